//! Many runs of one deck with varied keys: each point is a run, and one table holds the results of
//! all.

mod axes;
mod in_flight;
mod latin;
mod point;
mod store;
mod table;

pub use axes::{Combination, Range, SweepAxis, Values};
pub use in_flight::{InFlight, LeftBehind};
pub use point::PointResult;
pub use store::Store;

use super::built::BuiltDeck;
use super::parallel::in_parallel;
use super::{StudyError, SweepError};
use crate::deck::{self, Deck, Looked, looking_at, nearest, without_stage};
use crate::output::OutputError;
use crate::scene::Scene;
use beamsim_core::failure::FailureKind;
use std::sync::atomic::{AtomicBool, Ordering};

/// A sweep.
pub struct Sweep {
    /// The text of the deck, with an expectation for each output
    text: String,
    /// The fingerprint of the deck, which all points share
    common: u64,
    /// The recorded outputs
    outputs: Vec<Looked>,
    /// True if the errors of the outputs are estimated
    error_bars: bool,
    /// The keys that are varied
    pub(crate) keys: Vec<String>,
    /// The values of the keys, point by point
    pub(crate) points: Vec<Vec<String>>,
}

/// Options for running points.
pub struct SweepOptions<'a> {
    /// Number of simultaneous points
    pub(crate) threads: usize,
    /// The signal that was caught, if there was one
    pub(crate) interrupted: &'a (dyn Fn() -> Option<i32> + Sync),
    /// The list of the points that have begun, for the case that the process dies
    pub(crate) in_flight: Option<&'a InFlight>,
    /// Takes each point (from 0) as it ends
    pub(crate) ended: &'a mut dyn FnMut(usize, &PointResult),
}

impl Sweep {
    /// Varies keys of the deck `text`.
    pub fn new(
        text: &str,
        axes: &[SweepAxis],
        how: Combination,
        outputs: Vec<Looked>,
        error_bars: bool,
    ) -> Result<Self, SweepError> {
        let points = axes::points(axes, how)?;
        let keys = axes.iter().map(|axis| axis.key.clone()).collect();
        let text = looking_at(text, &outputs);
        let common = fnv(fnv(FNV, &format!("{}\n{error_bars}\n", env!("CARGO_PKG_VERSION"))), &text);
        Ok(Self { text, common, outputs, error_bars, keys, points })
    }

    /// Checks that the deck has the keys, parameters and outputs. The values of each point are
    /// checked when it is run.
    pub fn check(&self, deck: &Deck) -> Result<(), StudyError> {
        self.check_keys(deck)?;
        BuiltDeck::read(&self.text).map(|_| ())
    }

    fn check_keys(&self, deck: &Deck) -> Result<(), SweepError> {
        let changed = deck::apply(&self.text, &self.settings(0)).map_err(SweepError::Setting)?;
        // The values of a point are its own matter: only its keys must exist.
        if let Some(error) = unknown_key(&changed) {
            return Err(SweepError::Setting(error));
        }
        if let Some(counter) = self.outputs.iter().find(|output| output.column.starts_with("run.")) {
            return Err(SweepError::CounterAsOutput(counter.column.clone()));
        }
        if let Some(key) = self.keys.iter().find(|key| key.ends_with(".csv")) {
            return Err(SweepError::Table(key.clone()));
        }
        let parameters = self.keys.iter().filter_map(|key| key.strip_prefix("param."));
        if let Some(name) = parameters.into_iter().find(|name| deck.parameters.get(name).is_none()) {
            let meant = nearest(name, deck.parameters.names());
            let hint = meant.map_or(String::new(), |meant| format!(": did you mean `{meant}`?"));
            return Err(SweepError::NoParameter { name: name.into(), hint });
        }
        Ok(())
    }

    /// The settings (`KEY=VALUE`) of a point (from 0).
    pub fn settings(&self, point: usize) -> Vec<String> {
        self.keys.iter().zip(&self.points[point]).map(|(key, value)| format!("{key}={value}")).collect()
    }

    /// The identity of a point (from 0): its settings, and a fingerprint of them and the deck.
    pub fn identity(&self, point: usize) -> String {
        let settings = format!("{:?}", self.settings(point));
        format!("{settings} {:016x}", fnv(self.common, &settings))
    }

    /// A fingerprint of the sweep and a word of the caller.
    pub fn fingerprint(&self, word: &str) -> String {
        let points = self.points.iter().map(|point| point.join(" ")).collect::<Vec<_>>().join("\n");
        format!("{:016x}", fnv(fnv(self.common, &format!("{word}\n{:?}\n", self.keys)), &points))
    }

    /// Runs points (from 0) in parallel, and saves the result of each as it ends.
    pub fn run(&self, points: &[usize], store: &Store, options: SweepOptions) -> Result<(), OutputError> {
        let SweepOptions { threads, interrupted, in_flight, ended } = options;
        // The queue is emptied from its end.
        let open = points.iter().rev().copied().collect();
        let work = |k: usize| {
            if let Some(Err(error)) = in_flight.map(|list| list.note(&self.identity(k))) {
                return Some(PointResult::failed(FailureKind::Io.name(), error.to_string()));
            }
            let done = point::run(&self.text, &self.settings(k), self.error_bars, &interrupted);
            (done.status != FailureKind::Interrupted.name()).then_some(done)
        };
        let broken = |_| PointResult::failed("broke_off", "internal error: please report it".into());
        let mut kept = Ok(());
        let failed = AtomicBool::new(false);
        let stopped = || interrupted().is_some() || failed.load(Ordering::Relaxed);
        in_parallel(threads, open, &stopped, &work, &broken, |k, done| {
            if let Err(error) = store.keep(&self.identity(k), &done) {
                failed.store(true, Ordering::Relaxed);
                kept = Err(error);
            }
            ended(k, &done);
        });
        kept
    }

    /// The saved result of each point.
    pub fn gathered(&self, store: &Store) -> Vec<Option<PointResult>> {
        (0..self.points.len()).map(|k| store.find(&self.identity(k))).collect()
    }
}

/// The error about a key that a deck cannot have, if there is one.
fn unknown_key(text: &str) -> Option<String> {
    let found = deck::read(text).map_or_else(|found| found, |(_, found)| found);
    let error = found.into_iter().find(|error| error.is_of_key)?;
    Some(match error.help {
        Some(help) => format!("{}: {help}", error.message),
        None => error.message,
    })
}

/// The initial value of the hash FNV-1a.
const FNV: u64 = 0xcbf2_9ce4_8422_2325;

/// Continues the hash FNV-1a, which is the same on every machine, with a text.
fn fnv(begun: u64, text: &str) -> u64 {
    text.bytes().fold(begun, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// The default outputs: the columns of the history at the end, then modes and critical loads.
pub fn usual_outputs(scene: &Scene) -> Vec<Looked> {
    let mut names: Vec<String> = Vec::new();
    for column in super::outcome::columns(scene) {
        // Without the number of the stage, a name means the last stage with such modes.
        let name = without_stage(&column).to_string();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.iter().map(|name| Looked::parse(name)).collect()
}
