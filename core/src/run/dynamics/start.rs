//! The start of a dynamic stage: velocities, and accelerations from equilibrium at its first
//! instant.

use super::Dynamics;
use super::massless::Massless;
use crate::integrate::Method;
use crate::kernel::Weights;
use crate::model::{LARGEST_GAP, Motion, MotionKind, SlotKind, StageError};
use crate::run::energy::Entry;
use crate::run::failure::Failure;
use crate::run::rehearsal::{INVISIBLE_WAY, SAME_VELOCITY, noticed_jump};
use crate::run::spatial::SpatialLook;
use crate::run::stage_run::StageRun;
use crate::solve::{NewtonFailure, SoftMode, Tangent, mechanism};
use crate::system::{Slot, State};
use crate::tensor::Vec3;
use crate::threads;
use crate::warning::WarningKind;
use std::collections::HashMap;

/// Relative change of a velocity that is round-off.
const ROUND_OFF: f64 = 1e-9;

/// What supports and motions change at once where a stage begins.
struct VelocityJumps {
    /// The changes of velocities in held directions, by slot
    changes: Vec<Vec3>,
    /// True if motions make all of them
    only_motions: bool,
}

/// The slot with the largest change of velocity.
#[derive(Default)]
struct Fastest {
    slot: Option<usize>,
    size: f64,
}

impl Fastest {
    fn take(&mut self, slot: usize, size: f64) {
        if size > self.size {
            *self = Self { slot: Some(slot), size };
        }
    }
}

impl Dynamics<'_, '_> {
    /// Gives velocities, sets the clock, and finds the accelerations of the start.
    pub(super) fn start(&mut self) -> Result<(), Failure> {
        self.refuse_past_end()?;
        let held = self.held_velocities();
        let begins = self.set_in_motion();
        self.set_clock()?;
        let caught = held.and_then(|held| self.caught(&held));
        self.stage.refuse_penetration()?;
        let caught = self.change_charts_with(caught);
        self.stage.linearise()?;
        let step = self.first_step();
        self.refuse_loose(&step)?;
        // Time steps do not look out of the plane again.
        SpatialLook::default().refuse_loose(self.stage, step.weights())?;
        self.join_velocities(caught.as_ref().map(|caught| &caught.changes[..]))?;
        if let Some(contacts) = self.stage.model.contacts() {
            contacts.begin_motion(self.stage.state);
        }
        self.find_rates();
        self.balance_massless()?;
        self.solve_accelerations()?;
        let jerk = self.jerk_of_joints()?;
        self.start_scheme(jerk.as_ref());
        let StageRun { bookkeeper, model, state, assembly, .. } = &mut *self.stage;
        if begins {
            bookkeeper.bring_in(Entry::new(model, state, assembly));
        } else if let Some(VelocityJumps { only_motions: true, .. }) = &caught {
            bookkeeper.book_velocity_jump(Entry::new(model, state, assembly));
        }
        self.stage.open_account()?;
        self.open_guard();
        // Behind the first row and the account, which have the true velocities.
        self.lead_velocities(jerk.as_ref());
        Ok(())
    }

    /// The first dynamic stage gives the initial velocities; whether it is this one. Held
    /// directions have none.
    fn set_in_motion(&mut self) -> bool {
        let StageRun { plan, state, past, assembly, .. } = &mut *self.stage;
        let begins = !std::mem::replace(&mut past.moving, true);
        if begins {
            plan.initial.iter().for_each(|motion| motion.give_to(state));
        }
        let dof_map = &assembly.system.pattern.dof_map;
        threads::each_part(&mut state.v, |start, part| {
            (start..).zip(part).for_each(|(slot, v)| *v -= dof_map.held_part(slot as Slot, *v));
        });
        begins
    }

    /// Refuses a stage whose end lies behind it: a stage before it has not come to its `until`.
    fn refuse_past_end(&self) -> Result<(), Failure> {
        let StageRun { state, number, .. } = &*self.stage;
        let end = self.settings.end;
        if state.time < end {
            return Ok(());
        }
        Err(Failure::Deck(format!(
            "stage {} ends at `end` = {end}, but the stages before it have reached the time {} (`end` is a time, not a \
             duration)",
            number + 1,
            state.time
        )))
    }

    /// The velocities in held directions where a motion goes on from the stage before; `None` without
    /// one.
    fn held_velocities(&self) -> Option<Vec<Vec3>> {
        let StageRun { state, past, assembly, .. } = &*self.stage;
        let dof_map = &assembly.system.pattern.dof_map;
        past.moving.then(|| threads::list(state.v.len(), |slot| dof_map.held_part(slot as Slot, state.v[slot])))
    }

