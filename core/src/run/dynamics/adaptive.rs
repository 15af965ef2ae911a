//! Steps that adapt to their local error.

use crate::integrate::{Increments, Scheme, Stages, StepEnds};
use crate::model::{Model, SlotKind};
use crate::rotation::Rotation;
use serde::{Deserialize, Serialize};

/// Chooses the length of steps.
///
/// The local error of a step of a second-order method is e = h^2 (beta - 1/6 + (alpha_m -
/// alpha_f)/2)(a1 - a0), translations over the length of the scene and rotations as spins T e.
/// Errors of steps add up, so each step is given its share of the tolerance, by its part of the
/// stage; a step whose largest error is above its share is rejected, and the next is chosen so that
/// it should be a little below.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Control {
    /// The method
    pub(super) scheme: Scheme,
    /// The error allowed to a step over its length
    rate: f64,
    length: f64,
    smallest: f64,
    /// The slots whose accelerations mean something; of others they tell no error.
    judged: Vec<bool>,
}

/// Part of the step that the tolerance would allow.
const SAFETY: f64 = 0.9;
/// A step grows at most by this, and shrinks at most by its reciprocal squared.
const GROWTH: f64 = 2.0;
/// Of steps with a stage in their middle: the factor of h^2 (a0 - 2 am + a1) in the error of a step
/// that knows accelerations at its ends only, and takes a line for the parabola.
const PARABOLA_FACTOR: f64 = 1.0 / 24.0;
/// A step may shrink to this part of the first one.
const SMALLEST: f64 = 1e-8;

impl Control {
    /// Begins with steps of this length; the tolerance is for all errors of the next `span` of
    /// time.
    pub fn new(tolerance: f64, span: f64, length: f64, scheme: Scheme, judged: Vec<bool>) -> Self {
        Self { scheme, rate: tolerance / span, length, smallest: SMALLEST * length.min(span), judged }
    }

    /// The error that a step is allowed.
    pub fn share(&self, length: f64) -> f64 {
        self.rate * length
    }

    /// The end and the length of the next step. What remains to the next stop is not left as a
    /// sliver.
    pub fn propose(&self, time: f64, stop: f64) -> (f64, f64) {
        let rest = stop - time;
        if self.length >= rest * (1.0 - 1e-9) {
            (stop, rest)
        } else if 2.0 * self.length > rest {
            (time + 0.5 * rest, 0.5 * rest)
        } else {
            (time + self.length, self.length)
        }
    }

    /// True if a step cannot become smaller.
    pub fn is_smallest(&self, length: f64) -> bool {
        length <= self.smallest
    }

    /// Newton failed: the next attempt takes a quarter.
    pub fn fail(&mut self, length: f64) -> bool {
        self.length = (0.25 * length).max(self.smallest);
        false
    }

    /// Takes or rejects a step with this error, and chooses the next length.
    pub fn judge(&mut self, length: f64, error: f64) -> bool {
        let allowed = self.share(length);
        let ratio = (error / allowed).max(1e-9);
        // The error of a step falls with the third power of its length, or with the fourth, its
        // share with the first.
        let root = match self.scheme.stages {
            Stages::End => libm::sqrt(ratio),
            Stages::MiddleAndEnd => libm::cbrt(ratio),
        };
        let factor = SAFETY / root;
        let taken = error <= allowed;
        let most = if taken { GROWTH } else { SAFETY };
        self.length = (length * factor.clamp(1.0 / (GROWTH * GROWTH), most)).max(self.smallest);
        taken
    }

    /// The largest local error of a step and its slot, from the accelerations at its ends, and in
    /// its middle if that is a stage.
    pub fn error(&self, model: &Model, increments: Option<&Increments>, ends: StepEnds, length: f64) -> (f64, usize) {
        let StepEnds { from: start, middle, to: end } = ends;
        // Without a factor the difference is no estimate; that of the trapezoidal rule keeps steps
        // sensible.
        let factor = match self.scheme.stages {
            Stages::End => self.scheme.error_factor().unwrap_or(1.0 / 12.0).abs(),
            Stages::MiddleAndEnd => PARABOLA_FACTOR,
        };
        let of_slot = |(slot, kind): (usize, &SlotKind)| {
            if !self.judged[slot] {
                return (0.0, slot);
            }
            let change = match middle {
                None => end.a[slot] - start.a[slot],
                Some(middle) => end.a[slot] - middle.a[slot] * 2.0 + start.a[slot],
            };
            let e = change * (factor * length * length);
            let size = match kind {
                SlotKind::Displacement | SlotKind::Sliding => e.norm() / model.length,
                SlotKind::Rotation if increments.is_none() => (Rotation::new(end.q[slot]).t * e).norm(),
                SlotKind::Rotation | SlotKind::Force | SlotKind::Moment => 0.0,
            };
            (size, slot)
        };
        let turned = increments.into_iter().flat_map(|increments| increments.errors(start, end, length, factor));
        let turned = turned.filter(|&(_, slot)| self.judged[slot]);
        let all = model.kinds.iter().enumerate().map(of_slot).chain(turned);
        all.fold((0.0, 0), |worst, one| if one.0 > worst.0 || one.0.is_nan() { one } else { worst })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn control() -> Control {
        Control::new(1e-3, 1.0, 0.1, Scheme::newmark(0.25, 0.5), Vec::new())
    }

    #[test]
    fn a_step_too_far_is_rejected_and_comes_back_smaller() {
        let mut control = control();
        assert!(!control.judge(0.1, 4e-4));
        assert!((control.length - 0.045).abs() < 1e-12);
        assert!(control.judge(0.045, 0.44e-4));
        assert!(!control.judge(0.045, 0.46e-4));
    }

    #[test]
    fn an_easy_step_lets_the_next_one_grow() {
        let mut control = control();
        assert!(control.judge(0.1, 0.0));
        assert_eq!(control.length, 0.2);
    }

    #[test]
    fn stops_are_hit_without_slivers() {
        let control = control();
        assert_eq!(control.propose(0.0, 1.0), (0.1, 0.1));
        assert_eq!(control.propose(0.95, 1.0).0, 1.0);
        let (next, length) = control.propose(0.0, 0.11);
        assert_eq!((next, length), (0.055, 0.055));
    }
}
