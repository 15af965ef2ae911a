//! run.json: the deck of a run, its work, its findings and how it ended.

use super::json::{Entries, Number};
use super::{OutputError, Units};
use crate::deck::{self, ImportedTable};
use crate::scene::{Mesh, Reason, Scene};
use beamsim_core::failure::FailureKind;
use beamsim_core::probe::{Envelope, Extreme, StressPlace};
use beamsim_core::run::{
    ContactCounters, Counters, Event, Failure, Moment, Place, StageStability, StageTimeError, Warning,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt::{self, Display, Formatter};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3;

/// Bytes of a file that are read at once
const READ_AT_ONCE: usize = 1 << 16;

/// The status of a run that did not fail.
const FINISHED: &str = "finished";

/// A run that has ended.
pub struct FinishedRun<'a> {
    /// Success, or why it failed
    pub(crate) result: &'a Result<(), Failure>,
    /// The work it took, and its findings
    pub(crate) counters: &'a Counters,
    /// Wall-clock seconds of the run
    pub(crate) seconds: f64,
    /// The number of threads
    pub(crate) threads: usize,
    /// The wanted accuracy and how far it was reached
    pub(crate) accuracy: Option<ReachedAccuracy>,
    /// The deck
    pub(crate) source: DeckSource,
    /// How often the run was resumed
    pub(crate) resumed: u32,
    /// The largest stresses, where they were followed
    pub(crate) envelope: Option<&'a Envelope>,
}

/// The text of a deck, and the long tables beside it. Their rows are not repeated in run.json: a
/// report reads them from their files, and finds by the fingerprint if they have changed.
#[derive(Clone, Debug, Default)]
pub struct DeckSource {
    /// The text, with the settings of the command line and the rows of short tables
    pub(crate) text: String,
    /// The long tables
    pub(crate) tables: Vec<TableSource>,
}

/// A table beside a deck.
#[derive(Clone, Debug)]
pub struct TableSource {
    /// The path of its file
    pub(crate) path: PathBuf,
    /// Its name in the deck, rows and fingerprint
    pub(crate) table: ImportedTable,
}

/// A wanted accuracy, and what was reached.
pub struct ReachedAccuracy {
    /// The columns of which an accuracy was wanted
    pub(crate) columns: Vec<ReachedColumn>,
    /// True if all estimates are at most the wanted errors
    pub(crate) is_reached: bool,
    /// The settings of the deck (`KEY=VALUE`) that reach it
    pub(crate) settings: Vec<String>,
    /// The runs of the search
    pub(crate) runs: usize,
    /// Wall-clock seconds of the search
    pub(crate) seconds: f64,
    /// Equal and placed elements, where both were looked at
    pub(crate) meshes: Option<ReachedMeshes>,
}

/// Equal elements, and elements placed where the solution varies fast.
pub struct ReachedMeshes {
    /// The best mesh of equal elements
    pub(crate) equal: ReachedMesh,
    /// The best mesh of placed ones, where one was tried
    pub(crate) placed: Option<ReachedMesh>,
    /// The number of placed elements over that of equal ones, as predicted
    pub(crate) predicted: f64,
    /// True if the placed elements were taken
    pub(crate) is_placed: bool,
}

/// A mesh that a search found.
pub struct ReachedMesh {
    /// The number of its elements
    pub(crate) elements: usize,
    /// The estimated error of the worst column
    pub(crate) estimate: f64,
    /// CPU seconds of its run
    pub(crate) seconds: f64,
}

/// The accuracy of a column. Errors are relative to the largest value of the column's kind.
pub struct ReachedColumn {
    /// The name of the column
    pub(crate) name: String,
    /// The wanted error
    pub(crate) wanted: f64,
    /// The estimated error
    pub(crate) estimate: f64,
}

