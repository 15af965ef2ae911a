//! Newton's iteration on one step or load level.

use super::convergence::{Convergence, Residual, Verdict, size};
use super::linear::LinearSolver;
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

/// The iteration with its linear solver and its scratch.
pub struct Newton {
    /// When to stop
    pub convergence: Convergence,
    /// Linear solves allowed
    pub max_iterations: usize,
    /// Solves with the tangent
    pub solver: LinearSolver,
    dq: Vec<Vec3>,
    /// The size of the last correction of a solution: `None` before the first, infinite after a
    /// change of chart
    last: Option<f64>,
    /// The first correction of the last solution in statics, along the tangent of the path; empty
    /// where nothing was to correct
    pub first: CompressedField<3>,
    /// The largest ratio of a correction of the last solution to the one before it, of those that
    /// are no round-off: an iteration that follows the path contracts
    pub contraction: f64,
    reuse: Reuse,
    stress_predictor: StressPredictor,
    /// The estimate of the error of time steps, where it is made
    pub time_error: Option<TimeError>,
    /// The tangent that is known to be that of the state a solution begins with, see
    /// [`Newton::begin_with`]
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
            stress_predictor: StressPredictor::default(),
            time_error: None,
            given: None,
        }
    }

    /// The signs of the eigenvalues of a tangent, see [`LinearSolver::signature`].
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

    /// The tangent that is there is that of another state than the one the next solution begins
    /// with.
    pub fn begin_anew(&mut self) {
        self.given = None;
    }

    /// Memory for a field of slots that nobody needs between solutions.
    pub fn scratch(&mut self) -> &mut [Vec3] {
        &mut self.dq
    }

    /// The tangent of the system is that of the state that the next solution begins with, but for
    /// the loads.
    pub fn begin_with(&mut self, system: &System) {
        self.given = Some(system.revision);
    }

    /// Brings the state into balance. `prescribed_increment` holds increments of held directions
    /// that are not in the state yet: they go in with the first correction, so that the rest of the
    /// structure follows them linearly. The forces of the system are then those of the state; its
    /// tangent need not be.
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
            prescribed_increment,
            round_off,
            iterations: 0,
            refinement: Refinement::default(),
            has_formed_anew: false,
        };
        solution.begin();
        solution.find()
    }

    /// The step that was solved last is taken from one state to another.
    pub fn end_step(&mut self, system: &System, step_ends: StepEnds, step: &Step, increments: Option<&Increments>) {
        if let Some(time_error) = &mut self.time_error {
            time_error.end(system, &self.dq, step_ends, step, increments);
        }
    }
}

/// A solution under way.
struct Solution<'s> {
    newton: &'s mut Newton,
    model: &'s Model,
    /// The rotations and elements that have charts in the stage
    charted: &'s Charted,
    assembly: &'s mut Assembly,
    state: &'s mut State,
    method: &'s dyn Method,
    work: &'s mut Work,
    /// Increments of held directions that go in with the first correction
    prescribed_increment: Option<&'s [Vec3]>,
    round_off: RoundOff,
    /// Corrections so far
    iterations: usize,
    refinement: Refinement,
    /// A tangent was formed since corrections with an older one have stalled.
    has_formed_anew: bool,
}

/// The fate of an iterate.
#[derive(PartialEq)]
enum Next {
    /// It is the solution.
    Done,
    /// It is corrected.
    Correct,
}