    /// Changes charts, and keeps the changes of velocities of rotations whose chart stays: in another
    /// one rates are others, and the impulse of those is left out.
    fn change_charts_with(&mut self, caught: Option<VelocityJumps>) -> Option<VelocityJumps> {
        let Some(mut caught) = caught else {
            self.stage.change_charts(None);
            return None;
        };
        let before = self.stage.state.q.clone();
        self.stage.change_charts(None);
        let is_changed = |slot: &usize| self.stage.state.q[*slot] != before[*slot];
        (0..before.len()).filter(is_changed).for_each(|slot| caught.changes[slot] = Vec3::ZERO);
        Some(caught)
    }

    /// The changes of the velocities in held directions, which were `held` before: where supports and
    /// motions act that did not act before. `None` without such. They are told.
    fn caught(&mut self, held: &[Vec3]) -> Option<VelocityJumps> {
        let StageRun { state, assembly, model, .. } = &*self.stage;
        let dof_map = &assembly.system.pattern.dof_map;
        let change = |slot: usize| dof_map.held_part(slot as Slot, state.v[slot]) - held[slot];
        let changes = threads::list(held.len(), change);
        let is_change = |slot: &usize| {
            let size = changes[*slot].norm();
            size > ROUND_OFF * held[*slot].norm().max(state.v[*slot].norm()) && !model.kinds[*slot].is_multiplier()
        };
        let slots: Vec<usize> = (0..held.len()).filter(is_change).collect();
        if slots.is_empty() {
            return None;
        }
        self.stage.issued.caught = true;
        let only_motions = self.warn_of_jumps(&slots, &changes);
        Some(VelocityJumps { changes, only_motions })
    }

    /// Warns of supports and motions that change velocities at once in the `slots`. Those of motions that were known when
    /// the deck was read are told already. True if motions make all changes.
    fn warn_of_jumps(&mut self, slots: &[usize], changes: &[Vec3]) -> bool {
        let StageRun { schedule, model, state, .. } = &*self.stage;
        let acting = schedule.motions(model).filter(|(_, timeline)| timeline.acts());
        let mut motions: HashMap<Slot, Vec<&Motion>> = HashMap::new();
        acting.for_each(|(motion, _)| motions.entry(motion.slot).or_default().push(motion));
        let slowest = INVISIBLE_WAY / (self.settings.end - state.time);
        let (mut by_support, mut by_motion) = (Fastest::default(), Fastest::default());
        for &slot in slots {
            let mut rest = changes[slot];
            for motion in motions.get(&(slot as Slot)).into_iter().flatten() {
                let (part, length) = match motion.kind {
                    MotionKind::Translation => (motion.axis * motion.axis.dot(rest), model.length),
                    MotionKind::Rotation => (rest, 1.0),
                };
                rest -= part;
                let noticed = noticed_jump(motion.amplitude.fastest(), slowest * length);
                if part.norm() > noticed.max(SAME_VELOCITY * state.v[slot].norm()) && !self.was_foreseen(motion) {
                    by_motion.take(slot, part.norm());
                }
            }
            if rest.norm() > ROUND_OFF * changes[slot].norm().max(state.v[slot].norm()) {
                by_support.take(slot, rest.norm());
            }
        }
        let stage = self.stage.number + 1;
        if let Some(slot) = by_support.slot {
            let node = self.stage.model.node_at(slot);
            let message = format!(
                "supports of stage {stage} stop what moves, the fastest at node \"{node}\": their impulse on all that \
                 is connected takes kinetic energy at once"
            );
            self.stage.warn(WarningKind::VelocityJump, message);
        }
        if let Some(slot) = by_motion.slot {
            let (node, size) = (self.stage.model.node_at(slot), by_motion.size);
            let message = format!(
                "a motion of stage {stage} changes the velocity of node \"{node}\" at once, by {size:.3e}: let its \
                 history begin with the velocity that the node has there, or let the stage before end at rest"
            );
            self.stage.warn(WarningKind::VelocityJump, message);
        }
        by_support.slot.is_none()
    }

    /// True if the velocity of a motion's node at the start of the stage was known when the deck was read: the motion
    /// acted in the stage that led there, and no stage has ended early.
    fn was_foreseen(&self, motion: &Motion) -> bool {
        let before = &self.stage.plan.stages[..self.stage.number];
        let last = before.iter().rposition(|stage| stage.work.kind().advances_state());
        last.is_some_and(|last| motion.amplitude.acts_in(last)) && before.iter().all(|stage| stage.until.is_none())
    }

    /// Sets the clock, and all accelerations but prescribed ones to zero; motors and surfaces must not
    /// jump.
    pub(super) fn set_clock(&mut self) -> Result<(), Failure> {
        let StageRun { model, state, schedule, .. } = &mut *self.stage;
        state.a.fill(Vec3::ZERO);
        let (time, amplitude) = (state.time, state.amplitude.clone());
        schedule.set_clock(model, state, time, 1.0);
        let motor = model.motor_jumps(&amplitude, state).into_iter().next().map(StageError::MotorJump);
        let jump =
            motor.or_else(|| model.surface_jumps(&amplitude, state).into_iter().next().map(StageError::SurfaceJump));
        match jump {
            Some(jump) => Err(self.stage.describe(jump)),
            None => Ok(()),
        }
    }

