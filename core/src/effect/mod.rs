//! Physical effects: one file an effect, one value a kind, holding every instance of that kind in
//! the scene.
//!
//! An effect exists in a run only because the deck calls for it; see `scene::compose`. [`Effect`]
//! is what each of them does. What only some do are [`Roles`]: constraints, stresses, masses,
//! coordinates driven from outside, spins that nothing resists.

mod batch;
pub mod elasticity;
pub mod inertia;
pub mod joint;
pub mod load;
pub mod resistance;
pub mod spin_hold;
pub mod spring;
mod volume;

pub use batch::{ByOrder, Connection};
pub use volume::{VolumeElement, VolumeElements};

use crate::kernel::Weights;
use crate::kernel::inertia::Inertia;
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Node, Plane, Slot, StageContext, State};
use crate::tensor::Vec3;
use batch::{
    AT_ONCE, after_displacement, at_slots, for_each_batch, motion_of, motions, one_by_one, own_blocks, own_part,
    quadratic, shared, side_by_side,
};
use std::sync::Arc;

/// Stored energy of one state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Of motion
    pub kinetic: f64,
    /// Of beams and springs
    pub strain: f64,
}

/// Mass and momenta of one state, global components, about the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Momentum {
    /// Total mass
    pub mass: f64,
    /// First moment of mass: mass times the place of the centre
    pub moment: Vec3,
    /// Linear momentum
    pub linear: Vec3,
    /// Angular momentum about the origin
    pub angular: Vec3,
}

impl Momentum {
    /// Adds another part.
    pub fn add(&mut self, other: Self) {
        self.mass += other.mass;
        self.moment += other.moment;
        self.linear += other.linear;
        self.angular += other.angular;
    }
}

/// Round-off that an exact zero of the force may show, in force and moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RoundOff {
    /// Force
    pub force: f64,
    /// Moment
    pub moment: f64,
}

impl RoundOff {
    /// The larger of both.
    pub fn or(self, other: Self) -> Self {
        Self { force: self.force.max(other.force), moment: self.moment.max(other.moment) }
    }
}

/// Increments of some unknowns, each with its slot.
pub type SomeIncrements = [(Slot, Vec3)];

/// A motor of a joint in some state.
#[derive(Clone, Copy, Debug)]
pub struct MotorState {
    /// The slot of its multiplier
    pub slot: Slot,
    /// The angle or displacement that its amplitude multiplies
    pub value: f64,
    /// The number of its amplitude
    pub amplitude: usize,
    /// It turns; else it slides
    pub turns: bool,
    /// How fast the joint turns or slides, as its nodes move
    pub speed: f64,
}

/// The form of a tangent, whatever the weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TangentForm {
    /// Forces do not depend on the state
    None,
    /// A potential, or constant symmetric matrices
    Symmetric,
    /// Any other
    General,
}

impl TangentForm {
    /// There is one.
    pub fn exists(self) -> bool {
        self != Self::None
    }

    /// A tangent that is symmetric, or not.
    pub fn symmetric(is_symmetric: bool) -> Self {
        if is_symmetric { Self::Symmetric } else { Self::General }
    }
}

/// One kind of physical effect with all its instances.
///
/// A method without a default is one that each effect must think about.
pub trait Effect: Send + Sync {
    /// Its name in `check` and run.json.
    fn name(&self) -> &'static str;

    /// The category of its forces.
    fn category(&self) -> Category;

    /// It adds damping forces beside those of its category.
    fn damps(&self) -> bool {
        false
    }

    /// The slots that meet in each instance; [divisible](Connectivity::divisible) where many
    /// instances make it worth while.
    fn connectivity(&self) -> Connectivity;

    /// The form of its tangent: a general one makes the whole tangent unsymmetric, and costs twice
    /// the factorisation.
    fn tangent(&self) -> TangentForm;

    /// It acts in a stage: inertia and damping do where something moves, inertia not where a
    /// rotating frame holds it.
    fn acts(&self, stage: &StageContext) -> bool {
        let moves = stage.kind.needs_inertia();
        match self.category() {
            Category::Inertia => moves && !stage.rotating,
            Category::Damping => moves,
            Category::Internal | Category::External => true,
        }
    }

