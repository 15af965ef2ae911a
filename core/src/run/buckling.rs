//! Where the path of equilibrium loses its stiffness: K(q(load), load) x = 0.
//!
//! About the present state the tangent varies along the path as K + m K', with K' its derivative over the load factor; the
//! eigenvalues m of K x = -m K' x tell how far away the critical loads are. Each is then followed: the path is continued to
//! the load found, and looked at again from there, until it is reached.

use super::analysis_results::{CriticalKind, CriticalLoad};
use super::direction::Direction;
use super::failure::Failure;
use super::levels::{LARGEST_CONTRACTION, NO_MOTION, distance};
use super::stage_run::{Run, StageRun};
use crate::kernel::Weights;
use crate::model::charts;
use crate::solve::{LinearSolver, Operator, Tangent, is_symmetric, largest_eigenvalues, mechanism};
use crate::system::{State, System};
use crate::tensor::Vec3;
use crate::warning::WarningKind;
use nalgebra::Complex;

/// How far the state is moved along the path to see the tangent vary: lengths of the scene, and radians.
const PROBE: f64 = 1e-5;
/// Looks at one critical load.
const MOST_LOOKS: usize = 80;
/// A critical load is known when it lies between two points of the path this near to each other, relative to itself.
const CLOSED: f64 = 1e-7;
/// Where pivots cannot be counted: an estimate this near to where it was made; what is left over is its square.
const NEAR: f64 = 1e-4;
/// Where load control ends, the tangent must see a critical load this near.
const SEEN: f64 = 1e-3;
/// A state that has moved so many times further than the tangent said has come down on another branch.
const LEAP: f64 = 8.0;
/// Just before a limit point a unit of load moves the scene so many times further than at the start: by the root of one over [`CLOSED`].
const RUNS_AWAY: f64 = 50.0;
/// A path that goes on so far behind a load, relative to it, has no limit point there.
const BEHIND: f64 = 1e-4;
/// A load that the tangent next to it foresees, to this part of it, is critical for all that can be told.
const FORESEEN: f64 = 1e-4;
/// Where it foresees the load to this part of it only, an imperfection turns the path aside.
const ASIDE: f64 = 1e-2;
/// States on both sides of a critical load that are further apart than this do not lie on one path.
const APART: f64 = 1e-3;
/// States of one load that lie nearer together than this are one.
const SAME: f64 = 1e-5;
/// A step along the path moves nothing further than this, in lengths of the scene and radians: a longer one may come down on
/// another branch.
const STRIDE: f64 = 0.5;
/// Where the tangent is extrapolated, so much of the way to where it would be singular lies between two looks,
const STRIDE_AHEAD: f64 = 0.15;
/// so near is the last one,
const NEAREST_EXTRAPOLATION: f64 = 5e-3;
/// and there are so many.
const MOST_EXTRAPOLATIONS: usize = 48;
/// The path is not followed in steps smaller than this part of the way.
const SMALLEST_PART: f64 = 1e-4;
/// Imaginary part up to which a critical load counts as real, relative; double ones come apart a little.
const REAL: f64 = 1e-3;

