//! What effects read and write: the state, the equations, the sparsity pattern, forces and tangent.

mod assembly;
mod equations;
mod field;
mod groups;
mod pattern;
mod plane;
mod regions;
mod runs;
mod sink;
mod stage;
mod state;
mod storage;
mod values;

pub use assembly::{Category, Leftover, Matrix, System};
pub use equations::{Direction, Equations, FrameConflict};
pub use field::Field;
pub use groups::{Groups, Layout};
pub use pattern::{Cliques, Entry, Meetings, Pattern, Symmetry, Tile, WIDTH, transposed};
pub use plane::{Aspect, Plane, rounded};
pub use regions::{Region, most as most_regions};
pub use sink::{Part, Sink};
pub use stage::{StageContext, StageKind, StageSet};
pub use state::{Anchor, Fading, Memory, Node, RotationRate, Slot, State};
pub use storage::{Own, Tiles, upper_entry, upper_start};
