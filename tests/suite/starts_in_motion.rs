//! Stages that begin in motion: forces of joints do not swing by the start.

use crate::random::Random;
use crate::scenes::{distance, list, simulate};
use beamsim::scene;
use beamsim_core::tensor::Vec3;
use beamsim_core::warning::WarningKind;
use std::f64::consts::PI;

/// Two bodies on joints, one to the ground and one between them, with gravity; random places, axes and inertia.
fn mechanism(random: &mut Random, spins: bool) -> String {
    let near = |random: &mut Random, x: f64| list(Vec3([x, 0.0, 0.0]) + random.cube(0.2));
    let joint = |random: &mut Random, nodes: &str, at: &str| {
        let axis = random.direction();
        let kind = ["revolute", "spherical", "universal"][random.range(0.0, 3.0) as usize];
        let axis = match kind {
            "revolute" => format!("axis = {}\n", list(axis)),
            "universal" => {
                format!("axes = [{}, {}]\n", list(axis), list(axis.cross(random.direction()).normalized().unwrap()))
            }
            _ => String::new(),
        };
        format!("[[joint]]\nkind = \"{kind}\"\nnodes = {nodes}\nat = {at}\n{axis}")
    };
    let [a, b, pin] = [0.5, 1.5, 1.0].map(|x| near(random, x));
    let joints = joint(random, "[\"A\"]", "[0, 0, 0]") + &joint(random, "[\"A\", \"B\"]", &pin);
    let initial = |random: &mut Random, node: &str| {
        format!("[[initial]]\nat = \"{node}\"\nspin = {}\n", list(random.direction() * 3.0))
    };
    let motion = if spins { initial(random, "A") + &initial(random, "B") } else { String::new() };
    format!(
        "gravity = [0, 0, -10]\n[point]\nA = {a}\nB = {b}\n[[body]]\nat = \"A\"\nmass = 2\ninertia = [0.1, 0.2, 0.25]\n\
         [[body]]\nat = \"B\"\nmass = 1\ninertia = [0.1, 0.15, 0.2]\n{joints}{motion}[output]\nnodes = [\"A\"]\ncolumns = [\"reaction\"]\n"
    )
}

fn stages(scheme: &str, step: f64, ends: &[f64]) -> String {
    let stage =
        |end: &f64| format!("[[stage]]\nkind = \"dynamic\"\nend = {end}\nstep = {step}\nscheme = \"{scheme}\"\n");
    ends.iter().map(stage).collect()
}

/// The largest error of the forces on the ground at multiples of 0.02 from 0.02 on, over the largest of them; `exact`
/// has steps of 0.0025.
fn error(deck: &str, scheme: &str, step: f64, ends: &[f64], exact: &[Vec<f64>; 3]) -> f64 {
    let run = simulate(&format!("{deck}{}", stages(scheme, step, ends)));
    let stride = (0.02 / step).round() as usize;
    let (mut off, mut size) = (0.0_f64, 0.0_f64);
    for (name, exact) in ["A.fx", "A.fy", "A.fz"].into_iter().zip(exact) {
        for (k, force) in run.column(name).iter().step_by(stride).enumerate().skip(1) {
            off = off.max((force - exact[8 * k]).abs());
            size = size.max(exact[8 * k].abs());
        }
    }
    off / size
}

fn exact(deck: &str) -> [Vec<f64>; 3] {
    let run = simulate(&format!("{deck}{}", stages("lobatto", 0.0025, &[0.6])));
    ["A.fx", "A.fy", "A.fz"].map(|name| run.column(name))
}

const SCHEMES: [&str; 4] = ["generalized_alpha", "lie_generalized_alpha", "hht", "newmark"];

#[test]
fn a_motion_goes_on_from_stage_to_stage() {
    let mut random = Random::new(7);
    for number in 0..8 {
        let deck = mechanism(&mut random, false);
        let exact = exact(&deck);
        for scheme in SCHEMES {
            let [one, two] = [&[0.6][..], &[0.3, 0.6]].map(|ends| error(&deck, scheme, 0.01, ends, &exact));
            assert!(two < 1.5 * one + 1e-3, "scene {number}, {scheme}: {one} in one stage, {two} in two\n{deck}");
        }
    }
}

#[test]
fn motions_go_on_where_rows_shorten_steps() {
    let deck = mechanism(&mut Random::new(9), true).replace("[output]\n", "[output]\ninterval = 0.02\n");
    // Steps of 0.011 are taken as steps of 0.01.
    let [wanted, taken] = [0.011, 0.01].map(|step| {
        let run = simulate(&format!("{deck}{}", stages("newmark", step, &[0.3, 0.6])));
        ["A.fx", "A.fy", "A.fz"].map(|name| run.column(name))
    });
    for (wanted, taken) in wanted.iter().zip(&taken) {
        let off = wanted.iter().zip(taken).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let size = taken.iter().fold(0.0, |size: f64, force| size.max(force.abs()));
        assert!(off < 1e-4 * size, "{off} of {size}");
    }
}

