//! A queue of tasks that several threads work through.

use beamsim_core::threads;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::mpsc::{self, Sender};
use std::thread;

/// Runs the tasks `open`, the last first, on several threads until all have ended or `stopped`.
/// `take` gets the result of each as it ends, on the calling thread. `work` returns `None` for a
/// task that was stopped. A task that panics does not stop the others: its result is `broken`.
pub fn in_parallel<T: Send>(
    wanted: usize,
    open: Vec<usize>,
    stopped: &(dyn Fn() -> bool + Sync),
    work: &(dyn Fn(usize) -> Option<T> + Sync),
    broken: &(dyn Fn(usize) -> T + Sync),
    mut take: impl FnMut(usize, T),
) {
    let wanted = wanted.clamp(1, open.len().max(1));
    let queue = Mutex::new(open);
    let go_on = |sender: Sender<(usize, T)>| {
        let next = || queue.lock().ok()?.pop();
        while let Some(k) = (!stopped()).then(next).flatten() {
            let done = catch_unwind(AssertUnwindSafe(|| work(k))).unwrap_or_else(|_| Some(broken(k)));
            if done.is_none_or(|done| sender.send((k, done)).is_err()) {
                return;
            }
        }
    };
    let (sender, receiver) = mpsc::channel();
    thread::scope(|scope| {
        let start = |_| {
            let sender = sender.clone();
            threads::beside(scope, || go_on(sender)).ok()
        };
        let started = (0..wanted).map_while(start).count();
        // The system may refuse new threads.
        if started == 0 {
            go_on(sender.clone());
        }
        drop(sender);
        receiver.iter().for_each(|(k, done)| take(k, done));
    });
}
