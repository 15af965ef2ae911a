//! Helices and splines as centre lines: orders of convergence against exact numbers.

use crate::scenes::simulate;

/// The displacement of the end of a helical spring along its axis, and the exact one.
fn spring(order: usize, elements: usize) -> f64 {
    let text = std::fs::read_to_string("decks/minimal/helix.toml").unwrap();
    let text = text.replace("elements = 20", &format!("elements = {elements}"));
    let text = text.replace("order = 3", &format!("order = {order}"));
    let simulation = simulate(&text);
    let found = simulation.end("top.uz");
    let (r, p, turns) = (1.0_f64, 0.8_f64, 2.0);
    let a = p.atan2(2.0 * std::f64::consts::PI * r);
    let length = turns * (2.0 * std::f64::consts::PI * r).hypot(p);
    let (sin2, cos2) = (a.sin() * a.sin(), a.cos() * a.cos());
    let exact = 1e-3 * length * (r * r * (cos2 / 5.0 + sin2 / 8.0) + sin2 / 2e3 + cos2 / 1e3);
    (found / exact - 1.0).abs()
}

#[test]
fn helices_converge_at_the_order_of_their_elements() {
    // Order 3 drops to four, like on arcs: see convergence.rs.
    for (order, elements, expected) in [(1, 64, 2.0), (2, 24, 4.0), (3, 32, 4.0)] {
        let errors = [elements, 2 * elements].map(|count| spring(order, count));
        let found = (errors[0] / errors[1]).log2();
        assert!((found - expected).abs() < 0.4, "order {order}: {found}, errors {errors:?}");
    }
}

#[test]
fn twenty_cubic_elements_of_a_helix_do_what_400_chords_do() {
    let chords = spring(1, 400);
    let curved = spring(3, 20);
    assert!(curved < 0.3 * chords, "{curved} against {chords}");
}

/// The displacement of the end of the spline of a deck.
fn along_spline(name: &str, order: usize, elements: usize) -> [f64; 3] {
    let text = std::fs::read_to_string(format!("decks/minimal/{name}.toml")).unwrap();
    let text = text.replace("elements = 20", &format!("elements = {elements}"));
    let simulation = simulate(&text.replace("order = 2", &format!("order = {order}")));
    ["tip.ux", "tip.uy", "tip.uz"].map(|column| simulation.end(column))
}

#[test]
fn splines_converge_at_the_order_of_their_elements() {
    let exact = [-1.6243776399013806e-5, -3.635661665643343e-5, 2.410863998346111e-4];
    let error = |order: usize, elements: usize| {
        let found = along_spline("spline_tangents", order, elements);
        (0..3).map(|k| (found[k] - exact[k]).abs()).fold(0.0, f64::max) / exact[2]
    };
    for (order, elements, expected) in [(1, 32, 2.0), (2, 32, 4.0)] {
        let errors = [elements, 2 * elements].map(|count| error(order, count));
        let found = (errors[0] / errors[1]).log2();
        assert!((found - expected).abs() < 0.8, "order {order}: {found}, errors {errors:?}");
    }
    let chords = error(1, 400);
    let curved = [error(2, 20), error(3, 20)];
    assert!(curved[0] < 0.2 * chords && curved[1] < 0.02 * chords, "{curved:?} against {chords}");
}
