//! Every deck in `decks/` holds its own expectations.

use beamsim::deck::{Severity, Unreadable};
use beamsim::scene;
use beamsim::study::{Recorder, judge};
use beamsim_core::run::{Failure, Observer, Run, Snapshot, StageResult};
use std::path::{Path, PathBuf};

struct Watcher(Recorder);

impl Observer for Watcher {
    fn row(&mut self, snapshot: &Snapshot) -> Result<(), Failure> {
        self.0.row(snapshot);
        Ok(())
    }

    fn found(&mut self, _stage: usize, result: &StageResult) -> Result<(), Failure> {
        self.0.found(result);
        Ok(())
    }
}

/// The decks of a folder, without subfolders.
pub fn decks(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut decks: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    decks.retain(|path| path.extension().is_some_and(|e| e == "toml"));
    decks.sort();
    decks
}

/// The text of a deck with the tables and meshes beside it.
fn whole_text(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let unreadable = |error: std::io::Error| Unreadable { message: error.to_string(), severity: Severity::File };
    let beside = |name: &str| std::fs::read(path.with_file_name(name)).map_err(unreadable);
    beamsim::deck::import(&text, &beside).map_or(text.clone(), |imported| imported.text)
}

fn verify(path: &Path) -> Vec<String> {
    let text = whole_text(path);
    let name = path.display();
    let scene = match scene::from_text(&text) {
        Ok((scene, _)) => scene,
        // Whether the name is the right one is for `beamsim verify`.
        Err(_) if text.contains("fails = \"deck\"") || text.contains("fails = \"limit\"") => return Vec::new(),
        Err(diagnostics) => {
            let all: Vec<String> = diagnostics.iter().map(|d| d.render(&name.to_string(), &text, false)).collect();
            return vec![all.join("\n")];
        }
    };
    let mut watcher = Watcher(Recorder::new(&scene));
    let (result, counters) = Run::new(scene.plan, &mut watcher).finish();
    let judgements = judge(&watcher.0, &result, &counters);
    if judgements.is_empty() {
        return vec![format!("{name} expects nothing")];
    }
    let broken = judgements.iter().filter(|j| !j.holds);
    broken.map(|j| format!("{name}: {} expected {}, came {}", j.what, j.expected, j.came)).collect()
}

fn all_hold(folder: &str, at_least: usize) {
    let decks = decks(folder);
    assert!(decks.len() >= at_least, "{folder} has only {} decks", decks.len());
    let broken: Vec<String> = decks.iter().flat_map(|path| verify(path)).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn scenes_of_the_paper_hold() {
    all_hold("decks", 18);
}

#[test]
fn cases_of_other_programs_hold() {
    all_hold("decks/peers", 30);
}

#[test]
fn paths_and_critical_loads_hold() {
    all_hold("decks/paths", 20);
    all_hold("decks/paths/euler_columns", 7);
}

#[test]
fn modes_hold() {
    all_hold("decks/modes", 18);
}

#[test]
fn stability_holds() {
    all_hold("decks/stability", 17);
}

#[test]
fn states_of_rest_hold() {
    all_hold("decks/rest", 7);
}

#[test]
fn what_motions_are_told_of_their_steps_holds() {
    all_hold("decks/dynamics", 6);
}

#[test]
fn joints_hold() {
    all_hold("decks/joints", 25);
}

#[test]
fn prestress_holds() {
    all_hold("decks/prestress", 6);
}

#[test]
fn computed_sections_hold() {
    all_hold("decks/sections", 5);
}

/// Those of `decks/hard/long` are for `beamsim verify decks/hard/long`.
fn hard_cases(families: &str, at_least: usize) {
    let mut decks = decks("decks/hard");
    decks.retain(|path| {
        path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(|c| families.contains(c)))
    });
    assert!(decks.len() >= at_least, "decks/hard has only {} of {families}", decks.len());
    let broken: Vec<String> = decks.iter().flat_map(|path| verify(path)).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn hard_rotations_hold() {
    hard_cases("r", 21);
}

#[test]
fn hard_paths_and_slender_beams_hold() {
    hard_cases("ls", 23);
}

#[test]
fn hard_motions_hold() {
    hard_cases("cd", 34);
}

#[test]
fn degenerate_scenes_hold() {
    hard_cases("z", 30);
}

#[test]
fn minimal_decks_hold() {
    all_hold("decks/minimal", 55);
}

#[test]
fn contacts_hold() {
    all_hold("decks/contact", 9);
    all_hold("decks/contact/meshes", 2);
}
