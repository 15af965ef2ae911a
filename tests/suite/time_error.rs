//! What dynamic stages of fixed steps know of their error, and what they tell of it.

use super::folder::{Folder, last_line, status};
use crate::random::Random;
use crate::scenes::{Simulation, simulate};
use beamsim::output::HistoryReader;
use beamsim_core::integrate::Largest;
use beamsim_core::warning::{About, WarningKind};
use serde_json::Value;
use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};

/// A point mass of 1 on a spring of stiffness pi^2 along x, let go with the velocity pi: x = sin(pi t), y = z = 0.
fn oscillator(scheme: &str, step: f64) -> String {
    format!(
        "[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 1\n[[spring]]\nat = \"a\"\nstiffness = [{k}, {k}, {k}, 0, 0, 0]\n\
         [[initial]]\nat = \"a\"\nvelocity = [{PI}, 0, 0]\n[output]\nnodes = [\"a\"]\ncolumns = [\"u\", \"energy\"]\n\
         [[stage]]\nkind = \"dynamic\"\nend = 10\nstep = {step}\nscheme = \"{scheme}\"\n",
        k = PI * PI
    )
}

/// The oscillator in a linear stage.
fn linear_oscillator(scheme: &str, step: f64) -> String {
    format!("[effects]\nlarge_rotations = false\n{}", oscillator(scheme, step))
}

/// A chain of 60 elements that swings in its second shape of a pendulum, in a plane or in space.
fn chain(planar: bool, step: f64) -> String {
    format!(
        "gravity = [0, 0, -9.81]\n[effects]\nplanar = {planar}\n[point]\ntop = [0, 0, 0]\nend = [1, 0, -1]\n\
         [section.s]\nEA = 1e4\nGA = 1e4\nGJ = 0.1\nEI = 0.1\nrhoA = 1\n\
         [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"top\", \"end\"]\nelements = 60\n\
         [[support]]\nat = \"top\"\nfix = \"all\"\n[output]\nnodes = [\"end\"]\n\
         [[stage]]\nkind = \"dynamic\"\nend = 2\nstep = {step}\nscheme = \"generalized_alpha\"\n"
    )
}

/// A free body of inertia 3, 5, 7 about its middle axis.
fn tumbling(scheme: &str, step: f64) -> String {
    format!(
        "[point]\nc = [0, 0, 0]\n[[body]]\nat = \"c\"\nmass = 1\ninertia = [3, 5, 7]\n[[initial]]\nat = \"c\"\nspin = [0.1, 10, 0]\n\
         [output]\nnodes = [\"c\"]\ncolumns = [\"d\"]\n[[stage]]\nkind = \"dynamic\"\nend = 6\nstep = {step}\nscheme = \"{scheme}\"\n"
    )
}

/// A rod about a hinge, let go when it is level: next to rigid, so that no step resolves how it stretches.
fn rod(scheme: &str, step: f64, elements: usize) -> String {
    format!(
        "gravity = [0, 0, -9.81]\n[point]\no = [0, 0, 0]\ne = [1, 0, 0]\n\
         [section.s]\nEA = 1e6\nGA = 1e6\nGJ = 100\nEI = 100\nrhoA = 1\nrhoJ = [0.002, 0.001, 0.001]\n\
         [[beam]]\nname = \"rod\"\nsection = \"s\"\nthrough = [\"o\", \"e\"]\nelements = {elements}\n\
         [[joint]]\nkind = \"revolute\"\nat = \"o\"\nbeams = [\"rod\"]\naxis = [0, 1, 0]\n\
         [output]\nnodes = [\"e\"]\n[[stage]]\nkind = \"dynamic\"\nend = 5\nstep = {step}\nscheme = \"{scheme}\"\n"
    )
}

/// A free body about its middle axis, which it all but keeps between one turn over and the next.
fn lingering(scheme: &str, step: f64) -> String {
    tumbling(scheme, step)
        .replace("inertia = [3, 5, 7]", "inertia = [1, 2, 3]")
        .replace("spin = [0.1, 10, 0]", "spin = [0.001, 10, 0.001]")
        .replace("end = 6", "end = 20")
}

/// The estimated errors of the only dynamic stage.
fn estimated(simulation: &Simulation) -> Largest {
    let [found] = simulation.counters.findings.time_errors[..] else { panic!("one stage") };
    found.largest
}

/// The names of the warnings that put an answer in doubt.
fn doubts(simulation: &Simulation) -> Vec<WarningKind> {
    let given = simulation.counters.findings.warnings.iter();
    given.map(|warning| warning.kind).filter(|kind| kind.about() != About::Deck).collect()
}

fn largest_difference(a: &[f64], b: impl Fn(usize) -> f64) -> f64 {
    a.iter().enumerate().map(|(k, a)| (a - b(k)).abs()).fold(0.0, f64::max)
}

