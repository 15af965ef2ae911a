//! The error of fixed time steps, integrated through a stage beside the motion itself.
//!
//! The local error of a step is known to first order from accelerations (adaptive steps are chosen
//! by it). Its growth and decay follow the linearised equations of motion: the scheme itself
//! carries the error e of the unknowns from step to step, with the tangent that Newton's method has
//! factorised already.
//!
//! ```text
//! e1  = e0 + h e0' + h^2 [(1/2 - beta) E0 + beta E1]
//! e1' = e0' + h [(1 - gamma) E0 + gamma E1]
//! (1 - alpha_m) E1 + alpha_m E0 = (1 - alpha_f) e1'' + alpha_f e0''
//! K e1 + C e1' + M e1'' = 0
//! ```
//!
//! With e^ for e1 where e1'' = 0, and J = K + c1 C + c2 M, balance is J e1 = M c2 e^ + C (c1 e^ -
//! e^'). A step costs one evaluation of inertia and damping and one substitution. At its end it
//! adds its own local errors, with d = alpha_m - alpha_f:
//!
//! ```text
//! tau  = (1/6 - beta - d/2) h^3 q'''
//! tau' = (1/2 - gamma - d) h^2 q''' + [1/6 - d (alpha_m - 1/2) - gamma (1/2 + d)] h^3 q''''
//! ```
//!
//! The derivatives are slopes of accelerations over several steps.
//!
//! The error of steps with a stage in their middle (Lobatto IIIA) is carried by the trapezoidal rule,
//! with a tangent of its own. Where the acceleration is f(q, v), with the slopes f_q and f_v, and c =
//! h^4/720, the defect of the collocation leaves
//!
//! ```text
//! tau = h c q^(5)        tau' = h c [5/4 (f_q q^(4) + f_v q^(5)) - 1/4 q^(6)]
//! ```
//!
//! which is h c q^(6) in a linear system. For the first part of tau', stiffness and damping act on e +
//! 5/4 c q^(4) and its rate in the place of e. The derivatives come from second differences of
//! accelerations within steps, and from their changes from step to step.
//!
//! The error of a motion that steps
//! do not resolve is bounded by the size of the motion, which a linear equation does not know;
//! slopes over several steps do not see it.

use super::alpha::LOBATTO_ERROR;
use super::time_error::{Correct, Largest, MassCentre, Scene, StepEnds, is_to_switch};
use super::{Increments, Method, Scheme, Stages, Step};
use crate::kernel::Weights;
use crate::kernel::turn::{StartChange, Stretch, Turn};
use crate::model::{Assembly, SlotKind};
use crate::rotation::{Complement, Rotation, log, relative_angle};
use crate::system::{Category, DofMap, Field, Slot, State, System};
use crate::tensor::Vec3;
use crate::threads::{self, PART};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The number of steps over which slopes of accelerations are taken.
pub(super) const SLOPE_STEPS: usize = 4;

/// The local error of a step of increments over h^4 w^2 times the change of the acceleration of a
/// free spin; without unit, measured on bodies that turn about their intermediate principal axes.
pub(super) const FREE_SPIN_ERROR: f64 = 1.0 / 8.0;

/// The error of a rotation, in radians, that is not compared with how far it has turned.
const SMALL_ANGLE: f64 = 0.1;

/// The size of the error, in radians or over the length of the scene, to which the carried error is
/// scaled for a difference quotient of the forces of rates.
const SCALED_ERROR: f64 = 1e-6;

/// The bound of a carried error, over the sum of the sizes of local errors. A larger one has grown
/// from round-off or second-order terms in an unstable motion (a body about its intermediate axis),
/// not from errors of the motion.
const MAX_GROWTH: f64 = 800.0;
/// The bound of a carried error, over the sum of the sizes of local errors, where accelerations
/// change sign from step to step: in a turning frame, frequencies far above those that steps
/// resolve let the carried error grow by itself.
const MAX_GROWTH_RINGING: f64 = 8.0;
/// The share of ringing accelerations in the sum of local errors from which on
/// [`MAX_GROWTH_RINGING`] holds.
const RINGING_SHARE: f64 = 0.05;

