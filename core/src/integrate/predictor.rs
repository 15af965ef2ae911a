//! What the corrections of the last steps tell about the next one.
//!
//! A scheme predicts the end of a step with the acceleration of its start. What Newton's method
//! then adds, c = q1 - q1(predicted), grows with the third power of the step and goes on as the
//! motion does: smoothly in soft directions, while in stiff ones accelerations swing from step to
//! step (the trapezoidal rule turns them round), and c with them. Sums of such motions follow from
//! those before them,
//!
//! ```text
//! c(n) = a1 c(n-1) + a2 c(n-2) + ...
//! ```
//!
//! and the factors are those that would have left the least in the last steps (linear prediction:
//! Makhoul 1975, doi:10.1109/PROC.1975.9792). What counts is the size of c, not that of its forces:
//! they are large where it is stiff, which the first correction takes away, but what that
//! correction leaves grows with the square of how far things turn. Where motion has no rule the
//! factors are small, and the prediction is the scheme's own; where it jolts they are too large to
//! be those of a motion, and lower orders are asked.

use super::{Method, Step};
use crate::model::{Model, SlotKind};
use crate::scalar::CompressedField;
use crate::system::{DofMap, State};
use crate::tensor::Vec3;
use crate::threads;
use nalgebra::{SMatrix, SVector};
use std::array::from_fn;
use std::collections::VecDeque;
use std::sync::Arc;

/// The order of the prediction: so many steps tell of the next one. One more is remembered, to
/// learn from.
const MOST: usize = 4;

/// The forgetting factor: what a step counts for beside the next one.
const MEMORY: f64 = 0.5;

/// Motions that do not grow have factors whose sizes add up to this at most: (1 + 1)^MOST - 1, of
/// roots in the unit disc. Where small corrections are followed by a jolt, the one is no multiple
/// of the others, although the factors say so.
const LARGEST: f64 = ((1 << MOST) - 1) as f64;

/// A step that is longer or shorter than another one by more than this has nothing to say of it.
const ALIKE: f64 = 4.0;

/// The power of the length of a step with which corrections grow
const GROWTH: i32 = 3;

/// Directions in which the corrections of the last steps differ by less than this share, in
/// squares, are those of their six digits.
const DIGITS: f64 = 1e-11;

/// Factors of the last corrections, the latest first
type Factors = [f64; MOST];

/// The corrections of the last steps of a stage.
#[derive(Default)]
pub struct Predictor {
    /// What corrections are compared by: of each slot its kind, and of each kind a factor of
    /// squares
    kinds: Arc<Vec<SlotKind>>,
    weights: [f64; SlotKind::ALL.len()],
    /// The latest first
    past: VecDeque<Past>,
    /// Entry k: what the factors of a prediction of order k + 1 come from
    fits: [Fit; MOST],
    /// The same before the last step
    before: [Fit; MOST],
    /// Where the scheme's own prediction went in the present step, by equation
    predicted: Vec<f64>,
    has_foreseen: bool,
}

/// The normal equations of some factors, of corrections over the power of the length of their
/// steps.
#[derive(Clone, Default)]
struct Fit {
    /// Lower triangle
    matrix: SMatrix<f64, MOST, MOST>,
    goals: SVector<f64, MOST>,
}

/// A step that has come to its end.
#[derive(Default)]
struct Past {
    length: f64,
    /// What makes corrections of steps of different lengths comparable
    rate: f64,
    /// c by equation: what is held is not corrected. A guess needs few digits.
    correction: CompressedField<1>,
    /// Its products with itself and with those before it, where there are any
    products: [f64; MOST + 1],
}

impl Predictor {
    /// For a stage of a scene.
    pub fn new(model: &Model) -> Self {
        let weight = |kind: SlotKind| if kind.is_multiplier() { 0.0 } else { kind.scale(model.length).powi(-2) };
        Self { kinds: model.kinds.clone(), weights: SlotKind::ALL.map(weight), ..Self::default() }
    }

    /// Another attempt at a step begins: nothing has been foreseen of it yet.
    pub fn reset(&mut self) {
        self.has_foreseen = false;
    }

    /// Whether something was foreseen of the present step.
    pub fn has_foreseen(&self) -> bool {
        self.has_foreseen
    }

