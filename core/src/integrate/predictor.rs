//! A predictor of the unknowns at the end of a step, from the corrections of the last steps.
//!
//! A scheme predicts the end of a step with the acceleration of its start. The correction c = q1 -
//! q1(predicted) by Newton's method grows with the third power of the step and varies as the motion
//! does: smoothly in soft directions, while in stiff ones accelerations, and c with them, change
//! sign from step to step (the trapezoidal rule reverses them). Sums of such sequences obey a
//! linear recurrence,
//!
//! ```text
//! c(n) = a1 c(n-1) + a2 c(n-2) + ...
//! ```
//!
//! whose factors minimise the remainders of the last steps (linear prediction: Makhoul 1975,
//! doi:10.1109/PROC.1975.9792). Remainders are measured in unknowns, not in forces: forces are
//! large in stiff directions, which the first correction of Newton's method removes, but its
//! remainder grows with the square of rotations. For an irregular motion the factors are small, and
//! the prediction is that of the scheme; after a sudden load they are larger than those of any
//! motion, and a lower order is used.

use super::{Method, Step};
use crate::model::{Model, SlotKind};
use crate::scalar::CompressedField;
use crate::system::{DofMap, State};
use crate::tensor::Vec3;
use crate::threads;
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use std::array::from_fn;
use std::collections::VecDeque;
use std::sync::Arc;

/// The order of the prediction: the number of last steps in the recurrence. One more step is
/// stored, to fit the factors.
const ORDER: usize = 4;

/// The forgetting factor: the weight of a step in the fit over that of the step after it.
const FORGETTING_FACTOR: f64 = 0.5;

/// The largest sum of the sizes of factors: (1 + 1)^ORDER - 1, for a recurrence with all roots in
/// the unit disc, which does not grow. Larger ones arise when a sudden load follows small
/// corrections.
const MAX_FACTOR_SUM: f64 = ((1 << ORDER) - 1) as f64;

/// The largest ratio of the lengths of two steps, up or down, of which one serves the prediction of
/// the other.
const MAX_LENGTH_RATIO: f64 = 4.0;

/// The power of the length of a step with which corrections grow.
const GROWTH_POWER: i32 = 3;

/// The regularisation of the fit, as a share of the trace of its matrix: corrections are stored to
/// six digits, so that smaller differences between them, in squares, are rounding.
const REGULARISATION: f64 = 1e-11;

/// Factors of the last corrections, the latest first.
type Factors = [f64; ORDER];

/// The corrections of the last steps of a stage.
#[derive(Clone, Default, Deserialize, Serialize)]
pub struct Predictor {
    /// The kind of each slot
    #[serde(skip)]
    kinds: Arc<Vec<SlotKind>>,
    /// The weight of squares of corrections of each kind of slot
    weights: [f64; SlotKind::ALL.len()],
    /// The last steps, the latest first
    past: VecDeque<PastStep>,
    /// Entry k: the normal equations of a prediction of order k + 1
    fits: [NormalEquations; ORDER],
    /// The normal equations before the last step
    before: [NormalEquations; ORDER],
    /// The unknowns that the scheme has predicted for the end of the present step, by equation
    #[serde(skip)]
    predicted: Vec<f64>,
    has_foreseen: bool,
}

/// Normal equations of factors, for corrections divided by the power [`GROWTH_POWER`] of the
/// lengths of their steps.
#[derive(Clone, Default, Deserialize, Serialize)]
struct NormalEquations {
    /// Lower triangle
    matrix: SMatrix<f64, ORDER, ORDER>,
    goals: SVector<f64, ORDER>,
}

/// A completed step.
#[derive(Clone, Default, Deserialize, Serialize)]
struct PastStep {
    /// The length of the step, a time
    length: f64,
    /// One over the power [`GROWTH_POWER`] of its length: makes corrections of steps of different
    /// lengths comparable
    rate: f64,
    /// c by equation, to six digits, which a prediction does not exceed
    correction: CompressedField<1>,
    /// The weighted products of its correction with itself and with those of the steps before it
    products: [f64; ORDER + 1],
}

impl Predictor {
    /// A predictor without past steps for a stage of a scene.
    pub fn new(model: &Model) -> Self {
        let weight = |kind: SlotKind| if kind.is_multiplier() { 0.0 } else { kind.scale(model.length).powi(-2) };
        Self { kinds: model.kinds.clone(), weights: SlotKind::ALL.map(weight), ..Self::default() }
    }

    /// The predictor with the kinds of slots of a model, which checkpoints leave out.
    pub fn of_model(self, model: &Model) -> Self {
        Self { kinds: model.kinds.clone(), ..self }
    }

