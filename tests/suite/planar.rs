//! Scenes in a plane: the same answers as in space, from three unknowns a node; and nothing hidden that leaves the plane.

#![allow(clippy::needless_range_loop)]

use crate::dual::Dual;
use crate::laws::stiffening;
use crate::random::Random;
use crate::tangents::{agree, symmetric};
use beamsim::scene::{self, Scene};
use beamsim_core::kernel::beam::StiffnessPoint;
use beamsim_core::kernel::inertia::{Inertia, Spin, body};
use beamsim_core::kernel::law::{Linear, PlanarLinear, PlanarStiffness, Stiffness, StoredLaw, Strain};
use beamsim_core::kernel::planar::{PlanarBody, PlanarNode, PlanarPoint, flattened};
use beamsim_core::kernel::{ElementSystem, NodeMotion, PlanarSystem, Weights, shape};
use beamsim_core::model::{Assembly, Schedule};
use beamsim_core::run::{Counters, Failure, Observer, Run, Snapshot, Warning};
use beamsim_core::scalar::Real;
use beamsim_core::system::Plane;
use beamsim_core::tensor::{Mat3, Vec3};
use std::array::from_fn;

/// Derivatives over the unknowns of the largest element.
type Wide = Dual<12>;

const TILTED: Vec3 = Vec3([0.36, 0.48, 0.8]);

/// Points of a section in the plane, where everything couples that may.
fn points<const N: usize>(plane: &Plane) -> Vec<StiffnessPoint<N>> {
    let axes = *plane.axes();
    let turned = |m: Mat3| axes * m * axes.transpose();
    let cn = turned(Mat3([[9.0, 0.7, 0.0], [0.7, 5.0, 0.0], [0.0, 0.0, 4.0]]));
    let cm = turned(Mat3([[2.0, 0.3, 0.0], [0.3, 3.0, 0.0], [0.0, 0.0, 7.0]]));
    let cc = Some(turned(Mat3([[0.0, 0.0, 0.4], [0.0, 0.0, -0.6], [0.0, 0.0, 0.0]])));
    let free = Strain { gamma: axes * Vec3([0.02, -0.05, 0.0]), kappa: plane.normal() * 0.3 };
    let point = |&(xi, weight): &(f64, f64)| StiffnessPoint {
        shape: shape::values::<N>(xi),
        slope: shape::derivatives::<N>(xi),
        weight,
        tangent: axes * Vec3([0.8, 0.6, 0.0]),
        law: Linear { stiffness: Stiffness { cn, cm, cc } },
        free: Some(free),
    };
    shape::gauss(N - 1).iter().map(point).collect()
}

fn lifted<T: Real, const N: usize>(point: &PlanarPoint<N>) -> PlanarPoint<N, T> {
    let PlanarStiffness { cn, cm, cc } = point.law.stiffness;
    let (cn, cc) = (cn.map(T::constant), cc.map(|cc| cc.map(T::constant)));
    PlanarPoint {
        shape: point.shape.map(T::constant),
        slope: point.slope.map(T::constant),
        weight: T::constant(point.weight),
        tangent: point.tangent.map(T::constant),
        law: PlanarLinear { stiffness: PlanarStiffness { cn, cm: T::constant(cm), cc } },
        free: point.free.map(|free| free.map(T::constant)),
    }
}

/// The unknowns of an element's nodes, two displacements and an angle each, and the same nodes in space.
fn nodes<const N: usize>(random: &mut Random, plane: &Plane, base: f64) -> ([[f64; 3]; N], [NodeMotion; N]) {
    let unknowns: [[f64; 3]; N] =
        from_fn(|_| [random.range(-0.3, 0.3), random.range(-0.3, 0.3), base + random.range(-0.5, 0.5)]);
    let in_space = unknowns.map(|[x, y, angle]| NodeMotion {
        u: *plane.axes() * Vec3([x, y, 0.0]),
        p: plane.normal() * angle,
        ..NodeMotion::rest()
    });
    (unknowns, in_space)
}

fn in_plane<T: Real, const N: usize>(
    points: &[StiffnessPoint<N>],
    plane: &Plane,
    nodes: &[PlanarNode<T>; N],
    weight: f64,
) -> PlanarSystem<N, T> {
    let mut out = PlanarSystem::zero();
    for point in points {
        let point = lifted::<T, N>(&PlanarPoint::new(point, plane.axes()));
        point.add(nodes, T::constant(0.7), None, weight, &mut out);
    }
    out
}