/// The error of the steps of a stage, from the step on after which it is carried.
#[derive(Clone, Deserialize, Serialize)]
pub(super) struct CarriedError {
    #[serde(skip)]
    pub(super) kinds: Arc<Vec<SlotKind>>,
    #[serde(skip)]
    pub(super) centres: Arc<Vec<MassCentre>>,
    length: f64,
    slots: Vec<SlotError>,
    step: Step,
    /// The length of the step before the present one
    before: f64,
    /// Velocities and accelerations, changed by the scaled error
    rates: [Field; 2],
    /// Forces of the changed rates, then the forces of inertia and damping on the error; by
    /// category and slot
    force: [Vec<Vec3>; 4],
    /// Errors at the end of the present step of rotations whose unknowns are increments: error,
    /// rate, rate2 and algorithmic of [`SlotError`]
    #[serde(skip)]
    turned: Vec<(Slot, [Vec3; 4])>,
    /// The factor that scales the error to [`SCALED_ERROR`]; zero while there is no error
    scaling: f64,
    known: Known,
    /// The impulses that means of forces at instants of the last steps have missed where forces
    /// jumped, by slot (internal, spatial), and that have not yet acted on the error
    missed: Vec<(Slot, Vec3)>,
    /// True if forces have jumped
    has_jumped: bool,
    /// The number of steps
    steps: usize,
    /// The lengths of the last steps, each at the index of its number modulo [`SLOPE_STEPS`]
    lengths: [f64; SLOPE_STEPS],
    largest: Largest,
    /// The sizes of local errors summed over the steps: of all, and of those of ringing
    /// accelerations
    sums: [Largest; 2],
}

/// The largest part of the motion in a step that its local error is. That of an oscillation with five steps a period is
/// an eighth.
const MOST_OF_MOTION: f64 = 0.5;

/// A vector, but not longer than `most`.
fn at_most(vector: Vec3, most: f64) -> Vec3 {
    let size = vector.norm();
    if size > most { vector * (most / size) } else { vector }
}

/// The quantities of the present step that have been computed.
#[derive(Clone, Copy, PartialEq, Deserialize, Serialize)]
enum Known {
    /// No quantity
    Nothing,
    /// The forces of inertia and damping on the error
    Forces,
    /// The error at the end of the step
    Error,
}

/// The error of a slot. That of a rotation whose unknown is an increment is a material rotation
/// vector, with the material errors of the spin and its rate, and the spatial error of the rate of
/// the momentum that it carries.
#[derive(Clone, Copy, Default, Deserialize, Serialize)]
struct SlotError {
    /// e at the end of the last step
    error: Vec3,
    /// e' at the end of the last step
    rate: Vec3,
    /// e'' at the end of the last step
    rate2: Vec3,
    /// E at the end of the last step
    algorithmic: Vec3,
    /// [`StepEnds::rate_of_error`] at the ends of the last steps, each at the index of its number
    /// modulo [`SLOPE_STEPS`]
    past: [Vec3; SLOPE_STEPS],
    /// The last slope of that rate; before slopes are complete the one at the start
    slope: Vec3,
    /// q at the start of the stage
    start: Vec3,
    /// True if accelerations of the slot are determined by mass
    moves: bool,
    /// The part of an error, and of its rate, on which stiffness and damping act in the next step as
    /// if it were there; zero without a stage in the middle
    apparent: [Vec3; 2],
    /// The number of steps whose rates of errors are known, up to [`SLOPE_STEPS`]
    age: u8,
}

/// e1, e1' and E1 for a step that ends with e1'' = 0.
struct Predicted {
    error: Vec3,
    rate: Vec3,
    algorithmic: Vec3,
}

impl SlotError {
    #[inline(always)]
    fn predicted(&self, step: &Step, stretch: Stretch) -> Predicted {
        let Scheme { beta, gamma, alpha_m, alpha_f, .. } = step.scheme;
        let h = step.length;
        let own = self.algorithmic;
        // Of an error all of the lag is taken for smooth: fixed steps change their length rarely, and an
        // error that is too large is told rather than one that is too small.
        let old = stretch.of_smooth(own, self.rate2);
        let new = (self.rate2 * alpha_f - old * alpha_m) * (1.0 / (1.0 - alpha_m));
        Predicted {
            error: self.error + self.apparent[0] + self.rate * h + (old * (0.5 - beta) + new * beta) * (h * h),
            rate: self.rate + self.apparent[1] + (old * (1.0 - gamma) + new * gamma) * h,
            algorithmic: new,
        }
    }

