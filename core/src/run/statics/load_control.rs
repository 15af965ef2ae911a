//! Equilibrium at a load factor, and how it and its forces vary with the load factor.

use crate::integrate::Equilibrium;
use crate::kernel::Weights;
use crate::model::{Model, Schedule};
use crate::run::failure::Failure;
use crate::run::stage_run::StageRun;
use crate::solve::{NewtonFailure, Tangent, mechanism};
use crate::system::State;
use crate::tensor::Vec3;
use crate::threads;

/// Step over which derivatives over the load factor are taken.
const LOAD_STEP: f64 = 1.0 / 4096.0;

/// The direction of a path of equilibrium.
pub(in crate::run) struct PathDirection {
    /// dq/dload
    pub(crate) rate: Vec<Vec3>,
    /// dg/dload at rest: of the forces, and at multipliers of the gaps of motors
    pub(super) pull: Vec<Vec3>,
}

impl PathDirection {
    /// The direction of a path on which nothing varies with the load factor.
    pub fn none(slots: usize) -> Self {
        Self { rate: vec![Vec3::ZERO; slots], pull: vec![Vec3::ZERO; slots] }
    }

    /// The rate of the displacement that the loads do work on; `None` without loads. What stands at
    /// multipliers are gaps of motors, not forces.
    pub fn work_rate(&self, model: &Model) -> Option<f64> {
        let all = self.pull.iter().zip(&self.rate).zip(model.kinds.iter());
        let acting = || all.clone().filter(|(_, kind)| !kind.is_multiplier());
        let loaded = acting().any(|((force, _), _)| *force != Vec3::ZERO);
        loaded.then(|| acting().map(|((force, rate), _)| -force.dot(*rate)).sum())
    }
}

impl StageRun<'_> {
    /// One attempt at a load factor. Prescribed motions enter with the first correction: they are
    /// taken back out of the state and handed to Newton as increments.
    pub fn attempt(&mut self, load: f64) -> Result<(), NewtonFailure> {
        if self.model.contacts().is_some() { self.attempt_with_contacts(load) } else { self.attempt_once(load) }
    }

    /// An attempt that ends without a balance where a correction is larger than this part of the one
    /// before it. Where points may touch it goes on: they come and go between iterations.
    pub fn attempt_within(&mut self, load: f64, largest_contraction: f64) -> Result<(), NewtonFailure> {
        if self.model.contacts().is_none() {
            self.newton.largest_contraction = largest_contraction;
        }
        let attempt = self.attempt(load);
        self.newton.largest_contraction = f64::INFINITY;
        attempt
    }

    /// One solution of Newton's method at a load factor.
    pub(super) fn attempt_once(&mut self, load: f64) -> Result<(), NewtonFailure> {
        let moves = self.set_load(load)?;
        let Self { assembly, newton, prescribed_increment, state, model, counters, .. } = self;
        let moved = moves.then_some(&prescribed_increment[..]);
        state.contacts.holds_on = !state.contacts.is_clear && model.contacts().is_some_and(|contacts| contacts.rubs());
        let solved = newton.solve(model, assembly, state, &Equilibrium, moved, &mut counters.work);
        state.contacts.holds_on = false;
        solved?;
        self.refuse_far_steps()
    }

    /// Refuses a step on which something has left its place, or has turned too far.
    pub(super) fn refuse_far_steps(&self) -> Result<(), NewtonFailure> {
        self.refuse_departures()?;
        self.refuse_leaps()?;
        self.refuse_windings()
    }

    /// Sets the load factor. Increments of prescribed motions are not in the state yet, but in
    /// `prescribed_increment`; whether there are any.
    pub fn set_load(&mut self, load: f64) -> Result<bool, NewtonFailure> {
        let Self { prescribed_increment, state, model, schedule, .. } = self;
        set_load(model, schedule, state, load, prescribed_increment)
    }

    /// The direction of the path; `None` where nothing varies with the load factor. The tangent
    /// stays factorised.
    pub fn path_direction(&mut self) -> Result<Option<PathDirection>, Failure> {
        let pull = self.load_derivative();
        let Self { assembly, newton, prescribed_increment, state, model, counters, .. } = self;
        if pull.iter().chain(prescribed_increment.iter()).all(|&v| v == Vec3::ZERO) {
            return Ok(None);
        }
        assembly.forget();
        assembly.evaluate(state, Weights::STIFFNESS, Some(prescribed_increment));
        let system = &assembly.system;
        let mut solution = vec![0.0; system.pattern.dof_map.count()];
        system.right_hand_side_of(&pull, &mut solution);
        counters.work.factorisations += 1;
        if !(newton.solver.factorise(system) && newton.solver.solve(system, &mut solution)) {
            let vector = mechanism(&mut newton.solver, &mut Tangent::that_stays(assembly, state), model);
            self.unless_interrupted()?;
            return Err(self.name_mechanism(vector, &self.assembly.system));
        }
        let mut rate = vec![Vec3::ZERO; pull.len()];
        system.pattern.dof_map.scatter(&solution, Some(prescribed_increment), &mut rate);
        Ok(Some(PathDirection { rate, pull }))
    }

    /// The derivative of the forces over the load factor; that of prescribed directions goes into
    /// `prescribed_increment`. Loads and motions without a history are linear in it; the step is
    /// small, so that no motion goes around.
    pub fn load_derivative(&mut self) -> Vec<Vec3> {
        let Self { assembly, prescribed_increment, state, model, schedule, .. } = self;
        prescribed_increment.resize(state.q.len(), Vec3::ZERO);
        let mut here = state.clone();
        let mut shifted = state.clone();
        let inverse = 1.0 / LOAD_STEP;
        schedule.set_clock(model, &mut here, state.time, state.load);
        let mut forces = |state: &State| -> Vec<Vec3> {
            assembly.evaluate(state, Weights::NONE, None);
            (0..state.q.len()).map(|slot| assembly.system.total(slot)).collect()
        };
        let before = forces(state);
        schedule.set_clock(model, &mut shifted, state.time, state.load + LOAD_STEP);
        // From where the motions put their directions now, not from where round-off has left them:
        // the step is small.
        for (prescribed_increment, (moved, from)) in prescribed_increment.iter_mut().zip(shifted.q.iter().zip(&here.q))
        {
            *prescribed_increment = (*moved - *from) * inverse;
        }
        shifted.q.copy_from_slice(&state.q);
        let after = forces(&shifted);
        after.iter().zip(&before).map(|(after, before)| (*after - *before) * inverse).collect()
    }
}

/// Sets the load factor of a state. `increment` takes the increments of prescribed motions, which
/// are not in the state yet; whether there are any.
pub(in crate::run) fn set_load(
    model: &Model,
    schedule: &Schedule,
    state: &mut State,
    load: f64,
    increment: &mut Vec<Vec3>,
) -> Result<bool, NewtonFailure> {
    threads::copy(increment, if model.motions.is_empty() { &[] } else { &state.q });
    let time = state.time;
    if let Some(too_far) = schedule.set_clock(model, state, time, load) {
        return Err(too_far.into());
    }
    for (increment, q) in increment.iter_mut().zip(&mut state.q) {
        let before = *increment;
        *increment = *q - before;
        *q = before;
    }
    Ok(increment.iter().any(|&v| v != Vec3::ZERO))
}
