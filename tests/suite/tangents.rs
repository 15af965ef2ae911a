//! Forces and tangents of the elements against automatic differentiation over all unknowns of the element.

#![allow(clippy::needless_range_loop)]

use crate::dual::{Dual, along, jacobian, values, variables, vector_rate, with_room};
use crate::laws::stiffening;
use crate::random::Random;
use beamsim_core::effect::spring::rotational;
use beamsim_core::kernel::beam::StiffnessPoint;
use beamsim_core::kernel::inertia::{Eccentric, Inertia, Rotary, Spin};
use beamsim_core::kernel::law::{Linear, Stiffness, StoredLaw};
use beamsim_core::kernel::load::{force_on_complement, material_force, material_moment, offset_force, spatial_moment};
use beamsim_core::kernel::seam::{Conversion, Converted, conversion};
use beamsim_core::kernel::volume::VolumePoint;
use beamsim_core::kernel::{ElementSystem, NodeMotion, Weights, shape};
use beamsim_core::rotation::{Complement, Rotation, complement};
use beamsim_core::scalar::Real;
use beamsim_core::tensor::{Mat3, Vec3};
use std::array::from_fn;
use std::f64::consts::PI;

/// A number with its derivatives over the 24 unknowns of the largest element: u1, P1, u2, P2, ….
type Wide = Dual<24>;

/// Lengths of the rotation vector around which the nodes lie: at rest, near zero, at pi, beyond 2 pi.
const BASES: [f64; 7] = [0.0, 1e-4, 1.3, PI, 5.0, 6.6, 8.0];

/// What a step of a time integration asks for.
const COMBINED: Weights = Weights { stiffness: 0.8, damping: 23.0, mass: 470.0 };
const WEIGHTS: [Weights; 4] = [Weights::STIFFNESS, Weights::DAMPING, Weights::MASS, COMBINED];

/// Which field of the nodes the variables are.
#[derive(Clone, Copy, PartialEq)]
enum Over {
    Position,
    Velocity,
    Acceleration,
}

const FIELDS: [Over; 3] = [Over::Position, Over::Velocity, Over::Acceleration];

/// The nodes with one of their fields as variables.
fn lift<const N: usize>(nodes: &[NodeMotion; N], over: Over) -> [NodeMotion<Wide>; N] {
    let pick = |field: Over, v: Vec3, first: usize| -> Vec3<Wide> {
        if field == over { variables(v, first) } else { Vec3::constant(v) }
    };
    from_fn(|i| {
        let node = &nodes[i];
        NodeMotion {
            u: pick(Over::Position, node.u, 6 * i),
            u_rate: pick(Over::Velocity, node.u_rate, 6 * i),
            u_rate2: pick(Over::Acceleration, node.u_rate2, 6 * i),
            p: pick(Over::Position, node.p, 6 * i + 3),
            p_rate: pick(Over::Velocity, node.p_rate, 6 * i + 3),
            p_rate2: pick(Over::Acceleration, node.p_rate2, 6 * i + 3),
        }
    })
}

/// The nodes as they move on in time.
fn lift_over_time<const N: usize>(nodes: &[NodeMotion; N]) -> [NodeMotion<Dual<1>>; N] {
    from_fn(|i| {
        let node = &nodes[i];
        NodeMotion {
            u: along(node.u, node.u_rate),
            u_rate: along(node.u_rate, node.u_rate2),
            u_rate2: Vec3::constant(node.u_rate2),
            p: along(node.p, node.p_rate),
            p_rate: along(node.p_rate, node.p_rate2),
            p_rate2: Vec3::constant(node.p_rate2),
        }
    })
}

/// The first variable of each block of an element with displacements and rotations.
fn both_blocks(nodes: usize) -> Vec<usize> {
    (0..2 * nodes).map(|block| 3 * block).collect()
}

/// The first variable of each block of an element with rotations alone.
fn rotation_blocks(nodes: usize) -> Vec<usize> {
    (0..nodes).map(|node| 6 * node + 3).collect()
}