#[test]
fn a_free_body_beside_a_mechanism_keeps_its_momentum() {
    let free = "[point.F]\nat = [0, 5, 0]\n[[body]]\nat = \"F\"\nmass = 1\ninertia = [1, 2, 3]\n[[initial]]\nat = \"F\"\nspin = [0.3, 5, 0.2]\n";
    let free = free.replace("[point.F]\nat = [0, 5, 0]\n", "");
    let beside = mechanism(&mut Random::new(10), true)
        .replace("[[body]]\nat = \"A\"", &format!("F = [0, 5, 0]\n{free}[[body]]\nat = \"A\""));
    let alone = format!("[point]\nF = [0, 5, 0]\n{free}[output]\nnodes = [\"F\"]\ncolumns = [\"w\"]\n");
    let [beside, alone] =
        [beside.replace("nodes = [\"A\"]\ncolumns = [\"reaction\"]", "nodes = [\"F\"]\ncolumns = [\"w\"]"), alone]
            .map(|deck| simulate(&format!("{deck}{}", stages("lie_generalized_alpha", 0.02, &[0.6]))).vector("F.w"));
    assert!(distance(beside, alone) < 1e-9, "{beside:?} for {alone:?}");
}

#[test]
fn forces_of_joints_that_begin_in_motion_are_of_second_order() {
    let mut random = Random::new(8);
    for number in 0..8 {
        let deck = mechanism(&mut random, true);
        let exact = exact(&deck);
        for scheme in SCHEMES {
            let [coarse, fine] = [0.01, 0.005].map(|step| error(&deck, scheme, step, &[0.6], &exact));
            assert!(fine < 0.35 * coarse + 1e-5, "scene {number}, {scheme}: {coarse} and {fine}\n{deck}");
        }
    }
}

/// In the first steps as well, where a scheme with a lag between true and algorithmic accelerations would let them swing.
#[test]
fn forces_of_joints_do_not_swing_in_the_first_steps() {
    let mut random = Random::new(12);
    for scheme in ["hht", "generalized_alpha\"\nrho_inf = 0.5 # \""] {
        let mut sums = [0.0; 2];
        for _ in 0..8 {
            let deck = mechanism(&mut random, true);
            let exact = exact(&deck);
            for (sum, step) in sums.iter_mut().zip([0.01, 0.005]) {
                let run = simulate(&format!("{deck}{}", stages(scheme, step, &[0.1])));
                let stride = (step / 0.0025).round() as usize;
                let off = |(name, exact): (&str, &Vec<f64>)| {
                    let forces = run.column(name);
                    let size = exact.iter().fold(0.0_f64, |size, force| size.max(force.abs()));
                    (1..6).map(|k| (forces[k] - exact[stride * k]).abs()).fold(0.0, f64::max) / size
                };
                *sum += ["A.fx", "A.fy", "A.fz"].into_iter().zip(&exact).map(off).fold(0.0, f64::max);
            }
        }
        let [coarse, fine] = sums;
        assert!(fine < 0.35 * coarse, "{scheme}: {coarse} and {fine}");
    }
}

/// A body on a hinge about z, at (2, 1, 0) from it, that turns at 1 rad/s in a stage before `more` acts on it.
fn hinged(scheme: &str, spin: f64, more: &str) -> String {
    format!(
        "[point]\ng = [0, 0, 0]\nd = [2, 1, 0]\n[[body]]\nat = \"g\"\nmass = 1\ninertia = [1, 1, 1]\n[[support]]\nat = \"g\"\nfix = \"all\"\n\
         [[body]]\nat = \"d\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n[[joint]]\nkind = \"revolute\"\nnodes = [\"g\", \"d\"]\nat = \"g\"\naxis = [0, 0, 1]\n\
         [[initial]]\nat = \"d\"\nspin = [0, 0, {spin}]\n{more}[output]\nnodes = [\"g\", \"d\"]\ncolumns = [\"reaction\", \"v\", \"w\"]\n{}",
        stages(scheme, 0.01, &[0.1, 0.3])
    )
}

