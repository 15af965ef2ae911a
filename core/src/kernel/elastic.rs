//! Strains, internal force and stiffness at a point of the beam (section 3, equations (45)–(80)).
//!
//! All tensors are material, with global components: P is measured from the initial placement, so
//! that K = T P' already is the change of curvature of an initially curved or twisted beam.

use super::law::{Stiffness, Strain, Stress};
use crate::rotation::Rotation;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// The configuration at a point: the rotation, x' (spatial) and P', both derivatives over initial
/// arc length.
#[derive(Clone, Copy, Debug)]
pub struct Point<T = f64> {
    /// R, T and the derivative tensors of the interpolated rotation vector
    rotation: Rotation<T>,
    /// y = R^T x'
    y: Vec3<T>,
    /// P'
    p_slope: Vec3<T>,
    /// C1(P')
    c1: Mat3<T>,
}

/// The generalised force at a point: conjugate to u', P' and P.
#[derive(Clone, Copy, Debug)]
pub struct PointForce<T = f64> {
    /// f_x' = R N
    pub(crate) x_slope: Vec3<T>,
    /// f_P' = T^T M
    pub(crate) p_slope: Vec3<T>,
    /// f_P = T^T (N x y) + C1^T M
    pub(crate) p: Vec3<T>,
}

/// The stiffness at a point: second derivatives over (x', P', P).
#[derive(Clone, Copy, Debug)]
pub struct PointTangent<T = f64> {
    /// K_xx = R Cn R^T
    pub(crate) xx: Mat3<T>,
    /// K_xP = R (Cn A - N~ T) [+ R Cc C1], A = y~ T
    pub(crate) xp: Mat3<T>,
    /// K_xP' = R Cc T, where the section couples
    pub(crate) xs: Option<Mat3<T>>,
    /// K_P'P' = T^T Cm T
    pub(crate) ss: Mat3<T>,
    /// K_P'P = T^T Cm C1 + C2(M) [+ T^T Cc^T A]
    pub(crate) sp: Mat3<T>,
    /// K_PP = A^T Cn A + C1^T Cm C1 + C3(M, P') + C2(N x y) + T^T N~ y~ T [+ A^T Cc C1 + C1^T Cc^T
    /// A]
    pub(crate) pp: Mat3<T>,
}

impl<T: Real> Point<T> {
    /// The point with rotation vector `p`, slope `p_slope` = P' and `x_slope` = x'.
    #[inline(always)]
    pub fn new(p: Vec3<T>, p_slope: Vec3<T>, x_slope: Vec3<T>) -> Self {
        let rotation = Rotation::new(p);
        Self { y: rotation.r.transpose_mul(x_slope), c1: rotation.c1(p_slope), rotation, p_slope }
    }

    /// The strains Gamma = y - E1 and K = T P' (material); `e1` is the unit tangent of the initial
    /// centre line.
    #[inline(always)]
    pub fn strain(&self, e1: Vec3<T>) -> Strain<T> {
        Strain { gamma: self.y - e1, kappa: self.rotation.t * self.p_slope }
    }

    /// The variation of the strains: dGamma = R^T du' + y~ T dP, dK = T dP' + C1 dP.
    #[inline(always)]
    pub fn strain_variation(&self, du_slope: Vec3<T>, dp_slope: Vec3<T>, dp: Vec3<T>) -> Strain<T> {
        let Rotation { r, t, .. } = self.rotation;
        Strain { gamma: r.transpose_mul(du_slope) + self.y.cross(t * dp), kappa: t * dp_slope + self.c1 * dp }
    }

    /// The internal force, (77).
    #[inline(always)]
    pub fn force(&self, stress: &Stress<T>) -> PointForce<T> {
        let Rotation { r, t, .. } = self.rotation;
        PointForce {
            x_slope: r * stress.n,
            p_slope: t.transpose_mul(stress.m),
            p: t.transpose_mul(stress.n.cross(self.y)) + self.c1.transpose_mul(stress.m),
        }
    }

    /// The stiffness, (78)–(80). `stress` forms the geometric part: the stress of this
    /// configuration for the exact tangent, the extrapolated one for the mixed-integration-point
    /// tangent.
    #[inline(always)]
    pub fn tangent(&self, stiffness: &Stiffness<T>, stress: &Stress<T>) -> PointTangent<T> {
        let rotation = &self.rotation;
        let c1 = self.c1;
        let r = rotation.r;
        let t = rotation.t;
        let cn = stiffness.cn;
        let cm = stiffness.cm;
        let a = Mat3::skew_mul(self.y, t);
        let cn_a = cn * a;
        let cm_c1 = cm * c1;
        let n_y_t = Mat3::skew_mul(stress.n, a);
        let mut tangent = PointTangent {
            xx: r * cn * r.transpose(),
            xp: r * (cn_a - Mat3::skew_mul(stress.n, t)),
            xs: None,
            ss: t.transpose_matmul(cm * t),
            sp: t.transpose_matmul(cm_c1) + rotation.c2(stress.m),
            pp: a.transpose_matmul(cn_a)
                + c1.transpose_matmul(cm_c1)
                + rotation.c3(stress.m, self.p_slope)
                + rotation.c2(stress.n.cross(self.y))
                + t.transpose_matmul(n_y_t),
        };
        if let Some(cc) = stiffness.cc {
            let mixed = a.transpose_matmul(cc * c1);
            tangent.xs = Some(r * cc * t);
            tangent.xp += r * (cc * c1);
            tangent.sp += t.transpose_matmul(cc.transpose_matmul(a));
            tangent.pp += mixed + mixed.transpose();
        }
        tangent
    }
}