/// s dg/dq + d dg/dv + m dg/da by rows, from forces over q, v and a.
fn exact_tangent(forces: &[Vec<Wide>; 3], weights: Weights, blocks: &[usize]) -> Vec<f64> {
    let factors = [weights.stiffness, weights.damping, weights.mass];
    let mut tangent: Vec<f64> = Vec::new();
    for row in 0..3 * blocks.len() {
        for &first in blocks {
            for k in first..first + 3 {
                let entry: f64 = (0..3).map(|field| factors[field] * forces[field][row].partials[k]).sum();
                tangent.push(entry);
            }
        }
    }
    tangent
}

/// The entries of several vectors in one list.
pub fn flat(vectors: &[Vec3]) -> Vec<f64> {
    vectors.iter().flat_map(|v| v.0).collect()
}

/// The entries of a tensor by rows.
pub fn entries(m: Mat3) -> Vec<f64> {
    m.0.iter().flatten().copied().collect()
}

/// Holds a list of numbers; errors are relative to the largest of them.
pub fn agree(what: &str, got: &[f64], exact: &[f64], tolerance: f64) {
    assert_eq!(got.len(), exact.len(), "{what}: the number of entries");
    let scale = exact.iter().fold(0.0_f64, |largest, e| largest.max(e.abs()));
    for (k, (g, e)) in got.iter().zip(exact).enumerate() {
        let error = (g - e).abs();
        assert!(
            error <= tolerance * scale,
            "{what}: entry {k} is {g:e} instead of {e:e}, error {error:e} where the largest entry is {scale:e}"
        );
    }
}

/// Holds the symmetry of a square matrix by rows.
pub fn symmetric(what: &str, matrix: &[f64], tolerance: f64) {
    let size = (0..=matrix.len()).find(|&n| n * n >= matrix.len()).unwrap_or_default();
    let transposed: Vec<f64> = (0..matrix.len()).map(|k| matrix[(k % size) * size + k / size]).collect();
    agree(&format!("{what}: symmetry"), matrix, &transposed, tolerance);
}

/// Nodes around a rotation vector, with every field at random.
fn moving_nodes<const N: usize>(random: &mut Random, base: Vec3) -> [NodeMotion; N] {
    from_fn(|_| NodeMotion {
        u: random.cube(0.3),
        u_rate: random.cube(2.0),
        u_rate2: random.cube(2.0),
        p: base + random.vector(0.4),
        p_rate: random.cube(2.0),
        p_rate2: random.cube(2.0),
    })
}

/// Half the length of the elements.
const HALF: f64 = 0.6;

pub fn stiffness_points<const N: usize>(random: &mut Random, coupled: bool) -> Vec<StiffnessPoint<N>> {
    let mut points = Vec::new();
    for &(xi, weight) in shape::gauss(N - 1) {
        let cc = random.tensor(0.4);
        points.push(StiffnessPoint {
            shape: shape::values::<N>(xi),
            slope: shape::derivatives::<N>(xi).map(|d| d / HALF),
            weight: weight * HALF,
            tangent: random.direction(),
            law: Linear {
                stiffness: Stiffness {
                    cn: random.positive_definite(),
                    cm: random.positive_definite(),
                    cc: coupled.then_some(cc),
                },
            },
            free: None,
        });
    }
    points
}

fn volume_points<const N: usize, Q: Copy>(quantity: impl Fn() -> Q) -> Vec<VolumePoint<N, Q>> {
    let mut points = Vec::new();
    for &(xi, weight) in shape::gauss(N) {
        points.push(VolumePoint { shape: shape::values::<N>(xi), weight: weight * HALF, quantity: quantity() });
    }
    points
}

fn elastic<T: Real, L: StoredLaw, const N: usize>(
    points: &[StiffnessPoint<N, f64, L>],
    nodes: &[NodeMotion<T>; N],
    weight: f64,
) -> ElementSystem<T> {
    let mut out = ElementSystem::new(2 * N);
    for point in points {
        point.lifted().add_elastic(nodes, T::zero(), None, weight, &mut out);
    }
    out
}

