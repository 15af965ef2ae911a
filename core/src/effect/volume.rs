//! Elements with forces per length: common to the effects of rotary and eccentric inertia, damping
//! by mass, weight and line loads.

use super::{ByOrder, Connection, ELEMENTS_PER_TASK, for_each_batch, motions, shared, side_by_side};
use crate::kernel::volume::{Blocks, VolumeKernel, VolumePoint};
use crate::kernel::{ElementSystem, NodeMotion, Weights, beam};
use crate::scalar::{Instructions, LANES, Lanes, Pack, each_lane};
use crate::system::{Assembler, Connectivity, State};
use crate::tensor::Vec3;
use crate::threads;
use std::sync::Arc;

/// An element of N nodes and N integration points with the quantities `Q`.
#[derive(Clone, Debug)]
pub struct VolumeElement<const N: usize, Q> {
    /// The number and the nodes of the element
    pub(crate) connection: Connection<N>,
    /// The initial place of its first node
    place: Vec3,
    /// Data shared with equal neighbours
    common: Arc<SharedVolumeData<N, Q>>,
}

/// The data that neighbouring elements share.
#[derive(Debug, PartialEq)]
struct SharedVolumeData<const N: usize, Q> {
    /// The initial places of the nodes from the first node
    arms: [Vec3; N],
    points: [VolumePoint<N, Q>; N],
}

impl<const N: usize, Q: Copy> VolumeElement<N, Q> {
    /// An element whose first node is at `place`, with the other nodes at `arms` from there. Data
    /// that equal those of the `neighbour` are shared.
    pub fn new(
        connection: Connection<N>,
        place: Vec3,
        arms: [Vec3; N],
        points: [VolumePoint<N, Q>; N],
        neighbour: Option<&Self>,
    ) -> Self
    where
        Q: PartialEq,
    {
        let common = shared(SharedVolumeData { arms, points }, neighbour.map(|neighbour| &neighbour.common));
        Self { connection, place, common }
    }

    /// The initial place of its first node.
    pub fn place(&self) -> Vec3 {
        self.place
    }

    /// The initial places of its nodes from the first node.
    pub fn arms(&self) -> &[Vec3; N] {
        &self.common.arms
    }

    /// The integration points of the element.
    #[inline(always)]
    pub fn points(&self) -> &[VolumePoint<N, Q>; N] {
        &self.common.points
    }

    /// Calls `show` with the quantity of each point, its weight, its initial place and its motion.
    fn each_point(&self, at: &State, mut show: impl FnMut(&Q, f64, Vec3, &NodeMotion)) {
        let nodes = self.connection.motions_in_one_chart(at);
        for point in self.points() {
            let place = self.place + beam::interpolate(&point.shape, |i| self.arms()[i]);
            show(&point.quantity, point.weight, place, &point.motion(&nodes));
        }
    }

    /// True if all elements share their points.
    #[inline(always)]
    fn share(elements: [&Self; LANES]) -> bool {
        elements[1..].iter().all(|element| Arc::ptr_eq(&element.common, &elements[0].common))
    }

    /// Point g of elements side by side, with the present data of a kernel; `share` is true if they
    /// share their points.
    #[inline(always)]
    fn side_by_side<K>(
        elements: [&Self; LANES],
        share: bool,
        g: usize,
        kernel: &K,
    ) -> VolumePoint<N, K::Present<Lanes>, Lanes>
    where
        K: VolumeKernel<Quantity = Q>,
        K::Present<f64>: Pack<Packed = K::Present<Lanes>>,
    {
        let point = |k: usize| elements[k].points()[g].map(|quantity| kernel.at_present(quantity));
        match share {
            true => VolumePoint::pack([&point(0); LANES]),
            false => VolumePoint::pack(each_lane!(|k| point(k)).each_ref()),
        }
    }
}

/// Elements of two, three and four nodes, with quantities `Q` at their points.
pub type VolumeElements<Q> = ByOrder<VolumeElement<2, Q>, VolumeElement<3, Q>, VolumeElement<4, Q>>;

impl<Q: Copy> VolumeElements<Q> {
    /// The slots of each element for kernels with these blocks; divisible, since effects add only
    /// the instances of an assembler.
    pub fn connectivity(&self, blocks: Blocks) -> Connectivity {
        let mut connectivity = Connectivity::divisible();
        for_each_batch!(self, |_first, batch| for element in batch {
            let nodes = element.connection.nodes.iter();
            match blocks {
                Blocks::Rotations => connectivity.push(nodes.map(|node| node.p)),
                Blocks::Both => connectivity.push(element.connection.slots()),
            }
        });
        connectivity
    }

