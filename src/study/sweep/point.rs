//! One point of a sweep.

use crate::study::error_bars::of_expected;
use crate::study::outcome::Outcome as Run;
use crate::study::variant::Variant;
use crate::study::{Recorder, expected_values};
use beamsim_core::run::{Failure, Warning};

/// What came of a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// `finished`, or a failure's name
    pub status: String,
    /// What went wrong
    pub message: String,
    /// What was looked at; none where it failed
    pub values: Vec<f64>,
    /// Estimated errors of these, where they are wanted
    pub errors: Vec<f64>,
    /// Converged levels and steps, Newton iterations, factorisations
    pub work: [u64; 3],
    /// On the wall
    pub seconds: f64,
}

impl Outcome {
    /// The status of a point whose process was gone before it came to an end.
    pub const KILLED: &str = "killed";

    /// One without results.
    pub fn failed(status: &str, message: String) -> Self {
        Self { status: status.into(), message, ..Self::default() }
    }

    /// Whether it came to its end.
    pub fn finished(&self) -> bool {
        self.status == "finished"
    }
}

/// Runs the deck `text`, which expects what is looked at, with settings.
pub fn run(text: &str, settings: &[String], error_bars: bool, interrupted: &dyn Fn() -> Option<i32>) -> Outcome {
    match Variant::read(text, settings) {
        Ok(variant) => simulate(variant, error_bars, interrupted),
        Err(why) => Outcome::failed("deck", why),
    }
}

fn simulate(variant: Variant, error_bars: bool, interrupted: &dyn Fn() -> Option<i32>) -> Outcome {
    let Variant { text, deck, mut scene } = variant;
    // Rows of a history that nobody reads need not be kept.
    let probes = std::mem::take(&mut scene.probes);
    let run = Run::of(&scene, Some(Recorder::new(&scene)), u64::MAX, interrupted);
    scene.probes = probes;
    let counters = &run.counters;
    let outcome = Outcome {
        work: [counters.steps, counters.work.iterations, counters.work.factorisations],
        seconds: run.seconds,
        ..Outcome::default()
    };
    let failed = |failure: Failure, outcome| {
        let (status, message) = (failure.name().to_string(), failure.to_string());
        Outcome { status, message, ..outcome }
    };
    if let Err(failure) = run.ended {
        return failed(failure, outcome);
    }
    let errors = match error_bars {
        true => of_expected(&text, &deck, &scene, &run.expected, interrupted),
        false => Ok(Vec::new()),
    };
    match errors {
        Ok(errors) => {
            let expected = expected_values(&scene.expectations);
            let missed = expected.iter().zip(&run.expected).find(|(_, value)| value.is_nan());
            let missed = missed.map(|((name, _), _)| format!("`{name}` was not reached"));
            let message = missed.unwrap_or_else(|| told(&run.counters.findings.warnings));
            Outcome { status: "finished".into(), message, values: run.expected, errors, ..outcome }
        }
        // What was run is worth having without.
        Err(failure @ Failure::Interrupted { .. }) => failed(failure, outcome),
        Err(failure) => Outcome {
            status: "finished".into(),
            message: format!("no error bars: {failure}"),
            values: run.expected,
            ..outcome
        },
    }
}

/// The first warning of a run, and the names of others; nothing where there are none.
fn told(warnings: &[Warning]) -> String {
    let Some(first) = warnings.first() else { return String::new() };
    let mut names = vec![first.kind.name()];
    for warning in warnings {
        if !names.contains(&warning.kind.name()) {
            names.push(warning.kind.name());
        }
    }
    let others = &names[1..];
    if others.is_empty() { first.to_string() } else { format!("{first}; also {}", others.join(", ")) }
}
