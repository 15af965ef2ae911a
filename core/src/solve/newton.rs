//! Newton's iteration for one time step or load level.

use super::convergence::{Convergence, Judgement, Residual, Verdict, size};
use super::linear::{Factorisation, LinearSolver, MethodChoice};
use super::newton_failure::NewtonFailure;
use super::refinement::Refinement;
use super::reuse::Reuse;
use super::signature::Signature;
use super::soft_mode::mechanism;
use super::softest::NullVector;
use super::stress_predictor::StressPredictor;
use super::tangent::Tangent;
use super::work::{Work, timed};
use crate::effect::RoundOff;
use crate::integrate::{Increments, Method, Step, StepEnds, TimeError};
use crate::kernel::Weights;
use crate::model::{Assembly, Charted, Model, charts};
use crate::scalar::CompressedField;
use crate::system::{State, System};
use crate::tensor::{Vec3, zeros};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Newton's iteration with its linear solver and buffers, kept between solutions.
pub struct Newton {
    /// Stop test
    pub(crate) convergence: Convergence,
    /// Largest number of linear solves in a solution
    pub(crate) max_iterations: usize,
    /// Linear solver
    pub solver: LinearSolver,
    pub(super) dq: Vec<Vec3>,
    /// Size of the last correction of the current solution: `None` before the first, infinite after
    /// a change of chart
    last: Option<f64>,
    /// First correction of the last solution in statics, tangential to the equilibrium path; empty
    /// if there was none
    pub(crate) first: CompressedField<3>,
    /// Largest ratio of successive corrections of the last solution, above round-off; small if the
    /// iteration follows the path
    pub(crate) contraction: f64,
    /// A solution ends without a result where a correction is larger than this part of the one before
    /// it: a step that would be refused costs no more of them. Infinite unless a caller sets it
    pub(crate) largest_contraction: f64,
    /// True if the last solution was ended by `largest_contraction`
    has_ended_early: bool,
    /// True if a correction of the last solution was shortened, so that centre lines of beams do not
    /// cross
    pub(crate) was_shortened: bool,
    /// True if the last correction was
    is_short: bool,
    reuse: Reuse,
    stress_predictor: StressPredictor,
    /// Error estimator of time steps, in adaptive dynamics
    pub(crate) time_error: Option<TimeError>,
    /// Revision of the tangent if it is that of the start of the next solution, see
    /// [`Newton::begin_with`]
    given: Option<u64>,
}

/// What an iteration takes from one solution to the next.
#[derive(Deserialize, Serialize)]
pub struct NewtonMemory {
    choice: MethodChoice,
    /// Number of tangents that the last solution has required
    tangents: usize,
    time_error: Option<TimeError>,
}

/// Corrections below this size (relative to the length of the scene, or in radians) do not count
/// for the contraction.
const SMALLEST_COMPARED_CORRECTION: f64 = 1e-6;

/// Corrections above this size (relative to the length of the scene, or in radians) show
/// divergence.
const DIVERGED_CORRECTION: f64 = 1e6;

/// The same for static levels that begin with points that touch: none of 230 attempts with such a
/// correction has come to a balance, and another stiffness of the contacts is tried.
const DIVERGED_IN_CONTACT: f64 = 30.0;

/// A correction of size `now` over the one before it; zero where that tells nothing.
pub fn contraction(last: Option<f64>, now: f64) -> f64 {
    last.filter(|&last| last > SMALLEST_COMPARED_CORRECTION).map_or(0.0, |last| now / last)
}

impl Newton {
    /// Newton's iteration for a stage with this system.
    pub fn new(convergence: Convergence, max_iterations: usize, solver: LinearSolver, system: &System) -> Self {
        Self {
            convergence,
            max_iterations,
            solver,
            dq: zeros(system.force[0].len()),
            last: None,
            first: CompressedField::default(),
            contraction: 0.0,
            largest_contraction: f64::INFINITY,
            has_ended_early: false,
            was_shortened: false,
            is_short: false,
            reuse: Reuse::new(),
            stress_predictor: StressPredictor::default(),
            time_error: None,
            given: None,
        }
    }

    /// True if the next solution starts with the tangent of the system.
    pub fn is_given(&self, system: &System) -> bool {
        self.given == Some(system.revision)
    }

