//! The scene as mechanics sees it: unknowns, elements, effects, constraints, loads.

mod assembly;
pub mod beam_element;
mod builder;
pub mod charts;
mod constraint;
mod course;
mod effect_size;
mod history;
mod linear;
mod names;
mod parts;
mod schedule;
mod section;
mod stage_error;

pub use crate::system::{StageContext, StageKind, StageSet};
pub use assembly::Assembly;
pub use builder::{BuildError, ModelBuilder, NodeId, StraightBeam};
pub use constraint::{Motion, MotionKind, Support};
pub use course::{Amplitude, Course, Progress, Ramp, Timeline};
pub use effect_size::EffectSize;
pub use history::{History, NOTICED, Reading, Table};
pub(crate) use linear::LinearisedSystem;
pub use names::Names;
pub use parts::ModelParts;
pub use schedule::{Schedule, TooFar};
pub use section::{MassPerLength, SectionMatrices};
pub use stage_error::{Jump, LARGEST_GAP, MotorJump, StageError, SurfaceJump};

use crate::effect::joint::nearest_angle;
use crate::effect::{Constraint, Contacts, Drive, Effect, Energy, ForceJumps, Momentum, MotorState};
use crate::kernel::MAX_NODES;
use crate::system::{Category, DofMap, Layout, MirrorData, Node, NodeBlocks, Plane, Slot, State, System, most_regions};
use crate::tensor::Vec3;
use crate::threads;
use std::sync::Arc;

/// A state that is out of a plane by less, relative to the largest motion, is in it: a stage before
/// that ran in space leaves round-off of a few thousand steps. What is left aside is dropped, a
/// hundredth of what planar and spatial answers may differ by.
const OUT_OF_PLANE: f64 = 1e-12;

/// The kind of vector that a slot holds.
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
    /// The sliding of a node along a beam, a length in the first component
    Sliding,
}

impl SlotKind {
    /// All of them, in their order
    pub const ALL: [Self; 5] = [Self::Displacement, Self::Rotation, Self::Force, Self::Moment, Self::Sliding];

    /// Tells whether it holds multipliers: no unknowns of motion, with gaps in the place of forces.
    pub fn is_multiplier(self) -> bool {
        matches!(self, Self::Force | Self::Moment)
    }

    /// The arm that moments are divided by to compare with forces: a length for rotations, else 1.
    pub fn arm(self, length: f64) -> f64 {
        if self == Self::Rotation { length } else { 1.0 }
    }

    /// The scale that the unknowns of such a slot are compared with: a length for displacements and
    /// for sliding, 1 for rotations.
    pub fn scale(self, length: f64) -> f64 {
        if matches!(self, Self::Displacement | Self::Sliding) { length } else { 1.0 }
    }

    /// The [`Self::scale`] of each equation of slots of these kinds, in a scene of this length.
    pub fn scales(kinds: &[Self], length: f64, dof_map: &DofMap) -> Vec<f64> {
        let mut scales = vec![1.0; dof_map.count()];
        for (slot, kind) in (0..).zip(kinds) {
            let free = dof_map.of(slot).into_iter().filter(|&equation| equation != DofMap::HELD);
            free.for_each(|equation| scales[equation as usize] = kind.scale(length));
        }
        scales
    }
}

/// A beam element as changes of chart and the judgement of the mesh see it.
#[derive(Clone, Debug)]
pub struct ElementInfo {
    all: [Slot; MAX_NODES],
    count: u8,
    /// True where it interpolates total rotation vectors, so that all of them must be taken in one
    /// chart
    in_one_chart: bool,
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

/// A scene. Nothing of it changes in a run: what does is [`State`] and [`Schedule`].
pub struct Model {
    /// The kind of vector that each slot holds
    pub kinds: Arc<Vec<SlotKind>>,
    /// The names of nodes, by their slots
    names: Arc<Names>,
    /// The slots with multipliers
    pub multipliers: Vec<Slot>,
    /// How many joints remember their angle
    angles: usize,
    /// The slots on which rotational springs act: their unwrapped rotation vectors must be known
    pub(crate) sprung: Vec<Slot>,
    /// The rotations on the two sides of each joint that remembers its angle
    pub(crate) sprung_joints: Vec<[Option<Slot>; 2]>,
    /// How many beam elements there are
    pub(crate) elements: usize,
    /// Rotations and elements that large rotations change the charts of; see [`Self::charted`]
    rotating: Charted,
    /// The effects, in the order in which their forces are added
    pub effects: Vec<Arc<dyn Effect>>,
    /// The factors of loads and springs
    pub(crate) amplitudes: Vec<Amplitude>,
    /// Supports
    pub supports: Vec<Support>,
    /// Prescribed motions
    pub(crate) motions: Vec<Motion>,
    /// The plane that the scene lies in, where it is treated in one
    pub plane: Option<Plane>,
    /// True where static and dynamic stages are linear in the displacements
    pub linear: bool,
    /// The length to which displacements are compared: the largest distance of two nodes, the radius of bodies, or 1
    pub length: f64,
}

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

