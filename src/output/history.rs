//! history.csv: one row per load level or time step, one column per number.

use super::{Extent, OutputError, Record, ResultFolder, folder, settle};
use beamsim_core::probe::clocks;
use beamsim_core::run::Moment;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::fmt::Write;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use xxhash_rust::xxh3::Xxh3;

/// The name of the history of a run that finished.
const HISTORY: &str = folder::HISTORY[0];
/// The name of the history of a run that did not.
const PARTIAL_HISTORY: &str = folder::HISTORY[1];
/// Bytes of a file that are read at once
const READ_AT_ONCE: usize = 1 << 16;
/// Bytes that a row has at most
const LONGEST_ROW: u64 = 64 << 20;
/// Rows are handed to the system at least so often, as long as there are new ones.
const FLUSH_INTERVAL: Duration = Duration::from_millis(20);

/// The rows that are written: every n-th, or those at multiples of a time interval, and always the
/// last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows {
    /// Every n-th row
    pub(crate) every: usize,
    /// The time interval; it takes precedence in stages that advance time
    pub(crate) interval: Option<f64>,
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
    pub(super) number: u64,
    /// True for a row that is always written; any other is written only if it turns out to be the
    /// last
    pub(super) wanted: bool,
    /// True if its stage advances time
    dynamic: bool,
}

impl RowCounter {
    /// Counts from 0.
    pub fn new(rows: Rows) -> Self {
        Self { rows, seen: 0 }
    }

    /// Counts on from the number of states so far.
    pub fn after(rows: Rows, seen: u64) -> Self {
        Self { rows, seen }
    }

    /// The number of states so far.
    pub fn seen(&self) -> u64 {
        self.seen
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
    /// What it takes to go on behind the rows so far
    fn save(&self) -> SavedBars;
}

/// Error bars as far as they are known, with the runs that they come from.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct SavedBars {
    /// The runs that the history is compared with
    pub(crate) companions: Vec<SavedCompanion>,
    /// The largest estimates so far, for each companion and column
    pub(crate) largest: Vec<Vec<f64>>,
    /// The largest value so far of each column's kind
    pub(crate) values: Vec<f64>,
}

/// A run that a history is compared with.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct SavedCompanion {
    /// The moment of each row
    pub(crate) moments: Vec<Moment>,
    /// The columns of the history, row by row
    pub(crate) rows: Vec<Vec<f64>>,
    /// For each column: a difference over this is an error
    pub(crate) divisors: Vec<f64>,
    /// The row that was compared last
    pub(crate) next: usize,
}

/// A history as far as it is written.
#[derive(Deserialize, Serialize)]
pub struct SavedHistory {
    /// The length of the file
    bytes: u64,
    /// XXH3 of 64 bits of the file
    checksum: u64,
    /// The last row, if it is written only if no other follows
    pending: Option<Vec<String>>,
    /// Rows whose additional numbers are not known yet
    held_back: Vec<Vec<String>>,
}

/// Writes the history of a run.
pub struct HistoryWriter {
    /// The path of the file, for messages
    path: PathBuf,
    writer: csv::Writer<RowFile>,
    names: Vec<String>,
    side_columns: Option<Box<dyn SideColumns>>,
    text: String,
    record: csv::ByteRecord,
    /// True if the last row is written only if no other follows
    pending: bool,
    /// Wanted rows whose additional numbers are not known yet
    held_back: Vec<csv::ByteRecord>,
    /// When rows were handed to the system last
    flushed: Instant,
}

impl HistoryWriter {
    /// Creates the history in a folder, with columns of these names.
    pub fn create(
        folder: &ResultFolder,
        names: Vec<String>,
        side_columns: Option<Box<dyn SideColumns>>,
    ) -> Result<Self, OutputError> {
        let mut writer = csv::Writer::from_writer(RowFile::new(folder.create(HISTORY)?));
        let others = side_columns.as_ref().map_or(Vec::new(), |side| side.names(&names));
        let mut header: Vec<&str> = clocks().collect();
        header.extend(names.iter().chain(&others).map(String::as_str));
        writer.write_record(header)?;
        // A full disk is told before the run begins.
        writer.flush()?;
        Ok(Self::with(folder.part(HISTORY), writer, names, side_columns))
    }

