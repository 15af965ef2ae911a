//! Load control: equal levels, approached in smaller steps where Newton fails.

use super::failure::Failure;
use super::run::{Run, Workshop};
use crate::integrate::Equilibrium;
use crate::kernel::Weights;
use crate::model::charts;
use crate::solve::{NewtonFailure, Pivots};
use crate::tensor::Vec3;

/// A level is not approached in steps smaller than this part of it.
const SMALLEST_PART: f64 = 1.0 / 4096.0;

/// Follows the number of negative pivots from level to level.
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

    /// At a level: says where a limit or branch point lies behind.
    fn look(&mut self, run: &mut Run, workshop: &mut Workshop) {
        let Some(pivots) = &mut self.pivots else { return };
        workshop.assembly.forget();
        workshop.assembly.evaluate(&run.state, Weights::STIFFNESS, None);
        let negative = pivots.negative(&workshop.assembly.system);
        if negative.is_none() {
            // Not symmetric: neither will the next be.
            self.pivots = None;
        }
        run.tell_stability(None, self.negative, negative);
        self.negative = negative;
    }
}

impl Run<'_> {
    /// All levels of a static stage.
    pub(super) fn run_static(&mut self, workshop: &mut Workshop, steps: usize, adaptive: bool) -> Result<(), Failure> {
        self.start_static(workshop)?;
        let mut stability = Stability::new(self, workshop);
        let mut increment = 1.0 / steps as f64;
        for level in 1..=steps {
            let target = level as f64 / steps as f64;
            increment = self.reach(workshop, target, increment, 1.0 / steps as f64, adaptive)?;
            self.counters.steps += 1;
            stability.look(self, workshop);
            self.show(workshop)?;
            if self.is_over(workshop) {
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
        charts::switch(&mut self.state, &self.model.rotations, 0.0, None);
        charts::freeze(&mut self.state, &self.model.elements);
        workshop.assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        let Workshop { assembly, newton, .. } = &mut *workshop;
        if newton.solver.factorise(&assembly.system)
            && let Some(vector) = newton.solver.null_vector(&assembly.system)
        {
            return Err(self.name_mechanism(Some(vector), &assembly.system));
        }
        self.open_account(workshop)
    }

    /// Goes to the load factor `target`; returns the increment that the next level may begin with.
    fn reach(
        &mut self,
        workshop: &mut Workshop,
        target: f64,
        mut increment: f64,
        level: f64,
        adaptive: bool,
    ) -> Result<f64, Failure> {
        self.good.copy_from(&self.state);
        while self.good.load < target {
            let rest = target - self.good.load;
            let next = if increment >= rest * (1.0 - 1e-9) { target } else { self.good.load + increment };
            self.observer.progress(self.moment(), self.static_progress(next))?;
            match self.attempt(workshop, next) {
                Ok(()) => {
                    self.accept(workshop)?;
                    self.good.copy_from(&self.state);
                    increment = (2.0 * increment).min(level);
                }
                Err(failure) => {
                    let smaller = 0.5 * increment.min(rest);
                    if !adaptive || smaller < SMALLEST_PART * level {
                        let named = self.name_failure(failure, &workshop.assembly.system);
                        self.state.copy_from(&self.good);
                        return Err(named);
                    }
                    self.counters.cutbacks += 1;
                    increment = smaller;
                    self.state.copy_from(&self.good);
                }
            }
        }
        Ok(increment)
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
