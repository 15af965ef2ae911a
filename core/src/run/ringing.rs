//! Looks for columns that alternate from step to step, or nearly so.
//!
//! Stiff parts follow a motion at once in truth. Schemes without dissipation let them vibrate
//! instead, with accelerations that nearly change sign from step to step, and forces with them;
//! displacements may be right. The sixth difference of a column,
//!
//! ```text
//! (v[n-6] - 6 v[n-5] + 15 v[n-4] - 20 v[n-3] + 15 v[n-2] - 6 v[n-1] + v[n])/64
//! ```
//!
//! is the amplitude of what alternates from step to step, an eighth of that of an oscillation of
//! four steps, and a twenty-fourth of that of five steps. A jump enters six differences: the median
//! of thirteen passes over it, and takes a peak of one row for a 64th.

use super::snapshot::Snapshot;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::Arc;

/// Weights of the sixth difference.
const WEIGHTS: [f64; 7] = [1.0 / 64.0, -6.0 / 64.0, 15.0 / 64.0, -20.0 / 64.0, 15.0 / 64.0, -6.0 / 64.0, 1.0 / 64.0];

/// Differences whose median is taken.
const WINDOW: usize = 13;

/// Columns below this part of the largest one of their kind are compared with that part.
const SMALLEST_PART: f64 = 1e-3;

/// Rows whose distances in time differ by less than this part are evenly spaced.
const EVEN: f64 = 1e-6;

/// Kinds of columns that depend on accelerations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RingingKind {
    /// Accelerations
    Acceleration,
    /// Angular accelerations
    AngularAcceleration,
    /// Forces
    Force,
    /// Moments
    Moment,
    /// Strains
    Strain,
    /// Curvatures
    Curvature,
}

impl RingingKind {
    /// All kinds, in their order.
    pub const ALL: [Self; 6] =
        [Self::Acceleration, Self::AngularAcceleration, Self::Force, Self::Moment, Self::Strain, Self::Curvature];
}

/// Appends the values of columns.
pub type ReadColumns = dyn Fn(&Snapshot, &mut Vec<f64>) + Send + Sync;

/// Columns that depend on accelerations, with the function that appends their values, and others beside them.
#[derive(Clone)]
pub struct WatchedColumns {
    /// The names of all columns that are appended
    pub names: Vec<String>,
    /// Which of them are watched, vector by vector: the first, and the first behind them
    pub vectors: Vec<(RingingKind, [usize; 2])>,
    /// Appends the values
    pub read: Arc<ReadColumns>,
}

/// Follows the watched columns of a run over a stage of fixed steps.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub(super) struct Ringing {
    signals: Vec<Signal>,
    /// The time of the last row
    time: Option<f64>,
    /// The distance in time of the last two rows
    spacing: Option<f64>,
}

/// Columns of one kind at one place: a vector over time.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
struct Signal {
    /// Values in the last evenly spaced rows, the latest last
    values: VecDeque<Vec<f64>>,
    /// Magnitudes of the last differences
    differences: VecDeque<f64>,
    /// The largest magnitude of a value
    largest: f64,
    /// The largest median of differences
    oscillation: f64,
    /// When that was
    time: f64,
}

/// The worst oscillation of the columns of a stage.
pub(super) struct WorstOscillation<'a> {
    pub names: &'a [String],
    /// Its amplitude over the largest value of these columns
    pub share: f64,
    pub time: f64,
}

impl Ringing {
    /// Takes the columns of a row. Behind a step of another length all begins anew.
    pub fn take(&mut self, watched: &[WatchedColumns], snapshot: &Snapshot) {
        let time = snapshot.state.time;
        let spacing = self.time.replace(time).map(|before| time - before);
        let before = std::mem::replace(&mut self.spacing, spacing);
        if let (Some(before), Some(spacing)) = (before, spacing)
            && (spacing - before).abs() > EVEN * before
        {
            self.signals.iter_mut().for_each(Signal::forget);
            return;
        }
        self.signals.resize_with(watched.iter().map(|columns| columns.vectors.len()).sum(), Signal::default);
        let mut row = Vec::new();
        let mut signals = self.signals.iter_mut();
        for columns in watched {
            row.clear();
            (columns.read)(snapshot, &mut row);
            for ((_, [start, end]), signal) in columns.vectors.iter().zip(&mut signals) {
                signal.take(&row[*start..*end], time);
            }
        }
    }

