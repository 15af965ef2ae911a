//! The logarithm: a rotation vector of a rotation tensor, through the unit quaternion.

use crate::tensor::{Mat3, Vec3};

/// The rotation vector P of `r` with |P| <= pi, accurate at 0 and at pi.
///
/// The quaternion (q0, q) comes from the largest of tr R, R11, R22, R33, so that nothing cancels (Spurrier 1978); then
/// P = 2 atan2(|q|, q0) q/|q| with q0 >= 0. Within 4e-16 of the angle's scale for angles from 1e-9 to pi.
pub fn log(r: Mat3) -> Vec3 {
    let (scalar, vector) = quaternion(r);
    let length = vector.norm();
    if length == 0.0 {
        return Vec3::ZERO;
    }
    vector * (2.0 * libm::atan2(length, scalar) / length)
}

/// The angle in [0, pi] that takes the rotation `a` into the rotation `b`.
pub fn relative_angle(a: Mat3, b: Mat3) -> f64 {
    let (scalar, vector) = quaternion(a.transpose_matmul(b));
    2.0 * libm::atan2(vector.norm(), scalar)
}

/// The unit quaternion of `r` with a scalar part that is not negative.
fn quaternion(r: Mat3) -> (f64, Vec3) {
    let m = r.0;
    let trace = m[0][0] + m[1][1] + m[2][2];
    let largest = (0..3).fold(0, |best, i| if m[i][i] > m[best][best] { i } else { best });
    let (scalar, vector) = if trace >= m[largest][largest] {
        let scalar = 0.5 * (1.0 + trace).sqrt();
        let axial = Vec3([m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]);
        (scalar, axial * (0.25 / scalar))
    } else {
        let (i, j, k) = (largest, (largest + 1) % 3, (largest + 2) % 3);
        let mut vector = [0.0; 3];
        vector[i] = (0.5 * m[i][i] + 0.25 * (1.0 - trace)).sqrt();
        let scale = 0.25 / vector[i];
        vector[j] = (m[j][i] + m[i][j]) * scale;
        vector[k] = (m[k][i] + m[i][k]) * scale;
        ((m[k][j] - m[j][k]) * scale, Vec3(vector))
    };
    if scalar < 0.0 { (-scalar, -vector) } else { (scalar, vector) }
}
