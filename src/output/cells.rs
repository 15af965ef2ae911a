//! Cells of tables that programs for spreadsheets open.

use std::borrow::Cow;

/// A text as a cell that no spreadsheet takes for a formula: an apostrophe is put before `=`, `+`,
/// `-`, `@`, a tabulator or the end of a line, unless the cell is a number.
pub fn harmless(text: &str) -> Cow<'_, str> {
    let begins = text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n']);
    if begins && text.parse::<f64>().is_err() { Cow::Owned(format!("'{text}")) } else { Cow::Borrowed(text) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_and_formulas_do_not() {
        for text in ["-1.5", "+2e3", "plain", "", "a=1", "-inf"] {
            assert_eq!(harmless(text), text);
        }
        for text in ["=1+1", "+cmd", "-x", "@sum", "\tx", "\r=1", "-1+1"] {
            assert_eq!(harmless(text), format!("'{text}"));
        }
    }
}
