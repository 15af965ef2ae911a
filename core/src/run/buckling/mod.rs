//! Where the path of equilibrium loses its stiffness: K(q(load), load) x = 0.
//!
//! About the present state the tangent varies along the path as K + m K', with K' its derivative
//! over the load factor; the eigenvalues m of K x = -m K' x tell how far away the critical loads
//! are. Each is then followed: the path is continued to the load found, and looked at again from
//! there, until it is reached.

mod imperfection;
mod search;
mod spectrum;
mod walk;

use self::search::{CriticalSearch, Sight};
use self::spectrum::{critical_loads, direction, negative_pivots, next_critical_load, rank, unpaired_critical_loads};
use self::walk::{Walked, continue_path, has_leapt};
use super::distance::distance;
use super::failure::Failure;
use super::results::{CriticalKind, CriticalLoad, StageResult};
use super::stage_run::{Analysis, StageRun};
use crate::sorting::sort_by;
use crate::system::State;
use crate::warning::WarningKind;

/// Looks at one critical load
const MOST_LOOKS: usize = 80;
/// Where pivots cannot be counted: an estimate this near to where it was made; what is left over is
/// its square.
const NEAR: f64 = 1e-4;
/// The motion by a unit of load just before a limit point, over that at the start: the root of one
/// over the part of a load to which it is closed in.
const RUNS_AWAY: f64 = 50.0;
/// The same for the work that loads do on the motion. Next to a bifurcation, round-off alone moves a scene
/// along the buckling mode, on which they do none.
const WORK_RUNS_AWAY: f64 = 2.0;
/// The way, over a load, that a path goes on behind it where it has no limit point there.
const BEHIND: f64 = 1e-4;
/// The part of a load to which the tangent next to it must foresee it: then it is critical for all
/// that can be told.
const FORESEEN: f64 = 1e-4;
/// The part of a load to which the tangent foresees it where an imperfection turns the path aside.
const ASIDE: f64 = 1e-2;
/// The largest distance of states on both sides of a critical load that lie on one path.
const APART: f64 = 1e-3;
/// Where the tangent is extrapolated: the part of the way to where it would be singular between two
/// looks.
const STRIDE_AHEAD: f64 = 0.15;
/// The part of a critical load by which the last extrapolation lies before it.
const NEAREST_EXTRAPOLATION: f64 = 5e-3;
/// The part of a load to which its estimate from the start is right where the tangent varies evenly up to it: it is no
/// limit point.
const WELL_FORESEEN: f64 = 2e-3;
/// Looks of one extrapolation.
const MOST_EXTRAPOLATIONS: usize = 48;

/// Where pivots cannot be counted: the largest difference, relative to a critical load that is known, between it and how it
/// looks from another state.
const LIKE_KNOWN: f64 = 2e-2;
/// The rate of motion next to a critical load, times that load, in lengths of the scene and radians, below
/// which what moves is round-off and no limit point. A ten-millionth before a limit point it is about
/// 1600 times the whole motion to it.
const STANDS_STILL: f64 = 1e-2;

/// The path is followed as far as this, in lengths of the scene.
const FARTHEST: f64 = 100.0;
/// An estimate that moves on as fast as the load from which it is seen, its drift being 1 within this, is no critical load:
/// a bar that heat lengthens without stress gives way only because it becomes long.
const KEEPS_DISTANCE: f64 = 1e-3;

/// The message about a scene without critical loads.
const NOTHING_BUCKLES: &str = "no load factor is found at which the scene loses its stiffness: its loads do not reduce \
                               it, or they are of a kind that makes vibrations grow (follower loads, moments fixed in \
                               space): look for the load at which a frequency of modal stages becomes zero, or grows";

/// Limit points whose loads differ by less, relative to the load, are one point.
const SAME_LIMIT: f64 = 1e-6;

/// The path behind a critical load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Behind {
    /// It goes on.
    GoesOn,
    /// Load control has ended there on its way, at a limit point or where an imperfection turns the path aside.
    Ends,
    /// It belongs to an imperfect structure, whose further critical loads are not those of the perfect one.
    Imperfect,
}