    /// Adds what is foreseen to the prediction of a step.
    pub fn begin(&mut self, dof_map: &DofMap, state: &mut State, step: &Step, scratch: &mut [Vec3]) {
        self.predicted.resize(dof_map.count(), 0.0);
        dof_map.gather(|slot| state.q[slot], &mut self.predicted);
        let Some(factors) = self.factors(step.length) else { return };
        self.has_foreseen = true;
        let past: [_; MOST] = self.corrections();
        let of = |equation| past.iter().zip(&factors).map(move |(past, factor)| past.get(equation)[0] * factor);
        dof_map.scatter_found(|equation| of(equation).sum(), scratch);
        step.correct(state, scratch);
    }

    /// Takes note of a step that has come to its end, with the unknowns that it was predicted in.
    pub fn end(&mut self, dof_map: &DofMap, state: &State, step: &Step) {
        let mut change = std::mem::take(&mut self.predicted);
        dof_map.gather_change(|slot| state.q[slot], &mut change);
        // Into the memory of one that nobody asks for any more.
        let forgotten = if self.past.len() > MOST { self.past.pop_back() } else { None };
        let mut correction = forgotten.unwrap_or_default().correction;
        correction.take(change.len(), |equation| [change[equation]]);
        dof_map.fill(|slot| self.weights[self.kinds[slot] as usize], &mut change);
        self.learn(step.length, correction, &change);
        self.predicted = change;
    }

    /// Learns from a step of this length with its correction; `weights` are the factors of squares.
    fn learn(&mut self, length: f64, correction: CompressedField<1>, weights: &[f64]) {
        let rate = length.powi(-GROWTH);
        self.past.push_front(Past { length, rate, correction, products: [0.0; MOST + 1] });
        let all: [_; MOST + 1] = self.corrections();
        let products = threads::sums(weights.len(), |dof_map| {
            let mut sums = [0.0; MOST + 1];
            for equation in dof_map {
                let own = all[0].get(equation)[0] * weights[equation];
                sums.iter_mut().zip(&all).for_each(|(sum, one)| *sum += own * one.get(equation)[0]);
            }
            sums
        });
        self.past[0].products = products;
        let known = self.alike(length, 1);
        let told = Fit {
            matrix: lower(|row, column| if row < known { self.product(column + 1, row + 1) } else { 0.0 }),
            goals: SVector::from_fn(|row, _| if row < known { self.product(0, row + 1) } else { 0.0 }),
        };
        self.before = self.fits.clone();
        // Where few steps are remembered, what was learnt of more of them stays.
        self.fits[..known].iter_mut().zip(1..).for_each(|(fit, count)| fit.learn(&told, count));
    }

    /// The last corrections, the latest first; in the place of what is not known stands the first
    /// of them.
    fn corrections<const N: usize>(&self) -> [&CompressedField<1>; N] {
        from_fn(|number| &self.past.get(number).unwrap_or(&self.past[0]).correction)
    }

    /// The product of a correction with one `later` than it, both over the power of the length of
    /// their steps.
    fn product(&self, later: usize, earlier: usize) -> f64 {
        let [of, with] = [later, earlier].map(|number| &self.past[number]);
        of.products[earlier - later] * of.rate * with.rate
    }

    /// How many of the steps from the one `since` on, at most [`MOST`], have something to say of
    /// one of this length.
    fn alike(&self, length: f64, since: usize) -> usize {
        let past = self.past.iter().skip(since).take(MOST);
        past.take_while(|past| (1.0 / ALIKE..=ALIKE).contains(&(length / past.length))).count()
    }

    /// The factors of the last corrections in what is foreseen of a step of this length; `None`
    /// where nothing is known.
    fn factors(&self, length: f64) -> Option<Factors> {
        let fits = self.fits[..self.alike(length, 0)].iter();
        let factors = fits.rev().find_map(Fit::solve)?;
        let growth = length.powi(GROWTH);
        Some(from_fn(|number| self.past.get(number).map_or(0.0, |past| factors[number] * past.rate * growth)))
    }

    /// The last step is not taken after all: what it told does not count.
    pub fn withdraw(&mut self) {
        self.past.pop_front();
        self.fits = self.before.clone();
    }

