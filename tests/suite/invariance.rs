//! What must not matter: the orientation of the scene, the order and number of load steps, units, and, up to the error of
//! the mesh, the direction in which a beam is drawn.

use crate::random::Random;
use crate::scenes::{Simulation, bend45, distance, simulate};
use beamsim_core::rotation::Rotation;
use beamsim_core::tensor::{Mat3, Vec3};

fn text(v: Vec3) -> String {
    format!("[{:?}, {:?}, {:?}]", v.0[0], v.0[1], v.0[2])
}

/// A bent frame with every kind of static load, an inclined roller and a spring, turned by `q`.
fn static_frame(q: Mat3) -> Simulation {
    let v = |x: f64, y: f64, z: f64| text(q * Vec3([x, y, z]));
    let deck = format!(
        r#"
gravity = {gravity}
[point]
root = {root}
knee = {knee}
bow = {bow}
tip = {tip}
[section.s]
EA = 1e4
GA = [4e3, 3e3]
GJ = 60
EI = [40, 90]
rhoA = 0.5
[[beam]]
name = "a"
section = "s"
through = ["root", "knee"]
elements = 4
axis3 = {axis3}
twist = [0, 0.7]
[[beam]]
name = "b"
section = "s"
arc = ["knee", "bow", "tip"]
elements = 3
order = 2
[[support]]
at = "root"
fix = "all"
[[support]]
at = "tip"
fix = ["ux", "rz"]
axes = [{first}, {second}]
[[spring]]
at = "knee"
stiffness = [30, 0, 20, 0, 40, 0]
axes = [{first}, {second}]
[[load]]
at = "knee"
force = {force}
moment = {moment}
[[load]]
at = "tip"
force = {follower}
moment = {couple}
frame = "body"
[[load]]
along = "a"
force = [[0, 3, 1], [0, -1, 2]]
moment = [1, 0.5, 0]
frame = "section"
[[load]]
along = "b"
force = [{line}, {line_end}]
moment = {line_moment}
[[stage]]
kind = "static"
steps = 3
tolerance = 1e-12
"#,
        gravity = v(0.0, 1.0, -3.0),
        root = v(0.0, 0.0, 0.0),
        knee = v(4.0, 0.0, 0.0),
        bow = v(6.0, 0.8, 0.5),
        tip = v(7.0, 3.0, 1.0),
        axis3 = v(0.2, 0.1, 1.0),
        first = v(0.6, 0.8, 0.0),
        second = v(-0.8, 0.6, 0.0),
        force = v(5.0, -8.0, 6.0),
        moment = v(20.0, 10.0, -15.0),
        follower = v(2.0, 3.0, -1.0),
        couple = v(-5.0, 8.0, 4.0),
        line = v(1.0, 2.0, 0.0),
        line_end = v(0.0, -1.0, 3.0),
        line_moment = v(0.3, -0.2, 0.4),
    );
    simulate(&deck)
}

/// A swinging arm with a spherical joint and a body at its end, driven about an axis, turned by `q`.
fn moving_arm(q: Mat3) -> Simulation {
    let v = |x: f64, y: f64, z: f64| text(q * Vec3([x, y, z]));
    let deck = format!(
        r#"
gravity = {gravity}
[point]
root = {root}
elbow = {elbow}
tip = {tip}
[section.s]
EA = 1e5
GA = 4e4
GJ = 300
EI = [400, 900]
rhoA = 0.5
rhoJ = [0.2, 0.1, 0.1]
[[beam]]
name = "a"
section = "s"
through = ["root", "elbow"]
elements = 3
axis3 = {axis3}
[[beam]]
name = "b"
section = "s"
through = ["elbow", "tip"]
elements = 2
order = 2
axis3 = {axis3}
[[joint]]
kind = "spherical"
at = "elbow"
beams = ["a", "b"]
[[body]]
at = "tip"
mass = 1.5
offset = {offset}
inertia = [{j1}, {j2}, {j3}]
[[support]]
at = "root"
fix = "pin"
[[motion]]
at = "root"
rotate = {axis}
angle = 3
history = "turn"
[history.turn]
times = [0, 1]
values = [0, 1]
smooth = true
[[initial]]
beam = "b"
spin = {spin}
about = "elbow"
[[stage]]
kind = "dynamic"
end = 1.2
step = 0.01
tolerance = 1e-12
"#,
        gravity = v(0.0, 1.0, -3.0),
        root = v(0.0, 0.0, 0.0),
        elbow = v(4.0, 0.0, 0.0),
        tip = v(7.0, 1.0, 0.5),
        axis3 = v(0.2, 0.1, 1.0),
        offset = v(0.2, 0.1, -0.1),
        axis = v(0.0, 0.6, 0.8),
        spin = v(0.4, 0.2, 0.5),
        j1 = text(tensor(q).column(0)),
        j2 = text(tensor(q).column(1)),
        j3 = text(tensor(q).column(2)),
    );
    simulate(&deck)
}

/// An inertia, turned; equal mirror entries to the last bit.
fn tensor(q: Mat3) -> Mat3 {
    let m = q * Mat3::diagonal([0.3, 0.4, 0.5]) * q.transpose();
    (m + m.transpose()) * 0.5
}

