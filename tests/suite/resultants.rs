//! Strains and stress resultants along beams: in balance with reactions, and of higher order than the strains that
//! elements have at their points.

use super::folder::{Folder, status};
use crate::random::Random;
use crate::scenes::{Simulation, list, simulate};
use beamsim_core::tensor::Vec3;
use std::collections::HashMap;
use std::fs;

const SECTION: &str =
    "[section.s]\nEA = 1e5\nGA = [2e4, 3e4]\nGJ = 8\nEI = [10, 20]\nrhoA = 1\nrhoJ = [2e-3, 1e-3, 1e-3]\n";

const STATIC: &str = "[[stage]]\nkind = \"static\"\nsteps = 4\n";

const PLACES: [&str; 5] = ["a", "arm@0.25", "arm@0.3", "arm@0.5", "b"];

/// A beam that is clamped at its start, with elements of an order.
struct Cantilever<'a> {
    /// Its centre line
    line: String,
    interpolation: &'a str,
    /// Tables of loads and others
    rest: String,
}

impl Cantilever<'_> {
    /// A run with columns at places.
    fn run(&self, order: usize, elements: usize, places: &[&str], columns: &str, stages: &str) -> Simulation {
        simulate(&self.deck(order, elements, places, columns, stages))
    }

    fn deck(&self, order: usize, elements: usize, places: &[&str], columns: &str, stages: &str) -> String {
        let Self { line, interpolation, rest } = self;
        format!(
            "[effects]\nplanar = false\n{SECTION}[[beam]]\nname = \"arm\"\nsection = \"s\"\n{line}elements = {elements}\n\
             order = {order}\ninterpolation = \"{interpolation}\"\n[[support]]\nat = \"a\"\nfix = \"all\"\n{rest}\
             [output]\nnodes = {places:?}\ncolumns = {columns}\n{stages}"
        )
    }

    /// Forces and moments (local axes) at all places at the end of a run.
    fn resultants(&self, order: usize, elements: usize, stages: &str) -> Vec<[f64; 6]> {
        let run = self.run(order, elements, &PLACES, "[\"resultant\"]", stages);
        PLACES.iter().map(|place| resultant(&run, place)).collect()
    }
}

fn resultant(run: &Simulation, place: &str) -> [f64; 6] {
    ["N1", "N2", "N3", "M1", "M2", "M3"].map(|name| run.end(&format!("{place}.{name}")))
}

