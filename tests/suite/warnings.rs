//! Warnings and the stability of static stages as data: their names, run.json, and what decks expect of them.

use super::folder::{Folder, last_line, status};
use crate::random::Random;
use crate::scenes::{Simulation, attempt, list, simulate, warnings};
use beamsim_core::run::{Failure, StabilityVerdict, StageStability};
use beamsim_core::tensor::Vec3;
use beamsim_core::warning::WarningKind;
use serde_json::Value;
use std::f64::consts::PI;
use std::fs;
use std::path::Path;

fn file(name: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap()
}

/// A cantilever column under `load` in its axis, in space, with other tables.
fn column(load: f64, more: &str) -> String {
    column_with("planar = false", load, more)
}

/// The same with other words under `[effects]`. Its soft axis is x.
fn column_with(effects: &str, load: f64, more: &str) -> String {
    format!(
        "[effects]\n{effects}\n[point]\nfoot = [0, 0, 0]\ntop = [0, 0, 1]\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 10\nEI = [10, 20]\nrhoA = 1\nrhoJ = [2e-3, 1e-3, 1e-3]\n\
         [[beam]]\nname = \"column\"\nsection = \"s\"\nthrough = [\"foot\", \"top\"]\nelements = 8\n\
         [[support]]\nat = \"foot\"\nfix = \"all\"\n[[load]]\nat = \"top\"\nforce = [0, 0, -{load}]\n{more}"
    )
}

const STATIC: &str = "[[stage]]\nkind = \"static\"\nsteps = 3\n";

/// pi^2 EI/(4 L^2) about the soft axis
const CRITICAL: f64 = 24.674;

fn verdicts(deck: &str) -> Vec<StageStability> {
    simulate(deck).counters.findings.stability
}

#[test]
fn the_reference_lists_each_warning_with_what_it_is_about() {
    let page = file("docs/deck.md");
    let (_, section) = page.split_once("\n## Warnings\n").unwrap();
    let (section, _) = section.split_once("\n## ").unwrap();
    let listed: Vec<Vec<&str>> = section
        .lines()
        .filter(|line| line.starts_with("| `"))
        .map(|line| line.split('|').map(|cell| cell.trim().trim_matches('`')).collect())
        .collect();
    let found: Vec<[&str; 2]> = listed.iter().map(|cells| [cells[1], cells[2]]).collect();
    let expected: Vec<[&str; 2]> = WarningKind::ALL.iter().map(|kind| [kind.name(), kind.about().name()]).collect();
    assert_eq!(found, expected);
    assert!(listed.iter().all(|cells| cells[3].len() > 20));
}

#[test]
fn the_schema_allows_the_names_of_warnings_and_false() {
    let schema: Value = serde_json::from_str(&file("src/deck/schema.json")).unwrap();
    let names = WarningKind::ALL.iter().map(|kind| Value::from(kind.name()));
    let expected: Vec<Value> = names.chain([Value::from(false)]).collect();
    assert_eq!(schema["properties"]["expect"]["items"]["properties"]["warns"]["enum"], Value::from(expected));
}