impl Run<'_> {
    /// The critical loads nearest above the present one, then those below it.
    pub(super) fn run_buckling(&mut self, workshop: &mut StageRun, modes: usize) -> Result<(), Failure> {
        self.stand_still();
        if self.fresh {
            self.state.load = 0.0;
        }
        let (time, load) = (self.state.time, self.state.load);
        let held = self.state.q.clone();
        self.schedule.set_clock(&self.model, &mut self.state, time, load);
        self.state.q = held;
        self.change_charts(None);
        self.open_account(workshop)?;
        self.warn_out_of_balance(workshop);
        let loads = self.critical_loads(workshop, modes)?;
        if loads.is_empty() {
            return Err(Failure::Deck("no load of this scene takes stiffness away: nothing can buckle (under following loads it may flutter: \
                 see a modal stage)".into()));
        }
        let start = self.state.clone();
        // Next to a critical load round-off moves the scene along; the load itself is closed in by pivots.
        let uncertainty = self.counters.work.uncertainty;
        let mut passed = [0, 0];
        let mut found = Vec::new();
        for number in 0..loads.len() {
            let back = loads[number] < load;
            // Of the loads on this side of the present one it is number `before`.
            let before = passed[usize::from(back)];
            passed[usize::from(back)] += 1;
            // The look from the start is as much work as a search.
            let count = loads.len() as f64;
            let done = |come: f64| (1.0 + number as f64 + come) / (1.0 + count);
            let mut critical = self.follow(workshop, loads[number], before, &done)?;
            self.state.copy_from(&start);
            self.good.copy_from(&start);
            if critical.kind == CriticalKind::Estimate {
                critical.load = self.extrapolate(workshop, loads[number], before)?.unwrap_or(critical.load);
                self.state.copy_from(&start);
                self.good.copy_from(&start);
            }
            found.push(critical);
        }
        self.counters.work.uncertainty = uncertainty;
        found.sort_by(|a, b| rank(a.load, load).total_cmp(&rank(b.load, load)));
        self.count_steps();
        self.observer.buckling(self.stage + 1, &found)
    }

    /// Follows the path to the critical load behind which `before` + 1 more pivots are negative. Every attempt starts from the
    /// last point before it, since behind it the way back is not sure to be the same. `done` tells the part of the stage that lies behind with
    /// some part of this.
    fn follow(
        &mut self,
        workshop: &mut StageRun,
        estimate: f64,
        before: usize,
        done: &dyn Fn(f64) -> f64,
    ) -> Result<CriticalLoad, Failure> {
        let way = (estimate - self.state.load).signum();
        let start_rate = self.size_of_rate(workshop)?;
        let none = self.negative_pivots(workshop);
        let mut search = Search {
            here: self.state.clone(),
            beyond: None,
            behind: None,
            estimate,
            stretch: 1.0,
            way,
            seen: estimate,
            ended: None,
        };
        for _ in 0..MOST_LOOKS {
            if let Some(found) = search.found() {
                let off = if search.ended.is_some() { self.foreseen(workshop, &search, found, before)? } else { 0.0 };
                if off > FORESEEN && self.goes_on(workshop, &search, found, none.map(|none| none + before))? {
                    if off < ASIDE {
                        self.warn_of_turn_aside(found);
                    }
                    // A step from further away came down elsewhere, or nowhere.
                    let ahead = self.next_critical(workshop, way, before)?;
                    search.go_on_from(&self.state, ahead);
                    continue;
                }
                let is_apart = |behind: &State| distance(&self.model, &search.here, behind) > APART;
                if search.is_a_limit(found) && !search.behind.as_ref().is_some_and(is_apart) {
                    self.state.copy_from(&search.here);
                    self.judge_mesh()?;
                    let kind = self.kind_of_critical(workshop, start_rate)?;
                    return Ok(CriticalLoad { load: found, kind });
                }
                break;
            }
            let target = search.target();
            self.state.copy_from(&search.here);
            self.good.copy_from(&search.here);
            self.observer.progress(self.moment(), self.static_progress(done(search.come())))?;
            let walked = self.continue_path(workshop, target);
            if walked != Walked::There || self.has_leapt(workshop, &search.here)? {
                // Load control ends at limit points, or comes down on another branch.
                search.end_at(target, walked);
                continue;
            }
            let count = self.negative_pivots(workshop);
            let Some(passed) = none.zip(count).map(|(none, count)| count.saturating_sub(none)) else {
                // Without a count of pivots the tangent itself must do.
                self.state.copy_from(&search.here);
                self.good.copy_from(&search.here);
                return self.follow_nearest(workshop, search.estimate, before, done);
            };
            if passed > before {
                search.beyond = Some(target);
                search.behind = Some(self.state.clone());
                search.ended = None;
                search.stretch = 1.0;
            } else {
                let ahead = self.next_critical(workshop, way, before - passed)?;
                search.advance(&self.state, ahead);
            }
        }
        self.warn_of_estimate(search.here.load, search.ended);
        Ok(CriticalLoad { load: search.estimate, kind: CriticalKind::Estimate })
    }

    /// How far from a load, relative to it, the tangent of the last point before it looks singular. A structure with a small imperfection has no
    /// critical point there, but its path runs aside as if it had, the more sharply the smaller the imperfection.
    fn foreseen(&mut self, workshop: &mut StageRun, search: &Search, load: f64, before: usize) -> Result<f64, Failure> {
        self.state.copy_from(&search.here);
        let seen = self.critical_loads(workshop, before + 4)?;
        Ok(seen.into_iter().map(|seen| (seen - load).abs() / load.abs()).fold(f64::INFINITY, f64::min))
    }

    /// Whether load control follows the path past a load from next to it, with so many negative pivots. The state is then that point.
    fn goes_on(
        &mut self,
        workshop: &mut StageRun,
        search: &Search,
        load: f64,
        negative: Option<usize>,
    ) -> Result<bool, Failure> {
        self.state.copy_from(&search.here);
        self.good.copy_from(&search.here);
        let walked = self.continue_path(workshop, load + search.way * BEHIND * load.abs());
        Ok(walked == Walked::There
            && !self.has_leapt(workshop, &search.here)?
            && negative.is_some_and(|most| self.negative_pivots(workshop).is_some_and(|count| count <= most)))
    }

    /// The critical load with `before` others between it and the present one, as it looks from here.
    fn next_critical(&mut self, workshop: &mut StageRun, way: f64, before: usize) -> Result<Option<f64>, Failure> {
        let load = self.state.load;
        let ahead = self.critical_loads(workshop, before + 4)?;
        Ok(ahead.into_iter().filter(|critical| (critical - load) * way > 0.0).nth(before))
    }

    /// What lies just ahead of the present state: towards a limit point the path moves without bounds.
    fn kind_of_critical(&mut self, workshop: &mut StageRun, start_rate: f64) -> Result<CriticalKind, Failure> {
        let runs_away = self.size_of_rate(workshop)? > RUNS_AWAY * start_rate;
        Ok(if runs_away { CriticalKind::Limit } else { CriticalKind::Branch })
    }

    /// How far a unit of load moves the scene at the present state, in lengths of it and radians.
    fn size_of_rate(&mut self, workshop: &mut StageRun) -> Result<f64, Failure> {
        let Some(Direction { rate, .. }) = self.path_direction(workshop)? else { return Ok(0.0) };
        let sizes = rate.iter().zip(self.model.kinds.iter()).filter(|(_, kind)| !kind.is_multiplier());
        Ok(sizes.map(|(rate, kind)| rate.norm() / kind.scale(self.model.length)).fold(0.0, f64::max))
    }

    /// A structure that an imperfection lets turn aside has no critical point. From smaller loads its tangent looks like that of the perfect one:
    /// there the load at which it seems to be singular does not move, until the imperfection is felt. That load, of the critical
    /// load with `before` others below it; `None` where nothing is seen.
    fn extrapolate(&mut self, workshop: &mut StageRun, first: f64, before: usize) -> Result<Option<f64>, Failure> {
        let way = (first - self.state.load).signum();
        let mut last: Option<Sight> = None;
        let (mut least_drift, mut steadiest) = (f64::INFINITY, None);
        for _ in 0..MOST_EXTRAPOLATIONS {
            let load = self.state.load;
            let Some(critical) = self.next_critical(workshop, way, before)? else { break };
            let now = Sight { from: load, critical };
            let drift = last.as_ref().map_or(f64::MAX, |last| now.drift_since(last));
            if drift < least_drift {
                least_drift = drift;
                steadiest = Some(last.map_or(critical, |last| 0.5 * (critical + last.critical)));
            }
            last = Some(now);
            if (critical - load).abs() < NEAREST_EXTRAPOLATION * critical.abs() {
                break;
            }
            let none = self.negative_pivots(workshop);
            self.good.copy_from(&self.state);
            if self.continue_path(workshop, load + STRIDE_AHEAD * (critical - load)) != Walked::There
                || self.negative_pivots(workshop) != none
            {
                break;
            }
        }
        Ok(steadiest)
    }

    /// Whether the state is on another branch than one before it: it has moved much further than the path goes there, or does not
    /// come back to it.
    fn has_leapt(&mut self, workshop: &mut StageRun, from: &State) -> Result<bool, Failure> {
        let (to, step) = (self.state.clone(), self.state.load - from.load);
        self.state.copy_from(from);
        let direction = self.path_direction(workshop)?;
        let ahead = direction.map_or(0.0, |Direction { rate, .. }| {
            let mut ahead = from.clone();
            ahead.q.iter_mut().zip(&rate).for_each(|(q, rate)| *q += *rate * step);
            distance(&self.model, from, &ahead)
        });
        let far = distance(&self.model, from, &to) > (LEAP * ahead).max(NO_MOTION);
        self.state.copy_from(&to);
        let leapt = far
            || self.continue_path(workshop, from.load) != Walked::There
            || distance(&self.model, from, &self.state) > SAME;
        self.state.copy_from(&to);
        self.good.copy_from(&to);
        Ok(leapt)
    }

    /// Goes from estimate to estimate, each what the critical load looks like from the last.
    fn follow_nearest(
        &mut self,
        workshop: &mut StageRun,
        mut critical: f64,
        before: usize,
        done: &dyn Fn(f64) -> f64,
    ) -> Result<CriticalLoad, Failure> {
        let mut walked = Walked::There;
        for _ in 0..MOST_LOOKS {
            self.observer.progress(self.moment(), self.static_progress(done(0.0)))?;
            let from = self.state.load;
            let near = self.critical_loads(workshop, before + 4)?;
            // Those that were passed lie behind: it is the one that looks most like the last estimate.
            let off = |load: &f64| (load - critical).abs();
            let Some(next) = near.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))) else { break };
            critical = next;
            if (critical - from).abs() <= NEAR * critical.abs() {
                return Ok(CriticalLoad { load: critical, kind: CriticalKind::Branch });
            }
            let target = critical - 0.5 * NEAR * (critical - self.state.load).signum() * critical.abs();
            walked = self.continue_path(workshop, target);
            if walked != Walked::There {
                break;
            }
        }
        self.warn_of_estimate(self.state.load, Some(walked));
        Ok(CriticalLoad { load: critical, kind: CriticalKind::Estimate })
    }

    fn warn_of_turn_aside(&mut self, load: f64) {
        let message = format!(
            "next to load factor {load} the path turns aside, as where a structure with a smaller imperfection buckles; the buckling load \
             that is listed lies further on"
        );
        self.warn(WarningKind::BucklingEstimate, message);
    }

    fn warn_of_estimate(&mut self, from: f64, ended: Option<Walked>) {
        let coarse = ended == Some(Walked::TooCoarse);
        let why = if coarse {
            "beyond it the mesh is too coarse for the shape: use more `elements`"
        } else {
            "a structure with a small imperfection bends aside and has none"
        };
        let message = format!(
            "a buckling load is an estimate, extrapolated from smaller loads: no critical point was found on the path up to load factor \
             {from} ({why})"
        );
        self.warn(WarningKind::BucklingEstimate, message);
    }

    /// Of the tangent at the present state, where it is symmetric.
    fn negative_pivots(&mut self, workshop: &mut StageRun) -> Option<usize> {
        let StageRun { assembly, newton, .. } = workshop;
        assembly.forget();
        assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        newton.solver.negative_pivots(&mut Tangent::that_may_go(assembly, &self.state, Weights::STIFFNESS))
    }

    /// Goes along the path to a load factor in steps that shrink where they must.
    fn continue_path(&mut self, workshop: &mut StageRun, target: f64) -> Walked {
        let start = self.state.load;
        let (mut done, mut part) = (0.0, 1.0_f64);
        self.good.copy_from(&self.state);
        while done < 1.0 {
            let next = (done + part).min(1.0);
            let load = if next == 1.0 { target } else { start + (target - start) * next };
            let Some(moved) = self.step_along(workshop, load) else {
                self.state.copy_from(&self.good);
                part *= 0.25;
                if part < SMALLEST_PART {
                    return Walked::Short;
                }
                continue;
            };
            charts::freeze(&mut self.state, &self.schedule.charted(&self.model).elements);
            charts::wind(&mut self.state, &self.good, &self.schedule.charted(&self.model).rotations);
            if charts::coarsest(&self.state, &self.schedule.charted(&self.model).elements, charts::COARSE).is_some() {
                self.state.copy_from(&self.good);
                return Walked::TooCoarse;
            }
            self.model.remember(&mut self.state);
            self.good.copy_from(&self.state);
            done = next;
            part *= if moved < 0.5 * STRIDE { 2.0 } else { 1.0 };
        }
        Walked::There
    }

    /// One step along the path: how far it moved, where it came down near by.
    fn step_along(&mut self, workshop: &mut StageRun, load: f64) -> Option<f64> {
        self.attempt(workshop, load).ok()?;
        if workshop.newton.contraction > LARGEST_CONTRACTION && !self.is_linear() {
            return None;
        }
        let moved = distance(&self.model, &self.good, &self.state);
        (self.is_linear() || moved <= STRIDE).then_some(moved)
    }

    /// The critical loads as they look from the present state.
    fn critical_loads(&mut self, workshop: &mut StageRun, modes: usize) -> Result<Vec<f64>, Failure> {
        let Some(Direction { rate: direction, .. }) = self.path_direction(workshop)? else { return Ok(Vec::new()) };
        let size = direction.iter().zip(self.model.kinds.iter()).filter(|(_, kind)| !kind.is_multiplier());
        let size = size.map(|(d, kind)| d.norm() * kind.arm(self.model.length) / self.model.length).fold(0.0, f64::max);
        let reach = if size > 0.0 { (PROBE / size).min(1e6) } else { 1.0 };
        let varied = self.varied_tangent(workshop, &direction, reach);
        let StageRun { assembly, newton, .. } = workshop;
        assembly.evaluate(&self.state, Weights::STIFFNESS, None);
        self.counters.work.factorisations += 1;
        let done = newton.solver.factorise_surely(&assembly.system);
        let mut tangent = Tangent::that_stays(assembly, &self.state);
        if !done {
            let vector = mechanism(&mut newton.solver, &mut tangent, &self.model);
            return Err(self.name_mechanism(vector, &workshop.assembly.system));
        }
        // A stable state of a conservative scene: the tangent is an inner product in which everything is symmetric.
        let stable = newton.solver.negative_pivots(&mut tangent) == Some(0);
        let system = &assembly.system;
        let symmetric = stable && self.model.multipliers.is_empty();
        let symmetric = symmetric && is_symmetric(&system.pattern, &varied);
        let mut operator = Softening { system, varied: &varied, solver: &mut newton.solver, symmetric };
        let found = largest_eigenvalues(&mut operator, 4 * modes + 8).unwrap_or_default().values;
        let load = self.state.load;
        let real = |theta: &&Complex<f64>| theta.norm() > 0.0 && theta.im.abs() <= REAL * theta.norm();
        let mut loads: Vec<f64> = found.iter().filter(real).map(|theta| load + 1.0 / theta.re).collect();
        loads.sort_by(|a, b| rank(*a, load).total_cmp(&rank(*b, load)));
        loads.truncate(modes);
        Ok(loads)
    }

    /// (K(q + r dq, load + r) - K(q - r dq, load - r)) / 2r
    fn varied_tangent(&mut self, workshop: &mut StageRun, direction: &[Vec3], reach: f64) -> Vec<f64> {
        let assembly = &mut workshop.assembly;
        assembly.forget();
        let mut tangent = |reach: f64| {
            let mut state = self.state.clone();
            self.schedule.set_clock(&self.model, &mut state, self.state.time, self.state.load + reach);
            state.q.copy_from_slice(&self.state.q);
            state.q.iter_mut().zip(direction).for_each(|(q, &d)| *q += d * reach);
            assembly.evaluate(&state, Weights::STIFFNESS, None);
            assembly.system.values.clone()
        };
        let (after, before) = (tangent(reach), tangent(-reach));
        after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * reach)).collect()
    }
}

