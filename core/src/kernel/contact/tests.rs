//! Contact points against dual numbers, balance of forces and moments, objectivity, symmetry.

use super::along::{MinimumKind, ShapeAt, minima, slopes, weighted_sum};
use super::distance::Side;
use super::dual::{Dual, Errors, Random, along, size, tangent_error};
use super::friction::{CarriedTraction, FrictionLaw, Status};
use super::law::NormalLaw;
use super::point::{Carrier, ContactLaw, Place, PointState, add_point};
use super::surface::{Surface, tests::shapes};
use super::variation::{ContactNode, NodeBefore, NodeTurning};
use crate::kernel::element::{ElementSystem, Weights};
use crate::rotation::Rotation;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};
use std::array::from_fn;

/// The number of random directions along which a tangent is compared.
const DIRECTIONS: usize = 3;

/// Weights of a step of dynamics.
const WEIGHTS: Weights = Weights { stiffness: 0.7, damping: 1.3, mass: 0.0 };

/// Who carries the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CarriedBy {
    Ground,
    Motion,
    Node,
}

/// The unknowns of a node with their rates, and the rotation that its rotation vector follows.
#[derive(Clone, Copy)]
struct Body {
    start: Vec3,
    base: Mat3,
    u: Vec3,
    p: Vec3,
    u_rate: Vec3,
    p_rate: Vec3,
}

/// A contact point with all that it depends on.
struct Scene<const N: usize> {
    bodies: [Body; N],
    before: [NodeBefore; N],
    carrier: Body,
    carried_by: CarriedBy,
    surface: Surface,
    law: ContactLaw,
    s: f64,
}

impl Body {
    fn random(random: &mut Random, start: Vec3, still: bool) -> Self {
        let rate = if still { 0.0 } else { 0.5 };
        Self {
            start,
            base: random.rotation(2.0).r,
            u: random.vector(0.2),
            p: random.vector(1.0),
            u_rate: random.vector(rate),
            p_rate: random.vector(rate),
        }
    }

    fn place(&self) -> Vec3 {
        self.start + self.u
    }

    fn rotation(&self) -> Rotation {
        Rotation::new(self.p).after(self.base)
    }

    /// The body after a rigid motion of the scene.
    fn moved(&self, by: &Mat3, shift: Vec3) -> Self {
        let u = *by * self.place() + shift - self.start;
        Self { u, base: *by * self.base, u_rate: *by * self.u_rate, ..*self }
    }
}

/// Unknowns and rates of a body as variables of a scalar.
struct Unknowns<T> {
    u: Vec3<T>,
    p: Vec3<T>,
    u_rate: Vec3<T>,
    p_rate: Vec3<T>,
}

impl Unknowns<f64> {
    fn of(body: &Body) -> Self {
        Self { u: body.u, p: body.p, u_rate: body.u_rate, p_rate: body.p_rate }
    }
}

type D = Dual<DIRECTIONS>;

impl Unknowns<D> {
    /// Unknowns whose derivatives are those of the weights along directions.
    fn along(body: &Body, first: usize, directions: &[Vec<f64>; DIRECTIONS], weights: Weights) -> Self {
        Self {
            u: along(body.u, first, directions, weights.stiffness),
            p: along(body.p, first + 3, directions, weights.stiffness),
            u_rate: along(body.u_rate, first, directions, weights.damping),
            p_rate: along(body.p_rate, first + 3, directions, weights.damping),
        }
    }

    fn constants(body: &Body) -> Self {
        let Body { u, p, u_rate, p_rate, .. } = *body;
        Self {
            u: Vec3::constant(u),
            p: Vec3::constant(p),
            u_rate: Vec3::constant(u_rate),
            p_rate: Vec3::constant(p_rate),
        }
    }
}

impl<const N: usize> Scene<N> {
    fn nodes<T: Real>(&self, unknowns: &[Unknowns<T>; N]) -> [ContactNode<T>; N] {
        from_fn(|i| ContactNode {
            place: Vec3::constant(self.bodies[i].start) + unknowns[i].u,
            velocity: unknowns[i].u_rate,
        })
    }