#[test]
fn supports_and_motions_that_begin_in_motion_move_all_that_joints_connect() {
    let caught = "[[support]]\nat = \"d\"\nfix = \"uy\"\nstages = [2]\n";
    let moved = "[history.h]\nexpr = \"-0.5*t\"\n[[motion]]\nat = \"d\"\nux = 1\nhistory = { name = \"h\", stages = [2] }\nstages = [2]\n";
    for scheme in SCHEMES {
        // The body stands still, and no force holds it.
        let run = simulate(&hinged(scheme, 1.0, caught));
        for (spin, force) in run.column("d.wz").iter().zip(run.column("g.fx")).skip(11) {
            assert!(spin.abs() < 1e-9 && force.abs() < 1e-6, "{scheme}: {spin}, {force}");
        }
        // With vx = -0.5 it turns at -vx/y, y = 1 at first, and goes on so: y falls by 0.1 in 0.1, to first order.
        let run = simulate(&hinged(scheme, 0.0, moved));
        for (k, spin) in run.column("d.wz").iter().enumerate().skip(11) {
            // x = 2 - 0.5 t and y = sqrt(5 - x^2).
            let x: f64 = 2.0 - 0.5 * (0.01 * k as f64 - 0.1);
            let exact = 0.5 / (5.0 - x * x).sqrt();
            assert!((spin - exact).abs() < 2e-3, "{scheme}, row {k}: {spin} for {exact}");
        }
    }
}

/// A motion that takes hold of what moves, or moves what stands still, in a later stage is told, and its impulse is work.
#[test]
fn motions_that_begin_later_with_another_velocity_are_told() {
    let random = &mut Random::new(77);
    for scheme in SCHEMES {
        let [mass, given, taken] = [0, 0, 0].map(|_| 10.0_f64.powf(random.range(-2.0, 2.0)));
        let text = |motion: &str| {
            format!(
                "[point]\na = [0, 0, 0]\nz = [0, 5, 0]\n[[body]]\nat = \"a\"\nmass = {mass}\n[[body]]\nat = \"z\"\n\
                 mass = {mass}\n[[initial]]\nvelocity = [{given}, 0, 0]\n\
                 [[motion]]\nat = \"a\"\nux = 1\nhistory = {{ name = \"h\", stages = [2] }}\nstages = [2]\n\
                 [history.h]\nexpr = \"{motion}\"\n[[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.01\nscheme = \"{scheme}\"\n\
                 [[stage]]\nkind = \"dynamic\"\nend = 0.2\nstep = 0.01\nscheme = \"{scheme}\"\n\
                 [output]\nnodes = [\"a\"]\ncolumns = [\"v\", \"energy\"]\n"
            )
        };
        let at = |value: f64| format!("{} + {value}*t", 0.1 * given);
        let jumps = simulate(&text(&at(taken)));
        let told: Vec<_> = jumps.counters.findings.warnings.iter().map(|warning| warning.kind).collect();
        assert_eq!(told, [WarningKind::VelocityJump], "{scheme}\n{}", text(&at(taken)));
        let total = jumps.column("energy.total");
        assert!((jumps.end("energy.total") / total[0] - 1.0).abs() < 1e-9, "{scheme}: {total:?}");
        // What the motion goes on with is no jump.
        let goes_on = simulate(&text(&at(given)));
        assert!(goes_on.counters.findings.warnings.is_empty(), "{:?}", goes_on.counters.findings.warnings);
    }
}

/// A motion and a support at one node: the support is told, and what it takes is no work of the motion. What acts before
/// as well is told once, when the deck is read; a motion by a formula that begins at rest jumps nowhere.
#[test]
fn motions_and_supports_that_begin_together_are_told_apart() {
    let text = |initial: &str, stages: &str, formula: &str, more: &str| {
        format!(
            "[point]\na = [0, 0, 0]\nz = [0, 5, 0]\n[[body]]\nat = \"a\"\nmass = 2\n[[body]]\nat = \"z\"\nmass = 3\n\
             [[initial]]\nat = \"a\"\nvelocity = {initial}\n[[initial]]\nat = \"z\"\nvelocity = [0, 1, 0]\n\
             [[motion]]\nat = \"a\"\nux = 1\nhistory = \"h\"\nstages = {stages}\n[history.h]\nexpr = \"{formula}\"\n{more}\
             [[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = 0.01\n[[stage]]\nkind = \"dynamic\"\nend = 0.2\nstep = 0.01\n\
             [output]\nnodes = [\"a\"]\ncolumns = [\"v\", \"energy\"]\n"
        )
    };
    let told = |text: &str| {
        let run = simulate(text);
        let jumps = run.counters.findings.warnings.iter().filter(|warning| warning.kind == WarningKind::VelocityJump);
        let messages: Vec<_> = jumps.map(|warning| warning.message.clone()).collect();
        (messages, run)
    };
    // It goes on with 0.5 along x and is caught along y.
    let support = "[[support]]\nat = \"a\"\nfix = [\"uy\"]\nstages = [2]\n";
    let (messages, run) = told(&text("[0.5, 2, 0]", "[2]", "0.5*t", support));
    assert!(messages.len() == 1 && messages[0].contains("supports of stage 2"), "{messages:?}");
    assert!(run.end("energy.external").abs() < 1e-12, "{}", run.end("energy.external"));
    // Both jump.
    let (messages, _) = told(&text("[0.5, 2, 0]", "[2]", "0.05 + 3*(t - 0.1)", support));
    assert_eq!(messages.len(), 2, "{messages:?}");
    // The motion acts in both stages without a jump.
    let (messages, _) = told(&text("[0.5, 0, 0]", "[1, 2]", "0.5*t", ""));
    assert!(messages.is_empty(), "{messages:?}");
    // A node at rest is moved smoothly.
    let (messages, _) = told(&text("[0, 0, 0]", "[2]", "(t - 0.1)^2", ""));
    assert!(messages.is_empty(), "{messages:?}");
}

