//! Corrections of a solution whose residual is round-off.

use crate::model::Model;
use crate::scalar::CompressedField;
use crate::tensor::Vec3;

/// Where only round-off is left, a correction smaller than this part of the unknowns ends the
/// iteration.
const FINE: f64 = 1e-8;

/// Follows corrections that refine a solution whose residual is round-off.
#[derive(Default)]
pub(super) struct Refinement {
    before: CompressedField<3>,
    /// Its size
    size: f64,
    /// The last correction over the unknowns; after a change of chart there is none.
    last: f64,
    /// The last correction over the one before
    ratio: f64,
    /// True if both go the same way
    aligned: bool,
}

impl Refinement {
    /// Looks at a correction of this size; the unknowns have a size, too.
    pub fn look(&mut self, model: &Model, dq: &[Vec3], size: f64, unknowns: f64) -> &Self {
        let (now, before) = (|slot: usize| dq[slot], |slot: usize| Vec3(self.before.get(slot)));
        let count = self.before.len();
        let [along, own, others] = [
            model.inner_product(count, now, before),
            model.inner_product(count, now, now),
            model.inner_product(count, before, before),
        ];
        let cosine = along / (own * others).sqrt();
        self.aligned = cosine > 0.5;
        self.ratio = if self.before.is_empty() { 0.0 } else { size / self.size };
        (self.size, self.last) = (size, size / unknowns);
        self.before.take(if self.last.is_finite() { dq.len() } else { 0 }, |slot| dq[slot].0);
        self
    }

    /// Small enough, or not becoming smaller any more.
    pub fn is_done(&self) -> bool {
        self.last <= FINE || self.stalls()
    }

    /// Still too large, and not becoming smaller any more.
    pub fn stalls(&self) -> bool {
        let most = if self.aligned { 0.9 } else { 0.5 };
        self.last > FINE && self.last.is_finite() && self.ratio > most
    }

    /// The sum of the corrections that are still to come: of those that go one way, each `ratio`
    /// times the one before.
    pub fn uncertainty(&self) -> f64 {
        let series = if self.aligned { 1.0 / (1.0 - self.ratio.min(0.99)) } else { 1.0 };
        if self.last.is_finite() { (self.last * series).min(1.0) } else { 0.0 }
    }
}
