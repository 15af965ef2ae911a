//! Time steps with a stage in their middle.

use super::Dynamics;
use super::middle::Middle;
use crate::integrate::{Lobatto, MIDDLE, Stage, Step};
use crate::model::Assembly;
use crate::run::energy::Entry;
use crate::run::failure::Failure;
use crate::run::stage_run::StageRun;
use crate::solve::NewtonFailure;
use crate::system::State;

impl Dynamics<'_, '_> {
    /// Predicts both stages of a step, puts prescribed directions where they belong, and finds the
    /// balance of both.
    pub(super) fn find_stages(&mut self, middle: &mut Middle, step: &Step, next: f64) -> Result<(), NewtonFailure> {
        self.steady();
        let StageRun { assembly, newton, state, model, schedule, counters, bookkeeper, keeps_account, .. } =
            &mut *self.stage;
        if let Some(error) = &mut newton.time_error {
            error.begin(step, self.last_length);
        }
        let length = step.length;
        let step = Lobatto { length };
        let Middle { state: middle, predictor } = middle;
        middle.copy_from(state);
        step.predict(middle, state);
        let dof_map = &assembly.system.pattern.dof_map;
        for stage in [Stage::Middle, Stage::End] {
            let (predictor, predicted) = match stage {
                Stage::Middle => (&mut *predictor, &*middle),
                Stage::End => (&mut self.predictor, &**state),
            };
            if predictor.foresee(dof_map, predicted, length, newton.scratch()) {
                step.correct(middle, state, stage, newton.scratch(), 1.0);
            }
        }
        let start = state.time;
        for (state, time) in [(&mut *middle, start + MIDDLE * length), (&mut **state, next)] {
            if let Some(too_far) = schedule.set_clock(model, state, time, 1.0) {
                return Err(too_far.into());
            }
        }
        let pass = &mut |middle: &State, assembly: &Assembly| {
            if *keeps_account {
                bookkeeper.pass_middle(Entry::new(model, middle, assembly));
            }
        };
        newton.solve_stages(model, assembly, middle, state, &step, &mut counters.work, pass)?;
        let dof_map = &assembly.system.pattern.dof_map;
        predictor.end(dof_map, middle, length);
        self.predictor.end(dof_map, state, length);
        Ok(())
    }

    /// Gives velocities and accelerations that the gaps of joints allow to a step that is taken.
    /// Stages close the gaps themselves; errors of their rates would add up.
    pub(super) fn restore_rates(&mut self) -> Result<(), Failure> {
        if self.middle.is_some() && !self.stage.model.multipliers.is_empty() {
            // Accelerations are those of prescribed motions, to which the solution is added.
            self.set_clock()?;
            self.close_joints()?;
            self.find_accelerations()?;
        }
        Ok(())
    }
}
