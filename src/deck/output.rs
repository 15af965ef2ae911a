//! `[output]`: nodes, columns and rows that are written.

use super::diagnostic::{Span, Spanned};
use super::reader::{Context, Table};
use super::stage::MOST_STEPS;

/// `[output]`
#[derive(Clone, Debug)]
pub struct Output {
    /// The nodes that are written; default: every named point that is a node
    pub(crate) nodes: Option<Vec<Spanned<String>>>,
    /// The groups of columns; default: u and r
    pub(crate) columns: Option<Vec<Spanned<String>>>,
    /// Each n-th row
    pub(crate) every: usize,
    /// Rows at multiples of this time
    pub(crate) interval: Option<f64>,
    /// Place of `interval`
    pub(crate) interval_span: Span,
    /// True where the whole shape is written for ParaView
    pub(crate) vtk: bool,
    /// Place of `envelope`, where the largest stresses along all beams are written
    pub(crate) envelope: Option<Span>,
    /// Place of `profile`, where resultants along all beams are written
    pub(crate) profile: Option<Span>,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            nodes: None,
            columns: None,
            every: 1,
            interval: None,
            interval_span: 0..0,
            vtk: false,
            envelope: None,
            profile: None,
        }
    }
}

/// Keys of `[output]`.
pub(super) const KEYS: [&str; 7] = ["nodes", "columns", "every", "interval", "vtk", "envelope", "profile"];

pub(super) fn read_output(top: &Table) -> Output {
    let Some(item) = top.get("output") else { return Output::default() };
    let Some(table) = Table::new(top.context, item, "[output]", &KEYS) else { return Output::default() };
    if table.has("every") {
        table.refuse("interval", "give `every` or `interval`, not both");
    }
    let texts = |key: &str| table.optional(key, Context::texts).flatten();
    let wanted = |key: &str| table.flag_or(key, false).unwrap_or(false).then(|| table.key_span(key));
    Output {
        nodes: texts("nodes"),
        columns: texts("columns"),
        every: table.whole_or("every", 1..=MOST_STEPS, 1).unwrap_or(1),
        interval: table.positive("interval").map(|v| v.value),
        interval_span: table.key_span("interval"),
        vtk: table.flag_or("vtk", false).unwrap_or(false),
        envelope: wanted("envelope"),
        profile: wanted("profile"),
    }
}
