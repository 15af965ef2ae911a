//! Data that effects read and write: the state, the degrees of freedom, the sparsity pattern, nodal
//! forces and the tangent.

mod assembler;
mod assembly;
mod category;
mod connectivity;
mod contact;
mod dof_map;
mod field;
mod node_blocks;
mod pattern;
mod plane;
mod range_list;
mod regions;
mod stage;
mod state;
mod storage;
mod tile;
mod values;

pub use assembler::{Assembler, SystemSlice};
pub use assembly::{Matrix, ResidualBuffer, System};
pub use category::Category;
pub use connectivity::Connectivity;
pub use contact::{
    ChainMemory, Clearance, ContactMemory, ContactRegime, ContactStiffness, ListedPair, PairPointKind, PairPointMemory,
    PairsMemory, PointMemory,
};
pub use dof_map::{Direction, DofMap, FrameConflict};
pub use field::Field;
pub use node_blocks::{Layout, NodeBlocks};
pub(crate) use pattern::IdleRow;
pub use pattern::{Adjacency, Pattern, Symmetry, TangentEntry, WIDTH};
pub use plane::{MirrorData, Plane, rounded};
pub use regions::{Region, most as most_regions};
pub use stage::{StageContext, StageKind, StageSet};
pub use state::{Anchor, Fading, Memory, Node, RotationRate, Slot, State};
pub use storage::{DiagonalTiles, Tiles, upper_entry, upper_start};
pub use tile::{Tile, transposed};
