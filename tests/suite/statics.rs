//! The policy of static stages: it comes to the right branch whatever the number of load levels, and says what it did.

use crate::random::Random;
use crate::scenes::{attempt, list, simulate};
use beamsim_core::run::{EventKind, Failure};
use std::f64::consts::TAU;
use std::fs;

/// Lee's frame (two-node mesh of twenty elements a leg) under P = 2, beyond its first limit.
fn lee(stage: &str) -> String {
    format!(
        r#"
[point]
foot = [0, 0, 0]
corner = [0, 120, 0]
loaded = [24, 120, 0]
end = [120, 120, 0]
[section.leg]
EA = 4320
GA = 432000
GJ = 144000
EI = [144000, 1440]
[[beam]]
name = "column"
section = "leg"
through = ["foot", "corner"]
elements = 10
order = 2
[[beam]]
name = "girder"
section = "leg"
through = ["corner", "loaded", "end"]
elements = [2, 8]
order = 2
[[support]]
at = "foot"
fix = ["ux", "uy", "uz", "rx", "ry"]
[[support]]
at = "end"
fix = ["ux", "uy", "uz", "rx", "ry"]
[[load]]
at = "loaded"
force = [0, -2, 0]
[[stage]]
kind = "static"
{stage}
[output]
nodes = ["loaded"]
"#
    )
}

/// The only stable equilibrium in the plane; -92.7277 is that of the continuous frame, integrated independently.
#[test]
fn a_limit_point_is_gone_around_with_any_number_of_levels() {
    for steps in [1_u32, 2, 3, 7, 20] {
        let simulation = simulate(&lee(&format!("steps = {steps}")));
        let uy = simulation.end("loaded.uy");
        assert!((uy + 92.7277).abs() < 2e-3, "{steps} levels: {uy}");
        let limits: Vec<f64> = simulation
            .counters
            .findings
            .events
            .iter()
            .filter(|event| event.kind == EventKind::Limit)
            .map(|event| event.at.load)
            .collect();
        assert_eq!(limits.len(), 2, "{steps} levels: {limits:?}");
        assert!((limits[0] - 0.9279).abs() < 2e-3 && (limits[1] + 0.4707).abs() < 4e-3, "{limits:?}");
        let loads = simulation.column("load");
        assert_eq!(loads.last(), Some(&1.0));
        assert_eq!(loads.len() as u64, simulation.counters.steps + 1);
        for level in (1..=steps).map(|k| f64::from(k) / f64::from(steps)) {
            let rows = loads.iter().filter(|&&load| load == level).count();
            assert!(rows == 1, "{steps} levels: {rows} rows at {level}");
        }
        assert!(simulation.rows.windows(2).all(|pair| pair[0] != pair[1]), "a row stands twice");
    }
}

#[test]
fn who_forbids_smaller_steps_gets_the_failure_of_load_control() {
    let failure = attempt(&lee("steps = 4\nadaptive = false")).result.expect_err("P = 2 is beyond the limit");
    assert!(matches!(failure, Failure::NotConverged { .. }), "{failure}");
}

/// A stiff arm of length L = 1 on a hinge, held by a spring without length of its own to a point at a = 2 on its axis: the
/// moment k a L sin(angle) never exceeds 20, and the path goes round and round.
#[test]
fn a_load_that_is_never_carried_ends_in_words_about_it() {
    let text = r#"
[point]
hub = [0, 0, 0]
tip = [1, 0, 0]
anchor = [2, 0, 0]
[section.s]
EA = 1e6
GA = 1e6
GJ = 1e6
EI = 1e6
[[beam]]
name = "arm"
section = "s"
through = ["hub", "tip"]
elements = 2
[[joint]]
kind = "revolute"
nodes = ["hub"]
axis = [0, 0, 1]
[[body]]
at = "anchor"
mass = 1
[[support]]
at = "anchor"
fix = "all"
[[spring]]
between = ["tip", "anchor"]
stiffness = 10
length = 0
[[load]]
at = "tip"
moment = [0, 0, 30]
[[stage]]
kind = "static"
steps = 10
"#;
    let simulation = attempt(text);
    let failure = simulation.result.expect_err("20 is the most it carries");
    let Failure::LimitPoint { at, goal, increments, .. } = &failure else { panic!("{failure}") };
    assert!((at.load - 2.0 / 3.0).abs() < 1e-3 && *goal == 0.7 && *increments > 100, "{failure}");
    assert!(simulation.hint.is_some_and(|hint| hint.contains("does not reach the load")));
    let most = simulation.rows.iter().map(|row| row[0]).fold(0.0, f64::max);
    assert!((most - 2.0 / 3.0).abs() < 1e-4, "the rows go to the limit: {most}");
}

