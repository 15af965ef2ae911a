//! What changes in a run besides the state: what loads and motions do in the present stage, and
//! what earlier stages have left of them.

use super::course::{Progress, StageStart, Timeline};
use super::stage_error::{Jump, StageError};
use super::{Charted, Model, Motion};
use crate::system::{Direction, DofMap, Plane, Slot, StageKind, State};
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// The angle by which a prescribed rotation may go in one step or load increment, in radians.
pub(super) const LARGEST_TURN: f64 = 0.75 * std::f64::consts::PI;

/// The part of a rotation vector along a held axis above which it has turned about it, in radians;
/// and the sine above which axes differ.
const NOT_ZERO: f64 = 1e-9;

/// What a step would turn too far, by an angle in radians.
#[derive(Clone, Debug, PartialEq)]
pub enum TooFar {
    /// The node with a rotation
    Node(Slot, f64),
    /// The surface with a name
    Surface(String, f64),
}

/// The courses of all loads and prescribed motions of a model. Plain data: with the state it is all
/// of a scene that changes in a run.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Schedule {
    stage: usize,
    kind: StageKind,
    /// By number of the amplitude
    loads: Vec<Progress>,
    /// By number of the motion
    motions: Vec<Progress>,
}

impl Schedule {
    /// Before the first stage.
    pub fn new(model: &Model) -> Self {
        Self {
            stage: 0,
            kind: StageKind::Static,
            loads: vec![Progress::default(); model.amplitudes.len()],
            motions: vec![Progress::default(); model.motions.len()],
        }
    }

    /// The kind of the present stage; static before the first one.
    pub fn kind(&self) -> StageKind {
        self.kind
    }

