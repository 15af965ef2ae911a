//! Joints, dampers, links and rotating frames: forces and tangents against automatic differentiation.

use crate::dual::{Dual, values, variables, with_room};
use crate::random::Random;
use crate::scenes::{attempt, simulate};
use crate::tangents::{agree, symmetric};
use beamsim_core::effect::joint::{FreeCoordinate, Joint, JointKind};
use beamsim_core::effect::spring::Link;
use beamsim_core::kernel::inertia::{Derivatives, Inertia, Spin, body, drag, steadily_turned};
use beamsim_core::kernel::joint::{DirectionPair, End, GapFactors, add_along, add_between, block, cosine, slides};
use beamsim_core::kernel::turn::{Carrier, Start, StepCoefficients, Stretch, Turn};
use beamsim_core::kernel::volume::VolumeForce;
use beamsim_core::kernel::{ElementSystem, Weights};
use beamsim_core::rotation::Rotation;
use beamsim_core::run::Failure;
use beamsim_core::scalar::Real;
use beamsim_core::system::{Node, State};
use beamsim_core::tensor::{Mat3, Vec3};

/// u_A, P_A, u_B, P_B and two times three multipliers.
type Wide = Dual<18>;

const BASES: [f64; 4] = [0.0, 1.2, 3.0, 5.5];

/// A joint of a kind between two nodes, or between ground and a node.
struct Scene {
    joint: Joint,
    fields: [Vec3; 6],
}

impl Scene {
    fn new(kind: JointKind, to_ground: bool, arms: [Vec3; 2], random: &mut Random, base: f64) -> Self {
        let node = |k: u32| Node { u: 2 * k, p: 2 * k + 1 };
        let joint = Joint {
            held: kind.held,
            normal: kind.normal,
            nodes: [(!to_ground).then_some(node(0)), Some(node(1))],
            places: [random.cube(1.0), random.cube(1.0)],
            arms,
            axes: Rotation::new(random.vector(1.0)).r,
            along: Some(4),
            between: Some(5),
            drive: None,
            angle: None,
        };
        let p = [random.vector(base), random.vector(base)];
        let mut fields = [random.cube(1.0), p[0], random.cube(1.0), p[1], random.cube(2.0), random.cube(2.0)];
        if to_ground {
            fields[0] = Vec3::ZERO;
            fields[1] = Vec3::ZERO;
        }
        // Multipliers that are not used stay at zero.
        for slot in [4, 5] {
            let used = joint.used(slot);
            (0..3).filter(|&k| !used[k]).for_each(|k| fields[slot as usize].0[k] = 0.0);
        }
        Self { joint, fields }
    }

    fn ends<T: Real>(&self, fields: &[Vec3<T>; 6]) -> [End<T>; 2] {
        let end = |k: usize| End {
            place: fields[2 * k] + Vec3::constant(self.joint.places[k]),
            rotation: Rotation::new(fields[2 * k + 1]),
        };
        [end(0), end(1)]
    }

    fn lifted(&self) -> [Vec3<Wide>; 6] {
        std::array::from_fn(|k| variables(self.fields[k], 3 * k))
    }

    /// The directions that stay normal.
    fn pairs<T: Real>(&self) -> Vec<DirectionPair<T>> {
        let e = |k: usize| Vec3::constant(self.joint.axes.column(k));
        self.joint.normal.iter().map(|&(i, j)| DirectionPair { a: e(i), b: e(j) }).collect()
    }

    /// lambda . gaps, in the order of the blocks.
    fn lagrangian<T: Real>(&self, fields: &[Vec3<T>; 6]) -> T {
        let [a, b] = self.ends(fields);
        let along = slides(&self.joint.axes, &self.joint.arms, &a, &b);
        let mut sum = T::constant(0.0);
        for k in (0..3).filter(|&k| self.joint.held[k]) {
            sum += along.0[k] * fields[4].0[k];
        }
        for (k, pair) in self.pairs().into_iter().enumerate() {
            sum += cosine(pair, &a, &b) * fields[5].0[k];
        }
        sum
    }

