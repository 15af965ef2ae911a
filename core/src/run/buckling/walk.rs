//! Ways along the path by load control, of which the analysis keeps an eye on whether they stay on
//! it.

use crate::model::charts;
use crate::run::distance::{NO_MOTION, distance};
use crate::run::failure::Failure;
use crate::run::stage_run::StageRun;
use crate::run::statics::{LARGEST_CONTRACTION, PathDirection};
use crate::system::State;

/// A state that has moved so many times further than the tangent said has come down on another
/// branch.
const LEAP: f64 = 8.0;
/// States of one load that lie nearer together than this are one.
const SAME: f64 = 1e-5;
/// A step along the path moves nothing further than this, in lengths of the scene and radians: a
/// longer one may come down on another branch.
const STRIDE: f64 = 0.5;
/// The path is not followed in steps smaller than this part of the way.
const SMALLEST_PART: f64 = 1e-4;

/// How far load control came on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walked {
    /// To the load factor that was wanted
    There,
    /// Not there, in steps however small
    Short,
    /// To where the mesh does not tell the shape
    TooCoarse,
}

/// Goes along the path to a load factor in steps that shrink where they must.
pub fn continue_path(stage: &mut StageRun, target: f64) -> Result<Walked, Failure> {
    let start = stage.state.load;
    let (mut done, mut part) = (0.0, 1.0_f64);
    stage.good.copy_from(stage.state);
    while done < 1.0 {
        let next = (done + part).min(1.0);
        let load = if next == 1.0 { target } else { start + (target - start) * next };
        let moved = step_along(stage, load);
        stage.unless_interrupted()?;
        let Some(moved) = moved else {
            stage.state.copy_from(stage.good);
            part *= 0.25;
            if part < SMALLEST_PART {
                return Ok(Walked::Short);
            }
            continue;
        };
        charts::freeze(stage.state, &stage.charted.elements);
        charts::wind(stage.state, stage.good, &stage.charted.rotations);
        if charts::coarsest(stage.state, &stage.charted.elements, charts::COARSE).is_some() {
            stage.state.copy_from(stage.good);
            return Ok(Walked::TooCoarse);
        }
        stage.remember();
        stage.good.copy_from(stage.state);
        done = next;
        part *= if moved < 0.5 * STRIDE { 2.0 } else { 1.0 };
    }
    Ok(Walked::There)
}

/// One step along the path: how far it moved, where it came down near by.
fn step_along(stage: &mut StageRun, load: f64) -> Option<f64> {
    let largest = if stage.is_linear() { f64::INFINITY } else { LARGEST_CONTRACTION };
    stage.attempt_within(load, largest).ok()?;
    if stage.newton.contraction > largest {
        return None;
    }
    let moved = distance(stage.model, stage.good, stage.state);
    (stage.is_linear() || moved <= STRIDE).then_some(moved)
}

/// True if the state is on another branch than one before it: it has moved much further than the
/// path goes there, or does not come back to it.
pub fn has_leapt(stage: &mut StageRun, from: &State) -> Result<bool, Failure> {
    let (to, step) = (stage.state.clone(), stage.state.load - from.load);
    stage.state.copy_from(from);
    // With the stiffness that contacts had on the way: what they gave way is no leap.
    let direction = stage.path_direction()?;
    let ahead = direction.map_or(0.0, |PathDirection { rate, .. }| {
        let mut ahead = from.clone();
        ahead.q.iter_mut().zip(&rate).for_each(|(q, rate)| *q += *rate * step);
        distance(stage.model, from, &ahead)
    });
    let far = distance(stage.model, from, &to) > (LEAP * ahead).max(NO_MOTION);
    stage.state.copy_from(&to);
    let leapt =
        far || continue_path(stage, from.load)? != Walked::There || distance(stage.model, from, stage.state) > SAME;
    stage.state.copy_from(&to);
    stage.good.copy_from(&to);
    Ok(leapt)
}
