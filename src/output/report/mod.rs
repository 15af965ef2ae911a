//! report.html: one page that plays a run back, with its histories, energies, effects and deck. It needs no network and no server.

mod encode;
mod film;

pub use film::Film;

use super::{HistoryReader, PartFile, Record};
use beamsim_core::probe::{COLUMNS, ColumnGroup, ColumnPart};
use encode::base64;
use serde_json::{Value, json};
use std::io;
use std::path::Path;

/// The page, which has places for a title and for data.
const PAGE: &str = include_str!("page.html");

/// Numbers of a history that a page carries.
const MOST_NUMBERS: usize = 2_000_000;

/// Where a report gets its words from.
pub struct Report<'a> {
    /// What it is about
    pub title: &'a str,
    /// The content of run.json
    pub record: &'a Record,
}

impl Report<'_> {
    /// Writes the page of results in a folder.
    pub fn write(&self, results: &Path, film: Film, path: &Path) -> io::Result<()> {
        PartFile::write_to(path, self.page(results, film)?.as_bytes())
    }

    fn page(&self, results: &Path, mut film: Film) -> io::Result<String> {
        let history = HistoryReader::of_results(results).map(|path| HistoryReader::read(&path)).transpose()?;
        let history = history.unwrap_or(HistoryReader { names: Vec::new(), rows: Vec::new() });
        // The last row of a run that was stopped is the one of that moment, which the film passes over.
        let filmed = history.rows.len() - usize::from(self.record.is_interrupted() && !history.rows.is_empty());
        let shown = rows(&history, &film.end(filmed));
        // The last row that is shown up to there.
        let row = |of: usize| shown.partition_point(|&k| k <= of).saturating_sub(1);
        let (bars, columns): (Vec<usize>, Vec<usize>) =
            (0..history.names.len()).partition(|&k| is_bar(&history.names, k));
        let data = json!({
            "title": self.title,
            "version": env!("CARGO_PKG_VERSION"),
            "deck": self.record.text(),
            "run": self.record.bare(),
            "history": table(&history, &shown, &columns, ""),
            "parts": parts(),
            "bars": if bars.is_empty() { Value::Null } else { table(&history, &shown, &bars, ".err") },
            "scene": film.to_json(&row),
            "modes": numbers(&results.join("modes.csv"))?,
            "buckling": numbers(&results.join("buckling.csv"))?,
        });
        let escaped = self.title.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
        let (before, after) = PAGE.split_once("{{DATA}}").unwrap_or((PAGE, ""));
        // A page of text must not take what a deck says for its own; `<` stands in texts alone.
        Ok([&before.replace("{{TITLE}}", &escaped), &data.to_string().replace('<', "\\u003c"), after].concat())
    }
}

/// A small table of the results, where they have it.
fn numbers(path: &Path) -> io::Result<Value> {
    if !path.exists() {
        return Ok(Value::Null);
    }
    let HistoryReader { names, rows } = HistoryReader::read(path)?;
    Ok(json!({ "columns": names, "rows": rows }))
}

/// Whether a column is the error bar of another.
fn is_bar(names: &[String], k: usize) -> bool {
    names[k].strip_suffix(".err").is_some_and(|of| names.iter().any(|name| name == of))
}

/// Columns that share a picture: the group of the whole scene that they belong to, if they do, their heading, and the ends
/// of their names.
fn parts() -> Vec<Value> {
    let of_history = COLUMNS.iter().filter(|group| group.is_of_node() || group.is_of_scene());
    let of_group = |group: &'static ColumnGroup| {
        let scene = group.is_of_scene().then_some(group.key);
        let part = move |part: &ColumnPart| json!({ "scene": scene, "title": part.title, "suffixes": part.suffixes });
        group.parts.iter().map(part)
    };
    of_history.flat_map(of_group).collect()
}

/// The rows that are shown: all, or each n-th and those with a frame.
fn rows(history: &HistoryReader, frames: &[usize]) -> Vec<usize> {
    let count = history.rows.len();
    let stride = (count * history.names.len()).div_ceil(MOST_NUMBERS).max(1);
    (0..count).filter(|k| k.is_multiple_of(stride) || frames.binary_search(k).is_ok() || k + 1 == count).collect()
}

fn table(history: &HistoryReader, rows: &[usize], columns: &[usize], suffix: &str) -> Value {
    let names: Vec<&str> = columns.iter().map(|&k| history.names[k].trim_end_matches(suffix)).collect();
    let numbers = columns.iter().flat_map(|&k| rows.iter().map(move |&row| history.rows[row][k]));
    json!({ "columns": names, "rows": rows.len(), "data": base64(numbers.flat_map(f64::to_le_bytes)) })
}