#[test]
fn the_estimate_is_the_error_of_an_oscillation_and_falls_with_the_order_of_the_scheme() {
    type Deck = fn(&str, f64) -> String;
    let large =
        ["newmark", "hht", "generalized_alpha", "lie_generalized_alpha"].map(|scheme| (scheme, oscillator as Deck));
    let linear = ["newmark", "hht", "generalized_alpha"].map(|scheme| (scheme, linear_oscillator as Deck));
    let of_order_two = large.into_iter().chain(linear).map(|(scheme, deck)| (scheme, deck, 0.02, 4.0));
    let of_order_four = [oscillator as Deck, linear_oscillator].map(|deck| ("lobatto", deck, 0.2, 16.0));
    for (scheme, deck, step, falls) in of_order_two.chain(of_order_four) {
        let of = |step: f64| {
            let simulation = simulate(&deck(scheme, step));
            let error = largest_difference(&simulation.column("a.ux"), |k| (PI * step * k as f64).sin());
            let estimate = estimated(&simulation);
            assert!((estimate.moved - 1.0).abs() < 0.05, "{scheme}: {estimate:?}");
            (error, estimate.displacement)
        };
        let [whole, half] = [of(step), of(0.5 * step)];
        for (error, estimate) in [whole, half] {
            assert!((0.75..1.25).contains(&(estimate / error)), "{scheme}: {estimate:e} for {error:e}");
        }
        let ratio = whole.1 / half.1 / falls;
        assert!((0.9..1.15).contains(&ratio), "{scheme}: halved steps leave 1/{ratio} of 1/{falls}");
    }
}

/// The tangent of a linear stage is factorised once, before there is any error.
#[test]
fn linear_stages_carry_their_errors_like_others() {
    let [large, linear] = [oscillator("newmark", 0.1), linear_oscillator("newmark", 0.1)].map(|deck| simulate(&deck));
    let [expected, found] = [&large, &linear].map(|simulation| estimated(simulation).displacement);
    assert!((found / expected - 1.0).abs() < 1e-6, "{found} for {expected}");
    assert!(doubts(&large).contains(&WarningKind::LongSteps) && doubts(&linear) == [WarningKind::LongSteps]);
}

#[test]
fn errors_of_free_rotations_are_known_and_the_other_scheme_is_named() {
    // Exact to 1e-4: d2 lies across the momentum at 1.352 and 4.056.
    let exact = simulate(&tumbling("lie_generalized_alpha", 1e-3));
    let [newmark, lie] = ["newmark", "lie_generalized_alpha"].map(|scheme| simulate(&tumbling(scheme, 0.01)));
    let off = |simulation: &Simulation| {
        let exact = exact.column("c.d2y");
        largest_difference(&simulation.column("c.d2y"), |k| exact[10 * k])
    };
    assert!(off(&newmark) > 0.5 && off(&lie) < 0.02);
    assert!(estimated(&newmark).rotation > 0.5);
    assert!((off(&lie)..0.1).contains(&estimated(&lie).rotation), "{:?}", estimated(&lie));
    assert_eq!((doubts(&newmark), doubts(&lie)), (vec![WarningKind::LongSteps], vec![]));
    let message = &newmark.counters.findings.warnings[0].message;
    assert!(message.contains("scheme = \"lie_generalized_alpha\""), "{message}");
}

/// An error that grows by itself is told with steps of order four as well, and is not told where it is small.
#[test]
fn errors_of_lobatto_in_free_rotations_are_known() {
    let turned = |simulation: &Simulation| ["c.d1x", "c.d2y", "c.d3z"].map(|name| simulation.column(name));
    for (inertia, spin, steps) in [
        ("[3, 5, 7]", "[0.1, 10, 0]", [0.05, 0.025, 0.0125]),
        ("[7, 3, 5]", "[0, 0.2, 8]", [0.05, 0.025, 0.0125]),
        ("[3, 5, 7]", "[1, 0, 10]", [0.1, 0.05, 0.025]),
    ] {
        let of = |scheme: &str, step: f64| {
            let deck = tumbling(scheme, step).replace("[3, 5, 7]", inertia).replace("[0.1, 10, 0]", spin);
            simulate(&deck)
        };
        let exact = turned(&of("lobatto", 0.003125));
        for step in steps {
            let simulation = of("lobatto", step);
            let stride = (step / 0.003125).round() as usize;
            let columns = turned(&simulation);
            let off = columns.iter().zip(&exact).map(|(a, exact)| largest_difference(a, |k| exact[stride * k]));
            let (off, estimate) = (off.fold(0.0, f64::max), estimated(&simulation).rotation);
            let told = doubts(&simulation).contains(&WarningKind::LongSteps);
            println!("{inertia}, {spin}, step {step}: {estimate:e} for {off:e}, told: {told}");
            assert!(estimate > 0.7 * off.min(0.5), "{inertia}, step {step}: {estimate:e} for {off:e}");
            assert!(told || off < 0.1, "{inertia}, step {step}: {off} in silence");
            assert!(!told || off > 0.01, "{inertia}, step {step}: an error of {off:e} is told as {estimate:e}");
        }
    }
}

