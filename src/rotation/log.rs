//! The inverse of the exponential: a rotation vector of a rotation tensor, through the unit quaternion.

use crate::real::Real;
use crate::tensor::{Mat3, Vec3};

/// The rotation vector P of `r` with |P| <= pi, accurate at 0 and at pi.
///
/// The quaternion (q0, q) comes from the largest of tr R, R11, R22, R33, so that nothing cancels (Spurrier 1978); then
/// P = 2 atan2(|q|, q0) q/|q| with q0 >= 0. Within 4e-16 of the angle's scale for angles from 1e-9 to pi.
#[inline]
pub fn log<T: Real>(r: Mat3<T>) -> Vec3<T> {
    let (scalar, vector) = quaternion(r);
    vector * angle_over_sine(vector.squared(), scalar)
}

/// 2 atan2(|q|, q0)/|q| for z = |q|^2; smooth at zero.
#[inline]
fn angle_over_sine<T: Real>(z: T, scalar: T) -> T {
    let t = z / (scalar * scalar);
    if t.largest() < 1e-3 {
        // atan(x)/x = 1 - x^2/3 + x^4/5 - ...
        let series = [1.0 / 11.0, -1.0 / 9.0, 1.0 / 7.0, -1.0 / 5.0, 1.0 / 3.0];
        let sum = series.into_iter().fold(T::constant(-1.0 / 13.0), |sum, c| sum * t + T::constant(c));
        return (T::one() - sum * t) * T::constant(2.0) / scalar;
    }
    let length = z.sqrt();
    length.atan2(scalar) * 2.0 / length
}

/// The angle in [0, pi] that takes the rotation `a` into the rotation `b`.
pub fn relative_angle(a: Mat3, b: Mat3) -> f64 {
    let (scalar, vector) = quaternion(a.transpose_matmul(b));
    2.0 * libm::atan2(vector.norm(), scalar)
}

/// The unit quaternion of `r` with a scalar part that is not negative.
#[inline]
fn quaternion<T: Real>(r: Mat3<T>) -> (T, Vec3<T>) {
    let (m, one) = (r.0, T::one());
    let trace = m[0][0] + m[1][1] + m[2][2];
    let largest = (0..3).fold(0, |best, i| if m[i][i].largest() > m[best][best].largest() { i } else { best });
    let (scalar, vector) = if trace.largest() >= m[largest][largest].largest() {
        let scalar = (one + trace).sqrt() * 0.5;
        let axial = Vec3([m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]);
        (scalar, axial * (T::constant(0.25) / scalar))
    } else {
        let (i, j, k) = (largest, (largest + 1) % 3, (largest + 2) % 3);
        let mut vector = [T::zero(); 3];
        vector[i] = (m[i][i] * 0.5 + (one - trace) * 0.25).sqrt();
        let scale = T::constant(0.25) / vector[i];
        vector[j] = (m[j][i] + m[i][j]) * scale;
        vector[k] = (m[k][i] + m[i][k]) * scale;
        ((m[k][j] - m[j][k]) * scale, Vec3(vector))
    };
    if scalar.largest() < 0.0 { (-scalar, -vector) } else { (scalar, vector) }
}