    fn turning<T: Real>(&self, unknowns: &[Unknowns<T>; N]) -> [NodeTurning<T>; N] {
        from_fn(|i| NodeTurning {
            rotation: Rotation::new(unknowns[i].p).after(Mat3::constant(self.bodies[i].base)),
            before: self.before[i],
        })
    }

    fn carrier<T: Real>(&self, unknowns: &Unknowns<T>, weights: Weights) -> Carrier<T> {
        if self.carried_by == CarriedBy::Ground {
            return Carrier::ground();
        }
        let rotation = Rotation::new(unknowns.p);
        let is_node = self.carried_by == CarriedBy::Node;
        let omega_derivative =
            rotation.c1(unknowns.p_rate).scale(weights.stiffness) + rotation.t.scale(weights.damping);
        Carrier {
            place: Vec3::constant(self.carrier.start) + unknowns.u,
            velocity: unknowns.u_rate,
            omega: rotation.t * unknowns.p_rate,
            omega_derivative: if is_node { omega_derivative } else { Mat3::zero() },
            rotation: rotation.after(Mat3::constant(self.carrier.base)),
            origin: self.carrier.start,
            is_node,
        }
    }

    fn blocks(&self) -> usize {
        2 * N + if self.carried_by == CarriedBy::Node { 2 } else { 0 }
    }

    fn evaluate<T: Real>(
        &self,
        unknowns: &[Unknowns<T>; N],
        carrier: &Unknowns<T>,
        s: T,
        weights: Weights,
    ) -> (ElementSystem<T>, PointState<T>) {
        let nodes = self.nodes(unknowns);
        let carrier = self.carrier(carrier, weights);
        let shape = ShapeAt::new(s);
        let point = carrier.on_surface(weighted_sum(&shape.values, |i| nodes[i].place));
        let distance = self.surface.distance(point).unwrap();
        let mut out = ElementSystem::new(self.blocks());
        let turning = self.turning(unknowns);
        let state = add_point((&nodes, Some(&turning)), &shape, &carrier, &distance, &self.law, weights, &mut out);
        (out, state)
    }

    /// The system of a contact without friction: nodes have displacements alone.
    fn of_displacements(&self, weights: Weights) -> ElementSystem {
        let nodes = self.nodes(&from_fn(|i| Unknowns::of(&self.bodies[i])));
        let carrier = self.carrier(&Unknowns::of(&self.carrier), weights);
        let shape = ShapeAt::new(self.s);
        let point = carrier.on_surface(weighted_sum(&shape.values, |i| nodes[i].place));
        let distance = self.surface.distance(point).unwrap();
        let mut out = ElementSystem::new(self.blocks() - N);
        add_point((&nodes, None), &shape, &carrier, &distance, &self.law, weights, &mut out);
        out
    }

    fn now(&self, weights: Weights) -> (ElementSystem, PointState) {
        self.evaluate(&from_fn(|i| Unknowns::of(&self.bodies[i])), &Unknowns::of(&self.carrier), self.s, weights)
    }

    /// Forces in dual numbers, at a closest point that moves if the law says so.
    fn dual(&self, directions: &[Vec<f64>; DIRECTIONS], weights: Weights) -> ElementSystem<D> {
        let unknowns = from_fn(|i| Unknowns::along(&self.bodies[i], 6 * i, directions, weights));
        let carrier = match self.carried_by {
            CarriedBy::Node => Unknowns::along(&self.carrier, 6 * N, directions, weights),
            CarriedBy::Ground | CarriedBy::Motion => Unknowns::constants(&self.carrier),
        };
        let s = match self.law.place {
            Place::Fixed => D::constant(self.s),
            Place::Closest => self.closest(&unknowns, &carrier),
        };
        self.evaluate(&unknowns, &carrier, s, Weights::NONE).0
    }

