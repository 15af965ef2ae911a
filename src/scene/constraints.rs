//! Supports and motions: from tables to held directions, and the clashes between them.

use super::compose::{DrivenTable, stage_set};
use super::joints::FoundJoint;
use super::mesh::Mesh;
use super::names;
use crate::deck::{self, Axes, Deck, Diagnostic, Expression, HistoryBody, HistoryUse, MotionWhat, Span};
use beamsim_core::effect::joint::FreeCoordinate;
use beamsim_core::model::{Amplitude, History, Motion, MotionKind, Reading, StageSet, Support, Table};
use beamsim_core::run::Driven;
use beamsim_core::system::{Direction, Node, Slot};
use beamsim_core::tensor::{Mat3, Vec3};
use std::collections::HashMap;
use std::sync::Arc;

/// Three directions as columns; the deck gives the first two.
pub fn axes(axes: Option<Axes>) -> Mat3 {
    let Some([a, b]) = axes else { return Mat3::IDENTITY };
    let a = Vec3(a);
    let b = Vec3(b);
    Mat3::from_columns(a, b, a.cross(b))
}

/// An expression of t as a history.
struct Formula {
    expression: Expression,
    parameters: deck::Parameters,
}

impl History for Formula {
    fn at(&self, x: f64) -> [f64; 3] {
        let value = self.expression.evaluate(&mut |name| {
            if name == "t" { Some([x, 1.0, 0.0]) } else { self.parameters.get(name) }
        });
        // Names were checked when the deck was read.
        value.unwrap_or([f64::NAN; 3])
    }
}

/// The histories of a deck by name.
pub fn histories(deck: &Deck) -> HashMap<String, Arc<dyn History>> {
    let one = |history: &deck::HistoryTable| {
        let function: Arc<dyn History> = match &history.body {
            HistoryBody::Table { times, values, smooth } => {
                Arc::new(Table { times: times.clone(), values: values.clone(), smooth: *smooth })
            }
            HistoryBody::Expression(expression) => {
                Arc::new(Formula { expression: expression.clone(), parameters: deck.parameters.clone() })
            }
        };
        (history.name.value.clone(), function)
    };
    deck.histories.iter().map(one).collect()
}

/// A held direction with the table it comes from.
struct Held {
    direction: Direction,
    stages: StageSet,
    span: Span,
    what: &'static str,
}

/// Supports and motions of a deck.
pub fn constraints(
    deck: &Deck,
    mesh: &Mesh,
    histories: &HashMap<String, Arc<dyn History>>,
    connections: &[FoundJoint],
    diagnostics: &mut Vec<Diagnostic>,
) -> SceneConstraints {
    let mut held = Vec::new();
    let mut supports = Vec::new();
    for support in &deck.supports {
        match mesh.find_node(deck, &support.at) {
            Ok((node, _)) => {
                let node = mesh.nodes[node].node;
                let directions = directions(support.fix, axes(support.axes), node.u, node.p);
                let stages = stage_set(support.stages.as_ref());
                note(&mut held, &directions, &stages, &support.span, "support");
                supports.push(Support { directions, stages });
            }
            Err(diagnostic) => diagnostics.push(diagnostic),
        }
    }
    let mut motions = Vec::new();
    let mut driven = Vec::new();
    let table = |number: usize, what: &'static str, span: &Span, history: Option<&HistoryUse>| DrivenTable {
        drives: Driven::Motion(number),
        what,
        span: span.clone(),
        history: history.cloned(),
    };
    for connection in connections.iter().filter(|connection| connection.is_support()) {
        let Some(node) = connection.nodes[1].map(|node| mesh.nodes[node].node) else { continue };
        let directions = directions(connection.joint.kind.ground.components, connection.axes, node.u, node.p);
        note(&mut held, &directions, &StageSet::default(), &connection.joint.span, "joint to ground");
        supports.push(Support { directions, stages: StageSet::default() });
        match ground_motor(deck, histories, connection, node) {
            Ok(None) => {}
            Ok(Some(motor)) => {
                let span = &connection.joint.span;
                let history = connection.joint.motor.as_ref().and_then(|motor| motor.history.as_ref());
                note(&mut held, &motor.directions(), motor.amplitude.stages(), span, "motion");
                driven.push(table(motions.len(), "motor", span, history));
                motions.push(motor);
            }
            Err(diagnostic) => diagnostics.push(diagnostic),
        }
    }
    for motion in &deck.motions {
        match read_motion(deck, mesh, histories, motion) {
            Ok(found) => {
                driven.push(table(motions.len(), "motion", &motion.span, motion.history.as_ref()));
                note(&mut held, &found.directions(), found.amplitude.stages(), &motion.span, "motion");
                motions.push(found);
            }
            Err(diagnostic) => diagnostics.push(diagnostic),
        }
    }
    refuse_clashes(deck, mesh, &held, diagnostics);
    SceneConstraints { supports, motions, driven }
}

/// The constraints of a scene on the unknowns of its nodes.
pub struct SceneConstraints {
    /// Supports
    pub(super) supports: Vec<Support>,
    /// Motions, and motors of joints to ground
    pub(super) motions: Vec<Motion>,
    /// The tables of the motions
    pub(super) driven: Vec<DrivenTable>,
}

