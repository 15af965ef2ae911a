//! Beam elements of N nodes: interpolation, and the sums over Gauss points.

use super::elastic::{Point, PointTangent, Stiffness, Strain, Stress};
use super::element::{ElementSystem, NodeMotion};
use crate::real::Real;
use crate::tensor::Vec3;

/// An integration point for internal forces.
#[derive(Clone, Copy, Debug)]
pub struct StiffnessPoint<const N: usize> {
    /// Shape functions
    pub shape: [f64; N],
    /// Their derivatives over initial arc length
    pub slope: [f64; N],
    /// Gauss weight times ds/dxi
    pub weight: f64,
    /// E1, the unit tangent of the initial centre line
    pub tangent: Vec3,
    /// The section in global components
    pub stiffness: Stiffness,
}

/// sum_i N_i v_i
#[inline(always)]
pub fn interpolate<T: Real, const N: usize>(shape: &[f64; N], value: impl Fn(usize) -> Vec3<T>) -> Vec3<T> {
    let mut sum = value(0).scale(shape[0]);
    for (i, &n) in shape.iter().enumerate().skip(1) {
        sum += value(i).scale(n);
    }
    sum
}

impl<const N: usize> StiffnessPoint<N> {
    /// The configuration at this point; x' = E1 + sum N_i' u_i.
    #[inline(always)]
    pub fn configuration<T: Real>(&self, nodes: &[NodeMotion<T>; N]) -> Point<T> {
        let p = interpolate(&self.shape, |i| nodes[i].p);
        let p_slope = interpolate(&self.slope, |i| nodes[i].p);
        let x_slope = Vec3::constant(self.tangent) + interpolate(&self.slope, |i| nodes[i].u);
        Point::new(p, p_slope, x_slope)
    }

    /// Strain and stress at this point.
    pub fn strain_and_stress<T: Real>(&self, nodes: &[NodeMotion<T>; N]) -> (Strain<T>, Stress<T>) {
        let strain = self.configuration(nodes).strain(self.tangent);
        (strain, self.stiffness.stress(&strain))
    }

    /// The stress that a correction of the nodes is expected to lead to: C (strain + B dq).
    #[inline(always)]
    pub fn extrapolated_stress<T: Real>(
        &self,
        nodes: &[NodeMotion<T>; N],
        du: impl Fn(usize) -> Vec3<T>,
        dp: impl Fn(usize) -> Vec3<T>,
    ) -> Stress<T> {
        let at = self.configuration(nodes);
        let strain = at.strain(self.tangent);
        let change = at.strain_variation(
            interpolate(&self.slope, &du),
            interpolate(&self.slope, &dp),
            interpolate(&self.shape, &dp),
        );
        self.stiffness.stress(&Strain { gamma: strain.gamma + change.gamma, kappa: strain.kappa + change.kappa })
    }

    /// Adds the internal force and, where `weight` is not zero, `weight` times the stiffness. `geometric` is the
    /// stress of the geometric part, if it is not the present one.
    #[inline(always)]
    pub fn add_elastic<T: Real>(
        &self,
        nodes: &[NodeMotion<T>; N],
        geometric: Option<&Stress<T>>,
        weight: f64,
        out: &mut ElementSystem<T>,
    ) {
        let at = self.configuration(nodes);
        let stress = self.stiffness.stress(&at.strain(self.tangent));
        let force = at.force(&stress);
        let w = self.weight;
        for i in 0..N {
            let (n, s) = (self.shape[i] * w, self.slope[i] * w);
            out.add_force(2 * i, force.x_slope.scale(s));
            out.add_force(2 * i + 1, force.p.scale(n) + force.p_slope.scale(s));
        }
        if weight != 0.0 {
            let tangent = at.tangent(&self.stiffness, geometric.unwrap_or(&stress));
            self.add_stiffness(&tangent, w * weight, out);
        }
    }

    /// Adds w times the blocks of every pair of nodes, using the symmetry of the stiffness.
    #[inline(always)]
    fn add_stiffness<T: Real>(&self, k: &PointTangent<T>, w: f64, out: &mut ElementSystem<T>) {
        let (n, s) = (&self.shape, &self.slope);
        for i in 0..N {
            for j in 0..N {
                let mut up = k.xp.scale(w * s[i] * n[j]);
                if let Some(xs) = k.xs {
                    up += xs.scale(w * s[i] * s[j]);
                }
                out.add_tangent(2 * i, 2 * j + 1, up);
                out.add_tangent(2 * j + 1, 2 * i, up.transpose());
                if j < i {
                    continue;
                }
                let uu = k.xx.scale(w * s[i] * s[j]);
                let pp = k.ss.scale(w * s[i] * s[j])
                    + k.sp.scale(w * s[i] * n[j])
                    + k.sp.transpose().scale(w * n[i] * s[j])
                    + k.pp.scale(w * n[i] * n[j]);
                out.add_tangent(2 * i, 2 * j, uu);
                out.add_tangent(2 * i + 1, 2 * j + 1, pp);
                if j > i {
                    out.add_tangent(2 * j, 2 * i, uu.transpose());
                    out.add_tangent(2 * j + 1, 2 * i + 1, pp.transpose());
                }
            }
        }
    }
}
