//! Stages that are linear in the displacements: forces and tangent of the state in which a stage
//! begins, and no others.
//!
//! ```text
//! g(q, v, a, t) = g(q0, 0, 0, t) + K0 (q - q0) + C0 v + M0 a
//! ```

use super::Model;
use crate::effect::Effect;
use crate::kernel::Weights;
use crate::system::{
    Category, Connectivity, DofMap, FrameConflict, Layout, Memory, Pattern, Slot, State, Symmetry, System,
};
use crate::tensor::Vec3;

/// The matrices of a stage.
pub struct Linear {
    /// The state about which everything is linear, at rest, with the loads that it has there
    pub origin: State,
    /// The state about which everything is linear, with a clock that follows that of the run
    pub about: State,
    /// The slots of multipliers, which have no rates
    multipliers: Vec<Slot>,
    /// All directions, the held ones too: they have forces, and motions that are prescribed
    whole: System,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    mass: Vec<f64>,
    /// The weights that the tangent was last formed with, and its revision then
    pub formed: Option<(Weights, u64)>,
}

impl Linear {
    /// The matrices of these effects about a state. `Err` never happens without held directions.
    pub fn new<'e>(
        effects: impl Iterator<Item = &'e dyn Effect>,
        model: &Model,
        about: &State,
    ) -> Result<Self, FrameConflict> {
        let effects: Vec<&dyn Effect> = effects.collect();
        let slots = model.slots();
        let connectivity: Vec<Connectivity> = effects.iter().map(|effect| effect.connectivity()).collect();
        let pattern =
            Pattern::new(DofMap::new(slots, &[])?, model.node_blocks(Layout::Spatial), connectivity, Symmetry::None);
        let mut origin = about.clone();
        origin.stand_still();
        let mut whole = System::new(pattern, slots, &Category::ALL, &[]);
        let mut matrix = |weights: Weights| {
            whole.clear(None);
            let forget = Memory::default();
            for (number, effect) in effects.iter().enumerate().filter(|(_, effect)| effect.tangent().exists()) {
                effect.add(&origin, &forget, weights, &mut whole.assembler(number, effect.category(), true));
            }
            whole.values.clone()
        };
        let (stiffness, damping, mass) = (matrix(Weights::STIFFNESS), matrix(Weights::DAMPING), matrix(Weights::MASS));
        let (about, multipliers) = (origin.clone(), model.multipliers.clone());
        Ok(Self { origin, about, multipliers, whole, stiffness, damping, mass, formed: None })
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
        self.add_part(&self.stiffness, &displaced, &mut force[Category::Internal as usize]);
        self.add_rates(state, force);
    }

    /// Adds the forces of velocities and accelerations alone.
    pub fn add_rates(&self, state: &State, force: &mut [Vec<Vec3>; 4]) {
        for (values, field, category) in
            [(&self.damping, &state.v[..], Category::Damping), (&self.mass, &state.a[..], Category::Inertia)]
        {
            let mut rates = field.to_vec();
            // Joints show the mass matrix their conditions for accelerations, which are no forces.
            self.multipliers.iter().for_each(|&slot| rates[slot as usize] = Vec3::ZERO);
            let force = &mut force[category as usize];
            let kept: Vec<Vec3> = self.multipliers.iter().map(|&slot| force[slot as usize]).collect();
            self.add_part(values, &rates, force);
            self.multipliers.iter().zip(kept).for_each(|(&slot, kept)| force[slot as usize] = kept);
        }
    }

    fn add_part(&self, values: &[f64], field: &[Vec3], force: &mut [Vec3]) {
        // Without held directions the equations are the components of the slots, one after the other.
        let x: Vec<f64> = field.iter().flat_map(|v| v.0).collect();
        let product = self.whole.multiply(values, &x);
        for (force, part) in force.iter_mut().zip(product.as_chunks::<3>().0) {
            *force += Vec3(*part);
        }
    }
}
