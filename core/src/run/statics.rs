//! Load control: equal levels, approached in smaller steps where Newton fails, and along the path where those fail too.

use super::failure::Failure;
use super::levels::{Approach, Levels, Way};
use super::path::Arrival;
use super::stage_run::{Run, StageRun};
use crate::integrate::Equilibrium;
use crate::kernel::Weights;
use crate::model::charts;
use crate::solve::{NewtonFailure, Signature, SoftMode, Tangent};
use crate::tensor::Vec3;
use crate::threads;
use crate::warning::WarningKind;

/// Load increments whose length a detour by arc length begins with.
const DETOUR: (f64, f64) = (0.01, 0.05);

/// What came of a step.
enum Tried {
    /// Balance, with these signs of pivots
    Good(Option<Signature>),
    /// Balance, perhaps on another branch
    Jumped(Option<Signature>),
    /// Balance, by an iteration that has not gone straight to it
    Strayed(Option<Signature>),
    /// None
    Failed(NewtonFailure),
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

/// What helps a stage that took over much from a motion.
const IN_MOTION: &str =
    " (the stage began in motion, whose forces fade: `[damping]` in the dynamic stage before it leaves less of them)";

impl Run<'_> {
    /// All levels of a static stage.
    pub(super) fn run_static(
        &mut self,
        workshop: &mut StageRun,
        steps: usize,
        approach: Approach,
    ) -> Result<(), Failure> {
        let loose = self.begin_static(workshop)?;
        let mut levels = Levels::new(self, workshop, steps, approach, loose);
        let at_start = levels.stability.signature;
        self.good.copy_from(&self.state);
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
        // What is linear keeps the tangent of its start.
        let signature = if self.is_linear() { at_start } else { levels.stability.signature };
        self.conclude_static(workshop, signature, false)
    }

    /// At rest, at load factor 0; refuses mechanisms before anything is loaded.
    pub(super) fn start_static(&mut self, workshop: &mut StageRun) -> Result<(), Failure> {
        self.begin_static(workshop)?.map_or(Ok(()), Err)
    }

    /// The same, but what nothing holds as long as nothing is loaded is only named.
    fn begin_static(&mut self, workshop: &mut StageRun) -> Result<Option<Failure>, Failure> {
        self.stand_still();
        let time = self.state.time;
        let held = self.state.q.clone();
        self.schedule.set_clock(&self.model, &mut self.state, time, 0.0);
        self.state.q = held;
        charts::switch(&mut self.state, &self.schedule.charted(&self.model).rotations, charts::STATIC_BAND, None);
        charts::freeze(&mut self.state, &self.schedule.charted(&self.model).elements);
        self.take_over(workshop);
        self.linearise(workshop)?;
        workshop.assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        let StageRun { assembly, newton, .. } = &mut *workshop;
        let mut tangent = Tangent::that_may_go(assembly, &self.state, Weights::STIFFNESS);
        self.counters.work.factorisations += 1;
        if self.is_linear() {
            // What is linear is factorised once.
            tangent = Tangent::that_stays(assembly, &self.state);
            newton.solver.factorise_new(&mut tangent);
        }
        let soft_mode = SoftMode::find(&mut newton.solver, &mut tangent, &self.model, self.stage > 0);
        // What cannot be factorised as long as nothing is loaded may be held by what the first step brings.
        if let Some(soft_mode) = soft_mode.filter(|soft_mode| !soft_mode.vector.broke_down) {
            if soft_mode.is_loose() {
                let named = self.name_mechanism(Some(soft_mode.vector), &assembly.system);
                // Conditions that joints say twice no load makes one.
                if matches!(&named, Failure::Singular { place: Some(place), .. } if place.is_joint()) {
                    return Err(named);
                }
                self.open_account(workshop)?;
                return Ok(Some(named));
            }
            if soft_mode.is_soft() {
                self.warn_of_softness();
            }
            // At the start of a run cables and strings are meant to be so.
            if soft_mode.is_held_by_stress() {
                let named = self.name_mechanism(Some(soft_mode.vector), &assembly.system);
                let message = format!("but for the stress it is under at the start of the stage: {named}");
                self.warn(WarningKind::HeldByStress, message);
            }
        }
        let loose = self.refuse_loose_in_space(workshop, Weights::STIFFNESS).err();
        self.open_account(workshop)?;
        Ok(loose)
    }

