//! Memory of contacts: what a run takes from one converged state to the next.

use crate::kernel::contact::{CarriedTraction, NodeBefore};
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The law of normal forces in a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub enum ContactRegime {
    /// Multipliers that augmentations bring to equilibrium: static stages
    #[default]
    Augmented,
    /// A penalty with damping: dynamic stages
    Penalty,
}

/// The contacts of a scene between two converged states.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct ContactMemory {
    /// The law of normal forces
    pub regime: ContactRegime,
    /// Factor on the first stiffness of contacts with which a load level begins
    pub(crate) first_factor: f64,
    /// Present factor on the first stiffness of contacts
    pub(crate) factor: f64,
    /// Factors on the stiffness of stick with which load levels end, by the numbers of contacts; 1 for
    /// those that are not there
    pub(crate) full_stick_factors: Vec<f64>,
    /// The energy by which penalties at the start of a dynamic stage exceed that of the static stage
    /// before, whose forces they hold
    pub(crate) taken_over: f64,
    /// The part of the stiffness of stick that acts at present in static stages
    pub(crate) stick_part: f64,
    /// True if the tangent has a stiffness against sliding and opening, which contacts have not
    pub(crate) resists: bool,
    /// True if points that slid go on sliding in the first tangent of a level
    pub(crate) goes_on: bool,
    /// True before the first correction of a level, in which points that stuck go on sticking
    pub(crate) holds_on: bool,
    /// Energy that friction and damping of contacts have taken since the start of the run
    pub(crate) dissipated: f64,
    /// Energy per time that the damping of contacts takes
    pub(crate) damping_power: f64,
    /// The largest penetration in the present dynamic stage, over the one that is allowed
    pub(crate) deepest: f64,
    /// The largest penetration of beams into beams between the points that carry forces, over the one that is
    /// allowed, in the present dynamic stage; zero where those points are hardly less deep
    pub(crate) deepest_between: f64,
    /// The number of steps of the shortest contact in the present dynamic stage, from the step with
    /// its first force to the last one; none if no contact has ended
    pub(crate) shortest: Option<u32>,
    /// True if nothing was near to anything at the last converged state, and nothing that is looked at rubs
    pub(crate) is_clear: bool,
    /// Contacts of each chain: a beam or a body against a surface
    pub(crate) chains: Arc<Vec<ChainMemory>>,
    /// Chains that cannot touch their surfaces before the next step ends: they are not looked at; empty where
    /// all are
    pub(crate) clearances: Arc<Vec<Option<Clearance>>>,
    /// Pairs of beam elements, and their contacts
    pub pairs: PairsMemory,
}

impl Default for ContactMemory {
    fn default() -> Self {
        Self {
            regime: ContactRegime::Augmented,
            first_factor: 1.0,
            factor: 1.0,
            full_stick_factors: Vec::new(),
            taken_over: 0.0,
            stick_part: 1.0,
            resists: false,
            goes_on: true,
            holds_on: false,
            dissipated: 0.0,
            damping_power: 0.0,
            deepest: 0.0,
            deepest_between: 0.0,
            shortest: None,
            is_clear: false,
            chains: Arc::default(),
            clearances: Arc::default(),
            pairs: PairsMemory::default(),
        }
    }
}

impl ContactMemory {
    /// The factor on the stiffness of stick with which load levels end, of a contact by its number.
    pub fn full_stick_factor(&self, contact: usize) -> f64 {
        self.full_stick_factors.get(contact).copied().unwrap_or(1.0)
    }

    /// How far a chain is from its surface, if it is not looked at.
    pub fn clearance(&self, chain: usize) -> Option<&Clearance> {
        self.clearances.get(chain)?.as_ref()
    }

    /// True if a chain has points in memory.
    pub fn has_points(&self, chain: usize) -> bool {
        self.chains.get(chain).is_some_and(|memory| !memory.points.is_empty())
    }

    /// True if some point has a force.
    pub fn touches(&self) -> bool {
        let has_force = |point: &PointMemory| point.force > 0.0;
        let of_pairs = self.pairs.points.iter().any(|point| has_force(&point.point));
        of_pairs || self.chains.iter().flat_map(|chain| &chain.points).any(has_force)
    }
}

/// A ball that holds a beam or a body, and its place beside a surface that it does not touch.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Clearance {
    /// The centre of the ball (axes of the surface)
    pub(crate) middle: Vec3,
    /// The radius of the ball, a length
    pub(crate) reach: f64,
    /// The distance of its centre from the surface, a length
    pub(crate) gap: f64,
}

impl Clearance {
    /// True if the ball does not meet the surface on the way to another place, which is longer than the straight one by
    /// `more`, a length, at most. The distance changes by no more than the centre moves, and the radius grows linearly.
    pub fn lasts_until(&self, end: &Self, more: f64) -> bool {
        let way = (end.middle - self.middle).norm() + more;
        let growth = end.reach - self.reach;
        // The part of the way that is free as seen from one of its ends.
        let free = |clear: f64, closing: f64| if closing > 0.0 { clear / closing } else { 1.0 };
        free(self.gap - self.reach, way + growth) + free(end.gap - end.reach, way - growth) > 1.0
    }
}

