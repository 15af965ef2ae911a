//! Newton's iteration for a time step with two stages, see [`Lobatto`].

use super::convergence::{Judgement, Residual, Verdict, size};
use super::linear::Factorisation;
use super::newton::Newton;
use super::newton_failure::NewtonFailure;
use super::soft_mode::mechanism;
use super::tangent::Tangent;
use super::work::{Work, timed};
use crate::effect::RoundOff;
use crate::integrate::{Lobatto, Stage};
use crate::kernel::Weights;
use crate::model::{Assembly, Model};
use crate::system::{State, System};
use crate::tensor::Vec3;

/// The residual of the middle stage before its last correction, over its tolerance, that this
/// correction and one of the end bring below it.
const MIDDLE_ALLOWANCE: f64 = 4.0;

/// The least number of rounds: the first two settle what the prediction has missed.
const MIN_ROUNDS: usize = 2;

/// A round that leaves a larger share of the residual of the end has an outdated tangent.
const SLOW_ROUND: f64 = 0.5;

/// The rounds in which the residual may fall slowly before that counts.
const ROUNDS_UNJUDGED: usize = 4;

/// Corrections of the end above this size (relative to the length of the scene, or in radians) show
/// divergence.
const DIVERGED_CORRECTION: f64 = 1e6;

impl Newton {
    /// Solves for the balance of both stages of a step. Afterwards the forces of the system are
    /// those of the end; those of the middle are shown to `pass` where it is in balance, the last
    /// time for the middle that is found.
    #[expect(clippy::too_many_arguments, reason = "both stages of a step, and who sees them")]
    pub fn solve_stages(
        &mut self,
        model: &Model,
        assembly: &mut Assembly,
        middle: &mut State,
        end: &mut State,
        step: &Lobatto,
        work: &mut Work,
        pass: &mut dyn FnMut(&State, &Assembly),
    ) -> Result<(), NewtonFailure> {
        self.begin_anew();
        assembly.forget();
        let round_off = assembly.round_off(end);
        let solution =
            Stages { newton: self, model, assembly, middle, end, step, work, pass, round_off, history: Vec::new() };
        let found = solution.find();
        // Whatever it ended with, an interrupted solution is none.
        NewtonFailure::unless_interrupted().and(found)
    }
}

/// A solution in progress.
struct Stages<'s> {
    newton: &'s mut Newton,
    model: &'s Model,
    assembly: &'s mut Assembly,
    middle: &'s mut State,
    end: &'s mut State,
    step: &'s Lobatto,
    work: &'s mut Work,
    /// Sees the middle in balance
    pass: &'s mut dyn FnMut(&State, &Assembly),
    round_off: RoundOff,
    /// Largest residual of the end in each round, relative to its tolerance
    history: Vec<f64>,
}

