//! Summaries for scripts: with `--json` a line on standard output for each deck, folder or table,
//! instead of text.

use super::console;
use crate::deck::EffectWord;
use crate::output::{Record, RunSummary, WarningRecord};
use crate::scene::Scene;
use crate::study::effects::{EffectStudy, ReducedScene};
use crate::study::{Comparison, Judgement};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// A line of JSON: the name of the command, then its summary.
#[derive(Serialize)]
struct Line<'a, T> {
    command: &'a str,
    #[serde(flatten)]
    summary: T,
}

fn print(command: &str, summary: impl Serialize) {
    if !console::prints_json() {
        return;
    }
    match serde_json::to_string(&Line { command, summary }) {
        Ok(line) => console::data(&line),
        Err(error) => console::note(&format!("warning[io]: no JSON for `{command}`: {error}")),
    }
}

/// Paths that are no UTF-8 are printed with replacement characters.
fn text(path: &Path) -> String {
    path.display().to_string()
}

/// Prints the content of run.json without the text and the tables of the deck.
pub fn run(deck: &Path, results: &Path, record: &Record) {
    print("run", RunSummary::of(record, text(deck), text(results)));
}

#[derive(Serialize)]
struct Check<'a> {
    deck: String,
    elements: usize,
    nodes: usize,
    unknowns: usize,
    effects: Vec<&'a str>,
    seconds: f64,
    warnings: Vec<WarningRecord>,
}

/// Prints the size of a scene and the predicted time of a run in seconds.
pub fn check(deck: &Path, scene: &Scene, seconds: f64) {
    let summary = Check {
        deck: text(deck),
        elements: scene.mesh.element_count,
        nodes: scene.mesh.nodes.len(),
        unknowns: scene.plan.model.slots() * 3,
        effects: scene.reasons.iter().filter(|reason| reason.active).map(|reason| reason.name).collect(),
        seconds,
        warnings: scene.warnings.iter().map(WarningRecord::from).collect(),
    };
    print("check", summary);
}

#[derive(Serialize)]
struct Verification<'a> {
    deck: String,
    seconds: f64,
    holds: bool,
    expectations: &'a [Judgement],
}

/// Prints the judgements of the expectations of a deck.
pub fn verify(deck: &Path, seconds: f64, expectations: &[Judgement]) {
    let holds = expectations.iter().all(|judgement| judgement.holds);
    print("verify", Verification { deck: text(deck), seconds, holds, expectations });
}

#[derive(Serialize)]
struct ComparedColumn<'a> {
    column: &'a str,
    row: usize,
    came: f64,
    stored: f64,
    holds: bool,
}

#[derive(Serialize)]
struct ComparedFiles<'a> {
    history: String,
    stored: String,
    holds: bool,
    columns: Vec<ComparedColumn<'a>>,
}

/// Prints the worst cell of each column of a history that was compared with a stored one.
pub fn compare(history: &Path, stored: &Path, cells: &[Comparison]) {
    let mut columns = Vec::new();
    for Comparison { column, row, came, stored, ratio } in cells {
        columns.push(ComparedColumn { column, row: *row, came: *came, stored: *stored, holds: *ratio <= 1.0 });
    }
    let holds = columns.iter().all(|column| column.holds);
    print("compare", ComparedFiles { history: text(history), stored: text(stored), holds, columns });
}

#[derive(Serialize)]
struct Reduced<'a> {
    without: Vec<&'a str>,
    failure: Option<String>,
    change: Option<f64>,
    of: Option<&'a str>,
    time: Option<f64>,
    iterations: Option<u64>,
}

impl<'a> Reduced<'a> {
    fn of(scene: &'a ReducedScene, found: &'a EffectStudy) -> Self {
        let outcome = scene.outcome();
        let (change, column) = scene.largest();
        Self {
            without: keys(&scene.without),
            failure: if outcome.is_none() { Some(scene.failure()) } else { None },
            change: outcome.map(|_| change),
            of: outcome.filter(|_| change > 0.0).map(|_| found.columns[column].as_str()),
            time: outcome.map(|outcome| outcome.seconds / found.whole.seconds),
            iterations: outcome.map(|outcome| outcome.counters.work.iterations),
        }
    }
}

