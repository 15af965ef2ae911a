//! Words to the user. A closed pipe is a quiet end.

use std::collections::BTreeSet;
use std::io::{self, IsTerminal, Write};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// How the user wants to be spoken to.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct Manner {
    /// Say nothing but warnings and errors
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Print a line of JSON for each result instead of words
    #[arg(long, global = true)]
    json: bool,
    /// End with a failure where there are warnings: those about a deck before it runs, those of a run after it (exit status 1)
    #[arg(long, global = true)]
    deny_warnings: bool,
}

static MANNER: OnceLock<Manner> = OnceLock::new();
static WARNINGS: AtomicUsize = AtomicUsize::new(0);

/// From here on.
pub fn in_manner(manner: Manner) {
    let _ = MANNER.set(manner);
}

fn manner() -> Manner {
    MANNER.get().copied().unwrap_or_default()
}

/// Whether scripts are spoken to.
pub fn speaks_json() -> bool {
    manner().json
}

/// Whether only warnings and errors are wanted.
pub fn is_quiet() -> bool {
    manner().quiet
}

/// Whether warnings are failures.
pub fn denies_warnings() -> bool {
    manner().deny_warnings
}

/// Takes note of warnings that were said.
pub fn count_warnings(count: usize) {
    WARNINGS.fetch_add(count, Ordering::Relaxed);
}

/// Whether a message about a file is said for the first time.
pub fn is_new(file: &Path, message: &str) -> bool {
    static SAID: Mutex<BTreeSet<(PathBuf, String)>> = Mutex::new(BTreeSet::new());
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    said.insert((file.into(), message.into()))
}

/// How many there were.
pub fn warnings() -> usize {
    WARNINGS.load(Ordering::Relaxed)
}

/// A line on standard output, for people.
pub fn line(text: &str) {
    if !manner().quiet && !manner().json {
        answer(text);
    }
}

/// A line on standard output, for scripts.
pub fn data(text: &str) {
    if manner().json {
        answer(text);
    }
}

/// What was asked for, whatever the manner.
pub fn answer(text: &str) {
    write_to(&mut io::stdout().lock(), text);
}

/// A remark on standard error that is no warning.
pub fn remark(text: &str) {
    if !manner().quiet {
        note(text);
    }
}

/// A line on standard error.
pub fn note(text: &str) {
    write_to(&mut io::stderr().lock(), text);
}

/// The last line on standard error: it names the failure.
pub fn error(name: &str, message: &str) {
    note(&format!("error[{name}]: {message}"));
}

/// Whether messages may be coloured.
pub fn styled() -> bool {
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
}

/// Nobody reads any more: nothing is lost by not writing.
fn write_to(out: &mut dyn Write, text: &str) {
    let _ = writeln!(out, "{text}").and_then(|()| out.flush());
}

/// 1.3 ms, 2.5 s.
pub fn time(seconds: f64) -> String {
    let (number, unit) = if seconds < 1.0 { (1e3 * seconds, "ms") } else { (seconds, "s") };
    let digits = if number < 10.0 {
        2
    } else if number < 100.0 {
        1
    } else {
        0
    };
    format!("{number:.digits$} {unit}")
}

/// A count of threads as it stands on a command line.
pub fn threads(text: &str) -> Result<NonZero<usize>, String> {
    text.parse().map_err(|_| "threads are counted from 1".into())
}

/// A time as it stands on a command line: 90, 90s, 1.5m, 2h.
pub fn duration(text: &str) -> Result<Duration, String> {
    let wrong = || "a time is a number with s, m or h: 90s, 5m, 1h";
    let number = text.trim_end_matches(['s', 'm', 'h']);
    let unit = match &text[number.len()..] {
        "" | "s" => 1.0,
        "m" => 60.0,
        "h" => 3600.0,
        _ => return Err(wrong().into()),
    };
    let seconds = number.trim().parse::<f64>().map_err(|_| wrong())? * unit;
    // Later than that nobody waits, and clocks can add it.
    const LONGEST: f64 = 100.0 * 365.0 * 86_400.0;
    if !(0.0..=LONGEST).contains(&seconds) {
        return Err("a time is between 0 and a hundred years".into());
    }
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}
