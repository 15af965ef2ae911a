//! Graded meshes: elements that end at given places are those of as many pieces, and converge at their order.

use crate::scenes::{Simulation, distance, refusal, simulate};

const ORDERS: [usize; 3] = [1, 2, 3];
const INTERPOLATIONS: [&str; 2] = ["total", "relative"];

/// The places where elements of the graded mesh end.
const ENDS: [f64; 3] = [0.1, 0.25, 0.6];

/// A twisted, tapered arm in space under all that acts along a beam, statics and then motion. `beam` gives its line and elements.
fn arm(beam: &str, order: usize, interpolation: &str) -> Simulation {
    simulate(&format!(
        r#"
gravity = [0, 0, -9.81]
[point]
root = [0, 0, 0]
tip = [2, 1, 0]
[section.thick]
EA = 2e4
GA = [8e3, 7e3]
GJ = 60
EI = [80, 90]
rhoA = 2
rhoJ = [0.02, 0.01, 0.01]
[section.thin]
EA = 1e4
GA = [4e3, 3e3]
GJ = 30
EI = [40, 50]
rhoA = 1
rhoJ = [0.01, 0.005, 0.005]
[[beam]]
name = "arm"
section = ["thick", "thin"]
{beam}
order = {order}
interpolation = "{interpolation}"
twist = [0, 0.4]
free_strain = [0, 0, 0, 0, 0, 0.05]
[damping]
mass = 0.1
stiffness = 0.001
[[support]]
at = "root"
fix = "all"
[[load]]
along = "arm"
force = [0, 3, 1]
frame = "section"
[[load]]
at = "arm@0.25"
force = [0, 4, 6]
[[load]]
at = "tip"
moment = [2, 1, 3]
[[stage]]
kind = "static"
steps = 4
tolerance = 1e-12
[[stage]]
kind = "dynamic"
end = 0.05
step = 0.005
tolerance = 1e-12
[output]
nodes = ["arm@0.25", "arm@0.4", "arm:1", "tip"]
columns = ["u", "r", "v", "strain", "resultant", "energy"]
"#
    ))
}

fn list(places: &[f64]) -> String {
    format!("[{places:?}]")
}

/// The same elements as pieces of a straight line.
fn pieces(places: &[f64]) -> String {
    let corners: Vec<String> = places.iter().map(|t| format!("[{}, {}, 0]", 2.0 * t, t)).collect();
    format!("through = [\"root\", {}, \"tip\"]\nelements = 1", corners.join(", "))
}

/// The rows of the static stage with the start.
const STATIC_ROWS: usize = 5;

/// The largest difference of columns whose names end so, in the first rows, over the largest value of the column.
fn largest_difference(a: &Simulation, b: &Simulation, endings: &[&str], rows: usize) -> f64 {
    assert_eq!((&a.names, a.rows.len()), (&b.names, b.rows.len()));
    let of_column = |name: &String| {
        let own = &a.column(name)[..rows];
        let other = &b.column(name)[..rows];
        let size = own.iter().fold(1e-3_f64, |size, value| size.max(value.abs()));
        own.iter().zip(other).map(|(x, y)| (x - y).abs() / size).fold(0.0, f64::max)
    };
    let is_of = |name: &&String| endings.iter().any(|ending| name.ends_with(ending));
    a.names.iter().filter(is_of).map(of_column).fold(0.0, f64::max)
}

/// Asserts that two runs of an arm are equal but for round-off, which stresses and motions amplify.
fn assert_equal(a: &Simulation, b: &Simulation, what: &str) {
    let motions = largest_difference(a, b, &[".ux", ".uy", ".uz", ".rx", ".ry", ".rz"], STATIC_ROWS);
    assert!(motions < 1e-11, "{what}: {motions:e} in statics");
    let all = largest_difference(a, b, &[""], a.rows.len());
    assert!(all < 1e-8, "{what}: {all:e}");
}

#[test]
fn graded_elements_are_those_of_as_many_pieces() {
    for order in ORDERS {
        for interpolation in INTERPOLATIONS {
            let graded = format!("through = [\"root\", \"tip\"]\nelements = {}", list(&ENDS));
            let graded = arm(&graded, order, interpolation);
            let pieces = arm(&pieces(&ENDS), order, interpolation);
            assert_equal(&graded, &pieces, &format!("order {order}, {interpolation}"));
        }
    }
}

#[test]
fn equal_elements_at_listed_places_are_equal_elements() {
    for order in ORDERS {
        let of =
            |elements: &str| arm(&format!("through = [\"root\", \"tip\"]\nelements = {elements}"), order, "relative");
        assert_equal(&of("4"), &of("[[0.25, 0.5, 0.75]]"), &format!("order {order}"));
        assert_eq!(of("4\ngrading = 1").rows, of("4").rows, "order {order}");
    }
}

