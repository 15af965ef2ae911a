//! Progress of a run: a bar on a terminal, a line every few seconds elsewhere.

use super::console;
use crate::deck::shown_in_line;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Time between lines where there is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(10);
/// Time between updates of the bar.
const REDRAW_INTERVAL: Duration = Duration::from_millis(100);

/// Shows progress on standard error.
pub struct Progress {
    bar: Option<ProgressBar>,
    name: String,
    last: Instant,
}

impl Progress {
    /// Progress of a run of this name.
    pub fn new(name: &str) -> Self {
        let bar = (std::io::stderr().is_terminal() && !console::is_quiet()).then(|| {
            let style = ProgressStyle::with_template("{prefix} [{bar:30}] {percent:>3} % {elapsed} (left {eta}) {msg}");
            let bar = ProgressBar::new(10_000).with_prefix(shown_in_line(name).into_owned());
            bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        });
        Self { bar, name: name.into(), last: Instant::now() }
    }

    /// Shows the finished part, from 0 to 1, and a description of the present place.
    pub fn show(&mut self, done: f64, place: impl Fn() -> String) {
        let wait = if self.bar.is_some() { REDRAW_INTERVAL } else { LINE_INTERVAL };
        if self.last.elapsed() < wait {
            return;
        }
        self.last = Instant::now();
        match &self.bar {
            Some(bar) => {
                bar.set_message(shown_in_line(&place()).into_owned());
                bar.set_position((done * 10_000.0) as u64);
            }
            None => console::remark(&format!("{}: {:.1} % ({})", self.name, 100.0 * done, place())),
        }
    }

    /// Prints a line above the bar.
    pub fn note(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| console::note(text)),
            None => console::note(text),
        }
    }

    /// Removes the bar.
    pub fn done(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