    /// Shows the data of which a mirror decides whether the scene lies in a plane.
    /// [`MirrorData::Spatial`]: the scene is never treated in one.
    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData));

    /// A kernel of its own for a plane that it lies in, where that is less work than the one in
    /// space.
    fn in_plane(self: Arc<Self>, _plane: &Plane) -> Option<Box<dyn PlanarForm>> {
        None
    }

    /// Adds forces, and the tangent of the weights that are not zero.
    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Assembler);

    /// Stored energy.
    fn energy(&self, _at: &State) -> Energy {
        Energy::default()
    }

    /// The largest strain that a field of small increments of the unknowns makes, curvatures and
    /// springs' displacements measured by `length`: a number without units, of the size of the
    /// field itself where the effect stands in its way, zero where not. Strains tell soft from
    /// loose where the tangent has lost a stiffness to round-off.
    fn strain_of(&self, at: &State, field: &[Vec3], length: f64) -> f64;

    /// The roles that it has beside adding forces.
    fn roles(&self) -> Roles<'_>;
}

/// The roles of an effect.
#[derive(Clone, Copy, Default)]
pub struct Roles<'a> {
    /// It keeps gaps closed by multipliers.
    pub constraint: Option<&'a dyn Constraint>,
    /// It has stresses at integration points.
    pub stresses: Option<&'a dyn StressPoints>,
    /// It has mass.
    pub masses: Option<&'a dyn Masses>,
    /// Something in it is driven from outside.
    pub driven: Option<&'a dyn Driven>,
    /// Spins in it may be free.
    pub spins: Option<&'a dyn FreeSpins>,
}

impl Roles<'_> {
    /// Nothing but forces.
    pub const NONE: Self = Self { constraint: None, stresses: None, masses: None, driven: None, spins: None };
}

/// Constraints: gaps that multipliers keep closed, and the motors that open them as prescribed.
pub trait Constraint {
    /// First and second derivatives over time of the gaps, for a motion without accelerations; by
    /// slot of the multipliers. A dynamic stage begins with velocities and accelerations that keep
    /// the gaps closed.
    fn drift(&self, at: &State, rates: &mut [Vec3], rates2: &mut [Vec3]);

    /// After each converged state: continues angles that the state remembers.
    fn remember(&self, at: &mut State);

    /// Shows its motors.
    fn motors(&self, at: &State, show: &mut dyn FnMut(MotorState));

    /// How far motors turn their nodes at once when amplitudes change: the slot that turns most,
    /// and radians.
    fn turned(&self, from: &[f64], to: &[f64]) -> Option<(Slot, f64)>;

    /// The forces on a node of joints to ground that multipliers hold, in this sign of forces:
    /// force, and moment conjugate to its rotation vector.
    fn held_by_ground(&self, at: &State, node: Node) -> (Vec3, Vec3);
}

/// Stresses at integration points.
pub trait StressPoints {
    /// The number of points whose stresses the robust tangent remembers.
    fn memory_points(&self) -> usize;

    /// Remembers the stresses of the next tangent, extrapolated from unknowns and charts before
    /// they were corrected by `dq`. Rates of `at` may be those after it.
    fn extrapolate(&self, at: &State, dq: &[Vec3], memory: &mut Memory);

    /// x.K x of a field of increments, from the strains that it makes: no digits are lost between
    /// nodes that move alike. `None` where the tangent alone tells, as under stress.
    fn stiffness_along(&self, at: &State, field: &[Vec3]) -> Option<f64>;

    /// The round-off of its forces.
    fn round_off(&self, at: &State) -> RoundOff;
}

/// Mass.
pub trait Masses {
    /// Mass and momenta.
    fn momentum(&self, at: &State) -> Momentum;

    /// Shows mass properties that sit at nodes: increments of rotation carry their momentum.
    fn bodies(&self, _show: &mut dyn FnMut(Node, &Inertia)) {}
}

/// Coordinates that are driven from outside: motors, free strains.
pub trait Driven {
    /// Shows each coordinate with the derivative of the stored energy over it, for the energy
    /// account.
    fn drives(&self, at: &State, show: &mut dyn FnMut(f64, f64));
}

/// Spins that nothing resists.
pub trait FreeSpins {
    /// Shows motions against which nothing acts, each by the increments of some unknowns.
    fn free_motions(&self, at: &State, show: &mut dyn FnMut(&SomeIncrements));

    /// Before a step is predicted from the velocities: takes the round-off of free spins out of
    /// them.
    fn steady(&self, at: &mut State);
}

/// An effect's kernel of its own for a plane: what it adds to the system there. All else the effect
/// itself tells.
pub trait PlanarForm: Send + Sync {
    /// Its tangent is symmetric, whatever the weights.
    fn is_symmetric(&self) -> bool;

    /// As [`Effect::add`].
    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Assembler);

    /// As [`StressPoints::extrapolate`].
    fn extrapolate(&self, _at: &State, _dq: &[Vec3], _memory: &mut Memory) {}
}