/// What is carried along grows without bounds where the motion is unstable for a while, or rings: it is no error of the motion.
#[test]
fn good_steps_of_a_lingering_body_are_not_warned_of() {
    for step in [0.01, 0.005, 0.002] {
        let simulation = simulate(&lingering("lie_generalized_alpha", step));
        assert!(!doubts(&simulation).contains(&WarningKind::LongSteps), "step {step}: {:?}", estimated(&simulation));
    }
    // Even at the short step its spin is off by 6 of 10.
    for step in [0.01, 0.002] {
        let simulation = simulate(&lingering("newmark", step));
        assert!(doubts(&simulation).contains(&WarningKind::LongSteps), "step {step}: {:?}", estimated(&simulation));
    }
}

#[test]
fn good_steps_of_a_stiff_rod_are_not_warned_of() {
    let exact = simulate(&rod("generalized_alpha", 0.0005, 1)).vector("e.u");
    for scheme in ["newmark", "generalized_alpha", "lie_generalized_alpha", "lobatto"] {
        for (elements, steps) in [
            (1, vec![0.01, 0.005]),
            (2, vec![0.008, 0.006, 0.005, 0.004, 0.002]),
            (4, vec![0.008, 0.006, 0.005, 0.003]),
        ] {
            for step in steps {
                let simulation = simulate(&rod(scheme, step, elements));
                let come = simulation.vector("e.u");
                let off = largest_difference(&come, |k| exact[k]);
                let estimate = estimated(&simulation);
                let of = format!("{scheme}, {elements} elements, step {step}: {estimate:?} for {off}");
                assert!(off < 0.02 * estimate.moved, "{of}");
                assert!(estimate.displacement < 0.03 * estimate.moved, "{of}");
                assert!(!doubts(&simulation).contains(&WarningKind::LongSteps), "{of}");
            }
        }
    }
}

/// Scenes of more than a hundred slots carry their errors only where the sum of local ones comes to something.
#[test]
fn large_scenes_know_their_errors_too_and_the_proposed_step_will_do() {
    for planar in [true, false] {
        let long = simulate(&chain(planar, 0.1));
        let end = |simulation: &Simulation| simulation.vector("end.u");
        let exact = end(&simulate(&chain(planar, 0.002)));
        let off = |simulation: &Simulation| largest_difference(&end(simulation), |k| exact[k]);
        assert!(doubts(&long).contains(&WarningKind::LongSteps), "planar: {planar}");
        assert!(estimated(&long).displacement > 0.3 * off(&long), "{:?} for {}", estimated(&long), off(&long));
        let message =
            &long.counters.findings.warnings.iter().find(|w| w.kind == WarningKind::LongSteps).unwrap().message;
        let (_, proposed) = message.split_once("`step = ").unwrap();
        let proposed: f64 = proposed.split_once('`').unwrap().0.parse().unwrap();
        let shorter = simulate(&chain(planar, proposed));
        assert_eq!(doubts(&shorter), [], "step {proposed}");
        assert!(off(&shorter) < 0.05 * estimated(&shorter).moved, "step {proposed}: {}", off(&shorter));
    }
}

/// A cantilever of 60 elements under sudden weight, whose second mode long steps do not resolve: its error counts
/// several times.
#[test]
fn large_scenes_know_their_errors_with_a_stage_in_the_middle_of_steps() {
    let run = |step: f64| {
        simulate(&format!(
            "gravity = [0, 0, -0.1]\n[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n\
             [section.s]\nEA = 1e3\nGA = 1e3\nGJ = 1\nEI = 1\nrhoA = 1\n\
             [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 60\n\
             [[support]]\nat = \"a\"\nfix = \"all\"\n[output]\nnodes = [\"b\"]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 6\nstep = {step}\nscheme = \"lobatto\"\n"
        ))
    };
    let exact = run(0.025).column("b.uz");
    for (step, stride, is_told) in [(0.5, 20, true), (0.4, 16, true), (0.1, 4, false)] {
        let simulation = run(step);
        let off = largest_difference(&simulation.column("b.uz"), |k| exact[stride * k]);
        let Largest { displacement, moved, .. } = estimated(&simulation);
        let of = format!("step {step}: {displacement:e} for {off:e} of {moved:e}");
        println!("{of}");
        assert!((0.2..5.0).contains(&(displacement / off)), "{of}");
        assert_eq!(doubts(&simulation).contains(&WarningKind::LongSteps), is_told, "{of}");
    }
}

