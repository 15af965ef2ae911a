//! Dual numbers: a value with its derivatives over N variables, through the same kernels that a run uses.

// The product and quotient rules add and subtract.
#![allow(clippy::suspicious_arithmetic_impl)]

use beamsim_core::scalar::Real;
use beamsim_core::tensor::{Mat3, Vec3};
use std::array::from_fn;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A number that knows its partial derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize> {
    /// The number
    pub value: f64,
    /// Its derivatives
    pub partials: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// Variable number `index`.
    pub fn variable(value: f64, index: usize) -> Self {
        Self { value, partials: from_fn(|k| if k == index { 1.0 } else { 0.0 }) }
    }
}

// The operations are kept out of line: the kernels are inlined whole, and with 24 derivatives they would grow huge.

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(never)]
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, partials: from_fn(|k| self.partials[k] + other.partials[k]) }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(never)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, partials: from_fn(|k| self.partials[k] - other.partials[k]) }
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            partials: from_fn(|k| self.partials[k] * other.value + self.value * other.partials[k]),
        }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(never)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, partials: from_fn(|k| (self.partials[k] - value * other.partials[k]) / other.value) }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(never)]
    fn neg(self) -> Self {
        Self { value: -self.value, partials: from_fn(|k| -self.partials[k]) }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(never)]
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, partials: from_fn(|k| self.partials[k] * factor) }
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const N: usize> Real for Dual<N> {
    fn constant(value: f64) -> Self {
        Self { value, partials: [0.0; N] }
    }

    #[inline(never)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        Self { value, partials: from_fn(|k| self.partials[k] / (2.0 * value)) }
    }

    #[inline(never)]
    fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        Self {
            value: libm::atan2(self.value, x.value),
            partials: from_fn(|k| (x.value * self.partials[k] - self.value * x.partials[k]) / square),
        }
    }

    fn largest(self) -> f64 {
        self.value
    }

    fn above(self, limit: f64, then: Self, otherwise: Self) -> Self {
        if self.value > limit { then } else { otherwise }
    }
}

/// The components of `v` as variables number `first`, `first + 1`, `first + 2`.
pub fn variables<const N: usize>(v: Vec3, first: usize) -> Vec3<Dual<N>> {
    Vec3(from_fn(|i| Dual::variable(v.0[i], first + i)))
}

/// v + t w around t = 0.
pub fn along(v: Vec3, w: Vec3) -> Vec3<Dual<1>> {
    Vec3(from_fn(|i| Dual { value: v.0[i], partials: [w.0[i]] }))
}

/// The values without their derivatives.
pub fn values<const N: usize>(v: Vec3<Dual<N>>) -> Vec3 {
    Vec3(v.0.map(|c| c.value))
}

/// The derivatives over the variables `first`, `first + 1`, `first + 2`: one row a component, one column a variable.
pub fn jacobian<const N: usize>(v: Vec3<Dual<N>>, first: usize) -> Mat3 {
    Mat3(v.0.map(|c| from_fn(|k| c.partials[first + k])))
}

/// The derivative of a vector over t.
pub fn vector_rate(v: Vec3<Dual<1>>) -> Vec3 {
    Vec3(v.0.map(|c| c.partials[0]))
}

/// The derivative of a tensor over t.
pub fn tensor_rate(m: Mat3<Dual<1>>) -> Mat3 {
    Mat3(m.0.map(|row| row.map(|c| c.partials[0])))
}

/// Runs a test on a thread with room for many large dual numbers: without optimisation no two of them share a place on
/// the stack.
pub fn with_room(test: impl FnOnce() + Send + 'static) {
    let thread = std::thread::Builder::new().stack_size(1 << 28).spawn(test).expect("a thread can be started");
    if let Err(panic) = thread.join() {
        std::panic::resume_unwind(panic);
    }
}

#[test]
fn dual_numbers_differentiate() {
    let (x, y): (Dual<2>, Dual<2>) = (Dual::variable(1.7, 0), Dual::variable(-0.6, 1));
    let mut f = (x * y - x / y) * x.sqrt() * 3.0;
    f += -x;
    f -= y;
    let (a, b, root) = (1.7_f64, -0.6_f64, 1.7_f64.sqrt());
    let exact = [4.5 * root * (b - 1.0 / b) - 1.0, 3.0 * a * root * (1.0 + 1.0 / (b * b)) - 1.0];
    for k in 0..2 {
        let error = (f.partials[k] - exact[k]).abs();
        assert!(
            error < 1e-13,
            "derivative {k} at ({a}, {b}): {} instead of {}, error {error:e}",
            f.partials[k],
            exact[k]
        );
    }
}