    /// The largest value of each kind.
    pub fn largest(&self, watched: &[WatchedColumns]) -> [f64; RingingKind::ALL.len()] {
        let mut largest = [0.0; RingingKind::ALL.len()];
        for ((kind, _), signal) in watched.iter().flat_map(|columns| &columns.vectors).zip(&self.signals) {
            largest[*kind as usize] = signal.largest.max(largest[*kind as usize]);
        }
        largest
    }

    /// The worst oscillation. Values up to `round_off` of their kind are no more than round-off.
    pub fn worst<'w>(
        &self,
        watched: &'w [WatchedColumns],
        round_off: [f64; RingingKind::ALL.len()],
    ) -> Option<WorstOscillation<'w>> {
        let largest = self.largest(watched);
        let vectors = watched.iter().flat_map(|columns| columns.vectors.iter().map(move |vector| (columns, *vector)));
        let shares = vectors.zip(&self.signals).map(|((columns, (kind, [start, end])), signal)| {
            let kind = kind as usize;
            let scale = signal.largest.max(SMALLEST_PART * largest[kind]).max(round_off[kind]);
            let share = if scale > 0.0 { signal.oscillation / scale } else { 0.0 };
            WorstOscillation { names: &columns.names[start..end], share, time: signal.time }
        });
        shares.max_by(|a, b| a.share.total_cmp(&b.share))
    }
}

impl Signal {
    fn forget(&mut self) {
        self.values.clear();
        self.differences.clear();
    }

    fn take(&mut self, value: &[f64], time: f64) {
        if self.values.back().is_some_and(|last| last.len() != value.len()) {
            self.forget();
        }
        self.largest = self.largest.max(magnitude(value.iter().copied()));
        let oldest = if self.values.len() == WEIGHTS.len() { self.values.pop_front() } else { None };
        let mut latest = oldest.unwrap_or_default();
        latest.clear();
        latest.extend_from_slice(value);
        self.values.push_back(latest);
        if self.values.len() == WEIGHTS.len() {
            let component = |k: usize| self.values.iter().zip(WEIGHTS).map(|(value, weight)| weight * value[k]).sum();
            let difference = magnitude((0..value.len()).map(component));
            self.add_difference(difference, time);
        }
    }

    fn add_difference(&mut self, difference: f64, time: f64) {
        if self.differences.len() == WINDOW {
            self.differences.pop_front();
        }
        self.differences.push_back(difference);
        if self.differences.len() < WINDOW {
            return;
        }
        let mut sorted = [0.0; WINDOW];
        sorted.iter_mut().zip(&self.differences).for_each(|(sorted, &difference)| *sorted = difference);
        let (_, &mut median, _) = sorted.select_nth_unstable_by(WINDOW / 2, f64::total_cmp);
        if median > self.oscillation {
            self.oscillation = median;
            self.time = time;
        }
    }
}

fn magnitude(value: impl Iterator<Item = f64>) -> f64 {
    value.map(|v| v * v).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn oscillation(value: impl Fn(f64) -> [f64; 2]) -> f64 {
        let mut signal = Signal::default();
        (0..60).for_each(|step| signal.take(&value(f64::from(step)), f64::from(step)));
        signal.oscillation
    }

    /// A vector that turns has differences of one magnitude, sin(pi/n)^6 of its own at n steps a turn.
    #[test]
    fn oscillations_of_few_steps_are_seen() {
        let alternating = oscillation(|step| [3.0 + step, (PI * step).cos()]);
        assert!((alternating - 1.0).abs() < 1e-12, "{alternating}");
        for steps in [2.2f64, 3.0, 4.0, 5.0, 8.0] {
            let turning = oscillation(|step| [(TAU * step / steps).cos(), (TAU * step / steps).sin()]);
            let exact = (PI / steps).sin().powi(6);
            assert!((turning - exact).abs() < 1e-12, "{steps} steps: {turning} for {exact}");
        }
    }

    #[test]
    fn jumps_and_kinks_are_passed_over() {
        let alone = |value: fn(f64) -> f64| oscillation(|step| [value(step), 0.0]);
        assert_eq!(alone(|step| if step < 30.0 { 0.0 } else { 1.0 }), 0.0);
        assert_eq!(alone(|step| (step - 30.0).abs()), 0.0);
        assert_eq!(alone(|step| if step == 30.0 { 1.0 } else { 0.0 }), 1.0 / 64.0);
    }
}
