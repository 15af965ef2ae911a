//! Compares the results of a run with the expectations of its deck.

use crate::deck::{Instant, Reduce, Reduction, Target, Words};
use crate::scene::{Bounds, Expectation, ExpectationKind, ModeQuantity, RunCounter, Scene};
use beamsim_core::probe::Probe;
use beamsim_core::run::{Counters, Failure, Mode, Snapshot, StageResult, Warning};
use serde::Serialize;

/// Records the expected columns of every converged state.
pub struct Recorder {
    expectations: Vec<Expectation>,
    rows: Vec<Vec<ExpectedRow>>,
    /// The probes that are read in each state; several expectations may share one
    probes: Vec<Probe>,
    /// For each expectation of a column, the number of that column among those of all probes
    places: Vec<Option<usize>>,
    scratch: Vec<f64>,
    /// Modes and critical loads of the last stages that had some
    modes: Vec<Mode>,
    critical: Vec<f64>,
    /// Warnings about the deck
    warnings: Vec<Warning>,
}

/// The value of a column in one row.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ExpectedRow {
    stage: usize,
    time: f64,
    load: f64,
    value: f64,
}

/// The judgement of an expectation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judgement {
    /// The column with its rows, the counter, the failure or the warnings
    pub what: String,
    /// The expected value
    pub expected: String,
    /// The value of the run
    pub came: String,
    /// The difference from the expected value, where there is one
    pub(crate) error: Option<f64>,
    /// The difference over the allowed one, where there is one
    pub(crate) ratio: Option<f64>,
    /// True if the expectation holds
    pub holds: bool,
}

impl Recorder {
    /// A recorder for the expectations of a scene.
    pub fn new(scene: &Scene) -> Self {
        let expectations = scene.expectations.clone();
        let rows = vec![Vec::new(); expectations.len()];
        let mut probes: Vec<Probe> = Vec::new();
        let places = expectations.iter().map(|expectation| place(expectation, &mut probes)).collect();
        Self {
            rows,
            expectations,
            probes,
            places,
            scratch: Vec::new(),
            modes: Vec::new(),
            critical: Vec::new(),
            warnings: scene.warnings.clone(),
        }
    }

    /// Takes the result of an analysis.
    pub fn found(&mut self, result: &StageResult) {
        match result {
            StageResult::Modes(modes) => self.modes.clone_from(modes),
            StageResult::CriticalLoads(loads) => self.critical = loads.iter().map(|critical| critical.load).collect(),
        }
    }

    fn mode(&self, quantity: ModeQuantity, number: usize) -> Option<f64> {
        match quantity {
            ModeQuantity::Omega => self.modes.get(number).map(|mode| mode.omega),
            ModeQuantity::Growth => self.modes.get(number).map(|mode| mode.growth),
            ModeQuantity::Load => self.critical.get(number).copied(),
        }
    }

    /// The values of the expectations of [`expected_values`], NaN where they were not reached.
    pub fn values(&self) -> Vec<f64> {
        let came = self.expectations.iter().zip(&self.rows).filter_map(|(expectation, rows)| match &expectation.kind {
            ExpectationKind::Column { reduce: how, bounds, .. } => bounds.value.map(|_| reduce(rows, *how)),
            ExpectationKind::Mode { quantity, number, bounds } => bounds.value.map(|_| self.mode(*quantity, *number)),
            ExpectationKind::Counter { .. }
            | ExpectationKind::Fails
            | ExpectationKind::Warns(_)
            | ExpectationKind::Quiet => None,
        });
        came.map(|value| value.unwrap_or(f64::NAN)).collect()
    }

    /// Takes a converged state.
    pub fn row(&mut self, at: &Snapshot) {
        self.scratch.clear();
        for probe in &self.probes {
            probe.read(at, &mut self.scratch);
        }
        let moment = |value| ExpectedRow { stage: at.stage, time: at.state.time, load: at.state.load, value };
        for ((place, rows), expectation) in self.places.iter().zip(&mut self.rows).zip(&self.expectations) {
            if matches!(expectation.kind, ExpectationKind::Column { reduce: Reduce::At(Instant::End), .. }) {
                rows.clear();
            }
            rows.extend(place.map(|place| moment(self.scratch[place])));
        }
    }
}

/// The number of an expectation's column among those of all probes. Its probe is added if it is
/// missing.
fn place(expectation: &Expectation, probes: &mut Vec<Probe>) -> Option<usize> {
    let ExpectationKind::Column { probe, component, .. } = &expectation.kind else { return None };
    let known = probes.iter().position(|known| known.names == probe.names);
    let number = known.unwrap_or(probes.len());
    if known.is_none() {
        probes.push(probe.clone());
    }
    Some(probes[..number].iter().map(|before| before.names.len()).sum::<usize>() + component)
}

/// The names and values of the expectations that have a value, counters excepted.
pub fn expected_values(expectations: &[Expectation]) -> Vec<(String, f64)> {
    let expected = expectations.iter().filter_map(|expectation| match &expectation.kind {
        ExpectationKind::Column { reduce: how, bounds, .. } => {
            Some((format!("{} {}", expectation.name, describe(how)), bounds.value?.value))
        }
        ExpectationKind::Mode { bounds, .. } => Some((expectation.name.clone(), bounds.value?.value)),
        ExpectationKind::Counter { .. }
        | ExpectationKind::Fails
        | ExpectationKind::Warns(_)
        | ExpectationKind::Quiet => None,
    });
    expected.collect()
}

