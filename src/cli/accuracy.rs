//! `beamsim run --accuracy`: elements and steps for a wanted accuracy.

use super::error::{CommandError, DeckError};
use super::load::Loaded;
use super::progress::Progress;
use super::restart::RestartArguments;
use super::simulate::{RunExtras, Target};
use super::thread_count::cores;
use super::variant::{describe, paste_lines};
use super::{console, load, signals};
use crate::deck::{self, Accuracy, Deck};
use crate::output::{DeckSource, Film, ReachedAccuracy, ReachedColumn, ReachedMesh, ReachedMeshes, ResultFolder};
use crate::scene::Scene;
use crate::study::accuracy::{Found, MeshFound, Meshes, reach};
use crate::study::cost::{Journal, StudyOptions};
use crate::study::error_bars::{ErrorBars, error_bars, polylines, refuse_paths};
use crate::study::{Outcome, StudyError};
use std::num::NonZero;
use std::path::Path;
use std::time::{Duration, Instant};

/// The file of the runs of a search that was stopped.
const JOURNAL: &str = "accuracy.journal";

/// Arguments of `beamsim run` besides the decks.
#[derive(clap::Args)]
pub struct RunArguments {
    /// Choose elements and steps so that the estimated error of each output is below ERROR, relative
    /// to the largest displacement, rotation, … of the run: 1e-3
    #[arg(long, value_name = "ERROR")]
    accuracy: Option<f64>,
    /// Time limit of the search for this accuracy: 90s, 5m, 1h
    #[arg(long, value_parser = console::duration, value_name = "TIME")]
    budget: Option<Duration>,
    /// Write estimated errors beside the columns of the history (`tip.ux.err`), from two more runs:
    /// half the elements, half the step
    #[arg(long)]
    error_bars: bool,
    /// Largest number of threads (default: one per core), for a search and for large scenes;
    /// results do not depend on it
    #[arg(long, value_parser = console::threads, value_name = "N")]
    pub(super) threads: Option<NonZero<usize>>,
    /// Also write report.html, a page that plays the run back
    #[arg(long)]
    report: bool,
    #[command(flatten)]
    pub(super) restart: RestartArguments,
}

/// A deck whose elements and steps are chosen.
pub struct Chosen {
    /// The deck
    pub(super) loaded: Loaded,
    /// How far the wanted accuracy was reached, where one is wanted
    accuracy: Option<ReachedAccuracy>,
    /// The outputs of the run where the search has run it already
    outcome: Option<Outcome>,
    /// How far the wanted accuracy is missed, as a message, if it is
    pub(super) missed: Option<String>,
}

impl RunArguments {
    /// True if an accuracy of a deck is wanted.
    pub fn searches(&self, loaded: &Loaded) -> bool {
        self.accuracy.is_some() || loaded.deck.accuracy.is_some()
    }

    /// Searches for the wanted accuracy of a deck where there is one. Runs of the search are saved
    /// in the folder of results, so that a search that was stopped goes on.
    pub fn choose(
        &self,
        name: &str,
        path: &Path,
        loaded: Loaded,
        folder: &ResultFolder,
    ) -> Result<Chosen, CommandError> {
        self.accuracy
            .map(Accuracy::check)
            .transpose()
            .map_err(|why| CommandError::Usage(format!("--accuracy: {why}")))?;
        let Some(wanted) = self.accuracy.map(Accuracy::All).or(loaded.deck.accuracy.clone()) else {
            if self.budget.is_some() {
                let why = "--budget limits the search for an accuracy: give --accuracy, or `accuracy` in the deck";
                return Err(CommandError::Usage(why.into()));
            }
            if self.error_bars {
                note_polylines(&loaded.deck);
            }
            return Ok(Chosen { loaded, accuracy: None, outcome: None, missed: None });
        };
        note_polylines(&loaded.deck);
        if self.error_bars {
            refuse_paths(&loaded.deck).map_err(|found| study_error(found.into(), path, &loaded))?;
        }
        let start = Instant::now();
        let mut found = self.search(name, path, &loaded, &wanted, folder)?;
        print_found(name, &loaded.deck, &found, &wanted);
        let accuracy = Some(reached(&found, &wanted, start.elapsed()));
        // The text in memory is used, since the file may have changed in the meantime.
        let settled = load::again(path, &loaded.text, &found.settings())?;
        let text = deck::apply(&loaded.source.text, &found.settings()).map_err(CommandError::deck)?;
        let loaded = Loaded { source: DeckSource { text, ..loaded.source }, ..settled };
        let missed = (!found.reached).then(|| missed(&found, &wanted));
        Ok(Chosen { loaded, accuracy, outcome: found.outcome.take(), missed })
    }

