//! Time schemes: order two for all of them, through changes of chart, with equal and with alternating steps; adaptive steps.

use crate::scenes::{distance, simulate};
use beamsim::integrate::{Rotations, Scheme, Step};
use beamsim::model::{Assembly, StageKind, charts, increments};
use beamsim::scene;
use beamsim::solve::{Convergence, LinearSolver, Newton, Work};

const SCHEMES: [&str; 6] = [
    "scheme = \"newmark\"",
    "scheme = \"hht\"",
    "scheme = \"hht\"\nalpha = 0.3",
    "scheme = \"generalized_alpha\"\nrho_inf = 0.9",
    "scheme = \"generalized_alpha\"\nrho_inf = 0.5",
    "scheme = \"generalized_alpha\"\nrho_inf = 0",
];

/// A soft rod that is turned by almost two turns, and swings out of its plane meanwhile.
fn turned_rod(stage: &str) -> String {
    format!(
        r#"
gravity = [0, 0, -1]
[point]
root = [0, 0, 0]
tip = [2, 0, 0]
[section.s]
EA = 2e3
GA = 1e3
GJ = 30
EI = [40, 60]
rhoA = 1
rhoJ = [0.02, 0.01, 0.01]
[[beam]]
name = "rod"
section = "s"
through = ["root", "tip"]
elements = 2
order = 2
[[support]]
at = "root"
fix = "pin"
[[motion]]
at = "root"
rotate = [0, 0.28, 0.96]
angle = 12
history = "turn"
[[load]]
at = "tip"
force = [0, 0, 1]
history = "turn"
[history.turn]
times = [0, 3]
values = [0, 1]
smooth = true
[[stage]]
kind = "dynamic"
end = 2.4
tolerance = 1e-12
{stage}
"#
    )
}

#[test]
fn every_scheme_is_of_order_two_through_chart_switches() {
    for scheme in SCHEMES {
        let run = |step: f64| simulate(&turned_rod(&format!("step = {step}\n{scheme}")));
        let [a, b, c] = [0.01, 0.005, 0.0025].map(run);
        assert!(c.counters.work.chart_switches > 5, "{scheme}: {}", c.counters.work.chart_switches);
        let [a, b, c] = [a, b, c].map(|simulation| simulation.vector("tip.u"));
        let order = (distance(a, b) / distance(b, c)).log2();
        assert!((order - 2.0).abs() < 0.35, "{scheme}: order {order}");
    }
}

/// Steps h, 2h, h, 2h, … by hand: gravity is left out, so that the rod starts without acceleration.
fn alternating(scheme: Scheme, h: f64) -> [f64; 3] {
    let text = turned_rod("step = 1").replace("gravity = [0, 0, -1]", "");
    alternating_to(&text, scheme, h, 2.4, "tip")
}

/// The same for any scene that starts from rest without acceleration.
fn alternating_to(text: &str, scheme: Scheme, h: f64, end: f64, tip: &str) -> [f64; 3] {
    let (scene, _) = scene::from_text(text).unwrap_or_else(|e| panic!("{e:?}"));
    let mut model = scene.plan.model;
    let mut state = model.rest();
    let equations = model.begin_stage(0, StageKind::Dynamic, &state).unwrap();
    let mut assembly = Assembly::new(model.acting(&scene.plan.stages[0].context(0)), equations, model.slots.len());
    let solver = LinearSolver::new(&assembly.system.pattern).unwrap();
    let mut newton = Newton::new(Convergence { tolerance: 1e-12 }, 25, solver, &assembly.system);
    let (mut time, mut before, mut work) = (0.0, h, Work::default());
    for number in 0.. {
        let length = if number % 2 == 0 { h } else { 2.0 * h };
        if time + length > end + 1e-9 {
            break;
        }
        time += length;
        let (step, good) = (Step { scheme, length }, state.clone());
        let total = scheme.rotations == Rotations::Totals;
        if !total {
            increments::begin(&mut state, &model.rotations);
        }
        step.predict(&mut state, before);
        assert_eq!(model.set_clock(&mut state, time, 1.0), None);
        newton.solve(&model, &mut assembly, &mut state, &step, None, &mut work).unwrap();
        increments::end(&mut state, &good, &model.rotations);
        charts::wind(&mut state, &good, &model.rotations);
        let lag = total.then_some(scheme.lag() * length);
        charts::switch(&mut state, &model.rotations, charts::DYNAMIC_BAND, lag);
        charts::freeze(&mut state, &model.elements);
        before = length;
    }
    let tip = scene.mesh.nodes.iter().find(|node| node.name == tip).unwrap().node;
    state.q[tip.u as usize].0
}

