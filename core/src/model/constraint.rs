//! What acts on the state instead of the forces: supports and prescribed motions.

use super::amplitude::Goal;
use super::history::Reading;
use crate::system::{Direction, MirrorData, Slot, State};
use crate::system::{StageKind, StageSet};
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
    /// What of it decides whether the scene lies in a plane: the directions that it holds at each slot.
    pub fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        for at_slot in self.directions.chunk_by(|a, b| a.slot == b.slot) {
            let held = at_slot.iter().fold(Mat3::ZERO, |sum, direction| sum + direction.axis.outer(direction.axis));
            show(MirrorData::Tensor(held));
        }
    }
}

/// What a motion prescribes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionKind {
    /// The displacement along an axis
    Translation,
    /// The whole rotation, about a fixed axis
    Rotation,
}

/// A prescribed motion: value (length or angle) times its course.
#[derive(Clone)]
pub struct Motion {
    /// What it prescribes
    pub kind: MotionKind,
    /// The slot it moves
    pub slot: Slot,
    /// Unit vector: direction or axis of rotation
    pub axis: Vec3,
    /// Displacement or angle that the history multiplies
    pub value: f64,
    /// Its history; without one it goes with the load factor.
    pub history: Option<Reading>,
    /// When it acts
    pub stages: StageSet,
    /// Present course
    course: Course,
    has_acted: bool,
    /// The last ramp that went anywhere, over the load factor
    grown: Option<(f64, f64)>,
}

#[derive(Clone, Copy, Debug)]
enum Course {
    Off,
    Hold(f64),
    Ramp { from: f64, to: f64 },
    History(StageKind),
}

/// A motion that would have to jump when a stage begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Jump {
    /// The number of the motion in the deck
    pub motion: usize,
    /// Where the node is
    pub from: f64,
    /// Where the motion begins
    pub to: f64,
}

impl Motion {
    /// A motion before the first stage.
    pub fn new(
        kind: MotionKind,
        slot: Slot,
        axis: Vec3,
        value: f64,
        history: Option<Reading>,
        stages: StageSet,
    ) -> Self {
        Self { kind, slot, axis, value, history, stages, course: Course::Off, has_acted: false, grown: None }
    }

    /// Settles what it does in stage number `stage`; `Err` where it would have to jump (from, to).
    pub fn begin_stage(
        &mut self,
        stage: usize,
        kind: StageKind,
        state: &State,
        length: f64,
        fresh: bool,
    ) -> Result<(), (f64, f64)> {
        let (from, aside) = self.reached(state);
        let grows = self.is_fresh(stage);
        self.history.iter_mut().for_each(|history| history.begin_stage(stage, kind, state.time));
        if !self.stages.contains(stage) {
            self.course = Course::Off;
            return Ok(());
        }
        let goal = Goal::of(self.history.as_ref(), stage);
        let to = |factor: f64| self.value * factor;
        self.course = match (kind, goal) {
            (StageKind::Modal, _) | (_, Goal::Stay) => Course::Hold(from),
            (StageKind::Buckling, goal) => match (fresh, grows, goal) {
                (true, true, Goal::Value(factor)) => Course::Ramp { from, to: to(factor) },
                (false, ..) => self.grown.map_or(Course::Hold(from), |(from, to)| Course::Ramp { from, to }),
                _ => Course::Hold(from),
            },
            (kind, Goal::History) => Course::History(kind),
            (StageKind::Static, Goal::Value(factor)) => Course::Ramp { from, to: to(factor) },
            (StageKind::Dynamic, Goal::Value(_)) if self.has_acted => Course::Hold(from),
            (StageKind::Dynamic, Goal::Value(factor)) => Course::Hold(to(factor)),
        };
        // A modal stage only looks.
        self.has_acted |= kind != StageKind::Modal;
        if let Course::Ramp { from, to } = self.course
            && from != to
        {
            self.grown = Some((from, to));
        }
        let to = self.start(state.time);
        if (kind == StageKind::Dynamic && self.is_apart(from, to, length)) || aside > 1e-9 {
            Err((from, to))
        } else {
            Ok(())
        }
    }

    /// Where it puts its node at the start of the present stage.
    pub fn start(&self, time: f64) -> f64 {
        self.at(time, 0.0)[0]
    }

