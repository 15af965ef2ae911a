//! `accuracy = …`: how large the estimated error of outputs may be.

use super::reader::{Context, Table};
use super::{Diagnostic, Spanned};
use toml::de::DeValue;

/// How large the errors of outputs may be, each over the largest value of its kind in the scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Accuracy {
    /// Of all columns
    All(f64),
    /// Of some columns, with the places of their names
    Columns(Vec<(Spanned<String>, f64)>),
}

impl Accuracy {
    pub(super) fn read(top: &Table) -> Option<Self> {
        let item = top.get("accuracy")?;
        let context: &Context = top.context;
        let checked = |number: Spanned<f64>| {
            if number.value > 0.0 && number.value < 1.0 {
                return Some(number.value);
            }
            context.wrong(number.span, format!("an accuracy is between 0 and 1, found {}", number.value))
        };
        let DeValue::Table(_) = item.get_ref() else { return context.number(item).and_then(checked).map(Self::All) };
        let table = Table::of_names(context, item, "`accuracy`")?;
        let columns: Vec<(Spanned<String>, f64)> = table
            .entries()
            .map(|(name, item)| Some((name, context.number(item).and_then(checked)?)))
            .collect::<Option<_>>()?;
        if columns.is_empty() {
            context.report(Diagnostic::error("`accuracy` names no column", table.span.clone()));
        }
        Some(Self::Columns(columns))
    }

    /// What is wanted of a column; infinite where nothing is.
    pub fn of(&self, column: &str) -> f64 {
        match self {
            Self::All(wanted) => *wanted,
            Self::Columns(columns) => {
                columns.iter().find(|(name, _)| name.value == column).map_or(f64::INFINITY, |(_, wanted)| *wanted)
            }
        }
    }

    /// The smallest that is wanted of any column.
    pub fn least(&self) -> f64 {
        match self {
            Self::All(wanted) => *wanted,
            Self::Columns(columns) => columns.iter().map(|(_, wanted)| *wanted).fold(f64::INFINITY, f64::min),
        }
    }

    /// The columns that are named.
    pub fn columns(&self) -> impl Iterator<Item = &Spanned<String>> {
        let named: &[(Spanned<String>, f64)] = if let Self::Columns(columns) = self { columns } else { &[] };
        named.iter().map(|(name, _)| name)
    }
}