fn rotary<T: Real, const N: usize>(
    points: &[VolumePoint<N, Mat3>],
    nodes: &[NodeMotion<T>; N],
    weights: Weights,
) -> ElementSystem<T> {
    let mut out = ElementSystem::new(N);
    for point in points {
        point.lifted(|j| Mat3::constant(*j)).add(&Rotary { gyroscopic: true }, nodes, weights, &mut out);
    }
    out
}

fn body<T: Real, const N: usize>(
    points: &[VolumePoint<N, Inertia>],
    nodes: &[NodeMotion<T>; N],
    weights: Weights,
) -> ElementSystem<T> {
    let mut out = ElementSystem::new(2 * N);
    for point in points {
        point.lifted(Inertia::lifted).add(&Eccentric { gyroscopic: true }, nodes, weights, &mut out);
    }
    out
}

/// The strain energy of an element.
fn strain_energy<L: StoredLaw, const N: usize>(
    points: &[StiffnessPoint<N, f64, L>],
    nodes: &[NodeMotion<Wide>; N],
) -> Wide {
    let mut sum = Wide::zero();
    for point in points {
        sum += point.lifted().energy(nodes, Wide::zero());
    }
    sum
}

/// The integral of m u'.u'/2 + m u'.R(Omega x d) + Omega.J Omega/2.
fn kinetic_energy<const N: usize>(points: &[VolumePoint<N, Inertia>], nodes: &[NodeMotion<Wide>; N]) -> Wide {
    let mut sum = Wide::zero();
    for point in points {
        let motion = point.lifted::<Wide, _>(Inertia::lifted::<Wide>).motion(nodes);
        let spin = Spin::new(motion.p, motion.p_rate, motion.p_rate2);
        let d: Vec3<Wide> = Vec3::constant(point.quantity.offset);
        let j: Mat3<Wide> = Mat3::constant(point.quantity.about_node);
        let (velocity, omega) = (motion.u_rate, spin.omega);
        let carried = spin.rotation.r * omega.cross(d);
        let of_mass = velocity.dot(velocity) * 0.5 + velocity.dot(carried);
        let of_spin = omega.dot(j * omega) * 0.5;
        sum += (of_mass * point.quantity.mass + of_spin) * point.weight;
    }
    sum
}

/// The momenta conjugate to u1, P1, u2, P2, …: m (u' + R(Omega x d)) and T^T (J Omega + m d x R^T u').
fn momenta<T: Real, const N: usize>(points: &[VolumePoint<N, Inertia>], nodes: &[NodeMotion<T>; N]) -> Vec<Vec3<T>> {
    let mut sum = vec![Vec3::<T>::zero(); 2 * N];
    for point in points {
        let motion = point.lifted::<T, _>(Inertia::lifted::<T>).motion(nodes);
        let spin = Spin::new(motion.p, motion.p_rate, motion.p_rate2);
        let d: Vec3<T> = Vec3::constant(point.quantity.offset);
        let j: Mat3<T> = Mat3::constant(point.quantity.about_node);
        let (r, t) = (spin.rotation.r, spin.rotation.t);
        let (velocity, omega, mass) = (motion.u_rate, spin.omega, point.quantity.mass);
        let linear = (velocity + r * omega.cross(d)).scale(mass);
        let angular = t.transpose_mul(j * omega + d.cross(r.transpose_mul(velocity)).scale(mass));
        for i in 0..N {
            let w = point.weight * point.shape[i];
            sum[2 * i] += linear.scale(w);
            sum[2 * i + 1] += angular.scale(w);
        }
    }
    sum
}

// Elasticity ---------------------------------------------------------------------------------------------------------

fn elasticity_holds<const N: usize>() {
    let mut random = Random::new(N as u64);
    for coupled in [false, true] {
        for base in BASES {
            let points = stiffness_points::<N>(&mut random, coupled);
            let center = random.vector(base);
            let nodes: [NodeMotion; N] = moving_nodes(&mut random, center);
            let what = format!("{N} nodes around |P| = {base}, coupled: {coupled}, nodes {nodes:?}");
            points_hold(&format!("elasticity, {what}"), &points, &nodes);
            let points: Vec<_> = points.iter().map(stiffening).collect();
            points_hold(&format!("elasticity that stiffens, {what}"), &points, &nodes);
        }
    }
}

