//! Dynamic stages: time steps, fixed or such that adapt to their local error.

mod adaptive;
pub(super) mod checkpoint;
mod friction;
mod friction_impulses;
mod grid;
mod judgement;
mod massless;
mod massless_start;
mod middle;
mod smooth_start;
mod start;
mod two_stages;

use self::adaptive::Control;
use self::checkpoint::{DynamicsCheckpoint, StepsCheckpoint};
use self::friction_impulses::FrictionImpulses;
use self::grid::Grid;
use self::middle::Middle;
use super::checkpoint::AnalysisCheckpoint;
use super::energy::{EnergyGuard, Growth};
use super::failure::Failure;
use super::plan::TimeStepping;
use super::ringing::Ringing;
use super::stage_run::{Analysis, StageRun};
use crate::integrate::{Increments, Predictor, Rotations, Step, StepEnds, TimeError};
use crate::kernel::Weights;
use crate::solve::NewtonFailure;
use crate::system::{Slot, State};
use crate::tensor::Vec3;
use crate::warning::WarningKind;
use std::f64::consts::PI;

/// The smallest part in which a fixed step that fails is taken.
const SMALLEST_PART: f64 = 1.0 / 64.0;

/// Attempts at a step that looks at more pairs of beams, or at more surfaces, at most.
const MOST_LISTS: usize = 4;

/// What places are rounded by on the way through Newton's method, in lengths of the scene and radians: 1e4
/// times the round-off of one operation.
const ROUNDED: f64 = 1e-12;

/// Strains that Newton may leave where an iteration ends.
const TOLERATED_STRAIN: f64 = 1e-9;

/// A dynamic stage.
pub(super) struct Dynamics<'s, 'r> {
    stage: &'s mut StageRun<'r>,
    settings: TimeStepping,
    /// The length of the last step
    last_length: f64,
    /// The unknowns of time steps where those are increments of rotation
    increments: Option<Increments>,
    predictor: Predictor,
    /// The middle of steps, where that is a stage
    middle: Option<Box<Middle>>,
    /// By slot: its accelerations mean something.
    massive: Vec<bool>,
    /// The slots whose velocities enter no force: they have neither inertia nor damping.
    rateless: Vec<usize>,
    /// Watches the energy of time steps; not in linear stages, whose account takes as long as their
    /// steps.
    guard: Option<EnergyGuard>,
    /// The friction of fixed steps
    friction: FrictionImpulses,
    /// Columns that depend on accelerations
    ringing: Ringing,
}

impl<'s, 'r> Dynamics<'s, 'r> {
    /// Before the start of the stage.
    pub fn new(stage: &'s mut StageRun<'r>, settings: TimeStepping) -> Self {
        let guard = (!stage.is_linear()).then(|| energy_guard(stage, settings.energy_limit));
        stage.keeps_account |= guard.is_some();
        let has_increments = settings.scheme.rotations == Rotations::Increments;
        Self {
            last_length: settings.step,
            settings,
            increments: has_increments
                .then(|| Increments::new(stage.model, stage.schedule.kind(), &stage.assembly.system.pattern.dof_map)),
            predictor: Predictor::new(stage.model),
            middle: Middle::of(settings.scheme, stage.model, stage.state),
            massive: Vec::new(),
            rateless: Vec::new(),
            guard,
            friction: FrictionImpulses::default(),
            ringing: Ringing::default(),
            stage,
        }
    }
}

/// Strains that Newton leaves have an energy of their own, of the stiffest section along the length
/// of the scene.
fn energy_guard(stage: &StageRun, limit: f64) -> EnergyGuard {
    let round_off = stage.assembly.round_off(stage.state).force;
    let stiffest = round_off / f64::EPSILON;
    EnergyGuard::new(limit, stiffest * stage.model.length * TOLERATED_STRAIN * TOLERATED_STRAIN, round_off)
}

