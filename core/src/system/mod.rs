//! Data that effects read and write: the state, the degrees of freedom, the sparsity pattern, nodal
//! forces and the tangent.

mod assembler;
mod assembly;
mod category;
mod connectivity;
mod dof_map;
mod field;
mod node_blocks;
mod pattern;
mod plane;
mod regions;
mod runs;
mod stage;
mod state;
mod storage;
mod tile;
mod values;

pub use assembler::{Assembler, Part};
pub use assembly::{Leftover, Matrix, System};
pub use category::Category;
pub use connectivity::Connectivity;
pub use dof_map::{Direction, DofMap, FrameConflict};
pub use field::Field;
pub use node_blocks::{Layout, NodeBlocks};
pub use pattern::{Entry, Meetings, Pattern, Symmetry, WIDTH};
pub use plane::{MirrorData, Plane, rounded};
pub use regions::{Region, most as most_regions};
pub use stage::{StageContext, StageKind, StageSet};
pub use state::{Anchor, Fading, Memory, Node, RotationRate, Slot, State};
pub use storage::{Own, Tiles, upper_entry, upper_start};
pub use tile::{Tile, transposed};
