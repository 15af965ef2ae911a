//! Inertia of beam sections with a full 6x6 mass: the mass centre lies off the centre line, or J couples.

use super::{ByOrder, Connection, Effect, Energy, Momentum, after_displacement, for_each_batch, rigid_body};
use crate::kernel::beam::{VolumePoint, interpolate};
use crate::kernel::inertia::Inertia;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Category, Cliques, Memory, Sink, State};

/// An element of N nodes and as many points with mass properties per length.
#[derive(Clone, Debug)]
pub struct EccentricElement<const N: usize> {
    /// Its place in the scene
    pub connection: Connection<N>,
    /// Points with the mass properties per length
    pub points: [VolumePoint<N, Inertia>; N],
}

/// All beam elements with eccentric mass.
#[derive(Clone, Debug, Default)]
pub struct SectionInertia {
    /// The elements
    pub elements: ByOrder<EccentricElement<2>, EccentricElement<3>, EccentricElement<4>>,
}

impl Effect for SectionInertia {
    fn name(&self) -> &'static str {
        "eccentric section inertia"
    }

    fn category(&self) -> Category {
        Category::Inertia
    }

    fn cliques(&self) -> Cliques {
        let mut cliques = Cliques::default();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            cliques.push(element.connection.slots());
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
            for point in &element.points {
                kinetic += point.weight * rigid_body::kinetic(&point.quantity, &point.motion(&nodes));
            }
        });
        Energy { kinetic, strain: 0.0 }
    }

    fn momentum(&self, at: &State) -> Momentum {
        let mut sum = Momentum::ZERO;
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            let nodes = element.connection.motions_in_one_chart(at);
            for point in &element.points {
                let place = interpolate(&point.shape, |i| element.connection.places[i]);
                sum.add(rigid_body::momentum(&point.quantity, place, &point.motion(&nodes), point.weight));
            }
        });
        sum
    }
}

fn add_batch<const N: usize>(
    batch: &[EccentricElement<N>],
    first: usize,
    at: &State,
    weights: Weights,
    out: &mut Sink,
) {
    let mut system = ElementSystem::new(2 * N);
    for (k, element) in batch.iter().enumerate() {
        element.connection.evaluate(at, weights, true, after_displacement, &mut system, |nodes, weights, system| {
            for point in &element.points {
                point.add_body(nodes, weights, system);
            }
        });
        out.add(first + k, &system);
    }
}