/// The tangent by rows.
fn tangent<const N: usize>(system: &PlanarSystem<N>) -> Vec<f64> {
    let entry = |k: usize| {
        let (row, column) = (k / (3 * N), k % (3 * N));
        system.tangent[row / 3][column / 3][3 * (column % 3) + row % 3]
    };
    (0..9 * N * N).map(entry).collect()
}

fn kernel_is_that_of_space<const N: usize>() {
    let plane = Plane::normal_to(TILTED).unwrap();
    let points = points::<N>(&plane);
    points_are_those_of_space(&plane, &points, 1e-14);
    let stiffening: Vec<_> = points.iter().map(stiffening).collect();
    // Its factor amplifies the round-off of strains.
    points_are_those_of_space(&plane, &stiffening, 1e-13);
}

fn points_are_those_of_space<L: StoredLaw, const N: usize>(
    plane: &Plane,
    points: &[StiffnessPoint<N, f64, L>],
    tolerance: f64,
) {
    let mut random = Random::new(11);
    for base in [0.0, 1.3, 3.0, 5.5] {
        let (unknowns, motions) = nodes::<N>(&mut random, plane, base);
        let planar_nodes = unknowns.map(|[x, y, angle]| PlanarNode { u: [x, y], angle });
        let mut planar = PlanarSystem::zero();
        for point in points {
            PlanarPoint::new(point, plane.axes()).add(&planar_nodes, 0.7, None, 1.0, &mut planar);
        }
        let mut in_space = ElementSystem::new(2 * N);
        points.iter().for_each(|point| point.add_elastic(&motions, 0.7, None, 1.0, &mut in_space));
        // Displacements keep to the first two axes, rotations to the third.
        let axes = *plane.axes();
        let axis = |k: usize| axes.column(k % 3);
        let block = |k: usize| 2 * (k / 3) + usize::from(k % 3 == 2);
        let force: Vec<f64> = (0..3 * N).map(|k| axis(k).dot(in_space.force_block(block(k)))).collect();
        let exact: Vec<f64> = (0..9 * N * N)
            .map(|k| (k / (3 * N), k % (3 * N)))
            .map(|(row, column)| axis(row).dot(in_space.tangent_block(block(row), block(column)) * axis(column)))
            .collect();
        agree("force", planar.force.as_flattened(), &force, tolerance);
        agree("tangent", &tangent(&planar), &exact, tolerance);
        symmetric("tangent", &tangent(&planar), 1e-15);
        let change: [[f64; 3]; N] = from_fn(|_| random.cube(0.1).0);
        let (du, dp) = (change.map(|[x, y, _]| axes * Vec3([x, y, 0.0])), change.map(|c| plane.normal() * c[2]));
        for point in points {
            let exact = point.extrapolated_stress(&motions, 0.7, |i| du[i], |i| dp[i]);
            let here = PlanarPoint::new(point, &axes).extrapolated_stress(
                &planar_nodes,
                0.7,
                &change.map(|[x, y, angle]| PlanarNode { u: [x, y], angle }),
            );
            agree("foreseen stress", &here, &flattened(&exact, &axes), tolerance);
        }
    }
}

#[test]
fn kernels_are_those_of_space() {
    kernel_is_that_of_space::<2>();
    kernel_is_that_of_space::<3>();
    kernel_is_that_of_space::<4>();
}

fn tangent_is_the_derivative<const N: usize>() {
    let (mut random, plane) = (Random::new(12), Plane::normal_to(TILTED).unwrap());
    let points = points::<N>(&plane);
    let (unknowns, _) = nodes::<N>(&mut random, &plane, 1.0);
    let variable = |i: usize, k: usize| Wide::variable(unknowns[i][k], 3 * i + k);
    let variables = from_fn(|i| PlanarNode { u: [variable(i, 0), variable(i, 1)], angle: variable(i, 2) });
    let force = in_plane(&points, &plane, &variables, 0.0).force;
    let exact: Vec<f64> = force.as_flattened().iter().flat_map(|f| f.partials[..3 * N].to_vec()).collect();
    let here = in_plane(&points, &plane, &unknowns.map(|[x, y, angle]| PlanarNode { u: [x, y], angle }), 1.0);
    agree("tangent", &tangent(&here), &exact, 1e-13);
}

#[test]
fn tangents_are_derivatives() {
    tangent_is_the_derivative::<2>();
    tangent_is_the_derivative::<3>();
    tangent_is_the_derivative::<4>();
}

