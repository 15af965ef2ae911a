//! Weight of beams and bodies: spatial forces at their mass centres.

use crate::effect::inertia::{Body, inertia_mirror_data};
use crate::effect::volume::VolumeElements;
use crate::effect::{Effect, Roles, TangentForm};
use crate::kernel::inertia::Inertia;
use crate::kernel::load::{Weight, offset_force};
use crate::kernel::volume::Blocks;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, State};
use crate::tensor::Vec3;

/// The weight of all beams. Elements with mass on the centre line have no tangent.
#[derive(Clone, Debug)]
pub struct BeamGravity {
    /// The acceleration of gravity at an amplitude of one, spatial
    pub acceleration: Vec3,
    /// The index of its amplitude
    pub amplitude: usize,
    /// The elements, with the mass properties of their points per length
    pub elements: VolumeElements<Inertia>,
}

impl Effect for BeamGravity {
    fn name(&self) -> &'static str {
        "gravity on beams"
    }

    fn category(&self) -> Category {
        Category::External
    }

    fn connectivity(&self) -> Connectivity {
        self.elements.connectivity(Blocks::Both)
    }

    fn tangent(&self) -> TangentForm {
        if self.elements.any(|inertia| inertia.offset != Vec3::ZERO) {
            TangentForm::Symmetric
        } else {
            TangentForm::None
        }
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        show(MirrorData::Vector(self.acceleration));
        self.elements.each_quantity(|inertia| inertia_mirror_data(inertia, show));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let acceleration = self.acceleration * at.amplitude[self.amplitude];
        self.elements.add(&Weight { acceleration }, at, weights, out);
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}

/// The weight of all bodies.
#[derive(Clone, Debug)]
pub struct BodyGravity {
    /// The acceleration of gravity at an amplitude of one, spatial
    pub acceleration: Vec3,
    /// The index of its amplitude
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

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::divisible();
        self.bodies.iter().for_each(|body| connectivity.push([body.node.u, body.node.p]));
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        if self.bodies.iter().any(|body| body.inertia.offset != Vec3::ZERO) {
            TangentForm::Symmetric
        } else {
            TangentForm::None
        }
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        show(MirrorData::Vector(self.acceleration));
        self.bodies.iter().for_each(|body| inertia_mirror_data(&body.inertia, show));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
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

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}