/// Lee's frame, which snaps through on the way, from the binary.
#[test]
fn a_record_lists_the_warnings_of_a_snap_through_and_the_stability_of_its_end() {
    let folder = Folder::new("warnings");
    folder.write("lee.toml", &file("decks/hard/s01_lee_plain_static.toml"));
    let ran = folder.beamsim(&["run", "lee.toml"]);
    assert_eq!(status(&ran), 0);
    let record: Value = serde_json::from_slice(&fs::read(folder.0.join("results/lee/run.json")).unwrap()).unwrap();
    let warnings = record["warnings"].as_array().unwrap();
    let names: Vec<&str> = warnings.iter().map(|warning| warning["name"].as_str().unwrap()).collect();
    let expected = ["arc_length_detour", "limit_point", "turning_point", "turning_point", "limit_point"];
    assert_eq!(names[..5], expected);
    assert_eq!(names[5..], ["load_control_resumed"]);
    assert!(
        warnings.iter().all(|warning| warning["about"] == "path" && warning["stage"] == 1 && warning["time"] == 0.0)
    );
    let limit = &record["events"][0];
    assert_eq!((&limit["kind"], &limit["load"]), (&Value::from("limit point"), &warnings[1]["load"]));
    assert!((limit["load"].as_f64().unwrap() - 0.9278).abs() < 1e-3);
    assert_eq!(record["stability"], serde_json::json!([{ "stage": 1, "verdict": "stable", "negative": 0 }]));
    // On the terminal the same, in the same order.
    let told = String::from_utf8_lossy(&ran.stderr).into_owned();
    let told: Vec<&str> = told.lines().filter(|line| line.starts_with("warning")).collect();
    let lines =
        warnings.iter().zip(&names).map(|(w, name)| format!("warning[{name}]: {}", w["message"].as_str().unwrap()));
    assert_eq!(told, lines.collect::<Vec<_>>());
}

#[test]
fn static_stages_end_stable_or_unstable_or_unknown() {
    let end = |verdict, negative| vec![StageStability { stage: 1, verdict, negative }];
    let [stable, unstable] = [end(StabilityVerdict::Stable, Some(0)), end(StabilityVerdict::Unstable, Some(1))];
    let along = "[[stage]]\nkind = \"static\"\nsteps = 4\ncontrol = \"arc_length\"\n";
    // About the soft axis alone it buckles below 98.7.
    for stage in [STATIC, along] {
        assert_eq!(verdicts(&column(0.9 * CRITICAL, stage)), stable);
        assert_eq!(verdicts(&column(1.1 * CRITICAL, stage)), unstable);
    }
    let linear = column_with("large_rotations = false", 1.1 * CRITICAL, STATIC);
    assert_eq!(verdicts(&linear), stable, "linear theory knows no buckling");
    // A moment fixed in space: the tangent is not symmetric, pivots say nothing, and vibrations tell where there are masses.
    let twisted = column(1.0, &format!("[[load]]\nat = \"top\"\nmoment = [1, 1, 1]\n{STATIC}"));
    assert_eq!(verdicts(&twisted), end(StabilityVerdict::Stable, None));
    let massless = twisted.replace("rhoA = 1\nrhoJ = [2e-3, 1e-3, 1e-3]\n", "rhoA = 0\n");
    assert_eq!(verdicts(&massless), end(StabilityVerdict::Unknown, None));
}

/// About its soft axis a strip buckles first, out of the plane that it is loaded in.
#[test]
fn a_planar_stage_that_is_unstable_aside_ends_unstable() {
    let bent = format!("[[load]]\nat = \"top\"\nforce = [0.01, 0, 0]\n{STATIC}");
    for planar in [true, false] {
        let found = verdicts(&column_with(&format!("planar = {planar}"), 1.1 * CRITICAL, &bent));
        let expected = StageStability { stage: 1, verdict: StabilityVerdict::Unstable, negative: Some(1) };
        assert_eq!(found, [expected], "planar = {planar}");
    }
}

#[test]
fn only_static_stages_have_a_verdict() {
    let dynamic = "[[stage]]\nkind = \"dynamic\"\nend = 0.01\nstep = 0.005\n";
    let modal = "[[stage]]\nkind = \"modal\"\nmodes = 1\n";
    let found = verdicts(&column(1.0, &format!("{STATIC}{modal}{STATIC}{dynamic}")));
    assert_eq!(found.iter().map(|found| found.stage).collect::<Vec<_>>(), [1, 3]);
}

/// On the falling branch of Lee's frame, reached by a detour of load control that ends there.
#[test]
fn a_detour_that_ends_by_until_tells_the_stability_of_its_end() {
    let deck = file("decks/hard/s01_lee_plain_static.toml");
    let (scene, _) = deck.split_once("[[stage]]").unwrap();
    let stage = "[[stage]]\nkind = \"static\"\nsteps = 4\nuntil = { column = \"loaded.uy\", below = -60 }\n";
    let simulation = simulate(&format!("{scene}{stage}"));
    let findings = &simulation.counters.findings;
    assert_eq!(
        findings.stability,
        [StageStability { stage: 1, verdict: StabilityVerdict::Unstable, negative: Some(1) }]
    );
    assert_eq!(findings.warnings.last().map(|warning| warning.kind), Some(WarningKind::Unstable));
}

