//! What a run leaves on disk. Files appear whole: a finished name never holds half a result.

mod files;
mod history;
mod modes;
mod record;

pub use files::{PartFile, remove_if_there};
pub use history::{HistoryReader, HistoryWriter, Rows};
pub use modes::ModesWriter;
pub use record::{Outcome, run_record};