/// A straight beam along x with `loads`.
fn straight(loads: &str, interpolation: &'static str) -> Cantilever<'static> {
    let line = "through = [\"a\", \"b\"]\n".to_string();
    let points = "[point]\na = [0, 0, 0]\nb = [1, 0, 0]\n";
    Cantilever { line, interpolation, rest: format!("{points}{loads}") }
}

/// The largest difference of forces, and of moments, at all places.
fn differences(a: &[[f64; 6]], b: &[[f64; 6]]) -> [f64; 2] {
    let largest = |part: std::ops::Range<usize>| {
        let all = a.iter().zip(b).flat_map(|(a, b)| part.clone().map(|k| (a[k] - b[k]).abs()));
        all.fold(0.0, f64::max)
    };
    [largest(0..3), largest(3..6)]
}

/// The order by which an error falls where elements are halved.
fn order_of(errors: [f64; 2]) -> f64 {
    (errors[0] / errors[1]).log2()
}

/// Under loads at nodes forces and moments at a clamp are those of the reaction.
#[test]
fn resultants_at_clamps_are_reactions() {
    let mut random = Random::new(7);
    for trial in 0..12 {
        let order = 1 + trial % 3;
        let [axis, side] = random.axes();
        let [a, b] = [random.vector(1.0), axis];
        let middle = a + axis * 0.5 + side * 0.2;
        let lines = [
            format!("through = [\"a\", \"b\"]\ntwist = [0, {}]\n", random.range(-1.0, 1.0)),
            format!("arc = [\"a\", {}, \"b\"]\n", list(middle)),
        ];
        let [force, moment] = [list(random.cube(6.0)), list(random.cube(2.0))];
        let points = format!("[point]\na = {}\nb = {}\n", list(a), list(a + b));
        let loads = format!("[[load]]\nat = \"b\"\nforce = {force}\nmoment = {moment}\n");
        let beam = Cantilever {
            line: lines[trial / 3 % 2].clone(),
            interpolation: ["relative", "total"][trial % 2],
            rest: format!("{points}{loads}"),
        };
        let run = beam.run(order, 6, &["a"], "[\"reaction\", \"resultant\"]", STATIC);
        let found = resultant(&run, "a");
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let [f, m] = ["a.f", "a.m"].map(|name| norm(&run.vector(name)));
        // Between points resultants are turned by interpolated curvatures, whose errors fall with the order.
        let allowed = [2e-3, 1e-4, 1e-5][order - 1];
        assert!((norm(&found[..3]) / f - 1.0).abs() < allowed, "order {order}: {found:?}, {f}");
        assert!((norm(&found[3..]) / m - 1.0).abs() < allowed, "order {order}: {found:?}, {m}");
    }
}

/// Strains of elements have the order of the elements away from their points; moments gain an order, and with two nodes
/// forces gain one, also where forces act along the beam.
#[test]
fn resultants_gain_an_order() {
    let loads = "[[load]]\nat = \"b\"\nforce = [0, 8, 2]\nmoment = [0.3, 0, 0]\n\
                 [[load]]\nalong = \"arm\"\nforce = [-5, 9, 4]\n";
    for interpolation in ["relative", "total"] {
        let beam = straight(loads, interpolation);
        let exact = beam.resultants(3, 80, STATIC);
        for (order, wanted) in [(1, [1.8, 1.8]), (2, [1.8, 2.8]), (3, [2.4, 3.7])] {
            let errors = [8, 16].map(|elements| differences(&beam.resultants(order, elements, STATIC), &exact));
            for (kind, name) in [(0, "forces"), (1, "moments")] {
                let observed = order_of([errors[0][kind], errors[1][kind]]);
                assert!(observed > wanted[kind], "{interpolation}, order {order}, {name}: {observed}, {errors:?}");
            }
        }
        let [force, moment] = differences(&beam.resultants(1, 16, STATIC), &exact);
        assert!(force < 0.05 && moment < 5e-3, "{interpolation}: {force}, {moment}");
    }
}

/// Forces at nodes are not taken for forces along the beam, also where each node has one.
#[test]
fn forces_at_nodes_stay_at_nodes() {
    let all = |nodes: usize| -> String {
        let load = |k: usize| format!("[[load]]\nat = \"arm@{}\"\nforce = [0.05, 0.01, 0]\n", k as f64 / nodes as f64);
        (1..=nodes).map(load).collect()
    };
    let beam = straight(&all(8), "relative");
    let run = beam.run(1, 8, &["a", "arm@0.45", "b"], "[\"resultant\"]", STATIC);
    for (column, expected) in
        [("a.N1", 0.4), ("a.N2", 0.08), ("arm@0.45.N1", 0.25), ("arm@0.45.M3", 0.015), ("b.N1", 0.05)]
    {
        assert!((run.end(column) / expected - 1.0).abs() < 0.02, "{column}: {} instead of {expected}", run.end(column));
    }
    let one = "[[load]]\nat = \"arm@0.25\"\nforce = [0, 1, 0]\n[[load]]\nat = \"b\"\nforce = [0, 1e-3, 0]\n";
    for elements in [4, 8] {
        let run = straight(one, "relative").run(1, elements, &["a", "b"], "[\"resultant\"]", STATIC);
        let [root, tip] = ["a.N2", "b.N2"].map(|name| run.end(name));
        assert!((root - 1.001).abs() < 1e-3 && (tip - 1e-3).abs() < 1e-5, "{elements}: {root}, {tip}");
    }
}

/// The force at the top of what hangs; a beam of a single element shows its mean.
#[test]
fn forces_along_a_beam_reach_its_ends() {
    let hanging = straight("[[load]]\nalong = \"arm\"\nforce = [1, 0, 0]\n", "relative");
    let top = |elements| hanging.run(1, elements, &["a"], "[\"resultant\"]", STATIC).end("a.N1");
    for (elements, expected) in [(1, 0.5), (2, 1.0), (3, 1.0), (9, 1.0)] {
        assert!((top(elements) - expected).abs() < 1e-4, "{elements}: {}", top(elements));
    }
}

/// Strains are those of the resultants, with the free strain.
#[test]
fn strains_belong_to_resultants() {
    let loads = "[[load]]\nat = \"b\"\nforce = [0, 8, 2]\n[[load]]\nalong = \"arm\"\nforce = [-5, 9, 4]\n";
    for order in 1..=3 {
        let mut beam = straight(loads, "relative");
        beam.line += "free_strain = [0, 0, 0, 0.1, 0.2, -0.3]\n";
        let run = beam.run(order, 6, &PLACES, "[\"resultant\", \"strain\"]", STATIC);
        let stiffness = [1e5, 2e4, 3e4, 8.0, 10.0, 20.0];
        let free = [0.0, 0.0, 0.0, 0.1, 0.2, -0.3];
        for place in PLACES {
            let stress = resultant(&run, place);
            let strain = ["G1", "G2", "G3", "K1", "K2", "K3"].map(|name| run.end(&format!("{place}.{name}")));
            for k in 0..6 {
                let off = stiffness[k] * (strain[k] - free[k]) - stress[k];
                assert!(off.abs() < 1e-8, "order {order}, {place}: {stress:?}, {strain:?}");
            }
        }
    }
}

/// Damping of shear alone: the elastic force lags behind a load that grows, and the moment is that of the whole force.
#[test]
fn moments_balance_with_damping_forces() {
    let beam = straight(
        "[damping]\nstiffness = [0.5, 0.5, 0.5, 0, 0, 0]\n[history.ramp]\ntimes = [0, 4]\nvalues = [0, 1]\n\
         [[load]]\nat = \"b\"\nforce = [0, 0.1, 0]\nhistory = \"ramp\"\n",
        "relative",
    );
    let stage = "[[stage]]\nkind = \"dynamic\"\nend = 4\nstep = 0.02\nscheme = \"generalized_alpha\"\nrho_inf = 0\n";
    for order in 1..=3 {
        let run = beam.run(order, 2, &["a"], "[\"resultant\"]", stage);
        let [force, moment] = ["a.N2", "a.M3"].map(|name| run.end(name));
        assert!((force / 0.1 - 0.875).abs() < 0.01, "order {order}: {force}");
        assert!((moment / 0.1 - 1.0).abs() < 0.01, "order {order}: {moment}");
    }
}

/// A beam that ends where another one goes on, with a third one listed between them, and a beam that is pressed on a ball:
/// what others do at a node is not taken for a force along the beam.
#[test]
fn neighbours_are_elements_of_the_beam() {
    let beam = |name: &str, ends: &str, elements: usize| {
        format!("[[beam]]\nname = \"{name}\"\nsection = \"s\"\nthrough = {ends}\nelements = {elements}\norder = 1\n")
    };
    let start = "[point]\na = [0, 0, 0]\nb = [0.25, 0, 0]\nc = [1, 0, 0]\nd = [0, 0, 3]\ne = [1, 0, 3]\n";
    let others = beam("other", "[\"d\", \"e\"]", 3) + &beam("rest", "[\"b\", \"c\"]", 3);
    let scene = format!(
        "[effects]\nplanar = false\n{SECTION}{start}{}{others}[[support]]\nat = \"a\"\nfix = \"all\"\n[[support]]\nat = \"d\"\nfix = \"all\"\n\
         [[load]]\nat = \"c\"\nforce = [0, 1, 0]\n[[load]]\nat = \"e\"\nforce = [0, -7, 2]\n\
         [output]\nnodes = [\"first@0.9\", \"rest@0.1\", \"other@0.5\"]\ncolumns = [\"resultant\"]\n{STATIC}",
        beam("first", "[\"a\", \"b\"]", 1)
    );
    let run = simulate(&scene);
    for (column, expected) in [("first@0.9.N2", 1.0), ("rest@0.1.N2", 1.0), ("other@0.5.N2", -7.0)] {
        assert!((run.end(column) / expected - 1.0).abs() < 0.03, "{column}: {}", run.end(column));
    }
    let ball = "[[surface]]\nname = \"ball\"\nkind = \"sphere\"\nat = [0.3, 0.2, 0]\nradius = 0.15\n\
                [[contact]]\nname = \"touch\"\nbeams = [\"arm\"]\nsurfaces = [\"ball\"]\nradius = 0.04\n[[load]]\nat = \"b\"\nforce = [0, 8, 0]\n";
    let run = straight(ball, "relative").run(1, 4, &["a"], "[\"resultant\", \"reaction\"]", &STATIC.replace("4", "20"));
    let [shear, reaction] = ["a.N2", "a.fy"].map(|name| run.end(name));
    assert!(reaction > 1.0 && (shear / -reaction - 1.0).abs() < 0.1, "{shear}, {reaction}");
}

/// The envelope of a beam with a moment in its middle: both sides have half of it.
#[test]
fn envelopes_take_both_sides_of_a_node() {
    let folder = Folder::new("envelope_of_jump");
    let deck = "[point]\na = [0, 0, 0]\nm = [1, 0, 0]\nb = [2, 0, 0]\n[material.steel]\nE = 2e11\nnu = 0.3\nrho = 7850\n\
        [section.s]\nmaterial = \"steel\"\nshape = \"rectangle\"\nwidth = 0.1\nheight = 0.1\n[[beam]]\nname = \"arm\"\nsection = \"s\"\n\
        through = [\"a\", \"m\", \"b\"]\nelements = [1, 1]\n[[support]]\nat = \"a\"\nfix = [\"ux\", \"uy\", \"uz\", \"rx\"]\n\
        [[support]]\nat = \"b\"\nfix = [\"uy\", \"uz\"]\n[[load]]\nat = \"m\"\nmoment = [0, 0, 1000]\n\
        [output]\nnodes = [\"m\"]\nenvelope = true\n[[stage]]\nkind = \"static\"\nsteps = 2\n";
    folder.write("deck.toml", deck);
    let run = folder.beamsim(&["run", "deck.toml", "--out", "out"]);
    assert_eq!(status(&run), 0, "{}", String::from_utf8_lossy(&run.stderr));
    let table = fs::read_to_string(folder.0.join("out/stress.csv")).unwrap();
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let at = names.iter().position(|name| *name == "vm").unwrap();
    let largest = lines.map(|line| line[at].parse::<f64>().unwrap()).fold(0.0, f64::max);
    // M / W with W = b h^2 / 6
    let expected = 500.0 * 6.0 / 1e-3;
    assert!((largest / expected - 1.0).abs() < 0.01, "{largest} for {expected}");
}

/// Rows of a table with columns of text and numbers.
fn table(folder: &Folder, file: &str) -> Vec<HashMap<String, String>> {
    let text = fs::read_to_string(folder.0.join(file)).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_string).collect::<Vec<_>>());
    let names = lines.next().unwrap();
    lines.map(|line| names.iter().cloned().zip(line).collect()).collect()
}