/// The motor of a joint to ground is a prescribed motion of its node.
fn ground_motor(
    deck: &Deck,
    histories: &HashMap<String, Arc<dyn History>>,
    connection: &FoundJoint,
    node: Node,
) -> Result<Option<Motion>, Diagnostic> {
    let Some(motor) = &connection.joint.motor else { return Ok(None) };
    let history = find_history(deck, histories, motor.history.as_ref())?;
    let axis = connection.axes.column(0);
    let motion = |(kind, slot): (MotionKind, Slot)| {
        let amplitude = Amplitude::of_motion(motor.value, history, StageSet::default());
        Motion { kind, slot, axis, amplitude }
    };
    let driven = connection.joint.kind.driven.map(|coordinate| match coordinate {
        FreeCoordinate::Angle => (MotionKind::Rotation, node.p),
        FreeCoordinate::Slide => (MotionKind::Translation, node.u),
    });
    Ok(driven.map(motion))
}

/// The history that a table names.
pub fn find_history(
    deck: &Deck,
    histories: &HashMap<String, Arc<dyn History>>,
    named: Option<&HistoryUse>,
) -> Result<Option<Reading>, Diagnostic> {
    let Some(HistoryUse { name, stages }) = named else { return Ok(None) };
    match histories.get(&name.value) {
        Some(function) => Ok(Some(Reading::new(function.clone(), stage_set(stages.as_ref())))),
        None => Err(names::unknown("history", name, deck.histories.iter().map(|h| h.name.value.as_str()))),
    }
}

fn directions(fix: [bool; 6], axes: Mat3, u: Slot, p: Slot) -> Vec<Direction> {
    let one = |k: usize| Direction { slot: if k < 3 { u } else { p }, axis: axes.column(k % 3) };
    (0..6).filter(|&k| fix[k]).map(one).collect()
}

fn note(held: &mut Vec<Held>, directions: &[Direction], stages: &StageSet, span: &Span, what: &'static str) {
    let one = |&direction: &Direction| Held { direction, stages: stages.clone(), span: span.clone(), what };
    held.extend(directions.iter().map(one));
}

fn read_motion(
    deck: &Deck,
    mesh: &Mesh,
    histories: &HashMap<String, Arc<dyn History>>,
    motion: &deck::Motion,
) -> Result<Motion, Diagnostic> {
    let (node, _) = mesh.find_node(deck, &motion.at)?;
    let node = mesh.nodes[node].node;
    let history = find_history(deck, histories, motion.history.as_ref())?;
    let stages = stage_set(motion.stages.as_ref());
    Ok(match motion.what {
        MotionWhat::Displacement { direction, value } => {
            let axis = axes(motion.axes).column(direction);
            Motion {
                kind: MotionKind::Translation,
                slot: node.u,
                axis,
                amplitude: Amplitude::of_motion(value, history, stages),
            }
        }
        MotionWhat::Rotation { axis, angle } => {
            let Some(axis) = (axes(motion.axes) * Vec3(axis)).normalized() else {
                return Err(Diagnostic::error("`rotate` is an axis and must not be zero", motion.span.clone()));
            };
            Motion {
                kind: MotionKind::Rotation,
                slot: node.p,
                axis,
                amplitude: Amplitude::of_motion(angle, history, stages),
            }
        }
    })
}

/// Earlier tables hold all three directions of the slot, whenever this one holds its own.
fn spanned(earlier: &[Held], b: &Held) -> bool {
    let always = |a: &&Held| a.direction.slot == b.direction.slot && (a.stages.0.is_none() || a.stages == b.stages);
    let axes: Vec<Vec3> = earlier.iter().filter(always).map(|a| a.direction.axis).collect();
    axes.iter().any(|x| axes.iter().any(|y| axes.iter().any(|z| x.cross(*y).dot(*z).abs() > 1e-6)))
}

/// Directions at one node must be the same or orthogonal, and a motion needs its own.
fn refuse_clashes(deck: &Deck, mesh: &Mesh, held: &[Held], diagnostics: &mut Vec<Diagnostic>) {
    let meet = |a: &Held, b: &Held| (0..deck.stages.len().max(1)).any(|s| a.stages.contains(s) && b.stages.contains(s));
    let mut reported: Vec<(usize, usize)> = Vec::new();
    for (k, b) in held.iter().enumerate() {
        for a in held[..k].iter().filter(|a| a.direction.slot == b.direction.slot && a.span != b.span) {
            let cosine = a.direction.axis.dot(b.direction.axis).abs();
            let same = cosine > 1.0 - 1e-9;
            let moves = a.what == "motion" || b.what == "motion";
            // A skew direction says nothing new of a slot that is held altogether.
            let harmless = cosine <= 1e-9 || (!moves && (same || spanned(&held[..k], b)));
            let pair = (a.span.start, b.span.start);
            if harmless || !meet(a, b) || reported.contains(&pair) {
                continue;
            }
            reported.push(pair);
            let slot = b.direction.slot;
            let node = mesh
                .nodes
                .iter()
                .find(|n| n.node.u == slot || n.node.p == slot)
                .map_or("?".into(), |n| mesh.names.of(n.node.p));
            let how = if same { "the same direction" } else { "directions that are neither parallel nor orthogonal" };
            let message = format!("this {} and another {} both constrain {how} of node `{node}`", b.what, a.what);
            diagnostics.push(
                Diagnostic::error(message, b.span.clone()).context(a.span.clone(), format!("the other {}", a.what)),
            );
        }
    }
}
