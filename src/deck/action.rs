//! What acts on a scene: supports, motions, joints, bodies, springs, loads, initial velocities, histories.

use super::diagnostic::{Diagnostic, Span, Spanned, nearest, one_of};
use super::expression::Expression;
use super::geometry::{check_name, matrix, read_point};
use super::reader::{Context, Item, Table, kind_of};
use beamsim_core::effect::joint::JointKind;
use toml::de::DeValue;

/// Two orthonormal directions; the third follows.
pub type Axes = [[f64; 3]; 2];

/// `[[support]]`
#[derive(Clone, Debug)]
pub struct Support {
    /// The node
    pub at: Spanned<String>,
    /// Which of ux uy uz rx ry rz
    pub fix: [bool; 6],
    /// What the directions mean
    pub axes: Option<Axes>,
    /// Stages from 1
    pub stages: Option<Vec<usize>>,
    /// Where the table stands
    pub span: Span,
}

/// `[[motion]]`
#[derive(Clone, Debug)]
pub struct Motion {
    /// The node
    pub at: Spanned<String>,
    /// What moves
    pub what: MotionWhat,
    /// What the directions mean
    pub axes: Option<Axes>,
    /// Its history
    pub history: Option<HistoryUse>,
    /// Stages from 1
    pub stages: Option<Vec<usize>>,
    /// Where the table stands
    pub span: Span,
}

/// What a motion prescribes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionWhat {
    /// Displacement along direction 0, 1 or 2
    Displacement {
        /// ux, uy, uz
        direction: usize,
        /// How far
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

/// `[[joint]]`
#[derive(Clone, Debug)]
pub struct Joint {
    /// What it lets move
    pub kind: JointKind,
    /// What it connects
    pub parts: JointParts,
    /// Its axis, or both axes of a universal joint; global, at the start
    pub axes: Vec<[f64; 3]>,
    /// About or along the axis
    pub stiffness: f64,
    /// About or along the axis
    pub damping: f64,
    /// A prescribed angle or displacement, with its history
    pub motor: Option<(f64, Option<HistoryUse>)>,
    /// Where the table stands
    pub span: Span,
}

/// What a joint connects; one part is joined to ground.
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
        /// Where the joint sits; left out: at the last of them
        at: Option<Spanned<super::PointRef>>,
    },
}

/// `[[body]]`
#[derive(Clone, Debug)]
pub struct Body {
    /// The point
    pub at: Spanned<String>,
    /// Mass
    pub mass: f64,
    /// Inertia about its own centre, global axes at the start
    pub inertia: Option<[[f64; 3]; 3]>,
    /// Its centre as seen from the node
    pub offset: [f64; 3],
    /// Where the table stands
    pub span: Span,
}

/// `[[spring]]`
#[derive(Clone, Debug)]
pub struct Spring {
    /// What it connects
    pub body: SpringBody,
    /// Stages from 1
    pub stages: Option<Vec<usize>>,
    /// Where the table stands
    pub span: Span,
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
        /// What the directions mean
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
        /// Whether it is a cable
        tension_only: bool,
    },
}

/// In what frame the components of a load are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// Fixed in space
    Space,
    /// Global axes at the start, then turning with the section
    Body,
    /// Local axes 1, 2, 3, turning with the section
    Section,
}

/// A vector, constant or linear along a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadVector {
    /// At the start
    pub start: [f64; 3],
    /// At the end
    pub end: [f64; 3],
}

/// Where a load acts.
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
    /// Where
    pub target: LoadTarget,
    /// Force
    pub force: Option<LoadVector>,
    /// Moment
    pub moment: Option<LoadVector>,
    /// Of its components
    pub frame: Frame,
    /// Its history
    pub history: Option<HistoryUse>,
    /// Stages from 1
    pub stages: Option<Vec<usize>>,
    /// Where the table stands
    pub span: Span,
}

/// What starts moving.
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
    /// What starts moving
    pub target: InitialTarget,
    /// Velocity
    pub velocity: [f64; 3],
    /// Angular velocity
    pub spin: [f64; 3],
    /// The point it turns about: a name or coordinates
    pub about: Option<Spanned<super::PointRef>>,
    /// Where the table stands
    pub span: Span,
}

