//! The role of contacts beside their forces.

use crate::kernel::contact::{FrictionLaw, PointState, Status};
use crate::system::{Slot, State};
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};

/// Penetrations beyond this multiple of the allowed one are warned of: what rests penetrates by exactly one.
pub const TOLD_PENETRATION: f64 = 1.01;

/// The role of contacts, whose memory is [`State::contacts`].
pub trait Contacts {
    /// True if some contact has friction.
    fn rubs(&self) -> bool;

    /// The work of friction since the last accepted state, which the memory of a state still tells;
    /// negative where friction takes energy.
    fn friction_work(&self, at: &State) -> f64;

    /// The points with friction that may touch in a state.
    fn rubbing(&self, at: &State) -> Vec<RubbingPoint>;

    /// The factors on the stiffness of stick, by the numbers of contacts, with which the springs of all
    /// points reach the limit of friction within the allowed part of the element or the radius.
    fn needed_stick_factors(&self, at: &State) -> Vec<f64>;

    /// The largest displacement in a state of a node that may touch something.
    fn largest_displacement(&self, at: &State) -> f64;

    /// Penetrations and changes of a balanced state. Penetrations are held against what is allowed, and against a small
    /// part of the displacement `way` if that is less; infinite for the first alone.
    fn survey(&self, at: &State, way: f64) -> ContactSurvey;

    /// Takes the normal forces of a balanced state as multipliers.
    fn augment(&self, at: &mut State);

    /// Holds the points that touch as they are, with their forces, for small vibrations about the
    /// state.
    fn hold(&self, at: &mut State);

    /// Begins the multipliers of static, modal and buckling stages, after a dynamic one, with the forces of the
    /// penalty.
    fn begin_augmented(&self, at: &mut State);

    /// Begins the penalty of dynamic stages, after a static one, with the forces of the multipliers.
    fn begin_penalty(&self, at: &mut State);

    /// Writes the memory of a state in which a motion begins, where nothing is remembered of contacts yet: forces of
    /// what touches, without friction.
    fn begin_motion(&self, at: &mut State);

    /// Writes the memory of a state that is accepted after `before`.
    fn accept(&self, before: &State, at: &mut State);

    /// Changes of contacts since the accepted state `before`.
    fn change(&self, before: &State, at: &State) -> ContactChange;

    /// True if most of the friction of a contact in a balanced state is at points that were apart in the
    /// accepted state `before`: they moved on without a contact, which counts as sliding.
    fn touches_late(&self, before: &State, at: &State) -> bool;

    /// The deepest penetration of the contacts that act in a state, if it is larger than allowed.
    /// `begins` tells of which ones, by the number of the amplitude that switches them.
    fn penetrates(&self, at: &State, begins: &dyn Fn(usize) -> bool) -> Option<Penetration>;

    /// The deepest penetration among all points of beams in a state, those included that carry no
    /// force, if it is larger than allowed.
    fn hidden_penetration(&self, at: &State) -> Option<Penetration>;

    /// Lists the pairs of beam elements that are near each other, unless a state has such a list.
    fn list_pairs(&self, at: &mut State);

    /// Adds to what is looked at in `from` what may have met on the way to another state without being looked at:
    /// pairs of beam elements, beams and surfaces. If there is none, puts aside in `to` what is far from its surface:
    /// the next step does not look at it, and must ask this at its end.
    fn list_missed(&self, from: &mut State, to: &mut State) -> Missed;

    /// Looks again in `from` at what is put aside there and may meet its surface on the way to a state within a step, or
    /// at the end of a failed one; a slot of it, if there is some.
    fn look_for(&self, from: &mut State, to: &State) -> Option<Slot>;

    /// Looks again at all that is put aside in an accepted state.
    fn look_everywhere(&self, at: &mut State);

    /// The part of an increment of the unknowns, up to 1, on which the centre lines of beams stay
    /// apart.
    fn safe_part(&self, at: &State, increment: &[Vec3]) -> f64;

    /// Shows the surfaces with a prescribed motion of which a contact acts in a state: the name, the number of the amplitude, and whether
    /// it is an angle.
    fn driven_surfaces(&self, at: &State, show: &mut dyn FnMut(&str, usize, bool));

    /// A surface that a prescribed rotation has turned too far for contact since amplitudes were `from`:
    /// its name, and radians.
    fn turned(&self, from: &[f64], at: &State) -> Option<(&str, f64)>;

    /// A slot of a node that may have passed through a surface on the way from one state to another.
    fn passed(&self, from: &State, to: &State) -> Option<Slot>;

    /// The energy stored in an accepted state: of penalties and of elastic stick.
    fn energy(&self, at: &State) -> f64;

    /// The energy of the springs by which points stick in an accepted state.
    fn energy_of_holds(&self, at: &State) -> f64;

