//! The estimated error of the fixed time steps of a stage.
//!
//! The local error of a step is tau = (1/6 - beta - d/2) h^3 q''', with d = alpha_m - alpha_f. The
//! sum of the sizes of local errors is |1/6 - beta - d/2| h^2 times the total variation of
//! accelerations, which is 2/pi of the error of an oscillation, whose phase errors add up over
//! quarter periods. With a stage in the middle of steps it is tau = h^5/720 q''''', from the second
//! differences of accelerations within steps. While that sum stays far below the size of a warning nothing else is done;
//! where it will not, and in small scenes, where errors may grow by themselves, the error is
//! integrated beside the motion (`carried_error`).

use super::carried_error::{CarriedError, FREE_SPIN_ERROR, SLOPE_STEPS};
use super::increments::bodies_by_rotation;
use super::{Increments, Stages, Step};
use crate::kernel::Weights;
use crate::kernel::inertia::Inertia;
use crate::model::charts::DYNAMIC_BAND;
use crate::model::{Assembly, Model, SlotKind};
use crate::system::{DofMap, Field, Slot, State, System};
use crate::tensor::Vec3;
use crate::threads::{self, PART};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::sync::Arc;

/// The number of slots up to which the error of a scene is carried from the start of a stage.
const SLOTS_CARRIED_AT_ONCE: usize = 100;

/// The number of slots above which the error of a scene is not carried, which would take a quarter
/// of its memory.
const MAX_SLOTS_CARRIED: usize = 200_000;

/// The sum of local errors of displacements, over the largest displacement and extrapolated to the
/// end of the stage, from which on the error is carried.
const MIN_RELATIVE_ERROR: f64 = 0.02;
/// The sum of local errors of rotations, in radians and extrapolated to the end of the stage, from
/// which on the error is carried.
const MIN_ROTATION_ERROR: f64 = 0.1;

/// The number of steps before sums of local errors are extrapolated to the end of the stage: little
/// has moved at first.
const MIN_STEPS: usize = 4 * SLOPE_STEPS;

/// The share of the stage before sums of local errors are extrapolated to its end.
const MIN_STAGE_SHARE: f64 = 0.125;

/// A rate that is not known: changes from it count as none.
const UNKNOWN: Vec3 = Vec3([f64::NAN; 3]);

/// The largest errors of a stage, and the largest displacement to compare them with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Largest {
    /// Largest error of a displacement of a node or a mass centre, a length
    pub displacement: f64,
    /// Largest error of a rotation that has inertia, in radians
    pub rotation: f64,
    /// Largest displacement of a node or a mass centre since the start of the stage, a length
    pub moved: f64,
}

impl Largest {
    /// Updates squares of these quantities with those of a slot.
    #[inline(always)]
    pub(super) fn take(&mut self, kind: SlotKind, error: Vec3, moved: Vec3) {
        let of_kind = match kind {
            SlotKind::Displacement | SlotKind::Sliding => &mut self.displacement,
            SlotKind::Rotation | SlotKind::Force | SlotKind::Moment => &mut self.rotation,
        };
        *of_kind = of_kind.max(error.squared());
        self.moved = self.moved.max(moved.squared());
    }

    /// The roots, where these quantities are squares.
    pub(super) fn root(self) -> Self {
        Self { displacement: self.displacement.sqrt(), rotation: self.rotation.sqrt(), moved: self.moved.sqrt() }
    }

    pub(super) fn or(self, other: Self) -> Self {
        Self {
            displacement: self.displacement.max(other.displacement),
            rotation: self.rotation.max(other.rotation),
            moved: self.moved.max(other.moved),
        }
    }
}

/// Solves for the correction of the forces of a system, with the factors of its tangent; `false`
/// without factors.
pub type Correct<'a> = dyn FnMut(&System, &mut [Vec3]) -> bool + 'a;

/// Data of the scene that errors depend on.
#[derive(Clone, Deserialize, Serialize)]
pub(super) struct Scene {
    /// The kind of each slot
    #[serde(skip)]
    pub(super) kinds: Arc<Vec<SlotKind>>,
    /// The length of the scene
    pub(super) length: f64,
    /// True for each slot whose accelerations are determined by mass
    massive: Vec<bool>,
    /// Mass centres away from their nodes
    #[serde(skip)]
    pub(super) centres: Arc<Vec<MassCentre>>,
}

