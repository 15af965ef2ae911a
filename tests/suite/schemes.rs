//! Time schemes: order two for all of them, through changes of chart, with equal and with alternating steps; adaptive steps.

use crate::random::Random;
use crate::scenes::{distance, list, simulate};
use beamsim::scene;
use beamsim_core::integrate::{Increments, Rotations, Scheme, Step};
use beamsim_core::kernel::Weights;
use beamsim_core::model::{Assembly, Schedule, StageKind, charts};
use beamsim_core::rotation::Rotation;
use beamsim_core::run::InitialMotion;
use beamsim_core::solve::{Convergence, LinearSolver, Newton, Work};
use beamsim_core::system::State;
use beamsim_core::tensor::{Mat3, Vec3};
use beamsim_core::warning::WarningKind;

const SCHEMES: [&str; 7] = [
    "scheme = \"lie_generalized_alpha\"",
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

#[test]
fn lobatto_is_of_order_four_through_chart_switches() {
    let run = |step: f64| simulate(&turned_rod(&format!("step = {step}\nscheme = \"lobatto\"")));
    let [a, b, c] = [0.0025, 0.00125, 0.000625].map(run);
    assert!(c.counters.work.chart_switches > 5, "{}", c.counters.work.chart_switches);
    let [a, b, c] = [a, b, c].map(|simulation| simulation.vector("tip.u"));
    let order = (distance(a, b) / distance(b, c)).log2();
    assert!((order - 4.0).abs() < 0.7, "order {order}");
}

#[test]
fn lobatto_is_of_order_four_for_a_free_body() {
    let change = |a: [Vec3; 3], b: [Vec3; 3]| (0..3).map(|k| (a[k] - b[k]).max_abs()).fold(0.0, f64::max);
    let run = |step: f64| FREE.simulate("lobatto", step, Vec3([0.3, 0.4, 0.5]));
    let [a, b, c] = [0.04, 0.02, 0.01].map(run);
    let order = (change(a, b) / change(b, c)).log2();
    assert!((order - 4.0).abs() < 0.7, "order {order}");
}

/// Joints with multipliers: each step restores the rates that they allow.
#[test]
fn lobatto_is_of_order_four_with_joints() {
    let deck = read("joints/body_double_pendulum_3d.toml");
    let run = |step: f64| {
        let settings = ["scheme=\"lobatto\"".into(), format!("step={step}"), "tolerance=1e-12".into()];
        simulate(&with_settings(&deck, &settings.map(|setting: String| format!("stage.0.{setting}")))).vector("two.")
    };
    let [a, b, c] = [0.02, 0.01, 0.005].map(run);
    let order = (distance(a, b) / distance(b, c)).log2();
    assert!((order - 4.0).abs() < 0.7, "order {order}");
}

/// Two bodies that part after a contact fly on without a force: corrections of their accelerations
/// fall from round to round until they are no normal numbers any more.
#[test]
fn lobatto_goes_on_where_all_forces_have_died_away() {
    let deck = r#"
[point]
p = [0, 0, 0]
q = [1, 0.05, 0]
[[body]]
at = "p"
mass = 2
inertia = [0.01, 0.01, 0.01]
[[body]]
at = "q"
mass = 1
inertia = [0.002, 0.002, 0.002]
[[initial]]
at = "q"
velocity = [-2, 0, 0]
[[surface]]
name = "s"
kind = "sphere"
at = [0, 0, 0]
radius = 0.1
on = "p"
[[contact]]
name = "c"
nodes = ["q"]
surfaces = ["s"]
radius = 0.07
stiffness = 1e5
[output]
columns = ["v", "momentum", "energy"]
[[stage]]
kind = "dynamic"
scheme = "lobatto"
end = 1
step = 1e-4
"#;
    let simulation = simulate(deck);
    assert!((simulation.end("momentum.px") + 2.0).abs() < 1e-9 && simulation.end("p.vx") < -1.0);
    assert!((simulation.end("energy.total") / 2.0 - 1.0).abs() < 1e-3, "{}", simulation.end("energy.total"));
}

/// Adaptive steps of Lobatto's scheme err by less than their tolerance: the estimate, of a lower
/// order than the scheme, is cautious.
#[test]
fn adaptive_steps_of_lobatto_keep_their_tolerance() {
    let run = |settings: &str| simulate(&turned_rod(&format!("step = 0.0025\nscheme = \"lobatto\"\n{settings}")));
    let exact = simulate(&turned_rod("step = 0.000625\nscheme = \"lobatto\"")).vector("tip.u");
    for tolerance in [1e-4, 1e-6] {
        let own = run(&format!("step_tolerance = {tolerance}\nadaptive = true")).vector("tip.u");
        let error = distance(own, exact);
        assert!(error < tolerance, "{error:e} at {tolerance:e}");
    }
}

/// Steps h, 2h, h, 2h, … by hand: gravity is left out, so that the rod starts without acceleration.
fn alternating(scheme: Scheme, h: f64) -> [f64; 3] {
    let text = turned_rod("step = 1").replace("gravity = [0, 0, -1]", "");
    alternating_to(&text, scheme, h, 2.4, "tip")
}

/// Velocities of the deck, and accelerations from equilibrium. Every direction of the scene must have mass.
fn set_in_motion(motions: &[InitialMotion], state: &mut State, assembly: &mut Assembly, solver: &mut LinearSolver) {
    for motion in motions {
        for &(node, _) in &motion.nodes {
            assert_eq!(motion.velocity, Vec3::ZERO, "this loop knows spins only");
            let rotation = Rotation::new(state.q[node.p as usize]);
            state.v[node.p as usize] = rotation.t_inverse().transpose_mul(motion.spin);
        }
    }
    assembly.evaluate(state, Weights::MASS, None);
    let mut right_hand_side = vec![0.0; assembly.system.pattern.dof_map.count()];
    assembly.system.right_hand_side(&mut right_hand_side);
    assert!(solver.factorise(&assembly.system) && solver.solve(&assembly.system, &mut right_hand_side));
    assembly.system.pattern.dof_map.scatter(&right_hand_side, None, &mut state.a);
}

/// The same for any scene that starts from rest without acceleration, or with spins of bodies.
fn alternating_to(text: &str, scheme: Scheme, h: f64, end: f64, tip: &str) -> [f64; 3] {
    let (scene, _) = scene::from_text(text).unwrap_or_else(|e| panic!("{e:?}"));
    let model = scene.plan.model;
    let mut state = model.rest();
    let mut schedule = Schedule::new(&model);
    let dof_map = schedule.begin_stage(&model, 0, StageKind::Dynamic, &state).unwrap();
    let mut assembly = Assembly::new(&scene.plan.stages[0].context(0), dof_map, &model);
    let solver = LinearSolver::new(&assembly.system, &model.kinds, model.length).unwrap();
    let total = scheme.rotations == Rotations::Totals;
    let increments = (!total).then(|| Increments::new(&model, StageKind::Dynamic, &assembly.system.pattern.dof_map));
    let mut newton = Newton::new(Convergence { tolerance: 1e-12, negligible: 0.0 }, 25, solver, &assembly.system);
    schedule.set_clock(&model, &mut state, 0.0, 1.0);
    if !scene.plan.initial.is_empty() {
        set_in_motion(&scene.plan.initial, &mut state, &mut assembly, &mut newton.solver);
    }
    scheme.start(&mut state, h, None);
    if let Some(increments) = &increments {
        increments.start(&mut state, None);
    }
    let (mut time, mut before, mut work) = (0.0, h, Work::default());
    for number in 0.. {
        let length = if number % 2 == 0 { h } else { 2.0 * h };
        if time + length > end + 1e-9 {
            break;
        }
        time += length;
        let (step, good) = (Step { scheme, length }, state.clone());
        if let Some(increments) = &increments {
            increments.begin(&mut state, &step, before);
        }
        step.predict(&mut state, before);
        assert_eq!(schedule.set_clock(&model, &mut state, time, 1.0), None);
        newton.solve(&model, &mut assembly, &mut state, &step, None, &mut work).unwrap();
        if let Some(increments) = &increments {
            increments.end(&mut state, &good);
        }
        charts::wind(&mut state, &good, &model.charted(StageKind::Dynamic).rotations);
        let lag = total.then_some(scheme.lag() * length);
        charts::switch(&mut state, &model.charted(StageKind::Dynamic).rotations, charts::DYNAMIC_BAND, lag);
        charts::freeze(&mut state, &model.charted(StageKind::Dynamic).elements);
        before = length;
    }
    let tip = scene.mesh.nodes[scene.mesh.points[tip]].node;
    if state.q[tip.u as usize] == Vec3::ZERO {
        // What does not move tells by its axis.
        return Rotation::new(state.q[tip.p as usize]).r.column(2).0;
    }
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

/// The errors of all steps together stay about the tolerance, and what must be rejected is.
#[test]
fn adaptive_steps_meet_their_tolerance() {
    let schemes = ["newmark", "generalized_alpha", "lie_generalized_alpha"];
    // Deck, beams, end, step of a run that counts as exact.
    let scenes = [
        (turned_rod("step = 1"), 1, 2.4, 0.0005),
        (read("right_angle_coarse.toml"), 2, 6.0, 0.0025),
        (read("robot_arm.toml"), 2, 2.0, 0.0005),
    ];
    for (deck, beams, end, fine) in scenes {
        let length = scene::from_text(&deck).unwrap().0.plan.model.length;
        for scheme in schemes {
            let run = |own: &[String]| {
                let mut settings = vec![format!("stage.0.end={end}"), format!("stage.0.scheme=\"{scheme}\"")];
                settings.extend((0..beams).map(|k| format!("beam.{k}.interpolation=\"relative\"")));
                settings.extend(own.iter().map(|setting| format!("stage.0.{setting}")));
                simulate(&with_settings(&deck, &settings))
            };
            let exact = run(&[format!("step={fine}")]).vector("tip.u");
            let mut before = None;
            for tolerance in [1e-2, 1e-3, 1e-4] {
                let adaptive = ["step=0.2".into(), "adaptive=true".into(), format!("step_tolerance={tolerance}")];
                let simulation = run(&adaptive);
                let error = distance(simulation.vector("tip.u"), exact) / length;
                assert!(error < 5.0 * tolerance, "{scheme}, tolerance {tolerance}: error {error}\n{deck}");
                assert!(simulation.counters.cutbacks > 0, "{scheme}, {tolerance}: a first step of 0.2 is too long");
                // Errors of order two: a tenth of the tolerance takes about three times the steps.
                let steps = simulation.counters.steps as f64;
                assert!(before.is_none_or(|before| (1.5..6.0).contains(&(steps / before))), "{before:?} {steps}");
                before = Some(steps);
            }
        }
    }
}

/// A push that ends at once on a body that flies and turns freely.
#[test]
fn adaptive_steps_forget_a_jump_of_accelerations() {
    let dissipation = ["generalized_alpha", "lie_generalized_alpha"]
        .into_iter()
        .flat_map(|name| [0.0, 0.3, 0.6, 0.8, 0.9, 0.95, 1.0].map(|rho| format!("\"{name}\"\nrho_inf = {rho:?}")));
    let others = ["newmark", "hht", "lobatto"].map(|name| format!("\"{name}\""));
    for scheme in dissipation.chain(others) {
        for (tolerance, pushed) in [(1e-3, 0.1), (1e-4, 0.1), (1e-6, 0.1), (1e-4, 0.37)] {
            let simulation = simulate(&format!(
                "[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 1\ninertia = [0.5, 0.5, 0.5]\n\
                 [[load]]\nat = \"a\"\nforce = [10, 0, 0]\nmoment = [0, 0, 1]\nhistory = \"h\"\n\
                 [history.h]\ntimes = [0, {pushed}, {pushed}00000001]\nvalues = [1, 1, 0]\n\
                 [[initial]]\nat = \"a\"\nvelocity = [0, 20, 0]\n\
                 [[stage]]\nkind = \"dynamic\"\nend = 3\nstep = 0.01\nscheme = {scheme}\nadaptive = true\n\
                 step_tolerance = {tolerance:?}\n[output]\ncolumns = [\"u\", \"r\"]\n"
            ));
            // A push of a constant force, and motion without a force after it.
            let way = pushed * (3.0 - 0.5 * pushed);
            for (column, exact) in [("a.ux", 10.0 * way), ("a.uy", 60.0), ("a.rz", 2.0 * way)] {
                let found = simulation.end(column);
                assert!(
                    (found - exact).abs() < 5.0 * tolerance,
                    "{scheme} {tolerance} {pushed} {column}: {found} {exact}"
                );
            }
        }
    }
}

/// A ball that bounces twice; the place at the end is that of the equations of motion, integrated by a method of order
/// eight (DOP853).
#[test]
fn adaptive_steps_forget_impacts() {
    for scheme in ["generalized_alpha", "newmark", "hht"] {
        let run = simulate(&format!(
            "gravity = [0, 0, -10]\n[point]\na = [0, 0, 1.1]\n[[body]]\nat = \"a\"\nmass = 1\n[[surface]]\nname = \"f\"\n\
             kind = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n[[contact]]\nname = \"c\"\nnodes = [\"a\"]\n\
             surfaces = [\"f\"]\nradius = 0.1\nstiffness = 1e5\npenetration = 0.1\n[[stage]]\nkind = \"dynamic\"\nend = 2\n\
             step = 0.01\nscheme = \"{scheme}\"\nadaptive = true\nstep_tolerance = 1e-6\n[output]\ncolumns = [\"x\"]\n"
        ));
        let z = run.end("a.z");
        assert!((z - 0.917237).abs() < 1e-5, "{scheme}: {z}");
    }
}

/// Of a free body over increments the error is of order four, and so few steps are enough.
#[test]
fn adaptive_steps_know_what_increments_are_good_at() {
    let settings = |tolerance: f64| format!("lie_generalized_alpha\"\nadaptive = true\nstep_tolerance = {tolerance} #");
    let still = Vec3([0.3, 0.4, 0.5]);
    let tumbling = Pinned { end: 10.0, ..FREE };
    let exact = tumbling.simulate("lie_generalized_alpha", 0.005, still);
    for (tolerance, most) in [(1e-3, 100), (1e-5, 300)] {
        let (end, steps) = tumbling.simulate_counting(&settings(tolerance), 0.1, still);
        let error = (0..3).map(|k| (end[k] - exact[k]).max_abs()).fold(0.0, f64::max);
        assert!(error < 5.0 * tolerance && steps < most, "tolerance {tolerance}: {error:e} in {steps} steps");
    }
}

/// A pulse that begins and ends between two steps leaves no trace in the accelerations at their ends: steps stop where it begins.
#[test]
fn adaptive_steps_see_what_comes_late() {
    let text = |adaptive: &str| {
        format!(
            "[point]\nblock = [0, 0, 0]\n[[body]]\nat = \"block\"\nmass = 2\n\
             [[load]]\nat = \"block\"\nforce = [100, 0, 0]\nhistory = \"pulse\"\n\
             [history.pulse]\ntimes = [0.5, 0.51, 0.52]\nvalues = [0, 1, 0]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 2\nstep = 0.1\n{adaptive}\n[output]\ncolumns = [\"u\", \"v\"]\n"
        )
    };
    let adaptive = simulate(&text("adaptive = true\nstep_tolerance = 1e-6"));
    assert!((adaptive.vector("block.v")[0] - 0.5).abs() < 1e-9);
    assert!((adaptive.vector("block.u")[0] - 0.5 * 1.49).abs() < 1e-5);
    // Fixed steps are where the deck puts them, and know nothing of it.
    assert_eq!(simulate(&text("")).vector("block.v"), [0.0; 3]);
}

/// What has no inertia turns with its rod past pi, where its vector is continued in the other chart.
#[test]
fn rotations_without_inertia_turn_on_over_increments() {
    let spin = |scheme: &str| {
        let rod = format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 5e4\nGA = 2e4\nGJ = 80\nEI = 100\nrhoA = 1\n\
             [[beam]]\nname = \"rod\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\n\
             [[initial]]\nspin = [0, 0, 10]\nabout = \"a\"\n\
             [[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"ry\"]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.002\nscheme = \"{scheme}\"\n[output]\ncolumns = [\"u\"]\n"
        );
        let run = simulate(&rod);
        assert_eq!(run.counters.cutbacks, 0);
        run.vector("b.u")
    };
    let (increments, totals) = (spin("lie_generalized_alpha"), spin("generalized_alpha"));
    let rigid = [f64::cos(10.0) - 1.0, f64::sin(10.0), 0.0];
    assert!(distance(increments, totals) < 1e-3, "{increments:?} and {totals:?}");
    assert!(distance(increments, rigid) < 0.05, "{increments:?} and {rigid:?}");
}

/// A rod that is hit hard: Newton cannot take the first step as long as it is asked for.
#[test]
fn a_step_whose_newton_fails_is_taken_smaller() {
    let hit = |adaptive: &str| {
        turned_rod(&format!("step = 0.6\nmax_iterations = 4\n{adaptive}"))
            .replace("force = [0, 0, 1]", "force = [0, 30, 80]")
    };
    for steps in ["", "adaptive = true\nstep_tolerance = 1e-3"] {
        let simulation = simulate(&hit(steps));
        assert!(simulation.counters.cutbacks > 0, "this step is no longer too long: take a longer one");
    }
}

/// At rest but for round-off, and then a load: what the rest foresees of it, many times too much, fails once and not in every step from there on.
#[test]
fn a_jolt_out_of_rest_costs_no_more_than_its_steps() {
    let leg = |name: &str, ends: &str| {
        format!(
            "[[beam]]\nname = \"{name}\"\nsection = \"leg\"\nthrough = {ends}\nelements = 2\ninterpolation = \"total\"\n"
        )
    };
    let text = format!(
        "[point]\nroot = [0, 0, 0]\nelbow = [10, 0, 0]\ntip = [10, 10, 0]\n\
         [section.leg]\nEA = 1e6\nGA = 1e6\nGJ = 1e3\nEI = 1e3\nrhoA = 1\nrhoJ = [20, 10, 10]\n{}{}\
         [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"tip\"\nforce = [0, 0, 0.1]\n\
         [[load]]\nat = \"elbow\"\nforce = [0, 0, 50]\nhistory = \"hat\"\n\
         [history.hat]\ntimes = [0, 4, 4.01, 5, 5.01]\nvalues = [0, 0, 1, 1, 0]\n\
         [[stage]]\nkind = \"static\"\nsteps = 1\n[[stage]]\nkind = \"dynamic\"\nend = 8\nstep = 0.01\n[output]\nnodes = [\"tip\"]\n",
        leg("lower", "[\"root\", \"elbow\"]"),
        leg("upper", "[\"elbow\", \"tip\"]"),
    );
    let counters = simulate(&text).counters;
    assert_eq!((counters.steps, counters.cutbacks), (801, 0));
    assert!(counters.work.iterations < 3 * counters.steps, "{} iterations", counters.work.iterations);
}

/// The deck of a scene of the paper with other settings, and a column at its end.
fn paper(deck: &str, settings: &[String], column: &str) -> [f64; 3] {
    simulate(&with_settings(&read(deck), settings)).vector(column)
}

fn read(deck: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("decks").join(deck);
    std::fs::read_to_string(path).unwrap()
}

fn with_settings(text: &str, settings: &[String]) -> String {
    beamsim::deck::apply(text, settings).unwrap()
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
fn lobatto_is_of_order_four_in_the_scenes_of_the_paper() {
    // Deck, settings, beams, end, first step, column. Steps hit the kinks of loads and motions; a softer section has no
    // vibrations that they do not resolve.
    let soft = ["section.leg.EA=1e4", "section.leg.GA=1e4"];
    let scenes = [
        ("top_rigid.toml", &[][..], 0, 0.6, 0.008, "pin.r"),
        ("right_angle_coarse.toml", &soft, 2, 4.0, 0.0125, "tip.u"),
        ("robot_arm.toml", &[], 2, 1.5, 0.0125, "tip.u"),
    ];
    for (deck, own, beams, end, step, column) in scenes {
        let run = |h: f64| {
            let mut settings: Vec<String> = own.iter().map(|setting| setting.to_string()).collect();
            settings.extend([format!("stage.0.end={end}"), format!("stage.0.step={h}")]);
            settings.push("stage.0.scheme=\"lobatto\"".into());
            settings.push("stage.0.tolerance=1e-12".into());
            settings.extend((0..beams).map(|k| format!("beam.{k}.interpolation=\"relative\"")));
            paper(deck, &settings, column)
        };
        let [a, b, c] = [step, 0.5 * step, 0.25 * step].map(run);
        let order = (distance(a, b) / distance(b, c)).log2();
        assert!((order - 4.0).abs() < 0.6, "{deck}: order {order}");
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
    let scenes = [
        ("top_rigid.toml", 0, 0.002 / 3.0, 0.6, "pin"),
        ("right_angle_coarse.toml", 2, 0.02 / 3.0, 4.0, "tip"),
        ("robot_arm.toml", 2, 0.003, 1.44, "tip"),
    ];
    for (deck, beams, step, end, tip) in scenes {
        let settings: Vec<String> = (0..beams).map(|k| format!("beam.{k}.interpolation=\"relative\"")).collect();
        let text = with_settings(&read(deck), &settings);
        for scheme in schemes {
            let [a, b, c] = [step, 0.5 * step, 0.25 * step].map(|h| alternating_to(&text, scheme, h, end, tip));
            let order = (distance(a, b) / distance(b, c)).log2();
            assert!((order - 2.0).abs() < 0.4, "{deck}, {scheme:?}: order {order}");
        }
    }
}

/// A body about a fixed point.
struct Pinned {
    /// Mass centre as seen from the point; the mass is 1.
    offset: Vec3,
    /// About the point, principal axes along x, y, z
    inertia: [f64; 3],
    gravity: f64,
    /// Material
    spin: Vec3,
    /// Rotation vector at the start
    lean: Vec3,
    end: f64,
    /// Whether the point is held while it turns
    held: bool,
}

/// Spins about its middle axis, where it is not stable: it turns over twice until 20.
const FREE: Pinned = Pinned {
    offset: Vec3::ZERO,
    inertia: [1.0, 2.0, 3.0],
    gravity: 0.0,
    spin: Vec3([0.01, 2.0, 0.01]),
    lean: Vec3::ZERO,
    end: 20.0,
    held: true,
};

/// The top of the paper
const TOP: Pinned = Pinned {
    offset: Vec3([0.0, 0.0, 1.0]),
    inertia: [5.0, 5.0, 1.0],
    gravity: 20.0,
    spin: Vec3([0.0, 0.0, 50.0]),
    lean: Vec3([0.3, 0.0, 0.0]),
    end: 1.5,
    held: true,
};

impl Pinned {
    /// Its axes at the end. It is drawn turned back, so that a static stage that turns it by `turned` brings it to its place.
    fn simulate(&self, scheme: &str, step: f64, turned: Vec3) -> [Vec3; 3] {
        self.simulate_counting(scheme, step, turned).0
    }

    /// And how many steps it took.
    fn simulate_counting(&self, scheme: &str, step: f64, turned: Vec3) -> ([Vec3; 3], u64) {
        let lean = Rotation::new(self.lean).r;
        let drawn = Rotation::new(turned).r.transpose() * lean;
        let d = self.offset;
        let about_centre = Mat3::diagonal(self.inertia) - (Mat3::diagonal([d.squared(); 3]) - d.outer(d));
        let inertia = drawn * about_centre * drawn.transpose();
        let numbers = |v: Vec3| format!("{:?}", v.0);
        let rows: Vec<String> =
            (0..3).map(|i| format!("{:?}", [0, 1, 2].map(|j| inertia.0[i.min(j)][i.max(j)]))).collect();
        let text = format!(
            r#"
gravity = [0, 0, {gravity}]
[point]
a = [0, 0, 0]
[[body]]
at = "a"
mass = 1
offset = {offset}
inertia = [{rows}]
[[support]]
at = "a"
fix = "pin"
stages = {held}
[[motion]]
at = "a"
rotate = {axis}
angle = {angle}
stages = [1]
[[initial]]
at = "a"
spin = {spin}
[[stage]]
kind = "static"
steps = 4
[[stage]]
kind = "dynamic"
end = {end}
step = {step}
scheme = "{scheme}"
tolerance = 1e-12
[output]
columns = ["d"]
"#,
            gravity = -self.gravity,
            offset = numbers(drawn * d),
            rows = rows.join(", "),
            axis = numbers(turned),
            angle = turned.norm(),
            spin = numbers(lean * self.spin),
            end = self.end,
            held = if self.held { "[1, 2]" } else { "[1]" },
        );
        let simulation = simulate(&text);
        let column = |k: usize| Vec3(["x", "y", "z"].map(|c| simulation.end(&format!("a.d{k}{c}"))));
        let end = Mat3::from_columns(column(1), column(2), column(3)) * drawn;
        ([0, 1, 2].map(|k| end.column(k)), simulation.counters.steps)
    }
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
    let error = |a: [Vec3; 3], b: [Vec3; 3]| (0..3).map(|k| (a[k] - b[k]).max_abs()).fold(0.0, f64::max);
    // How many times better than the best of total vectors it is at least.
    for (body, step, times) in [(FREE, 0.02, 1000.0), (TOP, 0.001, 50.0)] {
        let exact = body.simulate("lie_generalized_alpha", step / 16.0, orientations[0]);
        let all = |scheme: &str| -> Vec<f64> {
            orientations.iter().map(|&turned| error(body.simulate(scheme, step, turned), exact)).collect()
        };
        let (increments, totals) = (all("lie_generalized_alpha"), all("newmark"));
        let least = |errors: &[f64]| errors.iter().copied().fold(f64::INFINITY, f64::min);
        let most = increments.iter().copied().fold(0.0, f64::max);
        assert!(most - least(&increments) < 1e-10, "{:e} to {most:e}", least(&increments));
        assert!(least(&totals) > times * most, "total vectors {:e}, increments {most:e}", least(&totals));
    }
}

/// Without moments what remains is the error of the quadrature of the spin, which is of order four for every rho_inf.
#[test]
fn a_free_body_is_of_order_four_over_increments() {
    let change = |a: [Vec3; 3], b: [Vec3; 3]| (0..3).map(|k| (a[k] - b[k]).max_abs()).fold(0.0, f64::max);
    // With the mass centre at its node, pinned, and aside of it, flying.
    let aside = Pinned { offset: Vec3([0.0, 0.0, 0.5]), inertia: [1.25, 2.25, 3.0], held: false, end: 10.0, ..FREE };
    for (body, step) in [(FREE, 0.08), (aside, 0.04)] {
        for rho in [0.0, 0.5, 0.9, 1.0] {
            let scheme = format!("lie_generalized_alpha\"\nrho_inf = {rho} #");
            let run = |step: f64| body.simulate(&scheme, step, Vec3([0.3, 0.4, 0.5]));
            let [a, b, c] = [step, 0.5 * step, 0.25 * step].map(run);
            let order = (change(a, b) / change(b, c)).log2();
            assert!((order - 4.0).abs() < 0.2, "rho_inf {rho}: order {order}");
        }
    }
}

/// The thinner a rod, the more its spin about itself would make of errors of its momentum.
#[test]
fn slender_bodies_are_no_harder() {
    let change = |a: [Vec3; 3], b: [Vec3; 3]| (0..3).map(|k| (a[k] - b[k]).max_abs()).fold(0.0, f64::max);
    for thin in [1.0, 1e-2, 1e-4, 1e-8] {
        let length = 2.2;
        let rod = Pinned {
            offset: Vec3([0.0, 0.0, length]),
            inertia: [length * length + 1.0, length * length + 1.0, thin],
            gravity: 9.81,
            spin: Vec3([0.5, 2.5, 0.0]),
            lean: Vec3([0.3, 0.0, 0.0]),
            end: 3.0,
            held: true,
        };
        let run = |step: f64| rod.simulate("lie_generalized_alpha", step, Vec3([0.3, 0.4, 0.5]));
        let error = change(run(0.01), run(0.00125));
        assert!(error < 2e-3, "inertia about the axis {thin}: {error:e}");
    }
}

/// A pendulum on a hinge that two held components of its rotation make: it goes over the top again and again.
#[test]
fn hinges_stay_hinges_over_increments() {
    let run = |scheme: &str, step: f64| {
        simulate(&format!(
            r#"
gravity = [0, -9.81, 0]
[point]
a = [0, 0, 0]
[[body]]
at = "a"
mass = 2
offset = [0.5, 0, 0.1]
inertia = [0.3, 0.2, 0.4]
[[support]]
at = "a"
fix = ["ux", "uy", "uz", "rx", "ry"]
[[initial]]
at = "a"
spin = [0, 0, 12]
[[stage]]
kind = "dynamic"
end = 10
step = {step}
scheme = "{scheme}"
[output]
columns = ["rc", "w", "energy"]
"#
        ))
    };
    let simulation = run("lie_generalized_alpha", 0.005);
    for column in ["a.rx", "a.ry", "a.wx", "a.wy"] {
        assert!(simulation.end(column).abs() < 1e-12, "{column} {:e}", simulation.end(column));
    }
    let exact = run("newmark", 0.0005).end("a.rz");
    assert!(exact > 60.0, "it turns over: {exact}");
    assert!((simulation.end("a.rz") - exact).abs() < 2e-2, "{} {exact}", simulation.end("a.rz"));
}

/// Stages of one scheme after another: what is algorithmic starts anew, and the motion goes on.
#[test]
fn schemes_follow_one_another() {
    let stages = |schemes: [&str; 3]| -> String {
        let stage = |(k, scheme): (usize, &str)| {
            format!("[[stage]]\nkind = \"dynamic\"\nend = {}\nstep = 0.002\nscheme = \"{scheme}\"\n", k + 1)
        };
        let stages: String = schemes.into_iter().enumerate().map(stage).collect();
        format!(
            r#"
[point]
a = [0, 0, 0]
[[body]]
at = "a"
mass = 1
inertia = [1, 2, 3]
[[initial]]
at = "a"
spin = [1, 2, 3]
{stages}
[output]
columns = ["d"]
"#
        )
    };
    let (lie, newmark) = ("lie_generalized_alpha", "newmark");
    let end = |schemes: [&str; 3]| {
        let simulation = simulate(&stages(schemes));
        ["a.d1x", "a.d2y", "a.d3z"].map(|column| simulation.end(column))
    };
    let (mixed, one) = (end([lie, newmark, lie]), end([lie; 3]));
    let error = distance(mixed, one);
    assert!(error > 0.0 && error < 1e-3, "{error:e}");
}

/// A body that hangs from a hinge of multipliers: steps do not collapse, and the hinge stays closed.
#[test]
fn adaptive_steps_go_with_joints() {
    let run = |stage: &str| {
        simulate(&format!(
            r#"
gravity = [0, 0, -9.81]
[point]
a = [1, 0, 0]
[[body]]
at = "a"
mass = 1
inertia = [0.1, 0.2, 0.3]
[[joint]]
kind = "revolute"
nodes = ["a"]
at = [0, 0, 0]
axis = [0, 1, 0]
[[initial]]
at = "a"
velocity = [0, 0, -10]
spin = [0, 10, 0]
[[stage]]
kind = "dynamic"
end = 1
{stage}
[output]
columns = ["u"]
"#
        ))
    };
    let fine = run("step = 0.0002\nscheme = \"generalized_alpha\"").vector("a.u");
    for scheme in ["generalized_alpha", "lie_generalized_alpha"] {
        let stage = format!("step = 0.1\nscheme = \"{scheme}\"\nadaptive = true\nstep_tolerance = 1e-3");
        let simulation = run(&stage);
        let error = distance(simulation.vector("a.u"), fine);
        assert!(error < 5e-3, "{scheme}: {error:e}");
        assert!(simulation.counters.steps < 3000, "{scheme}: {} steps", simulation.counters.steps);
    }
}

/// Nobody can count turns that a step leaps over: it is taken in smaller ones.
#[test]
fn more_than_half_a_turn_a_step_is_not_leapt_over() {
    let run = |spin: f64, step: &str| {
        crate::scenes::attempt(&format!(
            "[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 1\ninertia = [1, 1, 1]\n[[initial]]\nat = \"a\"\nspin = [0, 0, {spin}]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 2\nscheme = \"lie_generalized_alpha\"\n{step}\n[output]\ncolumns = [\"rc\"]\n"
        ))
    };
    for steps in ["step = 0.4", "step = 0.4\nadaptive = true"] {
        let counted = run(10.0, steps);
        assert!(counted.result.is_ok() && counted.counters.cutbacks > 0);
        assert!((counted.end("a.rz") - 20.0).abs() < 1e-9, "{steps}: {}", counted.end("a.rz"));
    }
    // A 64th of the step is still too long.
    let told = run(1e3, "step = 0.4").result.unwrap_err().to_string();
    assert!(told.contains("node \"a\" turns by"), "{told}");
}

/// Where the smallest step is still too wrong, the run says so.
#[test]
fn the_smallest_step_is_not_taken_on_trust() {
    let text = turned_rod("step = 0.2\nadaptive = true\nstep_tolerance = 1e-30");
    let result = crate::scenes::attempt(&text).result;
    let failure = result.expect_err("no step is that good");
    assert_eq!(failure.name(), "not_converged");
    assert!(failure.to_string().contains("the smallest step has an estimated error"), "{failure}");
}

/// Late on the clock a short step is hardly longer than the clock's round-off: it is still one step.
#[test]
fn a_short_step_late_on_the_clock_is_taken_once() {
    let text = "[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 1\ninertia = [1, 1, 1]\n[[initial]]\nat = \"a\"\nvelocity = [1, 0, 0]\n\
                [[stage]]\nkind = \"dynamic\"\nend = 1000\nstep = 10\n[[stage]]\nkind = \"dynamic\"\nend = 1000.01\nstep = 1e-5\n";
    let simulation = simulate(text);
    assert!((simulation.end("a.ux") - 1000.01).abs() < 1e-9, "{}", simulation.end("a.ux"));
    assert_eq!(simulation.counters.steps, 1100);
}

/// Rows of fixed steps stay where they were, and the motion is that of the smaller step.
#[test]
fn a_subdivided_step_is_as_good_as_a_smaller_one() {
    let hit = |step: f64| {
        let settings = format!("step = {step}\nmax_iterations = 4");
        simulate(&turned_rod(&settings).replace("force = [0, 0, 1]", "force = [0, 30, 80]"))
    };
    let (coarse, fine) = (hit(0.6), hit(0.6 / 64.0));
    assert!(coarse.counters.cutbacks > 0 && fine.counters.cutbacks == 0);
    assert_eq!(coarse.rows.len() as u64, coarse.counters.steps + 1);
    let off = distance(coarse.vector("tip.u"), fine.vector("tip.u"));
    let size = fine.vector("tip.u").iter().fold(0.0_f64, |m, u| m.max(u.abs()));
    assert!(off < 0.2 * size, "{off} of {size}");
}

/// The energy that a damper takes, and the work of a force and of a moved support, have the order of the scheme.
#[test]
fn work_through_the_middle_of_steps_has_order_four() {
    let text = |step: f64| {
        format!(
            "[point]\nm = [0, 0, 0]\nr = [0, 3, 0]\nw = [0, 6, 0]\nv = [1, 6, 0]\n[history.push]\nexpr = \"sin(3*t)\"\n\
             [history.turn]\nexpr = \"t^2 * (3 - t) / 4\"\n\
             [[body]]\nat = \"m\"\nmass = 1\n[[body]]\nat = \"r\"\nmass = 1\ninertia = [0.5, 0.6, 0.7]\n\
             [[body]]\nat = \"v\"\nmass = 2\n[[body]]\nat = \"w\"\nmass = 1\n\
             [[support]]\nat = \"m\"\nfix = [\"uy\", \"uz\", \"rx\", \"ry\", \"rz\"]\n\
             [[support]]\nat = \"r\"\nfix = [\"ux\", \"uy\", \"uz\"]\n\
             [[support]]\nat = \"w\"\nfix = [\"uy\", \"uz\", \"rx\", \"ry\", \"rz\"]\n[[support]]\nat = \"v\"\nfix = [\"uy\", \"uz\", \"rx\", \"ry\", \"rz\"]\n\
             [[spring]]\nat = \"m\"\nstiffness = [4, 0, 0, 0, 0, 0]\ndamping = [0.8, 0, 0, 0, 0, 0]\n\
             [[spring]]\nat = \"r\"\nstiffness = [0, 0, 0, 1, 1, 2]\ndamping = [0, 0, 0, 0.2, 0.3, 0.1]\n\
             [[spring]]\nbetween = [\"w\", \"v\"]\nstiffness = 5\n\
             [[motion]]\nat = \"w\"\nux = 0.5\nhistory = \"turn\"\n\
             [[load]]\nat = \"m\"\nforce = [2, 0, 0]\nhistory = \"push\"\n\
             [[load]]\nat = \"r\"\nmoment = [1, 0.5, -0.7]\nhistory = \"push\"\n\
             [[stage]]\nkind = \"dynamic\"\nend = 2\nstep = {step}\nscheme = \"lobatto\"\n\
             [output]\nnodes = [\"m\", \"r\", \"v\"]\ncolumns = [\"u\", \"energy\"]\n"
        )
    };
    let ends = |step: f64| {
        let simulation = simulate(&text(step));
        ["energy.external", "energy.damped", "energy.total"].map(|column| simulation.end(column))
    };
    let [coarse, fine, exact] = [0.1, 0.05, 0.0025].map(ends);
    for k in 0..3 {
        let [first, second] = [coarse, fine].map(|ends| (ends[k] - exact[k]).abs());
        assert!(first < 2e-3 && second < first / 11.0, "{k}: {first} and {second} of {exact:?}");
    }
    assert!(exact[0] > 0.5 && exact[1] > 0.1 && exact[2].abs() < 1e-7, "{exact:?}");
}

/// Bodies that wait at rest for their load have the energies of round-off, which may grow.
#[test]
fn what_waits_at_rest_for_its_load_gains_no_energy() {
    let joint = "[[joint]]\nkind = \"universal\"\nnodes = [\"tip\"]\nat = [0.1, 0.17, 0.07]\naxes = [[0.8, 0.6, 0], [-0.36, 0.48, 0.8]]\n";
    let schemes = || SCHEMES.into_iter().chain(["scheme = \"lobatto\""]);
    for (scheme, joint) in schemes().map(|scheme| (scheme, joint)).chain(schemes().map(|scheme| (scheme, ""))) {
        let text = format!(
            "[point]\ntip = [0.4, 0.3, 0.2]\n[[body]]\nat = \"tip\"\nmass = 1\ninertia = [0.02, 0.02, 0.02]\n\
             {joint}\
             [[spring]]\nat = \"tip\"\nstiffness = [60, 40, 10, 0, 0, 0]\ndamping = [0.5, 0.6, 1.7, 0.04, 0.03, 0.02]\n\
             [history.late]\ntimes = [0, 0.5, 0.7]\nvalues = [0, 0, 1]\n\
             [[load]]\nat = \"tip\"\nforce = [1, 2, 3]\nhistory = \"late\"\n\
             [[stage]]\nkind = \"dynamic\"\nend = END\nstep = 0.005\n{scheme}\n[output]\ncolumns = [\"u\", \"energy\"]\n"
        );
        let simulation = simulate(&text.replace("END", "1"));
        assert!(simulation.end("energy.external") > 0.01, "{scheme}");
        let quiet = simulate(&text.replace("END", "0.4"));
        assert_eq!(quiet.counters.findings.warnings, [], "{scheme}");
    }
}

/// A driven bead gets its energy from the drive, whose force changes its sign within each element.
#[test]
fn drives_of_sliders_do_the_work_that_moves_their_beads() {
    for elements in [4, 8] {
        let text = format!(
            "[point]\na = [0, 0, 0]\nb = [4, 0, 0]\nc = [0.5, 0, 0]\n[section.s]\nEA = 1e5\nGA = 1e5\nGJ = 1e3\nEI = 1e3\nrhoA = 1\n\
             [history.h]\nexpr = \"t^2 * (3 - t) / 4\"\n\
             [[beam]]\nname = \"w\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = {elements}\norder = 2\n\
             [[body]]\nat = \"c\"\nmass = 1\n[[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"b\"\nfix = \"all\"\n\
             [[slider]]\nnodes = [\"c\"]\non = \"w\"\ndisplacement = 2\nhistory = \"h\"\n\
             [[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.01\nscheme = \"lobatto\"\n\
             [output]\nnodes = [\"c\"]\ncolumns = [\"v\", \"energy\"]\n"
        );
        let simulation = simulate(&text);
        assert!((simulation.end("c.vx") - 1.5).abs() < 0.01);
        let [kinetic, total] = ["energy.kinetic", "energy.total"].map(|column| simulation.end(column));
        assert!(total.abs() < 3e-3 * kinetic, "{elements}: {total} of {kinetic}");
    }
}

const NAMES: [&str; 5] = ["lobatto", "generalized_alpha", "lie_generalized_alpha", "hht", "newmark"];

/// Of a part that is driven at its node, a motor's history begins with an acceleration: what a joint fastens to it has it, too.
#[test]
fn what_is_fastened_to_a_driven_node_is_accelerated_with_it() {
    let pushed = [
        "[[joint]]\nkind = \"prismatic\"\nnodes = [\"a\"]\naxis = [0.6, 0, 0.8]\ndisplacement = 1\nhistory = \"h\"\n",
        "[[motion]]\nat = \"a\"\nux = 0.6\nhistory = \"h\"\n[[motion]]\nat = \"a\"\nuz = 0.8\nhistory = \"h\"\n[[support]]\nat = \"a\"\nfix = [\"uy\", \"rx\", \"ry\", \"rz\"]\n",
    ];
    for (scheme, push) in NAMES.into_iter().flat_map(|scheme| pushed.map(|push| (scheme, push))) {
        let run = simulate(&format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[[body]]\nat = \"a\"\nmass = 2\ninertia = [1, 1, 1]\n\
             [[body]]\nat = \"b\"\nmass = 3\ninertia = [1, 1, 1]\n[history.h]\nexpr = \"1 - cos(2*t)\"\n\
             {push}[[joint]]\nkind = \"rigid\"\nnodes = [\"a\", \"b\"]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.005\nscheme = \"{scheme}\"\n\
             [output]\ncolumns = [\"a\", \"reaction\"]\n"
        ));
        let [of_b, force] = ["b.az", "a.fz"].map(|column| run.column(column));
        assert!((of_b[0] - 3.2).abs() < 1e-12 && (force[0] - 16.0).abs() < 1e-11, "{scheme}: {of_b:?} {force:?}");
        if scheme == "lobatto" {
            let exact = |k: usize| 3.2 * f64::cos(0.01 * k as f64);
            let off = |(k, a): (usize, &f64)| (a - exact(k)).abs();
            let off = of_b.iter().enumerate().map(off).fold(0.0, f64::max);
            assert!(off < 1e-10 && (run.end("a.fz") - 5.0 * exact(20)).abs() < 1e-9, "{off:e} {}", run.end("a.fz"));
        }
    }
}

/// A motor at the node of its crank, or beside it: one joint is a support of the node, the other has multipliers.
#[test]
fn motors_at_nodes_and_beside_them_drive_alike() {
    for scheme in ["lobatto", "generalized_alpha"] {
        let damping = if scheme == "lobatto" { "" } else { "rho_inf = 0.5\n" };
        let [at_node, beside] = ["", "at = [0, 0, 0.3]\n"].map(|at| {
            simulate(&format!(
                "[point]\nshaft = [0, 0, 0]\nrod = [0.8, 0, 0]\nslider = [1.3, 0, 0]\n\
                 [[body]]\nat = \"shaft\"\nmass = 1\ninertia = [0.01, 0.01, 0.01]\noffset = [0.15, 0, 0]\n\
                 [[body]]\nat = \"rod\"\nmass = 2\ninertia = [0.17, 0.17, 0.17]\n\
                 [[body]]\nat = \"slider\"\nmass = 3\ninertia = [0.1, 0.1, 0.1]\n\
                 [[joint]]\nkind = \"revolute\"\nnodes = [\"shaft\"]\n{at}axis = [0, 0, 1]\nangle = 1\nhistory = \"h\"\n\
                 [[joint]]\nkind = \"universal\"\nnodes = [\"shaft\", \"rod\"]\nat = [0.3, 0, 0]\naxes = [[0, 0, 1], [0, 1, 0]]\n\
                 [[joint]]\nkind = \"spherical\"\nnodes = [\"rod\", \"slider\"]\nat = \"slider\"\n\
                 [[joint]]\nkind = \"prismatic\"\nnodes = [\"slider\"]\naxis = [1, 0, 0]\n\
                 [history.h]\nexpr = \"3 * t^2\"\n\
                 [[stage]]\nkind = \"dynamic\"\nend = 0.5\nstep = 0.005\nscheme = \"{scheme}\"\n{damping}\
                 [output]\nnodes = [\"shaft\", \"rod\", \"slider\"]\ncolumns = [\"a\", \"alpha\", \"energy\"]\n"
            ))
        });
        for column in ["slider.ax", "rod.ay", "rod.alphaz", "energy.external"] {
            let [one, other] = [&at_node, &beside].map(|run| run.column(column));
            let size = other.iter().fold(0.0_f64, |most, a| most.max(a.abs()));
            let off = one.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(size > 0.1 && off < 1e-6 * size, "{scheme}, {column}: {off:e} of {size}");
        }
    }
}

/// A bead that is driven along a heavy beam has the acceleration of its drive from the first row on.
#[test]
fn beads_are_accelerated_with_their_drives() {
    for scheme in NAMES {
        let run = simulate(&format!(
            "[point]\na = [0, 0, 0]\nb = [0, 0, 4]\nc = [0, 0, 0.5]\n[section.s]\nEA = 1e5\nGA = 1e5\nGJ = 1e3\nEI = 1e3\nrhoA = 1e9\n\
             [history.h]\nexpr = \"t^2\"\n[[beam]]\nname = \"w\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\n\
             [[body]]\nat = \"c\"\nmass = 1\n[[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"b\"\nfix = \"all\"\n\
             [[slider]]\nnodes = [\"c\"]\non = \"w\"\ndisplacement = 1.5\nhistory = \"h\"\n\
             [[stage]]\nkind = \"dynamic\"\nend = 0.01\nstep = 0.01\nscheme = \"{scheme}\"\n\
             [output]\nnodes = [\"c\"]\ncolumns = [\"a\"]\n"
        ));
        let first = run.column("c.az")[0];
        assert!((first - 3.0).abs() < 1e-6, "{scheme}: {first}");
    }
}

/// A frame of two bodies that joints let not move at all, under a load that comes slowly: its energies are round-off.
#[test]
fn what_cannot_move_gains_no_energy() {
    for scheme in NAMES {
        let run = simulate(&format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0.3, 0]\n[[body]]\nat = \"a\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n\
             [[body]]\nat = \"b\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n\
             [[joint]]\nkind = \"revolute\"\nnodes = [\"a\"]\nat = [-0.5, 0.1, 0]\naxis = [0, 0, 1]\n\
             [[joint]]\nkind = \"spherical\"\nnodes = [\"b\"]\nat = [1.7, 0.1, 0.2]\n\
             [[joint]]\nkind = \"universal\"\nnodes = [\"a\", \"b\"]\nat = [0.45, 0.6, 0.1]\naxes = [[0, 0, 1], [1, 0, 0]]\n\
             [[load]]\nat = \"b\"\nforce = [3, -5, 2]\nhistory = \"h\"\n[history.h]\nexpr = \"sin(3*t)\"\n\
             [[stage]]\nkind = \"dynamic\"\nend = 0.2\nstep = 0.002\nscheme = \"{scheme}\"\n[output]\ncolumns = [\"u\", \"energy\"]\n"
        ));
        let told = &run.counters.findings.warnings;
        assert!(told.iter().all(|warning| warning.kind == WarningKind::UndampedMultipliers), "{scheme}: {told:?}");
        assert!(run.vector("b.u").iter().all(|u| u.abs() < 1e-12), "{scheme}");
    }
}

