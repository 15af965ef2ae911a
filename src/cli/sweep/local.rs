//! Points on the cores of this machine.

use super::plan::Plan;
use crate::cli::load::Refusal;
use crate::cli::progress::Progress;
use crate::cli::{cores, signals};
use crate::study::sweep::{Options, Outcome};
use std::num::NonZero;
use std::time::Instant;

/// Runs points (from 0) and keeps what comes of them; gives how many failed.
pub fn run(plan: &Plan, points: &[usize], threads: Option<NonZero<usize>>) -> Result<usize, Refusal> {
    let (begun, count) = (Instant::now(), points.len());
    let mut progress = Progress::new(&plan.name);
    let (mut done, mut failed) = (0_usize, 0_usize);
    let mut tell = |point: usize, outcome: &Outcome| {
        done += 1;
        if !outcome.finished() {
            failed += 1;
            progress.note(&format!("point {}: {}: {}", point + 1, outcome.status, outcome.message));
        }
        let rate = done as f64 / begun.elapsed().as_secs_f64().max(1e-9);
        progress.tell(done as f64 / count as f64, || {
            format!("{done} of {count} points, {failed} failed, {rate:.1} a second")
        });
    };
    let options = Options { threads: cores(threads), interrupted: &signals::caught, tell: &mut tell };
    let kept = plan.sweep.run(points, &plan.store, options);
    progress.done();
    kept.map_err(Refusal::io)?;
    Ok(failed)
}
