//! Pairs of beams in contact against dual numbers, balance of forces and moments, objectivity.

use super::along::{ShapeAt, weighted_sum};
use super::beam_pair::{PairLaw, PairSide, add_pair};
use super::dual::{Dual, Errors, Random, along, size, tangent_error};
use super::friction::{CarriedTraction, FrictionLaw, Status};
use super::law::NormalLaw;
use super::pair_search::bilateral;
use super::point::PointState;
use super::variation::{ContactNode, NodeBefore, NodeTurning};
use crate::kernel::element::{ElementSystem, MAX_NODES, Weights};
use crate::rotation::Rotation;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};
use std::array::from_fn;

/// The number of random directions along which a tangent is compared.
const DIRECTIONS: usize = 3;

type D = Dual<DIRECTIONS>;

/// Weights of a step of dynamics.
const WEIGHTS: Weights = Weights { stiffness: 0.7, damping: 1.3, mass: 0.0 };

/// A node: its place and velocity, and the rotation that its rotation vector follows.
#[derive(Clone, Copy)]
struct Body {
    place: Vec3,
    velocity: Vec3,
    base: Mat3,
    p: Vec3,
    before: NodeBefore,
}

/// Two elements with their closest points.
#[derive(Clone)]
struct Scene<const NA: usize, const NB: usize> {
    a: [Body; NA],
    b: [Body; NB],
    s: f64,
    e: f64,
    law: PairLaw,
}

impl Body {
    fn random(random: &mut Random, place: Vec3, speed: f64) -> Self {
        Self {
            place,
            velocity: random.vector(speed),
            base: random.rotation(2.0).r,
            p: random.vector(1.0),
            before: NodeBefore { place: Vec3::ZERO, rotation: Mat3::IDENTITY },
        }
    }

    fn rotation(&self) -> Rotation {
        Rotation::new(self.p).after(self.base)
    }

    fn now(&self) -> ContactNode {
        let Self { place, velocity, .. } = *self;
        ContactNode { place, velocity }
    }

    fn turning(&self) -> NodeTurning {
        NodeTurning { rotation: self.rotation(), before: self.before }
    }

    /// The node, whose derivatives are those of the weights along directions.
    fn dual(&self, first: usize, directions: &[Vec<f64>; DIRECTIONS], weights: Weights) -> ContactNode<D> {
        ContactNode {
            place: along(self.place, first, directions, weights.stiffness),
            velocity: along(self.velocity, first, directions, weights.damping),
        }
    }

    fn dual_turning(&self, first: usize, directions: &[Vec<f64>; DIRECTIONS], weights: Weights) -> NodeTurning<D> {
        let p = along(self.p, first + 3, directions, weights.stiffness);
        NodeTurning { rotation: Rotation::new(p).after(Mat3::constant(self.base)), before: self.before }
    }

    fn moved(&self, by: &Mat3, shift: Vec3) -> Self {
        Self { place: *by * self.place + shift, velocity: *by * self.velocity, base: *by * self.base, ..*self }
    }
}

impl<const NA: usize, const NB: usize> Scene<NA, NB> {
    fn now(&self, weights: Weights) -> (ElementSystem, PointState) {
        let turning_a = Some(from_fn(|i| self.a[i].turning()));
        let turning_b = Some(from_fn(|k| self.b[k].turning()));
        let [s, e] = [self.s, self.e];
        let a = PairSide { nodes: from_fn(|i| self.a[i].now()), turning: turning_a, shape: ShapeAt::<NA>::new(s) };
        let b = PairSide { nodes: from_fn(|k| self.b[k].now()), turning: turning_b, shape: ShapeAt::<NB>::new(e) };
        let mut out = ElementSystem::new(2 * (NA + NB));
        let state = add_pair(&a, &b, &self.law, weights, &mut out).unwrap();
        (out, state)
    }

    /// Forces in dual numbers, at closest points that move if they are free.
    fn dual(&self, directions: &[Vec<f64>; DIRECTIONS], weights: Weights) -> ElementSystem<D> {
        let nodes_a: [ContactNode<D>; NA] = from_fn(|i| self.a[i].dual(6 * i, directions, weights));
        let nodes_b: [ContactNode<D>; NB] = from_fn(|k| self.b[k].dual(6 * (NA + k), directions, weights));
        let (s, e) = self.closest(&nodes_a, &nodes_b);
        let turning_a = Some(from_fn(|i| self.a[i].dual_turning(6 * i, directions, weights)));
        let turning_b = Some(from_fn(|k| self.b[k].dual_turning(6 * (NA + k), directions, weights)));
        let a = PairSide { nodes: nodes_a, turning: turning_a, shape: ShapeAt::new(s) };
        let b = PairSide { nodes: nodes_b, turning: turning_b, shape: ShapeAt::new(e) };
        let mut out = ElementSystem::new(2 * (NA + NB));
        add_pair(&a, &b, &self.law, Weights::NONE, &mut out).unwrap();
        out
    }