/// `history = "h"`, or `history = { name = "h", stages = [2] }`
#[derive(Clone, Debug)]
pub struct HistoryUse {
    /// The name of the history
    pub name: Spanned<String>,
    /// The stages that it belongs to, from 1: in others it stands still. Left out: it is read in all.
    pub stages: Option<Vec<usize>>,
}

impl HistoryUse {
    /// Whether it is read in a stage, from 1.
    pub fn goes_on_in(&self, stage: usize) -> bool {
        self.stages.as_ref().is_none_or(|stages| stages.contains(&stage))
    }
}

/// `[history.NAME]`
#[derive(Clone, Debug)]
pub struct HistoryTable {
    /// Its name
    pub name: Spanned<String>,
    /// What it is
    pub body: HistoryBody,
}

/// A table or an expression of t.
#[derive(Clone, Debug)]
pub enum HistoryBody {
    /// Times and values
    Table {
        /// Increasing
        times: Vec<f64>,
        /// As many
        values: Vec<f64>,
        /// Whether intervals are smooth
        smooth: bool,
    },
    /// An expression of t, with the parameters put in
    Expression(Expression),
}

const DIRECTIONS: [&str; 6] = ["ux", "uy", "uz", "rx", "ry", "rz"];

pub(super) fn read_support<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Support> {
    let table = Table::new(context, item, "[[support]]", &["at", "fix", "axes", "stages"])?;
    let at = required_text(&table, "at");
    let fix = table.required("fix").and_then(|item| read_fix(context, item));
    let (axes, stages) = (read_axes(&table), read_stages(&table));
    Some(Support { at: at?, fix: fix?, axes: axes?, stages: stages?, span: table.span.clone() })
}

fn required_text(table: &Table, key: &str) -> Option<Spanned<String>> {
    table.context.text(table.required(key)?)
}

fn read_fix(context: &Context, item: &Item) -> Option<[bool; 6]> {
    let unknown = |word: &str, span: Span, list: bool| {
        let mut diagnostic = Diagnostic::error(format!("`fix` does not know `{word}`"), span);
        let help = "`fix` is \"all\", \"pin\" or a list of ux uy uz rx ry rz";
        let meant = nearest(word, DIRECTIONS).filter(|_| list);
        diagnostic.help = Some(meant.map_or(help.into(), |meant| format!("did you mean `{meant}`?")));
        context.report(diagnostic);
    };
    match item.get_ref() {
        DeValue::String(word) if word == "all" => Some([true; 6]),
        DeValue::String(word) if word == "pin" => Some([true, true, true, false, false, false]),
        DeValue::String(word) => {
            if let Some(k) = DIRECTIONS.iter().position(|d| d == word) {
                return Some(std::array::from_fn(|i| i == k));
            }
            unknown(word, item.span(), false);
            None
        }
        DeValue::Array(_) => {
            let words = context.texts(item)?;
            let mut fix = [false; 6];
            for word in &words {
                let Some(k) = DIRECTIONS.iter().position(|d| *d == word.value) else {
                    unknown(&word.value, word.span.clone(), true);
                    return None;
                };
                if fix[k] {
                    return context.wrong(word.span.clone(), format!("`{}` stands twice", word.value));
                }
                fix[k] = true;
            }
            if words.is_empty() {
                return context.wrong(item.span(), "`fix` must not be empty");
            }
            Some(fix)
        }
        other => context.wrong(
            item.span(),
            format!("`fix` is \"all\", \"pin\" or a list of ux uy uz rx ry rz, found {}", kind_of(other)),
        ),
    }
}

/// `Some(None)` where there is no key.
fn read_axes(table: &Table) -> Option<Option<Axes>> {
    let Some(item) = table.get("axes") else { return Some(None) };
    let context = table.context;
    let DeValue::Array(rows) = item.get_ref() else {
        return context.wrong(item.span(), format!("`axes` is two vectors, found {}", kind_of(item.get_ref())));
    };
    if rows.len() != 2 {
        return context
            .wrong(item.span(), format!("`axes` is the first two of three directions, found {}", rows.len()));
    }
    let rows: Vec<Option<[f64; 3]>> = rows.iter().map(|row| context.vector(row).map(|v| v.value)).collect();
    let [a, b]: [Option<[f64; 3]>; 2] = rows.try_into().ok()?;
    let (a, b) = (a?, b?);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let off = (dot(a, a) - 1.0).abs().max((dot(b, b) - 1.0).abs()).max(dot(a, b).abs());
    if off > 1e-6 {
        return context.wrong(item.span(), "`axes` must be two unit vectors normal to each other");
    }
    Some(Some([a, b]))
}