/// Sums of local errors are taken every fourth step: what is left over at the end counts, too.
#[test]
fn short_stages_of_large_scenes_know_their_errors() {
    for steps in [1, 2, 3, 4, 6] {
        let of = |step: f64| {
            let deck = chain(true, step).replace("end = 2\n", &format!("end = {}\n", 0.05 * f64::from(steps)));
            simulate(&deck.replace("[\"end\"]", "[\"b@0.05\", \"b@0.1\", \"b@0.25\", \"end\"]"))
        };
        let (long, exact) = (of(0.05), of(0.001));
        let places = exact.names.iter().filter(|name| name.ends_with(".ux") || name.ends_with(".uz"));
        let off = places.map(|name| {
            let exact = exact.column(name);
            largest_difference(&long.column(name), |k| exact[50 * k])
        });
        let (off, estimate) = (off.fold(0.0, f64::max), estimated(&long));
        let ratio = estimate.displacement / off;
        assert!((0.5..5.0).contains(&ratio), "{steps} steps: {estimate:?} for {off}");
    }
}

/// A static stage whose work nobody asks for is not booked.
#[test]
fn a_static_stage_between_is_no_imbalance_where_nobody_asks_for_energies() {
    let deck = oscillator("newmark", 0.01)
        .replace(", \"energy\"", "")
        .replace("end = 10", "end = 0.5")
        .replace("[[stage]]", "[[load]]\nat = \"a\"\nforce = [0, 0.1, 0]\n[[stage]]");
    let dynamic = "[[stage]]\nkind = \"dynamic\"\nend = 1.5\nstep = 0.01\n";
    let simulation = simulate(&format!("{deck}[[stage]]\nkind = \"static\"\nsteps = 4\n{dynamic}"));
    assert_eq!(doubts(&simulation), []);
}

/// What moved goes on behind a modal stage; behind a static one it does not.
#[test]
fn only_stages_that_end_at_rest_take_kinetic_energy() {
    let deck = oscillator("newmark", 0.01).replace("end = 10", "end = 1");
    let after = |stages: &str| doubts(&simulate(&format!("{deck}{stages}"))).contains(&WarningKind::EnergyBalance);
    let modal = "[[stage]]\nkind = \"modal\"\nmodes = 1\n";
    assert!(!after(modal));
    assert!(!after(&format!("{modal}[[stage]]\nkind = \"dynamic\"\nend = 2\nstep = 0.01\n")));
    assert!(after("[[stage]]\nkind = \"static\"\nsteps = 1\n"));
}

/// A scene is let go from a preload with initial motions: they bring energy in that no step is to blame for.
#[test]
fn what_initial_motions_bring_in_after_a_preload_is_no_imbalance() {
    let preload = "[[load]]\nat = \"a\"\nforce = [0, 0.1, 0]\n[[stage]]\nkind = \"static\"\nsteps = 4\n[[stage]]";
    let deck = oscillator("newmark", 0.01).replace("[[stage]]", preload);
    assert_eq!(doubts(&simulate(&deck)), []);
}

/// Errors are compared with the largest motion and energy of the run: a stage that is almost at rest may err by its own.
#[test]
fn a_stage_nearly_at_rest_is_judged_by_the_motion_of_the_run() {
    // A damper takes nearly all of the energy; then steps are far too long for what is left of the motion.
    let deck = oscillator("generalized_alpha", 0.005)
        .replace("stiffness = ", "damping = [4, 4, 4, 0, 0, 0]\nstiffness = ")
        + "[[stage]]\nkind = \"dynamic\"\nend = 14\nstep = 0.4\nscheme = \"generalized_alpha\"\nrho_inf = 0\n";
    let simulation = simulate(&deck);
    let [_, last] = simulation.counters.findings.time_errors[..] else { panic!("two stages") };
    assert!(last.largest.displacement > 0.1 * last.largest.moved, "{last:?}");
    assert_eq!(doubts(&simulation), []);
}

#[test]
fn an_accuracy_that_is_missed_has_a_status_of_its_own_and_the_best_is_written() {
    let folder = Folder::new("missed");
    folder.write("deck.toml", &oscillator("newmark", 0.01));
    // A few rounds fit into a second, and none comes near.
    let output = folder.beamsim(&["run", "deck.toml", "--accuracy", "1e-12", "--budget", "1s"]);
    assert_eq!(status(&output), 5, "{}", last_line(&output));
    assert!(last_line(&output).starts_with("error[accuracy]: an error of 1e-12 of `"), "{}", last_line(&output));
    let read = |name: &str| fs::read(folder.0.join("results/deck").join(name)).unwrap();
    let record: Value = serde_json::from_slice(&read("run.json")).unwrap();
    assert_eq!((&record["accuracy"]["reached"], &record["status"]), (&false.into(), &"finished".into()));
    let [wanted, estimate] = [0, 1].map(|k| record["accuracy"]["columns"]["a.ux"][k].as_f64().unwrap());
    assert!(wanted == 1e-12 && estimate > 1e-12 && estimate < 1e-2);
    assert!(!read("history.csv").is_empty());
}

