//! States of rest that small load levels do not lead to: of what only its loads hold, as hanging
//! chains and blades on free hinges, and of cables that are laid loosely.
//!
//! The structure moves along the forces on it, against an artificial resistance that fades (see
//! [`crate::effect::resistance`]), until it comes to rest. Balance is then found without any
//! resistance, from that state.

use super::load_control::set_load;
use super::stability::LARGEST_UNCOUNTED;
use crate::effect::resistance::Resistance;
use crate::integrate::{Equilibrium, Method};
use crate::kernel::Weights;
use crate::model::{Assembly, Model, SlotKind, charts};
use crate::run::distance::distance;
use crate::run::failure::{Failure, Moment};
use crate::run::spatial::{InSpace, SpatialLook};
use crate::run::stage_run::{StageRun, newton_for};
use crate::solve::{LinearSolver, Newton, NullVector, Signature, SoftMode, Tangent, size};
use crate::system::{Anchor, Slot, State, System};
use std::f64::consts::PI;
use std::sync::Arc;

/// The first resistance lets the largest force move its node by this part of the length of the
/// scene.
const GENTLE: f64 = 0.05;

/// The factor of the resistance after a step that came to balance.
const EASIER: f64 = 0.2;
/// The factor of the resistance after a step that did not.
const HARDER: f64 = 8.0;

/// More than so many times the first resistance is not tried.
const HARDEST: f64 = 1e8;

/// The arm by which rotations are resisted, as part of the length of the scene.
const ARM: f64 = 0.05;

/// After a step that moves less (lengths of the scene, radians) balance is tried without
/// resistance.
const SLOW: f64 = 1e-2;

/// Where steps move less, and there is no balance without resistance, there will be none.
const STANDING: f64 = 1e-10;

/// Balance is not further away than that.
const NEIGHBOURHOOD: f64 = 0.1;

/// The size of a push along an unstable motion (lengths of the scene, radians).
const PUSH: f64 = 1e-3;

/// Steps after a push before balance is tried again: it has to grow.
const STEPS_OF_PUSH: usize = 8;

/// The stiffness, over the largest force over the length of the scene, below which nothing holds a
/// motion.
const LOOSE: f64 = 1e-7;

/// A turn without any displacement that has less stiffness than this part of the largest force
/// times the length is held by nothing: thin cables have next to no torsional stiffness.
const LOOSE_TURN: f64 = 1e-12;

/// The motion, in lengths of the scene, beyond which nothing holds a structure.
const FARTHEST: f64 = 100.0;

/// Steps in all, those that fail among them.
const MOST_STEPS: usize = 2000;

/// Steps at one load factor, those that fail among them.
const MOST_AT_ONCE: usize = 200;

/// Prescribed motions begin with increments of this size (lengths of the scene, radians).
const PACE: f64 = 0.02;

/// The load is applied in parts; each that fails is tried again in so many.
const DIVISOR: f64 = 4.0;

/// Parts of the stage that are not divided further.
const SMALLEST: f64 = 1.0 / 65536.0;

/// From the last good state to one at rest at the load factor `target`; `false`, with the last good
/// state, where none is found.
pub fn come_to_rest(stage: &mut StageRun, target: f64) -> Result<bool, Failure> {
    Descent::new(stage)?.go_to(target)
}

/// A motion to a state of rest: a stage with an artificial resistance beside its effects.
struct Descent<'s, 'r> {
    stage: &'s mut StageRun<'r>,
    assembly: Assembly,
    newton: Newton,
    /// Steps that are left
    steps: usize,
}

impl<'s, 'r> Descent<'s, 'r> {
    fn new(stage: &'s mut StageRun<'r>) -> Result<Self, Failure> {
        let (assembly, newton) = Self::assemble(stage)?;
        Ok(Self { stage, assembly, newton, steps: MOST_STEPS })
    }