fn points_hold<L: StoredLaw, const N: usize>(
    what: &str,
    points: &[StiffnessPoint<N, f64, L>],
    nodes: &[NodeMotion; N],
) {
    let system = elastic(points, nodes, 1.0);
    let moving = lift(nodes, Over::Position);
    let energy = strain_energy(points, &moving);
    agree(&format!("force against energy, {what}"), system.force(), &energy.partials[..6 * N], 1e-12);
    let force = elastic(points, &moving, 0.0).force().to_vec();
    let mut exact: Vec<f64> = Vec::new();
    for f in &force {
        exact.extend_from_slice(&f.partials[..6 * N]);
    }
    agree(&format!("tangent, {what}"), &system.tangent(), &exact, 1e-12);
    symmetric(what, &system.tangent(), 1e-13);
    let weighted = elastic(points, nodes, 0.25);
    let quarter: Vec<f64> = exact.iter().map(|e| 0.25 * e).collect();
    agree(&format!("weighted tangent, {what}"), &weighted.tangent(), &quarter, 1e-12);
}

#[test]
fn elasticity_of_two_nodes_holds() {
    with_room(elasticity_holds::<2>);
}

#[test]
fn elasticity_of_three_nodes_holds() {
    with_room(elasticity_holds::<3>);
}

#[test]
fn elasticity_of_four_nodes_holds() {
    with_room(elasticity_holds::<4>);
}

/// The stress of the mixed-integration-point tangent: the present one and its derivative along the correction.
#[test]
fn the_extrapolated_stress_is_linear_in_the_correction() {
    let mut random = Random::new(77);
    for coupled in [false, true] {
        for base in BASES {
            let points = stiffness_points::<3>(&mut random, coupled);
            let center = random.vector(base);
            let nodes: [NodeMotion; 3] = moving_nodes(&mut random, center);
            let (du, dp): ([Vec3; 3], [Vec3; 3]) = (from_fn(|_| random.cube(0.2)), from_fn(|_| random.cube(0.2)));
            let moving: [NodeMotion<Dual<1>>; 3] = from_fn(|i| {
                let mut node = NodeMotion::rest();
                node.u = along(nodes[i].u, du[i]);
                node.p = along(nodes[i].p, dp[i]);
                node
            });
            for point in &points {
                let got = point.extrapolated_stress(&nodes, 0.0, |i| du[i], |i| dp[i]);
                let (_, stress) = point.lifted().strain_and_stress(&moving, Dual::zero());
                let n = values(stress.n) + vector_rate(stress.n);
                let m = values(stress.m) + vector_rate(stress.m);
                let what = format!("extrapolated stress around |P| = {base}, coupled: {coupled}, nodes {nodes:?}");
                agree(&what, &flat(&[got.n, got.m]), &flat(&[n, m]), 1e-12);
            }
        }
    }
}

// Inertia ------------------------------------------------------------------------------------------------------------

fn rotary_inertia_holds<const N: usize>() {
    let mut random = Random::new(100 + N as u64);
    for base in BASES {
        let j = random.positive_definite();
        let points: Vec<VolumePoint<N, Mat3>> = volume_points(|| j);
        let center = random.vector(base);
        let nodes: [NodeMotion; N] = moving_nodes(&mut random, center);
        let forces = FIELDS.map(|over| rotary(&points, &lift(&nodes, over), Weights::NONE).force().to_vec());
        for weights in WEIGHTS {
            let what = format!("rotary inertia, {N} nodes around |P| = {base}, {weights:?}, nodes {nodes:?}");
            let system = rotary(&points, &nodes, weights);
            agree(&what, &system.tangent(), &exact_tangent(&forces, weights, &rotation_blocks(N)), 1e-12);
            if weights == Weights::MASS {
                symmetric(&what, &system.tangent(), 1e-13);
            }
        }
        // It is a body without mass: the force follows from the kinetic energy there.
        let massless = Inertia { mass: 0.0, offset: Vec3::ZERO, about_node: j };
        let bodies: Vec<VolumePoint<N, Inertia>> = volume_points(|| massless);
        let whole = body(&bodies, &nodes, Weights::NONE);
        let rotations: Vec<Vec3> = (0..N).map(|i| whole.force_block(2 * i + 1)).collect();
        let what = format!("rotary inertia against a body without mass, {N} nodes around |P| = {base}");
        agree(&what, rotary(&points, &nodes, Weights::NONE).force(), &flat(&rotations), 1e-13);
    }
}

