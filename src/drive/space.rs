//! What a stage in a plane cannot see: whether the plane is left.

use super::failure::Failure;
use super::run::Run;
use crate::kernel::Weights;
use crate::model::Assembly;
use crate::solve::{LinearSolver, mechanism};

impl Run<'_> {
    /// The present stage in space, where it is treated in a plane.
    pub(super) fn in_space(&self) -> Result<Option<Assembly>, Failure> {
        if self.plane.is_none() {
            return Ok(None);
        }
        let context = self.plan.stages[self.stage].context(self.stage);
        let equations = self.model.number(self.stage, None).map_err(|error| self.describe(error))?;
        Ok(Some(Assembly::new(&context, equations, &self.model)))
    }

    /// Warns where the state is unstable in space by more than the `negative` pivots that it has in its plane.
    pub(super) fn look_out_of_plane(&mut self, negative: Option<usize>) -> Result<(), Failure> {
        let Some(in_plane) = negative else { return Ok(()) };
        if self.told.unstable == Some(self.stage) {
            return Ok(());
        }
        let Some(mut assembly) = self.in_space()? else { return Ok(()) };
        assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        let solver = LinearSolver::new(&assembly.system, &self.model.multipliers);
        self.counters.work.factorisations += 1;
        let in_space = solver.and_then(|mut solver| solver.negative_pivots(&assembly.system));
        if let Some(more) = in_space.and_then(|in_space| in_space.checked_sub(in_plane)).filter(|&more| more > 0) {
            self.warn_out_of_plane(more);
        }
        Ok(())
    }

    /// Refuses what nothing holds in the plane or out of it, with these weights of stiffness, damping and mass and without
    /// velocities.
    pub(super) fn refuse_loose_in_space(&mut self, weights: Weights) -> Result<(), Failure> {
        let Some(mut assembly) = self.in_space()? else { return Ok(()) };
        let Some(mut solver) = LinearSolver::new(&assembly.system, &self.model.multipliers) else {
            return Err(Failure::Limit("not enough memory to look at the tangent in space".into()));
        };
        let mut still = self.state.clone();
        still.stand_still();
        assembly.evaluate(&still, weights, None);
        self.counters.work.factorisations += 1;
        solver.factorise(&assembly.system);
        let loose = mechanism(&mut solver, &assembly, &self.model, &still);
        loose.map_or(Ok(()), |vector| Err(self.name_mechanism(Some(vector), &assembly.system)))
    }
}