/// A frame of two legs, as one beam with a corner and as two beams that meet there: each leg has the same resultants and
/// stresses, also at the corner, in its own axes. A couple beside it makes the moment jump: both sides have a row.
#[test]
fn both_sides_of_a_corner_and_of_a_couple_are_written() {
    let mut random = Random::new(98);
    for order in 1..=3 {
        let [along, aside] = random.axes();
        let places = [Vec3::ZERO, along * 0.4, along * 0.4 + aside * 0.5, along * 0.4 + aside];
        let points: String =
            ["a", "k", "c", "b"].iter().zip(places).map(|(name, at)| format!("{name} = {}\n", list(at))).collect();
        let beam = |name: &str, through: &str| {
            let elements = "2, ".repeat(through.matches(',').count());
            format!(
                "[[beam]]\nname = \"{name}\"\nsection = \"s\"\nthrough = {through}\nelements = [{elements}]\norder = {order}\n\
                 axis3 = {}\n",
                list(along.cross(aside))
            )
        };
        let rest = format!(
            "[[support]]\nat = \"a\"\nfix = \"all\"\n[[load]]\nat = \"b\"\nforce = {}\n[[load]]\nat = \"c\"\nmoment = {}\n\
             [output]\nnodes = [\"b\"]\nenvelope = true\nprofile = true\n[[stage]]\nkind = \"static\"\nsteps = 1\n",
            list(random.vector(10.0)),
            list(random.vector(8.0))
        );
        let head = format!(
            "[point]\n{points}[material.steel]\nE = 2e11\nnu = 0.3\n\
             [section.s]\nmaterial = \"steel\"\nshape = \"rectangle\"\nwidth = 0.02\nheight = 0.03\n"
        );
        let folder = Folder::new(&format!("both_sides_{order}"));
        folder.write("one.toml", &format!("{head}{}{rest}", beam("leg", "[\"a\", \"k\", \"c\", \"b\"]")));
        let two = [beam("first", "[\"a\", \"k\"]"), beam("second", "[\"k\", \"c\", \"b\"]")].concat();
        folder.write("two.toml", &format!("{head}{two}{rest}"));
        for name in ["one", "two"] {
            let run = folder.beamsim(&["run", &format!("{name}.toml"), "--out", name]);
            assert_eq!(status(&run), 0, "{}", String::from_utf8_lossy(&run.stderr));
        }
        let [one, two] = ["one", "two"].map(|name| table(&folder, &format!("{name}/profile.csv")));
        assert_eq!(one.len(), two.len());
        let columns = ["N1", "N2", "N3", "M1", "M2", "M3", "vm"];
        for (a, b) in one.iter().zip(&two) {
            let [a, b] = [a, b].map(|row| columns.map(|name| row[name].parse::<f64>().unwrap()));
            for k in 0..7 {
                let size = if k < 6 { 10.0 } else { 1e6 };
                assert!((a[k] - b[k]).abs() < 1e-6 * size, "order {order}, {}: {a:?} {b:?}", columns[k]);
            }
        }
        // One row at a node where nothing acts, two at the corner and at the couple, where M jumps by its size.
        let rows = |length: f64| -> Vec<Vec3> {
            let is_there =
                |row: &&HashMap<String, String>| (row["length"].parse::<f64>().unwrap() - length).abs() < 1e-9;
            let moment =
                |row: &HashMap<String, String>| Vec3(["M1", "M2", "M3"].map(|name| row[name].parse().unwrap()));
            one.iter().filter(is_there).map(moment).collect()
        };
        assert_eq!([0.2, 0.4, 0.65].map(|length| rows(length).len()), [1, 2, 1], "order {order}");
        let couple = rows(0.9);
        assert_eq!(couple.len(), 2, "order {order}");
        let jump = (couple[1] - couple[0]).norm();
        assert!((jump - 8.0).abs() < 0.02, "order {order}: {jump}");
        let largest = |name: &str| {
            let values = table(&folder, &format!("{name}/stress.csv")).into_iter();
            values.map(|row| row["vm"].parse::<f64>().unwrap()).fold(0.0, f64::max)
        };
        let [one, two] = [largest("one"), largest("two")];
        assert!((one / two - 1.0).abs() < 1e-6, "order {order}: {one} {two}");
    }
}

