//! Checkpoints of a stage: how they are taken, and how the stage goes on from one.

use super::checkpoint::{AnalysisCheckpoint, Checkpoint, LinearCheckpoint, RunState, StageCheckpoint};
use super::failure::Failure;
use super::stage_run::StageRun;
use crate::kernel::Weights;
use crate::model::StageError;
use crate::solve::Tangent;

impl StageRun<'_> {
    /// Shows the observer a checkpoint, if it wants one. Called between rows.
    pub fn offer_checkpoint(&mut self, analysis: impl FnOnce() -> AnalysisCheckpoint) -> Result<(), Failure> {
        // Work that a request has cut short is no place to go on from.
        self.unless_interrupted()?;
        if !self.observer.wants_checkpoint() {
            return Ok(());
        }
        let stage = StageCheckpoint {
            is_planar: self.plane.is_some(),
            fresh: self.fresh,
            soft: self.soft,
            cutbacks_before: self.cutbacks_before,
            prescribed_increment: self.prescribed_increment.clone(),
            evaluations: self.assembly.evaluations.iter().map(|&(_, count)| count).collect(),
            linear: self.linear_checkpoint(),
            newton: self.newton.memory(),
            analysis: analysis(),
        };
        let run = RunState {
            schedule: self.schedule.clone(),
            state: self.state.clone(),
            good: self.good.clone(),
            counters: self.counters.clone(),
            issued: self.issued.clone(),
            bookkeeper: self.bookkeeper.clone(),
            past: self.past.clone(),
        };
        self.observer.checkpoint(&Checkpoint { number: self.number, run, stage: Some(stage) })
    }

    fn linear_checkpoint(&self) -> Option<LinearCheckpoint> {
        let linear = self.assembly.linear()?;
        let system = &self.assembly.system;
        let formed = linear.formed.filter(|&(_, revision)| revision == system.revision);
        let factorised = formed.filter(|_| self.newton.solver.has_factorised(system)).map(|(weights, _)| weights);
        Some(LinearCheckpoint { origin: linear.origin.clone(), factorised })
    }

    /// Takes up the stage where a checkpoint has left it.
    pub fn take_up(&mut self, from: StageCheckpoint) -> Result<(), Failure> {
        let StageCheckpoint {
            is_planar: _,
            fresh: _,
            soft,
            cutbacks_before,
            prescribed_increment,
            evaluations,
            linear,
            newton,
            analysis,
        } = from;
        (self.soft, self.cutbacks_before) = (soft, cutbacks_before);
        self.prescribed_increment = prescribed_increment;
        let counted = self.assembly.evaluations.iter_mut().zip(evaluations);
        counted.for_each(|((_, count), before)| *count = before);
        self.newton.recall(newton, self.model, &self.assembly.system);
        if let Some(LinearCheckpoint { origin, factorised }) = linear {
            let made = self.assembly.linearise(self.model, &origin);
            made.map_err(|conflict| self.describe(StageError::Conflict(conflict)))?;
            factorised.into_iter().for_each(|weights| self.make_again(|stage| stage.form_linear_tangent(weights)));
        }
        self.resumed = Some(analysis);
        Ok(())
    }

    /// Makes again what the checkpoint of an analysis leaves out, with `make`, which neither counts
    /// as work nor changes the choices of the linear solver.
    pub fn make_again(&mut self, make: impl FnOnce(&mut Self)) {
        let counters = self.counters.clone();
        let evaluations = self.assembly.evaluations.clone();
        let choice = self.newton.solver.choice();
        make(self);
        self.newton.solver.choose(choice, &self.assembly.system);
        self.assembly.evaluations = evaluations;
        *self.counters = counters;
    }

    /// Forms and factorises the tangent of a linear stage, which serves all its levels and steps.
    fn form_linear_tangent(&mut self, weights: Weights) {
        let is_dynamic = self.stage().work.kind().advances_time();
        let Self { assembly, state, newton, .. } = self;
        assembly.evaluate(state, weights, None);
        let mut tangent = if is_dynamic {
            Tangent::that_may_go(assembly, state, weights)
        } else {
            Tangent::that_stays(assembly, state)
        };
        newton.solver.factorise_new(&mut tangent);
    }
}