impl Solution<'_> {
    fn begin(&mut self) {
        let newton = &mut *self.newton;
        (newton.last, newton.contraction) = (None, 0.0);
        newton.first.clear();
        newton.reuse.begin(newton.given.take() == Some(self.assembly.system.revision));
    }

    fn find(&mut self) -> Result<(), NewtonFailure> {
        loop {
            let forms = self.forms_tangent();
            let (verdict, residual) = self.evaluate(forms);
            if self.decide(verdict, residual, forms)? == Next::Done {
                return Ok(());
            }
            self.choose_tangent(forms);
            let length = self.find_correction(residual)?;
            self.foresee_stress(verdict == Verdict::Noisy);
            self.correct(length);
        }
    }

    /// True if the tangent is formed with the forces of the present iterate.
    fn forms_tangent(&self) -> bool {
        let is_last = self.iterations >= self.newton.max_iterations;
        self.prescribed_increment.is_some() || is_last || self.newton.reuse.expects_tangent()
    }

    /// The forces of the present iterate, and its tangent where it is formed; judged.
    fn evaluate(&mut self, forms: bool) -> (Verdict, Residual) {
        let weights = if forms { self.method.weights() } else { Weights::NONE };
        let Newton { stress_predictor, convergence, reuse, dq, last, .. } = &mut *self.newton;
        if forms {
            stress_predictor.foresee(self.assembly, self.state, dq);
        }
        let seconds = &mut self.work.evaluation_seconds;
        timed(seconds, || self.assembly.evaluate(self.state, weights, self.prescribed_increment));
        let (verdict, residual) = convergence.judge(self.model, &self.assembly.system, self.round_off, *last);
        reuse.look(residual.ratio, verdict == Verdict::Noisy);
        (verdict, residual)
    }

    /// The fate of the iterate: it is the solution, is corrected, or leads nowhere.
    fn decide(&mut self, verdict: Verdict, residual: Residual, forms: bool) -> Result<Next, NewtonFailure> {
        let is_last = self.iterations >= self.newton.max_iterations;
        match verdict {
            Verdict::Converged if self.prescribed_increment.is_none() => {
                if residual.ratio > 0.0 {
                    self.polish(forms);
                }
                self.end();
                return Ok(Next::Done);
            }
            // Each correction with a new residual refines the solution, until round-off makes it no
            // smaller.
            Verdict::Noisy if self.prescribed_increment.is_none() && self.iterations > 0 => {
                return Ok(self.refine(is_last));
            }
            Verdict::NotFinite => return Err(NewtonFailure::not_finite(self.assembly, self.state)),
            Verdict::Continue if !is_last => self.refinement = Refinement::default(),
            Verdict::Continue | Verdict::Converged | Verdict::Noisy => {}
        }
        if is_last { Err(self.not_converged(residual)) } else { Ok(Next::Correct) }
    }

    /// Looks at the last correction of an iterate whose residual is round-off.
    fn refine(&mut self, is_last: bool) -> Next {
        let Newton { reuse, dq, last, .. } = &mut *self.newton;
        let refined = self.refinement.look(self.model, dq, last.unwrap_or_default(), size(self.model, &self.state.q));
        if refined.stalls() && !reuse.is_own() && !self.has_formed_anew {
            // Not round-off may make it stall, but an older tangent.
            self.has_formed_anew = true;
            reuse.forget();
        } else if refined.is_done() || is_last {
            self.work.uncertainty = self.work.uncertainty.max(refined.uncertainty());
            self.end();
            return Next::Done;
        }
        Next::Correct
    }

    /// Goes on with the tangent that is there, or with that of the iterate.
    fn choose_tangent(&mut self, forms: bool) {
        if !forms && self.newton.reuse.keeps_tangent() {
            self.newton.reuse.keep();
            return;
        }
        if !forms {
            self.form();
        }
        self.newton.reuse.form(self.prescribed_increment.is_some());
        // What one tangent leaves tells nothing of the corrections with another one.
        self.refinement = Refinement::default();
    }

    /// The next correction; its size.
    fn find_correction(&mut self, residual: Residual) -> Result<f64, NewtonFailure> {
        self.show_rates();
        self.work.iterations += 1;
        // What an older tangent leaves is more than what the solver does.
        let looks = self.newton.reuse.is_own();
        let prescribed_increment = self.prescribed_increment.take();
        if !self.substitute(prescribed_increment, looks) {
            return Err(NewtonFailure::Singular(self.mechanism()));
        }
        self.iterations += 1;
        let length = size(self.model, &self.newton.dq);
        if length > RUNAWAY {
            // Round-off may have left a stiffness where there is none.
            return Err(match self.mechanism() {
                Some(vector) => NewtonFailure::Singular(Some(vector)),
                None => self.not_converged(residual),
            });
        }
        Ok(length)
    }

    /// Foresees the stress that the next tangent is formed with. Where balance is expected that is
    /// the stress of the state itself.
    fn foresee_stress(&mut self, noisy: bool) {
        let Newton { stress_predictor, reuse, .. } = &mut *self.newton;
        if !noisy && reuse.expects_balance() {
            stress_predictor.forget(self.assembly);
        } else {
            stress_predictor.remember();
        }
    }

    /// Takes a correction of this size into the state.
    fn correct(&mut self, length: f64) {
        let newton = &mut *self.newton;
        if let Some(last) = newton.last.filter(|&last| last > NO_CORRECTION) {
            newton.contraction = newton.contraction.max(length / last);
        }
        let changes_charts = self.method.changes_charts();
        if changes_charts && self.iterations == 1 {
            newton.first.take(newton.dq.len(), |slot| newton.dq[slot].0);
        }
        self.add();
        // What was a correction before is none in a new chart: it may not end the iteration.
        let switched = changes_charts && self.change_charts();
        self.newton.last = Some(if switched { f64::INFINITY } else { length });
    }

    /// A solution is found.
    fn end(&mut self) {
        let Newton { time_error, solver, dq, reuse, .. } = &mut *self.newton;
        if let Some(time_error) = time_error {
            let mut correct = |system: &System, dq: &mut [Vec3]| {
                solver.has_factorised(system) && solver.correct(system, false, None, dq)
            };
            time_error.solve(&mut correct, &mut self.assembly.system, self.state, dq);
        }
        reuse.end();
        solver.succeeded();
    }

    /// Shows the state of a new tangent to the estimate of the error of time steps. The tangent of
    /// a linear stage, which is formed once, fits the states of all steps.
    fn show_rates(&mut self) {
        let Newton { time_error, solver, .. } = &mut *self.newton;
        let is_new = !solver.has_factorised(&self.assembly.system);
        if let Some(time_error) = time_error.as_mut().filter(|error| is_new || error.knows_no_forces()) {
            let seconds = &mut self.work.evaluation_seconds;
            timed(seconds, || time_error.look(self.assembly, self.state, self.method.weights()));
        }
    }

    /// Forces and the tangent.
    fn form(&mut self) {
        let Newton { stress_predictor, dq, .. } = &mut *self.newton;
        stress_predictor.foresee(self.assembly, self.state, dq);
        let seconds = &mut self.work.evaluation_seconds;
        timed(seconds, || self.assembly.evaluate(self.state, self.method.weights(), None));
    }

    /// Another correction with a tangent of this solution takes most of a residual away for the
    /// price of a substitution: what is left of it may grow from time step to time step. Forces
    /// stay those of the iterate before, from which they differ by less than the stop test allows.
    /// A time step that is in balance at once has no tangent but its own; `formed` where it is
    /// there.
    fn polish(&mut self, formed: bool) {
        let last = self.newton.last;
        // A correction that grows is none; without one before, one that is large for its residual
        // is of something loose.
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
    }

    /// The next attempt is better off with pivots where round-off has taken most of the softest
    /// stiffness.
    fn not_converged(&mut self, residual: Residual) -> NewtonFailure {
        let mut tangent = Tangent::that_may_go(self.assembly, self.state, self.method.weights());
        self.newton.solver.doubt(&mut tangent);
        NewtonFailure::NotConverged { residual, history: self.newton.reuse.history.clone() }
    }

    /// A motion that nothing holds.
    fn mechanism(&mut self) -> Option<NullVector> {
        let mut tangent = Tangent::that_may_go(self.assembly, self.state, self.method.weights());
        mechanism(&mut self.newton.solver, &mut tangent, self.model)
    }

    /// Solves J dq = -g; held directions take their part of `prescribed_increment`. `looks`: at
    /// what the solver leaves. `false` where there is no solution.
    fn substitute(&mut self, prescribed_increment: Option<&[Vec3]>, looks: bool) -> bool {
        let Newton { solver, dq, .. } = &mut *self.newton;
        let mut tangent = Tangent::that_may_go(self.assembly, self.state, self.method.weights());
        let Work { solve_seconds, factorisations, .. } = &mut *self.work;
        timed(solve_seconds, || {
            let (done, new) = solver.factorise_new(&mut tangent);
            *factorisations += u64::from(new);
            done && solver.correct(tangent.system(), looks || new, prescribed_increment, dq)
        })
    }

    /// In statics a node changes its chart as soon as an iterate passes pi, so that the tangent
    /// stays regular at any turn; whether one did.
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