/// The content of run.json. Keys that an older version has not written are read as their defaults.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Record {
    version: String,
    status: String,
    /// The other files of the run
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) files: Vec<FileRecord>,
    /// How often the run was resumed
    #[serde(skip_serializing_if = "is_zero")]
    resumed: u32,
    deck: Value,
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
    /// The tables beside the deck whose rows are not in its text
    #[serde(skip_serializing_if = "Vec::is_empty")]
    tables: Vec<TableRecord>,
    #[serde(flatten)]
    findings: Findings,
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// A file of a run, by which it is told from that of another run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileRecord {
    /// The name in the folder of results
    pub(super) name: String,
    bytes: u64,
    /// XXH3 of 64 bits, in hexadecimal digits
    checksum: String,
}

impl FileRecord {
    /// The file at a path, under a name.
    pub fn of(name: &str, path: &Path) -> Result<Self, OutputError> {
        let wrong = |error| OutputError::file(path, error);
        let mut file = File::open(path).map_err(wrong)?;
        let mut hasher = Xxh3::new();
        let mut buffer = vec![0; READ_AT_ONCE];
        let mut bytes = 0;
        loop {
            let count = file.read(&mut buffer).map_err(wrong)?;
            if count == 0 {
                break;
            }
            hasher.update(&buffer[..count]);
            bytes += count as u64;
        }
        Ok(Self { name: name.into(), bytes, checksum: format!("{:016x}", hasher.digest()) })
    }
}

/// A table beside the deck.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct TableRecord {
    /// Its name in the deck
    pub(crate) csv: String,
    /// The path of its file; not UTF-8 characters are replaced
    pub(crate) path: String,
    /// The number of its rows
    rows: usize,
    /// A fingerprint of its file
    pub(crate) hash: String,
}

/// The part of run.json that does not repeat the deck.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Findings {
    effects: Vec<EffectRecord>,
    counters: CountersRecord,
    events: Vec<EventRecord>,
    stability: Vec<StabilityRecord>,
    time_errors: Vec<TimeErrorRecord>,
    warnings: Vec<WarningRecord>,
    /// The largest stresses by beam and section
    #[serde(skip_serializing_if = "Vec::is_empty")]
    stress: Vec<StressRecord>,
    threads: usize,
    seconds: SecondsRecord,
    #[serde(skip_serializing_if = "Option::is_none")]
    accuracy: Option<AccuracyRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    failure: Option<Value>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct EffectRecord {
    name: String,
    active: bool,
    reason: String,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct CountersRecord {
    steps: u64,
    cutbacks: u64,
    uncertainty: Number,
    iterations: u64,
    factorisations: u64,
    chart_switches: u64,
    mixed_elements: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    contact: Option<ContactRecord>,
    evaluations: Entries<u64>,
    linear_solvers: Vec<String>,
}

/// Work that contacts made; only in runs where something touched.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct ContactRecord {
    augmentations: u64,
    softenings: u64,
    changes: u64,
    #[serde(default)]
    stiffenings: u64,
    #[serde(default)]
    lists: u64,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct EventRecord {
    stage: usize,
    load: Number,
    kind: String,
    negative_pivots: Option<usize>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct StabilityRecord {
    stage: usize,
    verdict: String,
    negative: Option<usize>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct TimeErrorRecord {
    stage: usize,
    displacement: Number,
    rotation: Number,
    moved: Number,
}

/// A warning in run.json and in the summaries for scripts. A warning about a deck has no stage,
/// time and load.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct WarningRecord {
    name: String,
    about: String,
    stage: Option<usize>,
    time: Option<f64>,
    load: Option<f64>,
    message: String,
}

/// The largest stresses of a section on a beam.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct StressRecord {
    beam: String,
    section: String,
    vm: Option<ExtremeRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    index: Option<ExtremeRecord>,
}

/// A largest value: when and where it was, and the resultants N1 N2 N3 M1 M2 M3 then.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct ExtremeRecord {
    value: Number,
    stage: usize,
    time: Number,
    load: Number,
    fraction: f64,
    point: [f64; 2],
    region: String,
    resultant: [Number; 6],
}