    /// Adds forces and tangents of a kernel.
    pub fn add<K>(&self, kernel: &K, at: &State, weights: Weights, out: &mut Assembler)
    where
        K: VolumeKernel<Quantity = Q>,
        K::Present<f64>: Pack<Packed = K::Present<Lanes>>,
    {
        for_each_batch!(*self, out.instances(), |first, batch| {
            let done = Instructions::here().run_side_by_side(
                #[inline(always)]
                || add_batch(kernel, batch, first, at, weights, out),
            );
            if done.is_none() {
                let each = batch.iter().enumerate();
                each.for_each(|(k, element)| add_alone(kernel, element, first + k, at, weights, out));
            }
        });
    }

    /// Sums over points: calls `add` with the sum of a part and the quantity, weight, initial place
    /// and motion of each point, and `take` with the sums of parts in their order. Parts do not
    /// depend on the number of threads.
    pub fn sum<S: Default + Send>(
        &self,
        at: &State,
        add: impl Fn(&mut S, &Q, f64, Vec3, &NodeMotion) + Send + Sync,
        mut take: impl FnMut(S),
    ) where
        Q: Send + Sync,
    {
        for_each_batch!(self, |_first, batch| {
            let sum_of = |part: &[VolumeElement<_, Q>]| {
                let mut sum = S::default();
                part.iter()
                    .for_each(|element| element.each_point(at, |q, w, x, motion| add(&mut sum, q, w, x, motion)));
                sum
            };
            threads::in_order(batch.chunks(ELEMENTS_PER_TASK), sum_of, &mut take);
        });
    }

    /// Calls `show` with the quantity of each point.
    pub fn each_quantity(&self, mut show: impl FnMut(&Q)) {
        for_each_batch!(self, |_first, batch| {
            batch.iter().flat_map(|element| element.points()).for_each(|point| show(&point.quantity));
        });
    }

    /// True if `is` holds for the quantity of some point.
    pub fn any(&self, is: impl Fn(&Q) -> bool) -> bool {
        let mut found = false;
        for_each_batch!(self, |_first, batch| {
            found |= batch.iter().flat_map(|element| element.points()).any(|point| is(&point.quantity));
        });
        found
    }
}

/// Adds a batch of elements in lanes; `first` is the number of its first instance.
#[inline(always)]
fn add_batch<K, const N: usize>(
    kernel: &K,
    batch: &[VolumeElement<N, K::Quantity>],
    first: usize,
    at: &State,
    weights: Weights,
    out: &mut Assembler,
) where
    K: VolumeKernel,
    K::Present<f64>: Pack<Packed = K::Present<Lanes>>,
{
    let mut systems = out.lend(K::BLOCKS.count(N), weights != Weights::NONE);
    for start in (0..batch.len()).step_by(LANES) {
        let elements = side_by_side(batch, start);
        let nodes = motions(each_lane!(|k| &elements[k].connection), at);
        let share = VolumeElement::share(elements);
        systems.clear_for(weights);
        for g in 0..N {
            VolumeElement::side_by_side(elements, share, g, kernel).add(kernel, &nodes, weights, &mut systems);
        }
        let is_mixed = |k: usize| at.mixed[elements[k].connection.element as usize] != 0;
        out.add_lanes(first + start, LANES.min(batch.len() - start), &systems, is_mixed, |k, out| {
            add_alone(kernel, elements[k], first + start + k, at, weights, out);
        });
    }
    out.take_back(systems);
}

/// Adds force and tangent of one element, whose nodes may have rotation vectors in different
/// charts.
#[inline(never)]
fn add_alone<K: VolumeKernel, const N: usize>(
    kernel: &K,
    element: &VolumeElement<N, K::Quantity>,
    number: usize,
    at: &State,
    weights: Weights,
    out: &mut Assembler,
) {
    let mut system = ElementSystem::new(K::BLOCKS.count(N));
    let sum = |nodes: &[NodeMotion; N], weights: Weights, system: &mut ElementSystem| {
        for point in element.points() {
            point.map(|quantity| kernel.at_present(quantity)).add(kernel, nodes, weights, system);
        }
    };
    element.connection.evaluate(at, weights, K::RATES, &|j| K::BLOCKS.rotation(j), &mut system, &sum);
    out.add(number, &system);
}
