//! Laws of sections: stress, tangent and energy against automatic differentiation, and the form in a plane against that in space.
//!
//! [`Stiffening`] is not linear, so that the tests of the kernels see whether these show their law the right strain.

use crate::dual::{Dual, jacobian, variables};
use crate::random::Random;
use crate::tangents::{agree, entries, flat, symmetric};
use beamsim_core::kernel::beam::StiffnessPoint;
use beamsim_core::kernel::law::{
    Linear, PlanarLaw, PlanarLinear, PlanarStiffness, PlanarStrain, PlanarStress, SectionLaw, Stiffness, StoredLaw,
    Strain, Stress,
};
use beamsim_core::scalar::{LANES, Lanes, Pack, Real};
use beamsim_core::system::Plane;
use beamsim_core::tensor::{Mat3, Vec3};

/// Derivatives over the six strains.
type Wide = Dual<6>;

/// A law with the energy U + growth U^2, U that of a linear section.
#[derive(Clone, Copy, Debug)]
pub struct Stiffening<T = f64> {
    linear: Linear<T>,
    growth: T,
}

/// [`Stiffening`] in a plane.
#[derive(Clone, Copy, Debug)]
pub struct PlanarStiffening<T = f64> {
    linear: PlanarLinear<T>,
    growth: T,
}

/// The point with a law that is not linear.
pub fn stiffening<const N: usize>(point: &StiffnessPoint<N>) -> StiffnessPoint<N, f64, Stiffening> {
    StiffnessPoint {
        shape: point.shape,
        slope: point.slope,
        weight: point.weight,
        tangent: point.tangent,
        law: Stiffening { linear: point.law, growth: 0.3 },
        free: point.free,
    }
}

impl<T: Real> Stiffening<T> {
    /// The derivative of the energy over U.
    fn factor(&self, elastic: &Strain<T>) -> T {
        T::one() + self.growth * self.linear.energy(elastic) * 2.0
    }
}

impl<T: Real> SectionLaw<T> for Stiffening<T> {
    fn stress(&self, elastic: &Strain<T>) -> Stress<T> {
        let Stress { n, m } = self.linear.stress(elastic);
        let factor = self.factor(elastic);
        Stress { n: n * factor, m: m * factor }
    }

    fn tangent(&self, elastic: &Strain<T>) -> Stiffness<T> {
        let Stiffness { cn, cm, cc } = self.linear.tangent(elastic);
        let Stress { n, m } = self.linear.stress(elastic);
        let factor = self.factor(elastic);
        let twice = self.growth * 2.0;
        let coupling = n.outer(m) * twice;
        Stiffness {
            cn: cn * factor + n.outer(n) * twice,
            cm: cm * factor + m.outer(m) * twice,
            cc: Some(cc.map_or(coupling, |cc| cc * factor + coupling)),
        }
    }

    fn energy(&self, elastic: &Strain<T>) -> T {
        let energy = self.linear.energy(elastic);
        energy + self.growth * energy * energy
    }
}

impl<T: Real> PlanarStiffening<T> {
    /// The derivative of the energy over U.
    fn factor(&self, elastic: &PlanarStrain<T>) -> T {
        let [n1, n2, m] = self.linear.stress(elastic);
        let [x, y, kappa] = *elastic;
        T::one() + self.growth * (n1 * x + n2 * y + m * kappa)
    }
}

impl<T: Real> PlanarLaw<T> for PlanarStiffening<T> {
    fn stress(&self, elastic: &PlanarStrain<T>) -> PlanarStress<T> {
        let factor = self.factor(elastic);
        self.linear.stress(elastic).map(|component| component * factor)
    }

    fn tangent(&self, elastic: &PlanarStrain<T>) -> PlanarStiffness<T> {
        let PlanarStiffness { cn: [c1, c2, c12], cm, cc } = self.linear.tangent(elastic);
        let [n1, n2, m] = self.linear.stress(elastic);
        let factor = self.factor(elastic);
        let twice = self.growth * 2.0;
        let [a, b] = cc.unwrap_or([T::zero(); 2]);
        PlanarStiffness {
            cn: [c1 * factor + n1 * n1 * twice, c2 * factor + n2 * n2 * twice, c12 * factor + n1 * n2 * twice],
            cm: cm * factor + m * m * twice,
            cc: Some([a * factor + n1 * m * twice, b * factor + n2 * m * twice]),
        }
    }
}

impl StoredLaw for Stiffening {
    type Lifted<T: Real> = Stiffening<T>;
    type InPlane = PlanarStiffening;

    fn lifted<T: Real>(&self) -> Stiffening<T> {
        Stiffening { linear: self.linear.lifted(), growth: T::constant(self.growth) }
    }

    fn in_plane(&self, axes: &Mat3) -> PlanarStiffening {
        PlanarStiffening { linear: self.linear.in_plane(axes), growth: self.growth }
    }

    fn show_directions(&self, show: &mut dyn FnMut(&Stiffness)) {
        self.linear.show_directions(show);
    }
}

impl Pack for Stiffening {
    type Packed = Stiffening<Lanes>;

    fn pack(of: [&Self; LANES]) -> Self::Packed {
        Stiffening { linear: Pack::pack(of.map(|law| &law.linear)), growth: Pack::pack(of.map(|law| &law.growth)) }
    }
}

impl Pack for PlanarStiffening {
    type Packed = PlanarStiffening<Lanes>;