/// The mass centre of what is fixed to a node, away from the node.
#[derive(Clone, Copy, Debug)]
pub(super) struct MassCentre {
    /// The slot of the displacement of the node
    pub(super) place: Slot,
    /// The slot of its rotation
    pub(super) rotation: Slot,
    /// From the node to the centre, in global axes of the initial placement
    pub(super) offset: Vec3,
}

impl MassCentre {
    /// Those of a model.
    fn of(model: &Model) -> Arc<Vec<Self>> {
        let bodies = bodies_by_rotation(model).into_iter();
        let centre = |(rotation, (place, body)): (Slot, (Slot, Inertia))| {
            (body.offset != Vec3::ZERO).then_some(Self { place, rotation, offset: body.offset })
        };
        Arc::new(bodies.filter_map(centre).collect())
    }

    /// The longest way from a node to one of them.
    pub fn longest(centres: &[Self]) -> f64 {
        centres.iter().map(|centre| centre.offset.norm()).fold(0.0, f64::max)
    }
}

impl Scene {
    /// The longest way from a node to a mass centre.
    pub fn longest_offset(&self) -> f64 {
        MassCentre::longest(&self.centres)
    }

    /// True if the accelerations of a slot are determined by mass and it is no multiplier.
    pub fn moves(&self, slot: usize) -> bool {
        self.massive[slot] && !self.kinds[slot].is_multiplier()
    }
}

/// The states at both ends of a time step, and in its middle if that is a stage, in one chart.
#[derive(Clone, Copy)]
pub struct StepEnds<'a> {
    /// The state at the start of the step
    pub(crate) from: &'a State,
    /// The state in the middle of the step, if that is a stage
    pub(crate) middle: Option<&'a State>,
    /// The state at the end of the step
    pub(crate) to: &'a State,
}

impl StepEnds<'_> {
    /// The rate of a slot at the end of the step whose slope the local error is a multiple of: the
    /// acceleration; with a middle q'''', from the parabola through the accelerations.
    #[inline(always)]
    pub(super) fn rate_of_error(&self, slot: usize) -> Vec3 {
        let Self { from, middle, to } = self;
        match middle {
            None => to.a[slot],
            Some(middle) => {
                let half = 0.5 * (to.time - from.time);
                (from.a[slot] - middle.a[slot] * 2.0 + to.a[slot]) * (1.0 / (half * half))
            }
        }
    }

    /// The states of the step, each with the weight of its force in the impulse that the step takes.
    pub fn instants(&self) -> Vec<(f64, &State)> {
        let Self { from, middle, to } = *self;
        match middle {
            None => vec![(0.5, from), (0.5, to)],
            Some(middle) => vec![(1.0 / 6.0, from), (2.0 / 3.0, middle), (1.0 / 6.0, to)],
        }
    }
}

/// The error of the steps of a stage.
#[derive(Clone, Deserialize, Serialize)]
pub struct TimeError {
    scene: Scene,
    /// q at the start of the stage
    start: Vec<Vec3>,
    /// [`StepEnds::rate_of_error`] at the last update of the sum; NaN where it is that of another
    /// chart, or not known yet
    past: Field,
    /// Accelerations, by moments and by the spin itself (spatial), of rotations whose unknowns are
    /// increments, at the last update of the sum
    past_turns: Vec<[Vec3; 2]>,
    /// The length of the step before the present one
    before: f64,
    /// The number of steps so far
    steps: usize,
    /// The number of steps of the whole stage
    of_steps: f64,
    /// The longest step since the last update of the sum
    longest: Option<Step>,
    /// The sizes of local errors, summed over the steps before the error was carried
    sum: Largest,
    /// True if forces may jump within steps
    sees_jumps: bool,
    carried: Option<Box<CarriedError>>,
}

impl TimeError {
    /// The estimator with the kinds of slots of a model, which checkpoints leave out.
    pub fn of_model(mut self, model: &Model) -> Self {
        self.scene.kinds = model.kinds.clone();
        self.scene.centres = MassCentre::of(model);
        if let Some(carried) = &mut self.carried {
            carried.kinds = model.kinds.clone();
            carried.centres = self.scene.centres.clone();
        }
        self
    }

