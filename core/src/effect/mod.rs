//! Physical effects: one file an effect, one value a kind, holding every instance of that kind in the scene.
//!
//! An effect exists in a run only because the deck calls for it; see `scene::compose`.

pub mod beam_elasticity;
pub mod beam_mass;
pub mod elastic_element;
pub mod fading_inertia;
pub mod gravity;
pub mod interpolation;
pub mod joint;
pub mod line_load;
pub mod link;
pub mod mass_damping;
pub mod node_load;
pub mod planar_elasticity;
pub mod planar_inertia;
pub mod resistance;
pub mod rigid_body;
pub mod rotary_inertia;
pub mod rotating_frame;
pub mod section_inertia;
pub mod spin_hold;
pub mod spring;
pub mod strain_rate_damping;
mod volume;

pub use volume::{VolumeElement, VolumeElements};

use crate::kernel::inertia::Inertia;
use crate::kernel::seam::Converted;
use crate::kernel::{ElementSystem, NodeMotion, Weights};
use crate::scalar::{LANES, Lanes, Pack, Real, each_lane};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Node, Plane, Slot, StageContext, State};
use crate::tensor::{Mat3, Vec3};
use std::ops::Range;
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
    /// Whether it turns, or slides
    pub turns: bool,
    /// How fast the joint turns or slides, as its nodes move
    pub speed: f64,
}

/// One kind of physical effect with all its instances.
pub trait Effect: Send + Sync {
    /// Its name in `check` and run.json.
    fn name(&self) -> &'static str;

    /// What its forces are.
    fn category(&self) -> Category;

    /// Whether it adds forces that damp beside those of its category.
    fn damps(&self) -> bool {
        false
    }

    /// The slots that meet in each instance; [divisible](Connectivity::divisible) where many instances make it worth while.
    fn connectivity(&self) -> Connectivity;

    /// Whether its forces depend on the state at all; forces that do not have no tangent.
    fn has_tangent(&self) -> bool {
        true
    }

    /// Whether its tangent is symmetric, whatever the weights.
    fn is_symmetric(&self) -> bool {
        !self.has_tangent()
    }

    /// Whether it acts in a stage: inertia and damping do where something moves, inertia not where a rotating frame holds it.
    fn acts(&self, stage: &StageContext) -> bool {
        let moves = stage.kind.needs_inertia();
        match self.category() {
            Category::Inertia => moves && !stage.rotating,
            Category::Damping => moves,
            Category::Internal | Category::External => true,
        }
    }

    /// Shows what of it decides whether the scene lies in a plane. Unless it does, the scene is never treated in one.
    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        show(MirrorData::Spatial);
    }

    /// What does its work in a plane that it lies in, where that is less than in space.
    fn in_plane(self: Arc<Self>, _plane: &Plane) -> Option<Box<dyn PlanarForm>> {
        None
    }

    /// Points it needs memory for.
    fn memory_points(&self) -> usize {
        0
    }

    /// Adds forces, and the tangent of the weights that are not zero.
    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Assembler);

    /// Remembers what the next tangent is formed with: what unknowns and charts were before they were corrected by `dq`. Rates of `at` may be
    /// those after it.
    fn extrapolate(&self, _at: &State, _dq: &[Vec3], _memory: &mut Memory) {}

    /// Stored energy.
    fn energy(&self, _at: &State) -> Energy {
        Energy::default()
    }

    /// The largest strain that a field of small increments of the unknowns makes, curvatures and springs' displacements
    /// measured by `length`: a number without units, of the size of the field itself where the effect stands in its way,
    /// zero where not. Strains tell soft from loose where the tangent has lost a stiffness to round-off.
    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    /// x.K x of a field of increments, from the strains that it makes: no digits are lost between nodes that move alike. `None` where the
    /// tangent alone tells, as under stress.
    fn stiffness_along(&self, _at: &State, _field: &[Vec3]) -> Option<f64> {
        None
    }

    /// Mass and momenta.
    fn momentum(&self, _at: &State) -> Momentum {
        Momentum::default()
    }

    /// Shows the bodies at nodes with their mass properties.
    fn bodies(&self, _show: &mut dyn FnMut(Node, &Inertia)) {}

    /// What joints to ground beside its supports do to a node in this sign of forces: force, and moment conjugate to its rotation
    /// vector.
    fn held_by_ground(&self, _at: &State, _node: Node) -> (Vec3, Vec3) {
        (Vec3::ZERO, Vec3::ZERO)
    }

    /// Shows motions against which nothing acts, each by the increments of some unknowns.
    fn free_motions(&self, _at: &State, _show: &mut dyn FnMut(&SomeIncrements)) {}

    /// Before a step is predicted from the velocities: takes out of them what nothing but round-off has put there.
    fn steady(&self, _at: &mut State) {}

    /// After each converged state: continues what it keeps in the state, such as turns of joints.
    fn remember(&self, _at: &mut State) {}

    /// First and second derivatives over time of the gaps that its multipliers close, for a motion without accelerations;
    /// by slot of the multipliers.
    fn drift(&self, _at: &State, _rates: &mut [Vec3], _rates2: &mut [Vec3]) {}

    /// Shows its motors.
    fn motors(&self, _at: &State, _show: &mut dyn FnMut(MotorState)) {}

    /// How far motors turn their nodes at once when amplitudes change: the slot that turns most, and radians.
    fn turned(&self, _from: &[f64], _to: &[f64]) -> Option<(Slot, f64)> {
        None
    }

    /// Coordinates that are driven from outside, each with the derivative of the stored energy over it: motors, free strains.
    fn drives(&self, _at: &State, _show: &mut dyn FnMut(f64, f64)) {}

    /// The round-off of its forces.
    fn round_off(&self, _at: &State) -> RoundOff {
        RoundOff::default()
    }
}

