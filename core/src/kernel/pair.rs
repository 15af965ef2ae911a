//! Relative elements of two nodes in closed form: [`Relative`] elements whose only integration
//! point lies half way between the nodes, where the rotation is that of the frame, so that nothing
//! is interpolated:
//!
//! ```text
//! Gamma = s (R_r^T dx - dX),   K = s phi,   phi = log(R_1^T R_2) = 2h,   s = 1/length
//! ```
//!
//! With t_i the material spins of the nodes, A = T(phi)^-1 and a = s R_r^T dx
//!
//! ```text
//! dGamma = s R_r^T d(dx) + a~ (F_1 t_1 + F_2 t_2)
//! dK = s (A t_2 - A^T t_1) = s (B_1 t_1 + B_2 t_2)
//! f_x = w s R_r N,   f_t_i = w (F_i^T q + s B_i^T M),   q = N x a
//! ```
//!
//! and the second variation, G = Cn a~ - N~ and S = G^T a~,
//!
//! ```text
//! x,x:     w s^2 R_r Cn R_r^T
//! x,t_j:   w s R_r (G F_j + s Cc B_j)
//! t_i,t_j: w (F_i^T (S F_j - s a~ Cc B_j) + s B_i^T (Cc^T a~ F_j + s Cm B_j) + E_i B_j)
//! E_i dphi = d(F_i^T) q + s d(B_i^T) M
//! ```
//!
//! Cn, Cc and Cm are the blocks of the law's tangent, F_i and R_r those of [`super::relative`]. T_i
//! takes spins to rotation vectors, whose own second variation is C2. This takes a third of the
//! operations of [`Relative::carry_back`].

use super::beam::StiffnessPoint;
use super::element::ElementSystem;
use super::law::{SectionLaw, Stiffness, Strain, Stress};
use super::relative::Relative;
use crate::rotation::{Rotation, Series};
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// The rotation vector phi = log(R_1^T R_2) between the two nodes, and the coefficients of its
/// variation.
struct Between<T> {
    phi: Vec3<T>,
    /// A = T(phi)^-1
    inverse: Mat3<T>,
    /// A = I + phi~/2 + e phi~^2
    e: T,
    /// de/dz over z = phi.phi
    e_slope: T,
}

impl<T: Real> Between<T> {
    #[inline(always)]
    fn new(h: Vec3<T>) -> Self {
        let phi = h.scale(2.0);
        let [_, f1, f2, f3, f4, f5, ..] = Series::at(h.squared()).0;
        // 2 df_m/dz = m f_{m+2} - f_{m+1}
        let d1 = (f3 - f2) * 0.5;
        let d2 = (f4 * 2.0 - f3) * 0.5;
        let d3 = (f5 * 3.0 - f4) * 0.5;
        let e = (f2 - f3) / (f1 * 4.0);
        let e_slope = ((d2 - d3) * f1 - (f2 - f3) * d1) / (f1 * f1 * 16.0);
        let even = Mat3::diagonal([T::one() - e * phi.squared(); 3]) + phi.outer(phi) * e;
        Self { phi, inverse: even + h.skew(), e, e_slope }
    }

    /// The derivative of e phi~^2 m over phi for a fixed m: the part that the derivatives of A m
    /// and of A^T m share.
    #[inline(always)]
    fn bend(&self, m: Vec3<T>) -> Mat3<T> {
        let phi = self.phi;
        let along = phi.dot(m);
        let twice = phi * along - m * phi.squared();
        (phi.outer(m) + Mat3::diagonal([along; 3]) - m.outer(phi).scale(2.0)) * self.e
            + twice.outer(phi) * (self.e_slope * 2.0)
    }
}

/// Forces conjugate to the difference of displacements (spatial) and to the material spins of the
/// nodes, divided by the weight of the integration point.
struct PairForces<T> {
    /// R_r N
    across: Vec3<T>,
    /// q = N x a
    frame: Vec3<T>,
    /// F_i^T q + s B_i^T M
    spin: [Vec3<T>; 2],
}

impl<const N: usize, T: Real> Relative<N, T> {
    /// The arm a = s R_r^T dx, in the axes of the frame.
    #[inline(always)]
    fn arm(&self, slope: T) -> Vec3<T> {
        (self.arms[1] - self.arms[0]) * slope
    }

    /// Overwrites `out` with the force and, where `weight` is not zero, `weight` times the
    /// stiffness of an element of two nodes and one integration point half way between them. It
    /// equals [`StiffnessPoint::add_elastic`] in the frame of the element followed by
    /// [`Relative::carry_back`].
    #[inline(always)]
    pub fn fill_half_way<L: SectionLaw<T>>(
        &self,
        rotations: &[Rotation<T>; N],
        point: &StiffnessPoint<N, T, L>,
        free: T,
        geometric: Option<&Stress<T>>,
        weight: f64,
        out: &mut ElementSystem<T>,
    ) {
        debug_assert!(N == 2, "the frame of other elements does not stand at their points");
        let slope = point.slope[1];
        let between = Between::new(self.half.rotation.p);
        let arm = self.arm(slope);
        let elastic = point.elastic_part(&self.pair_strain(slope, &between), free);
        let stress = point.law.stress(&elastic);
        let follows = [self.half.follows(false), self.half.follows(true)];
        let forces = self.pair_forces(&stress, arm, slope, &follows, &between);
        let across = forces.across * (point.weight * slope);
        out.set_force(0, -across);
        out.set_force(2, across);
        for i in 0..2 {
            out.set_force(2 * i + 1, rotations[i].t.transpose_mul(forces.spin[i]) * point.weight);
        }
        if weight != 0.0 {
            let stress = geometric.unwrap_or(&stress);
            let forces = self.pair_forces(stress, arm, slope, &follows, &between);
            let stiffness = point.law.tangent(&elastic);
            let w = point.weight * weight;
            self.fill_pair_tangent(rotations, slope, &stiffness, stress, &forces, &follows, &between, w, out);
        }
    }