/// The scene in 20 random orientations gives the same displacements, turned.
fn turns_with_the_scene(run: fn(Mat3) -> Simulation, node: &str, length: f64) {
    let plain = Vec3(run(Mat3::IDENTITY).vector(&format!("{node}.u")));
    assert!(plain.norm() > 0.03 * length, "the scene hardly moves: {plain:?}");
    let mut random = Random::new(7);
    for _ in 0..20 {
        let q = Rotation::new(random.vector(3.1)).r;
        let turned = Vec3(run(q).vector(&format!("{node}.u")));
        let error = (q.transpose() * turned - plain).norm() / length;
        assert!(error < 1e-9, "turned by {q:?}: {error:e}");
    }
}

#[test]
fn a_static_scene_turns_with_its_orientation() {
    turns_with_the_scene(static_frame, "knee", 8.0);
}

#[test]
fn a_dynamic_scene_turns_with_its_orientation() {
    turns_with_the_scene(moving_arm, "tip", 8.0);
}

/// A frame under two loads, in stages as given.
fn loaded_frame(stages: &str, first: &str, second: &str) -> [f64; 3] {
    let deck = format!(
        r#"
[point]
root = [0, 0, 0]
knee = [4, 0, 0]
tip = [4, 3, 0]
[section.s]
EA = 1e5
GA = 4e4
GJ = 300
EI = 500
[[beam]]
name = "a"
section = "s"
through = ["root", "knee", "tip"]
elements = 4
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [0, 30, 60]
{first}
[[load]]
at = "knee"
force = [-40, 0, 50]
{second}
{stages}
"#
    );
    simulate(&deck).vector("tip.u")
}

#[test]
fn load_order_and_step_count_do_not_matter_in_statics() {
    let stage = |steps: usize| format!("[[stage]]\nkind = \"static\"\nsteps = {steps}\ntolerance = 1e-12\n");
    let both = loaded_frame(&stage(4), "", "");
    assert!(both[2].abs() > 1.0, "hardly loaded: {both:?}");
    let two = stage(3) + &stage(3);
    let cases = [
        ("one step", loaded_frame(&stage(1), "", "")),
        ("many steps", loaded_frame(&stage(37), "", "")),
        ("first load first", loaded_frame(&two, "", "stages = [2]")),
        ("second load first", loaded_frame(&two, "stages = [2]", "")),
        (
            "forth and back",
            loaded_frame(
                &(two.clone() + &stage(2)),
                "",
                "stages = [1, 3]\nhistory = \"full\"\n[history.full]\ntimes = [0, 1]\nvalues = [0, 1]",
            ),
        ),
    ];
    for (name, tip) in cases {
        assert!(distance(tip, both) < 1e-9 * 7.0, "{name}: {tip:?} against {both:?}");
    }
}

/// Interpolated rotation vectors of one chart know no direction, so that only elements across a seam could tell.
#[test]
fn reversing_a_beam_changes_nothing_within_one_chart() {
    let (forth, back) = (bend45(1, 8, ["root", "tip"], "total"), bend45(1, 8, ["tip", "root"], "total"));
    assert!(distance(forth, back) < 1e-9 * 76.5, "{forth:?} against {back:?}");
}

/// A cantilever wound up to a helix, drawn in either direction: its elements cross seams, whose base is the first node.
fn helix(elements: usize, through: &str) -> [f64; 3] {
    let deck = format!(
        r#"
[point]
root = [0, 0, 0]
tip = [10, 0, 0]
[section.s]
EA = 1e4
GA = 1e4
GJ = 100
EI = 100
[[beam]]
name = "b"
section = "s"
through = {through}
elements = {elements}
axis3 = [0, 0, 1]
interpolation = "total"
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [0, 0, 10]
moment = [0, 0, "40*pi"]
[[stage]]
kind = "static"
steps = 80
tolerance = 1e-11
"#
    );
    let simulation = simulate(&deck);
    assert!(simulation.counters.mixed_elements > 0, "no seam is crossed");
    simulation.vector("tip.u")
}

#[test]
fn reversing_a_beam_across_seams_changes_only_the_discretisation_error() {
    let differ = |n: usize| distance(helix(n, "[\"root\", \"tip\"]"), helix(n, "[\"tip\", \"root\"]"));
    let (coarse, fine) = (differ(40), differ(80));
    assert!(coarse > 1e-9 && coarse < 0.2, "{coarse:e}");
    assert!(fine < 0.3 * coarse, "{coarse:e} does not shrink with the mesh: {fine:e}");
}

