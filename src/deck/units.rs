//! `units = { … }`: labels for plots and reports.

use super::reader::Table;

/// Keys of `units`.
pub(super) const KEYS: [&str; 3] = ["length", "force", "time"];

/// Labels of length, force and time; empty where there is none.
pub(super) fn read_units(top: &Table) -> Option<[String; 3]> {
    let table = Table::new(top.context, top.get("units")?, "`units`", &KEYS)?;
    Some(KEYS.map(|key| table.text(key).map_or(String::new(), |label| label.value)))
}