/// The last value of a column of a deck in `decks/dynamics/`, run with a wanted accuracy that is reached.
fn end_of_search(folder: &Folder, deck: &Path, wanted: f64, column: &str) -> f64 {
    let output = folder.beamsim(&["run", deck.to_str().unwrap(), "--accuracy", &wanted.to_string(), "--out", "out"]);
    assert_eq!(status(&output), 0, "{}", last_line(&output));
    let history = HistoryReader::read(&folder.0.join("out/history.csv")).unwrap();
    let number = history.names.iter().position(|name| name == column).unwrap();
    history.rows.last().unwrap()[number]
}

fn dynamic_deck(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("decks/dynamics").join(name).with_extension("toml")
}

/// Steps over the whole of a smooth motion see nothing of it, and two of them agree: shorter ones are taken from the start.
#[test]
fn an_accuracy_is_kept_where_motions_are_shorter_than_steps() {
    let folder = Folder::new("short_motion");
    let came = end_of_search(&folder, &dynamic_deck("pin_that_moves_within_a_step"), 1e-3, "p.ry");
    // (J + m l^2) w' = -m g l sin + m l a cos, by a Runge-Kutta method of order 8.
    assert!((came.abs() - 0.51971).abs() <= 1e-3 * 0.7468, "{came} for 0.51971");
}

/// The same of a load by a formula: all steps that miss its pulse agree on what else moves.
#[test]
fn an_accuracy_is_kept_where_pulses_are_shorter_than_steps() {
    let folder = Folder::new("short_pulse");
    let deck =
        fs::read_to_string(dynamic_deck("formula_between_steps")).unwrap() + "\n[[initial]]\nvelocity = [0.1, 0, 0]\n";
    folder.write("deck.toml", &deck);
    let came = end_of_search(&folder, &folder.0.join("deck.toml"), 1e-2, "a.vx");
    let exact = 0.1 + 600.0 * 0.0004 * std::f64::consts::PI.sqrt();
    assert!((came - exact).abs() <= 1e-2 * exact, "{came} for {exact}");
}

/// The middle of an arc is a node of the deck's mesh, and of those that are chosen.
#[test]
fn an_accuracy_is_kept_at_nodes_that_other_meshes_do_not_have() {
    let folder = Folder::new("between_nodes");
    for wanted in [1e-3, 3e-4] {
        let came = end_of_search(&folder, &dynamic_deck("accuracy_between_nodes"), wanted, "b1@0.5.uy");
        // 36 cubic elements an arc; the largest displacement is 0.02618.
        assert!((came - 0.0012150).abs() <= wanted * 0.02618, "{came} for 0.0012150, wanted {wanted:e}");
    }
}

#[test]
fn bars_of_long_steps_hold_the_error() {
    let folder = Folder::new("bars_of_long_steps");
    folder.write("deck.toml", &oscillator("newmark", 0.1));
    let output = folder.beamsim(&["run", "deck.toml", "--error-bars", "--out", "out"]);
    assert_eq!(status(&output), 0, "{}", last_line(&output));
    let history = HistoryReader::read(&folder.0.join("out/history.csv")).unwrap();
    let column = |name: &str| history.names.iter().position(|known| known == name).unwrap();
    let (time, own, bar) = (column("time"), column("a.ux"), column("a.ux.err"));
    let mut largest: f64 = 0.0;
    for row in &history.rows {
        let error = (row[own] - (PI * row[time]).sin()).abs();
        assert!(error <= row[bar] + 1e-15, "at {}: {error:e} in {:e}", row[time], row[bar]);
        largest = largest.max(error);
    }
    let last = history.rows.last().unwrap()[bar];
    assert!(last <= 3.0 * largest, "{largest:e} in {last:e}");
}

