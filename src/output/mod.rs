//! The files of results. A file gets its name when it is complete: no name ever stands for half a
//! result.

mod cells;
mod checkpoint;
mod error;
mod fields;
mod files;
mod folder;
mod history;
pub(crate) mod json;
mod modes;
mod ownership;
mod plot;
mod profile;
mod quantities;
mod record;
mod report;
mod stress;

pub use cells::harmless;
pub use checkpoint::{FoundCheckpoint, SavedRun};
pub use error::OutputError;
pub use fields::{FieldsWriter, SavedFields};
pub use files::{PartFile, remove_dead_parts, remove_fields, remove_if_there};
pub use folder::{Extent, ResultFolder, settle};
pub use history::{
    HistoryReader, HistoryWriter, Row, RowCounter, Rows, SavedBars, SavedCompanion, SavedHistory, SideColumns,
};
pub use modes::ModesWriter;
pub use ownership::{OutputKind, may_replace, refuse_no_folder};
pub use plot::{Axis, Boundary, Level, Line, LinePlot, LineStyle, Scale, SectionPicture, StressShade};
pub use profile::{ProfileReader, ProfileRow};
pub use quantities::{Units, quantity_of};
pub use record::{
    DeckSource, FileRecord, FinishedRun, ReachedAccuracy, ReachedColumn, ReachedMesh, ReachedMeshes, Record,
    RunSummary, TableRecord, TableSource, WarningRecord,
};
pub use report::{Film, Reel, Report, filmed_rows, read_history};
pub use stress::{write_envelope, write_profile};
