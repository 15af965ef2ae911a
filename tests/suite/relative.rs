//! The relative interpolation: tangents against automatic differentiation, objectivity, indifference to charts.

use crate::dual::{Dual, variables, with_room};
use crate::laws::stiffening;
use crate::random::Random;
use crate::tangents::{agree, stiffness_points, symmetric};
use beamsim_core::kernel::beam::StiffnessPoint;
use beamsim_core::kernel::law::{Linear, StoredLaw, Strain, Stress};
use beamsim_core::kernel::relative::Relative;
use beamsim_core::kernel::{ElementSystem, shape};
use beamsim_core::rotation::{Rotation, complement, log};
use beamsim_core::scalar::Real;
use beamsim_core::tensor::{Mat3, Vec3};
use std::array::from_fn;
use std::f64::consts::PI;

type Wide = Dual<24>;

struct Element<const N: usize, L = Linear> {
    places: [Vec3; N],
    points: Vec<StiffnessPoint<N, f64, L>>,
}

/// Displacements and rotation vectors of the nodes.
type Nodes<const N: usize, T = f64> = [(Vec3<T>, Vec3<T>); N];

impl<const N: usize> Element<N> {
    fn new(random: &mut Random) -> Self {
        let places = from_fn(|i| random.cube(0.1) + Vec3([shape::node_coordinate(i, N), 0.3, -0.2]));
        Self { places, points: stiffness_points(random, true) }
    }
}

impl<const N: usize, L: StoredLaw> Element<N, L> {
    fn see<T: Real>(&self, nodes: &Nodes<N, T>) -> (Relative<N, T>, [Rotation<T>; N]) {
        let rotations = nodes.map(|(_, p)| Rotation::new(p));
        (Relative::new(&self.places.map(Vec3::constant), &nodes.map(|(u, _)| u), &rotations), rotations)
    }

    fn energy<T: Real>(&self, nodes: &Nodes<N, T>) -> T {
        let seen = self.see(nodes).0;
        let mut sum = T::zero();
        for point in &self.points {
            sum += point.lifted().energy(&seen.nodes, T::zero());
        }
        sum
    }

    /// As elements of two nodes do it, or of any number.
    fn system<T: Real>(&self, nodes: &Nodes<N, T>, weight: f64) -> ElementSystem<T> {
        if N == 2 { self.half_way(nodes, weight) } else { self.carried_back(nodes, weight) }
    }

    fn half_way<T: Real>(&self, nodes: &Nodes<N, T>, weight: f64) -> ElementSystem<T> {
        let ((seen, rotations), mut out) = (self.see(nodes), ElementSystem::new(2 * N));
        seen.fill_half_way(&rotations, &self.points[0].lifted(), T::zero(), None, weight, &mut out);
        out
    }

    fn carried_back<T: Real>(&self, nodes: &Nodes<N, T>, weight: f64) -> ElementSystem<T> {
        let (seen, rotations) = self.see(nodes);
        let (mut local, mut out) = (ElementSystem::new(2 * N), ElementSystem::new(2 * N));
        for point in &self.points {
            point.lifted().add_elastic(&seen.nodes, T::zero(), None, weight, &mut local);
        }
        seen.carry_back(&rotations, &local, None, weight, &mut out);
        out
    }
}

fn nodes_around<const N: usize>(random: &mut Random, base: Vec3, spread: f64) -> Nodes<N> {
    from_fn(|_| (random.cube(0.3), base + random.vector(spread)))
}

fn lifted<const N: usize>(nodes: &Nodes<N>) -> Nodes<N, Wide> {
    from_fn(|i| (variables(nodes[i].0, 6 * i), variables(nodes[i].1, 6 * i + 3)))
}

fn tangent_holds<const N: usize>() {
    let mut random = Random::new(900 + N as u64);
    // Spreads up to neighbours that turn by some 2 rad against each other.
    for (base, spread) in [(0.0, 0.0), (1e-4, 1e-5), (1.3, 0.4), (PI, 0.9), (5.0, 0.6), (6.6, 0.3), (2.0, 1.1)] {
        let element = Element::<N>::new(&mut random);
        let base = random.vector(base);
        let nodes: Nodes<N> = nodes_around(&mut random, base, spread);
        let what = format!("relative element of {N} nodes around {base:?}, {nodes:?}");
        element_holds(&what, &element, &nodes);
        let points = element.points.iter().map(stiffening).collect();
        element_holds(
            &format!("{what}, with a law that stiffens"),
            &Element { places: element.places, points },
            &nodes,
        );
    }
}

fn element_holds<L: StoredLaw, const N: usize>(what: &str, element: &Element<N, L>, nodes: &Nodes<N>) {
    let system = element.system(nodes, 1.0);
    let energy = element.energy(&lifted(nodes));
    agree(&format!("force against energy, {what}"), system.force(), &energy.partials[..6 * N], 1e-12);
    let force = element.system(&lifted(nodes), 0.0);
    let exact: Vec<f64> = force.force().iter().flat_map(|f| f.partials[..6 * N].to_vec()).collect();
    agree(&format!("tangent, {what}"), &system.tangent(), &exact, 1e-12);
    symmetric(what, &system.tangent(), 1e-13);
}

#[test]
fn relative_tangents_hold() {
    with_room(|| {
        tangent_holds::<2>();
        tangent_holds::<3>();
        tangent_holds::<4>();
    });
}

