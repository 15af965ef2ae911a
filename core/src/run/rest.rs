//! States of rest that small load levels do not lead to: of what only its loads hold, as hanging chains and blades on free hinges, and of
//! cables that are laid loosely.
//!
//! The structure moves along the forces on it, against an artificial resistance that fades (see [`crate::effect::resistance`]), until it
//! comes to rest. Balance is then found without any resistance, from that state.

use super::failure::{Failure, Moment};
use super::levels::{LARGEST_UNCOUNTED, distance};
use super::space::Space;
use super::stage_run::{Run, StageRun};
use crate::effect::resistance::Resistance;
use crate::integrate::{Equilibrium, Method};
use crate::kernel::Weights;
use crate::model::{Assembly, Model, SlotKind, charts};
use crate::solve::{LinearSolver, Newton, NullVector, Signature, SoftMode, Tangent, size};
use crate::system::{Anchor, Slot, State, System};
use std::f64::consts::PI;
use std::sync::Arc;

/// The first resistance lets the largest force move its node by this part of the length of the scene.
const GENTLE: f64 = 0.05;

/// What the resistance is multiplied by after a step that came to balance, and after one that did not.
const EASIER: f64 = 0.2;
const HARDER: f64 = 8.0;

/// More than so many times the first resistance is not tried.
const HARDEST: f64 = 1e8;

/// The arm by which rotations are resisted, as part of the length of the scene.
const ARM: f64 = 0.05;

/// After a step that moves less (lengths of the scene, radians) balance is tried without resistance.
const SLOW: f64 = 1e-2;

/// Where steps move less, and there is no balance without resistance, there will be none.
const STANDING: f64 = 1e-10;

/// Balance is not further away than that.
const NEIGHBOURHOOD: f64 = 0.1;

/// What is unstable is pushed by this (lengths of the scene, radians).
const PUSH: f64 = 1e-3;

/// Steps after a push before balance is tried again: it has to grow.
const STEPS_OF_PUSH: usize = 8;

/// What has less stiffness than this part of the largest force over the length of the scene is held by nothing.
const LOOSE: f64 = 1e-7;

/// A turn without any displacement that has less stiffness than this part of the largest force times the length is held by nothing: thin
/// cables have next to no torsional stiffness.
const LOOSE_TURN: f64 = 1e-12;

/// What moves further than so many lengths of the scene, nothing holds.
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

/// A stage with an artificial resistance beside its effects.
struct Resisted {
    assembly: Assembly,
    newton: Newton,
    /// Steps that are left
    steps: usize,
}