/// `Some(None)` where there is no key: all stages.
fn read_stages(table: &Table) -> Option<Option<Vec<usize>>> {
    let Some(item) = table.get("stages") else { return Some(None) };
    let context = table.context;
    let DeValue::Array(array) = item.get_ref() else {
        let message = format!("`stages` is a list of stage numbers from 1, found {}", kind_of(item.get_ref()));
        return context.wrong(item.span(), message);
    };
    if array.is_empty() {
        return context.wrong(item.span(), "`stages` must not be empty");
    }
    let count = context.stage_count;
    let number = |entry: &Item| {
        let n = context.whole(entry, 1, usize::MAX)?;
        if n.value > count {
            let message = format!("there is no stage {}: the deck has {count}", n.value);
            return context.wrong(n.span, message);
        }
        Some(n.value)
    };
    let numbers: Vec<Option<usize>> = array.iter().map(number).collect();
    Some(Some(numbers.into_iter().collect::<Option<_>>()?))
}

/// The history that a table names; `None` where it names none, or a wrong one, which is reported. `acting`: the stages in
/// which the table itself acts, where it does not in all.
pub(super) fn read_history_use(table: &Table, acting: Option<&Vec<usize>>) -> Option<HistoryUse> {
    let (context, item) = (table.context, table.get("history")?);
    if !matches!(item.get_ref(), DeValue::Table(_)) {
        return Some(HistoryUse { name: context.text(item)?, stages: None });
    }
    let named = Table::new(context, item, "`history`", &["name", "stages"])?;
    let (name, stages) = (required_text(&named, "name"), read_stages(&named)?);
    let (name, stages) = (name?, stages);
    let idle = |stage: &&usize| acting.is_some_and(|acting| !acting.contains(stage));
    if let Some(stage) = stages.iter().flatten().find(idle) {
        let message =
            format!("the history `{}` belongs to stage {stage}, in which {} does not act", name.value, table.what);
        context.report(Diagnostic::error(message, named.key_span("stages")));
    }
    Some(HistoryUse { name, stages })
}

pub(super) fn read_motion<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Motion> {
    let keys = ["at", "ux", "uy", "uz", "rotate", "angle", "axes", "history", "stages"];
    let table = Table::new(context, item, "[[motion]]", &keys)?;
    let at = required_text(&table, "at");
    let what = read_motion_what(&table);
    let (axes, stages) = (read_axes(&table), read_stages(&table));
    let history = read_history_use(&table, stages.iter().flatten().next());
    Some(Motion { at: at?, what: what?, axes: axes?, history, stages: stages?, span: table.span.clone() })
}

fn read_motion_what(table: &Table) -> Option<MotionWhat> {
    let context = table.context;
    let given: Vec<usize> = (0..3).filter(|&k| table.has(DIRECTIONS[k])).collect();
    match (&given[..], table.get("rotate")) {
        (&[direction], None) => {
            if table.has("angle") {
                return context.wrong(table.key_span("angle"), "`angle` belongs to `rotate`");
            }
            Some(MotionWhat::Displacement { direction, value: table.number(DIRECTIONS[direction])?.value })
        }
        ([], Some(item)) => {
            let angle = table.required("angle").and_then(|item| context.number(item));
            let axis = context.vector::<3>(item)?;
            if axis.value == [0.0; 3] {
                return context.wrong(axis.span, "`rotate` is an axis and must not be zero");
            }
            Some(MotionWhat::Rotation { axis: axis.value, angle: angle?.value })
        }
        ([], None) => {
            context.wrong(table.span.clone(), "[[motion]] needs one of `ux`, `uy`, `uz`, or `rotate` with `angle`")
        }
        _ => context.wrong(
            table.span.clone(),
            "[[motion]] prescribes one thing: one of `ux`, `uy`, `uz`, or `rotate`; use one table for each",
        ),
    }
}

