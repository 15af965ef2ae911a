//! history.csv: one row a load level or time step, one column a number.

use super::files::{PartFile, remove_if_there};
use beamsim_core::probe::clocks;
use beamsim_core::run::Moment;
use std::fmt::Write;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Which rows are written: each n-th, or those at multiples of a time; the last one always.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows {
    /// Each n-th
    pub every: usize,
    /// At multiples of this time
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

/// Counts converged states, for all that is written of them.
pub struct RowCounter {
    rows: Rows,
    seen: u64,
}

/// A converged state among others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Its number, from 0
    pub number: u64,
    /// Whether it is written whatever follows; the last always is
    pub wanted: bool,
    /// Whether time passes in its stage
    pub dynamic: bool,
}

impl RowCounter {
    /// Of these rows.
    pub fn new(rows: Rows) -> Self {
        Self { rows, seen: 0 }
    }

    /// The next.
    pub fn next(&mut self, dynamic: bool, time: f64) -> Row {
        let number = self.seen;
        self.seen += 1;
        Row { number, wanted: self.rows.contains(number, dynamic, time), dynamic }
    }
}

/// What stands beside the columns of a history: numbers about them, row by row.
pub trait Beside: Send {
    /// The names of its columns, beside these
    fn names(&self, columns: &[String]) -> Vec<String>;
    /// Takes the row of a stage (from 1) and clock: the time, or in static stages the load factor. Whether all is known that stands beside the
    /// rows before: else they wait for a later row.
    fn take(&mut self, stage: usize, clock: f64, row: &[f64]) -> bool;
    /// What stands beside the rows that wait, as far as is known
    fn numbers(&self) -> Vec<f64>;
}

/// Writes the history of a run.
pub struct HistoryWriter {
    folder: PathBuf,
    part: PartFile,
    writer: csv::Writer<File>,
    names: Vec<String>,
    beside: Option<Box<dyn Beside>>,
    text: String,
    record: csv::ByteRecord,
    /// Whether the last row was not wanted, and so is not written yet
    pending: bool,
    /// Wanted rows that wait for what stands beside them
    waiting: Vec<csv::ByteRecord>,
}

impl HistoryWriter {
    /// Begins a history in `folder` with columns of these names.
    pub fn create(folder: &Path, names: Vec<String>, beside: Option<Box<dyn Beside>>) -> io::Result<Self> {
        let (part, file) = PartFile::create(folder, "history.csv")?;
        let mut writer = csv::Writer::from_writer(file);
        let others = beside.as_ref().map_or(Vec::new(), |beside| beside.names(&names));
        let all = clocks().map(String::from).chain(names.iter().cloned()).chain(others);
        writer.write_record(all).map_err(io::Error::from)?;
        Ok(Self {
            folder: folder.into(),
            part,
            writer,
            names,
            beside,
            text: String::new(),
            record: csv::ByteRecord::new(),
            pending: false,
            waiting: Vec::new(),
        })
    }

    /// Takes the numbers of a converged state; writes them if its row is wanted. Gives the name of a column that is not finite, if one is.
    pub fn row(&mut self, at: Moment, values: &[f64], row: Row) -> io::Result<Option<String>> {
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
        if self.beside.is_some() {
            self.wait_for_what_stands_beside(at, values, row.dynamic)?;
        } else if !self.pending {
            self.writer.write_byte_record(&self.record)?;
        }
        Ok(None)
    }

    fn wait_for_what_stands_beside(&mut self, at: Moment, values: &[f64], dynamic: bool) -> io::Result<()> {
        let clock = if dynamic { at.time } else { at.load };
        if self.beside.as_mut().is_some_and(|beside| beside.take(at.stage, clock, values)) {
            self.write_waiting()?;
        }
        if !self.pending {
            self.waiting.push(self.record.clone());
        }
        Ok(())
    }

    fn write_waiting(&mut self) -> io::Result<()> {
        let beside = self.beside.as_ref().map_or(Vec::new(), |beside| beside.numbers());
        for mut record in self.waiting.drain(..) {
            push(&mut record, &mut self.text, &beside);
            self.writer.write_byte_record(&record)?;
        }
        Ok(())
    }

    /// Ends the history: `history.csv` if the run finished, else `history.partial.csv`.
    pub fn finish(mut self, finished: bool) -> io::Result<()> {
        if self.pending {
            self.waiting.push(std::mem::take(&mut self.record));
        }
        self.write_waiting()?;
        let file = self.writer.into_inner().map_err(|e| io::Error::other(e.to_string()))?;
        let (name, other) =
            if finished { ("history.csv", "history.partial.csv") } else { ("history.partial.csv", "history.csv") };
        self.part.finish(&file, name)?;
        remove_if_there(&self.folder, other)
    }
}

/// Debug formatting is the shortest text that reads back to the same float, with an exponent where shorter.
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
    /// Names of the columns
    pub names: Vec<String>,
    /// Row by row
    pub rows: Vec<Vec<f64>>,
}

impl HistoryReader {
    /// Where the history in a folder of results is, whole or of a run that failed.
    pub fn of_results(folder: &Path) -> Option<PathBuf> {
        let names = ["history.csv", "history.partial.csv"];
        names.map(|name| folder.join(name)).into_iter().find(|path| path.exists())
    }

    /// Reads a table of numbers with a line of names above.
    pub fn read(path: &Path) -> io::Result<Self> {
        let wrong = |message: String| io::Error::other(format!("{}: {message}", path.display()));
        let file = File::open(path).map_err(|e| wrong(e.to_string()))?;
        let mut reader = csv::Reader::from_reader(file);
        let names = reader.headers().map_err(|e| wrong(e.to_string()))?.iter().map(str::to_string).collect();
        let mut rows = Vec::new();
        for (number, record) in reader.records().enumerate() {
            let record = record.map_err(|e| wrong(e.to_string()))?;
            let parse = |field: &str| {
                field.trim().parse::<f64>().map_err(|_| wrong(format!("row {}: `{field}` is not a number", number + 1)))
            };
            rows.push(record.iter().map(parse).collect::<io::Result<_>>()?);
        }
        Ok(Self { names, rows })
    }
}
