//! Stages that are linear in the displacements: forces and tangent of the state in which a stage begins, and no others.
//!
//! ```text
//! g(q, v, a, t) = g(q0, 0, 0, t) + K0 (q - q0) + C0 v + M0 a
//! ```

use super::Model;
use crate::effect::Effect;
use crate::kernel::Weights;
use crate::system::{Category, Cliques, Equations, FrameConflict, Layout, Memory, Pattern, State, System};
use crate::tensor::Vec3;
use std::sync::Arc;

/// The matrices of a stage.
pub struct Linear {
    /// The state about which everything is linear, at rest; its clock follows that of the run.
    pub about: State,
    /// All directions, the held ones too: they have forces, and motions that are prescribed
    whole: System,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    mass: Vec<f64>,
    /// Those that the tangent was last formed with, and its revision then
    pub formed: Option<(Weights, u64)>,
}

impl Linear {
    /// Of what acts about a state. `Err` never happens without held directions.
    pub fn new(effects: &[Arc<dyn Effect>], model: &Model, about: &State) -> Result<Self, FrameConflict> {
        let slots = model.slots.len();
        let cliques: Vec<Cliques> = effects.iter().map(|effect| effect.cliques()).collect();
        let pattern = Pattern::new(Equations::new(slots, &[])?, model.groups(Layout::Spatial), cliques);
        let mut about = about.clone();
        about.stand_still();
        let mut whole = System::new(pattern, slots, false);
        let mut matrix = |weights: Weights| {
            whole.clear(None);
            let forget = Memory::default();
            for (number, effect) in effects.iter().enumerate().filter(|(_, effect)| effect.has_tangent()) {
                effect.add(&about, &forget, weights, &mut whole.sink(number, effect.category(), true));
            }
            whole.values.clone()
        };
        let (stiffness, damping, mass) = (matrix(Weights::STIFFNESS), matrix(Weights::DAMPING), matrix(Weights::MASS));
        Ok(Self { about, whole, stiffness, damping, mass, formed: None })
    }

    /// Takes the clock, and the amplitudes that belong to it, from a state.
    pub fn follow(&mut self, state: &State) {
        (self.about.time, self.about.load) = (state.time, state.load);
        self.about.amplitude.copy_from_slice(&state.amplitude);
        self.about.amplitude_rates.copy_from_slice(&state.amplitude_rates);
    }

    /// Adds what displacements, velocities and accelerations bring to the forces.
    pub fn add_forces(&self, state: &State, force: &mut [Vec<Vec3>; 4]) {
        let displaced: Vec<Vec3> = state.q.iter().zip(&self.about.q).map(|(q, q0)| *q - *q0).collect();
        let parts = [
            (&self.stiffness, &displaced, Category::Internal),
            (&self.damping, &state.v, Category::Damping),
            (&self.mass, &state.a, Category::Inertia),
        ];
        for (values, field, category) in parts {
            // Without held directions the equations are the components of the slots, one after the other.
            let x: Vec<f64> = field.iter().flat_map(|v| v.0).collect();
            let product = self.whole.multiply(values, &x);
            for (force, part) in force[category as usize].iter_mut().zip(product.as_chunks::<3>().0) {
                *force += Vec3(*part);
            }
        }
    }
}
