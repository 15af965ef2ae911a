//! Axes of round surfaces, where they have no normal, and the rims of open tubes.

use crate::random::Random;
use crate::scenes::{attempt, list, simulate};
use beamsim_core::failure::FailureKind;
use beamsim_core::tensor::Vec3;

/// A beam that is carried by 0.6 across a thin surface 0.3 below it.
fn carried_across(surface: &str, order: usize, stage: &str) -> String {
    format!(
        "[point]\na = [0, 0, 0.3]\nb = [1, 0, 0.3]\n\
         [section.s]\nEA = 1e4\nGA = 1e5\nGJ = 1\nEI = 1\nrhoA = 1\nrhoJ = [2e-4, 1e-4, 1e-4]\n\
         [[beam]]\nname = \"w\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 10\norder = {order}\n\
         [[surface]]\nname = \"s\"\n{surface}\n\
         [[contact]]\nname = \"c\"\nbeams = [\"w\"]\nsurfaces = [\"s\"]\nradius = 0.005\n{stage}\n\
         [output]\nnodes = [\"w@0.5\"]\ncolumns = [\"u\", \"contact\"]\n"
    )
}

const ROUND: [&str; 6] = [
    "kind = \"cylinder\"\nfrom = [0.43, -1, 0]\nto = [0.43, 1, 0]\nradius = 0.01",
    "kind = \"capsule\"\nfrom = [0.43, -0.3, 0]\nto = [0.43, 0.3, 0]\nradius = 0.01",
    "kind = \"sphere\"\nat = [0.43, 0, 0]\nradius = 0.01",
    "kind = \"cone\"\nfrom = [0.43, -0.3, 0]\nto = [0.43, 0.3, 0]\nradius = [0.01, 0.012]",
    "kind = \"torus\"\nat = [0.43, 0, -0.3]\naxis = [1, 0, 0]\nring = 0.3\nradius = 0.01",
    "kind = \"tube\"\nthrough = [[0.43, -0.3, 0], [0.43, 0.3, 0]]\nradius = 0.01",
];

/// Levels that put the centre line of a beam, or the middle of a ball, exactly on the axis of a surface: no force
/// is there, but nothing may come through.
#[test]
fn levels_that_end_on_an_axis_do_not_pass() {
    let moved = "[[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"rx\", \"ry\", \"rz\"]\n\
                 [[support]]\nat = \"b\"\nfix = [\"ux\", \"uy\", \"rx\", \"rz\"]\n\
                 [[motion]]\nat = \"a\"\nuz = -0.6\n[[motion]]\nat = \"b\"\nuz = -0.6\n[[stage]]\nkind = \"static\"\n";
    let (mut held, mut ended) = (0, 0);
    for (number, surface) in ROUND.into_iter().enumerate() {
        for steps in [1, 2, 6, 20] {
            let order = 1 + (number + steps) % 2;
            let simulation = attempt(&carried_across(surface, order, &format!("{moved}steps = {steps}")));
            match &simulation.result {
                Ok(()) => {
                    assert!(simulation.end("c.normal") > 500.0, "{surface}, {steps} levels");
                    assert!(simulation.end("c.gap") > -1e-4, "{surface}, {steps} levels");
                    held += 1;
                }
                Err(failure) => {
                    let kinds = [FailureKind::ContactPassed, FailureKind::NotConverged];
                    assert!(kinds.contains(&failure.kind()), "{failure}, {surface}, {steps} levels");
                    ended += 1;
                }
            }
        }
    }
    println!("{held} held, {ended} ended");
    assert!(held >= 18, "{held} of 24");
}

#[test]
fn time_steps_that_end_on_an_axis_do_not_pass() {
    for surface in ROUND {
        for count in [10, 20, 40] {
            let stage = format!(
                "[[initial]]\nbeam = \"w\"\nvelocity = [0, 0, -6]\n[[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = {}",
                0.1 / f64::from(count)
            );
            let simulation = attempt(&carried_across(surface, 1, &stage));
            match &simulation.result {
                Ok(()) => assert!(0.3 + simulation.end("w@0.5.uz") > 0.0, "{surface}, {count} steps"),
                Err(failure) => assert_eq!(failure.kind(), FailureKind::ContactPassed, "{surface}, {count} steps"),
            }
            let ball = format!(
                "[point]\nb = [0.43, 0, 0.3]\n[[body]]\nat = \"b\"\nmass = 1\ninertia = [1, 1, 1]\n\
                 [[support]]\nat = \"b\"\nfix = [\"ux\", \"uy\", \"rx\", \"ry\", \"rz\"]\n\
                 [[initial]]\nat = \"b\"\nvelocity = [0, 0, -6]\n[[surface]]\nname = \"s\"\n{surface}\n\
                 [[contact]]\nname = \"c\"\nnodes = [\"b\"]\nsurfaces = [\"s\"]\nradius = 0.005\nstiffness = 1000\n\
                 [[stage]]\nkind = \"dynamic\"\nend = 0.1\nstep = {}\n",
                0.1 / f64::from(count)
            );
            let failure = refusal_of_run(&ball);
            assert_eq!(failure, FailureKind::ContactPassed, "{surface}, {count} steps");
        }
    }
}

