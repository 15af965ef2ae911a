//! Load control: equal levels, approached in smaller steps where Newton fails, and along the path where those fail too.

use super::failure::Failure;
use super::path::{Arrival, squared};
use super::run::{Run, Workshop};
use crate::integrate::Equilibrium;
use crate::kernel::Weights;
use crate::model::charts;
use crate::solve::{Limp, NewtonFailure, Pivots};
use crate::system::State;
use crate::tensor::Vec3;

/// A level is not approached in steps smaller than this part of it.
const SMALLEST_PART: f64 = 1.0 / 4096.0;

/// Load increments whose length a detour by arc length begins with.
const DETOUR: (f64, f64) = (0.01, 0.05);

/// A step over which the number of negative pivots changes is cut back to this part of a level: it may have jumped.
const CLOSE: f64 = 1.0 / 256.0;

/// And it may not have moved further than so many times what the path has moved so far by such a part of the load.
const JUMP: f64 = 8.0;

/// Follows the number of negative pivots from step to step.
struct Stability {
    pivots: Option<Pivots>,
    negative: Option<usize>,
}

impl Stability {
    /// At the start of a stage.
    fn new(run: &Run, workshop: &Workshop) -> Self {
        let system = &workshop.assembly.system;
        let mut pivots = Pivots::new(system, &run.model.multipliers);
        // The start was assembled with its stiffness.
        let negative = pivots.as_mut().and_then(|pivots| pivots.negative(system));
        Self { pivots, negative }
    }

    /// The number at the run's state; `None` where it is not known.
    fn count(&mut self, run: &Run, workshop: &mut Workshop) -> Option<usize> {
        let pivots = self.pivots.as_mut()?;
        workshop.assembly.forget();
        workshop.assembly.evaluate(&run.state, Weights::STIFFNESS, None);
        let negative = pivots.negative(&workshop.assembly.system);
        if negative.is_none() {
            // Not symmetric: neither will the next be.
            self.pivots = None;
        }
        negative
    }

    fn changes_to(&self, negative: Option<usize>) -> bool {
        matches!((self.negative, negative), (Some(before), Some(after)) if before != after)
    }

    /// Says where a limit or branch point lies behind.
    fn pass(&mut self, run: &mut Run, negative: Option<usize>) {
        run.tell_stability(None, self.negative, negative);
        self.negative = negative;
    }
}

/// How the levels of a stage are approached.
struct Levels {
    /// The state before the first
    start: State,
    /// Load factor from one to the next
    level: f64,
    /// Where smaller steps are allowed, the next one; else `None`
    increment: Option<f64>,
    stability: Stability,
}

/// How a level was reached.
#[derive(PartialEq)]
enum Reached {
    /// By load control
    Level,
    /// Along the path, which has shown its rows
    Along,
    /// The stage's `until` came true on the way.
    Over,
}

