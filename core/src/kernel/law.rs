//! Laws of sections: stress resultants, tangent and energy of strains, in space (equations (45) and
//! (46) of Makinen 2007) and in a plane.
//!
//! All vectors and tensors are material, with global components. Kernels give a law elastic
//! strains: the free strain of a point (natural curvature, thermal strain) makes no stress and is
//! subtracted first.

use crate::scalar::{LANES, Lanes, Pack, Real, pack};
use crate::tensor::{Mat3, Vec3};
use std::ops::Add;

/// Gamma (translational strain, 1) and K (change of curvature, 1/length), both material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strain<T = f64> {
    /// Gamma = R^T x' - E1
    pub gamma: Vec3<T>,
    /// K = T P'
    pub kappa: Vec3<T>,
}

/// The stress resultants N (force) and M (moment), both material.
#[derive(Clone, Copy, Debug)]
pub struct Stress<T = f64> {
    /// N, force
    pub n: Vec3<T>,
    /// M, force times length
    pub m: Vec3<T>,
}

impl<T: Real> Stress<T> {
    /// The components of N, then of M.
    #[inline(always)]
    pub fn components(&self) -> [T; 6] {
        let Self { n, m } = self;
        [n.0[0], n.0[1], n.0[2], m.0[0], m.0[1], m.0[2]]
    }
}

/// The tangent of a law in global components: dN = Cn dGamma + Cc dK, dM = Cc^T dGamma + Cm dK.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiffness<T = f64> {
    /// Cn, symmetric; force. R0 diag(EA, GA2, GA3) R0^T where strains do not couple
    pub cn: Mat3<T>,
    /// Cm, symmetric; force times length squared. R0 diag(GJ, EI2, EI3) R0^T where curvatures do
    /// not couple
    pub cm: Mat3<T>,
    /// Cc, the coupling of strain and curvature, where there is one; force times length
    pub cc: Option<Mat3<T>>,
}

/// In-plane strain: Gamma along the two axes of the plane, and K about its normal.
pub type PlanarStrain<T> = [T; 3];

/// In-plane stress: N along the two axes of the plane, and M about its normal.
pub type PlanarStress<T> = [T; 3];

/// The tangent of a law in the axes of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarStiffness<T = f64> {
    /// Cn: its two diagonal entries, then the entry beside the diagonal
    pub cn: [T; 3],
    /// Cm: bending stiffness about the normal of the plane
    pub cm: T,
    /// Cc: the coupling of strain and curvature; `None` where the section does not couple them
    pub cc: Option<[T; 2]>,
}

/// The constitutive law of a section in space.
pub trait SectionLaw<T: Real>: Copy {
    /// Stress resultants: the derivatives of the energy over the strain.
    fn stress(&self, elastic: &Strain<T>) -> Stress<T>;

    /// Derivatives of the stress resultants over the strain.
    fn tangent(&self, elastic: &Strain<T>) -> Stiffness<T>;

    /// Strain energy per initial length.
    fn energy(&self, elastic: &Strain<T>) -> T;

    /// The tangent of a section without elastic strain.
    #[inline(always)]
    fn stiffness_at_rest(&self) -> Stiffness<T> {
        self.tangent(&Strain { gamma: Vec3::zero(), kappa: Vec3::zero() })
    }
}

/// The constitutive law of a section in a plane.
pub trait PlanarLaw<T: Real>: Copy {
    /// Stress resultants: the derivatives of the energy over the in-plane strain.
    fn stress(&self, elastic: &PlanarStrain<T>) -> PlanarStress<T>;

    /// Derivatives of the stress resultants over the strain.
    fn tangent(&self, elastic: &PlanarStrain<T>) -> PlanarStiffness<T>;
}

/// A law in the form that elements store: plain `f64` numbers, packed into lanes or planes on
/// demand.
pub trait StoredLaw: SectionLaw<f64> + Pack<Packed = Self::Lifted<Lanes>> {
    /// The law over another scalar.
    type Lifted<T: Real>: SectionLaw<T>;
    /// The law restricted to a plane.
    type InPlane: PlanarLaw<f64> + Pack<Packed: PlanarLaw<Lanes>>;

    /// A copy of the law whose numbers are constants of another scalar, say dual numbers.
    fn lifted<T: Real>(&self) -> Self::Lifted<T>;

    /// The law of strains in the plane with these axes (columns, the third one normal), for a
    /// section that the plane mirrors.
    fn in_plane(&self, axes: &Mat3) -> Self::InPlane;

    /// Calls `show` with stiffness tensors that carry the directions of the law: a reflection that
    /// leaves all of them unchanged leaves the law unchanged.
    fn show_directions(&self, show: &mut dyn FnMut(&Stiffness));
}

/// A linear elastic section: N = Cn Gamma + Cc K, M = Cc^T Gamma + Cm K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear<T = f64> {
    /// The tangent, constant over strains
    pub stiffness: Stiffness<T>,
}

/// A linear elastic section in a plane: N = Cn Gamma + Cc K, M = Cc.Gamma + Cm K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarLinear<T = f64> {
    /// The tangent, constant over strains
    pub stiffness: PlanarStiffness<T>,
}

