//! How many threads commands use.

use crate::scene::Scene;
use std::num::NonZero;

/// The number of runs at a time: the wanted one, or one per core.
pub fn cores(wanted: Option<NonZero<usize>>) -> usize {
    wanted.or_else(|| std::thread::available_parallelism().ok()).map_or(1, NonZero::get)
}

/// The threads of one run: the wanted number, or one per core, but no more than the scene can use.
pub fn threads_of(scene: &Scene, wanted: Option<NonZero<usize>>) -> usize {
    // To ask the system for its cores takes as long as a small run.
    match scene.plan.model.regions() {
        0 | 1 => 1,
        regions => cores(wanted).min(regions),
    }
}

/// ` on 4 threads` for summaries; empty for one thread.
pub fn on_threads(count: usize) -> String {
    if count > 1 { format!(" on {count} threads") } else { String::new() }
}
