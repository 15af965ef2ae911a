//! Parts of plots that histories and profiles share: the run and how it ended, names and colours of
//! lines, the title of the vertical axis, the file.

use super::error::CommandError;
use super::picture::Format;
use super::{console, json};
use crate::deck::nearest;
use crate::output::{LinePlot, LineStyle, PartFile, Record, Units, quantity_of};
use std::path::{Path, PathBuf};

/// The run that a table belongs to.
pub struct PlottedRun {
    /// The folder of the run; none of a table with another name than runs give
    pub(crate) folder: Option<PathBuf>,
    /// The record, if run.json is beside the table
    pub record: Option<Record>,
    /// How the run ended, if it did not finish
    pub(crate) failure: Option<String>,
}

impl PlottedRun {
    /// The run of a table: `name` is the one without ending that runs give.
    pub fn of(table: &Path, name: &str) -> Self {
        let is_named = |ending: &str| table.file_name().is_some_and(|own| own == format!("{name}{ending}").as_str());
        let is_partial = is_named(".partial.csv");
        let is_of_run = is_partial || is_named(".csv");
        let parent = table.parent().filter(|_| is_of_run);
        let folder = parent.and_then(|folder| std::fs::canonicalize(folder.join(".")).ok());
        let record = folder.as_ref().and_then(|folder| Record::read(folder).ok());
        let failure = record.as_ref().and_then(Record::failure).or(is_partial.then_some("unknown"));
        let failure = failure.map(str::to_string);
        Self { folder, record, failure }
    }

    /// The title of the deck.
    pub fn title(&self) -> Option<&str> {
        self.record.as_ref().and_then(Record::title)
    }

    /// A remark for titles, if the run did not finish.
    pub fn remark(&self) -> String {
        self.failure.as_ref().map_or(String::new(), |failure| format!(" (did not finish: {failure})"))
    }

    /// The warning that a table is incomplete, if it is.
    pub fn warning(&self, table: &str, path: &Path) -> Option<String> {
        let failure = self.failure.as_ref()?;
        Some(format!("warning: {}: the run did not finish ({failure}); its {table} ends there", path.display()))
    }
}

/// One of several runs, beams or columns.
pub struct OneOf {
    /// Its name in the legend
    pub name: String,
    /// From 0
    pub number: usize,
    /// Number of all
    pub count: usize,
}

/// Name and style of the line of a column of a run or beam. One run needs no name, and its columns
/// differ by colour; one column needs no name, and its runs differ by colour.
pub fn line_of(run: OneOf, column: OneOf) -> (String, LineStyle) {
    let (name, colour, dash) = match (run.count, column.count) {
        (1, _) => (column.name, column.number, 0),
        (_, 1) => (run.name, run.number, run.number),
        _ => (format!("{}: {}", run.name, column.name), column.number, run.number),
    };
    (name, LineStyle::Dashed { colour, dash })
}

/// The title of the vertical axis: the column, or the quantity if all columns show the same one.
/// Otherwise it is empty, and the legend shows the units. `in_history` gives the name of a column with
/// the same quantity in a history.
pub fn y_title(columns: &[String], units: &Units, in_history: impl Fn(&str) -> String) -> String {
    let first = in_history(&columns[0]);
    if let [column] = columns {
        return units.title(column, &first);
    }
    let quantity = quantity_of(&first);
    let is_common = columns.iter().all(|column| quantity_of(&in_history(column)) == quantity);
    quantity.filter(|_| is_common).map_or(String::new(), |quantity| units.title(quantity, &first))
}

/// An error about a name that a table does not have.
pub fn unknown(table: &str, kind: &str, name: &str, known: &[&str]) -> CommandError {
    let help = match nearest(name, known.iter().copied()) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => format!("there are {}", known.join(", ")),
    };
    CommandError::Usage(format!("the {table} has no {kind} `{name}`: {help}"))
}

/// Writes a plot and tells its file.
pub fn write(plot: &LinePlot, path: &Path, format: Format) -> Result<(), CommandError> {
    PartFile::write_to(path, &format.draw(plot)?)?;
    console::line(&format!("{}", path.display()));
    json::wrote("plot", path);
    Ok(())
}
