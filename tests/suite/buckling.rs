//! Critical loads on the paths of buckling stages: one row for each point.

use crate::random::Random;
use crate::scenes::{attempt, list, results, simulate};
use beamsim_core::run::{CriticalKind, CriticalLoad, StageResult};
use beamsim_core::tensor::Vec3;
use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

fn deck(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("decks").join(path)).unwrap()
}

fn critical_loads(text: &str) -> Vec<CriticalLoad> {
    let of_stage = |result| match result {
        StageResult::CriticalLoads(loads) => Some(loads),
        StageResult::Modes(_) => None,
    };
    results(text).into_iter().filter_map(of_stage).next_back().unwrap()
}

fn with_modes(text: &str, modes: usize) -> String {
    let lines = text.lines().map(|line| match line.starts_with("modes = ") {
        true => format!("modes = {modes}\n"),
        false => format!("{line}\n"),
    });
    lines.collect()
}

/// Load control ends at a limit point: no other load lies behind it, however many are asked for.
#[test]
fn a_limit_point_is_listed_once() {
    let frame = deck("hard/s13_buckling_limit_point.toml");
    let [alone] = critical_loads(&with_modes(&frame, 1))[..] else { panic!("one load") };
    assert_eq!(alone.kind, CriticalKind::Limit);
    for modes in 2..=4 {
        let [found] = critical_loads(&with_modes(&frame, modes))[..] else { panic!("one load of {modes}") };
        assert_eq!(found.kind, CriticalKind::Limit);
        assert!((found.load / alone.load - 1.0).abs() < 1e-7, "{} and {}", found.load, alone.load);
    }
}

/// A higher frame turns aside before its limit point.
#[test]
fn branches_before_a_limit_point_are_listed_with_it() {
    let frame = deck("hard/s13_buckling_limit_point.toml").replace("b = [0, 0, 0.3]", "b = [0, 0, 0.6]");
    let found = critical_loads(&with_modes(&frame, 4));
    let kinds: Vec<CriticalKind> = found.iter().map(|critical| critical.kind).collect();
    let (last, before) = kinds.split_last().unwrap();
    assert_eq!(*last, CriticalKind::Limit, "{found:?}");
    assert!(!before.is_empty() && before.iter().all(|kind| *kind == CriticalKind::Branch), "{found:?}");
    assert!(found.windows(2).all(|pair| pair[0].load < pair[1].load * (1.0 - 1e-6)), "{found:?}");
}

/// Next to the critical load round-off alone moves a column aside, the faster the nearer; it is a branch all the same.
#[test]
fn columns_in_any_direction_have_double_branches() {
    let mut random = Random::new(43);
    for case in 0..30 {
        let length = 10f64.powf(random.range(-1.0, 2.0));
        let [along, across] = random.axes();
        let bending = 10f64.powf(random.range(-1.0, 2.0));
        let stretching = bending / (length * length) * 10f64.powf(random.range(4.0, 7.0));
        let exact = std::f64::consts::PI.powi(2) / 4.0 * bending / (length * length);
        let text = format!(
            "[point]\na = [0, 0, 0]\nb = {}\n[section.s]\nEA = {stretching}\nGA = {}\nGJ = {bending}\nEI = {bending}\n\
             [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 12\norder = 2\naxis3 = {}\n\
             [[support]]\nat = \"a\"\nfix = \"all\"\n[[load]]\nat = \"b\"\nforce = {}\n[[stage]]\nkind = \"static\"\nsteps = 1\n\
             [[stage]]\nkind = \"buckling\"\nmodes = 2\n",
            list(along * length),
            stretching * 100.0,
            list(across),
            list(along * (-0.5 * exact)),
        );
        let found = critical_loads(&text);
        let [one, other] = found[..] else { panic!("{case}: {found:?}\n{text}") };
        for critical in [one, other] {
            assert_eq!(critical.kind, CriticalKind::Branch, "{case}: {found:?}\n{text}");
            assert!((critical.load / 2.0 - 1.0).abs() < 1e-3, "{case}: {found:?}\n{text}");
        }
    }
}