    /// The size of the error of a rotation that is now `q`, but no more than twice the angle from its start: a linear
    /// equation does not know that what turns to and fro errs by no more. The largest over all steps is told.
    #[inline(always)]
    fn bounded_by_angle(&self, error: Vec3, q: Vec3) -> f64 {
        let size = error.norm();
        if size <= SMALL_ANGLE {
            return size;
        }
        size.min(SMALL_ANGLE.max(2.0 * relative_angle(Rotation::new(self.start).r, Rotation::new(q).r)))
    }

    /// A step of a rotation that starts with `part` times the error, and the increment with which
    /// it ends at the end of the step without error, whose increment is `x`.
    fn changed(&self, turn: &Turn, x: Vec3, stretch: Stretch, part: f64) -> (Turn, Vec3) {
        let by = StartChange {
            turned: self.error * part,
            omega: self.rate * part,
            acceleration: self.rate2 * part,
            algorithmic: self.algorithmic * part,
        };
        (turn.changed(&by, stretch), log(Rotation::new(-by.turned).r * Rotation::new(x).r))
    }
}

impl CarriedError {
    /// Begins with an error of zero in a state at the end of `step`; `start` is q at the start of
    /// the stage, and `force` gives the sizes of lists of forces by category.
    pub fn new(scene: &Scene, force: [Vec<Vec3>; 4], state: &State, start: &[Vec3], step: Step) -> Self {
        let of_slot = |slot: usize| SlotError { moves: scene.moves(slot), start: start[slot], ..SlotError::default() };
        Self {
            kinds: scene.kinds.clone(),
            centres: scene.centres.clone(),
            length: scene.length,
            slots: threads::list(scene.kinds.len(), of_slot),
            before: step.length,
            rates: [state.v.clone(), state.a.clone()],
            force,
            turned: Vec::new(),
            scaling: 0.0,
            known: Known::Nothing,
            missed: Vec::new(),
            has_jumped: false,
            steps: 0,
            lengths: [step.length; SLOPE_STEPS],
            largest: Largest::default(),
            sums: [Largest::default(); 2],
            step,
        }
    }

    /// Begins an attempt at a step; `before` is the length of the step before.
    pub fn begin(&mut self, step: &Step, before: f64) {
        self.step = *step;
        self.before = before;
        self.known = Known::Nothing;
    }

    /// The change of the length of the present step.
    fn stretch(&self) -> Stretch {
        Stretch::new(self.step.length, self.before, self.step.scheme.lag())
    }

    /// True if the error is not zero.
    pub fn has_error(&self) -> bool {
        self.scaling > 0.0
    }

    /// The weights of the tangent that carries the error.
    pub fn weights(&self) -> Weights {
        self.step.weights()
    }

    /// True if [`Self::look`] has not been called in the present step.
    pub fn knows_no_forces(&self) -> bool {
        self.known == Known::Nothing
    }

    /// Computes the forces of inertia and damping on the error by difference quotients, at the
    /// state of the present tangent. The forces of the system must be those of that state; they are
    /// kept.
    pub fn look(&mut self, assembly: &mut Assembly, state: &mut State, weights: Weights) {
        if self.scaling == 0.0 {
            return;
        }
        self.known = Known::Forces;
        self.change_rates(state, weights);
        self.swap_rates(state);
        assembly.evaluate_rates(state, &mut self.force);
        self.swap_rates(state);
        let system = &assembly.system;
        let factor = 1.0 / self.scaling;
        let [_, inertia, _, damping] = &mut self.force;
        threads::each_part(inertia, |start, part| {
            for (slot, force) in (start..).zip(part) {
                *force = (*force - system.part_of(Category::Inertia, slot)) * factor;
            }
        });
        if !damping.is_empty() {
            threads::each_part(inertia, |start, part| {
                for ((slot, force), damping) in (start..).zip(part).zip(&damping[start..]) {
                    *force += (*damping - system.part_of(Category::Damping, slot)) * factor;
                }
            });
        }
    }

