//! The scene as mechanics sees it: unknowns, elements, effects, constraints, loads.

mod amplitude;
mod assembly;
pub mod charts;
mod constraint;
mod effect_size;
mod history;
mod linear;
mod names;

pub use crate::system::{StageContext, StageKind, StageSet};
pub use amplitude::Amplitude;
pub use assembly::Assembly;
pub use constraint::{Jump, Motion, MotionKind, Support};
pub use effect_size::EffectSize;
pub use history::{History, NOTICED, Reading, Table};
pub use names::Names;

use crate::effect::joint::nearest_angle;
use crate::effect::{Effect, Energy, Momentum, MotorState};
use crate::kernel::MAX_NODES;
use crate::system::{
    Category, Direction, DofMap, FrameConflict, Layout, MirrorData, Node, NodeBlocks, Plane, Slot, State, System,
    most_regions,
};
use crate::tensor::Vec3;
use crate::threads;
use std::collections::HashMap;
use std::sync::Arc;

/// A prescribed rotation may go this far in one step or load increment.
const LARGEST_TURN: f64 = 0.75 * std::f64::consts::PI;

/// A state that is out of a plane by less, relative to the largest motion, is in it: a stage before that ran in space leaves round-off of
/// a few thousand steps. What is left aside is dropped, a hundredth of what planar and spatial answers may differ by.
const OUT_OF_PLANE: f64 = 1e-12;

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlotKind {
    /// A displacement
    Displacement,
    /// A rotation vector
    Rotation,
    /// Multipliers of gaps that are lengths: forces
    Force,
    /// Multipliers of gaps between directions: moments
    Moment,
}

impl SlotKind {
    /// All of them, in their order
    pub const ALL: [Self; 4] = [Self::Displacement, Self::Rotation, Self::Force, Self::Moment];

    /// Whether it is one of multipliers: no unknowns of motion, and what stands in the place of forces are gaps.
    pub fn is_multiplier(self) -> bool {
        matches!(self, Self::Force | Self::Moment)
    }

    /// What turns the forces of such a slot into forces that compare: a length for moments, 1 for forces.
    pub fn arm(self, length: f64) -> f64 {
        if self == Self::Rotation { length } else { 1.0 }
    }

    /// What the unknowns of such a slot are compared with: a length for displacements, 1 for rotations.
    pub fn scale(self, length: f64) -> f64 {
        if self == Self::Displacement { length } else { 1.0 }
    }
}

/// A beam element as changes of chart and the judgement of the mesh see it.
#[derive(Clone, Debug)]
pub struct ElementInfo {
    all: [Slot; MAX_NODES],
    count: u8,
    /// Whether it interpolates total rotation vectors, so that all of them must be taken in one chart
    pub in_one_chart: bool,
}

impl ElementInfo {
    /// An element of nodes with these rotation vectors, at most [`MAX_NODES`].
    pub fn new(rotations: impl ExactSizeIterator<Item = Slot>, in_one_chart: bool) -> Self {
        let (mut all, count) = ([0; MAX_NODES], rotations.len() as u8);
        all.iter_mut().zip(rotations).for_each(|(place, slot)| *place = slot);
        Self { all, count, in_one_chart }
    }

    /// The rotation vectors of its nodes
    #[inline]
    pub fn rotations(&self) -> &[Slot] {
        &self.all[..usize::from(self.count)]
    }
}

/// The rotation vectors that have charts, and the elements that join them.
#[derive(Clone, Debug, Default)]
pub struct Charted {
    /// The slots of rotation vectors, in their order
    pub rotations: Vec<Slot>,
    /// The beam elements
    pub elements: Vec<ElementInfo>,
}

