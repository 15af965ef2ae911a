//! What the corrections of the last steps tell about the next one.
//!
//! A scheme predicts the end of a step with the acceleration of its start. What Newton's method then adds, c = q1 - q1(predicted), grows with
//! the third power of the step and goes on as the motion does: it is foreseen as nothing, as the last one, or along the line or
//! the parabola through the last ones. In stiff directions accelerations swing from step to step (the trapezoidal rule turns them round),
//! and c with them: it is foreseen as the last one turned round, or along what swings about a constant or about a line. That way is
//! taken whose residual J (c - c(foreseen)) would have been the smallest in the last steps: where motion is not smooth that is the
//! scheme's own.

use super::{Method, Step};
use crate::model::{Model, SlotKind};
use crate::real::Rough;
use crate::system::{Equations, State};
use crate::tensor::Vec3;
use crate::threads;
use std::array::from_fn;
use std::collections::VecDeque;
use std::sync::Arc;

/// The factors of the last corrections for each way to foresee the next one, the latest first. With E the shift by a step, they make
/// nothing of 1, E - 1, (E - 1)^2, (E - 1)^3 times a correction; where it swings of E + 1, (E + 1) (E - 1), (E + 1) (E - 1)^2.
const WAYS: [&[f64]; 7] = [&[], &[1.0], &[2.0, -1.0], &[3.0, -3.0, 1.0], &[-1.0], &[0.0, 1.0], &[1.0, 1.0, -1.0]];

/// The weight of the last step in what is thought of a way.
const NEWS: f64 = 0.5;

/// A step that is longer or shorter than another one by more than this has nothing to say of it.
const ALIKE: f64 = 4.0;

/// The power of the length of a step with which corrections grow
const CORRECTION: i32 = 3;

/// And forces J c, since J has the mass over the square of the length
const FORCE: i32 = 1;

/// So many steps are remembered.
const MOST: usize = WAYS[3].len();

/// Factors of the last corrections, the latest first
type Factors = [f64; MOST];

/// The corrections of the last steps of a stage.
#[derive(Default)]
pub struct Trend {
    /// What forces are compared by: of each slot its kind, and of each kind a factor
    kinds: Arc<Vec<SlotKind>>,
    weights: [f64; SlotKind::ALL.len()],
    /// The latest first
    past: VecDeque<Past>,
    /// By way, how much residual it would have left (squares, in the mean of the last steps); `None` where that is not known
    missed: [Option<f64>; WAYS.len()],
    /// Where the scheme's own prediction went in the present step, by equation
    predicted: Vec<f64>,
    /// The way that was taken there
    taken: usize,
}

/// A step that has come to its end, by equation: what is held is not corrected. A guess needs few digits.
#[derive(Default)]
struct Past {
    length: f64,
    /// c
    correction: Rough<1>,
    /// J c, moments over the length of the scene; gaps do not count
    force: Rough<1>,
}

impl Trend {
    /// For a stage of a scene.
    pub fn new(model: &Model) -> Self {
        let weight = |kind: SlotKind| if kind.is_multiplier() { 0.0 } else { 1.0 / kind.arm(model.length) };
        Self { kinds: model.kinds.clone(), weights: SlotKind::ALL.map(weight), ..Self::default() }
    }

    /// Another attempt at a step begins: nothing has been foreseen of it yet.
    pub fn reset(&mut self) {
        self.taken = 0;
    }

    /// Whether something was foreseen of the present step.
    pub fn has_foreseen(&self) -> bool {
        self.taken > 0
    }

    /// Adds what is foreseen to the prediction of a step.
    pub fn begin(&mut self, equations: &Equations, state: &mut State, step: &Step, scratch: &mut [Vec3]) {
        self.predicted.resize(equations.count(), 0.0);
        equations.gather(|slot| state.q[slot], &mut self.predicted);
        let best = self.best();
        if let Some(factors) = self.factors(best, step.length, CORRECTION).filter(|_| best > 0) {
            self.taken = best;
            equations.scatter_found(|equation| self.foreseen(&factors, equation), scratch);
            step.correct(state, scratch);
        }
    }

