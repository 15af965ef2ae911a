//! Rotary inertia of beam sections without eccentric mass: mass, gyroscopic and centrifugal terms
//! (Makinen 2007, equations (51), (52), (68)–(71)).

use crate::effect::volume::VolumeElements;
use crate::effect::{Effect, Energy, Masses, Momentum, Roles, TangentForm, quadratic};
use crate::kernel::inertia::Rotary;
use crate::kernel::volume::Blocks;
use crate::kernel::{NodeMotion, Weights};
use crate::rotation::Rotation;
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, State};
use crate::tensor::{Mat3, Vec3};

/// The rotary inertia of all beam elements without eccentric mass.
#[derive(Clone, Debug, Default)]
pub struct RotaryInertia {
    /// The elements, with J per length at their points, in global components of the initial
    /// placement
    pub elements: VolumeElements<Mat3>,
    /// True if gyroscopic forces count
    pub gyroscopic: bool,
}

impl Effect for RotaryInertia {
    fn name(&self) -> &'static str {
        "rotary inertia"
    }

    fn category(&self) -> Category {
        Category::Inertia
    }

    fn connectivity(&self) -> Connectivity {
        self.elements.connectivity(Blocks::Rotations)
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::General
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        self.elements.each_quantity(|j| show(MirrorData::Tensor(*j)));
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        self.elements.add(&Rotary { gyroscopic: self.gyroscopic }, at, weights, out);
    }

    fn energy(&self, at: &State) -> Energy {
        let mut kinetic = 0.0;
        let energy =
            |sum: &mut f64, j: &Mat3, w: f64, _, motion: &NodeMotion| *sum += w * quadratic(*j, spin(motion).1);
        self.elements.sum(at, energy, |part| kinetic += part);
        Energy { kinetic, strain: 0.0 }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles { masses: Some(self), ..Roles::NONE }
    }
}

impl Masses for RotaryInertia {
    fn momentum(&self, at: &State) -> Momentum {
        let mut angular = Vec3::ZERO;
        let momentum = |sum: &mut Vec3, j: &Mat3, w: f64, _, motion: &NodeMotion| {
            let (rotation, omega) = spin(motion);
            *sum += rotation.r * (*j * omega) * w;
        };
        self.elements.sum(at, momentum, |part| angular += part);
        Momentum { angular, ..Momentum::default() }
    }
}

/// The rotation R and the material spin Omega of a motion.
fn spin(motion: &NodeMotion) -> (Rotation, Vec3) {
    let rotation = Rotation::new(motion.p);
    (rotation, rotation.t * motion.p_rate)
}
