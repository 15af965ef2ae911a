//! Columns: named pure functions of a converged state. Histories, `until` and expectations all read these.

mod place;
mod quantity;

pub use place::{BeamPoint, Place};
pub use quantity::{NODE_GROUPS, Probe, Quantity, WHOLE_GROUPS, suffixes};