/// A point on another one: a warning about the deck, which puts no answer in doubt.
#[test]
fn warnings_about_a_deck_stand_in_its_record_without_a_moment() {
    let folder = Folder::new("deck_warnings");
    let twins = "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\nc = [1, 0, 0]\nd = [2, 0, 0]\n[section.s]\nEA = 1e3\nGA = 1e3\nGJ = 10\nEI = 10\n\
         [[beam]]\nname = \"left\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 1\n\
         [[beam]]\nname = \"right\"\nsection = \"s\"\nthrough = [\"c\", \"d\"]\nelements = 1\n\
         [[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"d\"\nfix = \"all\"\n\
         [[load]]\nat = \"b\"\nforce = [0, 0, 0.1]\n[[stage]]\nkind = \"static\"\nsteps = 1\n\
         [[expect]]\nwarns = \"equal_places\"\n[[expect]]\nwarns = false\n";
    folder.write("twins.toml", twins);
    let ran = folder.beamsim(&["run", "twins.toml"]);
    assert!(String::from_utf8_lossy(&ran.stderr).starts_with("warning[equal_places]: "));
    let record: Value = serde_json::from_slice(&fs::read(folder.0.join("results/twins/run.json")).unwrap()).unwrap();
    let [warning] = &record["warnings"].as_array().unwrap()[..] else { panic!("{record}") };
    assert_eq!((&warning["name"], &warning["about"]), (&Value::from("equal_places"), &Value::from("deck")));
    assert!(["stage", "time", "load"].iter().all(|key| warning[key].is_null()));
    assert_eq!(status(&folder.beamsim(&["verify", "twins.toml"])), 0);
    let checked = folder.beamsim(&["check", "twins.toml", "--json"]);
    let told: Value = serde_json::from_slice(&checked.stdout).unwrap();
    assert_eq!(told["warnings"], record["warnings"]);
}

/// A velocity of all nodes, and the spin of one of two, or of both: the second table replaces the first one.
#[test]
fn initial_velocities_that_reach_no_node_are_told() {
    let scene = |spinning: &str| {
        format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e3\nGA = 1e3\nGJ = 10\nEI = 10\nrhoA = 1\n\
             [[beam]]\nname = \"rod\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 1\norder = 1\n\
             [[initial]]\nvelocity = [1, 0, 0]\n[[initial]]\n{spinning}\nspin = [0, 0, 0.1]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.01\n"
        )
    };
    let told = |spinning: &str| -> usize {
        let found = warnings(&scene(spinning));
        found.iter().filter(|message| message.contains("all nodes of this table have a later table")).count()
    };
    assert_eq!([told("at = \"a\""), told("beam = \"rod\""), told("")], [0, 1, 1]);
}

