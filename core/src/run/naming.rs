//! Failures of a stage, named with their moment and their node.

use super::failure::{Attempts, Failure, Place};
use super::refusal::{refusal, refusal_help};
use super::stage_run::StageRun;
use crate::model::{Model, SlotKind, StageError};
use crate::solve::{NewtonFailure, NullVector};
use crate::system::{Slot, System};
use crate::tensor::Vec3;

/// Why a stage (from 0) cannot begin, with what helps.
pub(super) fn describe(error: StageError, model: &Model, number: usize) -> Failure {
    let message = format!("stage {}: {}", number + 1, refusal(&error, model));
    let help = refusal_help(&error, model, number);
    Failure::Deck(help.map_or(message.clone(), |help| format!("{message}; {help}")))
}

impl StageRun<'_> {
    /// Names what Newton ended with.
    pub fn name_failure(&self, failure: NewtonFailure, system: &System) -> Failure {
        let at = self.moment();
        match failure {
            NewtonFailure::NotConverged { residual, history } => Failure::NotConverged {
                at,
                place: Place::of(self.model, residual.slot as usize, residual.value),
                residual: residual.value.norm(),
                force: residual.force,
                history,
                tried: Attempts {
                    cutbacks: self.counters.cutbacks - self.cutbacks_before,
                    soft: self.soft,
                    touches: self.good.contacts.touches(),
                    beams_touch: !self.good.contacts.pairs.points.is_empty(),
                    curved: self.charted.elements.iter().any(|element| element.rotations().len() > 2),
                    may_touch: self.model.contacts().is_some(),
                },
            },
            NewtonFailure::StepTooSmall { slot, error, share } => {
                Failure::StepTooSmall { at, place: Place::of(self.model, slot, Vec3::ZERO), error, share }
            }
            NewtonFailure::Singular(vector) => self.name_mechanism(vector, system),
            NewtonFailure::TurnsTooFar { slot, angle } => {
                Failure::TurnsTooFar { at, node: self.model.node_at(slot), angle }
            }
            NewtonFailure::SurfaceTurnsTooFar { surface, angle } => Failure::SurfaceTurnsTooFar { at, surface, angle },
            NewtonFailure::LeapsTooFar { element, angle } => self.name_coarse(element, angle),
            NewtonFailure::Penetrates { slot, depth } => {
                Failure::Penetration { at, node: self.model.node_at(slot), depth }
            }
            NewtonFailure::Leaves { slot } => Failure::SliderEnd { at, node: self.model.node_at(slot) },
            NewtonFailure::Passes { slot } => Failure::ContactPassed { at, node: self.model.node_at(slot) },
            NewtonFailure::NotFinite { effect, slot } => {
                Failure::NonFinite { at, effect, node: self.model.node_at(slot) }
            }
            NewtonFailure::Interrupted(signal) => Failure::Interrupted { at, signal },
        }
    }

    /// Names the node and the direction that move most in a motion without stiffness.
    pub fn name_mechanism(&self, vector: Option<NullVector>, system: &System) -> Failure {
        let at = self.moment();
        Failure::Singular { at, place: vector.map(|vector| self.place_of(&vector, system)) }
    }

    /// Where a motion moves most, in spatial axes: increments of a rotation vector turn about R T dP.
    pub fn place_of(&self, vector: &NullVector, system: &System) -> Place {
        let (largest, motion) = vector.by_slot(&system.pattern.dof_map, self.model.slots());
        let moved = motion[largest];
        let direction = match self.model.kinds[largest] {
            SlotKind::Rotation => {
                let rotation = self.state.rotation(largest as Slot);
                rotation.r * (rotation.t * moved)
            }
            SlotKind::Displacement | SlotKind::Force | SlotKind::Moment | SlotKind::Sliding => moved,
        };
        Place::of(self.model, largest, direction)
    }

    /// Why the stage cannot go on.
    pub fn describe(&self, error: StageError) -> Failure {
        describe(error, self.model, self.number)
    }

    pub fn name_coarse(&self, element: usize, angle: f64) -> Failure {
        let rotations = self.charted.elements[element].rotations();
        let names = [rotations[0], rotations[rotations.len() - 1]].map(|slot| self.model.node_at(slot as usize));
        Failure::MeshTooCoarse { at: self.moment(), nodes: names, relative_rotation: angle }
    }
}