    /// Forces on the nodes and gaps, from the kernels.
    fn forces<T: Real>(&self, fields: &[Vec3<T>; 6]) -> ElementSystem<T> {
        let mut out = ElementSystem::new(block::COUNT);
        let ends = self.ends(fields);
        add_along(&self.joint.axes, &self.joint.arms, &ends, fields[4], GapFactors::NONE, &mut out);
        let mut along = slides(&self.joint.axes, &self.joint.arms, &ends[0], &ends[1]);
        (0..3).filter(|&k| !self.joint.held[k]).for_each(|k| along.0[k] = T::constant(0.0));
        out.add_force(block::ALONG, along);
        let mut between = Vec3::zero();
        for (k, pair) in self.pairs().into_iter().enumerate() {
            add_between(pair, &ends, fields[5].0[k], GapFactors::NONE, k, &mut out);
            between.0[k] = cosine(pair, &ends[0], &ends[1]);
        }
        out.add_force(block::BETWEEN, between);
        out
    }

    /// Forces, gaps and tangent, as the effect adds them.
    fn system(&self) -> ElementSystem {
        let mut state = State::rest(6, 0, 0, 0);
        state.q.copy_from_slice(&self.fields);
        let mut out = ElementSystem::new(block::COUNT);
        self.joint.system(&state, Weights::STIFFNESS, &mut out);
        out
    }

    /// Which unknowns the joint has: those of its nodes, and the multipliers that it uses.
    fn used(&self) -> Vec<bool> {
        let node = |k: usize| [self.joint.nodes[k].is_some(); 6];
        [&node(0)[..], &node(1), &self.joint.used(4), &self.joint.used(5)].concat()
    }
}

fn exact(force: &[Wide]) -> Vec<f64> {
    force.iter().flat_map(|f| f.partials.to_vec()).collect()
}

/// The rows and columns of a square matrix that are used.
fn used_part(matrix: &[f64], used: &[bool]) -> Vec<f64> {
    let size = used.len();
    (0..size * size).filter(|k| used[k / size] && used[k % size]).map(|k| matrix[k]).collect()
}

/// Joints of every kind, between nodes and to ground, with and without arms, in random orientations.
#[test]
fn joints_are_derivatives_of_their_gaps() {
    with_room(|| {
        let mut random = Random::new(1200);
        for base in BASES {
            for kind in JointKind::ALL {
                for (to_ground, has_arms) in [(false, true), (false, false), (true, true), (true, false)] {
                    let arms = if has_arms { [random.cube(0.5), random.cube(0.5)] } else { [Vec3::ZERO; 2] };
                    let scene = Scene::new(kind, to_ground, arms, &mut random, base);
                    let what = format!("{kind:?} joint around |P| = {base}, {to_ground} to ground");
                    let (system, used) = (scene.system(), scene.used());
                    let gradient = scene.lagrangian(&scene.lifted()).partials;
                    agree(&format!("forces, {what}"), system.force(), &gradient, 1e-12);
                    let exact = exact(scene.forces(&scene.lifted()).force());
                    let tangent = used_part(&system.tangent(), &used);
                    agree(&format!("tangent, {what}"), &tangent, &used_part(&exact, &used), 1e-12);
                    symmetric(&what, &tangent, 1e-12);
                }
            }
        }
    });
}

