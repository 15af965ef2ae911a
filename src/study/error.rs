//! Errors of studies.

use crate::deck::Diagnostic;
use crate::output::OutputError;
use beamsim_core::failure::FailureKind;
use beamsim_core::run::Failure;
use thiserror::Error;

/// Why a study, or a run of one, could not be made.
#[derive(Debug, Error)]
pub enum StudyError {
    /// Something in the deck is wrong, at a place of its text.
    #[error("{}", .0.message)]
    Deck(Diagnostic),
    /// A changed deck describes no scene.
    #[error("{message}")]
    NoScene {
        /// The reason
        message: String,
        /// The kind of error: a wrong deck, or one that exceeds a limit
        kind: FailureKind,
    },
    /// A changed deck has other outputs than the deck itself.
    #[error("its outputs differ from those of the deck")]
    OtherOutputs,
    /// A run failed.
    #[error("{0}")]
    Failure(Failure),
    /// Results could not be read or written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Two histories cannot be compared.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    /// The points of a sweep cannot be made.
    #[error(transparent)]
    Sweep(#[from] SweepError),
}

impl StudyError {
    /// The error of a changed deck that is wrong.
    pub fn no_scene(message: String) -> Self {
        Self::NoScene { message, kind: FailureKind::Deck }
    }

    /// The kind of failure that it is.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::NoScene { kind, .. } => *kind,
            Self::Failure(failure) => failure.kind(),
            Self::Output(_) => FailureKind::Io,
            Self::Deck(_) | Self::OtherOutputs | Self::Comparison(_) | Self::Sweep(_) => FailureKind::Deck,
        }
    }
}

impl From<Diagnostic> for StudyError {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::Deck(diagnostic)
    }
}

impl From<Failure> for StudyError {
    fn from(failure: Failure) -> Self {
        Self::Failure(failure)
    }
}

/// Why two histories cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ComparisonError {
    /// The histories have different numbers of rows.
    #[error("{rows} rows, but the stored history has {stored}")]
    Rows {
        /// Rows of the history
        rows: usize,
        /// Rows of the stored history
        stored: usize,
    },
    /// The stored history is empty.
    #[error("the stored history has no rows")]
    Empty,
    /// The history lacks a stored column.
    #[error("the column `{0}` is missing")]
    MissingColumn(String),
}

/// Why the points of a sweep cannot be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SweepError {
    /// No key is varied.
    #[error("no key is varied: give --vary KEY=V1,V2,…")]
    NothingVaried,
    /// An option `--vary` without key or values.
    #[error("--vary {0}: expected KEY=V1,V2,… or KEY=FROM:TO:COUNT")]
    NoKey(String),
    /// An option `--vary` whose values cannot be read.
    #[error("--vary {text}: {reason}")]
    Vary {
        /// The option
        text: String,
        /// The error of its values
        reason: Box<SweepError>,
    },
    /// A table `[[vary]]` whose range cannot be read.
    #[error("`{key}`: {reason}")]
    Key {
        /// The key that is varied
        key: String,
        /// The error of its values
        reason: Box<SweepError>,
    },
    /// A list with an empty entry.
    #[error("there is an empty value in `{0}`")]
    EmptyValue(String),
    /// A text that is no range.
    #[error("`{0}` is not a range: write FROM:TO or FROM:TO:COUNT, with `:log` at the end for logarithmic spacing")]
    NoRange(String),
    /// A logarithmic range with a bound that is not positive.
    #[error("logarithmic spacing from {from} to {to} needs positive ends")]
    NotPositive {
        /// The first value
        from: f64,
        /// The last value
        to: f64,
    },
    /// A range of which no value is taken.
    #[error("a range needs at least one value")]
    NoNumbers,
    /// More points than are supported.
    #[error("more points than the limit of {0}")]
    TooManyPoints(usize),
    /// A key without values.
    #[error("`{0}` has no values")]
    NoValues(String),
    /// A key that is varied twice.
    #[error("`{0}` is varied twice")]
    VariedTwice(String),
    /// A range without a count where no sample is drawn.
    #[error("`{0}` has a range: give the number of values (FROM:TO:COUNT), or use --sample")]
    RangeWithoutCount(String),
    /// Lists of different lengths that are to be combined value by value.
    #[error("--zip needs equal numbers of values: `{first}` has {first_count}, `{other}` has {other_count}")]
    UnequalLists {
        /// The first key
        first: String,
        /// The number of its values
        first_count: usize,
        /// A key with another number of values
        other: String,
        /// The number of its values
        other_count: usize,
    },
    /// A varied key, or the value of one, that the deck refuses.
    #[error("{0}")]
    Setting(String),
    /// A counter of the run as an output.
    #[error("`{0}` cannot be an output: steps, iterations and factorisations are always in the table")]
    CounterAsOutput(String),
    /// A table beside the deck as a varied key.
    #[error("`{0}` cannot be varied: CSV tables are read once for all points")]
    Table(String),
    /// A parameter that the deck does not have.
    #[error("the deck has no parameter `{name}`{hint}")]
    NoParameter {
        /// The name of the parameter
        name: String,
        /// `: did you mean …?`, or nothing
        hint: String,
    },
}
