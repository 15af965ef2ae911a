//! Predicts the duration of a run from its first moments on this machine.

use crate::scene::Scene;
use beamsim_core::run::{Counters, Failure, Moment, Observer, Run, Snapshot};
use std::fmt::Write;
use std::time::{Duration, Instant};

/// The prediction for a run.
pub struct Forecast {
    /// Wall-clock seconds of the whole run
    pub seconds: f64,
    /// Wall-clock seconds of the trial run
    pub watched: f64,
    /// The end of the trial run, if it came to one
    pub ended: Option<Result<(), Failure>>,
    /// True if the trial run did any iteration
    pub(crate) computed: bool,
    /// The last moment of the trial run
    pub at: Moment,
}

/// Runs a scene for a limited time and predicts the duration of the whole run: the running stage
/// continues at the pace of the later half of its attempts so far, and later stages take the usual
/// numbers of iterations.
pub fn forecast(scene: &Scene, limit: Duration) -> Forecast {
    let at = Moment { stage: 1, time: 0.0, load: 0.0 };
    let mut watch = Watch {
        scene,
        begun: Instant::now(),
        limit,
        seen: Vec::new(),
        at,
        under_way: 0.0,
        until: None,
        row: String::new(),
    };
    let (result, counters) = Run::new(scene.plan.clone(), &mut watch).finish();
    let watched = watch.begun.elapsed().as_secs_f64();
    let gave_up = matches!(result, Err(Failure::Interrupted { .. }));
    let left = if gave_up { watch.left(watched, &counters) } else { 0.0 };
    let computed = counters.work.iterations > 0;
    Forecast { seconds: watched + left, watched, ended: (!gave_up).then_some(result), computed, at: watch.at }
}

/// The beginning of an attempt at a step or level.
struct Attempt {
    /// Wall-clock seconds from the start of the run
    elapsed: f64,
    /// The stage, from 0
    stage: usize,
    /// The finished part of the stage, from 0 to 1
    done: f64,
}

/// Observer of the trial run.
struct Watch<'a> {
    scene: &'a Scene,
    begun: Instant,
    limit: Duration,
    seen: Vec<Attempt>,
    at: Moment,
    /// The part of the stage that will be finished after the present attempt
    under_way: f64,
    /// The progress of the stage towards the end that `until` defines
    until: Option<UntilProgress>,
    row: String,
}

/// The progress of a stage towards the bound of its `until`.
#[derive(Clone, Copy)]
struct UntilProgress {
    /// The stage, from 0
    stage: usize,
    /// The watched value at its first row
    first: f64,
    /// The part of the way from there to the bound, from 0 to 1
    done: f64,
}

impl Watch<'_> {
    /// Predicted seconds from now to the end.
    fn left(&self, watched: f64, counters: &Counters) -> f64 {
        let Some(last) = self.seen.last() else { return 0.0 };
        let of_stage: Vec<&Attempt> = self.seen.iter().filter(|attempt| attempt.stage == last.stage).collect();
        let first = of_stage[0];
        let middle = of_stage[of_stage.len() / 2];
        // The preparation before the first attempt is not repeated.
        let an_iteration = (watched - self.seen[0].elapsed) / counters.work.iterations.max(1) as f64;
        let pace = |from: &Attempt| (last.elapsed - from.elapsed) / (last.done - from.done);
        // Searches for critical loads are slow at first and fast at the end.
        let searches = self.scene.plan.stages[last.stage].work.speeds_up();
        let from = if searches { [first, middle] } else { [middle, first] };
        let of_this = from.into_iter().map(pace).find(|pace| pace.is_finite() && *pace > 0.0);
        let of_this = of_this.unwrap_or(an_iteration * self.iterations(last.stage));
        let later = last.stage + 1..self.scene.plan.stages.len();
        of_this * (1.0 - last.done) + later.map(|stage| an_iteration * self.iterations(stage)).sum::<f64>()
    }

    fn look_at_until(&mut self, at: &Snapshot) {
        let stage = at.stage - 1;
        let Some(until) = &self.scene.plan.stages[stage].until else { return };
        let value = (until.column)(at);
        let first = self.until.filter(|until| until.stage == stage).map_or(value, |until| until.first);
        let part = |bound: f64| if bound == first { 0.0 } else { ((value - first) / (bound - first)).clamp(0.0, 1.0) };
        let done = [until.below, until.above].into_iter().flatten().map(part).fold(0.0, f64::max);
        self.until = Some(UntilProgress { stage, first, done });
    }

    /// The usual number of iterations of a stage.
    fn iterations(&self, stage: usize) -> f64 {
        let before = self.scene.plan.stages[..stage].iter().rev();
        let start = before.filter_map(|stage| stage.work.end()).next().unwrap_or(0.0);
        self.scene.plan.stages[stage].work.usual_iterations(start)
    }
}

impl Observer for Watch<'_> {
    /// Formats the row as a run would, without writing it.
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
        let until = self.until.filter(|until| until.stage == stage).map_or(0.0, |until| until.done);
        let begins = self.seen.last().is_none_or(|last| last.stage != stage);
        let tried = self.under_way;
        let next = done * stages - stage as f64;
        let before = self.seen.last().map_or(0.0, |last| last.done);
        // An attempt has failed if the next one ends at an earlier point.
        let behind = if begins {
            0.0
        } else if next > tried {
            tried
        } else {
            before
        };
        self.under_way = next;
        // At least one attempt is timed completely.
        let is_over =
            self.seen.first().is_some_and(|first| elapsed.as_secs_f64() - first.elapsed > self.limit.as_secs_f64());
        self.seen.push(Attempt { elapsed: elapsed.as_secs_f64(), stage, done: behind.max(until) });
        if is_over { Err(Failure::Interrupted { at, signal: 0 }) } else { Ok(()) }
    }
}
