//! A run from the command line: its history, fields, modes and record are written, its progress and
//! warnings are shown.

use super::console;
use super::progress::Progress;
use super::signals;
use crate::output::{
    DeckSource, Extent, FieldsWriter, Film, FinishedRun, HistoryWriter, ModesWriter, OutputError, ReachedAccuracy,
    Record, ResultFolder, Row, RowCounter, Rows, SavedRun, SideColumns, Units, write_envelope, write_profile,
};
use crate::scene::Scene;
use crate::study::error_bars::ErrorBars;
use crate::study::{self, Recorder};
use beamsim_core::model::StageKind;
use beamsim_core::probe::{Envelope, Profile};
use beamsim_core::run::{Checkpoint, Counters, Failure, Moment, Observer, Run, Snapshot, StageResult, Warning};
use beamsim_core::threads;
use std::time::{Duration, Instant};

/// Additions to the results of a run.
#[derive(Default)]
pub struct RunExtras {
    /// The wanted accuracy and how far it was reached
    pub(super) accuracy: Option<ReachedAccuracy>,
    /// The outputs of the run where a search has run it already
    pub(super) outcome: Option<study::Outcome>,
    /// Error bars
    pub(super) bars: Option<ErrorBars>,
    /// The deck
    pub(super) source: DeckSource,
    /// Recorder of shapes for the report
    pub(super) film: Option<Film>,
}

/// A run that has ended.
pub struct Finished {
    /// Success, or why it failed
    pub(super) result: Result<(), Failure>,
    /// The work it took
    pub(super) counters: Counters,
    /// Wall-clock seconds
    pub(super) seconds: f64,
    /// The recorded shapes
    pub(super) film: Option<Film>,
    /// The content of run.json, where results were written
    pub(super) record: Option<Record>,
    /// The number of threads
    pub(super) threads: usize,
    /// The folder of results, which no other run writes to as long as this value lives
    pub(super) folder: Option<ResultFolder>,
}

/// Bytes that are taken for run.json when a run begins. Longer ones, of decks with long tables, may
/// find no room.
const RESERVED: usize = 64 << 10;

/// Where the results of a run go, and where it begins.
pub struct Target {
    /// The folder of results
    pub(super) folder: ResultFolder,
    /// Where the run goes on, if it is resumed
    pub(super) saved: Option<Box<SavedRun<Checkpoint>>>,
    /// The time between checkpoints, if any are written
    pub(super) interval: Option<Duration>,
}

impl Target {
    /// A folder for a run that begins at its start, and cannot be resumed.
    pub fn without_checkpoints(folder: ResultFolder) -> Self {
        Self { folder, saved: None, interval: None }
    }
}