/// A stiff rod that a motor turns under gravity, M = rhoA L^3/3 alpha - rhoA g L^2/2 cos(angle), in three units of length: where
/// stiff parts ring, its moment is wrong and a warning says so.
#[test]
fn moments_that_ring_are_reported() {
    for (scheme, steps, rings) in
        [("newmark", 100, true), ("newmark", 400, false), ("hht", 400, false), ("generalized_alpha", 400, false)]
    {
        for unit in [1e-3, 1.0, 1e3] {
            let (stiff, turn) = (1e8 * unit, 3.6 * PI);
            let bending = 0.01 * stiff * unit * unit;
            let deck = format!(
                "gravity = [0, 0, {g}]\n[point]\na = [0, 0, 0]\nb = [{unit}, 0, 0]\n\
                 [section.s]\nEA = {stiff}\nGA = {stiff}\nGJ = {bending}\nEI = {bending}\nrhoA = {mass}\n\
                 [[beam]]\nname = \"c\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\norder = 2\n\
                 [[joint]]\nkind = \"revolute\"\nat = \"a\"\nbeams = [\"c\"]\naxis = [0, 1, 0]\nangle = {turn}\n\
                 history = {{ name = \"h\", stages = [2] }}\n[history.h]\ntimes = [0, 1]\nvalues = [0, 1]\nsmooth = true\n\
                 [[stage]]\nkind = \"static\"\nsteps = 1\n\
                 [[stage]]\nkind = \"dynamic\"\nend = 1\nstep = {step}\nscheme = \"{scheme}\"\n\
                 [output]\nnodes = [\"a\"]\ncolumns = [\"reaction\"]\n",
                g = -9.81 * unit,
                mass = 3.0 / unit,
                step = 1.0 / f64::from(steps)
            );
            let ran = simulate(&deck);
            // Before the motor starts there are the unloaded row and that of the static stage.
            let moments = (-1..).map(|step| f64::from(step) / f64::from(steps)).zip(ran.column("a.my")).skip(2);
            let exact = |t: f64| {
                let angle = turn * t.powi(3) * (10.0 - 15.0 * t + 6.0 * t * t);
                let acceleration = turn * 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t);
                unit * unit * (acceleration - 3.0 * 9.81 / 2.0 * angle.cos())
            };
            let largest = (0..=100).map(|k| exact(f64::from(k) / 100.0).abs()).fold(0.0, f64::max);
            let off = moments.map(|(t, moment)| (moment - exact(t)).abs()).fold(0.0, f64::max) / largest;
            assert!(if rings { off > 0.2 } else { off < 0.1 }, "{scheme}, {steps} steps: {off}\n{deck}");
            assert_eq!(reports_ringing(&ran), rings, "{scheme}, {steps} steps: {off}\n{deck}");
        }
    }
}

fn reports_ringing(simulation: &Simulation) -> bool {
    simulation.counters.findings.warnings.iter().any(|warning| warning.kind == WarningKind::Ringing)
}

/// A body on a base that moves to and fro with five steps a period, one that turns about its pivot, balanced or not, in five
/// steps a turn: reactions are exact, or zero.
#[test]
fn forces_of_motions_that_are_prescribed_are_not_reported() {
    let body = |offset: f64| {
        format!(
            "[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 2\ninertia = [1, 2, 3]\noffset = [{offset}, 0, 0]\n\
             [output]\ncolumns = [\"reaction\", \"a\"]\n"
        )
    };
    let shaken = "[[support]]\nat = \"a\"\nfix = [\"ux\", \"uz\", \"rx\", \"ry\", \"rz\"]\n[[motion]]\nat = \"a\"\nuy = 1\nhistory = \"h\"\n\
                  [history.h]\nexpr = \"1 - cos(0.4*pi*t)\"\n";
    let turned = "[[joint]]\nkind = \"revolute\"\nnodes = [\"a\"]\nat = \"a\"\naxis = [0.6, 0, 0.8]\nangle = 1\nhistory = \"h\"\n\
                  [history.h]\nexpr = \"0.4*pi*t\"\n";
    for scheme in ["newmark", "hht", "lie_generalized_alpha"] {
        for (offset, motion) in [(0.0, shaken), (0.0, turned), (0.1, turned)] {
            let stage = format!("[[stage]]\nkind = \"dynamic\"\nend = 60\nstep = 1\nscheme = \"{scheme}\"\n");
            let deck = format!("{}{motion}{stage}", body(offset));
            assert!(!reports_ringing(&simulate(&deck)), "{deck}");
        }
    }
}

