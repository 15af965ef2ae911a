//! Inertia of beam sections with a full 6x6 mass matrix: the mass centre lies off the centre line,
//! or J couples.

use super::{inertia_mirror_data, rigid_body};
use crate::effect::volume::VolumeElements;
use crate::effect::{Effect, Energy, Masses, Momentum, Roles, TangentForm};
use crate::kernel::inertia::{Eccentric, Inertia};
use crate::kernel::volume::Blocks;
use crate::kernel::{NodeMotion, Weights};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, State};
use crate::tensor::Vec3;

/// The inertia of all beam elements with eccentric mass.
#[derive(Clone, Debug, Default)]
pub struct SectionInertia {
    /// The elements, with the mass properties of their points per length
    pub elements: VolumeElements<Inertia>,
    /// True if gyroscopic and centrifugal forces count
    pub gyroscopic: bool,
}

impl Effect for SectionInertia {
    fn name(&self) -> &'static str {
        "eccentric section inertia"
    }

    fn category(&self) -> Category {
        Category::Inertia
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
        self.elements.add(&Eccentric { gyroscopic: self.gyroscopic }, at, weights, out);
    }

    fn energy(&self, at: &State) -> Energy {
        let mut kinetic = 0.0;
        let energy = |sum: &mut f64, inertia: &Inertia, w: f64, _, motion: &NodeMotion| {
            *sum += w * rigid_body::kinetic(inertia, motion);
        };
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

impl Masses for SectionInertia {
    fn momentum(&self, at: &State) -> Momentum {
        let mut sum = Momentum::default();
        let momentum = |sum: &mut Momentum, inertia: &Inertia, w: f64, place, motion: &NodeMotion| {
            sum.add(rigid_body::momentum(inertia, place, motion, w));
        };
        self.elements.sum(at, momentum, |part| sum.add(part));
        sum
    }
}