    /// The closest point by a step of Newton's method in dual numbers.
    fn closest(&self, unknowns: &[Unknowns<D>; N], carrier: &Unknowns<D>) -> D {
        let nodes = self.nodes(unknowns);
        let carrier = self.carrier(carrier, Weights::NONE);
        let shape = ShapeAt::<N, D>::new(D::constant(self.s));
        let place = |i: usize| carrier.on_surface(nodes[i].place);
        let distance = self.surface.distance(weighted_sum(&shape.values, place)).unwrap();
        let first = weighted_sum(&shape.slopes, place);
        let second = weighted_sum(&shape.bends, place);
        let n = distance.normal;
        let f_ss = n.dot(second) + first.dot(distance.curvature * first);
        D::constant(self.s) - n.dot(first) / f_ss
    }

    /// Nodes as the carrier sees them, on the surface.
    fn seen(&self) -> [Vec3; N] {
        let carrier = self.carrier(&Unknowns::of(&self.carrier), Weights::NONE);
        from_fn(|i| carrier.on_surface(self.bodies[i].place()))
    }

    fn moved(&self, by: &Mat3, shift: Vec3) -> Self {
        Self {
            bodies: from_fn(|i| self.bodies[i].moved(by, shift)),
            carrier: self.carrier.moved(by, shift),
            surface: self.surface.clone(),
            ..*self
        }
    }
}

/// Without friction a contact acts on displacements alone, with the same forces and the same tangent.
#[test]
fn points_without_friction_leave_out_rotations() {
    let mut random = Random(51);
    let mut compared = 0;
    for (name, shape) in shapes() {
        let surface = Surface { shape, side: Side::Outside };
        for carried_by in [CarriedBy::Ground, CarriedBy::Motion, CarriedBy::Node] {
            for (place, damped) in [(Place::Fixed, true), (Place::Closest, false)] {
                let kind = Kind { carried_by, place, friction: false, damped };
                let Some(scene) = (0..50).find_map(|_| random_scene::<2>(&mut random, &surface, kind)) else {
                    continue;
                };
                let (whole, compact) = (scene.now(WEIGHTS).0, scene.of_displacements(WEIGHTS));
                // Rotations of the two nodes are the blocks 1 and 3 of the whole.
                let of_whole = [0, 2, 4, 5];
                for i in 0..compact.blocks() {
                    assert_eq!(compact.force_block(i), whole.force_block(of_whole[i]), "{name} {kind:?}");
                    for j in 0..compact.blocks() {
                        let [a, b] = [compact.tangent_block(i, j), whole.tangent_block(of_whole[i], of_whole[j])];
                        assert_eq!(a, b, "{name} {kind:?} {i} {j}");
                    }
                }
                compared += 1;
            }
        }
    }
    assert!(compared > 40, "{compared}");
}

/// The kinds of scenes.
#[derive(Clone, Copy, Debug)]
struct Kind {
    carried_by: CarriedBy,
    place: Place,
    friction: bool,
    damped: bool,
}