/// A history of the load factor means nothing where that goes back: load control tells its own failure.
#[test]
fn histories_keep_load_control() {
    let text = lee("steps = 5").replace("force = [0, -2, 0]", "force = [0, -2, 0]\nhistory = \"up\"")
        + "[history.up]\ntimes = [0, 1]\nvalues = [0, 1]\n";
    let simulation = attempt(&text);
    let failure = simulation.result.expect_err("load control ends at the limit point");
    assert!(matches!(failure, Failure::NotConverged { .. }), "{failure}");
    assert!(simulation.rows.iter().all(|row| row[0] >= 0.0));
}

/// A straight shaft twisted by its end: its displacements are round-off, in whatever direction it lies.
#[test]
fn round_off_is_no_jump() {
    let shaft = |end: &str, axis: &str| {
        simulate(&format!(
            "[point]\na = [0, 0, 0]\nb = {end}\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 100\nEI = 100\n\
             [[beam]]\nname = \"m\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 20\n\
             [[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"b\"\nfix = [\"uy\", \"uz\"]\naxes = [{axis}, [0, 0, 1]]\n\
             [[motion]]\nat = \"b\"\nrotate = {axis}\nangle = \"4*pi\"\n[[stage]]\nkind = \"static\"\nsteps = 16\n"
        ))
        .counters
    };
    let along = shaft("[10, 0, 0]", "[1, 0, 0]");
    let skew = shaft("[6, 8, 0]", "[0.6, 0.8, 0]");
    assert_eq!(
        (along.steps, along.cutbacks, along.findings.events.len()),
        (skew.steps, skew.cutbacks, skew.findings.events.len())
    );
}

/// A pinned column, 10 pi^2 its critical load, pressed in the first stage by `force` and pushed `aside` at its middle; `stage` ends the
/// table of that static stage.
fn pinned_column(order: usize, force: &str, aside: &str, stage: &str) -> String {
    format!(
        "[point]\nfoot = [0, 0, 0]\nmiddle = [0, 0, 0.5]\ntop = [0, 0, 1]\n\
         [section.s]\nEA = 1e5\nGA = 5e4\nGJ = 100\nEI = [1000, 10]\n\
         [[beam]]\nname = \"c\"\nsection = \"s\"\nthrough = [\"foot\", \"middle\", \"top\"]\nelements = 4\norder = {order}\n\
         [[support]]\nat = \"foot\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"rz\"]\n\
         [[support]]\nat = \"top\"\nfix = [\"ux\", \"uy\", \"rx\", \"rz\"]\n\
         [[load]]\nat = \"top\"\nforce = [0, 0, \"-{force}\"]\nstages = [1]\n[[load]]\nat = \"middle\"\nforce = [\"{aside}\", 0, 0]\n\
         [[stage]]\nkind = \"static\"\n{stage}"
    )
}

/// The branch of the other side is as stable, and no pivot tells.
#[test]
fn an_imperfect_column_bends_to_the_side_of_its_imperfection() {
    for steps in [3, 10, 30, 50] {
        let column = simulate(&pinned_column(3, "1.5*10*pi^2", "0.015*pi^2", &format!("steps = {steps}\n")));
        let aside = column.end("middle.ux");
        assert!((aside - 0.39448).abs() < 1e-4, "{steps} levels: {aside}");
    }
}

/// A buckled column from which the load is taken again: its path leads past where it buckled, next to the mirrored branch.
#[test]
fn arc_length_stays_on_its_branch() {
    for steps in [1, 10, 40] {
        let path =
            format!("[[stage]]\nkind = \"static\"\ncontrol = \"arc_length\"\nsteps = {steps}\nmax_steps = 300\n");
        let column = simulate(&pinned_column(2, "15*pi^2", "0.01*pi^2", &format!("steps = 10\n{path}")));
        // F L^3/48 EI, and the shear of F L/4 GA.
        let force = 0.01 * std::f64::consts::PI.powi(2);
        let exact = force / 480.0 + force / (4.0 * 5e4);
        let aside = column.end("middle.ux");
        assert!(
            (aside - exact).abs() < 1e-3 * exact && column.end("load") == 1.0,
            "{steps} steps: {aside} for {exact}"
        );
    }
}

