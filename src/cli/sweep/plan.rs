//! What a command line, or a sweep.toml, makes of a sweep.

use super::Wanted;
use super::slurm::absolute;
use crate::cli::load::{self, Refusal};
use crate::cli::run::folder;
use crate::cli::say;
use crate::deck::{Diagnostic, Looked, SweepFile, VaryBody, VaryTable};
use crate::study::sweep::{Axis, Combination, Outcome, Range, Store, Sweep, Values, usual_outputs};
use beamsim_core::failure::FailureKind;
use std::path::{Path, PathBuf};

/// A sweep with its place.
pub struct Plan {
    /// Of the deck, or of the sweep.toml
    pub name: String,
    /// The sweep
    pub sweep: Sweep,
    /// Where its table goes
    pub folder: PathBuf,
    /// Where its points go
    pub store: Store,
}

impl Plan {
    /// Reads the deck and what is varied of it.
    pub fn of(wanted: &Wanted) -> Result<Self, Refusal> {
        let text = load::text(&wanted.file)?;
        let given = if SweepFile::is_one(&text) { Some(read(&wanted.file, &text)?) } else { None };
        let file = given.clone().unwrap_or_default();
        let usage = |why: String| Refusal::usage(why);

        let mut axes = file.vary.iter().map(axis).collect::<Result<Vec<_>, _>>().map_err(usage)?;
        for text in &wanted.vary {
            let axis = Axis::parse(text).map_err(usage)?;
            axes.retain(|known| known.key != axis.key);
            axes.push(axis);
        }
        let how = match wanted.sample.map(|count| count as usize).or(file.sample.filter(|_| !wanted.zip)) {
            Some(count) => Combination::Sample { count, seed: wanted.seed.or(file.seed).unwrap_or(1) },
            None if wanted.zip || file.zip => Combination::Zip,
            None => Combination::Grid,
        };
        let deck = match &given {
            Some(file) => wanted.file.parent().unwrap_or(Path::new("")).join(&file.deck),
            None => wanted.file.clone(),
        };
        let settings: Vec<String> = file.set.iter().chain(&wanted.set).cloned().collect();
        let loaded = load::deck(&deck, &settings)?;
        if loaded.deck.accuracy.is_some() {
            return Err(usage(
                "a sweep runs the deck's own elements and steps: take `accuracy` out of the deck, or use --error-bars"
                    .into(),
            ));
        }
        let words = if wanted.outputs.is_empty() { &file.outputs } else { &wanted.outputs };
        let outputs = match words.len() {
            0 => usual_outputs(&loaded.scene),
            _ => words.iter().map(|text| Looked::parse(text)).collect(),
        };
        let sweep =
            Sweep::new(&loaded.text, &axes, how, outputs, wanted.error_bars || file.error_bars).map_err(usage)?;
        sweep.check(&loaded.deck).map_err(|why| Refusal::of(FailureKind::Deck, why))?;
        let name = load::name(&wanted.file);
        let folder = folder(wanted.out.as_deref(), &name, false);
        Ok(Self { sweep, store: Store::of(&folder), folder, name })
    }

    /// What is known of a point (from 0).
    pub fn known(&self, point: usize) -> Option<Outcome> {
        self.store.find(&self.sweep.identity(point))
    }

    /// Keeps what came of a point (from 0).
    pub fn keep(&self, point: usize, outcome: &Outcome) -> Result<(), Refusal> {
        let kept = self.store.keep(&self.sweep.identity(point), outcome);
        kept.map_err(Refusal::io)
    }

    /// What no other sweep and no other folder has.
    pub fn fingerprint(&self) -> String {
        self.sweep.fingerprint(&std::path::absolute(&self.folder).unwrap_or_default().display().to_string())
    }

    /// The words that make the same sweep from any folder.
    pub fn words(&self, wanted: &Wanted) -> Result<Vec<String>, Refusal> {
        let path = |path: &Path| Ok(absolute(path)?.display().to_string());
        let mut words = vec!["sweep".into(), path(&wanted.file)?, "--out".into(), path(&self.folder)?];
        for (flag, values) in [("--set", &wanted.set), ("--vary", &wanted.vary), ("--output", &wanted.outputs)] {
            words.extend(values.iter().flat_map(|value| [flag.to_string(), value.clone()]));
        }
        let numbers = [("--sample", wanted.sample.map(u64::from)), ("--seed", wanted.seed)];
        for (flag, number) in numbers.into_iter().filter_map(|(flag, number)| Some((flag, number?))) {
            words.extend([flag.to_string(), number.to_string()]);
        }
        let flags = [("--zip", wanted.zip), ("--error-bars", wanted.error_bars)];
        words.extend(flags.into_iter().filter(|(_, set)| *set).map(|(flag, _)| flag.to_string()));
        Ok(words)
    }

    /// The points (from 0) that are still to be run.
    pub fn open(&self, redo: bool) -> Vec<usize> {
        let known = self.sweep.gathered(&self.store);
        let again = |outcome: &Outcome| outcome.status == Outcome::KILLED || (redo && !outcome.finished());
        let is_open = |k: &usize| known[*k].as_ref().is_none_or(again);
        let open: Vec<usize> = (0..known.len()).filter(is_open).collect();
        if open.len() < known.len() {
            say::note(&format!("{}: goes on after {} points that are done", self.name, known.len() - open.len()));
        }
        open
    }
}

fn read(path: &Path, text: &str) -> Result<SweepFile, Refusal> {
    SweepFile::read(text).map_err(|found: Vec<Diagnostic>| {
        let count = if found.len() == 1 { "1 error".to_string() } else { format!("{} errors", found.len()) };
        Refusal {
            details: load::render(&path.display().to_string(), text, &found),
            ..Refusal::of(FailureKind::Deck, format!("{count} in {}", path.display()))
        }
    })
}

fn axis(table: &VaryTable) -> Result<Axis, String> {
    let values = match table.body {
        VaryBody::List(ref values) => Ok(Values::List(values.clone())),
        VaryBody::Range { from, to, count, log } => Values::of_range(Range { from, to, logarithmic: log }, count),
    };
    let key = table.key.value.clone();
    Ok(Axis { values: values.map_err(|why| format!("`{key}`: {why}"))?, key })
}
