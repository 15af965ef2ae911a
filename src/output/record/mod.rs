//! run.json: the deck of a run, its work, its findings and how it ended.

mod accuracy;
mod failure;
mod findings;
mod stress;

pub use accuracy::{ReachedAccuracy, ReachedColumn, ReachedMesh, ReachedMeshes};
pub use findings::WarningRecord;

use super::{OutputError, Units};
use crate::deck::{self, ImportedTable};
use crate::scene::Scene;
use accuracy::AccuracyRecord;
use beamsim_core::failure::FailureKind;
use beamsim_core::probe::Envelope;
use beamsim_core::run::{Counters, Failure};
use failure::failure_of;
use findings::{CountersRecord, EffectRecord, EventRecord, Findings, SecondsRecord, StabilityRecord, TimeErrorRecord};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt::{self, Display, Formatter};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use stress::stress_records;
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
