//! What each effect of a scene changes in its answer, and what it costs: each is taken out in turn, and the scene is run again.

mod change;
mod present;
mod table;

use crate::deck::{Deck, Diagnostic, EffectWord};
use crate::scene::{self, Scene};
use crate::study::outcome::{Outcome, columns};
use crate::study::scale::quantity;
use beamsim_core::probe::Quantity;
use beamsim_core::run::Failure;
use change::changes;
use present::acts;

/// What takes more attempts than so many times those of the whole scene, and a few, is given up: it would not end in any time that a
/// user waits, and is no cheaper.
const MOST_ATTEMPTS: u64 = 20;
const FEW_ATTEMPTS: u64 = 200;

/// A run is timed again until it has taken so many seconds in all.
const TIMED: f64 = 0.2;

/// But not more often than this.
const MOST_REPEATS: usize = 99;

/// Times that differ by less than this part are the same: medians of several runs repeat to about this.
const SAME_TIME: f64 = 0.02;

/// What a scene without some of its effects does.
#[derive(Clone)]
pub struct Variant {
    /// What was taken out
    pub without: Vec<EffectWord>,
    /// What came of it; `Err` where there is no such scene
    pub outcome: Result<Outcome, String>,
    /// The change of each column, relative to the largest value of its kind in the whole scene; NaN where there is nothing to compare,
    /// empty where the run failed
    pub changes: Vec<f64>,
}

/// The study of a scene.
pub struct Ablation {
    /// The names of the columns
    pub columns: Vec<String>,
    /// The scene as it is
    pub whole: Outcome,
    /// Without each effect that acts, those that change most first
    pub variants: Vec<Variant>,
    /// Effects that can be taken out, but are not in the scene
    pub absent: Vec<EffectWord>,
    /// Without all that may go
    pub cheapest: Variant,
}

impl Variant {
    /// The largest change, and the number of its column; infinite where the scene fails.
    pub fn largest(&self) -> (f64, usize) {
        let worst = |best: (f64, usize), (column, &change): (usize, &f64)| {
            if change > best.0 { (change, column) } else { best }
        };
        match &self.outcome {
            Ok(outcome) if outcome.ended.is_ok() => self.changes.iter().enumerate().fold((0.0, 0), worst),
            _ => (f64::INFINITY, 0),
        }
    }

    /// Seconds of the run.
    pub fn seconds(&self) -> f64 {
        self.outcome().map_or(f64::INFINITY, |outcome| outcome.seconds)
    }

    /// What came of it, where it came to its end.
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref().ok().filter(|outcome| outcome.ended.is_ok())
    }

    /// Why it did not.
    pub fn failure(&self) -> String {
        match &self.outcome {
            Err(message) => message.clone(),
            Ok(Outcome { ended: Err(failure), .. }) => format!("{}: {failure}", failure.name()),
            Ok(_) => String::new(),
        }
    }
}

/// Takes each effect of a deck out in turn, then together those that change no output by more than `tolerance`. `interrupted` tells of
/// signals.
pub fn ablate(
    deck: &Deck,
    scene: &Scene,
    tolerance: f64,
    interrupted: &dyn Fn() -> Option<i32>,
    tell: &mut dyn FnMut(&str),
) -> Result<Ablation, Failure> {
    let columns = columns(scene);
    let (present, absent) = EffectWord::ALL.into_iter().partition::<Vec<_>, _>(|word| acts(*word, deck, scene));
    tell("the whole scene");
    let whole = timed(scene, u64::MAX, interrupted);
    if let Err(failure) = &whole.ended {
        return Err(failure.clone());
    }
    let study = Study { deck, whole: &whole, columns: &columns, length: scene.plan.model.length, interrupted };
    let mut variants = Vec::new();
    for word in present {
        tell(&format!("without {}", word.key()));
        variants.push(study.without(&[word])?);
    }
    variants.sort_by(|a, b| b.largest().0.total_cmp(&a.largest().0));
    tell("without all that may go");
    let cheapest = study.cheapest(&variants, tolerance)?;
    Ok(Ablation { columns, variants, absent, cheapest, whole })
}

