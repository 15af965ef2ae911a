//! `beamsim effects`

use super::run::{folder, refuse_twins};
use super::{Status, Verdict, json, load, say, signals};
use crate::deck::EffectWord;
use crate::output::PartFile;
use crate::study::ablation::{Ablation, Variant, ablate};
use beamsim_core::failure::FailureKind;
use std::path::{Path, PathBuf};

/// Studies decks one after the other.
pub fn effects(decks: &[PathBuf], settings: &[String], tolerance: f64, out: Option<&Path>) -> Status {
    let mut verdict = Verdict::default();
    if !(tolerance.is_finite() && tolerance >= 0.0) {
        verdict.fail(Status::Wrong, "usage", "--tolerance must be finite and not negative".into());
        return verdict.finish(1);
    }
    if refuse_twins(decks, &mut verdict) {
        return verdict.finish(1);
    }
    signals::caught();
    for path in decks {
        if let Err((status, name, message)) = study(path, settings, tolerance, out, decks.len() > 1, &mut verdict) {
            verdict.fail(status, name, message);
        }
        if signals::caught().is_some() {
            break;
        }
    }
    verdict.finish(decks.len())
}

fn study(
    path: &Path,
    settings: &[String],
    tolerance: f64,
    out: Option<&Path>,
    several: bool,
    verdict: &mut Verdict,
) -> Result<(), (Status, &'static str, String)> {
    let load::Loaded { deck, scene, .. } = match load::deck(path, settings) {
        Ok(loaded) => loaded,
        Err(refusal) => {
            verdict.refuse(refusal);
            return Ok(());
        }
    };
    let name = load::name(path);
    let mut progress = |what: &str| say::note(&format!("{name}: {what}"));
    let found = ablate(&deck, &scene, tolerance, &signals::caught, &mut progress)
        .map_err(|failure| (Status::of_failure(&failure), failure.name(), failure.to_string()))?;
    tell(&name, scene.title.as_deref(), &found, tolerance);
    let folder = folder(out, &name, several);
    let table = found.to_csv().map_err(|error| (Status::Io, FailureKind::Io.name(), error.to_string()))?;
    PartFile::write(&folder, "effects.csv", &table)
        .map_err(|error| (Status::Io, FailureKind::Io.name(), error.to_string()))?;
    say::line(&format!("  {}", folder.join("effects.csv").display()));
    json::effects(path, &folder.join("effects.csv"), &found, tolerance);
    Ok(())
}

fn tell(name: &str, title: Option<&str>, found: &Ablation, tolerance: f64) {
    say::line(&format!("{name}: {}", title.unwrap_or("(no title)")));
    let whole = &found.whole;
    let iterations = whole.counters.work.iterations;
    say::line(&format!(
        "  all effects: {iterations} iterations, {} outputs, {:.3} ms",
        found.columns.len(),
        1e3 * whole.seconds
    ));
    say::line(&format!(
        "  {:<20} {:>14}  {:<16} {:>6} {:>11}",
        "without", "largest change", "of", "time", "iterations"
    ));
    found.variants.iter().for_each(|variant| tell_variant(variant, found));
    if !found.absent.is_empty() {
        let absent: Vec<_> = found.absent.iter().map(|word| word.key()).collect();
        say::line(&format!("  not in this scene: {}", absent.join(", ")));
    }
    tell_cheapest(found, tolerance);
}

fn tell_variant(variant: &Variant, found: &Ablation) {
    let without = names(&variant.without).join(", ");
    let (change, column) = variant.largest();
    let Some(outcome) = variant.outcome() else {
        return say::line(&format!("  {without:<20} {:>14}  {}", "-", variant.failure()));
    };
    let of = if change == 0.0 { "" } else { found.columns.get(column).map_or("", String::as_str) };
    let time = outcome.seconds / found.whole.seconds;
    let iterations = outcome.counters.work.iterations;
    say::line(&format!("  {without:<20} {change:>14.1e}  {of:<16} {time:>6.2} {iterations:>11}"));
}

fn tell_cheapest(found: &Ablation, tolerance: f64) {
    let cheapest = &found.cheapest;
    if cheapest.without.is_empty() {
        return say::line(&format!("  within {tolerance}: all effects stay, leaving none out saves time"));
    }
    let (change, _) = cheapest.largest();
    let time = cheapest.seconds() / found.whole.seconds;
    say::line(&format!("  within {tolerance}: {time:.2} of the time, largest change {change:.1e}, with"));
    say::line("    [effects]");
    names(&cheapest.without).iter().for_each(|name| say::line(&format!("    {name} = false")));
}

fn names(words: &[EffectWord]) -> Vec<&'static str> {
    words.iter().map(|word| word.key()).collect()
}
