//! A run of a scene: all its outputs, and what they took.

use crate::drive::{Counters, Failure, Mode, Observer, Run, Snapshot, Stage, StageWork};
use crate::model::StageKind;
use crate::scene::Scene;
use std::time::Instant;

/// A run is timed again until it has taken so many seconds in all.
const TIMED: f64 = 0.2;

/// But not more often than this.
const MOST_REPEATS: usize = 9;

/// The outputs of a run, and what it took.
#[derive(Clone)]
pub struct Outcome {
    /// How it ended
    pub ended: Result<(), Failure>,
    /// Stage and clock of each row: the time, or in static stages the load factor
    pub(super) clocks: Vec<(usize, f64)>,
    /// Row by row
    pub(super) rows: Vec<Vec<f64>>,
    /// Modes and critical loads, by the columns behind those of the rows
    pub(super) modes: Vec<f64>,
    /// Steps and levels tried
    pub(super) attempts: u64,
    /// Work done
    pub counters: Counters,
    /// Wall-clock seconds, the median of several runs
    pub seconds: f64,
}

impl Outcome {
    /// Runs a scene several times for its time; everything else is the same each time.
    pub(super) fn of(scene: &Scene, most_attempts: u64, interrupted: &dyn Fn() -> Option<i32>) -> Self {
        let once = || {
            let (clocks, rows, modes) = (Vec::new(), Vec::new(), Vec::new());
            let mut columns = Columns { scene, clocks, rows, modes, attempts: 0, most_attempts, interrupted };
            let start = Instant::now();
            let (ended, counters) = Run::new(scene.plan.clone(), &mut columns).finish();
            let seconds = start.elapsed().as_secs_f64();
            let Columns { clocks, rows, modes, attempts, .. } = columns;
            Self { ended, clocks, rows, modes, attempts, counters, seconds }
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
}

/// The names of all outputs: the columns of the history, then modes and critical loads, stage by stage.
pub(super) fn columns(scene: &Scene) -> Vec<String> {
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
        let dynamic = self.scene.plan.stages[at.stage - 1].work.kind() == StageKind::Dynamic;
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
                "given up at {at} after {} attempts at steps, far more than the whole scene takes",
                self.most_attempts
            ))),
            None => Ok(()),
        }
    }
}