    /// From here on the energy is watched.
    fn open_guard(&mut self) {
        let StageRun { model, bookkeeper, assembly, .. } = &*self.stage;
        let first = bookkeeper.first().unwrap_or_default();
        if let Some(guard) = &mut self.guard {
            let force = model.largest_force(&assembly.system);
            guard.open(bookkeeper.ledger(), first, f64::EPSILON * force * model.length);
        }
    }

    /// Velocities that the gaps of joints allow: those given, changed by the impulses that closing
    /// the joints takes.
    pub(super) fn close_joints(&mut self) -> Result<(), Failure> {
        self.join_velocities(None)
    }

    /// Velocities that the gaps of joints allow, after velocities in held directions have changed by
    /// `caught`: those given, changed by the impulses of joints and supports, [M G^T; G 0] [dv;
    /// impulse] = [-M_fc dv_c; -dg/dt].
    fn join_velocities(&mut self, caught: Option<&[Vec3]>) -> Result<(), Failure> {
        if self.stage.model.multipliers.is_empty() && caught.is_none() {
            return Ok(());
        }
        let rates = self.rates_before(caught);
        self.stage.assembly.evaluate(self.stage.state, Weights::MASS, caught);
        self.refuse_open_joints()?;
        self.stage.assembly.system.forget_forces();
        let Some(impulse) = self.solve_with_mass(&rates)? else { return Ok(()) };
        let moves = self.stage.model.kinds.iter().map(|kind| !kind.is_multiplier());
        for ((v, impulse), _) in self.stage.state.v.iter_mut().zip(impulse).zip(moves).filter(|(_, moves)| *moves) {
            *v += impulse;
        }
        Ok(())
    }

    /// The rates of gaps before velocities in held directions have changed by `caught`: the changes act
    /// through the tangent.
    fn rates_before(&self, caught: Option<&[Vec3]>) -> Vec<Vec3> {
        let StageRun { assembly, state, .. } = &*self.stage;
        let Some(caught) = caught else {
            let [rates, _] = assembly.drift(state);
            return rates;
        };
        let mut before = State::clone(state);
        before.v.iter_mut().zip(caught).for_each(|(v, &change)| *v -= change);
        let [rates, _] = assembly.drift(&before);
        rates
    }

    /// A dynamic stage never jumps: neither do joints that a stage before has left open.
    fn refuse_open_joints(&self) -> Result<(), Failure> {
        for &slot in &self.stage.model.multipliers {
            let kind = self.stage.model.kinds[slot as usize];
            let size = if kind == SlotKind::Force { self.stage.model.length } else { 1.0 };
            let gap = self.stage.assembly.system.total(slot as usize).norm();
            if gap > LARGEST_GAP * size {
                let at = self.stage.moment();
                return Err(Failure::Deck(format!(
                    "the {} has a gap of {gap:.3e} at the start of the stage ({at}), which it would have to close at \
                     once",
                    self.stage.model.node_at(slot as usize)
                )));
            }
        }
        Ok(())
    }

    fn solve_accelerations(&mut self) -> Result<(), Failure> {
        if !self.find_accelerations()? {
            self.stage.warn(
                WarningKind::NoStartAccelerations,
                "the mass matrix is singular, so that the accelerations at the start are undefined (a point mass with \
                 an offset and without inertia?): they are set to zero",
            );
        }
        Ok(())
    }

    /// Accelerations and multipliers from equilibrium; `false` where the mass matrix is singular.
    pub(super) fn find_accelerations(&mut self) -> Result<bool, Failure> {
        let StageRun { assembly, state, .. } = &mut *self.stage;
        assembly.forget();
        let [_, rates2] = assembly.drift(state);
        assembly.evaluate(state, Weights::MASS, None);
        if (0..state.q.len()).any(|slot| !assembly.system.total(slot).is_finite()) {
            let failure = NewtonFailure::not_finite(assembly, state);
            return Err(self.stage.name_failure(failure, &self.stage.assembly.system));
        }
        let Some(solved) = self.solve_with_mass(&rates2)? else {
            self.stage.assembly.evaluate(self.stage.state, Weights::NONE, None);
            return Ok(false);
        };
        let StageRun { model, state, .. } = &mut *self.stage;
        for (slot, kind) in model.kinds.iter().enumerate() {
            let field = if kind.is_multiplier() { &mut state.q[..] } else { &mut state.a[..] };
            field[slot] += solved[slot];
        }
        // The forces of the start, for reactions and the energy account.
        self.stage.assembly.evaluate(self.stage.state, Weights::NONE, None);
        Ok(true)
    }

