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

/// A steady rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameMotion {
    /// The angular velocity, spatial, 1/time
    pub spin: Vec3,
    /// A point on the axis
    pub about: Vec3,
}

/// How a static stage comes to the motion of its frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameRamp {
    /// The motion that it begins with
    pub from: FrameMotion,
    /// The index of the amplitude that goes from 0 to 1 on the way
    pub amplitude: usize,
}

/// The inertia of all mass of the scene in the rotating frame of a stage.
#[derive(Clone, Debug)]
pub struct RotatingFrame {
    /// The number of its stage, from 0
    pub stage: usize,
    /// The motion of the frame
    pub motion: FrameMotion,
    /// The way to it; `None` if it is there from the start
    pub ramp: Option<FrameRamp>,
    /// Beam elements, with the mass properties per length and the initial places of their points
    pub elements: VolumeElements<(Inertia, Vec3)>,
    /// Bodies, and the lumped section inertia of beams with relative rotations
    pub bodies: Vec<Body>,
}

impl RotatingFrame {
    /// The motion in a state: on the way spin and axis are linear in the amplitude.
    fn motion_at(&self, at: &State) -> FrameMotion {
        let FrameMotion { spin, about } = self.motion;
        let Some(FrameRamp { from, amplitude }) = self.ramp else { return self.motion };
        let left = 1.0 - at.amplitude[amplitude];
        FrameMotion { spin: spin + (from.spin - spin) * left, about: about + (from.about - about) * left }
    }
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
        show(MirrorData::Axial(self.motion.spin));
        self.ramp.iter().for_each(|ramp| show(MirrorData::Axial(ramp.from.spin)));
        self.elements.each_quantity(|(inertia, _)| inertia_mirror_data(inertia, show));
        self.bodies.iter().for_each(|body| inertia_mirror_data(&body.inertia, show));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let FrameMotion { spin, about } = self.motion_at(at);
        self.elements.add(&SteadilyTurned { spin, about }, at, weights, out);
        let first = self.elements.two.len() + self.elements.three.len() + self.elements.four.len();
        let mut system = ElementSystem::new(2);
        for k in own_part(first, self.bodies.len(), &out.instances()) {
            let body = &self.bodies[k];
            let from_axis = body.place - about + at.q[body.node.u as usize];
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
