//! The estimated error of the fixed steps of a stage.
//!
//! A step leaves tau = (1/6 - beta - d/2) h^3 q''' out of a motion, d = alpha_m - alpha_f. In all
//! steps the sizes of these sum up to
//! |1/6 - beta - d/2| h^2 times the way that accelerations take, which is 2/pi of the error of an oscillation: errors of its phase add up,
//! one quarter period like the other. Where that sum stays far below what is worth a warning
//! nothing else is done; where it will not, and in small scenes, where errors may grow by
//! themselves, the error is carried along with the motion (`carried_error`).

use super::carried_error::{CarriedError, FREE_SPIN, WIDTH};
use super::{Increments, Scheme, Step};
use crate::kernel::Weights;
use crate::model::charts::DYNAMIC_BAND;
use crate::model::{Assembly, Model, SlotKind};
use crate::system::{DofMap, Field, Slot, State, System};
use crate::tensor::Vec3;
use crate::threads::{self, PART};
use std::f64::consts::PI;
use std::sync::Arc;

/// Errors of scenes with no more slots are carried along from the start of a stage.
const FEW_SLOTS: usize = 100;

/// Errors of larger scenes are not carried along, which would take a quarter of their memory.
const MOST_SLOTS: usize = 200_000;

/// The sum of local errors, over the largest motion, for which errors are carried along where a
/// stage would come to it at its present rate.
const WORTH_CARRYING: f64 = 0.02;
/// The sum of local errors of rotations, in radians, for which errors are carried along, likewise.
const WORTH_CARRYING_TURNS: f64 = 0.1;

/// Steps, and the part of a stage, after which that rate is believed: at first little has moved
/// yet.
const FIRST_STEPS: usize = 4 * WIDTH;
const FIRST_PART: f64 = 0.125;

/// The largest errors so far, and what they are compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Largest {
    /// Error of a displacement
    pub displacement: f64,
    /// Error of a rotation, in radians
    pub rotation: f64,
    /// How far a node has gone since the stage began
    pub moved: f64,
}

impl Largest {
    /// Takes a slot into squares of these.
    #[inline(always)]
    pub(super) fn take(&mut self, kind: SlotKind, error: Vec3, moved: Vec3) {
        let of_kind = if kind == SlotKind::Displacement { &mut self.displacement } else { &mut self.rotation };
        *of_kind = of_kind.max(error.squared());
        self.moved = self.moved.max(moved.squared());
    }

    /// Takes the roots of squares.
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

/// Finds the correction that the forces of a system ask for with the factors of its tangent;
/// `false` where there are none.
pub type Correct<'a> = dyn FnMut(&System, &mut [Vec3]) -> bool + 'a;

/// What is needed to know of a scene.
pub(super) struct Scene {
    pub kinds: Arc<Vec<SlotKind>>,
    pub length: f64,
    /// For each slot whether its accelerations mean something
    massive: Vec<bool>,
}

impl Scene {
    /// Whether the accelerations of a slot mean something.
    pub fn moves(&self, slot: usize) -> bool {
        self.massive[slot] && !self.kinds[slot].is_multiplier()
    }
}

/// The error of the steps of a stage.
pub struct TimeError {
    scene: Scene,
    /// q where the stage began
    start: Vec<Vec3>,
    /// Accelerations where the sum was taken last; not a number where they are those of another
    /// chart
    past: Field,
    /// Of rotations whose unknowns are increments those from moments and from their own spin,
    /// spatial
    past_turns: Vec<[Vec3; 2]>,
    /// How many steps there were, of how many
    steps: usize,
    of_steps: f64,
    /// The longest step since the sum was taken last, once there is one
    longest: Option<Step>,
    /// The sizes of local errors, summed over the steps before the error was carried along
    sum: Largest,
    carried: Option<Box<CarriedError>>,
}

impl TimeError {
    /// For a stage that begins in a state, with a first step, and lasts for `duration`; `massive`
    /// tells for each slot whether its accelerations mean something.
    pub fn new(
        model: &Model,
        assembly: &Assembly,
        (state, increments): (&State, Option<&Increments>),
        massive: &[bool],
        (first, duration): (Step, f64),
    ) -> Self {
        let scene = Scene { kinds: model.kinds.clone(), length: model.length, massive: massive.to_vec() };
        let mut error = Self {
            scene,
            start: state.q.clone(),
            past: state.a.clone(),
            past_turns: increments
                .into_iter()
                .flat_map(|increments| increments.accelerations(state))
                .map(|a| [a.driven, a.free])
                .collect(),
            steps: 0,
            of_steps: duration / first.length,
            longest: None,
            sum: Largest::default(),
            carried: None,
        };
        if model.slots() <= FEW_SLOTS {
            error.carry(&assembly.system, state, first);
        }
        error
    }

