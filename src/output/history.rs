//! history.csv: one row per load level or time step, one column per number.

use super::OutputError;
use super::files::{PartFile, remove_if_there};
use beamsim_core::probe::clocks;
use beamsim_core::run::Moment;
use std::collections::HashSet;
use std::fmt::Write;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// The rows that are written: every n-th, or those at multiples of a time interval, and always the
/// last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows {
    /// Every n-th row
    pub every: usize,
    /// The time interval; it takes precedence in stages that advance time
    pub interval: Option<f64>,
}

impl Rows {
    fn contains(&self, number: u64, dynamic: bool, time: f64) -> bool {
        match self.interval {
            Some(interval) if dynamic => {
                let turns = time / interval;
                (turns - turns.round()).abs() < 1e-9 + 1e-13 * turns.abs()
            }
            Some(_) => true,
            None => number.is_multiple_of(self.every as u64),
        }
    }
}

/// Numbers converged states, and decides which rows are written.
pub struct RowCounter {
    rows: Rows,
    seen: u64,
}

/// The row of a converged state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Its number, from 0
    pub number: u64,
    /// True for a row that is always written; any other is written only if it turns out to be the
    /// last
    pub wanted: bool,
    /// True if its stage advances time
    pub dynamic: bool,
}

impl RowCounter {
    /// Counts from 0.
    pub fn new(rows: Rows) -> Self {
        Self { rows, seen: 0 }
    }

    /// The row of the next converged state.
    pub fn next(&mut self, dynamic: bool, time: f64) -> Row {
        let number = self.seen;
        self.seen += 1;
        Row { number, wanted: self.rows.contains(number, dynamic, time), dynamic }
    }
}

/// Additional columns of a history that are computed from its rows, such as error bars.
pub trait SideColumns: Send {
    /// The names of the additional columns, given the names of the others
    fn names(&self, columns: &[String]) -> Vec<String>;
    /// Takes the row of a stage (from 1) and clock: the time, or in static stages the load factor.
    /// Returns true when the additional numbers of all rows so far are known; rows are held back
    /// until then.
    fn take(&mut self, stage: usize, clock: f64, row: &[f64]) -> bool;
    /// The additional numbers of the rows that are held back, as far as they are known
    fn numbers(&self) -> Vec<f64>;
}

/// Writes the history of a run.
pub struct HistoryWriter {
    folder: PathBuf,
    part: PartFile,
    writer: csv::Writer<File>,
    names: Vec<String>,
    side_columns: Option<Box<dyn SideColumns>>,
    text: String,
    record: csv::ByteRecord,
    /// True if the last row is written only if no other follows
    pending: bool,
    /// Wanted rows whose additional numbers are not known yet
    held_back: Vec<csv::ByteRecord>,
}

impl HistoryWriter {
    /// Creates the history in a folder, with columns of these names.
    pub fn create(
        folder: &Path,
        names: Vec<String>,
        side_columns: Option<Box<dyn SideColumns>>,
    ) -> Result<Self, OutputError> {
        let (part, file) = PartFile::create(folder, "history.csv")?;
        let mut writer = csv::Writer::from_writer(file);
        let others = side_columns.as_ref().map_or(Vec::new(), |side| side.names(&names));
        let mut header: Vec<&str> = clocks().collect();
        header.extend(names.iter().chain(&others).map(String::as_str));
        writer.write_record(header)?;
        Ok(Self {
            folder: folder.into(),
            part,
            writer,
            names,
            side_columns,
            text: String::new(),
            record: csv::ByteRecord::new(),
            pending: false,
            held_back: Vec::new(),
        })
    }

    /// Takes the numbers of a converged state, and writes them if its row is wanted. Returns the
    /// name of a column that is not finite, if there is one.
    pub fn row(&mut self, at: Moment, values: &[f64], row: Row) -> Result<Option<String>, OutputError> {
        let clocks = [at.time, at.load];
        if let Some(k) = clocks.iter().chain(values).position(|value| !value.is_finite()) {
            let name = k.checked_sub(clocks.len()).and_then(|k| self.names.get(k));
            return Ok(name.cloned().or(Some("time".into())));
        }
        self.record.clear();
        self.record.push_field(at.stage.to_string().as_bytes());
        push(&mut self.record, &mut self.text, &clocks);
        push(&mut self.record, &mut self.text, values);
        self.pending = !row.wanted;
        if self.side_columns.is_some() {
            self.hold_back(at, values, row.dynamic)?;
        } else if !self.pending {
            self.writer.write_byte_record(&self.record)?;
        }
        Ok(None)
    }

