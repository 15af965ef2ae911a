//! Strains and stress resultants at any place of a beam element.
//!
//! An element knows them best at its integration points. Between these and beyond them resultants
//! follow balance (material components, R' = R K~, y = R^T x'), so that the moment at a clamp is
//! that of its reaction:
//!
//! ```text
//! N' = -K x N - p,   M' = -K x M - y x N
//! N(s) = sum L_g(s) exp(-theta_g) N_g,   theta_g = integral from s_g to s of K ds
//! M(s) = sum L_g(s) (M_g + integral from s_g to s of M' ds)
//! ```
//!
//! L_g are the polynomials that are one at point g and zero at the others. K and M' are known at the
//! points, and follow the polynomials through them. Forces p and moments per length, with those of
//! inertia, enter through the differences between the points, where there are several. The single
//! point of an element of two nodes shows neither: p is taken from the jumps of N at its nodes,
//! moments per length are left out. Moments at its ends are those of the point and of N, since loads
//! act at the nodes:
//!
//! ```text
//! N(s) -= p s,   M(s) += y x p (s^2 - h^2/4) / 2     s from the middle, h the length
//! ```

use super::element::{ElasticElement, ElasticPoint};
use super::interpolation::{Interpolation, View};
use crate::kernel::NodePlace;
use crate::kernel::law::{Strain, Stress};
use crate::kernel::shape::{gauss, lagrange};
use crate::rotation::Rotation;
use crate::scalar::Rate;
use crate::system::State;
use crate::tensor::Vec3;

type Vector6 = nalgebra::Vector6<f64>;

/// Strains and stress resultants of an element at one state (material, global components).
#[derive(Clone, Debug)]
pub struct ElementStresses {
    /// Coordinates of the integration points on [-1, 1]
    xi: Vec<f64>,
    /// The amplitude of the free strain
    pub(crate) free_amplitude: f64,
    points: Vec<StressedPoint>,
}

/// An integration point.
#[derive(Clone, Debug)]
struct StressedPoint {
    /// Gamma and K. Rates hold what is of first order in the displacements of a linear stage as their
    /// rate, which is zero in other stages
    strain: Strain<Rate>,
    /// Elastic stress
    elastic: Stress<Rate>,
    /// Stress of strain-rate damping
    damping: Stress<Rate>,
    /// y less Gamma: the unit tangent of the initial centre line
    tangent: Vec3,
    /// Initial length over xi
    stretch: f64,
}

impl ElementStresses {
    /// Strain and elastic stress at the integration points.
    pub fn at_points(&self) -> Vec<(Strain, Stress)> {
        let of_point = |point: &StressedPoint| (point.strain_now(), stress_of(&now(&point.elastic)));
        self.points.iter().map(of_point).collect()
    }

    /// Strain and elastic stress at `xi` on [-1, 1], under the force per length `along`, which is
    /// zero for elements with several points. The strain is that of the polynomial through the integration points,
    /// which does not know how the section varies.
    pub fn at(&self, xi: f64, along: Vec3) -> (Strain, Stress) {
        let share = |g: usize| lagrange(&self.xi, g, xi);
        let each = || self.points.iter().enumerate();
        let elastic: Vector6 = each().map(|(g, point)| now(&point.elastic) * share(g)).sum();
        let change = match &self.points[..] {
            [point] => point.elastic_part(&(self.change(0, xi) + point.change_along(xi, along))),
            _ => each().map(|(g, _)| self.change(g, xi) * share(g)).sum(),
        };
        let strain = each().map(|(g, point)| point.strain_vector() * share(g)).sum();
        (strain_of(&strain), stress_of(&(elastic + change)))
    }

    /// True for an element with a single point, which does not show the force along it.
    pub fn hides_force_along(&self) -> bool {
        self.points.len() == 1
    }

    /// The force per length, with that of inertia: the jump of the force at the node between this
    /// element and the next one of the beam, over half of each element.
    pub fn force_along(&self, next: &Self) -> Vec3 {
        let length = 0.5 * (self.length() + next.length());
        (self.force_at(1.0) - next.force_at(-1.0)) * (1.0 / length)
    }

    /// The sum of elastic and damping force at `xi`.
    fn force_at(&self, xi: f64) -> Vec3 {
        let of_point = |(g, point): (usize, &StressedPoint)| -> Vector6 {
            (now(&point.total()) + self.change(g, xi)) * lagrange(&self.xi, g, xi)
        };
        stress_of(&self.points.iter().enumerate().map(of_point).sum()).n
    }

    /// The initial length.
    fn length(&self) -> f64 {
        self.points.iter().zip(gauss(self.xi.len())).map(|(point, &(_, weight))| point.stretch * weight).sum()
    }

    /// The change of the stress by balance from integration point `g` to `xi`, without what acts
    /// along the element.
    fn change(&self, g: usize, xi: f64) -> Vector6 {
        let weights = self.integrals(self.xi[g], xi);
        let each = || self.points.iter().zip(&weights);
        let theta =
            each().fold(Vec3::zero(), |sum, (point, &weight)| sum + point.strain.kappa.scale(point.stretch * weight));
        let m = each().fold(Vec3::zero(), |sum, (point, &weight)| sum + point.moment_slope().scale(weight));
        let n = self.points[g].total().n;
        now(&Stress { n: Rotation::new(theta).r.transpose_mul(n) - n, m })
    }