#[test]
fn rotary_inertia_of_two_nodes_holds() {
    with_room(rotary_inertia_holds::<2>);
}

#[test]
fn rotary_inertia_of_three_nodes_holds() {
    with_room(rotary_inertia_holds::<3>);
}

#[test]
fn rotary_inertia_of_four_nodes_holds() {
    with_room(rotary_inertia_holds::<4>);
}

fn body_holds<const N: usize>() {
    let mut random = Random::new(200 + N as u64);
    for base in BASES {
        let inertia = Inertia { mass: 1.7, offset: random.vector(0.4), about_node: random.positive_definite() };
        let points: Vec<VolumePoint<N, Inertia>> = volume_points(|| inertia);
        let center = random.vector(base);
        let nodes: [NodeMotion; N] = moving_nodes(&mut random, center);
        let forces = FIELDS.map(|over| body(&points, &lift(&nodes, over), Weights::NONE).force().to_vec());
        for weights in WEIGHTS {
            let what = format!("eccentric inertia, {N} nodes around |P| = {base}, {weights:?}, nodes {nodes:?}");
            let system = body(&points, &nodes, weights);
            agree(&what, &system.tangent(), &exact_tangent(&forces, weights, &both_blocks(N)), 1e-12);
            if weights == Weights::MASS {
                symmetric(&what, &system.tangent(), 1e-13);
            }
        }
        // Lagrange: f = d/dt dT/dv - dT/dq
        let what = format!("eccentric inertia, {N} nodes around |P| = {base}, nodes {nodes:?}");
        let over_velocity = kinetic_energy(&points, &lift(&nodes, Over::Velocity));
        let over_position = kinetic_energy(&points, &lift(&nodes, Over::Position));
        agree(&format!("momenta, {what}"), &flat(&momenta(&points, &nodes)), &over_velocity.partials[..6 * N], 1e-12);
        let moving = momenta(&points, &lift_over_time(&nodes));
        let mut exact: Vec<f64> = Vec::new();
        for (block, momentum) in moving.into_iter().enumerate() {
            for (i, rate) in vector_rate(momentum).0.into_iter().enumerate() {
                exact.push(rate - over_position.partials[3 * block + i]);
            }
        }
        let force = body(&points, &nodes, Weights::NONE);
        agree(&format!("force against kinetic energy, {what}"), force.force(), &exact, 1e-12);
    }
}

#[test]
fn eccentric_inertia_of_two_nodes_holds() {
    with_room(body_holds::<2>);
}

#[test]
fn eccentric_inertia_of_three_nodes_holds() {
    with_room(body_holds::<3>);
}

#[test]
fn eccentric_inertia_of_four_nodes_holds() {
    with_room(body_holds::<4>);
}

// Loads and springs --------------------------------------------------------------------------------------------------