/// A quarter circle in three beams, or in one with the same elements.
fn bow(beams: &str) -> [f64; 3] {
    let text = format!(
        r#"
[point]
root = [1, 0, 0]
a = ["cos(18*deg)", "sin(18*deg)", 0]
b = ["cos(45*deg)", "sin(45*deg)", 0]
tip = [0, 1, 0]
[section.s]
EA = 1e4
GA = 5e3
GJ = 20
EI = [30, 40]
{beams}
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [5, 3, 20]
[[stage]]
kind = "static"
steps = 3
tolerance = 1e-12
"#
    );
    simulate(&text).vector("tip.u")
}

#[test]
fn graded_elements_of_an_arc_are_those_of_as_many_arcs() {
    for order in ORDERS {
        let beam = |name: &str, start: &str, middle: f64, end: &str, elements: &str| {
            format!(
                "[[beam]]\nname = \"{name}\"\nsection = \"s\"\norder = {order}\nelements = {elements}\naxis3 = [0, 0, 1]\n\
                 arc = [\"{start}\", [\"cos({middle}*deg)\", \"sin({middle}*deg)\", 0], \"{end}\"]\n"
            )
        };
        let graded = bow(&beam("one", "root", 30.0, "tip", "[[0.2, 0.5]]"));
        let parts = [
            beam("one", "root", 9.0, "a", "1"),
            beam("two", "a", 30.0, "b", "1"),
            beam("three", "b", 60.0, "tip", "1"),
        ];
        let apart = distance(graded, bow(&parts.concat()));
        assert!(apart < 1e-12, "order {order}: {apart:e}");
    }
}

/// A stretched strip whose curvature decays from the clamp.
fn strip(elements: &str, order: usize, interpolation: &str) -> [f64; 3] {
    let text = format!(
        r#"
[point]
root = [0, 0, 0]
tip = [1, 0, 0]
[section.s]
EA = 1e5
GA = 1e5
GJ = 10
EI = 10
[[beam]]
name = "b"
section = "s"
through = ["root", "tip"]
elements = {elements}
order = {order}
interpolation = "{interpolation}"
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [1000, 500, 300]
[[stage]]
kind = "static"
steps = 2
tolerance = 1e-13
"#
    );
    simulate(&text).vector("tip.u")
}

#[test]
fn graded_elements_converge_at_their_order() {
    for interpolation in INTERPOLATIONS {
        let limit = strip("64\ngrading = 6", 3, interpolation);
        for (order, count, within) in [(1, 64, 0.1), (2, 12, 0.3), (3, 6, 0.6)] {
            let error = |count: usize| distance(strip(&format!("{count}\ngrading = 6"), order, interpolation), limit);
            let observed = (error(count) / error(2 * count)).log2();
            assert!((observed - 2.0 * order as f64).abs() < within, "{interpolation}, order {order}: {observed}");
            assert!(error(count) < distance(strip(&count.to_string(), order, interpolation), limit));
        }
    }
}

#[test]
fn names_of_places_follow_the_elements() {
    let text = |elements: &str, at: &str| {
        format!(
            "[point]\nroot = [0, 0, 0]\nknee = [1, 0, 0]\ntip = [3, 0, 0]\n\
             [section.s]\nEA = 1e4\nGA = 1e4\nGJ = 10\nEI = 10\n\
             [[beam]]\nname = \"b\"\nsection = \"s\"\nthrough = [\"root\", \"knee\", \"tip\"]\n{elements}\n\
             [[support]]\nat = \"root\"\nfix = \"all\"\n[[load]]\nat = \"{at}\"\nforce = [1, 0, 0]\n\
             [[stage]]\nkind = \"static\"\nsteps = 1\n[output]\nnodes = [\"{at}\"]\n"
        )
    };
    // A force of 1 stretches each unit of length by 1e-4. The second piece is twice as long as the first.
    let stretched = |elements: &str, at: &str, place: f64| {
        let end = simulate(&text(elements, at)).end(&format!("{at}.ux"));
        assert!((end - 1e-4 * place).abs() < 1e-9, "{elements} {at}: {end}");
    };
    stretched("elements = [[0.2, 0.7], 3]", "b:2", 0.7);
    stretched("elements = [[0.2, 0.7], 3]", "b:4", 1.0 + 2.0 / 3.0);
    stretched("elements = [[0.2, 0.7], [0.25]]\norder = 2", "b:8", 1.5);
    stretched("elements = [[0.25]]", "b@0.5", 1.5);
    stretched("elements = 2\ngrading = [4, 0.25]", "b:1", 1.0 / 3.0);
    stretched("elements = 2\ngrading = [4, 0.25]", "b:3", 1.0 + 4.0 / 3.0);
    stretched("elements = [[0.25], 4]\nnumbering = [[0.25], [0.5, 0.75]]", "b:3", 2.0);
    let help = refusal(&text("elements = [[0.2, 0.7], [0.3]]", "b@0.5"));
    assert!(help.contains("let an element end there: at 0.250000000 of piece 2"), "{help}");
}