    /// The rotations and elements that have charts in the present stage.
    pub fn charted<'m>(&self, model: &'m Model) -> &'m Charted {
        model.charted(self.kind)
    }

    /// Settles the courses of a stage, and numbers the unknowns that are free in it.
    pub fn begin_stage(
        &mut self,
        model: &Model,
        stage: usize,
        kind: StageKind,
        state: &State,
    ) -> Result<DofMap, StageError> {
        if let Some(jump) = self.settle(model, stage, kind, state).into_iter().next() {
            return Err(StageError::Jump(jump));
        }
        self.refuse_turned_hinges(model, state)?;
        let plane = model.plane.filter(|plane| kind.advances_state() && model.keeps(state, plane));
        self.dof_map(model, plane)
    }

    /// Settles the courses of a stage; the motions that would have to jump.
    pub fn settle(&mut self, model: &Model, stage: usize, kind: StageKind, state: &State) -> Vec<Jump> {
        let fresh = self.has_fresh_loads(model, stage);
        let start = StageStart { number: stage, kind, time: state.time, fresh };
        (self.stage, self.kind) = (stage, kind);
        for (progress, amplitude) in self.loads.iter_mut().zip(&model.amplitudes) {
            progress.begin_stage(amplitude, &start);
        }
        let mut jumps = Vec::new();
        for (number, (progress, motion)) in self.motions.iter_mut().zip(&model.motions).enumerate() {
            let (from, aside) = motion.reached(state);
            progress.reached = from;
            progress.begin_stage(&motion.amplitude, &start);
            let timeline = Timeline::new(&motion.amplitude, progress);
            let [to, ..] = timeline.at(state.time, 0.0);
            let jumps_in_time = kind == StageKind::Dynamic && motion.is_apart(from, to, model.length);
            if timeline.acts() && (jumps_in_time || aside > NOT_ZERO) {
                jumps.push(Jump { motion: number, from, to });
            }
        }
        jumps
    }

    /// Remembers where the present stage has left the loads.
    pub fn end_stage(&mut self, model: &Model, state: &State) {
        for (progress, amplitude) in self.loads.iter_mut().zip(&model.amplitudes) {
            let [value, ..] = Timeline::new(amplitude, progress).at(state.time, state.load);
            progress.reached = value;
        }
    }

    /// Tells whether loads or motions without a history act for the first time in a stage that has
    /// not begun.
    pub fn has_fresh_loads(&self, model: &Model, stage: usize) -> bool {
        let loads = self.loads.iter().zip(&model.amplitudes);
        let motions = self.motions.iter().zip(model.motions.iter().map(|motion| &motion.amplitude));
        loads.chain(motions).any(|(progress, amplitude)| progress.is_fresh(amplitude, stage))
    }

    /// Tells whether neither a load nor a motion goes with the load factor in the present stage.
    pub fn is_idle(&self) -> bool {
        !self.loads.iter().chain(&self.motions).any(Progress::grows)
    }

    /// The course of the amplitude with this number.
    pub fn load<'a>(&'a self, model: &'a Model, number: usize) -> Timeline<'a> {
        Timeline::new(&model.amplitudes[number], &self.loads[number])
    }

    /// The course of the motion with this number.
    pub fn motion<'a>(&'a self, model: &'a Model, number: usize) -> Timeline<'a> {
        Timeline::new(&model.motions[number].amplitude, &self.motions[number])
    }

    /// The courses of all amplitudes.
    pub fn loads<'a>(&'a self, model: &'a Model) -> impl Iterator<Item = Timeline<'a>> {
        (0..self.loads.len()).map(|number| self.load(model, number))
    }

    /// All motions with their courses.
    pub fn motions<'a>(&'a self, model: &'a Model) -> impl Iterator<Item = (&'a Motion, Timeline<'a>)> {
        (0..self.motions.len()).map(|number| (&model.motions[number], self.motion(model, number)))
    }

    /// The unknowns that are free in the present stage, in a plane or in space.
    pub fn dof_map(&self, model: &Model, plane: Option<Plane>) -> Result<DofMap, StageError> {
        let held = self.held_directions(model);
        let numbered = match plane {
            None => DofMap::new(model.slots(), &held),
            Some(plane) => DofMap::planar(model.slots(), &held, plane, |slot| model.is_rotation(slot)),
        };
        numbered.map_err(StageError::Conflict)
    }

    /// One or two held components of a rotation vector survive a change of chart only where they
    /// are zero.
    pub fn refuse_turned_hinges(&self, model: &Model, state: &State) -> Result<(), StageError> {
        let mut held: HashMap<Slot, Vec<Vec3>> = HashMap::new();
        self.held_directions(model).iter().for_each(|d| held.entry(d.slot).or_default().push(d.axis));
        for &slot in &self.charted(model).rotations {
            let Some(axes) = held.get(&slot) else { continue };
            let turned = axes.iter().any(|axis| state.q[slot as usize].dot(*axis).abs() > NOT_ZERO);
            let spans = |axis: &Vec3| axes.iter().any(|held| held.dot(*axis).abs() > NOT_ZERO);
            if turned && !Vec3::UNIT.iter().all(spans) {
                return Err(StageError::TurnedHinge(slot));
            }
        }
        Ok(())
    }

    /// The first time behind `time` at which a load or a motion takes another course, or bends most.
    pub fn next_corner(&self, model: &Model, time: f64) -> Option<f64> {
        let timelines = self.loads(model).chain(self.motions(model).map(|(_, timeline)| timeline));
        timelines.filter_map(|timeline| timeline.next_corner(time)).min_by(f64::total_cmp)
    }

    /// Sets the clock and the load factor, the loads that belong to them, and the prescribed
    /// motions. Returns what turns too far at once.
    pub fn set_clock(&self, model: &Model, state: &mut State, time: f64, load: f64) -> Option<TooFar> {
        let before = state.amplitude.clone();
        (state.time, state.load) = (time, load);
        for (k, timeline) in self.loads(model).enumerate() {
            let [value, rate, rate2] = timeline.at(time, load);
            state.amplitude[k] = value;
            state.amplitude_rates[k] = [rate, rate2];
        }
        let turned_surface = model.contacts().and_then(|contacts| contacts.turned(&before, state));
        let mut too_far = turned_surface.map(|(surface, angle)| TooFar::Surface(surface.into(), angle));
        for turned in model.constraints().filter_map(|constraint| constraint.turned(&before, &state.amplitude)) {
            if turned.1 > LARGEST_TURN {
                too_far = Some(TooFar::Node(turned.0, turned.1));
            }
        }
        for (motion, timeline) in self.motions(model).filter(|(_, timeline)| timeline.acts()) {
            let angle = motion.impose(timeline.at(time, load), state);
            if angle > LARGEST_TURN {
                too_far = Some(TooFar::Node(motion.slot, angle));
            }
        }
        too_far
    }

    /// A state without the jumps that its prescribed velocities made after the time `from`; `None` where they made none.
    pub fn without_jumps(&self, model: &Model, state: &State, from: f64) -> Option<State> {
        let mut without = None;
        for (motion, timeline) in self.motions(model) {
            let jump = timeline.jumped(from, state.time);
            if jump != 0.0 {
                let [value, rate, rate2] = timeline.at(state.time, state.load);
                motion.impose([value, rate - jump, rate2], without.get_or_insert_with(|| state.clone()));
            }
        }
        without
    }

    fn held_directions(&self, model: &Model) -> Vec<Direction> {
        let supports = model.supports.iter().filter(|support| support.stages.contains(self.stage));
        let moved = self.motions(model).filter(|(_, timeline)| timeline.acts());
        // A prescribed rotation holds all of its node, so that what a joint about the same axis
        // holds is no question any more.
        let prescribed = moved.flat_map(|(motion, _)| motion.directions());
        prescribed.chain(supports.flat_map(|support| support.directions.clone())).collect()
    }
}
