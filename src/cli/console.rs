//! Printing: the only place that writes to the terminal. Texts of users are escaped, so that no deck
//! and no file name controls the terminal or forges a line.

use crate::deck::{hides_text, shown, shown_in_line};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
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
        print(&shown_in_line(text));
    }
}

/// Prints a line of JSON for scripts on standard output.
pub fn data(json: &str) {
    if options().json {
        print(&escaped_json(json));
    }
}

/// Prints the answer of a command on standard output, whatever the options. It may have several
/// lines.
pub fn answer(text: &str) {
    print(&shown(text));
}

/// Prints a remark on standard error, unless `--quiet` is given.
pub fn remark(text: &str) {
    if !options().quiet {
        note(text);
    }
}

/// Prints a line on standard error.
pub fn note(text: &str) {
    write_to_stderr(&shown_in_line(text));
}

/// Prints several lines on standard error.
pub fn notes(text: &str) {
    write_to_stderr(&shown(text));
}

/// Prints messages about a deck on standard error: they are escaped, and may be coloured.
pub fn diagnostics(rendered: &str) {
    write_to_stderr(rendered);
}

/// Prints the last line on standard error, with the name of the failure.
pub fn error(name: &str, message: &str) {
    note(&format!("error[{name}]: {message}"));
}

/// JSON with characters that would control a terminal as escapes of JSON. They occur in its texts
/// only.
fn escaped_json(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    for c in json.chars() {
        if c.is_control() || hides_text(c) {
            // All of them have at most 16 bits.
            let _ = write!(out, "\\u{:04x}", u32::from(c));
        } else {
            out.push(c);
        }
    }
    out
}

/// True where messages may be coloured.
pub fn styled() -> bool {
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
}

/// The first error of standard output, except that nobody reads it any more.
static STDOUT_ERROR: Mutex<Option<io::Error>> = Mutex::new(None);

/// Writes a line to standard output. The first error is kept for the end of the command; after it,
/// and after the other end of a pipe was closed, nothing more is written.
fn print(text: &str) {
    static IS_CLOSED: AtomicBool = AtomicBool::new(false);
    if IS_CLOSED.load(Ordering::Relaxed) {
        return;
    }
    if let Err(error) = write_line(&mut io::stdout().lock(), text) {
        IS_CLOSED.store(true, Ordering::Relaxed);
        if error.kind() != io::ErrorKind::BrokenPipe {
            *STDOUT_ERROR.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
        }
    }
}

/// The error of standard output, if it could not take everything. A reader that stops early, such as
/// `head`, is none.
pub fn stdout_error() -> Option<io::Error> {
    STDOUT_ERROR.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// Writes a line to standard error. There is no other place to tell its errors.
fn write_to_stderr(text: &str) {
    let _ = write_line(&mut io::stderr().lock(), text);
}

fn write_line(out: &mut dyn Write, text: &str) -> io::Result<()> {
    // One write: lines of several processes stay whole.
    out.write_all(format!("{text}\n").as_bytes())?;
    out.flush()
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
    let wrong = || "a time must be a number with s, m or h: 90s, 5m, 1h";
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
        return Err("a time must be between 0 and 100 years".into());
    }
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_stays_json_and_controls_no_terminal() {
        let json = escaped_json("[\"a\u{9b}2J\", \"\u{202e}b\u{7f}\", \"plain é\\n\"]");
        assert_eq!(json, "[\"a\\u009b2J\", \"\\u202eb\\u007f\", \"plain é\\n\"]");
    }

    #[test]
    fn a_full_device_is_an_error() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::StorageFull.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        assert!(write_line(&mut Full, "text").is_err());
    }
}