#[test]
fn bodies_are_those_of_space() {
    let (mut random, plane) = (Random::new(13), Plane::normal_to(TILTED).unwrap());
    let (axes, normal) = (*plane.axes(), plane.normal());
    let inertia = Inertia {
        mass: 1.7,
        offset: axes * Vec3([0.3, -0.2, 0.0]),
        about_node: axes * Mat3([[2.0, 0.3, 0.0], [0.3, 3.0, 0.0], [0.0, 0.0, 4.5]]) * axes.transpose(),
    };
    for weights in
        [Weights::STIFFNESS, Weights::DAMPING, Weights::MASS, Weights { stiffness: 0.8, damping: 23.0, mass: 470.0 }]
    {
        let [angle, spin, rate] = random.cube(2.5).0;
        let acceleration = [random.range(-1.0, 1.0), random.range(-1.0, 1.0)];
        let planar = PlanarBody::new(&inertia, &axes).evaluate(acceleration, angle, [spin, rate], weights);
        let motion = Spin::new(normal * angle, normal * spin, normal * rate);
        let in_space = body(&inertia, axes * Vec3([acceleration[0], acceleration[1], 0.0]), &motion, weights);
        let axis = |k: usize| axes.column(k);
        let force = [axis(0).dot(in_space.u), axis(1).dot(in_space.u), axis(2).dot(in_space.p)];
        agree("force", &planar.force[0], &force, 1e-14);
        let block = |row: usize, column: usize| match (row == 2, column == 2) {
            (false, false) => in_space.uu,
            (false, true) => in_space.up,
            (true, false) => in_space.pu,
            (true, true) => in_space.pp,
        };
        let exact: Vec<f64> = (0..9).map(|k| axis(k / 3).dot(block(k / 3, k % 3) * axis(k % 3))).collect();
        agree("tangent", &tangent(&planar), &exact, 1e-13);
    }
}

/// Everything that a run showed: rows of unknowns with their forces, and warnings.
#[derive(Default)]
struct Seen {
    rows: Vec<Vec<f64>>,
    planar: bool,
    warnings: Vec<String>,
}

impl Observer for Seen {
    fn row(&mut self, at: &Snapshot) -> Result<(), Failure> {
        self.planar = at.system.pattern.dof_map.plane().is_some();
        let fields = [&at.state.q[..], &at.state.v];
        let unknowns = fields.iter().flat_map(|field| field.iter().flat_map(|v| v.0));
        let energy = at.model.energy(at.state);
        self.rows.push(unknowns.chain([energy.strain, energy.kinetic]).collect());
        Ok(())
    }

    fn warn(&mut self, warning: &Warning) {
        self.warnings.push(warning.message.clone());
    }
}

fn scene_of(text: &str) -> Scene {
    scene::from_text(text).unwrap_or_else(|e| panic!("{e:?}\n{text}")).0
}

fn run(text: &str) -> (Seen, Result<(), Failure>, Counters) {
    let mut seen = Seen::default();
    let (result, counters) = Run::new(scene_of(text).plan, &mut seen).finish();
    (seen, result, counters)
}

/// A vector in a plane that is no coordinate plane, or in that of x and y.
fn place(tilted: bool, x: f64, y: f64) -> String {
    let plane = Plane::normal_to(if tilted { TILTED } else { Vec3::UNIT[2] }).unwrap();
    format!("{:?}", (*plane.axes() * Vec3([x, y, 0.0])).0)
}

fn normal(tilted: bool, size: f64) -> String {
    format!("{:?}", (if tilted { TILTED } else { Vec3::UNIT[2] } * size).0)
}

/// Two beams with an angle between them, sections whose axis 3 is the normal of the plane, clamped at the root.
fn frame(tilted: bool, interpolation: &str, order: usize) -> String {
    let v = |x: f64, y: f64| place(tilted, x, y);
    let axis3 = normal(tilted, 1.0);
    let beam = |name: &str, through: &str| {
        format!(
            "[[beam]]\nname = \"{name}\"\nsection = \"s\"\nthrough = [{through}]\nelements = 3\norder = {order}\n\
             axis3 = {axis3}\ninterpolation = \"{interpolation}\"\n"
        )
    };
    format!(
        "[point]\nroot = {}\nknee = {}\ntip = {}\n[section.s]\nEA = 900\nGA = [400, 300]\nGJ = 20\nEI = [70, 50]\n\
         rhoA = 1.3\nrhoJ = [0.4, 0.3, 0.2]\n{}{}[[support]]\nat = \"root\"\nfix = \"all\"\n",
        v(0.0, 0.0),
        v(2.0, 0.5),
        v(2.5, 2.5),
        beam("a", "\"root\", \"knee\""),
        beam("b", "\"knee\", \"tip\""),
    )
}