/// Two beams on one line, of which a light one carries a heavy one at their common nodes: each keeps its own shear, also
/// where they have one element a span.
#[test]
fn beams_on_one_line_carry_each_other() {
    let section = |name: &str, size: f64, mass: f64| {
        format!(
            "[section.{name}]\nEA = {0:e}\nGA = {0:e}\nGJ = {1:e}\nEI = {1:e}\nrhoA = {mass}\n",
            1e7 * size,
            1e4 * size
        )
    };
    let beam = |name: &str| {
        format!(
            "[[beam]]\nname = \"{name}\"\nsection = \"{name}\"\nthrough = [\"a\", \"b\", \"c\"]\nelements = [1, 1]\n"
        )
    };
    let deck = format!(
        "gravity = [0, 0, -9.81]\n[point]\na = [0, 0, 0]\nb = [1, 0, 0]\nc = [2, 0, 0]\n{}{}{}{}\
         [[support]]\nat = \"a\"\nfix = \"all\"\n[output]\nnodes = [\"stiff@0.05\", \"stiff@0.95\"]\ncolumns = [\"resultant\"]\n{STATIC}",
        section("stiff", 1.0, 0.0),
        section("soft", 1e-5, 5.0),
        beam("stiff"),
        beam("soft")
    );
    let run = simulate(&deck);
    // The soft beam rests on its nodes: half of its weight at the end, all of a span in the middle.
    for (column, spans) in [("stiff@0.05.N3", 1.5), ("stiff@0.95.N3", 0.5)] {
        let expected = -5.0 * 9.81 * spans;
        assert!((run.end(column) / expected - 1.0).abs() < 1e-3, "{column}: {} for {expected}", run.end(column));
    }
}