    /// The effects of a stage with an artificial resistance.
    fn assemble(stage: &StageRun) -> Result<(Assembly, Newton), Failure> {
        let dof_map = stage.schedule.dof_map(stage.model, stage.plane).map_err(|error| stage.describe(error))?;
        let slots = stage.model.kinds.iter().enumerate().filter(|(_, kind)| !kind.is_multiplier());
        let slots = slots.map(|(slot, kind)| (slot as Slot, *kind == SlotKind::Rotation)).collect();
        let context = stage.stage().context(stage.number);
        let mut acting = stage.model.acting(&context);
        acting.push(Arc::new(Resistance { slots, arm: ARM * stage.model.length }));
        let pairs = stage.state.contacts.pairs.list.clone();
        let assembly = Assembly::of(acting, &context, dof_map, stage.model, pairs);
        let newton = newton_for(stage.stage(), &assembly, stage.model, stage.moment())?;
        Ok((assembly, newton))
    }

    /// Assembles anew where other beams are near each other in the last good state.
    fn fit_assembly(&mut self) -> Result<(), Failure> {
        if self.assembly.fits(self.stage.good) {
            return Ok(());
        }
        self.stage.state.copy_all_but_rates(self.stage.good);
        self.stage.fit_assembly()?;
        let (assembly, newton) = Self::assemble(self.stage)?;
        let old = std::mem::replace(&mut self.assembly, assembly);
        self.assembly.take_over(old);
        self.newton = newton;
        Ok(())
    }

    /// From the last good state to one at rest at the load factor `target`; `false`, with the last
    /// good state, where none is found.
    fn go_to(&mut self, target: f64) -> Result<bool, Failure> {
        let start = self.stage.good.kept();
        let account = self.stage.bookkeeper.clone();
        let mut part = (target - start.load) * self.first_part(target);
        let mut arrived = true;
        while arrived && self.stage.good.load < target {
            let rest = target - self.stage.good.load;
            let next = if part >= rest * (1.0 - 1e-9) { target } else { self.stage.good.load + part };
            let (before, account) = (self.stage.good.kept(), self.stage.bookkeeper.clone());
            if self.fall(next)? {
                part *= 2.0;
            } else {
                self.stage.good.copy_all_but_rates(&before);
                *self.stage.bookkeeper = account;
                part = (part / DIVISOR).min(rest / DIVISOR);
                arrived = part >= SMALLEST && self.steps > 0;
            }
        }
        self.stage.count_evaluations(&self.assembly);
        if !arrived {
            *self.stage.bookkeeper = account;
            self.stage.good.copy_all_but_rates(&start);
            self.stage.state.copy_all_but_rates(&start);
        }
        Ok(arrived)
    }

    /// The part of a load increment that prescribed motions begin with.
    fn first_part(&mut self, target: f64) -> f64 {
        let StageRun { model, schedule, state, good, .. } = &mut *self.stage;
        let mut increment = Vec::new();
        state.copy_all_but_rates(good);
        let moves = set_load(model, schedule, state, target, &mut increment);
        let moved = moves.map(|moves| if moves { size(model, &increment) } else { 0.0 });
        state.copy_all_but_rates(good);
        // What turns too far at once tells no size.
        PACE / moved.unwrap_or(PI).max(PACE)
    }