/// A critical load on its path.
struct Found {
    critical: CriticalLoad,
    behind: Behind,
}

impl Found {
    /// A load that was reached, or only estimated, without an end of the path.
    fn on_the_way(load: f64, kind: CriticalKind) -> Self {
        Self { critical: CriticalLoad { load, kind }, behind: Behind::GoesOn }
    }

    /// The load of a structure without its imperfection.
    fn of_the_perfect(load: f64) -> Self {
        Self { critical: CriticalLoad { load, kind: CriticalKind::Estimate }, behind: Behind::Imperfect }
    }
}

/// How far a path was followed.
enum Followed {
    /// To a critical load
    To(Found),
    /// As far as it may be, to this load, without one
    Far(f64),
}

/// A critical load as the tangent at smaller loads foresees it.
struct Extrapolation {
    load: f64,
    /// How fast it moves with the load from which it is seen; `None` from a single look
    drift: Option<f64>,
}

/// A critical load that is searched.
#[derive(Clone, Copy)]
struct Aim {
    /// As it looks from the start
    sight: Sight,
    /// The number of others before it
    before: usize,
    /// The first one in its direction, as it looks from the start
    nearest: f64,
}

/// How a scene answers to a unit of load.
struct Response {
    /// How far it moves, in lengths of the scene and radians
    size: f64,
    /// The work of the loads on that motion; `None` without loads
    work: Option<f64>,
}

/// True if a load is this near to another one, relative to it.
fn is_near(a: f64, b: f64, part: f64) -> bool {
    (a - b).abs() <= part * b.abs()
}

/// Critical loads as they look from a state, without those that look like known ones: each known one takes the nearest away.
fn without_known(mut seen: Vec<f64>, known: &[CriticalLoad]) -> Vec<f64> {
    for CriticalLoad { load, .. } in known {
        let off = |&at: &usize| (seen[at] - load).abs();
        let nearest = (0..seen.len()).min_by(|a, b| off(a).total_cmp(&off(b)));
        if let Some(at) = nearest.filter(|&at| is_near(seen[at], *load, LIKE_KNOWN)) {
            seen.remove(at);
        }
    }
    seen
}

/// The critical loads above the present one so far, or those below it.
#[derive(Default)]
struct SoFar {
    found: Vec<CriticalLoad>,
    limit: PathLimit,
    /// The estimate of the last one from the start, if it was right
    foreseen: Option<f64>,
}

/// The limit of a path above the present load, or below it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum PathLimit {
    /// The last critical load, if there is one, does not end the path by load control.
    #[default]
    Open,
    /// The last critical load ends it, at this load.
    At(f64),
    /// The search for the next critical load has come to the same load: none lies before it.
    Reached,
    /// A small imperfection turns the path aside: the next critical loads are those of a structure without it.
    Imperfect,
}

impl PathLimit {
    /// The limit after one more critical load.
    fn after(self, next: &Found) -> Self {
        let Found { critical: CriticalLoad { load, kind }, behind } = *next;
        let is_same = |limit: f64| behind == Behind::Ends && is_near(load, limit, SAME_LIMIT);
        match self {
            Self::At(limit) if is_same(limit) => Self::Reached,
            _ if behind == Behind::Ends || kind == CriticalKind::Limit => Self::At(load),
            _ if behind == Behind::Imperfect => Self::Imperfect,
            Self::Open | Self::At(_) | Self::Reached | Self::Imperfect => Self::Open,
        }
    }
}

/// A buckling stage.
pub(super) struct Buckling<'s, 'r> {
    pub(super) stage: &'s mut StageRun<'r>,
    /// The number of critical loads that are asked for
    pub(super) modes: usize,
}