    /// The stress extrapolated over variations of displacements and rotation vectors, at the point
    /// half way between the nodes. It equals [`StiffnessPoint::extrapolated_stress`] in the frame
    /// of the element.
    #[inline(always)]
    pub fn extrapolated_half_way<L: SectionLaw<T>>(
        &self,
        rotations: &[Rotation<T>; N],
        point: &StiffnessPoint<N, T, L>,
        free: T,
        du: &[Vec3<T>; N],
        dp: &[Vec3<T>; N],
    ) -> Stress<T> {
        let slope = point.slope[1];
        let between = Between::new(self.half.rotation.p);
        let spins = [rotations[0].t * dp[0], rotations[1].t * dp[1]];
        let frame = self.half.follows(false) * spins[0] + self.half.follows(true) * spins[1];
        let mut strain = self.pair_strain(slope, &between);
        strain.gamma += self.frame.transpose_mul(du[1] - du[0]) * slope + self.arm(slope).cross(frame);
        strain.kappa += (between.inverse * spins[1] - between.inverse.transpose_mul(spins[0])) * slope;
        point.stress(&strain, free)
    }

    #[inline(always)]
    fn pair_strain(&self, slope: T, between: &Between<T>) -> Strain<T> {
        Strain { gamma: (self.nodes[1].u - self.nodes[0].u) * slope, kappa: between.phi * slope }
    }

    #[inline(always)]
    fn pair_forces(
        &self,
        stress: &Stress<T>,
        arm: Vec3<T>,
        slope: T,
        follows: &[Mat3<T>; 2],
        between: &Between<T>,
    ) -> PairForces<T> {
        let frame = stress.n.cross(arm);
        let moment = stress.m * slope;
        PairForces {
            across: self.frame * stress.n,
            frame,
            spin: [
                follows[0].transpose_mul(frame) - between.inverse * moment,
                follows[1].transpose_mul(frame) + between.inverse.transpose_mul(moment),
            ],
        }
    }

    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    fn fill_pair_tangent(
        &self,
        rotations: &[Rotation<T>; N],
        slope: T,
        stiffness: &Stiffness<T>,
        stress: &Stress<T>,
        forces: &PairForces<T>,
        follows: &[Mat3<T>; 2],
        between: &Between<T>,
        w: T,
        out: &mut ElementSystem<T>,
    ) {
        let arm = self.arm(slope);
        let ends = [&rotations[0].t, &rotations[1].t];
        // The weight multiplies each stiffness before any other product: stiff sections of short
        // elements would overflow otherwise.
        let cn = stiffness.cn * w;
        let cm = stiffness.cm * (w * slope * slope);
        let bent = w * slope;
        // F_i T_i and B_i T_i
        let frame = [follows[0] * *ends[0], follows[1] * *ends[1]];
        let bend = [-between.inverse.transpose_matmul(*ends[0]), between.inverse * *ends[1]];
        let g = ((stress.n * w).skew() - Mat3::skew_mul(arm, cn)).transpose();
        let s = -Mat3::skew_mul(arm, g).transpose();

        let xx = self.frame * (cn * (slope * slope)) * self.frame.transpose();
        let mut over_frame = [s * frame[0], s * frame[1]];
        let mut over_bend = [cm * bend[0], cm * bend[1]];
        let mut over_x = [g * frame[0], g * frame[1]];
        if let Some(cc) = stiffness.cc {
            let cc = cc * bent;
            let across = Mat3::skew_mul(arm, cc);
            for j in 0..2 {
                over_frame[j] -= across * bend[j];
                over_bend[j] += cc.transpose_matmul(Mat3::skew_mul(arm, frame[j]));
                over_x[j] += cc * bend[j];
            }
        }
        let m = stress.m * bent;
        let turned = self.half.turned(forces.frame * w);
        let twist = between.bend(m);
        let spun = [
            ends[0].transpose_matmul(turned[0].scale(0.5) + m.skew().scale(0.5) - twist),
            ends[1].transpose_matmul(turned[1].scale(0.5) + m.skew().scale(0.5) + twist),
        ];
        let apart = -xx;
        for j in 0..2 {
            let xp = self.frame * over_x[j] * slope;
            let xp = [-xp, xp];
            for i in 0..2 {
                out.set_symmetric(2 * i, 2 * j + 1, &xp[i]);
                out.set_tangent(2 * i, 2 * j, if i == j { &xx } else { &apart });
            }
            for i in 0..=j {
                let mut pp = frame[i].transpose_matmul(over_frame[j])
                    + bend[i].transpose_matmul(over_bend[j])
                    + spun[i] * bend[j];
                if i == j {
                    pp += rotations[i].c2(forces.spin[i] * w);
                }
                match i < j {
                    true => out.set_symmetric(2 * i + 1, 2 * j + 1, &pp),
                    false => out.set_tangent(2 * i + 1, 2 * j + 1, &pp),
                }
            }
        }
    }
}