const JOINT_KEYS: [&str; 11] =
    ["kind", "at", "beams", "nodes", "axis", "axes", "stiffness", "damping", "angle", "displacement", "history"];

pub(super) fn read_joint<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Joint> {
    let table = Table::new(context, item, "[[joint]]", &JOINT_KEYS)?;
    table.required("kind")?;
    let words = JointKind::ALL.map(|kind| kind.word);
    let kind = table.word("kind", &words).and_then(|word| JointKind::of_word(word.value));
    let parts = read_joint_parts(&table);
    let (kind, parts) = (kind?, parts?);
    let axes = read_joint_axes(&table, kind);
    refuse_drive_of_others(&table, kind);
    let number = |key: &str| {
        if !table.has(key) {
            return Some(0.0);
        }
        let value = table.number(key)?;
        let message = || format!("`{key}` of a joint must not be negative");
        if value.value < 0.0 { context.wrong(value.span, message()) } else { Some(value.value) }
    };
    let (stiffness, damping) = (number("stiffness"), number("damping"));
    let motor = ["angle", "displacement"].into_iter().find(|key| table.has(key));
    let motor = match motor {
        None => None,
        Some(key) => Some((table.number(key)?.value, read_history_use(&table, None))),
    };
    if motor.is_none() && table.has("history") {
        let message = "`history` of a joint belongs to `angle` or `displacement`";
        context.report(Diagnostic::error(message, table.key_span("history")));
    }
    Some(Joint { kind, parts, axes: axes?, stiffness: stiffness?, damping: damping?, motor, span: table.span.clone() })
}

fn read_joint_parts(table: &Table) -> Option<JointParts> {
    let context = table.context;
    let one_or_two = |key: &str| {
        let item = table.get(key)?;
        let names = context.texts(item)?;
        match &names[..] {
            [a, b] if a.value == b.value => context.wrong(b.span.clone(), format!("a joint needs two different {key}")),
            [_] | [_, _] => Some(names),
            _ => context.wrong(item.span(), format!("`{key}` names one or two, found {}", names.len())),
        }
    };
    match (table.has("beams"), table.has("nodes")) {
        (true, true) => context.wrong(table.key_span("nodes"), "a joint connects `beams` or `nodes`, not both"),
        (false, true) => {
            let nodes = one_or_two("nodes");
            let at = table.get("at").map_or(Some(None), |item| read_point(context, item).map(Some));
            Some(JointParts::Nodes { nodes: nodes?, at: at? })
        }
        _ => {
            let at = required_text(table, "at");
            table.required("beams")?;
            let beams = one_or_two("beams");
            Some(JointParts::Beams { at: at?, beams: beams? })
        }
    }
}

fn read_joint_axes(table: &Table, kind: JointKind) -> Option<Vec<[f64; 3]>> {
    let context = table.context;
    let wanted = match kind.axes {
        0 => None,
        1 => Some("axis"),
        _ => Some("axes"),
    };
    for key in ["axis", "axes"].into_iter().filter(|key| table.has(key) && Some(*key) != wanted) {
        let message = match wanted {
            Some(wanted) => format!("this joint has `{wanted}`, not `{key}`"),
            None => format!("this joint has no `{key}`"),
        };
        context.report(Diagnostic::error(message, table.key_span(key)));
    }
    let unit = |v: Spanned<[f64; 3]>| {
        let length = v.value.iter().map(|c| c * c).sum::<f64>().sqrt();
        if length > 0.0 {
            return Some(v.value.map(|c| c / length));
        }
        context.wrong(v.span, "an axis must not be zero")
    };
    match wanted {
        None => Some(Vec::new()),
        Some("axis") => {
            table.required("axis")?;
            Some(vec![unit(table.vector::<3>("axis")?)?])
        }
        Some(key) => {
            let item = table.required(key)?;
            let DeValue::Array(rows) = item.get_ref() else {
                return context.wrong(item.span(), "`axes` is two vectors");
            };
            let axes: Option<Vec<[f64; 3]>> = rows.iter().map(|row| unit(context.vector(row)?)).collect();
            match &axes?[..] {
                &[a, b] if (0..3).map(|k| a[k] * b[k]).sum::<f64>().abs() < 1e-9 => Some(vec![a, b]),
                _ => context.wrong(item.span(), "`axes` is two vectors normal to each other"),
            }
        }
    }
}

