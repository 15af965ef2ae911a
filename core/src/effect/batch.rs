//! Batches of elements: the nodes of an element, elements side by side in lanes, batches by order,
//! ranges of instances, and the macro that walks through batches.

use crate::kernel::seam::Converted;
use crate::kernel::{ElementSystem, NodeMotion, Weights};
use crate::scalar::{LANES, Lanes, Pack, Real, each_lane};
use crate::system::{Assembler, Connectivity, Node, Slot, State};
use crate::tensor::{Mat3, Vec3};
use std::ops::Range;
use std::sync::Arc;

/// A beam element of the scene with its nodes.
#[derive(Clone, Copy, Debug)]
pub struct Connection<const N: usize> {
    /// The number of the element in the scene, an index of [`State::mixed`]
    pub(crate) element: u32,
    /// The nodes of the element
    pub(crate) nodes: [Node; N],
}

impl<const N: usize> Connection<N> {
    /// The motions of the nodes, each in its own chart.
    #[inline]
    pub fn motions(&self, at: &State) -> [NodeMotion; N] {
        self.nodes.map(|node| at.motion(node))
    }

    /// The motions of the nodes, all in the chart of the first node.
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

    /// Increments of displacements and of rotation vectors at the nodes, in the chart of the first
    /// node, from increments `dq` of the unknowns by slot.
    pub fn variations_in_one_chart(&self, at: &State, dq: impl Fn(Slot) -> Vec3) -> ([Vec3; N], [Vec3; N]) {
        let du = self.nodes.map(|node| dq(node.u));
        let dp = self.nodes.map(|node| dq(node.p));
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

    /// Evaluates the element in the chart of its first node, and pulls the result back to the
    /// charts of the others. `rates` is true if forces depend on rates of rotation vectors;
    /// `kernel` adds to a cleared system.
    pub(super) fn evaluate(
        &self,
        at: &State,
        weights: Weights,
        rates: bool,
        rotation_block: &dyn Fn(usize) -> usize,
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

/// The rows of [`LANES`] elements that an assembler takes of a batch of `length` elements, before
/// which the effect has `before` instances. Assemblers take whole rows.
pub(super) fn own_blocks(before: usize, length: usize, out: &Assembler) -> Range<usize> {
    let own = own_part(before, length, &out.instances());
    own.start.div_ceil(LANES)..own.end.div_ceil(LANES)
}

/// The number of elements of a batch that a thread takes at a time, a multiple of [`LANES`].
pub(super) const ELEMENTS_PER_TASK: usize = 256 * LANES;

/// The row of elements from `start` on; the last element of the batch fills up an incomplete row.
#[inline(always)]
pub(super) fn side_by_side<E>(batch: &[E], start: usize) -> [&E; LANES] {
    let element = |k: usize| &batch[(start + k).min(batch.len() - 1)];
    each_lane!(|k| element(k))
}

/// The motions of the nodes of elements side by side, each in its own chart.
#[inline(always)]
pub(super) fn motions<const N: usize>(connections: [&Connection<N>; LANES], at: &State) -> [NodeMotion<Lanes>; N] {
    let mut out = [motions_of(connections, 0, at); N];
    for i in 1..N {
        out[i] = motions_of(connections, i, at);
    }
    out
}

/// The motions of the nodes with number `i` in their elements, each in its own chart.
#[inline(always)]
pub(super) fn motions_of<const N: usize>(
    connections: [&Connection<N>; LANES],
    i: usize,
    at: &State,
) -> NodeMotion<Lanes> {
    motion_of(each_lane!(|k| connections[k].nodes[i]), at)
}

/// The motions of nodes side by side, each in its own chart.
#[inline(always)]
pub(super) fn motion_of(nodes: [Node; LANES], at: &State) -> NodeMotion<Lanes> {
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

/// The values of a field at slots side by side.
#[inline(always)]
pub(super) fn at_slots(field: &[Vec3], slots: [Slot; LANES]) -> Vec3<Lanes> {
    Vec3::pack(each_lane!(|k| &field[slots[k] as usize]))
}

/// The block of the rotation of node j in elements with displacements and rotations.
pub(super) fn after_displacement(j: usize) -> usize {
    2 * j + 1
}

/// Batches of elements of two, three and four nodes.
#[derive(Clone, Debug)]
pub struct ByOrder<A, B, C> {
    /// Elements of two nodes
    pub two: Vec<A>,
    /// Elements of three nodes
    pub three: Vec<B>,
    /// Elements of four nodes
    pub four: Vec<C>,
}

impl<A, B, C> Default for ByOrder<A, B, C> {
    fn default() -> Self {
        Self { two: Vec::new(), three: Vec::new(), four: Vec::new() }
    }
}

impl<A, B, C> ByOrder<A, B, C> {
    /// True if no batch has an element.
    pub fn is_empty(&self) -> bool {
        self.two.is_empty() && self.three.is_empty() && self.four.is_empty()
    }

    /// Releases unused memory at the ends of lists.
    pub fn shrink_to_fit(&mut self) {
        self.two.shrink_to_fit();
        self.three.shrink_to_fit();
        self.four.shrink_to_fit();
    }
}

/// A pointer to data: that of a neighbour if its data are equal, otherwise a new one.
pub(super) fn shared<T: PartialEq>(own: T, neighbours: Option<&Arc<T>>) -> Arc<T> {
    neighbours.filter(|known| ***known == own).cloned().unwrap_or_else(|| Arc::new(own))
}

/// Runs a body for each batch in the order two, three, four, with the number of the batch's first
/// instance and its elements; with a range of instances, for the part of each batch that is in the
/// range. Empty batches are skipped.
macro_rules! for_each_batch {
    ($batches:expr, |$first:ident, $batch:ident| $body:expr) => {
        crate::effect::batch::for_each_batch!($batches, 0..usize::MAX, |$first, $batch| $body)
    };
    ($batches:expr, $instances:expr, |$first:ident, $batch:ident| $body:expr) => {{
        let batches = &$batches;
        let instances = $instances;
        let mut before = 0;
        crate::effect::batch::for_each_batch!(@one batches.two, instances, before, $first, $batch, $body);
        crate::effect::batch::for_each_batch!(@one batches.three, instances, before, $first, $batch, $body);
        crate::effect::batch::for_each_batch!(@one batches.four, instances, before, $first, $batch, $body);
        let _ = before;
    }};
    // Bodies may allocate memory, which is not done for empty batches.
    (@one $own:expr, $instances:ident, $before:ident, $first:ident, $batch:ident, $body:expr) => {
        let own = crate::effect::batch::own_part($before, $own.len(), &$instances);
        let $first = $before + own.start;
        let $batch = &$own[own];
        if !$batch.is_empty() {
            $body;
        }
        $before += $own.len();
    };
}
pub(super) use for_each_batch;

/// The indices of the elements of a batch that are among `instances`. The batch has `length`
/// elements, and the effect `before` instances before it.
#[inline]
pub(super) fn own_part(before: usize, length: usize, instances: &Range<usize>) -> Range<usize> {
    let place = |instance: usize| instance.clamp(before, before + length) - before;
    place(instances.start)..place(instances.end)
}

/// The connectivity of instances with one slot each.
pub(super) fn one_by_one(slots: &[(Slot, bool)]) -> Connectivity {
    let mut connectivity = Connectivity::divisible();
    slots.iter().for_each(|&(slot, _)| connectivity.push([slot]));
    connectivity
}

/// The quadratic form v . J v / 2.
#[inline(always)]
pub(super) fn quadratic<T: Real>(j: Mat3<T>, v: Vec3<T>) -> T {
    v.dot(j * v) * 0.5
}
