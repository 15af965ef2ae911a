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
    /// The strain that makes no stress, where there is one (natural curvature, thermal strain), for an amplitude of one
    pub free: Option<Strain>,
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

    /// Strain and stress at this point; `free` is the amplitude of the free strain.
    pub fn strain_and_stress<T: Real>(&self, nodes: &[NodeMotion<T>; N], free: f64) -> (Strain<T>, Stress<T>) {
        let strain = self.configuration(nodes).strain(self.tangent);
        (strain, self.stress(&strain, free))
    }

    /// The stress of a strain, less its free part.
    #[inline(always)]
    pub fn stress<T: Real>(&self, strain: &Strain<T>, free: f64) -> Stress<T> {
        self.stiffness.stress(&self.elastic_part(strain, free))
    }

    /// The strain less its free part.
    #[inline(always)]
    pub fn elastic_part<T: Real>(&self, strain: &Strain<T>, free: f64) -> Strain<T> {
        match &self.free {
            None => *strain,
            Some(own) => Strain {
                gamma: strain.gamma - Vec3::constant(own.gamma * free),
                kappa: strain.kappa - Vec3::constant(own.kappa * free),
            },
        }
    }

    /// How the strain varies with the nodes.
    #[inline(always)]
    pub fn strain_variation<T: Real>(
        &self,
        at: &Point<T>,
        du: impl Fn(usize) -> Vec3<T>,
        dp: impl Fn(usize) -> Vec3<T>,
    ) -> Strain<T> {
        let slopes = (interpolate(&self.slope, du), interpolate(&self.slope, &dp));
        at.strain_variation(slopes.0, slopes.1, interpolate(&self.shape, &dp))
    }

    /// The stress that a correction of the nodes is expected to lead to: C (strain + B dq).
    #[inline(always)]
    pub fn extrapolated_stress<T: Real>(
        &self,
        nodes: &[NodeMotion<T>; N],
        free: f64,
        du: impl Fn(usize) -> Vec3<T>,
        dp: impl Fn(usize) -> Vec3<T>,
    ) -> Stress<T> {
        let at = self.configuration(nodes);
        let strain = at.strain(self.tangent);
        let change = self.strain_variation(&at, du, dp);
        let next = Strain { gamma: strain.gamma + change.gamma, kappa: strain.kappa + change.kappa };
        self.stress(&next, free)
    }

    /// Adds the internal force and, where `weight` is not zero, `weight` times the stiffness. `geometric` is the
    /// stress of the geometric part, if it is not the present one.
    #[inline(always)]
    pub fn add_elastic<T: Real>(
        &self,
        nodes: &[NodeMotion<T>; N],
        free: f64,
        geometric: Option<&Stress<T>>,
        weight: f64,
        out: &mut ElementSystem<T>,
    ) {
        let at = self.configuration(nodes);
        let stress = self.stress(&at.strain(self.tangent), free);
        self.add_force(&at, &stress, out);
        if weight != 0.0 {
            self.add_tangent(&at, &self.stiffness, geometric.unwrap_or(&stress), weight, out);
        }
    }

    /// Adds the force of a stress.
    #[inline(always)]
    pub fn add_force<T: Real>(&self, at: &Point<T>, stress: &Stress<T>, out: &mut ElementSystem<T>) {
        let (force, w) = (at.force(stress), self.weight);
        for i in 0..N {
            let (n, s) = (self.shape[i] * w, self.slope[i] * w);
            out.add_force(2 * i, force.x_slope.scale(s));
            out.add_force(2 * i + 1, force.p.scale(n) + force.p_slope.scale(s));
        }
    }

    /// Adds `weight` times the tangent of a stiffness and of the geometric part of a stress.
    #[inline(always)]
    pub fn add_tangent<T: Real>(
        &self,
        at: &Point<T>,
        stiffness: &Stiffness,
        stress: &Stress<T>,
        weight: f64,
        out: &mut ElementSystem<T>,
    ) {
        self.add_stiffness(&at.tangent(stiffness, stress), self.weight * weight, out);
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
