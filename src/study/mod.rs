//! What is done with whole runs.

pub mod ablation;
pub mod accuracy;
mod compare;
pub mod cost;
mod crowd;
pub mod error_bars;
pub mod forecast;
mod outcome;
mod scale;
pub mod sweep;
mod variant;
mod verify;

pub use compare::{Comparison, compare};
pub use outcome::Outcome;
pub use verify::{Judgement, Recorder, expected_failure, expected_values, judge};