/// A random scene with a contact that has a force; `None` if the random one has none.
fn random_scene<const N: usize>(random: &mut Random, surface: &Surface, kind: Kind) -> Option<Scene<N>> {
    let still = !kind.damped;
    let from = random.vector(1.5);
    let line = random.direction() * random.between(0.3, 0.8);
    let starts: [Vec3; N] = from_fn(|i| from + line * (i as f64 / (N.max(2) - 1) as f64) + random.vector(0.05));
    let start = random.vector(0.3);
    let carrier = Body::random(random, start, still);
    let bodies = from_fn(|i| {
        let mut body = Body::random(random, starts[i], still);
        body.u = body.u * 0.2;
        body
    });
    let mut scene = Scene {
        bodies,
        before: [NodeBefore { place: Vec3::ZERO, rotation: Mat3::IDENTITY }; N],
        carrier,
        carried_by: kind.carried_by,
        surface: surface.clone(),
        law: ContactLaw {
            radius: 0.1,
            normal: NormalLaw::Augmented { multiplier: 0.0, stiffness: random.between(1.0, 5.0), touching: 0.0 },
            friction: None,
            carried: CarriedTraction::default(),
            place: kind.place,
            weight: 0.75,
        },
        s: random.between(0.0, 1.0),
    };
    let distance = |y: Vec3| surface.distance(y).ok();
    let seen = scene.seen();
    if kind.place == Place::Closest {
        scene.s = minima(&seen, scene.surface.intervals(&seen), &distance)
            .found()
            .iter()
            .find(|minimum| minimum.kind != MinimumKind::Kink)?
            .s;
    }
    let shape = ShapeAt::<N>::new(scene.s);
    let here = distance(weighted_sum(&shape.values, |i| seen[i]))?;
    let flat = kind.place == Place::Closest && slopes(&seen, &shape, &here).second < 0.1;
    if here.value < -0.05 || here.curvature.max_abs() > 8.0 || flat {
        return None;
    }
    let stiffness = random.between(1.0, 5.0);
    let depth = random.between(0.1, 0.4);
    scene.law.radius = here.value + depth;
    scene.law.normal = if kind.damped {
        NormalLaw::Penalty { stiffness, damping: random.between(0.1, 0.5), offset: random.between(0.0, 0.3) }
    } else {
        NormalLaw::Augmented { multiplier: random.between(0.1, 1.0), stiffness, touching: 0.0 }
    };
    if kind.friction {
        set_friction(random, &mut scene, here.normal);
    }
    (scene.now(Weights::NONE).1.status() != Status::Open).then_some(scene)
}

/// Gives a scene friction and a state before, from which it has turned and slid a little.
fn set_friction<const N: usize>(random: &mut Random, scene: &mut Scene<N>, normal: Vec3) {
    let carrier = scene.carrier(&Unknowns::of(&scene.carrier), Weights::NONE);
    scene.before = from_fn(|i| {
        let seen = carrier.rotation.r.transpose() * scene.bodies[i].rotation().r;
        NodeBefore {
            place: carrier.sees(scene.bodies[i].place()) + random.vector(0.2),
            rotation: random.rotation(0.5).r * seen,
        }
    });
    let n0 = (normal + random.vector(0.2)).normalized().unwrap();
    let free = random.vector(0.3);
    let carried = CarriedTraction { force: free - n0 * n0.dot(free), normal: n0, ..CarriedTraction::default() };
    // Some were open.
    scene.law.carried = if random.between(0.0, 1.0) < 0.25 { CarriedTraction::default() } else { carried };
    scene.law.friction = Some(FrictionLaw::plain(random.between(0.1, 1.5), random.between(0.5, 3.0)));
}

/// Sums of spatial forces and of moments about the origin, of the element and the carrier.
fn sums<const N: usize>(scene: &Scene<N>) -> (Vec3, Vec3) {
    let (system, _) = scene.now(Weights::NONE);
    let mut force = Vec3::ZERO;
    let mut moment = Vec3::ZERO;
    let bodies = scene.bodies.iter().chain([&scene.carrier]);
    for (i, body) in bodies.enumerate() {
        let f = system.force_block(2 * i);
        let rotation = body.rotation();
        force += f;
        moment += body.place().cross(f)
            + rotation.r * (Rotation::new(body.p).t_inverse().transpose_mul(system.force_block(2 * i + 1)));
    }
    (force, moment)
}

fn asymmetry(system: &ElementSystem) -> f64 {
    let count = 3 * system.blocks();
    let tangent = system.tangent();
    let mut worst = 0.0f64;
    for i in 0..count {
        for j in 0..i {
            worst = worst.max((tangent[i * count + j] - tangent[j * count + i]).abs());
        }
    }
    worst / size(system)
}

