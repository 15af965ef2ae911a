//! Motions that nothing holds: mechanisms and loose parts.

use super::convergence::correction;
use super::linear::LinearSolver;
use super::softest::NullVector;
use crate::model::{Assembly, Model};
use crate::system::State;

/// The softest motion of a tangent.
pub struct Limp {
    /// The motion
    pub vector: NullVector,
    /// The largest strain that it makes, see [`crate::effect::Effect::strain_of`], over the size of the motion
    pub strain: f64,
    /// Whether it is a motion, not the multiplier of a joint
    moves: bool,
}

/// A motion that something holds strains it by about its own size; what round-off makes of one that nothing holds is smaller
/// than this, up to condition numbers of 1e13.
const NO_STRAIN: f64 = 1e-3;

impl Limp {
    /// The softest motion of the tangent that `solver` has tried to factorise.
    pub fn find(solver: &mut LinearSolver, assembly: &Assembly, model: &Model, state: &State) -> Option<Self> {
        let vector = solver.softest(&assembly.system)?;
        let (largest, motion) = vector.by_slot(&assembly.system.pattern.equations, state.q.len());
        // What moves may be the multiplier of a condition that is said twice: no strain stands in its way.
        let moves = !model.slots[largest].is_multiplier();
        let size = if moves { correction(model, &motion) } else { 0.0 };
        let strain = if size > 0.0 { assembly.strain_of(state, &motion, model.length) / size } else { 0.0 };
        Some(Self { vector, strain, moves })
    }

    /// Whether nothing holds it. Very slender beams on fine meshes bend so softly that their stiffness is lost in the tangent,
    /// but they bend.
    pub fn is_loose(&self) -> bool {
        !self.vector.held && self.strain <= NO_STRAIN
    }

    /// Whether its stiffness is lost in the tangent, although something holds it.
    pub fn is_soft(&self) -> bool {
        !self.vector.held && self.strain > NO_STRAIN
    }

    /// Whether it strains nothing, and only stress that is there already holds it, as a hanging pendulum.
    pub fn is_held_by_stress(&self) -> bool {
        self.vector.held && self.moves && self.strain <= NO_STRAIN
    }
}

/// A motion that nothing holds, of a tangent that `solver` has tried to factorise.
pub fn mechanism(solver: &mut LinearSolver, assembly: &Assembly, model: &Model, state: &State) -> Option<NullVector> {
    Limp::find(solver, assembly, model, state).filter(Limp::is_loose).map(|limp| limp.vector)
}