/// The work of an effect in a plane: what it adds to the system there. All else it is asked itself.
pub trait PlanarForm: Send + Sync {
    /// Whether its tangent is symmetric, whatever the weights.
    fn is_symmetric(&self) -> bool {
        true
    }

    /// As [`Effect::add`].
    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Assembler);

    /// As [`Effect::extrapolate`].
    fn extrapolate(&self, _at: &State, _dq: &[Vec3], _memory: &mut Memory) {}
}

/// A beam element as effects know it: its number in the scene and its nodes.
#[derive(Clone, Copy, Debug)]
pub struct Connection<const N: usize> {
    /// The number of the element in the scene, an index of [`State::mixed`]
    pub element: u32,
    /// Its nodes
    pub nodes: [Node; N],
}

impl<const N: usize> Connection<N> {
    /// The motions of the nodes, each in its own chart.
    #[inline]
    pub fn motions(&self, at: &State) -> [NodeMotion; N] {
        self.nodes.map(|node| at.motion(node))
    }

    /// The motions of the nodes, all in the chart of the first.
    pub fn motions_in_one_chart(&self, at: &State) -> [NodeMotion; N] {
        let motions = self.motions(at);
        match at.mixed[self.element as usize] {
            0 => motions,
            mask => {
                let converted = Converted::new(&motions, mask).nodes;
                std::array::from_fn(|i| converted[i])
            }
        }
    }

    /// What increments of the unknowns change in them: displacements and rotation vectors.
    pub fn variations_in_one_chart(&self, at: &State, dq: &[Vec3]) -> ([Vec3; N], [Vec3; N]) {
        let (du, dp) = (self.nodes.map(|node| dq[node.u as usize]), self.nodes.map(|node| dq[node.p as usize]));
        match at.mixed[self.element as usize] {
            0 => (du, dp),
            mask => {
                let converted = Converted::new(&self.motions(at), mask);
                (du, std::array::from_fn(|i| converted.variation(i, dp[i])))
            }
        }
    }

    /// The slots u1, P1, u2, P2, ….
    pub fn slots(&self) -> impl Iterator<Item = u32> {
        self.nodes.into_iter().flat_map(|node| [node.u, node.p])
    }

    /// Evaluates the element in one chart, and where its nodes sit in different ones pulls the result back.
    fn evaluate(
        &self,
        at: &State,
        weights: Weights,
        rates: bool,
        rotation_block: impl Fn(usize) -> usize,
        out: &mut ElementSystem,
        kernel: &dyn Fn(&[NodeMotion; N], Weights, &mut ElementSystem),
    ) {
        let nodes = self.motions(at);
        let mask = at.mixed[self.element as usize];
        let cleared = |nodes: &[NodeMotion; N], weights: Weights, out: &mut ElementSystem| {
            out.clear();
            kernel(nodes, weights, out);
        };
        if mask == 0 {
            return cleared(&nodes, weights, out);
        }
        let converted = Converted::new(&nodes, mask);
        let in_one_chart = std::array::from_fn(|i| converted.nodes[i]);
        converted.pull_back(weights, rates, rotation_block, out, &|weights, out| cleared(&in_one_chart, weights, out));
    }
}

/// Which rows of elements side by side of a batch of this length, before which there are so many instances, a sink takes: it never
/// takes parts of rows.
fn own_blocks(before: usize, length: usize, out: &Assembler) -> Range<usize> {
    let own = own_part(before, length, &out.instances());
    own.start.div_ceil(LANES)..own.end.div_ceil(LANES)
}

/// As many elements of a batch as one thread takes at a time, where elements know nothing of each other: whole rows.
const AT_ONCE: usize = 256 * LANES;

/// The elements from `start` on that stand side by side; the last one of a batch fills up its row.
#[inline(always)]
fn side_by_side<E>(batch: &[E], start: usize) -> [&E; LANES] {
    let element = |k: usize| &batch[(start + k).min(batch.len() - 1)];
    each_lane!(|k| element(k))
}

/// The motions of the nodes of elements side by side, each in its own chart.
#[inline(always)]
fn motions<const N: usize>(connections: [&Connection<N>; LANES], at: &State) -> [NodeMotion<Lanes>; N] {
    let mut out = [motions_of(connections, 0, at); N];
    for i in 1..N {
        out[i] = motions_of(connections, i, at);
    }
    out
}