/// Runs a scene on a number of threads. With a target its results are written there; a recorder
/// follows the expectations of the deck.
pub fn simulate(
    scene: &Scene,
    name: &str,
    target: Option<Target>,
    recorder: Option<&mut Recorder>,
    extras: RunExtras,
    threads: usize,
) -> Finished {
    let start = Instant::now();
    // From here on a signal stops the run, and what it has reached is written.
    let _kept = target.as_ref().map(|_| signals::keep());
    let RunExtras { accuracy, outcome, bars, source, film } = extras;
    let (results, from, opened) = match target.map(|target| Results::open(scene, target, bars)).transpose() {
        Ok(opened) => {
            let (results, from) = opened.unzip();
            (results, from.flatten(), Ok(()))
        }
        Err(error) => (None, None, Err(Failure::Io(error.to_string()))),
    };
    // A film, fields, stresses along beams and checkpoints need the whole state of each row, which
    // an outcome does not have.
    let needs_states = film.is_some() || from.is_some() || results.as_ref().is_some_and(Results::need_states);
    let outcome = outcome.filter(|_| !needs_states);
    let mut watcher = Watcher {
        scene,
        results,
        unwritten: RowCounter::new(Rows { every: scene.every, interval: scene.plan.interval }),
        values: Vec::new(),
        recorder,
        progress: Progress::new(name),
        time_unit: time_unit(scene),
        film,
        dynamic: are_dynamic(scene),
    };
    let seconds_of_search = outcome.as_ref().map(|outcome| outcome.seconds);
    let threads = if seconds_of_search.is_some() { 1 } else { threads };
    let plan = scene.plan.clone();
    let (mut result, counters) = match (opened, outcome, from) {
        (Err(failure), _, _) => (Err(failure), Counters::default()),
        (Ok(()), Some(outcome), _) => watcher.replay(outcome),
        (Ok(()), None, Some(from)) => threads::on(threads, || Run::resume(plan, from, &mut watcher).finish()),
        (Ok(()), None, None) => threads::on(threads, || Run::new(plan, &mut watcher).finish()),
    };
    watcher.progress.done();
    let seconds = seconds_of_search.unwrap_or_else(|| start.elapsed().as_secs_f64());
    let mut record = None;
    let mut folder = None;
    if let Some(mut results) = watcher.results.take() {
        let completed = results.complete(scene, Extent::of(&result));
        if let (Ok(()), Err(error)) = (&result, completed) {
            result = Err(Failure::Io(error.to_string()));
        }
        let resumed = results.resumed;
        let envelope = results.envelope.as_ref();
        let run =
            FinishedRun { result: &result, counters: &counters, seconds, threads, accuracy, source, resumed, envelope };
        let mut content = Record::of(scene, run);
        let (claimed, written) = results.commit(Extent::of(&result), &mut content);
        folder = Some(claimed);
        record = Some(content);
        if let Err(error) = written {
            result = Err(Failure::Io(error.to_string()));
        }
    }
    Finished { result, counters, seconds, film: watcher.film, record, threads, folder }
}

/// The files that are written while a run goes on.
struct Results {
    folder: ResultFolder,
    history: HistoryWriter,
    fields: Option<FieldsWriter>,
    modes: ModesWriter,
    /// The largest stresses, where they are followed
    envelope: Option<Envelope>,
    /// Resultants at the ends of stages, where they are written
    profile: Option<Profile>,
    rows: RowCounter,
    /// How often the run was resumed
    resumed: u32,
    /// The time between checkpoints, if any are written
    interval: Option<Duration>,
    /// When the last checkpoint was written, or the run began
    last_checkpoint: Instant,
    /// There are rows or results behind the last checkpoint.
    has_news: bool,
    /// The names of the files that are complete
    names: Vec<&'static str>,
}

impl Results {
    /// Opens the files of a run, and tells where it goes on, if it is resumed.
    fn open(scene: &Scene, target: Target, bars: Option<ErrorBars>) -> Result<(Self, Option<Checkpoint>), OutputError> {
        let Target { folder, saved, interval } = target;
        let bars = bars.map(|bars| Box::new(bars) as Box<dyn SideColumns>);
        let names = scene.probes.iter().flat_map(|probe| probe.names.clone()).collect();
        let timed = are_dynamic(scene).into_iter().all(|dynamic| dynamic);
        let rows = Rows { every: scene.every, interval: scene.plan.interval };
        let Some(saved) = saved else {
            folder.clean()?;
            folder.reserve(RESERVED)?;
            let history = HistoryWriter::create(&folder, names, bars)?;
            let fields = scene.vtk.then(|| FieldsWriter::create(&folder, scene.figure(), timed)).transpose()?;
            let results = Self::new(folder, history, RowCounter::new(rows), interval);
            let envelope = scene.envelope.clone().map(Envelope::new);
            let profile = scene.profile.clone().map(|places| Profile::new(places, Vec::new()));
            return Ok((Self { fields, envelope, profile, ..results }, None));
        };
        let SavedRun { resumed, rows: seen, history, modes, fields, reel: _, bars: _, envelope, profile, run } = *saved;
        folder.reserve(RESERVED)?;
        let history = HistoryWriter::resume(&folder, names, bars, history)?;
        let fields = fields.map(|saved| FieldsWriter::resume(&folder, scene.figure(), timed, saved)).transpose()?;
        let results = Self::new(folder, history, RowCounter::after(rows, seen), interval);
        let followed = scene.envelope.clone();
        let envelope = followed.map(|places| Envelope::resume(places, envelope.unwrap_or_default()));
        let profile = scene.profile.clone().map(|places| Profile::new(places, profile.unwrap_or_default()));
        Ok((Self { fields, modes, envelope, profile, resumed: resumed + 1, ..results }, Some(run)))
    }

