//! Translational inertia of beams without eccentric mass: the consistent mass matrix, free of charts.

use super::planar_inertia::PlanarMass;
use super::volume::VolumeElements;
use super::{Effect, Energy, Momentum, PlanarForm};
use crate::kernel::Weights;
use crate::kernel::inertia::Translation;
use crate::kernel::volume::Blocks;
use crate::system::{Aspect, Category, Cliques, Memory, Plane, Sink, State};
use std::sync::Arc;

/// All beam elements with mass on their centre line, by their mass per length.
#[derive(Clone, Debug, Default)]
pub struct BeamMass {
    /// The elements
    pub elements: VolumeElements<f64>,
}

impl Effect for BeamMass {
    fn name(&self) -> &'static str {
        "beam mass"
    }

    fn category(&self) -> Category {
        Category::Inertia
    }

    fn cliques(&self) -> Cliques {
        self.elements.cliques(Blocks::Displacements)
    }

    fn is_symmetric(&self) -> bool {
        true
    }

    fn aspects(&self, _show: &mut dyn FnMut(Aspect)) {
        // On the centre line, which the beams' elasticity shows.
    }

    fn in_plane(self: Arc<Self>, plane: &Plane) -> Option<Box<dyn PlanarForm>> {
        Some(Box::new(PlanarMass::new(self, *plane)))
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        self.elements.add(&Translation, at, weights, out);
    }

    fn energy(&self, at: &State) -> Energy {
        let mut kinetic = 0.0;
        self.elements.each_velocity(at, |mass, w, velocity| kinetic += 0.5 * w * mass * velocity.squared());
        Energy { kinetic, strain: 0.0 }
    }

    fn momentum(&self, at: &State) -> Momentum {
        let mut sum = Momentum::ZERO;
        self.elements.each_point(at, |mass, w, place, motion| {
            let (mass, x) = (mass * w, place + motion.u);
            let linear = motion.u_rate * mass;
            sum.add(Momentum { mass, moment: x * mass, linear, angular: x.cross(linear) });
        });
        sum
    }
}