/// Refuses springs, dampers and motors of joints that have no free coordinate for them, and motors of another coordinate.
fn refuse_drive_of_others(table: &Table, kind: JointKind) {
    let own = kind.driven.map(|coordinate| ["stiffness", "damping", coordinate.word(), "history"]);
    let keys = ["stiffness", "damping", "angle", "displacement", "history"];
    for key in keys.into_iter().filter(|key| table.has(key) && !own.is_some_and(|own| own.contains(key))) {
        let help = match kind.driven {
            Some(coordinate) => format!("its motor is `{}`", coordinate.word()),
            None => format!(
                "springs, dampers and motors belong to joints with one free coordinate: {}",
                one_of(driven_kinds())
            ),
        };
        let message = format!("a {} joint has no `{key}`", kind.word);
        table.context.report(Diagnostic::error(message, table.key_span(key)).help(help));
    }
}

/// The words of the joints that may have a spring, a damper or a motor.
fn driven_kinds() -> Vec<&'static str> {
    JointKind::ALL.iter().filter(|kind| kind.driven.is_some()).map(|kind| kind.word).collect()
}

pub(super) fn read_body<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Body> {
    let table = Table::new(context, item, "[[body]]", &["at", "mass", "inertia", "offset"])?;
    let at = required_text(&table, "at");
    table.required("mass");
    let mass = table.positive("mass");
    let inertia = match table.get("inertia") {
        None => Some(None),
        Some(item) => read_inertia(&table, item).map(Some),
    };
    let offset = if table.has("offset") { table.vector("offset").map(|v| v.value) } else { Some([0.0; 3]) };
    Some(Body { at: at?, mass: mass?.value, inertia: inertia?, offset: offset?, span: table.span.clone() })
}

fn read_inertia(table: &Table, item: &Item) -> Option<[[f64; 3]; 3]> {
    let is_matrix =
        matches!(item.get_ref(), DeValue::Array(rows) if rows.iter().any(|r| matches!(r.get_ref(), DeValue::Array(_))));
    if is_matrix {
        return matrix(table, "inertia", item);
    }
    let [a, b, c] = table.context.vector::<3>(item)?.value;
    Some([[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]])
}

const SPRING_KEYS: [&str; 8] = ["at", "between", "stiffness", "damping", "length", "tension_only", "axes", "stages"];

pub(super) fn read_spring<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Spring> {
    let table = Table::new(context, item, "[[spring]]", &SPRING_KEYS)?;
    let stages = read_stages(&table);
    if table.has("at") && table.has("between") {
        return context
            .wrong(table.key_span("between"), "a spring goes from a node (`at`) to ground or `between` two nodes");
    }
    if !table.has("stiffness") && !table.has("damping") {
        return context.wrong(table.span.clone(), "[[spring]] needs `stiffness` or `damping`");
    }
    let body = if table.has("between") { read_link(&table) } else { read_ground_spring(&table) };
    Some(Spring { body: body?, stages: stages?, span: table.span.clone() })
}

fn read_ground_spring(table: &Table) -> Option<SpringBody> {
    let context = table.context;
    for key in ["length", "tension_only"].into_iter().filter(|key| table.has(key)) {
        context.report(Diagnostic::error(format!("`{key}` belongs to a spring `between` nodes"), table.key_span(key)));
    }
    let at = required_text(table, "at");
    let six = |key: &str| {
        let Some(item) = table.get(key) else { return Some([0.0; 6]) };
        let values = context.vector::<6>(item)?;
        if values.value.iter().any(|&v| v < 0.0) {
            return context.wrong(values.span, format!("`{key}` of a spring must not be negative"));
        }
        Some(values.value)
    };
    let (stiffness, damping, axes) = (six("stiffness"), six("damping"), read_axes(table));
    Some(SpringBody::Ground { at: at?, stiffness: stiffness?, damping: damping?, axes: axes? })
}

