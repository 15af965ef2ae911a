//! `[[load]]`: forces and moments at nodes and along beams.

use super::diagnostic::{Span, Spanned};
use super::history::{HistoryUse, read_history_use};
use super::reader::{Context, Item, Table};
use super::stage::read_stages;
use super::words::words;
use toml::de::DeValue;

words! {
    /// Frame of the components of a load.
    pub enum Frame {
        /// Fixed in space
        Space = "space",
        /// Global axes at the start, then turning with the section
        Body = "body",
        /// Local axes 1, 2, 3, turning with the section
        Section = "section",
    }
}

/// A vector, constant or linear along a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadVector {
    /// At the start
    pub start: [f64; 3],
    /// At the end
    pub end: [f64; 3],
}

/// Place of a load.
#[derive(Clone, Debug)]
pub enum LoadTarget {
    /// At a node
    At(Spanned<String>),
    /// Along a beam
    Along(Spanned<String>),
}

/// `[[load]]`
#[derive(Clone, Debug)]
pub struct Load {
    /// Node or beam
    pub(crate) target: LoadTarget,
    /// Force
    pub force: Option<LoadVector>,
    /// Moment
    pub moment: Option<LoadVector>,
    /// Frame of its components
    pub frame: Frame,
    /// Factor over time or load factor
    pub(crate) history: Option<HistoryUse>,
    /// Stages from 1; left out: all
    pub(crate) stages: Option<Vec<usize>>,
    /// Place of the table
    pub(crate) span: Span,
}

/// Keys of `[[load]]`.
pub(super) const KEYS: [&str; 7] = ["at", "along", "force", "moment", "frame", "history", "stages"];

pub(super) fn read_load<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Load> {
    let table = Table::new(context, item, "[[load]]", &KEYS)?;
    let target = match (table.get("at"), table.get("along")) {
        (Some(item), None) => context.text(item).map(LoadTarget::At),
        (None, Some(item)) => context.text(item).map(LoadTarget::Along),
        (Some(_), Some(item)) => {
            context.wrong(item.span(), "a load acts either `at` a node or `along` a beam, not both")
        }
        (None, None) => table.wrong("[[load]] needs `at` (a node) or `along` (a beam)"),
    };
    if !table.has("force") && !table.has("moment") {
        table.wrong::<()>("[[load]] needs `force` or `moment`");
    }
    let force = read_vector(&table, "force");
    let moment = read_vector(&table, "moment");
    let frame = table.word_or("frame", Frame::Space);
    let stages = read_stages(&table);
    let history = read_history_use(&table, stages.iter().flatten().next());
    Some(Load {
        target: target?,
        force: force?,
        moment: moment?,
        frame: frame?,
        history,
        stages: stages?,
        span: table.span.clone(),
    })
}

/// One vector, or two along a beam; `Some(None)` where the key is left out.
fn read_vector(table: &Table, key: &str) -> Option<Option<LoadVector>> {
    table.optional(key, |context, item| {
        let is_row = |entry: &Item| matches!(entry.get_ref(), DeValue::Array(_));
        let rows = match item.get_ref() {
            DeValue::Array(rows) if rows.iter().any(is_row) => rows,
            _ => {
                let vector = context.vector::<3>(item)?.value;
                return Some(LoadVector { start: vector, end: vector });
            }
        };
        if !table.has("along") {
            let message = format!("`{key}` at a node must be one vector; [start, end] is only allowed with `along`");
            return context.wrong(item.span(), message);
        }
        if rows.len() != 2 {
            let message = format!("`{key}` must be a vector or [start vector, end vector], found {} rows", rows.len());
            return context.wrong(item.span(), message);
        }
        let rows: Vec<Option<[f64; 3]>> = rows.iter().map(|row| context.vector(row).map(|v| v.value)).collect();
        let [start, end]: [Option<[f64; 3]>; 2] = rows.try_into().ok()?;
        Some(LoadVector { start: start?, end: end? })
    })
}
