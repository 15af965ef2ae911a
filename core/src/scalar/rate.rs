//! A number with its rate: a scalar that carries first derivatives over time through any kernel.

use super::Real;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A function of time near an instant, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate<T = f64> {
    /// The value
    pub(crate) value: T,
    /// The derivative over time
    pub(crate) rate: T,
}

impl<T: Real> Add for Rate<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, rate: self.rate + other.rate }
    }
}

impl<T: Real> Sub for Rate<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, rate: self.rate - other.rate }
    }
}

impl<T: Real> Neg for Rate<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, rate: -self.rate }
    }
}

impl<T: Real> Mul for Rate<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { value: self.value * other.value, rate: self.rate * other.value + self.value * other.rate }
    }
}

impl<T: Real> Div for Rate<T> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = T::one() / other.value;
        let value = self.value * inverse;
        Self { value, rate: (self.rate - value * other.rate) * inverse }
    }
}

impl<T: Real> Mul<f64> for Rate<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, rate: self.rate * factor }
    }
}

impl<T: Real> AddAssign for Rate<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Real> SubAssign for Rate<T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<T: Real> Real for Rate<T> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self { value: T::constant(value), rate: T::zero() }
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
        Self { value: self.value.atan2(x.value), rate: turn / square }
    }

    #[inline(always)]
    fn largest(self) -> f64 {
        self.value.largest()
    }

    #[inline(always)]
    fn above(self, limit: f64, then: Self, otherwise: Self) -> Self {
        let choose = |then: T, otherwise: T| self.value.above(limit, then, otherwise);
        Self { value: choose(then.value, otherwise.value), rate: choose(then.rate, otherwise.rate) }
    }

    #[inline(always)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        T::apart(work)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Lanes;
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

    #[test]
    fn lanes_have_their_own_rates() {
        let x = Rate { value: Lanes([1.0, 2.0, 3.0, 4.0]), rate: Lanes([1.0, 0.0, -1.0, 2.0]) };
        let square = x * x / Rate::constant(2.0);
        assert_eq!(square.value.0, [0.5, 2.0, 4.5, 8.0]);
        assert_eq!(square.rate.0, [1.0, 0.0, -3.0, 8.0]);
    }
}
