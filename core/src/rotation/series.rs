//! The entire functions f_m from which all coefficients of the rotation algebra are formed.
//!
//! With z = psi^2,
//!
//! ```text
//! f_m(z) = sum_k (-z)^k / (2k+m)!
//! f0 = cos psi,   f1 = sin psi / psi,   f2 = (1 - cos psi) / psi^2,   ...
//! f_m = 1/m! - z f_{m+2}
//! 2 df_m/dz = m f_{m+2} - f_{m+1}
//! ```
//!
//! The coefficients c1 … c5 of the tensors C1 … C5 (Makinen 2007, (A2), (A9)) and their derivatives
//! over psi are linear in f2 … f7: no cancellation, no division by the angle, no branch near zero.

use crate::scalar::Real;

/// The functions f0 … f7 at one argument z = psi^2.
#[derive(Clone, Copy, Debug)]
pub struct Series<T>(pub [T; 8]);

/// The largest argument z = psi^2, rad^2, at which the series is summed; above it, it is summed at
/// a quarter of the argument (once or more often) and the angle doubled again.
const LARGEST_ARGUMENT: f64 = 16.0;

/// Reciprocals of the factorials, 1/0! … 1/32!.
const RECIPROCAL_FACTORIAL: [f64; 33] = {
    let mut table = [1.0; 33];
    let mut factorial = 1.0;
    let mut m = 1;
    while m < 33 {
        factorial *= m as f64;
        table[m] = 1.0 / factorial;
        m += 1;
    }
    table
};

/// Terms of the two series that are summed: the first left out is below 1e-19 of the sum at the
/// largest argument.
const TERMS: usize = 13;

impl<T: Real> Series<T> {
    /// The functions at `z` = psi^2.
    #[inline(always)]
    pub fn at(z: T) -> Self {
        if z.largest() <= LARGEST_ARGUMENT { Self::by_horner(z) } else { Self::by_doubling(z) }
    }

    /// f6 and f7 by Horner's rule, the others downward from them.
    #[inline(always)]
    fn by_horner(z: T) -> Self {
        let mut f6 = T::zero();
        let mut f7 = T::zero();
        for k in (0..TERMS).rev() {
            f6 = T::constant(RECIPROCAL_FACTORIAL[2 * k + 6]) - z * f6;
            f7 = T::constant(RECIPROCAL_FACTORIAL[2 * k + 7]) - z * f7;
        }
        let down = |m: usize, above: T| T::constant(RECIPROCAL_FACTORIAL[m]) - z * above;
        let f5 = down(5, f7);
        let f4 = down(4, f6);
        let f3 = down(3, f5);
        let f2 = down(2, f4);
        let f1 = down(1, f3);
        let f0 = down(0, f2);
        Self([f0, f1, f2, f3, f4, f5, f6, f7])
    }

    /// Quarters the argument until the series can be summed, then doubles the angle again by exact
    /// relations between entire functions: an iterate of Newton's method may have any angle, also
    /// beyond 2 pi.
    #[cold]
    fn by_doubling(z: T) -> Self {
        let quarter = |z: T| z.above(LARGEST_ARGUMENT, z * 0.25, z);
        let mut small = z;
        let mut doublings = 0;
        while small.largest() > LARGEST_ARGUMENT && doublings < 500 {
            small = quarter(small);
            doublings += 1;
        }
        let mut f = Self::by_horner(small);
        for k in (0..doublings).rev() {
            // Exact, as all powers of two are.
            let argument = z * 0.25_f64.powi(k);
            f = Self::chosen(argument, f.doubled(argument), f);
        }
        f
    }

    /// `doubled` if the argument is too large for the series, otherwise `f`; lane by lane.
    fn chosen(argument: T, doubled: Self, f: Self) -> Self {
        Self(std::array::from_fn(|m| argument.above(LARGEST_ARGUMENT, doubled.0[m], f.0[m])))
    }

    /// The functions at `z`, from these at z/4.
    fn doubled(self, z: T) -> Self {
        let [f0, f1, f2, f3, f4, f5, ..] = self.0;
        let g0 = f0 * f0 * 2.0 - T::one();
        let g1 = f0 * f1;
        let g2 = f1 * f1 * 0.5;
        let g3 = (f3 + f1 * f2) * 0.25;
        let g4 = f3 * (T::one() + f1) * 0.125;
        let g5 = (f5 + f4 + f3 * f2) * 0.0625;
        let g6 = (T::constant(1.0 / 24.0) - g4) / z;
        let g7 = (T::constant(1.0 / 120.0) - g5) / z;
        Self([g0, g1, g2, g3, g4, g5, g6, g7])
    }

    /// The coefficients of the tensors C1 … C5.
    #[inline(always)]
    pub fn coefficients(&self) -> Coefficients<T> {
        let [_, _, f2, f3, f4, f5, f6, f7] = self.0;
        Coefficients {
            c1: f3 - f2,
            c2: f4 * 2.0 - f3,
            c3: f5 * 3.0 - f4,
            c4: -f2,
            c5: f3,
            d1: f3 - f4 * 3.0 + f5 * 3.0,
            d2: f4 - f5 * 5.0 + f6 * 8.0,
            d3: f5 - f6 * 7.0 + f7 * 15.0,
        }
    }
}

/// Coefficients c1 … c5 of (A2), and d1 … d3 = c1'/psi … c3'/psi of (A9), in Makinen 2007.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Coefficients<T> {
    pub c1: T,
    pub c2: T,
    pub c3: T,
    pub c4: T,
    pub c5: T,
    pub d1: T,
    pub d2: T,
    pub d3: T,
}