    /// A step of Newton's method in dual numbers for the free parameters, from l^2/2.
    fn closest(&self, nodes_a: &[ContactNode<D>; NA], nodes_b: &[ContactNode<D>; NB]) -> (D, D) {
        let on_a = ShapeAt::<NA, D>::new(D::constant(self.s));
        let on_b = ShapeAt::<NB, D>::new(D::constant(self.e));
        let apart = weighted_sum(&on_a.values, |i| nodes_a[i].place) - weighted_sum(&on_b.values, |k| nodes_b[k].place);
        let za = weighted_sum(&on_a.slopes, |i| nodes_a[i].place);
        let zb = weighted_sum(&on_b.slopes, |k| nodes_b[k].place);
        let first = [apart.dot(za), -apart.dot(zb)];
        let ss = za.squared() + apart.dot(weighted_sum(&on_a.bends, |i| nodes_a[i].place));
        let ee = zb.squared() - apart.dot(weighted_sum(&on_b.bends, |k| nodes_b[k].place));
        let se = -za.dot(zb);
        let (s, e) = (D::constant(self.s), D::constant(self.e));
        match self.law.free {
            [false, false] => (s, e),
            [true, false] => (s - first[0] / ss, e),
            [false, true] => (s, e - first[1] / ee),
            [true, true] => {
                let determinant = ss * ee - se * se;
                let ds = (se * first[1] - ee * first[0]) / determinant;
                let de = (se * first[0] - ss * first[1]) / determinant;
                (s + ds, e + de)
            }
        }
    }

    fn moved(&self, by: &Mat3, shift: Vec3) -> Self {
        Self {
            a: self.a.map(|body| body.moved(by, shift)),
            b: self.b.map(|body| body.moved(by, shift)),
            ..self.clone()
        }
    }

    fn bodies(&self) -> impl Iterator<Item = &Body> {
        self.a.iter().chain(&self.b)
    }
}

/// Two elements that cross at a distance, with a contact that has a force.
fn random_pair<const NA: usize, const NB: usize>(
    random: &mut Random,
    free: [bool; 2],
    friction: bool,
    damped: bool,
) -> Option<Scene<NA, NB>> {
    let speed = if damped { 0.5 } else { 0.0 };
    let turn = random.rotation(3.0).r;
    let shift = random.vector(1.0);
    let along = random.vector(0.15) + Vec3::UNIT[0];
    let across = random.vector(0.4) + Vec3::UNIT[1];
    let above = random.vector(0.1) + Vec3([0.0, 0.0, 0.4]);
    let place_a = |i: usize| along * (i as f64 / (NA - 1) as f64 - 0.5) + above;
    let place_b = |i: usize| across * (i as f64 / (NB - 1) as f64 - 0.5);
    let a: [Body; NA] = from_fn(|i| {
        let place = turn * (place_a(i) + random.vector(0.03)) + shift;
        Body::random(random, place, speed)
    });
    let b: [Body; NB] = from_fn(|i| {
        let place = turn * (place_b(i) + random.vector(0.03)) + shift;
        Body::random(random, place, speed)
    });
    let closest = bilateral(&a.map(|body| body.place), &b.map(|body| body.place)).found().next()?;
    let law = PairLaw {
        radii: [0.0; 2],
        normal: NormalLaw::Augmented { multiplier: 0.0, stiffness: 1.0, touching: 0.0 },
        friction: None,
        carried: CarriedTraction::default(),
        carrier: (random.between(0.0, NB as f64) as usize).min(NB - 1),
        free,
        weight: random.between(0.3, 1.0),
    };
    let mut scene = Scene { a, b, s: closest.s, e: closest.e, law };
    place_fixed(random, &mut scene);
    let depth = random.between(0.02, 0.1);
    let split = random.between(0.3, 0.7);
    let distance = pair_distance(&scene);
    scene.law.radii = [(distance + depth) * split, (distance + depth) * (1.0 - split)];
    let stiffness = random.between(1.0, 5.0);
    scene.law.normal = if damped {
        NormalLaw::Penalty { stiffness, damping: random.between(0.1, 0.5), offset: 0.0 }
    } else {
        NormalLaw::Augmented { multiplier: random.between(0.1, 1.0), stiffness, touching: 0.0 }
    };
    if friction {
        set_friction(random, &mut scene);
    }
    (scene.now(Weights::NONE).1.status() != Status::Open).then_some(scene)
}

