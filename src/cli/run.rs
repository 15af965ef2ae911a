//! `beamsim run`

use super::accuracy::RunArguments;
use super::error::CommandError;
use super::folders::{check_names, folder};
use super::simulate::{Finished, simulate};
use super::status::Status;
use super::thread_count::{on_threads, threads_of};
use super::verdict::Verdict;
use super::{console, json, load, outputs, report, signals};
use crate::scene::Scene;
use beamsim_core::run::Failure;
use std::path::{Path, PathBuf};

/// Runs decks one after the other, each after a search for elements and steps where an accuracy is
/// wanted.
pub fn run(decks: &[PathBuf], settings: &[String], wanted: &RunArguments, out: Option<&Path>) -> Status {
    let mut verdict = Verdict::default();
    if let Err(error) = check_names(decks) {
        verdict.fail(error);
        return verdict.finish(1);
    }
    for (number, path) in decks.iter().enumerate() {
        let name = load::name(path);
        let folder = folder(out, &name, decks.len() > 1);
        if let Err(error) = run_one(&name, path, settings, wanted, &folder, &mut verdict) {
            verdict.fail(error);
        }
        if let Some(signal) = signals::caught() {
            if number + 1 < decks.len() {
                verdict.fail(CommandError::Stopped { signal, message: format!("stopped by signal {signal}") });
            }
            break;
        }
    }
    verdict.finish(decks.len())
}

fn run_one(
    name: &str,
    path: &Path,
    settings: &[String],
    wanted: &RunArguments,
    folder: &Path,
    verdict: &mut Verdict,
) -> Result<(), CommandError> {
    let loaded = load::deck(path, settings)?;
    let results = outputs::claim(folder)?;
    // From here on a signal stops what is under way, and leaves the folder in order.
    let _kept = signals::keep();
    if wanted.searches(&loaded) {
        wanted.restart.refuse_early(&results)?;
    }
    let mut chosen = wanted.choose(name, path, loaded, &results)?;
    let mut target = wanted.restart.target(name, results, &chosen.loaded.scene)?;
    let missed = chosen.missed.take();
    let (scene, extras) = wanted.extras(path, chosen, &mut target)?;
    let threads = threads_of(&scene, wanted.threads);
    let mut finished = simulate(&scene, name, Some(target), None, extras, threads);
    summarise(name, &scene, &finished, folder);
    finished.record.iter().for_each(|record| json::run(path, folder, record));
    if let (Some(film), Some(record)) = (finished.film.take(), finished.record.take()) {
        let page = folder.join("report.html");
        let written = report::write(&scene, name, &record, film, folder, &page);
        written.unwrap_or_else(|error| verdict.fail(error));
    }
    // From here on another run may write to the folder.
    drop(finished.folder.take());
    finished.result.map_err(CommandError::Run)?;
    missed.map_or(Ok(()), |missed| Err(CommandError::Missed(missed)))
}

/// Prints a few lines after a run.
fn summarise(name: &str, scene: &Scene, finished: &Finished, folder: &Path) {
    let Finished { result, counters, seconds, threads, .. } = finished;
    let work = &counters.work;
    if let Some(title) = &scene.title {
        console::line(&format!("{name}: {title}"));
    }
    let unknowns = scene.plan.model.slots() * 3;
    let planar = scene.reasons.iter().filter(|r| r.active && r.name == "planar").map(|r| r.name);
    let evaluated = counters.evaluations.iter().filter(|(_, count)| *count > 0).map(|(name, _)| *name);
    let acting = planar.chain(evaluated).collect::<Vec<_>>().join(", ");
    console::line(&format!("  {} elements, {unknowns} unknowns; {acting}", scene.mesh.element_count));
    console::line(&format!(
        "  {} steps, {} iterations, {} cut-backs, {} chart switches, {} mixed elements in {seconds:.3} s{}",
        counters.steps,
        work.iterations,
        counters.cutbacks,
        work.chart_switches,
        counters.mixed_elements,
        on_threads(*threads)
    ));
    match result {
        Ok(()) => console::line(&format!("  {}", folder.join("history.csv").display())),
        Err(failure) => {
            if !matches!(failure, Failure::Io(_)) {
                let partial = folder.join("history.partial.csv");
                console::line(&format!("  results up to the failure: {}", partial.display()));
            }
            if folder.join("checkpoint").exists() {
                console::note("the run can go on from its checkpoint: repeat the command with --resume");
            }
            if let Some(hint) = failure.hint(&scene.plan) {
                console::note(&format!("hint: {hint}"));
            }
        }
    }
}
