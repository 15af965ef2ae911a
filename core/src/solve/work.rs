//! Counters of work.

use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Work of a run, summed up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Work {
    /// Number of corrections of Newton's iteration whose forces were evaluated
    pub iterations: u64,
    /// Number of factorisations
    pub factorisations: u64,
    /// Number of chart changes
    pub chart_switches: u64,
    /// Time for evaluating and assembling forces and tangents in s
    pub evaluation_seconds: f64,
    /// Time for factorising and solving in s
    pub solve_seconds: f64,
    /// Largest correction that round-off leaves at the end of an iteration, relative to the
    /// unknowns
    pub uncertainty: f64,
}

/// Runs `part` and adds its duration in s to `seconds`.
pub fn timed<R>(seconds: &mut f64, part: impl FnOnce() -> R) -> R {
    let start = Instant::now();
    let result = part();
    *seconds += start.elapsed().as_secs_f64();
    result
}
