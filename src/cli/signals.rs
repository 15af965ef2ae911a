//! SIGINT and SIGTERM end a run after the step it is in.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

static CAUGHT: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// The signal that has been caught, if one has.
pub fn caught() -> Option<i32> {
    let flag = CAUGHT.get_or_init(|| {
        let flag = Arc::new(AtomicUsize::new(0));
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            // Without a handler the signal ends the process, as it would have anyway.
            let _ = signal_hook::flag::register_usize(signal, flag.clone(), signal as usize);
        }
        flag
    });
    match flag.load(Ordering::Relaxed) {
        0 => None,
        signal => Some(signal as i32),
    }
}