    /// The results of a run with a history alone, which was not resumed.
    fn new(folder: ResultFolder, history: HistoryWriter, rows: RowCounter, interval: Option<Duration>) -> Self {
        Self {
            folder,
            history,
            fields: None,
            modes: ModesWriter::default(),
            envelope: None,
            profile: None,
            rows,
            resumed: 0,
            interval,
            last_checkpoint: Instant::now(),
            has_news: false,
            names: Vec::new(),
        }
    }

    /// Writes a checkpoint.
    fn write_checkpoint(&mut self, scene: &Scene, film: Option<&Film>, run: &Checkpoint) -> Result<(), OutputError> {
        let saved = SavedRun {
            resumed: self.resumed,
            rows: self.rows.seen(),
            history: self.history.save()?,
            modes: self.modes.clone(),
            fields: self.fields.as_mut().map(FieldsWriter::save).transpose()?,
            reel: film.map(|film| film.reel().clone()),
            bars: self.history.side_columns().map(SideColumns::save),
            envelope: self.envelope.as_ref().map(|envelope| envelope.followed().to_vec()),
            profile: self.profile.as_ref().map(|profile| profile.ends().to_vec()),
            run,
        };
        saved.write(scene, &self.folder)?;
        (self.last_checkpoint, self.has_news) = (Instant::now(), false);
        Ok(())
    }

    /// Completes all files but the record. Those that can be written are, whatever fails.
    fn complete(&mut self, scene: &Scene, run: Extent) -> Result<(), OutputError> {
        let history = self.history.complete();
        let extent = run.after(&history);
        let modes = self.modes.finish(&self.folder).map(|names| self.names.extend(names));
        let stresses = self.write_stresses(scene, extent.after(&modes));
        let extent = extent.after(&modes).after(&stresses);
        let fields = self
            .fields
            .take()
            .map_or(Ok(()), |fields| fields.finish(&self.folder, extent).map(|name| self.names.push(name)));
        history.and(modes).and(stresses).and(fields)
    }

    /// Writes the tables of stresses and resultants along beams, where they are wanted.
    fn write_stresses(&mut self, scene: &Scene, extent: Extent) -> Result<(), OutputError> {
        if let Some(envelope) = &self.envelope {
            self.names.push(write_envelope(&self.folder, &scene.mesh, envelope, extent)?);
        }
        if let Some(profile) = &self.profile {
            self.names.push(write_profile(&self.folder, &scene.mesh, profile, extent)?);
        }
        Ok(())
    }

    /// True if whole states are needed, not only the numbers of the history.
    fn need_states(&self) -> bool {
        self.fields.is_some() || self.envelope.is_some() || self.profile.is_some()
    }

    /// Gives all results their names, and returns the folder, which is still claimed.
    fn commit(self, extent: Extent, record: &mut Record) -> (ResultFolder, Result<(), OutputError>) {
        let Self { folder, history, mut names, .. } = self;
        let named = history.close(&folder, extent).and_then(|name| {
            names.push(name);
            folder.commit(&names, record)
        });
        (folder, named)
    }
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

/// Observer of a run from the command line.
struct Watcher<'r> {
    scene: &'r Scene,
    results: Option<Results>,
    /// Numbers rows where no results are written
    unwritten: RowCounter,
    /// The numbers of the present row
    values: Vec<f64>,
    /// Follows the expectations of the deck, where these are judged
    recorder: Option<&'r mut Recorder>,
    progress: Progress,
    /// The unit of time with a space before it; empty where the deck names none
    time_unit: String,
    /// For each stage whether it advances time
    dynamic: Vec<bool>,
    film: Option<Film>,
}