#[test]
fn every_scheme_is_of_order_two_with_alternating_steps() {
    let schemes = [
        Scheme::newmark(0.25, 0.5),
        Scheme::hht(0.1),
        Scheme::generalized_alpha(0.9),
        Scheme::generalized_alpha(0.5),
        Scheme::generalized_alpha(0.0),
    ];
    for scheme in schemes {
        let [a, b, c] = [0.008, 0.004, 0.002].map(|h| alternating(scheme, h));
        let order = (distance(a, b) / distance(b, c)).log2();
        assert!((order - 2.0).abs() < 0.35, "{scheme:?}: order {order}");
    }
}

/// Errors fall with the tolerance, steps follow the motion, and what must be rejected is.
#[test]
fn adaptive_steps_follow_their_tolerance() {
    let fine = simulate(&turned_rod("step = 0.0005")).vector("tip.u");
    let mut last = f64::INFINITY;
    for tolerance in [1e-4, 1e-5, 1e-6] {
        let stage =
            format!("step = 0.2\nadaptive = true\nstep_tolerance = {tolerance}\nscheme = \"generalized_alpha\"");
        let simulation = simulate(&turned_rod(&stage));
        let error = distance(simulation.vector("tip.u"), fine);
        assert!(simulation.counters.cutbacks > 0, "a first step of 0.2 is too long");
        assert!(error < last, "tolerance {tolerance}: {error:e} after {last:e}");
        last = error;
    }
    // The local errors of some thousand steps add up, damped by the dissipation of the scheme.
    assert!(last < 1e-3, "{last:e}");
}

/// A rod that is hit hard: Newton cannot take the first step as long as it is asked for.
#[test]
fn a_step_whose_newton_fails_is_taken_smaller() {
    let hit = |adaptive: &str| {
        turned_rod(&format!("step = 0.6\nmax_iterations = 4\n{adaptive}"))
            .replace("force = [0, 0, 1]", "force = [0, 30, 80]")
    };
    assert!(crate::scenes::attempt(&hit("")).result.is_err(), "this step is no longer too long: take a longer one");
    let simulation = simulate(&hit("adaptive = true\nstep_tolerance = 1e-3"));
    assert!(simulation.counters.cutbacks > 0);
}

/// The deck of a scene of the paper with other settings, and a column at its end.
fn paper(deck: &str, settings: &[String], column: &str) -> [f64; 3] {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("decks").join(deck);
    let text = beamsim::deck::apply(&std::fs::read_to_string(path).unwrap(), settings).unwrap();
    simulate(&text).vector(column)
}

/// The paper's own scenes, each across changes of chart, under every scheme.
#[test]
fn every_scheme_is_of_order_two_in_the_scenes_of_the_paper() {
    let schemes = ["\"newmark\"", "\"hht\"", "\"generalized_alpha\"", "\"lie_generalized_alpha\""];
    // Deck, beams, end, first step, column.
    let scenes = [
        ("top_rigid.toml", 0, 0.6, 0.002, "pin.r"),
        ("right_angle_coarse.toml", 2, 4.0, 0.02, "tip.u"),
        ("robot_arm.toml", 2, 1.5, 0.004, "tip.u"),
    ];
    for (deck, beams, end, step, column) in scenes {
        for scheme in schemes {
            let run = |h: f64| {
                let mut settings =
                    vec![format!("stage.0.end={end}"), format!("stage.0.step={h}"), format!("stage.0.scheme={scheme}")];
                settings.push("stage.0.tolerance=1e-12".into());
                settings.extend((0..beams).map(|k| format!("beam.{k}.interpolation=\"relative\"")));
                paper(deck, &settings, column)
            };
            let [a, b, c] = [step, 0.5 * step, 0.25 * step].map(run);
            let order = (distance(a, b) / distance(b, c)).log2();
            assert!((order - 2.0).abs() < 0.4, "{deck}, {scheme}: order {order}");
        }
    }
}

