//! `[[spring]]`: springs and dampers to ground, and springs, dampers and cables between nodes.

use super::axes::{Axes, read_axes};
use super::diagnostic::{Span, Spanned};
use super::reader::{Context, Item, Table};
use super::stage::read_stages;

/// `[[spring]]`
#[derive(Clone, Debug)]
pub struct Spring {
    /// Ends and stiffness
    pub body: SpringBody,
    /// Stages from 1; left out: all
    pub(crate) stages: Option<Vec<usize>>,
    /// Place of the table
    pub(crate) span: Span,
}

/// Kinds of springs.
#[derive(Clone, Debug)]
pub enum SpringBody {
    /// From a node to ground
    Ground {
        /// The node
        at: Spanned<String>,
        /// ux uy uz rx ry rz
        stiffness: [f64; 6],
        /// ux uy uz rx ry rz
        damping: [f64; 6],
        /// Directions of these; left out: the global axes
        axes: Option<Axes>,
    },
    /// Between two nodes
    Between {
        /// The nodes
        nodes: [Spanned<String>; 2],
        /// Force per length
        stiffness: f64,
        /// Force per velocity
        damping: f64,
        /// Length without force; left out: the distance at the start
        length: Option<f64>,
        /// True for a cable, which carries no compression
        tension_only: bool,
    },
}

/// Keys of `[[spring]]`.
pub(super) const KEYS: [&str; 8] =
    ["at", "between", "stiffness", "damping", "length", "tension_only", "axes", "stages"];

pub(super) fn read_spring<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Spring> {
    let table = Table::new(context, item, "[[spring]]", &KEYS)?;
    let stages = read_stages(&table);
    if table.has("at") && table.has("between") {
        return table.wrong_key(
            "between",
            "a spring connects either a node (`at`) to ground, or the two nodes in `between`, not both",
        );
    }
    if !table.has("stiffness") && !table.has("damping") {
        return table.wrong("[[spring]] needs `stiffness` or `damping`");
    }
    let body = if table.has("between") { read_between(&table) } else { read_ground(&table) };
    Some(Spring { body: body?, stages: stages?, span: table.span.clone() })
}

fn read_ground(table: &Table) -> Option<SpringBody> {
    for key in ["length", "tension_only"] {
        table.refuse(key, format!("`{key}` is only allowed in a spring `between` nodes"));
    }
    let at = table.required_text("at");
    let stiffness = table.non_negative_vector_or("stiffness", [0.0; 6]);
    let damping = table.non_negative_vector_or("damping", [0.0; 6]);
    let axes = read_axes(table);
    Some(SpringBody::Ground { at: at?, stiffness: stiffness?, damping: damping?, axes: axes? })
}

fn read_between(table: &Table) -> Option<SpringBody> {
    let context = table.context;
    table.refuse("axes", "`axes` is not allowed in a spring between nodes");
    let item = table.get("between")?;
    let Ok(nodes) = <[Spanned<String>; 2]>::try_from(context.texts(item)?) else {
        return context.wrong(item.span(), "`between` must name two nodes");
    };
    let stiffness = table.non_negative_or("stiffness", 0.0);
    let damping = table.non_negative_or("damping", 0.0);
    let length = table.optional("length", |_, _| table.non_negative("length"));
    let tension_only = table.flag_or("tension_only", false);
    if !table.has("stiffness") && tension_only == Some(false) {
        table.refuse("length", "`length` has no effect without `stiffness` or `tension_only`");
    }
    Some(SpringBody::Between {
        nodes,
        stiffness: stiffness?,
        damping: damping?,
        length: length?.map(|length| length.value),
        tension_only: tension_only?,
    })
}