    /// The sum of the last corrections with their factors.
    #[inline(always)]
    fn foreseen(&self, factors: &Factors, equation: usize) -> f64 {
        let parts = self.past.iter().zip(factors);
        parts.fold(0.0, |sum, (past, factor)| sum + past.correction.get(equation)[0] * factor)
    }

    /// Takes note of a step that has come to its end, with the unknowns that it was predicted in; `multiply` turns a vector into its
    /// product with the tangent.
    pub fn end(&mut self, equations: &Equations, state: &State, step: &Step, multiply: impl FnOnce(&mut [f64])) {
        let mut change = std::mem::take(&mut self.predicted);
        equations.gather_change(|slot| state.q[slot], &mut change);
        // Into the memory of the oldest, which nobody asks for any more.
        let oldest = self.past.get_mut(MOST - 1).map(|oldest| std::mem::take(&mut oldest.correction));
        let mut correction = oldest.unwrap_or_default();
        correction.take(change.len(), |equation| [change[equation]]);
        multiply(&mut change);
        equations.scale(|slot| self.weights[self.kinds[slot] as usize], &mut change);
        self.learn(step.length, correction, &change);
        self.predicted = change;
    }

    /// Learns from a step of this length, with its correction and its force.
    fn learn(&mut self, length: f64, correction: Rough<1>, force: &[f64]) {
        let factors = from_fn(|way| self.factors(way, length, FORCE));
        let missed = self.rests(force, &factors);
        for (mean, (rest, known)) in self.missed.iter_mut().zip(missed.into_iter().zip(factors)) {
            *mean = known.map(|_| mean.map_or(rest, |mean| mean + NEWS * (rest - mean)));
        }
        let oldest = if self.past.len() == MOST { self.past.pop_back() } else { None };
        let mut rough = oldest.unwrap_or_default().force;
        rough.take(force.len(), |equation| [force[equation]]);
        self.past.push_front(Past { length, correction, force: rough });
    }

    /// The last step is not taken after all.
    pub fn withdraw(&mut self) {
        self.past.pop_front();
    }

    /// Forgets all steps: unknowns have changed their meaning, or the motion does not go on.
    pub fn forget(&mut self) {
        self.past.clear();
    }

    /// The first of the ways that miss least.
    fn best(&self) -> usize {
        let known = self.missed.iter().enumerate().filter_map(|(way, missed)| Some((way, (*missed)?)));
        known.reduce(|best, next| if next.1 < best.1 { next } else { best }).map_or(0, |(way, _)| way)
    }

    /// The factors of the last steps by which a way foresees what grows with this power of the length of a step; `None` where too
    /// little is known.
    fn factors(&self, way: usize, length: f64, power: i32) -> Option<Factors> {
        let mut factors = [0.0; MOST];
        for (number, factor) in WAYS[way].iter().enumerate() {
            let stretch = length / self.past.get(number)?.length;
            if !(1.0 / ALIKE..=ALIKE).contains(&stretch) {
                return None;
            }
            factors[number] = factor * stretch.powi(power);
        }
        Some(factors)
    }

