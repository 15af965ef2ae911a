//! What each effect of a scene changes in its answer, and what it costs: each is taken out in turn, and the scene is run again.

use crate::deck::{self, Deck, Diagnostic, EffectWord, SpringBody};
use crate::drive::{Counters, Failure, Mode, Observer, Run, Snapshot, Stage, StageWork};
use crate::scene::{self, Scene};
use std::time::Instant;

/// A run is timed again until it has taken so many seconds in all.
const TIMED: f64 = 0.2;

/// But not more often than this.
const MOST_REPEATS: usize = 9;

/// What takes more attempts than so many times those of the whole scene, and a few, is given up.
const MOST_ATTEMPTS: u64 = 20;
const FEW_ATTEMPTS: u64 = 200;

/// Forces below this part of the moments over the length of the scene are round-off, and moments likewise.
const ROUND_OFF: f64 = 1e-6;

/// Times that differ by less than this part are the same.
const SAME_TIME: f64 = 0.02;

/// The outputs of a run, and what it took.
#[derive(Clone)]
pub struct Outcome {
    /// How it ended
    pub ended: Result<(), Failure>,
    /// Stage and clock of each row: the time, or in static stages the load factor
    clocks: Vec<(usize, f64)>,
    /// Row by row
    rows: Vec<Vec<f64>>,
    /// Modes and critical loads, by the columns behind those of the rows
    modes: Vec<f64>,
    /// Steps and levels tried
    attempts: u64,
    /// Work done
    pub counters: Counters,
    /// Wall-clock seconds, the median of several runs
    pub seconds: f64,
}

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

impl Ablation {
    /// A table of comma-separated values: a line for each output and each variant, the cheapest one last.
    pub fn to_csv(&self) -> String {
        let mut text = String::from("without,status,iterations,seconds,output,change\n");
        let whole = self.whole.seconds;
        text += &format!(",finished,{},{whole:?},,\n", self.whole.counters.work.iterations);
        for variant in self.variants.iter().chain([&self.cheapest]) {
            let without = variant.without.iter().map(|word| word.key()).collect::<Vec<_>>().join("+");
            let Some(outcome) = variant.outcome() else {
                text += &format!("{without},failed,,,,\n");
                continue;
            };
            let (iterations, seconds) = (outcome.counters.work.iterations, outcome.seconds);
            for (column, change) in self.columns.iter().zip(&variant.changes) {
                let change = if change.is_nan() { String::new() } else { format!("{change:?}") };
                text += &format!("{without},finished,{iterations},{seconds:?},{column},{change}\n");
            }
        }
        text
    }
}

/// Collects the columns of every row.
struct Columns<'a> {
    scene: &'a Scene,
    clocks: Vec<(usize, f64)>,
    rows: Vec<Vec<f64>>,
    modes: Vec<f64>,
    attempts: u64,
    most_attempts: u64,
    interrupted: &'a dyn Fn() -> Option<i32>,
}

impl Columns<'_> {
    /// As many numbers as a stage (from 1) has columns, NaN for modes that it did not find.
    fn take_modes(&mut self, stage: usize, mut found: Vec<f64>) {
        found.resize(columns_of(stage, &self.scene.plan.stages[stage - 1]).len(), f64::NAN);
        self.modes.extend(found);
    }
}