/// An immutable scene; only the courses of amplitudes and motions change from stage to stage.
#[derive(Clone)]
pub struct Model {
    /// What each slot holds
    pub kinds: Arc<Vec<SlotKind>>,
    /// And the node that it is named after
    pub names: Arc<Names>,
    /// The slots with multipliers
    pub multipliers: Vec<Slot>,
    /// How many joints remember their angle
    pub angles: usize,
    /// The slots on which rotational springs act: their unwrapped rotation vectors must be known
    pub sprung: Vec<Slot>,
    /// Those of the two sides of each joint that remembers its angle
    pub sprung_joints: Vec<[Option<Slot>; 2]>,
    /// How many beam elements there are
    pub elements: usize,
    /// What large rotations ask for
    pub rotating: Arc<Charted>,
    /// The same in the present stage: nothing where that is linear
    pub charted: Arc<Charted>,
    /// What acts
    pub effects: Vec<Arc<dyn Effect>>,
    /// The factors of loads and springs
    pub amplitudes: Vec<Amplitude>,
    /// Supports
    pub supports: Vec<Support>,
    /// Prescribed motions
    pub motions: Vec<Motion>,
    /// The plane that the scene lies in, where it is treated in one
    pub plane: Option<Plane>,
    /// Whether static and dynamic stages are linear in the displacements
    pub linear: bool,
    /// The length to which displacements are compared: the diagonal of the scene's box, or 1
    pub length: f64,
}

/// Why a stage cannot begin.
#[derive(Clone, Debug, PartialEq)]
pub enum StageError {
    /// Two constraints on one node are neither the same nor orthogonal.
    Conflict(FrameConflict),
    /// A motion would have to jump.
    Jump(Jump),
    /// A support would hold single components of a rotation that is not zero there.
    TurnedHinge(Slot),
    /// A motor would have to jump.
    MotorJump(MotorJump),
    /// A path or a search for critical loads, and nothing goes with the load factor.
    NothingGrows(StageKind),
    /// A search for modes, and nothing that is free to move has mass.
    NoMass,
}

/// A motor that would have to jump when a dynamic stage begins.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorJump {
    /// The slot of its multiplier
    pub slot: Slot,
    /// The number of its amplitude
    pub amplitude: usize,
    /// Whether it turns, or slides
    pub turns: bool,
    /// The angle or displacement that it has reached
    pub from: f64,
    /// Where it begins
    pub to: f64,
}

/// What a motor may jump by when a dynamic stage begins, in radians or relative to the scene's length.
pub const LARGEST_GAP: f64 = 1e-6;

impl Model {
    /// The number of slots.
    pub fn slots(&self) -> usize {
        self.kinds.len()
    }

    /// The name of the node of a slot, for messages.
    pub fn node_at(&self, slot: usize) -> String {
        self.names.of(slot as Slot)
    }

    /// The state before the first stage.
    pub fn rest(&self) -> State {
        State::rest(self.slots(), self.elements, self.amplitudes.len(), self.angles)
    }

    /// The inner product of two motions, displacements over the length of the scene.
    pub fn inner_product(
        &self,
        slots: usize,
        a: impl Fn(usize) -> Vec3 + Send + Sync,
        b: impl Fn(usize) -> Vec3 + Send + Sync,
    ) -> f64 {
        let [displacements, rotations, ..] = threads::sums(slots, |part| {
            let mut sums = [0.0; SlotKind::ALL.len()];
            for slot in part {
                sums[self.kinds[slot] as usize] += a(slot).dot(b(slot));
            }
            sums
        });
        rotations + displacements / self.length.powi(2)
    }

    /// Settles the courses of loads and motions, and numbers the unknowns that are free in this stage.
    pub fn begin_stage(&mut self, stage: usize, kind: StageKind, state: &State) -> Result<DofMap, StageError> {
        if let Some(jump) = self.settle(stage, kind, state).into_iter().next() {
            return Err(StageError::Jump(jump));
        }
        let plane = self.plane.filter(|plane| kind.advances_state() && self.keeps(state, plane));
        self.refuse_turned_hinges(stage, state)?;
        self.number(stage, plane)
    }