    /// What the next solution depends on, beside its state and a tangent that is given to it.
    pub fn memory(&self) -> NewtonMemory {
        NewtonMemory { choice: self.solver.choice(), tangents: self.reuse.before, time_error: self.time_error.clone() }
    }

    /// Goes on with the memory of another iteration.
    pub fn recall(&mut self, memory: NewtonMemory, model: &Model, system: &System) {
        let NewtonMemory { choice, tangents, time_error } = memory;
        self.solver.choose(choice, system);
        self.reuse.before = tangents;
        self.time_error = time_error.map(|error| error.of_model(model));
    }

    /// Signs of the eigenvalues of a tangent, see [`LinearSolver::signature`].
    pub fn signature(&mut self, tangent: &mut Tangent, work: &mut Work) -> Option<Signature> {
        let known = self.solver.has_factorised(tangent.system());
        let signature = self.solver.signature(tangent);
        work.factorisations += u64::from(!known && self.solver.has_factorised(tangent.system()));
        signature
    }

    /// Forms the stiffness of a state and determines the signs of its eigenvalues.
    pub fn signature_at(&mut self, assembly: &mut Assembly, state: &State, work: &mut Work) -> Option<Signature> {
        assembly.forget();
        assembly.evaluate(state, Weights::STIFFNESS, None);
        self.signature(&mut Tangent::that_may_go(assembly, state, Weights::STIFFNESS), work)
    }

    /// Declares that the current tangent is not that of the state at which the next solution
    /// starts.
    pub fn begin_anew(&mut self) {
        self.given = None;
    }

    /// Buffer for a field of slots, free between solutions.
    pub fn scratch(&mut self) -> &mut [Vec3] {
        &mut self.dq
    }

    /// Declares that the tangent of the system is, except for loads, that of the state at which the
    /// next solution starts.
    pub fn begin_with(&mut self, system: &System) {
        self.given = Some(system.revision);
    }

    /// True if the last correction went beyond any motion: next to nothing held what moved.
    pub fn has_run_away(&self, model: &Model) -> bool {
        size(model, &self.dq) > DIVERGED_IN_CONTACT
    }

    /// Solves for the equilibrium of `state`. `prescribed_increment` holds increments of held
    /// directions (by slot, global components) that `state` does not yet contain: the first
    /// correction includes them, so that the rest of the structure follows linearly. Afterwards the
    /// forces of the system are those of the state; its tangent need not be.
    pub fn solve(
        &mut self,
        model: &Model,
        assembly: &mut Assembly,
        state: &mut State,
        method: &dyn Method,
        prescribed_increment: Option<&[Vec3]>,
        work: &mut Work,
    ) -> Result<(), NewtonFailure> {
        self.stress_predictor.forget(assembly);
        let round_off = assembly.round_off(state);
        let mut solution = Solution {
            newton: self,
            model,
            charted: model.charted(assembly.stage.kind),
            assembly,
            state,
            method,
            work,
            prescribed_increment: prescribed_increment.map(Cow::Borrowed),
            round_off,
            iterations: 0,
            refinement: Refinement::default(),
            has_formed_anew: false,
        };
        solution.begin();
        let found = solution.find();
        // Whatever it ended with, an interrupted solution is none.
        NewtonFailure::unless_interrupted().and(found)
    }

    /// Passes the last time step to the error estimator.
    pub fn end_step(
        &mut self,
        model: &Model,
        system: &System,
        step_ends: StepEnds,
        step: &Step,
        increments: Option<&Increments>,
    ) {
        if let Some(time_error) = &mut self.time_error {
            time_error.end(model, system, &self.dq, step_ends, step, increments);
        }
    }
}

/// A solution in progress.
struct Solution<'s> {
    newton: &'s mut Newton,
    model: &'s Model,
    /// Rotations and elements that have charts in the stage
    charted: &'s Charted,
    assembly: &'s mut Assembly,
    state: &'s mut State,
    method: &'s dyn Method,
    work: &'s mut Work,
    /// Increments of held directions for the next correction (by slot, global components)
    prescribed_increment: Option<Cow<'s, [Vec3]>>,
    round_off: RoundOff,
    /// Number of corrections so far
    iterations: usize,
    refinement: Refinement,
    /// True if a tangent was formed after corrections with an older one had stalled
    has_formed_anew: bool,
}