/// Runs a scene in its plane and in space; all that both show agrees.
fn agrees_with_space(what: &str, text: &str) -> Seen {
    let (planar, ended, _) = run(text);
    ended.unwrap_or_else(|failure| panic!("{what}: {failure}"));
    assert!(planar.planar, "{what} is not simulated in a plane");
    let (spatial, ended, _) = run(&format!("{text}[effects]\nplanar = false\n"));
    ended.unwrap_or_else(|failure| panic!("{what}, in space: {failure}"));
    assert!(!spatial.planar);
    assert_eq!(planar.rows.len(), spatial.rows.len(), "{what}: rows");
    for (a, b) in planar.rows.iter().zip(&spatial.rows) {
        agree(what, a, b, 1e-10);
    }
    planar
}

const STATIC: &str = "[[stage]]\nkind = \"static\"\nsteps = 4\ntolerance = 1e-12\n";
const DYNAMIC: &str =
    "[[stage]]\nkind = \"dynamic\"\nend = 0.4\nstep = 0.02\nscheme = \"generalized_alpha\"\ntolerance = 1e-12\n";

/// What may act on a frame in its plane, each as it stands in a deck.
fn actions(tilted: bool) -> Vec<(&'static str, String)> {
    let v = |x: f64, y: f64| place(tilted, x, y);
    let n = |size: f64| normal(tilted, size);
    let at_tip = |what: &str| format!("[[load]]\nat = \"tip\"\n{what}\n");
    vec![
        ("dead force", at_tip(&format!("force = {}", v(3.0, -8.0)))),
        ("dead moment", at_tip(&format!("moment = {}", n(40.0)))),
        ("following force", at_tip(&format!("force = {}\nframe = \"body\"", v(4.0, 9.0)))),
        ("following moment", at_tip(&format!("moment = {}\nframe = \"body\"", n(-60.0)))),
        ("line load", format!("[[load]]\nalong = \"b\"\nforce = {}\nmoment = {}\n", v(2.0, -3.0), n(1.0))),
        ("following line load", format!("[[load]]\nalong = \"b\"\nforce = {}\nframe = \"body\"\n", v(2.0, -3.0))),
        (
            "prescribed displacement",
            format!("[[motion]]\nat = \"tip\"\nux = 0.4\naxes = [{}, {}]\n", v(0.6, 0.8), v(-0.8, 0.6)),
        ),
        ("prescribed rotation", format!("[[motion]]\nat = \"tip\"\nrotate = {}\nangle = 2\n", n(1.0))),
        (
            "body",
            format!(
                "[[body]]\nat = \"tip\"\nmass = 2\ninertia = [0.3, 0.3, 0.3]\noffset = {}\n{}",
                v(0.1, -0.2),
                at_tip(&format!("force = {}", v(3.0, 5.0)))
            ),
        ),
        (
            "spring to the root",
            format!(
                "[[spring]]\nbetween = [\"root\", \"tip\"]\nstiffness = 5\ndamping = 0.4\nlength = 3.4\n{}",
                at_tip(&format!("force = {}", v(3.0, 5.0)))
            ),
        ),
    ]
}

#[test]
fn whatever_acts_in_a_plane_acts_as_in_space() {
    for (interpolation, order) in [("relative", 1), ("total", 1), ("relative", 2), ("total", 3)] {
        for tilted in [false, true] {
            for (what, action) in actions(tilted) {
                let frame = frame(tilted, interpolation, order);
                let damping = "[damping]\nmass = 0.3\nstiffness = 0.002\n";
                let stages = [STATIC.to_string(), format!("{DYNAMIC}{damping}")];
                for stage in
                    stages.iter().filter(|stage| !(what.starts_with("prescribed") && stage.contains("dynamic")))
                {
                    agrees_with_space(&format!("{what}, {interpolation} {order}"), &format!("{frame}{action}{stage}"));
                }
            }
        }
    }
}