fn refusal_of_run(deck: &str) -> FailureKind {
    attempt(deck).result.expect_err(deck).kind()
}

/// A wire on the axis of a tube, half in and half out, wherever its nodes are.
#[test]
fn nothing_is_touched_beyond_an_open_end() {
    let mut random = Random::new(91);
    for case in 0..40 {
        let along = random.direction();
        let (origin, radius) = (random.cube(1.0), random.range(0.01, 0.05));
        let (thin, shift) = (radius * random.range(0.1, 0.9), random.range(-0.05, 0.05));
        let on_axis = |x: f64| list(origin + along * x);
        let smooth = case % 2 == 0;
        let deck = format!(
            "[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1\nEI = 1\n\
             [[beam]]\nname = \"w\"\nsection = \"s\"\nthrough = [{}, {}]\nelements = 20\n\
             [[support]]\nat = \"w@start\"\nfix = \"all\"\n\
             [[surface]]\nname = \"v\"\nkind = \"tube\"\nthrough = [{}, {}]\nradius = {radius}\nside = \"inside\"\nsmooth = {smooth}\n\
             [[contact]]\nname = \"c\"\nbeams = [\"w\"]\nsurfaces = [\"v\"]\nradius = {thin}\n\
             [[stage]]\nkind = \"static\"\nsteps = 1\n[output]\nnodes = [\"w@end\"]\ncolumns = [\"contact\"]\n",
            on_axis(shift - 0.5),
            on_axis(shift + 0.5),
            on_axis(0.0),
            on_axis(2.0)
        );
        let simulation = simulate(&deck);
        let gap = simulation.end("c.gap");
        // Gaps on an axis are those beside it.
        assert!((gap - (radius - thin)).abs() < 1e-5 * radius, "{case}: {gap} for {}", radius - thin);
        assert_eq!(simulation.end("c.normal"), 0.0, "{case}");
    }
}

/// A wire with a dead force at its end that is pushed out of a tube without friction. Rigid walls do no work, so that the
/// work of the push is the rest of the energy: the wire is driven out (Bigoni et al. 2015, doi:10.1016/j.mechmat.2015.05.006).
#[test]
fn wires_slide_out_of_tubes_without_a_loss() {
    let mut random = Random::new(92);
    for case in 0..6 {
        let [along, aside] = random.axes();
        let origin = random.cube(1.0);
        let order = 1 + case % 3;
        let place = |x: f64| list(origin + along * x);
        let radius = if case % 2 == 1 { "[0.02, 0.012]" } else { "0.012" };
        let motion = |k: usize| {
            let [name, way] = [["ux", "uy", "uz"][k].to_string(), (along * 0.2).0[k].to_string()];
            format!("[[motion]]\nat = \"tail\"\n{name} = {way}\nstages = [2]\n")
        };
        let motions: String = (0..3).map(motion).collect();
        let deck = format!(
            "[section.s]\nEA = 1e6\nGA = 1e6\nGJ = 1\nEI = 1\n[point]\ntail = {}\ntip = {}\n\
             [[beam]]\nname = \"w\"\nsection = \"s\"\nthrough = [\"tail\", \"tip\"]\nelements = {}\norder = {order}\n\
             [[support]]\nat = \"tail\"\nfix = [\"rx\", \"ry\", \"rz\"]\n\
             [[support]]\nat = \"tail\"\nfix = [\"ux\", \"uy\", \"uz\"]\nstages = [1]\n\
             [[load]]\nat = \"tip\"\nforce = {}\n\
             {motions}\
             [[surface]]\nname = \"sheath\"\nkind = \"tube\"\nside = \"inside\"\nthrough = [{}, {}]\nsmooth = {}\n\
             radius = {radius}\n\
             [[contact]]\nname = \"c\"\nbeams = [\"w\"]\nsurfaces = [\"sheath\"]\nradius = 0.01\npenetration = 1e-6\n\
             [[stage]]\nkind = \"static\"\nsteps = 4\n[[stage]]\nkind = \"static\"\nsteps = 20\n\
             [output]\nnodes = [\"tail\"]\ncolumns = [\"reaction\", \"contact\", \"energy\"]\n",
            place(-0.6),
            place(0.2),
            80 / order,
            list(aside),
            place(-1.0),
            place(0.0),
            case < 3,
        );
        let simulation = simulate(&deck);
        let [strain, external, total] =
            ["strain", "external", "total"].map(|energy| simulation.column(&format!("energy.{energy}")));
        let gained = external[24] - external[4];
        let lost = total[24] - total[4];
        let push: Vec<f64> = {
            let components = ["fx", "fy", "fz"].map(|axis| simulation.column(&format!("tail.{axis}")));
            (4..=24).map(|row| Vec3([0, 1, 2].map(|k| components[k][row])).dot(along)).collect()
        };
        println!("{case}: {lost} of {gained}, push {push:?}");
        // Forces of elements of order 1 jump where nodes pass the rim, and levels take their work by two values each.
        let allowed = if order == 1 { 6e-2 } else { 3e-3 };
        assert!(lost.abs() < allowed * gained, "{case}: {lost} of {gained}");
        assert!(strain[24] > 3.0 * strain[4], "{case}: it is hardly bent");
        assert!(push[4..].iter().all(|&push| push < -0.04), "{case}: {push:?}");
    }
}

