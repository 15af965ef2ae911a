//! The policy of static stages: it comes to the right branch whatever the number of load levels, and says what it did.

use crate::scenes::{attempt, simulate};
use beamsim::drive::{EventKind, Failure};

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
    for steps in [1, 2, 3, 7, 20] {
        let simulation = simulate(&lee(&format!("steps = {steps}")));
        let uy = simulation.end("loaded.uy");
        assert!((uy + 92.7277).abs() < 2e-3, "{steps} levels: {uy}");
        let limits: Vec<f64> = simulation
            .counters
            .events
            .iter()
            .filter(|event| event.kind == EventKind::Limit)
            .map(|event| event.at.load)
            .collect();
        assert_eq!(limits.len(), 2, "{steps} levels: {limits:?}");
        assert!((limits[0] - 0.9279).abs() < 2e-3 && (limits[1] + 0.4707).abs() < 4e-3, "{limits:?}");
        let levels = simulation.column("load");
        assert_eq!(levels.last(), Some(&1.0));
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
    assert!(failure.hint().is_some_and(|hint| hint.contains("does not carry this load")));
    let most = simulation.rows.iter().map(|row| row[0]).fold(0.0, f64::max);
    assert!((most - 2.0 / 3.0).abs() < 1e-4, "the rows go to the limit: {most}");
}