#[test]
fn units_do_not_matter() {
    let run = |length: f64, force: f64| {
        let deck = format!(
            r#"
[param]
l = {length:?}
f = {force:?}
[point]
root = [0, 0, 0]
tip = ["4*l", 0, 0]
[section.s]
EA = "1e5*f"
GA = "4e4*f"
GJ = "300*f*l^2"
EI = "500*f*l^2"
[[beam]]
name = "a"
section = "s"
through = ["root", "tip"]
elements = 6
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [0, "30*f", "60*f"]
moment = ["40*f*l", 0, "300*f*l"]
[[stage]]
kind = "static"
steps = 3
"#
        );
        let simulation = simulate(&deck);
        (simulation.vector("tip.u").map(|u| u / length), simulation.counters.work.iterations)
    };
    let (plain, iterations) = run(1.0, 1.0);
    for (length, force) in [(1e6, 1.0), (1e-6, 1.0), (1.0, 1e6), (1.0, 1e-6), (1e3, 1e-6)] {
        let (scaled, work) = run(length, force);
        assert!(distance(plain, scaled) < 1e-9 * 4.0, "{length} {force}: {plain:?} against {scaled:?}");
        assert_eq!(work, iterations, "{length} {force}");
    }
}

/// A swinging, damped arm with a body and a spring in units of length, mass and time: the same steps, the same iterations, the same motion.
#[test]
fn units_do_not_matter_in_motion() {
    let run = |length: f64, mass: f64, time: f64| {
        let deck = format!(
            r#"
gravity = [0, "-9.81*l/sec^2", 0]
[param]
l = {length:?}
m = {mass:?}
sec = {time:?}
f = "m*l/sec^2"
[point]
root = [0, 0, 0]
tip = ["4*l", 0, 0]
[section.s]
EA = "1e5*f"
GA = "4e4*f"
GJ = "300*f*l^2"
EI = "500*f*l^2"
rhoA = "0.5*m/l"
rhoJ = ["0.02*m*l", "0.01*m*l", "0.01*m*l"]
[[beam]]
name = "a"
section = "s"
through = ["root", "tip"]
elements = 6
[[support]]
at = "root"
fix = "pin"
[[spring]]
at = "root"
stiffness = [0, 0, 0, "40*f*l", "40*f*l", "40*f*l"]
damping = [0, 0, 0, "2*f*l*sec", "2*f*l*sec", "2*f*l*sec"]
[[body]]
at = "tip"
mass = "2*m"
inertia = ["0.3*m*l^2", "0.2*m*l^2", "0.1*m*l^2"]
[[initial]]
spin = [0, 0, "1.5/sec"]
[[load]]
at = "tip"
force = [0, 0, "20*f"]
moment = ["10*f*l", 0, 0]
history = "push"
[history.push]
times = [0, "0.5*sec", "1*sec"]
values = [0, 1, 0]
[[stage]]
kind = "dynamic"
end = "2*sec"
step = "0.02*sec"
"#
        );
        let simulation = simulate(&deck);
        (simulation.vector("tip.u").map(|u| u / length), simulation.counters.work.iterations)
    };
    let (plain, iterations) = run(1.0, 1.0, 1.0);
    for factor in [1e6, 1e-6] {
        for (length, mass, time) in
            [(factor, 1.0, 1.0), (1.0, factor, 1.0), (1.0, 1.0, factor), (factor, 1.0 / factor, factor)]
        {
            let (scaled, work) = run(length, mass, time);
            assert!(distance(plain, scaled) < 1e-9 * 4.0, "{length} {mass} {time}: {plain:?} against {scaled:?}");
            assert_eq!(work, iterations, "{length} {mass} {time}");
        }
    }
}

/// A body that flies and tumbles alone, in units of length from a millionth to a hundred million: the length of the scene
/// is its radius of gyration. Convergence was judged by a length of 1.
#[test]
fn a_single_body_moves_alike_in_any_unit() {
    let in_unit = |unit: f64| {
        let length = |value: f64| format!("{:?}", value * unit);
        let inertia = |value: f64| format!("{:?}", value * unit * unit);
        let deck = format!(
            "gravity = [0, 0, {}]\n[point]\np = [0, 0, 0]\n[[body]]\nat = \"p\"\nmass = 2\noffset = [{}, 0, {}]\n\
             inertia = [[{}, 0, 0], [0, {}, 0], [0, 0, {}]]\n[[initial]]\nat = \"p\"\nvelocity = [{}, 0, 0]\n\
             spin = [1, 5, 0.1]\n[[stage]]\nkind = \"dynamic\"\nend = 2\nstep = 0.02\n[output]\nnodes = [\"p\"]\ncolumns = [\"x\"]\n",
            length(-9.81),
            length(0.1),
            length(0.05),
            inertia(0.4),
            inertia(0.6),
            inertia(0.7),
            length(3.0),
        );
        let simulation = simulate(&deck);
        let places = simulation.vector("p.").map(|place| place / unit);
        (simulation.counters.work.iterations, simulation.counters.cutbacks, places)
    };
    let (iterations, cutbacks, places) = in_unit(1.0);
    for unit in [1e-6, 1e-3, 1e3, 1e8] {
        let (other_iterations, other_cutbacks, other_places) = in_unit(unit);
        println!("{unit}: {other_iterations} iterations, {other_cutbacks} cut-backs, {other_places:?}, not {places:?}");
        assert!(
            other_iterations.abs_diff(iterations) <= 2 && other_cutbacks == cutbacks,
            "{unit}: {other_iterations}, not {iterations}"
        );
        assert!(distance(other_places, places) < 1e-9, "{unit}: {other_places:?}, not {places:?}");
    }
}
