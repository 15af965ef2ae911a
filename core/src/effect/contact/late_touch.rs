//! Points that have come into contact in a level: what they moved before they touched counts as
//! sliding.

use crate::kernel::contact::{FrictionLaw, PointState};

/// The part of the friction of a contact that its new points have, beyond which they decide it.
const DECISIVE: f64 = 0.5;

/// The part of its limit up to which friction at a new point does not count.
const NEGLIGIBLE: f64 = 0.05;

/// Sums of the amounts of friction at the points of a contact.
#[derive(Clone, Copy, Default)]
struct Friction {
    /// At points that were apart when the level began
    of_new: f64,
    /// At all points
    of_all: f64,
}

/// Friction at a point.
pub(super) struct PointFriction {
    force: f64,
    /// The largest that it can be
    limit: f64,
}

impl PointFriction {
    /// That of a point with a part `weight` of the force.
    pub fn of(law: Option<&FrictionLaw>, state: &PointState, weight: f64) -> Self {
        let limit = law.map_or(0.0, |law| law.limit(state.normal_force.force));
        Self { force: weight * state.traction.force.norm(), limit: weight * limit }
    }
}

/// The friction of all contacts at the end of a level.
pub(super) struct LateTouch {
    of_contacts: Vec<Friction>,
}

impl LateTouch {
    /// Of so many contacts.
    pub fn new(contacts: usize) -> Self {
        Self { of_contacts: vec![Friction::default(); contacts] }
    }

    /// Adds a point of a contact; `was_apart`: when the level began.
    pub fn add(&mut self, contact: usize, point: PointFriction, was_apart: impl FnOnce() -> bool) {
        let sums = &mut self.of_contacts[contact];
        sums.of_all += point.force;
        if point.force > NEGLIGIBLE * point.limit && was_apart() {
            sums.of_new += point.force;
        }
    }

    /// True if new points have most of the friction of some contact.
    pub fn is_decisive(&self) -> bool {
        self.of_contacts.iter().any(|sums| sums.of_new > DECISIVE * sums.of_all)
    }
}
