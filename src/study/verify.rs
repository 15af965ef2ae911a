//! Expectations held against a run.

use crate::deck::{Instant, Reduce};
use crate::scene::{Bounds, Expectation, ExpectationKind, ModeQuantity, Scene};
use beamsim_core::probe::Probe;
use beamsim_core::run::{Counters, Failure, Mode, Snapshot, StageResult, Warning};

/// Follows the expected columns through every converged state.
pub struct Recorder {
    expectations: Vec<Expectation>,
    rows: Vec<Vec<Row>>,
    /// What is read in each state; several expectations may be about one quantity
    probes: Vec<Probe>,
    /// Of each expectation that has a column, its place among the columns of all probes
    places: Vec<Option<usize>>,
    scratch: Vec<f64>,
    /// Of the last stages that had some
    modes: Vec<Mode>,
    critical: Vec<f64>,
    /// About the deck
    warnings: Vec<Warning>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Row {
    stage: usize,
    time: f64,
    load: f64,
    value: f64,
}

/// What became of an expectation.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// Column, counter, failure or warnings, and where it was looked at
    pub what: String,
    /// What was expected
    pub expected: String,
    /// What came
    pub came: String,
    /// The departure from the expected value, where there is one
    pub error: Option<f64>,
    /// The departure over the allowed one, where there is one
    pub ratio: Option<f64>,
    /// Whether it holds
    pub holds: bool,
}

impl Recorder {
    /// For the expectations of a scene.
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

    /// What came of each expectation that has a value, NaN where it was not reached; in the order of [`expected_values`].
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
        let moment = |value| Row { stage: at.stage, time: at.state.time, load: at.state.load, value };
        for ((place, rows), expectation) in self.places.iter().zip(&mut self.rows).zip(&self.expectations) {
            if matches!(expectation.kind, ExpectationKind::Column { reduce: Reduce::At(Instant::End), .. }) {
                rows.clear();
            }
            rows.extend(place.map(|place| moment(self.scratch[place])));
        }
    }
}

/// The place of an expectation's column among those of all probes, to which its own is added where it is not there.
fn place(expectation: &Expectation, probes: &mut Vec<Probe>) -> Option<usize> {
    let ExpectationKind::Column { probe, component, .. } = &expectation.kind else { return None };
    let known = probes.iter().position(|known| known.names == probe.names);
    let number = known.unwrap_or(probes.len());
    if known.is_none() {
        probes.push(probe.clone());
    }
    Some(probes[..number].iter().map(|before| before.names.len()).sum::<usize>() + component)
}

/// What is expected of a run, and the values: of those expectations that name one, but for counters.
pub fn expected_values(expectations: &[Expectation]) -> Vec<(String, f64)> {
    let expected = expectations.iter().filter_map(|expectation| match &expectation.kind {
        ExpectationKind::Column { reduce: how, bounds, .. } => {
            Some((format!("{} {}", expectation.name, describe(how)), bounds.value?.0))
        }
        ExpectationKind::Mode { bounds, .. } => Some((expectation.name.clone(), bounds.value?.0)),
        ExpectationKind::Counter { .. }
        | ExpectationKind::Fails
        | ExpectationKind::Warns(_)
        | ExpectationKind::Quiet => None,
    });
    expected.collect()
}

