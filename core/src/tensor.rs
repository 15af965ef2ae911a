//! Vectors and second-order tensors of three-dimensional space over any [`Real`].
//!
//! Every function is `#[inline(always)]`, so that a kernel compiled for a wider instruction set
//! keeps all of its operations in that instruction set.

use crate::scalar::{LANES, Lanes, Pack, Rate, Real, pack};
use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// The array [f(0), f(1), f(2)], written out: no closure that the compiler may leave outside of a
/// kernel, no bounds checks.
macro_rules! three {
    (|$i:ident| $f:expr) => {
        [
            {
                let $i = 0;
                $f
            },
            {
                let $i = 1;
                $f
            },
            {
                let $i = 2;
                $f
            },
        ]
    };
}

/// The largest magnitude among numbers; NaN if one is (`f64::max` would pass over it).
fn largest(components: &[f64]) -> f64 {
    components.iter().fold(0.0, |largest, c| if c.abs() > largest || c.is_nan() { c.abs() } else { largest })
}

/// `count` vectors of zeros, in zeroed memory of the operating system: pages that nobody writes to
/// take no memory. (The compiler removes the loop over the vectors; only memory depends on that,
/// and it was measured.)
pub fn zeros(count: usize) -> Vec<Vec3> {
    vec![[0.0; 3]; count].into_iter().map(Vec3).collect()
}

/// A copy of vectors; if all of them are zero, it takes no memory until it is written to.
pub fn copied(vectors: &[Vec3]) -> Vec<Vec3> {
    if vectors.iter().all(|vector| *vector == Vec3::ZERO) { zeros(vectors.len()) } else { vectors.to_vec() }
}

/// A vector of three components.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Vec3<T = f64>(pub [T; 3]);

/// A tensor of three by three components, stored by rows.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Mat3<T = f64>(pub [[T; 3]; 3]);

impl Pack for Vec3 {
    type Packed = Vec3<Lanes>;

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Vec3<Lanes> {
        Vec3(pack!(of.0))
    }
}

impl Pack for Mat3 {
    type Packed = Mat3<Lanes>;

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Mat3<Lanes> {
        Mat3(pack!(of.0))
    }
}

impl Default for Vec3 {
    fn default() -> Self {
        Self::ZERO
    }
}

impl Default for Mat3 {
    fn default() -> Self {
        Self::ZERO
    }
}

impl Vec3<f64> {
    /// The vector with three zeros.
    pub const ZERO: Self = Self([0.0; 3]);
    /// The unit vectors of the global frame.
    pub const UNIT: [Self; 3] = [Self([1.0, 0.0, 0.0]), Self([0.0, 1.0, 0.0]), Self([0.0, 0.0, 1.0])];

    /// The vector of length one in this direction; `None` for a vector without one.
    pub fn normalized(self) -> Option<Self> {
        // Beyond these lengths squares of components overflow or vanish.
        const SHORTEST: f64 = 1e-150;
        const LONGEST: f64 = 1e150;
        let of_length = |vector: Self, length: f64| vector * (1.0 / length);
        let length = self.norm();
        if (SHORTEST..=LONGEST).contains(&length) {
            return Some(of_length(self, length));
        }
        let largest = self.max_abs();
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        // Dividing twice: the inverse of a very small number is infinite.
        let scaled = Self(self.0.map(|component| component / largest));
        Some(of_length(scaled, scaled.norm()))
    }

    /// The largest magnitude among the components; NaN if one is.
    pub fn max_abs(self) -> f64 {
        largest(&self.0)
    }

    /// The norm |a|, without underflow or overflow of squares.
    pub fn size(self) -> f64 {
        let square = self.squared();
        if (1e-280..=1e280).contains(&square) {
            return square.sqrt();
        }
        let scale = self.max_abs();
        match scale {
            // The reciprocal of the scale neither underflows nor overflows.
            1e-300..=1e300 => self.scale(1.0 / scale).norm() * scale,
            _ => scale,
        }
    }