/// Contacts of a beam or a body against a surface.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct ChainMemory {
    /// The points, in the order of their places
    pub(crate) points: Vec<PointMemory>,
    /// The nodes as the surface saw them at the last converged state at which the chain was looked at; empty without
    /// friction, and before the first state
    pub(crate) nodes: Vec<NodeBefore>,
}

/// Stiffness of contacts of an element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct ContactStiffness {
    /// First stiffness of augmentations, force per length
    pub augmented: f64,
    /// Stiffness of the penalty in dynamic stages, force per length
    pub penalty: f64,
}

impl ContactStiffness {
    /// That with which a stage begins.
    pub fn first(&self, regime: ContactRegime) -> f64 {
        match regime {
            ContactRegime::Augmented => self.augmented,
            ContactRegime::Penalty => self.penalty,
        }
    }
}

/// A contact point with a force, or with the traction of the last converged state where an augmentation
/// has found it open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct PointMemory {
    /// Its place: the number of its element plus the part of that element before it
    pub(crate) place: f64,
    /// The number of the edge of a box or a mesh that it touches; otherwise it touches the whole
    /// surface
    pub(crate) edge: Option<u32>,
    /// The part of the force and of the traction that it carries: all of it in static stages, and the
    /// part of its share where points of a dynamic stage share them
    pub(crate) weight: f64,
    /// p, the normal force, without the weight
    pub(crate) force: f64,
    /// L of the next evaluation in static stages, with which the force of an accepted state is p
    pub(crate) multiplier: f64,
    /// Stiffness of the contact when the point was found: L and the offset were computed with it
    pub(crate) stiffness: ContactStiffness,
    /// g, the gap, a length
    pub(crate) gap: f64,
    /// Its friction at the last converged state, without the weight, in the axes of the surface; of beams in
    /// global axes
    pub(crate) carried: CarriedTraction,
    /// The gap at which the penalty begins, a length: a dynamic stage begins with the forces of the
    /// static one before
    pub(crate) offset: f64,
    /// The number of steps of a dynamic stage in contact
    pub(crate) steps: u32,
    /// The force on the beam or body, with the weight (global components)
    pub(crate) push: Vec3,
    /// The place where bodies touch (global components)
    pub(crate) at: Vec3,
}

impl PointMemory {
    /// True if it has a traction and did not slide.
    pub fn sticks(&self) -> bool {
        self.carried.force != Vec3::ZERO && !self.carried.slides
    }

    /// Gives the point another part of the force, which stays the same with it.
    pub fn reweigh(&mut self, weight: f64) {
        let factor = self.weight / weight;
        self.weight = weight;
        self.force *= factor;
        self.multiplier *= factor;
        self.carried.force = self.carried.force * factor;
    }

    /// The gap at which the penalty of a point begins that carries the part `weight` now, a length: one whose
    /// share grows pushes no more by its offset than before.
    pub fn offset_at(&self, weight: f64) -> f64 {
        self.offset * (self.weight / weight).min(1.0)
    }

    /// A point that is open now, with the traction of the last converged state; `None` if it had none.
    pub fn opened(&self) -> Option<Self> {
        (self.carried.force != Vec3::ZERO).then_some(Self { force: 0.0, multiplier: 0.0, push: Vec3::ZERO, ..*self })
    }
}

/// Pairs of beam elements near each other, and their contacts.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub struct PairsMemory {
    /// The pairs that are looked at, in their order
    pub list: Arc<Vec<ListedPair>>,
    /// Unit tangents of all beams at their nodes at the last converged state (global axes); empty
    /// where no pair is listed
    pub(crate) directions: Arc<Vec<Vec3>>,
    /// Places of the nodes of all beams at the last converged state; empty where no pair is listed
    pub(crate) accepted: Arc<Vec<Vec3>>,
    /// Places of the nodes of all beams when the list was made; empty before the first list
    pub(crate) places: Arc<Vec<Vec3>>,
    /// The gap up to which pairs are in the list, a length
    pub(crate) margin: f64,
    /// Points with a force, in the order of their meetings and places
    pub(crate) points: Arc<Vec<PairPointMemory>>,
    /// Places and rotations of the nodes of all beams at the last converged state (global axes);
    /// empty without friction, and before the first state
    pub nodes: Arc<Vec<NodeBefore>>,
}

/// Two beam elements near each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
pub struct ListedPair {
    /// Number of the meeting: two beams, or one that meets itself
    pub(crate) meeting: u32,
    /// Numbers of the elements, each in its beam
    pub(crate) elements: [u32; 2],
}

/// The kind of a contact point of two beams.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub enum PairPointKind {
    /// The closest points of both beams
    Closest,
    /// A node of the first beam and its closest point on the second
    NodeOfFirst,
    /// A node of the second beam and its closest point on the first
    NodeOfSecond,
}

/// A contact point of two beams with a force.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct PairPointMemory {
    /// Number of the meeting
    pub(crate) meeting: u32,
    /// Its kind
    pub(crate) kind: PairPointKind,
    /// Its place on the second beam: the number of its element plus the part of that element before
    /// it
    pub(crate) on_second: f64,
    /// Its place on the first beam, its force and its traction (global axes), and the push on the first beam
    pub(crate) point: PointMemory,
}
