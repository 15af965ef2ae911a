//! Physical effects: one type for each kind of effect, in a file of its own, whose value holds all
//! instances in the scene.
//!
//! A model holds an effect only if the scene needs it. [`Effect`] is the interface of all effects;
//! [`Roles`] are interfaces of some: constraints, stresses, masses, coordinates driven from
//! outside, and free spins.

mod batch;
pub mod contact;
mod contact_role;
pub mod elasticity;
pub mod inertia;
pub mod joint;
pub mod load;
pub mod resistance;
pub mod sliding;
pub mod spin_hold;
pub mod spring;
mod volume;

pub use batch::{ByOrder, Connection};
pub use contact_role::{
    ContactChange, ContactResultant, ContactSurvey, Contacts, ElasticStick, Missed, Penetration, RubbingPoint,
    TOLD_PENETRATION,
};
pub use volume::{VolumeElement, VolumeElements};

use crate::kernel::Weights;
use crate::kernel::inertia::Inertia;
use crate::system::{
    Assembler, Category, Connectivity, ListedPair, Memory, MirrorData, Node, Plane, Slot, StageContext, State,
};
use crate::tensor::{Mat3, Vec3};
use batch::{
    ELEMENTS_PER_TASK, after_displacement, at_slots, for_each_batch, motion_of, motions, one_by_one, own_blocks,
    own_part, quadratic, shared, side_by_side,
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The stored energy of a state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Kinetic energy
    pub kinetic: f64,
    /// Strain energy of beams and springs
    pub strain: f64,
}

/// Mass and momenta of a state, in global components, about the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Momentum {
    /// Total mass
    pub mass: f64,
    /// First moment of mass: mass times the place of the mass centre
    pub moment: Vec3,
    /// Linear momentum
    pub(crate) linear: Vec3,
    /// Angular momentum about the origin
    pub(crate) angular: Vec3,
}

impl Momentum {
    /// Adds mass and momenta of another part.
    pub fn add(&mut self, other: Self) {
        self.mass += other.mass;
        self.moment += other.moment;
        self.linear += other.linear;
        self.angular += other.angular;
    }
}

/// The largest round-off of forces and moments that are zero in exact arithmetic.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RoundOff {
    /// Round-off of a force
    pub(crate) force: f64,
    /// Round-off of a moment
    pub(crate) moment: f64,
}

impl RoundOff {
    /// The larger round-off of both, for force and moment.
    pub fn or(self, other: Self) -> Self {
        Self { force: self.force.max(other.force), moment: self.moment.max(other.moment) }
    }
}

/// Increments of some unknowns, with their slots.
pub type SomeIncrements = [(Slot, Vec3)];

/// A motor of a joint in a state.
#[derive(Clone, Copy, Debug)]
pub struct MotorState {
    /// The slot of its multiplier
    pub(crate) slot: Slot,
    /// The angle in radians, or displacement, at an amplitude of one
    pub(crate) value: f64,
    /// The index of its amplitude
    pub(crate) amplitude: usize,
    /// True for a motor on an angle, false for one on a slide
    pub(crate) turns: bool,
    /// The rate of angle or slide by the motion of its nodes
    pub(crate) speed: f64,
}

/// The form of a tangent for all weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TangentForm {
    /// No tangent: forces do not depend on the state
    None,
    /// A symmetric tangent: that of a potential, or constant symmetric matrices
    Symmetric,
    /// A tangent without symmetry
    General,
}

impl TangentForm {
    /// True if there is a tangent.
    pub fn exists(self) -> bool {
        self != Self::None
    }

    /// A symmetric tangent, or one without symmetry.
    pub fn symmetric(is_symmetric: bool) -> Self {
        if is_symmetric { Self::Symmetric } else { Self::General }
    }
}

/// A kind of physical effect with all its instances.
///
/// Methods without a default have no value that is safe for all effects.
pub trait Effect: Send + Sync {
    /// The name of the effect in `check` and run.json.
    fn name(&self) -> &'static str;

    /// The category of its forces.
    fn category(&self) -> Category;

    /// True if it adds damping forces beside the forces of its category.
    fn damps(&self) -> bool {
        false
    }

    /// The slots of each instance; [divisible](Connectivity::divisible) if instances may be
    /// assembled in parallel.
    fn connectivity(&self) -> Connectivity;

    /// The slots of each instance where pairs of beam elements are near each other.
    fn connectivity_with(&self, _pairs: &[ListedPair]) -> Connectivity {
        self.connectivity()
    }