/// Wall-clock seconds.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct SecondsRecord {
    total: f64,
    evaluation: f64,
    solve: f64,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct AccuracyRecord {
    reached: bool,
    /// The wanted and the estimated error of each column
    columns: Entries<[Number; 2]>,
    settings: Vec<String>,
    runs: usize,
    seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    meshes: Option<MeshesRecord>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct MeshesRecord {
    equal: MeshRecord,
    placed: Option<MeshRecord>,
    /// The number of placed elements over that of equal ones, as predicted
    predicted: Number,
    /// `equal` or `placed`
    taken: String,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct MeshRecord {
    elements: usize,
    estimate: Number,
    /// CPU seconds of its run
    seconds: Number,
}

/// A failure: its name and message, and the numbers that its kind has. It is only written: a record
/// that is read keeps the failure as it stands.
#[derive(Serialize)]
struct FailureRecord {
    name: String,
    message: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    hint: Option<String>,
    #[serde(flatten)]
    at: Option<MomentRecord>,
    #[serde(flatten)]
    place: Option<PlaceRecord>,
    #[serde(flatten)]
    numbers: Option<FailureNumbers>,
}

#[derive(Serialize)]
struct MomentRecord {
    stage: usize,
    time: Number,
    load: Number,
}

/// The unknown that a failure names.
#[derive(Serialize)]
struct PlaceRecord {
    node: String,
    direction: [Number; 3],
    unknown: String,
}

/// The numbers of the kinds of failures.
#[derive(Serialize)]
#[serde(untagged)]
enum FailureNumbers {
    NotConverged { residual: Number, force: Number, iterations: usize, residual_history: Vec<Number>, cutbacks: u64 },
    TurnsTooFar { node: String, angle: Number },
    LimitPoint { goal: Number, arc_length_increments: u64, end: Number },
    StepTooSmall { error: Number, share: Number },
    Penetration { node: String, depth: Number },
    ContactStart { contact: String, surface: String, node: String, depth: Number },
    OfNode { node: String },
    NonFinite { effect: Option<String>, node: String },
    MeshTooCoarse { nodes: [String; 2], relative_rotation: Number },
    EnergyGrowth { grown: Number, largest: Number },
    Interrupted { signal: i32 },
}

/// The summary of a run for scripts: run.json with paths in the place of the deck.
#[derive(Serialize)]
pub struct RunSummary<'a> {
    version: &'a str,
    status: &'a str,
    deck: String,
    results: String,
    #[serde(flatten)]
    findings: &'a Findings,
}

impl<'a> RunSummary<'a> {
    /// The summary of a record, with the path of the deck and that of the results.
    pub fn of(record: &'a Record, deck: String, results: String) -> Self {
        Self { version: &record.version, status: &record.status, deck, results, findings: &record.findings }
    }
}

impl Record {
    /// The record of a run.
    pub fn of(scene: &Scene, run: FinishedRun) -> Self {
        let FinishedRun { result, counters, seconds, threads, accuracy, source, resumed, envelope } = run;
        let found = &counters.findings;
        let warnings = scene.warnings.iter().chain(&found.warnings);
        let findings = Findings {
            effects: scene.reasons.iter().map(EffectRecord::from).collect(),
            counters: CountersRecord::from(counters),
            events: found.events.iter().map(EventRecord::from).collect(),
            stability: found.stability.iter().map(StabilityRecord::from).collect(),
            time_errors: found.time_errors.iter().map(TimeErrorRecord::from).collect(),
            warnings: warnings.map(WarningRecord::from).collect(),
            stress: envelope.map_or(Vec::new(), |envelope| stress_records(envelope, &scene.mesh)),
            threads,
            seconds: SecondsRecord {
                total: seconds,
                evaluation: counters.work.evaluation_seconds,
                solve: counters.work.solve_seconds,
            },
            accuracy: accuracy.map(AccuracyRecord::from),
            failure: result.as_ref().err().and_then(|failure| failure_of(failure, scene)),
        };
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            status: result.as_ref().map_or_else(Failure::name, |()| FINISHED).into(),
            files: Vec::new(),
            resumed,
            deck: resolved(&source).unwrap_or_else(|| scene.resolved.clone()),
            tables: source.tables.iter().map(TableRecord::from).collect(),
            text: Some(source.text),
            findings,
        }
    }

    /// Reads run.json of a folder of results.
    pub fn read(folder: &Path) -> Result<Self, OutputError> {
        Self::read_from(&folder.join("run.json"))
    }

    /// Reads a file with the content of run.json.
    pub fn read_from(path: &Path) -> Result<Self, OutputError> {
        let bytes = fs::read(path).map_err(|error| OutputError::file(path, error))?;
        serde_json::from_slice(&bytes).map_err(|error| OutputError::content(path, error))
    }

    /// True if the run can go on from its checkpoint: it was stopped from outside.
    pub fn may_be_resumed(&self) -> bool {
        [FailureKind::Interrupted, FailureKind::Io, FailureKind::Limit].iter().any(|kind| kind.name() == self.status)
    }

    /// True if a file of the run is not there.
    pub fn misses_files(&self, folder: &Path) -> bool {
        self.files.iter().any(|file| !folder.join(&file.name).exists())
    }

    /// Refuses a file of another run, or one that was changed; a record of an older version knows no
    /// files.
    pub fn refuse_foreign(&self, folder: &Path, name: &str) -> Result<(), OutputError> {
        let path = folder.join(name);
        let listed = self.files.iter().find(|file| file.name == name);
        let reason = match listed {
            None if self.files.is_empty() => return Ok(()),
            Some(file) if FileRecord::of(name, &path)? == *file => return Ok(()),
            None => "is not a file of the run that run.json describes",
            Some(_) => "is not as the run that run.json describes has written it: it was changed, or is of another run",
        };
        Err(OutputError::content(&path, format!("{reason} (run the deck again, or give the file itself)")))
    }

    /// The text of the deck.
    pub fn text(&self) -> Option<&str> {
        self.text.as_deref()
    }

    /// The tables beside the deck.
    pub fn tables(&self) -> &[TableRecord] {
        &self.tables
    }

    /// The title of the deck.
    pub fn title(&self) -> Option<&str> {
        self.deck["title"].as_str()
    }

    /// Labels of the units of the deck.
    pub fn units(&self) -> Units {
        Units::of_deck(&self.deck)
    }

    /// The name of the failure that ended the run, if it did not finish.
    pub fn failure(&self) -> Option<&str> {
        Some(self.status.as_str()).filter(|status| !["", FINISHED].contains(status))
    }

    /// True if a signal ended the run.
    pub fn is_interrupted(&self) -> bool {
        self.status == FailureKind::Interrupted.name()
    }

    /// The record without the text of the deck.
    pub fn bare(&self) -> Self {
        Self { text: None, ..self.clone() }
    }
}