    fn hold_back(&mut self, at: Moment, values: &[f64], dynamic: bool) -> Result<(), OutputError> {
        let clock = if dynamic { at.time } else { at.load };
        if self.side_columns.as_mut().is_some_and(|side| side.take(at.stage, clock, values)) {
            self.write_held_back()?;
        }
        if !self.pending {
            self.held_back.push(self.record.clone());
        }
        Ok(())
    }

    fn write_held_back(&mut self) -> Result<(), OutputError> {
        let numbers = self.side_columns.as_ref().map_or(Vec::new(), |side| side.numbers());
        for mut record in self.held_back.drain(..) {
            push(&mut record, &mut self.text, &numbers);
            self.writer.write_byte_record(&record)?;
        }
        Ok(())
    }

    /// Gives the file its name: `history.csv` if the run finished, else `history.partial.csv`.
    pub fn finish(mut self, finished: bool) -> Result<(), OutputError> {
        if self.pending {
            self.held_back.push(std::mem::take(&mut self.record));
        }
        self.write_held_back()?;
        let file = self.writer.into_inner().map_err(|e| io::Error::other(e.to_string()))?;
        let name = if finished { "history.csv" } else { "history.partial.csv" };
        let other = if finished { "history.partial.csv" } else { "history.csv" };
        self.part.finish(&file, name)?;
        remove_if_there(&self.folder, other)
    }
}

/// Adds numbers to a record. Debug formatting is the shortest text that reads back to the same
/// float, with an exponent where shorter.
fn push(record: &mut csv::ByteRecord, text: &mut String, values: &[f64]) {
    for value in values {
        text.clear();
        let _ = write!(text, "{value:?}");
        record.push_field(text.as_bytes());
    }
}

/// A stored history.
#[derive(Clone, Debug, PartialEq)]
pub struct HistoryReader {
    /// The names of the columns
    pub names: Vec<String>,
    /// The numbers, row by row
    pub rows: Vec<Vec<f64>>,
}

impl HistoryReader {
    /// The path of the history in a folder of results: of a run that finished, or of one that
    /// failed.
    pub fn of_results(folder: &Path) -> Option<PathBuf> {
        let names = ["history.csv", "history.partial.csv"];
        names.map(|name| folder.join(name)).into_iter().find(|path| path.exists())
    }

    /// Reads a table of numbers whose first line holds the names.
    pub fn read(path: &Path) -> Result<Self, OutputError> {
        let wrong = |message: String| OutputError::content(path, message);
        let file = File::open(path).map_err(|error| OutputError::file(path, error))?;
        let mut reader = csv::Reader::from_reader(file);
        let names: Vec<String> =
            reader.headers().map_err(|e| wrong(e.to_string()))?.iter().map(str::to_string).collect();
        let mut known = HashSet::new();
        if let Some(name) = names.iter().find(|name| !known.insert(name.as_str())) {
            return Err(wrong(format!("two columns are called `{name}`")));
        }
        let mut rows = Vec::new();
        for (number, record) in reader.records().enumerate() {
            let record = record.map_err(|e| wrong(e.to_string()))?;
            let parse = |field: &str| {
                field.trim().parse::<f64>().map_err(|_| wrong(format!("row {}: `{field}` is not a number", number + 1)))
            };
            rows.push(record.iter().map(parse).collect::<Result<_, _>>()?);
        }
        Ok(Self { names, rows })
    }

    /// The first number that is not finite, in words.
    pub fn first_not_finite(&self) -> Option<String> {
        self.rows.iter().enumerate().find_map(|(row, cells)| {
            let column = cells.iter().position(|number| !number.is_finite())?;
            Some(format!("row {}: `{}` is {}, not a finite number", row + 1, self.names[column], cells[column]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_others_are_checked() {
        let path = std::env::temp_dir().join(format!("beamsim-history-{}.csv", std::process::id()));
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            HistoryReader::read(&path)
        };
        let twice = read("time,a,a\n0,1,2\n").unwrap_err().to_string();
        assert!(twice.contains("two columns are called `a`"), "{twice}");
        assert!(read("time,a\n0,x\n").is_err() && read("time,a\n0,1,2\n").is_err());
        assert_eq!(read("time,a\n0,1\n").unwrap().first_not_finite(), None);
        let not_finite = read("time,a\n0,1\n1,nan\n").unwrap().first_not_finite();
        assert_eq!(not_finite.as_deref(), Some("row 2: `a` is NaN, not a finite number"));
        std::fs::remove_file(&path).unwrap();
    }
}
