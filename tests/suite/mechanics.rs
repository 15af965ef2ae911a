//! Bugs that were found by looking: each a small scene with an exact answer.

use crate::scenes::{attempt, refusal, simulate};
use beamsim_core::run::Failure;

const ROD: &str = r#"
[point]
near = [0, 0, 0]
far = [10, 0, 0]
[section.rod]
EA = 1e5
GA = 1e5
GJ = 100
EI = 1e3
rhoA = 1
[[beam]]
name = "rod"
section = "rod"
through = ["near", "far"]
elements = 4
order = 2
[[support]]
at = "near"
fix = "all"
"#;

/// Angular momentum grows with the moment: in space, not with the body.
#[test]
fn a_fixed_moment_is_fixed_under_every_scheme() {
    for scheme in ["newmark", "generalized_alpha", "lie_generalized_alpha"] {
        let simulation = simulate(&format!(
            r#"
[point]
a = [0, 0, 0]
[[body]]
at = "a"
mass = 1
inertia = [1, 1, 1]
[[initial]]
at = "a"
spin = [2, 0, 0]
[[load]]
at = "a"
moment = [0, 0, 1]
[[stage]]
kind = "dynamic"
end = 3
step = 0.01
scheme = "{scheme}"
[output]
columns = ["momentum"]
"#
        ));
        let momentum = ["lx", "ly", "lz"].map(|c| simulation.end(&format!("momentum.{c}")));
        for (came, exact) in momentum.into_iter().zip([2.0, 0.0, 3.0]) {
            assert!((came - exact).abs() < 1e-3, "{scheme}: {momentum:?}");
        }
    }
}