/// Judges every expectation, and a failure that is not expected.
pub fn judge(recorder: &Recorder, result: &Result<(), Failure>, counters: &Counters) -> Vec<Judgement> {
    let came = result.as_ref().map_or_else(Failure::name, |()| "finished");
    let mut judgements: Vec<Judgement> = Vec::new();
    let expects_failure = recorder.expectations.iter().any(|e| matches!(e.kind, ExpectationKind::Fails));
    if let (Err(failure), false) = (result, expects_failure) {
        judgements.push(Judgement {
            what: "the run".into(),
            expected: "finished".into(),
            came: format!("{}: {failure}", failure.name()),
            error: None,
            ratio: None,
            holds: false,
        });
    }
    let warnings: Vec<&Warning> = recorder.warnings.iter().chain(&counters.findings.warnings).collect();
    for (expectation, rows) in recorder.expectations.iter().zip(&recorder.rows) {
        judgements.push(match &expectation.kind {
            ExpectationKind::Fails => expected_failure(&expectation.name, came),
            ExpectationKind::Warns(kind) => {
                expected_warning(expectation, &warnings, warnings.iter().any(|warning| warning.kind == *kind))
            }
            ExpectationKind::Quiet => {
                expected_warning(expectation, &warnings, !warnings.iter().any(|warning| warning.is_doubt()))
            }
            ExpectationKind::Counter { counter: of, bounds } => {
                hold(expectation.name.clone(), bounds, Some(counter(counters, *of) as f64))
            }
            ExpectationKind::Mode { quantity, number, bounds } => {
                hold(expectation.name.clone(), bounds, recorder.mode(*quantity, *number))
            }
            ExpectationKind::Column { reduce: how, bounds, .. } => {
                hold(format!("{} {}", expectation.name, describe(how)), bounds, reduce(rows, *how))
            }
        });
    }
    judgements
}

/// The judgement of an expected failure.
pub fn expected_failure(expected: &str, came: &str) -> Judgement {
    Judgement {
        what: "the run".into(),
        expected: expected.into(),
        came: came.into(),
        error: None,
        ratio: None,
        holds: came == expected,
    }
}

/// The judgement of expected warnings, or of their absence.
fn expected_warning(expectation: &Expectation, given: &[&Warning], holds: bool) -> Judgement {
    let mut names: Vec<&str> = given.iter().map(|warning| warning.kind.name()).collect();
    names.sort_unstable();
    names.dedup();
    Judgement {
        what: "warnings".into(),
        expected: expectation.name.clone(),
        came: if names.is_empty() { "none".into() } else { names.join(", ") },
        error: None,
        ratio: None,
        holds,
    }
}

fn counter(counters: &Counters, of: RunCounter) -> u64 {
    match of {
        RunCounter::Steps => counters.steps,
        RunCounter::Iterations => counters.work.iterations,
        RunCounter::Cutbacks => counters.cutbacks,
        RunCounter::ChartSwitches => counters.work.chart_switches,
        RunCounter::MixedElements => counters.mixed_elements,
    }
}

fn describe(reduce: &Reduce) -> String {
    match reduce {
        Reduce::At(Instant::End) => "at the end".into(),
        Reduce::At(Instant::Time(time)) => format!("at time {time}"),
        Reduce::At(Instant::Load(load)) => format!("at load {load}"),
        Reduce::Over(reduction) => reduction.word().into(),
    }
}

fn hold(what: String, bounds: &Bounds, came: Option<f64>) -> Judgement {
    let mut expected = Vec::new();
    let mut holds = true;
    let mut error = None;
    let mut ratio = None;
    let value = came.unwrap_or(f64::NAN);
    if let Some(Target { value: wanted, atol, rtol }) = bounds.value {
        expected.push(format!("{wanted}"));
        let departure = (value - wanted).abs();
        let allowed = atol + rtol * wanted.abs();
        holds &= departure <= allowed;
        error = came.map(|_| departure);
        ratio = came.map(|_| if departure == 0.0 { 0.0 } else { departure / allowed });
    }
    if let Some(bound) = bounds.below {
        expected.push(format!("< {bound}"));
        holds &= value < bound;
    }
    if let Some(bound) = bounds.above {
        expected.push(format!("> {bound}"));
        holds &= value > bound;
    }
    let came = came.map_or("was not reached".into(), |value| format!("{value:?}"));
    Judgement { what, expected: expected.join(" and "), came, error, ratio, holds }
}

