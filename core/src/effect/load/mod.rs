//! Loads: weight, and forces and moments along beams and at nodes.

mod gravity;
mod line;
mod node;

pub use gravity::{BeamGravity, BodyGravity};
pub use line::{LineLoad, LineLoadKind};
pub use node::{NodeForce, NodeLoad, NodeLoadKind};
