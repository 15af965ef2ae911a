//! `beamsim compare`

use super::error::CommandError;
use super::status::Status;
use super::verdict::Verdict;
use super::{console, json};
use crate::output::HistoryReader;
use crate::study::{self, ComparedHistories};
use std::path::Path;

/// Prints the worst cell of each column.
pub fn compare(a: &Path, b: &Path, rtol: f64, atol: f64) -> Status {
    let mut verdict = Verdict::default();
    if let Err(error) = print_comparison(a, b, rtol, atol) {
        verdict.fail(error);
    }
    verdict.finish(1)
}

fn print_comparison(a: &Path, b: &Path, rtol: f64, atol: f64) -> Result<(), CommandError> {
    let usable = |tolerance: f64| tolerance.is_finite() && tolerance >= 0.0;
    if !(usable(rtol) && usable(atol)) {
        return Err(CommandError::Usage("--rtol and --atol must be finite and not negative".into()));
    }
    let read = |path: &Path| HistoryReader::read(&HistoryReader::of_results(path)?.unwrap_or_else(|| path.into()));
    let (history, stored) = (read(a)?, read(b)?);
    let ComparedHistories { columns: table, extra, nan } =
        study::compare(&history, &stored, rtol, atol).map_err(|error| CommandError::Unexpected(error.to_string()))?;
    json::compare(a, b, &table);
    let width = table.iter().map(|c| c.column.chars().count()).max().unwrap_or(0);
    console::line(&format!(
        "  {:<width$}  {:>6}  {:>24}  {:>24}  {:>10}",
        "column", "row", "history", "stored", "difference"
    ));
    for cell in &table {
        let mark = if cell.ratio <= 1.0 { " " } else { "X" };
        let difference = (cell.came - cell.stored).abs();
        console::line(&format!(
            "{mark} {:<width$}  {:>6}  {:>24?}  {:>24?}  {difference:>10.2e}",
            cell.column, cell.row, cell.came, cell.stored
        ));
    }
    if !extra.is_empty() {
        console::line(&format!("only in {} (not compared): {}", a.display(), extra.join(", ")));
    }
    if !nan.is_empty() {
        console::line(&format!("NaN in both histories, which counts as equal: {}", nan.join(", ")));
    }
    let beyond = table.iter().filter(|cell| cell.ratio > 1.0).count();
    if beyond > 0 {
        let message = format!("{beyond} column(s) differ by more than {atol} + {rtol} |stored|");
        return Err(CommandError::Unexpected(message));
    }
    Ok(())
}