/// Those of the nodes with this number in their elements.
#[inline(always)]
fn motions_of<const N: usize>(connections: [&Connection<N>; LANES], i: usize, at: &State) -> NodeMotion<Lanes> {
    motion_of(each_lane!(|k| connections[k].nodes[i]), at)
}

/// The motions of nodes side by side.
#[inline(always)]
fn motion_of(nodes: [Node; LANES], at: &State) -> NodeMotion<Lanes> {
    let [u, p]: [[Slot; LANES]; 2] = [each_lane!(|k| nodes[k].u), each_lane!(|k| nodes[k].p)];
    NodeMotion {
        u: at_slots(&at.q, u),
        u_rate: at_slots(&at.v, u),
        u_rate2: at_slots(&at.a, u),
        p: at_slots(&at.q, p),
        p_rate: at_slots(&at.v, p),
        p_rate2: at_slots(&at.a, p),
    }
}

/// What a field is at the slots of elements side by side.
#[inline(always)]
fn at_slots(field: &[Vec3], slots: [Slot; LANES]) -> Vec3<Lanes> {
    Vec3::pack(each_lane!(|k| &field[slots[k] as usize]))
}

/// The block of node j's rotation in elements with displacements and rotations.
fn after_displacement(j: usize) -> usize {
    2 * j + 1
}

/// Batches of elements of two, three and four nodes.
#[derive(Clone, Debug)]
pub struct ByOrder<A, B, C> {
    /// Two nodes
    pub two: Vec<A>,
    /// Three nodes
    pub three: Vec<B>,
    /// Four nodes
    pub four: Vec<C>,
}

impl<A, B, C> Default for ByOrder<A, B, C> {
    fn default() -> Self {
        Self { two: Vec::new(), three: Vec::new(), four: Vec::new() }
    }
}

impl<A, B, C> ByOrder<A, B, C> {
    /// Whether no element is in any batch.
    pub fn is_empty(&self) -> bool {
        self.two.is_empty() && self.three.is_empty() && self.four.is_empty()
    }

    /// Gives back what lists have grown to beyond their ends.
    pub fn shrink_to_fit(&mut self) {
        self.two.shrink_to_fit();
        self.three.shrink_to_fit();
        self.four.shrink_to_fit();
    }
}

/// What an element keeps behind a pointer: what a neighbour has where that is the same, or else its own.
fn shared<T: PartialEq>(own: T, neighbours: Option<&Arc<T>>) -> Arc<T> {
    neighbours.filter(|known| ***known == own).cloned().unwrap_or_else(|| Arc::new(own))
}

/// Where each instance of a batch begins counting: batches follow each other in the order two, three, four. Of each batch those of
/// some instances, where these are given.
macro_rules! for_each_batch {
    ($batches:expr, |$first:ident, $batch:ident| $body:expr) => {
        crate::effect::for_each_batch!($batches, 0..usize::MAX, |$first, $batch| $body)
    };
    ($batches:expr, $instances:expr, |$first:ident, $batch:ident| $body:expr) => {{
        let (batches, instances) = (&$batches, $instances);
        let mut before = 0;
        crate::effect::for_each_batch!(@one batches.two, instances, before, $first, $batch, $body);
        crate::effect::for_each_batch!(@one batches.three, instances, before, $first, $batch, $body);
        crate::effect::for_each_batch!(@one batches.four, instances, before, $first, $batch, $body);
        let _ = before;
    }};
    // Room to work in is not made for nothing.
    (@one $own:expr, $instances:ident, $before:ident, $first:ident, $batch:ident, $body:expr) => {
        let own = crate::effect::own_part($before, $own.len(), &$instances);
        let ($first, $batch) = ($before + own.start, &$own[own]);
        if !$batch.is_empty() {
            $body;
        }
        $before += $own.len();
    };
}
pub(crate) use for_each_batch;

/// Which elements of a batch of this length, before which there are so many instances, are among some instances.
#[inline]
fn own_part(before: usize, length: usize, instances: &Range<usize>) -> Range<usize> {
    let place = |instance: usize| instance.clamp(before, before + length) - before;
    place(instances.start)..place(instances.end)
}

/// Instances at one slot each.
fn one_by_one(slots: &[(Slot, bool)]) -> Connectivity {
    let mut connectivity = Connectivity::divisible();
    slots.iter().for_each(|&(slot, _)| connectivity.push([slot]));
    connectivity
}

/// What of mass properties decides whether they lie in a plane.
fn inertia_mirror_data(inertia: &Inertia, show: &mut dyn FnMut(MirrorData)) {
    show(MirrorData::Vector(inertia.offset));
    show(MirrorData::Tensor(inertia.about_node));
}

/// v . J v / 2
#[inline(always)]
fn quadratic<T: Real>(j: Mat3<T>, v: Vec3<T>) -> T {
    v.dot(j * v) * 0.5
}