#[test]
fn error_bars_say_where_a_polyline_may_stand_for_a_curve() {
    let folder = Folder::new("polyline");
    let deck = |path: &str| {
        format!(
            "[section.s]\nEA = 1e3\nGA = 1e3\nGJ = 10\nEI = 10\n[[beam]]\nname = \"b\"\nsection = \"s\"\n{path}\n\
             [[support]]\nat = \"b@start\"\nfix = \"all\"\n[[load]]\nat = \"b@end\"\nforce = [0, 0, 1]\n\
             [output]\nnodes = [\"b@end\"]\n[[stage]]\nkind = \"static\"\nsteps = 1\n"
        )
    };
    let told = |path: &str, words: &[&str]| {
        folder.write("deck.toml", &deck(path));
        let output = folder.beamsim(&[&["run", "deck.toml", "--out", "out"][..], words].concat());
        assert_eq!(status(&output), 0, "{}", last_line(&output));
        let said = [output.stdout, output.stderr].concat();
        String::from_utf8_lossy(&said).contains("straight pieces meet at angles of up to")
    };
    let pieces = "through = [[0, 0, 0], [1, 0, 0], [1.98, 0.2, 0], [2.9, 0.6, 0]]\nelements = 2";
    let corner = "through = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]\nelements = 2";
    let arc = "arc = [[0, 0, 0], [1, 0.3, 0], [2, 1, 0]]\nelements = 4";
    assert!(told(pieces, &["--error-bars"]) && !told(pieces, &[]));
    assert!(!told(corner, &["--error-bars"]) && !told(arc, &["--error-bars"]));
}

/// A mass of 2 that falls by half a unit into a cable, and swings a little.
fn falling_into_a_cable(scheme: &str, damping: f64, step: f64) -> String {
    format!(
        "gravity = [0, 0, -10]\n[point]\ntop = [0, 0, 0]\nm = [0.001, 0, -1]\n[[body]]\nat = \"top\"\nmass = 1\ninertia = [1, 1, 1]\n\
         [[support]]\nat = \"top\"\nfix = \"all\"\n[[body]]\nat = \"m\"\nmass = 2\n\
         [[spring]]\nbetween = [\"top\", \"m\"]\nstiffness = 5000\nlength = 1.5\ntension_only = true\ndamping = {damping}\n\
         [output]\nnodes = [\"m\"]\ncolumns = [\"x\", \"v\"]\n[[stage]]\nkind = \"dynamic\"\nend = 2\nstep = {step}\nscheme = \"{scheme}\"\n"
    )
}

#[test]
fn cables_that_become_taut_within_steps_are_in_the_estimate() {
    for damping in [0.0, 5.0, 20.0] {
        let exact = simulate(&falling_into_a_cable("newmark", damping, 2e-5)).column("m.z");
        for scheme in ["newmark", "generalized_alpha", "lie_generalized_alpha", "hht", "lobatto"] {
            let (mut of_all, mut least) = (0.0, f64::INFINITY);
            for (step, stride) in [(0.01, 500), (0.008, 400), (0.005, 250), (0.004, 200), (0.002, 100), (0.001, 50)] {
                let run = simulate(&falling_into_a_cable(scheme, damping, step));
                let off = |(k, z): (usize, &f64)| (z - exact[stride * k]).abs();
                let error = run.column("m.z").iter().enumerate().map(off).fold(0.0, f64::max);
                let Largest { displacement, .. } = run.counters.findings.time_errors[0].largest;
                let ratio = displacement / error;
                // Errors of successive changes add up or cancel by chance, and beyond the size of the motion the
                // estimate grows on.
                assert!(
                    ratio > 0.12 && (ratio < 30.0 || displacement > 0.3),
                    "{scheme}, {damping}, {step}: {displacement} for {error}"
                );
                of_all += ratio.ln() / 6.0;
                least = f64::min(least, ratio);
            }
            assert!(
                (0.4..5.0).contains(&f64::exp(of_all)),
                "{scheme}, {damping}: {} (at least {least})",
                f64::exp(of_all)
            );
        }
    }
}

#[test]
fn an_accuracy_is_reached_with_cables_that_become_taut() {
    let folder = Folder::new("accuracy_of_cables");
    for (damping, accuracy) in [(0.0, 1e-3), (20.0, 1e-2)] {
        folder.write("cable.toml", &falling_into_a_cable("generalized_alpha", damping, 0.01));
        let run =
            folder.beamsim(&["run", "cable.toml", "--accuracy", &accuracy.to_string(), "--out", "out", "--force"]);
        assert_eq!(status(&run), 0, "{}", String::from_utf8_lossy(&run.stderr));
        let exact = simulate(&falling_into_a_cable("newmark", damping, 2e-5));
        let history = HistoryReader::read(&folder.0.join("out/history.csv")).unwrap();
        let column = |name: &str| history.names.iter().position(|known| known == name).unwrap();
        for name in ["m.z", "m.vz"] {
            let (exact, time, own) = (exact.column(name), column("time"), column(name));
            let size = exact.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
            for row in &history.rows {
                let steps = row[time] / 2e-5;
                let (before, part) = ((steps as usize).min(exact.len() - 2), steps.fract());
                let there = exact[before] * (1.0 - part) + exact[before + 1] * part;
                assert!(
                    (row[own] - there).abs() < accuracy * size,
                    "{name} at {}: {} for {there}",
                    row[time],
                    row[own]
                );
            }
        }
    }
}