impl<'r> Analysis<'r> for Buckling<'_, 'r> {
    fn stage(&mut self) -> &mut StageRun<'r> {
        self.stage
    }

    /// Finds the critical loads nearest above the present one, then those below it.
    fn run(&mut self) -> Result<(), Failure> {
        let moving = self.stand_still()?;
        let load = self.stage.state.load;
        let loads = critical_loads(self.stage, self.modes)?;
        let start = self.stage.state.clone();
        // Next to a critical load round-off moves the scene along; the load itself is closed in by
        // pivots.
        let uncertainty = self.stage.counters.work.uncertainty;
        let (above, below): (Vec<f64>, Vec<f64>) = loads.into_iter().partition(|&critical| critical > load);
        let mut found = self.find_all(&above, &start)?;
        found.extend(self.find_all(&below, &start)?);
        if found.is_empty() {
            return Err(Failure::Deck(format!("stage {}: {NOTHING_BUCKLES}", self.stage.number + 1)));
        }
        self.stage.counters.work.uncertainty = uncertainty;
        sort_by(&mut found, |a, b| rank(a.load, load).total_cmp(&rank(b.load, load)));
        self.stage.counters.steps += 1;
        // What moved moves on.
        self.stage.state.copy_rates(&moving);
        self.stage.give(&StageResult::CriticalLoads(found))
    }

    /// Nothing is off: motions go on behind a buckling stage.
    fn judge(&mut self) {}
}

impl Buckling<'_, '_> {
    /// Paths are followed from rest. Returns the state with its rates.
    fn stand_still(&mut self) -> Result<State, Failure> {
        let moving = self.stage.stand_still();
        let StageRun { model, state, fresh, schedule, .. } = &mut *self.stage;
        if *fresh {
            state.load = 0.0;
        }
        let (time, load) = (state.time, state.load);
        let held = state.q.clone();
        schedule.set_clock(model, state, time, load);
        state.q = held;
        self.stage.open_account()?;
        self.stage.warn_out_of_balance();
        Ok(moving)
    }

    /// The critical loads on one side of the present one that look from the start like these, up to a limit point
    /// that ends the path, or to one that is not there.
    fn find_all(&mut self, loads: &[f64], start: &State) -> Result<Vec<CriticalLoad>, Failure> {
        let mut so_far = SoFar::default();
        for (number, &seen) in loads.iter().enumerate() {
            let Some(next) = self.find(loads, number, start, &so_far)? else { break };
            so_far.limit = so_far.limit.after(&next);
            if so_far.limit == PathLimit::Reached {
                break;
            }
            so_far.foreseen = is_near(seen, next.critical.load, WELL_FORESEEN).then_some(seen);
            so_far.found.push(next.critical);
        }
        Ok(so_far.found)
    }

    /// The critical load that looks from the start as number `number` of these, behind those that were found so
    /// far; `None` if it only looks so. The state is then the start again.
    fn find(&mut self, loads: &[f64], number: usize, start: &State, so_far: &SoFar) -> Result<Option<Found>, Failure> {
        let aim = Aim { sight: Sight { from: start.load, critical: loads[number] }, before: number, nearest: loads[0] };
        if so_far.limit == PathLimit::Imperfect {
            let seen = self.sights(&aim)?;
            self.stage.go_back_to(start)?;
            return Ok(Some(Found::of_the_perfect(seen[seen.len() - 1].critical)));
        }
        // The look from the start is as much work as a search.
        let count = loads.len() as f64;
        let done = |come: f64| (1.0 + number as f64 + come) / (1.0 + count);
        let followed = self.follow(loads[number], number, &so_far.found, &done)?;
        self.stage.go_back_to(start)?;
        let mut found = match followed {
            Followed::To(found) => found,
            Followed::Far(load) => return self.foresee(&aim, load, start),
        };
        if found.critical.kind == CriticalKind::Estimate {
            let seen = self.extrapolate(loads[number], number)?;
            found.critical.load = seen.map_or(found.critical.load, |seen| seen.load);
        } else if let Some(perfect) = self.imperfect(&found, &aim, so_far)? {
            found = perfect;
        }
        self.stage.go_back_to(start)?;
        Ok(Some(found))
    }

    /// The critical load of a structure that an imperfection lets deflect without end, up to a load; `None` where smaller
    /// loads do not foresee it either.
    fn foresee(&mut self, aim: &Aim, followed_to: f64, start: &State) -> Result<Option<Found>, Failure> {
        let seen = self.extrapolate(aim.sight.critical, aim.before)?;
        let seen = seen.filter(|seen| seen.drift.is_some_and(|drift| (drift - 1.0).abs() > KEEPS_DISTANCE));
        self.stage.go_back_to(start)?;
        if seen.is_some() {
            self.warn_of_estimate(followed_to, None);
        }
        Ok(seen.map(|seen| Found::of_the_perfect(seen.load)))
    }