/// What a critical load looks like from a load.
struct Sight {
    from: f64,
    critical: f64,
}

impl Sight {
    /// How fast it moves with the load from which it is seen.
    fn drift_since(&self, last: &Self) -> f64 {
        ((self.critical - last.critical) / (self.from - last.from)).abs()
    }
}

/// A critical load between a state that lies before it and a load that lies beyond.
struct Search {
    here: State,
    beyond: Option<f64>,
    /// The state at the load that lies beyond, where load control comes to it
    behind: Option<State>,
    /// What it looks like from here
    estimate: f64,
    /// How much farther than the estimate the next look goes: it may fall short again and again
    stretch: f64,
    way: f64,
    /// What the tangent of the last point before it said
    seen: f64,
    /// How load control went where what lies beyond is known only from that it did not get there, or not on this branch
    ended: Option<Walked>,
}

/// How far load control came on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Walked {
    /// To the load factor that was wanted
    There,
    /// Not there, in steps however small
    Short,
    /// To where the mesh does not tell the shape
    TooCoarse,
}

impl Search {
    /// The critical load, where the points around it lie together.
    fn found(&self) -> Option<f64> {
        let (from, beyond) = (self.here.load, self.beyond?);
        let between = (self.estimate - from) * self.way > 0.0 && (beyond - self.estimate) * self.way > 0.0;
        let closed = (beyond - from).abs() <= CLOSED * beyond.abs();
        closed.then_some(if between { self.estimate } else { 0.5 * (from + beyond) })
    }

