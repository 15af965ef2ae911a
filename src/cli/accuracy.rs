//! `beamsim run --accuracy`: elements and steps for a wanted accuracy.

use super::load::{Loaded, Refusal};
use super::progress::Progress;
use super::{Status, cores, load, say, signals};
use crate::deck::{Accuracy, Deck};
use crate::output::{Film, Reached};
use crate::scene::Scene;
use crate::study::Outcome;
use crate::study::accuracy::{Found, reach};
use crate::study::cost::{self, Journal, Options, Pace, Point};
use crate::study::error_bars::{ErrorBars, error_bars, polylines, refuse_paths};
use beamsim_core::failure::FailureKind;
use std::num::NonZero;
use std::path::Path;
use std::time::{Duration, Instant};

/// What the user wants of a run.
#[derive(clap::Args)]
pub struct Target {
    /// Choose elements and steps for this estimated error of all outputs, relative to the largest value of each kind
    #[arg(long, value_name = "ERROR")]
    accuracy: Option<f64>,
    /// Search no longer than this for them: 90s, 5m, 1h
    #[arg(long, value_parser = say::duration, value_name = "TIME")]
    budget: Option<Duration>,
    /// Write estimated errors beside the columns of the history (`tip.ux.err`), from two coarser runs
    #[arg(long)]
    error_bars: bool,
    /// Threads, at most (default: one a core); they serve a search and large scenes, whose results are the same on any number of them
    #[arg(long, value_parser = say::threads, value_name = "N")]
    pub threads: Option<NonZero<usize>>,
    /// Also write report.html, a page that plays the run back
    #[arg(long)]
    report: bool,
}

/// A scene that is ready to run.
pub struct Aimed {
    /// The deck as it was read
    pub text: String,
    /// The scene
    pub scene: Scene,
    /// The accuracy that was wanted, and what was reached
    pub reached: Option<Reached>,
    /// By what it was missed, if it was
    pub missed: Option<String>,
    /// Its outputs, where the search for that accuracy has run it
    pub outcome: Option<Outcome>,
    /// Error bars, where they are wanted
    pub bars: Option<ErrorBars>,
    /// What films it for a report, where one is wanted
    pub film: Option<Film>,
}

impl Target {
    /// Reads a deck, and searches for the wanted accuracy where there is one.
    pub fn aim(&self, name: &str, path: &Path, settings: &[String]) -> Result<Aimed, Refusal> {
        let loaded = load::deck(path, settings)?;
        let usage = |why: String| Refusal::usage(why);
        self.accuracy.map(Accuracy::check).transpose().map_err(|why| usage(format!("--accuracy: {why}")))?;
        let Some(wanted) = self.accuracy.map(Accuracy::All).or(loaded.deck.accuracy.clone()) else {
            if self.budget.is_some() {
                let why = "--budget bounds the search for an accuracy: give --accuracy, or `accuracy` in the deck";
                return Err(usage(why.into()));
            }
            return self.with_bars(path, loaded, None, None);
        };
        tell_polylines(&loaded.deck);
        if self.error_bars {
            refuse_paths(&loaded.deck).map_err(|why| refused(cost::Refusal::Deck(why), path, &loaded))?;
        }
        let start = Instant::now();
        let mut found = self.search(name, path, &loaded, &wanted)?;
        tell(name, &loaded.deck, &found, &wanted);
        let columns = found.columns.iter().zip(&found.estimates).filter(|(_, estimate)| !estimate.is_nan());
        let columns = columns.map(|(column, &estimate)| (column.clone(), wanted.of(column), estimate));
        let reached = Reached {
            columns: columns.filter(|(_, wanted, _)| wanted.is_finite()).collect(),
            is_reached: found.reached,
            settings: found.settings.clone(),
            runs: found.runs,
            seconds: start.elapsed().as_secs_f64(),
        };
        // The file may have changed since it was read.
        let loaded = load::again(path, &loaded.text, &found.settings)?;
        let missed = (!found.reached).then(|| missed(&found, &wanted));
        let aimed = self.with_bars(path, loaded, Some(reached), found.outcome.take())?;
        Ok(Aimed { missed, ..aimed })
    }

    fn with_bars(
        &self,
        path: &Path,
        loaded: Loaded,
        reached: Option<Reached>,
        outcome: Option<Outcome>,
    ) -> Result<Aimed, Refusal> {
        let made = || error_bars(&loaded.text, &loaded.deck, &loaded.scene, &signals::caught);
        let bars = self.error_bars.then(made).transpose().map_err(|refusal| refused(refusal, path, &loaded))?;
        if self.error_bars && reached.is_none() {
            tell_polylines(&loaded.deck);
        }
        let film = self.report.then(|| Film::of(&loaded.scene));
        Ok(Aimed { text: loaded.text, scene: loaded.scene, reached, missed: None, outcome, bars, film })
    }