/// A body on a cylindrical joint, held by a spring along each axis and about the joint's, under a force and a moment: it slides
/// by F.n/k and turns until moments balance, whatever the arm from its node to the joint.
#[test]
fn cylindrical_joints_slide_along_their_axis_and_turn_about_it() {
    let (stiffness, turning) = (3.0, 2.0);
    let text = |v: Vec3| format!("{:?}", v.0);
    let mut random = Random::new(1210);
    for number in 0..12 {
        let q = Rotation::new(random.vector(3.0)).r;
        let axis = q.column(0);
        let arm = if number % 2 == 0 { Vec3::ZERO } else { q.column(1) * 0.3 + q.column(2) * 0.2 + axis * 0.4 };
        let (force, moment) = (random.cube(1.0), axis * random.range(-1.5, 1.5));
        let nodes = if number % 3 == 0 { "[\"mover\"]" } else { "[\"anchor\", \"mover\"]" };
        let place = random.cube(1.0);
        let deck = format!(
            r#"
[point]
anchor = [0.2, -0.1, 0.4]
mover = {mover}
[[body]]
at = "anchor"
mass = 1
[[support]]
at = "anchor"
fix = "all"
[[body]]
at = "mover"
mass = 1
[[joint]]
kind = "cylindrical"
nodes = {nodes}
at = {joint}
axis = {axis}
[[spring]]
at = "mover"
stiffness = [{stiffness}, {stiffness}, {stiffness}, {turning}, 0, 0]
axes = [{axis}, {second}]
[[load]]
at = "mover"
force = {force}
moment = {moment}
[[stage]]
kind = "static"
steps = 4
[output]
nodes = ["mover"]
columns = ["u", "r"]
"#,
            mover = text(place),
            joint = text(place + arm),
            axis = text(axis),
            second = text(q.column(1)),
            force = text(force),
            moment = text(moment),
        );
        let end = simulate(&deck);
        let (u, r) = (Vec3(end.vector("mover.u")), Vec3(end.vector("mover.r")));
        assert!((r - axis * axis.dot(r)).norm() < 1e-9, "{r:?} is not about {axis:?}\n{deck}");
        assert!((axis.dot(u) - axis.dot(force) / stiffness).abs() < 1e-9, "slides by {u:?}\n{deck}");
        // The joint's point of the body stays on the axis.
        let seat = Rotation::new(r).r * arm;
        let aside = u + seat - arm;
        assert!((aside - axis * axis.dot(aside)).norm() < 1e-9, "{aside:?} aside\n{deck}");
        // Moments about the axis, with the node at the end of -seat.
        let resultant = moment + (-seat).cross(force - u * stiffness);
        assert!((axis.dot(resultant) - turning * axis.dot(r)).abs() < 1e-8, "{r:?}\n{deck}");
    }
}

/// The JSON Schema lists the kinds of joints in their order, and asks of each the keys that the reader asks for.
#[test]
fn the_schema_knows_the_rows_of_all_joints() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/deck/schema.json");
    let schema: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let joint = &schema["properties"]["joint"]["items"];
    let words: Vec<&str> = JointKind::ALL.iter().map(|kind| kind.word).collect();
    assert_eq!(joint["properties"]["kind"]["enum"], serde_json::json!(words));
    for kind in JointKind::ALL {
        let is_of_kind = |rule: &&serde_json::Value| {
            let of = &rule["if"]["properties"]["kind"];
            of["const"] == kind.word || of["enum"].as_array().is_some_and(|words| words.iter().any(|w| w == kind.word))
        };
        let rules: Vec<_> = joint["then"]["allOf"].as_array().unwrap().iter().filter(is_of_kind).collect();
        let is_required = |key: &str| {
            let required = rules.iter().filter_map(|rule| rule["then"]["required"].as_array());
            required.flatten().any(|word| word == key)
        };
        let is_refused = |key: &str| rules.iter().any(|rule| rule["then"]["properties"][key]["not"].is_object());
        for (key, axes) in [("axis", 1), ("axes", 2)] {
            assert_eq!(is_required(key), kind.axes == axes, "`{key}` of {kind:?} joints");
            assert!(is_refused(key) || kind.axes == axes, "`{key}` of {kind:?} joints");
        }
        for key in ["stiffness", "damping", "history"] {
            assert_eq!(is_refused(key), kind.driven.is_none(), "`{key}` of {kind:?} joints");
        }
        for coordinate in [FreeCoordinate::Angle, FreeCoordinate::Slide] {
            let key = coordinate.word();
            assert_eq!(is_refused(key), kind.driven != Some(coordinate), "`{key}` of {kind:?} joints");
        }
    }
}

#[test]
fn cables_pull_along_themselves() {
    let node = Node { u: 0, p: 1 };
    let mut random = Random::new(1300);
    for tension_only in [false, true] {
        for _ in 0..20 {
            let length = random.range(0.2, 1.6);
            let link = Link {
                nodes: [node, node],
                places: [Vec3::ZERO; 2],
                stiffness: 3.0,
                damping: 0.7,
                length,
                tension_only,
                amplitude: 0,
            };
            let (d, rate) = (random.direction(), random.cube(2.0));
            let pull = link.pull(d, rate);
            let moving: (Vec3<Dual<6>>, Vec3<Dual<6>>) = (variables(d, 0), variables(rate, 3));
            let wide = link.pull(moving.0, moving.1);
            let total = wide.elastic + wide.damping;
            let over = |first: usize| -> Vec<f64> {
                total.0.iter().flat_map(|c| c.partials[first..first + 3].to_vec()).collect()
            };
            let entries = |m: Mat3| -> Vec<f64> { m.0.iter().flatten().copied().collect() };
            if tension_only && length >= 1.0 {
                assert_eq!(values(total), Vec3::ZERO, "a slack cable pulls");
                continue;
            }
            agree("cable over its place", &entries(pull.over_place), &over(0), 1e-12);
            agree("cable over its velocity", &entries(pull.over_velocity), &over(3), 1e-12);
        }
    }
}

