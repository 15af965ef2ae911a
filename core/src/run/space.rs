//! What a stage in a plane cannot see: whether the plane is left.

use super::failure::Failure;
use super::findings::{StabilityVerdict, StageStability};
use super::stage_run::{Run, StageRun};
use crate::kernel::Weights;
use crate::model::Assembly;
use crate::solve::{LinearSolver, Signature, Tangent, mechanism};

/// A stage that is treated in a plane, as it is in space.
pub(super) struct Space {
    pub assembly: Assembly,
    pub solver: LinearSolver,
}

impl Run<'_> {
    /// The present stage in space, where it is treated in a plane: set up once, by the first look.
    pub(super) fn in_space<'w>(&self, workshop: &'w mut StageRun) -> Result<Option<&'w mut Space>, Failure> {
        if workshop.space.is_none() && self.plane.is_some() {
            workshop.space = Some(self.set_up_in_space(workshop)?);
        }
        Ok(workshop.space.as_mut())
    }

    fn set_up_in_space(&self, in_plane: &StageRun) -> Result<Space, Failure> {
        let context = self.plan.stages[self.stage].context(self.stage);
        let dof_map = self.schedule.dof_map(&self.model, None).map_err(|error| self.describe(error))?;
        let assembly = Assembly::new(&context, dof_map, &self.model);
        let (solver, system) = (&in_plane.newton.solver, &in_plane.assembly.system);
        match LinearSolver::beside(solver, system, &assembly.system, &self.model.multipliers) {
            Some(solver) => Ok(Space { assembly, solver }),
            None => Err(Failure::Limit("not enough memory to look at the tangent in space".into())),
        }
    }

    /// Warns where the state is unstable in space by more than the `negative` pivots that it has in its plane.
    pub(super) fn look_out_of_plane(
        &mut self,
        workshop: &mut StageRun,
        negative: Option<usize>,
    ) -> Result<(), Failure> {
        let Some(in_plane) = negative else { return Ok(()) };
        if self.told.unstable == Some(self.stage) {
            return Ok(());
        }
        if let Some(more @ 1..) = self.count_out_of_plane(workshop, in_plane)? {
            self.warn_out_of_plane(more);
        }
        Ok(())
    }

    /// How many more pivots are negative in space than the `in_plane` ones of a stage that is treated in a plane; none where it is
    /// treated in space, `None` where it is not known.
    fn count_out_of_plane(&mut self, workshop: &mut StageRun, in_plane: usize) -> Result<Option<usize>, Failure> {
        let Some(Space { assembly, solver }) = self.in_space(workshop)? else { return Ok(Some(0)) };
        assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        self.counters.work.factorisations += 1;
        let mut tangent = Tangent::that_may_go(assembly, &self.state, Weights::STIFFNESS);
        let in_space = solver.negative_pivots(&mut tangent);
        Ok(in_space.and_then(|in_space| in_space.checked_sub(in_plane)))
    }

    /// At the end of a static stage: notes whether the equilibrium is stable, and warns where it is not. `signature`: of its tangent, as the
    /// stage is treated, where it is known; `on_limit`: whether the state is a limit point, with the pivots behind it.
    pub(super) fn conclude_static(
        &mut self,
        workshop: &mut StageRun,
        signature: Option<Signature>,
        on_limit: bool,
    ) -> Result<(), Failure> {
        let negative = signature.and_then(Signature::negative);
        self.warn_of_instability(negative);
        let stage = self.stage + 1;
        let aside = match negative {
            None => None,
            // There the look in space was taken behind it.
            Some(_) if on_limit => (self.told.unstable != Some(self.stage)).then_some(0),
            Some(in_plane) => self.count_out_of_plane(workshop, in_plane)?,
        };
        let mut found = StageStability::of_pivots(stage, negative, aside);
        if found.verdict == StabilityVerdict::Unknown && !on_limit {
            let vibrations = self.vibrations(signature)?;
            self.warn_of_vibrations(vibrations);
            found = StageStability::of_vibrations(stage, vibrations);
        }
        self.counters.findings.stability.push(found);
        match aside {
            Some(more @ 1..) if self.told.unstable != Some(self.stage) => self.warn_out_of_plane(more),
            _ => {}
        }
        Ok(())
    }

    /// Refuses what nothing holds in the plane or out of it, with these weights of stiffness, damping and mass and without
    /// velocities.
    pub(super) fn refuse_loose_in_space(&mut self, workshop: &mut StageRun, weights: Weights) -> Result<(), Failure> {
        let Some(Space { assembly, solver }) = self.in_space(workshop)? else { return Ok(()) };
        let still = self.state.at_rest();
        assembly.evaluate(&still, weights, None);
        self.counters.work.factorisations += 1;
        let loose = mechanism(solver, &mut Tangent::that_may_go(assembly, &still, weights), &self.model);
        loose.map_or(Ok(()), |vector| Err(self.name_mechanism(Some(vector), &assembly.system)))
    }
}
