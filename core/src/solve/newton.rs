//! Newton's iteration on one step or load level.

use super::convergence::{Convergence, Residual, Verdict, size};
use super::linear::LinearSolver;
use super::pivots::Signature;
use super::refinement::Refinement;
use super::reuse::Reuse;
use super::soft_mode::mechanism;
use super::softest::NullVector;
use super::stress_predictor::StressPredictor;
use super::tangent::Tangent;
use crate::integrate::{Increments, Method, Step, TimeError};
use crate::kernel::Weights;
use crate::model::{Assembly, Charted, Model, charts};
use crate::scalar::CompressedField;
use crate::system::{State, System};
use crate::tensor::{Vec3, zeros};
use std::time::Instant;

/// Work done, added up over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Corrections of Newton's method whose forces were looked at
    pub iterations: u64,
    /// Factorisations
    pub factorisations: u64,
    /// Changes of chart
    pub chart_switches: u64,
    /// Seconds spent on forces and tangents, scattered into the system
    pub evaluation_seconds: f64,
    /// Seconds spent on factorising and solving
    pub solve_seconds: f64,
    /// What round-off still leaves to correct where an iteration ended, relative to the unknowns
    pub uncertainty: f64,
}

/// Runs `part` and adds its seconds to `seconds`.
pub fn timed<R>(seconds: &mut f64, part: impl FnOnce() -> R) -> R {
    let start = Instant::now();
    let result = part();
    *seconds += start.elapsed().as_secs_f64();
    result
}

/// Why an iteration did not end in balance.
#[derive(Clone, Debug, PartialEq)]
pub enum NewtonFailure {
    /// Too many iterations, or corrections that run away
    NotConverged {
        /// The worst residual of the last iterate
        residual: Residual,
        /// The largest residual of each iterate, over what is allowed
        history: Vec<f64>,
    },
    /// A prescribed rotation goes too far at once.
    TurnsTooFar {
        /// Of this slot
        slot: usize,
        /// Radians
        angle: f64,
    },
    /// Neighbouring nodes turn past pi against each other at once.
    LeapsTooFar {
        /// Of this element
        element: usize,
        /// What their relative rotation would be
        angle: f64,
    },
    /// The error of the smallest step is above what it may be.
    StepTooSmall {
        /// Of this slot
        slot: usize,
        /// Relative to the scene's length, or in radians
        error: f64,
        /// What is allowed
        share: f64,
    },
    /// The tangent cannot be solved with.
    Singular(Option<NullVector>),
    /// A force is not finite.
    NotFinite {
        /// The effect that gave it, if one did
        effect: Option<&'static str>,
        /// Where
        slot: usize,
    },
}

impl NewtonFailure {
    /// Names the effect whose forces are not finite; of a sum that overflows nobody alone is to blame.
    pub fn not_finite(assembly: &mut Assembly, state: &State) -> Self {
        match assembly.culprit(state) {
            Some((effect, slot)) => Self::NotFinite { effect: Some(effect), slot },
            None => Self::NotFinite { effect: None, slot: 0 },
        }
    }
}

/// The iteration with its linear solver and its scratch.
pub struct Newton {
    /// When to stop
    pub convergence: Convergence,
    /// Linear solves allowed
    pub max_iterations: usize,
    /// Solves with the tangent
    pub solver: LinearSolver,
    dq: Vec<Vec3>,
    /// The size of the last correction of a solution: `None` before the first, infinite after a change of chart
    last: Option<f64>,
    /// The first correction of the last solution in statics, along the tangent of the path; empty where nothing was to correct
    pub first: CompressedField<3>,
    /// The largest ratio of a correction of the last solution to the one before it, of those that are no round-off: an iteration that
    /// follows the path contracts
    pub contraction: f64,
    reuse: Reuse,
    foresight: StressPredictor,
    /// What follows the error of time steps, where something does
    pub time_error: Option<TimeError>,
    /// The tangent that is known to be that of the state a solution begins with, see [`Newton::begin_with`]
    given: Option<u64>,
}

