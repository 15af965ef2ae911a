//! Static stages: balance at growing loads, by load levels or along a path by arc length.

mod arc_length;
mod augment;
pub(super) mod checkpoint;
mod friction_account;
mod level_control;
mod levels;
mod load_control;
mod path;
mod path_point;
mod rest;
mod stability;

pub(super) use arc_length::ArcLength;
pub(super) use level_control::LoadLevels;
pub(super) use load_control::PathDirection;
pub(super) use stability::LARGEST_CONTRACTION;

use super::failure::Failure;
use super::spatial::SpatialLook;
use super::stage_run::StageRun;
use crate::kernel::Weights;
use crate::model::{StageError, charts};
use crate::solve::{SoftMode, Tangent};
use crate::warning::WarningKind;

/// Values of the largest tangent that is kept beside its factors at the start of a stage, 80 MB:
/// that saves a factorisation and an evaluation, and takes half as much memory again.
const MOST_KEPT_VALUES: usize = 10_000_000;

/// Puts the stage at rest, at load factor 0. What nothing holds as long as nothing is loaded is
/// named: levels may bring what holds it.
fn begin(stage: &mut StageRun, space: &mut SpatialLook) -> Result<Option<Failure>, Failure> {
    unload(stage)?;
    stage.refuse_penetration()?;
    stage.take_over();
    stage.linearise()?;
    let loose = match softest(stage).filter(|soft_mode| !soft_mode.vector.broke_down) {
        Some(soft_mode) if soft_mode.is_loose() => {
            let named = stage.name_mechanism(Some(soft_mode.vector), &stage.assembly.system);
            // Conditions that joints say twice no load makes one.
            if matches!(&named, Failure::Singular { place: Some(place), .. } if place.is_joint()) {
                return Err(named);
            }
            Some(named)
        }
        held => {
            // What cannot be factorised as long as nothing is loaded may be held by what the first
            // step brings.
            held.into_iter().for_each(|soft_mode| warn_of_soft_mode(stage, soft_mode));
            space.refuse_loose(stage, Weights::STIFFNESS).err()
        }
    };
    stage.open_account()?;
    Ok(loose)
}

/// No velocities, and no load that grows. Motors must not leap.
fn unload(stage: &mut StageRun) -> Result<(), Failure> {
    let StageRun { model, state, schedule, charted, .. } = stage;
    state.stand_still();
    let (time, amplitude) = (state.time, state.amplitude.clone());
    let held = state.q.clone();
    schedule.set_clock(model, state, time, 0.0);
    state.q = held;
    if let Some(leap) = model.motor_leaps(&amplitude, state).into_iter().next() {
        return Err(stage.describe(StageError::MotorJump(leap)));
    }
    charts::switch(state, &charted.rotations, charts::STATIC_BAND, None);
    charts::freeze(state, &charted.elements);
    Ok(())
}

/// The softest motion of the stiffness, which is formed. It stays beside its factors, since the
/// signs of pivots at the start and the first correction need both, unless that takes much memory.
fn softest(stage: &mut StageRun) -> Option<SoftMode> {
    let stays = stage.is_linear() || stage.assembly.system.values.len() <= MOST_KEPT_VALUES;
    let StageRun { assembly, newton, state, model, counters, number, .. } = stage;
    assembly.evaluate(state, Weights::STIFFNESS, None);
    counters.work.factorisations += 1;
    let mut tangent = if stays {
        let mut tangent = Tangent::that_stays(assembly, state);
        newton.solver.factorise_new(&mut tangent);
        tangent
    } else {
        Tangent::that_may_go(assembly, state, Weights::STIFFNESS)
    };
    SoftMode::find(&mut newton.solver, &mut tangent, model, *number > 0)
}

/// Warns of a motion that something holds, but softly, or by stress alone.
fn warn_of_soft_mode(stage: &mut StageRun, soft_mode: SoftMode) {
    if soft_mode.is_soft() {
        stage.warn_of_softness();
    }
    // At the start of a run cables and strings are meant to be so.
    if soft_mode.is_held_by_stress() {
        let named = stage.name_mechanism(Some(soft_mode.vector), &stage.assembly.system);
        let message =
            format!("only the stress at the start of the stage stabilises the structure; without it: {named}");
        stage.warn(WarningKind::HeldByStress, message);
    }
}