/// Balls that a force pushes against the rim of a tube, from its mouth and from beside its end: their middle is a radius
/// away from the circle.
#[test]
fn balls_rest_on_rims() {
    let ball = |side: &str, radius: &str, place: [f64; 3], free: &str, force: [f64; 3]| {
        let fixed: Vec<String> = ["ux", "uy", "uz", "rx", "ry", "rz"]
            .iter()
            .filter(|name| **name != free)
            .map(|name| format!("\"{name}\""))
            .collect();
        let spring = ["ux", "uy", "uz", "rx", "ry", "rz"].map(|name| if name == free { 10.0 } else { 0.0 });
        let deck = format!(
            "[point]\nb = {place:?}\n[[body]]\nat = \"b\"\nmass = 1\n[[support]]\nat = \"b\"\nfix = [{}]\n\
             [[spring]]\nat = \"b\"\nstiffness = {spring:?}\n[[load]]\nat = \"b\"\nforce = {force:?}\n\
             [[surface]]\nname = \"t\"\nkind = \"tube\"\nside = \"{side}\"\nthrough = [[-1, 0, 0], [0, 0, 0]]\nradius = {radius}\n\
             [[contact]]\nname = \"c\"\nnodes = [\"b\"]\nsurfaces = [\"t\"]\nradius = 0.03\nstiffness = 1e4\npenetration = 1e-7\n\
             [[stage]]\nkind = \"static\"\nsteps = 20\n[output]\nnodes = [\"b\"]\ncolumns = [\"x\", \"contact\"]\n",
            fixed.join(", ")
        );
        let simulation = simulate(&deck);
        (Vec3(simulation.vector("b.")), simulation.end("c.normal"))
    };
    let (place, normal) = ball("inside", "0.02", [0.04, 0.005, 0.0], "ux", [-1.0, 0.0, 0.0]);
    let exact = (0.03_f64.powi(2) - 0.015_f64.powi(2)).sqrt();
    assert!((place.0[0] - exact).abs() < 1e-6, "{place:?} {exact}");
    let push = 1.0 - 10.0 * (0.04 - exact);
    assert!((normal - push * 0.03 / exact).abs() < 1e-3 * normal, "{normal}");
    let (place, normal) = ball("outside", "0.02", [0.01, 0.0, 0.06], "uz", [0.0, 0.0, -1.0]);
    let exact = (0.03_f64.powi(2) - 0.01_f64.powi(2)).sqrt();
    assert!((place.0[2] - 0.02 - exact).abs() < 1e-6, "{place:?} {exact}");
    let push = 1.0 - 10.0 * (0.06 - 0.02 - exact);
    assert!((normal - push * 0.03 / exact).abs() < 1e-3 * normal, "{normal}");
    // The wall of a tube that widens leans back: it ends where the plane normal to it goes through the end of the axis.
    let (tilt, wide, before) = (0.29, 0.3, 0.006);
    let (place, _) = ball("outside", "[0.01, 0.3]", [-wide * tilt - before, 0.0, 0.35], "uz", [0.0, 0.0, -1.0]);
    let exact = wide * (1.0 - tilt * tilt).sqrt() + (0.03_f64.powi(2) - before * before).sqrt();
    assert!((place.0[2] - exact).abs() < 1e-6, "{place:?} {exact}");
}
