//! Inertia in a frame that turns steadily: centrifugal and Coriolis forces, gyroscopic moments of
//! sections.
//!
//! It replaces all other inertia of its stage, for steady states and small motions about them.

use super::inertia_mirror_data;
use super::rigid_body::Body;
use crate::effect::{Effect, Roles, TangentForm, VolumeElements, own_part};
use crate::kernel::inertia::{Inertia, SteadilyTurned, steadily_turned};
use crate::kernel::volume::Blocks;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, StageContext, State};
use crate::tensor::Vec3;

/// The inertia of all mass of the scene in the rotating frame of a stage.
#[derive(Clone, Debug)]
pub struct RotatingFrame {
    /// The number of its stage, from 0
    pub stage: usize,
    /// The angular velocity of the frame, spatial, 1/time
    pub spin: Vec3,
    /// A point on the axis of the frame
    pub about: Vec3,
    /// The index of the amplitude by which a static stage increases the spin; `None` for the full
    /// spin
    pub amplitude: Option<usize>,
    /// Beam elements, with the mass properties per length and the initial places of their points
    pub elements: VolumeElements<(Inertia, Vec3)>,
    /// Bodies, and the lumped section inertia of beams with relative rotations
    pub bodies: Vec<Body>,
}

impl Effect for RotatingFrame {
    fn name(&self) -> &'static str {
        "rotating frame"
    }

    fn category(&self) -> Category {
        Category::Inertia
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = self.elements.connectivity(Blocks::Both);
        self.bodies.iter().for_each(|body| connectivity.push([body.node.u, body.node.p]));
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::General
    }

    fn acts(&self, stage: &StageContext) -> bool {
        stage.number == self.stage
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        show(MirrorData::Axial(self.spin));
        self.elements.each_quantity(|(inertia, _)| inertia_mirror_data(inertia, show));
        self.bodies.iter().for_each(|body| inertia_mirror_data(&body.inertia, show));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let spin = self.spin * self.amplitude.map_or(1.0, |number| at.amplitude[number]);
        self.elements.add(&SteadilyTurned { spin, about: self.about }, at, weights, out);
        let first = self.elements.two.len() + self.elements.three.len() + self.elements.four.len();
        let mut system = ElementSystem::new(2);
        for k in own_part(first, self.bodies.len(), &out.instances()) {
            let body = &self.bodies[k];
            let from_axis = body.place - self.about + at.q[body.node.u as usize];
            let force = steadily_turned(&body.inertia, spin, from_axis, &at.rotation(body.node.p), weights);
            force.write(weights, &mut system);
            out.add(first + k, &system);
        }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}