    /// By way, the sum of squares of what it leaves of a force.
    fn rests(&self, force: &[f64], factors: &[Option<Factors>; WAYS.len()]) -> [f64; WAYS.len()] {
        let factors = factors.map(|factors| factors.unwrap_or_default());
        threads::sums(force.len(), |equations| {
            let mut sums = [0.0; WAYS.len()];
            for equation in equations {
                let past: Factors =
                    from_fn(|number| self.past.get(number).map_or(0.0, |past| past.force.get(equation)[0]));
                for (sum, factors) in sums.iter_mut().zip(&factors) {
                    let foreseen = past[0] * factors[0] + past[1] * factors[1] + past[2] * factors[2];
                    *sum += (force[equation] - foreseen).powi(2);
                }
            }
            sums
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rough(numbers: &[f64]) -> Rough<1> {
        let mut rough = Rough::default();
        rough.take(numbers.len(), |k| [numbers[k]]);
        rough
    }

    fn with(corrections: &[f64]) -> Trend {
        let mut trend = Trend::default();
        for (length, correction) in corrections.iter().map(|c| (1.0, *c)) {
            trend.learn(length, rough(&[correction]), &[correction]);
        }
        trend
    }

    fn foreseen(trend: &Trend, way: usize, length: f64) -> f64 {
        let factors = trend.factors(way, length, CORRECTION).unwrap();
        trend.past.iter().zip(factors).map(|(past, factor)| past.correction.get(0)[0] * factor).sum()
    }

    #[test]
    fn lines_and_parabolas_go_on() {
        let line = with(&[1.0, 3.0, 5.0, 7.0, 9.0]);
        assert_eq!((line.best(), foreseen(&line, 2, 1.0)), (2, 11.0));
        let parabola = with(&[1.0, 4.0, 9.0, 16.0, 25.0, 36.0]);
        assert_eq!((parabola.best(), foreseen(&parabola, 3, 1.0)), (3, 49.0));
        // With half the step an eighth.
        assert_eq!(foreseen(&line, 2, 0.5), 11.0 / 8.0);
        assert!(line.factors(2, 0.1, CORRECTION).is_none());
    }

    #[test]
    fn steps_that_grow_are_foreseen() {
        let mut trend = Trend::default();
        for length in [1.0_f64, 1.8, 3.2, 5.8] {
            trend.learn(length, rough(&[length.powi(3)]), &[length]);
        }
        assert_eq!(trend.best(), 1);
        // Of six digits the last may be off.
        assert!((foreseen(&trend, 1, 10.0) - 1000.0).abs() < 1e-3);
        // A step that is not taken has nothing to say.
        trend.learn(5.8, rough(&[7.0]), &[1.0]);
        trend.withdraw();
        assert!((foreseen(&trend, 1, 10.0) - 1000.0).abs() < 1e-3);
    }

    #[test]
    fn what_swings_from_step_to_step_is_foreseen() {
        let next = |corrections: &[f64]| {
            let trend = with(corrections);
            foreseen(&trend, trend.best(), 1.0)
        };
        assert_eq!(next(&[1.0, -1.0]), 1.0);
        // About a constant, and about a line
        assert_eq!(next(&[4.0, -2.0, 4.0, -2.0, 4.0, -2.0, 4.0]), -2.0);
        assert_eq!(next(&[1.0, -1.0, 3.0, 1.0, 5.0, 3.0, 7.0, 5.0, 9.0, 7.0]), 11.0);
    }

    #[test]
    fn what_comes_without_rule_is_not_foreseen() {
        assert_eq!(with(&[1.0, -0.1, 0.2, 2.0, 0.1, -0.3, 1.0, 0.1, -0.1, -1.0]).best(), 0);
        assert_eq!(with(&[0.0; 5]).best(), 0);
    }

    #[test]
    fn what_is_learnt_does_not_depend_on_threads() {
        let learnt = || {
            let mut trend = Trend::default();
            for step in 1..=6 {
                let force: Vec<f64> =
                    (0..5 * threads::PART).map(|k| (k as f64 * f64::from(step * step)).sin()).collect();
                trend.learn(1.0, rough(&force), &force);
            }
            trend.missed.map(|missed| missed.map(f64::to_bits))
        };
        let alone = learnt();
        assert!(alone.iter().all(Option::is_some));
        assert_eq!(threads::on(3, learnt), alone);
    }

    #[test]
    fn forgotten_steps_are_not_gone_on_with() {
        let mut trend = with(&[1.0, 1.0, 1.0]);
        assert_eq!(trend.best(), 1);
        trend.forget();
        assert!(trend.factors(1, 1.0, CORRECTION).is_none());
    }
}