/// The quaternions of a node, row by row.
fn quaternions(simulation: &Simulation, node: &str) -> Vec<[f64; 4]> {
    let parts = ["qw", "qx", "qy", "qz"].map(|name| simulation.column(&format!("{node}.{name}")));
    (0..parts[0].len()).map(|row| std::array::from_fn(|k| parts[k][row])).collect()
}

/// The largest angle between the rotations of a node in two runs, the second with `stride` times as many steps.
fn largest_angle(of: &Simulation, exact: &Simulation, node: &str, stride: usize) -> f64 {
    let exact = quaternions(exact, node);
    let angle = |(row, q): (usize, [f64; 4])| {
        let cosine: f64 = q.iter().zip(exact[row * stride]).map(|(a, b)| a * b).sum();
        2.0 * cosine.abs().min(1.0).acos()
    };
    quaternions(of, node).into_iter().enumerate().map(angle).fold(0.0, f64::max)
}

/// Moments change how free spins turn the axes of a body within steps of increments.
#[test]
fn errors_of_heavy_tops_are_known() {
    let random = &mut Random::new(41);
    for _ in 0..6 {
        let [inertia, spin] = [
            [0, 1, 2].map(|_| random.range(0.05, 0.08)),
            [random.range(-3.0, 3.0), random.range(-3.0, 3.0), random.range(5.0, 17.0)],
        ];
        let offset = [random.range(-0.1, 0.1), random.range(-0.1, 0.1), random.range(0.05, 0.3)];
        let top = |scheme: &str, step: f64| {
            simulate(&format!(
                "gravity = [0, 0, -9.81]\n[point]\np = [0, 0, 0]\n[[body]]\nat = \"p\"\nmass = 1.3\ninertia = {inertia:?}\n\
                 offset = {offset:?}\n[[support]]\nat = \"p\"\nfix = \"pin\"\n[[initial]]\nat = \"p\"\nspin = {spin:?}\n\
                 [output]\nnodes = [\"p\"]\ncolumns = [\"q\"]\n\
                 [[stage]]\nkind = \"dynamic\"\nend = 2\nstep = {step}\nscheme = \"{scheme}\"\n"
            ))
        };
        let exact = top("lobatto", 1e-3);
        for (scheme, allowed) in [("lie_generalized_alpha", 0.5..4.0), ("newmark", 0.45..4.0)] {
            let run = top(scheme, 5e-3);
            let [error, estimate] = [largest_angle(&run, &exact, "p", 5), estimated(&run).rotation];
            assert!(allowed.contains(&(estimate / error)), "{scheme}: {estimate} for {error}, {inertia:?} {spin:?}");
        }
    }
}

/// What flies may be where it should be, and turned by a wrong angle. Told is an estimate of 0.3 rad; of random bodies at
/// ten and more steps a turn estimates are 0.3 to 3 times the error.
#[test]
fn errors_of_rotations_are_told_of_bodies_that_fly() {
    let mut random = Random::new(5);
    let [mut wrong, mut right] = [0, 0];
    for case in 0..40 {
        let scheme = ["newmark", "hht", "generalized_alpha", "lie_generalized_alpha"][case % 4];
        let inertia = [random.range(0.1, 0.15), random.range(0.15, 0.2), random.range(0.2, 0.24)];
        let spin = random.vector(6.0).0;
        let body = |scheme: &str, step: f64| {
            simulate(&format!(
                "[point]\np = [0, 0, 0]\n[[body]]\nat = \"p\"\nmass = 1\ninertia = {inertia:?}\n\
                 [[initial]]\nat = \"p\"\nvelocity = [30, 0, 0]\nspin = {spin:?}\n[output]\nnodes = [\"p\"]\n\
                 columns = [\"q\"]\n[[stage]]\nkind = \"dynamic\"\nend = 12\nstep = {step}\nscheme = \"{scheme}\"\n"
            ))
        };
        let step = if case < 20 { 0.08 } else { 0.004 };
        let [run, exact] = [body(scheme, step), body("lobatto", 0.004)];
        let error = largest_angle(&run, &exact, "p", (step / 0.004).round() as usize);
        let is_told = doubts(&run).contains(&WarningKind::LongSteps);
        assert!(is_told || error < 0.7, "{scheme}, {inertia:?}, {spin:?}: {error} rad in silence");
        assert!(!is_told || error > 0.1, "{scheme}, {inertia:?}, {spin:?}: {error} rad are told");
        wrong += usize::from(error > 0.3);
        right += usize::from(error < 0.05);
    }
    println!("{wrong} wrong, {right} right");
    assert!(wrong > 5 && right > 5, "{wrong} wrong, {right} right");
}

