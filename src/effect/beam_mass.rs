//! Translational inertia of beams without eccentric mass: the consistent mass matrix, constant and free of charts.

use super::{ByOrder, Connection, Effect, Energy, Momentum, for_each_batch};
use crate::kernel::beam::{VolumePoint, interpolate};
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Category, Cliques, Memory, Sink, State};
use crate::tensor::{Mat3, Vec3};

/// An element of N nodes and as many points for its mass per length.
#[derive(Clone, Debug)]
pub struct MassElement<const N: usize> {
    /// Its place in the scene
    pub connection: Connection<N>,
    /// Points with the mass per length
    pub points: [VolumePoint<N, f64>; N],
    /// The mass matrix of a single direction, m_ij = sum w rhoA N_i N_j
    matrix: [[f64; N]; N],
}

impl<const N: usize> MassElement<N> {
    /// The element with the mass per length of these points.
    pub fn new(connection: Connection<N>, points: [VolumePoint<N, f64>; N]) -> Self {
        let entry = |i: usize, j: usize| points.iter().map(|p| p.weight * p.quantity * p.shape[i] * p.shape[j]).sum();
        let matrix = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
        Self { connection, points, matrix }
    }

    fn kinetic(&self, at: &State) -> f64 {
        let v = self.connection.nodes.map(|node| at.v[node.u as usize]);
        let products = (0..N).flat_map(|i| (0..N).map(move |j| (i, j)));
        0.5 * products.map(|(i, j)| self.matrix[i][j] * v[i].dot(v[j])).sum::<f64>()
    }

    fn momentum(&self, at: &State) -> Momentum {
        let mut sum = Momentum::ZERO;
        for point in &self.points {
            let mass = point.weight * point.quantity;
            let x =
                interpolate(&point.shape, |i| self.connection.places[i] + at.q[self.connection.nodes[i].u as usize]);
            let linear = interpolate(&point.shape, |i| at.v[self.connection.nodes[i].u as usize]) * mass;
            sum.add(Momentum { mass, moment: x * mass, linear, angular: x.cross(linear) });
        }
        sum
    }
}

/// All beam elements with mass on their centre line.
#[derive(Clone, Debug, Default)]
pub struct BeamMass {
    /// The elements
    pub elements: ByOrder<MassElement<2>, MassElement<3>, MassElement<4>>,
}

impl Effect for BeamMass {
    fn name(&self) -> &'static str {
        "beam mass"
    }

    fn category(&self) -> Category {
        Category::Inertia
    }

    fn cliques(&self) -> Cliques {
        let mut cliques = Cliques::default();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            cliques.push(element.connection.nodes.map(|node| node.u));
        });
        cliques
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        for_each_batch!(self.elements, |first, batch| add_batch(batch, first, at, weights, out));
    }

    fn energy(&self, at: &State) -> Energy {
        let mut kinetic = 0.0;
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            kinetic += element.kinetic(at);
        });
        Energy { kinetic, strain: 0.0 }
    }

    fn momentum(&self, at: &State) -> Momentum {
        let mut sum = Momentum::ZERO;
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            sum.add(element.momentum(at));
        });
        sum
    }
}

fn add_batch<const N: usize>(batch: &[MassElement<N>], first: usize, at: &State, weights: Weights, out: &mut Sink) {
    let mut system = ElementSystem::new(N);
    for (k, element) in batch.iter().enumerate() {
        system.clear();
        let accelerations: [Vec3; N] = element.connection.nodes.map(|node| at.a[node.u as usize]);
        for i in 0..N {
            system.add_force(i, interpolate(&element.matrix[i], |j| accelerations[j]));
            if weights.mass != 0.0 {
                for j in 0..N {
                    system.add_tangent(i, j, Mat3::diagonal([element.matrix[i][j] * weights.mass; 3]));
                }
            }
        }
        out.add(first + k, &system);
    }
}