    /// Sets the changed rates: those of the state less those of the scaled error that is zero at
    /// the end of the step.
    fn change_rates(&mut self, state: &State, weights: Weights) {
        let stretch = self.stretch();
        let Self { slots, rates: [v, a], scaling, step, .. } = self;
        let slots = &slots[..];
        let step = &*step;
        let scaling = *scaling;
        v.copy_from(&state.v);
        a.copy_from(&state.a);
        let v = &mut v[..];
        let a = &mut a[..];
        threads::each(v.chunks_mut(PART).zip(a.chunks_mut(PART)).enumerate(), |(number, (v, a))| {
            let of_part = v.iter_mut().zip(a).zip(&slots[PART * number..]);
            for ((v, a), slot) in of_part.filter(|(_, slot)| slot.moves) {
                let Predicted { error, rate, .. } = slot.predicted(step, stretch);
                *v += (error * weights.damping - rate) * scaling;
                *a += error * (weights.mass * scaling);
            }
        });
        for (k, turn) in turns(state) {
            let (turn, x) = slots[k].changed(turn, state.q[k], stretch, scaling);
            let (omega, acceleration) = turn.rates(x);
            v[k] = state.v[k] * 2.0 - omega;
            a[k] = state.a[k] * 2.0 - acceleration;
        }
    }

    fn swap_rates(&mut self, state: &mut State) {
        let [v, a] = &mut self.rates;
        std::mem::swap(&mut state.v, v);
        std::mem::swap(&mut state.a, a);
    }

    /// Solves for the error at the end of a step in balance, with the factors of its tangent, and
    /// writes it to `error`. Without usable factors nothing is found.
    pub fn solve(&mut self, correct: &mut Correct, system: &mut System, state: &State, error: &mut [Vec3]) {
        if self.known != Known::Forces {
            return;
        }
        // The solver sums the forces of all categories: those of the others are subtracted from the
        // forces on the error.
        const INERTIA: usize = Category::Inertia as usize;
        // Internal forces act against the true motion, and so against the error, which is the true motion
        // less that of the steps.
        for &(slot, impulse) in &self.missed {
            self.force[INERTIA][slot as usize] -= impulse * (1.0 / self.step.length);
        }
        threads::each_part(&mut self.force[INERTIA], |start, part| {
            for (slot, force) in (start..).zip(part) {
                let others = system.total(slot) - system.part_of(Category::Inertia, slot);
                *force = -(*force + others);
            }
        });
        std::mem::swap(&mut system.force[INERTIA], &mut self.force[INERTIA]);
        let solved = correct(system, error);
        std::mem::swap(&mut system.force[INERTIA], &mut self.force[INERTIA]);
        if solved {
            self.known = Known::Error;
            self.find_turned(state, error);
        }
    }

    /// Converts the errors of increments of rotation in `error` to errors of rotations and their
    /// rates.
    fn find_turned(&mut self, state: &State, error: &[Vec3]) {
        let stretch = self.stretch();
        let Self { slots, turned, scaling, .. } = self;
        turned.clear();
        for (k, turn) in turns(state) {
            let x = state.q[k];
            let omega = state.v[k];
            let acceleration = state.a[k];
            let (changed, same) = slots[k].changed(turn, x, stretch, *scaling);
            let other = same + error[k] * *scaling;
            let (other_omega, other_acceleration) = changed.rates(other);
            let ahead = Rotation::new(slots[k].error * *scaling).r * Rotation::new(other).r;
            let changes = [
                log(Rotation::new(x).r.transpose() * ahead),
                other_omega - omega,
                other_acceleration - acceleration,
                changed.algorithmic(other, other_omega) - turn.algorithmic(x, omega),
            ];
            turned.push((k as Slot, changes.map(|change| change * (1.0 / *scaling))));
        }
    }

