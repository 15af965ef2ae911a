//! Runs that go on from a checkpoint end with the same results as runs that never stopped, to the
//! last bit: all decks, each stopped at a random row. Long runs end early, after some rows.

use beamsim::deck::{Severity, Unreadable};
use beamsim::scene::{self, Scene};
use beamsim_core::run::{Checkpoint, Counters, Failure, Observer, Run, Snapshot, StageResult, Warning};
use beamsim_core::threads;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// The number of rows of a run. Without a limit (`RESUME_ROWS=1000000`) all runs take some minutes.
const ROWS: usize = 30;

/// All that a run shows.
#[derive(Default)]
struct Shown {
    /// Rows as bits: stage, time, load factor, columns
    rows: Vec<Vec<u64>>,
    results: Vec<(usize, StageResult)>,
    warnings: Vec<String>,
}

/// A checkpoint as stored, and the number of rows, results and warnings before it.
struct Stored {
    bytes: Vec<u8>,
    rows: usize,
    results: usize,
    warnings: usize,
}

/// Watches a run, and keeps one of its checkpoints: each with the same probability.
struct Keeper<'s> {
    scene: &'s Scene,
    seed: u64,
    offers: u64,
    /// The run was resumed: its first checkpoint is kept.
    is_resumed: bool,
    /// The number of rows after which the run ends
    limit: usize,
    shown: Shown,
    kept: Option<Stored>,
}

impl<'s> Keeper<'s> {
    fn new(scene: &'s Scene, seed: u64) -> Self {
        let limit = std::env::var("RESUME_ROWS").ok().and_then(|rows| rows.parse().ok()).unwrap_or(ROWS);
        Self { scene, seed, offers: 0, is_resumed: false, limit, shown: Shown::default(), kept: None }
    }
}

fn hash(value: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

impl Observer for Keeper<'_> {
    fn row(&mut self, at: &Snapshot) -> Result<(), Failure> {
        let mut values = vec![at.stage as f64, at.state.time, at.state.load];
        self.scene.probes.iter().for_each(|probe| probe.read(at, &mut values));
        self.shown.rows.push(values.into_iter().map(f64::to_bits).collect());
        if self.shown.rows.len() < self.limit { Ok(()) } else { Err(Failure::Io("enough rows".into())) }
    }

    fn found(&mut self, stage: usize, result: &StageResult) -> Result<(), Failure> {
        self.shown.results.push((stage, result.clone()));
        Ok(())
    }

    fn warn(&mut self, warning: &Warning) {
        self.shown.warnings.push(warning.to_string());
    }

    fn wants_checkpoint(&mut self) -> bool {
        self.offers += 1;
        if self.is_resumed {
            return self.offers == 1;
        }
        // A checkpoint before the first row is the start of the run.
        !self.shown.rows.is_empty() && hash((self.seed, self.offers)).is_multiple_of(self.offers)
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<(), Failure> {
        let Shown { rows, results, warnings } = &self.shown;
        let bytes = postcard::to_stdvec(checkpoint).expect("a checkpoint is plain data");
        let [rows, results, warnings] = [rows.len(), results.len(), warnings.len()];
        self.kept = Some(Stored { bytes, rows, results, warnings });
        Ok(())
    }
}

/// Counters without times.
fn timeless(mut counters: Counters) -> Counters {
    (counters.work.evaluation_seconds, counters.work.solve_seconds) = (0.0, 0.0);
    counters
}

/// The first difference between a run and one that was resumed; `None` where there is none.
fn difference(scene: &Scene, seed: u64) -> Option<String> {
    let mut whole = Keeper::new(scene, seed);
    let (ended, counters) = Run::new(scene.plan.clone(), &mut whole).finish();
    let Keeper { shown, kept, .. } = whole;
    let stored = kept?;
    let checkpoint: Checkpoint = postcard::from_bytes(&stored.bytes).expect("it was stored whole");
    let at = checkpoint.steps();
    let fresh = Keeper::new(scene, 0);
    let mut rest = Keeper { is_resumed: true, limit: fresh.limit - stored.rows, ..fresh };
    let (ended_again, counters_again) = Run::resume(scene.plan.clone(), checkpoint, &mut rest).finish();
    let first = rest.kept.map(|kept| kept.bytes);
    let Shown { rows, results, warnings } = rest.shown;
    let differs = if first.as_ref() != Some(&stored.bytes) {
        "a checkpoint right after the resume is another one".into()
    } else if ended.as_ref().map_err(|e| e.to_string()) != ended_again.as_ref().map_err(|e| e.to_string()) {
        format!("ends with {ended_again:?} instead of {ended:?}")
    } else if let Some(row) = shown.rows[stored.rows..].iter().zip(&rows).position(|(a, b)| a != b) {
        format!("row {row} after the checkpoint")
    } else if rows.len() != shown.rows.len() - stored.rows {
        format!("{} rows instead of {}", rows.len(), shown.rows.len() - stored.rows)
    } else if results != shown.results[stored.results..] {
        "the results of an analysis".into()
    } else if warnings != shown.warnings[stored.warnings..] {
        format!("warnings {warnings:?} instead of {:?}", &shown.warnings[stored.warnings..])
    } else if timeless(counters.clone()) != timeless(counters_again.clone()) {
        format!("counters {counters_again:?} instead of {counters:?}")
    } else {
        return None;
    };
    Some(format!("after {at} steps: {differs}"))
}

/// The decks of a folder and its subfolders, without those that take long.
fn decks(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("long") {
            decks(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "toml") {
            found.push(path);
        }
    }
}

/// The scene of a deck; `None` where it is wrong, as some decks are meant to be.
fn scene_of(path: &Path) -> Option<Scene> {
    let text = std::fs::read_to_string(path).unwrap();
    let unreadable = |error: std::io::Error| Unreadable { message: error.to_string(), severity: Severity::File };
    let beside = |name: &str| std::fs::read(path.with_file_name(name)).map_err(unreadable);
    let imported = beamsim::deck::import(&text, &beside).ok()?;
    scene::from_text(&imported.text).ok().map(|(scene, _)| scene)
}

#[test]
fn resumed_runs_end_as_those_that_never_stopped() {
    let mut paths = Vec::new();
    decks(&PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("decks"), &mut paths);
    paths.sort();
    let chosen = std::env::var("RESUME_DECK").ok();
    let seeds: u64 = std::env::var("RESUME_SEEDS").ok().and_then(|seeds| seeds.parse().ok()).unwrap_or(1);
    paths.retain(|path| chosen.as_ref().is_none_or(|part| path.to_string_lossy().contains(part)));
    let work = |path: &PathBuf| -> Vec<String> {
        let Some(scene) = scene_of(path) else { return Vec::new() };
        let name = path.display();
        let seeds = (0..seeds).map(|seed| hash((path.file_name(), seed)));
        seeds.filter_map(|seed| difference(&scene, seed)).map(|differs| format!("{name} {differs}")).collect()
    };
    let found: Vec<String> = threads::on(2, || threads::map(paths.iter(), work)).concat();
    assert!(found.is_empty(), "{} differ:\n{}", found.len(), found.join("\n"));
}