impl<'r> Analysis<'r> for Dynamics<'_, 'r> {
    fn stage(&mut self) -> &mut StageRun<'r> {
        self.stage
    }

    fn run(&mut self) -> Result<(), Failure> {
        let steps = match self.stage.resumed.take() {
            Some(AnalysisCheckpoint::Dynamics(checkpoint)) => self.take_up(checkpoint),
            None | Some(AnalysisCheckpoint::Levels(_) | AnalysisCheckpoint::ArcLength(_)) => self.begin()?,
        };
        match steps {
            StepsCheckpoint::Fixed { start, taken } => self.run_fixed(start, taken),
            StepsCheckpoint::Adaptive(control) => self.run_adaptive(control),
        }
    }

    fn judge(&mut self) {
        self.warn_of_imbalance();
        self.warn_of_contacts();
        self.stage.warn_of_soft_stick();
        self.stage.warn_of_layers();
        self.judge_steps();
        self.judge_friction();
        self.warn_of_ringing();
    }
}

impl Dynamics<'_, '_> {
    /// Begins the stage.
    fn begin(&mut self) -> Result<StepsCheckpoint, Failure> {
        self.start()?;
        let start = self.stage.state.time;
        Ok(match self.settings.adaptive {
            None => {
                self.follow_errors();
                StepsCheckpoint::Fixed { start, taken: 0 }
            }
            Some(tolerance) => {
                let TimeStepping { end, step, scheme, .. } = self.settings;
                StepsCheckpoint::Adaptive(Control::new(tolerance, end - start, step, scheme, self.massive.clone()))
            }
        })
    }

    /// Takes up the stage where a checkpoint has left it.
    fn take_up(&mut self, checkpoint: DynamicsCheckpoint) -> StepsCheckpoint {
        let DynamicsCheckpoint {
            last_length,
            predictor,
            of_middle,
            massive,
            rateless,
            guard,
            friction,
            ringing,
            steps,
        } = checkpoint;
        (self.last_length, self.massive, self.rateless) = (last_length, massive, rateless);
        (self.guard, self.friction, self.ringing) = (guard, friction, ringing);
        self.predictor = predictor.of_model(self.stage.model);
        if let (Some(middle), Some(predictor)) = (&mut self.middle, of_middle) {
            middle.predictor = predictor.of_model(self.stage.model);
        }
        match steps {
            // The deck may ask for rows at other instants now.
            StepsCheckpoint::Fixed { start, taken } if !self.lies_on_grid(start, taken) => {
                StepsCheckpoint::Fixed { start: self.stage.state.time, taken: 0 }
            }
            steps @ (StepsCheckpoint::Fixed { .. } | StepsCheckpoint::Adaptive(_)) => steps,
        }
    }

    /// True if the present time is that of step `taken` of the grid from `start`.
    fn lies_on_grid(&self, start: f64, taken: u64) -> bool {
        let time = if taken == 0 { start } else { self.grid_from(start).step(taken).0 };
        time == self.stage.state.time
    }

    /// Shows the observer where the stage is, if it wants that.
    fn offer_checkpoint(&mut self, steps: impl FnOnce() -> StepsCheckpoint) -> Result<(), Failure> {
        let Self { stage, last_length, predictor, middle, massive, rateless, guard, friction, ringing, .. } = self;
        stage.offer_checkpoint(|| {
            AnalysisCheckpoint::Dynamics(DynamicsCheckpoint {
                last_length: *last_length,
                predictor: predictor.clone(),
                of_middle: middle.as_ref().map(|middle| middle.predictor.clone()),
                massive: massive.clone(),
                rateless: rateless.clone(),
                guard: guard.clone(),
                friction: *friction,
                ringing: ringing.clone(),
                steps: steps(),
            })
        })
    }

    /// The first step.
    fn first_step(&self) -> Step {
        Step { scheme: self.settings.scheme, length: self.settings.step }
    }

