//! Constraints on the unknowns of a state: supports and prescribed motions.

use super::course::Amplitude;
use crate::system::{Direction, MirrorData, Slot, StageSet, State};
use crate::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

/// Directions of a node that are held at their values at the start of a stage.
#[derive(Clone, Debug)]
pub struct Support {
    /// The held directions
    pub directions: Vec<Direction>,
    /// The stages in which it acts
    pub stages: StageSet,
}

impl Support {
    /// Shows the tensor of held directions at each slot, by which the scene may lie in a plane.
    pub fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        for at_slot in self.directions.chunk_by(|a, b| a.slot == b.slot) {
            let held = at_slot.iter().fold(Mat3::ZERO, |sum, direction| sum + direction.axis.outer(direction.axis));
            show(MirrorData::Tensor(held));
        }
    }
}

/// The tolerance of equal positions: in radians, or over the length of the scene.
const EQUAL_POSITIONS: f64 = 1e-9;

/// The kinds of prescribed motions, by their unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionKind {
    /// The displacement along an axis
    Translation,
    /// The whole rotation vector, along a fixed axis
    Rotation,
}

/// A prescribed motion of a node.
#[derive(Clone)]
pub struct Motion {
    /// The unknowns that it prescribes
    pub kind: MotionKind,
    /// The slot of the prescribed unknowns
    pub slot: Slot,
    /// Direction or axis of rotation, a unit vector
    pub axis: Vec3,
    /// The displacement or the angle, over the stages
    pub amplitude: Amplitude,
}

impl Motion {
    /// The present displacement or angle along the axis, and the distance of a rotation vector from
    /// the axis.
    pub fn reached(&self, state: &State) -> (f64, f64) {
        let slot = self.slot as usize;
        match self.kind {
            MotionKind::Translation => (state.q[slot].dot(self.axis), 0.0),
            MotionKind::Rotation => {
                let unwrapped = state.unwrapped_at(self.slot);
                let along = unwrapped.dot(self.axis);
                (along, (unwrapped - self.axis * along).norm())
            }
        }
    }

    /// True if two displacements or angles differ by more than round-off, in a scene of this
    /// `length`.
    pub fn is_apart(&self, from: f64, to: f64, length: f64) -> bool {
        let scale = if self.kind == MotionKind::Translation { length } else { 1.0 };
        (to - from).abs() > EQUAL_POSITIONS * scale
    }

    /// The mirror data of the motion, by which the scene may lie in a plane.
    pub fn aspect(&self) -> MirrorData {
        let full = self.amplitude.full();
        match self.kind {
            MotionKind::Translation if full == 0.0 => MirrorData::Line(self.axis),
            MotionKind::Translation => MirrorData::Vector(self.axis),
            MotionKind::Rotation => MirrorData::Axial(self.axis * full),
        }
    }

    /// The prescribed directions.
    pub fn directions(&self) -> Vec<Direction> {
        match self.kind {
            MotionKind::Translation => vec![Direction { slot: self.slot, axis: self.axis }],
            MotionKind::Rotation => Vec3::UNIT.map(|axis| Direction { slot: self.slot, axis }).to_vec(),
        }
    }

    /// Sets position, velocity and acceleration in a state, from the value and its two derivatives
    /// over time. A rotation about n is P = theta n, Pd = theta' n, Pdd = theta'' n, with theta at
    /// the representative nearest to the present chart; where the unknown is an increment, it is
    /// the change of theta times n, and the spin is theta' n.
    ///
    /// Returns the angle by which it turns the node from the last converged state, in radians:
    /// beyond half a turn the direction is ambiguous.
    pub(super) fn impose(&self, [value, rate, rate2]: [f64; 3], state: &mut State) -> f64 {
        let slot = self.slot as usize;
        let n = self.axis;
        match self.kind {
            MotionKind::Translation => {
                let replaced = |old: Vec3, value: f64| old + n * (value - old.dot(n));
                state.q[slot] = replaced(state.q[slot], value);
                state.v.put(slot, replaced(state.v[slot], rate));
                state.a.put(slot, replaced(state.a[slot], rate2));
                0.0
            }
            MotionKind::Rotation => {
                let turned = value - state.unwrapped_at(self.slot).dot(n);
                let end = n * value;
                state.q[slot] = if state.turn(self.slot).is_some() {
                    n * turned
                } else {
                    let turns = ((state.q[slot].dot(n) - value) / (2.0 * PI)).round();
                    n * (value + 2.0 * PI * turns)
                };
                state.v.put(slot, n * rate);
                state.a.put(slot, n * rate2);
                if !state.unwrapped.is_empty() || state.q[slot] != end {
                    state.unwrapped_mut()[slot] = end;
                }
                turned.abs()
            }
        }
    }
}
