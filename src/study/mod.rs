//! What is done with whole runs.

pub mod ablation;
mod compare;
mod verify;

pub use compare::{Comparison, compare};
pub use verify::{Judgement, Recorder, expected_failure, judge};
