//! `accuracy = …`: the largest estimated errors of outputs.

use super::reader::{Context, Table};
use super::{Diagnostic, Spanned};
use toml::de::DeValue;

/// Largest errors of outputs, each relative to the largest value of its kind in the scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Accuracy {
    /// Of all columns
    All(f64),
    /// Of some columns, with the places of their names
    Columns(Vec<(Spanned<String>, f64)>),
}

/// Smallest accuracy: errors below are round-off.
const LEAST: f64 = 1e-12;

impl Accuracy {
    /// Refuses numbers that are no accuracy.
    pub fn check(value: f64) -> Result<f64, String> {
        if (LEAST..1.0).contains(&value) {
            return Ok(value);
        }
        Err(format!("an accuracy must be between {LEAST:e} and 1, found {value:?}"))
    }

    pub(super) fn read(top: &Table) -> Option<Self> {
        let item = top.get("accuracy")?;
        let context: &Context = top.context;
        let checked = |number: Spanned<f64>| match Self::check(number.value) {
            Ok(value) => Some(value),
            Err(why) => context.wrong(number.span, why),
        };
        let DeValue::Table(_) = item.get_ref() else { return context.number(item).and_then(checked).map(Self::All) };
        let table = Table::of_names(context, item, "`accuracy`")?;
        let columns: Vec<(Spanned<String>, f64)> = table
            .entries()
            .map(|(name, item)| Some((name, context.number(item).and_then(checked)?)))
            .collect::<Option<_>>()?;
        if columns.is_empty() {
            context.report(Diagnostic::error("`accuracy` must name at least one column", table.span.clone()));
        }
        Some(Self::Columns(columns))
    }

    /// The largest error of a column; infinite where there is no bound.
    pub fn of(&self, column: &str) -> f64 {
        match self {
            Self::All(wanted) => *wanted,
            Self::Columns(columns) => columns
                .iter()
                .find(|(name, _)| is_named(column, &name.value))
                .map_or(f64::INFINITY, |(_, wanted)| *wanted),
        }
    }

    /// The smallest error bound of any column.
    pub fn least(&self) -> f64 {
        match self {
            Self::All(wanted) => *wanted,
            Self::Columns(columns) => columns.iter().map(|(_, wanted)| *wanted).fold(f64::INFINITY, f64::min),
        }
    }

    /// Columns with a bound of their own.
    pub fn columns(&self) -> impl Iterator<Item = &Spanned<String>> {
        let named: &[(Spanned<String>, f64)] = if let Self::Columns(columns) = self { columns } else { &[] };
        named.iter().map(|(name, _)| name)
    }
}

/// True if a name of the deck stands for a column: `mode1.omega` is `stage2.mode1.omega` too.
pub fn is_named(column: &str, name: &str) -> bool {
    column == name || without_stage(column) == name
}

/// The name of a mode or critical load without that of its stage: `mode1.omega` of
/// `stage2.mode1.omega`.
pub fn without_stage(column: &str) -> &str {
    let bare = column
        .strip_prefix("stage")
        .and_then(|rest| rest.split_once('.'))
        .filter(|(number, _)| number.parse::<usize>().is_ok());
    bare.map_or(column, |(_, bare)| bare)
}