    /// The form of its tangent. A general one makes the whole tangent unsymmetric, with twice the
    /// cost of factorisation.
    fn tangent(&self) -> TangentForm;

    /// True if it acts in a stage. Inertia and damping act in stages with motions, inertia not in a
    /// rotating frame, which replaces it.
    fn acts(&self, stage: &StageContext) -> bool {
        let moves = stage.kind.needs_inertia();
        match self.category() {
            Category::Inertia => moves && !stage.rotating,
            Category::Damping => moves,
            Category::Internal | Category::External => true,
        }
    }

    /// Shows data that a reflection in the plane of a planar scene must leave unchanged.
    /// [`MirrorData::Spatial`] makes the scene a spatial one.
    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData));

    /// The planar form of the effect, which lies in `plane`; `None` if it has none.
    fn in_plane(self: Arc<Self>, _plane: &Plane) -> Option<Box<dyn PlanarForm>> {
        None
    }

    /// Adds forces, and the tangent of the weights; a weight of zero asks for no computation.
    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Assembler);

    /// The stored energy of a state.
    fn energy(&self, _at: &State) -> Energy {
        Energy::default()
    }

    /// The largest strain of a field of small increments of the unknowns, without unit: curvatures
    /// are multiplied by `length`, displacements of springs divided by it. It is of the size of the
    /// field if the effect resists it, and zero if it does not. Strains distinguish soft structures
    /// from mechanisms where round-off hides a stiffness in the tangent.
    fn strain_of(&self, at: &State, field: &[Vec3], length: f64) -> f64;

    /// The roles of the effect beside its forces.
    fn roles(&self) -> Roles<'_>;
}

/// The roles of an effect beside its forces; `None` for those that it does not have.
#[derive(Clone, Copy, Default)]
pub struct Roles<'a> {
    /// Gaps that multipliers close
    pub(crate) constraint: Option<&'a dyn Constraint>,
    /// Stresses at integration points
    pub(crate) stresses: Option<&'a dyn StressPoints>,
    /// Mass
    pub(crate) masses: Option<&'a dyn Masses>,
    /// Coordinates driven from outside
    pub(crate) driven: Option<&'a dyn DrivenCoordinates>,
    /// Spins without resistance
    pub(crate) spins: Option<&'a dyn FreeSpins>,
    /// Contacts, with a memory from one converged state to the next
    pub(crate) contacts: Option<&'a dyn Contacts>,
    /// Forces that jump
    pub(crate) force_jumps: Option<&'a dyn ForceJumps>,
}

impl Roles<'_> {
    /// No role beside forces.
    pub const NONE: Self = Self {
        constraint: None,
        stresses: None,
        masses: None,
        driven: None,
        spins: None,
        contacts: None,
        force_jumps: None,
    };
}

/// What jumps in a force along a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
pub enum ForceJump {
    /// Its slope: the error of a time step over which it does is of second order
    Slope,
    /// The force itself: the error is of first order
    Force,
}

/// The role of effects whose forces jump, or change their slope at once, where the motion passes
/// some place.
pub trait ForceJumps {
    /// True if something acts in a state whose force may jump.
    fn acts(&self, at: &State) -> bool;

    /// What has jumped within a time step of some length.
    fn jumped(&self, from: &State, to: &State, length: f64) -> Option<ForceJump>;

    /// Shows by slot what a mean of the forces at some instants of a time step of some length misses
    /// where a force has jumped: the mean force over the step less that mean (internal, spatial).
    /// `instants` are the states there, equally far from each other, with their weights.
    fn missed(&self, instants: &[(f64, &State)], length: f64, show: &mut dyn FnMut(Slot, Vec3));
}

/// The role of constraints: gaps that multipliers close, and motors that prescribe them.
pub trait Constraint {
    /// Writes first and second derivatives over time of the gaps, by slot of the multipliers, with
    /// the velocities and accelerations of the state. A dynamic stage begins with velocities and
    /// accelerations that keep the gaps closed.
    fn drift(&self, at: &State, rates: &mut [Vec3], rates2: &mut [Vec3]);

    /// Updates the angles in the memory of a converged state.
    fn remember(&self, at: &mut State);

    /// Shows the motors in a state.
    fn motors(&self, at: &State, show: &mut dyn FnMut(MotorState));

