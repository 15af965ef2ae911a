//! The error that fixed steps make, followed through a stage beside the motion itself.
//!
//! What a step leaves out of the motion is known to first order from accelerations (the local
//! error, by which adaptive steps are chosen). What becomes of it is decided by the linearised
//! equations of motion: the scheme itself carries the error e of the unknowns from step to step,
//! with the tangent that Newton's method has anyway.
//!
//! ```text
//! e1  = e0 + h e0' + h^2 [(1/2 - beta) E0 + beta E1]
//! e1' = e0' + h [(1 - gamma) E0 + gamma E1]
//! (1 - alpha_m) E1 + alpha_m E0 = (1 - alpha_f) e1'' + alpha_f e0''
//! K e1 + C e1' + M e1'' = 0
//! ```
//!
//! With e^ for e1 where e1'' = 0, and J = K + c1 C + c2 M, balance is J e1 = M c2 e^ + C (c1 e^ -
//! e^'). So a step costs one evaluation of inertia and damping and one substitution. At its end it
//! adds its own local errors, with d = alpha_m - alpha_f:
//!
//! ```text
//! tau  = (1/6 - beta - d/2) h^3 q'''
//! tau' = (1/2 - gamma - d) h^2 q''' + [1/6 - d (alpha_m - 1/2) - gamma (1/2 + d)] h^3 q''''
//! ```
//!
//! The derivatives are slopes of accelerations over several steps. A motion that steps do not
//! resolve errs by its own size and no more, which a linear equation does not know; over several
//! steps nothing is seen of it.

use super::time_error::{Correct, Largest, Scene, is_to_switch};
use super::{Increments, Method, Scheme, Step};
use crate::kernel::Weights;
use crate::kernel::turn::{StartChange, Turn};
use crate::model::{Assembly, SlotKind};
use crate::rotation::{Complement, Rotation, log};
use crate::system::{Category, DofMap, Field, Slot, State, System};
use crate::tensor::Vec3;
use crate::threads::{self, PART};
use std::sync::Arc;

/// Steps over which slopes of accelerations are taken.
pub(super) const WIDTH: usize = 4;

/// The part of h^4 w^2 times the change of the acceleration of a free spin that a step of
/// increments errs by, measured on bodies that turn about their middle axes.
pub(super) const FREE_SPIN: f64 = 1.0 / 8.0;

/// The change of rates that shows how forces follow them: that of an error of this size, in radians
/// or over the length of the scene.
const NUDGE: f64 = 1e-6;

/// The most that an error is taken to grow to, over the sum of the sizes of local errors. What is
/// carried along beyond that has grown from roundoff or second-order terms in an unstable motion (a
/// body about its middle axis), which the motion itself has not.
const MOST_GROWTH: f64 = 800.0;
/// The same where accelerations ring from step to step: frequencies far above those that steps
/// resolve let the carried error grow by itself in a frame that turns.
const MOST_GROWTH_RINGING: f64 = 8.0;
/// The part of the local errors from which on that is so.
const RUNG: f64 = 0.05;

/// The error of the steps of a stage, since it is carried along.
pub(super) struct CarriedError {
    kinds: Arc<Vec<SlotKind>>,
    length: f64,
    slots: Vec<OfSlot>,
    step: Step,
    /// By how much the step is longer than the one before
    stretch: f64,
    /// Rates with the change that the error makes
    rates: [Field; 2],
    /// Their forces, then what the error meets; by category and slot
    force: [Vec<Vec3>; 4],
    /// The errors at the end of the present step of rotations whose unknowns are increments, as
    /// they stand in [`OfSlot`]
    turned: Vec<(Slot, [Vec3; 4])>,
    /// What the error is multiplied by to show; zero where there is none yet
    nudge: f64,
    known: Known,
    /// How many steps there were, and the lengths of the last of them, each at the place of its
    /// number
    steps: usize,
    lengths: [f64; WIDTH],
    largest: Largest,
    /// The sizes of local errors, summed over the steps, and of those among them that come from
    /// ringing
    sums: [Largest; 2],
}

/// What is known of the error at the end of the present step.
#[derive(Clone, Copy, PartialEq)]
enum Known {
    /// Nothing
    Nothing,
    /// What it meets of inertia and damping
    Forces,
    /// The error
    Error,
}

/// What is known of a slot. The error of a rotation whose unknown is an increment is a material
/// turn, with the material errors of the spin and its rate, and the spatial one of the rate of the
/// momentum that it carries.
#[derive(Clone, Copy, Default)]
struct OfSlot {
    /// e, e', e'' and E at the end of the last step
    error: Vec3,
    rate: Vec3,
    rate2: Vec3,
    algorithmic: Vec3,
    /// Accelerations at the ends of the last steps, each at the place of its number
    past: [Vec3; WIDTH],
    /// The slope that was found last
    jerk: Vec3,
    /// q where the stage began
    start: Vec3,
    /// Whether its accelerations mean something
    moves: bool,
    /// Of how many steps it has accelerations, as far as that matters
    age: u8,
}