/// Two bodies under a pulse, given as a formula: over the time of the run, and over that of the second stage.
#[test]
fn pulses_between_steps_are_told_by_the_clock_of_their_stages() {
    let body = |name: &str| format!("[[body]]\nat = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\n");
    let scene = format!(
        "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n{}{}[history.h]\nexpr = \"exp(-((t - 0.505)/0.002)^2)\"\n",
        body("a"),
        body("b")
    );
    let load = |at: &str, history: &str| format!("[[load]]\nat = \"{at}\"\nforce = [1, 0, 0]\nhistory = {history}\n");
    let stages = |step: f64| {
        [1.0, 2.0].map(|end| format!("[[stage]]\nkind = \"dynamic\"\nend = {end}\nstep = {step}\n")).concat()
    };
    let of_run = load("a", "\"h\"");
    let of_stage = load("b", "{ name = \"h\", stages = [2] }");
    let missed = |loads: &str, step: f64| -> Vec<String> {
        let all = warnings(&format!("{scene}{loads}{}", stages(step)));
        all.into_iter().filter(|message| message.contains("% of the history `h`")).collect()
    };
    let [first, second] = [&of_run, &of_stage].map(|loads| missed(loads, 0.01));
    assert!(first.len() == 1 && first[0].contains("of stage 1"), "{first:?}");
    assert!(second.len() == 1 && second[0].contains("of stage 2"), "{second:?}");
    let both = missed(&(of_run.clone() + &of_stage), 0.01);
    assert!(both.len() == 1 && both[0].contains("likewise another load"), "{both:?}");
    assert!(missed(&(of_run + &of_stage), 0.001).is_empty());
}

/// Also a formula, and a motion.
#[test]
fn peaks_between_load_levels_are_told() {
    let scene = |history: &str, steps: usize| {
        let driven = "[[motion]]\nat = \"top\"\nuz = -0.01\nhistory = \"h\"\n";
        let stage = format!("[[stage]]\nkind = \"static\"\nsteps = {steps}\n");
        column(0.0, &format!("{driven}[history.h]\n{history}\n{stage}"))
    };
    let table = "times = [0, 0.25, 0.5, 1]\nvalues = [0, 1, 0, 0]";
    for (history, steps, is_missed) in [
        (table, 2, true),
        (table, 4, false),
        ("expr = \"sin(8*pi*t)\"", 4, true),
        ("expr = \"sin(8*pi*t)\"", 64, false),
        ("expr = \"t^3\"", 1, false),
    ] {
        let all = warnings(&scene(history, steps));
        let told = all.iter().any(|message| message.contains("miss a peak of the history `h` of this motion"));
        assert_eq!(told, is_missed, "{history}, {steps} levels: {all:?}");
    }
}

#[test]
fn expected_warnings_are_judged() {
    let folder = Folder::new("expected_warnings");
    for (load, wanted, holds) in [
        (0.9 * CRITICAL, "\"unstable\"", false),
        (0.9 * CRITICAL, "false", true),
        (1.1 * CRITICAL, "\"unstable\"", true),
        (1.1 * CRITICAL, "\"limit_point\"", false),
        (1.1 * CRITICAL, "false", false),
    ] {
        folder.write("deck.toml", &column(load, &format!("{STATIC}[[expect]]\nwarns = {wanted}\n")));
        let verified = folder.beamsim(&["verify", "deck.toml"]);
        assert_eq!(status(&verified), i32::from(!holds), "{wanted} under {load}: {}", last_line(&verified));
    }
    // What came is told by name.
    let verified = folder.beamsim(&["verify", "deck.toml"]);
    assert!(String::from_utf8_lossy(&verified.stdout).contains("branch_point, unstable"));
}

#[test]
fn a_sweep_tells_the_warnings_of_its_points() {
    let folder = Folder::new("sweep_warnings");
    folder.write(
        "deck.toml",
        &format!("[param]\nx = 0\n{}[[expect]]\ncolumn = \"top.uz\"\nbelow = 1\n", column(1.1 * CRITICAL, STATIC)),
    );
    let swept = folder.beamsim(&["sweep", "deck.toml", "--vary", "section.s.GJ=10,11", "--output", "top.uz"]);
    assert_eq!(status(&swept), 0, "{}", last_line(&swept));
    let table = fs::read_to_string(folder.0.join("results/deck/sweep.csv")).unwrap();
    assert_eq!(table.matches("warning[branch_point]: ").count(), 2, "{table}");
    assert_eq!(table.matches("; also unstable").count(), 2, "{table}");
}