/// A strip with a force of 5 % aside, shortened far beyond what it buckles at: no load turns, and no branch begins.
#[test]
fn an_imperfect_path_has_no_branches() {
    for steps in [1, 20, 200] {
        let strip = simulate(&format!(
            "[point]\nleft = [0, 0, 0]\nmiddle = [0.5, 0, 0]\nright = [1, 0, 0]\n\
             [section.s]\nEA = 1e5\nGA = 5e4\nGJ = 10\nEI = [10, 1000]\n\
             [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"left\", \"middle\", \"right\"]\nelements = 12\norder = 2\n\
             [[support]]\nat = \"left\"\nfix = \"all\"\n[[support]]\nat = \"right\"\nfix = [\"uy\", \"uz\", \"rx\", \"ry\", \"rz\"]\n\
             [[load]]\nat = \"middle\"\nforce = [0, 0, 20]\n[[motion]]\nat = \"right\"\nux = -0.6\n\
             [[stage]]\nkind = \"static\"\ncontrol = \"arc_length\"\nsteps = {steps}\nmax_steps = 1000\n"
        ));
        let aside = strip.end("middle.uz");
        assert!(
            (aside - 0.389_643_66).abs() < 1e-7 && strip.counters.findings.events.is_empty(),
            "{steps} steps: {aside}"
        );
    }
}

/// A hinged arch at five times its limit load, with a force of 1 % aside: the detour leads to the branch hanging through.
#[test]
fn a_detour_passes_bifurcations_nearby() {
    for steps in [1, 4, 20] {
        let arch = simulate(&format!(
            "[param]\nR = 5\na = \"20*deg\"\n[point]\nleft = [\"-R*sin(a)\", 0, \"R*cos(a)\"]\ncrown = [0, 0, \"R\"]\nright = [\"R*sin(a)\", 0, \"R*cos(a)\"]\n\
             [section.s]\nEA = 2e4\nGA = 1e4\nGJ = 10\nEI = 10\n\
             [[beam]]\nname = \"b\"\nsection = \"s\"\narc = [\"left\", \"crown\", \"right\"]\nelements = 12\norder = 2\n\
             [[support]]\nat = \"left\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"rz\"]\n[[support]]\nat = \"right\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\", \"rz\"]\n\
             [[load]]\nat = \"crown\"\nforce = [0.5, 0, -60]\n[[stage]]\nkind = \"static\"\nsteps = {steps}\n"
        ));
        let crown = arch.end("crown.uz");
        assert!((crown + 0.681_38).abs() < 1e-5 && arch.counters.steps < 100, "{steps} levels: {crown}");
    }
}

/// A pendulum stopped in its swing: nothing grows with the load factor, and the first step goes where gravity leads.
#[test]
fn a_static_stage_may_begin_out_of_balance() {
    let hanging = simulate(
        "gravity = [0, 0, -10]\n[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1\nEI = 1\nrhoA = 1\n\
         [[beam]]\nname = \"m\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 8\n[[support]]\nat = \"a\"\nfix = \"all\"\n\
         [[stage]]\nkind = \"dynamic\"\nend = 0.5\nstep = 0.01\n[[stage]]\nkind = \"static\"\nsteps = 1\n",
    );
    let statics = simulate(
        "gravity = [0, 0, -10]\n[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1\nEI = 1\nrhoA = 1\n\
         [[beam]]\nname = \"m\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 8\n[[support]]\nat = \"a\"\nfix = \"all\"\n\
         [[stage]]\nkind = \"static\"\nsteps = 4\n",
    );
    assert!((hanging.end("b.uz") - statics.end("b.uz")).abs() < 1e-8);
}

/// Turned back within one level, no element turns further than it did: smaller steps tell.
#[test]
fn a_reversal_is_no_leap_over_pi() {
    for steps in [2, 3, 8] {
        let text = format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 10\nEI = 10\n\
             [[beam]]\nname = \"m\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 2\n[[support]]\nat = \"a\"\nfix = \"all\"\n\
             [[load]]\nat = \"b\"\nmoment = [0, 0, 36]\nhistory = \"h\"\n[history.h]\ntimes = [0, 0.5, 1]\nvalues = [0, 1, -1]\n\
             [[stage]]\nkind = \"static\"\nsteps = {steps}\n"
        );
        // Two elements of half a length that turn by 1.8 against each other, the first by 0.9.
        let exact = -0.5 * (0.9_f64.sin() + 2.7_f64.sin());
        let uy = simulate(&text).end("b.uy");
        assert!((uy - exact).abs() < 1e-4, "{steps}: {uy} for {exact}");
    }
}

