//! `beamsim run --accuracy`: elements and steps for a wanted accuracy.

use super::error::{CommandError, DeckError};
use super::load::Loaded;
use super::progress::Progress;
use super::simulate::RunExtras;
use super::thread_count::cores;
use super::variant::{describe, paste_lines};
use super::{console, load, signals};
use crate::deck::{self, Accuracy, Deck};
use crate::output::{DeckSource, Film, ReachedAccuracy, ReachedColumn};
use crate::scene::Scene;
use crate::study::accuracy::{Found, reach};
use crate::study::cost::{Journal, StudyOptions};
use crate::study::error_bars::{ErrorBars, error_bars, polylines, refuse_paths};
use crate::study::{Outcome, StudyError};
use std::num::NonZero;
use std::path::Path;
use std::time::{Duration, Instant};

/// Arguments of `beamsim run` besides the decks.
#[derive(clap::Args)]
pub struct RunArguments {
    /// Choose elements and steps so that the estimated error of all outputs is below ERROR,
    /// relative to the largest value of each kind
    #[arg(long, value_name = "ERROR")]
    accuracy: Option<f64>,
    /// Time limit of this search: 90s, 5m, 1h
    #[arg(long, value_parser = console::duration, value_name = "TIME")]
    budget: Option<Duration>,
    /// Write estimated errors beside the columns of the history (`tip.ux.err`), from two more runs
    /// with other elements and steps
    #[arg(long)]
    error_bars: bool,
    /// Largest number of threads (default: one per core), for a search and for large scenes;
    /// results do not depend on it
    #[arg(long, value_parser = console::threads, value_name = "N")]
    pub threads: Option<NonZero<usize>>,
    /// Also write report.html, a page that plays the run back
    #[arg(long)]
    report: bool,
}

/// A scene that is ready to run.
pub struct PreparedRun {
    /// The scene
    pub scene: Scene,
    /// How far the wanted accuracy is missed, as a message, if it is
    pub missed: Option<String>,
    /// Additions to the results: accuracy, error bars, film
    pub extras: RunExtras,
}

impl RunArguments {
    /// Reads a deck, and searches for the wanted accuracy where there is one.
    pub fn prepare(&self, name: &str, path: &Path, settings: &[String]) -> Result<PreparedRun, CommandError> {
        let loaded = load::deck(path, settings)?;
        self.accuracy
            .map(Accuracy::check)
            .transpose()
            .map_err(|why| CommandError::Usage(format!("--accuracy: {why}")))?;
        let Some(wanted) = self.accuracy.map(Accuracy::All).or(loaded.deck.accuracy.clone()) else {
            if self.budget.is_some() {
                let why = "--budget limits the search for an accuracy: give --accuracy, or `accuracy` in the deck";
                return Err(CommandError::Usage(why.into()));
            }
            return self.with_bars(path, loaded, None, None);
        };
        note_polylines(&loaded.deck);
        if self.error_bars {
            refuse_paths(&loaded.deck).map_err(|found| study_error(found.into(), path, &loaded))?;
        }
        let start = Instant::now();
        let mut found = self.search(name, path, &loaded, &wanted)?;
        print_found(name, &loaded.deck, &found, &wanted);
        let accuracy = reached(&found, &wanted, start.elapsed());
        // The text in memory is used, since the file may have changed in the meantime.
        let settled = load::again(path, &loaded.text, &found.settings())?;
        let text = deck::apply(&loaded.source.text, &found.settings()).map_err(CommandError::deck)?;
        let loaded = Loaded { source: DeckSource { text, ..loaded.source }, ..settled };
        let missed = (!found.reached).then(|| missed(&found, &wanted));
        let prepared = self.with_bars(path, loaded, Some(accuracy), found.outcome.take())?;
        Ok(PreparedRun { missed, ..prepared })
    }

