//! A run from the command line: its history, fields, modes and record are written, its progress and
//! warnings are shown.

use super::console;
use super::progress::Progress;
use super::signals;
use crate::output::{
    DeckSource, FieldsWriter, Film, FinishedRun, HistoryWriter, ModesWriter, OutputError, PartFile, ReachedAccuracy,
    Record, Row, RowCounter, Rows, SideColumns, Units, remove_fields, remove_if_there,
};
use crate::scene::Scene;
use crate::study::error_bars::ErrorBars;
use crate::study::{self, Recorder};
use beamsim_core::model::StageKind;
use beamsim_core::run::{Counters, Failure, Moment, Observer, Run, Snapshot, StageResult, Warning};
use beamsim_core::threads;
use std::path::Path;
use std::time::Instant;

/// Additions to the results of a run.
#[derive(Default)]
pub struct RunExtras {
    /// The wanted accuracy and how far it was reached
    pub accuracy: Option<ReachedAccuracy>,
    /// The outputs of the run where a search has run it already
    pub outcome: Option<study::Outcome>,
    /// Error bars
    pub bars: Option<ErrorBars>,
    /// The deck
    pub source: DeckSource,
    /// Recorder of shapes for the report
    pub film: Option<Film>,
}

/// A run that has ended.
pub struct Finished {
    /// Success, or why it failed
    pub result: Result<(), Failure>,
    /// The work it took
    pub counters: Counters,
    /// Wall-clock seconds
    pub seconds: f64,
    /// The recorded shapes
    pub film: Option<Film>,
    /// The content of run.json, where results were written
    pub record: Option<Record>,
    /// The number of threads
    pub threads: usize,
}

/// Runs a scene on a number of threads. With a folder its results are written there; a recorder
/// follows the expectations of the deck.
pub fn simulate(
    scene: &Scene,
    name: &str,
    folder: Option<&Path>,
    recorder: Option<&mut Recorder>,
    extras: RunExtras,
    threads: usize,
) -> Finished {
    let start = Instant::now();
    // From here on the run itself answers signals.
    signals::caught();
    let RunExtras { accuracy, outcome, bars, source, film } = extras;
    let opened = folder.map(|folder| open(scene, folder, bars)).transpose();
    let (writers, opened) = match opened {
        Ok(writers) => (writers, Ok(())),
        Err(error) => (None, Err(Failure::Io(error.to_string()))),
    };
    let (history, fields) = writers.map_or((None, None), |Writers { history, fields }| (Some(history), fields));
    // A film and fields need the whole state of each row, which an outcome does not have.
    let outcome = outcome.filter(|_| film.is_none() && fields.is_none());
    let mut watcher = Watcher {
        scene,
        history,
        values: Vec::new(),
        recorder,
        progress: Progress::new(name),
        time_unit: time_unit(scene),
        modes: ModesWriter::default(),
        fields,
        film,
        dynamic: are_dynamic(scene),
        rows: RowCounter::new(Rows { every: scene.every, interval: scene.plan.interval }),
    };
    let seconds_of_search = outcome.as_ref().map(|outcome| outcome.seconds);
    let threads = if seconds_of_search.is_some() { 1 } else { threads };
    let (mut result, counters) = match (opened, outcome) {
        (Err(failure), _) => (Err(failure), Counters::default()),
        (Ok(()), Some(outcome)) => watcher.replay(outcome),
        (Ok(()), None) => threads::on(threads, || Run::new(scene.plan.clone(), &mut watcher).finish()),
    };
    watcher.progress.done();
    let seconds = seconds_of_search.unwrap_or_else(|| start.elapsed().as_secs_f64());
    let mut record = None;
    if let (Some(history), Some(folder)) = (watcher.history.take(), folder) {
        let run = FinishedRun { result: &result, counters: &counters, seconds, threads, accuracy, source };
        let content = Record::of(scene, run);
        let writers = Writers { history, fields: watcher.fields.take() };
        let written = write_results(writers, &watcher.modes, folder, result.is_ok(), &content);
        record = Some(content);
        if let Err(error) = written {
            result = Err(Failure::Io(error.to_string()));
        }
    }
    Finished { result, counters, seconds, film: watcher.film, record, threads }
}

/// The files that are written row by row.
struct Writers {
    history: HistoryWriter,
    fields: Option<FieldsWriter>,
}