    /// The part of the search that lies behind: digits that both points around the load share.
    fn come(&self) -> f64 {
        let beyond = self.beyond.filter(|&beyond| beyond != 0.0);
        let apart = beyond.map_or(1.0, |beyond| (beyond - self.here.load).abs() / beyond.abs());
        (apart.ln() / CLOSED.ln()).clamp(0.0, 1.0)
    }

    /// The path by load control ends before this load.
    fn end_at(&mut self, load: f64, walked: Walked) {
        self.beyond = Some(load);
        self.behind = None;
        self.ended = Some(walked);
        self.stretch = 1.0;
        self.estimate = 0.5 * (self.here.load + load);
    }

    /// Whether load control ends there for want of stiffness: a limit point looks twice as far away as it is.
    fn is_a_limit(&self, found: f64) -> bool {
        match self.ended {
            None => true,
            Some(Walked::TooCoarse) => false,
            Some(_) => (self.seen - found).abs() <= SEEN * found.abs(),
        }
    }

    /// Where to look next: a little beyond the estimate, so that it is closed in from there; in the middle where the
    /// estimate does not lie between.
    fn target(&self) -> f64 {
        let from = self.here.load;
        let ahead = self.estimate + self.way * 0.5 * CLOSED * self.estimate.abs();
        let target = from + self.stretch * (ahead - from);
        match self.beyond {
            Some(beyond) if (target - beyond) * self.way >= 0.0 => {
                let before = self.estimate - self.way * 0.4 * CLOSED * self.estimate.abs();
                let inside = (before - from) * self.way > 0.0 && (beyond - before) * self.way > 0.0;
                if inside { before } else { 0.5 * (from + beyond) }
            }
            _ => target,
        }
    }

