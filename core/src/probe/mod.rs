//! Columns: named pure functions of a converged state. Histories, `until` and expectations all read
//! these.

mod beam_point;
mod columns;
mod envelope;
mod figure;
mod largest_row;
mod place;
mod profile;
mod quantity;
mod reading;

pub use beam_point::{BeamElements, BeamPoint, BeamSide, StressPlace, StressPoint};
pub use columns::{
    COLUMNS, ColumnGroup, ColumnPart, ENERGY_WITH_CONTACTS, Nearest, Need, STRESS_AT_POINT, STRESS_WITH_INDEX, Source,
    clocks, find_column, find_part, group, quantity,
};
pub use envelope::{Envelope, Extremes, Followed};
pub use figure::{Figure, Line, LinePoint, Look};
pub use largest_row::{Extreme, LargestRow};
pub use place::Place;
pub use profile::{Profile, ProfilePlace, StageEnd};
pub use quantity::{Dimension, MeshError, Quantity};
pub use reading::{Probe, Reading};