/// e1, e1' and E1 for a step that ends with e1'' = 0.
struct Predicted {
    error: Vec3,
    rate: Vec3,
    algorithmic: Vec3,
}

impl OfSlot {
    #[inline(always)]
    fn predicted(&self, step: &Step, stretch: f64) -> Predicted {
        let Scheme { beta, gamma, alpha_m, alpha_f, .. } = step.scheme;
        let h = step.length;
        let own = self.algorithmic;
        let old = if stretch == 1.0 { own } else { self.rate2 + (own - self.rate2) * stretch };
        let new = (self.rate2 * alpha_f - old * alpha_m) * (1.0 / (1.0 - alpha_m));
        Predicted {
            error: self.error + self.rate * h + (old * (0.5 - beta) + new * beta) * (h * h),
            rate: self.rate + (old * (1.0 - gamma) + new * gamma) * h,
            algorithmic: new,
        }
    }

    /// The turn of a rotation that begins with a part of the error, and the increment with which it
    /// ends where the other one ends.
    fn changed(&self, turn: &Turn, x: Vec3, stretch: f64, part: f64) -> (Turn, Vec3) {
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
    /// From a state on, in which a step has ended that was as long as the next ones will be;
    /// `start` is q where the stage began. `moves` tells for each slot whether its accelerations
    /// mean something.
    pub fn new(scene: &Scene, force: [Vec<Vec3>; 4], state: &State, start: &[Vec3], step: Step) -> Self {
        let of_slot = |slot: usize| OfSlot { moves: scene.moves(slot), start: start[slot], ..OfSlot::default() };
        Self {
            kinds: scene.kinds.clone(),
            length: scene.length,
            slots: threads::list(scene.kinds.len(), of_slot),
            stretch: 1.0,
            rates: [state.v.clone(), state.a.clone()],
            force,
            turned: Vec::new(),
            nudge: 0.0,
            known: Known::Nothing,
            steps: 0,
            lengths: [step.length; WIDTH],
            largest: Largest::default(),
            sums: [Largest::default(); 2],
            step,
        }
    }

    /// An attempt at a step begins; the one before was as long as `before`.
    pub fn begin(&mut self, step: &Step, before: f64) {
        self.step = *step;
        self.stretch = step.length / before;
        self.known = Known::Nothing;
    }

    /// Whether what the error meets in the present step is not known yet.
    pub fn knows_no_forces(&self) -> bool {
        self.known == Known::Nothing
    }

    /// Looks at what the error meets of inertia and damping in the state that the tangent of the
    /// step belongs to. The forces of the system are those of that state, and stay.
    pub fn look(&mut self, assembly: &mut Assembly, state: &mut State, weights: Weights) {
        if self.nudge == 0.0 {
            return;
        }
        self.known = Known::Forces;
        self.change_rates(state, weights);
        self.swap_rates(state);
        assembly.evaluate_rates(state, &mut self.force);
        self.swap_rates(state);
        let system = &assembly.system;
        let factor = 1.0 / self.nudge;
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

    /// Rates that differ from those of the state by as much as those of an error that is zero at
    /// the end of the step, the other way.
    fn change_rates(&mut self, state: &State, weights: Weights) {
        let Self { slots, rates: [v, a], nudge, step, stretch, .. } = self;
        let slots = &slots[..];
        let step = &*step;
        let stretch = *stretch;
        let nudge = *nudge;
        v.copy_from(&state.v);
        a.copy_from(&state.a);
        let v = &mut v[..];
        let a = &mut a[..];
        threads::each(v.chunks_mut(PART).zip(a.chunks_mut(PART)).enumerate(), |(number, (v, a))| {
            let of_part = v.iter_mut().zip(a).zip(&slots[PART * number..]);
            for ((v, a), slot) in of_part.filter(|(_, slot)| slot.moves) {
                let Predicted { error, rate, .. } = slot.predicted(step, stretch);
                *v += (error * weights.damping - rate) * nudge;
                *a += error * (weights.mass * nudge);
            }
        });
        for (k, turn) in turns(state) {
            let (turn, x) = slots[k].changed(turn, state.q[k], stretch, nudge);
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

    /// The step is in balance: its tangent tells the error at its end, unless it has been given up.
    pub fn solve(&mut self, correct: &mut Correct, system: &mut System, state: &State, error: &mut [Vec3]) {
        if self.known != Known::Forces {
            return;
        }
        // The solver takes the sum of all forces: what the others have of it is taken away from
        // what it shall see.
        const INERTIA: usize = Category::Inertia as usize;
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

    /// The errors of rotations whose unknowns are increments, of which `error` has those of the
    /// increments.
    fn find_turned(&mut self, state: &State, error: &[Vec3]) {
        let Self { slots, turned, nudge, stretch, .. } = self;
        turned.clear();
        for (k, turn) in turns(state) {
            let x = state.q[k];
            let omega = state.v[k];
            let acceleration = state.a[k];
            let (changed, same) = slots[k].changed(turn, x, *stretch, *nudge);
            let other = same + error[k] * *nudge;
            let (other_omega, other_acceleration) = changed.rates(other);
            let ahead = Rotation::new(slots[k].error * *nudge).r * Rotation::new(other).r;
            let changes = [
                log(Rotation::new(x).r.transpose() * ahead),
                other_omega - omega,
                other_acceleration - acceleration,
                changed.algorithmic(other, other_omega) - turn.algorithmic(x, omega),
            ];
            turned.push((k as Slot, changes.map(|change| change * (1.0 / *nudge))));
        }
    }

    /// The step is taken from one state to another, both in one chart, with the error that was
    /// found at its end.
    pub fn end(
        &mut self,
        dof_map: &DofMap,
        error: &[Vec3],
        (from, to): (&State, &State),
        increments: Option<&Increments>,
    ) {
        let Step { scheme, length: h } = self.step;
        let stretch = self.stretch;
        let weights = self.step.weights();
        self.steps += 1;
        let own = self.steps % WIDTH;
        self.lengths[own] = h;
        let local = Local::new(&scheme, h, own, self.lengths.iter().sum());
        // Where nothing is found an error stays as it was: to go on freely would be much for what
        // is stiff.
        let found = self.known == Known::Error;
        let Self { kinds, slots, step, .. } = self;
        let work = |(number, part): (usize, &mut [OfSlot])| {
            let mut largest = Largest::default();
            let mut sizes = [Largest::default(); 2];
            for (k, slot) in (PART * number..).zip(part) {
                let kind = kinds[k];
                if kind.is_multiplier() || (kind == SlotKind::Rotation && increments.is_some()) {
                    continue;
                }
                if found && slot.moves {
                    let predicted = slot.predicted(step, stretch);
                    let x = error[k] - predicted.error;
                    slot.rate = predicted.rate + x * weights.damping;
                    slot.rate2 = x * weights.mass;
                    slot.algorithmic = predicted.algorithmic + x * (1.0 / (scheme.beta * h * h));
                }
                if found {
                    slot.error = error[k];
                }
                let mut now = slot.error;
                if slot.moves {
                    let rings = local.rings(slot, from.a[k], to.a[k]);
                    let [mut of_place, mut of_rate] = local.of(slot, from.a[k], to.a[k]);
                    if !dof_map.is_plain(k as Slot) {
                        of_place -= dof_map.held_part(k as Slot, of_place);
                        of_rate -= dof_map.held_part(k as Slot, of_rate);
                    }
                    // The error of a rate is not felt before the next step has ended.
                    now += of_place;
                    take_size(&mut sizes, kind, of_place, rings);
                    slot.error += of_place - of_rate * h;
                    slot.rate += of_rate;
                }
                let moved = if kind == SlotKind::Displacement { to.q[k] - slot.start } else { Vec3::ZERO };
                largest.take(kind, now, moved);
            }
            (largest, sizes)
        };
        let mut now = Largest::default();
        let mut sizes = [Largest::default(); 2];
        let gather = |(largest, [all, rung]): (Largest, [Largest; 2])| {
            now = now.or(largest);
            sizes = [sizes[0].or(all), sizes[1].or(rung)];
        };
        threads::in_order(slots.chunks_mut(PART).enumerate(), work, gather);
        if let Some(increments) = increments {
            self.end_turns(increments, (from, to), &local, (&mut now, &mut sizes));
        }
        let now = now.root();
        for (sum, size) in self.sums.iter_mut().zip(sizes) {
            let size = size.root();
            sum.displacement += size.displacement;
            sum.rotation += size.rotation;
        }
        self.largest = self.largest.or(now);
        let size = (now.displacement / self.length).max(now.rotation);
        self.nudge = if size > 0.0 { NUDGE / size } else { 0.0 };
    }

    /// The same for rotations whose unknowns are increments.
    fn end_turns(
        &mut self,
        increments: &Increments,
        (from, to): (&State, &State),
        local: &Local,
        (largest, sizes): (&mut Largest, &mut [Largest; 2]),
    ) {
        let found = self.known == Known::Error;
        let h = self.step.length;
        for (slot, turned) in self.turned.drain(..).filter(|_| found) {
            let slot = &mut self.slots[slot as usize];
            [slot.error, slot.rate, slot.rate2, slot.algorithmic] = turned;
        }
        for (before, after) in increments.accelerations(from).zip(increments.accelerations(to)) {
            let slot = &mut self.slots[after.slot as usize];
            if slot.moves {
                let rings = local.rings(slot, before.driven, after.driven);
                let [of_place, of_rate] = local.of(slot, before.driven, after.driven);
                let of_spin = (after.free - before.free) * (h.powi(4) * after.spin.squared() * FREE_SPIN);
                let back = Rotation::new(to.q[after.slot as usize]).r.transpose();
                take_size(sizes, SlotKind::Rotation, of_place + of_spin, rings);
                slot.error += back * (of_place + of_spin);
                slot.rate += back * of_rate;
            }
            largest.take(SlotKind::Rotation, slot.error, Vec3::ZERO);
        }
    }

    /// Total rotation vectors are about to change their charts in a state: their errors go with
    /// them.
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
            slot.age = 0;
        }
    }

    /// The largest errors so far.
    pub fn largest(&self) -> Largest {
        let [all, rung] = self.sums;
        let rings = rung.displacement > RUNG * all.displacement || rung.rotation > RUNG * all.rotation;
        let most = match self.step.scheme {
            scheme if !is_told_by_places(&scheme) => f64::INFINITY,
            _ if rings => MOST_GROWTH_RINGING,
            _ => MOST_GROWTH,
        };
        // What has no mass has no local errors of its own.
        let bounded = |error: f64, sum: f64| if sum > 0.0 { error.min(most * sum) } else { error };
        Largest {
            displacement: bounded(self.largest.displacement, all.displacement),
            rotation: bounded(self.largest.rotation, all.rotation),
            moved: self.largest.moved,
        }
    }
}

/// Whether local errors of places tell how large those of rates are: those of a scheme of first
/// order, or with a beta near 1/6, do not.
fn is_told_by_places(scheme: &Scheme) -> bool {
    let lag = scheme.lag();
    (0.5 - scheme.gamma - lag).abs() < 1e-9 && (1.0 / 6.0 - scheme.beta - 0.5 * lag).abs() > 0.04
}

/// Takes the size of a local error into those of a step.
#[inline(always)]
fn take_size([all, rung]: &mut [Largest; 2], kind: SlotKind, size: Vec3, rings: bool) {
    all.take(kind, size, Vec3::ZERO);
    if rings {
        rung.take(kind, size, Vec3::ZERO);
    }
}

/// The steps that rotations are in whose unknowns are increments.
fn turns(state: &State) -> impl Iterator<Item = (usize, &Turn)> {
    state.turns.iter().enumerate().filter_map(|(k, turn)| Some((k, turn.as_ref()?)))
}

/// What the local errors of a step come from.
struct Local {
    /// Of q''' in tau and in tau', and of the change of q''' in tau'
    factors: [f64; 3],
    /// The place of the step among the last ones, and one over the sum of their lengths
    place: usize,
    per_span: f64,
}

impl Local {
    fn new(scheme: &Scheme, h: f64, place: usize, span: f64) -> Self {
        let Scheme { beta, gamma, alpha_m, .. } = *scheme;
        let lag = scheme.lag();
        let of_change = 1.0 / 6.0 - lag * (alpha_m - 0.5) - gamma * (0.5 + lag);
        let of_slope = [1.0 / 6.0 - beta - 0.5 * lag, 0.5 - gamma - lag];
        Self { factors: [of_slope[0] * h * h * h, of_slope[1] * h * h, of_change * h * h], place, per_span: 1.0 / span }
    }

    /// Whether an acceleration goes up and down from step to step.
    #[inline(always)]
    fn rings(&self, slot: &OfSlot, before: Vec3, after: Vec3) -> bool {
        let earlier = slot.past[(self.place + WIDTH - 2) % WIDTH];
        slot.age > 1 && (after - before).dot(before - earlier) < 0.0
    }

    /// tau and tau', from the accelerations at both ends.
    #[inline(always)]
    fn of(&self, slot: &mut OfSlot, before: Vec3, after: Vec3) -> [Vec3; 2] {
        if slot.age == 0 {
            // Before it began, a motion is taken to have been as it was then.
            slot.past = [before; WIDTH];
        }
        let jerk = (after - slot.past[self.place]) * self.per_span;
        // While a slope becomes known its change is none of the motion's.
        let change = if usize::from(slot.age) < WIDTH { Vec3::ZERO } else { jerk - slot.jerk };
        slot.age = (WIDTH as u8).min(slot.age + 1);
        slot.past[self.place] = after;
        slot.jerk = jerk;
        let [of_place, of_rate, of_change] = self.factors;
        [jerk * of_place, jerk * of_rate + change * of_change]
    }
}