impl Observer for Columns<'_> {
    fn row(&mut self, at: &Snapshot) -> Result<(), Failure> {
        let mut row = Vec::new();
        self.scene.probes.iter().for_each(|probe| probe.read(at, &mut row));
        let dynamic = self.scene.plan.stages[at.stage - 1].work.kind() == crate::model::StageKind::Dynamic;
        self.clocks.push((at.stage, if dynamic { at.state.time } else { at.state.load }));
        self.rows.push(row);
        Ok(())
    }

    fn modes(&mut self, stage: usize, modes: &[Mode]) -> Result<(), Failure> {
        let found = modes.iter().flat_map(|mode| [mode.omega, mode.growth]);
        self.take_modes(stage, found.collect());
        Ok(())
    }

    fn buckling(&mut self, stage: usize, loads: &[f64]) -> Result<(), Failure> {
        self.take_modes(stage, loads.to_vec());
        Ok(())
    }

    fn progress(&mut self, at: crate::drive::Moment, _done: f64) -> Result<(), Failure> {
        self.attempts += 1;
        match (self.interrupted)() {
            Some(signal) => Err(Failure::Interrupted { at, signal }),
            None if self.attempts > self.most_attempts => Err(Failure::Limit(format!(
                "given up at {at} after {} attempts at steps, {MOST_ATTEMPTS} times those of the whole scene",
                self.most_attempts
            ))),
            None => Ok(()),
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
    let whole = run(scene, u64::MAX, interrupted);
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
        let most = MOST_ATTEMPTS * self.whole.attempts + FEW_ATTEMPTS;
        let outcome = build(&deck).map(|scene| run(&scene, most, self.interrupted));
        if let Ok(Outcome { ended: Err(failure @ Failure::Interrupted { .. }), .. }) = &outcome {
            return Err(failure.clone());
        }
        let mut changes = match &outcome {
            Ok(outcome) if outcome.ended.is_ok() => changes(self.columns, self.length, self.whole, outcome),
            _ => Vec::new(),
        };
        if words.contains(&EffectWord::LargeRotations) {
            // Energies are those of the full theory, which the linear one does not keep.
            let energies = self.columns.iter().zip(&mut changes).filter(|(column, _)| column.starts_with("energy."));
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
            let tried = self.without(&[&best.without[..], &variant.without[..]].concat())?;
            if tried.largest().0 <= tolerance && tried.seconds() < best.seconds() {
                best = tried;
            }
        }
        Ok(best)
    }
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

/// Runs a scene several times for its time; everything else is the same each time.
fn run(scene: &Scene, most_attempts: u64, interrupted: &dyn Fn() -> Option<i32>) -> Outcome {
    let once = || {
        let (clocks, rows, modes) = (Vec::new(), Vec::new(), Vec::new());
        let mut columns = Columns { scene, clocks, rows, modes, attempts: 0, most_attempts, interrupted };
        let start = Instant::now();
        let (ended, counters) = Run::new(scene.plan.clone(), &mut columns).finish();
        let seconds = start.elapsed().as_secs_f64();
        let Columns { clocks, rows, modes, attempts, .. } = columns;
        Outcome { ended, clocks, rows, modes, attempts, counters, seconds }
    };
    let mut outcome = once();
    let mut times = vec![outcome.seconds];
    while outcome.ended.is_ok() && times.len() < MOST_REPEATS && times.iter().sum::<f64>() < TIMED {
        times.push(once().seconds);
    }
    times.sort_by(f64::total_cmp);
    outcome.seconds = times[times.len() / 2];
    outcome
}

/// The names of all outputs: the columns of the history, then modes and critical loads, stage by stage.
fn columns(scene: &Scene) -> Vec<String> {
    let mut columns: Vec<String> = scene.probes.iter().flat_map(|probe| probe.names.clone()).collect();
    columns.extend(scene.plan.stages.iter().enumerate().flat_map(|(k, stage)| columns_of(k + 1, stage)));
    columns
}

/// Those of a stage, which has this number.
fn columns_of(number: usize, stage: &Stage) -> Vec<String> {
    let mode = |mode: usize| ["omega", "growth"].map(|quantity| format!("stage{number}.mode{mode}.{quantity}"));
    match stage.work {
        StageWork::Modal { modes } => (1..=modes).flat_map(mode).collect(),
        StageWork::Buckling { modes } => (1..=modes).map(|mode| format!("stage{number}.buckling{mode}.load")).collect(),
        _ => Vec::new(),
    }
}

/// The largest change of each column over all rows, relative to the largest value of its kind in the whole scene: of all displacements,
/// rotations, forces, ….
fn changes(columns: &[String], length: f64, whole: &Outcome, other: &Outcome) -> Vec<f64> {
    let kinds: Vec<&str> = columns.iter().map(|column| kind(column)).collect();
    let mut scales = std::collections::HashMap::new();
    let of_history = columns.len() - whole.modes.len();
    let all = whole.rows.iter().map(|row| (0, row)).chain([(of_history, &whole.modes)]);
    for (first, row) in all {
        for (kind, value) in kinds[first..].iter().zip(row) {
            let scale = scales.entry(*kind).or_insert(0.0_f64);
            *scale = scale.max(value.abs());
        }
    }
    // Round-off of forces is no moment, and the other way about.
    for (one, other, arm) in
        [("f", "m", 1.0 / length), ("m", "f", length), ("N", "M", 1.0 / length), ("M", "N", length)]
    {
        let floor = scales.get(other).map_or(0.0, |scale| ROUND_OFF * arm * scale);
        scales.entry(one).and_modify(|scale| *scale = scale.max(floor));
    }
    let mut changes = vec![0.0_f64; columns.len()];
    let mut compare = |column: usize, came: f64, was: f64| {
        let (difference, scale) = ((came - was).abs(), scales[kinds[column]]);
        let same = difference == 0.0 || (came.is_nan() && was.is_nan());
        let now = if same { 0.0 } else { difference / scale };
        changes[column] = match now {
            // What is always zero has nothing that a change would compare with.
            _ if scale == 0.0 && !same => f64::NAN,
            now if now.is_nan() => f64::INFINITY,
            now if changes[column].is_nan() => now,
            now => changes[column].max(now),
        };
    };
    for (k, row) in whole.rows.iter().enumerate() {
        let Some(there) = other.at(whole, k) else { continue };
        there.iter().zip(row).enumerate().for_each(|(column, (came, was))| compare(column, *came, *was));
    }
    // A mode that was not found again is a change without measure.
    for (k, was) in whole.modes.iter().enumerate() {
        compare(of_history + k, other.modes.get(k).copied().unwrap_or(f64::NAN), *was);
    }
    changes
}

/// What a column shows: its name without the node, and without the direction. Energies compare with each other: their sum is the error
/// of the scheme alone.
fn kind(column: &str) -> &str {
    if column.starts_with("energy.") {
        return "energy";
    }
    if column.ends_with(".omega") || column.ends_with(".growth") {
        return "mode";
    }
    let quantity = column.rsplit('.').next().unwrap_or(column);
    quantity.trim_end_matches(|c: char| c.is_ascii_digit() || ['x', 'y', 'z'].contains(&c))
}

impl Outcome {
    /// The row that belongs to row `k` of another run: at its clock, between two rows where there is none. Of stages whose clock goes
    /// back, and of others that ended elsewhere, the last row is compared with the last.
    fn at(&self, other: &Self, k: usize) -> Option<Vec<f64>> {
        let (stage, clock) = other.clocks[k];
        if self.clocks.get(k) == Some(&(stage, clock)) {
            return self.rows.get(k).cloned();
        }
        if k + 1 == other.rows.len() {
            return self.rows.last().cloned();
        }
        let goes_on = |outcome: &Self| {
            let own = outcome.clocks.iter().filter(|(s, _)| *s == stage).map(|(_, clock)| *clock);
            own.is_sorted()
        };
        if !(goes_on(self) && goes_on(other)) {
            return None;
        }
        let after = self.clocks.iter().position(|&(s, c)| s == stage && c >= clock)?;
        if self.clocks[after].1 == clock {
            return Some(self.rows[after].clone());
        }
        let (s, c0) = *self.clocks.get(after.checked_sub(1)?)?;
        let share = (s == stage).then(|| (clock - c0) / (self.clocks[after].1 - c0))?;
        let (a, b) = (&self.rows[after - 1], &self.rows[after]);
        Some(a.iter().zip(b).map(|(a, b)| a + (b - a) * share).collect())
    }
}

/// Whether there is something of an effect in a scene.
fn acts(word: EffectWord, deck: &Deck, scene: &Scene) -> bool {
    let any = |names: &[&str]| scene.reasons.iter().any(|reason| reason.active && names.contains(&reason.name));
    let sprung = |spring: &deck::Spring| match spring.body {
        SpringBody::Ground { damping, .. } => damping != [0.0; 6],
        SpringBody::Between { damping, .. } => damping != 0.0,
    };
    match word {
        EffectWord::Planar => any(&["planar"]),
        EffectWord::RotaryInertia => any(&["rotary inertia", "section inertia at nodes"]),
        EffectWord::Gyroscopic => {
            any(&["rotary inertia", "eccentric section inertia", "section inertia at nodes", "rigid body inertia"])
        }
        EffectWord::Shear => any(&["shear"]),
        EffectWord::Extension => any(&["extension"]),
        EffectWord::Damping => {
            deck.damping.is_some_and(|factors| factors != [0.0; 2])
                || deck.springs.iter().any(sprung)
                || deck.joints.iter().any(|joint| joint.damping != 0.0)
        }
        EffectWord::Gravity => any(&["gravity on beams", "gravity on bodies"]),
        EffectWord::FollowerTangent => {
            any(&["following line loads", "following forces", "following moments", "dead moments"])
        }
        EffectWord::GeometricStiffness => any(&["geometric stiffness"]),
        EffectWord::LargeRotations => any(&["large rotations"]),
    }
}