    /// The path goes on past what was taken for its end, to this point, with what a critical load looks like from there.
    fn go_on_from(&mut self, state: &State, next: Option<f64>) {
        (self.beyond, self.behind, self.ended) = (None, None, None);
        self.stretch = 1.0;
        self.advance(state, next);
    }

    /// A point that lies before the critical load, with what that looks like from there.
    fn advance(&mut self, state: &State, next: Option<f64>) {
        let shorter =
            self.beyond.is_none_or(|beyond| (beyond - state.load).abs() < 0.5 * (beyond - self.here.load).abs());
        self.here = state.clone();
        self.seen = next.unwrap_or(self.seen);
        self.stretch *= 2.0;
        self.estimate = match (next, self.beyond) {
            (Some(next), None) => next,
            (Some(next), Some(beyond)) if shorter && (beyond - next) * self.way > 0.0 => next,
            (_, Some(beyond)) => 0.5 * (state.load + beyond),
            (None, None) => state.load + 2.0 * (self.estimate - state.load).abs().max(CLOSED) * self.way,
        };
    }
}

/// Loads above the present one come first, nearest first, then the others.
fn rank(critical: f64, load: f64) -> f64 {
    let distance = critical - load;
    if distance > 0.0 { -1.0 / distance } else { -distance }
}

/// K^-1 K': its eigenvalues are -1/m.
struct Softening<'a> {
    system: &'a System,
    varied: &'a [f64],
    solver: &'a mut LinearSolver,
    symmetric: bool,
}

impl Operator for Softening<'_> {
    fn size(&self) -> usize {
        self.system.pattern.dof_map.count()
    }

    fn apply(&mut self, x: &[f64]) -> Option<Vec<f64>> {
        let mut out = self.system.multiply(self.varied, x);
        out.iter_mut().for_each(|v| *v = -*v);
        self.solver.solve_once(self.system, &mut out).then_some(out)
    }

    fn weigh(&mut self, x: &[f64]) -> Vec<f64> {
        if self.symmetric { self.system.multiply(&self.system.values, x) } else { x.to_vec() }
    }

    fn is_symmetric(&self) -> bool {
        self.symmetric
    }
}
