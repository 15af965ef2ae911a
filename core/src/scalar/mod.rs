//! Scalars of the kernels: `f64` or lanes of several elements in a run, dual numbers in the tests
//! that compare every tangent with automatic differentiation.

mod compressed_field;
mod jet;
mod lanes;
mod rate;

pub use compressed_field::CompressedField;
pub use jet::Jet;
pub use lanes::{Instructions, LANES, Lanes, Pack};
pub(crate) use lanes::{each_lane, pack};
pub use rate::Rate;

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A scalar of the kernels. It has only operations that IEEE 754 rounds exactly, so that results
/// do not depend on the machine: no fused multiply-add, no function of the platform's `libm`.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + Mul<f64, Output = Self>
{
    /// The constant `value`.
    fn constant(value: f64) -> Self;

    /// The square root.
    fn sqrt(self) -> Self;

    /// The angle in (-pi, pi], radians, whose tangent is `self` / `x`, in the quadrant of the signs
    /// of both.
    fn atan2(self, x: Self) -> Self;

    /// The value itself, or the largest one of lanes. It may decide if an algorithm is needed, but
    /// must not enter a result.
    fn largest(self) -> f64;

    /// `then` if the value is above `limit`, otherwise `otherwise`; lane by lane.
    fn above(self, limit: f64, then: Self, otherwise: Self) -> Self;

    /// Runs `work`. Scalars of single elements compile it once, apart from its callers, which keeps
    /// long formulas from being repeated in them; lanes keep it in the caller, where the wide
    /// registers are.
    #[inline(always)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        work()
    }

    /// Zero.
    #[inline(always)]
    fn zero() -> Self {
        Self::constant(0.0)
    }

    /// One.
    #[inline(always)]
    fn one() -> Self {
        Self::constant(1.0)
    }
}

impl Real for f64 {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        libm::atan2(self, x)
    }

    #[inline(always)]
    fn largest(self) -> f64 {
        self
    }

    #[inline(always)]
    fn above(self, limit: f64, then: Self, otherwise: Self) -> Self {
        if self > limit { then } else { otherwise }
    }

    #[inline(never)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        work()
    }
}
