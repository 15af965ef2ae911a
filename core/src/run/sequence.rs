//! A run from its plan: the stages one after the other, watched by an observer.

use super::buckling::Buckling;
use super::checkpoint::{Checkpoint, RunState, StageCheckpoint};
use super::dynamics::Dynamics;
use super::failure::{Failure, Moment};
use super::modal::Modal;
use super::naming::describe;
use super::observer::Observer;
use super::plan::{Plan, StageWork};
use super::rehearsal::lacking;
use super::snapshot::Counters;
use super::stage_run::{Analysis, StageRun, newton_for, unless_interrupted};
use super::statics::{ArcLength, LoadLevels};
use crate::effect::ContactChange;
use crate::model::{Assembly, Model, StageKind};
use crate::system::{ContactRegime, DofMap};
use std::sync::Arc;

/// A run in progress, between its stages.
pub struct Run<'o> {
    plan: Plan,
    model: Arc<Model>,
    observer: &'o mut dyn Observer,
    run: RunState,
    /// The first stage to run, from 0
    first: usize,
    /// Where a checkpoint has left that stage, if it had begun
    begun: Option<StageCheckpoint>,
}

impl<'o> Run<'o> {
    /// A run at its start.
    pub fn new(plan: Plan, observer: &'o mut dyn Observer) -> Self {
        let model = plan.model.clone();
        Self { plan, run: RunState::new(&model), model, observer, first: 0, begun: None }
    }

    /// A run that goes on from a checkpoint of the same plan.
    pub fn resume(plan: Plan, from: Checkpoint, observer: &'o mut dyn Observer) -> Self {
        let Checkpoint { number, run, stage } = from;
        Self { model: plan.model.clone(), plan, run, observer, first: number, begun: stage }
    }

    /// Runs all stages. Whatever happens, the counters tell how far it came.
    pub fn finish(mut self) -> (Result<(), Failure>, Counters) {
        let result = (self.first..self.plan.stages.len()).try_for_each(|number| self.run_stage(number));
        (result, self.run.counters)
    }

    /// Runs stage number `number`, from 0. After a request to stop it has come to no other end.
    fn run_stage(&mut self, number: usize) -> Result<(), Failure> {
        let result = self.carry_out_stage(number);
        if matches!(result, Err(Failure::Io(_) | Failure::Interrupted { .. })) {
            return result;
        }
        let at = self.moment_in(number);
        unless_interrupted(at).and(result)
    }

    fn carry_out_stage(&mut self, number: usize) -> Result<(), Failure> {
        let work = self.plan.stages[number].work;
        let contacts = self.run.state.contacts.clone();
        let mut run = match self.begun.take() {
            None => self.open_stage(number)?,
            Some(begun) => self.open_stage_again(number, begun)?,
        };
        let stage = &mut run;
        match work {
            StageWork::Static { steps, approach } => carry_out(LoadLevels { stage, steps, approach }),
            StageWork::Path { steps, max_steps } => carry_out(ArcLength { stage, steps, max_steps }),
            StageWork::Modal { modes } => carry_out(Modal { stage, modes }),
            StageWork::Buckling { modes } => carry_out(Buckling { stage, modes }),
            StageWork::Dynamic(steps) => carry_out(Dynamics::new(stage, steps)),
        }?;
        run.hand_over();
        if !work.kind().advances_state() {
            // Such stages only look.
            self.run.state.contacts = contacts;
        }
        self.run.schedule.end_stage(&self.model, &self.run.state);
        Ok(())
    }