    /// At one load factor: steps against a resistance that fades, until the state is in balance
    /// without it. Each step leaves its state as the good one.
    fn fall(&mut self, load: f64) -> Result<bool, Failure> {
        let start = self.stage.good.kept();
        let gentle = self.gentle_resistance(load);
        let (mut resistance, mut lifts, mut growing) = (gentle, true, 0_usize);
        self.stage.state.copy_all_but_rates(self.stage.good);
        let enough = self.steps.saturating_sub(MOST_AT_ONCE);
        while gentle > 0.0 && resistance <= HARDEST * gentle && self.steps > enough {
            self.stage.tell_progress(start.load)?;
            self.steps -= 1;
            let first = lifts.then_some(load);
            self.fit_assembly()?;
            let has_moved = self.step_against(resistance, first);
            self.stage.unless_interrupted()?;
            if !has_moved {
                self.stage.counters.cutbacks += 1;
                resistance *= HARDER;
                self.stage.state.copy_all_but_rates(self.stage.good);
                continue;
            }
            lifts = false;
            resistance *= EASIER;
            let moved = distance(self.stage.model, self.stage.good, self.stage.state);
            self.stage.pass_through(&self.assembly)?;
            if distance(self.stage.model, &start, self.stage.good) > FARTHEST {
                return Ok(false);
            }
            growing = growing.saturating_sub(1);
            if moved >= SLOW || growing > 0 {
                continue;
            }
            let is_balanced = self.balances(load);
            self.stage.unless_interrupted()?;
            if !is_balanced {
                if moved < STANDING {
                    return Ok(false);
                }
                continue;
            }
            let StageRun { assembly, newton, state, counters, .. } = &mut *self.stage;
            let signature = newton.signature_at(assembly, state, &mut counters.work);
            self.stage.unless_interrupted()?;
            if signature.is_none_or(|signature| !signature.tells_unstable()) {
                self.stage.good.copy_all_but_rates(self.stage.state);
                return Ok(true);
            }
            // In balance, but not at rest.
            self.push();
            growing = STEPS_OF_PUSH;
        }
        Ok(false)
    }

    /// The resistance that lets the largest force at a load factor move its node by little. Motions
    /// that are prescribed are in the state at once: what they strain is to be resisted, too.
    fn gentle_resistance(&mut self, load: f64) -> f64 {
        let StageRun { model, state, good, schedule, .. } = &mut *self.stage;
        state.copy_all_but_rates(good);
        let time = state.time;
        schedule.set_clock(model, state, time, load);
        self.assembly.evaluate(state, Weights::NONE, None);
        model.largest_force(&self.assembly.system) / (GENTLE * model.length)
    }

    /// After a failed step: goes back to the last good state. True if more surfaces are looked at there than before.
    fn looks_at_surfaces(&mut self) -> bool {
        let StageRun { state, good, .. } = &mut *self.stage;
        let looks = good.contacts.clearances != state.contacts.clearances;
        state.copy_all_but_rates(good);
        looks
    }

    /// One step from the run's state; in the first, whose load factor is given, prescribed motions
    /// come in. `false` where it finds no balance, or none that is a minimum: with less resistance
    /// than some motion gains by the forces there is no way along them.
    fn step_against(&mut self, resistance: f64, first: Option<f64>) -> bool {
        let StageRun { model, schedule, state, counters, .. } = &mut *self.stage;
        let mut increment = Vec::new();
        let moves = match first.map(|load| set_load(model, schedule, state, load, &mut increment)) {
            Some(Err(_)) => return false,
            Some(Ok(moves)) => moves,
            None => false,
        };
        state.anchor = Some(Arc::new(Anchor { resistance, q: state.q.clone() }));
        let increment = moves.then_some(&increment[..]);
        let solved = self.newton.solve(model, &mut self.assembly, state, &Equilibrium, increment, &mut counters.work);
        let solved = solved
            .and_then(|()| self.stage.refuse_departures())
            .and_then(|()| self.stage.refuse_leaps())
            .and_then(|()| self.stage.refuse_windings());
        let solved = solved.and_then(|()| self.stage.refuse_passing());
        let solved = solved.and_then(|()| self.stage.refuse_missed());
        if solved.is_err() {
            return self.looks_at_surfaces() && self.step_against(resistance, first);
        }
        let StageRun { state, counters, .. } = &mut *self.stage;
        let signature = self.newton.signature_at(&mut self.assembly, state, &mut counters.work);
        !signature.is_some_and(Signature::tells_unstable)
    }

    /// True if there is balance without resistance at the last good state; then it is the state of
    /// the run.
    fn balances(&mut self, load: f64) -> bool {
        self.stage.newton.begin_anew();
        let found = self.stage.attempt(load).is_ok()
            && self.stage.newton.contraction <= LARGEST_UNCOUNTED
            && distance(self.stage.model, self.stage.good, self.stage.state) < NEIGHBOURHOOD;
        if !found {
            self.stage.state.copy_all_but_rates(self.stage.good);
        }
        found
    }