/// u, P and their first and second rates as the variables of three evaluations.
type Six = Dual<6>;

const WEIGHTS: [Weights; 4] =
    [Weights::STIFFNESS, Weights::DAMPING, Weights::MASS, Weights { stiffness: 0.7, damping: 3.0, mass: 11.0 }];

fn volume_tangent(force: &VolumeForce) -> Vec<f64> {
    let mut system = ElementSystem::new(2);
    force.write(Weights::STIFFNESS, &mut system);
    system.tangent()
}

fn weighted(forces: [VolumeForce<Six>; 3], weights: Weights) -> Vec<f64> {
    let factors = [weights.stiffness, weights.damping, weights.mass];
    let component = |f: &VolumeForce<Six>, row: usize| if row < 3 { f.u.0[row] } else { f.p.0[row - 3] };
    let entry = |row: usize, column: usize| -> f64 {
        (0..3).map(|k| factors[k] * component(&forces[k], row).partials[column]).sum()
    };
    (0..36).map(|k| entry(k / 6, k % 6)).collect()
}

fn some_inertia(random: &mut Random) -> Inertia {
    Inertia { mass: 1.7, offset: random.vector(0.4), about_node: random.positive_definite() }
}

#[test]
fn drag_and_its_tangent_agree() {
    let mut random = Random::new(1400);
    for base in BASES {
        let inertia = some_inertia(&mut random);
        let (p, v, w) = (random.vector(base), random.cube(2.0), random.cube(2.0));
        let wide = |moving: usize| {
            let pick =
                |k: usize, x: Vec3, first: usize| if k == moving { variables(x, first) } else { Vec3::constant(x) };
            let spin = Spin::new(pick(0, p, 3), pick(1, w, 3), Vec3::zero());
            drag(&inertia.lifted(), pick(1, v, 0), &spin, 0.6, Weights::NONE)
        };
        let forces = [wide(0), wide(1), wide(2)];
        for weights in WEIGHTS {
            let got = drag(&inertia, v, &Spin::new(p, w, Vec3::ZERO), 0.6, weights);
            agree(
                &format!("drag around {base}, {weights:?}"),
                &volume_tangent(&got),
                &weighted(forces, weights),
                1e-12,
            );
        }
    }
}

/// Spins as functions of the increment of a step, around large and small increments, with both kinds of carriers.
#[test]
fn bodies_over_increments_agree() {
    let mut random = Random::new(1500);
    let step = StepCoefficients { beta: 0.3, gamma: 0.6, alpha_m: 0.3, alpha_f: 0.4, length: 0.7 };
    // Increments of a step do not come near a whole turn, where T^-1 ends.
    for base in BASES.into_iter().filter(|&base| base < 4.0) {
        let inertia = some_inertia(&mut random);
        let whole = inertia.about_node;
        let matrix = nalgebra::Matrix3::from_fn(|i, j| whole.0[i][j]).try_inverse().unwrap();
        let inverse = Mat3([0, 1, 2].map(|i| [0, 1, 2].map(|j| matrix[(i, j)])));
        let start = Start {
            rotation: Rotation::new(random.vector(2.0)).r,
            omega: random.cube(2.0),
            acceleration: random.cube(2.0),
            algorithmic: random.cube(2.0),
            earlier: random.cube(2.0),
            stretch: Stretch::new(1.5, 1.0, step.alpha_m - step.alpha_f),
        };
        for carrier in [Carrier { tensor: whole, inverse }, Carrier::SPIN] {
            let turn = Turn::new(step, carrier, &start);
            let (x, a) = (random.vector(base), random.cube(2.0));
            let weights = Weights { stiffness: 1.0, damping: 2.0, mass: 3.0 };
            let pick = |moving: bool, x: Vec3, first: usize| {
                if moving { variables(x, first) } else { Vec3::constant(x) }
            };
            let spin = |x: Vec3<Six>| {
                let (omega, acceleration) = turn.rates(x);
                let rotation = Rotation::new(x).after(Mat3::constant(turn.base()));
                Spin::direct(rotation, omega, acceleration, Derivatives::none())
            };
            let wide = |moving: usize| {
                body(&inertia.lifted(), pick(moving == 2, a, 0), &spin(pick(moving == 0, x, 3)), Weights::NONE)
            };
            let zero = body(&inertia.lifted(), Vec3::constant(a), &spin(Vec3::constant(x)), Weights::NONE);
            let (omega, acceleration) = turn.rates(x);
            let got = body(&inertia, a, &turn.spin(x, omega, acceleration), weights);
            let what = format!("body over an increment around {base}");
            agree(&what, &volume_tangent(&got), &weighted([wide(0), zero, wide(2)], weights), 1e-11);
        }
    }
}

