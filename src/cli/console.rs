//! Printing. Errors of a closed pipe are ignored.

use std::collections::BTreeSet;
use std::io::{self, IsTerminal, Write};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// Global options of the output.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct PrintOptions {
    /// Print only warnings and errors
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Print a line of JSON for each result instead of text
    #[arg(long, global = true)]
    json: bool,
    /// Treat warnings as failures: warnings about a deck stop it before it runs, warnings of a run
    /// give exit status 1 after it
    #[arg(long, global = true)]
    deny_warnings: bool,
}

static OPTIONS: OnceLock<PrintOptions> = OnceLock::new();
static WARNINGS: AtomicUsize = AtomicUsize::new(0);

/// Sets the options, once.
pub fn configure(options: PrintOptions) {
    let _ = OPTIONS.set(options);
}

fn options() -> PrintOptions {
    OPTIONS.get().copied().unwrap_or_default()
}

/// True with `--json`.
pub fn prints_json() -> bool {
    options().json
}

/// True with `--quiet`.
pub fn is_quiet() -> bool {
    options().quiet
}

/// True with `--deny-warnings`.
pub fn denies_warnings() -> bool {
    options().deny_warnings
}

/// Counts warnings that were printed.
pub fn count_warnings(count: usize) {
    WARNINGS.fetch_add(count, Ordering::Relaxed);
}

/// True for the first message of this text about a file.
pub fn is_new(file: &Path, message: &str) -> bool {
    static PRINTED: Mutex<BTreeSet<(PathBuf, String)>> = Mutex::new(BTreeSet::new());
    let mut printed = PRINTED.lock().unwrap_or_else(PoisonError::into_inner);
    printed.insert((file.into(), message.into()))
}

/// The number of warnings so far.
pub fn warnings() -> usize {
    WARNINGS.load(Ordering::Relaxed)
}

/// Prints a line for people on standard output.
pub fn line(text: &str) {
    if !options().quiet && !options().json {
        answer(text);
    }
}

/// Prints a line for scripts on standard output.
pub fn data(text: &str) {
    if options().json {
        answer(text);
    }
}

/// Prints the answer of a command on standard output, whatever the options.
pub fn answer(text: &str) {
    write_to(&mut io::stdout().lock(), text);
}

/// Prints a remark on standard error, unless `--quiet` is given.
pub fn remark(text: &str) {
    if !options().quiet {
        note(text);
    }
}

/// Prints a line on standard error.
pub fn note(text: &str) {
    write_to(&mut io::stderr().lock(), text);
}

/// Prints the last line on standard error, with the name of the failure.
pub fn error(name: &str, message: &str) {
    note(&format!("error[{name}]: {message}"));
}

/// True where messages may be coloured.
pub fn styled() -> bool {
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
}

/// Writes a line. Errors are ignored: nobody reads a closed pipe.
fn write_to(out: &mut dyn Write, text: &str) {
    let _ = writeln!(out, "{text}").and_then(|()| out.flush());
}

/// A measured time with three digits: 1.30 ms, 2.50 s.
pub fn time(seconds: f64) -> String {
    let in_ms = seconds < 1.0;
    let number = if in_ms { 1e3 * seconds } else { seconds };
    let unit = if in_ms { "ms" } else { "s" };
    let digits = if number < 10.0 {
        2
    } else if number < 100.0 {
        1
    } else {
        0
    };
    format!("{number:.digits$} {unit}")
}

/// Reads a number of threads of the command line.
pub fn threads(text: &str) -> Result<NonZero<usize>, String> {
    text.parse().map_err(|_| "expected a number of threads, at least 1".into())
}

/// Reads a time of the command line: 90, 90s, 1.5m, 2h.
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
    // Clocks can add this many seconds.
    const LONGEST: f64 = 100.0 * 365.0 * 86_400.0;
    if !(0.0..=LONGEST).contains(&seconds) {
        return Err("a time is between 0 and a hundred years".into());
    }
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}
