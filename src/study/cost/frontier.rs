//! The Pareto frontier of error and time: the runs that no other run beats in both.

use super::run::CostRun;
use beamsim_core::sorting::sort_by;

/// The error of a run, at least the resolution of the reference; infinite where the run cannot be
/// compared.
fn error_of(run: &CostRun, resolution: f64) -> f64 {
    if run.error.is_nan() { f64::INFINITY } else { run.error.max(resolution) }
}

/// The numbers of runs that are at most `near` times as slow as the fastest one of at least their
/// accuracy.
pub(super) fn near(runs: &[CostRun], resolution: f64, near: f64) -> Vec<usize> {
    let known = |k: &usize| error_of(&runs[*k], resolution).is_finite();
    let time = |k: usize| runs[k].timing.seconds.cpu;
    let mut order: Vec<usize> = (0..runs.len()).filter(known).collect();
    sort_by(&mut order, |&a, &b| error_of(&runs[a], resolution).total_cmp(&error_of(&runs[b], resolution)));
    let mut best = f64::INFINITY;
    let mut chosen = Vec::new();
    for group in order.chunk_by(|&a, &b| error_of(&runs[a], resolution) == error_of(&runs[b], resolution)) {
        best = group.iter().map(|&k| time(k)).fold(best, f64::min);
        chosen.extend(group.iter().copied().filter(|&k| time(k) <= near * best));
    }
    chosen.sort_unstable();
    chosen
}

/// Marks the runs that no other run beats in both error and time; of equal runs the first.
pub(super) fn mark(runs: &mut [CostRun], resolution: f64) {
    let key = |run: &CostRun| (error_of(run, resolution), run.timing.seconds.cpu);
    for k in 0..runs.len() {
        let (error, time) = key(&runs[k]);
        let beaten = |(j, other): (usize, &CostRun)| {
            let (e, t) = key(other);
            j != k && e <= error && t <= time && (e < error || t < time || j < k)
        };
        runs[k].frontier = error.is_finite() && !runs.iter().enumerate().any(beaten);
    }
}