impl Stages<'_> {
    fn find(mut self) -> Result<(), NewtonFailure> {
        let mut is_middle_balanced = false;
        let [mut last, mut last_of_middle] = [None; 2];
        for round in 0..self.newton.max_iterations.max(MIN_ROUNDS + 1) {
            let forms = round == 0 || self.is_slow();
            let Judgement { verdict, residual } = self.evaluate(Stage::End, forms, last)?;
            self.history.push(residual.ratio);
            let is_balanced = verdict != Verdict::Continue && is_middle_balanced && round >= MIN_ROUNDS;
            last = Some(self.correct(Stage::End, round, forms, residual)?);
            if is_balanced {
                self.newton.solver.succeeded();
                self.carry_error();
                return Ok(());
            }
            let Judgement { verdict, residual } = self.evaluate(Stage::Middle, false, last_of_middle)?;
            is_middle_balanced = verdict != Verdict::Continue || residual.ratio <= MIDDLE_ALLOWANCE;
            if is_middle_balanced {
                (self.pass)(self.middle, self.assembly);
            }
            last_of_middle = Some(self.correct(Stage::Middle, round, false, residual)?);
        }
        let Judgement { residual, .. } = self.evaluate(Stage::End, false, last)?;
        Err(self.not_converged(residual))
    }

    /// Solves for a carried error of the steps at the end, with a tangent of its own.
    fn carry_error(&mut self) {
        let Self { newton, assembly, end, work, .. } = self;
        let Newton { time_error, solver, dq, .. } = &mut **newton;
        let Some((error, weights)) = time_error.as_mut().and_then(|error| error.weights().map(|w| (error, w))) else {
            return;
        };
        let Work { evaluation_seconds, solve_seconds, factorisations, .. } = &mut **work;
        timed(evaluation_seconds, || {
            assembly.evaluate(end, weights, None);
            error.look(assembly, end, weights);
        });
        timed(solve_seconds, || {
            let Factorisation { is_done, is_new } =
                solver.factorise_new(&mut Tangent::that_may_go(assembly, end, weights));
            *factorisations += u64::from(is_new);
            let mut correct = |system: &System, dq: &mut [Vec3]| is_done && solver.correct(system, false, None, dq);
            error.solve(&mut correct, &mut assembly.system, end, dq);
        });
    }

    /// True if the last round has left much of the residual.
    fn is_slow(&self) -> bool {
        let [.., before, last] = self.history[..] else { return false };
        self.history.len() >= ROUNDS_UNJUDGED && last > SLOW_ROUND * before && last > 1.0
    }

    /// Evaluates the forces of a stage, and the tangent if `forms`; `last` is the size of the last
    /// correction of the stage.
    fn evaluate(&mut self, stage: Stage, forms: bool, last: Option<f64>) -> Result<Judgement, NewtonFailure> {
        NewtonFailure::unless_interrupted()?;
        let weights = if forms { self.step.weights() } else { Weights::NONE };
        let state = match stage {
            Stage::Middle => &*self.middle,
            Stage::End => &*self.end,
        };
        timed(&mut self.work.evaluation_seconds, || self.assembly.evaluate(state, weights, None));
        let judgement = self.newton.convergence.judge(self.model, &self.assembly.system, self.round_off, last);
        match judgement.verdict {
            Verdict::NotFinite => Err(NewtonFailure::not_finite(self.assembly, state)),
            Verdict::Converged | Verdict::Noisy | Verdict::Continue => Ok(judgement),
        }
    }

    /// Corrects a stage by its residual, and returns the size of the correction.
    fn correct(&mut self, stage: Stage, round: usize, forms: bool, residual: Residual) -> Result<f64, NewtonFailure> {
        self.work.iterations += 1;
        let is_solved = self.substitute(forms);
        NewtonFailure::unless_interrupted()?;
        if !is_solved {
            let mut tangent = Tangent::that_may_go(self.assembly, self.end, self.step.weights());
            return Err(NewtonFailure::Singular(mechanism(&mut self.newton.solver, &mut tangent, self.model)));
        }
        let length = size(self.model, &self.newton.dq);
        if length > DIVERGED_CORRECTION {
            return Err(self.not_converged(residual));
        }
        let factor = self.step.relaxation(stage, round);
        self.step.correct(self.middle, self.end, stage, &self.newton.dq, factor);
        Ok(length)
    }

    /// Solves P dq = -g; with `looks` the residual of the linear solve is checked. `false` if there
    /// is no solution.
    fn substitute(&mut self, looks: bool) -> bool {
        let Self { newton, assembly, end, step, work, .. } = self;
        let Newton { solver, dq, .. } = &mut **newton;
        let mut tangent = Tangent::that_may_go(assembly, end, step.weights());
        let Work { solve_seconds, factorisations, .. } = &mut **work;
        timed(solve_seconds, || {
            let Factorisation { is_done, is_new } = solver.factorise_new(&mut tangent);
            *factorisations += u64::from(is_new);
            is_done && solver.correct(tangent.system(), looks || is_new, None, dq)
        })
    }

    /// Failure of the iteration; if round-off has taken most of the softest stiffness, the linear
    /// solver changes its method for the next attempt.
    fn not_converged(&mut self, residual: Residual) -> NewtonFailure {
        let mut tangent = Tangent::that_may_go(self.assembly, self.end, self.step.weights());
        self.newton.solver.doubt(&mut tangent);
        NewtonFailure::NotConverged { residual, history: std::mem::take(&mut self.history) }
    }
}
