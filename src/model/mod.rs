//! The scene as mechanics sees it: unknowns, elements, effects, constraints, loads.

mod amplitude;
pub mod charts;
mod constraint;
mod history;
mod linear;

pub use crate::system::{StageContext, StageKind, StageSet};
pub use amplitude::Amplitude;
pub use constraint::{Jump, Motion, MotionKind, Support};
pub use history::{History, Table};

use crate::effect::{Effect, Energy, Momentum, Noise};
use crate::kernel::Weights;
use crate::system::{
    Aspect, Cliques, Direction, Equations, FrameConflict, Groups, Layout, Memory, Node, Pattern, Plane, Slot, State,
    System,
};
use crate::tensor::Vec3;
use linear::Linear;
use std::sync::Arc;

/// A prescribed rotation may go this far in one step or load increment.
const LARGEST_TURN: f64 = 0.75 * std::f64::consts::PI;

/// A state that is out of a plane by less, relative to the largest motion, is in it.
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
}

/// A slot, and the node that it is named after.
#[derive(Clone, Debug)]
pub struct SlotInfo {
    /// What it holds
    pub kind: SlotKind,
    /// The name of its node, for messages
    pub node: String,
    /// The initial place of its node
    pub place: Vec3,
}

/// A beam element as changes of chart and the judgement of the mesh see it.
#[derive(Clone, Debug)]
pub struct ElementInfo {
    /// Its nodes
    pub nodes: Vec<Node>,
    /// Whether it interpolates total rotation vectors, so that all of them must be taken in one chart
    pub in_one_chart: bool,
}

impl SlotInfo {
    /// Whether it holds multipliers: no unknowns of motion, and what stands in the place of forces are gaps.
    pub fn is_multiplier(&self) -> bool {
        matches!(self.kind, SlotKind::Force | SlotKind::Moment)
    }

    /// What its unknowns are compared with: a length for displacements, 1 for rotations.
    pub fn scale(&self, length: f64) -> f64 {
        if self.kind == SlotKind::Displacement { length } else { 1.0 }
    }

    /// What turns the forces of this slot into forces that compare: a length for moments, 1 for forces.
    pub fn arm(&self, length: f64) -> f64 {
        if self.kind == SlotKind::Rotation { length } else { 1.0 }
    }
}

/// What an effect adds to a system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// The effect
    pub name: &'static str,
    /// How many of it there are: elements, loads, …
    pub instances: usize,
    /// Unknowns that nothing else touches
    pub unknowns: usize,
    /// Entries of the tangent that are there for it alone
    pub entries: usize,
}

/// An immutable scene; only the courses of amplitudes and motions change from stage to stage.
#[derive(Clone)]
pub struct Model {
    /// All slots
    pub slots: Vec<SlotInfo>,
    /// The slots with rotation vectors
    pub rotations: Vec<Slot>,
    /// The slots with multipliers
    pub multipliers: Vec<Slot>,
    /// How many joints remember their angle
    pub angles: usize,
    /// The slots on which rotational springs act: how they are wound must be known
    pub sprung: Vec<Slot>,
    /// The beam elements
    pub elements: Vec<ElementInfo>,
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
}

impl Model {
    /// The state before the first stage.
    pub fn rest(&self) -> State {
        State::rest(self.slots.len(), self.elements.len(), self.amplitudes.len(), self.angles)
    }

    /// Settles the courses of loads and motions, and numbers the unknowns that are free in this stage.
    pub fn begin_stage(&mut self, stage: usize, kind: StageKind, state: &State) -> Result<Equations, StageError> {
        let fresh = self.has_fresh_loads(stage);
        self.amplitudes.iter_mut().for_each(|amplitude| amplitude.begin_stage(stage, kind, fresh));
        for (number, motion) in self.motions.iter_mut().enumerate() {
            let jump = |(from, to)| StageError::Jump(Jump { motion: number, from, to });
            motion.begin_stage(stage, kind, state, self.length, fresh).map_err(jump)?;
        }
        let held = self.held_directions(stage);
        let plane = self
            .plane
            .filter(|plane| matches!(kind, StageKind::Static | StageKind::Dynamic) && self.keeps(state, plane));
        self.refuse_turned_hinges(&held, state)?;
        self.number(stage, plane)
    }