#[test]
fn loads_and_their_tangents_hold() {
    let mut random = Random::new(300);
    for psi in [1e-9, 1e-4, 0.3, 1.0, PI, 4.0, 6.1, 6.5, 8.0] {
        for _ in 0..10 {
            let (p, a, b) = (random.vector(psi), random.cube(2.0), random.cube(2.0));
            let (lifted_a, lifted_b): (Vec3<Dual<3>>, Vec3<Dual<3>>) = (Vec3::constant(a), Vec3::constant(b));
            let (still, moving) = (Rotation::new(p), Rotation::new(variables::<3>(p, 0)));
            let cases = [
                ("spatial moment", spatial_moment(&still, a), spatial_moment(&moving, lifted_a).0),
                ("material moment", material_moment(&still, a), material_moment(&moving, lifted_a).0),
                ("material force", material_force(&still, a), material_force(&moving, lifted_a).0),
                ("force at an offset", offset_force(&still, a, b), offset_force(&moving, lifted_a, lifted_b).0),
            ];
            for (name, (force, tangent), lifted) in cases {
                let what = format!("{name} at P = {p:?}, |P| = {psi}");
                agree(&format!("force, {what}"), &force.0, &values(lifted).0, 1e-13);
                agree(&format!("tangent, {what}"), &entries(tangent), &entries(jacobian(lifted, 0)), 1e-12);
            }
            // What they are: virtual work against the spin, or the derivative of the potential.
            let (at_offset, fixed_moment) = (cases[3].1, cases[0].1);
            let potential = -(lifted_b.dot(moving.r * lifted_a));
            let what = format!("potential of a force at an offset, P = {p:?}, |P| = {psi}");
            agree(&what, &at_offset.0.0, &potential.partials, 1e-12);
            let spatial = still.t.transpose_mul(still.r.transpose_mul(a));
            agree(&format!("T^T R^T m = T m at P = {p:?}"), &fixed_moment.0.0, &(-spatial).0, 1e-12);
        }
    }
}

#[test]
fn rotational_springs_hold_through_whole_turns() {
    let mut random = Random::new(400);
    for turns in [-1.0, 0.0, 1.0, 3.0] {
        for psi in [0.3, 1.0, 3.0, PI, 4.0, 6.1] {
            for _ in 0..10 {
                let (stiffness, p) = (random.positive_definite(), random.vector(psi));
                let moving = variables::<3>(p, 0);
                let k: Mat3<Dual<3>> = Mat3::constant(stiffness);
                let unwrapped = moving * (Dual::<3>::one() + Dual::<3>::constant(2.0 * PI * turns) / moving.norm());
                let energy = unwrapped.dot(k * unwrapped) * 0.5;
                let (force, tangent) = rotational(stiffness, turns, p);
                let lifted = rotational(stiffness, turns, moving).0;
                let what = format!("rotational spring, {turns} turns at P = {p:?}, |P| = {psi}");
                agree(&format!("force against energy, {what}"), &force.0, &energy.partials, 1e-12);
                agree(&format!("tangent, {what}"), &entries(tangent), &entries(jacobian(lifted, 0)), 1e-12);
                symmetric(&what, &entries(tangent), 1e-13);
            }
        }
    }
}

#[test]
fn forces_on_complements_have_potentials() {
    let mut random = Random::new(401);
    for psi in [0.3, 1.0, 3.0, PI, 4.0, 6.1] {
        for _ in 0..10 {
            let (force, p) = (random.vector(2.0), random.vector(psi));
            let moving = variables::<3>(p, 0);
            let lifted: Vec3<Dual<3>> = Vec3::constant(force);
            let far = moving * (Dual::<3>::one() - Dual::<3>::constant(2.0 * PI) / moving.norm());
            let (own, tangent) = force_on_complement(p, force);
            let what = format!("force on the complement of P = {p:?}, |P| = {psi}");
            agree(&format!("potential, {what}"), &own.0, &far.dot(lifted).partials, 1e-12);
            let moved = force_on_complement(moving, lifted).0;
            agree(&format!("tangent, {what}"), &entries(tangent), &entries(jacobian(moved, 0)), 1e-12);
            symmetric(&what, &entries(tangent), 1e-13);
        }
    }
}

// Elements whose nodes sit in different charts -----------------------------------------------------------------------

/// Lengths of the first node's rotation vector: its own chart may be the long one.
const SEAM_BASES: [f64; 4] = [2.2, PI - 0.1, 3.6, 4.5];