/// The tables of a deck with numbers for expressions, and without the rows of long tables; `None` if
/// it imports none.
fn resolved(source: &DeckSource) -> Option<Value> {
    if source.tables.is_empty() {
        return None;
    }
    // Readers complain of names of files, which they do not know.
    deck::read(&source.text).ok().map(|(deck, _)| deck.resolved)
}

impl From<&TableSource> for TableRecord {
    fn from(source: &TableSource) -> Self {
        let ImportedTable { name, rows, hash } = &source.table;
        Self { csv: name.clone(), path: source.path.display().to_string(), rows: *rows, hash: hash.clone() }
    }
}

/// The text of the file.
impl Display for Record {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let text = serde_json::to_string_pretty(self).map_err(|_| fmt::Error)?;
        writeln!(f, "{text}")
    }
}

impl From<&Reason> for EffectRecord {
    fn from(reason: &Reason) -> Self {
        Self { name: reason.name.into(), active: reason.active, reason: reason.reason.clone() }
    }
}

impl From<&Counters> for CountersRecord {
    fn from(counters: &Counters) -> Self {
        let evaluations = counters.evaluations.iter().map(|&(name, count)| (name.to_string(), count));
        Self {
            steps: counters.steps,
            cutbacks: counters.cutbacks,
            uncertainty: Number(counters.work.uncertainty),
            iterations: counters.work.iterations,
            factorisations: counters.work.factorisations,
            chart_switches: counters.work.chart_switches,
            mixed_elements: counters.mixed_elements,
            contact: contact_record(&counters.contacts),
            evaluations: Entries(evaluations.collect()),
            linear_solvers: counters.linear_solvers.iter().map(ToString::to_string).collect(),
        }
    }
}

