//! The mass part of Rayleigh damping: alpha M qd, on beams and bodies.

use super::rigid_body::Body;
use super::{Effect, VolumeElements, inertia_aspects};
use crate::kernel::inertia::{Drag, Inertia, drag};
use crate::kernel::volume::Blocks;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Aspect, Category, Cliques, Memory, Sink, State};

/// The damping of beams by the mass of their sections.
#[derive(Clone, Debug)]
pub struct BeamMassDamping {
    /// alpha, one over a time
    pub factor: f64,
    /// Elements by the mass properties of their points
    pub elements: VolumeElements<Inertia>,
}

impl Effect for BeamMassDamping {
    fn name(&self) -> &'static str {
        "mass-proportional damping of beams"
    }

    fn category(&self) -> Category {
        Category::Damping
    }

    fn cliques(&self) -> Cliques {
        self.elements.cliques(Blocks::Both)
    }

    fn aspects(&self, show: &mut dyn FnMut(Aspect)) {
        self.elements.each_quantity(|inertia| inertia_aspects(inertia, show));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        self.elements.add(&Drag { factor: self.factor }, at, weights, out);
    }
}

/// The damping of bodies by their mass.
#[derive(Clone, Debug)]
pub struct BodyMassDamping {
    /// alpha, one over a time
    pub factor: f64,
    /// The bodies
    pub bodies: Vec<Body>,
}

impl Effect for BodyMassDamping {
    fn name(&self) -> &'static str {
        "mass-proportional damping of bodies"
    }

    fn category(&self) -> Category {
        Category::Damping
    }

    fn cliques(&self) -> Cliques {
        let mut cliques = Cliques::divisible();
        self.bodies.iter().for_each(|body| cliques.push([body.node.u, body.node.p]));
        cliques
    }

    fn aspects(&self, show: &mut dyn FnMut(Aspect)) {
        self.bodies.iter().for_each(|body| inertia_aspects(&body.inertia, show));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        let mut system = ElementSystem::new(2);
        for k in out.instances() {
            let body = &self.bodies[k];
            let velocity = at.v[body.node.u as usize];
            let force = drag(&body.inertia, velocity, &at.spin(body.node.p), self.factor, weights);
            force.write(weights, &mut system);
            out.add(k, &system);
        }
    }
}
