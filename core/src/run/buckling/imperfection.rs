//! Critical loads of structures with a small imperfection, whose path turns aside and leads on.

use super::search::Sight;
use super::spectrum::{negative_pivots, next_critical_load};
use super::walk::{Walked, continue_path};
use super::{Aim, Behind, Buckling, Found, PathLimit, SoFar, is_near};
use crate::run::failure::Failure;
use crate::run::results::CriticalKind;
use crate::warning::WarningKind;

/// Parts of the way to the first critical load from which the others are seen, to know whether they stay where they are.
const PARTS_OF_SIGHTS: [f64; 2] = [0.3, 0.6];
/// The part of a load by which another one lies elsewhere.
const ELSEWHERE: f64 = 1e-2;
/// How far a critical load as it looks may move, over the load from which it is seen, where it is that of a structure
/// without a small imperfection.
const STEADY: f64 = 1e-2;
/// How far a critical load as it looks may move, over the load from which it is seen, where the path may well turn aside
/// there, which is told.
const NEARLY_STEADY: f64 = 5e-2;

impl Buckling<'_, '_> {
    /// The load at which a structure without a small imperfection buckles, where the path leads aside and on to a limit
    /// point: seen from smaller loads it stays where it is, as no limit point does.
    pub(super) fn imperfect(&mut self, found: &Found, aim: &Aim, so_far: &SoFar) -> Result<Option<Found>, Failure> {
        let load = found.critical.load;
        let is_limit = found.behind == Behind::Ends || found.critical.kind == CriticalKind::Limit;
        // Contacts that close on the way make the path stiffer.
        if !is_limit || self.stage.model.contacts().is_some() || so_far.limit.after(found) == PathLimit::Reached {
            return Ok(None);
        }
        // The path has turned aside at a load before, and ends there.
        let is_again = so_far.foreseen.is_some_and(|foreseen| is_near(foreseen, load, ELSEWHERE));
        let is_elsewhere = |sight: &Sight| {
            let lies_beyond = (load - sight.critical) * (sight.critical - sight.from) > 0.0;
            !is_near(sight.critical, load, ELSEWHERE) && (lies_beyond || is_again)
        };
        if !is_elsewhere(&aim.sight) || negative_pivots(self.stage).is_none() {
            return Ok(None);
        }
        let seen = self.sights(aim)?;
        let [.., last, now] = &seen[..] else { return Ok(None) };
        let drift = now.drift_since(last);
        if !is_elsewhere(now) || drift > NEARLY_STEADY {
            return Ok(None);
        }
        if drift > STEADY {
            self.warn_of_turn_aside(now.critical);
            return Ok(None);
        }
        self.warn_of_imperfection(now.critical, load);
        Ok(Some(Found::of_the_perfect(now.critical)))
    }

    /// A critical load as it looks from the start and from points on the way to the nearest one, as far as the path
    /// leads there.
    pub(super) fn sights(&mut self, aim: &Aim) -> Result<Vec<Sight>, Failure> {
        let start = aim.sight.from;
        let way = (aim.nearest - start).signum();
        let mut seen = vec![aim.sight];
        for part in PARTS_OF_SIGHTS {
            let from = start + part * (aim.nearest - start);
            if continue_path(self.stage, from)? != Walked::There {
                break;
            }
            let Some(critical) = next_critical_load(self.stage, way, aim.before)? else { break };
            seen.push(Sight { from, critical });
        }
        Ok(seen)
    }

    fn warn_of_imperfection(&mut self, load: f64, found: f64) {
        let message = format!(
            "a small imperfection makes the path deviate: without it the structure would buckle at load factor {load}, \
             which is in the list, as are its further buckling loads; the path itself loses its stiffness at load factor \
             {found}"
        );
        self.stage.warn(WarningKind::BucklingEstimate, message);
    }
}
