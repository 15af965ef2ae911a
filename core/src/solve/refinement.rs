//! Corrections of a solution whose residual is round-off.

use crate::model::Model;
use crate::scalar::CompressedField;
use crate::tensor::Vec3;

/// Size of a correction, relative to that of the unknowns, that ends an iteration with a residual
/// at round-off.
const FINAL_CORRECTION_RATIO: f64 = 1e-8;

/// Observes successive corrections that refine a solution whose residual is round-off.
#[derive(Default)]
pub(super) struct Refinement {
    before: CompressedField<3>,
    /// Size of the last correction, see [`super::convergence::size`]
    size: f64,
    /// Size of the last correction relative to that of the unknowns; not finite after a change of
    /// chart
    last: f64,
    /// Ratio of the sizes of the last two corrections
    ratio: f64,
    /// True if the last two corrections have nearly the same direction
    aligned: bool,
}

impl Refinement {
    /// Observes a correction `dq` of this size, for unknowns of size `unknowns`.
    pub fn look(&mut self, model: &Model, dq: &[Vec3], size: f64, unknowns: f64) -> &Self {
        let now = |slot: usize| dq[slot];
        let before = |slot: usize| Vec3(self.before.get(slot));
        let count = self.before.len();
        let [along, own, others] = [
            model.inner_product(count, now, before),
            model.inner_product(count, now, now),
            model.inner_product(count, before, before),
        ];
        let cosine = along / (own * others).sqrt();
        self.aligned = cosine > 0.5;
        self.ratio = if self.before.is_empty() { 0.0 } else { size / self.size };
        self.size = size;
        self.last = size / unknowns;
        self.before.take(if self.last.is_finite() { dq.len() } else { 0 }, |slot| dq[slot].0);
        self
    }

    /// True if corrections are small enough, or do not decrease any more.
    pub fn is_done(&self) -> bool {
        self.last <= FINAL_CORRECTION_RATIO || self.stalls()
    }

    /// True if corrections are not small enough and do not decrease any more.
    pub fn stalls(&self) -> bool {
        let most = if self.aligned { 0.9 } else { 0.5 };
        self.last > FINAL_CORRECTION_RATIO && self.last.is_finite() && self.ratio > most
    }

    /// Sum of the remaining corrections relative to the unknowns: a geometric series with factor
    /// `ratio` if they are aligned.
    pub fn uncertainty(&self) -> f64 {
        let series = if self.aligned { 1.0 / (1.0 - self.ratio.min(0.99)) } else { 1.0 };
        if self.last.is_finite() { (self.last * series).min(1.0) } else { 0.0 }
    }
}