fn read_link(table: &Table) -> Option<SpringBody> {
    let context = table.context;
    if table.has("axes") {
        context.report(Diagnostic::error("a spring between nodes has no `axes`", table.key_span("axes")));
    }
    let item = table.get("between")?;
    let Ok(nodes) = <[Spanned<String>; 2]>::try_from(context.texts(item)?) else {
        return context.wrong(item.span(), "`between` names two nodes");
    };
    let number = |key: &str, default: Option<f64>| {
        if !table.has(key) {
            return Some(default);
        }
        let value = table.number(key)?;
        let message = || format!("`{key}` of a spring must not be negative");
        if value.value < 0.0 { context.wrong(value.span, message()) } else { Some(Some(value.value)) }
    };
    let (stiffness, damping) = (number("stiffness", Some(0.0)), number("damping", Some(0.0)));
    let length = number("length", None);
    let tension_only = if table.has("tension_only") { table.flag("tension_only")? } else { false };
    Some(SpringBody::Between { nodes, stiffness: stiffness??, damping: damping??, length: length?, tension_only })
}

/// Rayleigh factors of mass and stiffness.
pub(super) fn read_damping(top: &Table) -> Option<[f64; 2]> {
    let table = Table::new(top.context, top.get("damping")?, "[damping]", &["mass", "stiffness"])?;
    let factor = |key: &str| {
        if !table.has(key) {
            return Some(0.0);
        }
        let value = table.number(key)?;
        let message = || format!("`{key}` in [damping] must not be negative");
        if value.value < 0.0 { table.context.wrong(value.span, message()) } else { Some(value.value) }
    };
    let (mass, stiffness) = (factor("mass"), factor("stiffness"));
    Some([mass?, stiffness?])
}