/// Judges every expectation; a failure that nobody expected is judged too.
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
            ExpectationKind::Counter { name, bounds } => {
                hold(expectation.name.clone(), bounds, Some(counter(counters, name) as f64))
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

/// The judgement of expected warnings, or of none.
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

fn counter(counters: &Counters, name: &str) -> u64 {
    match name {
        "steps" => counters.steps,
        "iterations" => counters.work.iterations,
        "cutbacks" => counters.cutbacks,
        "chart_switches" => counters.work.chart_switches,
        _ => counters.mixed_elements,
    }
}

fn describe(reduce: &Reduce) -> String {
    match reduce {
        Reduce::At(Instant::End) => "at the end".into(),
        Reduce::At(Instant::Time(time)) => format!("at time {time}"),
        Reduce::At(Instant::Load(load)) => format!("at load {load}"),
        how => how.word().into(),
    }
}

fn hold(what: String, bounds: &Bounds, came: Option<f64>) -> Judgement {
    let mut expected = Vec::new();
    let (mut holds, mut error, mut ratio) = (true, None, None);
    let value = came.unwrap_or(f64::NAN);
    if let Some((wanted, atol, rtol)) = bounds.value {
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

fn reduce(rows: &[Row], how: Reduce) -> Option<f64> {
    let first = rows.first()?.value;
    // A value that is not a number must not be passed over.
    let fold = |pick: fn(f64, f64) -> f64, of: &dyn Fn(f64) -> f64| {
        rows.iter().map(|row| of(row.value)).reduce(|a, b| if a.is_nan() || b.is_nan() { f64::NAN } else { pick(a, b) })
    };
    match how {
        Reduce::Max => fold(f64::max, &|v| v),
        Reduce::Min => fold(f64::min, &|v| v),
        Reduce::AbsMax => fold(f64::max, &f64::abs),
        Reduce::Drift => fold(f64::max, &|v| (v - first).abs()),
        Reduce::Mean => Some(rows.iter().map(|row| row.value).sum::<f64>() / rows.len() as f64),
        Reduce::At(Instant::End) => rows.last().map(|row| row.value),
        Reduce::At(Instant::Time(time)) => at_time(rows, time),
        Reduce::At(Instant::Load(load)) => at_load(rows, load),
    }
}

/// The last row at that time, or between the two rows around it.
fn at_time(rows: &[Row], time: f64) -> Option<f64> {
    let slack = 1e-12 * time.abs();
    let before = rows.iter().rev().find(|row| row.time <= time + slack)?;
    if (before.time - time).abs() <= slack {
        return Some(before.value);
    }
    let after = rows.iter().find(|row| row.time > time)?;
    Some(between(time, (before.time, before.value), (after.time, after.value)))
}

/// The first crossing of a load factor within a stage, from below or above.
fn at_load(rows: &[Row], load: f64) -> Option<f64> {
    let slack = 1e-12 * load.abs().max(1.0);
    let hit = |row: &Row| (row.load - load).abs() <= slack;
    let first = rows.first().filter(|row| hit(row)).map(|row| row.value);
    let crossing = |pair: &[Row]| {
        let [before, after] = [pair[0], pair[1]];
        let crosses = (before.load - load) * (after.load - load) < 0.0;
        match hit(&after) {
            true => Some(after.value),
            false => crosses.then(|| between(load, (before.load, before.value), (after.load, after.value))),
        }
    };
    // From one stage to the next the load factor jumps; what stands at that moment is no crossing.
    let pairs = rows.windows(2).filter(|pair| pair[0].stage == pair[1].stage || hit(&pair[1]));
    first.or_else(|| pairs.into_iter().find_map(crossing))
}

fn between(x: f64, (x0, y0): (f64, f64), (x1, y1): (f64, f64)) -> f64 {
    y0 + (y1 - y0) * (x - x0) / (x1 - x0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Vec<Row> {
        let row = |(time, load, value)| Row { stage: 1, time, load, value };
        [(0.0, 0.0, 1.0), (0.0, 0.5, 3.0), (0.0, 1.0, 4.0), (1.0, 1.0, -6.0), (3.0, 1.0, 0.0)].map(row).to_vec()
    }

    #[test]
    fn rows_are_reduced_as_the_deck_says() {
        let value = |how| reduce(&rows(), how).unwrap();
        assert_eq!(value(Reduce::Max), 4.0);
        assert_eq!(value(Reduce::Min), -6.0);
        assert_eq!(value(Reduce::AbsMax), 6.0);
        assert_eq!(value(Reduce::Mean), 0.4);
        assert_eq!(value(Reduce::Drift), 7.0);
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
        let row = |(stage, load, value)| Row { stage, time: 0.0, load, value };
        let rows = [(1, 0.0, 1.0), (1, 1.0, 5.0), (2, 0.2, 9.0), (2, -0.2, 7.0)].map(row);
        assert_eq!(at_load(&rows, 0.5), Some(3.0));
        assert_eq!(at_load(&rows, 0.0), Some(1.0));
        assert_eq!(at_load(&rows[1..], 0.5), None);
        assert_eq!(at_load(&rows[1..], -0.1), Some(7.5));
    }

    #[test]
    fn nan_holds_nothing() {
        let bounds = Bounds { value: Some((1.0, 10.0, 0.0)), below: None, above: None };
        assert!(!hold("x".into(), &bounds, Some(f64::NAN)).holds);
        assert!(!hold("x".into(), &bounds, None).holds);
        assert!(hold("x".into(), &bounds, Some(2.0)).holds);
    }
}
