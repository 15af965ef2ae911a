//! Words to the user. A closed pipe is a quiet end.

use std::io::{self, IsTerminal, Write};
use std::time::Duration;

/// A line on standard output.
pub fn line(text: &str) {
    write_to(&mut io::stdout().lock(), text);
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
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}