    /// Takes over what the mean of forces at instants of the step has missed, by slot. What was
    /// missed before acts no more once it is in the error.
    pub fn miss(&mut self, missed: Vec<(Slot, Vec3)>) {
        if self.known == Known::Error {
            self.missed.clear();
        }
        self.has_jumped |= !missed.is_empty();
        self.missed.extend(missed.into_iter().map(|(slot, force)| (slot, force * self.step.length)));
    }

    /// Ends a step between two states in one chart, with the `error` that [`Self::solve`] has
    /// found, and adds the local errors.
    pub fn end(&mut self, dof_map: &DofMap, error: &[Vec3], step_ends: StepEnds, increments: Option<&Increments>) {
        let to = step_ends.to;
        let Step { scheme, length: h } = self.step;
        let stretch = self.stretch();
        let weights = self.step.weights();
        self.steps += 1;
        let own = self.steps % SLOPE_STEPS;
        self.lengths[own] = h;
        let local = LocalErrors::new(&self.step, own, self.lengths.iter().sum(), self.before);
        // Without a solution the error is kept: a free continuation would exaggerate errors of
        // stiff motions.
        let found = self.known == Known::Error;
        let Self { kinds, slots, step, .. } = self;
        let work = |(number, part): (usize, &mut [SlotError])| {
            let mut largest = Largest::default();
            let mut told_angle = 0.0f64;
            let mut sizes = [Largest::default(); 2];
            for (k, slot) in (PART * number..).zip(part) {
                let kind = kinds[k];
                if kind.is_multiplier() || (kind == SlotKind::Rotation && increments.is_some()) {
                    continue;
                }
                if found && slot.moves {
                    let predicted = slot.predicted(step, stretch);
                    let x = error[k] - predicted.error;
                    slot.error = error[k] - slot.apparent[0];
                    slot.rate = predicted.rate + x * weights.damping - slot.apparent[1];
                    slot.rate2 = x * weights.mass;
                    slot.algorithmic = predicted.algorithmic + x * (1.0 / (scheme.beta * h * h));
                } else if found {
                    slot.error = error[k];
                }
                let mut now = slot.error;
                if slot.moves {
                    let ends = local.rates(slot, &step_ends, k);
                    let rings = local.rings(slot, ends);
                    let mean = (to.q[k] - step_ends.from.q[k]).norm() * (1.0 / h);
                    let fastest = mean.max(step_ends.from.v[k].norm()).max(to.v[k].norm());
                    let [mut of_place, mut of_rate] = local.within(fastest, local.of(slot, ends));
                    if !dof_map.is_plain(k as Slot) {
                        for error in [&mut of_place, &mut of_rate].into_iter().chain(&mut slot.apparent) {
                            *error -= dof_map.held_part(k as Slot, *error);
                        }
                    }
                    // The error of a rate has no effect on places before the end of the next step.
                    now += of_place;
                    take_size(&mut sizes, kind, of_place, rings);
                    slot.error += of_place - of_rate * h;
                    slot.rate += of_rate;
                }
                let moved = if kind == SlotKind::Displacement { to.q[k] - slot.start } else { Vec3::ZERO };
                // Rotations without inertia follow what has inertia.
                if kind != SlotKind::Rotation || slot.moves {
                    largest.take(kind, now, moved);
                }
                if kind == SlotKind::Rotation && slot.moves {
                    told_angle = told_angle.max(slot.bounded_by_angle(now, to.q[k]));
                }
            }
            (largest, told_angle, sizes)
        };
        let mut now = Largest::default();
        let mut told_angle = 0.0f64;
        let mut sizes = [Largest::default(); 2];
        let gather = |(largest, angle, [all, ringing]): (Largest, f64, [Largest; 2])| {
            now = now.or(largest);
            told_angle = told_angle.max(angle);
            sizes = [sizes[0].or(all), sizes[1].or(ringing)];
        };
        threads::in_order(slots.chunks_mut(PART).enumerate(), work, gather);
        if let Some(increments) = increments {
            let angle = self.end_turns(increments, step_ends, &local, &mut now, &mut sizes);
            told_angle = told_angle.max(angle);
        }
        for centre in self.centres.iter() {
            let [error, moved] = self.of_centre(centre, to, increments.is_some());
            now.take(SlotKind::Displacement, error, moved);
        }
        let now = now.root();
        for (sum, size) in self.sums.iter_mut().zip(sizes) {
            let size = size.root();
            sum.displacement += size.displacement;
            sum.rotation += size.rotation;
        }
        self.largest = self.largest.or(Largest { rotation: told_angle, ..now });
        let size = (now.displacement / self.length).max(now.rotation);
        self.scaling = if size > 0.0 { SCALED_ERROR / size } else { 0.0 };
    }