#[test]
fn supports_joints_and_curved_beams_act_as_in_space() {
    for tilted in [false, true] {
        let v = |x: f64, y: f64| place(tilted, x, y);
        let frame = frame(tilted, "relative", 1);
        let load = format!("[[load]]\nat = \"tip\"\nforce = {}\n", v(3.0, -8.0));
        let roller = format!("[[support]]\nat = \"tip\"\nfix = [\"ux\"]\naxes = [{}, {}]\n", v(0.6, 0.8), v(-0.8, 0.6));
        let hinge = "[[joint]]\nkind = \"spherical\"\nat = \"knee\"\nbeams = [\"a\", \"b\"]\n";
        let pin = "[[spring]]\nat = \"tip\"\nstiffness = [50, 50, 50, 10, 10, 10]\ndamping = [1, 1, 1, 1, 1, 1]\n";
        let free_strain = frame.replace("interpolation", "free_strain = [0.01, 0, 0, 0, 0, 0.2]\ninterpolation");
        let scenes = [
            ("roller on a slope", format!("{frame}{roller}{load}")),
            ("hinge between beams", format!("{frame}{hinge}{pin}{load}")),
            ("free strain", format!("{free_strain}{load}")),
        ];
        for (what, scene) in scenes {
            for stage in [STATIC, DYNAMIC] {
                agrees_with_space(what, &format!("{scene}{stage}"));
            }
        }
    }
}

/// What increments that are prescribed push the rest with, and the forces of a shaken frame, along all free directions of the plane.
fn pushes(text: &str, normal: Vec3) -> Vec<f64> {
    let plan = scene_of(text).plan;
    let (model, stage) = (plan.model, plan.stages[0].context(0));
    let (mut state, mut random) = (model.rest(), Random::new(11));
    let mut in_plane = |slot: usize| {
        let v = random.vector(0.1);
        let along = normal * normal.dot(v);
        if slot.is_multiple_of(2) { v - along } else { along }
    };
    let mut schedule = Schedule::new(&model);
    let dof_map = schedule.begin_stage(&model, 0, stage.kind, &state).unwrap();
    let mut prescribed_increment = state.q.clone();
    for field in [&mut state.q[..], &mut state.v, &mut state.a, &mut prescribed_increment] {
        field.iter_mut().enumerate().for_each(|(slot, value)| *value = in_plane(slot));
    }
    let mut assembly = Assembly::new(&stage, dof_map, &model);
    assembly.evaluate(&state, Weights { stiffness: 1.0, damping: 3.0, mass: 40.0 }, Some(&prescribed_increment));
    let dof_map = &assembly.system.pattern.dof_map;
    let (mut pushed, mut field) = (vec![0.0; dof_map.count()], state.q.clone());
    assembly.system.right_hand_side(&mut pushed);
    dof_map.scatter(&pushed, None, &mut field);
    let seen = |(slot, v): (usize, &Vec3)| {
        let along = normal * normal.dot(*v);
        if slot.is_multiple_of(2) { *v - along } else { along }.0
    };
    field.iter().enumerate().flat_map(seen).collect()
}

#[test]
fn what_is_prescribed_pushes_as_in_space() {
    for (interpolation, order) in [("relative", 1), ("total", 2), ("relative", 3)] {
        for tilted in [false, true] {
            let normal = if tilted { TILTED } else { Vec3::UNIT[2] };
            for (what, action) in actions(tilted).iter().filter(|(what, _)| what.starts_with("prescribed")) {
                let along = action
                    .replace("ux = 0.4", "ux = 0.4\nhistory = \"h\"")
                    .replace("angle = 2", "angle = 2\nhistory = \"h\"");
                let history = "[history.h]\nexpr = \"t^2\"\n";
                let damping = "[damping]\nmass = 0.3\nstiffness = 0.002\n";
                let text = format!("{}{along}{history}{DYNAMIC}{damping}", frame(tilted, interpolation, order));
                let planar = pushes(&text, normal);
                assert!(planar.iter().any(|push| push.abs() > 1.0));
                agree(what, &planar, &pushes(&format!("{text}[effects]\nplanar = false\n"), normal), 1e-10);
            }
        }
    }
}

/// Rotations without inertia have the mean spin of a step and no acceleration, where a support holds others of the same node, too.
#[test]
fn what_has_no_inertia_turns_as_in_space() {
    for interpolation in ["relative", "total"] {
        let text = frame(false, interpolation, 1).replace("rhoJ = [0.4, 0.3, 0.2]\n", "");
        let supported = format!(
            "{text}[[support]]\nat = \"tip\"\nfix = [\"uz\", \"rx\", \"ry\"]\n\
             [[load]]\nat = \"tip\"\nforce = [3, -8, 0]\n{DYNAMIC}"
        );
        agrees_with_space("a supported tip without rotary inertia", &supported);
    }
}