    fn with_bars(
        &self,
        path: &Path,
        loaded: Loaded,
        accuracy: Option<ReachedAccuracy>,
        outcome: Option<Outcome>,
    ) -> Result<PreparedRun, CommandError> {
        let bars = if self.error_bars { Some(bars(path, &loaded)?) } else { None };
        if self.error_bars && accuracy.is_none() {
            note_polylines(&loaded.deck);
        }
        let film = self.report.then(|| Film::of(&loaded.scene));
        let extras = RunExtras { accuracy, outcome, bars, source: loaded.source, film };
        Ok(PreparedRun { scene: loaded.scene, missed: None, extras })
    }

    fn search(&self, name: &str, path: &Path, loaded: &Loaded, wanted: &Accuracy) -> Result<Found, CommandError> {
        signals::caught();
        let mut progress = Progress::new(name);
        let mut show = |done: usize, all: usize| {
            progress.show(done as f64 / all as f64, || format!("searching for the accuracy: {done} of {all} runs"));
        };
        let options = StudyOptions {
            threads: cores(self.threads),
            budget: self.budget,
            interrupted: &signals::caught,
            progress: &mut show,
            journal: &mut Journal::default(),
        };
        let found = reach(&loaded.text, &loaded.deck, &loaded.scene, wanted, options);
        progress.done();
        let mut found = found.map_err(|error| study_error(error, path, loaded))?;
        match found.stopped.take() {
            None => Ok(found),
            Some(by) => {
                paste_lines(&loaded.deck, &found.settings()).iter().for_each(|line| console::note(line));
                Err(CommandError::SearchStopped { by, missed: missed(&found, wanted) })
            }
        }
    }
}

fn bars(path: &Path, loaded: &Loaded) -> Result<ErrorBars, CommandError> {
    let bars = error_bars(&loaded.text, &loaded.deck, &loaded.scene, &signals::caught);
    bars.map_err(|error| study_error(error, path, loaded))
}

/// The outputs of which an accuracy is wanted, with their estimated errors.
fn reached(found: &Found, wanted: &Accuracy, time: Duration) -> ReachedAccuracy {
    let mut columns = Vec::new();
    for (name, &estimate) in found.columns.iter().zip(&found.estimates) {
        let wanted = wanted.of(name);
        if wanted.is_finite() && !estimate.is_nan() {
            columns.push(ReachedColumn { name: name.clone(), wanted, estimate });
        }
    }
    ReachedAccuracy {
        columns,
        is_reached: found.reached,
        settings: found.settings(),
        runs: found.runs,
        seconds: time.as_secs_f64(),
    }
}

/// The message about an accuracy that was not reached.
fn missed(found: &Found, wanted: &Accuracy) -> String {
    let (column, estimate) = found.worst(wanted);
    format!(
        "an error of {:e} of `{column}` was not reached; the best estimate is {estimate:.1e}, with {}",
        wanted.of(column),
        describe(&found.variant)
    )
}

/// Notes beams whose straight pieces may approximate curves: no estimate contains that error.
fn note_polylines(deck: &Deck) {
    polylines(deck).iter().for_each(|line| console::note(line));
}

/// The error of a study as the error of its deck, with the lines of the text.
pub fn study_error(error: StudyError, path: &Path, loaded: &Loaded) -> CommandError {
    match error {
        StudyError::Deck(diagnostic) => CommandError::Deck(DeckError {
            message: format!("1 error in {}", path.display()),
            details: diagnostic.render(&path.display().to_string(), &loaded.text, console::styled()),
            ..DeckError::default()
        }),
        other => other.into(),
    }
}

fn print_found(name: &str, deck: &Deck, found: &Found, wanted: &Accuracy) {
    let (column, estimate) = found.worst(wanted);
    console::line(&format!("{name}: estimated error {estimate:.1e} of {column} ({} runs)", found.runs));
    console::line(&format!("  {}", describe(&found.variant)));
    paste_lines(deck, &found.settings()).iter().for_each(|line| console::line(&format!("    {line}")));
}