    /// Begins another attempt at a step, which has no prediction yet.
    pub fn reset(&mut self) {
        self.has_foreseen = false;
    }

    /// True if the present step has a prediction by this predictor.
    pub fn has_foreseen(&self) -> bool {
        self.has_foreseen
    }

    /// Adds the predicted correction to the scheme's prediction of a step.
    pub fn begin(&mut self, dof_map: &DofMap, state: &mut State, step: &Step, scratch: &mut [Vec3]) {
        if self.foresee(dof_map, state, step.length, scratch) {
            step.correct(state, scratch);
        }
    }

    /// Predicts the correction of the scheme's prediction `state` for a step of a length; `false`
    /// if nothing is foreseen.
    pub fn foresee(&mut self, dof_map: &DofMap, state: &State, length: f64, correction: &mut [Vec3]) -> bool {
        self.predicted.resize(dof_map.count(), 0.0);
        dof_map.gather(|slot| state.q[slot], &mut self.predicted);
        let Some(factors) = self.factors(length) else { return false };
        self.has_foreseen = true;
        let past: [_; ORDER] = self.corrections();
        let of = |equation| past.iter().zip(&factors).map(move |(past, factor)| past.get(equation)[0] * factor);
        dof_map.scatter_found(|equation| of(equation).sum(), correction);
        true
    }

    /// Learns from a completed step, whose state must have the charts of its prediction.
    pub fn end(&mut self, dof_map: &DofMap, state: &State, length: f64) {
        let mut change = std::mem::take(&mut self.predicted);
        dof_map.gather_change(|slot| state.q[slot], &mut change);
        // The memory of a step that is no longer needed is used again.
        let forgotten = if self.past.len() > ORDER { self.past.pop_back() } else { None };
        let mut correction = forgotten.unwrap_or_default().correction;
        correction.take(change.len(), |equation| [change[equation]]);
        dof_map.fill(|slot| self.weights[self.kinds[slot] as usize], &mut change);
        self.learn(length, correction, &change);
        self.predicted = change;
    }

    /// Updates the fits with the correction of a step; `weights` are those of squares, by equation.
    fn learn(&mut self, length: f64, correction: CompressedField<1>, weights: &[f64]) {
        let rate = length.powi(-GROWTH_POWER);
        self.past.push_front(PastStep { length, rate, correction, products: [0.0; ORDER + 1] });
        let all: [_; ORDER + 1] = self.corrections();
        let products = threads::sums(weights.len(), |dof_map| {
            let mut sums = [0.0; ORDER + 1];
            for equation in dof_map {
                let own = all[0].get(equation)[0] * weights[equation];
                sums.iter_mut().zip(&all).for_each(|(sum, one)| *sum += own * one.get(equation)[0]);
            }
            sums
        });
        self.past[0].products = products;
        let known = self.alike(length, 1);
        let told = NormalEquations {
            matrix: lower(|row, column| if row < known { self.product(column + 1, row + 1) } else { 0.0 }),
            goals: SVector::from_fn(|row, _| if row < known { self.product(0, row + 1) } else { 0.0 }),
        };
        self.before = self.fits.clone();
        // Fits of an order above the number of stored steps are kept.
        self.fits[..known].iter_mut().zip(1..).for_each(|(fit, count)| fit.learn(&told, count));
    }

    /// The last corrections, the latest first; missing ones are replaced by the latest.
    fn corrections<const N: usize>(&self) -> [&CompressedField<1>; N] {
        from_fn(|number| &self.past.get(number).unwrap_or(&self.past[0]).correction)
    }

    /// The product of the corrections of two steps, numbered backwards, both over the power
    /// [`GROWTH_POWER`] of their lengths.
    fn product(&self, later: usize, earlier: usize) -> f64 {
        let [of, with] = [later, earlier].map(|number| &self.past[number]);
        of.products[earlier - later] * of.rate * with.rate
    }

    /// The number of consecutive steps from number `since` backwards, at most [`ORDER`], whose
    /// lengths are within the ratio [`MAX_LENGTH_RATIO`] of `length`.
    fn alike(&self, length: f64, since: usize) -> usize {
        let past = self.past.iter().skip(since).take(ORDER);
        past.take_while(|past| (1.0 / MAX_LENGTH_RATIO..=MAX_LENGTH_RATIO).contains(&(length / past.length))).count()
    }

