//! Work that a run counts.

use std::time::Instant;

/// Work done, added up over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Corrections of Newton's method whose forces were looked at
    pub iterations: u64,
    /// Factorisations
    pub factorisations: u64,
    /// Changes of chart
    pub chart_switches: u64,
    /// Seconds spent on forces and tangents, scattered into the system
    pub evaluation_seconds: f64,
    /// Seconds spent on factorising and solving
    pub solve_seconds: f64,
    /// The correction that round-off still leaves where an iteration ended, relative to the
    /// unknowns
    pub uncertainty: f64,
}

/// Runs `part` and adds its seconds to `seconds`.
pub fn timed<R>(seconds: &mut f64, part: impl FnOnce() -> R) -> R {
    let start = Instant::now();
    let result = part();
    *seconds += start.elapsed().as_secs_f64();
    result
}
