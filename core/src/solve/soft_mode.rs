//! Softest motions of a tangent: mechanisms and loose parts.

use super::convergence::size;
use super::linear::LinearSolver;
use super::softest::NullVector;
use super::tangent::Tangent;
use crate::model::{Model, SlotKind};
use crate::system::Slot;
use crate::tensor::Vec3;

/// The softest motion of a tangent, with its strain.
pub struct SoftMode {
    /// The motion
    pub(crate) vector: NullVector,
    /// True if the motion causes strain
    strains: bool,
    /// True if the motion moves nodes most, not the multiplier of a joint
    moves: bool,
    /// True if the motion opens joints; known where strain was computed and is none
    opens: bool,
}

/// Strain relative to the size of a motion, below which it is a rigid motion. Motions with
/// stiffness strain by about their own size; round-off in motions without any causes less than
/// this, up to condition numbers of 1e13.
const RIGID_STRAIN_RATIO: f64 = 1e-3;

impl SoftMode {
    /// Finds the softest motion of a tangent. A tangent that stays must be the one that `solver`
    /// has tried to factorise last. Strain is computed if the tangent has no stiffness against the
    /// motion, or if `stress` may be the only cause of that stiffness; otherwise it is assumed.
    /// `None` if there are no equations or the iteration fails.
    pub fn find(solver: &mut LinearSolver, tangent: &mut Tangent, model: &Model, stress: bool) -> Option<Self> {
        let vector = solver.softest(tangent)?;
        let assembly = tangent.assembly();
        let state = tangent.state();
        if vector.held && !stress {
            return Some(Self { vector, strains: true, moves: true, opens: false });
        }
        let (largest, motion) = vector.by_slot(&assembly.system.pattern.dof_map, state.q.len());
        // The largest component may be the multiplier of a redundant constraint, which causes no
        // strain.
        let moves = !model.kinds[largest].is_multiplier();
        let size = if moves { size(model, &motion) } else { 0.0 };
        let strains = size > 0.0 && assembly.strain_of(state, &motion, model.length) > RIGID_STRAIN_RATIO * size;
        let mut found = Self { vector, strains, moves, opens: false };
        found.opens = moves && !strains && found.opens_joints(tangent, model);
        Some(found)
    }

    /// True if the motion opens joints: their multipliers hold it. Gaps that are lengths count by their part of
    /// the length of the scene.
    pub fn opens_joints(&self, tangent: &mut Tangent, model: &Model) -> bool {
        if model.multipliers.is_empty() {
            return false;
        }
        let system = tangent.look();
        let dof_map = &system.pattern.dof_map;
        let (_, motion) = self.vector.by_slot(dof_map, model.slots());
        let mut rows = vec![Vec3::ZERO; model.slots()];
        dof_map.scatter(&system.multiply(&system.values, &self.vector.motion), None, &mut rows);
        let opening = |&slot: &Slot| {
            let arm = if model.kinds[slot as usize] == SlotKind::Force { model.length } else { 1.0 };
            rows[slot as usize].norm() / arm
        };
        let widest = model.multipliers.iter().map(opening).fold(0.0, f64::max);
        widest > RIGID_STRAIN_RATIO * size(model, &motion)
    }

    /// True if the motion has neither stiffness nor strain, nor opens joints. Very slender beams on
    /// fine meshes bend so softly that their stiffness is lost in round-off, but they strain.
    pub fn is_loose(&self) -> bool {
        !self.vector.held && !self.strains && !self.opens
    }

    /// True if the stiffness against the motion is lost in round-off, although it causes strain.
    pub fn is_soft(&self) -> bool {
        !self.vector.held && self.strains
    }

    /// True if only stress gives the motion stiffness, as gravity does to a pendulum. Meaningful
    /// only if strain was asked for with `stress`.
    pub fn is_held_by_stress(&self) -> bool {
        self.vector.held && self.moves && !self.strains && !self.opens
    }
}

/// A motion of a tangent without stiffness or strain, if there is one; see [`SoftMode::find`].
pub fn mechanism(solver: &mut LinearSolver, tangent: &mut Tangent, model: &Model) -> Option<NullVector> {
    SoftMode::find(solver, tangent, model, false).filter(SoftMode::is_loose).map(|soft_mode| soft_mode.vector)
}
