//! `[point]`: named places; and places in other tables, by a name or by coordinates.

use super::by_name::Named;
use super::diagnostic::Spanned;
use super::reader::{Context, Item, Table, kind_of};
use super::shown::hides_text;
use toml::de::DeValue;

/// A place: a name or coordinates.
#[derive(Clone, Debug, PartialEq)]
pub enum PointRef {
    /// A name of `[point]`
    Name(String),
    /// A place without a name
    Coordinates([f64; 3]),
}

impl Named for (Spanned<String>, [f64; 3]) {
    fn name(&self) -> &str {
        &self.0.value
    }
}

pub(super) fn read_points(top: &Table) -> Vec<(Spanned<String>, [f64; 3])> {
    let Some(item) = top.get("point") else { return Vec::new() };
    let Some(table) = Table::of_names(top.context, item, "[point]") else { return Vec::new() };
    let read = |(name, item)| Some((check_name(table.context, name)?, table.context.vector(item)?.value));
    table.entries().filter_map(read).collect()
}

/// Refuses names with the punctuation of node names and column names, in which names of points and
/// beams stand, and names that are dangerous there: spreadsheets carry out cells that begin with
/// `=`, `+` or `-`, and some characters hide or reorder text.
pub(super) fn check_name(context: &Context, name: Spanned<String>) -> Option<Spanned<String>> {
    let bad = name.value.chars().find(|c| matches!(c, '@' | ':' | '.' | ',' | '"' | '/' | '\\') || c.is_control());
    if name.value.trim().is_empty() {
        return context.wrong(name.span, "a name must not be empty");
    }
    if let Some(c) = bad {
        let message = format!("a name must not contain {c:?}: it would be ambiguous in node and column names");
        return context.wrong(name.span, message);
    }
    if let Some(c) = name.value.chars().find(|&c| hides_text(c)) {
        let message = format!("a name must not contain {c:?}, which hides or reorders text");
        return context.wrong(name.span, message);
    }
    if let Some(c) = name.value.trim_start().chars().next().filter(|c| ['=', '+', '-'].contains(c)) {
        let message = format!("a name must not begin with `{c}`: a spreadsheet would take its columns for formulas");
        return context.wrong(name.span, message);
    }
    Some(name)
}

/// A point by its name or its coordinates.
pub(super) fn read_point(context: &Context, item: &Item) -> Option<Spanned<PointRef>> {
    match item.get_ref() {
        DeValue::String(name) => Some(Spanned { value: PointRef::Name(name.to_string()), span: item.span() }),
        DeValue::Array(_) => Some(context.vector(item)?.map(PointRef::Coordinates)),
        other => context.wrong(item.span(), format!("a point must be a name or [x, y, z], found {}", kind_of(other))),
    }
}

pub(super) fn read_point_list(context: &Context, item: &Item) -> Option<Vec<Spanned<PointRef>>> {
    let DeValue::Array(array) = item.get_ref() else {
        return context.wrong(item.span(), format!("expected a list of points, found {}", kind_of(item.get_ref())));
    };
    let points: Vec<Option<Spanned<PointRef>>> = array.iter().map(|entry| read_point(context, entry)).collect();
    points.into_iter().collect()
}
