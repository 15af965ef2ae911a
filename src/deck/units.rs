//! `units = { … }`: labels for plots, reports and progress lines. `output::Units` reads them from the
//! resolved deck in run.json.

use super::reader::Table;

/// Keys of `units`.
pub(super) const KEYS: [&str; 3] = ["length", "force", "time"];

/// Reports unknown keys of `units` and values that are not texts.
pub(super) fn check_units(top: &Table) {
    let Some(value) = top.get("units") else { return };
    if let Some(table) = Table::new(top.context, value, "`units`", &KEYS) {
        KEYS.iter().for_each(|key| {
            table.text(key);
        });
    }
}