    /// Settles the courses of loads and motions; the motions that would have to jump.
    pub fn settle(&mut self, stage: usize, kind: StageKind, state: &State) -> Vec<Jump> {
        let fresh = self.has_fresh_loads(stage);
        self.charted = if self.is_linear(kind) { Arc::default() } else { self.rotating.clone() };
        self.amplitudes.iter_mut().for_each(|amplitude| amplitude.begin_stage(stage, kind, state.time, fresh));
        let mut jumps = Vec::new();
        for (number, motion) in self.motions.iter_mut().enumerate() {
            let begun = motion.begin_stage(stage, kind, state, self.length, fresh);
            jumps.extend(begun.err().map(|(from, to)| Jump { motion: number, from, to }));
        }
        jumps
    }

    /// Whether neither a load nor a motion goes with the load factor in the present stage.
    pub fn is_idle(&self) -> bool {
        !self.amplitudes.iter().any(Amplitude::grows) && !self.motions.iter().any(Motion::grows)
    }

    /// Whether no mass of a stage sits where something is free to move.
    pub fn lacks_mass(&self, stage: &StageContext, dof_map: &DofMap) -> bool {
        let is_free = |&slot: &Slot| dof_map.of(slot).iter().any(|&number| number != DofMap::HELD);
        let effects = self.effects.iter().filter(|effect| effect.category() == Category::Inertia && effect.acts(stage));
        !effects.into_iter().any(|effect| effect.connectivity().iter().flatten().any(is_free))
    }

    /// The motors of joints that a change of amplitudes moves by more than a joint may be open.
    pub fn motor_jumps(&self, from: &[f64], state: &State) -> Vec<MotorJump> {
        let mut jumps = Vec::new();
        self.each_motor(state, &mut |motor| {
            let [from, to] = [from, &state.amplitude].map(|amplitudes| motor.value * amplitudes[motor.amplitude]);
            let (gap, size) = match motor.turns {
                true => (nearest_angle(to - from), 1.0),
                false => (to - from, self.length),
            };
            if gap.abs() > LARGEST_GAP * size {
                let MotorState { slot, amplitude, turns, .. } = motor;
                jumps.push(MotorJump { slot, amplitude, turns, from, to });
            }
        });
        jumps
    }

    /// Shows the motors of joints.
    pub fn each_motor(&self, state: &State, show: &mut dyn FnMut(MotorState)) {
        self.effects.iter().for_each(|effect| effect.motors(state, show));
    }

    /// Whether stages of a kind are linear in the displacements.
    pub fn is_linear(&self, kind: StageKind) -> bool {
        self.linear && kind.advances_state()
    }

    /// The unknowns that are free in a stage that has begun, in a plane or in space.
    pub fn number(&self, stage: usize, plane: Option<Plane>) -> Result<DofMap, StageError> {
        let (slots, held) = (self.slots(), self.held_directions(stage));
        let turns = |slot: Slot| self.kinds[slot as usize] == SlotKind::Rotation;
        let numbered = match plane {
            None => DofMap::new(slots, &held),
            Some(plane) => DofMap::planar(slots, &held, plane, turns),
        };
        numbered.map_err(StageError::Conflict)
    }