/// Moves parameters that are not free, and the free one of two to its closest point.
fn place_fixed<const NA: usize, const NB: usize>(random: &mut Random, scene: &mut Scene<NA, NB>) {
    if !scene.law.free[0] {
        scene.s = (scene.s + random.between(-0.05, 0.05)).clamp(0.0, 1.0);
    }
    if !scene.law.free[1] {
        scene.e = (scene.e + random.between(-0.05, 0.05)).clamp(0.0, 1.0);
    }
    // Newton's method of the test itself, on values.
    let still = random.directions(6 * MAX_NODES);
    for _ in 0..20 {
        let nodes_a = from_fn(|i| scene.a[i].dual(0, &still, Weights::NONE));
        let nodes_b = from_fn(|k| scene.b[k].dual(0, &still, Weights::NONE));
        let (s, e) = scene.closest(&nodes_a, &nodes_b);
        scene.s = s.value;
        scene.e = e.value;
    }
}

fn pair_distance<const NA: usize, const NB: usize>(scene: &Scene<NA, NB>) -> f64 {
    let on_a = ShapeAt::<NA>::new(scene.s);
    let on_b = ShapeAt::<NB>::new(scene.e);
    (weighted_sum(&on_a.values, |i| scene.a[i].place) - weighted_sum(&on_b.values, |k| scene.b[k].place)).norm()
}

fn set_friction<const NA: usize, const NB: usize>(random: &mut Random, scene: &mut Scene<NA, NB>) {
    let carrier = scene.b[scene.law.carrier];
    let q = carrier.rotation().r;
    let mut remember = |body: &mut Body| {
        let now = NodeBefore::of(body.place, body.rotation().r, carrier.place, &q);
        body.before =
            NodeBefore { place: now.place + random.vector(0.1), rotation: random.rotation(0.5).r * now.rotation };
    };
    scene.a.iter_mut().for_each(&mut remember);
    scene.b.iter_mut().for_each(&mut remember);
    let normal = scene.now(Weights::NONE).1.normal;
    let n0 = (normal + random.vector(0.2)).normalized().unwrap();
    let free = random.vector(0.3);
    let carried = CarriedTraction { force: free - n0 * n0.dot(free), normal: n0, ..CarriedTraction::default() };
    // Some were open.
    scene.law.carried = if random.between(0.0, 1.0) < 0.25 { CarriedTraction::default() } else { carried };
    scene.law.friction = Some(FrictionLaw::plain(random.between(0.1, 1.5), random.between(0.5, 3.0)));
}

fn check<const NA: usize, const NB: usize>(random: &mut Random, wanted: usize, errors: &mut Errors) {
    for free in [[true, true], [true, false], [false, true], [false, false]] {
        for (friction, damped) in [(false, false), (true, false), (false, true), (true, true)] {
            for _ in 0..wanted {
                let Some(scene) = random_pair::<NA, NB>(random, free, friction, damped) else { continue };
                examine(&scene, random, friction, damped, errors);
            }
        }
    }
}

fn examine<const NA: usize, const NB: usize>(
    scene: &Scene<NA, NB>,
    random: &mut Random,
    friction: bool,
    damped: bool,
    errors: &mut Errors,
) {
    errors.count += 1;
    match scene.now(Weights::NONE).1.status() {
        Status::Sticks => errors.stick += 1,
        Status::Slides => errors.slip += 1,
        Status::Open | Status::Frictionless => {}
    }
    let weights = if damped { WEIGHTS } else { Weights::STIFFNESS };
    let (system, _) = scene.now(weights);
    let directions = random.directions(6 * (NA + NB));
    let exact = scene.dual(&directions, weights);
    errors.tangent = errors.tangent.max(tangent_error(&system, &exact, &directions));
    let size = size(&system);
    let mut force = Vec3::ZERO;
    let mut moment = Vec3::ZERO;
    for (i, body) in scene.bodies().enumerate() {
        let f = system.force_block(2 * i);
        let inverse = Rotation::new(body.p).t_inverse();
        force += f;
        moment += body.place.cross(f) + body.rotation().r * inverse.transpose_mul(system.force_block(2 * i + 1));
    }
    errors.force_sum = errors.force_sum.max(force.max_abs());
    errors.moment_sum = errors.moment_sum.max(moment.max_abs());
    if !friction && !damped {
        let count = 6 * (NA + NB);
        let tangent = system.tangent();
        let apart = |i: usize, j: usize| (tangent[i * count + j] - tangent[j * count + i]).abs() / size;
        let worst = (0..count).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| apart(i, j));
        errors.asymmetry = worst.fold(errors.asymmetry, f64::max);
    }
    let by = random.rotation(3.0).r;
    let (after, _) = scene.moved(&by, random.vector(2.0)).now(weights);
    let turn = |block: usize| if block.is_multiple_of(2) { by } else { Mat3::IDENTITY };
    for row in 0..2 * (NA + NB) {
        let change = turn(row) * system.force_block(row) - after.force_block(row);
        errors.objectivity = errors.objectivity.max(change.max_abs());
        for column in 0..2 * (NA + NB) {
            let turned = turn(row) * system.tangent_block(row, column) * turn(column).transpose();
            let change = (turned - after.tangent_block(row, column)).max_abs() / size;
            errors.objectivity = errors.objectivity.max(change);
        }
    }
}

