//! `beamsim effects`

use super::error::CommandError;
use super::folders::{check_names, folder};
use super::load::{self, Loaded};
use super::status::Status;
use super::verdict::Verdict;
use super::{console, json, outputs, signals};
use crate::deck::EffectWord;
use crate::output::{OutputError, OutputKind, PartFile};
use crate::study::effects::{EffectStudy, ReducedScene, study_effects};
use std::path::{Path, PathBuf};

/// Studies decks one after the other.
pub fn effects(decks: &[PathBuf], settings: &[String], tolerance: f64, out: Option<&Path>) -> Status {
    let mut verdict = Verdict::default();
    if let Err(error) = check_tolerance(tolerance).and_then(|()| check_names(decks)) {
        verdict.fail(error);
        return verdict.finish(1);
    }
    for path in decks {
        let name = load::name(path);
        let folder = folder(out, &name, decks.len() > 1);
        if let Err(error) = one(&name, path, settings, tolerance, &folder) {
            verdict.fail(error);
        }
    }
    verdict.finish(decks.len())
}

fn check_tolerance(tolerance: f64) -> Result<(), CommandError> {
    if tolerance.is_finite() && tolerance >= 0.0 {
        return Ok(());
    }
    Err(CommandError::Usage("--tolerance must be finite and not negative".into()))
}

fn one(name: &str, path: &Path, settings: &[String], tolerance: f64, folder: &Path) -> Result<(), CommandError> {
    outputs::check_folder(folder, &[("effects.csv", OutputKind::Effects)])?;
    let Loaded { deck, scene, .. } = load::deck(path, settings)?;
    let mut progress = |what: &str| console::note(&format!("{name}: {what}"));
    let found = study_effects(&deck, &scene, tolerance, &signals::caught, &mut progress)?;
    for warning in &found.whole.counters.findings.warnings {
        console::count_warnings(1);
        console::note(&format!("{name}: {warning}"));
    }
    print(name, scene.title.as_deref(), &found, tolerance);
    let table = found.to_csv().map_err(OutputError::from)?;
    PartFile::write(folder, "effects.csv", &table)?;
    let file = folder.join("effects.csv");
    console::line(&format!("  {}", file.display()));
    json::effects(path, &file, &found, tolerance);
    Ok(())
}

fn print(name: &str, title: Option<&str>, found: &EffectStudy, tolerance: f64) {
    console::line(&format!("{name}: {}", title.unwrap_or("(no title)")));
    let whole = &found.whole;
    let iterations = whole.counters.work.iterations;
    console::line(&format!(
        "  all effects: {iterations} iterations, {} outputs, {:.3} ms",
        found.columns.len(),
        1e3 * whole.seconds
    ));
    console::line(&format!(
        "  {:<20} {:>14}  {:<16} {:>6} {:>11}",
        "without", "largest change", "of", "time", "iterations"
    ));
    found.reduced.iter().for_each(|reduced| print_reduced(reduced, found));
    if !found.absent.is_empty() {
        let absent: Vec<_> = found.absent.iter().map(|word| word.key()).collect();
        console::line(&format!("  not in this scene: {}", absent.join(", ")));
    }
    print_cheapest(found, tolerance);
}

fn print_reduced(reduced: &ReducedScene, found: &EffectStudy) {
    let without = names(&reduced.without).join(", ");
    let (change, column) = reduced.largest();
    let Some(outcome) = reduced.outcome() else {
        return console::line(&format!("  {without:<20} {:>14}  {}", "-", reduced.failure()));
    };
    let of = if change == 0.0 { "" } else { found.columns.get(column).map_or("", String::as_str) };
    let time = outcome.seconds / found.whole.seconds;
    let iterations = outcome.counters.work.iterations;
    console::line(&format!("  {without:<20} {change:>14.1e}  {of:<16} {time:>6.2} {iterations:>11}"));
}

fn print_cheapest(found: &EffectStudy, tolerance: f64) {
    let cheapest = &found.cheapest;
    if cheapest.without.is_empty() {
        return console::line(&format!("  within {tolerance}: keep all effects: leaving effects out saves no time"));
    }
    let (change, _) = cheapest.largest();
    let time = cheapest.seconds() / found.whole.seconds;
    console::line(&format!("  within {tolerance}: {time:.2} of the time, largest change {change:.1e}, with"));
    console::line("    [effects]");
    names(&cheapest.without).iter().for_each(|name| console::line(&format!("    {name} = false")));
}

fn names(words: &[EffectWord]) -> Vec<&'static str> {
    words.iter().map(|word| word.key()).collect()
}
