//! Columns: named pure functions of a converged state. Histories, `until` and expectations all read
//! these.

mod columns;
mod figure;
mod place;
mod reading;

pub use columns::{
    COLUMNS, ColumnGroup, ColumnPart, Dimension, ENERGY_WITH_CONTACTS, MeshError, Nearest, Need, Quantity, Source,
    clocks, find_column, find_part, group, quantity,
};
pub use figure::{Figure, Line, LinePoint, Look};
pub use place::{BeamPoint, Place};
pub use reading::{Probe, Reading};
