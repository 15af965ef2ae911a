//! Observables of a run, from words on a command line.

use super::{Instant, Reduce, Reduction, Words};
use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value};

/// A number of a run: a column at an instant, or over all rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Looked {
    /// The column
    pub(crate) column: String,
    /// Instant, or rows
    reduce: Reduce,
}

impl Looked {
    /// `tip.uz`, `tip.uz:absmax`, `tip.uz:0.5` (a time), `tip.uz:load=0.5`.
    pub fn parse(text: &str) -> Self {
        let at_end = || Self { column: text.trim().into(), reduce: Reduce::At(Instant::End) };
        let Some((column, how)) = text.trim().rsplit_once(':') else { return at_end() };
        let load = how.strip_prefix("load=").and_then(|load| load.parse().ok()).map(Instant::Load);
        let instant = load.or_else(|| how.parse().ok().map(Instant::Time));
        match Reduction::of(how).map(Reduce::Over).or(instant.map(Reduce::At)) {
            Some(reduce) => Self { column: column.into(), reduce },
            // `arm:3.uz` is a column of the node number 3.
            None => at_end(),
        }
    }

    /// The text that [`Looked::parse`] reads as this.
    pub fn name(&self) -> String {
        match self.reduce {
            Reduce::At(Instant::End) => self.column.clone(),
            Reduce::At(Instant::Time(time)) => format!("{}:{time}", self.column),
            Reduce::At(Instant::Load(load)) => format!("{}:load={load}", self.column),
            Reduce::Over(reduction) => format!("{}:{}", self.column, reduction.word()),
        }
    }

    /// As an expectation that always holds.
    fn expectation(&self) -> Table {
        let mut table = Table::new();
        table.insert("column", toml_edit::value(self.column.as_str()));
        match self.reduce {
            Reduce::At(Instant::End) => {}
            Reduce::At(Instant::Time(time)) => drop(table.insert("at", toml_edit::value(time))),
            Reduce::At(Instant::Load(load)) => {
                let at = InlineTable::from_iter([("load", Value::from(load))]);
                table.insert("at", toml_edit::value(at));
            }
            Reduce::Over(reduction) => drop(table.insert("reduce", toml_edit::value(reduction.word()))),
        }
        table.insert("value", toml_edit::value(0.0));
        table.insert("atol", toml_edit::value(f64::MAX));
        table
    }
}

/// The text of a deck whose expectations are these observables, with bounds that always hold.
pub fn looking_at(text: &str, all: &[Looked]) -> String {
    // A deck that is no TOML is reported when it is read.
    let Ok(mut document) = text.parse::<DocumentMut>() else { return text.into() };
    let expectations: ArrayOfTables = all.iter().map(Looked::expectation).collect();
    document.insert("expect", Item::ArrayOfTables(expectations));
    document.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_name_columns_and_when_they_are_looked_at() {
        let of = |column: &str, reduce| Looked { column: column.into(), reduce };
        for (text, looked) in [
            ("tip.uz", of("tip.uz", Reduce::At(Instant::End))),
            ("arm:3.uz", of("arm:3.uz", Reduce::At(Instant::End))),
            ("arm:3.uz:absmax", of("arm:3.uz", Reduce::Over(Reduction::AbsMax))),
            ("tip.uz:0.5", of("tip.uz", Reduce::At(Instant::Time(0.5)))),
            ("tip.uz:load=0.5", of("tip.uz", Reduce::At(Instant::Load(0.5)))),
        ] {
            assert_eq!(Looked::parse(text), looked);
            assert_eq!(looked.name(), text);
        }
    }
}