struct Study<'a> {
    deck: &'a Deck,
    whole: &'a Outcome,
    columns: &'a [String],
    /// That of the scene
    length: f64,
    interrupted: &'a dyn Fn() -> Option<i32>,
}

impl Study<'_> {
    fn without(&self, words: &[EffectWord]) -> Result<Variant, Failure> {
        let mut deck = self.deck.clone();
        words.iter().for_each(|&word| deck.effects.force(word, false));
        if words.contains(&EffectWord::LargeRotations) {
            // Linear stages are treated in space, also where the deck insists on a plane.
            deck.effects.force(EffectWord::Planar, false);
        }
        let most = MOST_ATTEMPTS * self.whole.attempts + FEW_ATTEMPTS;
        let outcome = build(&deck).map(|scene| timed(&scene, most, self.interrupted));
        if let Ok(Outcome { ended: Err(failure @ Failure::Interrupted { .. }), .. }) = &outcome {
            return Err(failure.clone());
        }
        let mut changes = match &outcome {
            Ok(outcome) if outcome.ended.is_ok() => changes(self.columns, self.length, self.whole, outcome),
            _ => Vec::new(),
        };
        if words.contains(&EffectWord::LargeRotations) {
            // Energies are those of the full theory, which the linear one does not keep.
            let is_energy = |column: &str| quantity(column) == Some(Quantity::Energy);
            let energies = self.columns.iter().zip(&mut changes).filter(|(column, _)| is_energy(column));
            energies.for_each(|(_, change)| *change = f64::NAN);
        }
        Ok(Variant { without: words.to_vec(), outcome, changes })
    }

    /// What may go goes together, the least first, as long as no output changes by more than `tolerance`. What saves no time stays.
    fn cheapest(&self, variants: &[Variant], tolerance: f64) -> Result<Variant, Failure> {
        let nothing =
            Variant { without: Vec::new(), outcome: Ok(self.whole.clone()), changes: vec![0.0; self.columns.len()] };
        let mut best = nothing;
        for variant in variants.iter().rev().filter(|variant| variant.largest().0 <= tolerance) {
            if variant.seconds() > self.whole.seconds * (1.0 - SAME_TIME) {
                continue;
            }
            // The first alone is in the table already, with its time.
            let tried = match best.without[..] {
                [] => variant.clone(),
                _ => self.without(&[&best.without[..], &variant.without[..]].concat())?,
            };
            if tried.largest().0 <= tolerance && tried.seconds() < best.seconds() {
                best = tried;
            }
        }
        Ok(best)
    }
}

/// Runs a scene several times for the median of its time; everything else is the same each time.
fn timed(scene: &Scene, most_attempts: u64, interrupted: &dyn Fn() -> Option<i32>) -> Outcome {
    let once = || Outcome::of(scene, None, most_attempts, interrupted);
    let mut outcome = once();
    let mut times = vec![outcome.seconds];
    while outcome.ended.is_ok() && times.len() < MOST_REPEATS && times.iter().sum::<f64>() < TIMED {
        times.push(once().seconds);
    }
    times.sort_by(f64::total_cmp);
    outcome.seconds = times[times.len() / 2];
    outcome
}

fn build(deck: &Deck) -> Result<Scene, String> {
    let mut diagnostics = Vec::new();
    let scene = scene::build(deck, &mut diagnostics);
    let wrong = diagnostics.iter().find(|diagnostic| !diagnostic.is_warning());
    match (scene, wrong) {
        (Some(scene), None) => Ok(scene),
        (_, wrong) => {
            Err(wrong.map_or("there is no such scene".into(), |diagnostic: &Diagnostic| diagnostic.message.clone()))
        }
    }
}