fn reduce(rows: &[ExpectedRow], how: Reduce) -> Option<f64> {
    let first = rows.first()?.value;
    // The result is NaN if any value is.
    let fold = |pick: fn(f64, f64) -> f64, of: &dyn Fn(f64) -> f64| {
        rows.iter().map(|row| of(row.value)).reduce(|a, b| if a.is_nan() || b.is_nan() { f64::NAN } else { pick(a, b) })
    };
    match how {
        Reduce::Over(Reduction::Max) => fold(f64::max, &|v| v),
        Reduce::Over(Reduction::Min) => fold(f64::min, &|v| v),
        Reduce::Over(Reduction::AbsMax) => fold(f64::max, &f64::abs),
        Reduce::Over(Reduction::Drift) => fold(f64::max, &|v| (v - first).abs()),
        Reduce::Over(Reduction::Mean) => Some(rows.iter().map(|row| row.value).sum::<f64>() / rows.len() as f64),
        Reduce::At(Instant::End) => rows.last().map(|row| row.value),
        Reduce::At(Instant::Time(time)) => at_time(rows, time),
        Reduce::At(Instant::Load(load)) => at_load(rows, load),
    }
}

/// The value at a time: of the last row there, or interpolated.
fn at_time(rows: &[ExpectedRow], time: f64) -> Option<f64> {
    let slack = 1e-12 * time.abs();
    let before = rows.iter().rev().find(|row| row.time <= time + slack)?;
    if (before.time - time).abs() <= slack {
        return Some(before.value);
    }
    let after = rows.iter().find(|row| row.time > time)?;
    Some(between(time, (before.time, before.value), (after.time, after.value)))
}

/// The value where the load factor first crosses a value within a stage, from below or above.
fn at_load(rows: &[ExpectedRow], load: f64) -> Option<f64> {
    let slack = 1e-12 * load.abs().max(1.0);
    let hit = |row: &ExpectedRow| (row.load - load).abs() <= slack;
    let first = rows.first().filter(|row| hit(row)).map(|row| row.value);
    let crossing = |pair: &[ExpectedRow]| {
        let [before, after] = [pair[0], pair[1]];
        let crosses = (before.load - load) * (after.load - load) < 0.0;
        if hit(&after) {
            return Some(after.value);
        }
        crosses.then(|| between(load, (before.load, before.value), (after.load, after.value)))
    };
    // The jump of the load factor between stages is no crossing.
    let pairs = rows.windows(2).filter(|pair| pair[0].stage == pair[1].stage || hit(&pair[1]));
    first.or_else(|| pairs.into_iter().find_map(crossing))
}

fn between(x: f64, (x0, y0): (f64, f64), (x1, y1): (f64, f64)) -> f64 {
    y0 + (y1 - y0) * (x - x0) / (x1 - x0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Vec<ExpectedRow> {
        let row = |(time, load, value)| ExpectedRow { stage: 1, time, load, value };
        [(0.0, 0.0, 1.0), (0.0, 0.5, 3.0), (0.0, 1.0, 4.0), (1.0, 1.0, -6.0), (3.0, 1.0, 0.0)].map(row).to_vec()
    }

    #[test]
    fn rows_are_reduced_as_the_deck_says() {
        let value = |how| reduce(&rows(), how).unwrap();
        assert_eq!(value(Reduce::Over(Reduction::Max)), 4.0);
        assert_eq!(value(Reduce::Over(Reduction::Min)), -6.0);
        assert_eq!(value(Reduce::Over(Reduction::AbsMax)), 6.0);
        assert_eq!(value(Reduce::Over(Reduction::Mean)), 0.4);
        assert_eq!(value(Reduce::Over(Reduction::Drift)), 7.0);
        assert_eq!(value(Reduce::At(Instant::End)), 0.0);
    }

    #[test]
    fn instants_lie_between_rows() {
        let value = |instant| reduce(&rows(), Reduce::At(instant));
        assert_eq!(value(Instant::Time(0.0)), Some(4.0));
        assert_eq!(value(Instant::Time(0.5)), Some(-1.0));
        assert_eq!(value(Instant::Time(2.0)), Some(-3.0));
        assert_eq!(value(Instant::Time(4.0)), None);
        assert_eq!(value(Instant::Load(0.25)), Some(2.0));
        assert_eq!(value(Instant::Load(1.0)), Some(4.0));
        assert_eq!(value(Instant::Load(1.5)), None);
    }

    #[test]
    fn loads_are_crossed_from_above_too_but_not_between_stages() {
        let row = |(stage, load, value)| ExpectedRow { stage, time: 0.0, load, value };
        let rows = [(1, 0.0, 1.0), (1, 1.0, 5.0), (2, 0.2, 9.0), (2, -0.2, 7.0)].map(row);
        assert_eq!(at_load(&rows, 0.5), Some(3.0));
        assert_eq!(at_load(&rows, 0.0), Some(1.0));
        assert_eq!(at_load(&rows[1..], 0.5), None);
        assert_eq!(at_load(&rows[1..], -0.1), Some(7.5));
    }

    #[test]
    fn nan_holds_nothing() {
        let bounds = Bounds { value: Some(Target { value: 1.0, atol: 10.0, rtol: 0.0 }), below: None, above: None };
        assert!(!hold("x".into(), &bounds, Some(f64::NAN)).holds);
        assert!(!hold("x".into(), &bounds, None).holds);
        assert!(hold("x".into(), &bounds, Some(2.0)).holds);
    }
}