/// The nodes to be converted in elements of N nodes.
fn masks(nodes: usize) -> Vec<Conversion> {
    let count: Conversion = 1 << (nodes - 1);
    (1..count).map(|mask| mask << 1).collect()
}

/// Nodes of which those that `mask` names sit in the other chart, moving at random there.
fn seam_nodes<const N: usize>(random: &mut Random, base: Vec3, mask: Conversion) -> [NodeMotion; N] {
    let mut nodes: [NodeMotion; N] = moving_nodes(random, base);
    for (j, node) in nodes.iter_mut().enumerate() {
        if mask & (1 << j) != 0 {
            node.p = complement(node.p);
        }
    }
    nodes
}

/// The nodes in one chart, and the changes.
fn in_one_chart<const N: usize>(
    nodes: &[NodeMotion<Wide>; N],
    mask: Conversion,
) -> ([NodeMotion<Wide>; N], [Option<Complement<Wide>>; N]) {
    let (mut converted, mut changes) = (*nodes, [None; N]);
    for j in 0..N {
        if mask & (1 << j) != 0 {
            let change = Complement::new(nodes[j].p, nodes[j].p_rate, nodes[j].p_rate2);
            converted[j].p = change.p;
            converted[j].p_rate = change.velocity;
            converted[j].p_rate2 = change.acceleration;
            changes[j] = Some(change);
        }
    }
    (converted, changes)
}

/// Holds what is pulled back against the force as a function of the unknowns in their own charts.
fn seam_holds<const N: usize>(
    what: &str,
    nodes: &[NodeMotion; N],
    mask: Conversion,
    rates: bool,
    blocks: &[usize],
    evaluate: impl Fn(&[NodeMotion; N], Weights, &mut ElementSystem),
    evaluate_wide: impl Fn(&[NodeMotion<Wide>; N]) -> ElementSystem<Wide>,
) {
    let p: [Vec3; N] = from_fn(|i| nodes[i].p);
    assert_eq!(conversion(&p), mask, "{what}: the nodes to be converted at {p:?}");
    let rotation_block = |j: usize| if blocks.len() == N { j } else { 2 * j + 1 };
    let forces = FIELDS.map(|over| {
        let (converted, changes) = in_one_chart(&lift(nodes, over), mask);
        let mut system = evaluate_wide(&converted);
        for (j, change) in changes.iter().enumerate() {
            if let Some(change) = change {
                let row = rotation_block(j);
                let force = system.force_block(row);
                system.set_force(row, change.b.transpose_mul(force));
            }
        }
        system.force().to_vec()
    });
    let exact_force: Vec<f64> = forces[0].iter().map(|f| f.value).collect();
    let converted = Converted::new(nodes, mask);
    let one_chart: [NodeMotion; N] = from_fn(|i| converted.nodes[i]);
    for weights in WEIGHTS {
        let what = format!("{what}, {N} nodes, mask {mask:b}, {weights:?}, nodes {nodes:?}");
        let mut out: ElementSystem = ElementSystem::new(blocks.len());
        converted.pull_back(weights, rates, &rotation_block, &mut out, &|weights, system| {
            evaluate(&one_chart, weights, system);
        });
        agree(&format!("force, {what}"), out.force(), &exact_force, 1e-12);
        agree(&format!("tangent, {what}"), &out.tangent(), &exact_tangent(&forces, weights, blocks), 1e-12);
        if weights == Weights::MASS || (weights == Weights::STIFFNESS && !rates) {
            symmetric(&what, &out.tangent(), 1e-12);
        }
    }
}

