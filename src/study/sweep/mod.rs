//! Many runs of one deck: keys are varied, each point is a run of its own, and one table tells what came of all.

mod axes;
mod latin;
mod point;
mod store;
mod table;

pub use axes::{Axis, Combination, Range, Values};
pub use point::Outcome;
pub use store::Store;

use super::crowd::side_by_side;
use super::variant::Variant;
use crate::deck::{self, Deck, Looked, looking_at, nearest, without_stage};
use crate::scene::Scene;
use std::io;

/// What is run.
pub struct Sweep {
    /// The deck, which expects what is looked at
    text: String,
    /// The fingerprint of what all points share
    common: u64,
    /// What is looked at
    pub outputs: Vec<Looked>,
    /// Whether errors of these are estimated
    pub error_bars: bool,
    /// The keys that are varied
    pub keys: Vec<String>,
    /// Their values, point by point
    pub points: Vec<Vec<String>>,
}

/// How points are run.
pub struct Options<'a> {
    /// At a time
    pub threads: usize,
    /// Tells of signals
    pub interrupted: &'a (dyn Fn() -> Option<i32> + Sync),
    /// Sees each point (from 0) as it ends
    pub tell: &'a mut dyn FnMut(usize, &Outcome),
}

impl Sweep {
    /// Varies keys of the deck `text`.
    pub fn new(
        text: &str,
        axes: &[Axis],
        how: Combination,
        outputs: Vec<Looked>,
        error_bars: bool,
    ) -> Result<Self, String> {
        let points = axes::points(axes, how)?;
        let keys = axes.iter().map(|axis| axis.key.clone()).collect();
        let text = looking_at(text, &outputs);
        let common = fnv(fnv(FNV, &format!("{}\n{error_bars}\n", env!("CARGO_PKG_VERSION"))), &text);
        Ok(Self { text, common, outputs, error_bars, keys, points })
    }

    /// Whether keys, parameters and outputs are ones that the deck has; what a point makes of it is seen when that is run.
    pub fn check(&self, deck: &Deck) -> Result<(), String> {
        deck::apply(&self.text, &self.settings(0))?;
        if let Some(counter) = self.outputs.iter().find(|output| output.column.starts_with("run.")) {
            return Err(format!(
                "`{}` is no output of a point: steps, iterations and factorisations have columns anyway",
                counter.column
            ));
        }
        if let Some(key) = self.keys.iter().find(|key| key.ends_with(".csv")) {
            return Err(format!("`{key}` cannot be varied: tables beside the deck are read once, for all points"));
        }
        let parameters = self.keys.iter().filter_map(|key| key.strip_prefix("param."));
        if let Some(name) = parameters.into_iter().find(|name| deck.parameters.get(name).is_none()) {
            let meant =
                nearest(name, deck.parameters.names()).map_or(String::new(), |m| format!(": did you mean `{m}`?"));
            return Err(format!("the deck has no parameter `{name}`{meant}"));
        }
        Variant::read(&self.text, &[]).map(|_| ())
    }

    /// What makes a point (from 0) of the deck.
    pub fn settings(&self, point: usize) -> Vec<String> {
        self.keys.iter().zip(&self.points[point]).map(|(key, value)| format!("{key}={value}")).collect()
    }

    /// What its results belong to, and no other's.
    pub fn identity(&self, point: usize) -> String {
        let settings = format!("{:?}", self.settings(point));
        format!("{settings} {:016x}", fnv(self.common, &settings))
    }

    /// What no other sweep has, beside a word of the caller's.
    pub fn fingerprint(&self, word: &str) -> String {
        let points = self.points.iter().map(|point| point.join(" ")).collect::<Vec<_>>().join("\n");
        format!("{:016x}", fnv(fnv(self.common, &format!("{word}\n{:?}\n", self.keys)), &points))
    }

    /// Runs points (from 0) side by side and keeps what comes of each as it ends.
    pub fn run(&self, points: &[usize], store: &Store, options: Options) -> io::Result<()> {
        let Options { threads, interrupted, tell } = options;
        // The queue is emptied from its end.
        let open = points.iter().rev().copied().collect();
        let work = |k: usize| {
            let done = point::run(&self.text, &self.settings(k), self.error_bars, &interrupted);
            (done.status != "interrupted").then_some(done)
        };
        let broken = |_| Outcome::failed("broke_off", "a fault of the program: please report it".into());
        let mut kept = Ok(());
        let trouble = std::sync::atomic::AtomicBool::new(false);
        let stopped = || interrupted().is_some() || trouble.load(std::sync::atomic::Ordering::Relaxed);
        side_by_side(threads, open, &stopped, &work, &broken, |k, done| {
            if let Err(error) = store.keep(&self.identity(k), &done) {
                trouble.store(true, std::sync::atomic::Ordering::Relaxed);
                kept = Err(error);
            }
            tell(k, &done);
        });
        kept
    }

    /// What is known of each point.
    pub fn gathered(&self, store: &Store) -> Vec<Option<Outcome>> {
        (0..self.points.len()).map(|k| store.find(&self.identity(k))).collect()
    }
}

/// FNV-1a, which is the same on every machine: what it begins with, and what a text makes of that.
const FNV: u64 = 0xcbf2_9ce4_8422_2325;

fn fnv(begun: u64, text: &str) -> u64 {
    text.bytes().fold(begun, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// What a scene shows by itself: the columns of its history at the end, then modes and critical loads.
pub fn usual_outputs(scene: &Scene) -> Vec<Looked> {
    let mut names: Vec<String> = Vec::new();
    for column in super::outcome::columns(scene) {
        // Those of several stages have one name, which means the last.
        let name = without_stage(&column).to_string();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.iter().map(|name| Looked::parse(name)).collect()
}
