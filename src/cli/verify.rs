//! `beamsim verify`

use super::run::{Beyond, folder, simulate};
use super::{Status, Verdict, json, load, say, signals, threads_of};
use crate::study::{Judgement, Recorder, expected_failure, judge};
use beamsim_core::failure::FailureKind;
use std::path::{Path, PathBuf};

/// Runs decks and prints what was expected, what came, the error, the time. A folder stands for the decks in it.
pub fn verify(paths: &[PathBuf], settings: &[String], out: Option<&Path>) -> Status {
    let decks = match expand(paths) {
        Ok(decks) => decks,
        Err(message) => {
            say::error(FailureKind::Io.name(), &message);
            return Status::Io;
        }
    };
    let mut verdict = Verdict::default();
    if decks.is_empty() {
        verdict.fail(Status::Wrong, "usage", "there are no decks here".into());
        return verdict.finish(0);
    }
    let (mut held, mut total) = (0, 0);
    for path in &decks {
        let name = load::name(path);
        let judgements = match load::deck(path, settings) {
            Ok(load::Loaded { text, scene, .. }) => {
                let folder = out.map(|out| folder(Some(out), &name, decks.len() > 1));
                let mut recorder = Recorder::new(&scene);
                let finished = simulate(
                    &scene,
                    &name,
                    folder.as_deref(),
                    Some(&mut recorder),
                    Beyond { text, ..Beyond::default() },
                    threads_of(&scene, None),
                );
                if let Some(signal) = signals::caught() {
                    say::error(FailureKind::Interrupted.name(), &format!("stopped by signal {signal}"));
                    return Status::after(signal);
                }
                let judgements = judge(&recorder, &finished.result, &finished.counters);
                report(path, &judgements, finished.seconds);
                judgements
            }
            Err(refusal) if !refusal.expected.is_empty() => {
                let judgements: Vec<_> = refusal.expected.iter().map(|e| expected_failure(e, refusal.name)).collect();
                report(path, &judgements, 0.0);
                judgements
            }
            Err(refusal) => {
                verdict.refuse(refusal);
                continue;
            }
        };
        held += judgements.iter().filter(|j| j.holds).count();
        total += judgements.len();
    }
    say::line(&format!("{held} of {total} expectations hold in {} deck(s)", decks.len()));
    if held < total {
        verdict.fail(Status::Unexpected, "unexpected", format!("{} expectation(s) do not hold", total - held));
    }
    verdict.finish(decks.len())
}

/// Folders are replaced by the decks in them, in the order of their names, subfolders last.
fn expand(paths: &[PathBuf]) -> Result<Vec<PathBuf>, String> {
    let mut decks = Vec::new();
    for path in paths {
        if !path.is_dir() {
            decks.push(path.clone());
            continue;
        }
        let entries = std::fs::read_dir(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let mut entries: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|e| e.path())).collect();
        entries.sort();
        let (folders, files): (Vec<_>, Vec<_>) = entries.into_iter().partition(|entry| entry.is_dir());
        decks.extend(files.into_iter().filter(|file| file.extension().is_some_and(|e| e == "toml")));
        decks.extend(expand(&folders)?);
    }
    Ok(decks)
}

fn report(path: &Path, judgements: &[Judgement], seconds: f64) {
    json::verify(path, seconds, judgements);
    let verdict = if judgements.iter().all(|j| j.holds) { "ok" } else { "FAILED" };
    let nothing = if judgements.is_empty() { ", expects nothing" } else { "" };
    say::line(&format!("{verdict:<6} {} ({seconds:.3} s{nothing})", path.display()));
    let width =
        |pick: fn(&Judgement) -> &str| judgements.iter().map(|j| pick(j).chars().count()).max().unwrap_or(0).min(48);
    let (what, expected, came) = (width(|j| &j.what), width(|j| &j.expected), width(|j| &j.came));
    for j in judgements {
        let mark = if j.holds { " " } else { "X" };
        let error = j.error.map_or(String::new(), |e| format!("error {e:.2e}"));
        let ratio = j.ratio.map_or(String::new(), |r| format!(", {:.0} % of the tolerance", 100.0 * r));
        let line = format!("  {mark} {:<what$}  {:>expected$}  {:>came$}  {error}{ratio}", j.what, j.expected, j.came);
        say::line(line.trim_end());
    }
}
