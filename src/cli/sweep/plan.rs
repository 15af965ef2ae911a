//! The sweep that a command line or a sweep.toml describes.

use super::SweepArguments;
use super::slurm::absolute;
use crate::cli::console;
use crate::cli::error::{CommandError, DeckError};
use crate::cli::folders::folder;
use crate::cli::load;
use crate::deck::{Diagnostic, Looked, SweepFile, VaryBody, VaryTable};
use crate::study::SweepError;
use crate::study::sweep::{Combination, PointResult, Range, Store, Sweep, SweepAxis, Values, usual_outputs};
use std::path::{Path, PathBuf};

/// Points with results that are run again.
#[derive(Clone, Copy, Debug)]
pub struct Again {
    /// Those that failed
    pub(super) failed: bool,
    /// Those whose process died
    pub(super) killed: bool,
}

/// A sweep with its place.
pub struct Plan {
    /// Name of the deck, or of the sweep.toml
    pub(super) name: String,
    /// The sweep
    pub(super) sweep: Sweep,
    /// Folder of the table
    pub(super) folder: PathBuf,
    /// Results of its points
    pub(super) store: Store,
}

impl Plan {
    /// Reads the deck and what is varied of it.
    pub fn of(wanted: &SweepArguments) -> Result<Self, CommandError> {
        let text = load::deck_text(&wanted.file)?;
        let given = if SweepFile::is_one(&text) { Some(read(&wanted.file, &text)?) } else { None };
        let file = given.clone().unwrap_or_default();
        let usage = |error: SweepError| CommandError::Usage(error.to_string());

        let mut axes = file.vary.iter().map(axis).collect::<Result<Vec<_>, _>>().map_err(usage)?;
        let given_axes = wanted.vary.iter().map(|text| SweepAxis::parse(text)).collect::<Result<Vec<_>, _>>();
        let given_axes = given_axes.map_err(usage)?;
        // The command line overrides the file. A key that it varies twice is an error.
        axes.retain(|of_file| given_axes.iter().all(|axis| axis.key != of_file.key));
        axes.extend(given_axes);
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
            return Err(CommandError::Usage(
                "a sweep runs the elements and steps of the deck: remove `accuracy` from the deck, or use --error-bars"
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
        sweep.check(&loaded.deck)?;
        let name = load::name(&wanted.file);
        let folder = folder(wanted.out.as_deref(), &name, false);
        Ok(Self { sweep, store: Store::of(&folder), folder, name })
    }

    /// The saved result of a point (from 0).
    pub fn known(&self, point: usize) -> Option<PointResult> {
        self.store.find(&self.sweep.identity(point))
    }

    /// Saves the result of a point (from 0).
    pub fn keep(&self, point: usize, result: &PointResult) -> Result<(), CommandError> {
        Ok(self.store.keep(&self.sweep.identity(point), result)?)
    }

    /// A text that differs for every sweep and every folder.
    pub fn fingerprint(&self) -> String {
        self.sweep.fingerprint(&std::path::absolute(&self.folder).unwrap_or_default().display().to_string())
    }

    /// The command line that makes this sweep from any folder.
    pub fn words(&self, wanted: &SweepArguments) -> Result<Vec<String>, CommandError> {
        let path = |path: &Path| absolute(path).map(|path| path.display().to_string());
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
    pub fn open(&self, wanted: Again) -> Vec<usize> {
        let known = self.sweep.gathered(&self.store);
        let again = |result: &PointResult| {
            if result.status == PointResult::KILLED { wanted.killed } else { wanted.failed && !result.finished() }
        };
        let is_open = |k: &usize| known[*k].as_ref().is_none_or(again);
        let open: Vec<usize> = (0..known.len()).filter(is_open).collect();
        if open.len() < known.len() {
            console::note(&format!("{}: continues, {} points are done", self.name, known.len() - open.len()));
        }
        open
    }
}

fn read(path: &Path, text: &str) -> Result<SweepFile, CommandError> {
    SweepFile::read(text).map_err(|found: Vec<Diagnostic>| {
        CommandError::Deck(DeckError {
            message: load::count_of_errors(found.len(), path),
            details: load::render(&path.display().to_string(), text, &found),
            ..DeckError::default()
        })
    })
}

fn axis(table: &VaryTable) -> Result<SweepAxis, SweepError> {
    let values = match table.body {
        VaryBody::List(ref values) => Ok(Values::List(values.clone())),
        VaryBody::Range { from, to, count, log } => Values::of_range(Range { from, to, logarithmic: log }, count),
    };
    let key = table.key.value.clone();
    match values {
        Ok(values) => Ok(SweepAxis { key, values }),
        Err(reason) => Err(SweepError::Key { key, reason: Box::new(reason) }),
    }
}
