//! `[[joint]]`: connections of two beams or nodes, or of one of them with ground.

use super::axes::{dot, unit};
use super::diagnostic::{Diagnostic, Span, Spanned, one_of};
use super::history::{HistoryUse, read_history_use};
use super::point::{PointRef, read_point};
use super::reader::{Context, Item, Table};
use super::words::Words;
use beamsim_core::effect::joint::JointKind;
use toml::de::DeValue;

/// `[[joint]]`
#[derive(Clone, Debug)]
pub struct Joint {
    /// Kind, by the motions that it leaves free
    pub(crate) kind: JointKind,
    /// Connected beams or nodes
    pub parts: JointParts,
    /// Its axis, or both axes of a universal joint; global, at the start
    pub axes: Vec<[f64; 3]>,
    /// About or along the axis
    pub(crate) stiffness: f64,
    /// About or along the axis
    pub(crate) damping: f64,
    /// Motor on the free direction
    pub(crate) motor: Option<JointMotor>,
    /// Place of the table
    pub(crate) span: Span,
}

/// A prescribed angle or displacement of a joint.
#[derive(Clone, Debug)]
pub struct JointMotor {
    /// Radians of a revolute joint, length of a prismatic one
    pub(crate) value: f64,
    /// Factor over time or load factor
    pub(crate) history: Option<HistoryUse>,
}

/// The parts that a joint connects; one part is joined to ground.
#[derive(Clone, Debug)]
pub enum JointParts {
    /// Beams that meet at a point
    Beams {
        /// The point
        at: Spanned<String>,
        /// One or two
        beams: Vec<Spanned<String>>,
    },
    /// Nodes, which may lie apart
    Nodes {
        /// One or two
        nodes: Vec<Spanned<String>>,
        /// Place of the joint; left out: that of the last node
        at: Option<Spanned<PointRef>>,
    },
}

impl Words for JointKind {
    const ALL: &'static [Self] = &JointKind::ALL;

    fn word(self) -> &'static str {
        self.word
    }
}

/// Keys of `[[joint]]`.
pub(super) const KEYS: [&str; 11] =
    ["kind", "at", "beams", "nodes", "axis", "axes", "stiffness", "damping", "angle", "displacement", "history"];
/// Keys of springs, dampers and motors, which act on the one free direction of a joint.
const DRIVE: [&str; 5] = ["stiffness", "damping", "angle", "displacement", "history"];
/// Remedy for joints that slide and turn.
const SERIES: &str = "; put one of each in series, with a body between them, or use [[spring]]";
/// Largest cosine between the axes of a universal joint.
const NORMAL: f64 = 1e-9;

pub(super) fn read_joint<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Joint> {
    let table = Table::new(context, item, "[[joint]]", &KEYS)?;
    table.required("kind")?;
    let kind = table.word::<JointKind>("kind");
    let parts = read_parts(&table);
    let kind = kind?.value;
    let parts = parts?;
    let axes = read_joint_axes(&table, kind);
    refuse_drive_of_others(&table, kind);
    let stiffness = table.non_negative_or("stiffness", 0.0);
    let damping = table.non_negative_or("damping", 0.0);
    let motor = match ["angle", "displacement"].into_iter().find(|key| table.has(key)) {
        None => None,
        Some(key) => Some(JointMotor { value: table.number(key)?.value, history: read_history_use(&table, None) }),
    };
    if motor.is_none() {
        table.refuse("history", "`history` of a joint is only allowed with `angle` or `displacement`");
    }
    Some(Joint { kind, parts, axes: axes?, stiffness: stiffness?, damping: damping?, motor, span: table.span.clone() })
}

/// Refuses springs, dampers and motors of joints that have no free coordinate for them, and motors of another coordinate.
fn refuse_drive_of_others(table: &Table, kind: JointKind) {
    let own = kind.driven.map(|coordinate| ["stiffness", "damping", coordinate.word(), "history"]);
    for key in DRIVE.into_iter().filter(|key| table.has(key) && !own.is_some_and(|own| own.contains(key))) {
        let help = match kind.driven {
            Some(coordinate) => format!("its motor is given by `{}`", coordinate.word()),
            None => {
                let one = one_of(driven_kinds());
                let remedy = if kind.shares_displacement() { "" } else { SERIES };
                format!(
                    "springs, dampers and motors are only allowed in joints with one free coordinate: {one}{remedy}"
                )
            }
        };
        let message = format!("`{key}` is not allowed in a {} joint", kind.word);
        table.context.report(Diagnostic::error(message, table.key_span(key)).help(help));
    }
}

/// The words of the joints that may have a spring, a damper or a motor.
fn driven_kinds() -> Vec<&'static str> {
    JointKind::ALL.iter().filter(|kind| kind.driven.is_some()).map(|kind| kind.word).collect()
}

fn read_parts(table: &Table) -> Option<JointParts> {
    match (table.has("beams"), table.has("nodes")) {
        (true, true) => table.wrong_key("nodes", "a joint takes either `beams` or `nodes`, not both"),
        (false, true) => {
            let nodes = read_one_or_two(table, "nodes");
            let at = table.optional("at", read_point);
            Some(JointParts::Nodes { nodes: nodes?, at: at? })
        }
        (_, false) => {
            let at = table.required_text("at");
            table.required("beams")?;
            let beams = read_one_or_two(table, "beams");
            Some(JointParts::Beams { at: at?, beams: beams? })
        }
    }
}

fn read_one_or_two(table: &Table, key: &str) -> Option<Vec<Spanned<String>>> {
    let context = table.context;
    let item = table.get(key)?;
    let names = context.texts(item)?;
    match &names[..] {
        [a, b] if a.value == b.value => context.wrong(b.span.clone(), format!("a joint needs two different {key}")),
        [_] | [_, _] => Some(names),
        [] | [_, _, _, ..] => {
            context.wrong(item.span(), format!("`{key}` must have one or two names, found {}", names.len()))
        }
    }
}

/// Unit vectors: none, the axis, or both axes.
fn read_joint_axes(table: &Table, kind: JointKind) -> Option<Vec<[f64; 3]>> {
    let wanted = match kind.axes {
        0 => None,
        1 => Some("axis"),
        _ => Some("axes"),
    };
    for key in ["axis", "axes"].into_iter().filter(|key| Some(*key) != wanted) {
        let message = match wanted {
            Some(wanted) => format!("this kind of joint needs `{wanted}`, not `{key}`"),
            None => format!("`{key}` is not allowed in this kind of joint"),
        };
        table.refuse(key, message);
    }
    match kind.axes {
        0 => Some(Vec::new()),
        1 => Some(vec![read_unit(table.context, table.required("axis")?)?]),
        _ => read_normal_pair(table),
    }
}

fn read_normal_pair(table: &Table) -> Option<Vec<[f64; 3]>> {
    let context = table.context;
    let item = table.required("axes")?;
    let DeValue::Array(rows) = item.get_ref() else {
        return context.wrong(item.span(), "`axes` must be two vectors");
    };
    let axes: Vec<[f64; 3]> = rows.iter().map(|row| read_unit(context, row)).collect::<Option<_>>()?;
    match axes[..] {
        [a, b] if dot(a, b).abs() < NORMAL => Some(axes),
        _ => context.wrong(item.span(), "`axes` must be two vectors normal to each other"),
    }
}

/// A vector that is not zero, made one of unit length.
fn read_unit(context: &Context, item: &Item) -> Option<[f64; 3]> {
    let vector = context.vector::<3>(item)?;
    match unit(vector.value) {
        Some(unit) => Some(unit),
        None => context.wrong(vector.span, "an axis must not be zero"),
    }
}
