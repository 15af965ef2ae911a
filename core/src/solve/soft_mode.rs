//! Motions that nothing holds: mechanisms and loose parts.

use super::convergence::size;
use super::linear::LinearSolver;
use super::softest::NullVector;
use super::tangent::Tangent;
use crate::model::Model;

/// The softest motion of a tangent.
pub struct SoftMode {
    /// The motion
    pub vector: NullVector,
    /// It strains what it moves.
    strains: bool,
    /// True if it is a motion, not the multiplier of a joint
    moves: bool,
}

/// A motion that something holds strains it by about its own size; what round-off makes of one that
/// nothing holds is smaller than this, up to condition numbers of 1e13.
const NO_STRAIN: f64 = 1e-3;

impl SoftMode {
    /// The softest motion of a tangent; one that stays is the one that `solver` has tried to
    /// factorise. Whether it strains is asked where the tangent has no stiffness against it, or
    /// else where `stress` may be all that holds it.
    pub fn find(solver: &mut LinearSolver, tangent: &mut Tangent, model: &Model, stress: bool) -> Option<Self> {
        let vector = solver.softest(tangent)?;
        let (assembly, state) = (tangent.assembly(), tangent.state());
        if vector.held && !stress {
            return Some(Self { vector, strains: true, moves: true });
        }
        let (largest, motion) = vector.by_slot(&assembly.system.pattern.dof_map, state.q.len());
        // What moves may be the multiplier of a condition that is said twice: no strain stands in
        // its way.
        let moves = !model.kinds[largest].is_multiplier();
        let size = if moves { size(model, &motion) } else { 0.0 };
        let strains = size > 0.0 && assembly.strain_of(state, &motion, model.length) > NO_STRAIN * size;
        Some(Self { vector, strains, moves })
    }

    /// True if nothing holds it. Very slender beams on fine meshes bend so softly that their
    /// stiffness is lost in the tangent, but they bend.
    pub fn is_loose(&self) -> bool {
        !self.vector.held && !self.strains
    }

    /// True if its stiffness is lost in the tangent, although something holds it.
    pub fn is_soft(&self) -> bool {
        !self.vector.held && self.strains
    }

    /// True if it strains nothing, and only stress that is there already holds it, as a hanging
    /// pendulum. Known only where that was asked for.
    pub fn is_held_by_stress(&self) -> bool {
        self.vector.held && self.moves && !self.strains
    }
}

/// A motion that nothing holds, of a tangent; see [`SoftMode::find`].
pub fn mechanism(solver: &mut LinearSolver, tangent: &mut Tangent, model: &Model) -> Option<NullVector> {
    SoftMode::find(solver, tangent, model, false).filter(SoftMode::is_loose).map(|soft_mode| soft_mode.vector)
}
