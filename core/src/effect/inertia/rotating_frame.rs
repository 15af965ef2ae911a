//! Inertia as seen from a frame that turns steadily: centrifugal and Coriolis forces, gyroscopic
//! moments of sections.
//!
//! It stands for all inertia of its stage: of steady states, and of small motions about them.

use super::inertia_mirror_data;
use super::rigid_body::Body;
use crate::effect::{Effect, Roles, TangentForm, VolumeElements, own_part};
use crate::kernel::inertia::{Inertia, SteadilyTurned, steadily_turned};
use crate::kernel::volume::Blocks;
use crate::kernel::{ElementSystem, Weights};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, StageContext, State};
use crate::tensor::Vec3;

/// All mass of the scene in one stage's frame.
#[derive(Clone, Debug)]
pub struct RotatingFrame {
    /// The stage it belongs to, from 0
    pub stage: usize,
    /// Angular velocity of the frame
    pub spin: Vec3,
    /// A point on its axis
    pub about: Vec3,
    /// The number of the amplitude with which a static stage brings the spin in; `None`: in full
    pub amplitude: Option<usize>,
    /// Beams by the mass properties and initial places of their points
    pub elements: VolumeElements<(Inertia, Vec3)>,
    /// Bodies, and what relative beams have at their nodes
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