    /// Goes from the last good state to the load factor `target`: at once, in smaller steps, or along the path.
    fn reach(&mut self, workshop: &mut StageRun, target: f64, levels: &mut Levels) -> Result<Reached, Failure> {
        debug_assert!(
            self.state.q == self.good.q && self.state.load == self.good.load,
            "the last state is not the good one"
        );
        if let Some(loose) = levels.loose.take() {
            return self.rest_at(workshop, target, loose, levels);
        }
        while self.good.load < target {
            let next = levels.next(self.good.load, target);
            self.observer.progress(self.moment(), self.static_progress(next))?;
            match self.try_step(workshop, next, levels) {
                Tried::Good(signature) => self.take_step(workshop, signature, levels)?,
                _ if levels.halve(self.soft) => {
                    self.counters.cutbacks += 1;
                    self.state.copy_all_but_rates(&self.good);
                }
                // Nothing tells better.
                Tried::Strayed(signature) => self.take_step(workshop, signature, levels)?,
                Tried::Jumped(signature) if levels.approach != Approach::Path => {
                    self.take_step(workshop, signature, levels)?;
                }
                Tried::Jumped(_) => return self.go_around(workshop, target, None, levels),
                Tried::Failed(failure) => return self.go_around(workshop, target, Some(failure), levels),
            }
        }
        Ok(Reached::Level)
    }

    /// A level is reached by a motion to a state of rest, where there is one that its loads hold; else the stage ends with `failure`.
    fn rest_at(
        &mut self,
        workshop: &mut StageRun,
        target: f64,
        failure: Failure,
        levels: &mut Levels,
    ) -> Result<Reached, Failure> {
        let total = self.bookkeeper.ledger().total();
        let may_rest = !self.is_linear() && levels.approach != Approach::Straight && levels.way != Way::Levels;
        if !may_rest || !self.come_to_rest(workshop, target)? {
            return Err(failure);
        }
        self.refuse_loose_at_rest(workshop)?;
        let at = self.moment();
        let why = if let Failure::Singular { place: Some(place), .. } = &failure {
            format!("nothing but its loads holds {place}")
        } else {
            "load levels lead to no balance".into()
        };
        let message = format!(
            "{why}: the state at {at} is where the structure came to rest, moved by all forces against an artificial resistance; it is in \
             balance without that"
        );
        self.warn(WarningKind::CameToRest, message);
        levels.stability.signature = levels.stability.look(self, workshop);
        levels.way = Way::Rest;
        self.take_step(workshop, levels.stability.signature, levels)?;
        self.bookkeeper.damp_to(total);
        Ok(Reached::Level)
    }

    fn try_step(&mut self, workshop: &mut StageRun, next: f64, levels: &mut Levels) -> Tried {
        if let Err(failure) = self.attempt(workshop, next) {
            return Tried::Failed(failure);
        }
        let signature = levels.stability.look(self, workshop);
        let states = [&self.good, &self.state];
        let newton = &workshop.newton;
        let jumped = !self.soft && levels.may_have_jumped(&self.model, states, &newton.first, signature);
        match jumped {
            true => Tried::Jumped(signature),
            false if !self.soft && levels.may_have_strayed(newton.contraction, signature) => Tried::Strayed(signature),
            false => Tried::Good(signature),
        }
    }

    fn take_step(
        &mut self,
        workshop: &mut StageRun,
        signature: Option<Signature>,
        levels: &mut Levels,
    ) -> Result<(), Failure> {
        self.accept(workshop)?;
        levels.stability.pass(self, workshop, signature)?;
        self.good.copy_all_but_rates(&self.state);
        levels.way = levels.way.max(Way::Levels);
        // Where pivots were looked at the stiffness is that of this state.
        if signature.is_some() {
            workshop.newton.begin_with(&workshop.assembly.system);
        }
        levels.double();
        Ok(())
    }

