//! Time stepping: with fixed steps, or with steps that adapt to their local error.

use super::control::Control;
use super::failure::Failure;
use super::grid::Grid;
use super::guard::Growth;
use super::stage_run::{Run, StageRun};
use crate::integrate::{Increments, Predictor, Rotations, Scheme, Step, TimeError};
use crate::kernel::Weights;
use crate::model::charts;
use crate::solve::NewtonFailure;
use crate::system::{Slot, State};
use crate::tensor::Vec3;
use std::f64::consts::PI;

/// A fixed step that fails is not taken in smaller parts than this.
const SMALLEST_PART: f64 = 1.0 / 64.0;

impl Run<'_> {
    /// All steps of a dynamic stage, up to `end` on the run's clock.
    pub(super) fn run_dynamic(
        &mut self,
        workshop: &mut StageRun,
        end: f64,
        step: f64,
        scheme: Scheme,
        adaptive: Option<f64>,
    ) -> Result<(), Failure> {
        workshop.increments = (scheme.rotations == Rotations::Increments)
            .then(|| Increments::new(&self.model, self.schedule.kind(), &workshop.assembly.system.pattern.dof_map));
        workshop.trend = Predictor::new(&self.model);
        self.start_dynamic(workshop, &Step { scheme, length: step })?;
        self.find_rates(workshop);
        let mut before = step;
        match adaptive {
            None => {
                let first = Step { scheme, length: step };
                let StageRun { assembly, newton, massive, increments, .. } = &mut *workshop;
                let start = (&self.state, increments.as_ref());
                let duration = end - self.state.time;
                newton.time_error = Some(TimeError::new(&self.model, assembly, start, massive, (first, duration)));
                self.run_fixed(workshop, end, step, scheme, &mut before)
            }
            Some(tolerance) => {
                let judged = workshop.massive.clone();
                let control = Control::new(tolerance, end - self.state.time, step, scheme, judged);
                self.run_adaptive(workshop, end, control, &mut before)
            }
        }
    }

    /// Rows at start + k step, the last one at `end`.
    fn run_fixed(
        &mut self,
        workshop: &mut StageRun,
        end: f64,
        step: f64,
        scheme: Scheme,
        before: &mut f64,
    ) -> Result<(), Failure> {
        while self.state.time < end {
            let grid = self.next_grid(end, step);
            for number in 1..=grid.steps {
                let (next, length) = grid.step(number);
                let last = self.stride(workshop, Step { scheme, length }, before, (next, end))?;
                if self.complete(workshop, &last)? {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// A step of the grid at once, or where that fails in halves, and halves of halves. Returns the last of them, which is
    /// not settled yet. `next` is the time it ends at, `end` that of the stage.
    fn stride(
        &mut self,
        workshop: &mut StageRun,
        whole: Step,
        before: &mut f64,
        (next, end): (f64, f64),
    ) -> Result<Step, Failure> {
        // Parts are counted: the clock is rounded, and late in a run a short step is not much longer than that.
        let (mut step, mut parts) = (whole, 1);
        loop {
            let target = if parts == 1 { next } else { self.state.time + step.length };
            self.observer.progress(self.moment(), self.dynamic_progress(target, end))?;
            match self.advance(workshop, step, *before, target) {
                Ok(()) => {
                    *before = step.length;
                    parts -= 1;
                    if parts == 0 {
                        return Ok(step);
                    }
                    self.settle(workshop, &step)?;
                    self.close_joints(workshop)?;
                }
                Err(failure) => {
                    step.length *= 0.5;
                    parts *= 2;
                    if step.length < SMALLEST_PART * whole.length {
                        return Err(self.give_up(workshop, failure));
                    }
                    self.warn_of_subdivision();
                    self.state.copy_from(&self.good);
                    self.counters.cutbacks += 1;
                }
            }
        }
    }

    /// What every step is followed by, written or not.
    fn settle(&mut self, workshop: &mut StageRun, step: &Step) -> Result<(), Failure> {
        self.accept(workshop)?;
        self.settle_charts(workshop, step);
        Ok(())
    }

    fn settle_charts(&mut self, workshop: &mut StageRun, step: &Step) {
        let totals = workshop.increments.is_none();
        if let Some(error) = workshop.newton.time_error.as_mut().filter(|_| totals) {
            error.change_charts(&self.state, &self.schedule.charted(&self.model).rotations);
        }
        let switched = self.change_charts(totals.then_some(step.scheme.lag() * step.length));
        if totals && switched > 0 {
            workshop.trend.forget();
        }
    }

    /// A row a step; a step that fails, or whose error is too large, is tried again with a smaller one.
    fn run_adaptive(
        &mut self,
        workshop: &mut StageRun,
        end: f64,
        mut control: Control,
        before: &mut f64,
    ) -> Result<(), Failure> {
        while self.state.time < end {
            let (next, length) = control.propose(self.state.time, self.next_corner(end));
            self.observer.progress(self.moment(), self.dynamic_progress(next, end))?;
            let step = Step { scheme: control.scheme, length };
            let tried = self.advance(workshop, step, *before, next);
            let at_floor = control.is_smallest(length);
            let taken = match tried {
                Ok(()) => {
                    let increments = workshop.increments.as_ref();
                    let (error, slot) = control.error(&self.model, increments, &self.good, &self.state, length);
                    let taken = control.judge(length, error);
                    if !taken && at_floor {
                        let failure = NewtonFailure::StepTooSmall { slot, error, share: control.share(length) };
                        return Err(self.give_up(workshop, failure));
                    }
                    taken
                }
                Err(failure) if at_floor => return Err(self.give_up(workshop, failure)),
                Err(_) => control.fail(length),
            };
            if taken {
                *before = length;
                if self.complete(workshop, &step)? {
                    return Ok(());
                }
                // Where velocities leave the joints by the error of a step, accelerations of a shorter one must jump to
                // bring them back, more and more the shorter it is.
                self.close_joints(workshop)?;
            } else {
                workshop.trend.withdraw();
                self.state.copy_from(&self.good);
                self.counters.cutbacks += 1;
            }
        }
        Ok(())
    }

    /// One attempt at a step; what was foreseen of it may not be what it fails for.
    fn advance(&mut self, workshop: &mut StageRun, step: Step, before: f64, next: f64) -> Result<(), NewtonFailure> {
        self.good.copy_from(&self.state);
        workshop.trend.reset();
        let mut result = self.attempt_step(workshop, step, before, next);
        if result.is_err() && workshop.trend.has_foreseen() {
            workshop.trend.fail();
            self.state.copy_from(&self.good);
            result = self.attempt_step(workshop, step, before, next);
        }
        if result.is_err() {
            // It may have come to an end that is refused.
            workshop.trend.fail();
        }
        result
    }

    /// Predict, prescribe, iterate.
    fn attempt_step(
        &mut self,
        workshop: &mut StageRun,
        step: Step,
        before: f64,
        next: f64,
    ) -> Result<(), NewtonFailure> {
        let StageRun { assembly, newton, increments, trend, massive, rateless, .. } = workshop;
        if !rateless.is_empty() {
            self.model.steady(&mut self.state);
        }
        if let Some(error) = &mut newton.time_error {
            error.begin(&step, before);
        }
        if let Some(increments) = increments {
            increments.begin(&mut self.state, &step, before);
        }
        step.predict(&mut self.state, before);
        if let Some((slot, angle)) = self.schedule.set_clock(&self.model, &mut self.state, next, 1.0) {
            return Err(NewtonFailure::TurnsTooFar { slot: slot as usize, angle });
        }
        trend.begin(&assembly.system.pattern.dof_map, &mut self.state, &step, newton.scratch());
        newton.solve(&self.model, assembly, &mut self.state, &step, None, &mut self.counters.work)?;
        trend.end(&assembly.system.pattern.dof_map, &self.state, &step);
        self.refuse_massless_turns(massive)?;
        if let Some(increments) = increments {
            let switched = increments.end(&mut self.state, &self.good);
            self.counters.work.chart_switches += switched as u64;
            // Forces conjugate to total vectors, for reactions and the energy account.
            assembly.evaluate(&self.state, Weights::NONE, None);
        } else if !rateless.is_empty() {
            // A rule for accelerations makes velocities that nothing resists swing from step to step, more and more.
            let State { q, v, a, algorithmic, .. } = &mut self.state;
            let (v, rates2) = (&mut v[..], [&mut a[..], &mut algorithmic[..]]);
            rateless.iter().for_each(|&slot| v[slot] = (q[slot] - self.good.q[slot]) * (1.0 / step.length));
            let kept = rates2.into_iter().filter(|rates| !rates.is_empty());
            kept.for_each(|rates| rateless.iter().for_each(|&slot| rates[slot] = Vec3::ZERO));
        }
        let turning =
            self.schedule.charted(&self.model).rotations.iter().copied().filter(|&slot| massive[slot as usize]);
        turns_within(&self.state, turning, step.length)?;
        self.refuse_leaps()?;
        newton.end_step(&assembly.system, (&self.good, &self.state), &step, increments.as_ref());
        Ok(())
    }

    /// Rotations without inertia have no spin to speak of: they go where balance is. While a step is iterated the unknown is the
    /// increment, or a total vector in the chart it began in.
    fn refuse_massless_turns(&self, massive: &[bool]) -> Result<(), NewtonFailure> {
        let massless =
            self.schedule.charted(&self.model).rotations.iter().copied().filter(|&slot| !massive[slot as usize]);
        let mut turned = massless.map(|slot| {
            let (k, q) = (slot as usize, self.state.q[slot as usize]);
            (k, if self.state.turn(slot).is_some() { q.norm() } else { (q - self.good.q[k]).norm() })
        });
        match turned.find(|&(_, angle)| angle > PI) {
            Some((slot, angle)) => Err(NewtonFailure::TurnsTooFar { slot, angle }),
            None => Ok(()),
        }
    }

    /// What follows a step that is taken: account, row, charts. Tells whether the stage is over.
    fn complete(&mut self, workshop: &mut StageRun, step: &Step) -> Result<bool, Failure> {
        self.accept(workshop)?;
        self.counters.steps += 1;
        self.show(workshop)?;
        self.refuse_growth(workshop)?;
        if self.is_over(workshop) {
            return Ok(true);
        }
        self.settle_charts(workshop, step);
        Ok(false)
    }

    /// A scheme that makes energy from nothing ends the run while its results can still be told from round-off.
    fn refuse_growth(&self, workshop: &mut StageRun) -> Result<(), Failure> {
        let Some(guard) = &mut workshop.guard else { return Ok(()) };
        let moved = self.model.farthest(&self.good, &self.state);
        let Some(Growth { grown, largest }) = guard.judge(self.bookkeeper.ledger(), moved) else { return Ok(()) };
        Err(Failure::EnergyGrowth { at: self.moment(), grown, largest })
    }

    /// Names the failure and goes back to the last good state.
    fn give_up(&mut self, workshop: &StageRun, failure: NewtonFailure) -> Failure {
        let named = self.name_failure(failure, &workshop.assembly.system);
        self.state.copy_from(&self.good);
        named
    }

    /// Between steps, nodes beyond pi change their chart, and elements settle theirs; returns how many did. `lag`: see [`charts::switch`].
    pub(super) fn change_charts(&mut self, lag: Option<f64>) -> usize {
        let switched =
            charts::switch(&mut self.state, &self.schedule.charted(&self.model).rotations, charts::DYNAMIC_BAND, lag);
        self.counters.work.chart_switches += switched as u64;
        charts::freeze(&mut self.state, &self.schedule.charted(&self.model).elements);
        switched
    }

    /// The steps to the end; where rows are wanted at multiples of an interval, equal steps to the next of those.
    fn next_grid(&self, end: f64, step: f64) -> Grid {
        let stop = self.next_stop(end);
        let over = if self.plan.interval.is_some() { Grid::equal } else { Grid::over };
        over(self.state.time, stop, step)
    }

    /// The next instant that must be hit.
    fn next_stop(&self, end: f64) -> f64 {
        let Some(interval) = self.plan.interval else { return end };
        let next = ((self.state.time / interval + 1e-9).floor() + 1.0) * interval;
        if next >= end - 1e-9 * interval { end } else { next }
    }

    /// The same, or the next instant at which a load or a motion takes another course: what begins and ends within a step
    /// would leave no trace in the accelerations at its ends.
    fn next_corner(&self, end: f64) -> f64 {
        let stop = self.next_stop(end);
        self.schedule.next_corner(&self.model, self.state.time).map_or(stop, |corner| corner.min(stop))
    }

    fn dynamic_progress(&self, time: f64, end: f64) -> f64 {
        let done = if end > 0.0 { (time / end).clamp(0.0, 1.0) } else { 1.0 };
        (self.stage as f64 + done) / self.plan.stages.len() as f64
    }
}

/// Beyond half a turn in a step nobody could count the turns of a node.
fn turns_within(state: &State, rotations: impl Iterator<Item = Slot>, length: f64) -> Result<(), NewtonFailure> {
    // A spin is no faster than the total rotation vector: the tangent T makes no vector longer.
    let is_quick = |slot: Slot| state.v[slot as usize].norm() * length > PI;
    let turned = |slot: Slot| (slot as usize, state.spin(slot).omega.norm() * length);
    let mut turned = rotations.filter(|&slot| is_quick(slot)).map(turned);
    match turned.find(|&(_, angle)| angle > PI) {
        Some((slot, angle)) => Err(NewtonFailure::TurnsTooFar { slot, angle }),
        None => Ok(()),
    }
}
