//! What a run leaves on disk. Files appear whole: a finished name never holds half a result.

mod curves;
mod fields;
mod files;
mod history;
mod modes;
mod plot;
mod record;
mod report;

pub use curves::{Curve, Curves};
pub use fields::{FieldsWriter, remove_fields};
pub use files::{PartFile, remove_if_there};
pub use history::{Beside, HistoryReader, HistoryWriter, Row, RowCounter, Rows};
pub use modes::ModesWriter;
pub use plot::{LinePlots, NamedLine};
pub use record::{Outcome, Reached, Record, warnings};
pub use report::{Film, Report};