fn elastic_seam_holds<const N: usize>() {
    let mut random = Random::new(500 + N as u64);
    for mask in masks(N) {
        for base in SEAM_BASES {
            let points = stiffness_points::<N>(&mut random, true);
            let center = random.vector(base);
            let nodes: [NodeMotion; N] = seam_nodes(&mut random, center, mask);
            let what = format!("elasticity across charts around |P| = {base}");
            seam_holds(
                &what,
                &nodes,
                mask,
                false,
                &both_blocks(N),
                |nodes, weights, out| {
                    out.clear();
                    for point in &points {
                        point.add_elastic(nodes, 0.0, None, weights.stiffness, out);
                    }
                },
                |nodes| elastic(&points, nodes, 0.0),
            );
            // The force is the gradient of the energy, which knows no charts.
            let energy = strain_energy(&points, &in_one_chart(&lift(&nodes, Over::Position), mask).0);
            let converted = Converted::new(&nodes, mask);
            let one_chart: [NodeMotion; N] = from_fn(|i| converted.nodes[i]);
            let mut out: ElementSystem = ElementSystem::new(2 * N);
            converted.pull_back(Weights::NONE, false, &|j| 2 * j + 1, &mut out, &|_, system| {
                *system = elastic(&points, &one_chart, 0.0);
            });
            let what = format!("force against energy, {what}, {N} nodes, mask {mask:b}, nodes {nodes:?}");
            agree(&what, out.force(), &energy.partials[..6 * N], 1e-12);
        }
    }
}

#[test]
fn elasticity_holds_across_charts() {
    with_room(|| {
        elastic_seam_holds::<2>();
        elastic_seam_holds::<3>();
        elastic_seam_holds::<4>();
    });
}

fn rotary_seam_holds<const N: usize>() {
    let mut random = Random::new(600 + N as u64);
    for mask in masks(N) {
        for base in SEAM_BASES {
            let j = random.positive_definite();
            let points: Vec<VolumePoint<N, Mat3>> = volume_points(|| j);
            let center = random.vector(base);
            let nodes: [NodeMotion; N] = seam_nodes(&mut random, center, mask);
            seam_holds(
                &format!("rotary inertia across charts around |P| = {base}"),
                &nodes,
                mask,
                true,
                &rotation_blocks(N),
                |nodes, weights, out| {
                    out.clear();
                    for point in &points {
                        point.add(&Rotary { gyroscopic: true }, nodes, weights, out);
                    }
                },
                |nodes| rotary(&points, nodes, Weights::NONE),
            );
        }
    }
}

#[test]
fn rotary_inertia_holds_across_charts() {
    with_room(|| {
        rotary_seam_holds::<2>();
        rotary_seam_holds::<3>();
        rotary_seam_holds::<4>();
    });
}

fn body_seam_holds<const N: usize>() {
    let mut random = Random::new(700 + N as u64);
    for mask in masks(N) {
        for base in SEAM_BASES {
            let inertia = Inertia { mass: 1.7, offset: random.vector(0.4), about_node: random.positive_definite() };
            let points: Vec<VolumePoint<N, Inertia>> = volume_points(|| inertia);
            let center = random.vector(base);
            let nodes: [NodeMotion; N] = seam_nodes(&mut random, center, mask);
            seam_holds(
                &format!("eccentric inertia across charts around |P| = {base}"),
                &nodes,
                mask,
                true,
                &both_blocks(N),
                |nodes, weights, out| {
                    out.clear();
                    for point in &points {
                        point.add(&Eccentric { gyroscopic: true }, nodes, weights, out);
                    }
                },
                |nodes| body(&points, nodes, Weights::NONE),
            );
        }
    }
}

#[test]
fn eccentric_inertia_holds_across_charts() {
    with_room(|| {
        body_seam_holds::<2>();
        body_seam_holds::<3>();
        body_seam_holds::<4>();
    });
}

/// A single node past the band: nothing to convert, and nothing is changed.
#[test]
fn elements_in_one_chart_are_not_converted() {
    let mut random = Random::new(800);
    for base in [0.0, 1.0, PI, 4.0] {
        let center = random.vector(base);
        let nodes: [NodeMotion; 4] = moving_nodes(&mut random, center);
        let p: [Vec3; 4] = from_fn(|i| nodes[i].p);
        assert_eq!(conversion(&p), 0, "around |P| = {base}: {p:?}");
        let converted = Converted::new(&nodes, 0);
        for i in 0..4 {
            assert_eq!(converted.nodes[i].p, nodes[i].p, "node {i} around |P| = {base}");
        }
    }
}