    /// The integrals of the polynomials L_g over xi.
    fn integrals(&self, from: f64, to: f64) -> Vec<f64> {
        let half = 0.5 * (to - from);
        // L_g has at most degree two, which two points integrate exactly.
        let at = |k: usize, &(abscissa, weight): &(f64, f64)| {
            half * weight * lagrange(&self.xi, k, from + half * (1.0 + abscissa))
        };
        (0..self.xi.len()).map(|k| gauss(2).iter().map(|point| at(k, point)).sum()).collect()
    }

    /// Adds the stress of strain-rate damping at each integration point. `linear`: in a linear
    /// stage, where it is of first order.
    pub(super) fn add_damping(&mut self, stresses: &[Stress], linear: bool) {
        let part = |v: Vec3| if linear { Vec3::with_rate(Vec3::ZERO, v) } else { Vec3::with_rate(v, Vec3::ZERO) };
        for (point, stress) in self.points.iter_mut().zip(stresses) {
            point.damping = Stress { n: part(stress.n), m: part(stress.m) };
        }
    }
}

impl StressedPoint {
    fn strain_now(&self) -> Strain {
        let Strain { gamma, kappa } = &self.strain;
        Strain { gamma: sum(gamma), kappa: sum(kappa) }
    }

    fn strain_vector(&self) -> Vector6 {
        let Strain { gamma, kappa } = self.strain_now();
        vector(&Stress { n: gamma, m: kappa })
    }

    /// The elastic part of a change of force and moment along the element: that of the forces, and of
    /// the moments, at this point.
    fn elastic_part(&self, change: &Vector6) -> Vector6 {
        let part = |elastic: &Vec3<Rate>, damping: &Vec3<Rate>| {
            let [elastic, damping] = [sum(elastic), sum(damping)];
            let total = elastic + damping;
            let square = total.squared();
            // Without damping the part is one, to the last digit.
            let is_whole = damping == Vec3::ZERO || square == 0.0;
            if is_whole { 1.0 } else { (elastic.dot(total) / square).clamp(0.0, 1.0) }
        };
        let Stress { n, m } = stress_of(change);
        let of_forces = part(&self.elastic.n, &self.damping.n);
        let of_moments = part(&self.elastic.m, &self.damping.m);
        vector(&Stress { n: n * of_forces, m: m * of_moments })
    }

    fn total(&self) -> Stress<Rate> {
        self.elastic + self.damping
    }

    /// y = R^T x'
    fn y(&self) -> Vec3<Rate> {
        self.strain.gamma + Vec3::constant(self.tangent)
    }

    /// The derivative of the moment over xi by balance.
    fn moment_slope(&self) -> Vec3<Rate> {
        let Stress { n, m } = self.total();
        (m.cross(self.strain.kappa) + n.cross(self.y())).scale(self.stretch)
    }

    /// The change of the stress by a force per length, where this is the single point of an element
    /// of two nodes.
    fn change_along(&self, xi: f64, force: Vec3) -> Vector6 {
        let n = force * (-self.stretch * xi);
        let m = sum(&self.y()).cross(force) * (0.5 * self.stretch * self.stretch * (xi * xi - 1.0));
        vector(&Stress { n, m })
    }
}

impl<const N: usize, const G: usize> ElasticElement<N, G> {
    /// Strains and elastic stresses within the element. `origin` is the state about which the stage
    /// is linear; `None` in other stages.
    pub(super) fn stresses<I: Interpolation>(&self, at: &State, origin: Option<&State>) -> ElementStresses {
        let member = self.member();
        let view = I::see(member, origin.unwrap_or(at));
        let change = origin.map_or([(Vec3::ZERO, Vec3::ZERO); N], |origin| {
            I::variation(member, origin, &|slot| at.q[slot as usize] - origin.q[slot as usize])
        });
        let nodes: [NodePlace<Rate>; N] = std::array::from_fn(|i| {
            let NodePlace { u, p } = view.nodes()[i];
            NodePlace { u: Vec3::with_rate(u, change[i].0), p: Vec3::with_rate(p, change[i].1) }
        });
        // Free strains act as loads of a linear stage: its geometric stiffness leaves their stresses
        // out.
        let free_amplitude = self.free_amplitude(at);
        let [value, rate] = if origin.is_some() { [0.0, free_amplitude] } else { [free_amplitude, 0.0] };
        let free = Rate { value, rate };
        let of_point = |(point, &(_, weight)): (&ElasticPoint<N>, &(f64, f64))| {
            let (strain, elastic) = point.lifted::<Rate>().strain_and_stress(&nodes, free);
            StressedPoint {
                strain,
                elastic,
                damping: Stress { n: Vec3::zero(), m: Vec3::zero() },
                tangent: point.tangent,
                stretch: point.weight / weight,
            }
        };
        ElementStresses {
            xi: gauss(G).iter().map(|&(xi, _)| xi).collect(),
            free_amplitude,
            points: self.points().iter().zip(gauss(G)).map(of_point).collect(),
        }
    }
}

/// The sum of a vector and its change.
fn sum(vector: &Vec3<Rate>) -> Vec3 {
    Vec3(vector.0.each_ref().map(|number| number.value + number.rate))
}

/// The sum of a stress and its change.
fn now(stress: &Stress<Rate>) -> Vector6 {
    vector(&Stress { n: sum(&stress.n), m: sum(&stress.m) })
}

fn vector(stress: &Stress) -> Vector6 {
    Vector6::from(stress.components())
}

fn stress_of(v: &Vector6) -> Stress {
    Stress { n: Vec3([v[0], v[1], v[2]]), m: Vec3([v[3], v[4], v[5]]) }
}

fn strain_of(v: &Vector6) -> Strain {
    let Stress { n, m } = stress_of(v);
    Strain { gamma: n, kappa: m }
}