/// A cantilever with a kink, slender enough for Newton's method to wander.
fn kinked(middle: &str, tip: &str, beam: &str, acts: &str, steps: u32) -> String {
    format!(
        r#"
[point]
a = [0, 0, 0]
m = {middle}
t = {tip}
[section.s]
EA = 100000
GA = 10000
GJ = 40
EI = 5
[[beam]]
name = "b"
section = "s"
through = ["a", "m", "t"]
{beam}
{acts}
[[stage]]
kind = "static"
steps = {steps}
[output]
nodes = ["t"]
columns = ["u", "rc"]
"#
    )
}

/// Corrections lead round and round before they find the balance: those turns are none, neither of a free node nor of a spring that they
/// would wind up. In one level the tip turned by 64, 81, -21, -114 and 72.
#[test]
fn turns_that_only_an_iteration_makes_are_not_counted() {
    let clamp = "[[support]]\nat = \"a\"\nfix = \"all\"\n";
    let turned = "[[support]]\nat = \"a\"\nfix = \"pin\"\n[[motion]]\nat = \"a\"\nrotate = [0, 1, 0]\nangle = 4.004705264736968\n";
    let pulled = "[[load]]\nat = \"t\"\nforce = [-4.006517349824166, 0, -4.507699414161829]\n";
    let spring = "[[spring]]\nat = \"t\"\nstiffness = [0, 0, 0, 0.05, 0.05, 0.05]\n";
    let along = |force: &str| format!("{clamp}[[load]]\nalong = \"b\"\nforce = {force}\n");
    let following = "[[load]]\nat = \"t\"\nforce = [-47.223, 0, 18.151]\nframe = \"body\"\n";
    let dead = "[[load]]\nat = \"t\"\nforce = [-18.30774777872953, 0, 1.6755443038253581]\n";
    let scenes = [
        ("[0.719, 0, 0]", "[1.813, 0, 1.2]", "elements = 2", along("[15.699, 0, -17.217]") + spring),
        (
            "[1.1257941185301423, 0, 0]",
            "[1.5837411923261038, 0, 1.2]",
            "elements = 2\ninterpolation = \"total\"",
            along("[8.794413597688731, 0, 45.95237977177054]") + spring,
        ),
        ("[1.038, 0, 0.7]", "[1.064, 0, 1.2]", "elements = 1", along("[11.079, 0, 34.067]") + following),
        (
            "[0.8725941437251136, 0, 0]",
            "[1.050695481461016, 0, 1.2]",
            "elements = 1\norder = 2",
            along("[18.762288677159496, 0, 8.988762391513092]") + dead,
        ),
        (
            "[1.3366282554272808, 0, 0.7]",
            "[1.9203250055009653, 0, 1.2]",
            "elements = 2\norder = 2\ninterpolation = \"total\"",
            turned.to_string() + pulled,
        ),
    ];
    for (number, (middle, tip, beam, acts)) in scenes.iter().enumerate() {
        let end = |steps: u32| {
            let simulation = simulate(&kinked(middle, tip, beam, acts, steps));
            ["t.ux", "t.uz", "t.ry"].map(|column| simulation.end(column))
        };
        let fine = end(100);
        for steps in [1, 2, 4] {
            let coarse = end(steps);
            let apart = coarse.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-6, "scene {number}, {steps} levels: {coarse:?}, 100 levels: {fine:?}");
        }
    }
}

