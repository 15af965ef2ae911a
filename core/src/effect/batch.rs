//! Elements side by side: their nodes, batches by order, the rows that a thread takes, and the
//! macro that walks through batches.

use crate::kernel::seam::Converted;
use crate::kernel::{ElementSystem, NodeMotion, Weights};
use crate::scalar::{LANES, Lanes, Pack, Real, each_lane};
use crate::system::{Assembler, Connectivity, Node, Slot, State};
use crate::tensor::{Mat3, Vec3};
use std::ops::Range;
use std::sync::Arc;

/// The number of a beam element in the scene, and its nodes.
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

    /// Increments of displacements and rotation vectors at the nodes, in the chart of the first,
    /// from increments of the unknowns.
    pub fn variations_in_one_chart(&self, at: &State, dq: &[Vec3]) -> ([Vec3; N], [Vec3; N]) {
        let du = self.nodes.map(|node| dq[node.u as usize]);
        let dp = self.nodes.map(|node| dq[node.p as usize]);
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

    /// Evaluates the element in one chart, and where its nodes sit in different ones pulls the
    /// result back.
    pub(super) fn evaluate(
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

/// The rows of [`LANES`] elements that an assembler takes of a batch of this length, before which
/// there are `before` instances: it takes whole rows.
pub(super) fn own_blocks(before: usize, length: usize, out: &Assembler) -> Range<usize> {
    let own = own_part(before, length, &out.instances());
    own.start.div_ceil(LANES)..own.end.div_ceil(LANES)
}

/// Elements of a batch that one thread takes at a time: whole rows.
pub(super) const AT_ONCE: usize = 256 * LANES;

/// The elements from `start` on that stand side by side; the last one of a batch fills up its row.
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

/// The motions of the nodes with number `i` in their elements.
#[inline(always)]
pub(super) fn motions_of<const N: usize>(
    connections: [&Connection<N>; LANES],
    i: usize,
    at: &State,
) -> NodeMotion<Lanes> {
    motion_of(each_lane!(|k| connections[k].nodes[i]), at)
}

/// The motions of nodes side by side.
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

/// The block of node j's rotation in elements with displacements and rotations.
pub(super) fn after_displacement(j: usize) -> usize {
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
    /// No element is in any batch.
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

/// Data behind a pointer: that of a neighbour where it is equal, else the element's own.
pub(super) fn shared<T: PartialEq>(own: T, neighbours: Option<&Arc<T>>) -> Arc<T> {
    neighbours.filter(|known| ***known == own).cloned().unwrap_or_else(|| Arc::new(own))
}

/// Walks through batches in the order two, three, four: the number of the first instance of each,
/// and its elements. With a range of instances, the part of each batch that is in it.
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
    // Room to work in is not made for nothing.
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

/// The elements of a batch of this length, before which there are `before` instances, that are
/// among `instances`.
#[inline]
pub(super) fn own_part(before: usize, length: usize, instances: &Range<usize>) -> Range<usize> {
    let place = |instance: usize| instance.clamp(before, before + length) - before;
    place(instances.start)..place(instances.end)
}

/// Instances at one slot each.
pub(super) fn one_by_one(slots: &[(Slot, bool)]) -> Connectivity {
    let mut connectivity = Connectivity::divisible();
    slots.iter().for_each(|&(slot, _)| connectivity.push([slot]));
    connectivity
}

/// v . J v / 2
#[inline(always)]
pub(super) fn quadratic<T: Real>(j: Mat3<T>, v: Vec3<T>) -> T {
    v.dot(j * v) * 0.5
}