/// Two modes at one load are two rows.
#[test]
fn double_branches_are_listed_twice() {
    let found = critical_loads(&deck("paths/euler_columns/pinned_round.toml"));
    let [one, other] = found[..] else { panic!("{found:?}") };
    assert!((one.load / other.load - 1.0).abs() < 1e-5);
    assert_eq!([one.kind, other.kind], [CriticalKind::Branch; 2]);
}

/// A column that heat presses between fixed ends does not move, in whatever direction it stands: its loads are branches.
#[test]
fn loads_of_a_heated_column_are_branches_in_all_directions() {
    let mut random = Random::new(93);
    for _ in 0..6 {
        let axis = random.direction();
        let deck = format!(
            "[point]\na = [0, 0, 0]\nb = {}\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 1\nEI = [1, 2.3]\n[[beam]]\nname = \"c\"\n\
             section = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 6\norder = 3\nfree_strain = [1e-4, 0, 0, 0, 0, 0]\n\
             [[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"b\"\nfix = \"all\"\n[[stage]]\nkind = \"static\"\nsteps = 1\n\
             [[stage]]\nkind = \"buckling\"\nmodes = 2\n",
            list(axis)
        );
        let found = critical_loads(&deck);
        // Clamped at both ends: N = 4 pi^2 EI/L^2, where N = 1 at the load factor 1; shear takes some of it.
        assert!((found[0].load / 39.478 - 1.0).abs() < 5e-3, "{found:?}");
        assert!(found.iter().all(|critical| critical.kind == CriticalKind::Branch), "{found:?}");
    }
}

/// Where a static stage ends early and the next one applies the rest, all of the load is scaled.
#[test]
fn loads_after_an_early_end_are_scaled_as_a_whole() {
    let column = |stages: &str| {
        format!(
            "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e5\nGA = 1e6\nGJ = 1\nEI = [1, 2]\n\
             [[beam]]\nname = \"col\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 10\norder = 2\n\
             [[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\"]\n[[support]]\nat = \"b\"\nfix = [\"uy\", \"uz\"]\n\
             [[load]]\nat = \"b\"\nforce = [-5, 0, 0]\n{stages}[[stage]]\nkind = \"buckling\"\nmodes = 1\n"
        )
    };
    let until = |part: f64| {
        format!(
            "[[stage]]\nkind = \"static\"\nsteps = 20\nuntil = {{ column = \"a.fx\", above = {} }}\n",
            5.0 * part - 0.1
        )
    };
    let rest = "[[stage]]\nkind = \"static\"\nsteps = 2\n";
    let first = |stages: &str| critical_loads(&column(stages))[0].load;
    let whole = first(rest);
    assert!((whole / (std::f64::consts::PI.powi(2) / 5.0) - 1.0).abs() < 2e-3, "{whole}");
    for part in [0.05, 0.25, 0.7, 0.9] {
        for stages in [until(part), until(part) + rest, until(part) + rest + rest] {
            let load = first(&stages);
            assert!((load / whole - 1.0).abs() < 1e-6, "{part}: {load}, not {whole}\n{stages}");
        }
    }
}