/// The largest stresses of all places by beam and section, in the order of the beams.
fn stress_records(envelope: &Envelope, mesh: &Mesh) -> Vec<StressRecord> {
    let mut records: Vec<StressRecord> = Vec::new();
    for (place, found) in envelope.places().iter().zip(envelope.found()) {
        let beam = &mesh.beams[place.inside.beam].name;
        let section = &place.section.section().name;
        let number = records.iter().position(|known| known.beam == *beam && known.section == *section);
        let number = number.unwrap_or_else(|| {
            records.push(StressRecord { beam: beam.clone(), section: section.clone(), ..StressRecord::default() });
            records.len() - 1
        });
        let record = &mut records[number];
        for (known, new) in [(&mut record.vm, found.von_mises), (&mut record.index, found.index)] {
            let is_larger = |new: &Extreme| known.as_ref().is_none_or(|known| new.value > known.value.0);
            if let Some(new) = new.filter(is_larger) {
                *known = Some(extreme_record(&new, place));
            }
        }
    }
    records
}

fn extreme_record(found: &Extreme, place: &StressPlace) -> ExtremeRecord {
    ExtremeRecord {
        value: Number(found.value),
        stage: found.moment.stage,
        time: Number(found.moment.time),
        load: Number(found.moment.load),
        fraction: place.inside.fraction,
        point: found.at,
        region: place.section.section().regions.get(found.region).cloned().unwrap_or_default(),
        resultant: found.resultant.map(Number),
    }
}

impl From<&Event> for EventRecord {
    fn from(event: &Event) -> Self {
        Self {
            stage: event.at.stage,
            load: Number(event.at.load),
            kind: event.kind.name().into(),
            negative_pivots: event.negative_pivots,
        }
    }
}

impl From<&StageStability> for StabilityRecord {
    fn from(found: &StageStability) -> Self {
        Self { stage: found.stage, verdict: found.verdict.name().into(), negative: found.negative }
    }
}

impl From<&StageTimeError> for TimeErrorRecord {
    fn from(found: &StageTimeError) -> Self {
        Self {
            stage: found.stage,
            displacement: Number(found.largest.displacement),
            rotation: Number(found.largest.rotation),
            moved: Number(found.largest.moved),
        }
    }
}

impl From<&Warning> for WarningRecord {
    fn from(warning: &Warning) -> Self {
        Self {
            name: warning.kind.name().into(),
            about: warning.kind.about().name().into(),
            stage: warning.at.map(|at| at.stage),
            time: warning.at.map(|at| at.time),
            load: warning.at.map(|at| at.load),
            message: warning.message.clone(),
        }
    }
}

impl From<ReachedAccuracy> for AccuracyRecord {
    fn from(reached: ReachedAccuracy) -> Self {
        let entry = |column: ReachedColumn| (column.name, [Number(column.wanted), Number(column.estimate)]);
        Self {
            reached: reached.is_reached,
            columns: Entries(reached.columns.into_iter().map(entry).collect()),
            settings: reached.settings,
            runs: reached.runs,
            seconds: reached.seconds,
            meshes: reached.meshes.map(MeshesRecord::from),
        }
    }
}