    /// Settles loads and constraints of a stage, and analyses the pattern of its unknowns.
    fn open_stage(&mut self, number: usize) -> Result<StageRun<'_>, Failure> {
        self.offer_checkpoint(number)?;
        let stage = &self.plan.stages[number];
        let fresh = number == 0 || self.run.schedule.has_fresh_loads(&self.model, number);
        let begun = self.run.schedule.begin_stage(&self.model, number, stage.work.kind(), &self.run.state);
        let dof_map = begun.map_err(|error| describe(error, &self.model, number))?;
        let fading = !self.run.state.fading.is_empty();
        if let Some(error) = lacking(&self.model, &self.run.schedule, stage, number, fading, || Some(dof_map.clone())) {
            return Err(describe(error, &self.model, number));
        }
        if let Some(contacts) = self.model.contacts() {
            contacts.look_everywhere(&mut self.run.state);
        }
        let mut run = self.stage_run(number, dof_map, fresh)?;
        run.warn_of_space();
        Ok(run)
    }

    /// Opens a stage where a checkpoint has left it.
    fn open_stage_again(&mut self, number: usize, begun: StageCheckpoint) -> Result<StageRun<'_>, Failure> {
        let plane = self.model.plane.filter(|_| begun.is_planar);
        let dof_map = self.run.schedule.dof_map(&self.model, plane);
        let dof_map = dof_map.map_err(|error| describe(error, &self.model, number))?;
        let mut run = self.stage_run(number, dof_map, begun.fresh)?;
        run.take_up(begun)?;
        Ok(run)
    }

    /// The present moment, in stage `number` (from 0).
    fn moment_in(&self, number: usize) -> Moment {
        Moment { stage: number + 1, time: self.run.state.time, load: self.run.state.load }
    }

    /// A stage on some degrees of freedom; `fresh`: loads act for the first time in it.
    fn stage_run(&mut self, number: usize, dof_map: DofMap, fresh: bool) -> Result<StageRun<'_>, Failure> {
        let stage = &self.plan.stages[number];
        let plane = dof_map.plane().copied();
        if let Some(contacts) = self.model.contacts() {
            contacts.list_pairs(&mut self.run.state);
        }
        let assembly = Assembly::about(&self.run.state, &stage.context(number), dof_map, &self.model);
        let at = self.moment_in(number);
        let newton = newton_for(stage, &assembly, &self.model, at)?;
        let RunState { schedule, state, good, counters, issued, bookkeeper, past } = &mut self.run;
        if let Some(contacts) = self.model.contacts() {
            let advances = stage.work.kind().advances_time();
            let regime = if advances { ContactRegime::Penalty } else { ContactRegime::Augmented };
            if state.contacts.regime != regime {
                match regime {
                    ContactRegime::Penalty => contacts.begin_penalty(state),
                    ContactRegime::Augmented => contacts.begin_augmented(state),
                }
            }
            if stage.work.kind() == StageKind::Modal {
                contacts.hold(state);
            }
        }
        Ok(StageRun {
            keeps_account: self.plan.energy,
            plan: &self.plan,
            number,
            model: &self.model,
            charted: self.model.charted(stage.work.kind()),
            schedule,
            state,
            good,
            observer: &mut *self.observer,
            cutbacks_before: counters.cutbacks,
            counters,
            issued,
            bookkeeper,
            past,
            assembly,
            newton,
            plane,
            fresh,
            soft: false,
            prescribed_increment: Vec::new(),
            unflattened: Vec::new(),
            contact_change: ContactChange::None,
            resumed: None,
            is_judged: false,
        })
    }

    /// Shows the observer a checkpoint before the start of a stage, if it wants one.
    fn offer_checkpoint(&mut self, number: usize) -> Result<(), Failure> {
        let at = self.moment_in(number);
        unless_interrupted(at)?;
        if !self.observer.wants_checkpoint() {
            return Ok(());
        }
        self.observer.checkpoint(&Checkpoint { number, run: self.run.clone(), stage: None })
    }
}

/// Runs an analysis, sums up its work, and warns of what shows behind it, however it ended.
fn carry_out<'r>(mut analysis: impl Analysis<'r>) -> Result<(), Failure> {
    let result = analysis.run();
    analysis.stage().is_judged = true;
    analysis.stage().close();
    analysis.judge();
    result
}
