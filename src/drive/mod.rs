//! Runs: stages in sequence, each a loop over levels or steps, and what watches them.

mod control;
mod dynamics;
mod failure;
mod grid;
mod ledger;
mod run;
mod start;
mod statics;

pub use failure::{Failure, Moment, Place};
pub use ledger::Ledger;
pub use run::{Counters, InitialMotion, Observer, Plan, Run, Snapshot, Stage, StageWork, Until};