/// The change of forces and tangent by a rigid motion of the whole scene, beyond their rotation.
fn objectivity_error<const N: usize>(scene: &Scene<N>, random: &mut Random) -> f64 {
    let by = random.rotation(3.0).r;
    let moved = scene.moved(&by, random.vector(2.0));
    let (before, _) = scene.now(WEIGHTS);
    let (after, _) = moved.now(WEIGHTS);
    let mut worst = 0.0f64;
    let turn = |block: usize| if block.is_multiple_of(2) { by } else { Mat3::IDENTITY };
    for row in 0..scene.blocks() {
        worst = worst.max((turn(row) * before.force_block(row) - after.force_block(row)).max_abs());
        for column in 0..scene.blocks() {
            let turned = turn(row) * before.tangent_block(row, column) * turn(column).transpose();
            worst = worst.max((turned - after.tangent_block(row, column)).max_abs());
        }
    }
    worst / size(&before)
}

fn examine<const N: usize>(random: &mut Random, surface: &Surface, kind: Kind, wanted: usize, errors: &mut Errors) {
    let mut found = 0;
    for _ in 0..60 * wanted {
        let Some(scene) = random_scene::<N>(random, surface, kind) else { continue };
        match scene.now(Weights::NONE).1.status() {
            Status::Sticks => errors.stick += 1,
            Status::Slides => errors.slip += 1,
            Status::Open | Status::Frictionless => {}
        }
        let weights = if kind.damped { WEIGHTS } else { Weights::STIFFNESS };
        let directions = random.directions(3 * scene.blocks());
        let exact = scene.dual(&directions, weights);
        errors.tangent = errors.tangent.max(tangent_error(&scene.now(weights).0, &exact, &directions));
        if kind.carried_by == CarriedBy::Node {
            let (force, moment) = sums(&scene);
            errors.force_sum = errors.force_sum.max(force.max_abs());
            errors.moment_sum = errors.moment_sum.max(moment.max_abs());
            errors.objectivity = errors.objectivity.max(objectivity_error(&scene, random));
        }
        if !kind.friction && !kind.damped {
            errors.asymmetry = errors.asymmetry.max(asymmetry(&scene.now(Weights::STIFFNESS).0));
        }
        errors.count += 1;
        found += 1;
        if found == wanted {
            break;
        }
    }
}

/// Contacts of all kinds with elements of one to four nodes on all surfaces.
fn examine_all(place: Place, wanted: usize, seed: u64) {
    let mut random = Random(seed);
    for (name, shape) in shapes() {
        let mut errors = Errors::default();
        for side in [Side::Outside, Side::Inside] {
            let surface = Surface { shape: shape.clone(), side };
            for carried_by in [CarriedBy::Ground, CarriedBy::Motion, CarriedBy::Node] {
                for (friction, damped) in [(false, false), (true, false), (false, true), (true, true)] {
                    let kind = Kind { carried_by, place, friction, damped };
                    if place == Place::Fixed {
                        examine::<1>(&mut random, &surface, kind, wanted, &mut errors);
                    }
                    examine::<2>(&mut random, &surface, kind, wanted, &mut errors);
                    examine::<3>(&mut random, &surface, kind, wanted, &mut errors);
                    examine::<4>(&mut random, &surface, kind, wanted, &mut errors);
                }
            }
        }
        println!("{name}: {errors:?}");
        assert!(errors.count >= 20 && errors.stick >= 4 && errors.slip >= 4, "{name}: {errors:?}");
        assert!(errors.tangent < 1e-12 && errors.objectivity < 1e-11, "{name}: {errors:?}");
        assert!(errors.force_sum < 1e-14 && errors.moment_sum < 1e-14, "{name}: {errors:?}");
        assert!(errors.asymmetry < 1e-13, "{name}: {errors:?}");
    }
}

#[test]
fn contact_points_have_their_tangent() {
    examine_all(Place::Fixed, 4, 31);
}

#[test]
fn closest_points_have_their_tangent() {
    examine_all(Place::Closest, 4, 32);
}

