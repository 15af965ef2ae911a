//! `beamsim compare`

use super::{Status, json, say};
use crate::output::HistoryReader;
use crate::study;
use beamsim_core::failure::FailureKind;
use std::path::Path;

/// Prints the worst cell of each column.
pub fn compare(a: &Path, b: &Path, rtol: f64, atol: f64) -> Status {
    let usable = |tolerance: f64| tolerance.is_finite() && tolerance >= 0.0;
    if !(usable(rtol) && usable(atol)) {
        say::error("usage", "--rtol and --atol must be finite and not negative");
        return Status::Wrong;
    }
    let (came, stored) = match (HistoryReader::read(a), HistoryReader::read(b)) {
        (Ok(came), Ok(stored)) => (came, stored),
        (Err(error), _) | (_, Err(error)) => {
            say::error(FailureKind::Io.name(), &error.to_string());
            return Status::Io;
        }
    };
    let (table, extra) = match study::compare(&came, &stored, rtol, atol) {
        Ok(found) => found,
        Err(message) => {
            say::error("unexpected", &message);
            return Status::Unexpected;
        }
    };
    json::compare(a, b, &table);
    let width = table.iter().map(|c| c.column.chars().count()).max().unwrap_or(0);
    say::line(&format!("  {:<width$}  {:>6}  {:>24}  {:>24}  {:>10}", "column", "row", "came", "stored", "difference"));
    for cell in &table {
        let mark = if cell.ratio <= 1.0 { " " } else { "X" };
        let difference = (cell.came - cell.stored).abs();
        say::line(&format!(
            "{mark} {:<width$}  {:>6}  {:>24?}  {:>24?}  {difference:>10.2e}",
            cell.column, cell.row, cell.came, cell.stored
        ));
    }
    if !extra.is_empty() {
        say::line(&format!("only in {}: {}", a.display(), extra.join(", ")));
    }
    let beyond = table.iter().filter(|cell| cell.ratio > 1.0).count();
    if beyond > 0 {
        say::error("unexpected", &format!("{beyond} column(s) differ by more than {atol} + {rtol} |stored|"));
        return Status::Unexpected;
    }
    Status::Fine
}