    /// Follows the path to the critical load behind which `before` + 1 more pivots are negative.
    /// Every attempt starts from the last point before it, since behind it the way back is not sure
    /// to be the same. `done` tells the part of the stage that lies behind with some part of this.
    fn follow(
        &mut self,
        estimate: f64,
        before: usize,
        known: &[CriticalLoad],
        done: &dyn Fn(f64) -> f64,
    ) -> Result<Followed, Failure> {
        let start = self.stage.state.clone();
        let at_start = self.response()?;
        let none = negative_pivots(self.stage);
        let mut search = CriticalSearch::new(start.clone(), estimate);
        for _ in 0..MOST_LOOKS {
            if let Some(found) = search.found() {
                let ended = search.ended.is_some();
                let goes_on = ended && self.goes_on(&search, found, none.map(|none| none + before))?;
                if goes_on && self.passes_by(&mut search, found, before)? {
                    continue;
                }
                let is_apart = |behind: &State| distance(self.stage.model, &search.here, behind) > APART;
                if search.is_a_limit(found) && !search.behind.as_ref().is_some_and(is_apart) {
                    self.stage.state.copy_from(&search.here);
                    self.stage.judge_mesh()?;
                    // A path that goes on has no limit point: an imperfection turns it aside next to a bifurcation.
                    let kind = if goes_on { CriticalKind::Branch } else { self.kind_of_critical(&at_start)? };
                    let ends_path = ended && (goes_on || kind == CriticalKind::Limit);
                    let behind = if ends_path { Behind::Ends } else { Behind::GoesOn };
                    return Ok(Followed::To(Found { critical: CriticalLoad { load: found, kind }, behind }));
                }
                break;
            }
            if distance(self.stage.model, &start, &search.here) > FARTHEST {
                return Ok(Followed::Far(search.here.load));
            }
            let target = search.target();
            self.stage.go_back_to(&search.here)?;
            self.stage.tell_progress(done(search.come()))?;
            let walked = continue_path(self.stage, target)?;
            if walked != Walked::There || has_leapt(self.stage, &search.here)? {
                // Load control ends at limit points, or comes down on another branch.
                search.end_at(target, walked);
                continue;
            }
            let count = negative_pivots(self.stage);
            let Some(passed) = none.zip(count).map(|(none, count)| count.saturating_sub(none)) else {
                // Without a count of pivots the tangent itself must do.
                self.stage.go_back_to(&search.here)?;
                return self.follow_nearest(search.estimate, before, known, done).map(Followed::To);
            };
            if passed > before {
                search.close_at(target, self.stage.state.clone());
            } else {
                let ahead = next_critical_load(self.stage, search.way, before - passed)?;
                search.advance(self.stage.state, ahead);
            }
        }
        self.warn_of_estimate(search.here.load, search.ended);
        Ok(Followed::To(match search.ended {
            Some(Walked::TooCoarse) => Found::on_the_way(search.estimate, CriticalKind::Estimate),
            None | Some(Walked::There | Walked::Short) => Found::of_the_perfect(search.estimate),
        }))
    }

    /// True if the load is no critical one: the tangent next to it does not foresee it, and the search goes on from the
    /// present state, behind it. A step from further away came down elsewhere, or nowhere.
    fn passes_by(&mut self, search: &mut CriticalSearch, load: f64, before: usize) -> Result<bool, Failure> {
        let behind = self.stage.state.clone();
        let off = self.foreseen(search, load, before)?;
        if off <= FORESEEN {
            return Ok(false);
        }
        if off < ASIDE {
            self.warn_of_turn_aside(load);
        }
        self.stage.go_back_to(&behind)?;
        let ahead = next_critical_load(self.stage, search.way, before)?;
        search.go_on_from(self.stage.state, ahead);
        Ok(true)
    }

