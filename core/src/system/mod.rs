//! What effects read and write: the state, the equations, the sparsity pattern, forces and tangent.

mod assembler;
mod assembly;
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
mod values;

pub use assembler::{Assembler, Part};
pub use assembly::{Category, Leftover, Matrix, System};
pub use dof_map::{Direction, DofMap, FrameConflict};
pub use field::Field;
pub use node_blocks::{Layout, NodeBlocks};
pub use pattern::{Connectivity, Entry, Meetings, Pattern, Symmetry, Tile, WIDTH, transposed};
pub use plane::{MirrorData, Plane, rounded};
pub use regions::{Region, most as most_regions};
pub use stage::{StageContext, StageKind, StageSet};
pub use state::{Anchor, Fading, Memory, Node, RotationRate, Slot, State};
pub use storage::{Own, Tiles, upper_entry, upper_start};