impl Watcher<'_> {
    /// Writes a row of the history.
    fn write(&mut self, at: Moment, values: &[f64]) -> Result<Row, Failure> {
        let dynamic = self.dynamic[at.stage - 1];
        let Some(results) = &mut self.results else { return Ok(self.unwritten.next(dynamic, at.time)) };
        let row = results.rows.next(dynamic, at.time);
        results.has_news = true;
        match results.history.row(at, values, row).map_err(io_failure)? {
            Some(node) => Err(Failure::NonFinite { at, effect: Some("a column of the history"), node }),
            None => Ok(row),
        }
    }

    /// Writes the rows and repeats the warnings of a run that a search has made.
    fn replay(&mut self, outcome: study::Outcome) -> (Result<(), Failure>, Counters) {
        outcome.counters.findings.warnings.iter().for_each(|warning| self.warn(warning));
        let written = outcome.history().try_for_each(|(at, values)| self.write(at, values).map(|_| ()));
        if let Some(results) = &mut self.results {
            results.modes = outcome.found;
        }
        (written.and(outcome.ended), outcome.counters)
    }
}

impl Observer for Watcher<'_> {
    fn row(&mut self, snapshot: &Snapshot) -> Result<(), Failure> {
        self.recorder.iter_mut().for_each(|recorder| recorder.row(snapshot));
        let mut values = std::mem::take(&mut self.values);
        values.clear();
        if self.results.is_some() {
            self.scene.probes.iter().for_each(|probe| probe.read(snapshot, &mut values));
        }
        let row = self.write(snapshot.moment(), &values);
        self.values = values;
        let row = row?;
        if let Some(film) = &mut self.film {
            film.row(snapshot, row);
            // A run for its film alone ends with it; nobody asks how.
            if film.is_complete() {
                return Err(Failure::Io("all rows that were asked for are recorded".into()));
            }
        }
        if let Some(results) = &mut self.results {
            results.envelope.iter_mut().for_each(|envelope| envelope.row(snapshot));
            results.profile.iter_mut().for_each(|profile| profile.row(snapshot));
        }
        let mut fields = self.results.iter_mut().filter_map(|results| results.fields.as_mut());
        fields.try_for_each(|fields| fields.row(snapshot, row)).map_err(io_failure)
    }

    fn found(&mut self, stage: usize, result: &StageResult) -> Result<(), Failure> {
        self.recorder.iter_mut().for_each(|recorder| recorder.found(result));
        if let Some(results) = &mut self.results {
            results.modes.push(stage, result);
            results.has_news = true;
        }
        Ok(())
    }

    fn wants_checkpoint(&mut self) -> bool {
        let Some(Results { interval: Some(interval), last_checkpoint, has_news: true, .. }) = &self.results else {
            return false;
        };
        last_checkpoint.elapsed() >= *interval || signals::caught().is_some()
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<(), Failure> {
        let Self { results, scene, film, .. } = self;
        let Some(results) = results else { return Ok(()) };
        results.write_checkpoint(scene, film.as_ref(), checkpoint).map_err(io_failure)
    }

    fn warn(&mut self, warning: &Warning) {
        console::count_warnings(1);
        self.progress.note(&warning.to_string());
    }

    fn progress(&mut self, at: Moment, done: f64) -> Result<(), Failure> {
        let time_unit = &self.time_unit;
        self.progress.show(done, || format!("time {:.6}{time_unit}, load factor {:.4}", at.time, at.load));
        Ok(())
    }
}

fn io_failure(error: OutputError) -> Failure {
    Failure::Io(error.to_string())
}