    /// The error of a stage that begins in `state` with the step `first`, and lasts for `duration`.
    /// `massive` is true for each slot whose accelerations are determined by mass.
    pub fn new(
        model: &Model,
        assembly: &Assembly,
        state: &State,
        increments: Option<&Increments>,
        massive: &[bool],
        first: Step,
        duration: f64,
    ) -> Self {
        let scene = Scene {
            kinds: model.kinds.clone(),
            length: model.length,
            massive: massive.to_vec(),
            centres: MassCentre::of(model),
        };
        let mut past = state.a.clone();
        match first.scheme.stages {
            Stages::End => (),
            Stages::MiddleAndEnd => past.fill(UNKNOWN),
        }
        let mut error = Self {
            scene,
            start: state.q.clone(),
            past,
            past_turns: increments
                .into_iter()
                .flat_map(|increments| increments.accelerations(state))
                .map(|a| [a.driven, a.free])
                .collect(),
            before: first.length,
            steps: 0,
            of_steps: duration / first.length,
            longest: None,
            sum: Largest::default(),
            // In linear stages nothing does.
            sees_jumps: assembly.origin().is_none() && model.force_jumps().any(|effect| effect.acts(state)),
            carried: None,
        };
        // The sum of local errors does not show forces that jump.
        let at_once = if error.sees_jumps { MAX_SLOTS_CARRIED } else { SLOTS_CARRIED_AT_ONCE };
        if model.slots() <= at_once {
            error.carry(&assembly.system, state, first);
        }
        error
    }

    fn carry(&mut self, system: &System, state: &State, step: Step) {
        self.carried = Some(Box::new(CarriedError::new(&self.scene, system.force.clone(), state, &self.start, step)));
    }

    /// Begins an attempt at a step; `before` is the length of the step before.
    pub fn begin(&mut self, step: &Step, before: f64) {
        self.before = before;
        if let Some(carried) = &mut self.carried {
            carried.begin(step, before);
        }
    }

    /// True if an error is carried, and is not zero.
    pub fn has_error(&self) -> bool {
        self.carried.as_ref().is_some_and(|carried| carried.has_error())
    }

    /// The weights of the tangent that carries the error, where there is one.
    pub fn weights(&self) -> Option<Weights> {
        self.carried.as_ref().filter(|carried| carried.has_error()).map(|carried| carried.weights())
    }

    /// True if an error is carried and [`Self::look`] has not been called in the present step.
    pub fn knows_no_forces(&self) -> bool {
        self.carried.as_ref().is_some_and(|carried| carried.knows_no_forces())
    }

    /// Computes the forces of inertia and damping on a carried error, at the state of the present
    /// tangent. The forces of the system must be those of that state; they are kept.
    pub fn look(&mut self, assembly: &mut Assembly, state: &mut State, weights: Weights) {
        if let Some(carried) = &mut self.carried {
            carried.look(assembly, state, weights);
        }
    }

    /// Solves for a carried error at the end of a step in balance, and writes it to `error`.
    pub fn solve(&mut self, correct: &mut Correct, system: &mut System, state: &State, error: &mut [Vec3]) {
        if let Some(carried) = &mut self.carried {
            carried.solve(correct, system, state, error);
        }
    }

    /// Ends a step between two states in one chart, with the `error` that [`Self::solve`] has
    /// found.
    pub fn end(
        &mut self,
        model: &Model,
        system: &System,
        error: &[Vec3],
        step_ends: StepEnds,
        step: &Step,
        increments: Option<&Increments>,
    ) {
        if let Some(carried) = &mut self.carried {
            if self.sees_jumps {
                carried.miss(model.missed(&step_ends.instants(), step.length));
            }
            return carried.end(&system.pattern.dof_map, error, step_ends, increments);
        }
        self.steps += 1;
        self.longest = self.longest.filter(|longest| longest.length >= step.length).or(Some(*step));
        let is_due = match step.scheme.stages {
            Stages::End => self.steps.is_multiple_of(SLOPE_STEPS),
            // Such steps are long. Second differences of steps of unequal length do not compare.
            Stages::MiddleAndEnd => {
                if step.length != self.before {
                    self.past.fill(UNKNOWN);
                }
                true
            }
        };
        if is_due {
            self.sum_up(&system.pattern.dof_map, step_ends, increments);
            if self.is_worth_carrying() {
                self.carry(system, step_ends.to, *step);
            }
        }
    }