/// A sudden load on links that are next to rigid: steps do not resolve what it sets going, and damping takes it away.
#[test]
fn sudden_loads_on_stiff_linkages_end_no_run() {
    let link = |name: &str, ends: &str| {
        format!(
            "[[beam]]\nname = \"{name}\"\nsection = \"s\"\nthrough = {ends}\nelements = 2\norder = 2\naxis3 = [0, 0, 1]\n"
        )
    };
    let hinge = |at: &str, beams: &str, more: &str| {
        format!("[[joint]]\nkind = \"revolute\"\nat = \"{at}\"\nbeams = {beams}\naxis = [0, 0, 1]\n{more}")
    };
    for scheme in ["generalized_alpha\"\nrho_inf = 0.6 #", "hht"] {
        let text = [
            "gravity = [-3.8, -0.97, 0]\n[point]\nO = [0, 0, 0]\nA = [-0.162, -0.185, 0]\nB = [0.314, -0.543, 0]\nC = [0.482, 0, 0]\n\
             [section.s]\nEA = 1e7\nGA = 1e7\nGJ = 1e7\nEI = 1e7\nrhoA = 0.7\nrhoJ = [0.002, 0.001, 0.001]\n"
                .to_string(),
            link("crank", "[\"O\", \"A\"]"),
            link("coupler", "[\"B\", \"A\"]"),
            link("rocker", "[\"C\", \"B\"]"),
            hinge("O", "[\"crank\"]", "angle = 2.2\nhistory = \"h\"\n"),
            hinge("A", "[\"crank\", \"coupler\"]", "damping = 1.5\n"),
            hinge("B", "[\"coupler\", \"rocker\"]", "stiffness = 1.7\n"),
            hinge("C", "[\"rocker\"]", ""),
            "[[load]]\nat = \"rocker@end\"\nforce = [2.8, 0.39, 0]\n[[load]]\nat = \"rocker@end\"\nmoment = [0, 0, 2.2]\nframe = \"body\"\n\
             [[body]]\nat = \"coupler@0.5\"\nmass = 0.68\n[history.h]\nexpr = \"(t*2.9)^4/(1 + (t*2.9)^4)\"\n"
                .to_string(),
            format!(
                "[[stage]]\nkind = \"dynamic\"\nend = 0.8\nstep = 0.002\nscheme = \"{scheme}\"\n[output]\nnodes = [\"A\"]\ncolumns = [\"x\"]\n"
            ),
        ]
        .concat();
        let run = simulate(&text);
        let turned = {
            let s = (0.8f64 * 2.9).powi(4);
            2.2 * s / (1.0 + s)
        };
        let (sine, cosine) = turned.sin_cos();
        let expected = [-0.162 * cosine + 0.185 * sine, -0.162 * sine - 0.185 * cosine, 0.0];
        let found = run.vector("A.");
        assert!(distance(found, expected) < 1e-4, "{scheme}: {found:?} for {expected:?}");
    }
}