    /// The energy of the springs of friction in an accepted state, and what it is where all points slide.
    fn energy_of_friction(&self, at: &State) -> [f64; 2];

    /// The point that sticks by the longest way of its spring, over its radius, in an accepted state;
    /// `None` where nothing sticks.
    fn softest_stick(&self, at: &State) -> Option<ElasticStick>;

    /// The forces of a contact, by its number, in an accepted state.
    fn resultant(&self, number: usize, at: &State) -> ContactResultant;

    /// Normal force and friction per length, in an accepted state, on a beam at a part of its
    /// length.
    fn force_along(&self, beam: usize, fraction: f64, at: &State) -> [f64; 2];
}

/// The outcome of a look for contacts that a step did not look at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missed {
    /// None are missing: the step holds.
    None,
    /// Some were missing, and are looked at now: the step is to be taken again.
    Listed(Slot),
    /// More pairs of beam elements are missing than can be listed: the step is too long.
    TooMany(Slot),
}

/// A change of contacts in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactChange {
    /// Points keep contact, and none slides.
    #[default]
    None,
    /// A point has come into contact or left it: the path has a kink.
    Touches,
    /// A point slides: tangents have no symmetry.
    Slides,
}

/// The contacts of a balanced state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSurvey {
    /// The largest penetration, or gap with a force, over what is allowed
    pub(crate) violation: f64,
    /// That penetration or gap, a length
    pub(crate) gap: f64,
    /// A slot at that point
    pub(crate) slot: Slot,
    /// Number of points with a force
    pub(crate) points: usize,
    /// The work of all normal forces on the way of the largest penetrations that are allowed
    pub(crate) work_in_penetration: f64,
}

/// A penetration of a surface.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Penetration {
    /// Name of the contact
    pub(crate) contact: String,
    /// Name of the surface, or of the other beam
    pub(crate) surface: String,
    /// A slot of a node there
    pub(crate) slot: Slot,
    /// Its depth, a length
    pub(crate) depth: f64,
    /// The depth that is allowed
    pub(crate) allowed: f64,
}

/// A point with friction; vectors in the axes of what carries the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RubbingPoint {
    /// The beam or body and what it touches, and the place along the beam in elements
    pub(crate) place: (usize, f64),
    /// The friction on the element
    pub(crate) force: Vec3,
    /// The sliding since the last accepted state
    pub(crate) sliding: Vec3,
    /// True if its friction is at the limit
    pub(crate) slides: bool,
    /// K_t, the stiffness of stick, force per length
    pub(crate) stiffness: f64,
    /// mu p, the limit of friction
    pub(crate) limit: f64,
    /// The part of the force that the point carries
    pub(crate) weight: f64,
}

impl RubbingPoint {
    pub(crate) fn of(place: (usize, f64), law: &FrictionLaw, weight: f64, state: &PointState) -> Self {
        Self {
            place,
            force: state.traction.force,
            sliding: state.traction.sliding,
            slides: state.status() == Status::Slides,
            stiffness: law.stiffness,
            limit: law.limit(state.normal_force.force),
            weight,
        }
    }

    /// The way on which the spring of stick reaches the limit of friction.
    pub(crate) fn stick_way(&self) -> f64 {
        self.limit / self.stiffness
    }

    /// The point of another state that is nearest to this one, between the same bodies.
    pub(crate) fn nearest_of<'a>(&self, points: &'a [Self]) -> Option<&'a Self> {
        let distance = |point: &&Self| (point.place.1 - self.place.1).abs();
        let same = points.iter().filter(|point| point.place.0 == self.place.0);
        same.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

/// A point that sticks by a spring.
#[derive(Clone, Debug, PartialEq)]
pub struct ElasticStick {
    /// Name of the contact
    pub(crate) contact: String,
    /// The way that the spring has given, a length
    pub(crate) way: f64,
    /// The radius of the beam or body
    pub(crate) radius: f64,
}

impl ElasticStick {
    /// Puts a point in the place of the softest one so far, if it is softer.
    pub fn compare(softest: &mut Option<Self>, contact: &str, way: f64, radius: f64) {
        if softest.as_ref().is_none_or(|known| way / radius > known.way / known.radius) {
            *softest = Some(Self { contact: contact.into(), way, radius });
        }
    }
}

/// Forces and gaps of one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactResultant {
    /// The least gap, negative for a penetration; infinite where nothing has a distance
    pub(crate) gap: f64,
    /// The sum of normal forces
    pub(crate) normal: f64,
    /// The sum of the amounts of friction
    pub(crate) friction: f64,
    /// The force on beams and bodies (global components)
    pub(crate) force: Vec3,
    /// Its moment about the origin, or about the node that carries the surface
    pub(crate) moment: Vec3,
    /// The length of beams in contact
    pub(crate) length: f64,
    /// The number of points with a force
    pub(crate) points: usize,
    /// The number of points that slide
    pub(crate) sliding: usize,
}