impl From<ReachedMeshes> for MeshesRecord {
    fn from(meshes: ReachedMeshes) -> Self {
        let record = |ReachedMesh { elements, estimate, seconds }: ReachedMesh| MeshRecord {
            elements,
            estimate: Number(estimate),
            seconds: Number(seconds),
        };
        Self {
            equal: record(meshes.equal),
            placed: meshes.placed.map(record),
            predicted: Number(meshes.predicted),
            taken: if meshes.is_placed { "placed" } else { "equal" }.into(),
        }
    }
}

impl From<&Moment> for MomentRecord {
    fn from(at: &Moment) -> Self {
        Self { stage: at.stage, time: Number(at.time), load: Number(at.load) }
    }
}

impl From<&Place> for PlaceRecord {
    fn from(place: &Place) -> Self {
        Self {
            node: place.node.clone(),
            direction: place.direction.0.map(Number),
            unknown: format!("{:?}", place.kind).to_lowercase(),
        }
    }
}

/// A failure as JSON; texts and numbers cannot fail to be converted.
fn failure_of(failure: &Failure, scene: &Scene) -> Option<Value> {
    let record = FailureRecord {
        name: failure.name().into(),
        message: failure.to_string(),
        hint: failure.hint(&scene.plan),
        at: moment_of(failure).map(MomentRecord::from),
        place: place_of(failure).map(PlaceRecord::from),
        numbers: numbers_of(failure),
    };
    serde_json::to_value(record).ok()
}

fn contact_record(contacts: &ContactCounters) -> Option<ContactRecord> {
    let ContactCounters { augmentations, softenings, changes, stiffenings, lists } = *contacts;
    (*contacts != ContactCounters::default()).then_some(ContactRecord {
        augmentations,
        softenings,
        changes,
        stiffenings,
        lists,
    })
}

fn moment_of(failure: &Failure) -> Option<&Moment> {
    match failure {
        Failure::NotConverged { at, .. }
        | Failure::TurnsTooFar { at, .. }
        | Failure::LimitPoint { at, .. }
        | Failure::StepTooSmall { at, .. }
        | Failure::Singular { at, .. }
        | Failure::Penetration { at, .. }
        | Failure::ContactStart { at, .. }
        | Failure::ContactPassed { at, .. }
        | Failure::SliderEnd { at, .. }
        | Failure::NonFinite { at, .. }
        | Failure::MeshTooCoarse { at, .. }
        | Failure::EnergyGrowth { at, .. }
        | Failure::Interrupted { at, .. } => Some(at),
        Failure::Deck(_) | Failure::Limit(_) | Failure::Io(_) => None,
    }
}

fn place_of(failure: &Failure) -> Option<&Place> {
    match failure {
        Failure::NotConverged { place, .. } | Failure::StepTooSmall { place, .. } => Some(place),
        Failure::Singular { place, .. } => place.as_ref(),
        Failure::TurnsTooFar { .. }
        | Failure::LimitPoint { .. }
        | Failure::Penetration { .. }
        | Failure::ContactStart { .. }
        | Failure::ContactPassed { .. }
        | Failure::SliderEnd { .. }
        | Failure::NonFinite { .. }
        | Failure::MeshTooCoarse { .. }
        | Failure::EnergyGrowth { .. }
        | Failure::Interrupted { .. }
        | Failure::Deck(_)
        | Failure::Limit(_)
        | Failure::Io(_) => None,
    }
}

