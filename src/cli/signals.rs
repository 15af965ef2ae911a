//! SIGINT, SIGTERM and SIGHUP end a command within a second.
//!
//! A thread hears them, whatever the others do. While work is under way whose results are
//! [kept](keep), a signal asks it to stop, and the command ends after what was reached is written.
//! At all other times a signal ends the process at once, and so does a second one.

use super::console;
use super::status::Status;
use beamsim_core::interrupt;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

/// Signals that come within this time of the first are one request: `timeout` sends its signal to
/// the process and to its group, and a terminal that closes may do the same.
const ONE_REQUEST: Duration = Duration::from_millis(200);

/// Time that a run has to come to its next row: a step that is soon done is not lost.
const GRACE: Duration = Duration::from_millis(100);

/// The signal that asks to stop; 0 if nobody asks
static CAUGHT: AtomicI32 = AtomicI32::new(0);

/// Longest time for printing a message before the process ends: nobody may read it.
const MESSAGE_TIME: Duration = Duration::from_millis(100);

/// Bytes of stack of a thread that only hears or prints.
const STACK_BYTES: usize = 256 << 10;

/// Works in progress whose results are kept.
static KEPT: Mutex<usize> = Mutex::new(0);

/// Work in progress whose results are kept: as long as it lives, a signal does not end the process
/// but asks the work to stop.
pub struct Kept;

/// Begins work whose results are kept, also if it is stopped.
pub fn keep() -> Kept {
    *kept() += 1;
    Kept
}

impl Drop for Kept {
    fn drop(&mut self) {
        *kept() -= 1;
    }
}

fn kept() -> MutexGuard<'static, usize> {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The signal that asks to stop, if one does. Runs look for it between rows, where a checkpoint can
/// be written; work within a row is asked by [`interrupt`] a little later.
pub fn caught() -> Option<i32> {
    match CAUGHT.load(Ordering::Relaxed) {
        0 => None,
        signal => Some(signal),
    }
}

/// Makes a file that may not grow an error of writing, not the end of the process.
pub fn outlive_file_limits() {
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
}

/// When this returns signals are heard: no file is open before. If the system gives no thread for
/// that, they end the process as they would anyway.
pub fn listen() {
    let (sender, ready) = mpsc::channel();
    let hear_all = move || {
        let Ok(mut signals) = Signals::new(heard()) else { return };
        let _ = sender.send(());
        let mut first = None;
        signals.forever().for_each(|signal| hear(signal, &mut first));
    };
    if thread::Builder::new().name("signals".into()).stack_size(STACK_BYTES).spawn(hear_all).is_ok() {
        // An error means that the system takes no handlers.
        let _ = ready.recv();
    }
}

/// The signals that are heard. Those that are switched off stay so: a hang-up by `nohup`, an
/// interrupt by a shell that runs the command in the background.
fn heard() -> Vec<i32> {
    let ignored = ignored();
    let is_ignored = |signal: i32| ignored.map(|mask| mask >> (signal - 1) & 1 == 1);
    let mut signals: Vec<i32> =
        [SIGINT, SIGTERM].into_iter().filter(|&signal| is_ignored(signal) != Some(true)).collect();
    if is_ignored(SIGHUP) == Some(false) {
        signals.push(SIGHUP);
    }
    signals
}

/// Signals that were switched off when the process was started, a bit for each, from the lowest
/// bit for signal 1; `None` where the system does not tell.
fn ignored() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}

/// A signal that was heard.
struct Heard {
    signal: i32,
    at: Instant,
}

/// Hears a signal, after the `first` one if there was one.
fn hear(signal: i32, first: &mut Option<Heard>) {
    match first {
        Some(first) if first.at.elapsed() < ONE_REQUEST => {}
        Some(first) => exit(first.signal),
        None => {
            *first = Some(Heard { signal, at: Instant::now() });
            // No work may begin to keep results while the process ends.
            let kept = kept();
            if *kept == 0 {
                print(signal);
                exit(signal);
            }
            drop(kept);
            CAUGHT.store(signal, Ordering::Relaxed);
            thread::sleep(GRACE);
            interrupt::request(signal);
        }
    }
}

/// Prints that a signal ends the process, if that does not take long.
fn print(signal: i32) {
    let (sender, printed) = mpsc::channel();
    let print = move || {
        console::error("interrupted", &format!("stopped by signal {signal}"));
        let _ = sender.send(());
    };
    if thread::Builder::new().stack_size(STACK_BYTES).spawn(print).is_ok() {
        let _ = printed.recv_timeout(MESSAGE_TIME);
    }
}

/// Ends the process whatever its threads do.
fn exit(signal: i32) -> ! {
    signal_hook::low_level::exit(Status::after(signal) as i32)
}
