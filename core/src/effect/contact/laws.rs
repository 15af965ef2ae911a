//! The laws of a contact, and bounds that surfaces and pairs of beams share.

use crate::kernel::contact::{CarriedTraction, FrictionLaw, PointState};

/// The gap up to which a point without a force counts as touching, over the largest penetration.
pub(super) const TOUCHING: f64 = 1e-4;

/// The gap of a point whose force may be round-off, over the largest penetration.
const BARELY_TOUCHING: f64 = 1e-8;

/// Penetrations that are told exceed the allowed one by this factor.
pub(super) const ROUNDED: f64 = 1.01;

/// Forces below this part of the largest need no small gap.
pub(super) const RELEVANT_FORCE: f64 = 1e-6;

/// The laws of a contact.
#[derive(Clone, Debug)]
pub struct ContactLaws {
    /// Its name
    pub name: String,
    /// Coefficients of friction at the start and at the end of beams
    pub friction: [f64; 2],
    /// Tangential over normal stiffness
    pub stick: f64,
    /// The largest penetration, a length
    pub penetration: f64,
    /// c of the penalty, time per length
    pub damping: f64,
    /// The index of its amplitude, which is 0 in stages without it and otherwise 1
    pub amplitude: usize,
}

impl ContactLaws {
    /// The memory of friction at an accepted point. A point that barely touches has none: the
    /// direction of its traction is that of round-off. The bound follows the first stiffness, not
    /// that of the last augmentation, which a heavier contact may have raised.
    pub(super) fn carried(
        &self,
        friction: Option<&FrictionLaw>,
        carried: &CarriedTraction,
        state: &PointState,
    ) -> CarriedTraction {
        let force = state.normal_force.force;
        match friction {
            Some(law) if force > BARELY_TOUCHING * self.penetration * law.stiffness / self.stick => {
                law.to_carry(carried, &state.traction, state.normal, force)
            }
            Some(_) | None => CarriedTraction { normal: state.normal, ..CarriedTraction::default() },
        }
    }

    /// The coefficient of friction at a part of the length of a beam.
    pub(super) fn friction_at(&self, fraction: f64) -> f64 {
        let [start, end] = self.friction;
        start + (end - start) * fraction
    }

    /// True if it has friction.
    pub fn rubs(&self) -> bool {
        self.friction != [0.0; 2]
    }
}