/// A motor that turns by 2 rad a level keeps its turns.
#[test]
fn a_motor_does_not_lose_half_turns() {
    let simulation = simulate(
        &(ROD.replace("far = [10, 0, 0]", "far = [10, 0, 0]\nend = [12, 0, 0]")
            + r#"
[[beam]]
name = "arm"
section = "rod"
through = ["far", "end"]
elements = 1
[[joint]]
kind = "revolute"
at = "far"
beams = ["rod", "arm"]
axis = [0, 0, 1]
angle = 20
[[stage]]
kind = "static"
steps = 10
[output]
nodes = ["end"]
columns = ["rc"]
"#),
    );
    assert!((simulation.end("end.rz") - 20.0).abs() < 1e-9, "{}", simulation.end("end.rz"));
}

/// Arc length goes along a prescribed rotation beyond pi as load control does.
#[test]
fn a_path_goes_around_with_its_motion() {
    let simulation = simulate(
        &(ROD.to_string()
            + r#"
[[support]]
at = "far"
fix = "pin"
[[motion]]
at = "far"
rotate = [1, 0, 0]
angle = "1.5*pi"
[[stage]]
kind = "static"
control = "arc_length"
steps = 20
[output]
nodes = ["far"]
columns = ["rc", "reaction"]
"#),
    );
    assert_eq!(simulation.end("load"), 1.0);
    let exact = 15.0 * std::f64::consts::PI;
    assert!((simulation.end("far.mx") - exact).abs() < 1e-8, "{}", simulation.end("far.mx"));
}

/// Pure twist moves nothing: what round-off moves must not steer the path.
#[test]
fn a_path_of_rotations_alone_reaches_its_load() {
    let simulation = simulate(
        &(ROD.replace("far = [10, 0, 0]", "far = [6, 8, 0]")
            + r#"
[[load]]
at = "far"
moment = [6, 8, 0]
frame = "body"
[[stage]]
kind = "static"
control = "arc_length"
steps = 10
"#),
    );
    assert_eq!(simulation.end("load"), 1.0);
    assert!(simulation.counters.findings.events.is_empty());
}

/// Beams that joints chain at one point: each hangs on the one that it names.
#[test]
fn joints_at_one_point_make_a_chain() {
    let simulation = simulate(
        r#"
[point]
a = [-1, 0, 0]
h = [0, 0, 0]
b = [0, 1, 0]
c = [1, 0, 0]
[section.s]
EA = 1e6
GA = 1e6
GJ = 1e6
EI = 1e6
[[beam]]
name = "A"
section = "s"
through = ["a", "h"]
elements = 1
[[beam]]
name = "B"
section = "s"
through = ["h", "b"]
elements = 1
[[beam]]
name = "C"
section = "s"
through = ["h", "c"]
elements = 1
[[support]]
at = "a"
fix = "all"
[[joint]]
kind = "revolute"
at = "h"
beams = ["A", "B"]
axis = [0, 0, 1]
stiffness = 1
[[joint]]
kind = "rigid"
at = "h"
beams = ["B", "C"]
[[load]]
at = "c"
moment = [0, 0, 0.5]
[[stage]]
kind = "static"
steps = 2
[output]
nodes = ["b", "c"]
"#,
    );
    for node in ["b", "c"] {
        let turned = simulation.end(&format!("{node}.rz"));
        assert!((turned - 0.5).abs() < 1e-4, "{node}: {turned}");
    }
}

/// A modal or buckling stage without anything to find says so.
#[test]
fn empty_eigenproblems_are_named() {
    for kind in ["modal", "buckling"] {
        let deck = ROD.to_string()
            + &format!("[[support]]\nat = \"far\"\nfix = \"all\"\n[[stage]]\nkind = \"{kind}\"\nmodes = 2\n");
        for deck in [deck.replace("elements = 4\norder = 2", "elements = 1"), deck] {
            // Nothing is loaded, and one element of two clamped ends has no mass that is free to move.
            if kind == "buckling" || deck.contains("elements = 1") {
                let why = refusal(&deck);
                assert!(why.contains("a buckling stage needs a load") || why.contains("needs mass"), "{why}");
            } else {
                assert!(attempt(&deck).result.is_ok());
            }
        }
    }
}

/// A modal stage only looks: loads ramp, buckle and move on as if it were not there.
#[test]
fn modal_stages_leave_everything_as_it_was() {
    let column = |stages: &str| {
        let deck = ROD.to_string() + "[[load]]\nat = \"far\"\nforce = [-1, 0, 0]\n" + stages;
        simulate(&deck)
    };
    let modal = "[[stage]]\nkind = \"modal\"\nmodes = 1\n";
    let rest = "[[stage]]\nkind = \"static\"\nsteps = 2\n";
    let plain = column(rest);
    let looked = column(&(modal.to_string() + rest));
    assert_eq!(plain.end("far.ux"), looked.end("far.ux"));
}

/// A dynamic stage never jumps: a motor must begin where its joint is.
#[test]
fn a_motor_that_would_jump_is_refused() {
    let why = refusal(
        r#"
[point]
o = [0, 0, 0]
p = [1, 0, 0]
[[body]]
at = "o"
mass = 1
inertia = [1, 1, 1]
[[body]]
at = "p"
mass = 1
inertia = [1, 1, 1]
[[support]]
at = "o"
fix = "all"
[[joint]]
kind = "revolute"
nodes = ["o", "p"]
axis = [0, 0, 1]
angle = 1
history = "h"
[history.h]
times = [0, 1]
values = [0.5, 1]
[[stage]]
kind = "dynamic"
end = 0.1
step = 0.01
scheme = "generalized_alpha"
"#,
    );
    assert!(
        why.contains("must start at 0, where the joint is, but starts at 0.5 rad (28.6°)")
            && why.contains("this stage"),
        "{why}"
    );
}

/// Two rigid joints between the same nodes: the second says nothing new, and the failure names the joint.
#[test]
fn a_condition_said_twice_names_its_joint() {
    let simulation = attempt(
        &(ROD.to_string()
            + r#"
[[body]]
at = "away"
mass = 1
[[joint]]
kind = "rigid"
nodes = ["far", "away"]
[[joint]]
kind = "rigid"
nodes = ["away", "far"]
[[load]]
at = "away"
force = [0, 0, 1]
[[stage]]
kind = "static"
steps = 2
"#)
        .replace("far = [10, 0, 0]", "far = [10, 0, 0]\naway = [10, 1, 0]"),
    );
    match &simulation.result {
        Err(failure @ Failure::Singular { place: Some(place), .. }) => {
            assert!(place.is_joint(), "{failure}");
        }
        other => panic!("{other:?}"),
    }
}

/// A beam whose section changes from station to station is the chain of tapers between them.
#[test]
fn stations_are_tapers_one_after_the_other() {
    let section =
        |name: &str, x: f64| format!("[section.{name}]\nEA = {0}\nGA = {0}\nGJ = {1}\nEI = {1}\n", 1e4 * x, 10.0 * x);
    let rest = "[[support]]\nat = \"o\"\nfix = \"all\"\n[[load]]\nat = \"p\"\nforce = [1, 2, 3]\n[[stage]]\nkind = \"static\"\nsteps = 2\n[output]\nnodes = [\"p\"]\n";
    let sections = section("a", 3.0) + &section("b", 1.0) + &section("c", 2.0);
    let one = format!(
        "[point]\no = [0, 0, 0]\np = [4, 0, 0]\n{sections}[[beam]]\nname = \"s\"\nsection = [\"a\", \"b\", \"c\"]\nstations = [0, 0.25, 1]\n\
         through = [\"o\", \"p\"]\nelements = 8\norder = 2\n{rest}"
    );
    let beam = |name: &str, ends: &str, through: &str, elements: usize| {
        format!(
            "[[beam]]\nname = \"{name}\"\nsection = {ends}\nthrough = {through}\nelements = {elements}\norder = 2\n"
        )
    };
    let two = format!(
        "[point]\no = [0, 0, 0]\nm = [1, 0, 0]\np = [4, 0, 0]\n{sections}{}{}{rest}",
        beam("s", "[\"a\", \"b\"]", "[\"o\", \"m\"]", 2),
        beam("t", "[\"b\", \"c\"]", "[\"m\", \"p\"]", 6)
    );
    let [one, two] = [one, two].map(|deck| simulate(&deck));
    for axis in ["ux", "uy", "uz", "rx", "ry", "rz"] {
        let column = format!("p.{axis}");
        let (a, b) = (one.end(&column), two.end(&column));
        assert!((a - b).abs() <= 1e-12 * (1.0 + b.abs()), "{column}: {a} against {b}");
    }
}