/// Under a scheme that restores the rates of joints after each step, rigid bodies need no dissipation; beams do.
#[test]
fn lobatto_is_warned_of_where_beams_have_joints_with_multipliers() {
    let decks = [("decks/joints/body_double_pendulum.toml", false), ("decks/joints/four_bar_revolute.toml", true)];
    for (deck, is_told) in decks {
        let text = beamsim::deck::apply(&file(deck), &["stage.0.scheme=\"lobatto\"".into()]).unwrap();
        let (_, diagnostics) = beamsim::scene::from_text(&text).unwrap_or_else(|e| panic!("{e:?}"));
        assert_eq!(format!("{diagnostics:?}").contains("UndampedMultipliers"), is_told, "{deck}: {diagnostics:?}");
    }
}

/// Sections that are meant to be rigid in some direction: from EA = 1e13 EI/L^2 on, whatever the unit of length.
#[test]
fn beams_too_stiff_to_compute_are_told() {
    for length in [1e-3_f64, 1.0, 1e3] {
        let told = |ratio: f64, key: &str| {
            let [stiff, other] = [ratio / length.powi(2), 1e6 / length.powi(2)];
            let (ea, ga) = if key == "EA" { (stiff, other) } else { (other, stiff) };
            let deck = format!(
                "[point]\na = [0, 0, 0]\nb = [0, 0, {length:?}]\n[section.s]\nEA = {ea:?}\nGA = {ga:?}\nGJ = 1\nEI = [1, 2]\n[[beam]]\n\
                 name = \"c\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 2\n[[support]]\nat = \"a\"\nfix = \"all\"\n\
                 [[load]]\nat = \"b\"\nforce = [1, 0, 0]\n[[stage]]\nkind = \"static\"\nsteps = 1\n"
            );
            warnings(&deck).iter().any(|message| message.contains("resists stretching or shear"))
        };
        for key in ["EA", "GA"] {
            assert!(!told(5e12, key) && told(2e13, key), "{length} {key}");
        }
    }
}

/// Bodies that motors or springs of joints hold, in random directions: no stress is in them, and none is needed.
#[test]
fn joints_hold_bodies_in_later_stages() {
    let mut random = Random::new(94);
    let held = [
        "kind = \"revolute\"\nangle = 1",
        "kind = \"prismatic\"\nstiffness = 10",
        "kind = \"revolute\"\nstiffness = 3",
    ];
    for case in 0..30 {
        let [axis, aside] = random.axes();
        let place = random.cube(1.0);
        let deck = format!(
            "[point]\nA = {}\n[[body]]\nat = \"A\"\nmass = 2\ninertia = [0.1, 0.2, 0.25]\n[[joint]]\nnodes = [\"A\"]\nat = {}\n\
             axis = {}\n{}\n[[load]]\nat = \"A\"\nforce = {}\n{STATIC}{STATIC}",
            list(place + aside * 0.5),
            list(place),
            list(axis),
            held[case % 3],
            list(random.cube(0.1))
        );
        let told: Vec<_> = simulate(&deck).counters.findings.warnings.iter().map(|warning| warning.kind).collect();
        assert!(!told.contains(&WarningKind::HeldByStress), "{case}: {told:?}\n{deck}");
    }
}

