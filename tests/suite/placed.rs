//! Sections whose origin lies beside the line of the beam: stiffness and mass move and turn together.

use crate::scenes::frequencies;

/// A clamped, coupled, heavy arm; `beam` says how its section lies.
fn arm(beam: &str) -> String {
    format!(
        r#"
[point]
root = [0, 0, 0]
tip = [2, 0, 0]
[section.s]
stiffness = [
  [1e4, 0, 0, 30, 0, 0],
  [0, 4e3, 0, 0, 0, 0],
  [0, 0, 3e3, 0, 0, 0],
  [30, 0, 0, 20, 0, 0],
  [0, 0, 0, 0, 40, 5],
  [0, 0, 0, 0, 5, 90],
]
mass = [
  [2, 0, 0, 0, 0, -0.04],
  [0, 2, 0, 0, 0, 0],
  [0, 0, 2, 0.04, 0, 0],
  [0, 0, 0.04, 0.05, 0, 0],
  [0, 0, 0, 0, 0.02, 0.003],
  [-0.04, 0, 0, 0, 0.003, 0.03],
]
[[beam]]
name = "b"
section = "s"
{beam}
elements = 6
order = 2
interpolation = "total"
[[support]]
at = "b@start"
fix = "all"
[[stage]]
kind = "modal"
modes = 8
"#
    )
}

fn assert_alike(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < tolerance, "{found} against {expected}");
    }
}

/// The line of a beam is a choice: a beam drawn beside its section and moved back is the same beam,
/// clamped at the same section. Only stiffness and mass that move alike keep all frequencies.
#[test]
fn offsets_do_not_change_frequencies() {
    let plain = frequencies(&arm("through = [\"root\", \"tip\"]"));
    // Axis 2 is y and axis 3 is z.
    let beside = frequencies(&arm("through = [[0, -0.3, 0.2], [2, -0.3, 0.2]]\noffset = [0.3, -0.2]"));
    assert_alike(&beside, &plain, 1e-9);
}

/// A section turned in its axes is one whose axes are turned, whichever is turned.
#[test]
fn turns_are_twists_of_the_axes() {
    let twisted = frequencies(&arm("through = [\"root\", \"tip\"]\ntwist = [0.3, 1.2]"));
    let turned = frequencies(&arm("through = [\"root\", \"tip\"]\nturn = [0.3, 1.2]"));
    let both = frequencies(&arm("through = [\"root\", \"tip\"]\ntwist = [0.5, 0.5]\nturn = [-0.2, 0.7]"));
    assert_alike(&turned, &twisted, 1e-9);
    assert_alike(&both, &twisted, 1e-9);
    // Along axes that the twist turns, an offset turns back.
    let beside = frequencies(&arm(
        "through = [[0, -0.3, 0], [2, -0.3, 0]]\ntwist = [0.8, 0.8]\nturn = [-0.8, -0.8]\noffset = [\"0.3*cos(0.8)\", \"-0.3*sin(0.8)\"]",
    ));
    assert_alike(&beside, &frequencies(&arm("through = [\"root\", \"tip\"]")), 1e-9);
}