    /// The factors of the last corrections in the prediction of a step of this length; `None`
    /// without a usable fit.
    fn factors(&self, length: f64) -> Option<Factors> {
        let fits = self.fits[..self.alike(length, 0)].iter();
        let factors = fits.rev().find_map(NormalEquations::solve)?;
        let growth = length.powi(GROWTH_POWER);
        Some(from_fn(|number| self.past.get(number).map_or(0.0, |past| factors[number] * past.rate * growth)))
    }

    /// Removes the last step, which is not taken after all, from the fits.
    pub fn withdraw(&mut self) {
        self.past.pop_front();
        self.fits = self.before.clone();
    }

    /// Forgets the corrections of all steps, since unknowns have changed their meaning; the fits
    /// are kept.
    pub fn forget(&mut self) {
        self.past.clear();
    }

    /// Forgets corrections and fits after a step that has failed, perhaps because of its
    /// prediction.
    pub fn fail(&mut self) {
        self.forget();
        self.fits = Default::default();
        self.before = Default::default();
    }
}

impl NormalEquations {
    /// Adds the normal equations `told` of a step for the first `count` factors, and fades older
    /// ones.
    fn learn(&mut self, told: &Self, count: usize) {
        self.matrix = self.matrix * FORGETTING_FACTOR
            + lower(|row, column| if row < count { told.matrix[(row, column)] } else { 0.0 });
        self.goals =
            self.goals * FORGETTING_FACTOR + SVector::from_fn(|row, _| if row < count { told.goals[row] } else { 0.0 });
    }

    /// The factors of least remainder, zero for steps that are not known. `None` if there are no
    /// corrections, or if the sum of the factors exceeds [`MAX_FACTOR_SUM`].
    fn solve(&self) -> Option<SVector<f64, ORDER>> {
        let size = self.matrix.trace();
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        let mut matrix = self.matrix;
        for k in 0..ORDER {
            matrix[(k, k)] += REGULARISATION * size;
        }
        Some(matrix.cholesky()?.solve(&self.goals)).filter(|factors| factors.lp_norm(1) <= MAX_FACTOR_SUM)
    }
}

