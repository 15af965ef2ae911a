//! What no mass resists where a dynamic stage begins: it is in balance from the first instant on, whatever loads, free
//! strains and supports begin there.
//!
//! Both places and rates are those at the end of a step that is too short for anything with mass to move.

use super::Dynamics;
use crate::integrate::{Scheme, Step};
use crate::kernel::Weights;
use crate::model::SlotKind;
use crate::run::energy::Entry;
use crate::run::failure::Failure;
use crate::run::stage_run::StageRun;
use crate::solve::NewtonFailure;
use crate::system::{Slot, State};

/// The length of that step, over that of the first one of the stage.
const INSTANT: f64 = 1e-6;

/// The length of the next instant that is tried, over that of the one before.
const SHORTER: f64 = 1e-2;

/// A shorter instant must leave no more than this part of the imbalance, or no other one is tried.
const WORTHWHILE: f64 = 0.5;

/// The number of instants that are tried at most.
const MOST_INSTANTS: usize = 4;

impl Dynamics<'_, '_> {
    /// Puts what has neither mass nor damping where it is in balance, and gives what has damping alone the rate of
    /// balance.
    pub(super) fn balance_massless(&mut self) -> Result<(), Failure> {
        // Rates by backward differences: none of those before matters.
        let instant = Step { scheme: Scheme::newmark(1.0, 1.0), length: INSTANT * self.settings.step };
        let damped = self.damped_alone();
        let Self { stage, rateless, .. } = self;
        put_in_balance(stage, rateless, &instant)?;
        // Along axes without damping these come into balance first.
        if put_in_balance(stage, &damped, &instant)? {
            give_rates(stage, &damped, &instant)?;
        }
        Ok(())
    }

    /// The slots that have damping and no mass.
    fn damped_alone(&self) -> Vec<usize> {
        let kinds = &self.stage.model.kinds;
        let is_one = |&slot: &usize| {
            !self.massive[slot] && !kinds[slot].is_multiplier() && self.rateless.binary_search(&slot).is_err()
        };
        (0..kinds.len()).filter(is_one).collect()
    }
}

/// Puts slots where they are in balance; `false` where they are, or where no balance is found: then they move in the first
/// step.
fn put_in_balance(stage: &mut StageRun, slots: &[usize], instant: &Step) -> Result<bool, Failure> {
    if imbalance(stage, slots) <= 1.0 {
        return Ok(false);
    }
    // What has mass stays where it is.
    let start = stage.state.at_rest().into_owned();
    let Some(after) = state_after(stage, start, instant)? else { return Ok(false) };
    let StageRun { assembly, state, model, bookkeeper, .. } = stage;
    let strain = Entry::new(model, state, assembly).strain();
    slots.iter().for_each(|&slot| state.q[slot] = after.q[slot]);
    assembly.evaluate(state, Weights::NONE, None);
    bookkeeper.shift(Entry::new(model, state, assembly).strain() - strain);
    Ok(true)
}

/// Gives slots the rates of balance, if one is found. Where damping brakes what has mass within that instant, a shorter
/// one is tried.
fn give_rates(stage: &mut StageRun, slots: &[usize], instant: &Step) -> Result<(), Failure> {
    let mut instant = *instant;
    let mut least = f64::INFINITY;
    for _ in 0..MOST_INSTANTS {
        let start = State::clone(stage.state);
        let Some(after) = state_after(stage, start, &instant)? else { return Ok(()) };
        let before = stage.state.v.clone();
        slots.iter().for_each(|&slot| stage.state.v[slot] = after.v[slot]);
        let imbalance = imbalance(stage, slots);
        let is_better = imbalance < least;
        if !is_better {
            // Round-off of places is a rate over an instant, and along axes without damping no rate balances.
            stage.state.v.copy_from(&before);
        }
        if !is_better || imbalance <= 1.0 || imbalance > WORTHWHILE * least {
            return Ok(());
        }
        least = imbalance;
        instant.length *= SHORTER;
    }
    Ok(())
}

/// The largest force out of balance on some of these slots, over the one that passes for none.
fn imbalance(stage: &mut StageRun, slots: &[usize]) -> f64 {
    if slots.is_empty() {
        return 0.0;
    }
    let StageRun { assembly, newton, state, model, .. } = stage;
    assembly.forget();
    assembly.evaluate(state, Weights::NONE, None);
    let (system, dof_map) = (&assembly.system, &assembly.system.pattern.dof_map);
    let out_of_balance = |&slot: &usize| {
        let total = system.total(slot);
        let free = (total - dof_map.held_part(slot as Slot, total)).norm();
        if model.kinds[slot] == SlotKind::Rotation { free / model.length } else { free }
    };
    let largest = slots.iter().map(out_of_balance).fold(0.0, f64::max);
    if largest == 0.0 { 0.0 } else { largest / (newton.convergence.tolerance * model.largest_force(system)) }
}

/// The state at the end of a step from `start`; `None` where no balance is found. That of the stage stays.
fn state_after(stage: &mut StageRun, start: State, step: &Step) -> Result<Option<State>, Failure> {
    let StageRun { assembly, newton, state, model, counters, .. } = stage;
    let before = std::mem::replace(*state, start);
    step.predict(state, step.length);
    let solved = newton.solve(model, assembly, state, step, None, &mut counters.work);
    let after = std::mem::replace(*state, before);
    match solved {
        Ok(()) => Ok(Some(after)),
        Err(NewtonFailure::Interrupted(signal)) => Err(stage.stop(signal)),
        Err(_) => Ok(None),
    }
}