impl<T: Real> Stiffness<T> {
    /// The change of stress resultants with a change of strain.
    #[inline(always)]
    pub fn stress(&self, strain: &Strain<T>) -> Stress<T> {
        let mut stress = Stress { n: self.cn * strain.gamma, m: self.cm * strain.kappa };
        if let Some(cc) = self.cc {
            stress.n += cc * strain.kappa;
            stress.m += cc.transpose_mul(strain.gamma);
        }
        stress
    }
}

impl<T: Real> PlanarStiffness<T> {
    /// The change of stress resultants with a change of strain.
    #[inline(always)]
    pub fn stress(&self, strain: &PlanarStrain<T>) -> PlanarStress<T> {
        let [x, y, kappa] = *strain;
        let [c1, c2, c12] = self.cn;
        let mut stress = [c1 * x + c12 * y, c12 * x + c2 * y, self.cm * kappa];
        if let Some([a, b]) = self.cc {
            stress[0] += a * kappa;
            stress[1] += b * kappa;
            stress[2] += a * x + b * y;
        }
        stress
    }
}

impl Stiffness {
    /// The stiffness against strains in the plane with these axes (columns, the third one normal).
    pub fn in_plane(&self, axes: &Mat3) -> PlanarStiffness {
        let normal = axes.column(2);
        let inside = |v: Vec3| axes.transpose_mul(v).0;
        let [cn1, cn2] = [0, 1].map(|k| inside(self.cn * axes.column(k)));
        PlanarStiffness {
            cn: [cn1[0], cn2[1], cn2[0]],
            cm: normal.dot(self.cm * normal),
            cc: self.cc.map(|cc| {
                let [x, y, _] = inside(cc * normal);
                [x, y]
            }),
        }
    }
}

impl<T: Real> SectionLaw<T> for Linear<T> {
    #[inline(always)]
    fn stress(&self, elastic: &Strain<T>) -> Stress<T> {
        self.stiffness.stress(elastic)
    }

    #[inline(always)]
    fn tangent(&self, _elastic: &Strain<T>) -> Stiffness<T> {
        self.stiffness
    }

    #[inline(always)]
    fn energy(&self, elastic: &Strain<T>) -> T {
        let stress = self.stress(elastic);
        (elastic.gamma.dot(stress.n) + elastic.kappa.dot(stress.m)) * 0.5
    }
}

impl<T: Real> PlanarLaw<T> for PlanarLinear<T> {
    #[inline(always)]
    fn stress(&self, elastic: &PlanarStrain<T>) -> PlanarStress<T> {
        self.stiffness.stress(elastic)
    }

    #[inline(always)]
    fn tangent(&self, _elastic: &PlanarStrain<T>) -> PlanarStiffness<T> {
        self.stiffness
    }
}

impl StoredLaw for Linear {
    type Lifted<T: Real> = Linear<T>;
    type InPlane = PlanarLinear;

    #[inline(always)]
    fn lifted<T: Real>(&self) -> Linear<T> {
        let Stiffness { cn, cm, cc } = &self.stiffness;
        let cc = cc.map(Mat3::constant);
        Linear { stiffness: Stiffness { cn: Mat3::constant(*cn), cm: Mat3::constant(*cm), cc } }
    }

    fn in_plane(&self, axes: &Mat3) -> PlanarLinear {
        PlanarLinear { stiffness: self.stiffness.in_plane(axes) }
    }

    fn show_directions(&self, show: &mut dyn FnMut(&Stiffness)) {
        show(&self.stiffness);
    }
}

impl<T: Real> Add for Strain<T> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { gamma: self.gamma + other.gamma, kappa: self.kappa + other.kappa }
    }
}

impl<T: Real> Add for Stress<T> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { n: self.n + other.n, m: self.m + other.m }
    }
}

impl Default for Strain {
    fn default() -> Self {
        Self { gamma: Vec3::ZERO, kappa: Vec3::ZERO }
    }
}

impl Pack for Strain {
    type Packed = Strain<Lanes>;

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Self::Packed {
        Strain { gamma: pack!(of.gamma), kappa: pack!(of.kappa) }
    }
}

impl Pack for Stiffness {
    type Packed = Stiffness<Lanes>;

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Self::Packed {
        Stiffness { cn: pack!(of.cn), cm: pack!(of.cm), cc: pack!(of.cc) }
    }
}

impl Pack for PlanarStiffness {
    type Packed = PlanarStiffness<Lanes>;

    fn pack(of: [&Self; LANES]) -> Self::Packed {
        PlanarStiffness { cn: pack!(of.cn), cm: pack!(of.cm), cc: pack!(of.cc) }
    }
}

impl Pack for Linear {
    type Packed = Linear<Lanes>;

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Self::Packed {
        Linear { stiffness: pack!(of.stiffness) }
    }
}

impl Pack for PlanarLinear {
    type Packed = PlanarLinear<Lanes>;

    fn pack(of: [&Self; LANES]) -> Self::Packed {
        PlanarLinear { stiffness: pack!(of.stiffness) }
    }
}