#[test]
fn free_fall_and_spin_act_as_in_space() {
    for tilted in [false, true] {
        let text = frame(tilted, "relative", 1).replace("[[support]]\nat = \"root\"\nfix = \"all\"\n", "");
        let (velocity, spin) = (place(tilted, 0.3, 0.7), normal(tilted, 2.5));
        let thrown = format!(
            "gravity = {}\n{text}[[initial]]\nvelocity = {velocity}\nspin = {spin}\n{DYNAMIC}",
            place(tilted, 0.0, -9.81)
        );
        agrees_with_space("a thrown frame", &thrown);
    }
}

#[test]
fn stages_go_on_from_plane_to_space_and_back() {
    let load = "[[load]]\nat = \"tip\"\nforce = [3, -8, 0]\n";
    let text =
        format!("{}{load}{STATIC}[[stage]]\nkind = \"modal\"\nmodes = 3\n{DYNAMIC}", frame(false, "relative", 1));
    let seen = agrees_with_space("static, modal, dynamic", &text);
    assert!(seen.warnings.is_empty(), "{:?}", seen.warnings);
}

/// What inertia and damping carried fades in the plane as in space, and in the charts that nodes have come to.
#[test]
fn motions_come_to_rest_as_in_space() {
    for tilted in [false, true] {
        let damped = "[damping]\nmass = 0.5\n";
        let load = |x, y| format!("[[load]]\nat = \"tip\"\nforce = {}\n", place(tilted, x, y));
        let (stays, goes) = (load(1.0, 2.0), load(3.0, -8.0));
        let text = format!("{}{damped}{stays}{goes}stages = [1]\n{DYNAMIC}{STATIC}", frame(tilted, "relative", 1));
        let seen = agrees_with_space("dynamic, static", &text);
        assert!(seen.warnings.is_empty(), "{:?}", seen.warnings);
    }
}

/// Nodes that turn by more than pi, each through its own changes of chart.
#[test]
fn several_turns_act_as_in_space() {
    for interpolation in ["relative", "total"] {
        let text = frame(true, interpolation, 1).replace("elements = 3", "elements = 8");
        let rolled_up = format!("{text}[[load]]\nat = \"tip\"\nmoment = {}\n{STATIC}", normal(true, 160.0));
        agrees_with_space("several turns", &rolled_up);
    }
}

/// The ends of one element turn past pi against each other, its neighbouring nodes by no more than the mesh may.
#[test]
fn ends_of_an_element_turn_past_half_a_turn_as_in_space() {
    for (order, angle) in [(2, 3.9), (2, -3.9), (3, 4.8), (3, -4.8)] {
        let text = frame(true, "relative", order).replace("elements = 3", "elements = 1");
        let rolled_up = format!(
            "{text}[[motion]]\nat = \"knee\"\nrotate = {}\nangle = {angle}\n{}",
            normal(true, 1.0),
            STATIC.replace("steps = 4", "steps = 8")
        );
        agrees_with_space(&format!("order {order} by {angle}"), &rolled_up);
    }
}

fn is_planar(text: &str) -> bool {
    scene_of(text).plan.model.plane.is_some()
}

