//! The files of results. A file gets its name when it is complete: no name ever stands for half a
//! result.

mod cells;
mod error;
mod fields;
mod files;
mod history;
pub(crate) mod json;
mod modes;
mod ownership;
mod plot;
mod quantities;
mod record;
mod report;

pub use cells::harmless;
pub use error::OutputError;
pub use fields::{FieldsWriter, remove_fields};
pub use files::{PartFile, remove_if_there};
pub use history::{HistoryReader, HistoryWriter, Row, RowCounter, Rows, SideColumns};
pub use modes::ModesWriter;
pub use ownership::{OutputKind, may_replace};
pub use plot::{Axis, Boundary, Level, Line, LinePlot, LineStyle, Scale};
pub use quantities::{Units, quantity_of};
pub use record::{
    DeckSource, FinishedRun, ReachedAccuracy, ReachedColumn, Record, RunSummary, TableRecord, TableSource,
    WarningRecord,
};
pub use report::{Film, Report};
