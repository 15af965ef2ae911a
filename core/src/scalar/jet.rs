//! A number with its first two derivatives over time: a scalar that carries rates through any
//! kernel.

use super::Real;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A function of time near an instant, to second order: results computed from jets have their rates
/// with them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// The value
    pub(crate) value: f64,
    /// The first derivative over time
    pub(crate) rate: f64,
    /// The second derivative over time
    pub(crate) rate2: f64,
}

impl Jet {
    /// The composition with a function whose value is `f`, first derivative `slope` and second
    /// derivative `bend` at this value.
    fn through(self, f: f64, slope: f64, bend: f64) -> Self {
        Self { value: f, rate: slope * self.rate, rate2: slope * self.rate2 + bend * self.rate * self.rate }
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, rate: self.rate + other.rate, rate2: self.rate2 + other.rate2 }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, rate: -self.rate, rate2: -self.rate2 }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            rate: self.rate * other.value + self.value * other.rate,
            rate2: self.rate2 * other.value + 2.0 * self.rate * other.rate + self.value * other.rate2,
        }
    }
}

impl Div for Jet {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let inverse = 1.0 / other.value;
        self * other.through(inverse, -inverse * inverse, 2.0 * inverse * inverse * inverse)
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, rate: self.rate * factor, rate2: self.rate2 * factor }
    }
}

impl AddAssign for Jet {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Jet {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Real for Jet {
    fn constant(value: f64) -> Self {
        Self { value, rate: 0.0, rate2: 0.0 }
    }

    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.through(root, 0.5 / root, -0.25 / (root * self.value))
    }

    fn atan2(self, x: Self) -> Self {
        // d atan2(y, x) = (x dy - y dx) / (x^2 + y^2)
        let y = self;
        let square = self.value * self.value + x.value * x.value;
        let turn = x.value * y.rate - y.value * x.rate;
        let turn_rate = x.value * y.rate2 - y.value * x.rate2;
        let growth = 2.0 * (x.value * x.rate + y.value * y.rate);
        Self {
            value: libm::atan2(y.value, x.value),
            rate: turn / square,
            rate2: turn_rate / square - turn * growth / (square * square),
        }
    }

    fn largest(self) -> f64 {
        self.value
    }

    fn above(self, limit: f64, then: Self, otherwise: Self) -> Self {
        if self.value > limit { then } else { otherwise }
    }

    #[inline(never)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        work()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jets_follow_functions_of_time() {
        // x = 1 + 2 t + 3 t^2, y = 2 - t + t^2/2, at t = 0.
        let x = Jet { value: 1.0, rate: 2.0, rate2: 6.0 };
        let y = Jet { value: 2.0, rate: -1.0, rate2: 1.0 };
        let f = |x: f64, y: f64| ((x * y - x / y) * x.sqrt() + libm::atan2(y, x)) * 3.0;
        let jet = ((x * y - x / y) * x.sqrt() + y.atan2(x)) * 3.0;
        let at = |t: f64| f(1.0 + 2.0 * t + 3.0 * t * t, 2.0 - t + 0.5 * t * t);
        let h = 1e-4;
        assert!((jet.value - at(0.0)).abs() < 1e-14);
        assert!((jet.rate - (at(h) - at(-h)) / (2.0 * h)).abs() < 1e-6);
        assert!((jet.rate2 - (at(h) - 2.0 * at(0.0) + at(-h)) / (h * h)).abs() < 1e-5);
    }
}
