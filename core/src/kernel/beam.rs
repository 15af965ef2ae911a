//! Beam elements of N nodes: interpolation, and the sums over Gauss points.

use super::elastic::{Point, PointTangent};
use super::element::{ElementSystem, Placed};
use super::law::{Linear, SectionLaw, Stiffness, StoredLaw, Strain, Stress};
use crate::scalar::{LANES, Lanes, Pack, Real, pack};
use crate::tensor::Vec3;

/// An integration point for internal forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StiffnessPoint<const N: usize, T = f64, L = Linear<T>> {
    /// Shape functions
    pub shape: [T; N],
    /// Derivatives of the shape functions over initial arc length, 1/length
    pub slope: [T; N],
    /// Gauss weight times ds/dxi, a length
    pub weight: T,
    /// E1, the unit tangent of the initial centre line
    pub tangent: Vec3<T>,
    /// The law of the section in global components
    pub law: L,
    /// Free strain (natural curvature, thermal strain), which makes no stress, at an amplitude of
    /// one; material. `None` where there is none
    pub free: Option<Strain<T>>,
}

/// sum_i N_i v_i
#[inline(always)]
pub fn interpolate<T: Real, const N: usize>(shape: &[T; N], value: impl Fn(usize) -> Vec3<T>) -> Vec3<T> {
    let mut sum = value(0) * shape[0];
    for i in 1..N {
        sum += value(i) * shape[i];
    }
    sum
}

impl<const N: usize, L: StoredLaw> StiffnessPoint<N, f64, L> {
    /// A copy of this point whose numbers are constants of another scalar, say dual numbers.
    #[inline(always)]
    pub fn lifted<T: Real>(&self) -> StiffnessPoint<N, T, L::Lifted<T>> {
        let mut shape = [T::zero(); N];
        let mut slope = [T::zero(); N];
        for i in 0..N {
            shape[i] = T::constant(self.shape[i]);
            slope[i] = T::constant(self.slope[i]);
        }
        let free = match &self.free {
            None => None,
            Some(own) => Some(Strain { gamma: Vec3::constant(own.gamma), kappa: Vec3::constant(own.kappa) }),
        };
        StiffnessPoint {
            shape,
            slope,
            weight: T::constant(self.weight),
            tangent: Vec3::constant(self.tangent),
            law: self.law.lifted(),
            free,
        }
    }
}

impl<const N: usize, L: StoredLaw> Pack for StiffnessPoint<N, f64, L> {
    type Packed = StiffnessPoint<N, Lanes, L::Lifted<Lanes>>;

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Self::Packed {
        StiffnessPoint {
            shape: pack!(of.shape),
            slope: pack!(of.slope),
            weight: pack!(of.weight),
            tangent: pack!(of.tangent),
            law: pack!(of.law),
            free: pack!(of.free),
        }
    }
}

impl<const N: usize, T: Real, L: SectionLaw<T>> StiffnessPoint<N, T, L> {
    /// Moves the point to an element that is `times` as long: derivatives shrink, the weight grows.
    #[inline(always)]
    pub fn lengthen(&mut self, times: T) {
        let inverse = T::one() / times;
        for i in 0..N {
            self.slope[i] = self.slope[i] * inverse;
        }
        self.weight = self.weight * times;
    }

    /// The configuration at this point; x' = E1 + sum N_i' u_i.
    #[inline(always)]
    pub fn configuration(&self, nodes: &[impl Placed<T>; N]) -> Point<T> {
        let p = interpolate(&self.shape, |i| nodes[i].place().p);
        let p_slope = interpolate(&self.slope, |i| nodes[i].place().p);
        let x_slope = self.tangent + interpolate(&self.slope, |i| nodes[i].place().u);
        Point::new(p, p_slope, x_slope)
    }

    /// Strain and stress at this point; `free` is the amplitude of the free strain.
    #[inline(always)]
    pub fn strain_and_stress(&self, nodes: &[impl Placed<T>; N], free: T) -> (Strain<T>, Stress<T>) {
        let strain = self.configuration(nodes).strain(self.tangent);
        (strain, self.stress(&strain, free))
    }

    /// The strain less its free part at this point; `free` is the amplitude of the free strain.
    #[inline(always)]
    pub fn elastic_strain(&self, nodes: &[impl Placed<T>; N], free: T) -> Strain<T> {
        self.elastic_part(&self.configuration(nodes).strain(self.tangent), free)
    }

    /// The strain energy of this point, its weight included; `free` is the amplitude of the free
    /// strain.
    #[inline(always)]
    pub fn energy(&self, nodes: &[impl Placed<T>; N], free: T) -> T {
        self.law.energy(&self.elastic_strain(nodes, free)) * self.weight
    }