    fn carry(&mut self, system: &System, state: &State, step: Step) {
        self.carried = Some(Box::new(CarriedError::new(&self.scene, system.force.clone(), state, &self.start, step)));
    }

    /// An attempt at a step begins; the one before was as long as `before`.
    pub fn begin(&mut self, step: &Step, before: f64) {
        if let Some(carried) = &mut self.carried {
            carried.begin(step, before);
        }
    }

    /// Whether an error is carried along that has not seen yet what it meets in the present step.
    pub fn knows_no_forces(&self) -> bool {
        self.carried.as_ref().is_some_and(|carried| carried.knows_no_forces())
    }

    /// Looks at what the error meets of inertia and damping in the state that the tangent of the
    /// step belongs to. The forces of the system are those of that state, and stay.
    pub fn look(&mut self, assembly: &mut Assembly, state: &mut State, weights: Weights) {
        if let Some(carried) = &mut self.carried {
            carried.look(assembly, state, weights);
        }
    }

    /// The step is in balance: its tangent tells the error at its end, unless it has been given up.
    pub fn solve(&mut self, correct: &mut Correct, system: &mut System, state: &State, error: &mut [Vec3]) {
        if let Some(carried) = &mut self.carried {
            carried.solve(correct, system, state, error);
        }
    }

    /// A step is taken from one state to another, both in one chart, with the error that was found
    /// at its end.
    pub fn end(
        &mut self,
        system: &System,
        error: &[Vec3],
        states: (&State, &State),
        step: &Step,
        increments: Option<&Increments>,
    ) {
        if let Some(carried) = &mut self.carried {
            return carried.end(&system.pattern.dof_map, error, states, increments);
        }
        self.steps += 1;
        self.longest = self.longest.filter(|longest| longest.length >= step.length).or(Some(*step));
        if self.steps.is_multiple_of(WIDTH) {
            self.sum_up(&system.pattern.dof_map, states.1, increments);
            if self.is_worth_carrying() {
                self.carry(system, states.1, *step);
            }
        }
    }

    /// Adds the local errors of the steps since the sum was taken last, up to this state: after
    /// some steps, and where the stage is over.
    pub fn sum_up(&mut self, dof_map: &DofMap, state: &State, increments: Option<&Increments>) {
        let Some(step) = self.longest.take() else { return };
        let Scheme { beta, .. } = step.scheme;
        let h2 = step.length * step.length;
        let factor = (1.0 / 6.0 - beta - 0.5 * step.scheme.lag()).abs() * h2;
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
                let mut change = state.a[k] - std::mem::replace(past, state.a[k]);
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
            let of_spin = (turn.free - free) * (h2 * h2 * turn.spin.squared() * FREE_SPIN);
            if self.scene.moves(turn.slot as usize) {
                now.take(SlotKind::Rotation, (turn.driven - driven) * factor + of_spin, Vec3::ZERO);
            }
        }
        let now = now.root();
        self.sum.displacement += now.displacement;
        self.sum.rotation += now.rotation;
        self.sum.moved = self.sum.moved.max(now.moved);
    }

    /// Whether the sum of local errors comes to something by the end of the stage.
    fn is_worth_carrying(&self) -> bool {
        let Largest { displacement, rotation, moved } = self.sum;
        let done = self.steps as f64 / self.of_steps;
        let ahead = 1.0 / done.min(1.0);
        let is_large = displacement * ahead > WORTH_CARRYING * moved || rotation * ahead > WORTH_CARRYING_TURNS;
        is_large && self.steps >= FIRST_STEPS && done >= FIRST_PART && self.scene.kinds.len() <= MOST_SLOTS
    }

    /// Total rotation vectors are about to change their charts in a state: their errors go with
    /// them.
    pub fn change_charts(&mut self, state: &State, rotations: &[Slot]) {
        match &mut self.carried {
            Some(carried) => carried.change_charts(state, rotations),
            None => {
                let switches = |slot: &&Slot| is_to_switch(state.q[**slot as usize]);
                rotations.iter().filter(switches).for_each(|&slot| self.past[slot as usize] = Vec3([f64::NAN; 3]));
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

/// Whether a total rotation vector is about to change its chart.
pub(super) fn is_to_switch(p: Vec3) -> bool {
    p.squared() > (PI + DYNAMIC_BAND) * (PI + DYNAMIC_BAND)
}