    fn with(
        path: PathBuf,
        writer: csv::Writer<RowFile>,
        names: Vec<String>,
        side_columns: Option<Box<dyn SideColumns>>,
    ) -> Self {
        Self {
            path,
            writer,
            names,
            side_columns,
            text: String::new(),
            record: csv::ByteRecord::new(),
            pending: false,
            held_back: Vec::new(),
            flushed: Instant::now(),
        }
    }

    /// Opens the history of a run that is resumed: rows behind its checkpoint are removed.
    pub fn resume(
        folder: &ResultFolder,
        names: Vec<String>,
        side_columns: Option<Box<dyn SideColumns>>,
        saved: SavedHistory,
    ) -> Result<Self, OutputError> {
        if !folder.part(HISTORY).exists() {
            // The run was stopped, or killed while it gave its files their names.
            if folder.part(PARTIAL_HISTORY).exists() {
                folder.rename_part(PARTIAL_HISTORY, HISTORY)?;
            } else if folder.path().join(PARTIAL_HISTORY).exists() {
                folder.reopen(PARTIAL_HISTORY, HISTORY)?;
            } else {
                let reason = "belongs to the checkpoint and is missing: use --fresh to begin anew";
                return Err(OutputError::content(&folder.path().join(PARTIAL_HISTORY), reason));
            }
        }
        let path = folder.part(HISTORY);
        let wrong = |error| OutputError::file(&path, error);
        let mut file = File::options().read(true).write(true).open(&path).map_err(wrong)?;
        let hasher = hash_of(&mut file, saved.bytes).map_err(wrong)?;
        if hasher.digest() != saved.checksum {
            let reason = "was changed since its checkpoint was written: use --fresh to begin anew";
            return Err(OutputError::content(&path, reason));
        }
        file.set_len(saved.bytes).and_then(|()| file.seek(SeekFrom::End(0))).map_err(wrong)?;
        let file = RowFile { hasher, ..RowFile::new(file) };
        let mut writer = Self::with(path, csv::Writer::from_writer(file), names, side_columns);
        writer.pending = saved.pending.is_some();
        writer.record = saved.pending.unwrap_or_default().into();
        writer.held_back = saved.held_back.into_iter().map(csv::ByteRecord::from).collect();
        Ok(writer)
    }

    /// Makes the rows so far safe on the disk, and tells what it takes to go on behind them.
    pub fn save(&mut self) -> Result<SavedHistory, OutputError> {
        self.writer.flush()?;
        let file = &self.writer.get_ref().file;
        file.sync_all()?;
        let fields =
            |record: &csv::ByteRecord| record.iter().map(|f| String::from_utf8_lossy(f).into_owned()).collect();
        Ok(SavedHistory {
            bytes: file.metadata()?.len(),
            checksum: self.writer.get_ref().hasher.digest(),
            pending: self.pending.then(|| fields(&self.record)),
            held_back: self.held_back.iter().map(fields).collect(),
        })
    }

    /// The additional columns.
    pub fn side_columns(&self) -> Option<&dyn SideColumns> {
        self.side_columns.as_deref()
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
            let written = self.writer.write_byte_record(&self.record);
            written.map_err(|error| OutputError::file(&self.path, error.into()))?;
        }
        if self.flushed.elapsed() >= FLUSH_INTERVAL {
            self.writer.flush().map_err(|error| OutputError::file(&self.path, error))?;
            self.flushed = Instant::now();
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
            let written = self.writer.write_byte_record(&record);
            written.map_err(|error| OutputError::file(&self.path, error.into()))?;
        }
        Ok(())
    }

    /// Writes the rows that are left, and makes them safe on the disk.
    pub fn complete(&mut self) -> Result<(), OutputError> {
        if std::mem::take(&mut self.pending) {
            self.held_back.push(std::mem::take(&mut self.record));
        }
        self.write_held_back()?;
        self.writer.flush()?;
        Ok(self.writer.get_ref().file.sync_all()?)
    }

    /// Closes the file, and returns the name that it is to get. Half a row, where the disk was full, is
    /// removed.
    pub fn close(self, folder: &ResultFolder, extent: Extent) -> Result<&'static str, OutputError> {
        match extent {
            Extent::Whole => {}
            Extent::Partial => {
                drop(self.writer);
                let path = folder.part(HISTORY);
                keep_whole_rows(&path).map_err(|error| OutputError::file(&path, error))?;
                folder.rename_part(HISTORY, PARTIAL_HISTORY)?;
            }
        }
        Ok(extent.name(folder::HISTORY))
    }
}