/// Corrections below this (lengths of the scene, radians) need not become any smaller.
const NO_CORRECTION: f64 = 1e-6;

/// A correction of more than this (lengths of the scene, radians) is a flight, not a step.
const RUNAWAY: f64 = 1e6;

impl Newton {
    /// For a stage with these unknowns.
    pub fn new(convergence: Convergence, max_iterations: usize, solver: LinearSolver, system: &System) -> Self {
        Self {
            convergence,
            max_iterations,
            solver,
            dq: zeros(system.force[0].len()),
            last: None,
            first: CompressedField::default(),
            contraction: 0.0,
            reuse: Reuse::new(),
            foresight: StressPredictor::default(),
            time_error: None,
            given: None,
        }
    }

    /// What the pivots of a tangent tell, see [`LinearSolver::signature`].
    pub fn signature(&mut self, tangent: &mut Tangent, work: &mut Work) -> Option<Signature> {
        let known = self.solver.has_factorised(tangent.system());
        let signature = self.solver.signature(tangent);
        work.factorisations += u64::from(!known && self.solver.has_factorised(tangent.system()));
        signature
    }

    /// Forms the stiffness of a state, and tells what its pivots do.
    pub fn signature_at(&mut self, assembly: &mut Assembly, state: &State, work: &mut Work) -> Option<Signature> {
        assembly.forget();
        assembly.evaluate(state, Weights::STIFFNESS, None);
        self.signature(&mut Tangent::that_may_go(assembly, state, Weights::STIFFNESS), work)
    }

    /// The tangent that is there is that of another state than the one the next solution begins with.
    pub fn begin_anew(&mut self) {
        self.given = None;
    }

    /// Memory for a field of slots that nobody needs between solutions.
    pub fn scratch(&mut self) -> &mut [Vec3] {
        &mut self.dq
    }

    /// The tangent of the system is that of the state that the next solution begins with, but for the loads.
    pub fn begin_with(&mut self, system: &System) {
        self.given = Some(system.revision);
    }

