//! Arc-length control: paths of equilibrium that turn back in load or in displacement.
//!
//! Along a path the state q and the load factor are both unknown; a step goes a given length ds along the tangent t of the
//! last point and then back to the path in the plane normal to it (Riks 1979, doi:10.1016/0020-7683(79)90081-7):
//!
//! ```text
//! <t_u, u - u_n>/U^2 + t_l (l - l_n) = ds,     K dq = -g - g_l dl
//! ```
//!
//! Lengths are measured in displacements, over what a unit of load moves at the start (U), and in the load factor; rotation
//! vectors follow through the equations, so that no chart enters.

use super::analysis_results::{Event, EventKind};
use super::direction::Direction;
use super::failure::Failure;
use super::plan::StageWork;
use super::stage_run::{Run, StageRun};
use crate::kernel::Weights;
use crate::model::{SlotKind, StageError, StageKind, charts};
use crate::solve::{self, NewtonFailure, Signature, Tangent, Verdict, mechanism, timed};
use crate::system::State;
use crate::tensor::Vec3;
use crate::warning::WarningKind;

/// Iterations after which the next step stays as long.
const EASY: f64 = 5.0;
/// Limit and branch points that are told one by one.
const MOST_TOLD: usize = 10;
/// Steps grow at most to this multiple of the first.
const LONGEST: f64 = 2.0;
/// Where the path is straight and brings little load, at most to so many times that.
const STRETCH: f64 = 8.0;
/// Straight is what has this cosine between tangents.
const STRAIGHT: f64 = 0.995;
/// And shrink to this part of it.
const SHORTEST: f64 = 1.0 / 16384.0;
/// Cosine between tangents, or between a tangent and its chord, below which a step was too long: it may have come down on another
/// branch.
const BENT: f64 = 0.8;
/// Part of the first step below which a change of pivots is believed that no limit point explains.
const BELIEVED: f64 = 1.0 / 1024.0;
/// Attempts to come nearer to a special point.
const MOST_LOOKS: usize = 40;
/// A correction of so many times the step is a flight.
const FLIGHT: f64 = 100.0;
/// Relative length to which it is located.
const LOCATED: f64 = 1e-9;
/// Increments that a detour of load control may take without coming to a higher load than before, at least.
const LONGEST_DETOUR: usize = 1000;
/// And for each level of the stage.
const DETOUR_OF_LEVEL: f64 = 10.0;
/// Increments of a path, times those that bring no higher load.
const LONGEST_PATH: usize = 100;

/// A point of the path and its unit tangent.
#[derive(Clone)]
struct Point {
    state: State,
    tangent: Vec<Vec3>,
    /// The tangent's part in the load factor
    load_rate: f64,
    /// The rate of the displacement that the loads do work on
    work_rate: f64,
    signature: Option<Signature>,
    /// Whether it is a limit point: one pivot is next to zero, with the sign of round-off
    on_limit: bool,
}

/// What is looked for between two points, as a function that changes its sign there.
#[derive(Clone, Copy, PartialEq)]
enum Target {
    Limit,
    Turning,
    Load(f64),
}

impl Target {
    fn value(self, point: &Point) -> f64 {
        match self {
            Self::Limit => point.load_rate,
            Self::Turning => point.work_rate,
            Self::Load(load) => point.state.load - load,
        }
    }
}

/// How long a path is followed.
#[derive(Clone, Copy)]
struct Bounds {
    /// Increments in all
    increments: usize,
    /// Increments one after the other that come to no higher load than those before
    patience: usize,
}

/// How following a path ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arrival {
    /// At the load factor that it was to go to
    Goal,
    /// By the stage's `until`
    Until,
    /// Neither came in sight
    OutOfSteps,
    /// There is no path: nothing grows with the load factor
    Nowhere,
}