    /// The errors of fixed steps are estimated from here on. With a stage in the middle, joints with
    /// multipliers and contacts change accelerations by more than the motion does.
    fn follow_errors(&mut self) {
        let model = self.stage.model;
        if self.middle.is_some() && (!model.multipliers.is_empty() || model.contacts().is_some()) {
            return;
        }
        let first = self.first_step();
        let StageRun { assembly, newton, state, model, .. } = &mut *self.stage;
        let increments = self.increments.as_ref();
        let duration = self.settings.end - state.time;
        newton.time_error = Some(TimeError::new(model, assembly, state, increments, &self.massive, first, duration));
    }

    /// Rows at start + k step, the last one at `end`; of the grid that begins at `start` some steps
    /// are `taken` already.
    fn run_fixed(&mut self, mut start: f64, mut taken: u64) -> Result<(), Failure> {
        while self.stage.state.time < self.settings.end {
            let grid = self.grid_from(start);
            for number in taken + 1..=grid.steps {
                self.offer_checkpoint(|| StepsCheckpoint::Fixed { start, taken: number - 1 })?;
                let (next, length) = grid.step(number);
                let last = self.stride(Step { scheme: self.settings.scheme, length }, next)?;
                if self.complete(&last)? {
                    return Ok(());
                }
            }
            (start, taken) = (self.stage.state.time, 0);
        }
        Ok(())
    }

    /// A step of the grid at once, or where that fails in halves, and halves of halves. Returns the
    /// last of them, which is not settled yet. `next` is the time it ends at.
    fn stride(&mut self, whole: Step, next: f64) -> Result<Step, Failure> {
        // Parts are counted: the clock is rounded, and late in a run a short step is not much
        // longer than that.
        let mut step = whole;
        let mut parts = 1;
        loop {
            let target = if parts == 1 { next } else { self.stage.state.time + step.length };
            self.tell_time(target)?;
            match self.advance(step, target) {
                Ok(()) => {
                    self.add_friction(step.length);
                    self.restore_rates()?;
                    self.last_length = step.length;
                    parts -= 1;
                    if parts == 0 {
                        return Ok(step);
                    }
                    self.settle(&step)?;
                    self.close_joints()?;
                }
                Err(NewtonFailure::Interrupted(signal)) => return Err(self.stage.stop(signal)),
                Err(failure) => {
                    step.length *= 0.5;
                    parts *= 2;
                    if step.length < SMALLEST_PART * whole.length {
                        return Err(self.give_up(failure));
                    }
                    self.warn_of_subdivision();
                    self.stage.state.copy_from(self.stage.good);
                    self.stage.counters.cutbacks += 1;
                }
            }
        }
    }

    /// Settles a step that is taken, written or not.
    fn settle(&mut self, step: &Step) -> Result<(), Failure> {
        self.stage.accept()?;
        self.settle_charts(step);
        Ok(())
    }

    fn settle_charts(&mut self, step: &Step) {
        let totals = self.increments.is_none();
        if let Some(error) = self.stage.newton.time_error.as_mut().filter(|_| totals) {
            error.change_charts(self.stage.state, &self.stage.charted.rotations);
        }
        let switched = self.stage.change_charts(totals.then_some(step.scheme.lag() * step.length));
        if totals && switched > 0 {
            self.each_predictor(Predictor::forget);
        }
    }

