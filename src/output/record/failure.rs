//! The failure of a run in run.json.

use crate::output::json::Number;
use crate::scene::Scene;
use beamsim_core::run::{Failure, Moment, Place};
use serde::Serialize;
use serde_json::Value;

/// A failure: its name and message, and the numbers that its kind has. It is only written: a record
/// that is read keeps the failure as it stands.
#[derive(Serialize)]
struct FailureRecord {
    name: String,
    message: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    hint: Option<String>,
    #[serde(flatten)]
    at: Option<MomentRecord>,
    #[serde(flatten)]
    place: Option<PlaceRecord>,
    #[serde(flatten)]
    numbers: Option<FailureNumbers>,
}

#[derive(Serialize)]
struct MomentRecord {
    stage: usize,
    time: Number,
    load: Number,
}

/// The unknown that a failure names.
#[derive(Serialize)]
struct PlaceRecord {
    node: String,
    direction: [Number; 3],
    unknown: String,
}

/// The numbers of the kinds of failures.
#[derive(Serialize)]
#[serde(untagged)]
enum FailureNumbers {
    NotConverged { residual: Number, force: Number, iterations: usize, residual_history: Vec<Number>, cutbacks: u64 },
    TurnsTooFar { node: String, angle: Number },
    SurfaceTurnsTooFar { surface: String, angle: Number },
    LimitPoint { goal: Number, arc_length_increments: u64, end: Number },
    StepTooSmall { error: Number, share: Number },
    Penetration { node: String, depth: Number },
    ContactStart { contact: String, surface: String, node: String, depth: Number },
    OfNode { node: String },
    NonFinite { effect: Option<String>, node: String },
    MeshTooCoarse { nodes: [String; 2], relative_rotation: Number },
    EnergyGrowth { grown: Number, largest: Number },
    Interrupted { signal: i32 },
}

/// A failure as JSON; texts and numbers cannot fail to be converted.
pub(super) fn failure_of(failure: &Failure, scene: &Scene) -> Option<Value> {
    let record = FailureRecord {
        name: failure.name().into(),
        message: failure.to_string(),
        hint: failure.hint(&scene.plan),
        at: moment_of(failure).map(MomentRecord::from),
        place: place_of(failure).map(PlaceRecord::from),
        numbers: numbers_of(failure),
    };
    serde_json::to_value(record).ok()
}

impl From<&Moment> for MomentRecord {
    fn from(at: &Moment) -> Self {
        Self { stage: at.stage, time: Number(at.time), load: Number(at.load) }
    }
}

impl From<&Place> for PlaceRecord {
    fn from(place: &Place) -> Self {
        Self {
            node: place.node.clone(),
            direction: place.direction.0.map(Number),
            unknown: format!("{:?}", place.kind).to_lowercase(),
        }
    }
}

fn moment_of(failure: &Failure) -> Option<&Moment> {
    match failure {
        Failure::NotConverged { at, .. }
        | Failure::TurnsTooFar { at, .. }
        | Failure::SurfaceTurnsTooFar { at, .. }
        | Failure::LimitPoint { at, .. }
        | Failure::StepTooSmall { at, .. }
        | Failure::Singular { at, .. }
        | Failure::Penetration { at, .. }
        | Failure::ContactStart { at, .. }
        | Failure::ContactPassed { at, .. }
        | Failure::SliderEnd { at, .. }
        | Failure::NonFinite { at, .. }
        | Failure::MeshTooCoarse { at, .. }
        | Failure::EnergyGrowth { at, .. }
        | Failure::Interrupted { at, .. } => Some(at),
        Failure::Deck(_) | Failure::Limit(_) | Failure::Io(_) => None,
    }
}

fn place_of(failure: &Failure) -> Option<&Place> {
    match failure {
        Failure::NotConverged { place, .. } | Failure::StepTooSmall { place, .. } => Some(place),
        Failure::Singular { place, .. } => place.as_ref(),
        Failure::TurnsTooFar { .. }
        | Failure::SurfaceTurnsTooFar { .. }
        | Failure::LimitPoint { .. }
        | Failure::Penetration { .. }
        | Failure::ContactStart { .. }
        | Failure::ContactPassed { .. }
        | Failure::SliderEnd { .. }
        | Failure::NonFinite { .. }
        | Failure::MeshTooCoarse { .. }
        | Failure::EnergyGrowth { .. }
        | Failure::Interrupted { .. }
        | Failure::Deck(_)
        | Failure::Limit(_)
        | Failure::Io(_) => None,
    }
}

fn numbers_of(failure: &Failure) -> Option<FailureNumbers> {
    let numbers = match failure {
        Failure::NotConverged { residual, force, history, tried, .. } => FailureNumbers::NotConverged {
            residual: Number(*residual),
            force: Number(*force),
            iterations: history.len().saturating_sub(1),
            residual_history: history.iter().copied().map(Number).collect(),
            cutbacks: tried.cutbacks,
        },
        Failure::TurnsTooFar { node, angle, .. } => {
            FailureNumbers::TurnsTooFar { node: node.clone(), angle: Number(*angle) }
        }
        Failure::SurfaceTurnsTooFar { surface, angle, .. } => {
            FailureNumbers::SurfaceTurnsTooFar { surface: surface.clone(), angle: Number(*angle) }
        }
        Failure::LimitPoint { goal, increments, end, .. } => FailureNumbers::LimitPoint {
            goal: Number(*goal),
            arc_length_increments: *increments,
            end: Number(end.load),
        },
        Failure::StepTooSmall { error, share, .. } => {
            FailureNumbers::StepTooSmall { error: Number(*error), share: Number(*share) }
        }
        Failure::Penetration { node, depth, .. } => {
            FailureNumbers::Penetration { node: node.clone(), depth: Number(*depth) }
        }
        Failure::ContactStart { contact, surface, node, depth, .. } => FailureNumbers::ContactStart {
            contact: contact.clone(),
            surface: surface.clone(),
            node: node.clone(),
            depth: Number(*depth),
        },
        Failure::ContactPassed { node, .. } | Failure::SliderEnd { node, .. } => {
            FailureNumbers::OfNode { node: node.clone() }
        }
        Failure::NonFinite { effect, node, .. } => {
            FailureNumbers::NonFinite { effect: effect.map(String::from), node: node.clone() }
        }
        Failure::MeshTooCoarse { nodes, relative_rotation, .. } => {
            FailureNumbers::MeshTooCoarse { nodes: nodes.clone(), relative_rotation: Number(*relative_rotation) }
        }
        Failure::EnergyGrowth { grown, largest, .. } => {
            FailureNumbers::EnergyGrowth { grown: Number(*grown), largest: Number(*largest) }
        }
        Failure::Interrupted { signal, .. } => FailureNumbers::Interrupted { signal: *signal },
        Failure::Singular { .. } | Failure::Deck(_) | Failure::Limit(_) | Failure::Io(_) => return None,
    };
    Some(numbers)
}