fn open(scene: &Scene, folder: &Path, bars: Option<ErrorBars>) -> Result<Writers, OutputError> {
    let bars = bars.map(|bars| Box::new(bars) as Box<dyn SideColumns>);
    let names = scene.probes.iter().flat_map(|probe| probe.names.clone()).collect();
    let history = HistoryWriter::create(folder, names, bars)?;
    let only_dynamic = are_dynamic(scene).into_iter().all(|dynamic| dynamic);
    let fields = scene.vtk.then(|| FieldsWriter::create(folder, scene.figure(), only_dynamic));
    Ok(Writers { history, fields: fields.transpose()? })
}

/// For each stage whether it advances time.
fn are_dynamic(scene: &Scene) -> Vec<bool> {
    scene.plan.stages.iter().map(|stage| stage.work.kind() == StageKind::Dynamic).collect()
}

/// The unit of time with a space before it, for progress lines.
fn time_unit(scene: &Scene) -> String {
    let unit = Units::of_deck(&scene.resolved).of_column("time");
    unit.map_or(String::new(), |unit| format!(" {unit}"))
}

/// Gives all results their final names. The record is on disk before any other file gets its name,
/// and gets its own name last.
fn write_results(
    writers: Writers,
    modes: &ModesWriter,
    folder: &Path,
    finished: bool,
    record: &Record,
) -> Result<(), OutputError> {
    let (part, file) = PartFile::written(folder, "run.json", record.to_string().as_bytes())?;
    writers.history.finish(finished)?;
    remove_if_there(folder, "report.html")?;
    match writers.fields {
        Some(fields) => fields.finish(finished)?,
        None => remove_fields(folder)?,
    }
    modes.finish(folder)?;
    part.finish(&file, "run.json")
}

/// Observer of a run from the command line.
struct Watcher<'r> {
    scene: &'r Scene,
    history: Option<HistoryWriter>,
    /// The numbers of the present row
    values: Vec<f64>,
    /// Follows the expectations of the deck, where these are judged
    recorder: Option<&'r mut Recorder>,
    progress: Progress,
    /// The unit of time with a space before it; empty where the deck names none
    time_unit: String,
    /// For each stage whether it advances time
    dynamic: Vec<bool>,
    rows: RowCounter,
    modes: ModesWriter,
    fields: Option<FieldsWriter>,
    film: Option<Film>,
}

impl Watcher<'_> {
    /// Writes a row of the history.
    fn write(&mut self, at: Moment, values: &[f64]) -> Result<Row, Failure> {
        let row = self.rows.next(self.dynamic[at.stage - 1], at.time);
        let column = self.history.as_mut().map_or(Ok(None), |history| history.row(at, values, row));
        match column.map_err(io_failure)? {
            Some(node) => Err(Failure::NonFinite { at, effect: Some("a column of the history"), node }),
            None => Ok(row),
        }
    }

    /// Writes the rows and repeats the warnings of a run that a search has made.
    fn replay(&mut self, outcome: study::Outcome) -> (Result<(), Failure>, Counters) {
        outcome.counters.findings.warnings.iter().for_each(|warning| self.warn(warning));
        let written = outcome.history().try_for_each(|(at, values)| self.write(at, values).map(|_| ()));
        self.modes = outcome.found;
        (written.and(outcome.ended), outcome.counters)
    }
}

impl Observer for Watcher<'_> {
    fn row(&mut self, snapshot: &Snapshot) -> Result<(), Failure> {
        self.recorder.iter_mut().for_each(|recorder| recorder.row(snapshot));
        let mut values = std::mem::take(&mut self.values);
        values.clear();
        if self.history.is_some() {
            self.scene.probes.iter().for_each(|probe| probe.read(snapshot, &mut values));
        }
        let row = self.write(snapshot.moment(), &values);
        self.values = values;
        let row = row?;
        self.film.iter_mut().for_each(|film| film.row(snapshot, row));
        self.fields.iter_mut().try_for_each(|fields| fields.row(snapshot, row)).map_err(io_failure)
    }

    fn found(&mut self, stage: usize, result: &StageResult) -> Result<(), Failure> {
        self.recorder.iter_mut().for_each(|recorder| recorder.found(result));
        self.modes.push(stage, result);
        Ok(())
    }

    fn warn(&mut self, warning: &Warning) {
        console::count_warnings(1);
        self.progress.note(&warning.to_string());
    }

    fn progress(&mut self, at: Moment, done: f64) -> Result<(), Failure> {
        let time_unit = &self.time_unit;
        self.progress.show(done, || format!("time {:.6}{time_unit}, load factor {:.4}", at.time, at.load));
        match signals::caught() {
            Some(signal) => Err(Failure::Interrupted { at, signal }),
            None => Ok(()),
        }
    }
}

fn io_failure(error: OutputError) -> Failure {
    Failure::Io(error.to_string())
}
