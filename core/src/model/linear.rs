//! Linear stages: forces are linearised about the state at the start of the stage,
//! without displacements and rates.
//!
//! ```text
//! g(q, v, a, t) = g(q0, 0, 0, t) + K0 (q - q0) + C0 v + M0 a
//! ```
//!
//! The internal part of these forces has the energy
//!
//! ```text
//! U(q, t) = U(q0, t) + f(q0, t).(q - q0) + (q - q0).K0 (q - q0)/2
//! ```

use super::Model;
use crate::effect::{Effect, Energy};
use crate::kernel::Weights;
use crate::system::{
    Category, Connectivity, DofMap, FrameConflict, Layout, Memory, Pattern, Slot, State, Symmetry, System,
};
use crate::tensor::{Vec3, zeros};

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
    /// The stiffness of the effects of each category that have some
    stiffness: Vec<(Category, Vec<f64>)>,
    damping: Vec<f64>,
    mass: Vec<f64>,
    /// The weights of the last tangent, and the revision of the system at that time
    pub(crate) formed: Option<(Weights, u64)>,
}

impl LinearisedSystem {
    /// The matrices of effects about a state, with the stresses of geometric parts that each
    /// remembers. `Err` cannot happen, since no directions are held.
    pub fn new<'e>(
        effects: impl Iterator<Item = (&'e dyn Effect, &'e Memory)>,
        model: &Model,
        about: &State,
    ) -> Result<Self, FrameConflict> {
        let (effects, memories): (Vec<&dyn Effect>, Vec<&Memory>) = effects.unzip();
        let slots = model.slots();
        let connectivity: Vec<Connectivity> = effects.iter().map(|effect| effect.connectivity()).collect();
        let pattern =
            Pattern::new(DofMap::new(slots, &[])?, model.node_blocks(Layout::Spatial), connectivity, Symmetry::None);
        let mut origin = about.clone();
        origin.stand_still();
        let mut whole = System::new(pattern, slots, &Category::ALL, &[]);
        let mut matrix = |weights: Weights, categories: &[Category]| {
            whole.clear(None);
            let belongs = |effect: &dyn Effect| effect.tangent().exists() && categories.contains(&effect.category());
            for (number, effect) in effects.iter().enumerate().filter(|(_, effect)| belongs(**effect)) {
                effect.add(&origin, memories[number], weights, &mut whole.assembler(number, effect.category(), true));
            }
            whole.values.clone()
        };
        let present = |category: &Category| effects.iter().any(|effect| effect.category() == *category);
        let mut stiffness = Vec::new();
        for category in Category::ALL.into_iter().filter(present) {
            let values = matrix(Weights::STIFFNESS, &[category]);
            if values.iter().any(|&value| value != 0.0) {
                stiffness.push((category, values));
            }
        }
        let damping = matrix(Weights::DAMPING, &Category::ALL);
        let mass = matrix(Weights::MASS, &Category::ALL);
        let about = origin.clone();
        let multipliers = model.multipliers.clone();
        Ok(Self { origin, about, multipliers, whole, stiffness, damping, mass, formed: None })
    }

    /// Takes the clock and the amplitudes of loads from a state.
    pub fn follow(&mut self, state: &State) {
        set_clock(&mut self.about, state);
    }

    /// The state of linearisation, at rest, with the clock and the loads of another state.
    pub fn origin_with_loads_of(&self, state: &State) -> State {
        let mut origin = self.origin.clone();
        set_clock(&mut origin, state);
        origin
    }

    /// The energies of a state with the internal forces `internal`.
    pub fn energy(&self, model: &Model, state: &State, internal: &[Vec3]) -> Energy {
        let mut origin = self.origin_with_loads_of(state);
        origin.v.copy_from(&state.v);
        let mut energy = model.energy(&origin);
        let displaced = self.displaced(state);
        let mut elastic = zeros(displaced.len());
        self.add_stiffness(Category::Internal, &displaced, &mut elastic);
        // f(q0).dq + dq.K0 dq/2, from the forces f(q0) + K0 dq of the state
        let forces = internal.iter().zip(&elastic).map(|(&force, &elastic)| force - elastic * 0.5);
        energy.strain += forces.zip(&displaced).map(|(force, &dq)| force.dot(dq)).sum::<f64>();
        energy
    }

    /// q - q0 by slot.
    fn displaced(&self, state: &State) -> Vec<Vec3> {
        state.q.iter().zip(&self.origin.q).map(|(q, q0)| *q - *q0).collect()
    }

    fn add_stiffness(&self, of: Category, displaced: &[Vec3], force: &mut [Vec3]) {
        for (_, values) in self.stiffness.iter().filter(|(category, _)| *category == of) {
            self.add_part(values, displaced, force);
        }
    }

    /// Adds the forces of displacements from the state of linearisation, of velocities and of
    /// accelerations.
    pub fn add_forces(&self, state: &State, force: &mut [Vec<Vec3>; 4]) {
        let displaced = self.displaced(state);
        for category in Category::ALL {
            self.add_stiffness(category, &displaced, &mut force[category as usize]);
        }
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

/// Takes the clock and the amplitudes of loads from another state.
fn set_clock(state: &mut State, of: &State) {
    state.time = of.time;
    state.load = of.load;
    state.amplitude.copy_from_slice(&of.amplitude);
    state.amplitude_rates.copy_from_slice(&of.amplitude_rates);
}
