//! `[[motion]]`: a prescribed displacement or rotation of a node.

use super::axes::{Axes, read_axes};
use super::diagnostic::{Span, Spanned};
use super::history::{HistoryUse, read_history_use};
use super::reader::{Context, Item, Table};
use super::stage::read_stages;

/// `[[motion]]`
#[derive(Clone, Debug)]
pub struct Motion {
    /// The node
    pub(crate) at: Spanned<String>,
    /// Prescribed quantity
    pub what: MotionWhat,
    /// Directions of displacements; left out: the global axes
    pub axes: Option<Axes>,
    /// Factor over time or load factor
    pub(crate) history: Option<HistoryUse>,
    /// Stages from 1; left out: all
    pub(crate) stages: Option<Vec<usize>>,
    /// Place of the table
    pub(crate) span: Span,
}

/// The quantity that a motion prescribes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionWhat {
    /// Displacement along direction 0, 1 or 2
    Displacement {
        /// ux, uy, uz
        direction: usize,
        /// Length
        value: f64,
    },
    /// The whole rotation
    Rotation {
        /// About this vector
        axis: [f64; 3],
        /// Radians
        angle: f64,
    },
}

const DISPLACEMENTS: [&str; 3] = ["ux", "uy", "uz"];

/// Keys of `[[motion]]`.
pub(super) const KEYS: [&str; 9] = ["at", "ux", "uy", "uz", "rotate", "angle", "axes", "history", "stages"];

pub(super) fn read_motion<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Motion> {
    let table = Table::new(context, item, "[[motion]]", &KEYS)?;
    let at = table.required_text("at");
    let what = read_what(&table);
    let axes = read_axes(&table);
    let stages = read_stages(&table);
    let history = read_history_use(&table, stages.iter().flatten().next());
    Some(Motion { at: at?, what: what?, axes: axes?, history, stages: stages?, span: table.span.clone() })
}

fn read_what(table: &Table) -> Option<MotionWhat> {
    let context = table.context;
    let given: Vec<usize> = (0..3).filter(|&k| table.has(DISPLACEMENTS[k])).collect();
    match (&given[..], table.get("rotate")) {
        (&[direction], None) => {
            if table.has("angle") {
                return table.wrong_key("angle", "`angle` is only allowed with `rotate`");
            }
            Some(MotionWhat::Displacement { direction, value: table.number(DISPLACEMENTS[direction])?.value })
        }
        ([], Some(item)) => {
            let angle = table.required_number("angle");
            let axis = context.vector::<3>(item)?;
            if axis.value == [0.0; 3] {
                return context.wrong(axis.span, "`rotate` must be an axis that is not zero");
            }
            Some(MotionWhat::Rotation { axis: axis.value, angle: angle?.value })
        }
        ([], None) => table.wrong("[[motion]] needs one of `ux`, `uy`, `uz`, or `rotate` with `angle`"),
        ([_, ..], _) => table
            .wrong("one [[motion]] prescribes one component (`ux`, `uy`, `uz` or `rotate`): use one table for each"),
    }
}
