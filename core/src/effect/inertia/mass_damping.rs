//! The mass part of Rayleigh damping, alpha M qd, of beams and bodies.

use super::inertia_mirror_data;
use super::rigid_body::Body;
use crate::effect::{Effect, Roles, TangentForm, VolumeElements};
use crate::kernel::inertia::{Drag, Inertia, drag};
use crate::kernel::volume::Blocks;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, State};
use crate::tensor::Vec3;

/// Mass-proportional damping of beams.
#[derive(Clone, Debug)]
pub struct BeamMassDamping {
    /// alpha, 1/time
    pub factor: f64,
    /// The elements, with the mass properties of their points per length
    pub elements: VolumeElements<Inertia>,
}

impl Effect for BeamMassDamping {
    fn name(&self) -> &'static str {
        "mass-proportional damping of beams"
    }

    fn category(&self) -> Category {
        Category::Damping
    }

    fn connectivity(&self) -> Connectivity {
        self.elements.connectivity(Blocks::Both)
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::General
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        self.elements.each_quantity(|inertia| inertia_mirror_data(inertia, show));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        self.elements.add(&Drag { factor: self.factor }, at, weights, out);
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}

/// Mass-proportional damping of bodies.
#[derive(Clone, Debug)]
pub struct BodyMassDamping {
    /// alpha, 1/time
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

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::divisible();
        self.bodies.iter().for_each(|body| connectivity.push([body.node.u, body.node.p]));
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::General
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        self.bodies.iter().for_each(|body| inertia_mirror_data(&body.inertia, show));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let mut system = ElementSystem::new(2);
        for k in out.instances() {
            let body = &self.bodies[k];
            let velocity = at.v[body.node.u as usize];
            let force = drag(&body.inertia, velocity, &at.spin(body.node.p), self.factor, weights);
            force.write(weights, &mut system);
            out.add(k, &system);
        }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}