/// A pendulum on a hinge comes to rest under its weight, about any axis.
#[test]
fn weights_hold_pendulums() {
    let mut random = Random::new(96);
    let units = Vec3::UNIT;
    for case in 0..20 {
        let [down, axis] = if case < 6 { [-units[case % 3], units[(case + 1 + case / 3) % 3]] } else { random.axes() };
        let away = if case % 2 == 0 { Vec3::ZERO } else { down.cross(axis) * random.range(-0.4, 0.4) };
        let deck = format!(
            "gravity = {}\n[point]\nA = {}\n[[body]]\nat = \"A\"\nmass = 1\ninertia = [0.1, 0.2, 0.25]\n\
             [[joint]]\nkind = \"revolute\"\nnodes = [\"A\"]\nat = [0, 0, 0]\naxis = {}\n{STATIC}{STATIC}\
             [output]\nnodes = [\"A\"]\ncolumns = [\"x\"]\n",
            list(down * 10.0),
            list(down * 0.5 + away),
            list(axis)
        );
        let simulation = simulate(&deck);
        let exact = down * (0.25 + away.squared()).sqrt();
        assert!((Vec3(simulation.vector("A.")) - exact).norm() < 1e-6, "{case}: {deck}");
        let told: Vec<_> = simulation.counters.findings.warnings.iter().map(|warning| warning.kind).collect();
        assert!(told.contains(&WarningKind::CameToRest), "{case}: {told:?}");
    }
}

/// A body on a ball joint comes to rest below it and may still turn about the vertical, which is named, however it has
/// turned on its way.
#[test]
fn free_rotations_are_named_about_their_axis_in_space() {
    let mut random = Random::new(95);
    for case in 0..20 {
        let [down, aside] = random.axes();
        let angle = random.range(0.3, 2.8);
        let deck = format!(
            "gravity = {}\n[point]\nB = {}\n[[body]]\nat = \"B\"\nmass = 1\ninertia = [0.1, 0.2, 0.25]\n\
             [[joint]]\nkind = \"spherical\"\nnodes = [\"B\"]\nat = [0, 0, 0]\n[[stage]]\nkind = \"static\"\nsteps = 1\n",
            list(down * 10.0),
            list((down * angle.cos() + aside * angle.sin()) * 0.5)
        );
        let failure = attempt(&deck).result.expect_err(&deck);
        let Failure::Singular { place: Some(place), .. } = failure else { panic!("{failure}") };
        let along = place.direction.dot(down).abs();
        println!("{case}: {along}");
        assert!(along > 0.999, "{case}: {place}, down {down:?}");
    }
}

/// Curvatures of two-node elements with total vectors depend on the orientation; those of higher orders hardly.
#[test]
fn only_two_node_elements_depend_on_the_frame() {
    let told = |order: usize, interpolation: &str| {
        let run = simulate(&format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1\nEI = 1\n\
             [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 3\norder = {order}\n\
             interpolation = \"{interpolation}\"\n[[support]]\nat = \"a\"\nfix = \"all\"\n\
             [[load]]\nat = \"b\"\nforce = [0, 1, 2]\nmoment = [1, 0, 0]\n[output]\nnodes = [\"b\"]\n\
             [[stage]]\nkind = \"static\"\nsteps = 4\n"
        ));
        run.counters.findings.warnings.iter().any(|warning| warning.kind == WarningKind::FrameDependence)
    };
    assert_eq!([1, 2, 3].map(|order| told(order, "total")), [true, false, false]);
    assert!(!told(1, "relative"));
}

/// One level past the critical speed of a frame ends in a state that nothing holds about the axis: more levels find the
/// one before.
#[test]
fn frames_past_a_critical_speed_need_more_levels() {
    let deck = |steps: usize| {
        format!(
            "gravity = [0, 0, -10]\n[point]\no = [0, 0, 0]\np = [0, 0, -1]\n[[body]]\nat = \"p\"\nmass = 2\n\
             inertia = [0.3, 0.3, 0.2]\n[[joint]]\nkind = \"spherical\"\nnodes = [\"p\"]\nat = \"o\"\n\
             [[spring]]\nat = \"p\"\nstiffness = [0, 0, 0, 0, 0, 1]\n\
             [[stage]]\nkind = \"static\"\nsteps = {steps}\nframe = {{ spin = [0, 0, 10] }}\n[output]\nnodes = [\"p\"]\n"
        )
    };
    let hint = attempt(&deck(3)).hint.expect("it fails");
    assert!(hint.contains("critical speed, use more than 3 `steps`"), "{hint}");
    assert!(attempt(&deck(20)).result.is_ok());
}