/// Error bars hold the errors of resultants, and are not many times as long.
#[test]
fn error_bars_hold_the_errors_of_resultants() {
    let folder = Folder::new("error_bars_of_resultants");
    let beam = straight("[[load]]\nalong = \"arm\"\nforce = [-5, 9, 4]\n", "relative");
    let exact = beam.run(3, 80, &["a", "arm@0.5"], "[\"resultant\"]", STATIC);
    for order in 1..=3 {
        folder.write("deck.toml", &beam.deck(order, 8, &["a", "arm@0.5"], "[\"resultant\"]", STATIC));
        let run = folder.beamsim(&["run", "deck.toml", "--error-bars", "--out", "out"]);
        assert_eq!(status(&run), 0, "{}", String::from_utf8_lossy(&run.stderr));
        let history = fs::read_to_string(folder.0.join("out/history.csv")).unwrap();
        let [names, last] = [history.lines().next(), history.lines().last()].map(|line| line.unwrap().split(','));
        let row: HashMap<&str, f64> = names.zip(last.map(|value| value.parse().unwrap())).collect();
        for column in ["a.N2", "a.M3", "arm@0.5.N2", "arm@0.5.M3"] {
            let error = (row[column] - exact.end(column)).abs();
            let bar = row[&*format!("{column}.err")];
            assert!(
                error <= bar && bar < 8.0 * error + 0.01 * row[column].abs(),
                "order {order}, {column}: {error:e}, {bar:e}"
            );
        }
    }
}

