//! report.html: one page that plays a run back, with its histories, energies, effects and deck. It
//! needs no network and no server.

mod encode;
mod film;

pub use film::{Film, Reel};

use super::ownership::GENERATOR;
use super::{HistoryReader, OutputError, PartFile, Record, Units};
use beamsim_core::probe::{COLUMNS, ColumnGroup, ColumnPart, STRESS_AT_POINT, STRESS_WITH_INDEX};
use encode::base64;
use serde_json::{Value, json};
use std::path::Path;

/// The page, which has places for a title and for data.
const PAGE: &str = include_str!("page.html");

/// Numbers of a history that a page carries.
const MOST_NUMBERS: usize = 2_000_000;

/// Where a report gets its words from.
pub struct Report<'a> {
    /// What it is about
    pub(crate) title: &'a str,
    /// The content of run.json
    pub(crate) record: &'a Record,
}

impl Report<'_> {
    /// Writes the page of results in a folder. Returns whether it has the shapes of the film, which
    /// must be those of the history.
    pub fn write(&self, results: &Path, mut film: Film, path: &Path) -> Result<bool, OutputError> {
        let history = read_history(results)?;
        film.end(filmed_rows(&history, self.record));
        let belongs = film.belongs_to(&history);
        if !belongs {
            film.clear();
        }
        PartFile::write_to(path, self.page(results, &history, &film)?.as_bytes())?;
        Ok(belongs)
    }

    fn page(&self, results: &Path, history: &HistoryReader, film: &Film) -> Result<String, OutputError> {
        for name in ["modes.csv", "buckling.csv"].into_iter().filter(|name| results.join(name).exists()) {
            self.record.refuse_foreign(results, name)?;
        }
        let shown = rows(history, &film.frame_rows());
        // The last row that is shown up to there.
        let row = |of: usize| shown.partition_point(|&k| k <= of).saturating_sub(1);
        let (bars, columns): (Vec<usize>, Vec<usize>) =
            (0..history.names.len()).partition(|&k| is_bar(&history.names, k));
        let units = self.record.units();
        let data = json!({
            "title": self.title,
            "version": env!("CARGO_PKG_VERSION"),
            "deck": self.record.text(),
            "run": self.record.bare(),
            "length_unit": units.length(),
            "parts": parts(),
            "history": table(history, &shown, &columns, &units),
            "bars": if bars.is_empty() { Value::Null } else { table(history, &shown, &bars, &units) },
            "scene": film.to_json(&row, &units),
            "modes": small_table(&results.join("modes.csv"), &units)?,
            "buckling": small_table(&results.join("buckling.csv"), &units)?,
        });
        let escaped = self.title.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
        let (before, after) = PAGE.split_once("{{DATA}}").unwrap_or((PAGE, ""));
        // A page of text must not take what a deck says for its own; `<` stands in texts alone.
        Ok([
            &before.replace("{{GENERATOR}}", GENERATOR).replace("{{TITLE}}", &escaped),
            &data.to_string().replace('<', "\\u003c"),
            after,
        ]
        .concat())
    }
}

/// The history of a folder of results; without any row where there is none.
pub fn read_history(results: &Path) -> Result<HistoryReader, OutputError> {
    let history = HistoryReader::of_results(results)?.map(|path| HistoryReader::read(&path)).transpose()?;
    Ok(history.unwrap_or(HistoryReader { names: Vec::new(), rows: Vec::new() }))
}

/// The rows of a history that its run reaches by the deck: not the last one of a run that was
/// stopped, which is that of the moment.
pub fn filmed_rows(history: &HistoryReader, record: &Record) -> usize {
    history.rows.len() - usize::from(record.is_interrupted() && !history.rows.is_empty())
}

/// A small table of the results as columns, units and rows; null if there is no such file. Fields
/// that are no numbers stay texts.
fn small_table(path: &Path, units: &Units) -> Result<Value, OutputError> {
    if !path.exists() {
        return Ok(Value::Null);
    }
    let wrong = |error: csv::Error| OutputError::content(path, error);
    let mut reader = csv::Reader::from_path(path).map_err(wrong)?;
    let names: Vec<String> = reader.headers().map_err(wrong)?.iter().map(str::to_string).collect();
    let units: Vec<Option<String>> = names.iter().map(|name| units.of_column(name)).collect();
    let field = |text: &str| text.parse::<f64>().map_or_else(|_| json!(text), |number| json!(number));
    let mut rows: Vec<Vec<Value>> = Vec::new();
    for record in reader.records() {
        rows.push(record.map_err(wrong)?.iter().map(field).collect());
    }
    Ok(json!({ "columns": names, "units": units, "rows": rows }))
}

/// Whether a column is the error bar of another.
fn is_bar(names: &[String], k: usize) -> bool {
    names[k].strip_suffix(".err").is_some_and(|of| names.iter().any(|name| name == of))
}

/// Rows of the table of columns: columns that share a picture, with the group of the whole scene
/// that they belong to, if they do.
fn parts() -> Vec<Value> {
    let all = COLUMNS.iter().chain([&STRESS_WITH_INDEX, &STRESS_AT_POINT]);
    let of_history = all.filter(|group| group.is_of_node() || group.is_of_scene());
    let of_group = |group: &'static ColumnGroup| {
        let scene = group.is_of_scene().then_some(group.key);
        let of_section = group.is_of_section();
        let row = move |part: &ColumnPart| {
            let ColumnPart { title, suffixes, .. } = part;
            json!({ "scene": scene, "of_section": of_section, "title": title, "suffixes": suffixes })
        };
        group.parts.iter().map(row)
    };
    of_history.flat_map(of_group).collect()
}

/// The rows that are shown: all, or each n-th and those with a frame.
fn rows(history: &HistoryReader, frames: &[usize]) -> Vec<usize> {
    let count = history.rows.len();
    let stride = (count * history.names.len()).div_ceil(MOST_NUMBERS).max(1);
    (0..count).filter(|k| k.is_multiple_of(stride) || frames.binary_search(k).is_ok() || k + 1 == count).collect()
}

/// Rows of some columns of a history. Columns of error bars get the names of the columns that they
/// belong to.
fn table(history: &HistoryReader, rows: &[usize], columns: &[usize], units: &Units) -> Value {
    let name = |&k: &usize| {
        if is_bar(&history.names, k) { history.names[k].trim_end_matches(".err") } else { &history.names[k] }
    };
    let names: Vec<&str> = columns.iter().map(name).collect();
    let units: Vec<Option<String>> = names.iter().map(|name| units.of_column(name)).collect();
    let numbers = columns.iter().flat_map(|&k| rows.iter().map(move |&row| history.rows[row][k]));
    let data = base64(numbers.flat_map(f64::to_le_bytes));
    json!({ "columns": names, "units": units, "rows": rows.len(), "data": data })
}