    fn search(&self, name: &str, path: &Path, loaded: &Loaded, wanted: &Accuracy) -> Result<Found, Refusal> {
        signals::caught();
        let mut progress = Progress::new(name);
        let mut tell = |done: usize, all: usize| {
            progress.tell(done as f64 / all as f64, || format!("looking for the accuracy: {done} of {all} runs"));
        };
        let options = Options {
            threads: cores(self.threads),
            budget: self.budget,
            interrupted: &signals::caught,
            tell: &mut tell,
            journal: &mut Journal::default(),
        };
        let found = reach(&loaded.text, &loaded.deck, &loaded.scene, wanted, options);
        progress.done();
        let found = found.map_err(|refusal| refused(refusal, path, loaded))?;
        match &found.stopped {
            None => Ok(found),
            Some(stopped) => {
                lines(&loaded.deck, &found.settings).iter().for_each(|line| say::note(line));
                let message = format!("the search was stopped: {}", missed(&found, wanted));
                Err(Refusal::with_status(Status::of_failure(stopped), stopped.name(), message))
            }
        }
    }
}

/// Says by how much an accuracy is missed.
fn missed(found: &Found, wanted: &Accuracy) -> String {
    let (column, estimate) = found.worst(wanted);
    format!(
        "an error of {:e} of `{column}` is not reached, the best estimate is {estimate:.1e}, with {}",
        wanted.of(column),
        describe(&found.point)
    )
}

/// Notes beams whose straight pieces may stand for curves, which no estimate contains.
fn tell_polylines(deck: &Deck) {
    polylines(deck).iter().for_each(|line| say::note(line));
}

/// A study that could not be made, as it is told for a deck.
pub fn refused(refusal: cost::Refusal, path: &Path, loaded: &Loaded) -> Refusal {
    match refusal {
        cost::Refusal::Failure(failure) => {
            Refusal::with_status(Status::of_failure(&failure), failure.name(), failure.to_string())
        }
        cost::Refusal::Deck(diagnostic) => Refusal {
            details: diagnostic.render(&path.display().to_string(), &loaded.text, say::styled()),
            ..Refusal::of(FailureKind::Deck, format!("1 error in {}", path.display()))
        },
    }
}

fn tell(name: &str, deck: &Deck, found: &Found, wanted: &Accuracy) {
    let (column, estimate) = found.worst(wanted);
    say::line(&format!("{name}: estimated error {estimate:.1e}, of {column} ({} runs to find)", found.runs));
    say::line(&format!("  {}", describe(&found.point)));
    lines(deck, &found.settings).iter().for_each(|line| say::line(&format!("    {line}")));
}

/// A variant in words.
pub fn describe(point: &Point) -> String {
    let elements = match point.count() {
        0 => None,
        1 => Some("1 element".into()),
        count => Some(format!("{count} elements")),
    };
    let pace = match point.pace {
        Pace::Timeless => None,
        Pace::Steps(1.0) => Some("the deck's step".into()),
        Pace::Steps(factor) => Some(format!("{factor} times the step")),
        Pace::Adapts(tolerance) => Some(format!("step_tolerance {tolerance:e}")),
    };
    [Some(point.family.name()), elements, pace].into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// Settings as lines to paste into a deck, and as they stand on a command line.
pub fn lines(deck: &Deck, settings: &[String]) -> Vec<String> {
    if settings.is_empty() {
        return vec!["with the deck as it stands".into()];
    }
    let mut lines = Vec::new();
    let mut table = "";
    for setting in settings {
        let (path, value) = setting.split_once('=').unwrap_or((setting, ""));
        let (place, key) = path.rsplit_once('.').unwrap_or(("", path));
        if place != table {
            table = place;
            let (list, number) = place.split_once('.').unwrap_or((place, "0"));
            let number: usize = number.parse().unwrap_or(0);
            let which = match deck.beams.get(number).filter(|_| list == "beam") {
                Some(beam) => format!("beam {}", beam.name.value),
                None => format!("{list} {}", number + 1),
            };
            lines.push(format!("in [[{list}]] of {which}:"));
        }
        lines.push(format!("  {key} = {value}"));
    }
    let words = settings.iter().map(|setting| {
        let bare = setting.replace('"', "");
        if bare.contains(['[', ' ']) { format!("--set '{bare}'") } else { format!("--set {bare}") }
    });
    lines.push(format!("or: {}", words.collect::<Vec<_>>().join(" ")));
    lines
}
