//! Dual numbers and random data for the tests of contact kernels.

use crate::kernel::element::ElementSystem;
use crate::rotation::Rotation;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};
use std::array::from_fn;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A value with its derivatives over N variables.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize> {
    pub(crate) value: f64,
    pub(crate) partials: [f64; N],
}

impl<const N: usize> Dual<N> {
    pub fn variable(value: f64, index: usize) -> Self {
        Self { value, partials: from_fn(|k| if k == index { 1.0 } else { 0.0 }) }
    }

    fn chain(self, value: f64, slope: f64) -> Self {
        Self { value, partials: self.partials.map(|d| slope * d) }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self { value: self.value + b.value, partials: from_fn(|k| self.partials[k] + b.partials[k]) }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn mul(self, b: Self) -> Self {
        let partial = |k: usize| self.partials[k] * b.value + self.value * b.partials[k];
        Self { value: self.value * b.value, partials: from_fn(partial) }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        self * b.chain(1.0 / b.value, -1.0 / (b.value * b.value))
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.chain(self.value * factor, factor)
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    fn sub_assign(&mut self, b: Self) {
        *self = *self - b;
    }
}

impl<const N: usize> Real for Dual<N> {
    fn constant(value: f64) -> Self {
        Self { value, partials: [0.0; N] }
    }

    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }

    fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        let partial = |k: usize| (x.value * self.partials[k] - self.value * x.partials[k]) / square;
        Self { value: libm::atan2(self.value, x.value), partials: from_fn(partial) }
    }

    fn largest(self) -> f64 {
        self.value
    }

    fn above(self, limit: f64, then: Self, otherwise: Self) -> Self {
        if self.value > limit { then } else { otherwise }
    }
}

/// A vector of variables, the first of them number `first`.
pub fn variables<const N: usize>(v: Vec3, first: usize) -> Vec3<Dual<N>> {
    Vec3(from_fn(|i| Dual::variable(v.0[i], first + i)))
}

/// A vector of unknowns, the first of them number `first`, that changes along each of N directions
/// (all unknowns of a scene) times `weight`.
pub fn along<const N: usize>(v: Vec3, first: usize, directions: &[Vec<f64>; N], weight: f64) -> Vec3<Dual<N>> {
    Vec3(from_fn(|i| Dual { value: v.0[i], partials: from_fn(|k| directions[k][first + i] * weight) }))
}

/// The largest difference between derivatives of forces along directions and a tangent, and between
/// their values: relative to the largest entry of the tangent, or to one.
pub fn tangent_error<const N: usize>(
    system: &ElementSystem,
    exact: &ElementSystem<Dual<N>>,
    directions: &[Vec<f64>; N],
) -> f64 {
    let count = 3 * system.blocks();
    let tangent = system.tangent();
    let size = tangent.iter().fold(1.0, |largest: f64, entry| largest.max(entry.abs()));
    let mut worst = 0.0f64;
    for row in 0..count {
        let dual = exact.force()[row];
        for k in 0..N {
            let slope: f64 = (0..count).map(|j| tangent[row * count + j] * directions[k][j]).sum();
            worst = worst.max((slope - dual.partials[k]).abs());
        }
        worst = worst.max((dual.value - system.force()[row]).abs());
    }
    worst / size
}

/// The derivatives of a vector over three variables, the first of them number `first`.
pub fn jacobian<const N: usize>(v: Vec3<Dual<N>>, first: usize) -> Mat3 {
    Mat3(from_fn(|i| from_fn(|j| v.0[i].partials[first + j])))
}

/// Random numbers of a fixed sequence (xorshift of 64 bits).
pub struct Random(pub u64);

impl Random {
    /// A number in (low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A vector with components in (-size, size).
    pub fn vector(&mut self, size: f64) -> Vec3 {
        Vec3(from_fn(|_| self.between(-size, size)))
    }

    /// A unit vector.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let vector = self.vector(1.0);
            let length = vector.norm();
            if (0.1..1.0).contains(&length) {
                return vector * (1.0 / length);
            }
        }
    }

    /// Directions in a space of unknowns.
    pub fn directions<const N: usize>(&mut self, unknowns: usize) -> [Vec<f64>; N] {
        from_fn(|_| (0..unknowns).map(|_| self.between(-1.0, 1.0)).collect())
    }

    /// A rotation by up to `angle` radians.
    pub fn rotation(&mut self, angle: f64) -> Rotation {
        let angle = self.between(-angle, angle);
        Rotation::new(self.direction() * angle)
    }
}

/// Largest errors of forces and tangents over many scenes.
#[derive(Debug, Default)]
pub struct Errors {
    pub(super) count: usize,
    pub(super) stick: usize,
    pub(super) slip: usize,
    pub(super) tangent: f64,
    pub(super) force_sum: f64,
    pub(super) moment_sum: f64,
    pub(super) asymmetry: f64,
    pub(super) objectivity: f64,
}

/// The largest entry of a tangent, at least one.
pub fn size(system: &ElementSystem) -> f64 {
    system.tangent().iter().fold(1.0, |largest: f64, entry| largest.max(entry.abs()))
}
