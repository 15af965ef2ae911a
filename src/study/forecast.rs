//! How long a run will take, from its first moments on this machine.

use crate::scene::Scene;
use beamsim_core::run::{Counters, Failure, Moment, Observer, Run, Snapshot};
use std::fmt::Write;
use std::time::{Duration, Instant};

/// What is known of a run before it.
pub struct Forecast {
    /// Wall-clock seconds of the whole run
    pub seconds: f64,
    /// Seconds that it was watched
    pub watched: f64,
    /// How it ended within these, if it did
    pub ended: Option<Result<(), Failure>>,
    /// Whether a state had been computed by then
    pub computed: bool,
    /// Where it was then
    pub at: Moment,
}

/// Watches a run until the patience is over, or it ends, and tells how long all of it will take: a stage under way goes on as
/// in the later half of what was seen of it, later ones take so many iterations as are usual.
pub fn forecast(scene: &Scene, patience: Duration) -> Forecast {
    let at = Moment { stage: 1, time: 0.0, load: 0.0 };
    let (begun, seen) = (Instant::now(), Vec::new());
    let mut watch = Watch { scene, begun, patience, seen, at, under_way: 0.0, watched: None, row: String::new() };
    let (result, counters) = Run::new(scene.plan.clone(), &mut watch).finish();
    let watched = watch.begun.elapsed().as_secs_f64();
    let gave_up = matches!(result, Err(Failure::Interrupted { .. }));
    let left = if gave_up { watch.left(watched, &counters) } else { 0.0 };
    let computed = counters.work.iterations > 0;
    Forecast { seconds: watched + left, watched, ended: (!gave_up).then_some(result), computed, at: watch.at }
}

/// An attempt at a step or level begins.
struct Attempt {
    /// Seconds from the start of the run
    elapsed: f64,
    /// Stage, from 0
    stage: usize,
    /// How much of the stage lies behind, from 0 to 1
    done: f64,
}

struct Watch<'a> {
    scene: &'a Scene,
    begun: Instant,
    patience: Duration,
    seen: Vec<Attempt>,
    at: Moment,
    /// How much of the stage will lie behind after the attempt under way
    under_way: f64,
    /// What `until` of a stage watches: the stage, the value at its first row, and how far it has come from there to where it ends the stage
    watched: Option<(usize, f64, f64)>,
    row: String,
}

impl Watch<'_> {
    /// Seconds from now to the end.
    fn left(&self, watched: f64, counters: &Counters) -> f64 {
        let Some(last) = self.seen.last() else { return 0.0 };
        let of_stage: Vec<&Attempt> = self.seen.iter().filter(|attempt| attempt.stage == last.stage).collect();
        let (first, middle) = (of_stage[0], of_stage[of_stage.len() / 2]);
        // What comes before the first attempt is done once.
        let an_iteration = (watched - self.seen[0].elapsed) / counters.work.iterations.max(1) as f64;
        let pace = |from: &Attempt| (last.elapsed - from.elapsed) / (last.done - from.done);
        let speeds_up = self.scene.plan.stages[last.stage].work.speeds_up();
        let from = if speeds_up { [first, middle] } else { [middle, first] };
        let of_this = from.into_iter().map(pace).find(|pace| pace.is_finite() && *pace > 0.0);
        let of_this = of_this.unwrap_or(an_iteration * self.iterations(last.stage));
        let later = last.stage + 1..self.scene.plan.stages.len();
        of_this * (1.0 - last.done) + later.map(|stage| an_iteration * self.iterations(stage)).sum::<f64>()
    }

    fn look_at_until(&mut self, at: &Snapshot) {
        let stage = at.stage - 1;
        let Some(until) = &self.scene.plan.stages[stage].until else { return };
        let value = (until.column)(at);
        let first = self.watched.filter(|(watched, ..)| *watched == stage).map_or(value, |(_, first, _)| first);
        let come = |bound: f64| if bound == first { 0.0 } else { ((value - first) / (bound - first)).clamp(0.0, 1.0) };
        let come = [until.below, until.above].into_iter().flatten().map(come).fold(0.0, f64::max);
        self.watched = Some((stage, first, come));
    }

    /// Newton iterations that a stage usually takes.
    fn iterations(&self, stage: usize) -> f64 {
        let before = self.scene.plan.stages[..stage].iter().rev();
        let start = before.filter_map(|stage| stage.work.end()).next().unwrap_or(0.0);
        self.scene.plan.stages[stage].work.usual_iterations(start)
    }
}

impl Observer for Watch<'_> {
    /// Writes the row as a run would, but to nowhere.
    fn row(&mut self, at: &Snapshot) -> Result<(), Failure> {
        let mut values = Vec::new();
        self.scene.probes.iter().for_each(|probe| probe.read(at, &mut values));
        self.row.clear();
        for value in values {
            let _ = write!(self.row, "{value:?},");
        }
        self.look_at_until(at);
        Ok(())
    }

    fn progress(&mut self, at: Moment, done: f64) -> Result<(), Failure> {
        let elapsed = self.begun.elapsed();
        let stages = self.scene.plan.stages.len() as f64;
        let stage = at.stage - 1;
        self.at = at;
        let come = self.watched.filter(|(watched, ..)| *watched == stage).map_or(0.0, |(.., come)| come);
        let begins = self.seen.last().is_none_or(|last| last.stage != stage);
        let (tried, next) = (self.under_way, done * stages - stage as f64);
        let before = self.seen.last().map_or(0.0, |last| last.done);
        // An attempt that is followed by one that goes less far has failed.
        let behind = if begins {
            0.0
        } else if next > tried {
            tried
        } else {
            before
        };
        self.under_way = next;
        // At least one attempt is seen to its end.
        let is_over =
            self.seen.first().is_some_and(|first| elapsed.as_secs_f64() - first.elapsed > self.patience.as_secs_f64());
        self.seen.push(Attempt { elapsed: elapsed.as_secs_f64(), stage, done: behind.max(come) });
        if is_over { Err(Failure::Interrupted { at, signal: 0 }) } else { Ok(()) }
    }
}