#[test]
fn alternating_steps_keep_order_two_in_the_scenes_of_the_paper() {
    let schemes = [
        Scheme::newmark(0.25, 0.5),
        Scheme::hht(0.1),
        Scheme::generalized_alpha(0.9),
        Scheme::lie_generalized_alpha(0.9),
    ];
    // Pairs of steps hit the kinks of the load.
    for (deck, step, end) in [("right_angle_coarse.toml", 0.02 / 3.0, 4.0), ("robot_arm.toml", 0.003, 1.44)] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("decks").join(deck);
        let settings = [0, 1].map(|k| format!("beam.{k}.interpolation=\"relative\""));
        let text = beamsim::deck::apply(&std::fs::read_to_string(path).unwrap(), &settings).unwrap();
        for scheme in schemes {
            let [a, b, c] = [step, 0.5 * step, 0.25 * step].map(|h| alternating_to(&text, scheme, h, end, "tip"));
            let order = (distance(a, b) / distance(b, c)).log2();
            assert!((order - 2.0).abs() < 0.4, "{deck}, {scheme:?}: order {order}");
        }
    }
}

/// A free body near its middle axis, started at an orientation that a static stage has turned it to.
fn free_body(scheme: &str, step: f64, turned: beamsim::tensor::Vec3) -> [f64; 9] {
    let spin = beamsim::rotation::Rotation::new(turned).r * beamsim::tensor::Vec3([0.01, 2.0, 0.01]);
    let ([x, y, z], [a, b, c], angle) = (turned.0, spin.0, turned.norm());
    let text = format!(
        r#"
[point]
a = [0, 0, 0]
[[body]]
at = "a"
mass = 1
inertia = [1, 2, 3]
[[support]]
at = "a"
fix = "pin"
[[motion]]
at = "a"
rotate = [{x}, {y}, {z}]
angle = {angle}
stages = [1]
[[initial]]
at = "a"
spin = [{a}, {b}, {c}]
[[stage]]
kind = "static"
steps = 4
[[stage]]
kind = "dynamic"
end = 20
step = {step}
scheme = "{scheme}"
tolerance = 1e-12
[output]
columns = ["d"]
"#
    );
    let simulation = simulate(&text);
    let back = beamsim::rotation::Rotation::new(turned).r.transpose();
    let axis = |k: usize| back * beamsim::tensor::Vec3(["x", "y", "z"].map(|c| simulation.end(&format!("a.d{k}{c}"))));
    let [d1, d2, d3] = [1, 2, 3].map(axis);
    let axes = [d1, d2, d3].map(|d| d.0);
    std::array::from_fn(|k| axes[k / 3][k % 3])
}

/// Increments do not notice where the total vector happens to be: the same error from twenty orientations, and far less
/// than that of total vectors.
#[test]
fn increments_do_not_notice_the_orientation() {
    let mut random = crate::random::Random::new(77);
    let orientations: Vec<_> = (0..20)
        .map(|_| {
            let angle = random.range(0.3, 3.1);
            random.vector(angle)
        })
        .collect();
    let error = |a: [f64; 9], b: [f64; 9]| a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let exact = free_body("lie_generalized_alpha", 0.0005, orientations[0]);
    let (mut increments, mut totals) = (Vec::new(), Vec::new());
    for &turned in &orientations {
        increments.push(error(free_body("lie_generalized_alpha", 0.02, turned), exact));
        totals.push(error(free_body("newmark", 0.02, turned), exact));
    }
    let (least, most) =
        (increments.iter().copied().fold(f64::INFINITY, f64::min), increments.iter().copied().fold(0.0, f64::max));
    assert!(most - least < 1e-6 * most, "{least:e} to {most:e}");
    let best = totals.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(best > 5.0 * most, "total vectors {best:e}, increments {most:e}");
}