    /// A row a step; a step that fails, or whose error is too large, is tried again with a smaller
    /// one.
    fn run_adaptive(&mut self, mut control: Control) -> Result<(), Failure> {
        while self.stage.state.time < self.settings.end {
            self.offer_checkpoint(|| StepsCheckpoint::Adaptive(control.clone()))?;
            let (next, length) = control.propose(self.stage.state.time, self.next_corner());
            self.tell_time(next)?;
            let step = Step { scheme: control.scheme, length };
            let tried = self.advance(step, next);
            let at_floor = control.is_smallest(length);
            let taken = match tried {
                Ok(()) => {
                    let increments = self.increments.as_ref();
                    let ends = self.step_ends();
                    let (error, slot) = control.error(self.stage.model, increments, ends, length);
                    let mut taken = control.judge(length, error);
                    if taken && !at_floor && self.slides_back(length, control.share(length)) {
                        taken = control.fail(length);
                    }
                    if !taken && at_floor {
                        let failure = NewtonFailure::StepTooSmall { slot, error, share: control.share(length) };
                        return Err(self.give_up(failure));
                    }
                    taken
                }
                Err(NewtonFailure::Interrupted(signal)) => return Err(self.stage.stop(signal)),
                Err(failure) if at_floor => return Err(self.give_up(failure)),
                Err(_) => control.fail(length),
            };
            if taken {
                self.restore_rates()?;
                self.last_length = length;
                if self.complete(&step)? {
                    return Ok(());
                }
                // Where velocities leave the joints by the error of a step, accelerations of a
                // shorter one must jump to bring them back, more and more the shorter it is.
                self.close_joints()?;
            } else {
                self.each_predictor(Predictor::withdraw);
                self.stage.state.copy_from(self.stage.good);
                self.stage.counters.cutbacks += 1;
            }
        }
        Ok(())
    }

    /// One attempt at a step; what was foreseen of it may not be what it fails for.
    fn advance(&mut self, step: Step, next: f64) -> Result<(), NewtonFailure> {
        self.stage.good.copy_from(self.stage.state);
        self.each_predictor(Predictor::reset);
        let mut result = self.attempt_step(step, next);
        if result.is_err() && self.predictor.has_foreseen() {
            self.each_predictor(Predictor::fail);
            self.stage.state.copy_from(self.stage.good);
            result = self.attempt_step(step, next);
        }
        let mut lists = 0;
        while result.is_err() && lists < MOST_LISTS && self.stage.looks_at_more() {
            lists += 1;
            self.each_predictor(Predictor::fail);
            result = self.attempt_step(step, next);
        }
        if result.is_err() {
            // It may have come to an end that is refused.
            self.each_predictor(Predictor::fail);
        }
        result
    }

    fn each_predictor(&mut self, work: impl Fn(&mut Predictor)) {
        let of_middle = self.middle.as_mut().map(|middle| &mut middle.predictor);
        std::iter::once(&mut self.predictor).chain(of_middle).for_each(work);
    }

    /// Predict, prescribe, iterate.
    fn attempt_step(&mut self, step: Step, next: f64) -> Result<(), NewtonFailure> {
        match self.middle.take() {
            None => self.find_end(step, next)?,
            Some(mut middle) => {
                let found = self.find_stages(&mut middle, &step, next);
                self.middle = Some(middle);
                found?;
            }
        }
        self.refuse_massless_turns()?;
        self.settle_rates(&step);
        self.refuse_turns(step.length)?;
        self.stage.refuse_departures()?;
        self.stage.refuse_leaps()?;
        self.stage.refuse_passing()?;
        self.stage.refuse_missed()?;
        if let Some(middle) = &self.middle {
            self.stage.refuse_missed_within(&middle.state)?;
        }
        let StageRun { assembly, newton, state, good, model, .. } = &mut *self.stage;
        let middle = self.middle.as_ref().map(|middle| &middle.state);
        let ends = StepEnds { from: good, middle, to: state };
        newton.end_step(model, &assembly.system, ends, &step, self.increments.as_ref());
        Ok(())
    }

