//! A run of a scene with all its outputs.

use crate::deck::{Diagnostic, Spanned, is_named, nearest};
use crate::output::{HistoryReader, ModesWriter};
use crate::scene::Scene;
use crate::study::Recorder;
use crate::study::strains::StrainRecord;
use beamsim_core::run::{Counters, Failure, Moment, Observer, Run, Snapshot, Stage, StageResult};
use std::time::Instant;

/// The clock of a row in its stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::study) struct StageClock {
    /// The stage, from 1
    pub(super) stage: usize,
    /// The time, or in static stages the load factor
    pub(super) clock: f64,
}

/// The outputs of a run, and the work it took.
#[derive(Clone)]
pub struct Outcome {
    /// Success, or why it failed
    pub(crate) ended: Result<(), Failure>,
    /// For each stage: true if its clock is the time
    dynamic: Vec<bool>,
    /// The moment of each row
    moments: Vec<Moment>,
    /// The columns of the history, row by row
    pub(in crate::study) rows: Vec<Vec<f64>>,
    /// Modes and critical loads, for their files
    pub(crate) found: ModesWriter,
    /// Modes and critical loads, for the columns after those of the history
    pub(in crate::study) modes: Vec<f64>,
    /// The values of expectations, where a recorder was given
    pub(in crate::study) expected: Vec<f64>,
    /// Attempts at steps and levels
    pub(in crate::study) attempts: u64,
    /// The work it took
    pub(crate) counters: Counters,
    /// Wall-clock seconds
    pub(crate) seconds: f64,
    /// Strains along beams, where a record was given
    pub(in crate::study) strains: Option<StrainRecord>,
}

impl Outcome {
    /// Runs a scene. It fails after more than `most_attempts` attempts at steps and levels. A
    /// recorder follows the expectations of the deck.
    pub(in crate::study) fn of(
        scene: &Scene,
        recorder: Option<Recorder>,
        most_attempts: u64,
        interrupted: &dyn Fn() -> Option<i32>,
    ) -> Self {
        Self::with_strains(scene, recorder, None, most_attempts, interrupted)
    }

    /// Runs a scene likewise, and records its strains where a record is given.
    pub(in crate::study) fn with_strains(
        scene: &Scene,
        recorder: Option<Recorder>,
        strains: Option<StrainRecord>,
        most_attempts: u64,
        interrupted: &dyn Fn() -> Option<i32>,
    ) -> Self {
        let mut collector = OutputCollector {
            scene,
            recorder,
            strains,
            moments: Vec::new(),
            rows: Vec::new(),
            found: ModesWriter::default(),
            modes: Vec::new(),
            attempts: 0,
            most_attempts,
            interrupted,
        };
        let start = Instant::now();
        let (ended, counters) = Run::new(scene.plan.clone(), &mut collector).finish();
        let seconds = start.elapsed().as_secs_f64();
        let OutputCollector { recorder, strains, moments, rows, found, modes, attempts, .. } = collector;
        let expected = recorder.map_or(Vec::new(), |recorder| recorder.values());
        let dynamic = are_dynamic(scene);
        Self { ended, dynamic, moments, rows, found, modes, expected, attempts, counters, seconds, strains }
    }

    /// The rows of a run that finished, without its other results.
    pub(in crate::study) fn of_rows(scene: &Scene, moments: Vec<Moment>, rows: Vec<Vec<f64>>) -> Self {
        Self {
            ended: Ok(()),
            dynamic: are_dynamic(scene),
            moments,
            rows,
            found: ModesWriter::default(),
            modes: Vec::new(),
            expected: Vec::new(),
            attempts: 0,
            counters: Counters::default(),
            seconds: 0.0,
            strains: None,
        }
    }

    /// The rows of the history, with their moments.
    pub fn history(&self) -> impl Iterator<Item = (Moment, &[f64])> {
        self.moments.iter().zip(&self.rows).map(|(&at, row)| (at, &row[..]))
    }