    fn pack(of: [&Self; LANES]) -> Self::Packed {
        PlanarStiffening {
            linear: Pack::pack(of.map(|law| &law.linear)),
            growth: Pack::pack(of.map(|law| &law.growth)),
        }
    }
}

/// The tangent by rows, strains before curvatures.
fn rows(stiffness: &Stiffness) -> Vec<f64> {
    let coupling = stiffness.cc.unwrap_or(Mat3::ZERO);
    let mut all: Vec<f64> = Vec::new();
    for i in 0..3 {
        all.extend(stiffness.cn.0[i]);
        all.extend(coupling.0[i]);
    }
    for i in 0..3 {
        all.extend(coupling.column(i).0);
        all.extend(stiffness.cm.0[i]);
    }
    all
}

fn derivatives_hold(what: &str, law: &impl StoredLaw, random: &mut Random) {
    for size in [0.0, 0.1, 1.0] {
        let strain = Strain { gamma: random.cube(size), kappa: random.cube(size) };
        let what = format!("{what} at {strain:?}");
        let moving: Strain<Wide> = Strain { gamma: variables(strain.gamma, 0), kappa: variables(strain.kappa, 3) };
        let lifted = law.lifted::<Wide>();
        let stress = law.stress(&strain);
        let energy = lifted.energy(&moving);
        agree(&format!("energy, {what}"), &[law.energy(&strain)], &[energy.value], 1e-15);
        agree(&format!("stress, {what}"), &flat(&[stress.n, stress.m]), &energy.partials, 1e-14);
        let tangent = law.tangent(&strain);
        let Stress { n, m } = lifted.stress(&moving);
        let coupling = tangent.cc.unwrap_or(Mat3::ZERO);
        for (block, got, exact) in [
            ("Cn", tangent.cn, jacobian(n, 0)),
            ("Cc", coupling, jacobian(n, 3)),
            ("Cc^T", coupling.transpose(), jacobian(m, 0)),
            ("Cm", tangent.cm, jacobian(m, 3)),
        ] {
            agree(&format!("{block}, {what}"), &entries(got), &entries(exact), 1e-14);
        }
        symmetric(&what, &rows(&tangent), 1e-15);
        if size == 0.0 {
            agree(&format!("at rest, {what}"), &rows(&law.stiffness_at_rest()), &rows(&tangent), 0.0);
        }
    }
}

#[test]
fn tangents_and_stresses_are_derivatives() {
    let mut random = Random::new(41);
    for coupled in [false, true] {
        let coupling = random.tensor(0.4);
        let cn = random.positive_definite();
        let cm = random.positive_definite();
        let linear = Linear { stiffness: Stiffness { cn, cm, cc: coupled.then_some(coupling) } };
        derivatives_hold(&format!("linear, coupled: {coupled}"), &linear, &mut random);
        let stiffening = Stiffening { linear, growth: 0.3 };
        derivatives_hold(&format!("stiffening, coupled: {coupled}"), &stiffening, &mut random);
    }
}

fn plane_holds(what: &str, law: &impl StoredLaw, plane: &Plane, random: &mut Random) {
    let axes = plane.axes();
    let planar = law.in_plane(axes);
    for size in [0.0, 0.1, 1.0] {
        let [x, y, kappa] = random.cube(size).0;
        let strain = Strain { gamma: *axes * Vec3([x, y, 0.0]), kappa: plane.normal() * kappa };
        let what = format!("{what} at {x}, {y}, {kappa}");
        let Stress { n, m } = law.stress(&strain);
        let exact = [axes.column(0).dot(n), axes.column(1).dot(n), axes.column(2).dot(m)];
        agree(&format!("stress, {what}"), &planar.stress(&[x, y, kappa]), &exact, 1e-14);
        let all = |PlanarStiffness { cn, cm, cc }: PlanarStiffness| {
            let [a, b] = cc.unwrap_or([0.0; 2]);
            [cn[0], cn[1], cn[2], cm, a, b]
        };
        let exact = all(law.tangent(&strain).in_plane(axes));
        agree(&format!("tangent, {what}"), &all(planar.tangent(&[x, y, kappa])), &exact, 1e-14);
    }
}

#[test]
fn laws_in_a_plane_are_those_of_space() {
    let mut random = Random::new(42);
    let plane = Plane::normal_to(Vec3([0.36, 0.48, 0.8])).expect("a plane");
    let turned = |m: Mat3| *plane.axes() * m * plane.axes().transpose();
    let cn = turned(Mat3([[9.0, 0.7, 0.0], [0.7, 5.0, 0.0], [0.0, 0.0, 4.0]]));
    let cm = turned(Mat3([[2.0, 0.3, 0.0], [0.3, 3.0, 0.0], [0.0, 0.0, 7.0]]));
    let coupling = turned(Mat3([[0.0, 0.0, 0.4], [0.0, 0.0, -0.6], [0.0, 0.0, 0.0]]));
    for cc in [None, Some(coupling)] {
        let linear = Linear { stiffness: Stiffness { cn, cm, cc } };
        let coupled = cc.is_some();
        plane_holds(&format!("linear, coupled: {coupled}"), &linear, &plane, &mut random);
        let stiffening = Stiffening { linear, growth: 0.3 };
        plane_holds(&format!("stiffening, coupled: {coupled}"), &stiffening, &plane, &mut random);
    }
}
