//! What acts on the state instead of the forces: supports and prescribed motions.

use super::course::Amplitude;
use crate::system::{Direction, MirrorData, Slot, StageSet, State};
use crate::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

/// Directions of a node that are held where a stage finds them.
#[derive(Clone, Debug)]
pub struct Support {
    /// The held directions
    pub directions: Vec<Direction>,
    /// When it is there
    pub stages: StageSet,
}

impl Support {
    /// Shows the directions that it holds at each slot, which decide whether the scene lies in a
    /// plane.
    pub fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        for at_slot in self.directions.chunk_by(|a, b| a.slot == b.slot) {
            let held = at_slot.iter().fold(Mat3::ZERO, |sum, direction| sum + direction.axis.outer(direction.axis));
            show(MirrorData::Tensor(held));
        }
    }
}

/// The unknowns that a motion prescribes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionKind {
    /// The displacement along an axis
    Translation,
    /// The whole rotation, about a fixed axis
    Rotation,
}

/// A prescribed motion.
#[derive(Clone)]
pub struct Motion {
    /// The unknowns that it prescribes
    pub kind: MotionKind,
    /// The slot it moves
    pub slot: Slot,
    /// Unit vector: direction or axis of rotation
    pub axis: Vec3,
    /// Displacement or angle over the stages
    pub amplitude: Amplitude,
}

impl Motion {
    /// Where the node is along the axis, and how far its rotation is off the axis.
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

    /// Tells whether two positions differ, on the scale of a scene of this `length`.
    pub fn is_apart(&self, from: f64, to: f64, length: f64) -> bool {
        let scale = if self.kind == MotionKind::Translation { length } else { 1.0 };
        (to - from).abs() > 1e-9 * scale
    }

    /// The vector that decides whether the scene lies in a plane.
    pub fn aspect(&self) -> MirrorData {
        let full = self.amplitude.full();
        match self.kind {
            MotionKind::Translation if full == 0.0 => MirrorData::Line(self.axis),
            MotionKind::Translation => MirrorData::Vector(self.axis),
            MotionKind::Rotation => MirrorData::Axial(self.axis * full),
        }
    }

    /// The directions that it prescribes.
    pub fn directions(&self) -> Vec<Direction> {
        match self.kind {
            MotionKind::Translation => vec![Direction { slot: self.slot, axis: self.axis }],
            MotionKind::Rotation => Vec3::UNIT.map(|axis| Direction { slot: self.slot, axis }).to_vec(),
        }
    }

    /// Sets position, velocity and acceleration in a state, from the value and its two derivatives
    /// over time. A rotation about n is P = theta n, Pd = theta' n, Pdd = theta'' n, with theta at
    /// the representative nearest to the present chart; an increment is what theta has grown by,
    /// and the spin theta' n.
    ///
    /// Returns how far it turns the node from the last converged state: beyond half a turn nobody
    /// could tell in which direction it went.
    pub(super) fn impose(&self, [value, rate, rate2]: [f64; 3], state: &mut State) -> f64 {
        let (slot, n) = (self.slot as usize, self.axis);
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
