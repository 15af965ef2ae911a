//! `[[body]]`: a rigid body at a node.

use super::diagnostic::{Span, Spanned};
use super::reader::{Context, Item, Table};
use super::section::read_matrix;
use toml::de::DeValue;

/// `[[body]]`
#[derive(Clone, Debug)]
pub struct Body {
    /// The point
    pub(crate) at: Spanned<String>,
    /// Mass
    pub(crate) mass: f64,
    /// Inertia about its own centre, global axes at the start
    pub inertia: Option<[[f64; 3]; 3]>,
    /// Its centre as seen from the node
    pub offset: [f64; 3],
    /// Place of the table
    pub(crate) span: Span,
}

/// Keys of `[[body]]`.
pub(super) const KEYS: [&str; 4] = ["at", "mass", "inertia", "offset"];

pub(super) fn read_body<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Body> {
    let table = Table::new(context, item, "[[body]]", &KEYS)?;
    let at = table.required_text("at");
    let mass = table.required_positive("mass");
    let inertia = table.optional("inertia", |_, item| read_inertia(&table, item));
    let offset = table.vector_or("offset", [0.0; 3]);
    Some(Body { at: at?, mass: mass?.value, inertia: inertia?, offset: offset?, span: table.span.clone() })
}

/// Three principal moments about the global axes, or a matrix.
fn read_inertia(table: &Table, item: &Item) -> Option<[[f64; 3]; 3]> {
    let is_row = |entry: &Item| matches!(entry.get_ref(), DeValue::Array(_));
    if matches!(item.get_ref(), DeValue::Array(rows) if rows.iter().any(is_row)) {
        return read_matrix(table, "inertia", item);
    }
    let [a, b, c] = table.context.vector::<3>(item)?.value;
    Some([[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]])
}