/// A motor that starts from rest by a sum that is rounded has no velocity.
#[test]
fn velocities_of_round_off_are_no_jumps() {
    let told = |expr: &str| {
        crate::scenes::warnings(&format!(
            "[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 1\ninertia = [1, 1, 1]\n[[joint]]\nkind = \"revolute\"\n\
             nodes = [\"a\"]\naxis = [0, 0, 1]\nangle = 1\nhistory = \"h\"\n[history.h]\nexpr = \"{expr}\"\n\
             [[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.01\n"
        ))
    };
    assert_eq!(told("sin(t + pi/2) - 1"), Vec::<String>::new());
    assert!(told("1e-9*t")[0].contains("the velocity jumps"));
}

/// What has no mass is in balance where a dynamic stage begins. A massless bar in two halves holds a mass m at its end, and one
/// half is heated at once: u = e L/2 (1 - cos(w t)), w^2 = EA/(m L). In random units and directions, with and without a static
/// stage before, in which a support holds the middle of the heated bar; then it is released, with the same motion about its
/// place.
#[test]
fn what_has_no_mass_begins_in_balance() {
    let mut random = Random::new(101);
    for number in 0..12 {
        let [length, mass] = [0; 2].map(|_| 10.0_f64.powf(random.range(-3.0, 3.0)));
        let (along, part) = (random.direction(), random.range(0.3, 0.7));
        let (strain, frequency) = (1e-3 * random.range(0.2, 1.0), random.range(3.0, 20.0));
        let stiffness = frequency * frequency * mass * length;
        let is_released = number % 2 == 1;
        let (held, begins) = match is_released {
            true => {
                ("[[support]]\nat = \"m\"\nfix = \"all\"\nstages = [1]\n", "[[stage]]\nkind = \"static\"\nsteps = 1\n")
            }
            false => ("", ""),
        };
        let deck = |scheme: &str, steps: f64| {
            format!(
                "[point]\na = [0, 0, 0]\nm = {}\nb = {}\n[section.s]\nEA = {stiffness:e}\nGA = {stiffness:e}\nGJ = {bending:e}\n\
                 EI = {bending:e}\n[[beam]]\nname = \"hot\"\nsection = \"s\"\nthrough = [\"a\", \"m\"]\nelements = 1\n\
                 free_strain = [{strain}, 0, 0, 0, 0, 0]\n[[beam]]\nname = \"cold\"\nsection = \"s\"\nthrough = [\"m\", \"b\"]\n\
                 elements = 1\n[[body]]\nat = \"b\"\nmass = {mass:e}\n[[support]]\nat = \"a\"\nfix = \"all\"\n\
                 [[support]]\nat = \"b\"\naxes = [{}, {}]\nfix = [\"uy\", \"uz\", \"rx\", \"ry\", \"rz\"]\n{held}{begins}\
                 [[stage]]\nkind = \"dynamic\"\nend = {}\nstep = {:e}\nscheme = \"{scheme}\"\n\
                 [output]\nnodes = [\"b\"]\ncolumns = [\"u\"]\n",
                list(along * (part * length)),
                list(along * length),
                list(along),
                list(along.cross(Vec3([0.3, -0.7, 0.5])).normalized().unwrap()),
                4.0 / frequency,
                1.0 / (steps * frequency),
                bending = 1e-2 * stiffness * length * length,
            )
        };
        let size = strain * part * length;
        let error = |scheme: &str, steps: f64| {
            let run = simulate(&deck(scheme, steps));
            let way = run.vector("b.u");
            let expected = size * (1.0 - 4.0_f64.cos());
            let told: Vec<_> = run.counters.findings.warnings.iter().map(|warning| warning.kind).collect();
            assert!(told.iter().all(|kind| *kind == WarningKind::LongSteps), "{told:?}\n{}", deck(scheme, steps));
            (Vec3(way).dot(along) - expected).abs() / size
        };
        let [coarse, fine] = [20.0, 40.0].map(|steps| error("newmark", steps));
        assert!(fine < 2e-3 && coarse > 3.5 * fine, "{number}: {coarse:e} {fine:e}");
        let fourth = error("lobatto", 20.0);
        assert!(fourth < 2e-6, "{number}: {fourth:e}");
    }
}