/// A portal on clamped feet under two loads, in its plane, that is as good as inextensible: only their
/// difference shortens its columns differently. In units of a length and of EI, with its plane across `normal`.
fn portal(stiffness: f64, second: f64, start: f64, modes: usize, length: f64, normal: Vec3) -> String {
    let along = normal.cross(Vec3([0.3, 0.4, 0.5])).normalized().unwrap();
    let up = normal.cross(along);
    let place = |x: f64, z: f64| list((along * x + up * z) * length);
    let force = |part: f64| list(up * (-part / (length * length)));
    let before = if start > 0.0 { "[[stage]]\nkind = \"static\"\nsteps = 1\n" } else { "" };
    let load = if start > 0.0 { start } else { 1.0 };
    let mut text = format!(
        "[point]\nf0 = {}\nt0 = {}\nf1 = {}\nt1 = {}\n[section.s]\nEA = {ea:e}\nGA = {ea:e}\nGJ = 1\nEI = 1\n",
        place(0.0, 0.0),
        place(0.0, 1.0),
        place(1.0, 0.0),
        place(1.0, 1.0),
        ea = stiffness / (length * length),
    );
    for (name, from, to) in [("c0", "f0", "t0"), ("c1", "f1", "t1"), ("g", "t0", "t1")] {
        text += &format!(
            "[[beam]]\nname = \"{name}\"\nsection = \"s\"\nthrough = [\"{from}\", \"{to}\"]\nelements = 4\norder = 3\n"
        );
    }
    for foot in ["f0", "f1"] {
        text += &format!("[[support]]\nat = \"{foot}\"\nfix = \"all\"\n");
    }
    for (top, part) in [("t0", 1.0), ("t1", second)] {
        // Across its plane the portal is held.
        let (x, y) = (list(along), list(normal));
        text += &format!(
            "[[support]]\nat = \"{top}\"\nfix = [\"uy\", \"rx\", \"rz\"]\naxes = [{x}, {y}]\n\
             [[load]]\nat = \"{top}\"\nforce = {}\n",
            force(load * part)
        );
    }
    text + before + &format!("[[stage]]\nkind = \"buckling\"\nmodes = {modes}\n")
}

/// A portal with two loads that are not quite the same sways without a critical point at the load at which it would
/// buckle, to a limit point far above. References: an eigenvalue problem of Hermite elements, without shortening.
#[test]
fn nearly_perfect_portals_buckle_where_perfect_ones_do() {
    let mut random = Random::new(61);
    for (stiffness, second, reference) in
        [(1e5, 0.99, 7.4158), (1e5, 0.8, 8.1974), (1e6, 0.99, 7.4162), (1e6, 0.5, 9.8261), (1e6, 0.0, 14.586)]
    {
        for start in [0.0, 0.3] {
            let length = 10f64.powf(random.range(-3.0, 3.0));
            let load = start * reference;
            let text = portal(stiffness, second, load, 1, length, random.direction());
            let found = critical_loads(&text);
            let load = found[0].load * if start > 0.0 { load } else { 1.0 };
            let off = (load / reference - 1.0).abs();
            assert!(off < 3e-3, "EA {stiffness:e}, {second}, from {start}: {load} for {reference}\n{found:?}\n{text}");
        }
    }
}

/// Its further loads are those of the perfect portal, too, and none is listed twice.
#[test]
fn nearly_perfect_portals_have_further_loads() {
    let perfect = critical_loads(&portal(1e6, 1.0, 0.0, 3, 1.0, Vec3([0.0, 1.0, 0.0])));
    for (length, start) in [(1.0, 0.0), (1e3, 1.0), (1e-3, 4.0)] {
        let text = portal(1e6, 0.999, start, 3, length, Vec3([0.0, 0.6, 0.8]));
        let found = critical_loads(&text);
        // An imperfection of 1e-3 is on the verge of changing the load.
        assert!(found.len() == 3 && found.iter().all(|found| found.kind != CriticalKind::Limit), "{found:?}");
        for (found, perfect) in found.iter().zip(&perfect) {
            let load = found.load * if start > 0.0 { start } else { 1.0 };
            // The mean of the loads is smaller by 5e-4.
            assert!((load / perfect.load - 1.0).abs() < 2e-3, "{load} for {}: {found:?}", perfect.load);
        }
    }
}