    /// How far from a load, relative to it, the tangent of the last point before it looks singular.
    /// A structure with a small imperfection has no critical point there, but its path runs aside
    /// as if it had, the more sharply the smaller the imperfection.
    fn foreseen(&mut self, search: &CriticalSearch, load: f64, before: usize) -> Result<f64, Failure> {
        self.stage.state.copy_from(&search.here);
        let seen = unpaired_critical_loads(self.stage, before + 4)?;
        Ok(seen.into_iter().map(|seen| (seen - load).abs() / load.abs()).fold(f64::INFINITY, f64::min))
    }

    /// True if load control follows the path past a load from next to it, with so many negative
    /// pivots. The state is then that point.
    fn goes_on(&mut self, search: &CriticalSearch, load: f64, negative: Option<usize>) -> Result<bool, Failure> {
        self.stage.go_back_to(&search.here)?;
        let walked = continue_path(self.stage, load + search.way * BEHIND * load.abs())?;
        Ok(walked == Walked::There
            && !has_leapt(self.stage, &search.here)?
            && negative.is_some_and(|most| negative_pivots(self.stage).is_some_and(|count| count <= most)))
    }

    /// The kind of the critical load just ahead of the present state: towards a limit point the
    /// path moves without bounds.
    fn kind_of_critical(&mut self, at_start: &Response) -> Result<CriticalKind, Failure> {
        let here = self.response()?;
        let works = here.work.zip(at_start.work).is_none_or(|(now, first)| now.abs() > WORK_RUNS_AWAY * first.abs());
        let moves = here.size * self.stage.state.load.abs() > STANDS_STILL;
        let runs_away = here.size > RUNS_AWAY * at_start.size && moves && works;
        Ok(if runs_away { CriticalKind::Limit } else { CriticalKind::Branch })
    }

    /// How a unit of load moves the scene at the present state.
    fn response(&mut self) -> Result<Response, Failure> {
        let Some(direction) = direction(self.stage)? else { return Ok(Response { size: 0.0, work: None }) };
        let model = &self.stage.model;
        let sizes = direction.rate.iter().zip(model.kinds.iter()).filter(|(_, kind)| !kind.is_multiplier());
        let size = sizes.map(|(rate, kind)| rate.norm() / kind.scale(model.length)).fold(0.0, f64::max);
        Ok(Response { size, work: direction.work_rate(model) })
    }

    /// A structure that an imperfection lets turn aside has no critical point. From smaller loads
    /// its tangent looks like that of the perfect one: there the load at which it seems to be
    /// singular does not move, until the imperfection is felt. That load, of the critical load with
    /// `before` others below it; `None` where nothing is seen.
    fn extrapolate(&mut self, first: f64, before: usize) -> Result<Option<Extrapolation>, Failure> {
        let way = (first - self.stage.state.load).signum();
        let mut last: Option<Sight> = None;
        let mut steadiest: Option<Extrapolation> = None;
        for _ in 0..MOST_EXTRAPOLATIONS {
            let load = self.stage.state.load;
            let Some(critical) = next_critical_load(self.stage, way, before)? else { break };
            let now = Sight { from: load, critical };
            let drift = last.as_ref().map(|last| now.drift_since(last));
            let is_steadier =
                |than: &Extrapolation| drift.is_some_and(|drift| than.drift.is_none_or(|than| drift < than));
            if steadiest.as_ref().is_none_or(is_steadier) {
                let load = last.map_or(critical, |last| 0.5 * (critical + last.critical));
                steadiest = Some(Extrapolation { load, drift });
            }
            last = Some(now);
            if (critical - load).abs() < NEAREST_EXTRAPOLATION * critical.abs() {
                break;
            }
            let none = negative_pivots(self.stage);
            self.stage.good.copy_from(self.stage.state);
            if continue_path(self.stage, load + STRIDE_AHEAD * (critical - load))? != Walked::There
                || negative_pivots(self.stage) != none
            {
                break;
            }
        }
        Ok(steadiest)
    }