    /// The stress resultants of a total strain: the law sees the strain less its free part. `free`
    /// is the amplitude of the free strain.
    #[inline(always)]
    pub fn stress(&self, strain: &Strain<T>, free: T) -> Stress<T> {
        self.law.stress(&self.elastic_part(strain, free))
    }

    /// The elastic strain: the total strain less the free strain times its amplitude `free`.
    #[inline(always)]
    pub fn elastic_part(&self, strain: &Strain<T>, free: T) -> Strain<T> {
        match &self.free {
            None => *strain,
            Some(own) => Strain { gamma: strain.gamma - own.gamma * free, kappa: strain.kappa - own.kappa * free },
        }
    }

    /// The variation of the strain (material) when node i varies by the displacement `du(i)` and
    /// the rotation vector `dp(i)`.
    #[inline(always)]
    pub fn strain_variation(
        &self,
        at: &Point<T>,
        du: impl Fn(usize) -> Vec3<T>,
        dp: impl Fn(usize) -> Vec3<T>,
    ) -> Strain<T> {
        let slopes = (interpolate(&self.slope, du), interpolate(&self.slope, &dp));
        at.strain_variation(slopes.0, slopes.1, interpolate(&self.shape, &dp))
    }

    /// The stress resultants extrapolated over a correction of the nodes: those of the linearised
    /// strain, strain + B dq.
    #[inline(always)]
    pub fn extrapolated_stress(
        &self,
        nodes: &[impl Placed<T>; N],
        free: T,
        du: impl Fn(usize) -> Vec3<T>,
        dp: impl Fn(usize) -> Vec3<T>,
    ) -> Stress<T> {
        let at = self.configuration(nodes);
        let strain = at.strain(self.tangent);
        self.stress(&(strain + self.strain_variation(&at, du, dp)), free)
    }

    /// Adds the internal force and, where `weight` is not zero, `weight` times the stiffness.
    ///
    /// `free` is the amplitude of the free strain; `geometric` the stress of the geometric part, if
    /// it is not the stress of this configuration.
    #[inline(always)]
    pub fn add_elastic(
        &self,
        nodes: &[impl Placed<T>; N],
        free: T,
        geometric: Option<&Stress<T>>,
        weight: f64,
        out: &mut ElementSystem<T>,
    ) {
        let at = self.configuration(nodes);
        let elastic = self.elastic_part(&at.strain(self.tangent), free);
        let stress = self.law.stress(&elastic);
        self.add_force(&at, &stress, out);
        if weight != 0.0 {
            self.add_tangent(&at, &self.law.tangent(&elastic), geometric.unwrap_or(&stress), weight, out);
        }
    }

    /// Adds the nodal forces of a stress, (77).
    #[inline(always)]
    pub fn add_force(&self, at: &Point<T>, stress: &Stress<T>, out: &mut ElementSystem<T>) {
        let force = at.force(stress);
        let w = self.weight;
        for i in 0..N {
            let n = self.shape[i] * w;
            let s = self.slope[i] * w;
            out.add_force(2 * i, force.x_slope * s);
            out.add_force(2 * i + 1, force.p * n + force.p_slope * s);
        }
    }

    /// Adds `weight` times the tangent of a stiffness and of the geometric part of a stress.
    #[inline(always)]
    pub fn add_tangent(
        &self,
        at: &Point<T>,
        stiffness: &Stiffness<T>,
        stress: &Stress<T>,
        weight: f64,
        out: &mut ElementSystem<T>,
    ) {
        self.add_stiffness(&at.tangent(stiffness, stress), self.weight * weight, out);
    }

    /// Adds w times the blocks of every pair of nodes, using the symmetry of the stiffness.
    #[inline(always)]
    fn add_stiffness(&self, k: &PointTangent<T>, w: T, out: &mut ElementSystem<T>) {
        let n = &self.shape;
        let s = &self.slope;
        for i in 0..N {
            for j in 0..N {
                let mut up = k.xp * (w * s[i] * n[j]);
                if let Some(xs) = k.xs {
                    up += xs * (w * s[i] * s[j]);
                }
                out.add_symmetric(2 * i, 2 * j + 1, &up);
                if j < i {
                    continue;
                }
                let uu = k.xx * (w * s[i] * s[j]);
                let pp = k.ss * (w * s[i] * s[j])
                    + k.sp * (w * s[i] * n[j])
                    + k.sp.transpose() * (w * n[i] * s[j])
                    + k.pp * (w * n[i] * n[j]);
                match j > i {
                    true => {
                        out.add_symmetric(2 * i, 2 * j, &uu);
                        out.add_symmetric(2 * i + 1, 2 * j + 1, &pp);
                    }
                    false => {
                        out.add_tangent(2 * i, 2 * j, uu);
                        out.add_tangent(2 * i + 1, 2 * j + 1, pp);
                    }
                }
            }
        }
    }
}
