//! Inertia of beam sections with a full 6x6 mass: the mass centre lies off the centre line, or J couples.

use super::volume::VolumeElements;
use super::{Effect, Energy, Momentum, inertia_mirror_data, rigid_body};
use crate::kernel::inertia::{Eccentric, Inertia};
use crate::kernel::volume::Blocks;
use crate::kernel::{NodeMotion, Weights};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, State};

/// All beam elements with eccentric mass, by their mass properties per length.
#[derive(Clone, Debug, Default)]
pub struct SectionInertia {
    /// The elements
    pub elements: VolumeElements<Inertia>,
    /// Whether forces that spins have without accelerations count
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

    fn momentum(&self, at: &State) -> Momentum {
        let mut sum = Momentum::default();
        let momentum = |sum: &mut Momentum, inertia: &Inertia, w: f64, place, motion: &NodeMotion| {
            sum.add(rigid_body::momentum(inertia, place, motion, w));
        };
        self.elements.sum(at, momentum, |part| sum.add(part));
        sum
    }
}
