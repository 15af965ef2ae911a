//! How a command ends: its exit status, and its last line.

use super::console;
use super::error::CommandError;

/// The exit status of a command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// Success
    #[default]
    Fine = 0,
    /// An expectation or comparison failed
    Unexpected = 1,
    /// The deck or the command line is wrong
    Wrong = 2,
    /// The simulation failed
    GaveUp = 3,
    /// A file could not be read or written
    Io = 4,
    /// The wanted accuracy was not reached; the results are the best that were found
    Missed = 5,
    /// SIGINT
    Interrupted = 130,
    /// SIGTERM
    Terminated = 143,
}

impl Status {
    /// The exit status of a process that a signal ended.
    pub fn after(signal: i32) -> Self {
        if signal == 15 { Self::Terminated } else { Self::Interrupted }
    }
}

/// The errors of a command over several decks. The worst decides the exit status and the last line.
#[derive(Default)]
pub struct Verdict {
    worst: Option<CommandError>,
}

impl Verdict {
    /// Prints an error with its details and remembers it if it is the worst so far.
    pub fn fail(&mut self, error: CommandError) {
        if !error.details().is_empty() {
            console::note(error.details());
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