pub(super) fn read_load<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Load> {
    let keys = ["at", "along", "force", "moment", "frame", "history", "stages"];
    let table = Table::new(context, item, "[[load]]", &keys)?;
    let target = match (table.get("at"), table.get("along")) {
        (Some(item), None) => context.text(item).map(LoadTarget::At),
        (None, Some(item)) => context.text(item).map(LoadTarget::Along),
        (Some(_), Some(item)) => context.wrong(item.span(), "a load acts `at` a node or `along` a beam, not both"),
        (None, None) => context.wrong(table.span.clone(), "[[load]] needs `at` (a node) or `along` (a beam)"),
    };
    if !table.has("force") && !table.has("moment") {
        context.report(Diagnostic::error("[[load]] needs `force` or `moment`", table.span.clone()));
    }
    let along = table.has("along");
    let force = read_load_vector(&table, "force", along);
    let moment = read_load_vector(&table, "moment", along);
    let frame = if table.has("frame") {
        table.word("frame", &["space", "body", "section"]).map(|word| match word.value {
            "space" => Frame::Space,
            "body" => Frame::Body,
            _ => Frame::Section,
        })
    } else {
        Some(Frame::Space)
    };
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

/// `Some(None)` where there is no key.
fn read_load_vector(table: &Table, key: &str, along: bool) -> Option<Option<LoadVector>> {
    let Some(item) = table.get(key) else { return Some(None) };
    let context = table.context;
    let linear = match item.get_ref() {
        DeValue::Array(rows) if rows.iter().any(|r| matches!(r.get_ref(), DeValue::Array(_))) => Some(rows),
        _ => None,
    };
    let Some(rows) = linear else {
        let vector = context.vector::<3>(item)?.value;
        return Some(Some(LoadVector { start: vector, end: vector }));
    };
    if !along {
        return context.wrong(item.span(), format!("`{key}` at a node is one vector; [start, end] belongs to `along`"));
    }
    if rows.len() != 2 {
        return context.wrong(
            item.span(),
            format!("`{key}` is a vector or [start vector, end vector], found {} rows", rows.len()),
        );
    }
    let rows: Vec<Option<[f64; 3]>> = rows.iter().map(|row| context.vector(row).map(|v| v.value)).collect();
    let [start, end]: [Option<[f64; 3]>; 2] = rows.try_into().ok()?;
    Some(Some(LoadVector { start: start?, end: end? }))
}

pub(super) fn read_initial<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Initial> {
    let table = Table::new(context, item, "[[initial]]", &["beam", "at", "velocity", "spin", "about"])?;
    let target = match (table.get("at"), table.get("beam")) {
        (Some(item), None) => context.text(item).map(InitialTarget::At),
        (None, Some(item)) => context.text(item).map(InitialTarget::Beam),
        (None, None) => Some(InitialTarget::All),
        (Some(_), Some(item)) => {
            context.wrong(item.span(), "[[initial]] speaks of a node (`at`) or of a `beam`, not both")
        }
    };
    if !table.has("velocity") && !table.has("spin") {
        context.report(Diagnostic::error("[[initial]] needs `velocity` or `spin`", table.span.clone()));
    }
    let vector = |key: &str| if table.has(key) { table.vector::<3>(key).map(|v| v.value) } else { Some([0.0; 3]) };
    let (velocity, spin) = (vector("velocity"), vector("spin"));
    let about = table.get("about").map_or(Some(None), |item| read_point(context, item).map(Some));
    Some(Initial { target: target?, velocity: velocity?, spin: spin?, about: about?, span: table.span.clone() })
}

pub(super) fn read_history<'a>(
    context: &'a Context,
    name: Spanned<String>,
    item: &'a Item<'a>,
) -> Option<HistoryTable> {
    let name = check_name(context, name)?;
    let what = format!("[history.{}]", name.value);
    let table = Table::new(context, item, what.clone(), &["times", "values", "smooth", "expr", "csv", "column"])?;
    if let Some(key) = ["csv", "column"].into_iter().find(|key| table.has(key)) {
        // Where the deck is a file, tables beside it stand in its text by now.
        return context.wrong(
            table.key_span(key),
            format!("`{key}` of {what} names a table that was not read: `csv = \"file.csv\"`"),
        );
    }
    if table.has("expr") {
        if let Some(key) = ["times", "values", "smooth"].into_iter().find(|key| table.has(key)) {
            return context.wrong(table.key_span(key), format!("{what} is `times` and `values`, or `expr`, not both"));
        }
        return read_history_expression(&table, name);
    }
    let times = table.required("times").and_then(|item| context.numbers(item, None));
    let values = table.required("values").and_then(|item| context.numbers(item, None));
    let smooth = if table.has("smooth") { table.flag("smooth")? } else { false };
    let (times, values) = (times?, values?);
    if times.value.is_empty() {
        return context.wrong(times.span, "`times` must not be empty");
    }
    if times.value.len() != values.value.len() {
        let message = format!("`times` has {} entries and `values` {}", times.value.len(), values.value.len());
        return context.wrong(values.span, message);
    }
    if let Some(pair) = times.value.windows(2).find(|pair| pair[1] <= pair[0]) {
        return context.wrong(times.span, format!("`times` must increase: {} follows {}", pair[1], pair[0]));
    }
    Some(HistoryTable { name, body: HistoryBody::Table { times: times.value, values: values.value, smooth } })
}

fn read_history_expression(table: &Table, name: Spanned<String>) -> Option<HistoryTable> {
    let context = table.context;
    let item = table.get("expr")?;
    let text = match item.get_ref() {
        DeValue::Integer(_) | DeValue::Float(_) => context.number(item)?.map(|v| v.to_string()),
        _ => context.text(item)?,
    };
    let expression = match Expression::parse(&text.value) {
        Ok(expression) => expression,
        Err(error) => {
            let at = text.span.start + 1 + error.offset;
            return context.wrong(at..at + 1, format!("in the expression `{}`: {}", text.value, error.message));
        }
    };
    let tried =
        expression.evaluate(&mut |name| if name == "t" { Some([0.0, 1.0, 0.0]) } else { context.parameters.get(name) });
    if let Err(error) = tried {
        if context.parameters.is_broken(&text.value) {
            return None;
        }
        let at = text.span.start + 1 + error.offset;
        return context.wrong(at..at + 1, format!("in the expression `{}`: {}", text.value, error.message));
    }
    Some(HistoryTable { name, body: HistoryBody::Expression(expression) })
}