    /// True if every component is finite.
    pub fn is_finite(self) -> bool {
        self.0.iter().all(|c| c.is_finite())
    }
}

impl Vec3<Rate> {
    /// A vector with its rate.
    pub fn with_rate(value: Vec3, rate: Vec3) -> Self {
        Self(std::array::from_fn(|k| Rate { value: value.0[k], rate: rate.0[k] }))
    }
}

impl<T: Real> Vec3<T> {
    /// The vector with three zeros.
    #[inline(always)]
    pub fn zero() -> Self {
        Self([T::zero(); 3])
    }

    /// A constant vector, lifted to this scalar.
    #[inline(always)]
    pub fn constant(v: Vec3<f64>) -> Self {
        Self(three!(|i| T::constant(v.0[i])))
    }

    /// a . b
    #[inline(always)]
    pub fn dot(self, other: Self) -> T {
        self.0[0] * other.0[0] + self.0[1] * other.0[1] + self.0[2] * other.0[2]
    }

    /// a x b
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        let [a, b, c] = self.0;
        let [x, y, z] = other.0;
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// a . a
    #[inline(always)]
    pub fn squared(self) -> T {
        self.dot(self)
    }

    /// |a|
    #[inline(always)]
    pub fn norm(self) -> T {
        self.squared().sqrt()
    }

    /// a~, the tensor with a~ b = a x b.
    #[inline(always)]
    pub fn skew(self) -> Mat3<T> {
        let [a, b, c] = self.0;
        let o = T::zero();
        Mat3([[o, -c, b], [c, o, -a], [-b, a, o]])
    }

    /// a (x) b, the outer product.
    #[inline(always)]
    pub fn outer(self, other: Self) -> Mat3<T> {
        Mat3(three!(|i| three!(|j| self.0[i] * other.0[j])))
    }

    /// The vector times a constant.
    #[inline(always)]
    pub fn scale(self, factor: f64) -> Self {
        Self(three!(|i| self.0[i] * factor))
    }
}

impl Mat3<f64> {
    /// The zero tensor.
    pub const ZERO: Self = Self([[0.0; 3]; 3]);
    /// The identity.
    pub const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);

    /// True if every component is finite.
    pub fn is_finite(self) -> bool {
        self.0.iter().flatten().all(|c| c.is_finite())
    }

    /// The largest magnitude among the components; NaN if one is.
    pub fn max_abs(self) -> f64 {
        largest(self.0.as_flattened())
    }
}

impl<T: Real> Mat3<T> {
    /// The zero tensor.
    #[inline(always)]
    pub fn zero() -> Self {
        Self([[T::zero(); 3]; 3])
    }

    /// The identity.
    #[inline(always)]
    pub fn identity() -> Self {
        Self::diagonal([T::one(); 3])
    }

    /// A constant tensor, lifted to this scalar.
    #[inline(always)]
    pub fn constant(m: Mat3<f64>) -> Self {
        Self(three!(|i| three!(|j| T::constant(m.0[i][j]))))
    }

    /// The tensor with these diagonal entries.
    #[inline(always)]
    pub fn diagonal(d: [T; 3]) -> Self {
        let o = T::zero();
        Self([[d[0], o, o], [o, d[1], o], [o, o, d[2]]])
    }

    /// The tensor with these columns.
    #[inline(always)]
    pub fn from_columns(a: Vec3<T>, b: Vec3<T>, c: Vec3<T>) -> Self {
        Self(three!(|i| [a.0[i], b.0[i], c.0[i]]))
    }

    /// Column `j`.
    #[inline(always)]
    pub fn column(self, j: usize) -> Vec3<T> {
        Vec3([self.0[0][j], self.0[1][j], self.0[2][j]])
    }

    /// The transpose.
    #[inline(always)]
    pub fn transpose(self) -> Self {
        Self(three!(|i| [self.0[0][i], self.0[1][i], self.0[2][i]]))
    }

