//! `beamsim run`

use super::accuracy::{Aimed, Target};
use super::progress::Progress;
use super::{Status, Verdict, json, load, on_threads, report, say, signals, threads_of};
use crate::output::{
    Beside, FieldsWriter, Film, HistoryWriter, ModesWriter, Outcome, PartFile, Reached, Record, Row, RowCounter, Rows,
    remove_fields, remove_if_there,
};
use crate::scene::Scene;
use crate::study::error_bars::ErrorBars;
use crate::study::{self, Recorder};
use beamsim_core::failure::FailureKind;
use beamsim_core::run::{Counters, Failure, Moment, Observer, Run, Snapshot, StageResult, Warning};
use beamsim_core::threads;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Runs decks one after the other; where an accuracy is wanted, after a search for elements and steps.
pub fn run(decks: &[PathBuf], settings: &[String], target: &Target, out: Option<&Path>) -> Status {
    let mut verdict = Verdict::default();
    if refuse_twins(decks, &mut verdict) {
        return verdict.finish(1);
    }
    for (number, path) in decks.iter().enumerate() {
        let name = load::name(path);
        match target.aim(&name, path, settings) {
            Ok(Aimed { text, scene, reached, missed, outcome, bars, film }) => {
                let folder = folder(out, &name, decks.len() > 1);
                let beyond = Beyond { reached, outcome, bars, text, film };
                let threads = threads_of(&scene, target.threads);
                let mut finished = simulate(&scene, &name, Some(&folder), None, beyond, threads);
                summarise(&name, &scene, &finished, &folder);
                finished.record.iter().for_each(|record| json::run(path, &folder, record));
                if let (Some(film), Some(record)) = (finished.film.take(), finished.record.take()) {
                    let page = folder.join("report.html");
                    let written = report::write(&scene, &name, &record, film, &folder, &page);
                    written.unwrap_or_else(|refusal| verdict.refuse(refusal));
                }
                match (&finished.result, missed) {
                    (Err(failure), _) => verdict.fail(finished.status(), failure.name(), failure.to_string()),
                    (Ok(()), Some(missed)) => verdict.fail(Status::Missed, "accuracy", missed),
                    (Ok(()), None) => {}
                }
            }
            Err(refusal) => verdict.refuse(refusal),
        }
        if let Some(signal) = signals::caught() {
            if number + 1 < decks.len() {
                verdict.fail(
                    Status::after(signal),
                    FailureKind::Interrupted.name(),
                    format!("stopped by signal {signal}"),
                );
            }
            break;
        }
    }
    verdict.finish(decks.len())
}

/// Whether results of decks would overwrite each other, which is said.
pub fn refuse_twins(decks: &[PathBuf], verdict: &mut Verdict) -> bool {
    let Some(twin) = twin(decks) else { return false };
    let message = format!("two decks are called `{twin}`: their results would overwrite each other");
    verdict.fail(Status::Wrong, "usage", message);
    true
}

/// A name that two decks share.
fn twin(decks: &[PathBuf]) -> Option<String> {
    let names: Vec<String> = decks.iter().map(|deck| load::name(deck)).collect();
    names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)).map(|(_, name)| name.clone())
}

/// Where the results of a deck go.
pub fn folder(out: Option<&Path>, name: &str, several: bool) -> PathBuf {
    match out {
        Some(folder) if several => folder.join(name),
        Some(folder) => folder.into(),
        None => Path::new("results").join(name),
    }
}

/// A run that has ended.
pub struct Finished {
    /// How
    pub result: Result<(), Failure>,
    /// With what work
    pub counters: Counters,
    /// Wall-clock seconds
    pub seconds: f64,
    /// What filmed it
    pub film: Option<Film>,
    /// What stands in run.json
    pub record: Option<Record>,
    /// The threads it had
    pub threads: usize,
}

impl Finished {
    /// The exit status that belongs to it.
    pub fn status(&self) -> Status {
        self.result.as_ref().map_or_else(Status::of_failure, |()| Status::Fine)
    }
}

/// What watches a run from the command line.
struct Watcher<'r> {
    scene: &'r Scene,
    history: Option<HistoryWriter>,
    /// The numbers of a row
    values: Vec<f64>,
    /// What is expected on the way, where that is judged
    recorder: Option<&'r mut Recorder>,
    progress: Progress,
    dynamic: Vec<bool>,
    rows: RowCounter,
    modes: ModesWriter,
    fields: Option<FieldsWriter>,
    film: Option<Film>,
}

impl Watcher<'_> {
    /// A row of the history.
    fn write(&mut self, at: Moment, values: &[f64]) -> Result<Row, Failure> {
        let row = self.rows.next(self.dynamic[at.stage - 1], at.time);
        let column = self.history.as_mut().map_or(Ok(None), |history| history.row(at, values, row));
        match column.map_err(io_failure)? {
            Some(node) => Err(Failure::NonFinite { at, effect: Some("a column of the history"), node }),
            None => Ok(row),
        }
    }

    /// Tells of a run that is over.
    fn retell(&mut self, outcome: study::Outcome) -> (Result<(), Failure>, Counters) {
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
        say::count_warnings(1);
        self.progress.note(&warning.to_string());
    }

    fn progress(&mut self, at: Moment, done: f64) -> Result<(), Failure> {
        self.progress.tell(done, || format!("time {:.6}, load factor {:.4}", at.time, at.load));
        match signals::caught() {
            Some(signal) => Err(Failure::Interrupted { at, signal }),
            None => Ok(()),
        }
    }
}

