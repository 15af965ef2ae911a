//! Weight of beams and bodies: forces fixed in space at the mass centres.

use super::rigid_body::Body;
use super::section_inertia::EccentricElement;
use super::{ByOrder, Effect, after_displacement, for_each_batch};
use crate::kernel::load::offset_force;
use crate::kernel::{ElementSystem, Weights};
use crate::rotation::Rotation;
use crate::system::{Category, Cliques, Memory, Sink, State};
use crate::tensor::Vec3;

/// The weight of all beams. Elements with their mass on the centre line need no rotation and no tangent.
#[derive(Clone, Debug)]
pub struct BeamGravity {
    /// The acceleration of gravity
    pub acceleration: Vec3,
    /// The number of its amplitude
    pub amplitude: usize,
    /// Elements by the mass properties of their points
    pub elements: ByOrder<EccentricElement<2>, EccentricElement<3>, EccentricElement<4>>,
}

impl Effect for BeamGravity {
    fn name(&self) -> &'static str {
        "gravity on beams"
    }

    fn category(&self) -> Category {
        Category::External
    }

    fn cliques(&self) -> Cliques {
        let mut cliques = Cliques::default();
        for_each_batch!(self.elements, |_first, batch| for element in batch {
            cliques.push(element.connection.slots());
        });
        cliques
    }

    fn has_tangent(&self) -> bool {
        let mut eccentric = false;
        for_each_batch!(self.elements, |_first, batch| {
            eccentric |= batch.iter().flat_map(|e| &e.points).any(|p| p.quantity.offset != Vec3::ZERO);
        });
        eccentric
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        let g = self.acceleration * at.amplitude[self.amplitude];
        if g != Vec3::ZERO {
            for_each_batch!(self.elements, |first, batch| add_batch(batch, first, g, at, weights, out));
        }
    }
}

fn add_batch<const N: usize>(
    batch: &[EccentricElement<N>],
    first: usize,
    g: Vec3,
    at: &State,
    weights: Weights,
    out: &mut Sink,
) {
    let mut system = ElementSystem::new(2 * N);
    for (k, element) in batch.iter().enumerate() {
        element.connection.evaluate(at, weights, false, after_displacement, &mut system, |nodes, weights, system| {
            for point in &element.points {
                let weight = g * (point.quantity.mass * point.weight);
                for (i, &n) in point.shape.iter().enumerate() {
                    system.add_force(2 * i, -(weight * n));
                }
                if point.quantity.offset == Vec3::ZERO {
                    continue;
                }
                let rotation = Rotation::new(point.motion(nodes).p);
                let (moment, tangent) = offset_force(&rotation, point.quantity.offset, weight);
                for i in 0..N {
                    system.add_force(2 * i + 1, moment * point.shape[i]);
                    for j in 0..N {
                        let factor = point.shape[i] * point.shape[j] * weights.stiffness;
                        system.add_tangent(2 * i + 1, 2 * j + 1, tangent * factor);
                    }
                }
            }
        });
        out.add(first + k, &system);
    }
}

/// The weight of all bodies.
#[derive(Clone, Debug)]
pub struct BodyGravity {
    /// The acceleration of gravity
    pub acceleration: Vec3,
    /// The number of its amplitude
    pub amplitude: usize,
    /// The bodies
    pub bodies: Vec<Body>,
}

impl Effect for BodyGravity {
    fn name(&self) -> &'static str {
        "gravity on bodies"
    }

    fn category(&self) -> Category {
        Category::External
    }

    fn cliques(&self) -> Cliques {
        let mut cliques = Cliques::default();
        self.bodies.iter().for_each(|body| cliques.push([body.node.u, body.node.p]));
        cliques
    }

    fn has_tangent(&self) -> bool {
        self.bodies.iter().any(|body| body.inertia.offset != Vec3::ZERO)
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        let mut system = ElementSystem::new(2);
        for (k, body) in self.bodies.iter().enumerate() {
            let weight = self.acceleration * (at.amplitude[self.amplitude] * body.inertia.mass);
            system.clear();
            system.add_force(0, -weight);
            if body.inertia.offset != Vec3::ZERO {
                let rotation = Rotation::new(at.q[body.node.p as usize]);
                let (moment, tangent) = offset_force(&rotation, body.inertia.offset, weight);
                system.add_force(1, moment);
                system.add_tangent(1, 1, tangent * weights.stiffness);
            }
            out.add(k, &system);
        }
    }
}
