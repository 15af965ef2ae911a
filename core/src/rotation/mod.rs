//! The rotation manifold SO(3) in terms of the total rotation vector (Makinen 2007, section 2 and
//! appendix A).
//!
//! [`Rotation`] holds a rotation vector P, the rotation tensor R, the tangent tensor T that takes
//! rates of P to material spins, and the coefficients of the derivative tensors C1 … C5.
//! [`complement`] changes the chart, [`log`] is the inverse of the exponential.

mod chart;
mod log;
mod series;

pub use chart::{Complement, complement, nearest_turn, principal, unwound};
pub use log::{log, relative_angle};
pub use series::{Coefficients, Series};

use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// A rotation vector P with the tensors that depend on it alone.
#[derive(Clone, Copy, Debug)]
pub struct Rotation<T = f64> {
    /// The rotation vector P (global components; material and spatial ones agree, since R P = P).
    pub(crate) p: Vec3<T>,
    /// R, the rotation tensor: material to spatial.
    pub r: Mat3<T>,
    /// T, from the rate of P to the material spin: Omega = T dP/dt, K = T dP/ds.
    pub t: Mat3<T>,
    c: Coefficients<T>,
}

impl<T: Real> Rotation<T> {
    /// R and T of the rotation vector `p` (definition 2.1 and equation (8)):
    ///
    /// ```text
    /// R = f0 I + f1 P~ + f2 P(x)P        T = f1 I - f2 P~ + f3 P(x)P
    /// ```
    #[inline(always)]
    pub fn new(p: Vec3<T>) -> Self {
        T::apart(
            #[inline(always)]
            || Self::of_vector(p),
        )
    }

    #[inline(always)]
    fn of_vector(p: Vec3<T>) -> Self {
        let series = Series::at(p.squared());
        let [f0, f1, f2, f3, ..] = series.0;
        let skew = p.skew();
        let dyad = p.outer(p);
        Self {
            p,
            r: Mat3::diagonal([f0; 3]) + skew * f1 + dyad * f2,
            t: Mat3::diagonal([f1; 3]) - skew * f2 + dyad * f3,
            c: series.coefficients(),
        }
    }

    /// The rotation R = base exp(P): P is an increment that follows the rotation `base`. T and the
    /// derivative tensors remain those of the increment, since they give material spins.
    #[inline(always)]
    pub fn after(self, base: Mat3<T>) -> Self {
        Self { r: base * self.r, ..self }
    }

    /// The rotation of -P: R and T are transposed.
    #[inline(always)]
    pub fn reversed(&self) -> Self {
        Self { p: -self.p, r: self.r.transpose(), t: self.t.transpose(), c: self.c }
    }

    /// T^-1 = I + P~/2 + e P~^2. Its only pole is at |P| = 2 pi: e is formed without cancellation
    /// elsewhere.
    #[inline(always)]
    pub fn t_inverse(&self) -> Mat3<T> {
        let p = self.p;
        let z = self.p.squared();
        let [_, f1, f2, f3, ..] = Series::at(z * 0.25).0;
        let e = (f2 - f3) / (f1 * 4.0);
        // P~^2 = P(x)P - (P.P) I
        Mat3::diagonal([T::one() - e * z; 3]) + p.skew().scale(0.5) + p.outer(p) * e
    }

    /// C1(V) = D_P (T V), (A1):
    ///
    /// ```text
    /// C1 = c1 V(x)P - c2 (PxV)(x)P + c3 (P.V) P(x)P - c4 V~ + c5 [(P.V) I + P(x)V]
    /// ```
    #[inline(always)]
    pub fn c1(&self, v: Vec3<T>) -> Mat3<T> {
        let p = self.p;
        let c = &self.c;
        let pv = p.dot(v);
        (v * c.c1 - p.cross(v) * c.c2 + p * (c.c3 * pv)).outer(p) - v.skew() * c.c4
            + (Mat3::diagonal([pv; 3]) + p.outer(v)) * c.c5
    }

    /// C2(V) = D_P (T^T V), (A4): C1 with the opposite signs of c2 and c4.
    #[inline(always)]
    pub fn c2(&self, v: Vec3<T>) -> Mat3<T> {
        let p = self.p;
        let c = &self.c;
        let pv = p.dot(v);
        (v * c.c1 + p.cross(v) * c.c2 + p * (c.c3 * pv)).outer(p)
            + v.skew() * c.c4
            + (Mat3::diagonal([pv; 3]) + p.outer(v)) * c.c5
    }