    /// A^T b, without forming the transpose.
    #[inline(always)]
    pub fn transpose_mul(self, v: Vec3<T>) -> Vec3<T> {
        let m = self.0;
        Vec3(three!(|i| m[0][i] * v.0[0] + m[1][i] * v.0[1] + m[2][i] * v.0[2]))
    }

    /// A^T B, without forming the transpose.
    #[inline(always)]
    pub fn transpose_matmul(self, other: Self) -> Self {
        let a = self.0;
        let b = other.0;
        Self(three!(|i| three!(|j| a[0][i] * b[0][j] + a[1][i] * b[1][j] + a[2][i] * b[2][j])))
    }

    /// a~ B, the product with a skew tensor from the left.
    #[inline(always)]
    pub fn skew_mul(a: Vec3<T>, b: Self) -> Self {
        Self::from_columns(a.cross(b.column(0)), a.cross(b.column(1)), a.cross(b.column(2)))
    }

    /// The tensor times a constant.
    #[inline(always)]
    pub fn scale(self, factor: f64) -> Self {
        Self(three!(|i| three!(|j| self.0[i][j] * factor)))
    }
}

impl<T: Real> Add for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(three!(|i| self.0[i] + other.0[i]))
    }
}

impl<T: Real> Sub for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(three!(|i| self.0[i] - other.0[i]))
    }
}

impl<T: Real> Neg for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(three!(|i| -self.0[i]))
    }
}

impl<T: Real> AddAssign for Vec3<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Real> SubAssign for Vec3<T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<T: Real> Mul<T> for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        Self(three!(|i| self.0[i] * factor))
    }
}

impl<T: Real> Add for Mat3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(three!(|i| three!(|j| self.0[i][j] + other.0[i][j])))
    }
}

impl<T: Real> Sub for Mat3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(three!(|i| three!(|j| self.0[i][j] - other.0[i][j])))
    }
}

impl<T: Real> Neg for Mat3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(three!(|i| three!(|j| -self.0[i][j])))
    }
}

impl<T: Real> AddAssign for Mat3<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Real> SubAssign for Mat3<T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<T: Real> Mul<T> for Mat3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        Self(three!(|i| three!(|j| self.0[i][j] * factor)))
    }
}

impl<T: Real> Mul<Vec3<T>> for Mat3<T> {
    type Output = Vec3<T>;
    #[inline(always)]
    fn mul(self, v: Vec3<T>) -> Vec3<T> {
        Vec3(three!(|i| Vec3(self.0[i]).dot(v)))
    }
}

impl<T: Real> Mul for Mat3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let b = other.0;
        Self(three!(|i| three!(|j| self.0[i][0] * b[0][j] + self.0[i][1] * b[1][j] + self.0[i][2] * b[2][j])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_neither_underflow_nor_overflow() {
        for scale in [1e-310, 1e-200, 1e-50, 1.0, 1e100, 1e200, 1e305] {
            let size = Vec3([3.0 * scale, 0.0, 4.0 * scale]).size();
            assert!(size >= 4.0 * scale && size <= 5.1 * scale, "{scale:e}: {size:e}");
        }
        assert_eq!(Vec3::ZERO.size(), 0.0);
        assert!(Vec3([1.0, f64::NAN, 2.0]).size().is_nan());
        assert!(Vec3([f64::INFINITY, 0.0, 0.0]).size().is_infinite());
    }
    #[test]
    fn directions_neither_underflow_nor_overflow() {
        for size in [5e-324, 1e-200, 1.0, 1e200, 1.7e308] {
            assert_eq!(Vec3([0.0, -size, 0.0]).normalized(), Some(Vec3([0.0, -1.0, 0.0])), "{size:e}");
        }
        for none in [Vec3::ZERO, Vec3([f64::INFINITY, 0.0, 0.0]), Vec3([f64::NAN, 1.0, 0.0])] {
            assert_eq!(none.normalized(), None);
        }
    }
}
