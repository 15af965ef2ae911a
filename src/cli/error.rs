//! Errors of commands. Each has a name, a message for the last line, and an exit status.

use super::console;
use super::status::Status;
use crate::output::OutputError;
use crate::study::StudyError;
use beamsim_core::failure::FailureKind;
use beamsim_core::run::Failure;
use thiserror::Error;

/// Why a command could not do what it was asked for.
#[derive(Debug, Error)]
pub enum CommandError {
    /// The command line is wrong.
    #[error("{0}")]
    Usage(String),
    /// A deck cannot be read, or describes no scene.
    #[error("{}", .0.message)]
    Deck(DeckError),
    /// A file could not be read or written.
    #[error("{0}")]
    Io(String),
    /// Another run writes to the folder of results.
    #[error("{0}")]
    Locked(String),
    /// A checkpoint in the folder of results does not allow what was asked for.
    #[error("{0}")]
    Checkpoint(String),
    /// A simulation failed.
    #[error("{0}")]
    Run(Failure),
    /// A signal stopped the command between simulations.
    #[error("{message}")]
    Stopped {
        /// SIGHUP is 1, SIGINT 2, SIGTERM 15
        signal: i32,
        /// The last line
        message: String,
    },
    /// The search for an accuracy ended before it came to its end.
    #[error("the search was stopped: {missed}")]
    SearchStopped {
        /// The failure that stopped it
        by: Failure,
        /// How far the best result is from the wanted accuracy
        missed: String,
    },
    /// A wanted accuracy was not reached.
    #[error("{0}")]
    Missed(String),
    /// An expectation or comparison failed.
    #[error("{0}")]
    Unexpected(String),
    /// Some points of a sweep failed.
    #[error("{0}")]
    Sweep(String),
    /// There were warnings, and `--deny-warnings` was given.
    #[error("{0} warning(s), which --deny-warnings treats as a failure")]
    Warnings(usize),
}

/// The errors of one deck.
#[derive(Debug, Default)]
pub struct DeckError {
    /// The last line
    pub(super) message: String,
    /// The errors with their lines of the deck; empty where there is nothing to show
    pub(super) details: String,
    /// The kind of error
    pub(super) fault: DeckFault,
    /// Failures that the deck itself expects
    pub(super) expected: Vec<String>,
}

/// Kinds of errors of a deck.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DeckFault {
    /// Its text is wrong.
    #[default]
    Text,
    /// It only exceeds supported limits.
    Limit,
    /// A file that it names could not be read.
    File,
}

impl DeckFault {
    /// The kind of failure that it is.
    fn kind(self) -> FailureKind {
        match self {
            Self::Text => FailureKind::Deck,
            Self::Limit => FailureKind::Limit,
            Self::File => FailureKind::Io,
        }
    }
}

impl CommandError {
    /// An error of a deck without lines to show.
    pub fn deck(message: impl ToString) -> Self {
        Self::Deck(DeckError { message: message.to_string(), ..DeckError::default() })
    }

    /// A deck or file that exceeds a supported limit.
    pub fn limit(message: String) -> Self {
        Self::Deck(DeckError { message, fault: DeckFault::Limit, ..DeckError::default() })
    }

    /// A file that could not be read or written; the message of the error names it.
    pub fn io(error: impl Into<OutputError>) -> Self {
        Self::Io(error.into().to_string())
    }

    /// The word in brackets of the last line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Usage(_) => "usage",
            Self::Deck(error) => error.fault.kind().name(),
            Self::Io(_) => FailureKind::Io.name(),
            Self::Locked(_) => "locked",
            Self::Checkpoint(_) => "checkpoint",
            Self::Run(failure) | Self::SearchStopped { by: failure, .. } => failure.name(),
            Self::Stopped { .. } => FailureKind::Interrupted.name(),
            Self::Missed(_) => "accuracy",
            Self::Unexpected(_) => "unexpected",
            Self::Sweep(_) => "sweep",
            Self::Warnings(_) => "warnings",
        }
    }

    /// The exit status.
    pub fn status(&self) -> Status {
        match self {
            Self::Usage(_) | Self::Checkpoint(_) => Status::Wrong,
            Self::Deck(error) => Status::of(error.fault.kind()),
            Self::Io(_) | Self::Locked(_) => Status::Io,
            Self::Run(failure) | Self::SearchStopped { by: failure, .. } => Status::of_failure(failure),
            Self::Stopped { signal, .. } => Status::after(*signal),
            Self::Missed(_) => Status::Missed,
            Self::Unexpected(_) | Self::Warnings(_) => Status::Unexpected,
            Self::Sweep(_) => Status::GaveUp,
        }
    }

    /// Messages that are printed before the last line; empty where there are none.
    pub fn details(&self) -> &str {
        match self {
            Self::Deck(error) => &error.details,
            Self::Usage(_)
            | Self::Io(_)
            | Self::Locked(_)
            | Self::Checkpoint(_)
            | Self::Run(_)
            | Self::Stopped { .. }
            | Self::SearchStopped { .. }
            | Self::Missed(_)
            | Self::Unexpected(_)
            | Self::Sweep(_)
            | Self::Warnings(_) => "",
        }
    }

    /// Prints the last line.
    pub fn print(&self) {
        console::error(self.name(), &self.to_string());
    }
}

impl From<OutputError> for CommandError {
    fn from(error: OutputError) -> Self {
        if matches!(error, OutputError::Locked(_)) {
            return Self::Locked(error.to_string());
        }
        Self::io(error)
    }
}

/// An error of a study without the text of its deck: a diagnostic keeps its message and loses its
/// line.
impl From<StudyError> for CommandError {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::Failure(failure) => Self::Run(failure),
            StudyError::Output(error) => Self::io(error),
            StudyError::NoScene { message, kind: FailureKind::Limit } => Self::limit(message),
            StudyError::Deck(_)
            | StudyError::NoScene { .. }
            | StudyError::OtherOutputs
            | StudyError::Comparison(_)
            | StudyError::Sweep(_) => Self::deck(error),
        }
    }
}
