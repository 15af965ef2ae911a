//! Time schemes: order two for all of them, through changes of chart, with equal and with alternating steps; adaptive steps.

use crate::scenes::{distance, simulate};
use beamsim::integrate::{Scheme, Step};
use beamsim::model::{Assembly, StageKind, charts};
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
    let (scene, _) = scene::from_text(&text).unwrap_or_else(|e| panic!("{e:?}"));
    let mut model = scene.plan.model;
    let mut state = model.rest();
    let equations = model.begin_stage(0, StageKind::Dynamic, &state).unwrap();
    let mut assembly = Assembly::new(model.acting(&scene.plan.stages[0].context(0)), equations, model.slots.len());
    let solver = LinearSolver::new(&assembly.system.pattern).unwrap();
    let mut newton = Newton::new(Convergence { tolerance: 1e-12 }, 25, solver, &assembly.system);
    let (mut time, mut before, mut work) = (0.0, h, Work::default());
    for number in 0.. {
        let length = if number % 2 == 0 { h } else { 2.0 * h };
        if time + length > 2.4 + 1e-9 {
            break;
        }
        time += length;
        let (step, good) = (Step { scheme, length }, state.clone());
        step.predict(&mut state, before);
        assert_eq!(model.set_clock(&mut state, time, 1.0), None);
        newton.solve(&model, &mut assembly, &mut state, &step, None, &mut work).unwrap();
        charts::wind(&mut state, &good, &model.rotations);
        charts::switch(&mut state, &model.rotations, charts::DYNAMIC_BAND, Some(scheme.lag() * length));
        charts::freeze(&mut state, &model.elements);
        before = length;
    }
    let tip = scene.mesh.nodes.iter().find(|node| node.name == "tip").unwrap().node;
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
