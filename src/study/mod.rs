//! Studies: whole runs of a scene and its variants.

pub mod accuracy;
mod built;
mod change;
mod compare;
pub mod cost;
pub mod effects;
mod error;
pub mod error_bars;
pub mod forecast;
mod outcome;
mod outputs;
mod parallel;
mod scale;
mod strains;
pub mod sweep;
mod verify;

pub use change::Change;
pub use compare::{ComparedHistories, Comparison, compare};
pub use error::{ComparisonError, StudyError, SweepError};
pub use outcome::Outcome;
pub use verify::{Judgement, Recorder, expected_failure, expected_values, judge};