#[test]
fn pairs_have_their_tangent() {
    let mut random = Random(61);
    let mut all = [(); 9].map(|()| Errors::default());
    check::<2, 2>(&mut random, 4, &mut all[0]);
    check::<2, 3>(&mut random, 4, &mut all[1]);
    check::<2, 4>(&mut random, 4, &mut all[2]);
    check::<3, 2>(&mut random, 4, &mut all[3]);
    check::<3, 3>(&mut random, 4, &mut all[4]);
    check::<3, 4>(&mut random, 4, &mut all[5]);
    check::<4, 2>(&mut random, 4, &mut all[6]);
    check::<4, 3>(&mut random, 4, &mut all[7]);
    check::<4, 4>(&mut random, 4, &mut all[8]);
    for (k, errors) in all.iter().enumerate() {
        let nodes = [k / 3 + 2, k % 3 + 2];
        println!("pairs of {nodes:?} nodes: {errors:?}");
        assert!(errors.count >= 40 && errors.stick >= 3 && errors.slip >= 3, "{nodes:?}: {errors:?}");
        assert!(errors.tangent < 1e-12 && errors.objectivity < 1e-11, "{nodes:?}: {errors:?}");
        assert!(errors.force_sum < 1e-14 && errors.moment_sum < 1e-14, "{nodes:?}: {errors:?}");
        assert!(errors.asymmetry < 1e-13, "{nodes:?}: {errors:?}");
    }
}

#[test]
fn rigid_motions_within_a_step_do_not_slide() {
    let mut random = Random(62);
    let mut count = 0;
    for _ in 0..40 {
        let Some(mut scene) = random_pair::<3, 2>(&mut random, [true, true], true, false) else { continue };
        let carrier = scene.b[scene.law.carrier];
        let q = carrier.rotation().r;
        let remember = |body: &mut Body| {
            body.before = NodeBefore::of(body.place, body.rotation().r, carrier.place, &q);
        };
        scene.a.iter_mut().for_each(remember);
        scene.b.iter_mut().for_each(remember);
        let n0 = scene.now(Weights::NONE).1.normal;
        let free = random.vector(0.3);
        scene.law.carried =
            CarriedTraction { force: free - n0 * n0.dot(free), normal: n0, ..CarriedTraction::default() };
        scene.law.friction = Some(FrictionLaw::plain(100.0, 2.0));
        let by = random.rotation(3.0).r;
        let (_, state) = scene.moved(&by, random.vector(2.0)).now(Weights::NONE);
        let change = (state.traction.force - scene.law.carried.force).max_abs();
        assert!(change < 1e-13 && state.traction.sliding.max_abs() < 1e-13, "{change:e}");
        count += 1;
    }
    assert!(count > 20);
}

#[test]
fn rods_that_roll_on_each_other_do_not_slide() {
    // Two parallel rods of radii 1 and 2 that turn like gears: equal speeds of the surfaces.
    let straight = |y: f64, p: Vec3| -> [Body; 2] {
        from_fn(|i| Body {
            place: Vec3([i as f64, y, 0.0]),
            velocity: Vec3::ZERO,
            base: Mat3::IDENTITY,
            p,
            before: NodeBefore { place: Vec3([i as f64, y, 0.0]), rotation: Mat3::IDENTITY },
        })
    };
    let scene = |turn_a: f64, turn_b: f64| Scene {
        a: straight(2.99, Vec3([turn_a, 0.0, 0.0])),
        b: straight(0.0, Vec3([turn_b, 0.0, 0.0])),
        s: 0.5,
        e: 0.5,
        law: PairLaw {
            radii: [1.0, 2.0],
            normal: NormalLaw::Penalty { stiffness: 100.0, damping: 0.0, offset: 0.0 },
            friction: Some(FrictionLaw::plain(0.5, 10.0)),
            carried: CarriedTraction::default(),
            carrier: 0,
            free: [false, false],
            weight: 1.0,
        },
    };
    // The arms are 0.995 and 1.995, since the penetration is shared.
    let (_, rolls) = scene(0.2, -0.2 * 0.995 / 1.995).now(Weights::NONE);
    println!("rolling rods: {:?}", rolls.traction.force);
    assert!(rolls.traction.sliding.max_abs() < 1e-2);
    let (_, slides) = scene(0.2, 0.2).now(Weights::NONE);
    assert_eq!(slides.status(), Status::Slides);
}