    /// Additions to the results of a run that goes to a target: accuracy, error bars, film.
    pub fn extras(&self, path: &Path, chosen: Chosen, target: &mut Target) -> Result<(Scene, RunExtras), CommandError> {
        let Chosen { loaded, accuracy, outcome, .. } = chosen;
        let is_resumed = target.saved.is_some();
        let saved = target.saved.as_mut();
        let (bars_so_far, reel) = saved.map_or((None, None), |saved| (saved.bars.take(), saved.reel.take()));
        let missing =
            [("--error-bars", self.error_bars && bars_so_far.is_none()), ("--report", self.report && reel.is_none())];
        if let Some((option, _)) = missing.into_iter().find(|&(_, is_missing)| is_resumed && is_missing) {
            let why =
                format!("the run was begun without {option}: resume it without that, or use --fresh to begin anew");
            return Err(CommandError::Checkpoint(why));
        }
        let bars = match bars_so_far {
            Some(place) => Some(ErrorBars::resume(&loaded.deck, &loaded.scene, place)),
            None if self.error_bars => Some(bars(path, &loaded)?),
            None => None,
        };
        let film = match reel {
            Some(reel) => Some(Film::resume(&loaded.scene, reel)),
            None => self.report.then(|| Film::of(&loaded.scene)),
        };
        Ok((loaded.scene, RunExtras { accuracy, outcome, bars, source: loaded.source, film }))
    }

    fn search(
        &self,
        name: &str,
        path: &Path,
        loaded: &Loaded,
        wanted: &Accuracy,
        folder: &ResultFolder,
    ) -> Result<Found, CommandError> {
        // A signal stops the search, which tells how far it came.
        let _kept = signals::keep();
        let identity = format!("beamsim {}\n{wanted:?}\n{}", env!("CARGO_PKG_VERSION"), loaded.text);
        let mut journal = Journal::open(folder.path(), JOURNAL, &identity)?;
        if !journal.is_empty() {
            console::note(&format!("{name}: continues a stopped search, {} runs are done", journal.len()));
        }
        let mut progress = Progress::new(name);
        let mut show = |done: usize, all: usize| {
            progress.show(done as f64 / all as f64, || format!("searching for the accuracy: {done} of {all} runs"));
        };
        let options = StudyOptions {
            threads: cores(self.threads),
            budget: self.budget,
            interrupted: &signals::caught,
            progress: &mut show,
            journal: &mut journal,
        };
        let found = reach(&loaded.text, &loaded.deck, &loaded.scene, wanted, options);
        progress.done();
        let mut found = match found {
            Ok(found) => found,
            Err(error) => {
                if journal.is_empty() {
                    journal.close()?;
                }
                return Err(study_error(error, path, loaded));
            }
        };
        match found.stopped.take() {
            None => {
                journal.close()?;
                Ok(found)
            }
            Some(by) => {
                paste_lines(&loaded.deck, &found.settings()).iter().for_each(|line| console::note(line));
                console::note(&format!("{name}: {} runs are saved; run the command again to continue", journal.len()));
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
        meshes: found.meshes.as_ref().map(meshes),
    }
}

fn meshes(found: &Meshes) -> ReachedMeshes {
    let mesh =
        |mesh: &MeshFound| ReachedMesh { elements: mesh.elements, estimate: mesh.estimate, seconds: mesh.seconds };
    ReachedMeshes {
        equal: mesh(&found.equal),
        placed: found.placed.as_ref().map(mesh),
        predicted: found.predicted,
        is_placed: found.is_placed,
    }
}

/// The message about an accuracy that was not reached.
fn missed(found: &Found, wanted: &Accuracy) -> String {
    let (column, estimate) = found.worst(wanted);
    let why = if found.jump.is_some() {
        "; cables that become taut within steps cost accuracy: adaptive steps with a small `step_tolerance` find each change"
    } else {
        ""
    };
    format!(
        "an error of {:e} of `{column}` was not reached; the best estimate is {estimate:.1e}, with {}{why}",
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
    let StudyError::Deck(diagnostic) = error else { return error.into() };
    CommandError::Deck(DeckError {
        message: format!("1 error in {}", path.display()),
        details: diagnostic.render(&path.display().to_string(), &loaded.text, console::styled()),
        ..DeckError::default()
    })
}

fn print_found(name: &str, deck: &Deck, found: &Found, wanted: &Accuracy) {
    let (column, estimate) = found.worst(wanted);
    console::line(&format!("{name}: estimated error {estimate:.1e} of {column} ({} runs)", found.runs));
    console::line(&format!("  {}", describe(&found.variant)));
    if let Some(meshes) = &found.meshes {
        console::line(&format!("  {}", in_words(meshes)));
    }
    paste_lines(deck, &found.settings()).iter().for_each(|line| console::line(&format!("    {line}")));
}

/// Equal and placed elements in one line.
fn in_words(meshes: &Meshes) -> String {
    let mesh = |kind: &str, mesh: &MeshFound| {
        let time = if mesh.seconds.is_nan() { String::new() } else { format!(", {:.1e} s", mesh.seconds) };
        let enough = if mesh.is_reached { "" } else { " (not enough)" };
        format!("{} {kind} elements: error {:.1e} of {}{enough}{time}", mesh.elements, mesh.estimate, mesh.column)
    };
    let equal = mesh("equal", &meshes.equal);
    match &meshes.placed {
        Some(placed) => format!("{equal}; {}", mesh("placed", placed)),
        None => format!("{equal}; placed elements: not fewer (predicted {:.0} %)", 100.0 * meshes.predicted),
    }
}