    /// Where load control stands still the path is followed by arc length until it comes to the level. `failure` is what
    /// load control ended with, if it did not only seem to jump.
    fn go_around(
        &mut self,
        workshop: &mut StageRun,
        target: f64,
        failure: Option<NewtonFailure>,
        levels: &mut Levels,
    ) -> Result<Reached, Failure> {
        let named = failure.map(|failure| self.name_failure(failure, &workshop.assembly.system));
        self.state.copy_from(&self.good);
        let hopeless = levels.approach != Approach::Path || self.soft;
        match named {
            Some(named) if levels.approach == Approach::Straight || !named.is_of_balance() => return Err(named),
            Some(named) if hopeless => return self.rest_at(workshop, target, named, levels),
            _ => {}
        }
        let (at, steps) = (self.moment(), self.counters.steps);
        let motion = if self.state.fading.is_empty() { "" } else { IN_MOTION };
        let message =
            format!("load control stands still at {at}: the path is followed by arc length from there{motion}");
        self.warn(WarningKind::ArcLengthDetour, message);
        let increment = levels.level.clamp(DETOUR.0, DETOUR.1);
        let arrival = self.detour(workshop, &levels.start, target, increment, levels.level);
        let (end, increments) = (self.moment(), self.counters.steps - steps);
        let limit = Failure::LimitPoint { at, goal: target, increments, end };
        match arrival {
            Ok(Arrival::Until) => {
                levels.stability.signature = levels.stability.look(self, workshop);
                Ok(Reached::Over)
            }
            Ok(Arrival::Goal) => {
                self.resume(workshop, target, increments, levels);
                Ok(Reached::Along)
            }
            Ok(Arrival::OutOfSteps) => Err(limit),
            Ok(Arrival::Nowhere) => self.rest_at(workshop, target, named.unwrap_or(limit), levels),
            Err(failure) if !failure.is_of_balance() => Err(failure),
            Err(_) if increments > 0 => self.rest_at(workshop, target, limit, levels),
            Err(failure) => self.rest_at(workshop, target, named.unwrap_or(failure), levels),
        }
    }

    /// Load control goes on where a detour has come to its level.
    fn resume(&mut self, workshop: &mut StageRun, target: f64, increments: u64, levels: &mut Levels) {
        self.good.copy_from(&self.state);
        levels.stability.signature = levels.stability.look(self, workshop);
        levels.restart();
        self.warn(
            WarningKind::LoadControlResumed,
            format!("load control goes on at load factor {target}, after {increments} increments of arc length"),
        );
    }

    /// One attempt at a load factor. Prescribed motions enter with the first correction: they are taken back out of the
    /// state and handed to Newton as increments.
    pub(super) fn attempt(&mut self, workshop: &mut StageRun, load: f64) -> Result<(), NewtonFailure> {
        let StageRun { assembly, newton, prescribed_increment, .. } = workshop;
        let moves = self.set_load(prescribed_increment, load)?;
        let moved = moves.then_some(&prescribed_increment[..]);
        let work = &mut self.counters.work;
        newton.solve(&self.model, assembly, &mut self.state, &Equilibrium, moved, work)?;
        self.refuse_leaps()?;
        self.refuse_windings()
    }

    /// Sets the load factor; `prescribed_increment` takes the increments of prescribed motions, which are not in the state yet. Whether there are any.
    pub(super) fn set_load(&mut self, prescribed_increment: &mut Vec<Vec3>, load: f64) -> Result<bool, NewtonFailure> {
        threads::copy(prescribed_increment, if self.model.motions.is_empty() { &[] } else { &self.state.q });
        let time = self.state.time;
        if let Some((slot, angle)) = self.schedule.set_clock(&self.model, &mut self.state, time, load) {
            return Err(NewtonFailure::TurnsTooFar { slot: slot as usize, angle });
        }
        for (prescribed_increment, q) in prescribed_increment.iter_mut().zip(&mut self.state.q) {
            let before = *prescribed_increment;
            *prescribed_increment = *q - before;
            *q = before;
        }
        Ok(prescribed_increment.iter().any(|&v| v != Vec3::ZERO))
    }

    pub(super) fn static_progress(&self, load: f64) -> f64 {
        (self.stage as f64 + load) / self.plan.stages.len() as f64
    }
}
