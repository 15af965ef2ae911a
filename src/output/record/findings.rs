//! The work of a run and its findings in run.json.

use super::accuracy::AccuracyRecord;
use super::stress::StressRecord;
use crate::output::json::{Entries, Number};
use crate::scene::Reason;
use beamsim_core::run::{ContactCounters, Counters, Event, StageStability, StageTimeError, Warning};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The part of run.json that does not repeat the deck.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Findings {
    pub(super) effects: Vec<EffectRecord>,
    pub(super) counters: CountersRecord,
    pub(super) events: Vec<EventRecord>,
    pub(super) stability: Vec<StabilityRecord>,
    pub(super) time_errors: Vec<TimeErrorRecord>,
    pub(super) warnings: Vec<WarningRecord>,
    /// The largest stresses by beam and section
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) stress: Vec<StressRecord>,
    pub(super) threads: usize,
    pub(super) seconds: SecondsRecord,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) accuracy: Option<AccuracyRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) failure: Option<Value>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct EffectRecord {
    name: String,
    active: bool,
    reason: String,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct CountersRecord {
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
pub(super) struct EventRecord {
    stage: usize,
    load: Number,
    kind: String,
    negative_pivots: Option<usize>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct StabilityRecord {
    stage: usize,
    verdict: String,
    negative: Option<usize>,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct TimeErrorRecord {
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

/// Wall-clock seconds.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct SecondsRecord {
    pub(super) total: f64,
    pub(super) evaluation: f64,
    pub(super) solve: f64,
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
