//! How far a run has come: a bar on a terminal, a line now and then elsewhere.

use super::say;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Between lines where there is no terminal.
const QUIET: Duration = Duration::from_secs(10);
/// Between looks at the clock; a look costs less than a step, but not nothing.
const REDRAW: Duration = Duration::from_millis(100);

/// Shows progress on standard error.
pub struct Progress {
    bar: Option<ProgressBar>,
    name: String,
    last: Instant,
}

impl Progress {
    /// For a run of this name.
    pub fn new(name: &str) -> Self {
        let bar = (std::io::stderr().is_terminal() && !say::is_quiet()).then(|| {
            let style = ProgressStyle::with_template("{prefix} [{bar:30}] {percent:>3} % {elapsed} (left {eta}) {msg}");
            let bar = ProgressBar::new(10_000).with_prefix(name.to_string());
            bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        });
        Self { bar, name: name.into(), last: Instant::now() }
    }

    /// From 0 to 1, and where that is, for lines.
    pub fn tell(&mut self, done: f64, place: impl Fn() -> String) {
        let wait = if self.bar.is_some() { REDRAW } else { QUIET };
        if self.last.elapsed() < wait {
            return;
        }
        self.last = Instant::now();
        match &self.bar {
            Some(bar) => {
                bar.set_message(place());
                bar.set_position((done * 10_000.0) as u64);
            }
            None => say::remark(&format!("{}: {:.1} % ({})", self.name, 100.0 * done, place())),
        }
    }

    /// A line that does not disturb the bar.
    pub fn note(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| say::note(text)),
            None => say::note(text),
        }
    }

    /// Takes the bar away.
    pub fn done(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
