//! Points on the cores of this machine.

use super::SweepArguments;
use super::alone::run_alone;
use super::plan::Plan;
use crate::cli::error::CommandError;
use crate::cli::progress::Progress;
use crate::cli::thread_count::cores;
use crate::cli::{console, signals};
use crate::study::sweep::{InFlight, LeftBehind, PointResult, SweepOptions};
use std::num::NonZero;
use std::time::Instant;

/// Runs points (numbers from 0) and saves their results. Points that were being run when an earlier
/// process died come first, one at a time, each in a process of its own.
pub fn run_all(plan: &Plan, points: &[usize], wanted: &SweepArguments) -> Result<(), CommandError> {
    let left = LeftBehind::find(plan.store.folder());
    let has_died = |point: usize| plan.known(point).is_some_and(|result| result.status == PointResult::KILLED);
    let is_suspect = |point: &usize| left.contains(&plan.sweep.identity(*point)) || has_died(*point);
    let (suspects, others): (Vec<usize>, Vec<usize>) = points.iter().copied().partition(is_suspect);
    if !suspects.is_empty() {
        let name = &plan.name;
        let count = suspects.len();
        console::note(&format!("{name}: {count} point(s) of a process that died: each is run again alone"));
    }
    for &point in &suspects {
        if signals::caught().is_some() {
            // The lists stay: the next command knows the suspects as well.
            return Ok(());
        }
        run_alone(plan, point, wanted)?;
    }
    let in_flight = InFlight::begin(plan.store.folder())?;
    left.remove();
    run(plan, &others, wanted.threads, Some(&in_flight)).map(|_| ())
}

/// Runs points (numbers from 0) and saves their results; gives the number of failed ones.
pub fn run(
    plan: &Plan,
    points: &[usize],
    threads: Option<NonZero<usize>>,
    in_flight: Option<&InFlight>,
) -> Result<usize, CommandError> {
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
    let options = SweepOptions { threads: cores(threads), interrupted: &signals::caught, in_flight, ended: &mut show };
    let kept = plan.sweep.run(points, &plan.store, options);
    progress.done();
    kept?;
    Ok(failed)
}
