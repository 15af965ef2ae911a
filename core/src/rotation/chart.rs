//! The complement chart (Makinen 2007, definition 2.2, equations (81)–(84)): the rotation of P,
//! with psi = |P|, is also that of the complement vector P^C = P - (2 pi / psi) P, whose length is
//! |2 pi - psi|. At psi = pi both have length pi; a change of chart there keeps every rotation
//! vector within the ball in which the tangent tensor T is regular.

use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

/// A rotation vector with its rates, carried into the complement chart, and the tensors of the
/// change.
#[derive(Clone, Copy, Debug)]
pub struct Complement<T = f64> {
    /// P^C
    pub p: Vec3<T>,
    /// dP^C/dt = B W, with W = dP/dt
    pub velocity: Vec3<T>,
    /// d2P^C/dt2 = B A + Bd W, with A = d2P/dt2
    pub acceleration: Vec3<T>,
    /// B = dP^C/dP = (1 - 2 pi/psi) I + (2 pi/psi) n(x)n
    pub b: Mat3<T>,
    /// dB/dt, equal to the derivative of dP^C/dt over P
    pub b_rate: Mat3<T>,
    /// d2B/dt2, equal to the derivative of d2P^C/dt2 over P
    pub b_rate2: Mat3<T>,
}

impl<T: Real> Complement<T> {
    /// The complement of `p` with velocity `w` and acceleration `a`. The rotation must not be zero.
    pub fn new(p: Vec3<T>, w: Vec3<T>, a: Vec3<T>) -> Self {
        let psi = p.norm();
        let n = p * (T::one() / psi);
        let turn = T::constant(2.0 * PI) / psi;
        let b = Mat3::diagonal([T::one() - turn; 3]) + n.outer(n) * turn;
        let b_rate = derivative(psi, n, w);
        let b_rate2 = second_derivative(psi, n, w, a, b_rate);
        Self { p: p * (T::one() - turn), velocity: b * w, acceleration: b * a + b_rate * w, b, b_rate, b_rate2 }
    }

    /// The geometric matrix of a force that is conjugate to P^C: d(B^T f)/dP for constant `f`,
    /// (88).
    pub fn geometric(p: Vec3<T>, f: Vec3<T>) -> Mat3<T> {
        let psi = p.norm();
        derivative(psi, p * (T::one() / psi), f)
    }
}

/// The derivative of B over time: Bd(W) = (2 pi / psi^2) [(n.W) I + W(x)n + n(x)W - 3 (n.W) n(x)n].
fn derivative<T: Real>(psi: T, n: Vec3<T>, w: Vec3<T>) -> Mat3<T> {
    let nw = n.dot(w);
    (Mat3::diagonal([nw; 3]) + w.outer(n) + n.outer(w) - n.outer(n) * (nw * 3.0))
        * (T::constant(2.0 * PI) / (psi * psi))
}

/// The second derivative Bdd of B over time, (83), with nd = (W - n (n.W))/psi and s = n.A + nd.W.
fn second_derivative<T: Real>(psi: T, n: Vec3<T>, w: Vec3<T>, a: Vec3<T>, b_rate: Mat3<T>) -> Mat3<T> {
    let nw = n.dot(w);
    let n_rate = (w - n * nw) * (T::one() / psi);
    let s = n.dot(a) + n_rate.dot(w);
    let turn = T::constant(2.0 * PI) / (psi * psi);
    let linear = Mat3::diagonal([s; 3]) + a.outer(n) + n.outer(a) + w.outer(n_rate) + n_rate.outer(w);
    let cubic = n.outer(n) * s + (n_rate.outer(n) + n.outer(n_rate)) * nw;
    linear * turn - cubic * (turn * 3.0) - b_rate * (nw * 2.0 / psi)
}

/// The complement of a rotation vector, without rates. The rotation must not be zero.
pub fn complement(p: Vec3) -> Vec3 {
    p * (1.0 - 2.0 * PI / p.norm())
}

/// The number k for which P + 2 pi k n comes nearest to `reference`.
pub fn nearest_turn(p: Vec3, reference: Vec3) -> f64 {
    let psi = p.norm();
    if psi == 0.0 {
        return 0.0;
    }
    ((reference.dot(p) / psi - psi) / (2.0 * PI)).round()
}

/// The representative of the rotation of `p` that continues `previous` without a jump: ten turns
/// have the length 20 pi.
pub fn unwound(p: Vec3, previous: Vec3) -> Vec3 {
    let psi = p.norm();
    if psi < 1e-9 {
        // A rotation of almost zero has no axis of its own: it keeps the previous axis, at the
        // nearest whole turn.
        let turns = (previous.norm() / (2.0 * PI)).round();
        return previous.normalized().map_or(p, |axis| axis * (2.0 * PI * turns) + p);
    }
    p * (1.0 + 2.0 * PI * nearest_turn(p, previous) / psi)
}

/// The representative of a rotation vector with |P| <= pi; at pi the one whose first non-zero
/// component is positive.
pub fn principal(p: Vec3) -> Vec3 {
    let psi = p.norm();
    if psi < PI - 1e-12 {
        return p;
    }
    let turns = (psi / (2.0 * PI)).round();
    let short = p * (1.0 - 2.0 * PI * turns / psi);
    let at_pi = (short.norm() - PI).abs() < 1e-12;
    let leading = short.0.into_iter().find(|c| c.abs() > 1e-12 * PI);
    if at_pi && leading.is_some_and(|c| c < 0.0) { -short } else { short }
}
