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

use super::{Dynamics, TOLERATED_STRAIN};
use crate::effect::RoundOff;
use crate::probe::{Probe, Quantity};
use crate::run::stage_run::StageRun;
use crate::warning::WarningKind;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Weights of the fourth difference.
const DIFFERENCE: [f64; 5] = [0.0625, -0.25, 0.375, -0.25, 0.0625];

/// Differences whose median is taken.
const DIFFERENCES: usize = 11;

/// An oscillation of more than this part of the largest value of a column is told.
const TOLD: f64 = 0.05;

/// Columns below this part of the largest one of their quantity are compared with that part.
const SMALL: f64 = 1e-3;

/// Steps that differ by less than this part are equal.
const EQUAL: f64 = 1e-6;

/// Follows the columns of a run that depend on accelerations, over a stage.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub(in crate::run) struct Ringing {
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

/// Kinds of quantities that depend on accelerations.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Acceleration,
    AngularAcceleration,
    Force,
    Moment,
    Strain,
    Curvature,
}

impl Kind {
    fn of(quantity: Quantity) -> Option<Self> {
        Some(match quantity {
            Quantity::Acceleration => Self::Acceleration,
            Quantity::AngularAcceleration => Self::AngularAcceleration,
            Quantity::ReactionForce | Quantity::SectionForce | Quantity::ContactForce => Self::Force,
            Quantity::ReactionMoment | Quantity::SectionMoment | Quantity::ContactMoment => Self::Moment,
            Quantity::Strain => Self::Strain,
            Quantity::Curvature => Self::Curvature,
            // Looking for the largest stress of a section takes long; it goes with the resultants.
            Quantity::Stress
            | Quantity::FailureIndex
            | Quantity::Displacement
            | Quantity::Position
            | Quantity::Rotation
            | Quantity::Orientation
            | Quantity::SectionAxis
            | Quantity::Velocity
            | Quantity::AngularVelocity
            | Quantity::Energy
            | Quantity::Momentum
            | Quantity::AngularMomentum
            | Quantity::CentreOfMass
            | Quantity::ContactGap
            | Quantity::ContactForcePerLength
            | Quantity::ContactLength
            | Quantity::ContactPoints
            | Quantity::AngularFrequency
            | Quantity::GrowthRate
            | Quantity::Stage
            | Quantity::Time
            | Quantity::LoadFactor => return None,
        })
    }
}

/// The columns of a probe that depend on accelerations: their kind, the first of them, and the first behind them.
fn vectors(probe: &Probe) -> impl Iterator<Item = (Kind, [usize; 2])> + Clone {
    let parts = probe.group.parts.iter().scan(0, |end, part| {
        let start = *end;
        *end += part.suffixes.len().max(1);
        Some((part.quantity, [start, *end]))
    });
    parts.filter_map(|(quantity, ends)| Some((Kind::of(quantity)?, ends)))
}

impl Ringing {
    /// Takes the columns after a step.
    pub(super) fn take(&mut self, stage: &StageRun, length: f64) {
        let mut watched = stage.plan.columns.iter().filter(|probe| vectors(probe).next().is_some()).peekable();
        if watched.peek().is_none() {
            return;
        }
        if (length - self.length).abs() > EQUAL * length {
            self.signals.iter_mut().for_each(Signal::forget);
        }
        self.length = length;
        let snapshot = stage.snapshot();
        let mut row = Vec::new();
        let mut number = 0;
        for probe in watched {
            row.clear();
            probe.read(&snapshot, &mut row);
            for (_, [start, end]) in vectors(probe) {
                if number == self.signals.len() {
                    self.signals.push(Signal::default());
                }
                self.signals[number].take(&row[start..end], snapshot.state.time);
                number += 1;
            }
        }
    }
}

/// The worst oscillation of the columns of a stage.
struct Worst<'a> {
    names: &'a [String],
    /// Over the largest value
    share: f64,
    time: f64,
}

impl Dynamics<'_, '_> {
    /// Forces and accelerations that steps do not resolve.
    pub(super) fn warn_of_ringing(&mut self) {
        let Some(Worst { names, share, time }) = self.worst_oscillation().filter(|worst| worst.share > TOLD) else {
            return;
        };
        let columns = match names {
            [only] => format!("`{only}`"),
            [first, .., last] => format!("`{first}` … `{last}`"),
            [] => return,
        };
        let advice = if self.settings.scheme.dissipates() {
            "a smaller `step` resolves them, more dissipation damps them"
        } else {
            "`scheme = \"hht\"` damps them, a smaller `step` resolves them"
        };
        let message = format!(
            "stage {}: forces and accelerations oscillate faster than the time steps resolve, those of {columns} by {} of \
             their largest value (about time {time:.6}); displacements may be right ({advice})",
            self.stage.number + 1,
            super::judgement::percent(share)
        );
        self.stage.warn(WarningKind::Ringing, message);
    }

    fn worst_oscillation(&self) -> Option<Worst<'_>> {
        let watched = self.stage.plan.columns.iter();
        let columns = watched.flat_map(|probe| vectors(probe).map(move |(kind, ends)| (probe, kind, ends)));
        let signals = || columns.clone().zip(&self.ringing.signals);
        let largest_of = |kind: Kind| {
            let same = signals().filter(|((_, other, _), _)| *other == kind);
            same.map(|(_, signal)| signal.largest).fold(0.0, f64::max)
        };
        let shares = signals().map(|((probe, kind, [start, end]), signal)| {
            let scale = signal.largest.max(SMALL * largest_of(kind)).max(self.tolerated(kind));
            let share = if scale > 0.0 { signal.oscillation / scale } else { 0.0 };
            Worst { names: &probe.names[start..end], share, time: signal.time }
        });
        shares.max_by(|a, b| a.share.total_cmp(&b.share))
    }

    /// What Newton's method may leave in columns that are zero.
    fn tolerated(&self, kind: Kind) -> f64 {
        let StageRun { assembly, model, state, .. } = &*self.stage;
        let step = self.ringing.length;
        // The forces and moments of a strain of one
        let RoundOff { force, moment } = assembly.round_off(state);
        let [force, moment] = [force, moment].map(|round_off| round_off / f64::EPSILON);
        TOLERATED_STRAIN
            * match kind {
                Kind::Acceleration => 4.0 * model.length / (step * step),
                Kind::AngularAcceleration => 4.0 / (step * step),
                Kind::Force => force,
                Kind::Moment => moment,
                Kind::Strain => 1.0,
                Kind::Curvature => 1.0 / model.length,
            }
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
