//! What a run leaves on disk. Files appear whole: a finished name never holds half a result.

mod fields;
mod files;
mod history;
mod modes;
mod plot;
mod quantities;
mod record;
mod report;

pub use fields::{FieldsWriter, remove_fields};
pub use files::{PartFile, remove_if_there};
pub use history::{Beside, HistoryReader, HistoryWriter, Row, RowCounter, Rows};
pub use modes::ModesWriter;
pub use plot::{Axis, Boundary, Level, Line, LinePlot, LineStyle, Scale};
pub use quantities::{Units, quantity_of};
pub use record::{Outcome, Reached, Record, warnings};
pub use report::{Film, Report};