    /// Forgets all steps, since unknowns have changed their meaning; how they followed each other
    /// stays known.
    pub fn forget(&mut self) {
        self.past.clear();
    }

    /// The last step has failed, perhaps for what was foreseen of it: what foresaw it would do so
    /// again.
    pub fn fail(&mut self) {
        self.forget();
        (self.fits, self.before) = Default::default();
    }
}

impl Fit {
    /// Takes note of what a step tells of so many factors.
    fn learn(&mut self, told: &Self, count: usize) {
        self.matrix =
            self.matrix * MEMORY + lower(|row, column| if row < count { told.matrix[(row, column)] } else { 0.0 });
        self.goals = self.goals * MEMORY + SVector::from_fn(|row, _| if row < count { told.goals[row] } else { 0.0 });
    }

    /// Factors that leave least; of steps of which nothing is known they are zero. `None` where
    /// there is nothing to learn from, or they are those of no motion.
    fn solve(&self) -> Option<SVector<f64, MOST>> {
        let size = self.matrix.trace();
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let mut matrix = self.matrix;
        for k in 0..MOST {
            matrix[(k, k)] += DIGITS * size;
        }
        Some(matrix.cholesky()?.solve(&self.goals)).filter(|factors| factors.lp_norm(1) <= LARGEST)
    }
}