impl Run<'_> {
    /// The path until the load factor first reaches 1, or `until`, or `max_steps`.
    pub(super) fn run_path(&mut self, workshop: &mut StageRun, steps: usize, max_steps: usize) -> Result<(), Failure> {
        self.start_static(workshop)?;
        let Some(mut path) = Path::new(self, workshop, steps)? else {
            return Err(self.describe(StageError::NothingGrows(StageKind::Static)));
        };
        let bounds = Bounds { increments: max_steps, patience: max_steps };
        if self.go_along(workshop, &mut path, 1.0, bounds)? == Arrival::OutOfSteps {
            let at = self.moment();
            let message = format!("the path ends after `max_steps` = {max_steps} increments at {at}");
            self.warn(WarningKind::PathEnds, message);
        }
        self.conclude_static(workshop, path.here.signature, path.here.on_limit)
    }

    /// From the present state along its path until that comes to the load factor `goal`: around limit points that load control
    /// cannot pass. `from` is a state further back on the path, `increment` a load increment that is easy there, `level` that between levels.
    pub(super) fn detour(
        &mut self,
        workshop: &mut StageRun,
        from: &State,
        goal: f64,
        increment: f64,
        level: f64,
    ) -> Result<Arrival, Failure> {
        let Some(mut path) = Path::onward(self, workshop, from, increment)? else { return Ok(Arrival::Nowhere) };
        let patience = LONGEST_DETOUR.max((DETOUR_OF_LEVEL / level).ceil() as usize);
        self.go_along(workshop, &mut path, goal, Bounds { increments: LONGEST_PATH * patience, patience })
    }

    /// Along a path until the load factor reaches `goal` from below, or `until`, or a bound.
    fn go_along(
        &mut self,
        workshop: &mut StageRun,
        path: &mut Path,
        goal: f64,
        bounds: Bounds,
    ) -> Result<Arrival, Failure> {
        let (mut highest, mut in_vain) = (self.state.load, 0);
        // The signs that were passed last: on a located point itself they are nobody's.
        let (mut rising, mut working) = (path.here.load_rate > 0.0, path.here.work_rate > 0.0);
        let goal = Target::Load(goal);
        for number in 0..bounds.increments {
            if in_vain >= bounds.patience {
                break;
            }
            let done = match self.plan.stages[self.stage].work {
                StageWork::Path { .. } => number as f64 / bounds.increments as f64,
                _ => path.begun,
            };
            self.observer.progress(self.moment(), self.static_progress(done))?;
            let (next, length) = path.step(self, workshop)?;
            let mut targets = Vec::new();
            if (next.load_rate > 0.0) != rising {
                targets.push(Target::Limit);
            }
            if (next.work_rate > 0.0) != working {
                targets.push(Target::Turning);
            }
            if goal.value(&path.here) < 0.0 && goal.value(&next) >= 0.0 {
                targets.push(goal);
            }
            let behind = next.signature;
            let beyond = (self.plane.is_some() && targets.contains(&Target::Limit)).then(|| next.state.clone());
            let (mut arrived, mut target) = path.nearest(self, workshop, next, length, &targets);
            if target == Some(Target::Limit) {
                // On a limit point itself one pivot is next to zero: what counts is what lies behind it.
                arrived.signature = behind;
                arrived.on_limit = true;
                if let Some(beyond) = &beyond {
                    self.state.copy_from(beyond);
                    self.look_out_of_plane(workshop, behind.and_then(Signature::negative))?;
                }
            }
            if targets.contains(&goal) && (target.is_none() || target == Some(goal)) {
                if !self.hit(workshop, goal, &mut arrived, path) && path.shorten() {
                    self.counters.cutbacks += 1;
                    continue;
                }
                target = Some(goal);
            }
            match target {
                Some(Target::Limit) => rising = !rising,
                Some(Target::Turning) => working = !working,
                _ => {}
            }
            self.arrive(workshop, path, arrived, target)?;
            in_vain = if self.state.load > highest { 0 } else { in_vain + 1 };
            highest = highest.max(self.state.load);
            if self.is_over(workshop) {
                return Ok(Arrival::Until);
            }
            if target == Some(goal) {
                return Ok(Arrival::Goal);
            }
        }
        Ok(Arrival::OutOfSteps)
    }

    /// From a point near it to a load factor itself, not further away than an increment.
    fn hit(&mut self, workshop: &mut StageRun, goal: Target, point: &mut Point, path: &Path) -> bool {
        let Target::Load(load) = goal else { return false };
        self.state.copy_from(&point.state);
        if self.attempt(workshop, load).is_err() {
            return false;
        }
        let moved: Vec<Vec3> = self.state.q.iter().zip(&point.state.q).map(|(q, near)| *q - *near).collect();
        let near = squared(self, &moved) * path.scale <= path.length * path.length;
        if near {
            point.state.copy_from(&self.state);
        }
        near
    }

    /// What follows a point of the path: account, row, and a word where something special happened.
    fn arrive(
        &mut self,
        workshop: &mut StageRun,
        path: &mut Path,
        point: Point,
        target: Option<Target>,
    ) -> Result<(), Failure> {
        self.good.copy_from(&path.here.state);
        self.state.copy_from(&point.state);
        workshop.assembly.evaluate(&self.state, Weights::NONE, None);
        self.accept(workshop)?;
        self.counters.steps += 1;
        let kind = match target {
            Some(Target::Limit) => Some(EventKind::Limit),
            Some(Target::Turning) => Some(EventKind::Turning),
            _ => None,
        };
        self.tell_stability(workshop, kind, path.here.signature, point.signature)?;
        path.here = Point { state: self.state.clone(), ..point };
        self.show(workshop)
    }

    /// Names limit and turning points, and branches that were passed: where the signs of pivots changed.
    pub(super) fn tell_stability(
        &mut self,
        workshop: &mut StageRun,
        kind: Option<EventKind>,
        before: Option<Signature>,
        after: Option<Signature>,
    ) -> Result<(), Failure> {
        let changed = before.zip(after).is_some_and(|(before, after)| before.changes_to(after) > 0);
        let after = after.and_then(Signature::negative);
        let kind = kind.or_else(|| changed.then_some(EventKind::Branch));
        let Some(kind) = kind else { return Ok(()) };
        let event = Event { at: self.moment(), kind, negative_pivots: after };
        match self.told.points {
            0..MOST_TOLD => self.warn(kind.warning(), event.to_string()),
            MOST_TOLD => {
                let message = "more limit and branch points follow: run.json lists all of them as `events`";
                self.warn(WarningKind::MorePoints, message);
            }
            _ => {}
        }
        self.told.points += 1;
        self.counters.findings.events.push(event);
        if kind == EventKind::Limit { Ok(()) } else { self.look_out_of_plane(workshop, after) }
    }
}

