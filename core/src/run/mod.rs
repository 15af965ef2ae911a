//! Runs: stages in sequence, each a loop over levels or steps, and what watches them.

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
mod path;
mod rehearsal;
mod rest;
mod rigid;
mod run;
mod space;
mod start;
mod statics;
mod vibrations;
mod warnings;

pub use failure::{Failure, Moment, Place, refusal, refusal_help};
pub use findings::{Findings, StabilityVerdict, StageStability, StageTimeError, Warning};
pub use ledger::Ledger;
pub use levels::Approach;
pub use rehearsal::{Driven, HistoryJump, JumpKind, Rehearsal, rehearse};
pub use run::{
    Counters, CriticalKind, CriticalLoad, Event, EventKind, InitialMotion, Mode, Observer, Plan, Run, Snapshot, Stage,
    StageWork, Until,
};