/// Inertia seen from a rotating frame, against the same body seen from a frame at rest: the motions
/// x = x0 + Q (x~ - x0), R = Q R~ of an instant at which Q = I.
#[test]
fn a_rotating_frame_sees_the_same_inertia() {
    let mut random = Random::new(1600);
    for base in BASES {
        let inertia = some_inertia(&mut random);
        let (p, w, arm) = (random.vector(base), random.cube(2.0), random.cube(1.0));
        // In the frame: u, P with rates; seen from rest by the rules of relative motion.
        let seen = |u: Vec3<Six>, v: Vec3<Six>, a: Vec3<Six>, p: Vec3<Six>, pd: Vec3<Six>, pdd: Vec3<Six>| {
            let (w, arm) = (Vec3::constant(w), Vec3::constant(arm) + u);
            let relative = Spin::new(p, pd, pdd);
            let carried = relative.rotation.r.transpose_mul(w);
            let omega = relative.omega + carried;
            let acceleration = relative.acceleration - relative.omega.cross(carried);
            let total = a + w.cross(v).scale(2.0) + w.cross(w.cross(arm));
            let direct = Spin::direct(relative.rotation, omega, acceleration, Derivatives::none());
            body(&inertia.lifted(), total, &direct, Weights::NONE)
        };
        let o = Vec3::constant(Vec3::ZERO);
        let (zero, c) = (Vec3::ZERO, Vec3::<Six>::constant(p));
        let forces = [
            seen(variables(zero, 0), o, o, variables(p, 3), o, o),
            seen(o, variables(zero, 0), o, c, variables(zero, 3), o),
            seen(o, o, variables(zero, 0), c, o, variables(zero, 3)),
        ];
        for weights in WEIGHTS {
            let got = steadily_turned(&inertia, w, arm, &Rotation::new(p), weights);
            let what = format!("rotating frame around {base}, {weights:?}");
            let force = [got.u.0, got.p.0].concat();
            let expected = [values(forces[0].u).0, values(forces[0].p).0].concat();
            agree(&format!("force, {what}"), &force, &expected, 1e-12);
            agree(&what, &volume_tangent(&got), &weighted(forces, weights), 1e-12);
        }
    }
}

/// A motor that turns on from a stage with `until`, whose end only the run knows, and whose history goes back by more than
/// 135 degrees where the next static stage begins: its turns could not be counted.
#[test]
fn motors_do_not_leap_where_static_stages_begin() {
    let deck = |angle: f64| {
        format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[[body]]\nat = \"b\"\nmass = 1\ninertia = [1, 1, 1]\n\
             [[joint]]\nkind = \"revolute\"\nnodes = [\"b\"]\nat = \"a\"\naxis = [0, 0, 1]\nangle = {angle}\nhistory = \"h\"\n\
             [history.h]\ntimes = [0, 1]\nvalues = [0, 1]\n\
             [[stage]]\nkind = \"static\"\nsteps = 8\nuntil = {{ column = \"b.uz\", above = 1 }}\n\
             [[stage]]\nkind = \"static\"\nsteps = 8\n[output]\nnodes = [\"b\"]\ncolumns = [\"u\", \"rc\"]\n"
        )
    };
    assert!((simulate(&deck(2.0)).end("b.rz") - 2.0).abs() < 1e-9);
    let Err(Failure::Deck(message)) = attempt(&deck(2.5)).result else { panic!("the motor leaps") };
    assert!(message.contains("must start at 2.5 rad (143.2°), where the joint is, but starts at 0"), "{message}");
}