/// Decision about an iterate.
#[derive(PartialEq)]
enum Decision {
    /// The iterate is the solution.
    Done,
    /// The iterate is to be corrected.
    Correct,
}

impl Solution<'_> {
    fn begin(&mut self) {
        let newton = &mut *self.newton;
        newton.last = None;
        newton.contraction = 0.0;
        newton.was_shortened = false;
        newton.first.clear();
        newton.reuse.begin(newton.given.take() == Some(self.assembly.system.revision));
    }

    fn find(&mut self) -> Result<(), NewtonFailure> {
        loop {
            NewtonFailure::unless_interrupted()?;
            let forms = self.forms_tangent();
            let Judgement { verdict, residual } = self.evaluate(forms);
            NewtonFailure::unless_interrupted()?;
            if self.decide(verdict, residual, forms)? == Decision::Done {
                return Ok(());
            }
            self.choose_tangent(forms);
            let length = self.find_correction(residual)?;
            self.foresee_stress(verdict == Verdict::Noisy);
            self.correct(length);
        }
    }

    /// True if the tangent is formed together with the forces of the current iterate.
    fn forms_tangent(&self) -> bool {
        let is_last = self.iterations >= self.newton.max_iterations;
        self.prescribed_increment.is_some() || is_last || self.newton.reuse.expects_tangent()
    }

    /// Evaluates the forces of the current iterate, and its tangent if `forms`, and applies the
    /// stop test.
    fn evaluate(&mut self, forms: bool) -> Judgement {
        let weights = if forms { self.method.weights() } else { Weights::NONE };
        let Newton { stress_predictor, convergence, reuse, dq, last, .. } = &mut *self.newton;
        if forms {
            stress_predictor.foresee(self.assembly, self.state, dq);
        }
        let seconds = &mut self.work.evaluation_seconds;
        timed(seconds, || self.assembly.evaluate(self.state, weights, self.prescribed_increment.as_deref()));
        let judgement = convergence.judge(self.model, &self.assembly.system, self.round_off, *last);
        reuse.look(judgement.residual.ratio, judgement.verdict == Verdict::Noisy);
        judgement
    }

    /// Decides about the iterate. `Err` if no further correction is possible.
    fn decide(&mut self, verdict: Verdict, residual: Residual, forms: bool) -> Result<Decision, NewtonFailure> {
        let is_last = self.iterations >= self.newton.max_iterations;
        match verdict {
            Verdict::Converged if self.prescribed_increment.is_none() && !self.state.contacts.holds_on => {
                let carries_error = self.newton.time_error.as_ref().is_some_and(TimeError::has_error);
                if residual.ratio > 0.0 || carries_error {
                    self.polish(forms);
                }
                self.end();
                return Ok(Decision::Done);
            }
            // Each correction from a new residual refines the solution, until round-off prevents
            // further progress.
            Verdict::Noisy if self.prescribed_increment.is_none() && self.iterations > 0 => {
                return Ok(self.refine(is_last));
            }
            Verdict::NotFinite => return Err(NewtonFailure::not_finite(self.assembly, self.state)),
            Verdict::Continue if !is_last => self.refinement = Refinement::default(),
            Verdict::Continue | Verdict::Converged | Verdict::Noisy => {}
        }
        if is_last { Err(self.not_converged(residual)) } else { Ok(Decision::Correct) }
    }

    /// Decides about an iterate whose residual is round-off, by its last correction.
    fn refine(&mut self, is_last: bool) -> Decision {
        let Newton { reuse, dq, last, .. } = &mut *self.newton;
        let refined = self.refinement.look(self.model, dq, last.unwrap_or_default(), size(self.model, &self.state.q));
        if refined.stalls() && !reuse.is_own() && !self.has_formed_anew {
            // Not round-off but an older tangent may be the reason for the stall.
            self.has_formed_anew = true;
            reuse.forget();
        } else if refined.is_done() || is_last {
            self.work.uncertainty = self.work.uncertainty.max(refined.uncertainty());
            self.end();
            return Decision::Done;
        }
        Decision::Correct
    }

    /// Keeps the current tangent, or forms that of the iterate.
    fn choose_tangent(&mut self, forms: bool) {
        if !forms && self.newton.reuse.keeps_tangent() {
            self.newton.reuse.keep();
            return;
        }
        if !forms {
            self.form();
        }
        self.newton.reuse.form(self.prescribed_increment.is_some());
        // Corrections with different tangents are not comparable.
        self.refinement = Refinement::default();
    }

    /// Solves for the next correction and returns its size.
    fn find_correction(&mut self, residual: Residual) -> Result<f64, NewtonFailure> {
        self.show_rates();
        self.work.iterations += 1;
        // The residual of the linear solve is negligible beside the error of an older tangent.
        let looks = self.newton.reuse.is_own();
        let prescribed_increment = self.prescribed_increment.take();
        let is_solved = self.substitute(prescribed_increment.as_deref(), looks);
        NewtonFailure::unless_interrupted()?;
        if !is_solved {
            return Err(NewtonFailure::Singular(self.mechanism()));
        }
        self.iterations += 1;
        self.shorten(prescribed_increment);
        let length = size(self.model, &self.newton.dq);
        if length > DIVERGED_CORRECTION {
            // Round-off may look like stiffness where there is none.
            return Err(match self.mechanism() {
                Some(vector) => NewtonFailure::Singular(Some(vector)),
                None => self.not_converged(residual),
            });
        }
        if length > DIVERGED_IN_CONTACT && self.method.changes_charts() && self.state.contacts.touches() {
            return Err(self.not_converged(residual));
        }
        if contraction(self.newton.last, length) > self.newton.largest_contraction {
            // Where a shorter step ends so, too, lost digits may be the reason.
            return Err(match std::mem::replace(&mut self.newton.has_ended_early, true) {
                true => self.not_converged(residual),
                false => NewtonFailure::NotConverged { residual, history: self.newton.reuse.history.clone() },
            });
        }
        Ok(length)
    }

    /// Shortens a correction on which centre lines of beams would cross. The rest of the increments
    /// of held directions is left to the next one.
    fn shorten(&mut self, prescribed_increment: Option<Cow<'_, [Vec3]>>) {
        let Newton { dq, was_shortened, is_short, .. } = &mut *self.newton;
        let part = self.model.contacts().map_or(1.0, |contacts| contacts.safe_part(self.state, dq));
        *is_short = part < 1.0;
        if !*is_short {
            return;
        }
        *was_shortened = true;
        dq.iter_mut().for_each(|dq| *dq = *dq * part);
        let rest = |given: Cow<'_, [Vec3]>| given.iter().map(|&given| given * (1.0 - part)).collect();
        self.prescribed_increment = prescribed_increment.map(rest).map(Cow::Owned);
    }

    /// Prepares the prediction of stress for the next tangent. If equilibrium is expected, the
    /// stress of the state itself is used.
    fn foresee_stress(&mut self, noisy: bool) {
        let Newton { stress_predictor, reuse, .. } = &mut *self.newton;
        if !noisy && reuse.expects_balance() {
            stress_predictor.forget(self.assembly);
        } else {
            stress_predictor.remember();
        }
    }

    /// Adds a correction of size `length` to the state.
    fn correct(&mut self, length: f64) {
        let newton = &mut *self.newton;
        newton.contraction = newton.contraction.max(contraction(newton.last, length));
        let changes_charts = self.method.changes_charts();
        if changes_charts && self.iterations == 1 {
            newton.first.take(newton.dq.len(), |slot| newton.dq[slot].0);
        }
        self.add();
        // In a new chart the last correction has no meaning: it must not end the iteration, and no
        // more may one that was shortened.
        let switched = changes_charts && self.change_charts();
        let is_none = switched || self.newton.is_short;
        self.newton.last = Some(if is_none { f64::INFINITY } else { length });
    }

    /// Called when a solution is found.
    fn end(&mut self) {
        let Newton { time_error, solver, dq, reuse, has_ended_early, .. } = &mut *self.newton;
        *has_ended_early = false;
        if let Some(time_error) = time_error {
            let mut correct = |system: &System, dq: &mut [Vec3]| {
                solver.has_factorised(system) && solver.correct(system, false, None, dq)
            };
            time_error.solve(&mut correct, &mut self.assembly.system, self.state, dq);
        }
        reuse.end();
        solver.succeeded();
    }

    /// Passes the state of a new tangent to the error estimator of time steps. In a linear stage
    /// the only tangent serves all steps.
    fn show_rates(&mut self) {
        let Newton { time_error, solver, .. } = &mut *self.newton;
        let is_new = !solver.has_factorised(&self.assembly.system);
        if let Some(time_error) = time_error.as_mut().filter(|error| is_new || error.knows_no_forces()) {
            let seconds = &mut self.work.evaluation_seconds;
            timed(seconds, || time_error.look(self.assembly, self.state, self.method.weights()));
        }
    }

    /// Evaluates forces and tangent of the current iterate.
    fn form(&mut self) {
        let Newton { stress_predictor, dq, .. } = &mut *self.newton;
        stress_predictor.foresee(self.assembly, self.state, dq);
        let seconds = &mut self.work.evaluation_seconds;
        timed(seconds, || self.assembly.evaluate(self.state, self.method.weights(), None));
    }

    /// Adds one more correction to a converged iterate with a tangent of this solution. For the
    /// price of a substitution this removes most of the residual, which could grow from time step
    /// to time step. Forces remain those of the iterate before, within the tolerance of the stop
    /// test. `formed` if the tangent is that of the iterate.
    fn polish(&mut self, formed: bool) {
        let last = self.newton.last;
        // A correction larger than the last is no improvement; without a last one, a large
        // correction for a small residual belongs to a loose part.
        let most = last.unwrap_or_else(|| self.newton.convergence.tolerance.sqrt());
        if last.is_none() && self.method.changes_charts() {
            return;
        }
        if !formed && !self.newton.reuse.has_tangent() {
            self.form();
        }
        self.show_rates();
        if self.substitute(None, formed) && size(self.model, &self.newton.dq) <= most {
            self.add();
        }
    }

    /// Adds the correction to the state.
    fn add(&mut self) {
        let dq = &self.newton.dq;
        if self.method.changes_charts() {
            charts::carry(self.state, dq, &self.charted.rotations);
        }
        self.method.correct(self.state, dq);
        self.state.contacts.holds_on = false;
    }

    /// Failure of the iteration; if round-off has taken most of the softest stiffness, the linear
    /// solver changes its method for the next attempt.
    fn not_converged(&mut self, residual: Residual) -> NewtonFailure {
        let mut tangent = Tangent::that_may_go(self.assembly, self.state, self.method.weights());
        self.newton.solver.doubt(&mut tangent);
        NewtonFailure::NotConverged { residual, history: self.newton.reuse.history.clone() }
    }

    /// A motion without stiffness or strain, if there is one.
    fn mechanism(&mut self) -> Option<NullVector> {
        let mut tangent = Tangent::that_may_go(self.assembly, self.state, self.method.weights());
        mechanism(&mut self.newton.solver, &mut tangent, self.model)
    }

    /// Solves J dq = -g. Held directions take the components of `prescribed_increment`, or zero.
    /// With `looks` the residual of the linear solve is checked. `false` if there is no solution.
    fn substitute(&mut self, prescribed_increment: Option<&[Vec3]>, looks: bool) -> bool {
        let Newton { solver, dq, .. } = &mut *self.newton;
        let mut tangent = Tangent::that_may_go(self.assembly, self.state, self.method.weights());
        let Work { solve_seconds, factorisations, .. } = &mut *self.work;
        timed(solve_seconds, || {
            let Factorisation { is_done, is_new } = solver.factorise_new(&mut tangent);
            *factorisations += u64::from(is_new);
            is_done && solver.correct(tangent.system(), looks || is_new, prescribed_increment, dq)
        })
    }

    /// Changes charts in statics as soon as an iterate exceeds a rotation angle of pi, so that the
    /// tangent stays regular at any rotation. `true` if a chart has changed.
    fn change_charts(&mut self) -> bool {
        let rotations = &self.charted.rotations;
        if charts::first_beyond(self.state, rotations, charts::STATIC_BAND).is_none() {
            return false;
        }
        let Newton { stress_predictor, reuse, dq, .. } = &mut *self.newton;
        stress_predictor.foresee(self.assembly, self.state, dq);
        self.work.chart_switches += charts::switch(self.state, rotations, charts::STATIC_BAND, None) as u64;
        charts::freeze(self.state, &self.charted.elements);
        reuse.forget();
        true
    }
}
