//! Orders of convergence in element size and time step, against theory.

use crate::scenes::{bend45, distance, simulate};

/// The 45-degree bend drawn from root to tip.
fn bend(order: usize, elements: usize, interpolation: &str) -> [f64; 3] {
    bend45(order, elements, ["root", "tip"], interpolation)
}

const INTERPOLATIONS: [&str; 2] = ["total", "relative"];

/// The limit of fine meshes, from an independent boundary-value solution.
const LIMIT: [f64; 3] = [-23.813908521750506, -13.728996477183344, 53.60485845715535];

/// log2 of the ratio of the errors on two meshes, the second twice as fine.
fn observed_order(order: usize, elements: usize, interpolation: &str) -> f64 {
    let error = |n: usize| distance(bend(order, n, interpolation), LIMIT);
    (error(elements) / error(2 * elements)).log2()
}

#[test]
fn two_node_elements_are_of_order_two() {
    for interpolation in INTERPOLATIONS {
        let order = observed_order(1, 16, interpolation);
        assert!((order - 2.0).abs() < 0.05, "{interpolation}: {order}");
    }
}

#[test]
fn three_node_elements_are_of_order_four() {
    for interpolation in INTERPOLATIONS {
        let order = observed_order(2, 8, interpolation);
        assert!((order - 4.0).abs() < 0.15, "{interpolation}: {order}");
    }
}

/// On the arc the error falls with the sixth power until the interpolated geometry shows: equally spaced nodes of a cubic
/// leave an area between arc and curve whose mean does not vanish, an error of order four with a small factor.
#[test]
fn four_node_elements_are_of_order_six_on_coarse_arcs() {
    for interpolation in INTERPOLATIONS {
        let error = |n: usize| {
            let tip = bend(3, n, interpolation);
            (0..3).map(|k| (tip[k] - LIMIT[k]) * (tip[k] - LIMIT[k])).sum::<f64>().sqrt()
        };
        let order = (error(3) / error(6)).log2();
        assert!((order - 6.0).abs() < 0.35, "{interpolation}: {order}");
        let fine = (error(8) / error(16)).log2();
        assert!((fine - 4.0).abs() < 0.3, "{interpolation}: {fine}");
    }
}

/// A straight cantilever under a force across and a moment about its axis.
fn straight(elements: usize) -> [f64; 3] {
    let text = format!(
        r#"
[point]
root = [0, 0, 0]
tip = [10, 0, 0]
[section.s]
EA = 1e4
GA = 5e3
GJ = 300
EI = 500
[[beam]]
name = "b"
section = "s"
through = ["root", "tip"]
elements = {elements}
order = 3
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [0, 8, 12]
moment = [60, 0, 0]
frame = "body"
[[stage]]
kind = "static"
steps = 4
tolerance = 1e-12
"#
    );
    simulate(&text).vector("tip.u")
}

#[test]
fn four_node_elements_are_of_order_six_on_straight_beams() {
    let limit = straight(32);
    let order = (distance(straight(4), limit) / distance(straight(8), limit)).log2();
    assert!((order - 6.0).abs() < 0.3, "{order}");
}

/// A fast top that leans by 0.3: its rotation vector changes the chart several times.
fn top(step: f64) -> ([f64; 3], u64) {
    let text = format!(
        r#"
gravity = [0, 0, -20]
[point]
pin = [0, 0, 0]
[[body]]
at = "pin"
mass = 1
offset = [0, "-sin(0.3)", "cos(0.3)"]
inertia = [[4, 0, 0], [0, "4-3*sin(0.3)^2", "3*sin(0.3)*cos(0.3)"], [0, "3*sin(0.3)*cos(0.3)", "4-3*cos(0.3)^2"]]
[[support]]
at = "pin"
fix = "pin"
[[initial]]
spin = [0, "-50*sin(0.3)", "50*cos(0.3)"]
[[stage]]
kind = "dynamic"
end = 0.4
step = {step}
tolerance = 1e-12
[output]
columns = ["momentum"]
"#
    );
    let simulation = simulate(&text);
    (simulation.vector("momentum.c"), simulation.counters.work.chart_switches)
}

#[test]
fn newmark_is_of_order_two_across_chart_switches() {
    let [(a, switches), (b, _), (c, _)] = [0.001, 0.0005, 0.00025].map(top);
    assert_eq!(switches, 3, "0.4 * 50 rad are three turns and a bit");
    let order = (distance(a, b) / distance(b, c)).log2();
    assert!((order - 2.0).abs() < 0.1, "{order}");
}

/// A cantilever that swings far under a suddenly applied force.
fn swing(step: f64) -> [f64; 3] {
    let text = format!(
        r#"
[point]
root = [0, 0, 0]
tip = [10, 0, 0]
[section.s]
EA = 1e4
GA = 1e4
GJ = 500
EI = 500
rhoA = 1
rhoJ = [2, 1, 1]
[[beam]]
name = "b"
section = "s"
through = ["root", "tip"]
elements = 2
order = 3
[[support]]
at = "root"
fix = "all"
[[load]]
at = "tip"
force = [0, 4, 6]
history = "push"
[history.push]
times = [0, 4]
values = [0, 1]
smooth = true
[[stage]]
kind = "dynamic"
end = 3
step = {step}
tolerance = 1e-12
"#
    );
    simulate(&text).vector("tip.u")
}

#[test]
fn newmark_is_of_order_two_for_beams() {
    let [a, b, c] = [0.05, 0.025, 0.0125].map(swing);
    assert!(distance(c, [0.0; 3]) > 1.0, "the beam does not swing far: {c:?}");
    let order = (distance(a, b) / distance(b, c)).log2();
    assert!((order - 2.0).abs() < 0.1, "{order}");
}