/// Forces of a scene with one unknown changed by `change`, at the closest point found anew.
fn projected<const N: usize>(scene: &Scene<N>, unknown: usize, change: f64) -> Vec<f64> {
    let bodies_changed = |body: &Body, first: usize| {
        let mut body = *body;
        for i in 0..3 {
            if first + i == unknown {
                body.u.0[i] += change;
            }
            if first + 3 + i == unknown {
                body.p.0[i] += change;
            }
        }
        body
    };
    let mut changed = Scene {
        bodies: from_fn(|i| bodies_changed(&scene.bodies[i], 6 * i)),
        carrier: bodies_changed(&scene.carrier, 6 * N),
        surface: scene.surface.clone(),
        ..*scene
    };
    let distance = |y: Vec3| changed.surface.distance(y).ok();
    let found = minima(&changed.seen(), changed.surface.intervals(&changed.seen()), &distance);
    let nearest = found.found().iter().map(|minimum| minimum.s).min_by(|a, b| {
        let apart = |s: &f64| (s - scene.s).abs();
        apart(a).total_cmp(&apart(b))
    });
    changed.s = nearest.unwrap();
    changed.now(Weights::NONE).0.force().to_vec()
}

fn difference_error<const N: usize>(random: &mut Random, surface: &Surface, wanted: usize) -> f64 {
    const STEP: f64 = 1e-5;
    let kind = Kind { carried_by: CarriedBy::Node, place: Place::Closest, friction: true, damped: false };
    let mut worst = 0.0f64;
    let mut found = 0;
    while found < wanted {
        let Some(scene) = random_scene::<N>(random, surface, kind) else { continue };
        if !(0.01..0.99).contains(&scene.s) {
            continue;
        }
        found += 1;
        let (system, state) = scene.now(Weights::STIFFNESS);
        let count = 3 * scene.blocks();
        let tangent = system.tangent();
        let size = size(&system);
        let friction = scene.law.friction.unwrap();
        let limit = friction.coefficient * state.normal_force.force;
        // The part of the sliding that is not elastic, at least
        let slip = state.traction.sliding.norm() - (scene.law.carried.force.norm() + limit) / friction.stiffness;
        // Differences across the kink between stick and slip mean nothing.
        let near_limit = state.traction.force.norm() > 0.95 * limit;
        if (near_limit && state.status() == Status::Sticks) || (state.status() == Status::Slides && slip < 1e-2) {
            continue;
        }
        for column in 0..count {
            let at = |steps: f64| projected(&scene, column, steps * STEP);
            let [after, before, far_after, far_before] = [at(1.0), at(-1.0), at(2.0), at(-2.0)];
            for row in 0..count {
                let near = (after[row] - before[row]) * 8.0;
                let slope = (near - (far_after[row] - far_before[row])) / (12.0 * STEP);
                worst = worst.max((slope - tangent[row * count + column]).abs() / size);
            }
        }
    }
    worst
}

#[test]
fn closest_points_found_anew_agree_with_the_tangent() {
    let mut random = Random(33);
    for (name, shape) in shapes() {
        if name == "plane" {
            continue;
        }
        let surface = Surface { shape, side: Side::Outside };
        let errors = [
            difference_error::<2>(&mut random, &surface, 3),
            difference_error::<3>(&mut random, &surface, 3),
            difference_error::<4>(&mut random, &surface, 3),
        ];
        println!("differences, {name}: {errors:?}");
        assert!(errors.iter().all(|&error| error < 5e-9), "{name}: {errors:?}");
    }
}

/// A scene whose state before is its present one, with a traction that sticks.
fn at_rest(random: &mut Random, surface: &Surface) -> Scene<3> {
    let kind = Kind { carried_by: CarriedBy::Node, place: Place::Fixed, friction: true, damped: false };
    loop {
        let Some(mut scene) = random_scene::<3>(random, surface, kind) else { continue };
        let carrier = scene.carrier(&Unknowns::of(&scene.carrier), Weights::NONE);
        let body = |i: usize| &scene.bodies[i];
        scene.before =
            from_fn(|i| NodeBefore::of(body(i).place(), body(i).rotation().r, carrier.place, &carrier.rotation.r));
        scene.law.friction = Some(FrictionLaw::plain(50.0, 2.0));
        let (_, state) = scene.now(Weights::NONE);
        let n0 = state.normal;
        let free = random.vector(0.3);
        scene.law.carried =
            CarriedTraction { force: free - n0 * n0.dot(free), normal: n0, ..CarriedTraction::default() };
        return scene;
    }
}

