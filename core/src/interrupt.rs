//! A request to stop, for the whole process: a signal handler or a user of the library makes it,
//! and long work looks for it.
//!
//! The request stays until it is withdrawn. Work that has seen it returns without a result, and
//! whoever called it finds the request too: no half-done work is taken for a result.

use std::sync::atomic::{AtomicI32, Ordering};

/// The signal that asks to stop; 0 if nobody asks
static SIGNAL: AtomicI32 = AtomicI32::new(0);

/// Asks all work of the process to stop, on behalf of a signal by its number (SIGINT is 2). An
/// earlier request stays.
pub fn request(signal: i32) {
    // With an earlier request there is nothing to do.
    let _ = SIGNAL.compare_exchange(0, signal, Ordering::Relaxed, Ordering::Relaxed);
}

/// Withdraws the request, so that other work can begin. No work may be under way, which could take
/// what was left half-done for whole.
pub fn withdraw() {
    SIGNAL.store(0, Ordering::Relaxed);
}

/// The signal that asks to stop, if one does.
pub fn requested() -> Option<i32> {
    match SIGNAL.load(Ordering::Relaxed) {
        0 => None,
        signal => Some(signal),
    }
}

/// True if work is asked to stop. Costs a load.
#[inline(always)]
pub fn is_requested() -> bool {
    SIGNAL.load(Ordering::Relaxed) != 0
}