/// A hinged column whose head comes down on a stiff post at 0.7 of Euler's load: it buckles at 11.53 with the post's help,
/// though all looks from smaller loads see Euler's 9.87.
#[test]
fn a_contact_on_the_way_is_no_imperfection() {
    let text = r#"
[point]
foot = [0, 0, 0]
t = [0, 0, 1]
pf = [0.5, 0, 0]
pt = [0.5, 0, 0.5]
[section.s]
EA = 1e4
GA = 1e4
GJ = 1
EI = 1
[section.post]
EA = 1e4
GA = 1e4
GJ = 1e3
EI = 1e3
[[beam]]
name = "col"
section = "s"
through = ["foot", "t"]
elements = 6
order = 3
[[beam]]
name = "post"
section = "post"
through = ["pf", "pt"]
elements = 2
[[support]]
at = "foot"
fix = ["ux", "uy", "uz", "rx", "rz"]
[[support]]
at = "t"
fix = ["ux", "uy", "rx", "rz"]
[[support]]
at = "pf"
fix = "all"
[[surface]]
name = "head"
kind = "plane"
point = [0, 0, 0.98931]
normal = [0, 0, 1]
on = "pt"
[[contact]]
name = "c"
nodes = ["t"]
surfaces = ["head"]
radius = 0.01
stiffness = 1e5
[[load]]
at = "t"
force = [0, 0, -1]
[[stage]]
kind = "static"
steps = 1
[[stage]]
kind = "buckling"
modes = 1
"#;
    let [found] = critical_loads(text)[..] else { panic!("one load") };
    // 6.9 on the column alone, and the rest shared with the post, whose half length is twice as stiff.
    assert!(found.kind == CriticalKind::Branch && (found.load / 11.47 - 1.0).abs() < 0.01, "{found:?}");
}

/// A toggle of legs of two lengths under a push snaps at its limit point, which ends the list: no load behind it is one.
#[test]
fn a_limit_point_with_a_push_is_listed_once() {
    let text = r#"
[point]
a = [-1, 0, 0]
b = [0, 0, 1.1248]
c = [1.2, 0, 0]
[section.s]
EA = 46786
GA = 46786
GJ = 1
EI = 1
[[beam]]
name = "qab"
section = "s"
through = ["a", "b"]
elements = 3
order = 2
[[beam]]
name = "qbc"
section = "s"
through = ["b", "c"]
elements = 3
order = 2
[[support]]
at = "a"
fix = "all"
[[support]]
at = "c"
fix = "all"
[[support]]
at = "qab@0.5"
fix = ["uy", "rx", "rz"]
[[support]]
at = "qbc@0.5"
fix = ["uy", "rx", "rz"]
[[support]]
at = "b"
fix = ["uy", "rx", "rz"]
[[load]]
at = "b"
force = [0.001, 0, -1]
[[stage]]
kind = "buckling"
modes = 3
"#;
    let [found] = critical_loads(text)[..] else { panic!("one load") };
    assert!(found.kind == CriticalKind::Limit && (found.load - 11.84).abs() < 0.02, "{found:?}");
}

/// A torque about a fixed axis turns what it buckles; its tangent is unsymmetric. Pinned ends: T = 2 pi EI/L, twice, whatever the
/// stiffness against twisting and the torque that acts already (Greenhill 1883).
#[test]
fn shafts_buckle_under_the_torque_that_twists_them() {
    let mut random = Random::new(117);
    for _ in 0..12 {
        let length = 10f64.powf(random.range(-2.0, 2.0));
        let [along, across] = random.axes();
        let aside = along.cross(across);
        let bending = 10f64.powf(random.range(-2.0, 2.0));
        let twisting = bending * 10f64.powf(random.range(-0.3, 2.0));
        let stiff = bending / (length * length) * 10f64.powf(random.range(4.0, 6.0));
        let critical = 2.0 * std::f64::consts::PI * bending / length;
        let torque = along * (critical * random.range(0.01, 0.9));
        let axes = format!("axes = [{}, {}]", list(along), list(across));
        let text = format!(
            "[point]\na = [0, 0, 0]\nb = {}\n[section.s]\nEA = {stiff}\nGA = {stiff}\nGJ = {twisting}\nEI = {bending}\n\
             [[beam]]\nname = \"s\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 6\norder = 3\naxis3 = {}\n\
             [[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\"]\n{axes}\n[[support]]\nat = \"b\"\nfix = [\"uy\", \"uz\"]\n{axes}\n\
             [[load]]\nat = \"b\"\nmoment = {}\n[[load]]\nat = \"a\"\nmoment = {}\n[[stage]]\nkind = \"static\"\nsteps = 2\n\
             [[stage]]\nkind = \"buckling\"\nmodes = 2\n",
            list(along * length),
            list(aside),
            list(torque),
            list(torque * -1.0),
        );
        let found = critical_loads(&text);
        assert_eq!(found.len(), 2, "{found:?}\n{text}");
        for found in found {
            let load = found.load * torque.norm();
            assert!((load / critical - 1.0).abs() < 2e-3, "{load} for {critical}\n{text}");
        }
    }
}

