//! Runs: stages in sequence, each a loop over levels or steps, and what watches them.

mod analysis_results;
mod buckling;
mod control;
mod direction;
mod dynamics;
mod failure;
mod findings;
mod grid;
mod guard;
mod handover;
mod hint;
mod ledger;
mod levels;
mod modal;
mod observer;
mod path;
mod plan;
mod rehearsal;
mod rest;
mod rigid;
mod space;
mod stage_run;
mod start;
mod statics;
mod vibrations;
mod warnings;

pub use analysis_results::{CriticalKind, CriticalLoad, Event, EventKind, Mode, StageResult};
pub use failure::{Failure, Moment, Place, refusal, refusal_help};
pub use findings::{Findings, StabilityVerdict, StageStability, StageTimeError, Warning};
pub use ledger::Ledger;
pub use observer::{Counters, Observer, Snapshot};
pub use plan::{Approach, InitialMotion, Plan, Stage, StageWork, Until};
pub use rehearsal::{Driven, HistoryJump, JumpKind, Rehearsal, rehearse};
pub use stage_run::Run;