/// A path being followed.
struct Path {
    /// The load factor at which it was begun
    begun: f64,
    here: Point,
    length: f64,
    first: f64,
    /// The tangent's part in the load factor at the beginning
    first_rate: f64,
    /// 1/U^2
    scale: f64,
}

impl Path {
    /// `None` where nothing grows with the load factor.
    fn new(run: &mut Run, workshop: &mut StageRun, steps: usize) -> Result<Option<Self>, Failure> {
        let Some(Direction { rate: direction, .. }) = run.path_direction(workshop)? else { return Ok(None) };
        let mut path = Self::with_measure(run, direction);
        path.here = path.look(run, workshop, &path.here.clone())?;
        let first = 1.0 / (steps as f64 * path.here.load_rate.abs());
        path.begin_with(run, first).map(Some)
    }

    /// From the run's state on. Lengths are measured in what a unit of load has moved since `from`: near a limit point the
    /// tangent moves without bounds.
    fn onward(run: &mut Run, workshop: &mut StageRun, from: &State, increment: f64) -> Result<Option<Self>, Failure> {
        let risen = run.state.load - from.load;
        if risen <= 0.0 {
            return Self::new(run, workshop, (1.0 / increment).ceil() as usize);
        }
        let secant = run.state.q.iter().zip(&from.q).map(|(q, before)| (*q - *before) * (1.0 / risen)).collect();
        let mut path = Self::with_measure(run, secant);
        // Load control has come here from a lower load: onward is where the load grows.
        path.here.tangent.fill(Vec3::ZERO);
        path.here = path.look(run, workshop, &path.here.clone())?;
        path.begin_with(run, std::f64::consts::SQRT_2 * increment).map(Some)
    }