    /// The error of a mass centre, and how it has moved since the start of the stage.
    fn of_centre(&self, centre: &MassCentre, to: &State, is_material: bool) -> [Vec3; 2] {
        let MassCentre { place, rotation, offset } = *centre;
        let [place_error, turn] = [place, rotation].map(|slot| &self.slots[slot as usize]);
        let Rotation { r, t, .. } = Rotation::new(to.q[rotation as usize]);
        let material = if is_material { turn.error } else { t * turn.error };
        let moved = to.q[place as usize] - place_error.start + r * offset - Rotation::new(turn.start).r * offset;
        // What turns about a node errs by no more than across.
        let about_node = material.cross(offset);
        let most = (2.0 * offset.norm() / about_node.norm()).min(1.0);
        [place_error.error + r * about_node * most, moved]
    }

    /// Ends a step of the rotations whose unknowns are increments: takes the largest error and the
    /// sizes of local errors. Returns the largest error that is told.
    fn end_turns(
        &mut self,
        increments: &Increments,
        StepEnds { from, to, .. }: StepEnds,
        local: &LocalErrors,
        largest: &mut Largest,
        sizes: &mut [Largest; 2],
    ) -> f64 {
        let mut told_angle = 0.0f64;
        let found = self.known == Known::Error;
        let h = self.step.length;
        for (slot, turned) in self.turned.drain(..).filter(|_| found) {
            let slot = &mut self.slots[slot as usize];
            [slot.error, slot.rate, slot.rate2, slot.algorithmic] = turned;
        }
        for (before, after) in increments.accelerations(from).zip(increments.accelerations(to)) {
            let slot = &mut self.slots[after.slot as usize];
            if slot.moves {
                let q = to.q[after.slot as usize];
                let ends = [before.driven, after.driven];
                let rings = local.rings(slot, ends);
                let fastest = before.spin.norm().max(after.spin.norm());
                let [of_place, of_rate] = local.within(fastest, local.of(slot, ends));
                let of_spin = (after.free - before.free) * (h.powi(4) * after.spin.squared() * FREE_SPIN_ERROR);
                let back = Rotation::new(q).r.transpose();
                // Of h^3/6 (mu' + phi') the step leaves out what moments do to phi, which is -12 lead.
                let of_moments = after.lead * (-2.0 * h.powi(3));
                let rate_of_moments = (after.lead - before.lead) * (-2.0 * h * h);
                let of_step = of_place + of_spin + of_moments;
                take_size(sizes, SlotKind::Rotation, of_step, rings);
                let now = slot.error + back * of_step;
                slot.error = now - back * ((of_rate + rate_of_moments) * h);
                slot.rate += back * (of_rate + rate_of_moments);
                told_angle = told_angle.max(slot.bounded_by_angle(now, q));
                largest.take(SlotKind::Rotation, now, Vec3::ZERO);
            }
        }
        told_angle
    }

    /// Carries errors into the complement chart for the total rotation vectors of a state that are
    /// about to change theirs.
    pub fn change_charts(&mut self, state: &State, rotations: &[Slot]) {
        for &slot in rotations {
            let k = slot as usize;
            let p = state.q[slot as usize];
            if !is_to_switch(p) {
                continue;
            }
            let Complement { b, b_rate, b_rate2, .. } = Complement::new(p, state.v[k], state.a[k]);
            let slot = &mut self.slots[k];
            let drift = (b_rate * slot.rate) * 2.0 + b_rate2 * slot.error;
            slot.rate2 = b * slot.rate2 + drift;
            slot.algorithmic = b * slot.algorithmic + drift;
            slot.rate = b * slot.rate + b_rate * slot.error;
            slot.error = b * slot.error;
            slot.apparent = [Vec3::ZERO; 2];
            slot.age = 0;
        }
    }