/// A pendulum of one body errs by as much whatever moves beside it: its mass centre swings, its node stands still.
#[test]
fn errors_of_mass_centres_are_told() {
    let pendulum = |more: &str, step: f64| {
        simulate(&format!(
            "gravity = [0, 0, -9.81]\n[point]\np = [0, 0, 0]\nq = [5, 0, 0]\n\
             [[body]]\nat = \"p\"\nmass = 1\ninertia = [0.005, 0.005, 0.005]\noffset = [0.3, 0, 0]\n\
             [[support]]\nat = \"p\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"rz\"]\n{more}\
             [output]\nnodes = [\"p\"]\ncolumns = [\"q\"]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 6\nstep = {step}\nscheme = \"newmark\"\n"
        ))
    };
    let drifts = "[[body]]\nat = \"q\"\nmass = 1\n[[support]]\nat = \"q\"\nfix = [\"uy\", \"uz\"]\n\
                  [[initial]]\nat = \"q\"\nvelocity = [0.01, 0, 0]\n";
    for more in ["", drifts] {
        let [coarse, fine] = [0.04, 0.0025].map(|step| pendulum(more, step));
        assert_eq!((doubts(&coarse), doubts(&fine)), (vec![WarningKind::LongSteps], vec![]), "{more}");
        // The mass centre is 0.3 from the pin.
        let (error, estimate) = (0.3 * largest_angle(&coarse, &fine, "p", 16), estimated(&coarse));
        assert!((0.5..6.0).contains(&(estimate.displacement / error)), "{estimate:?} for {error}");
        assert!((estimate.moved - 0.6).abs() < 0.03, "{estimate:?}");
    }
}

/// What has no inertia follows what has: rotations of a bar without rotary inertia that falls on a floor.
#[test]
fn rotations_without_inertia_have_no_error_of_their_own() {
    let run = simulate(
        "gravity = [0, 0, -9.81]\n[point]\na = [0, 0, 0.01]\nb = [1, 0, 0.11]\n\
         [section.s]\nEA = 1e5\nGA = 1e5\nGJ = 1e3\nEI = 2e3\nrhoA = 1\n\
         [[beam]]\nname = \"l\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 6\n\
         [[surface]]\nname = \"floor\"\nkind = \"plane\"\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n\
         [[contact]]\nname = \"f\"\nbeams = [\"l\"]\nsurfaces = [\"floor\"]\nradius = 0.01\nstiffness = 1e6\ndamping = 1\n\
         [damping]\nstiffness = 1e-4\n[[stage]]\nkind = \"dynamic\"\nend = 0.3\nstep = 1e-4\n[output]\nnodes = [\"a\"]\n",
    );
    assert!(estimated(&run).rotation < 0.1, "{:?}", estimated(&run));
    assert!(!doubts(&run).contains(&WarningKind::LongSteps), "{:?}", doubts(&run));
}

/// Where nothing restores what a load moves, the first slope of the force leaves an error that grows for the whole
/// stage: a free body under a force or a moment that swings from a phase of its own.
#[test]
fn errors_of_loads_that_swing_what_is_free_are_known() {
    let mut random = Random::new(77);
    let mut ratios = [f64::INFINITY, 0.0];
    for case in 0..40 {
        let scheme = ["newmark", "generalized_alpha", "hht", "lie_generalized_alpha", "lobatto"][case % 5];
        let (rate, phase) = (random.range(0.15, 0.45), random.range(0.0, PI));
        let steps = random.range(40.0, 400.0).floor();
        let what = if case % 2 == 0 { ("force", "u") } else { ("moment", "r") };
        let text = format!(
            "[point]\np = [0, 0, 0]\n[[body]]\nat = \"p\"\nmass = 1\ninertia = [1, 1, 1]\n\
             [[load]]\nat = \"p\"\n{} = [0.001, 0, 0]\nhistory = \"h\"\n[history.h]\nexpr = \"sin({rate}*t + {phase})\"\n\
             [output]\nnodes = [\"p\"]\ncolumns = [\"{}\"]\n[[stage]]\nkind = \"dynamic\"\nend = {steps}\nstep = 1\n\
             scheme = \"{scheme}\"\n",
            what.0, what.1
        );
        let simulation = simulate(&text);
        let way = |k: usize| {
            let t = k as f64;
            0.001 * ((phase.sin() - (rate * t + phase).sin()) / rate + phase.cos() * t) / rate
        };
        let error = largest_difference(&simulation.column(&format!("p.{}x", what.1)), way);
        let estimate = estimated(&simulation);
        let ratio = (if what.0 == "force" { estimate.displacement } else { estimate.rotation }) / error;
        ratios = [ratios[0].min(ratio), ratios[1].max(ratio)];
        assert!((0.4..2.5).contains(&ratio), "{scheme} {what:?} {rate} {phase} {steps}: {ratio} of {error:e}");
    }
    println!("estimates over errors: {ratios:?}");
}
