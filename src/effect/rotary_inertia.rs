//! Rotary inertia of beam sections without eccentric mass: mass, gyroscopic and centrifugal terms ((51), (52), (68)–(71)).

use super::{ByOrder, Connection, Effect, Energy, Momentum, for_each_batch, quadratic};
use crate::kernel::beam::VolumePoint;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Category, Cliques, Memory, Sink, State};
use crate::tensor::Mat3;

/// An element of N nodes and as many points with J per length, global components of the initial placement.
#[derive(Clone, Debug)]
pub struct RotaryElement<const N: usize> {
    /// Its place in the scene
    pub connection: Connection<N>,
    /// Points with the rotary inertia per length
    pub points: [VolumePoint<N, Mat3>; N],
}

/// All beam elements whose sections have rotary inertia.
#[derive(Clone, Debug, Default)]
pub struct RotaryInertia {
    /// The elements
    pub elements: ByOrder<RotaryElement<2>, RotaryElement<3>, RotaryElement<4>>,
}

impl Effect for RotaryInertia {
    fn name(&self) -> &'static str {
        "rotary inertia"
    }

    fn category(&self) -> Category {
        Category::Inertia
    }

    fn cliques(&self) -> Cliques {
        let mut cliques = Cliques::default();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            cliques.push(element.connection.nodes.map(|node| node.p));
        });
        cliques
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        for_each_batch!(self.elements, |first, batch| add_batch(batch, first, at, weights, out));
    }

    fn energy(&self, at: &State) -> Energy {
        let mut kinetic = 0.0;
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            let nodes = element.connection.motions_in_one_chart(at);
            kinetic +=
                element.points.iter().map(|p| p.weight * quadratic(p.quantity, p.spin(&nodes).omega)).sum::<f64>();
        });
        Energy { kinetic, strain: 0.0 }
    }

    fn momentum(&self, at: &State) -> Momentum {
        let mut sum = Momentum::ZERO;
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            let nodes = element.connection.motions_in_one_chart(at);
            for point in &element.points {
                let spin = point.spin(&nodes);
                sum.angular += spin.rotation.r * (point.quantity * spin.omega) * point.weight;
            }
        });
        sum
    }
}

fn add_batch<const N: usize>(batch: &[RotaryElement<N>], first: usize, at: &State, weights: Weights, out: &mut Sink) {
    let mut system = ElementSystem::new(N);
    for (k, element) in batch.iter().enumerate() {
        element.connection.evaluate(
            at,
            weights,
            true,
            |j| j,
            &mut system,
            |nodes, weights, system| {
                for point in &element.points {
                    point.add_rotary(nodes, weights, system);
                }
            },
        );
        out.add(first + k, &system);
    }
}