    /// Goes from estimate to estimate, each what the critical load looks like from the last. Those that look like a known
    /// one are that one, as often as it is known.
    fn follow_nearest(
        &mut self,
        mut critical: f64,
        before: usize,
        known: &[CriticalLoad],
        done: &dyn Fn(f64) -> f64,
    ) -> Result<Found, Failure> {
        let mut walked = Walked::There;
        for _ in 0..MOST_LOOKS {
            self.stage.tell_progress(done(0.0))?;
            let from = self.stage.state.load;
            let near = without_known(critical_loads(self.stage, before + 4)?, known);
            // Those that were passed lie behind: it is the one that looks most like the last
            // estimate.
            let off = |load: &f64| (load - critical).abs();
            let Some(next) = near.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))) else { break };
            critical = next;
            if (critical - from).abs() <= NEAR * critical.abs() {
                return Ok(Found::on_the_way(critical, CriticalKind::Branch));
            }
            let target = critical - 0.5 * NEAR * (critical - self.stage.state.load).signum() * critical.abs();
            walked = continue_path(self.stage, target)?;
            if walked != Walked::There {
                break;
            }
        }
        self.warn_of_estimate(self.stage.state.load, Some(walked));
        Ok(Found::on_the_way(critical, CriticalKind::Estimate))
    }

    fn warn_of_turn_aside(&mut self, load: f64) {
        let message = format!(
            "near load factor {load} the path bends away: a structure with a smaller imperfection would buckle there; \
             the buckling load in the list lies further along the path"
        );
        self.stage.warn(WarningKind::BucklingEstimate, message);
    }

    fn warn_of_estimate(&mut self, from: f64, ended: Option<Walked>) {
        let coarse = ended == Some(Walked::TooCoarse);
        let why = if coarse {
            "beyond it the mesh is too coarse: use more `elements`"
        } else {
            "a structure with a small imperfection deflects gradually and has none"
        };
        let message = format!(
            "a buckling load is only an estimate, extrapolated from smaller loads: no critical point was found on the \
             path up to load factor {from} ({why})"
        );
        self.stage.warn(WarningKind::BucklingEstimate, message);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The loads that are listed of those that searches in one direction come to.
    fn listed(searches: &[(f64, CriticalKind, Behind)]) -> Vec<f64> {
        let mut direction = PathLimit::Open;
        let mut loads = Vec::new();
        for &(load, kind, behind) in searches {
            direction = direction.after(&Found { critical: CriticalLoad { load, kind }, behind });
            if direction == PathLimit::Reached {
                break;
            }
            loads.push(load);
        }
        loads
    }

    #[test]
    fn each_known_load_takes_one_of_those_in_sight_away() {
        let known = [7.0, 7.001].map(|load| CriticalLoad { load, kind: CriticalKind::Branch });
        assert_eq!(without_known(vec![7.01, 9.0], &known[..1]), [9.0]);
        assert_eq!(without_known(vec![7.0, 7.0, 9.0], &known[..1]), [7.0, 9.0]);
        assert_eq!(without_known(vec![7.0, 6.99, 9.0], &known), [9.0]);
        assert_eq!(without_known(vec![7.3, 9.0], &known), [7.3, 9.0]);
    }

    #[test]
    fn a_limit_point_that_is_reached_again_ends_the_list() {
        use Behind::{Ends, GoesOn, Imperfect};
        use CriticalKind::{Branch, Estimate, Limit};
        assert_eq!(listed(&[(9.0, Limit, Ends), (9.0 + 1e-7, Limit, Ends), (9.0, Limit, Ends)]), [9.0]);
        assert_eq!(listed(&[(7.0, Branch, GoesOn), (9.0, Limit, Ends), (9.0, Limit, Ends)]), [7.0, 9.0]);
        // Steep bifurcations pass for limit points.
        let steep = [(1.03, Limit, Ends), (1.05, Branch, GoesOn), (1.07, Limit, Ends)];
        assert_eq!(listed(&steep), [1.03, 1.05, 1.07]);
        assert_eq!(listed(&[(1.0, Limit, GoesOn), (1.0, Limit, GoesOn)]), [1.0, 1.0]);
        assert_eq!(listed(&[(1.0, Branch, GoesOn), (1.0, Branch, GoesOn)]), [1.0, 1.0]);
        assert_eq!(listed(&[(1.0, Estimate, Imperfect), (1.0, Estimate, Imperfect)]), [1.0, 1.0]);
    }
}