    /// Solves with the mass matrix, bordered by the gaps of joints, whose rows ask for -`gaps`;
    /// `None` where mass alone does not tell the solution, but stiffness holds everything.
    pub(super) fn solve_with_mass(&mut self, gaps: &[Vec3]) -> Result<Option<Vec<Vec3>>, Failure> {
        let StageRun { assembly, newton, model, state, counters, .. } = &mut *self.stage;
        let (solver, system) = (&mut newton.solver, &mut assembly.system);
        for &slot in &model.multipliers {
            system.replace_force(slot, gaps[slot as usize]);
        }
        let mut right_hand_side = vec![0.0; system.pattern.dof_map.count()];
        system.right_hand_side(&mut right_hand_side);
        let massless = Massless::release(system, model, &mut right_hand_side);
        massless.additions.iter().for_each(|(slot, block)| system.add_to_own_block(*slot, block));
        counters.work.factorisations += 1;
        let mut mass = Tangent::that_may_go(assembly, state, Weights::MASS).with(&massless.additions);
        // Along no axis round-off leaves pivots where the mass matrix is singular: solved with,
        // they give accelerations of 1e16.
        let without_mass = solver.null_vector(&mut mass);
        let factorised = without_mass.is_none() && solver.factorise_new(&mut mass).is_done;
        let system = mass.system();
        let solve = |right_hand_side: &mut [f64]| solver.solve(system, right_hand_side);
        if !factorised || !massless.solve(&system.pattern.dof_map, &mut right_hand_side, solve) {
            self.stage.unless_interrupted()?;
            let named = self.stage.name_mechanism(without_mass, &self.stage.assembly.system);
            return if self.is_held(&named) { Ok(None) } else { Err(named) };
        }
        let mut solved = vec![Vec3::ZERO; state.q.len()];
        system.pattern.dof_map.scatter(&right_hand_side, None, &mut solved);
        Ok(Some(solved))
    }

    /// True if stiffness holds the motions that mass does not resist; a condition of joints that is
    /// said twice is none of its business.
    fn is_held(&mut self, without_mass: &Failure) -> bool {
        if matches!(without_mass, Failure::Singular { place: Some(place), .. } if place.is_joint()) {
            return false;
        }
        let StageRun { assembly, newton, model, state, .. } = &mut *self.stage;
        assembly.evaluate(state, Weights::STIFFNESS, None);
        let mut tangent = Tangent::that_may_go(assembly, state, Weights::STIFFNESS);
        newton.solver.factorise_new(&mut tangent).is_done
            && SoftMode::find(&mut newton.solver, &mut tangent, model, false)
                .is_none_or(|soft_mode| !soft_mode.is_loose())
    }
}

impl Dynamics<'_, '_> {
    /// Refuses what neither stiffness nor mass resists, and joints that hold what is held already:
    /// round-off would move them. It is looked at without velocities, whose forces come and go with
    /// them.
    fn refuse_loose(&mut self, method: &dyn Method) -> Result<(), Failure> {
        let StageRun { assembly, newton, model, state, counters, .. } = &mut *self.stage;
        let still = state.at_rest();
        assembly.forget();
        assembly.evaluate(&still, method.weights(), None);
        counters.work.factorisations += 1;
        let mut tangent = Tangent::that_may_go(assembly, &still, method.weights());
        let loose = mechanism(&mut newton.solver, &mut tangent, model);
        loose.map_or(Ok(()), |vector| Err(self.stage.name_mechanism(Some(vector), &self.stage.assembly.system)))
    }

    /// Finds the slots whose accelerations mean something: their unknowns have inertia, or their
    /// motion is prescribed; and those whose velocities do not, either.
    pub(super) fn find_rates(&mut self) {
        let StageRun { assembly, model, state, .. } = &mut *self.stage;
        let mut moves = vec![false; model.slots()];
        model.motions.iter().for_each(|motion| moves[motion.slot as usize] = true);
        let mut touched = |weights: Weights| -> Vec<bool> {
            // Factors may have taken the place of the one that is there.
            assembly.form_again(state, weights);
            let system = &assembly.system;
            threads::list(moves.len(), |slot| {
                let moves = moves[slot] && !system.pattern.dof_map.is_plain(slot as Slot);
                moves || system.own_block(slot as Slot).max_abs() > 0.0
            })
        };
        let massive = touched(Weights::MASS);
        let damped = touched(Weights::DAMPING);
        assembly.evaluate(state, Weights::NONE, None);
        let rateless = |&slot: &usize| !(massive[slot] || damped[slot] || model.kinds[slot].is_multiplier());
        self.rateless = (0..massive.len()).filter(rateless).collect();
        self.massive = massive;
    }
}