/// The file of a history. After an error nothing more is written: rows behind half a row would be
/// taken for whole ones.
struct RowFile {
    file: File,
    /// Of what is written
    hasher: Xxh3,
    is_broken: bool,
}

impl RowFile {
    fn new(file: File) -> Self {
        Self { file, hasher: Xxh3::new(), is_broken: false }
    }
}

impl io::Write for RowFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.is_broken {
            return Err(io::Error::other("an earlier row could not be written"));
        }
        let written = self.file.write(bytes);
        if let Ok(count) = written {
            self.hasher.update(&bytes[..count]);
        }
        self.is_broken = written.as_ref().is_err_and(|error| error.kind() != io::ErrorKind::Interrupted);
        written
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// The hash of the first bytes of a file.
fn hash_of(file: &mut File, bytes: u64) -> io::Result<Xxh3> {
    let mut hasher = Xxh3::new();
    let mut first = file.take(bytes);
    let mut buffer = vec![0; READ_AT_ONCE];
    loop {
        match first.read(&mut buffer)? {
            0 => return Ok(hasher),
            count => hasher.update(&buffer[..count]),
        }
    }
}

/// Cuts a table behind its last whole row.
fn keep_whole_rows(path: &Path) -> io::Result<()> {
    let mut file = File::options().read(true).write(true).open(path)?;
    let length = file.metadata()?.len();
    let mut tail = Vec::new();
    file.seek(SeekFrom::Start(length.saturating_sub(LONGEST_ROW)))?;
    file.read_to_end(&mut tail)?;
    let half_row = tail.iter().rev().position(|&byte| byte == b'\n').unwrap_or(tail.len());
    if half_row > 0 {
        file.set_len(length - half_row as u64)?;
        file.sync_all()?;
    }
    Ok(())
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
    /// failed. `None` if there is none; an error if it is not that of the run that run.json
    /// describes.
    pub fn of_results(folder: &Path) -> Result<Option<PathBuf>, OutputError> {
        settle(folder);
        let Some(name) = [HISTORY, PARTIAL_HISTORY].into_iter().find(|name| folder.join(name).exists()) else {
            return Ok(None);
        };
        if let Ok(record) = Record::read(folder) {
            record.refuse_foreign(folder, name)?;
        }
        Ok(Some(folder.join(name)))
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
            let parse = |(field, name): (&str, &String)| {
                let not_a_number =
                    || format!("row {}: `{field}` in column `{name}` is not a number: not a history", number + 1);
                field.trim().parse::<f64>().map_err(|_| wrong(not_a_number()))
            };
            rows.push(record.iter().zip(&names).map(parse).collect::<Result<_, _>>()?);
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
    use std::fs;

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

    #[test]
    fn half_a_row_is_cut_off() {
        let path = std::env::temp_dir().join(format!("beamsim-rows-{}", std::process::id()));
        for (written, kept) in [("a,b\n1,2\n3,", "a,b\n1,2\n"), ("a,b\n1,2\n", "a,b\n1,2\n"), ("a,", ""), ("", "")] {
            fs::write(&path, written).unwrap();
            keep_whole_rows(&path).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), kept, "{written:?}");
        }
        fs::remove_file(&path).unwrap();
    }
}
