//! Linear stages: forces are linearised about the state at the start of the stage,
//! without displacements and rates.
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

/// The matrices of a linear stage.
pub struct LinearisedSystem {
    /// The state of linearisation, at rest, with the clock and the loads of the start of the stage
    pub(crate) origin: State,
    /// The state of linearisation, at rest, with the present clock and loads
    pub(crate) about: State,
    /// The slots of multipliers, whose rates have no forces
    multipliers: Vec<Slot>,
    /// The system of all directions, held ones included, which have reactions and prescribed
    /// motions
    whole: System,
    stiffness: Vec<f64>,
    damping: Vec<f64>,
    mass: Vec<f64>,
    /// The weights of the last tangent, and the revision of the system at that time
    pub(crate) formed: Option<(Weights, u64)>,
}

impl LinearisedSystem {
    /// The matrices of effects about a state. `Err` cannot happen, since no directions are held.
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
        let stiffness = matrix(Weights::STIFFNESS);
        let damping = matrix(Weights::DAMPING);
        let mass = matrix(Weights::MASS);
        let about = origin.clone();
        let multipliers = model.multipliers.clone();
        Ok(Self { origin, about, multipliers, whole, stiffness, damping, mass, formed: None })
    }

    /// Takes the clock and the amplitudes of loads from a state.
    pub fn follow(&mut self, state: &State) {
        self.about.time = state.time;
        self.about.load = state.load;
        self.about.amplitude.copy_from_slice(&state.amplitude);
        self.about.amplitude_rates.copy_from_slice(&state.amplitude_rates);
    }

    /// Adds the forces of displacements from the state of linearisation, of velocities and of
    /// accelerations.
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
            // Rows of multipliers in the mass matrix are conditions on accelerations, not forces.
            self.multipliers.iter().for_each(|&slot| rates[slot as usize] = Vec3::ZERO);
            let force = &mut force[category as usize];
            let kept: Vec<Vec3> = self.multipliers.iter().map(|&slot| force[slot as usize]).collect();
            self.add_part(values, &rates, force);
            self.multipliers.iter().zip(kept).for_each(|(&slot, kept)| force[slot as usize] = kept);
        }
    }

    fn add_part(&self, values: &[f64], field: &[Vec3], force: &mut [Vec3]) {
        // Without held directions the equations are the components of the slots, one after the
        // other.
        let x: Vec<f64> = field.iter().flat_map(|v| v.0).collect();
        let product = self.whole.multiply(values, &x);
        for (force, part) in force.iter_mut().zip(product.as_chunks::<3>().0) {
            *force += Vec3(*part);
        }
    }
}