impl Run<'_> {
    /// From the last good state to one at rest at the load factor `target`; `false`, with the last good state, where none is found.
    pub(super) fn come_to_rest(&mut self, workshop: &mut StageRun, target: f64) -> Result<bool, Failure> {
        let start = self.good.kept();
        let account = self.bookkeeper.clone();
        let mut resisted = self.resist()?;
        let mut part = (target - start.load) * self.first_part(target);
        let mut arrived = true;
        while arrived && self.good.load < target {
            let rest = target - self.good.load;
            let next = if part >= rest * (1.0 - 1e-9) { target } else { self.good.load + part };
            let (before, account) = (self.good.kept(), self.bookkeeper.clone());
            if self.fall(workshop, &mut resisted, next)? {
                part *= 2.0;
            } else {
                self.good.copy_all_but_rates(&before);
                self.bookkeeper = account;
                part = (part / DIVISOR).min(rest / DIVISOR);
                arrived = part >= SMALLEST && resisted.steps > 0;
            }
        }
        self.count_evaluations(&resisted.assembly);
        if !arrived {
            self.bookkeeper = account;
            self.good.copy_all_but_rates(&start);
            self.state.copy_all_but_rates(&start);
        }
        Ok(arrived)
    }

    /// The part of a load increment that prescribed motions begin with.
    fn first_part(&mut self, target: f64) -> f64 {
        let mut prescribed_increment = Vec::new();
        self.state.copy_all_but_rates(&self.good);
        let moved = self
            .set_load(&mut prescribed_increment, target)
            .map(|moves| if moves { size(&self.model, &prescribed_increment) } else { 0.0 });
        self.state.copy_all_but_rates(&self.good);
        // What turns too far at once tells no size.
        PACE / moved.unwrap_or(PI).max(PACE)
    }

    fn resist(&self) -> Result<Resisted, Failure> {
        let stage = &self.plan.stages[self.stage];
        let dof_map = self.schedule.dof_map(&self.model, self.plane).map_err(|error| self.describe(error))?;
        let slots = self.model.kinds.iter().enumerate().filter(|(_, kind)| !kind.is_multiplier());
        let slots = slots.map(|(slot, kind)| (slot as Slot, *kind == SlotKind::Rotation)).collect();
        let context = stage.context(self.stage);
        let mut acting = self.model.acting(&context);
        acting.push(Arc::new(Resistance { slots, arm: ARM * self.model.length }));
        let assembly = Assembly::of(acting, &context, dof_map, &self.model);
        let newton = self.newton_for(stage, &assembly)?;
        Ok(Resisted { assembly, newton, steps: MOST_STEPS })
    }

    /// At one load factor: steps against a resistance that fades, until the state is in balance without it. Each step leaves its state as
    /// the good one.
    fn fall(&mut self, workshop: &mut StageRun, resisted: &mut Resisted, load: f64) -> Result<bool, Failure> {
        let start = self.good.kept();
        let gentle = self.gentle_resistance(resisted, load);
        let (mut resistance, mut lifts, mut growing) = (gentle, true, 0_usize);
        self.state.copy_all_but_rates(&self.good);
        let enough = resisted.steps.saturating_sub(MOST_AT_ONCE);
        while gentle > 0.0 && resistance <= HARDEST * gentle && resisted.steps > enough {
            self.observer.progress(self.moment(), self.static_progress(start.load))?;
            resisted.steps -= 1;
            let prescribed_increment = lifts.then_some(load);
            if !self.step_against(resisted, resistance, prescribed_increment) {
                self.counters.cutbacks += 1;
                resistance *= HARDER;
                self.state.copy_all_but_rates(&self.good);
                continue;
            }
            lifts = false;
            resistance *= EASIER;
            let moved = distance(&self.model, &self.good, &self.state);
            self.pass_through(&resisted.assembly.system)?;
            if distance(&self.model, &start, &self.good) > FARTHEST {
                return Ok(false);
            }
            growing = growing.saturating_sub(1);
            if moved >= SLOW || growing > 0 {
                continue;
            }
            if !self.balances(workshop, load) {
                if moved < STANDING {
                    return Ok(false);
                }
                continue;
            }
            let StageRun { assembly, newton, .. } = &mut *workshop;
            let signature = newton.signature_at(assembly, &self.state, &mut self.counters.work);
            if signature.is_none_or(|signature| !signature.tells_unstable()) {
                self.good.copy_all_but_rates(&self.state);
                return Ok(true);
            }
            // In balance, but not at rest.
            self.push(resisted);
            growing = STEPS_OF_PUSH;
        }
        Ok(false)
    }

    /// The resistance that lets the largest force at a load factor move its node by little. Motions that are prescribed are in the state at
    /// once: what they strain is to be resisted, too.
    fn gentle_resistance(&mut self, resisted: &mut Resisted, load: f64) -> f64 {
        self.state.copy_all_but_rates(&self.good);
        let time = self.state.time;
        self.schedule.set_clock(&self.model, &mut self.state, time, load);
        resisted.assembly.evaluate(&self.state, Weights::NONE, None);
        self.model.largest_force(&resisted.assembly.system) / (GENTLE * self.model.length)
    }

    /// One step from the run's state; in the first, whose load factor is given, prescribed motions come in. `false` where it finds no balance,
    /// or none that is a minimum: with less resistance than some motion gains by the forces there is no way along them.
    fn step_against(&mut self, resisted: &mut Resisted, resistance: f64, first: Option<f64>) -> bool {
        let mut prescribed_increment = Vec::new();
        let moves = match first.map(|load| self.set_load(&mut prescribed_increment, load)) {
            Some(Err(_)) => return false,
            Some(Ok(moves)) => moves,
            None => false,
        };
        self.state.anchor = Some(Arc::new(Anchor { resistance, q: self.state.q.clone() }));
        let Resisted { assembly, newton, .. } = resisted;
        let work = &mut self.counters.work;
        let prescribed_increment = moves.then_some(&prescribed_increment[..]);
        let solved = newton.solve(&self.model, assembly, &mut self.state, &Equilibrium, prescribed_increment, work);
        let solved = solved.and_then(|()| self.refuse_leaps()).and_then(|()| self.refuse_windings());
        if solved.is_err() {
            return false;
        }
        let signature = newton.signature_at(assembly, &self.state, &mut self.counters.work);
        !signature.is_some_and(Signature::tells_unstable)
    }

    /// Whether there is balance without resistance at the last good state; then it is the state of the run.
    fn balances(&mut self, workshop: &mut StageRun, load: f64) -> bool {
        workshop.newton.begin_anew();
        let found = self.attempt(workshop, load).is_ok()
            && workshop.newton.contraction <= LARGEST_UNCOUNTED
            && distance(&self.model, &self.good, &self.state) < NEIGHBOURHOOD;
        if !found {
            self.state.copy_all_but_rates(&self.good);
        }
        found
    }

    /// From the last good state a little along its softest motion.
    fn push(&mut self, resisted: &mut Resisted) {
        self.state.copy_all_but_rates(&self.good);
        let Resisted { assembly, newton, .. } = resisted;
        assembly.forget();
        assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        let mut tangent = Tangent::that_may_go(assembly, &self.state, Weights::STIFFNESS);
        let Some(softest) = newton.solver.softest(&mut tangent) else { return };
        let (_, mut motion) = softest.by_slot(&assembly.system.pattern.dof_map, self.state.q.len());
        let extent = size(&self.model, &motion);
        let scale = if extent > 0.0 { PUSH / extent } else { 0.0 };
        let scales = self.model.kinds.iter().map(|kind| if kind.is_multiplier() { 0.0 } else { scale });
        motion.iter_mut().zip(scales).for_each(|(motion, scale)| *motion = *motion * scale);
        charts::carry(&mut self.state, &motion, &self.schedule.charted(&self.model).rotations);
        Equilibrium.correct(&mut self.state, &motion);
    }

    /// Refuses a state of rest that leaves a motion which neither loads nor stiffness hold, in the plane of the stage or out of it.
    pub(super) fn refuse_loose_at_rest(&mut self, workshop: &mut StageRun) -> Result<(), Failure> {
        let StageRun { assembly, newton, .. } = &mut *workshop;
        self.counters.work.factorisations += 1;
        if let Some(vector) = loose_at_rest(assembly, &mut newton.solver, &self.model, &self.state) {
            return Err(self.name_unheld(vector, &workshop.assembly.system));
        }
        let Some(Space { assembly, solver }) = self.in_space(workshop)? else { return Ok(()) };
        self.counters.work.factorisations += 1;
        match loose_at_rest(assembly, solver, &self.model, &self.state) {
            Some(vector) => Err(self.name_unheld(vector, &assembly.system)),
            None => Ok(()),
        }
    }

    /// It is a mechanism from the start of the stage on.
    fn name_unheld(&self, vector: NullVector, system: &System) -> Failure {
        Failure::Singular { at: Moment { load: 0.0, ..self.moment() }, place: Some(self.place_of(&vector, system)) }
    }
}

/// The softest motion, where it has no stiffness but for what the tolerance of balance leaves: that of a motion that loads hold is a force over
/// a length.
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
    (soft_mode.is_loose() || stiffness.abs() < moves.max(turns)).then_some(soft_mode.vector)
}
