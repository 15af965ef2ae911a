//! The end of a command: its exit status, and its last line.

use super::console;
use super::error::CommandError;
use super::status::Status;

/// The errors of a command over several decks. The worst decides the exit status and the last line.
#[derive(Default)]
pub struct Verdict {
    worst: Option<CommandError>,
}

impl Verdict {
    /// Prints an error with its details and remembers it if it is the worst so far.
    pub fn fail(&mut self, error: CommandError) {
        if !error.details().is_empty() {
            console::diagnostics(error.details());
        }
        error.print();
        if error.status() > self.status() {
            self.worst = Some(error);
        }
    }

    fn status(&self) -> Status {
        self.worst.as_ref().map_or(Status::Fine, CommandError::status)
    }

    /// The exit status. With several decks the worst error is printed again, since other output may
    /// have followed it.
    pub fn finish(self, decks: usize) -> Status {
        if let Some(error) = self.worst.as_ref().filter(|_| decks > 1) {
            error.print();
        }
        self.status()
    }
}
