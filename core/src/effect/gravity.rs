//! Weight of beams and bodies: forces fixed in space at the mass centres.

use super::rigid_body::Body;
use super::volume::VolumeElements;
use super::{Effect, inertia_aspects};
use crate::kernel::inertia::Inertia;
use crate::kernel::load::{Weight, offset_force};
use crate::kernel::volume::Blocks;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Aspect, Category, Cliques, Memory, Sink, State};
use crate::tensor::Vec3;

/// The weight of all beams. Elements with their mass on the centre line need no rotation and no tangent.
#[derive(Clone, Debug)]
pub struct BeamGravity {
    /// The acceleration of gravity
    pub acceleration: Vec3,
    /// The number of its amplitude
    pub amplitude: usize,
    /// Elements by the mass properties of their points
    pub elements: VolumeElements<Inertia>,
}

impl Effect for BeamGravity {
    fn name(&self) -> &'static str {
        "gravity on beams"
    }

    fn category(&self) -> Category {
        Category::External
    }

    fn cliques(&self) -> Cliques {
        self.elements.cliques(Blocks::Both)
    }

    fn has_tangent(&self) -> bool {
        self.elements.any(|inertia| inertia.offset != Vec3::ZERO)
    }

    fn is_symmetric(&self) -> bool {
        true
    }

    fn aspects(&self, show: &mut dyn FnMut(Aspect)) {
        show(Aspect::Vector(self.acceleration));
        self.elements.each_quantity(|inertia| inertia_aspects(inertia, show));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        let acceleration = self.acceleration * at.amplitude[self.amplitude];
        self.elements.add(&Weight { acceleration }, at, weights, out);
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
        let mut cliques = Cliques::divisible();
        self.bodies.iter().for_each(|body| cliques.push([body.node.u, body.node.p]));
        cliques
    }

    fn has_tangent(&self) -> bool {
        self.bodies.iter().any(|body| body.inertia.offset != Vec3::ZERO)
    }

    fn is_symmetric(&self) -> bool {
        true
    }

    fn aspects(&self, show: &mut dyn FnMut(Aspect)) {
        show(Aspect::Vector(self.acceleration));
        self.bodies.iter().for_each(|body| inertia_aspects(&body.inertia, show));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        let mut system = ElementSystem::new(2);
        for k in out.instances() {
            let body = &self.bodies[k];
            let weight = self.acceleration * (at.amplitude[self.amplitude] * body.inertia.mass);
            system.clear();
            system.add_force(0, -weight);
            if body.inertia.offset != Vec3::ZERO {
                let rotation = at.rotation(body.node.p);
                let (moment, tangent) = offset_force(&rotation, body.inertia.offset, weight);
                system.add_force(1, moment);
                system.add_tangent(1, 1, tangent * weights.stiffness);
            }
            out.add(k, &system);
        }
    }
}