    /// The clock of a row.
    pub(in crate::study) fn clock(&self, row: usize) -> StageClock {
        self.clock_at(&self.moments[row])
    }

    fn clock_at(&self, &Moment { stage, time, load }: &Moment) -> StageClock {
        StageClock { stage, clock: if self.is_dynamic(stage) { time } else { load } }
    }

    /// The clocks of all rows.
    pub(in crate::study) fn clocks(&self) -> impl Iterator<Item = StageClock> {
        self.moments.iter().map(|at| self.clock_at(at))
    }

    fn is_dynamic(&self, stage: usize) -> bool {
        self.dynamic.get(stage.wrapping_sub(1)) == Some(&true)
    }

    /// Its size in numbers, with clocks and lists.
    pub(in crate::study) fn size(&self) -> usize {
        self.rows.len() * (12 + self.rows.first().map_or(0, Vec::len))
    }
}

/// Clocks that differ relatively by less than this are equal.
const SAME: f64 = 1e-9;

/// The absolute tolerance of a clock.
fn slack(clock: f64) -> f64 {
    SAME * clock.abs().max(SAME)
}

/// The rows of a run at an instant of a stage.
pub(in crate::study) enum Presence {
    /// A row at the instant, by its number
    Row(usize),
    /// No row at the instant, but later ones
    Between,
    /// The stage ended before the instant
    Over,
}

impl Outcome {
    /// The number of the row at a clock, not before row `from`.
    pub(in crate::study) fn row_at(&self, from: usize, StageClock { stage, clock }: StageClock) -> Option<usize> {
        let hit = |at: &Moment| at.stage == stage && (self.clock_at(at).clock - clock).abs() <= slack(clock);
        self.moments[from..].iter().position(hit).map(|after| from + after)
    }

    /// The rows at a clock, not before row `from`.
    pub(in crate::study) fn presence(&self, from: usize, StageClock { stage, clock }: StageClock) -> Presence {
        let first = from + self.moments[from..].partition_point(|at| at.stage < stage);
        let end = first + self.moments[first..].partition_point(|at| at.stage == stage);
        // Times only rise, while load factors may fall along a path.
        let rises = self.is_dynamic(stage);
        let before = |at: &Moment| rises && self.clock_at(at).clock < clock - slack(clock);
        let begin = first + self.moments[first..end].partition_point(before);
        let last = if rises { end.min(begin + 1) } else { end };
        let here = |at: &Moment| (self.clock_at(at).clock - clock).abs() <= slack(clock);
        match self.moments[begin..last].iter().position(here) {
            Some(after) => Presence::Row(begin + after),
            None if begin < end => Presence::Between,
            None => Presence::Over,
        }
    }

    /// A stored history as the outcome of a run. Columns of the scene that it lacks are NaN.
    pub(in crate::study) fn of_table(scene: &Scene, table: &HistoryReader) -> Self {
        let find = |name: &str| table.names.iter().position(|known| known == name);
        let places: Vec<Option<usize>> = columns(scene).iter().map(|name| find(name)).collect();
        let cell = |row: &Vec<f64>, place: Option<usize>| place.and_then(|k| row.get(k)).copied();
        let number = |row: &Vec<f64>, name: &str| cell(row, find(name)).unwrap_or(f64::NAN);
        let stage = |row: &Vec<f64>| cell(row, find("stage")).map_or(1, |stage| stage as usize);
        let moment =
            |row: &Vec<f64>| Moment { stage: stage(row), time: number(row, "time"), load: number(row, "load") };
        let history = &places[..columns_of_history(scene)];
        let row = |row: &Vec<f64>| history.iter().map(|&place| cell(row, place).unwrap_or(f64::NAN)).collect();
        Self {
            ended: Ok(()),
            dynamic: are_dynamic(scene),
            moments: table.rows.iter().map(moment).collect(),
            rows: table.rows.iter().map(row).collect(),
            found: ModesWriter::default(),
            modes: vec![f64::NAN; places.len() - history.len()],
            expected: Vec::new(),
            attempts: 0,
            counters: Counters::default(),
            seconds: 0.0,
            strains: None,
        }
    }
}