#[derive(Serialize)]
struct Effects<'a> {
    deck: String,
    file: String,
    seconds: f64,
    iterations: u64,
    tolerance: f64,
    variants: Vec<Reduced<'a>>,
    cheapest: Reduced<'a>,
    absent: Vec<&'a str>,
}

fn keys(words: &[EffectWord]) -> Vec<&'static str> {
    words.iter().map(|word| word.key()).collect()
}

/// Prints the change and the time of each reduced scene, and the effects that all outputs can do
/// without.
pub fn effects(deck: &Path, file: &Path, found: &EffectStudy, tolerance: f64) {
    let summary = Effects {
        deck: text(deck),
        file: text(file),
        seconds: found.whole.seconds,
        iterations: found.whole.counters.work.iterations,
        tolerance,
        variants: found.reduced.iter().map(|scene| Reduced::of(scene, found)).collect(),
        cheapest: Reduced::of(&found.cheapest, found),
        absent: keys(&found.absent),
    };
    print("effects", summary);
}

#[derive(Serialize)]
struct Sweep<'a> {
    table: String,
    points: usize,
    finished: usize,
    failed: &'a BTreeMap<&'a str, Vec<usize>>,
}

/// Prints the size of a sweep, and the numbers of the points that did not finish by their status.
pub fn sweep(table: &Path, points: usize, finished: usize, failed: &BTreeMap<&str, Vec<usize>>) {
    print("sweep", Sweep { table: text(table), points, finished, failed });
}

/// A largest stress of a section.
#[derive(Serialize)]
pub struct SectionStress {
    /// Name of the load
    pub(super) load: String,
    /// Name of its column
    pub(super) measure: String,
    /// Largest, or smallest, value
    pub(super) value: f64,
    /// Its place, in the coordinates of the shape
    pub(super) at: [f64; 2],
    /// Its region
    pub(super) region: String,
}

/// The numbers of a section.
#[derive(Serialize)]
pub struct Section {
    /// Path of the deck
    pub(super) deck: String,
    /// Name of the section
    pub(super) section: String,
    /// Nodes of the mesh of a computed section
    pub(super) nodes: Option<usize>,
    /// Estimated relative error of a computed stiffness
    pub(super) estimate: Option<f64>,
    /// Area of a computed section
    pub(super) area: Option<f64>,
    /// The point of the shape through which the line of the beam goes
    pub(super) line: Option<[f64; 2]>,
    /// Tension centre from the line of the beam
    pub(super) tension_centre: Option<[f64; 2]>,
    /// Shear centre from the line of the beam
    pub(super) shear_centre: Option<[f64; 2]>,
    /// Mass centre from the line of the beam
    pub(super) mass_centre: Option<[f64; 2]>,
    /// 1/S11 about the tension centre
    pub(super) ea: Option<f64>,
    /// 1/S22 and 1/S33 about the shear centre
    pub(super) ga: Option<[f64; 2]>,
    /// 1/S44
    pub(super) gj: Option<f64>,
    /// Larger and smaller bending stiffness
    pub(super) ei: Option<[f64; 2]>,
    /// Angle from axis 2 to the axis of the larger bending stiffness, rad
    pub(super) principal_angle: Option<f64>,
    /// Largest von Mises stresses under unit resultants, or the given ones, of sections with a shape
    pub(super) stress: Vec<SectionStress>,
    /// 6x6 stiffness by rows
    pub(super) stiffness: Vec<Vec<f64>>,
    /// 6x6 mass by rows
    pub(super) mass: Option<Vec<Vec<f64>>>,
    /// Paths of the pictures
    pub(super) pictures: Vec<String>,
}

/// Prints the numbers of a section.
pub fn section(summary: &Section) {
    print("section", summary);
}

#[derive(Serialize)]
struct Wrote {
    file: String,
}

/// Prints the path of a file that a command has written.
pub fn wrote(command: &str, path: &Path) {
    print(command, Wrote { file: text(path) });
}