    /// Whether two positions are different ones, on the scale of a scene of this `length`.
    pub fn is_apart(&self, from: f64, to: f64, length: f64) -> bool {
        let scale = if self.kind == MotionKind::Translation { length } else { 1.0 };
        (to - from).abs() > 1e-9 * scale
    }

    /// Whether it would move for the first time in a static stage with this number.
    pub fn is_fresh(&self, stage: usize) -> bool {
        let grows = matches!(Goal::of(self.history.as_ref(), stage), Goal::Value(factor) if factor != 0.0);
        self.stages.contains(stage) && !self.has_acted && grows
    }

    /// Whether it goes with the load factor in the present stage.
    pub fn grows(&self) -> bool {
        matches!(self.course, Course::Ramp { from, to } if from != to)
    }

    /// Whether it follows a history in the present stage.
    pub fn follows_history(&self) -> bool {
        matches!(self.course, Course::History(_))
    }

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

    /// Whether it acts in the present stage.
    pub fn acts(&self) -> bool {
        !matches!(self.course, Course::Off)
    }

    /// What of it decides whether the scene lies in a plane.
    pub fn aspect(&self) -> MirrorData {
        match self.kind {
            MotionKind::Translation if self.value == 0.0 => MirrorData::Line(self.axis),
            MotionKind::Translation => MirrorData::Vector(self.axis),
            MotionKind::Rotation => MirrorData::Axial(self.axis * self.value),
        }
    }

    /// The directions that it prescribes.
    pub fn directions(&self) -> Vec<Direction> {
        match self.kind {
            MotionKind::Translation => vec![Direction { slot: self.slot, axis: self.axis }],
            MotionKind::Rotation => Vec3::UNIT.map(|axis| Direction { slot: self.slot, axis }).to_vec(),
        }
    }

    /// The first time behind `time` at which it takes another course.
    pub fn next_corner(&self, time: f64) -> Option<f64> {
        match self.course {
            Course::History(StageKind::Dynamic) => self.history.as_ref()?.next_corner(time),
            _ => None,
        }
    }

    /// The first time behind `time` at which its velocity jumps.
    pub fn next_kink(&self, time: f64) -> Option<f64> {
        match self.course {
            Course::History(StageKind::Dynamic) => self.history.as_ref()?.next_kink(time),
            _ => None,
        }
    }

    /// Its velocity just before `time`.
    pub fn velocity_before(&self, time: f64) -> f64 {
        match (self.course, &self.history) {
            (Course::History(StageKind::Dynamic), Some(history)) => self.value * history.slope_before(time),
            _ => 0.0,
        }
    }

    /// Value and two derivatives over time.
    pub fn at(&self, time: f64, load: f64) -> [f64; 3] {
        match self.course {
            Course::Off => [0.0; 3],
            Course::Hold(value) => [value, 0.0, 0.0],
            Course::Ramp { from, to } => [from + (to - from) * load, 0.0, 0.0],
            Course::History(kind) => {
                let history = self.history.as_ref().map_or([1.0, 0.0, 0.0], |h| h.at(kind, time, load));
                history.map(|factor| self.value * factor)
            }
        }
    }

    /// Sets position, velocity and acceleration in the state at its time and load. A rotation about n is P = theta n,
    /// Pd = theta' n, Pdd = theta'' n, with theta at the representative nearest to the present chart; an increment is what
    /// theta has grown by, and the spin theta' n.
    ///
    /// Returns how far it turns the node from the last converged state: beyond half a turn nobody could tell in which
    /// direction it went.
    pub fn impose(&self, state: &mut State) -> f64 {
        if !self.acts() {
            return 0.0;
        }
        let [value, rate, rate2] = self.at(state.time, state.load);
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
                let (turned, end) = (value - state.unwrapped_at(self.slot).dot(n), n * value);
                state.q[slot] = if state.turn(self.slot).is_some() {
                    n * turned
                } else {
                    let turns = ((state.q[slot].dot(n) - value) / (2.0 * PI)).round();
                    n * (value + 2.0 * PI * turns)
                };
                state.v.put(slot, n * rate);
                state.a.put(slot, n * rate2);
                if !state.unwrapped.is_empty() || state.q[slot] != end {
                    state.wound_apart()[slot] = end;
                }
                turned.abs()
            }
        }
    }
}