    /// dT/dt for the rate `w` of P, (A6):
    ///
    /// ```text
    /// Td = c1 (P.W) I - c2 (P.W) P~ + c3 (P.W) P(x)P + c4 W~ + c5 (W(x)P + P(x)W)
    /// ```
    #[inline(always)]
    pub fn t_rate(&self, w: Vec3<T>) -> Mat3<T> {
        let p = self.p;
        let c = &self.c;
        let pw = p.dot(w);
        Mat3::diagonal([c.c1 * pw; 3]) - p.skew() * (c.c2 * pw)
            + p.outer(p) * (c.c3 * pw)
            + w.skew() * c.c4
            + (w.outer(p) + p.outer(w)) * c.c5
    }

    /// C3(V, W) = D_P (C1(W)^T V), (A8); symmetric. With S(a,b) = a(x)b + b(x)a and u = V x W:
    ///
    /// ```text
    /// C3 = [c1 V.W + c2 P.u + c3 (P.W)(P.V)] I
    ///    + c2 S(P,u) + c3 (P.W) S(P,V) + c3 (P.V) S(P,W) + c5 S(W,V)
    ///    + [d1 V.W + d2 P.u + d3 (P.W)(P.V)] P(x)P
    /// ```
    #[inline(always)]
    pub fn c3(&self, v: Vec3<T>, w: Vec3<T>) -> Mat3<T> {
        let p = self.p;
        let c = &self.c;
        let u = v.cross(w);
        let vw = v.dot(w);
        let pu = p.dot(u);
        let pv = p.dot(v);
        let pw = p.dot(w);
        let spherical = c.c1 * vw + c.c2 * pu + c.c3 * pw * pv;
        let along = c.d1 * vw + c.d2 * pu + c.d3 * pw * pv;
        let half = (u * c.c2 + v * (c.c3 * pw) + w * (c.c3 * pv)).outer(p) + w.outer(v) * c.c5;
        Mat3::diagonal([spherical; 3]) + half + half.transpose() + p.outer(p) * along
    }

    /// C4(W) = D_W (Td(W) W), (A13):
    ///
    /// ```text
    /// C4 = (c1+c5) [(P.W) I + W(x)P] + 2 c3 (P.W) P(x)P + 2 c5 P(x)W - c2 (PxW)(x)P - c2 (P.W) P~
    /// ```
    #[inline(always)]
    pub fn c4(&self, w: Vec3<T>) -> Mat3<T> {
        let p = self.p;
        let c = &self.c;
        let pw = p.dot(w);
        (Mat3::diagonal([pw; 3]) + w.outer(p)) * (c.c1 + c.c5)
            + (p * (c.c3 * pw * 2.0) - p.cross(w) * c.c2).outer(p)
            + p.outer(w) * (c.c5 * 2.0)
            - p.skew() * (c.c2 * pw)
    }

    /// C5(W) = D_P (Td(W) W), (A13). With q = P.W:
    ///
    /// ```text
    /// C5 = [c3 q^2 + c5 W.W] I + [d3 q^2 + c3 W.W] P(x)P + 2 c3 q P(x)W + (d1 + c3) q W(x)P
    ///    - d2 q (PxW)(x)P - c2 (PxW)(x)W + c2 q W~ + (c1+c5) W(x)W
    /// ```
    #[inline(always)]
    pub fn c5(&self, w: Vec3<T>) -> Mat3<T> {
        let p = self.p;
        let c = &self.c;
        let q = p.dot(w);
        let ww = w.squared();
        let pxw = p.cross(w);
        Mat3::diagonal([c.c3 * q * q + c.c5 * ww; 3])
            + (p * (c.d3 * q * q + c.c3 * ww) + w * ((c.d1 + c.c3) * q) - pxw * (c.d2 * q)).outer(p)
            + (p * (c.c3 * q * 2.0) - pxw * c.c2 + w * (c.c1 + c.c5)).outer(w)
            + w.skew() * (c.c2 * q)
    }

    /// The gradient with respect to P of the potential w . R v of a vector fixed in the body: T^T
    /// (v x R^T w).
    #[inline(always)]
    pub fn potential_gradient(&self, v: Vec3<T>, w: Vec3<T>) -> Vec3<T> {
        self.t.transpose_mul(v.cross(self.r.transpose_mul(w)))
    }

    /// The Hessian of w . R v: C2(v x R^T w) + T^T v~ (R^T w)~ T; symmetric. It serves gravity on
    /// an eccentric mass, forces at an offset and constraints on directions (the family of equation
    /// (75)).
    #[inline(always)]
    pub fn potential_hessian(&self, v: Vec3<T>, w: Vec3<T>) -> Mat3<T> {
        let material = self.r.transpose_mul(w);
        self.c2(v.cross(material)) + self.t.transpose_matmul(Mat3::skew_mul(v, Mat3::skew_mul(material, self.t)))
    }
}