/// For each stage: true if its clock is the time.
fn are_dynamic(scene: &Scene) -> Vec<bool> {
    scene.plan.stages.iter().map(|stage| stage.work.kind().advances_time()).collect()
}

/// The names of all outputs: the columns of the history, then modes and critical loads, stage by
/// stage.
pub(in crate::study) fn columns(scene: &Scene) -> Vec<String> {
    let mut columns: Vec<String> = scene.probes.iter().flat_map(|probe| probe.names.clone()).collect();
    columns.extend(scene.plan.stages.iter().enumerate().flat_map(|(k, stage)| columns_of(k + 1, stage)));
    columns
}

/// The number of a column that a deck names.
pub(in crate::study) fn find_column(columns: &[String], name: &Spanned<String>) -> Result<usize, Diagnostic> {
    columns.iter().position(|column| is_named(column, &name.value)).ok_or_else(|| {
        let diagnostic =
            Diagnostic::error(format!("`{}` is not a column of the history", name.value), name.span.clone());
        match nearest(&name.value, columns.iter().map(String::as_str)) {
            Some(meant) => diagnostic.help(format!("did you mean `{meant}`?")),
            None => diagnostic.help("columns are chosen in [output]"),
        }
    })
}

/// The number of columns of the history.
pub(in crate::study) fn columns_of_history(scene: &Scene) -> usize {
    scene.probes.iter().map(|probe| probe.names.len()).sum()
}

/// The columns of the modes or critical loads of a stage (from 1).
fn columns_of(number: usize, stage: &Stage) -> Vec<String> {
    stage.work.results().into_iter().map(|result| format!("stage{number}.{result}")).collect()
}

/// Observer that collects all outputs.
struct OutputCollector<'a> {
    scene: &'a Scene,
    recorder: Option<Recorder>,
    strains: Option<StrainRecord>,
    moments: Vec<Moment>,
    rows: Vec<Vec<f64>>,
    found: ModesWriter,
    modes: Vec<f64>,
    attempts: u64,
    most_attempts: u64,
    interrupted: &'a dyn Fn() -> Option<i32>,
}

impl OutputCollector<'_> {
    /// Adds a number for each mode column of a stage (from 1), NaN for modes that were not found.
    fn take_modes(&mut self, stage: usize, mut found: Vec<f64>) {
        found.resize(columns_of(stage, &self.scene.plan.stages[stage - 1]).len(), f64::NAN);
        self.modes.extend(found);
    }
}

impl Observer for OutputCollector<'_> {
    fn row(&mut self, at: &Snapshot) -> Result<(), Failure> {
        let mut row = Vec::new();
        self.scene.probes.iter().for_each(|probe| probe.read(at, &mut row));
        self.moments.push(at.moment());
        self.rows.push(row);
        self.recorder.iter_mut().for_each(|recorder| recorder.row(at));
        self.strains.iter_mut().for_each(|strains| strains.row(self.scene, at));
        Ok(())
    }

    fn found(&mut self, stage: usize, result: &StageResult) -> Result<(), Failure> {
        self.recorder.iter_mut().for_each(|recorder| recorder.found(result));
        self.found.push(stage, result);
        self.take_modes(stage, result.values());
        Ok(())
    }

    fn progress(&mut self, at: Moment, _done: f64) -> Result<(), Failure> {
        self.attempts += 1;
        match (self.interrupted)() {
            Some(signal) => Err(Failure::Interrupted { at, signal }),
            None if self.attempts > self.most_attempts => Err(Failure::Limit(format!(
                "stopped at {at} after {} attempted steps, far more than the scene should need",
                self.most_attempts
            ))),
            None => Ok(()),
        }
    }
}