    /// Brings the state into balance. `prescribed_increment` holds increments of held directions that are not in the state yet: they go
    /// in with the first correction, so that the rest of the structure follows them linearly. The forces of the system are then those of
    /// the state; its tangent need not be.
    pub fn solve(
        &mut self,
        model: &Model,
        assembly: &mut Assembly,
        state: &mut State,
        method: &dyn Method,
        mut prescribed_increment: Option<&[Vec3]>,
        work: &mut Work,
    ) -> Result<(), NewtonFailure> {
        self.foresight.forget(assembly);
        let round_off = assembly.round_off(state);
        let mut iterations = 0;
        (self.last, self.contraction) = (None, 0.0);
        self.first.clear();
        self.reuse.begin(self.given.take() == Some(assembly.system.revision));
        let (mut refinement, mut formed_anew) = (Refinement::default(), false);
        loop {
            let forms =
                prescribed_increment.is_some() || iterations >= self.max_iterations || self.reuse.expects_tangent();
            let weights = if forms { method.weights() } else { Weights::NONE };
            if forms {
                self.foresight.foresee(assembly, state, &self.dq);
            }
            timed(&mut work.evaluation_seconds, || assembly.evaluate(state, weights, prescribed_increment));
            let (verdict, residual) = self.convergence.judge(model, &assembly.system, round_off, self.last);
            let noisy = verdict == Verdict::Noisy;
            self.reuse.look(residual.ratio, noisy);
            match verdict {
                Verdict::Converged if prescribed_increment.is_none() => {
                    if residual.ratio > 0.0 {
                        self.polish(model, assembly, state, method, forms, work);
                    }
                    self.end(assembly, state);
                    return Ok(());
                }
                // Each correction with a new residual refines the solution, until round-off makes it no smaller.
                Verdict::Noisy if prescribed_increment.is_none() && iterations > 0 => {
                    let last = self.last.unwrap_or_default();
                    let refined = refinement.look(model, &self.dq, last, size(model, &state.q));
                    if refined.stalls() && !self.reuse.is_own() && !formed_anew {
                        // Not round-off may make it stall, but an older tangent.
                        formed_anew = true;
                        self.reuse.forget();
                    } else if refined.is_done() || iterations >= self.max_iterations {
                        work.uncertainty = work.uncertainty.max(refined.uncertainty());
                        self.end(assembly, state);
                        return Ok(());
                    }
                }
                Verdict::NotFinite => return Err(NewtonFailure::not_finite(assembly, state)),
                Verdict::Continue if iterations < self.max_iterations => refinement = Refinement::default(),
                _ if iterations >= self.max_iterations => {
                    let mut tangent = Tangent::that_may_go(assembly, state, method.weights());
                    return Err(self.not_converged(&mut tangent, residual));
                }
                _ => {}
            }
            if forms || !self.reuse.keeps_tangent() {
                if !forms {
                    self.form(assembly, state, method, work);
                }
                self.reuse.form(prescribed_increment.is_some());
                // What one tangent leaves tells nothing of the corrections with another one.
                refinement = Refinement::default();
            } else {
                self.reuse.keep();
            }
            self.show_rates(assembly, state, method, work);
            let mut tangent = Tangent::that_may_go(assembly, state, method.weights());
            if !self.find_correction(&mut tangent, prescribed_increment.take(), work) {
                return Err(NewtonFailure::Singular(mechanism(&mut self.solver, &mut tangent, model)));
            }
            iterations += 1;
            let length = size(model, &self.dq);
            if length > RUNAWAY {
                // Round-off may have left a stiffness where there is none.
                return Err(match mechanism(&mut self.solver, &mut tangent, model) {
                    Some(vector) => NewtonFailure::Singular(Some(vector)),
                    None => self.not_converged(&mut tangent, residual),
                });
            }
            // Where balance is expected the next tangent, if any, is that of the state itself.
            if !noisy && self.reuse.expects_balance() {
                self.foresight.forget(assembly);
            } else {
                self.foresight.remember();
            }
            if let Some(last) = self.last.filter(|&last| last > NO_CORRECTION) {
                self.contraction = self.contraction.max(length / last);
            }
            let changes_charts = method.changes_charts();
            if changes_charts && iterations == 1 {
                self.first.take(self.dq.len(), |slot| self.dq[slot].0);
            }
            Self::add(model.charted(assembly.stage.kind), state, method, &self.dq);
            // What was a correction before is none in a new chart: it may not end the iteration.
            let switched = changes_charts && self.change_charts(model, assembly, state, work);
            self.last = Some(if switched { f64::INFINITY } else { length });
        }
    }

    /// A solution is found.
    fn end(&mut self, assembly: &mut Assembly, state: &State) {
        let Self { time_error, solver, dq, .. } = self;
        if let Some(time_error) = time_error {
            let mut correct = |system: &System, dq: &mut [Vec3]| {
                solver.has_factorised(system) && solver.correct(system, false, None, dq)
            };
            time_error.solve(&mut correct, &mut assembly.system, state, dq);
        }
        self.reuse.end();
        self.solver.succeeded();
    }

    /// What follows the error of a time step sees the state that a new tangent is that of. That of a linear stage, which is formed once, fits
    /// the states of all steps.
    fn show_rates(&mut self, assembly: &mut Assembly, state: &mut State, method: &dyn Method, work: &mut Work) {
        let Self { time_error, solver, .. } = self;
        let is_new = !solver.has_factorised(&assembly.system);
        if let Some(time_error) = time_error.as_mut().filter(|error| is_new || error.knows_no_forces()) {
            timed(&mut work.evaluation_seconds, || time_error.look(assembly, state, method.weights()));
        }
    }