    /// The largest rotation of a node by a motor when amplitudes change from `from` to `to`: its
    /// slot, and radians.
    fn turned(&self, from: &[f64], to: &[f64]) -> Option<(Slot, f64)>;

    /// The forces on a node of joints to ground with multipliers, in the sign of internal forces:
    /// force (spatial), and moment conjugate to the rotation vector.
    fn held_by_ground(&self, at: &State, node: Node) -> (Vec3, Vec3);

    /// Sets the rates of its own coordinates, which sliding joints alone have, to those of its nodes: the look at a deck
    /// compares them with those of drives.
    fn follow_nodes(&self, _at: &mut State) {}

    /// The displacement of a node that has slid beyond the end of the beam it slides on.
    fn left(&self, _at: &State) -> Option<Slot> {
        None
    }
}

/// The role of effects with stresses at integration points.
pub trait StressPoints {
    /// The number of points with extrapolated stresses in the memory of the effect.
    fn memory_points(&self) -> usize;

    /// Writes the stresses of the next tangent to the memory, extrapolated over the correction `dq`
    /// from the state before it (mixed-integration-point method). Rates of `at` may be those after
    /// the correction.
    fn extrapolate(&self, at: &State, dq: &[Vec3], memory: &mut Memory);

    /// The quadratic form x.K x of a field of increments, from its strains: no digits are lost
    /// between nodes with nearly equal increments. `None` if it needs the tangent, as under stress.
    fn stiffness_along(&self, at: &State, field: &[Vec3]) -> Option<f64>;

    /// The largest round-off of forces and moments in a state.
    fn round_off(&self, at: &State) -> RoundOff;

    /// Shows the bending at all points, element by element. `origin` is the state about which the
    /// stage is linear; `None` in other stages.
    fn each_bending(&self, at: &State, origin: Option<&State>, show: &mut dyn FnMut(Bending));
}

/// The bending of a beam at an integration point.
#[derive(Clone, Copy, Debug)]
pub struct Bending {
    /// Its element in the scene
    pub(crate) element: u32,
    /// The nodes at the ends of the element
    pub(crate) ends: [Node; 2],
    /// The length that the point stands for
    pub(crate) length: f64,
    /// The moment (material)
    pub(crate) moment: Vec3,
    /// The unit tangent of the initial centre line
    pub(crate) tangent: Vec3,
    /// The stiffness against bending and twist, force times length squared
    pub(crate) stiffness: Mat3,
    /// The axial force
    pub(crate) tension: f64,
}

/// The role of effects with mass.
pub trait Masses {
    /// Mass and momenta of a state.
    fn momentum(&self, at: &State) -> Momentum;

    /// Shows mass properties at nodes, whose angular momentum increments of rotation carry.
    fn bodies(&self, _show: &mut dyn FnMut(Node, &Inertia)) {}
}

/// The role of effects with coordinates driven from outside: motors, free strains.
pub trait DrivenCoordinates {
    /// Shows each driven coordinate with the derivative of the stored energy over it, for the
    /// energy balance. `origin` is the state about which the stage is linear; `None` in other
    /// stages.
    fn drives(&self, at: &State, origin: Option<&State>, show: &mut dyn FnMut(f64, f64));

    /// True where a jump of a coordinate does its work at once, whatever moves later: free strains.
    fn act_at_once(&self) -> bool;
}

/// A coordinate that is driven from outside, at one state.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
pub struct Drive {
    /// Its value
    pub value: f64,
    /// The derivative of the stored energy over it
    pub force: f64,
    /// See [`DrivenCoordinates::act_at_once`]
    pub acts_at_once: bool,
}

/// The role of effects with spins that no force resists.
pub trait FreeSpins {
    /// Shows free motions, each by increments of some unknowns.
    fn free_motions(&self, at: &State, show: &mut dyn FnMut(&SomeIncrements));

    /// Removes free spins, which are round-off, from the rates before a step is predicted.
    fn steady(&self, at: &mut State);
}

/// The planar form of an effect: it takes the place of the effect in the assembly of a planar
/// scene.
pub trait PlanarForm: Send + Sync {
    /// True if its tangent is symmetric for all weights.
    fn is_symmetric(&self) -> bool;

    /// Adds forces and tangent, see [`Effect::add`].
    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Assembler);

    /// Extrapolates stresses, see [`StressPoints::extrapolate`].
    fn extrapolate(&self, _at: &State, _dq: &[Vec3], _memory: &mut Memory) {}
}