/// Strains of tapered and twisted beams are resultants over the stiffness of the section at their place, plus the free
/// strain there, at nodes and between them, with elements of all orders, in linear and other stages.
#[test]
fn strains_belong_to_the_section_at_their_place() {
    let mut random = Random::new(99);
    for number in 0..12 {
        let sections: Vec<[f64; 6]> =
            (0..2).map(|_| [1e5, 2e4, 3e4, 8.0, 10.0, 20.0].map(|size| size * random.range(0.2, 3.0))).collect();
        let section = |name: &str, [ea, ga2, ga3, gj, ei2, ei3]: [f64; 6]| {
            format!("[section.{name}]\nEA = {ea}\nGA = [{ga2}, {ga3}]\nGJ = {gj}\nEI = [{ei2}, {ei3}]\n")
        };
        let free: Vec<f64> = (0..6).map(|k| random.range(-1.0, 1.0) * if k < 3 { 1e-2 } else { 0.5 }).collect();
        let places = [0.0, 0.5, 0.6, 1.0];
        let nodes = places.map(|place| format!("arm@{place}"));
        let deck = format!(
            "{}{}[[beam]]\nname = \"arm\"\nsection = [\"s\", \"t\"]\nthrough = [[0, 0, 0], {}]\nelements = 4\norder = {}\n\
             twist = [0, {}]\nfree_strain = {free:?}\nhistory = \"h\"\n[history.h]\ntimes = [0, 1]\nvalues = [0, 0.5]\n[[support]]\nat = \"arm@start\"\nfix = \"all\"\n\
             [[load]]\nat = \"arm@end\"\nforce = {}\nmoment = {}\n{STATIC}[effects]\nlarge_rotations = {}\n\
             [output]\nnodes = {nodes:?}\ncolumns = [\"resultant\", \"strain\"]\n",
            section("s", sections[0]),
            section("t", sections[1]),
            list(random.direction()),
            1 + number % 3,
            random.range(-1.5, 1.5),
            list(random.vector(1.0)),
            list(random.vector(0.5)),
            number < 6,
        );
        let run = simulate(&deck);
        for (place, node) in places.iter().zip(&nodes) {
            for (k, (strain, resultant)) in
                ["G1", "G2", "G3", "K1", "K2", "K3"].into_iter().zip(["N1", "N2", "N3", "M1", "M2", "M3"]).enumerate()
            {
                let stiffness = sections[0][k] * (1.0 - place) + sections[1][k] * place;
                let expected = run.end(&format!("{node}.{resultant}")) / stiffness + 0.5 * free[k];
                let found = run.end(&format!("{node}.{strain}"));
                assert!((found - expected).abs() < 1e-11, "{strain} at {node}: {found} for {expected}\n{deck}");
            }
        }
    }
}