    /// Shows what decides whether the scene lies in a plane, each with a name.
    pub fn mirror_data(&self, show: &mut dyn FnMut(&'static str, MirrorData)) {
        for effect in &self.effects {
            effect.mirror_data(&mut |aspect| show(effect.name(), aspect));
        }
        self.supports.iter().for_each(|support| support.mirror_data(&mut |aspect| show("supports", aspect)));
        self.motions.iter().for_each(|motion| show("motions", motion.aspect()));
    }

    /// Takes out of a state what round-off has put aside of its plane: nothing else would, and it grows from step to step.
    pub fn flatten(&self, plane: &Plane, state: &mut State) {
        if !plane.is_tilted() {
            return;
        }
        let normal = plane.normal();
        let flatten = |field: &mut [Vec3]| {
            for (kind, value) in self.kinds.iter().zip(field) {
                let aside = normal * value.dot(normal);
                *value = if *kind == SlotKind::Rotation { aside } else { *value - aside };
            }
        };
        let moves = state.moves();
        flatten(&mut state.q);
        if moves {
            [&mut state.v, &mut state.a, &mut state.algorithmic].into_iter().for_each(|rates| flatten(rates));
        }
    }

    /// Whether a state lies in a plane and moves in it, but for round-off.
    fn keeps(&self, state: &State, plane: &Plane) -> bool {
        let normal = plane.normal();
        let aside = |(kind, value): (&SlotKind, &Vec3)| match kind {
            SlotKind::Rotation => (*value - normal * value.dot(normal)).norm(),
            _ => value.dot(normal).abs() / self.length,
        };
        let size = |(kind, value): (&SlotKind, &Vec3)| value.norm() / kind.scale(self.length);
        [&state.q[..], &state.v, &state.a].into_iter().all(|field| {
            let largest = self.kinds.iter().zip(field).map(size).fold(0.0, f64::max);
            let farthest = self.kinds.iter().zip(field).map(aside).fold(0.0, f64::max);
            farthest <= OUT_OF_PLANE * largest
        })
    }

    /// Whether loads or motions without a history act for the first time in this stage.
    pub fn has_fresh_loads(&self, stage: usize) -> bool {
        self.amplitudes.iter().any(|a| a.is_fresh(stage)) || self.motions.iter().any(|m| m.is_fresh(stage))
    }

    /// Remembers where the stage left the loads.
    pub fn end_stage(&mut self, state: &State) {
        self.amplitudes.iter_mut().for_each(|amplitude| amplitude.end_stage(state.time, state.load));
    }

    fn held_directions(&self, stage: usize) -> Vec<Direction> {
        let supports = self.supports.iter().filter(|support| support.stages.contains(stage));
        let moved = self.motions.iter().filter(|motion| motion.acts());
        // A prescribed rotation holds all of its node, so that what a joint about the same axis holds is no question any more.
        moved.flat_map(Motion::directions).chain(supports.flat_map(|s| s.directions.clone())).collect()
    }

    /// One or two held components of a rotation vector survive a change of chart only where they are zero.
    pub fn refuse_turned_hinges(&self, stage: usize, state: &State) -> Result<(), StageError> {
        let mut held: HashMap<Slot, Vec<Vec3>> = HashMap::new();
        self.held_directions(stage).iter().for_each(|d| held.entry(d.slot).or_default().push(d.axis));
        for &slot in &self.charted.rotations {
            let Some(axes) = held.get(&slot) else { continue };
            let turned = axes.iter().any(|axis| state.q[slot as usize].dot(*axis).abs() > 1e-9);
            let spans = |axis: &Vec3| axes.iter().any(|held| held.dot(*axis).abs() > 1e-9);
            if turned && !Vec3::UNIT.iter().all(spans) {
                return Err(StageError::TurnedHinge(slot));
            }
        }
        Ok(())
    }

    /// The first time behind `time` at which a load or a motion takes another course.
    pub fn next_corner(&self, time: f64) -> Option<f64> {
        let loads = self.amplitudes.iter().filter_map(|amplitude| amplitude.next_corner(time));
        loads.chain(self.motions.iter().filter_map(|motion| motion.next_corner(time))).min_by(f64::total_cmp)
    }

    /// Sets the clock and the load factor, the loads that belong to them, and the prescribed motions. Where a motion turns
    /// its node too far at once, its slot and the angle are returned.
    pub fn set_clock(&self, state: &mut State, time: f64, load: f64) -> Option<(Slot, f64)> {
        let before = state.amplitude.clone();
        (state.time, state.load) = (time, load);
        for (k, amplitude) in self.amplitudes.iter().enumerate() {
            let [value, rate, rate2] = amplitude.at(time, load);
            state.amplitude[k] = value;
            state.amplitude_rates[k] = [rate, rate2];
        }
        let mut too_far = None;
        for turned in self.effects.iter().filter_map(|effect| effect.turned(&before, &state.amplitude)) {
            if turned.1 > LARGEST_TURN {
                too_far = Some(turned);
            }
        }
        for motion in &self.motions {
            let turned = motion.impose(state);
            if turned > LARGEST_TURN {
                too_far = Some((motion.slot, turned));
            }
        }
        too_far
    }

    /// The largest displacement of a node from one state to another.
    pub fn farthest(&self, from: &State, to: &State) -> f64 {
        threads::largest(self.kinds.len(), |part| {
            let nodes = part.filter(|&slot| self.kinds[slot] == SlotKind::Displacement);
            nodes.map(|slot| (to.q[slot] - from.q[slot]).norm()).fold(0.0, f64::max)
        })
    }

    /// The largest force of a category at a node, without moments.
    pub fn largest_force(&self, system: &System) -> f64 {
        threads::largest(self.kinds.len(), |part| {
            let nodes = part.filter(|&slot| self.kinds[slot] == SlotKind::Displacement);
            let forces = nodes.flat_map(|slot| Category::ALL.map(|category| system.part_of(category, slot).norm()));
            forces.fold(0.0, f64::max)
        })
    }

    /// The rotation of a node shares the tile of its displacement, which it follows.
    pub fn node_blocks(&self, layout: Layout) -> NodeBlocks {
        let kind = |slot: Slot| self.kinds[slot as usize];
        NodeBlocks::new(self.slots(), layout, |slot| {
            kind(slot) == SlotKind::Rotation && kind(slot - 1) == SlotKind::Displacement
        })
    }

    /// How many regions of it can be evaluated at once: one where it is not large.
    pub fn regions(&self) -> usize {
        most_regions(self.node_blocks(Layout::Spatial).count())
    }

    /// The effects that act in a stage.
    pub fn acting(&self, stage: &StageContext) -> Vec<Arc<dyn Effect>> {
        self.effects.iter().filter(|effect| effect.acts(stage)).cloned().collect()
    }

    /// The stored energy.
    pub fn energy(&self, state: &State) -> Energy {
        let mut sum = Energy::default();
        for effect in &self.effects {
            let part = effect.energy(state);
            sum.kinetic += part.kinetic;
            sum.strain += part.strain;
        }
        sum
    }

    /// What joints to ground do to a node, see [`Effect::held_by_ground`].
    pub fn held_by_ground(&self, state: &State, node: Node) -> (Vec3, Vec3) {
        let parts = self.effects.iter().map(|effect| effect.held_by_ground(state, node));
        parts.fold((Vec3::ZERO, Vec3::ZERO), |(f, m), (force, moment)| (f + force, m + moment))
    }

    /// What is driven from outside: each coordinate with the derivative of the energy over it.
    pub fn drives(&self, state: &State) -> Vec<(f64, f64)> {
        let mut all = Vec::new();
        self.effects.iter().for_each(|effect| effect.drives(state, &mut |x, force| all.push((x, force))));
        all
    }

    /// Before a step is predicted, see [`Effect::steady`].
    pub fn steady(&self, state: &mut State) {
        self.effects.iter().for_each(|effect| effect.steady(state));
    }

    /// After a converged state: turns of joints are counted, multipliers have no rates.
    pub fn remember(&self, state: &mut State) {
        self.effects.iter().for_each(|effect| effect.remember(state));
        for &slot in &self.multipliers {
            let slot = slot as usize;
            [&mut state.v, &mut state.a, &mut state.algorithmic]
                .into_iter()
                .filter(|rates| !rates.is_empty())
                .for_each(|rates| rates.put(slot, Vec3::ZERO));
        }
    }

    /// Mass and momenta.
    pub fn momentum(&self, state: &State) -> Momentum {
        let mut sum = Momentum::default();
        self.effects.iter().for_each(|effect| sum.add(effect.momentum(state)));
        sum
    }
}
