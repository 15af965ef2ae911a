//! Looks for forces and accelerations that oscillate faster than time steps resolve.
//!
//! Stiff parts follow a motion at once in truth. Schemes without dissipation let them vibrate instead, with accelerations that
//! nearly change sign from step to step, and forces with them; displacements stay right. The fourth difference of a column,
//!
//! ```text
//! (v[n-4] - 4 v[n-3] + 6 v[n-2] - 4 v[n-1] + v[n])/16
//! ```
//!
//! is the amplitude of what alternates from step to step, a quarter of that of an oscillation of four steps, and a fiftieth of
//! that of eight steps. A jump enters four differences, a peak five: the median of eleven passes over both.

use super::snapshot::Snapshot;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::Arc;

/// Weights of the fourth difference.
const DIFFERENCE: [f64; 5] = [0.0625, -0.25, 0.375, -0.25, 0.0625];

/// Differences whose median is taken.
const DIFFERENCES: usize = 11;

/// Columns below this part of the largest one of their quantity are compared with that part.
const SMALL: f64 = 1e-3;

/// Steps that differ by less than this part are equal.
const EQUAL: f64 = 1e-6;

/// Follows the columns of a run that depend on accelerations, over a stage.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub(super) struct Ringing {
    signals: Vec<Signal>,
    /// The length of the last step
    length: f64,
}

/// Columns of one quantity at one place: a vector over time.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
struct Signal {
    /// Values after the last steps of equal length, the latest last
    values: VecDeque<Vec<f64>>,
    /// Magnitudes of the last differences
    differences: VecDeque<f64>,
    /// The largest magnitude of a value
    largest: f64,
    /// The largest median of differences, and its time
    oscillation: f64,
    time: f64,
}

impl Signal {
    fn forget(&mut self) {
        self.values.clear();
        self.differences.clear();
    }

    fn take(&mut self, value: &[f64], time: f64) {
        self.largest = self.largest.max(magnitude(value.iter().copied()));
        let oldest = if self.values.len() == DIFFERENCE.len() { self.values.pop_front() } else { None };
        let mut latest = oldest.unwrap_or_default();
        latest.clear();
        latest.extend_from_slice(value);
        self.values.push_back(latest);
        if self.values.len() < DIFFERENCE.len() {
            return;
        }
        let component = |k: usize| self.values.iter().zip(DIFFERENCE).map(|(value, weight)| weight * value[k]).sum();
        let difference = magnitude((0..value.len()).map(component));
        if self.differences.len() == DIFFERENCES {
            self.differences.pop_front();
        }
        self.differences.push_back(difference);
        if self.differences.len() == DIFFERENCES {
            let mut sorted = Vec::from_iter(self.differences.iter().copied());
            sorted.sort_by(f64::total_cmp);
            let median = sorted[DIFFERENCES / 2];
            if median > self.oscillation {
                (self.oscillation, self.time) = (median, time);
            }
        }
    }
}

fn magnitude(value: impl Iterator<Item = f64>) -> f64 {
    value.map(|v| v * v).sum::<f64>().sqrt()
}

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

/// Columns that depend on accelerations, with the function that appends their values, and others beside them.
#[derive(Clone)]
pub struct WatchedColumns {
    /// The names of all columns that are appended
    pub names: Vec<String>,
    /// Which of them are watched, vector by vector: the first, and the first behind them
    pub vectors: Vec<(RingingKind, [usize; 2])>,
    /// Appends the values
    pub read: Arc<dyn Fn(&Snapshot, &mut Vec<f64>) + Send + Sync>,
}

/// The worst oscillation of the columns of a stage.
pub(super) struct Worst<'a> {
    pub names: &'a [String],
    /// Over the largest value
    pub share: f64,
    pub time: f64,
}

impl Ringing {
    /// The length of the last step.
    pub fn step(&self) -> f64 {
        self.length
    }

    /// Takes the columns after a step of a length.
    pub fn take(&mut self, watched: &[WatchedColumns], snapshot: &Snapshot, length: f64) {
        if (length - self.length).abs() > EQUAL * length {
            self.signals.iter_mut().for_each(Signal::forget);
        }
        self.length = length;
        self.signals.resize_with(watched.iter().map(|columns| columns.vectors.len()).sum(), Signal::default);
        let mut row = Vec::new();
        let mut signals = self.signals.iter_mut();
        for columns in watched {
            row.clear();
            (columns.read)(snapshot, &mut row);
            for ([start, end], signal) in columns.vectors.iter().map(|(_, ends)| *ends).zip(&mut signals) {
                signal.take(&row[start..end], snapshot.state.time);
            }
        }
    }

    /// The worst oscillation; `tolerated` are values of a kind that are no more than round-off.
    pub fn worst<'w>(
        &self,
        watched: &'w [WatchedColumns],
        tolerated: impl Fn(RingingKind) -> f64,
    ) -> Option<Worst<'w>> {
        let vectors = watched.iter().flat_map(|columns| columns.vectors.iter().map(move |vector| (columns, *vector)));
        let signals = || vectors.clone().zip(&self.signals);
        let largest_of = |kind: RingingKind| {
            let same = signals().filter(|((_, (other, _)), _)| *other == kind);
            same.map(|(_, signal)| signal.largest).fold(0.0, f64::max)
        };
        let shares = signals().map(|((columns, (kind, [start, end])), signal)| {
            let scale = signal.largest.max(SMALL * largest_of(kind)).max(tolerated(kind));
            let share = if scale > 0.0 { signal.oscillation / scale } else { 0.0 };
            Worst { names: &columns.names[start..end], share, time: signal.time }
        });
        shares.max_by(|a, b| a.share.total_cmp(&b.share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn oscillation(value: impl Fn(f64) -> f64) -> f64 {
        let mut signal = Signal::default();
        (0..60).for_each(|step| signal.take(&[value(f64::from(step)), 0.0], f64::from(step)));
        signal.oscillation
    }

    /// Of an amplitude of one, by the steps of a period: sin(pi/steps)^4, and the median of |cos|.
    #[test]
    fn what_few_steps_resolve_is_seen() {
        assert!((oscillation(|step| 3.0 + step + (PI * step).cos()) - 1.0).abs() < 1e-12);
        let of_period = |steps: f64| oscillation(|step| (TAU * step / steps).cos());
        assert!(of_period(2.1) > 0.7 && of_period(3.0) > 0.25, "{} {}", of_period(2.1), of_period(3.0));
        assert!(of_period(8.0) < 0.022 && of_period(16.0) < 0.002, "{} {}", of_period(8.0), of_period(16.0));
    }

    #[test]
    fn jumps_kinks_and_peaks_are_passed_over() {
        assert_eq!(oscillation(|step| if step < 30.0 { 0.0 } else { 1.0 }), 0.0);
        assert_eq!(oscillation(|step| (step - 30.0).abs()), 0.0);
        assert_eq!(oscillation(|step| if step == 30.0 { 1.0 } else { 0.0 }), 0.0);
    }
}
