//! One point of a sweep.

use crate::deck;
use crate::output::json::exact;
use crate::study::built::BuiltDeck;
use crate::study::error_bars::of_expected;
use crate::study::outcome::Outcome;
use crate::study::{Recorder, expected_values};
use beamsim_core::failure::FailureKind;
use beamsim_core::run::{Failure, Warning};
use serde::{Deserialize, Serialize};

/// The result of a point.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointResult {
    /// `finished`, or a failure's name
    pub(crate) status: String,
    /// The message of the failure, or the first warning
    pub(crate) message: String,
    /// The outputs; none where it failed
    #[serde(with = "exact")]
    pub(super) values: Vec<f64>,
    /// The estimated errors of the outputs, where they are wanted
    #[serde(with = "exact")]
    pub(super) errors: Vec<f64>,
    /// Converged levels and steps, Newton iterations, factorisations
    pub(super) work: [u64; 3],
    /// Wall-clock seconds
    pub(crate) seconds: f64,
    /// The number of warnings of a run that finished
    #[serde(default)]
    pub(crate) warnings: usize,
}

impl PointResult {
    /// The status of a point whose process ended without a result.
    pub const KILLED: &str = "killed";

    /// The result of a point that failed.
    pub fn failed(status: &str, message: String) -> Self {
        Self { status: status.into(), message, ..Self::default() }
    }

    /// True if the run finished.
    pub fn finished(&self) -> bool {
        self.status == "finished"
    }
}

/// Runs the deck `text`, which has an expectation for each output, with settings. These are applied
/// to the text, since users may vary anything, such as parameters that expressions depend on.
pub fn run(text: &str, settings: &[String], error_bars: bool, interrupted: &dyn Fn() -> Option<i32>) -> PointResult {
    let text = match deck::apply(text, settings) {
        Ok(text) => text,
        Err(why) => return PointResult::failed("deck", why),
    };
    match BuiltDeck::read(&text) {
        Ok(built) => simulate(&text, built, error_bars, interrupted),
        // A section that was not computed to its end is no error of the deck.
        Err(_) if interrupted().is_some() => {
            PointResult::failed(FailureKind::Interrupted.name(), "interrupted while sections were computed".into())
        }
        Err(error) => PointResult::failed(error.kind().name(), error.to_string()),
    }
}

fn simulate(text: &str, built: BuiltDeck, error_bars: bool, interrupted: &dyn Fn() -> Option<i32>) -> PointResult {
    let BuiltDeck { deck, mut scene } = built;
    // The rows of the history are not needed.
    let probes = std::mem::take(&mut scene.probes);
    let run = Outcome::of(&scene, Some(Recorder::new(&scene)), u64::MAX, interrupted);
    scene.probes = probes;
    let counters = &run.counters;
    let outcome = PointResult {
        work: [counters.steps, counters.work.iterations, counters.work.factorisations],
        seconds: run.seconds,
        warnings: counters.findings.warnings.len(),
        ..PointResult::default()
    };
    let failed = |failure: Failure, outcome| PointResult {
        status: failure.name().into(),
        message: failure.to_string(),
        ..outcome
    };
    if let Err(failure) = run.ended {
        return failed(failure, outcome);
    }
    let errors = if error_bars { of_expected(text, &deck, &scene, &run.expected, interrupted) } else { Ok(Vec::new()) };
    match errors {
        Ok(errors) => {
            let expected = expected_values(&scene.expectations);
            let missed = expected.iter().zip(&run.expected).find(|(_, value)| value.is_nan());
            let missed = missed.map(|((name, _), _)| format!("`{name}` was not reached"));
            let message = missed.unwrap_or_else(|| summary(&run.counters.findings.warnings));
            PointResult { status: "finished".into(), message, values: run.expected, errors, ..outcome }
        }
        Err(failure @ Failure::Interrupted { .. }) => failed(failure, outcome),
        // The outputs are valid without error bars.
        Err(failure) => PointResult {
            status: "finished".into(),
            message: format!("no error bars: {failure}"),
            values: run.expected,
            ..outcome
        },
    }
}

/// The first warning of a run and the names of other kinds; empty without warnings.
fn summary(warnings: &[Warning]) -> String {
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