    /// With its first length. Forces near the limits of floating point have no measure of displacements: then lengths are no numbers,
    /// and no search for a shorter one would end.
    fn begin_with(mut self, run: &Run, first: f64) -> Result<Self, Failure> {
        (self.first, self.length, self.first_rate) = (first, first, self.here.load_rate);
        if first.is_finite() && self.here.load_rate.is_finite() {
            return Ok(self);
        }
        let sizes = self.here.tangent.iter().map(|t| t.norm());
        let largest = sizes.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(slot, _)| slot);
        let node = run.model.node_at(largest);
        Err(Failure::NonFinite { at: run.moment(), effect: Some("what a unit of load moves"), node })
    }

    /// With what a unit of load moves, by `rate`, as measure of displacements, and as direction to go on in.
    fn with_measure(run: &Run, rate: Vec<Vec3>) -> Self {
        let moved = squared(run, &rate);
        let rotated = run.model.kinds.iter().zip(&rate).filter(|(kind, _)| **kind == SlotKind::Rotation);
        let turned = rotated.map(|(_, d)| d.norm() * run.model.length).fold(0.0, f64::max);
        // Displacements that are only round-off beside the rotations measure nothing.
        let moved = if moved.sqrt() > 1e-9 * turned { moved } else { 0.0 };
        let here = Point {
            state: run.state.clone(),
            tangent: rate,
            load_rate: 1.0,
            work_rate: 1.0,
            signature: None,
            on_limit: false,
        };
        Self {
            begun: run.state.load,
            here,
            length: 0.0,
            first: 0.0,
            first_rate: 1.0,
            scale: if moved > 0.0 { 1.0 / moved } else { 0.0 },
        }
    }

    /// Takes the next increment half as long; `false` where it may not be.
    fn shorten(&mut self) -> bool {
        let may = 0.5 * self.length >= SHORTEST * self.first;
        self.length *= if may { 0.5 } else { 1.0 };
        may
    }

    /// The point at the run's state: its tangent goes on in the direction of `before`.
    fn look(&mut self, run: &mut Run, workshop: &mut StageRun, before: &Point) -> Result<Point, Failure> {
        let slots = run.state.q.len();
        let Direction { rate, pull } = run.path_direction(workshop)?.unwrap_or_else(|| Direction::none(slots));
        // The tangent of the last evaluation tells the pivots.
        let StageRun { assembly, newton, .. } = workshop;
        let mut tangent = Tangent::that_may_go(assembly, &run.state, Weights::STIFFNESS);
        let signature = newton.solver.signature(&mut tangent);
        let along = dot(run, &rate, &before.tangent) * self.scale + before.load_rate;
        let size = (squared(run, &rate) * self.scale + 1.0).sqrt();
        let load_rate = if along < 0.0 { -1.0 / size } else { 1.0 / size };
        // Of prescribed motions alone no displacement is known that loads would do work on.
        let work = work_of_loads(run, &pull, &rate).unwrap_or(load_rate.signum());
        let tangent = rate.into_iter().map(|d| d * load_rate).collect();
        Ok(Point {
            state: run.state.clone(),
            tangent,
            load_rate,
            work_rate: work * load_rate,
            signature,
            on_limit: false,
        })
    }

    /// One step that is neither too hard nor too bent; its length.
    fn step(&mut self, run: &mut Run, workshop: &mut StageRun) -> Result<(Point, f64), Failure> {
        loop {
            let length = self.length;
            let failure = match self.advance(run, workshop, length) {
                Ok(iterations) => {
                    let next = match self.look(run, workshop, &self.here.clone()) {
                        Ok(next) => next,
                        Err(failure) => {
                            run.state.copy_from(&self.here.state);
                            return Err(failure);
                        }
                    };
                    let cosine =
                        dot(run, &next.tangent, &self.here.tangent) * self.scale + next.load_rate * self.here.load_rate;
                    let straight = cosine.min(length / self.chord(run, &next)) >= BENT;
                    let fine = straight && !self.may_have_jumped(&next, length);
                    if fine || length <= SHORTEST * self.first {
                        let factor = (EASY / iterations.max(1) as f64).sqrt().clamp(0.5, 2.0);
                        let is_easy = iterations <= 2 && cosine >= STRAIGHT;
                        let longest = if is_easy { self.longest(next.load_rate) } else { LONGEST * self.first };
                        self.length = (length * factor).min(longest.max(length));
                        return Ok((next, length));
                    }
                    None
                }
                Err(failure) => Some(failure),
            };
            run.counters.cutbacks += 1;
            self.length = 0.5 * length;
            if let (Some(failure), true) = (failure, self.length < SHORTEST * self.first) {
                let named = run.name_failure(failure, &workshop.assembly.system);
                run.state.copy_from(&self.here.state);
                return Err(named);
            }
        }
    }

    /// The longest step where the path is straight: it brings as much load as the longest one at the beginning.
    fn longest(&self, load_rate: f64) -> f64 {
        LONGEST * self.first * (self.first_rate / load_rate).abs().clamp(1.0, STRETCH)
    }

    /// How far a point is from here; over its length along the tangent, the cosine between both.
    fn chord(&self, run: &Run, next: &Point) -> f64 {
        let moved: Vec<Vec3> = next.state.q.iter().zip(&self.here.state.q).map(|(q, here)| *q - *here).collect();
        let risen = next.state.load - self.here.state.load;
        (squared(run, &moved) * self.scale + risen * risen).sqrt()
    }

    /// Whether a step of this length may have gone to another branch: along a path one pivot changes its sign where the load turns,
    /// and else only where another branch begins, which a short step passes by.
    fn may_have_jumped(&self, next: &Point, length: f64) -> bool {
        let (Some(before), Some(after)) = (self.here.signature, next.signature) else { return false };
        // On a limit point the load has turned already.
        let turned = !self.here.on_limit && (next.load_rate > 0.0) != (self.here.load_rate > 0.0);
        before.changes_to(after) != usize::from(turned) && length > BELIEVED * self.first
    }

    /// Goes `length` along the tangent and back to the path; leaves the run's state there and returns the iterations.
    fn advance(&self, run: &mut Run, workshop: &mut StageRun, length: f64) -> Result<usize, NewtonFailure> {
        let mut load = self.predict(run, length);
        workshop.assembly.forget();
        let round_off = workshop.assembly.round_off(&run.state);
        let mut last = None;
        let (mut iterations, mut history) = (0, Vec::new());
        loop {
            // Held directions are put where they belong, free of the round-off of predictor and corrections.
            run.schedule.set_clock(&run.model, &mut run.state, self.here.state.time, load);
            let pull = run.load_derivative(workshop);
            let StageRun { assembly, newton, prescribed_increment, .. } = workshop;
            let seconds = &mut run.counters.work.evaluation_seconds;
            timed(seconds, || assembly.evaluate(&run.state, Weights::STIFFNESS, Some(prescribed_increment)));
            let (verdict, residual) = newton.convergence.judge(&run.model, &assembly.system, round_off, last);
            history.push(residual.ratio);
            match verdict {
                Verdict::Converged | Verdict::Noisy => return Ok(iterations),
                Verdict::NotFinite => return Err(NewtonFailure::not_finite(assembly, &run.state)),
                Verdict::Continue if iterations == newton.max_iterations => {
                    return Err(NewtonFailure::NotConverged { residual, history });
                }
                Verdict::Continue => {}
            }
            let (dq, dl) = self.correction(run, workshop, &pull)?;
            let wild = dq.iter().any(|d| !d.is_finite()) || !dl.is_finite();
            if wild || squared(run, &dq) * self.scale + dl * dl > (FLIGHT * length).powi(2) {
                return Err(NewtonFailure::NotConverged { residual, history });
            }
            load += dl;
            let switched = correct(run, workshop, &dq);
            // What was a correction before is none in a new chart.
            last = Some(if switched { f64::INFINITY } else { solve::size(&run.model, &dq) });
            iterations += 1;
        }
    }

    /// The state `length` along the tangent; its load factor.
    fn predict(&self, run: &mut Run, length: f64) -> f64 {
        let here = &self.here;
        run.state.copy_from(&here.state);
        let ahead: Vec<Vec3> = here.tangent.iter().map(|t| *t * length).collect();
        charts::carry(&mut run.state, &ahead, &run.schedule.charted(&run.model).rotations);
        run.state.q.iter_mut().zip(&ahead).for_each(|(q, d)| *q += *d);
        here.state.load + here.load_rate * length
    }

    /// The correction of Newton within the plane normal to the tangent: of the unknowns, and of the load factor. The
    /// assembly holds forces and tangent of the run's state.
    fn correction(
        &self,
        run: &mut Run,
        workshop: &mut StageRun,
        pull: &[Vec3],
    ) -> Result<(Vec<Vec3>, f64), NewtonFailure> {
        let StageRun { assembly, newton, prescribed_increment, .. } = workshop;
        let (system, solver, work) = (&assembly.system, &mut newton.solver, &mut run.counters.work);
        let slots = pull.len();
        let mut back = vec![0.0; system.pattern.dof_map.count()];
        let mut along = back.clone();
        system.right_hand_side_of(pull, &mut along);
        // The residual's own right-hand side takes no part of prescribed increments.
        let total: Vec<Vec3> = (0..slots).map(|slot| system.total(slot)).collect();
        system.right_hand_side_without_lift(&total, &mut back);
        work.factorisations += 1;
        work.iterations += 1;
        let solved = timed(&mut work.solve_seconds, || {
            solver.factorise(system) && solver.solve(system, &mut back) && solver.solve(system, &mut along)
        });
        if !solved {
            return Err(NewtonFailure::Singular(mechanism(
                solver,
                &mut Tangent::that_stays(assembly, &run.state),
                &run.model,
            )));
        }
        let (mut a, mut b) = (vec![Vec3::ZERO; slots], vec![Vec3::ZERO; slots]);
        system.pattern.dof_map.scatter(&back, None, &mut a);
        system.pattern.dof_map.scatter(&along, Some(prescribed_increment), &mut b);
        let part = |d: &[Vec3]| dot(run, &self.here.tangent, d) * self.scale;
        let dl = -part(&a) / (part(&b) + self.here.load_rate);
        Ok((a.iter().zip(&b).map(|(a, b)| *a + *b * dl).collect(), dl))
    }

    /// Of the special points between here and `next` the nearest, or `next` itself.
    fn nearest(
        &mut self,
        run: &mut Run,
        workshop: &mut StageRun,
        next: Point,
        length: f64,
        targets: &[Target],
    ) -> (Point, Option<Target>) {
        let mut best = (next, length, None);
        for &target in targets {
            if let Some((point, at)) = self.locate(run, workshop, &best.0, best.1, target) {
                best = (point, at, Some(target));
            }
        }
        (best.0, best.2)
    }

    /// Where a function of the path has its zero between here and a point `length` ahead (Illinois' regula falsi); `None`
    /// where it has none.
    fn locate(
        &mut self,
        run: &mut Run,
        workshop: &mut StageRun,
        end: &Point,
        length: f64,
        target: Target,
    ) -> Option<(Point, f64)> {
        let (mut low, mut high) = ((0.0, target.value(&self.here)), (length, target.value(end)));
        if low.1 * high.1 > 0.0 {
            return None;
        }
        let size = low.1.abs().max(high.1.abs());
        let mut found = (end.clone(), length);
        for _ in 0..MOST_LOOKS {
            let share = if high.1 == low.1 { 0.5 } else { -low.1 / (high.1 - low.1) };
            let at = low.0 + (high.0 - low.0) * share.clamp(0.02, 0.98);
            self.advance(run, workshop, at).ok()?;
            let point = self.look(run, workshop, &self.here.clone()).ok()?;
            let value = target.value(&point);
            found = (point, at);
            if value.abs() <= LOCATED * size || (high.0 - low.0).abs() <= LOCATED * length {
                break;
            }
            if value * high.1 <= 0.0 {
                low = high;
            } else {
                low.1 *= 0.5;
            }
            high = (at, value);
        }
        Some(found)
    }
}