    /// The step that was solved last is taken from one state to another.
    pub fn end_step(
        &mut self,
        system: &System,
        states: (&State, &State),
        step: &Step,
        increments: Option<&Increments>,
    ) {
        if let Some(time_error) = &mut self.time_error {
            time_error.end(system, &self.dq, states, step, increments);
        }
    }

    /// Forces and the tangent.
    fn form(&mut self, assembly: &mut Assembly, state: &mut State, method: &dyn Method, work: &mut Work) {
        self.foresight.foresee(assembly, state, &self.dq);
        timed(&mut work.evaluation_seconds, || assembly.evaluate(state, method.weights(), None));
    }

    /// Another correction with a tangent of this solution takes most of a residual away for the price of a substitution: what is
    /// left of it may grow from time step to time step. Forces stay those of the iterate before, from which they differ by less
    /// than the stop test allows. A time step that is in balance at once has no tangent but its own; `formed` where it is there.
    fn polish(
        &mut self,
        model: &Model,
        assembly: &mut Assembly,
        state: &mut State,
        method: &dyn Method,
        formed: bool,
        work: &mut Work,
    ) {
        // A correction that grows is none; without one before, one that is large for its residual is of something loose.
        let most = self.last.unwrap_or_else(|| self.convergence.tolerance.sqrt());
        if self.last.is_none() && method.changes_charts() {
            return;
        }
        if !formed && !self.reuse.has_tangent() {
            self.form(assembly, state, method, work);
        }
        self.show_rates(assembly, state, method, work);
        let mut tangent = Tangent::that_may_go(assembly, state, method.weights());
        if self.substitute(&mut tangent, None, formed, work) && size(model, &self.dq) <= most {
            Self::add(model.charted(assembly.stage.kind), state, method, &self.dq);
        }
    }

    /// Corrects a state.
    fn add(charted: &Charted, state: &mut State, method: &dyn Method, dq: &[Vec3]) {
        if method.changes_charts() {
            charts::carry(state, dq, &charted.rotations);
        }
        method.correct(state, dq);
    }

    /// The next attempt is better off with pivots where round-off has taken most of the softest stiffness.
    fn not_converged(&mut self, tangent: &mut Tangent, residual: Residual) -> NewtonFailure {
        self.solver.doubt(tangent);
        NewtonFailure::NotConverged { residual, history: self.reuse.history.clone() }
    }

    /// Solves J dq = -g; held directions take their part of `prescribed_increment`. `false` where there is no solution.
    fn find_correction(
        &mut self,
        tangent: &mut Tangent,
        prescribed_increment: Option<&[Vec3]>,
        work: &mut Work,
    ) -> bool {
        work.iterations += 1;
        // What an older tangent leaves is more than what the solver does.
        self.substitute(tangent, prescribed_increment, self.reuse.is_own(), work)
    }

    /// The same, with a look at what the solver leaves or without.
    fn substitute(
        &mut self,
        tangent: &mut Tangent,
        prescribed_increment: Option<&[Vec3]>,
        looks: bool,
        work: &mut Work,
    ) -> bool {
        let Self { solver, dq, .. } = self;
        timed(&mut work.solve_seconds, || {
            let (done, new) = solver.factorise_new(tangent);
            work.factorisations += u64::from(new);
            done && solver.correct(tangent.system(), looks || new, prescribed_increment, dq)
        })
    }

    /// In statics a node changes its chart as soon as an iterate passes pi, so that the tangent stays regular at any turn; whether one did.
    fn change_charts(&mut self, model: &Model, assembly: &mut Assembly, state: &mut State, work: &mut Work) -> bool {
        let charted = model.charted(assembly.stage.kind);
        if charts::first_beyond(state, &charted.rotations, charts::STATIC_BAND).is_none() {
            return false;
        }
        self.foresight.foresee(assembly, state, &self.dq);
        work.chart_switches += charts::switch(state, &charted.rotations, charts::STATIC_BAND, None) as u64;
        charts::freeze(state, &charted.elements);
        self.reuse.forget();
        true
    }
}