/// A lower triangle.
fn lower(entry: impl Fn(usize, usize) -> f64) -> SMatrix<f64, MOST, MOST> {
    SMatrix::from_fn(|row, column| if column <= row { entry(row, column) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Has seen steps of these lengths with these corrections.
    fn with<const N: usize>(steps: &[(f64, [f64; N])]) -> Predictor {
        let mut trend = Predictor::default();
        steps.iter().for_each(|(length, correction)| learn(&mut trend, *length, correction));
        trend
    }

    fn learn(trend: &mut Predictor, length: f64, correction: &[f64]) {
        let mut rough = CompressedField::default();
        rough.take(correction.len(), |k| [correction[k]]);
        trend.learn(length, rough, &vec![1.0; correction.len()]);
    }

    /// Of steps of one second with one number.
    fn after(corrections: impl IntoIterator<Item = f64>) -> Predictor {
        with(&corrections.into_iter().map(|c| (1.0, [c])).collect::<Vec<_>>())
    }

    fn foreseen(trend: &Predictor, length: f64) -> Option<Vec<f64>> {
        let factors = trend.factors(length)?;
        let past: [_; MOST] = trend.corrections();
        let of = |k| (0..MOST).map(|step| past[step].get(k)[0] * factors[step]).sum();
        Some((0..past[0].len()).map(of).collect())
    }

    #[track_caller]
    fn assert_foreseen(trend: &Predictor, length: f64, wanted: &[f64], share: f64) {
        let Some(foreseen) = foreseen(trend, length) else { panic!("nothing is foreseen") };
        let largest = wanted.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= share * largest;
        assert!(foreseen.iter().zip(wanted).all(is_near), "{foreseen:?}, not {wanted:?}");
    }

    /// Smooth in one direction, swinging in others: each obeys a rule of its own, and both the same
    /// one.
    #[test]
    fn sums_of_smooth_and_swinging_motions_go_on() {
        let at = |step: i32| {
            let t = f64::from(step);
            [1.0 + 0.3 * t, (-1.0_f64).powi(step), (2.0 * t).cos() * 0.1 + 0.2, 0.0]
        };
        // A constant, a line, and what turns round: three factors. A cosine has two more, and is
        // one of five.
        let three: Vec<_> = (0..12).map(|k| (0.1, [at(k)[0], at(k)[1], at(k)[0] - at(k)[1]])).collect();
        assert_foreseen(&with(&three), 0.1, &[at(12)[0], at(12)[1], at(12)[0] - at(12)[1]], 1e-3);
        let cosine: Vec<_> = (0..12).map(|k| (0.1, [at(k)[2], at(k)[3]])).collect();
        assert_foreseen(&with(&cosine), 0.1, &[at(12)[2], at(12)[3]], 1e-3);
    }

    #[test]
    fn the_first_steps_already_tell() {
        assert!(foreseen(&Predictor::default(), 1.0).is_none() && foreseen(&after([2.0]), 1.0).is_none());
        // What halves goes on to halve, what turns round goes on to do so.
        assert_foreseen(&after([4.0, 2.0]), 1.0, &[1.0], 1e-5);
        assert_foreseen(&after([4.0, -4.0]), 1.0, &[4.0], 1e-5);
    }

    #[test]
    fn corrections_grow_with_the_third_power_of_steps() {
        let steps: Vec<_> = [1.0_f64, 1.8, 3.2, 5.8].map(|length| (length, [length.powi(3), 0.0])).into();
        let mut trend = with(&steps);
        assert_foreseen(&trend, 10.0, &[1000.0, 0.0], 1e-4);
        assert_foreseen(&trend, 2.0, &[8.0, 0.0], 1e-4);
        assert!(foreseen(&trend, 100.0).is_none(), "of a step like none before");
        // A step that is not taken says nothing, however it contradicts the others.
        learn(&mut trend, 5.8, &[-5.0 * 5.8_f64.powi(3), 7.0]);
        assert!(foreseen(&trend, 10.0).is_none_or(|wrong| (wrong[0] - 1000.0).abs() > 100.0));
        trend.withdraw();
        assert_foreseen(&trend, 10.0, &[1000.0, 0.0], 1e-4);
    }

    #[test]
    fn what_comes_without_rule_is_not_foreseen() {
        let round_off = |step: u32| from_fn::<f64, 500, _>(|k| f64::from(1000 * step + k as u32).powi(2).sin());
        let trend = with(&(0..20).map(|step| (1.0, round_off(step))).collect::<Vec<_>>());
        let Some(factors) = trend.factors(1.0) else { panic!("there is a past") };
        assert!(factors.iter().all(|factor| factor.abs() < 0.15), "{factors:?}");
        assert_eq!(after([0.0; 5]).factors(1.0), None);
    }

    /// Round-off at rest, and then a load: its correction is 1e8 times the last one, and the next
    /// one is not 1e8 times it.
    #[test]
    fn a_jolt_does_not_run_away() {
        let mut trend = after((0..6).map(|k| 1e-8 * f64::from(2 + k % 2)));
        for _ in 0..6 {
            learn(&mut trend, 1.0, &[1.0]);
            let next = foreseen(&trend, 1.0).map_or(0.0, |next| next[0]);
            assert!(next.abs() <= LARGEST, "{next}");
        }
        assert_foreseen(&trend, 1.0, &[1.0], 1e-3);
    }

    #[test]
    fn what_failed_is_not_foreseen_again() {
        let mut trend = after([1.0, 3.0, 9.0, 27.0]);
        assert_foreseen(&trend, 1.0, &[81.0], 1e-4);
        trend.fail();
        learn(&mut trend, 1.0, &[30.0]);
        assert!(foreseen(&trend, 1.0).is_none());
        // Nor does what is withdrawn bring it back.
        trend.withdraw();
        learn(&mut trend, 1.0, &[30.0]);
        assert!(foreseen(&trend, 1.0).is_none());
    }

    #[test]
    fn what_is_learnt_outlasts_what_is_forgotten() {
        let parabola = |k: i32| f64::from(k * k);
        let mut trend = after((0..10).map(parabola));
        trend.forget();
        assert!(foreseen(&trend, 1.0).is_none());
        (20..23).for_each(|k| learn(&mut trend, 1.0, &[parabola(k)]));
        assert_foreseen(&trend, 1.0, &[parabola(23)], 1e-3);
    }

    #[test]
    fn what_is_learnt_does_not_depend_on_threads() {
        let learnt = || {
            let count = 5 * threads::PART;
            let mut trend = Predictor::default();
            for step in 1..=6 {
                let correction: Vec<f64> = (0..count).map(|k| (k as f64 * f64::from(step * step)).sin()).collect();
                learn(&mut trend, 1.0, &correction);
            }
            trend.factors(1.0).map(|factors| factors.map(f64::to_bits))
        };
        let alone = learnt();
        assert!(alone.is_some());
        assert_eq!(threads::on(3, learnt), alone);
    }
}