/// A driven slider goes on with the velocity that initial motions give its node beside that of the beam.
#[test]
fn drives_of_sliders_go_on_with_initial_velocities() {
    for (velocity, of_beam, is_told) in [(0.4, 0.0, false), (0.9, 0.5, false), (0.4, 0.5, true), (0.0, 0.0, true)] {
        let text = format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\nm = [0.1, 0, 0]\n[section.s]\nEA = 1e4\nGA = 1e3\nGJ = 1\nEI = 1\nrhoA = 1\n\
             rhoJ = [0.02, 0.01, 0.01]\n[[beam]]\nname = \"q\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\n\
             [[body]]\nat = \"m\"\nmass = 0.2\n[[slider]]\nnodes = [\"m\"]\non = \"q\"\ndisplacement = 0.8\nhistory = \"h\"\n\
             [history.h]\nexpr = \"t/2\"\n[[initial]]\nat = \"m\"\nvelocity = [{velocity}, 0, 0]\n\
             [[initial]]\nbeam = \"q\"\nvelocity = [{of_beam}, 0, 0]\n\
             [[stage]]\nkind = \"dynamic\"\nend = 1\nstep = 0.01\nscheme = \"generalized_alpha\"\n\
             [output]\nnodes = [\"m\"]\ncolumns = [\"v\"]\n"
        );
        let (_, diagnostics) = scene::from_text(&text).unwrap_or_else(|e| panic!("{e:?}"));
        assert_eq!(
            format!("{diagnostics:?}").contains("VelocityJump"),
            is_told,
            "{velocity} {of_beam}: {diagnostics:?}"
        );
    }
}

/// A clamped beam that starts with one velocity everywhere, and damping in proportion to its stiffness: at the clamp its
/// rotations, which have damping and no mass, take their rates from balance within a time in which shear has not yet braked
/// what has mass.
#[test]
fn rates_of_balance_make_no_energy() {
    let mut random = Random::new(41);
    for case in 0..8 {
        let [length, bending, mass] = [0; 3].map(|_| 10f64.powf(random.range(-2.0, 2.0)));
        let stiff = 10f64.powf(random.range(5.0, 7.0)) * bending / (length * length);
        let omega = 3.516 * (bending / mass).sqrt() / (length * length);
        let damping = 2.0 * random.range(0.004, 0.02) / omega;
        let speed = 1e-3 * omega * length;
        let run = |steps: f64| {
            let period = 2.0 * PI / omega;
            simulate(&format!(
                "[effects]\nlarge_rotations = {}\n[section.s]\nEA = {stiff:e}\nGA = {stiff:e}\nGJ = {bending:e}\nEI = {bending:e}\n\
                 rhoA = {mass:e}\n[damping]\nstiffness = {damping:e}\n[[beam]]\nname = \"x\"\nsection = \"s\"\n\
                 through = [[0, 0, 0], [{length:e}, 0, 0]]\nelements = 6\norder = 2\n[[support]]\nat = \"x@start\"\nfix = \"all\"\n\
                 [[initial]]\nbeam = \"x\"\nvelocity = [0, 0, {speed:e}]\n[[stage]]\nkind = \"dynamic\"\nend = {:e}\nstep = {:e}\n\
                 scheme = \"newmark\"\n[output]\nnodes = [\"x@end\"]\ncolumns = [\"u\", \"energy\"]\n",
                case % 2 == 0,
                0.5 * period,
                period / steps,
            ))
        };
        let [coarse, fine] = [100.0, 400.0].map(run);
        let total = coarse.column("energy.total");
        let most = total.iter().copied().fold(0.0, f64::max);
        assert!((most / total[0] - 1.0).abs() < 0.01, "{most:e} of {:e}", total[0]);
        let tips = [&coarse, &fine].map(|run| run.column("x@end.uz").into_iter().fold(0.0, f64::max));
        assert!((tips[0] / tips[1] - 1.0).abs() < 0.01, "{tips:?}");
        let [found] = coarse.counters.findings.time_errors[..] else { panic!("one stage") };
        assert!(found.largest.displacement < 0.5 * found.largest.moved, "{found:?}");
    }
}