/// A ring under a pressure that follows it buckles at 3 EI/R^3, twice (Levy 1884). Two arcs of unequal elements bring the two
/// loads apart, to a pair that is not quite real.
#[test]
fn rings_of_unequal_arcs_buckle_under_following_pressure() {
    let mut random = Random::new(118);
    // The share of the first arc, elements of both, and the pressure of the static stage over EI/R^3. Near the loads of the last
    // ring the distances to them have imaginary parts of more than a thousandth.
    let rings = [
        (0.5, [20, 24], random.range(0.2, 2.5)),
        (0.5, [40, 57], random.range(0.2, 2.5)),
        (0.5, [31, 30], random.range(0.2, 2.5)),
        (0.5, [25, 25], random.range(0.2, 2.5)),
        (0.5, [80, 97], random.range(0.2, 2.5)),
        (0.379, [57, 44], 2.485),
    ];
    for (share, [first, second], pressure) in rings {
        let radius = 10f64.powf(random.range(-2.0, 2.0));
        let pressure = pressure / radius.powi(3);
        let at = |turns: f64| {
            let (sine, cosine) = (TAU * turns).sin_cos();
            format!("[{}, {}, 0]", radius * cosine, radius * sine)
        };
        let arc = |name: &str, ends: [&str; 2], middle: f64, elements: usize| {
            format!(
                "[[beam]]\nname = \"{name}\"\nsection = \"s\"\narc = [\"{}\", {}, \"{}\"]\nelements = {elements}\norder = 1\n\
                 axis3 = [0, 0, 1]\n[[load]]\nalong = \"{name}\"\nforce = [0, {pressure}, 0]\nframe = \"section\"\n",
                ends[0],
                at(middle),
                ends[1]
            )
        };
        let stiff = 4e3 / (radius * radius);
        let text = format!(
            "[point]\na = {}\nb = {}\n[section.s]\nEA = {stiff}\nGA = {stiff}\nGJ = 100\nEI = [100, 1]\n{}{}\
             [[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\"]\n[[support]]\nat = \"b\"\nfix = [\"uy\", \"uz\"]\n\
             [[stage]]\nkind = \"static\"\nsteps = 3\n[[stage]]\nkind = \"buckling\"\nmodes = 2\n",
            at(0.0),
            at(share),
            arc("first", ["a", "b"], share / 2.0, first),
            arc("second", ["b", "a"], (share + 1.0) / 2.0, second),
        );
        let found = critical_loads(&text);
        assert_eq!(found.len(), 2, "{found:?}\n{text}");
        for found in found {
            let load = found.load * pressure * radius.powi(3);
            // Chords of 20 elements are a little stiffer than the arc.
            assert!((load / 3.0 - 1.0).abs() < 0.04, "{load} for 3\n{text}");
        }
    }
}

