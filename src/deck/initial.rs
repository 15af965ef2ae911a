//! `[[initial]]`: initial velocities.

use super::diagnostic::{Span, Spanned};
use super::point::{PointRef, read_point};
use super::reader::{Context, Item, Table};

/// The part of a scene that has an initial velocity.
#[derive(Clone, Debug)]
pub enum InitialTarget {
    /// A node
    At(Spanned<String>),
    /// A beam
    Beam(Spanned<String>),
    /// Everything
    All,
}

/// `[[initial]]`
#[derive(Clone, Debug)]
pub struct Initial {
    /// Node, beam or everything
    pub(crate) target: InitialTarget,
    /// Velocity
    pub velocity: [f64; 3],
    /// Angular velocity
    pub spin: [f64; 3],
    /// A point on the axis of the spin: a name or coordinates
    pub about: Option<Spanned<PointRef>>,
    /// Place of the table
    pub(crate) span: Span,
}

/// Keys of `[[initial]]`.
pub(super) const KEYS: [&str; 5] = ["beam", "at", "velocity", "spin", "about"];

pub(super) fn read_initial<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Initial> {
    let table = Table::new(context, item, "[[initial]]", &KEYS)?;
    let target = match (table.get("at"), table.get("beam")) {
        (Some(item), None) => context.text(item).map(InitialTarget::At),
        (None, Some(item)) => context.text(item).map(InitialTarget::Beam),
        (None, None) => Some(InitialTarget::All),
        (Some(_), Some(item)) => {
            context.wrong(item.span(), "[[initial]] takes either a node (`at`) or a `beam`, not both")
        }
    };
    if !table.has("velocity") && !table.has("spin") {
        table.wrong::<()>("[[initial]] needs `velocity` or `spin`");
    }
    if !table.has("spin") {
        table.refuse("about", "`about` is the centre of the `spin`, which is missing");
    }
    let velocity = table.vector_or("velocity", [0.0; 3]);
    let spin = table.vector_or("spin", [0.0; 3]);
    let about = table.optional("about", read_point);
    Some(Initial { target: target?, velocity: velocity?, spin: spin?, about: about?, span: table.span.clone() })
}