impl Run<'_> {
    /// All levels of a static stage.
    pub(super) fn run_static(&mut self, workshop: &mut Workshop, steps: usize, adaptive: bool) -> Result<(), Failure> {
        self.start_static(workshop)?;
        let level = 1.0 / steps as f64;
        let stability = Stability::new(self, workshop);
        let mut levels = Levels { start: self.state.clone(), level, increment: adaptive.then_some(level), stability };
        for number in 1..=steps {
            let reached = self.reach(workshop, number as f64 / steps as f64, &mut levels)?;
            if reached == Reached::Level {
                self.counters.steps += 1;
                self.show(workshop)?;
            }
            if reached == Reached::Over || self.is_over(workshop) {
                break;
            }
        }
        Ok(())
    }

    /// At rest, at load factor 0; refuses mechanisms before anything is loaded.
    pub(super) fn start_static(&mut self, workshop: &mut Workshop) -> Result<(), Failure> {
        self.stand_still();
        let time = self.state.time;
        let held = self.state.q.clone();
        self.model.set_clock(&mut self.state, time, 0.0);
        self.state.q = held;
        charts::switch(&mut self.state, &self.model.rotations, charts::STATIC_BAND, None);
        charts::freeze(&mut self.state, &self.model.elements);
        workshop.assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        let Workshop { assembly, newton, .. } = &mut *workshop;
        if newton.solver.factorise(&assembly.system)
            && let Some(limp) = Limp::find(&mut newton.solver, assembly, &self.model, &self.state)
        {
            if limp.is_loose() {
                return Err(self.name_mechanism(Some(limp.vector), &assembly.system));
            }
            self.warn_of_softness();
        }
        self.open_account(workshop)
    }

    /// Goes to the load factor `target`: at once, in smaller steps, or along the path.
    fn reach(&mut self, workshop: &mut Workshop, target: f64, levels: &mut Levels) -> Result<Reached, Failure> {
        self.good.copy_from(&self.state);
        while self.good.load < target {
            let rest = target - self.good.load;
            let increment = levels.increment.unwrap_or(rest);
            let next = if increment >= rest * (1.0 - 1e-9) { target } else { self.good.load + increment };
            self.observer.progress(self.moment(), self.static_progress(next))?;
            let attempt = self.attempt(workshop, next);
            let negative = if attempt.is_ok() { levels.stability.count(self, workshop) } else { None };
            if attempt.is_ok() && !self.may_have_jumped(levels, negative) {
                levels.stability.pass(self, negative);
                self.accept(workshop)?;
                self.good.copy_from(&self.state);
                levels.increment = levels.increment.map(|increment| (2.0 * increment).min(levels.level));
                continue;
            }
            let smaller = 0.5 * increment.min(rest);
            if levels.increment.is_some() && smaller >= SMALLEST_PART * levels.level {
                self.counters.cutbacks += 1;
                levels.increment = Some(smaller);
                self.state.copy_from(&self.good);
            } else {
                return self.go_around(workshop, target, attempt.err(), levels);
            }
        }
        Ok(Reached::Level)
    }

    /// Whether a step that changed the number of negative pivots may have gone to another branch: it is not small, or the
    /// displacements are not those of a path that goes on.
    fn may_have_jumped(&self, levels: &Levels, negative: Option<usize>) -> bool {
        if levels.increment.is_none() || self.soft || !levels.stability.changes_to(negative) {
            return false;
        }
        let step = self.state.load - self.good.load;
        let risen = self.good.load - levels.start.load;
        let moved = |to: &State, from: &State| {
            let field: Vec<Vec3> = to.q.iter().zip(&from.q).map(|(to, from)| *to - *from).collect();
            squared(self, &field).sqrt()
        };
        let usual = if risen > 0.0 { moved(&self.good, &levels.start) / risen * step } else { f64::INFINITY };
        step > CLOSE * levels.level || moved(&self.state, &self.good) > JUMP * usual
    }

    /// Where load control stands still the path is followed by arc length until it comes to the level. `failure` is what
    /// load control ended with, if it did not only seem to jump.
    fn go_around(
        &mut self,
        workshop: &mut Workshop,
        target: f64,
        failure: Option<NewtonFailure>,
        levels: &mut Levels,
    ) -> Result<Reached, Failure> {
        let named = failure.map(|failure| self.name_failure(failure, &workshop.assembly.system));
        self.state.copy_from(&self.good);
        let stuck = matches!(named, None | Some(Failure::NotConverged { .. } | Failure::Singular { .. }));
        if let Some(named) = &named
            && (levels.increment.is_none() || !stuck || self.soft)
        {
            return Err(named.clone());
        }
        let (at, steps) = (self.moment(), self.counters.steps);
        self.observer
            .warn(&format!("load control stands still at {at}: the path is followed by arc length from there"));
        let arrival = self.detour(workshop, &levels.start, target, levels.level.clamp(DETOUR.0, DETOUR.1));
        let (end, increments) = (self.moment(), self.counters.steps - steps);
        let limit = Failure::LimitPoint { at, goal: target, increments, end };
        match arrival {
            Ok(Arrival::Until) => return Ok(Reached::Over),
            Ok(Arrival::Goal) => {}
            Ok(Arrival::OutOfSteps) => return Err(limit),
            Err(Failure::NotConverged { .. } | Failure::Singular { .. }) if increments > 0 => return Err(limit),
            Err(failure) => return Err(named.unwrap_or(failure)),
        }
        self.observer.warn(&format!(
            "load control goes on at load factor {target}, after {increments} increments of arc length"
        ));
        self.good.copy_from(&self.state);
        levels.stability.negative = levels.stability.count(self, workshop);
        levels.increment = Some(levels.level);
        Ok(Reached::Along)
    }

    /// One attempt at a load factor. Prescribed motions enter with the first correction: they are taken back out of the
    /// state and handed to Newton as increments.
    pub(super) fn attempt(&mut self, workshop: &mut Workshop, load: f64) -> Result<(), NewtonFailure> {
        let Workshop { assembly, newton, lift, .. } = workshop;
        lift.copy_from_slice(&self.state.q);
        let time = self.state.time;
        if let Some((slot, angle)) = self.model.set_clock(&mut self.state, time, load) {
            return Err(NewtonFailure::TurnsTooFar { slot: slot as usize, angle });
        }
        for (lift, q) in lift.iter_mut().zip(&mut self.state.q) {
            let before = *lift;
            *lift = *q - before;
            *q = before;
        }
        let moved = lift.iter().any(|&v| v != Vec3::ZERO).then_some(&lift[..]);
        let work = &mut self.counters.work;
        newton.solve(&self.model, assembly, &mut self.state, &Equilibrium, moved, work)
    }

    pub(super) fn static_progress(&self, load: f64) -> f64 {
        (self.stage as f64 + load) / self.plan.stages.len() as f64
    }
}
