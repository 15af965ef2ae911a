//! How far states lie apart.

use crate::model::{Model, SlotKind};
use crate::rotation::{Rotation, relative_angle};
use crate::system::State;
use crate::threads;

/// The largest motion that is round-off: over the length of the scene, and in radians.
pub(super) const NO_MOTION: f64 = 1e-9;

/// The largest difference of two states: displacements over the length of the scene, rotations in
/// radians, whatever their charts.
pub(super) fn distance(model: &Model, a: &State, b: &State) -> f64 {
    let one = |slot: usize| match model.kinds[slot] {
        SlotKind::Displacement => (b.q[slot] - a.q[slot]).norm() / model.length,
        SlotKind::Rotation => relative_angle(Rotation::new(a.q[slot]).r, Rotation::new(b.q[slot]).r),
        SlotKind::Force | SlotKind::Moment | SlotKind::Sliding => 0.0,
    };
    threads::largest(model.kinds.len(), |part| part.map(one).fold(0.0, f64::max))
}