    /// The states of the last step.
    fn step_ends(&self) -> StepEnds<'_> {
        let middle = self.middle.as_ref().map(|middle| &middle.state);
        StepEnds { from: self.stage.good, middle, to: self.stage.state }
    }

    /// Finds the balance at the end of a step.
    fn find_end(&mut self, step: Step, next: f64) -> Result<(), NewtonFailure> {
        self.predict(step, next)?;
        let StageRun { assembly, newton, state, model, counters, .. } = &mut *self.stage;
        self.predictor.begin(&assembly.system.pattern.dof_map, state, &step, newton.scratch());
        newton.solve(model, assembly, state, &step, None, &mut counters.work)?;
        self.predictor.end(&assembly.system.pattern.dof_map, state, step.length);
        Ok(())
    }

    /// Removes spins that are round-off from the rates.
    fn steady(&mut self) {
        let StageRun { plan, number, state, model, .. } = &mut *self.stage;
        if !self.rateless.is_empty() {
            model.steady(&plan.stages[*number].context(*number), state);
        }
    }

    /// Predicts the state at the end of a step by its scheme, and puts prescribed directions where
    /// they belong.
    fn predict(&mut self, step: Step, next: f64) -> Result<(), NewtonFailure> {
        self.steady();
        let StageRun { newton, state, model, schedule, .. } = &mut *self.stage;
        if let Some(error) = &mut newton.time_error {
            error.begin(&step, self.last_length);
        }
        if let Some(increments) = &mut self.increments {
            increments.begin(state, &step, self.last_length);
        }
        step.predict(state, self.last_length);
        match schedule.set_clock(model, state, next, 1.0) {
            Some(too_far) => Err(too_far.into()),
            None => Ok(()),
        }
    }

    /// After an iteration: total vectors take the place of increments, and velocities that enter no
    /// force are those of the way.
    fn settle_rates(&mut self, step: &Step) {
        let StageRun { assembly, state, good, counters, .. } = &mut *self.stage;
        if let Some(increments) = &mut self.increments {
            let switched = increments.end(state, good);
            counters.work.chart_switches += switched as u64;
            // Forces conjugate to total vectors, for reactions and the energy account.
            assembly.evaluate(state, Weights::NONE, None);
        } else if !self.rateless.is_empty() {
            // A rule for accelerations makes velocities that nothing resists swing from step to
            // step, more and more.
            let State { q, v, a, algorithmic, .. } = &mut **state;
            let (v, rates2) = (&mut v[..], [&mut a[..], &mut algorithmic[..]]);
            self.rateless.iter().for_each(|&slot| v[slot] = (q[slot] - good.q[slot]) * (1.0 / step.length));
            let kept = rates2.into_iter().filter(|rates| !rates.is_empty());
            kept.for_each(|rates| self.rateless.iter().for_each(|&slot| rates[slot] = Vec3::ZERO));
        }
    }

    /// Beyond half a turn in a step nobody could count the turns of a node.
    fn refuse_turns(&self, length: f64) -> Result<(), NewtonFailure> {
        let turning = self.stage.charted.rotations.iter().copied();
        turns_within(self.stage.state, turning.filter(|&slot| self.massive[slot as usize]), length)
    }

    /// Rotations without inertia have no spin to speak of: they go where balance is. While a step
    /// is iterated the unknown is the increment, or a total vector in the chart it began in.
    fn refuse_massless_turns(&self) -> Result<(), NewtonFailure> {
        let massless = self.stage.charted.rotations.iter().copied().filter(|&slot| !self.massive[slot as usize]);
        let mut turned = massless.map(|slot| {
            let (k, q) = (slot as usize, self.stage.state.q[slot as usize]);
            (k, if self.stage.state.turn(slot).is_some() { q.norm() } else { (q - self.stage.good.q[k]).norm() })
        });
        match turned.find(|&(_, angle)| angle > PI) {
            Some((slot, angle)) => Err(NewtonFailure::TurnsTooFar { slot, angle }),
            None => Ok(()),
        }
    }

    /// Completes a step that is taken: account, row, charts. True if the stage is over.
    fn complete(&mut self, step: &Step) -> Result<bool, Failure> {
        self.stage.accept()?;
        self.stage.counters.steps += 1;
        self.stage.show()?;
        self.follow_ringing();
        self.refuse_growth()?;
        if self.stage.is_over() {
            return Ok(true);
        }
        self.settle_charts(step);
        Ok(false)
    }

    /// Steps that adapt to their error have no even distances.
    fn follow_ringing(&mut self) {
        let watched = &self.stage.plan.watched;
        if !watched.is_empty() && self.settings.adaptive.is_none() {
            self.ringing.take(watched, &self.stage.snapshot());
        }
    }

    /// A scheme that makes energy from nothing ends the run while its results can still be told
    /// from round-off.
    fn refuse_growth(&mut self) -> Result<(), Failure> {
        let Some(guard) = &mut self.guard else { return Ok(()) };
        let StageRun { model, good, state, assembly, .. } = &*self.stage;
        let moved = model.farthest(good, state);
        if moved <= ROUNDED * model.length {
            guard.pass_over(ROUNDED * model.largest_force(&assembly.system) * model.length);
        }
        let Some(Growth { grown, largest }) = guard.judge(self.stage.bookkeeper.ledger(), moved) else { return Ok(()) };
        if self.is_round_off(largest) {
            return Ok(());
        }
        Err(Failure::EnergyGrowth { at: self.stage.moment(), grown, largest })
    }

    /// True if an energy is that of moving by what places are rounded by, in a step. The tangent is
    /// formed anew for it, and the guard passes over such energies from here on.
    fn is_round_off(&mut self, energy: f64) -> bool {
        let StageRun { assembly, model, state, .. } = &mut *self.stage;
        assembly.form_again(state, Weights { mass: self.last_length.powi(-2), ..Weights::STIFFNESS });
        let system = &assembly.system;
        let scales = model.scales(&system.pattern.dof_map);
        let mut stiffest = 0.0_f64;
        system.pattern.each_diagonal(|equation, place| {
            stiffest = stiffest.max(system.values[place].abs() * scales[equation].powi(2));
        });
        let of_round_off = stiffest * ROUNDED.powi(2);
        self.guard.iter_mut().for_each(|guard| guard.pass_over(of_round_off));
        energy <= of_round_off
    }

    /// Names the failure and goes back to the last good state.
    fn give_up(&mut self, failure: NewtonFailure) -> Failure {
        let named = self.stage.name_failure(failure, &self.stage.assembly.system);
        self.stage.state.copy_from(self.stage.good);
        named
    }

    /// The steps from `start` to the end; where rows are wanted at multiples of an interval, equal steps to the
    /// next of those.
    fn grid_from(&self, start: f64) -> Grid {
        let stop = self.next_stop(start);
        let over = if self.stage.plan.interval.is_some() { Grid::equal } else { Grid::over };
        over(start, stop, self.settings.step)
    }

    /// The next instant after `time` that must be hit.
    fn next_stop(&self, time: f64) -> f64 {
        let Some(interval) = self.stage.plan.interval else { return self.settings.end };
        let next = ((time / interval + 1e-9).floor() + 1.0) * interval;
        if next >= self.settings.end - 1e-9 * interval { self.settings.end } else { next }
    }

    /// The next instant that must be hit, or at which a load or a motion takes another course: what
    /// begins and ends within a step would leave no trace in the accelerations at its ends.
    fn next_corner(&self) -> f64 {
        let stop = self.next_stop(self.stage.state.time);
        self.stage.schedule.next_corner(self.stage.model, self.stage.state.time).map_or(stop, |corner| corner.min(stop))
    }

    /// Tells the observer the part of the stage that lies behind at a time.
    fn tell_time(&mut self, time: f64) -> Result<(), Failure> {
        let done = if self.settings.end > 0.0 { (time / self.settings.end).clamp(0.0, 1.0) } else { 1.0 };
        self.stage.tell_progress(done)
    }

    /// A fixed step fails, and is not the last that does.
    fn warn_of_subdivision(&mut self) {
        if !std::mem::replace(&mut self.stage.issued.subdivision, true) {
            let at = self.stage.moment();
            let message =
                format!("a time step did not converge at {at} and was subdivided, as are later ones that fail");
            self.stage.warn(WarningKind::StepSubdivided, message);
        }
    }
}

/// Refuses rotations by more than half a turn in a step of some length.
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