    /// Adds the local errors of the steps since the last update of the sum, up to the end of this
    /// one. Called every few steps, and at the end of the stage.
    pub fn sum_up(&mut self, dof_map: &DofMap, step_ends: StepEnds, increments: Option<&Increments>) {
        let Some(step) = self.longest.take() else { return };
        let state = step_ends.to;
        let h2 = step.length * step.length;
        let factor = step.error_factors()[0].abs() / step.length;
        let Self { scene, start, past, .. } = self;
        let scene = &*scene;
        let start = &start[..];
        let work = |(number, past): (usize, &mut [Vec3])| {
            let mut largest = Largest::default();
            for (k, past) in (PART * number..).zip(past) {
                let kind = scene.kinds[k];
                if !scene.moves(k) || (kind == SlotKind::Rotation && increments.is_some()) {
                    continue;
                }
                let rate = step_ends.rate_of_error(k);
                let mut change = rate - std::mem::replace(past, rate);
                if !dof_map.is_plain(k as Slot) {
                    change -= dof_map.held_part(k as Slot, change);
                }
                let moved = if kind == SlotKind::Displacement { state.q[k] - start[k] } else { Vec3::ZERO };
                largest.take(kind, change * factor, moved);
            }
            largest
        };
        let mut now = Largest::default();
        threads::in_order(past.chunks_mut(PART).enumerate(), work, |of_part: Largest| now = now.or(of_part));
        let turns = increments.into_iter().flat_map(|increments| increments.accelerations(state));
        for (past, turn) in self.past_turns.iter_mut().zip(turns) {
            let [driven, free] = std::mem::replace(past, [turn.driven, turn.free]);
            let of_spin = (turn.free - free) * (h2 * h2 * turn.spin.squared() * FREE_SPIN_ERROR);
            if self.scene.moves(turn.slot as usize) {
                let of_moments = turn.lead * (2.0 * h2 * step.length * SLOPE_STEPS as f64);
                now.take(SlotKind::Rotation, (turn.driven - driven) * factor + of_spin - of_moments, Vec3::ZERO);
            }
        }
        let now = now.root();
        self.sum.displacement += now.displacement;
        self.sum.rotation += now.rotation;
        self.sum.moved = self.sum.moved.max(now.moved);
    }

    /// True if the sum of local errors, extrapolated to the end of the stage, is large enough to
    /// carry the error.
    fn is_worth_carrying(&self) -> bool {
        let Largest { displacement, rotation, moved } = self.sum;
        let done = self.steps as f64 / self.of_steps;
        let ahead = 1.0 / done.min(1.0);
        let displacement = displacement + self.scene.longest_offset() * rotation;
        let is_large = displacement * ahead > MIN_RELATIVE_ERROR * moved || rotation * ahead > MIN_ROTATION_ERROR;
        is_large && self.steps >= MIN_STEPS && done >= MIN_STAGE_SHARE && self.scene.kinds.len() <= MAX_SLOTS_CARRIED
    }

    /// Carries errors into the complement chart for the total rotation vectors of a state that are
    /// about to change theirs.
    pub fn change_charts(&mut self, state: &State, rotations: &[Slot]) {
        match &mut self.carried {
            Some(carried) => carried.change_charts(state, rotations),
            None => {
                let switches = |slot: &&Slot| is_to_switch(state.q[**slot as usize]);
                rotations.iter().filter(switches).for_each(|&slot| self.past[slot as usize] = UNKNOWN);
            }
        }
    }

    /// The largest errors so far.
    pub fn largest(&self) -> Largest {
        let Largest { displacement, rotation, moved } =
            self.carried.as_ref().map_or(Largest::default(), |carried| carried.largest());
        Largest {
            displacement: displacement + self.sum.displacement,
            rotation: rotation + self.sum.rotation,
            moved: moved.max(self.sum.moved),
        }
    }
}

/// True if a total rotation vector is beyond the band in which it keeps its chart.
pub(super) fn is_to_switch(p: Vec3) -> bool {
    p.squared() > (PI + DYNAMIC_BAND) * (PI + DYNAMIC_BAND)
}