    /// The largest errors so far, bounded by multiples of the sum of local errors.
    pub fn largest(&self) -> Largest {
        let [all, ringing] = self.sums;
        let rings =
            ringing.displacement > RINGING_SHARE * all.displacement || ringing.rotation > RINGING_SHARE * all.rotation;
        let most = if self.has_jumped || !places_bound_rates(&self.step.scheme) {
            f64::INFINITY
        } else if rings {
            MAX_GROWTH_RINGING
        } else {
            MAX_GROWTH
        };
        let longest = MassCentre::longest(&self.centres);
        // Slots without mass have no local errors of their own.
        let bounded = |error: f64, sum: f64| if sum > 0.0 { error.min(most * sum) } else { error };
        Largest {
            displacement: bounded(self.largest.displacement, all.displacement + longest * all.rotation),
            rotation: bounded(self.largest.rotation, all.rotation),
            moved: self.largest.moved,
        }
    }
}

/// True if local errors of places bound those of rates: not in a scheme of first order, nor with a
/// beta near 1/6, nor with a stage in the middle of steps.
fn places_bound_rates(scheme: &Scheme) -> bool {
    let lag = scheme.lag();
    match scheme.stages {
        Stages::End => (0.5 - scheme.gamma - lag).abs() < 1e-9 && (1.0 / 6.0 - scheme.beta - 0.5 * lag).abs() > 0.04,
        Stages::MiddleAndEnd => false,
    }
}

/// Updates the largest local errors of a step, all and those of ringing accelerations, with one of
/// size `size`.
#[inline(always)]
fn take_size([all, ringing]: &mut [Largest; 2], kind: SlotKind, size: Vec3, rings: bool) {
    all.take(kind, size, Vec3::ZERO);
    if rings {
        ringing.take(kind, size, Vec3::ZERO);
    }
}

/// The steps of the rotations whose unknowns are increments, with their slots.
fn turns(state: &State) -> impl Iterator<Item = (usize, &Turn)> {
    state.turns.iter().enumerate().filter_map(|(k, turn)| Some((k, turn.as_ref()?)))
}

/// The coefficients of the local errors of a step.
struct LocalErrors {
    /// See [`Step::error_factors`]
    factors: [f64; 3],
    /// The factor of the rate of the error in [`SlotError::apparent`]
    of_apparent: f64,
    /// The length of the step
    length: f64,
    /// The number of steps over which slopes are taken
    steps: usize,
    /// The number of steps whose slopes change by their own completion, not with the motion
    settling: usize,
    /// The index of the step in lists of the last steps
    place: usize,
    /// One over the sum of the lengths of the steps of a slope, 1/time
    per_span: f64,
    /// True for the first step of its length, whose second differences do not compare with those before
    is_first: bool,
    /// The first slope of rates, where those over several steps come late
    start: Option<FirstSlope>,
}

/// The slope of a rate at the start of the first of two steps.
struct FirstSlope {
    /// The lengths of both steps
    lengths: [f64; 2],
}

impl FirstSlope {
    /// From the rate at the start and after each of both steps: of a parabola, or that of the first step where the rate
    /// turns round, since a parabola would overshoot.
    fn slope(&self, [start, middle, end]: [Vec3; 3]) -> Vec3 {
        let [first, second] = self.lengths;
        let [slope, next] = [(middle - start) * (1.0 / first), (end - middle) * (1.0 / second)];
        let turns_round = slope.dot(next) < 0.0;
        if turns_round { slope } else { slope - (next - slope) * (first / (first + second)) }
    }
}

impl LocalErrors {
    /// Of a step whose index in lists of the last steps is `place`. With it the last [`SLOPE_STEPS`] have
    /// taken the time `span`; the one before took `before`.
    fn new(step: &Step, place: usize, span: f64, before: f64) -> Self {
        let factors = step.error_factors();
        let length = step.length;
        match step.scheme.stages {
            Stages::End => {
                let [steps, settling] = [SLOPE_STEPS; 2];
                let per_span = 1.0 / span;
                let start = Some(FirstSlope { lengths: [before, length] });
                Self { factors, of_apparent: 0.0, length, steps, settling, place, per_span, is_first: false, start }
            }
            // Such steps are long: slopes over several would miss much of the motion.
            Stages::MiddleAndEnd => {
                let of_apparent = 1.25 * LOBATTO_ERROR * length.powi(4);
                let is_first = length != before;
                let per_span = 1.0 / length;
                Self { factors, of_apparent, length, steps: 1, settling: 2, place, per_span, is_first, start: None }
            }
        }
    }