    /// From the last good state a little along its softest motion.
    fn push(&mut self) {
        let StageRun { model, state, good, charted, .. } = &mut *self.stage;
        let Self { assembly, newton, .. } = self;
        state.copy_all_but_rates(good);
        assembly.forget();
        assembly.evaluate(state, Weights::STIFFNESS, None);
        let mut tangent = Tangent::that_may_go(assembly, state, Weights::STIFFNESS);
        let Some(softest) = newton.solver.softest(&mut tangent) else { return };
        let (_, mut motion) = softest.by_slot(&assembly.system.pattern.dof_map, state.q.len());
        let extent = size(model, &motion);
        let scale = if extent > 0.0 { PUSH / extent } else { 0.0 };
        let scales = model.kinds.iter().map(|kind| if kind.is_multiplier() { 0.0 } else { scale });
        motion.iter_mut().zip(scales).for_each(|(motion, scale)| *motion = *motion * scale);
        charts::carry(state, &motion, &charted.rotations);
        Equilibrium.correct(state, &motion);
    }
}

/// Refuses a state of rest that leaves a motion which neither loads nor stiffness hold, in the
/// plane of the stage or out of it.
pub fn refuse_loose(stage: &mut StageRun, space: &mut SpatialLook) -> Result<(), Failure> {
    stage.counters.work.factorisations += 1;
    let StageRun { assembly, newton, model, state, .. } = &mut *stage;
    if let Some(vector) = loose_at_rest(assembly, &mut newton.solver, model, state) {
        return Err(name_unheld(stage, vector, &stage.assembly.system));
    }
    let Some(InSpace { assembly, solver }) = space.of(stage)? else { return Ok(()) };
    stage.counters.work.factorisations += 1;
    match loose_at_rest(assembly, solver, stage.model, stage.state) {
        Some(vector) => Err(name_unheld(stage, vector, &assembly.system)),
        None => Ok(()),
    }
}

/// It is a mechanism from the start of the stage on.
fn name_unheld(stage: &StageRun, vector: NullVector, system: &System) -> Failure {
    Failure::Singular { at: Moment { load: 0.0, ..stage.moment() }, place: Some(stage.place_of(&vector, system)) }
}

/// The softest motion, where it has no stiffness but for what the tolerance of balance leaves: that
/// of a motion that loads hold is a force over a length.
fn loose_at_rest(
    assembly: &mut Assembly,
    solver: &mut LinearSolver,
    model: &Model,
    state: &State,
) -> Option<NullVector> {
    assembly.forget();
    assembly.evaluate(state, Weights::STIFFNESS, None);
    let force = model.largest_force(&assembly.system);
    let mut tangent = Tangent::that_may_go(assembly, state, Weights::STIFFNESS);
    let soft_mode = SoftMode::find(solver, &mut tangent, model, false)?;
    let system = tangent.look();
    let motion = &soft_mode.vector.motion;
    let stiffness: f64 = system.multiply(&system.values, motion).iter().zip(motion).map(|(f, x)| f * x).sum();
    let (_, by_slot) = soft_mode.vector.by_slot(&system.pattern.dof_map, state.q.len());
    let largest = |wanted: SlotKind| {
        let slots = by_slot.iter().zip(model.kinds.iter()).filter(|(_, kind)| **kind == wanted);
        slots.map(|(motion, _)| motion.squared()).fold(0.0, f64::max)
    };
    let moves = LOOSE * force / model.length * largest(SlotKind::Displacement);
    let turns = LOOSE_TURN * force * model.length * largest(SlotKind::Rotation);
    let mut is_soft = || stiffness.abs() < moves.max(turns) && !soft_mode.opens_joints(&mut tangent, model);
    (soft_mode.is_loose() || is_soft()).then_some(soft_mode.vector)
}