/// The short way of two nodes against the general one, with free strains and with the stress of another state in the geometric part.
#[test]
fn half_way_between_two_nodes_the_short_way_is_the_general_one() {
    let mut random = Random::new(1007);
    for (base, spread) in [(0.0, 0.0), (1e-4, 1e-5), (1.3, 0.4), (PI, 0.9), (5.0, 0.6), (6.6, 0.3), (2.0, 1.1)] {
        for coupled in [false, true] {
            let mut element = Element::<2>::new(&mut random);
            element.points[0].free = Some(Strain { gamma: random.cube(0.1), kappa: random.cube(0.2) });
            if !coupled {
                element.points[0].law.stiffness.cc = None;
            }
            let (point, base, free) = (element.points[0], random.vector(base), 0.7);
            let nodes: Nodes<2> = nodes_around(&mut random, base, spread);
            let other = Stress { n: random.cube(2.0), m: random.cube(3.0) };
            let (seen, rotations) = element.see(&nodes);
            for geometric in [None, Some(&other)] {
                let [mut local, mut source, mut general, mut short] = from_fn(|_| ElementSystem::new(4));
                point.add_elastic(&seen.nodes, free, geometric, 1.3, &mut local);
                if let Some(stress) = geometric {
                    point.add_force(&point.configuration(&seen.nodes), stress, &mut source);
                }
                seen.carry_back(&rotations, &local, geometric.map(|_| &source), 1.3, &mut general);
                seen.fill_half_way(&rotations, &point, free, geometric, 1.3, &mut short);
                let what = format!("base {base:?}, spread {spread}, coupled {coupled}, {geometric:?}");
                agree(&format!("force, {what}"), short.force(), general.force(), 1e-14);
                agree(&format!("tangent, {what}"), &short.tangent(), &general.tangent(), 1e-14);
            }
            let [du, dp]: [[Vec3; 2]; 2] = from_fn(|_| from_fn(|_| random.cube(0.1)));
            let spins = from_fn(|i| rotations[i].t * dp[i]);
            let change = seen.variation(&du, &spins);
            let general = point.extrapolated_stress(&seen.nodes, free, |i| change[i].0, |i| change[i].1);
            let short = seen.extrapolated_half_way(&rotations, &point, free, &du, &dp);
            let both = [&short, &general].map(|stress| [stress.n.0, stress.m.0].concat());
            agree(&format!("extrapolated stress, base {base:?}, spread {spread}"), &both[0], &both[1], 1e-14);
        }
    }
}

/// A rotation of the whole element, in each way to interpolate the curvature of which the paper computes (62).
fn invariance_holds<const N: usize>() {
    let mut random = Random::new(950 + N as u64);
    for spread in [0.05, 0.4, 1.0] {
        let element = Element::<N>::new(&mut random);
        let base = random.vector(1.0);
        let nodes: Nodes<N> = nodes_around(&mut random, base, spread);
        let strains = |nodes: &Nodes<N>| -> Vec<f64> {
            let seen = element.see(nodes).0;
            let strain = |point: &StiffnessPoint<N>| {
                let strain = point.strain_and_stress(&seen.nodes, 0.0).0;
                [strain.gamma.0, strain.kappa.0].concat()
            };
            element.points.iter().flat_map(strain).collect()
        };
        for _ in 0..20 {
            let length = random.range(0.0, PI);
            let q = Rotation::new(random.vector(length)).r;
            let turned: Nodes<N> = from_fn(|i| {
                let (u, p) = nodes[i];
                (q * (element.places[i] + u) - element.places[i], log(q * Rotation::new(p).r))
            });
            agree("strains after a rigid rotation", &strains(&turned), &strains(&nodes), 1e-13);
        }
    }
}

#[test]
fn strains_do_not_notice_rigid_rotations() {
    invariance_holds::<2>();
    invariance_holds::<3>();
    invariance_holds::<4>();
}

/// The paper's example (62): |K| at the middle is the same before and after the rigid rotation.
#[test]
fn the_papers_rotation_leaves_the_curvature_alone() {
    let p = [Vec3([1.0, -0.5, 0.25]), Vec3([-0.4, 0.7, 0.1])];
    let q = Vec3([0.2, 1.2, -0.5]);
    let curvature = |rotations: [Mat3; 2]| {
        let rotations = rotations.map(|r| Rotation::new(log(r)));
        let seen = Relative::<2>::new(&[Vec3::ZERO, Vec3::UNIT[0]], &[Vec3::ZERO; 2], &rotations);
        (seen.nodes[1].p - seen.nodes[0].p).norm()
    };
    let rotations = p.map(|p| Rotation::new(p).r);
    let turned = rotations.map(|r| Rotation::new(q).r * r);
    let (before, after) = (curvature(rotations), curvature(turned));
    assert!((before - after).abs() <= 1e-14 * before, "{before} and {after}");
    // The angle of R1^T R2, computed independently.
    assert!((before - 1.841_633_413_559_596_9).abs() <= 1e-14 * before, "{before}");
}

/// Charts are a matter of description: energy and spatial moments do not change with them.
#[test]
fn changes_of_chart_are_neutral() {
    let mut random = Random::new(990);
    for _ in 0..50 {
        let element = Element::<3>::new(&mut random);
        let length = random.range(0.3, 2.9);
        let base = random.vector(length);
        let nodes: Nodes<3> = nodes_around(&mut random, base, 0.4);
        let mut other = nodes;
        other[2].1 = complement(nodes[2].1);
        let (a, b) = (element.energy(&nodes), element.energy(&other));
        assert!((a - b).abs() <= 1e-12 * a, "{a} and {b}");
        let forces = |nodes: &Nodes<3>| -> Vec<f64> {
            let system = element.system(nodes, 0.0);
            let moment = |i: usize| Rotation::new(nodes[i].1).t_inverse() * system.force_block(2 * i + 1);
            (0..3).flat_map(|i| [system.force_block(2 * i).0, moment(i).0].concat()).collect()
        };
        agree("forces in another chart", &forces(&other), &forces(&nodes), 1e-12);
    }
}
