//! The importance of effects: each is switched off in turn, and the scene is run again for the
//! change of its outputs and its time.

mod change;
mod present;
mod table;

use crate::deck::{Deck, EffectWord, Words};
use crate::scene::Scene;
use crate::study::StudyError;
use crate::study::built::BuiltDeck;
use crate::study::outcome::{Outcome, columns};
use beamsim_core::run::Failure;
use beamsim_core::sorting::{sort_by, sort_numbers};
use change::changes;
use present::acts;

/// A reduced scene is given up after this factor of the attempts of the whole scene, and some more:
/// it would take longer than any user waits.
const MOST_ATTEMPTS: u64 = 20;
const MORE_ATTEMPTS: u64 = 200;

/// Total time of a run that is timed, in seconds: it is repeated until then.
const TIMED_SECONDS: f64 = 0.2;

/// The largest number of repetitions.
const MOST_REPEATS: usize = 99;

/// Times that differ relatively by less than this are equal: medians of several runs vary by about
/// as much.
const SAME_TIME: f64 = 0.02;

/// A scene without some of its effects.
#[derive(Clone)]
pub struct ReducedScene {
    /// The effects that were switched off
    pub without: Vec<EffectWord>,
    /// The run; `Err` where there is no such scene
    outcome: Result<Outcome, String>,
    /// The change of each column, relative to the largest value of its kind in the whole scene; NaN
    /// where there is nothing to compare, empty where the run failed
    changes: Vec<f64>,
}

/// The study of a scene.
pub struct EffectStudy {
    /// The names of the columns
    pub columns: Vec<String>,
    /// The run with all effects
    pub(crate) whole: Outcome,
    /// The scene without each of its effects, sorted by falling change
    pub reduced: Vec<ReducedScene>,
    /// Effects that can be switched off, but are not in the scene
    pub absent: Vec<EffectWord>,
    /// The scene without all effects that can be left out together
    pub cheapest: ReducedScene,
}

impl ReducedScene {
    /// The largest change, and the number of its column; infinite where the run failed.
    pub fn largest(&self) -> (f64, usize) {
        if self.outcome().is_none() {
            return (f64::INFINITY, 0);
        }
        let worst = |best: (f64, usize), (column, &change): (usize, &f64)| {
            if change > best.0 { (change, column) } else { best }
        };
        self.changes.iter().enumerate().fold((0.0, 0), worst)
    }

    /// Wall-clock seconds of the run.
    pub fn seconds(&self) -> f64 {
        self.outcome().map_or(f64::INFINITY, |outcome| outcome.seconds)
    }

    /// The run, where it finished.
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref().ok().filter(|outcome| outcome.ended.is_ok())
    }

    /// The reason why there is no finished run; empty where there is one.
    pub fn failure(&self) -> String {
        match &self.outcome {
            Err(message) => message.clone(),
            Ok(Outcome { ended: Err(failure), .. }) => format!("{}: {failure}", failure.name()),
            Ok(_) => String::new(),
        }
    }
}

/// Switches each effect of a deck off in turn, then together those that change no output by more
/// than `tolerance`. `interrupted` gives the signal that was caught; `progress` takes a description
/// of each run.
pub fn study_effects(
    deck: &Deck,
    scene: &Scene,
    tolerance: f64,
    interrupted: &dyn Fn() -> Option<i32>,
    progress: &mut dyn FnMut(&str),
) -> Result<EffectStudy, StudyError> {
    let columns = columns(scene);
    let (present, absent) = EffectWord::values().partition::<Vec<_>, _>(|word| acts(*word, deck, scene));
    progress("with all effects");
    let whole = timed(scene, u64::MAX, interrupted);
    if let Err(failure) = &whole.ended {
        return Err(StudyError::Failure(failure.clone()));
    }
    let baseline = Baseline { deck, whole: &whole, columns: &columns, length: scene.plan.model.length, interrupted };
    let mut reduced = Vec::new();
    for word in present {
        progress(&format!("without {}", word.word()));
        reduced.push(baseline.without(&[word])?);
    }
    sort_by(&mut reduced, |a, b| b.largest().0.total_cmp(&a.largest().0));
    progress("without all effects that can be left out");
    let cheapest = baseline.cheapest(&reduced, tolerance)?;
    Ok(EffectStudy { columns, reduced, absent, cheapest, whole })
}

/// The whole scene, with which reduced ones are compared.
struct Baseline<'a> {
    deck: &'a Deck,
    whole: &'a Outcome,
    columns: &'a [String],
    /// The length of the scene
    length: f64,
    interrupted: &'a dyn Fn() -> Option<i32>,
}

impl Baseline<'_> {
    fn without(&self, words: &[EffectWord]) -> Result<ReducedScene, StudyError> {
        let mut deck = self.deck.clone();
        words.iter().for_each(|&word| deck.effects.force(word, false));
        if words.contains(&EffectWord::LargeRotations) {
            // Linear stages are computed in space, also where the deck forces a plane.
            deck.effects.force(EffectWord::Planar, false);
        }
        let most = MOST_ATTEMPTS * self.whole.attempts + MORE_ATTEMPTS;
        let built = BuiltDeck::changed(&deck, &[]).map_err(|error| error.to_string());
        let outcome = built.map(|built| timed(&built.scene, most, self.interrupted));
        if let Ok(Outcome { ended: Err(failure @ Failure::Interrupted { .. }), .. }) = &outcome {
            return Err(StudyError::Failure(failure.clone()));
        }
        let changes = match &outcome {
            Ok(outcome) if outcome.ended.is_ok() => changes(self.columns, self.length, self.whole, outcome),
            Ok(_) | Err(_) => Vec::new(),
        };
        Ok(ReducedScene { without: words.to_vec(), outcome, changes })
    }

    /// Leaves effects out together, those with the smallest change first, as long as no output
    /// changes by more than `tolerance`. Effects whose removal saves no time stay.
    fn cheapest(&self, reduced: &[ReducedScene], tolerance: f64) -> Result<ReducedScene, StudyError> {
        let mut best = ReducedScene {
            without: Vec::new(),
            outcome: Ok(self.whole.clone()),
            changes: vec![0.0; self.columns.len()],
        };
        for one in reduced.iter().rev().filter(|one| one.largest().0 <= tolerance) {
            if one.seconds() > self.whole.seconds * (1.0 - SAME_TIME) {
                continue;
            }
            // The scene without the first effect alone has been run already.
            let tried = if best.without.is_empty() {
                one.clone()
            } else {
                self.without(&[&best.without[..], &one.without[..]].concat())?
            };
            if tried.largest().0 <= tolerance && tried.seconds() < best.seconds() {
                best = tried;
            }
        }
        Ok(best)
    }
}

/// Runs a scene several times for the median of its time. All other results are the same each time.
fn timed(scene: &Scene, most_attempts: u64, interrupted: &dyn Fn() -> Option<i32>) -> Outcome {
    let once = || Outcome::of(scene, None, most_attempts, interrupted);
    let mut outcome = once();
    let mut times = vec![outcome.seconds];
    while outcome.ended.is_ok() && times.len() < MOST_REPEATS && times.iter().sum::<f64>() < TIMED_SECONDS {
        times.push(once().seconds);
    }
    sort_numbers(&mut times);
    outcome.seconds = times[times.len() / 2];
    outcome
}
