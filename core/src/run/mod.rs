//! Runs: stages in sequence, each a loop over levels or steps, and what watches them.

mod distance;
mod failure;
mod findings;
mod issued;
mod layers;
mod refusal;
mod results;
mod ringing;

mod checkpoint;
mod earlier_stages;
mod energy;
mod observer;
mod plan;
mod snapshot;

mod hint;
mod rehearsal;
mod sampling;

mod handover;
mod naming;
mod restart;
mod spatial;
mod stage_run;
mod warnings;

mod buckling;
mod dynamics;
mod modal;
mod statics;

mod sequence;

pub use checkpoint::Checkpoint;
pub use energy::Ledger;
pub use failure::{Failure, Moment, Place};
pub use findings::{Findings, StabilityVerdict, StageStability, StageTimeError, Warning};
pub use observer::Observer;
pub use plan::{Approach, InitialMotion, Plan, Stage, StageWork, TimeStepping, Until};
pub use refusal::{refusal, refusal_help};
pub use rehearsal::{Driven, HistoryJump, JumpKind, Rehearsal, rehearse};
pub use results::{CriticalKind, CriticalLoad, Event, EventKind, Mode, StageResult};
pub use ringing::{ReadColumns, RingingKind, WatchedColumns};
pub use sequence::Run;
pub use snapshot::{ContactCounters, Counters, Snapshot};
