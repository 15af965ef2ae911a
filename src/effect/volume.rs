//! Elements over which something per length is integrated: shared by the effects of mass, weight and line loads.

use super::{ByOrder, Connection, for_each_batch};
use crate::kernel::volume::{Blocks, VolumeKernel, VolumePoint};
use crate::kernel::{ElementSystem, NodeMotion, Weights, beam};
use crate::system::{Cliques, Sink, State};
use crate::tensor::Vec3;

/// An element of N nodes and as many points.
#[derive(Clone, Debug)]
pub struct VolumeElement<const N: usize, Q> {
    /// Its place in the scene
    pub connection: Connection<N>,
    /// Its integration points
    pub points: [VolumePoint<N, Q>; N],
}

/// Elements of all orders.
pub type VolumeElements<Q> = ByOrder<VolumeElement<2, Q>, VolumeElement<3, Q>, VolumeElement<4, Q>>;

impl<Q: Copy> VolumeElements<Q> {
    /// The slots that meet in each element.
    pub fn cliques(&self, blocks: Blocks) -> Cliques {
        let mut cliques = Cliques::default();
        for_each_batch!(self, |_first, batch| for element in batch {
            let nodes = element.connection.nodes.iter();
            match blocks {
                Blocks::Displacements => cliques.push(nodes.map(|node| node.u)),
                Blocks::Rotations => cliques.push(nodes.map(|node| node.p)),
                Blocks::Both => cliques.push(element.connection.slots()),
            }
        });
        cliques
    }

    /// Adds forces and tangents of a kernel.
    pub fn add<K: VolumeKernel<Quantity = Q>>(&self, kernel: &K, at: &State, weights: Weights, out: &mut Sink) {
        for_each_batch!(self, |first, batch| add_batch(kernel, batch, first, at, weights, out));
    }

    /// Shows each point's quantity, its weight, its initial place and its motion.
    pub fn each_point(&self, at: &State, mut show: impl FnMut(&Q, f64, Vec3, &NodeMotion)) {
        for_each_batch!(self, |_first, batch| for element in batch {
            let nodes = element.connection.motions_in_one_chart(at);
            for point in &element.points {
                let place = beam::interpolate(&point.shape, |i| element.connection.places[i]);
                show(&point.quantity, point.weight, place, &point.motion(&nodes));
            }
        });
    }

    /// Whether any point has a quantity of this kind.
    pub fn any(&self, is: impl Fn(&Q) -> bool) -> bool {
        let mut found = false;
        for_each_batch!(self, |_first, batch| {
            found |= batch.iter().flat_map(|element| &element.points).any(|point| is(&point.quantity));
        });
        found
    }
}

/// Adds the elements of one order, `first` instances after the first one of the effect.
fn add_batch<K: VolumeKernel, const N: usize>(
    kernel: &K,
    batch: &[VolumeElement<N, K::Quantity>],
    first: usize,
    at: &State,
    weights: Weights,
    out: &mut Sink,
) {
    let mut system = ElementSystem::new(K::BLOCKS.count(N));
    for (k, element) in batch.iter().enumerate() {
        let sum = |nodes: &[NodeMotion; N], weights: Weights, system: &mut ElementSystem| {
            for point in &element.points {
                point.add(kernel, nodes, weights, system);
            }
        };
        if K::BLOCKS == Blocks::Displacements {
            // Displacements know no charts.
            system.clear();
            sum(&element.connection.motions(at), weights, &mut system);
        } else {
            element.connection.evaluate(at, weights, K::RATES, |j| K::BLOCKS.rotation(j), &mut system, sum);
        }
        out.add(first + k, &system);
    }
}
