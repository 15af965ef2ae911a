//! `beamsim verify`

use super::error::CommandError;
use super::folders::folder;
use super::load::{self, Loaded};
use super::restart::refuse_checkpoint;
use super::simulate::{RunExtras, Target, simulate};
use super::status::Status;
use super::thread_count::threads_of;
use super::verdict::Verdict;
use super::{console, json, outputs, signals};
use crate::output::OutputError;
use crate::study::{Judgement, Recorder, expected_failure, judge};
use std::path::{Path, PathBuf};

/// Runs decks and prints for each expectation the expected value, the result and the error. A
/// folder stands for the decks in it.
pub fn verify(paths: &[PathBuf], settings: &[String], out: Option<&Path>) -> Status {
    let mut verdict = Verdict::default();
    let decks = match expand(paths) {
        Ok(decks) => decks,
        Err(error) => {
            verdict.fail(error.into());
            return verdict.finish(1);
        }
    };
    if decks.is_empty() {
        verdict.fail(CommandError::Usage("no decks found".into()));
        return verdict.finish(0);
    }
    let mut held = 0;
    let mut total = 0;
    for path in &decks {
        let name = load::name(path);
        let folder = out.map(|out| folder(Some(out), &name, decks.len() > 1));
        match one(path, &name, settings, folder.as_deref()) {
            Ok(judgements) => {
                held += judgements.iter().filter(|j| j.holds).count();
                total += judgements.len();
            }
            Err(error @ CommandError::Stopped { .. }) => {
                verdict.fail(error);
                return verdict.finish(1);
            }
            Err(error) => verdict.fail(error),
        }
    }
    console::line(&format!("{held} of {total} expectations hold in {} deck(s)", decks.len()));
    if held < total {
        verdict.fail(CommandError::Unexpected(format!("{} expectation(s) do not hold", total - held)));
    }
    verdict.finish(decks.len())
}

/// Runs a deck and judges its expectations; a deck that cannot be read may be expected to fail.
fn one(path: &Path, name: &str, settings: &[String], folder: Option<&Path>) -> Result<Vec<Judgement>, CommandError> {
    let Loaded { source, scene, .. } = match load::deck(path, settings) {
        Ok(loaded) => loaded,
        Err(CommandError::Deck(error)) if !error.expected.is_empty() => {
            let expected = error.expected.clone();
            let failure = CommandError::Deck(error).name();
            let judgements: Vec<_> = expected.iter().map(|name| expected_failure(name, failure)).collect();
            print_judgements(path, &judgements, 0.0);
            return Ok(judgements);
        }
        Err(error) => return Err(error),
    };
    let mut recorder = Recorder::new(&scene);
    let extras = RunExtras { source, ..RunExtras::default() };
    let target = folder.map(target).transpose()?;
    let finished = simulate(&scene, name, target, Some(&mut recorder), extras, threads_of(&scene, None));
    if let Some(signal) = signals::caught() {
        return Err(CommandError::Stopped { signal, message: format!("stopped by signal {signal}") });
    }
    let judgements = judge(&recorder, &finished.result, &finished.counters);
    print_judgements(path, &judgements, finished.seconds);
    Ok(judgements)
}

/// A folder of results without the checkpoint of another run.
fn target(folder: &Path) -> Result<Target, CommandError> {
    let folder = outputs::claim(folder)?;
    refuse_checkpoint(&folder, "--resume")?;
    Ok(Target::without_checkpoints(folder))
}

/// Folders are replaced by the decks in them, in the order of their names, subfolders last.
fn expand(paths: &[PathBuf]) -> Result<Vec<PathBuf>, OutputError> {
    expand_within(paths, &mut Vec::new())
}

/// Expands paths that lie `within` these folders. A link back to one of them is passed over.
fn expand_within(paths: &[PathBuf], within: &mut Vec<PathBuf>) -> Result<Vec<PathBuf>, OutputError> {
    let mut decks = Vec::new();
    for path in paths {
        if !path.is_dir() {
            decks.push(path.clone());
            continue;
        }
        let folder = std::fs::canonicalize(path).map_err(|error| OutputError::file(path, error))?;
        if within.contains(&folder) {
            continue;
        }
        let entries = std::fs::read_dir(path).map_err(|error| OutputError::file(path, error))?;
        let mut entries: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|e| e.path())).collect();
        entries.sort();
        let (folders, files): (Vec<_>, Vec<_>) = entries.into_iter().partition(|entry| entry.is_dir());
        // Pipes and devices are no decks: nobody may ever write to them.
        let is_deck = |file: &PathBuf| file.extension().is_some_and(|e| e == "toml") && file.is_file();
        decks.extend(files.into_iter().filter(is_deck));
        within.push(folder);
        decks.extend(expand_within(&folders, within)?);
        within.pop();
    }
    Ok(decks)
}

fn print_judgements(path: &Path, judgements: &[Judgement], seconds: f64) {
    json::verify(path, seconds, judgements);
    let verdict = if judgements.iter().all(|j| j.holds) { "ok" } else { "FAILED" };
    let nothing = if judgements.is_empty() { ", no [[expect]] tables" } else { "" };
    console::line(&format!("{verdict:<6} {} ({seconds:.3} s{nothing})", path.display()));
    let width =
        |pick: fn(&Judgement) -> &str| judgements.iter().map(|j| pick(j).chars().count()).max().unwrap_or(0).min(48);
    let what = width(|j| &j.what);
    let expected = width(|j| &j.expected);
    let came = width(|j| &j.came);
    for j in judgements {
        let mark = if j.holds { " " } else { "X" };
        let error = j.error.map_or(String::new(), |e| format!("error {e:.2e}"));
        let ratio = j.ratio.map_or(String::new(), |r| format!(", {:.0} % of the tolerance", 100.0 * r));
        let line = format!("  {mark} {:<what$}  {:>expected$}  {:>came$}  {error}{ratio}", j.what, j.expected, j.came);
        console::line(line.trim_end());
    }
}