    /// The scales that the equations of this numbering are compared with.
    pub(crate) fn scales(&self, dof_map: &DofMap) -> Vec<f64> {
        SlotKind::scales(&self.kinds, self.length, dof_map)
    }

    /// Tells whether a slot holds a rotation vector.
    pub fn is_rotation(&self, slot: Slot) -> bool {
        self.kinds[slot as usize] == SlotKind::Rotation
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

    /// Tells whether no mass of a stage sits where something is free to move.
    pub fn lacks_mass(&self, stage: &StageContext, dof_map: &DofMap) -> bool {
        let is_free = |&slot: &Slot| dof_map.of(slot).iter().any(|&number| number != DofMap::HELD);
        let effects = self.effects.iter().filter(|effect| effect.category() == Category::Inertia && effect.acts(stage));
        !effects.into_iter().any(|effect| effect.connectivity().iter().flatten().any(is_free))
    }

    /// True if joints and motors of a stage, none of them redundant, constrain as much as all its unknowns may
    /// move.
    pub fn lacks_freedom(&self, dof_map: &DofMap) -> bool {
        let unknowns = |slot: usize| dof_map.of(slot as Slot).iter().filter(|&&number| number != DofMap::HELD).count();
        let add = |sums: [usize; 2], (slot, kind): (usize, &SlotKind)| match kind.is_multiplier() {
            true => [sums[0] + unknowns(slot), sums[1]],
            false => [sums[0], sums[1] + unknowns(slot)],
        };
        let [constraints, motions] = self.kinds.iter().enumerate().fold([0; 2], add);
        constraints == motions
    }

    /// The motors of joints that a change of amplitudes moves by more than a joint may be open.
    pub fn motor_jumps(&self, from: &[f64], state: &State) -> Vec<MotorJump> {
        let mut jumps = self.motor_changes(from, state);
        jumps.retain(|MotorJump { turns, from, to, .. }| match turns {
            true => nearest_angle(to - from).abs() > LARGEST_GAP,
            false => (to - from).abs() > LARGEST_GAP * self.length,
        });
        jumps
    }

    /// The motors of joints that a change of amplitudes turns so far that their turns cannot be counted.
    pub fn motor_leaps(&self, from: &[f64], state: &State) -> Vec<MotorJump> {
        let mut jumps = self.motor_changes(from, state);
        jumps.retain(|jump| jump.turns && (jump.to - jump.from).abs() > schedule::LARGEST_TURN);
        jumps
    }

    fn motor_changes(&self, from: &[f64], state: &State) -> Vec<MotorJump> {
        let mut changes = Vec::new();
        self.each_motor(state, &mut |MotorState { slot, amplitude, turns, value, .. }| {
            let [from, to] = [from, &state.amplitude].map(|amplitudes| value * amplitudes[amplitude]);
            changes.push(MotorJump { slot, amplitude, turns, from, to });
        });
        changes
    }

    /// The surfaces that a change of amplitudes moves at once.
    pub fn surface_jumps(&self, amplitudes: &[f64], state: &State) -> Vec<SurfaceJump> {
        let mut jumps = Vec::new();
        if let Some(contacts) = self.contacts() {
            contacts.driven_surfaces(state, &mut |surface, amplitude, turns| {
                let [from, to] = [amplitudes, &state.amplitude].map(|amplitudes| amplitudes[amplitude]);
                let size = if turns { 1.0 } else { self.length };
                if (to - from).abs() > LARGEST_GAP * size {
                    jumps.push(SurfaceJump { surface: surface.into(), amplitude, turns, from, to });
                }
            });
        }
        jumps
    }

    /// The effects whose forces jump.
    pub fn force_jumps(&self) -> impl Iterator<Item = &dyn ForceJumps> {
        self.effects.iter().filter_map(|effect| effect.roles().force_jumps)
    }

    /// What means of forces at some instants of a step of some length miss where forces jump, by
    /// slot; see [`ForceJumps::missed`].
    pub fn missed(&self, instants: &[(f64, &State)], length: f64) -> Vec<(Slot, Vec3)> {
        let mut missed = Vec::new();
        self.force_jumps()
            .for_each(|effect| effect.missed(instants, length, &mut |slot, force| missed.push((slot, force))));
        missed
    }

    /// The effects that close gaps by multipliers.
    pub(super) fn constraints(&self) -> impl Iterator<Item = &dyn Constraint> {
        self.effects.iter().filter_map(|effect| effect.roles().constraint)
    }

    /// The effect of contacts, if the scene has one.
    pub fn contacts(&self) -> Option<&dyn Contacts> {
        self.effects.iter().find_map(|effect| effect.roles().contacts)
    }

    /// Shows the motors of joints.
    pub fn each_motor(&self, state: &State, show: &mut dyn FnMut(MotorState)) {
        self.constraints().for_each(|constraint| constraint.motors(state, show));
    }

    /// The rotations and elements that have charts in stages of a kind: none where these are linear.
    pub fn charted(&self, kind: StageKind) -> &Charted {
        const NONE: &Charted = &Charted { rotations: Vec::new(), elements: Vec::new() };
        if self.is_linear(kind) { NONE } else { &self.rotating }
    }

    /// Tells whether stages of a kind are linear in the displacements.
    pub fn is_linear(&self, kind: StageKind) -> bool {
        self.linear && kind.advances_state()
    }

    /// Shows what decides whether the scene lies in a plane, each with a name.
    pub fn mirror_data(&self, show: &mut dyn FnMut(&'static str, MirrorData)) {
        for effect in &self.effects {
            effect.mirror_data(&mut |aspect| show(effect.name(), aspect));
        }
        self.supports.iter().for_each(|support| support.mirror_data(&mut |aspect| show("supports", aspect)));
        self.motions.iter().for_each(|motion| show("motions", motion.aspect()));
    }

    /// Takes out of a state what round-off has put aside of its plane: nothing else would, and it
    /// grows from step to step.
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

    /// Tells whether a state lies in a plane and moves in it, but for round-off.
    fn keeps(&self, state: &State, plane: &Plane) -> bool {
        let normal = plane.normal();
        let aside = |(kind, value): (&SlotKind, &Vec3)| match kind {
            SlotKind::Rotation => (*value - normal * value.dot(normal)).norm(),
            SlotKind::Displacement | SlotKind::Force | SlotKind::Moment | SlotKind::Sliding => {
                value.dot(normal).abs() / self.length
            }
        };
        let size = |(kind, value): (&SlotKind, &Vec3)| value.norm() / kind.scale(self.length);
        [&state.q[..], &state.v, &state.a].into_iter().all(|field| {
            let largest = self.kinds.iter().zip(field).map(size).fold(0.0, f64::max);
            let farthest = self.kinds.iter().zip(field).map(aside).fold(0.0, f64::max);
            farthest <= OUT_OF_PLANE * largest
        })
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

    /// Force and moment of joints to ground on a node, see [`Constraint::held_by_ground`]. `origin`
    /// is the state about which the stage is linear, in whose placement multipliers then act;
    /// `None` in other stages.
    pub fn held_by_ground(&self, state: &State, origin: Option<&State>, node: Node) -> (Vec3, Vec3) {
        let placed = origin.filter(|_| !self.multipliers.is_empty()).map(|origin| {
            let mut placed = origin.clone();
            self.multipliers.iter().for_each(|&slot| placed.q[slot as usize] = state.q[slot as usize]);
            placed
        });
        let state = placed.as_ref().unwrap_or(state);
        let parts = self.constraints().map(|constraint| constraint.held_by_ground(state, node));
        parts.fold((Vec3::ZERO, Vec3::ZERO), |(f, m), (force, moment)| (f + force, m + moment))
    }

    /// Coordinates that are driven from outside, each with the derivative of the energy over it, see
    /// [`DrivenCoordinates`](crate::effect::DrivenCoordinates).
    pub fn drives(&self, state: &State, origin: Option<&State>) -> Vec<Drive> {
        let mut all = Vec::new();
        let driven = self.effects.iter().filter_map(|effect| effect.roles().driven);
        driven.for_each(|driven| {
            let acts_at_once = driven.act_at_once();
            driven.drives(state, origin, &mut |value, force| all.push(Drive { value, force, acts_at_once }));
        });
        all
    }

    /// Before a step is predicted, see [`crate::effect::FreeSpins::steady`].
    pub fn steady(&self, stage: &StageContext, state: &mut State) {
        let acting = self.effects.iter().filter(|effect| effect.acts(stage));
        acting.filter_map(|effect| effect.roles().spins).for_each(|spins| spins.steady(state));
    }

    /// After a converged state: turns of joints are counted, multipliers have no rates.
    pub fn remember(&self, state: &mut State) {
        self.constraints().for_each(|constraint| constraint.remember(state));
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
        self.effects.iter().filter_map(|effect| effect.roles().masses).for_each(|mass| sum.add(mass.momentum(state)));
        sum
    }
}