/// A slender tie beside a column buckles where the load turns round, long before the column: the load of the column comes first.
#[test]
fn loads_above_the_present_one_are_found_beside_nearer_ones_below() {
    let mut random = Random::new(119);
    let text = deck("stability/column_beside_slender_tie.toml");
    for modes in [1, 2, 4] {
        for _ in 0..3 {
            let tie = 10f64.powf(random.range(-2.7, -1.0));
            let scene = with_modes(&text, modes).replace("1e-3", &tie.to_string());
            let found = critical_loads(&scene);
            assert_eq!(found.len(), modes, "{found:?}\n{scene}");
            let quarter = std::f64::consts::PI.powi(2) / 4.0;
            let exact = [quarter, 1.2 * quarter, 9.0 * quarter, 10.8 * quarter];
            for (found, exact) in found.iter().zip(exact) {
                assert!((found.load / exact - 1.0).abs() < 1e-3, "{tie}: {found:?} for {exact}");
            }
        }
    }
}

/// What moves goes on moving behind a stage that looks for critical loads or modes, in any chart.
#[test]
fn motions_go_on_behind_an_analysis_of_the_present_state() {
    let stages = |between: &str, cut: f64| {
        let dynamic = |end: f64| format!("[[stage]]\nkind = \"dynamic\"\nend = {end}\nstep = 0.002\n");
        let last = simulate(&format!(
            "[point]\na = [0, 0, 0]\nb = [0, 0, 1]\nc = [5, 0, 0]\n[section.s]\nEA = 200\nGA = 200\nGJ = 20\n\
             EI = [10, 20]\nrhoA = 1\n[[beam]]\nname = \"c\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 3\n\
             [[body]]\nat = \"c\"\nmass = 1\ninertia = [1, 2, 3]\n\
             [[spring]]\nat = \"c\"\nstiffness = [50, 60, 70, 1, 1, 1]\n\
             [[support]]\nat = \"a\"\nfix = \"all\"\n[[load]]\nat = \"b\"\nforce = [0, 0, -10]\n\
             [[initial]]\nat = \"b\"\nvelocity = [0.5, 0, 0]\n\
             [[initial]]\nat = \"c\"\nspin = [0, 0, 20]\nabout = \"c\"\n\
             {}{between}{}[output]\nnodes = [\"b\", \"c\"]\ncolumns = [\"u\", \"v\", \"w\"]\n",
            dynamic(cut),
            dynamic(0.4)
        ));
        last.rows[last.rows.len() - 1].clone()
    };
    // The body passes half a turn, and changes its chart, between 0.156 and 0.158.
    for cut in [0.1, 0.154, 0.156, 0.158, 0.16, 0.2] {
        let exact = stages("", cut);
        for between in ["buckling", "modal"] {
            let found = stages(&format!("[[stage]]\nkind = \"{between}\"\nmodes = 1\n"), cut);
            let off = exact.iter().zip(&found).map(|(a, b)| (a - b).abs() / (1.0 + a.abs())).fold(0.0, f64::max);
            assert!(off < 1e-9, "{between} at {cut}: {off}, {found:?} for {exact:?}");
        }
    }
}

/// A bar that heat makes longer without any stress bears every temperature.
#[test]
fn what_is_never_stressed_has_no_critical_load() {
    let random = &mut Random::new(19);
    for held in ["fix = \"all\"\n", "fix = \"pin\"\n[[support]]\nat = \"b\"\nfix = [\"uy\", \"uz\", \"rx\"]\n"] {
        for order in 1..=3 {
            let strain = 10.0_f64.powf(random.range(-6.0, -1.0));
            let text = format!(
                "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n[section.s]\nEA = 1e4\nGA = 1e4\nGJ = 10\nEI = 10\n\
                 [[beam]]\nname = \"bar\"\nsection = \"s\"\nthrough = [\"a\", \"b\"]\nelements = 4\norder = {order}\n\
                 free_strain = [{strain:e}, 0, 0, 0, 0, 0]\n[[support]]\nat = \"a\"\n{held}\
                 [[stage]]\nkind = \"buckling\"\nmodes = 1\n[output]\nnodes = [\"b\"]\n"
            );
            let run = attempt(&text);
            let why = run.result.expect_err(&text).to_string();
            assert!(why.contains("no load factor is found"), "{why}\n{text}");
            assert!(run.counters.work.iterations < 2000, "{} iterations\n{text}", run.counters.work.iterations);
        }
    }
}
