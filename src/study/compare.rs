//! Compares a history with a stored one, column by column.

use super::error::ComparisonError;
use crate::output::HistoryReader;

/// The worst cell of a column.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The column
    pub(crate) column: String,
    /// The number of the worst row, from 1
    pub(crate) row: usize,
    /// The value of the first history there
    pub(crate) came: f64,
    /// The value of the stored one
    pub(crate) stored: f64,
    /// |came - stored| as a multiple of the allowed difference
    pub ratio: f64,
}

/// The comparison of two histories.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedHistories {
    /// The worst cell of each column of the stored history
    pub columns: Vec<Comparison>,
    /// The names of columns that the stored history lacks
    pub(crate) extra: Vec<String>,
    /// The names of columns with cells that are NaN in both histories
    pub(crate) nan: Vec<String>,
}

/// Compares the columns that `stored` has; a column or row that `came` lacks is an error.
///
/// A cell passes where |came - stored| <= atol + rtol |stored|. The error bars of both histories
/// (`tip.ux.err`) are added to the right side; they are not compared themselves. NaN equals NaN and no
/// number, as in numpy.testing.assert_allclose: a stored NaN is a result, too.
pub fn compare(
    came: &HistoryReader,
    stored: &HistoryReader,
    rtol: f64,
    atol: f64,
) -> Result<ComparedHistories, ComparisonError> {
    if came.rows.len() != stored.rows.len() {
        return Err(ComparisonError::Rows { rows: came.rows.len(), stored: stored.rows.len() });
    }
    if stored.rows.is_empty() || stored.names.is_empty() {
        return Err(ComparisonError::Empty);
    }
    let mut table = Vec::new();
    let mut nan = Vec::new();
    for (k, column) in stored.names.iter().enumerate().filter(|(_, name)| !is_bar(name)) {
        let bars = [came, stored].map(|history| (history, history.names.iter().position(|n| *n == bar_of(column))));
        let bar = |row: usize| -> f64 {
            bars.iter().map(|(history, place)| place.map_or(0.0, |k| history.rows[row][k])).sum()
        };
        let Some(other) = came.names.iter().position(|name| name == column) else {
            return Err(ComparisonError::MissingColumn(column.clone()));
        };
        if came.rows.iter().zip(&stored.rows).any(|(a, b)| a[other].is_nan() && b[k].is_nan()) {
            nan.push(column.clone());
        }
        let cells = came.rows.iter().zip(&stored.rows).map(|(a, b)| (a[other], b[k]));
        let judged = cells.enumerate().map(|(row, (came, stored))| {
            let allowed = atol + rtol * stored.abs() + bar(row);
            let difference = (came - stored).abs();
            // Equal cells pass with any tolerance.
            let same = came == stored || (came.is_nan() && stored.is_nan());
            let ratio = if same { 0.0 } else { difference / allowed };
            let ratio = if ratio.is_nan() { f64::INFINITY } else { ratio };
            Comparison { column: column.clone(), row: row + 1, came, stored, ratio }
        });
        table.extend(judged.max_by(|a, b| a.ratio.total_cmp(&b.ratio)));
    }
    let extra = came.names.iter().filter(|name| !stored.names.contains(name) && !is_bar(name)).cloned().collect();
    Ok(ComparedHistories { columns: table, extra, nan })
}

/// The name of the error bars of a column.
fn bar_of(column: &str) -> String {
    format!("{column}.err")
}

fn is_bar(column: &str) -> bool {
    column.ends_with(".err")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(rows: &[[f64; 2]]) -> HistoryReader {
        let names = ["time", "u"].map(String::from).to_vec();
        HistoryReader { names, rows: rows.iter().map(|r| r.to_vec()).collect() }
    }

    #[test]
    fn the_worst_cell_of_each_column_is_told() {
        let a = history(&[[0.0, 1.0], [1.0, 2.0 + 1e-6], [2.0, 3.0]]);
        let b = history(&[[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]]);
        let ComparedHistories { columns: table, extra, .. } = compare(&a, &b, 1e-9, 0.0).unwrap();
        assert!(extra.is_empty());
        assert_eq!(table[0].ratio, 0.0);
        assert_eq!(table[1].row, 2);
        assert!((table[1].ratio - 500.0).abs() < 1e-3);
    }

    #[test]
    fn missing_rows_and_columns_are_errors() {
        let (a, b) = (history(&[[0.0, 1.0]]), history(&[[0.0, 1.0], [1.0, 1.0]]));
        assert!(compare(&a, &b, 1.0, 1.0).is_err());
        let mut c = history(&[[0.0, 1.0]]);
        c.names[1] = "v".into();
        c.names[1] = "v".into();
        assert_eq!(compare(&a, &c, 1.0, 1.0), Err(ComparisonError::MissingColumn("v".into())));
    }

    #[test]
    fn error_bars_of_either_history_are_allowed() {
        let mut a = history(&[[0.0, 1.0], [1.0, 2.0]]);
        let b = history(&[[0.0, 1.0], [1.0, 2.3]]);
        a.names.push("u.err".into());
        for (error, passes) in [(0.2, false), (0.4, true)] {
            a.rows.iter_mut().for_each(|row| row.truncate(2));
            a.rows.iter_mut().for_each(|row| row.push(error));
            for (one, other) in [(&a, &b), (&b, &a)] {
                let ComparedHistories { columns: table, extra, .. } = compare(one, other, 0.0, 1e-12).unwrap();
                assert_eq!((table.len(), table[1].ratio <= 1.0, extra.len()), (2, passes, 0));
            }
        }
    }

    #[test]
    fn nan_equals_nan_and_no_number() {
        let broken = history(&[[0.0, f64::NAN]]);
        let sound = history(&[[0.0, 1.0]]);
        for (a, b, ratio, nan) in
            [(&broken, &sound, f64::INFINITY, 0), (&sound, &broken, f64::INFINITY, 0), (&broken, &broken, 0.0, 1)]
        {
            let compared = compare(a, b, 1.0, 1.0).unwrap();
            assert_eq!((compared.columns[1].ratio, compared.nan.len()), (ratio, nan));
        }
    }
}