fn numbers_of(failure: &Failure) -> Option<FailureNumbers> {
    let numbers = match failure {
        Failure::NotConverged { residual, force, history, tried, .. } => FailureNumbers::NotConverged {
            residual: Number(*residual),
            force: Number(*force),
            iterations: history.len().saturating_sub(1),
            residual_history: history.iter().copied().map(Number).collect(),
            cutbacks: tried.cutbacks,
        },
        Failure::TurnsTooFar { node, angle, .. } => {
            FailureNumbers::TurnsTooFar { node: node.clone(), angle: Number(*angle) }
        }
        Failure::LimitPoint { goal, increments, end, .. } => FailureNumbers::LimitPoint {
            goal: Number(*goal),
            arc_length_increments: *increments,
            end: Number(end.load),
        },
        Failure::StepTooSmall { error, share, .. } => {
            FailureNumbers::StepTooSmall { error: Number(*error), share: Number(*share) }
        }
        Failure::Penetration { node, depth, .. } => {
            FailureNumbers::Penetration { node: node.clone(), depth: Number(*depth) }
        }
        Failure::ContactStart { contact, surface, node, depth, .. } => FailureNumbers::ContactStart {
            contact: contact.clone(),
            surface: surface.clone(),
            node: node.clone(),
            depth: Number(*depth),
        },
        Failure::ContactPassed { node, .. } | Failure::SliderEnd { node, .. } => {
            FailureNumbers::OfNode { node: node.clone() }
        }
        Failure::NonFinite { effect, node, .. } => {
            FailureNumbers::NonFinite { effect: effect.map(String::from), node: node.clone() }
        }
        Failure::MeshTooCoarse { nodes, relative_rotation, .. } => {
            FailureNumbers::MeshTooCoarse { nodes: nodes.clone(), relative_rotation: Number(*relative_rotation) }
        }
        Failure::EnergyGrowth { grown, largest, .. } => {
            FailureNumbers::EnergyGrowth { grown: Number(*grown), largest: Number(*largest) }
        }
        Failure::Interrupted { signal, .. } => FailureNumbers::Interrupted { signal: *signal },
        Failure::Singular { .. } | Failure::Deck(_) | Failure::Limit(_) | Failure::Io(_) => return None,
    };
    Some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECORD: &str = r#"{
        "version": "0.1.0", "status": "singular", "deck": { "param": { "L": 1.0 }, "beam": [{ "elements": 4 }] },
        "text": "a deck", "tables": [{ "csv": "f.csv", "path": "/a/f.csv", "rows": 2, "hash": "xxh3:00" }], "effects": [{ "name": "shear", "active": true, "reason": "GA" }],
        "counters": {
            "steps": 1, "cutbacks": 0, "uncertainty": 1e-12, "iterations": 3, "factorisations": 3,
            "chart_switches": 0, "mixed_elements": 0, "evaluations": { "z": 2, "a": 1 },
            "linear_solvers": ["blocks"]
        },
        "events": [{ "stage": 1, "load": 0.5, "kind": "limit_point", "negative_pivots": null }],
        "stability": [{ "stage": 1, "verdict": "unstable", "negative": 2 }],
        "time_errors": [{ "stage": 2, "displacement": null, "rotation": 0.1, "moved": 3.0 }],
        "warnings": [{
            "name": "unstable", "about": "stability", "stage": null, "time": null, "load": null, "message": "m"
        }],
        "threads": 2, "seconds": { "total": 0.1, "evaluation": 0.2, "solve": 0.3 },
        "accuracy": { "reached": true, "columns": { "tip.ux": [0.1, null] }, "settings": [], "runs": 3, "seconds": 1.0 },
        "failure": { "name": "singular", "message": "m", "stage": 1, "time": 0.0, "load": 0.0, "node": "a" }
    }"#;

    #[test]
    fn records_are_written_as_they_were_read() {
        let record: Record = serde_json::from_str(RECORD).unwrap();
        let compact = |value: &Value| value.to_string();
        let written: Value = serde_json::from_str(&record.to_string()).unwrap();
        // Texts show the order of keys, which a comparison of values does not.
        assert_eq!(compact(&written), compact(&serde_json::from_str(RECORD).unwrap()));
        assert!(record.bare().text().is_none() && !record.bare().to_string().contains("a deck"));
    }

    #[test]
    fn records_of_older_versions_lack_keys() {
        let record: Record = serde_json::from_str(r#"{ "status": "interrupted", "text": "a deck" }"#).unwrap();
        assert!(record.is_interrupted() && record.text() == Some("a deck"));
    }
}
