//! How equilibrium and its forces vary with the load factor.

use super::failure::Failure;
use super::stage_run::{Run, StageRun};
use crate::kernel::Weights;
use crate::solve::{Tangent, mechanism};
use crate::system::State;
use crate::tensor::Vec3;

/// Step over which derivatives over the load factor are taken.
const LOAD_STEP: f64 = 1.0 / 4096.0;

/// The direction of a path of equilibrium.
pub(super) struct Direction {
    /// dq/dload
    pub rate: Vec<Vec3>,
    /// dg/dload at rest: of the forces, and at multipliers of the gaps of motors
    pub pull: Vec<Vec3>,
}

impl Direction {
    /// Of a path on which nothing varies with the load factor.
    pub fn none(slots: usize) -> Self {
        Self { rate: vec![Vec3::ZERO; slots], pull: vec![Vec3::ZERO; slots] }
    }
}

impl Run<'_> {
    /// The direction of the path; `None` where nothing varies with the load factor. The tangent stays factorised.
    pub(super) fn path_direction(&mut self, workshop: &mut StageRun) -> Result<Option<Direction>, Failure> {
        let pull = self.load_derivative(workshop);
        let StageRun { assembly, newton, prescribed_increment, .. } = workshop;
        if pull.iter().chain(prescribed_increment.iter()).all(|&v| v == Vec3::ZERO) {
            return Ok(None);
        }
        assembly.forget();
        assembly.evaluate(&self.state, Weights::STIFFNESS, Some(prescribed_increment));
        let system = &assembly.system;
        let mut solution = vec![0.0; system.pattern.dof_map.count()];
        system.right_hand_side_of(&pull, &mut solution);
        self.counters.work.factorisations += 1;
        if !(newton.solver.factorise(system) && newton.solver.solve(system, &mut solution)) {
            let vector = mechanism(&mut newton.solver, &mut Tangent::that_stays(assembly, &self.state), &self.model);
            return Err(self.name_mechanism(vector, &workshop.assembly.system));
        }
        let mut rate = vec![Vec3::ZERO; pull.len()];
        system.pattern.dof_map.scatter(&solution, Some(prescribed_increment), &mut rate);
        Ok(Some(Direction { rate, pull }))
    }

    /// The derivative of the forces over the load factor; that of prescribed directions goes into the workshop's `prescribed_increment`.
    /// Loads and motions without a history are linear in it; the step is small, so that no motion goes around.
    pub(super) fn load_derivative(&mut self, workshop: &mut StageRun) -> Vec<Vec3> {
        let StageRun { assembly, prescribed_increment, .. } = workshop;
        prescribed_increment.resize(self.state.q.len(), Vec3::ZERO);
        let (mut here, mut shifted) = (self.state.clone(), self.state.clone());
        let inverse = 1.0 / LOAD_STEP;
        self.schedule.set_clock(&self.model, &mut here, self.state.time, self.state.load);
        let mut forces = |state: &State| -> Vec<Vec3> {
            assembly.evaluate(state, Weights::NONE, None);
            (0..state.q.len()).map(|slot| assembly.system.total(slot)).collect()
        };
        let before = forces(&self.state);
        self.schedule.set_clock(&self.model, &mut shifted, self.state.time, self.state.load + LOAD_STEP);
        // From where the motions put their directions now, not from where round-off has left them: the step is small.
        for (prescribed_increment, (moved, from)) in prescribed_increment.iter_mut().zip(shifted.q.iter().zip(&here.q))
        {
            *prescribed_increment = (*moved - *from) * inverse;
        }
        shifted.q.copy_from_slice(&self.state.q);
        let after = forces(&shifted);
        after.iter().zip(&before).map(|(after, before)| (*after - *before) * inverse).collect()
    }
}