/// A stiff half ring turned inside out by a line moment: residuals are round-off of its tension stiffness, which arc length
/// accepts like load levels. sin(phi) = m R^2/EI.
#[test]
fn arc_length_accepts_residuals_of_round_off() {
    let run = simulate(
        "[section.s]\nEA = 1e6\nGA = 4e5\nGJ = 1\nEI = [1, 1]\n[point]\na = [0.08, 0, 0]\nb = [-0.08, 0, 0]\n[[beam]]\nname = \"k\"\n\
         section = \"s\"\narc = [\"a\", [0, 0.08, 0], \"b\"]\nelements = 64\norder = 3\n[[support]]\nat = \"a\"\nfix = [\"uy\", \"uz\", \"rx\", \"rz\"]\n\
         [[support]]\nat = \"b\"\nfix = [\"uy\", \"uz\", \"rx\", \"rz\"]\n[[support]]\nat = \"k@0.5\"\nfix = [\"ux\"]\n\
         [[load]]\nalong = \"k\"\nmoment = [1, 0, 0]\nframe = \"section\"\n[[stage]]\nkind = \"static\"\ncontrol = \"arc_length\"\nsteps = 10\n\
         [output]\nnodes = [\"a\"]\ncolumns = [\"r\"]\n",
    );
    assert!((run.end("a.ry").sin() - 0.08 * 0.08).abs() < 1e-7, "{}", run.end("a.ry"));
}

/// Shallow stars of bars (springs) under a force at the apex, by arc length, as far as 3000 times the force that they snap
/// through under. With n bars of stiffness k and length l0, feet at the distance r, at the height z:
/// F = n k (l0/l - 1) z, l = sqrt(r^2 + z^2), with its limits where l^3 = l0 r^2. In random units and directions.
#[test]
fn arc_length_does_not_pass_over_a_structure_that_snaps_through() {
    let random = &mut Random::new(77);
    for _ in 0..300 {
        let [length, force] = [0, 0].map(|_| 10.0_f64.powf(random.range(-3.0, 3.0)));
        let [up, aside] = random.axes();
        let (bars, height) = (random.range(3.0, 6.99).floor(), random.range(0.15, 0.5));
        let (beyond, steps) = (10.0_f64.powf(random.range(0.2, 3.5)), random.range(5.0, 200.0) as u32);
        let original = 1.0_f64.hypot(height);
        let at_limit = original.cbrt();
        let limit = bars * (original / at_limit - 1.0) * (at_limit * at_limit - 1.0).sqrt();
        let mut deck = format!(
            "[point]\ntop = {}\n[[body]]\nat = \"top\"\nmass = 1.0\n[[load]]\nat = \"top\"\nforce = {}\n",
            list(up * (height * length)),
            list(up * (-beyond * limit * force)),
        );
        for bar in 0..bars as usize {
            let (sin, cos) = (TAU * bar as f64 / bars).sin_cos();
            let foot = aside * (cos * length) + up.cross(aside) * (sin * length);
            deck = format!("[point]\nfoot{bar} = {}\n{}", list(foot), deck.replacen("[point]\n", "", 1));
            deck += &format!(
                "[[body]]\nat = \"foot{bar}\"\nmass = 1.0\n[[support]]\nat = \"foot{bar}\"\nfix = \"all\"\n\
                 [[spring]]\nbetween = [\"top\", \"foot{bar}\"]\nstiffness = {:e}\n",
                force / length
            );
        }
        deck += &format!(
            "[[stage]]\nkind = \"static\"\ncontrol = \"arc_length\"\nsteps = {steps}\n[output]\nnodes = [\"top\"]\n"
        );
        let run = simulate(&deck);
        let events = run.counters.findings.events.iter();
        let limits: Vec<f64> = events.filter(|e| e.kind == EventKind::Limit).map(|e| e.at.load * beyond).collect();
        assert!(
            run.end("load") == 1.0
                && limits.len() == 2
                && (limits[0] - 1.0).abs() < 1e-6
                && (limits[1] + 1.0).abs() < 1e-6,
            "{bars} bars of height {height}, {beyond} times the limit in {steps} increments: {limits:?}"
        );
    }
}

/// Free strains that act in full from the start lead away from a state that is none of the path: no branch lies between.
#[test]
fn what_acts_at_once_passes_no_branch() {
    let deck = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/decks/prestress/bimetal.toml")).unwrap();
    let at_once = deck.replace("free_strain =", "history = \"now\"\nfree_strain =") + "\n[history.now]\nexpr = \"1\"\n";
    let [slowly, at_once] = [deck, at_once].map(|deck| simulate(&deck));
    assert!((at_once.end("tip.ux") / slowly.end("tip.ux") - 1.0).abs() < 1e-9);
    for run in [slowly, at_once] {
        assert!(run.counters.findings.warnings.is_empty(), "{:?}", run.counters.findings.warnings);
    }
}
