//! A number with its rate: a scalar that carries first derivatives over time through any kernel.

use super::Real;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A function of time near an instant, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// The value
    pub(crate) value: f64,
    /// The derivative over time
    pub(crate) rate: f64,
}

impl Add for Rate {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, rate: self.rate + other.rate }
    }
}

impl Sub for Rate {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, rate: self.rate - other.rate }
    }
}

impl Neg for Rate {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, rate: -self.rate }
    }
}

impl Mul for Rate {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { value: self.value * other.value, rate: self.rate * other.value + self.value * other.rate }
    }
}

impl Div for Rate {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = 1.0 / other.value;
        let value = self.value * inverse;
        Self { value, rate: (self.rate - value * other.rate) * inverse }
    }
}

impl Mul<f64> for Rate {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, rate: self.rate * factor }
    }
}

impl AddAssign for Rate {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Rate {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Real for Rate {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self { value, rate: 0.0 }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        Self { value: root, rate: self.rate * 0.5 / root }
    }

    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        // d atan2(y, x) = (x dy - y dx) / (x^2 + y^2)
        let square = self.value * self.value + x.value * x.value;
        let turn = x.value * self.rate - self.value * x.rate;
        Self { value: Real::atan2(self.value, x.value), rate: turn / square }
    }

    #[inline(always)]
    fn largest(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn above(self, limit: f64, then: Self, otherwise: Self) -> Self {
        if self.value > limit { then } else { otherwise }
    }

    #[inline(always)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        f64::apart(work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_follow_functions_of_time() {
        let f = |x: f64, y: f64| ((x * y - x / y) * x.sqrt() + libm::atan2(y, x)) * 3.0;
        let at = |t: f64| f(1.0 + 2.0 * t, 2.0 - t);
        let h = 1e-6;
        let (value, rate) = (at(0.0), (at(h) - at(-h)) / (2.0 * h));
        let of = |x: Rate, y: Rate| ((x * y - x / y) * x.sqrt() + y.atan2(x)) * 3.0;
        let found = of(Rate { value: 1.0, rate: 2.0 }, Rate { value: 2.0, rate: -1.0 });
        assert!((found.value - value).abs() < 1e-14 && (found.rate - rate).abs() < 1e-8, "{found:?} {value} {rate}");
        let above = found.above(0.0, Rate::constant(1.0), Rate::zero());
        assert_eq!((above.value, above.rate), (1.0, 0.0));
    }
}
