//! Exit statuses.

use beamsim_core::failure::{Cause, FailureKind};
use beamsim_core::run::Failure;
use signal_hook::consts::{SIGHUP, SIGTERM};

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
    /// SIGHUP
    HungUp = 129,
    /// SIGINT
    Interrupted = 130,
    /// SIGTERM
    Terminated = 143,
}

impl Status {
    /// The exit status after a failure of a kind.
    pub fn of(kind: FailureKind) -> Self {
        match kind.cause() {
            Cause::Deck => Self::Wrong,
            Cause::Numerics => Self::GaveUp,
            Cause::File => Self::Io,
            Cause::Signal => Self::Interrupted,
        }
    }

    /// The exit status after a failed simulation.
    pub fn of_failure(failure: &Failure) -> Self {
        if let Failure::Interrupted { signal, .. } = failure {
            return Self::after(*signal);
        }
        Self::of(failure.kind())
    }

    /// The exit status of a process that a signal ended.
    pub fn after(signal: i32) -> Self {
        match signal {
            SIGHUP => Self::HungUp,
            SIGTERM => Self::Terminated,
            // Also where a time limit has stopped a run.
            _ => Self::Interrupted,
        }
    }
}