/// Adds a correction; whether nodes changed their charts by it.
fn correct(run: &mut Run, workshop: &mut StageRun, dq: &[Vec3]) -> bool {
    workshop.assembly.extrapolate(&run.state, dq);
    charts::carry(&mut run.state, dq, &run.schedule.charted(&run.model).rotations);
    run.state.q.iter_mut().zip(dq).for_each(|(q, d)| *q += *d);
    let switched =
        charts::switch(&mut run.state, &run.schedule.charted(&run.model).rotations, charts::STATIC_BAND, None);
    if switched > 0 {
        run.counters.work.chart_switches += switched as u64;
        charts::freeze(&mut run.state, &run.schedule.charted(&run.model).elements);
    }
    switched > 0
}

/// The rate of the displacement that the loads do work on; `None` without loads. What stands at multipliers are gaps of motors,
/// not forces.
fn work_of_loads(run: &Run, pull: &[Vec3], rate: &[Vec3]) -> Option<f64> {
    let acting = || pull.iter().zip(rate).zip(run.model.kinds.iter()).filter(|(_, kind)| !kind.is_multiplier());
    let loaded = acting().any(|((force, _), _)| *force != Vec3::ZERO);
    loaded.then(|| acting().map(|((force, d), _)| -force.dot(*d)).sum())
}

/// The sum over displacements of squares; rotations follow.
fn squared(run: &Run, field: &[Vec3]) -> f64 {
    dot(run, field, field)
}

fn dot(run: &Run, a: &[Vec3], b: &[Vec3]) -> f64 {
    let slots = run.model.kinds.iter().zip(a.iter().zip(b));
    slots.filter(|(kind, _)| **kind == SlotKind::Displacement).map(|(_, (a, b))| a.dot(*b)).sum()
}
