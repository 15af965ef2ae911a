//! The laws of a contact, and bounds that surfaces and pairs of beams share.

use crate::kernel::contact::{CarriedTraction, FrictionLaw, NodeBlocks, NormalLaw, PointState, Status};
use crate::system::{ContactMemory, ContactRegime, ContactStiffness};

/// The largest penetration of balanced states over the way of the nodes in contact.
const TOLERANCE_OF_WAY: f64 = 1e-4;

/// The gap up to which a point without a force counts as touching, over the largest penetration.
pub(super) const TOUCHING: f64 = 1e-4;

/// The gap of a point whose force may be round-off, over the largest penetration.
const BARELY_TOUCHING: f64 = 1e-8;

/// Forces below this part of the largest need no small gap.
pub(super) const RELEVANT_FORCE: f64 = 1e-6;

/// The way on which the spring of a point in a static stage reaches the limit of friction, over the
/// length of its element. The larger one of this way and the next holds.
const WAY_OVER_LENGTH: f64 = 0.005;

/// That way over the radius
const WAY_OVER_RADIUS: f64 = 0.01;

/// The largest stiffness of stick over normal stiffness with which a static stage begins.
const LARGEST_STICK: f64 = 10.0;

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
    /// The smallest bound of penetrations of a balanced state, a length: they are held against small motions, too. It is
    /// `penetration` where the deck gives that
    pub least_penetration: f64,
    /// c of the penalty, time per length
    pub damping: f64,
    /// The index of its amplitude, which is 0 in stages without it and otherwise 1
    pub amplitude: usize,
}

impl ContactLaws {
    /// The largest penetration in a balanced state in which no node that may touch something has moved by more than `way`:
    /// next to motions it is small.
    pub(super) fn tolerance(&self, way: f64) -> f64 {
        (TOLERANCE_OF_WAY * way).clamp(self.least_penetration, self.penetration)
    }

    /// The memory of friction at an accepted point of a contact whose first stiffness is `first`. A
    /// point that barely touches has none: the direction of its traction is that of round-off.
    pub(super) fn carried(&self, has_friction: bool, first: f64, state: &PointState) -> CarriedTraction {
        let PointState { normal, traction, .. } = *state;
        if has_friction && state.normal_force.force > BARELY_TOUCHING * self.penetration * first {
            CarriedTraction { force: traction.force, normal, slides: traction.status == Status::Slides }
        } else {
            CarriedTraction { normal, ..CarriedTraction::default() }
        }
    }

    /// Coulomb's law in a state, at a point of the contact `number` with this coefficient and stiffness.
    pub(super) fn friction(
        &self,
        number: usize,
        coefficient: f64,
        stiffness: &ContactStiffness,
        contacts: &ContactMemory,
    ) -> Option<FrictionLaw> {
        (coefficient > 0.0).then(|| FrictionLaw {
            coefficient,
            stiffness: self.stick_stiffness(number, stiffness, contacts),
            resistance: if contacts.resists { stiffness.augmented } else { 0.0 },
            goes_on: contacts.goes_on,
            holds_on: contacts.holds_on,
        })
    }

    /// The law of normal forces in a state, at a point with this multiplier in static stages and this
    /// offset in dynamic ones. Where the tangent resists, a point that had a force has the tangent of a
    /// contact even if it opens.
    pub(super) fn normal_law(
        &self,
        multiplier: f64,
        offset: f64,
        stiffness: &ContactStiffness,
        contacts: &ContactMemory,
    ) -> NormalLaw {
        match contacts.regime {
            ContactRegime::Augmented => NormalLaw::Augmented {
                multiplier,
                stiffness: stiffness.augmented * contacts.factor,
                touching: if contacts.resists && multiplier > 0.0 {
                    f64::INFINITY
                } else {
                    TOUCHING * self.penetration
                },
            },
            ContactRegime::Penalty => {
                NormalLaw::Penalty { stiffness: stiffness.penalty, damping: self.damping, offset }
            }
        }
    }

    /// K_t of the contact `number` in a state.
    pub(super) fn stick_stiffness(&self, number: usize, stiffness: &ContactStiffness, contacts: &ContactMemory) -> f64 {
        match contacts.regime {
            ContactRegime::Augmented => {
                let factor = contacts.full_stick_factor(number) * contacts.stick_part;
                self.stick.min(LARGEST_STICK) * stiffness.augmented * factor
            }
            ContactRegime::Penalty => self.stick * stiffness.penalty,
        }
    }

    /// The factor on the stiffness of stick with which the spring of a point reaches the limit mu p
    /// within the allowed way. `length`: of the element.
    pub(super) fn needed_stick_factor(
        &self,
        limit: f64,
        stiffness: &ContactStiffness,
        length: f64,
        radius: f64,
    ) -> f64 {
        let way = (WAY_OVER_LENGTH * length).max(WAY_OVER_RADIUS * radius);
        limit / (self.stick.min(LARGEST_STICK) * stiffness.augmented * way)
    }

    /// The coefficient of friction at a part of the length of a beam.
    pub(super) fn friction_at(&self, fraction: f64) -> f64 {
        let [start, end] = self.friction;
        start + (end - start) * fraction
    }

    /// The largest coefficient of friction along beams.
    pub(super) fn largest_friction(&self) -> f64 {
        self.friction[0].max(self.friction[1])
    }

    /// True if it has friction.
    pub fn rubs(&self) -> bool {
        self.friction != [0.0; 2]
    }

    /// The blocks of a node in a contact point.
    pub(super) fn blocks_of_node(&self) -> NodeBlocks {
        NodeBlocks::with(self.rubs())
    }
}