#[test]
fn what_leaves_the_plane_is_seen() {
    let base = format!("{}[[load]]\nat = \"tip\"\nforce = [3, -8, 0]\n{DYNAMIC}", frame(false, "relative", 1));
    assert!(is_planar(&base));
    let spatial = |what: &str, text: String| assert!(!is_planar(&text), "{what}");
    let add = |table: &str| format!("{base}{table}\n");
    spatial("a small load aside", base.replace("force = [3, -8, 0]", "force = [3, -8, 1e-9]"));
    spatial("a small imperfection", base.replace("tip = [2.5, 2.5, 0.0]", "tip = [2.5, 2.5, 1e-9]"));
    spatial("a turned section", base.replace("axis3 = [0.0, 0.0, 1.0]", "axis3 = [0.0, 1e-6, 1.0]"));
    spatial("torsion", add("[[load]]\nat = \"tip\"\nmoment = [1, 0, 0]"));
    spatial("gravity aside", format!("gravity = [0, -9.81, 1]\n{base}"));
    spatial("a body aside", add("[[body]]\nat = \"tip\"\nmass = 1\noffset = [0, 0, 0.1]"));
    spatial("a tilted body", add("[[body]]\nat = \"tip\"\nmass = 1\ninertia = [[1, 0, 0.1], [0, 1, 0], [0.1, 0, 1]]"));
    spatial("motion aside", add("[[motion]]\nat = \"tip\"\nuz = 0.1").replace(DYNAMIC, STATIC));
    spatial("velocity aside", add("[[initial]]\nvelocity = [0, 0, 1e-3]"));
    spatial("spin aside", add("[[initial]]\nspin = [1, 0, 0]"));
    spatial("a tilted support", add("[[support]]\nat = \"tip\"\nfix = [\"ux\"]\naxes = [[0.6, 0, 0.8], [0, 1, 0]]"));
    spatial(
        "a spring aside",
        add("[[spring]]\nat = \"tip\"\nstiffness = [1, 2, 3, 0, 0, 0]\naxes = [[0.6, 0, 0.8], [0, 1, 0]]"),
    );
    let coupled =
        "stiffness = [[900,0,0,5,0,0],[0,400,0,0,0,0],[0,0,300,0,0,0],[5,0,0,20,0,0],[0,0,0,0,70,0],[0,0,0,0,0,50]]\n";
    let plain = "EA = 900\nGA = [400, 300]\nGJ = 20\nEI = [70, 50]\nrhoA = 1.3\nrhoJ = [0.4, 0.3, 0.2]\n";
    spatial("a section that twists when it is stretched", base.replace(DYNAMIC, STATIC).replace(plain, coupled));
}

#[test]
fn a_plane_that_is_asked_for_must_be_there() {
    let base = format!(
        "{}[[load]]\nat = \"tip\"\nforce = [3, -8, 1]\n{STATIC}[effects]\nplanar = true\n",
        frame(false, "relative", 1)
    );
    let Err(found) = scene::from_text(&base) else { panic!("this scene is not planar") };
    let message = &found[0].message;
    assert!(message.contains("planar = true") && message.contains("dead forces"), "{message}");
    assert!(is_planar(&base.replace("-8, 1]", "-8, 0]")));
}

#[test]
fn what_only_the_plane_holds_is_refused_as_in_space() {
    let loose = frame(false, "relative", 1).replace("fix = \"all\"", "fix = [\"ux\", \"uy\", \"rz\"]");
    let text = format!("{loose}[[load]]\nat = \"tip\"\nforce = [3, -8, 0]\n{STATIC}");
    assert!(is_planar(&text));
    let (_, ended, _) = run(&text);
    let failure = ended.expect_err("nothing holds it out of the plane");
    assert!(failure.name() == "singular" && failure.to_string().contains("along z"), "{failure}");
}

/// A deep and narrow cantilever under a force at its end buckles aside at 4.0126 sqrt(EI GJ)/L^2 (Timoshenko and Gere 1961).
#[test]
fn lateral_buckling_is_told_where_the_plane_hides_it() {
    let critical = 4.0126 * (1e2_f64 * 50.0).sqrt() / 100.0;
    let text = |force: f64| {
        format!(
            "[point]\nroot = [0, 0, 0]\ntip = [10, 0, 0]\n[section.s]\nEA = 1e8\nGA = 1e8\nGJ = 50\nEI = [1e2, 1e6]\n\
             [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"tip\"]\nelements = 20\norder = 2\n\
             [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, {}, 0]\n{STATIC}",
            -force
        )
    };
    let warned = |force: f64| {
        let (seen, ended, _) = run(&text(force));
        ended.unwrap();
        assert!(seen.planar);
        seen.warnings
            .iter()
            .any(|warning| warning.contains("unstable out of plane") && warning.contains("load factor 1"))
    };
    assert!(!warned(0.99 * critical) && warned(1.01 * critical));
}

