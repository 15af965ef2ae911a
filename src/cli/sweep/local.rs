//! Points on the cores of this machine.

use super::plan::Plan;
use crate::cli::error::CommandError;
use crate::cli::progress::Progress;
use crate::cli::signals;
use crate::cli::thread_count::cores;
use crate::study::sweep::{PointResult, SweepOptions};
use std::num::NonZero;
use std::time::Instant;

/// Runs points (numbers from 0) and saves their results; gives the number of failed ones.
pub fn run(plan: &Plan, points: &[usize], threads: Option<NonZero<usize>>) -> Result<usize, CommandError> {
    let begun = Instant::now();
    let count = points.len();
    let mut progress = Progress::new(&plan.name);
    let mut done = 0_usize;
    let mut failed = 0_usize;
    let mut show = |point: usize, result: &PointResult| {
        done += 1;
        if !result.finished() {
            failed += 1;
            progress.note(&format!("point {}: {}: {}", point + 1, result.status, result.message));
        }
        let rate = done as f64 / begun.elapsed().as_secs_f64().max(1e-9);
        progress.show(done as f64 / count as f64, || {
            format!("{done} of {count} points, {failed} failed, {rate:.1} per second")
        });
    };
    let options = SweepOptions { threads: cores(threads), interrupted: &signals::caught, ended: &mut show };
    let kept = plan.sweep.run(points, &plan.store, options);
    progress.done();
    kept?;
    Ok(failed)
}
