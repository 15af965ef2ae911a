//! The inverse of the exponential: a rotation vector of a rotation tensor, through the unit
//! quaternion.

use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// The rotation vector P of `r` with |P| <= pi, accurate at 0 and at pi.
///
/// The quaternion (q0, q) comes from the largest of tr R, R11, R22, R33, so that nothing cancels
/// (Spurrier 1978, doi:10.2514/3.57311); then P = 2 atan2(|q|, q0) q/|q| with q0 >= 0. The error is
/// within 4e-16 of the angle for angles from 1e-9 to pi.
#[inline(always)]
pub fn log<T: Real>(r: Mat3<T>) -> Vec3<T> {
    T::apart(
        #[inline(always)]
        || {
            let Quaternion { scalar, vector } = quaternion(r);
            vector * angle_over_sine(vector.squared(), scalar)
        },
    )
}

/// 2 atan2(|q|, q0)/|q| for z = |q|^2 of a unit quaternion with q0 >= 0; smooth at zero.
///
/// After t = tan(psi/4) = |q|/(1 + q0) and two more halvings of the angle, t -> t/(1 + sqrt(1 +
/// t^2)), the series of the arctangent converges quickly: no branch, and no angle in a denominator.
#[inline(always)]
fn angle_over_sine<T: Real>(z: T, scalar: T) -> T {
    let one = T::one();
    let quarter = one / (one + scalar);
    let t = z * quarter * quarter;
    let eighth = one / (one + (one + t).sqrt());
    let t = t * eighth * eighth;
    let sixteenth = one / (one + (one + t).sqrt());
    let t = t * sixteenth * sixteenth;
    // atan(x)/x = 1 - x^2/3 + x^4/5 - ..., x = tan(psi/16) < 0.2
    let mut sum = T::zero();
    for k in (0..ARCTANGENT_TERMS).rev() {
        sum = T::constant(1.0 / (2 * k + 1) as f64) - t * sum;
    }
    quarter * eighth * sixteenth * sum * 16.0
}

/// Terms of the series of atan(x)/x for x = tan(psi/16) < 0.2: the first one left out is below
/// 1e-18.
const ARCTANGENT_TERMS: usize = 12;

/// The angle in [0, pi] that takes the rotation `a` into the rotation `b`.
pub fn relative_angle(a: Mat3, b: Mat3) -> f64 {
    let Quaternion { scalar, vector } = quaternion(a.transpose_matmul(b));
    2.0 * libm::atan2(vector.norm(), scalar)
}

/// A unit quaternion (q0, q).
#[derive(Clone, Copy)]
struct Quaternion<T> {
    /// q0
    scalar: T,
    /// q
    vector: Vec3<T>,
}

/// The unit quaternion of `r` with a scalar part that is not negative.
#[inline(always)]
fn quaternion<T: Real>(r: Mat3<T>) -> Quaternion<T> {
    let m = r.0;
    let one = T::one();
    let trace = m[0][0] + m[1][1] + m[2][2];
    let larger = |a: T, b: T| (a - b).above(0.0, a, b);
    let excess = larger(larger(m[0][0], m[1][1]), m[2][2]) - trace;
    let scalar = (one + trace).sqrt() * 0.5;
    let axial = Vec3([m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]);
    let by_trace = Quaternion { scalar, vector: axial * (T::constant(0.25) / scalar) };
    if excess.largest() > 0.0 { by_diagonal(r, trace, excess, by_trace) } else { by_trace }
}

/// The unit quaternion from the largest diagonal entry if that exceeds the trace, otherwise
/// `by_trace`.
#[inline(never)]
fn by_diagonal<T: Real>(r: Mat3<T>, trace: T, excess: T, by_trace: Quaternion<T>) -> Quaternion<T> {
    let m = r.0;
    let one = T::one();
    let by = |i: usize| {
        let j = (i + 1) % 3;
        let k = (i + 2) % 3;
        let mut vector = [T::zero(); 3];
        vector[i] = (m[i][i] * 0.5 + (one - trace) * 0.25).sqrt();
        let scale = T::constant(0.25) / vector[i];
        vector[j] = (m[j][i] + m[i][j]) * scale;
        vector[k] = (m[k][i] + m[i][k]) * scale;
        Quaternion { scalar: (m[k][j] - m[j][k]) * scale, vector: Vec3(vector) }
    };
    let choose = |test: T, then: Quaternion<T>, otherwise: Quaternion<T>| {
        let component = |i: usize| test.above(0.0, then.vector.0[i], otherwise.vector.0[i]);
        Quaternion {
            scalar: test.above(0.0, then.scalar, otherwise.scalar),
            vector: Vec3(std::array::from_fn(component)),
        }
    };
    let first = choose(m[1][1] - m[0][0], by(1), by(0));
    let largest = (m[1][1] - m[0][0]).above(0.0, m[1][1], m[0][0]);
    let either = choose(excess, choose(m[2][2] - largest, by(2), first), by_trace);
    choose(-either.scalar, Quaternion { scalar: -either.scalar, vector: -either.vector }, either)
}