/// On a limit point itself round-off gives one pivot its sign, in the plane another one than in space.
#[test]
fn a_limit_point_is_not_taken_for_an_instability_out_of_plane() {
    let warned = |aside: f64, steps: usize| {
        let (seen, ended, _) = run(&format!(
            "[point]\nleft = [-1, 0, 0]\ncrown = [0, 0, 0.1]\nright = [1, 0, 0]\n\
             [section.s]\nEA = 1e4\nGA = 1e4\nGJ = 100\nEI = [{aside}, 1]\n\
             [[beam]]\nname = \"arch\"\nsection = \"s\"\nthrough = [\"left\", \"crown\", \"right\"]\nelements = 8\norder = 2\naxis3 = [0, 1, 0]\n\
             [[support]]\nat = \"left\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"rz\"]\n\
             [[support]]\nat = \"right\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"rz\"]\n[[load]]\nat = \"crown\"\nforce = [0, 0, -20]\n\
             [[stage]]\nkind = \"static\"\ncontrol = \"arc_length\"\nsteps = {steps}\n"
        ));
        ended.unwrap();
        assert!(seen.planar && seen.warnings.iter().any(|warning| warning.starts_with("limit point")));
        seen.warnings.iter().any(|warning| warning.contains("unstable out of plane"))
    };
    for steps in [10, 40, 80] {
        assert!(!warned(100.0, steps), "stiff aside, {steps} steps");
    }
    assert!(warned(0.5, 40), "soft aside");
}

/// Vectors in a tilted plane are rounded aside of it; nothing pulls that back, so it must not pile up.
#[test]
fn long_runs_stay_in_a_tilted_plane() {
    let steps = "[[stage]]\nkind = \"dynamic\"\nend = 20\nstep = 0.01\n";
    let text =
        format!("{}[[load]]\nat = \"tip\"\nforce = {}\n{steps}", frame(true, "relative", 1), place(true, 1.0, -2.0));
    let (seen, ended, _) = run(&text);
    ended.unwrap();
    assert!(seen.planar && seen.rows.len() == 2001);
    let last = seen.rows.last().unwrap();
    let (vectors, _) = last[..last.len() - 2].as_chunks::<3>();
    let aside = |k: usize| {
        let v = Vec3(vectors[k]);
        let along = v.dot(TILTED);
        if k.is_multiple_of(2) { along.abs() } else { (v - TILTED * along).norm() }
    };
    let worst = (0..vectors.len()).map(aside).fold(0.0, f64::max);
    assert!(worst < 1e-14, "{worst:e}");
}

/// The shear centre of a channel lies in its plane of symmetry, beside the centre line.
#[test]
fn sections_that_twist_under_loads_aside_of_the_plane_are_planar() {
    let coupled =
        "stiffness = [[900,0,0,0,0,0],[0,400,0,0,0,0],[0,0,300,5,0,0],[0,0,5,20,0,0],[0,0,0,0,70,0],[0,0,0,0,0,50]]\n";
    let plain = "EA = 900\nGA = [400, 300]\nGJ = 20\nEI = [70, 50]\nrhoA = 1.3\nrhoJ = [0.4, 0.3, 0.2]\n";
    let text = frame(false, "relative", 1).replace(plain, coupled);
    agrees_with_space("channel", &format!("{text}[[load]]\nat = \"tip\"\nforce = [3, -8, 0]\n{STATIC}"));
}

/// A tilted box is no mirror image of itself, whatever edges are equal.
#[test]
fn boxes_with_equal_edges_are_planar_only_along_their_faces() {
    let deck = |half: &str, tilt: f64| {
        let (sine, cosine) = tilt.sin_cos();
        format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e5\nGA = 1e5\nGJ = 10\nEI = 10\n[[beam]]\nname = \"w\"\n\
             section = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 10\norder = 2\n[[support]]\nat = \"a\"\nfix = \"all\"\n\
             [[load]]\nalong = \"w\"\nforce = [0, 0, -4]\n[[surface]]\nname = \"f\"\nkind = \"box\"\nat = [0.8, 0, -0.127]\n\
             half = {half}\naxes = [[1, 0, 0], [0, {cosine}, {sine}]]\n[[contact]]\nname = \"c\"\nbeams = [\"w\"]\nsurfaces = [\"f\"]\n\
             radius = 0.02\npenetration = 1e-4\n[[stage]]\nkind = \"static\"\nsteps = 2\n[output]\ncolumns = [\"u\", \"reaction\", \"contact\"]\n"
        )
    };
    for half in ["[0.1, 0.1, 0.1]", "[0.2, 0.1, 0.1]", "[0.2, 0.11, 0.1]"] {
        let (flat, ended, _) = run(&deck(half, 0.0));
        ended.unwrap();
        assert!(flat.planar, "{half}");
        let (tilted, ended, _) = run(&deck(half, 0.1));
        ended.unwrap();
        assert!(!tilted.planar, "{half}");
    }
}