/// Rotations with damping and without inertia begin with the rate of balance: a rod with GJ and the damping c GJ under a
/// sudden torque M turns by r (1 - exp(-t/c)), r = M L/GJ. Where only another axis is damped it turns by r at once, and
/// stays.
#[test]
fn what_has_damping_alone_begins_with_its_rate() {
    let mut random = Random::new(102);
    for number in 0..12 {
        let length = 10.0_f64.powf(random.range(-3.0, 3.0));
        let (along, turned, time) = (random.direction(), random.range(0.1, 0.5), random.range(0.05, 2.0));
        let aside = along.cross(random.direction()).normalized().unwrap();
        let torsion = 10.0 * length * length;
        let run = |scheme: &str, steps: f64, damping: &str| {
            simulate(&format!(
                "[effects]\nlarge_rotations = {}\n[point]\na = [0, 0, 0]\nb = {}\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = {torsion:e}\n\
                 EI = {bending:e}\nrhoA = 1\n[[beam]]\nname = \"p\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\n\
                 [[support]]\nat = \"a\"\nfix = \"all\"\n{damping}[[load]]\nat = \"b\"\nmoment = {}\n\
                 [[stage]]\nkind = \"dynamic\"\nend = {time:e}\nstep = {:e}\nscheme = \"{scheme}\"\n[output]\nnodes = [\"b\"]\ncolumns = [\"r\", \"w\"]\n",
                number % 2 == 0,
                list(along * length),
                list(along * (turned * torsion / length)),
                time / steps,
                bending = 100.0 * torsion,
            ))
        };
        let viscous = format!("[damping]\nstiffness = {time:e}\n");
        let error = |scheme: &str, steps: f64| {
            let expected = 1.0 - (-1.0_f64).exp();
            (Vec3(run(scheme, steps, &viscous).vector("b.r")).dot(along) / turned - expected).abs()
        };
        let [coarse, fine] = [10.0, 20.0].map(|steps| error("newmark", steps));
        assert!(fine < 5e-4 && coarse > 3.5 * fine, "{number}: {coarse:e} {fine:e}");
        let fourth = error("lobatto", 10.0);
        assert!(fourth < 2e-6, "{number}: {fourth:e}");
        let damper = format!(
            "[[spring]]\nat = \"b\"\naxes = [{}, {}]\ndamping = [0, 0, 0, {:e}, 0, 0]\n",
            list(aside),
            list(along.cross(aside)),
            torsion / length
        );
        let held = run("newmark", 10.0, &damper);
        let (place, rate) = (Vec3(held.vector("b.r")), Vec3(held.vector("b.w")));
        assert!(
            (place.dot(along) / turned - 1.0).abs() < 1e-6 && rate.norm() * time < 1e-2 * turned,
            "{number}: {place:?} {rate:?}"
        );
    }
}
