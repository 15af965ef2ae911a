//! Words to the user. A closed pipe is a quiet end.

use std::io::{self, IsTerminal, Write};

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