/// The matrix whose lower triangle has these entries.
fn lower(entry: impl Fn(usize, usize) -> f64) -> SMatrix<f64, ORDER, ORDER> {
    SMatrix::from_fn(|row, column| if column <= row { entry(row, column) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A predictor that has learnt from steps of these lengths with these corrections.
    fn with<const N: usize>(steps: &[(f64, [f64; N])]) -> Predictor {
        let mut predictor = Predictor::default();
        steps.iter().for_each(|(length, correction)| learn(&mut predictor, *length, correction));
        predictor
    }

    fn learn(predictor: &mut Predictor, length: f64, correction: &[f64]) {
        let mut rough = CompressedField::default();
        rough.take(correction.len(), |k| [correction[k]]);
        predictor.learn(length, rough, &vec![1.0; correction.len()]);
    }

    /// A predictor that has learnt from steps of length one with one unknown.
    fn after(corrections: impl IntoIterator<Item = f64>) -> Predictor {
        with(&corrections.into_iter().map(|c| (1.0, [c])).collect::<Vec<_>>())
    }

    fn foreseen(predictor: &Predictor, length: f64) -> Option<Vec<f64>> {
        let factors = predictor.factors(length)?;
        let past: [_; ORDER] = predictor.corrections();
        let of = |k| (0..ORDER).map(|step| past[step].get(k)[0] * factors[step]).sum();
        Some((0..past[0].len()).map(of).collect())
    }

    #[track_caller]
    fn assert_foreseen(predictor: &Predictor, length: f64, wanted: &[f64], share: f64) {
        let Some(foreseen) = foreseen(predictor, length) else { panic!("nothing is foreseen") };
        let largest = wanted.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= share * largest;
        assert!(foreseen.iter().zip(wanted).all(is_near), "{foreseen:?}, not {wanted:?}");
    }

    /// Smooth in one direction, alternating in others: all obey one recurrence.
    #[test]
    fn sums_of_smooth_and_swinging_motions_go_on() {
        let at = |step: i32| {
            let t = f64::from(step);
            [1.0 + 0.3 * t, (-1.0_f64).powi(step), (2.0 * t).cos() * 0.1 + 0.2, 0.0]
        };
        // A line and an alternating sign need three factors, a cosine and a constant as well.
        let three: Vec<_> = (0..12).map(|k| (0.1, [at(k)[0], at(k)[1], at(k)[0] - at(k)[1]])).collect();
        assert_foreseen(&with(&three), 0.1, &[at(12)[0], at(12)[1], at(12)[0] - at(12)[1]], 1e-3);
        let cosine: Vec<_> = (0..12).map(|k| (0.1, [at(k)[2], at(k)[3]])).collect();
        assert_foreseen(&with(&cosine), 0.1, &[at(12)[2], at(12)[3]], 1e-3);
    }

    #[test]
    fn the_first_steps_already_tell() {
        assert!(foreseen(&Predictor::default(), 1.0).is_none() && foreseen(&after([2.0]), 1.0).is_none());
        // A sequence that halves goes on to halve, one that alternates goes on to alternate.
        assert_foreseen(&after([4.0, 2.0]), 1.0, &[1.0], 1e-5);
        assert_foreseen(&after([4.0, -4.0]), 1.0, &[4.0], 1e-5);
    }

    #[test]
    fn corrections_grow_with_the_third_power_of_steps() {
        let steps: Vec<_> = [1.0_f64, 1.8, 3.2, 5.8].map(|length| (length, [length.powi(3), 0.0])).into();
        let mut predictor = with(&steps);
        assert_foreseen(&predictor, 10.0, &[1000.0, 0.0], 1e-4);
        assert_foreseen(&predictor, 2.0, &[8.0, 0.0], 1e-4);
        assert!(foreseen(&predictor, 100.0).is_none(), "of a step like none before");
        // A step that is withdrawn has no influence, however it contradicts the others.
        learn(&mut predictor, 5.8, &[-5.0 * 5.8_f64.powi(3), 7.0]);
        assert!(foreseen(&predictor, 10.0).is_none_or(|wrong| (wrong[0] - 1000.0).abs() > 100.0));
        predictor.withdraw();
        assert_foreseen(&predictor, 10.0, &[1000.0, 0.0], 1e-4);
    }

    #[test]
    fn what_comes_without_rule_is_not_foreseen() {
        let round_off = |step: u32| from_fn::<f64, 500, _>(|k| f64::from(1000 * step + k as u32).powi(2).sin());
        let predictor = with(&(0..20).map(|step| (1.0, round_off(step))).collect::<Vec<_>>());
        let Some(factors) = predictor.factors(1.0) else { panic!("there is a past") };
        assert!(factors.iter().all(|factor| factor.abs() < 0.15), "{factors:?}");
        assert_eq!(after([0.0; 5]).factors(1.0), None);
    }

    /// Round-off at rest, and then a load, whose correction is 1e8 times the last one: the next
    /// prediction must not be 1e8 times larger again.
    #[test]
    fn a_jolt_does_not_run_away() {
        let mut predictor = after((0..6).map(|k| 1e-8 * f64::from(2 + k % 2)));
        for _ in 0..6 {
            learn(&mut predictor, 1.0, &[1.0]);
            let next = foreseen(&predictor, 1.0).map_or(0.0, |next| next[0]);
            assert!(next.abs() <= MAX_FACTOR_SUM, "{next}");
        }
        assert_foreseen(&predictor, 1.0, &[1.0], 1e-3);
    }

    #[test]
    fn what_failed_is_not_foreseen_again() {
        let mut predictor = after([1.0, 3.0, 9.0, 27.0]);
        assert_foreseen(&predictor, 1.0, &[81.0], 1e-4);
        predictor.fail();
        learn(&mut predictor, 1.0, &[30.0]);
        assert!(foreseen(&predictor, 1.0).is_none());
        // A withdrawal does not restore the fits from before the failure.
        predictor.withdraw();
        learn(&mut predictor, 1.0, &[30.0]);
        assert!(foreseen(&predictor, 1.0).is_none());
    }

    #[test]
    fn what_is_learnt_outlasts_what_is_forgotten() {
        let parabola = |k: i32| f64::from(k * k);
        let mut predictor = after((0..10).map(parabola));
        predictor.forget();
        assert!(foreseen(&predictor, 1.0).is_none());
        (20..23).for_each(|k| learn(&mut predictor, 1.0, &[parabola(k)]));
        assert_foreseen(&predictor, 1.0, &[parabola(23)], 1e-3);
    }

    #[test]
    fn what_is_learnt_does_not_depend_on_threads() {
        let learnt = || {
            let count = 5 * threads::PART;
            let mut predictor = Predictor::default();
            for step in 1..=6 {
                let correction: Vec<f64> = (0..count).map(|k| (k as f64 * f64::from(step * step)).sin()).collect();
                learn(&mut predictor, 1.0, &correction);
            }
            predictor.factors(1.0).map(|factors| factors.map(f64::to_bits))
        };
        let alone = learnt();
        assert!(alone.is_some());
        assert_eq!(threads::on(3, learnt), alone);
    }
}