fn io_failure(error: std::io::Error) -> Failure {
    Failure::Io(error.to_string())
}

/// What stands in results beyond those of the run itself.
#[derive(Default)]
pub struct Beyond {
    /// The accuracy that was wanted and reached
    pub reached: Option<Reached>,
    /// The outputs of the run, where it is over already
    pub outcome: Option<study::Outcome>,
    /// Error bars
    pub bars: Option<ErrorBars>,
    /// The deck as it was read
    pub text: String,
    /// What films the run
    pub film: Option<Film>,
}

/// Runs a scene on so many threads; with a folder it leaves its results there, and a recorder follows what is expected.
pub fn simulate(
    scene: &Scene,
    name: &str,
    folder: Option<&Path>,
    recorder: Option<&mut Recorder>,
    beyond: Beyond,
    threads: usize,
) -> Finished {
    let start = Instant::now();
    // From here on signals are answered by the run.
    signals::caught();
    let Beyond { reached, outcome, bars, text, film } = beyond;
    let beside = bars.map(|bars| Box::new(bars) as Box<dyn Beside>);
    let names = || scene.probes.iter().flat_map(|probe| probe.names.clone()).collect();
    let history = folder.map(|folder| HistoryWriter::create(folder, names(), beside)).transpose();
    let dynamic: Vec<bool> = scene.plan.stages.iter().map(|s| s.work.kind().advances_time()).collect();
    let timed = dynamic.iter().all(|dynamic| *dynamic);
    let fields = folder.filter(|_| scene.vtk).map(|folder| FieldsWriter::create(folder, scene.figure(), timed));
    let (history, fields, opened) = match (history, fields.transpose()) {
        (Ok(history), Ok(fields)) => (history, fields, Ok(())),
        (Err(error), _) | (_, Err(error)) => (None, None, Err(io_failure(error))),
    };
    // Pictures need the whole state.
    let outcome = outcome.filter(|_| film.is_none() && fields.is_none());
    let mut watcher = Watcher {
        scene,
        history,
        values: Vec::new(),
        recorder,
        progress: Progress::new(name),
        modes: ModesWriter::default(),
        fields,
        film,
        dynamic,
        rows: RowCounter::new(Rows { every: scene.every, interval: scene.plan.interval }),
    };
    let before = outcome.as_ref().map(|outcome| outcome.seconds);
    let threads = if before.is_some() { 1 } else { threads };
    let (mut result, counters) = match (opened, outcome) {
        (Err(failure), _) => (Err(failure), Counters::default()),
        (Ok(()), Some(outcome)) => watcher.retell(outcome),
        (Ok(()), None) => threads::on(threads, || Run::new(scene.plan.clone(), &mut watcher).finish()),
    };
    watcher.progress.done();
    let seconds = before.unwrap_or_else(|| start.elapsed().as_secs_f64());
    let mut record = None;
    if let (Some(history), Some(folder)) = (watcher.history.take(), folder) {
        let reached = reached.as_ref();
        let outcome = Outcome { result: &result, counters: &counters, seconds, threads, reached, text: &text };
        let told = Record::of(scene, &outcome);
        let text = told.to_string();
        record = Some(told);
        let fields = watcher.fields.take();
        let written = write_results(history, fields, &watcher.modes, folder, result.is_ok(), &text);
        if let Err(error) = written {
            result = Err(io_failure(error));
        }
    }
    Finished { result, counters, seconds, film: watcher.film, record, threads }
}

/// The record is whole before anything gets its name, and gets its own when all else has.
fn write_results(
    history: HistoryWriter,
    fields: Option<FieldsWriter>,
    modes: &ModesWriter,
    folder: &Path,
    finished: bool,
    record: &str,
) -> std::io::Result<()> {
    let (part, file) = PartFile::written(folder, "run.json", record.as_bytes())?;
    history.finish(finished)?;
    remove_if_there(folder, "report.html")?;
    match fields {
        Some(fields) => fields.finish(finished)?,
        None => remove_fields(folder)?,
    }
    modes.finish(folder)?;
    part.finish(&file, "run.json")
}

/// A few lines after a run.
fn summarise(name: &str, scene: &Scene, finished: &Finished, folder: &Path) {
    let Finished { result, counters, seconds, threads, .. } = finished;
    let work = &counters.work;
    if let Some(title) = &scene.title {
        say::line(&format!("{name}: {title}"));
    }
    let unknowns = scene.plan.model.slots() * 3;
    let planar = scene.reasons.iter().filter(|r| r.active && r.name == "planar").map(|r| r.name);
    let evaluated = counters.evaluations.iter().filter(|(_, count)| *count > 0).map(|(name, _)| *name);
    let acting = planar.chain(evaluated).collect::<Vec<_>>().join(", ");
    say::line(&format!("  {} elements, {unknowns} unknowns; {acting}", scene.mesh.element_count));
    say::line(&format!(
        "  {} steps, {} iterations, {} cut-backs, {} chart switches, {} mixed elements in {seconds:.3} s{}",
        counters.steps,
        work.iterations,
        counters.cutbacks,
        work.chart_switches,
        counters.mixed_elements,
        on_threads(*threads)
    ));
    match result {
        Ok(()) => say::line(&format!("  {}", folder.join("history.csv").display())),
        Err(failure) => {
            if !matches!(failure, Failure::Io(_)) {
                say::line(&format!("  what was reached: {}", folder.join("history.partial.csv").display()));
            }
            if let Some(hint) = failure.hint(&scene.plan) {
                say::note(&format!("hint: {hint}"));
            }
        }
    }
}