    /// The unknowns that are free in a stage that has begun, in a plane or in space.
    pub fn number(&self, stage: usize, plane: Option<Plane>) -> Result<Equations, StageError> {
        let (slots, held) = (self.slots.len(), self.held_directions(stage));
        let turns = |slot: Slot| self.slots[slot as usize].kind == SlotKind::Rotation;
        let numbered = match plane {
            None => Equations::new(slots, &held),
            Some(plane) => Equations::planar(slots, &held, plane, turns),
        };
        numbered.map_err(StageError::Conflict)
    }

    /// Shows what decides whether the scene lies in a plane, each with a name.
    pub fn aspects(&self, show: &mut dyn FnMut(&'static str, Aspect)) {
        for effect in &self.effects {
            effect.aspects(&mut |aspect| show(effect.name(), aspect));
        }
        self.supports.iter().for_each(|support| support.aspects(&mut |aspect| show("supports", aspect)));
        self.motions.iter().for_each(|motion| show("motions", motion.aspect()));
    }

    /// Takes out of a state what round-off has put aside of its plane: nothing else would, and it grows from step to step.
    pub fn flatten(&self, plane: &Plane, state: &mut State) {
        if !plane.is_tilted() {
            return;
        }
        let normal = plane.normal();
        for field in [&mut state.q, &mut state.v, &mut state.a, &mut state.algorithmic] {
            for (info, value) in self.slots.iter().zip(field) {
                let aside = normal * value.dot(normal);
                *value = if info.kind == SlotKind::Rotation { aside } else { *value - aside };
            }
        }
    }

    /// Whether a state lies in a plane and moves in it, but for round-off.
    fn keeps(&self, state: &State, plane: &Plane) -> bool {
        let normal = plane.normal();
        let aside = |(info, value): (&SlotInfo, &Vec3)| match info.kind {
            SlotKind::Rotation => (*value - normal * value.dot(normal)).norm(),
            _ => value.dot(normal).abs() / self.length,
        };
        let size = |(info, value): (&SlotInfo, &Vec3)| value.norm() / info.scale(self.length);
        [&state.q, &state.v, &state.a].iter().all(|field| {
            let largest = self.slots.iter().zip(*field).map(size).fold(0.0, f64::max);
            let farthest = self.slots.iter().zip(*field).map(aside).fold(0.0, f64::max);
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
    fn refuse_turned_hinges(&self, held: &[Direction], state: &State) -> Result<(), StageError> {
        for &slot in &self.rotations {
            let here = || held.iter().filter(|d| d.slot == slot);
            let turned = here().any(|d| state.q[slot as usize].dot(d.axis).abs() > 1e-9);
            let spans = |axis: &Vec3| here().any(|d| d.axis.dot(*axis).abs() > 1e-9);
            if turned && !Vec3::UNIT.iter().all(spans) {
                return Err(StageError::TurnedHinge(slot));
            }
        }
        Ok(())
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
        let nodes = self.slots.iter().zip(from.q.iter().zip(&to.q));
        let moved = nodes.filter(|(info, _)| info.kind == SlotKind::Displacement).map(|(_, (a, b))| (*b - *a).norm());
        moved.fold(0.0, f64::max)
    }

    /// The rotation of a node shares the tile of its displacement, which it follows.
    pub fn groups(&self, layout: Layout) -> Groups {
        let kind = |slot: Slot| self.slots[slot as usize].kind;
        Groups::new(self.slots.len(), layout, |slot| {
            kind(slot) == SlotKind::Rotation && kind(slot - 1) == SlotKind::Displacement
        })
    }

    /// The effects that act in a stage, as they do in a plane or in space.
    pub fn acting(&self, stage: &StageContext, plane: Option<&Plane>) -> Vec<Arc<dyn Effect>> {
        let form = |effect: &Arc<dyn Effect>| match plane {
            None => effect.clone(),
            Some(plane) => effect.clone().in_plane(plane).unwrap_or_else(|| effect.clone()),
        };
        self.effects.iter().filter(|effect| effect.acts(stage)).map(form).collect()
    }

    /// What each effect that acts in a stage adds to the system of these equations.
    pub fn shares(&self, stage: &StageContext, equations: &Equations) -> Vec<Share> {
        let effects = self.acting(stage, None);
        let layout = if equations.plane().is_some() { Layout::Planar } else { Layout::Spatial };
        let cliques: Vec<_> = effects.iter().map(|effect| effect.cliques()).collect();
        let size_without = |left_out: Option<usize>| {
            let others = cliques.iter().enumerate().filter(|(k, _)| Some(*k) != left_out).map(|(_, own)| own.clone());
            let others: Vec<Cliques> = others.collect();
            let mut touched = vec![false; self.slots.len()];
            others.iter().flat_map(Cliques::iter).flatten().for_each(|&slot| touched[slot as usize] = true);
            let free = |slot: usize| equations.of(slot as Slot).iter().filter(|&&n| n != Equations::HELD).count();
            let unknowns = (0..touched.len()).filter(|&slot| touched[slot]).map(free).sum::<usize>();
            (unknowns, Pattern::new(equations.clone(), self.groups(layout), others).nonzeros())
        };
        let (unknowns, entries) = size_without(None);
        let share = |(k, effect): (usize, &Arc<dyn Effect>)| {
            let without = size_without(Some(k));
            let (unknowns, entries) = (unknowns - without.0, entries - without.1);
            Share { name: effect.name(), instances: cliques[k].len(), unknowns, entries }
        };
        effects.iter().enumerate().map(share).collect()
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
            (state.v[slot], state.a[slot], state.algorithmic[slot]) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        }
    }

    /// Mass and momenta.
    pub fn momentum(&self, state: &State) -> Momentum {
        let mut sum = Momentum::ZERO;
        self.effects.iter().for_each(|effect| sum.add(effect.momentum(state)));
        sum
    }
}

/// The effects of one stage with their scratch, and the system they add to.
pub struct Assembly {
    effects: Vec<Arc<dyn Effect>>,
    memories: Vec<Memory>,
    /// Forces and tangent
    pub system: System,
    /// Evaluations of each effect's instances so far, by name
    pub evaluations: Vec<(&'static str, u64)>,
    sizes: Vec<u64>,
    /// In linear stages
    linear: Option<Box<Linear>>,
}

impl Assembly {
    /// The system of what acts in a stage on these equations.
    pub fn new(stage: &StageContext, equations: Equations, model: &Model) -> Self {
        let effects = model.acting(stage, equations.plane());
        let layout = if equations.plane().is_some() { Layout::Planar } else { Layout::Spatial };
        let cliques: Vec<_> = effects.iter().map(|effect| effect.cliques()).collect();
        let symmetric = effects.iter().all(|effect| effect.is_symmetric());
        let memory = |e: &Arc<dyn Effect>| Memory { points: vec![[0.0; 6]; e.memory_points()], valid: false };
        Self {
            memories: effects.iter().map(memory).collect(),
            evaluations: effects.iter().map(|effect| (effect.name(), 0)).collect(),
            sizes: cliques.iter().map(|c| c.len() as u64).collect(),
            system: System::new(Pattern::new(equations, model.groups(layout), cliques), model.slots.len(), symmetric),
            effects,
            linear: None,
        }
    }

    /// Whether everything is linear.
    pub fn is_linear(&self) -> bool {
        self.linear.is_some()
    }

    /// From here on everything is linear about a state.
    pub fn linearise(&mut self, model: &Model, about: &State) -> Result<(), FrameConflict> {
        self.linear = Some(Box::new(Linear::new(&self.effects, model, about)?));
        Ok(())
    }

    /// Forces of the state, and the tangent of the weights; `lift`: see [`System::clear`]. Without weights the tangent is left as
    /// it is.
    pub fn evaluate(&mut self, state: &State, weights: Weights, lift: Option<&[Vec3]>) {
        match self.linear.take() {
            None => self.evaluate_effects(state, weights, lift),
            Some(mut linear) => {
                self.evaluate_linear(&mut linear, state, weights, lift);
                self.linear = Some(linear);
            }
        }
    }

    /// The tangent is formed where its weights change; and where increments are prescribed, which act through it.
    fn evaluate_linear(&mut self, linear: &mut Linear, state: &State, weights: Weights, lift: Option<&[Vec3]>) {
        linear.follow(state);
        let known =
            weights == Weights::NONE || (lift.is_none() && linear.formed == Some((weights, self.system.revision)));
        if known {
            self.system.clear_forces();
        } else {
            self.forget();
            self.evaluate_effects(&linear.origin, weights, lift);
            self.system.forget_forces();
            linear.formed = Some((weights, self.system.revision));
        }
        for (number, effect) in self.effects.iter().enumerate() {
            let mut sink = self.system.sink(number, effect.category(), false);
            effect.add(&linear.about, &self.memories[number], Weights::NONE, &mut sink);
            self.evaluations[number].1 += self.sizes[number];
        }
        linear.add_forces(state, &mut self.system.force);
    }

    fn evaluate_effects(&mut self, state: &State, weights: Weights, lift: Option<&[Vec3]>) {
        match weights {
            Weights::NONE => {
                debug_assert!(lift.is_none(), "prescribed increments act through the tangent");
                self.system.clear_forces();
            }
            _ => self.system.clear(lift),
        }
        for (number, effect) in self.effects.iter().enumerate() {
            let with_tangent = weights != Weights::NONE && effect.has_tangent();
            let mut sink = self.system.sink(number, effect.category(), with_tangent);
            let weights = if with_tangent { weights } else { Weights::NONE };
            effect.add(state, &self.memories[number], weights, &mut sink);
            self.evaluations[number].1 += self.sizes[number];
        }
    }

    /// Lets effects remember what the next tangent is formed with, before the state is corrected by `dq`.
    pub fn extrapolate(&mut self, state: &State, dq: &[Vec3]) {
        if self.linear.is_some() {
            return;
        }
        for (effect, memory) in self.effects.iter().zip(&mut self.memories).filter(|(e, _)| e.memory_points() > 0) {
            effect.extrapolate(state, dq, memory);
        }
    }

    /// Forgets what was remembered: a new step begins.
    pub fn forget(&mut self) {
        self.memories.iter_mut().for_each(|memory| memory.valid = false);
    }

    /// First and second derivatives over time of the gaps of joints, by slot of their multipliers; see [`Effect::drift`].
    pub fn drift(&self, state: &State) -> [Vec<Vec3>; 2] {
        let zero = vec![Vec3::ZERO; state.q.len()];
        let (mut rates, mut rates2) = (zero.clone(), zero);
        self.effects.iter().for_each(|effect| effect.drift(state, &mut rates, &mut rates2));
        [rates, rates2]
    }

    /// The largest round-off among the effects.
    pub fn noise(&self, state: &State) -> Noise {
        let mut largest = Noise::default();
        for noise in self.effects.iter().map(|effect| effect.noise(state)) {
            largest.force = largest.force.max(noise.force);
            largest.moment = largest.moment.max(noise.moment);
        }
        largest
    }

    /// The largest strain that a field makes, see [`Effect::strain_of`].
    pub fn strain_of(&self, state: &State, field: &[Vec3], length: f64) -> f64 {
        self.effects.iter().map(|effect| effect.strain_of(state, field, length)).fold(0.0, f64::max)
    }

    /// The name of the first effect whose forces are not finite, and the slot.
    pub fn culprit(&mut self, state: &State) -> Option<(&'static str, usize)> {
        for (number, effect) in self.effects.iter().enumerate() {
            self.system.clear(None);
            effect.add(
                state,
                &self.memories[number],
                Weights::NONE,
                &mut self.system.sink(number, effect.category(), false),
            );
            let forces = &self.system.force[effect.category() as usize];
            if let Some(slot) = forces.iter().position(|f| !f.is_finite()) {
                return Some((effect.name(), slot));
            }
        }
        None
    }
}
