//! Columns: named pure functions of a converged state. Histories, `until` and expectations all read these.

mod figure;
mod place;
mod quantity;

pub use figure::{Figure, Line, LinePoint, Look};
pub use place::{BeamPoint, Place};
pub use quantity::{NODE_GROUPS, Probe, Quantity, WHOLE_GROUPS, suffixes};