#[test]
fn rigid_motions_within_a_step_do_not_slide() {
    let mut random = Random(34);
    for (name, shape) in shapes() {
        let surface = Surface { shape, side: Side::Outside };
        for _ in 0..20 {
            let scene = at_rest(&mut random, &surface);
            let by = random.rotation(3.0).r;
            let (_, state) = scene.moved(&by, random.vector(2.0)).now(Weights::NONE);
            let change = (state.traction.force - scene.law.carried.force).max_abs();
            assert!(change < 1e-13 && state.traction.sliding.max_abs() < 1e-14, "{name}: {change:e}");
        }
    }
}

#[test]
fn balls_that_roll_do_not_slide() {
    let surface =
        Surface { shape: super::Shape::Plane { point: Vec3::ZERO, normal: Vec3::UNIT[2] }, side: Side::Outside };
    let radius = 0.3;
    let start = Vec3([0.0, 0.0, 0.29]);
    let still =
        Body { start, base: Mat3::IDENTITY, u: Vec3::ZERO, p: Vec3::ZERO, u_rate: Vec3::ZERO, p_rate: Vec3::ZERO };
    let scene = |angle: f64, advance: f64| Scene::<1> {
        bodies: [Body { u: Vec3([advance, 0.0, 0.0]), p: Vec3([0.0, angle, 0.0]), ..still }],
        before: [NodeBefore { place: start, rotation: Mat3::IDENTITY }],
        carrier: still,
        carried_by: CarriedBy::Ground,
        surface: surface.clone(),
        law: ContactLaw {
            radius,
            normal: NormalLaw::Penalty { stiffness: 100.0, damping: 0.0, offset: 0.0 },
            friction: Some(FrictionLaw::plain(0.5, 10.0)),
            carried: CarriedTraction::default(),
            place: Place::Fixed,
            weight: 1.0,
        },
        s: 0.0,
    };
    let (_, rolls) = scene(0.7, 0.7 * radius).now(Weights::NONE);
    assert!(rolls.traction.force.max_abs() < 1e-15 && rolls.status() == Status::Sticks);
    // Turned on the spot: the contact point goes backward, friction drives the ball forward.
    let (system, spins) = scene(0.7, 0.0).now(Weights::NONE);
    assert_eq!(spins.status(), Status::Slides);
    assert!((spins.force() - Vec3([0.5, 0.0, 1.0])).max_abs() < 1e-14, "{:?}", spins.force());
    // Internal forces: the force of the surface on the ball with the opposite sign, and its moment
    // about the centre, which brakes the spin.
    assert!((system.force_block(0) + Vec3([0.5, 0.0, 1.0])).max_abs() < 1e-14);
    assert!((system.force_block(1) - Vec3([0.0, 0.5 * radius, 0.0])).max_abs() < 1e-14);
}

#[test]
fn contact_points_dissipate() {
    let mut random = Random(35);
    let mut least = f64::INFINITY;
    let mut count = 0;
    for (_, shape) in shapes() {
        let surface = Surface { shape, side: Side::Outside };
        let kind = Kind { carried_by: CarriedBy::Node, place: Place::Fixed, friction: true, damped: false };
        for _ in 0..400 {
            let Some(scene) = random_scene::<2>(&mut random, &surface, kind) else { continue };
            let (_, state) = scene.now(Weights::NONE);
            let friction = scene.law.friction.unwrap();
            least = least.min(friction.dissipation(&scene.law.carried, &state.traction));
            count += 1;
        }
    }
    println!("least dissipation of {count} contacts: {least:e}");
    assert!(count > 300 && least >= 0.0);
}