    /// The index of an earlier step in lists of the last steps.
    fn earlier(&self, steps: usize) -> usize {
        (self.place + SLOPE_STEPS - steps) % SLOPE_STEPS
    }

    /// The rates of the error of a slot at both ends of the step. A second difference belongs to a
    /// whole step: that before the first one is taken to be the same.
    #[inline(always)]
    fn rates(&self, slot: &SlotError, step_ends: &StepEnds, k: usize) -> [Vec3; 2] {
        let after = step_ends.rate_of_error(k);
        let before = match step_ends.middle {
            None => step_ends.from.a[k],
            Some(_) if slot.age == 0 || self.is_first => after,
            Some(_) => slot.past[self.earlier(1)],
        };
        [before, after]
    }

    /// True if the change of the rate of an error reverses from step to step.
    #[inline(always)]
    fn rings(&self, slot: &SlotError, [before, after]: [Vec3; 2]) -> bool {
        let earlier = slot.past[self.earlier(2)];
        slot.age > 1 && (after - before).dot(before - earlier) < 0.0
    }

    /// The local errors of a slot whose rate is not larger than `fastest`, but no more than [`MOST_OF_MOTION`] of how far
    /// the step moves it, and of that rate. Accelerations of what is damped faster than steps resolve are far larger
    /// than its motion.
    fn within(&self, fastest: f64, [of_place, of_rate]: [Vec3; 2]) -> [Vec3; 2] {
        let most = MOST_OF_MOTION * fastest;
        [at_most(of_place, most * self.length), at_most(of_rate, most)]
    }

    /// How far the slope of a slot has changed to `slope`. A change that is missed at the start moves what nothing holds for
    /// the whole stage.
    fn change(&self, slot: &SlotError, slope: Vec3) -> Vec3 {
        let change = slope - slot.slope;
        let is_known = match self.start {
            Some(_) => usize::from(slot.age) + 1 >= self.settling,
            None => usize::from(slot.age) >= self.settling,
        };
        // Without a slope of the start the first change stands for the one before it, too.
        let stands_for_two = self.start.is_none() && usize::from(slot.age) == self.settling;
        if !is_known {
            Vec3::ZERO
        } else if stands_for_two {
            change * 2.0
        } else {
            change
        }
    }

    /// The slope that the next one is compared with: that of the start until slopes are complete.
    fn kept_slope(&self, slot: &SlotError, slope: Vec3, [before, after]: [Vec3; 2]) -> Vec3 {
        let age = usize::from(slot.age);
        let Some(start) = &self.start else { return slope };
        if age == 1 {
            start.slope([slot.past[self.earlier(2)], before, after])
        } else if age > 1 && age + 1 < self.settling {
            slot.slope
        } else {
            slope
        }
    }

    /// The local errors tau and tau', from the rates of the error at both ends of the step.
    #[inline(always)]
    fn of(&self, slot: &mut SlotError, [before, after]: [Vec3; 2]) -> [Vec3; 2] {
        if self.is_first {
            slot.age = 0;
        }
        if slot.age == 0 {
            // Rates before the first step are taken to be those at its start.
            slot.past = [before; SLOPE_STEPS];
        }
        let slope = (after - slot.past[self.earlier(self.steps)]) * self.per_span;
        let change = self.change(slot, slope);
        slot.slope = self.kept_slope(slot, slope, [before, after]);
        slot.age = (SLOPE_STEPS as u8).min(slot.age + 1);
        slot.past[self.place] = after;
        slot.apparent = [after + slope * self.length, slope].map(|rate| rate * self.of_apparent);
        let [of_place, of_rate, of_change] = self.factors;
        [slope * of_place, slope * of_rate + change * of_change]
    }
}
