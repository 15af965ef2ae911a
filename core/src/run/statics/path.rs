//! Arc-length control: paths of equilibrium that turn back in load or in displacement.
//!
//! Along a path the state q and the load factor are both unknown; a step goes a given length ds
//! along the tangent t of the last point, and aside as the path has bent up to there, and then back
//! to the path in the plane normal to t (Riks 1979, doi:10.1016/0020-7683(79)90081-7):
//!
//! ```text
//! <t_u, u - u_n>/U^2 + t_l (l - l_n) = ds,     K dq = -g - g_l dl
//! ```
//!
//! Lengths are measured in displacements, over what a unit of load moves at the start (U), and in
//! the load factor; rotation vectors follow through the equations, so that no chart enters.

use super::load_control::PathDirection;
use super::path_point::{Bend, Path, PathPoint};
use super::stability::LARGEST_CONTRACTION;
use crate::kernel::Weights;
use crate::model::{SlotKind, charts};
use crate::run::failure::Failure;
use crate::run::stage_run::StageRun;
use crate::solve::{self, Judgement, NewtonFailure, Tangent, Verdict, mechanism, timed};
use crate::system::State;
use crate::tensor::Vec3;

/// Iterations of a step after which the next one stays as long
const EASY: f64 = 5.0;
/// The contraction of corrections after which the next step stays as long. It grows with the size of
/// the first correction, which goes with the third power of the length where the bend is followed.
const STEADY_CONTRACTION: f64 = 0.5 * LARGEST_CONTRACTION;
/// The longest step, over the one that was wanted first.
const LONGEST: f64 = 2.0;
/// The longest step where the path is straight and brings little load, over [`LONGEST`].
const STRETCH: f64 = 8.0;
/// The cosine between tangents above which the path is straight.
const STRAIGHT: f64 = 0.995;
/// The shortest step, over the first one.
const SHORTEST: f64 = 1.0 / 16384.0;
/// The cosine between tangents, or between a tangent and its chord, below which a step was too
/// long: it may have come down on another branch.
const MIN_COSINE: f64 = 0.8;
/// The cosine between tangents, or between a tangent and its chord, below which the first step of a path was
/// too long: it may have passed over the whole way on which a structure snaps through.
const MIN_COSINE_OF_FIRST: f64 = 0.95;
/// The longest step that follows the bend of the path, over the one that the bend was taken from.
const LONGEST_OF_BEND: f64 = 4.0;
/// The shortest step that a bend is taken from, over the one of the bend before it: tangents that lie
/// nearer, at a located point, have no digits of it.
const SHORTEST_OF_BEND: f64 = 1e-3;
/// The largest angle, in radians, by which a step follows the bend of the path.
const LARGEST_BEND: f64 = 0.6;
/// Part of the first step below which a change of pivots that no limit point explains is believed, and
/// corrections may grow.
const BELIEVED: f64 = 1.0 / 1024.0;
/// Attempts to come nearer to a special point
const MOST_LOOKS: usize = 40;
/// The size of a correction, over the step, beyond which it is a flight.
const FLIGHT: f64 = 100.0;
/// The largest residual that may be round-off, over the allowed one.
const NEARLY_ALLOWED: f64 = 10.0;
/// The part of a residual that corrections leave where it no longer falls.
const STALLED: f64 = 0.3;
/// The largest correction by round-off, in lengths of the scene and radians.
const TINY_CORRECTION: f64 = 1e-9;
/// The length, over the step, to which a special point is located.
const LOCATED: f64 = 1e-9;
/// How far aside, over the step, a point is looked at where the tangent is singular to the last digit, as at a limit
/// point, whose load differs by the square of it.
const ASIDE: f64 = 1e-6;

/// A special point between two points of a path, as a function that changes its sign there.
#[derive(Clone, Copy, PartialEq)]
pub enum PathTarget {
    Limit,
    Turning,
    Load(f64),
}

impl PathTarget {
    pub fn value(self, point: &PathPoint) -> f64 {
        match self {
            Self::Limit => point.load_rate,
            Self::Turning => point.work_rate,
            Self::Load(load) => point.state.load - load,
        }
    }
}

impl Path {
    /// `None` where nothing grows with the load factor.
    pub fn new(stage: &mut StageRun, steps: usize) -> Result<Option<Self>, Failure> {
        let Some(PathDirection { rate: direction, .. }) = stage.path_direction()? else { return Ok(None) };
        let mut path = Self::with_measure(stage, direction);
        path.here = path.look(stage, &path.here)?;
        let first = 1.0 / (steps as f64 * path.here.load_rate.abs());
        path.begin_with(stage, first).map(Some)
    }

    /// From the run's state on. Lengths are measured in what a unit of load has moved since `from`:
    /// near a limit point the tangent moves without bounds.
    pub fn onward(stage: &mut StageRun, from: &State, increment: f64) -> Result<Option<Self>, Failure> {
        let risen = stage.state.load - from.load;
        if risen <= 0.0 {
            return Self::new(stage, (1.0 / increment).ceil() as usize);
        }
        let secant = stage.state.q.iter().zip(&from.q).map(|(q, before)| (*q - *before) * (1.0 / risen)).collect();
        let mut path = Self::with_measure(stage, secant);
        // Load control has come here from a lower load: onward is where the load grows.
        path.here.tangent.fill(Vec3::ZERO);
        path.here = path.look(stage, &path.here)?;
        path.begin_with(stage, std::f64::consts::SQRT_2 * increment).map(Some)
    }

    /// With its first length. Forces near the limits of floating point have no measure of
    /// displacements: then lengths are no numbers, and no search for a shorter one would end.
    fn begin_with(mut self, stage: &StageRun, first: f64) -> Result<Self, Failure> {
        (self.first, self.wanted, self.length, self.first_rate) = (first, first, first, self.here.load_rate);
        if first.is_finite() && self.here.load_rate.is_finite() {
            return Ok(self);
        }
        let sizes = self.here.tangent.iter().map(|t| t.norm());
        let largest = sizes.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(slot, _)| slot);
        let node = stage.model.node_at(largest);
        Err(Failure::NonFinite { at: stage.moment(), effect: Some("the displacement per unit load"), node })
    }

    /// With what a unit of load moves, by `rate`, as measure of displacements, and as direction to
    /// go on in.
    fn with_measure(stage: &mut StageRun, rate: Vec<Vec3>) -> Self {
        if let Some(contacts) = stage.model.contacts() {
            contacts.look_everywhere(stage.state);
            contacts.look_everywhere(stage.good);
        }
        let moved = squared(stage, &rate);
        let rotated = stage.model.kinds.iter().zip(&rate).filter(|(kind, _)| **kind == SlotKind::Rotation);
        let turned = rotated.map(|(_, d)| d.norm() * stage.model.length).fold(0.0, f64::max);
        // Displacements that are only round-off beside the rotations measure nothing.
        let moved = if moved.sqrt() > 1e-9 * turned { moved } else { 0.0 };
        let here = PathPoint {
            state: stage.state.clone(),
            tangent: rate,
            load_rate: 1.0,
            work_rate: 1.0,
            signature: None,
            on_limit: false,
            bend: None,
        };
        Self {
            begun: stage.state.load,
            here,
            length: 0.0,
            first: 0.0,
            wanted: 0.0,
            has_begun: false,
            first_rate: 1.0,
            scale: if moved > 0.0 { 1.0 / moved } else { 0.0 },
        }
    }

    /// Takes the next increment half as long; `false` where it may not be.
    pub fn shorten(&mut self) -> bool {
        let may = 0.5 * self.length >= SHORTEST * self.first;
        self.length *= if may { 0.5 } else { 1.0 };
        may
    }

    /// The point at the run's state: its tangent goes on in the direction of `before`.
    fn look(&self, stage: &mut StageRun, before: &PathPoint) -> Result<PathPoint, Failure> {
        let slots = stage.state.q.len();
        let direction = stage.path_direction()?.unwrap_or_else(|| PathDirection::none(slots));
        // The tangent of the last evaluation tells the pivots.
        let StageRun { assembly, newton, .. } = stage;
        let mut tangent = Tangent::that_may_go(assembly, stage.state, Weights::STIFFNESS);
        let signature = newton.solver.signature(&mut tangent);
        stage.unless_interrupted()?;
        let rate = &direction.rate;
        let along = dot(stage, rate, &before.tangent) * self.scale + before.load_rate;
        let size = (squared(stage, rate) * self.scale + 1.0).sqrt();
        let load_rate = if along < 0.0 { -1.0 / size } else { 1.0 / size };
        // Of prescribed motions alone no displacement is known that loads would do work on.
        let work = direction.work_rate(stage.model).unwrap_or(load_rate.signum());
        let tangent = direction.rate.into_iter().map(|d| d * load_rate).collect();
        Ok(PathPoint {
            state: stage.state.clone(),
            tangent,
            load_rate,
            work_rate: work * load_rate,
            signature,
            on_limit: false,
            bend: None,
        })
    }

    /// The point at the run's state, `length` ahead of here, with the bend of the path. Rates of rotation vectors in different
    /// charts have no difference that tells one.
    fn arrive(&self, stage: &mut StageRun, length: f64, charts_changed: bool) -> Result<PathPoint, Failure> {
        let mut next = self.look(stage, &self.here)?;
        next.bend = match &self.here.bend {
            _ if charts_changed => None,
            Some(bend) if length < SHORTEST_OF_BEND * bend.over => Some(bend.clone()),
            Some(_) | None => Some(self.bend_to(stage, &next, length)),
        };
        Ok(next)
    }

    /// How the path bends between here and a point `length` ahead, across the tangent there.
    fn bend_to(&self, stage: &StageRun, next: &PathPoint, length: f64) -> Bend {
        let mut rate: Vec<Vec3> = next.tangent.iter().zip(&self.here.tangent).map(|(t, here)| *t - *here).collect();
        let load_rate = next.load_rate - self.here.load_rate;
        let along = dot(stage, &next.tangent, &rate) * self.scale + next.load_rate * load_rate;
        rate.iter_mut().zip(&next.tangent).for_each(|(r, t)| *r = (*r - *t * along) * (1.0 / length));
        Bend { rate, load_rate: (load_rate - next.load_rate * along) / length, over: length }
    }

    /// One step that is neither too hard nor too bent; its length.
    pub fn step(&mut self, stage: &mut StageRun) -> Result<(PathPoint, f64), Failure> {
        loop {
            let length = self.length;
            let is_believed = length <= BELIEVED * self.first;
            let largest_contraction = if is_believed { f64::INFINITY } else { LARGEST_CONTRACTION };
            let failure = match self.advance(stage, length, largest_contraction) {
                Ok(Corrected { iterations, contraction, charts_changed }) => {
                    let next = match self.arrive(stage, length, charts_changed) {
                        Ok(next) => next,
                        Err(failure) => {
                            stage.state.copy_from(&self.here.state);
                            return Err(failure);
                        }
                    };
                    let cosine = dot(stage, &next.tangent, &self.here.tangent) * self.scale
                        + next.load_rate * self.here.load_rate;
                    let straight = cosine.min(length / self.chord(stage, &next)) >= self.least_cosine();
                    let fine = straight && (is_believed || !self.may_have_jumped(&next));
                    if fine || length <= SHORTEST * self.first {
                        if !std::mem::replace(&mut self.has_begun, true) {
                            self.first = length;
                        }
                        let by_iterations = (EASY / iterations.max(1) as f64).sqrt();
                        let by_contraction = (STEADY_CONTRACTION / contraction).cbrt();
                        let factor = by_iterations.min(by_contraction).clamp(0.5, 2.0);
                        let is_easy = iterations <= 2 && cosine >= STRAIGHT;
                        let longest = if is_easy { self.longest(next.load_rate) } else { LONGEST * self.wanted };
                        self.length = (length * factor).min(longest.max(length));
                        return Ok((next, length));
                    }
                    None
                }
                Err(failure) => Some(failure),
            };
            if let Some(NewtonFailure::Interrupted(signal)) = failure {
                stage.state.copy_from(&self.here.state);
                return Err(Failure::Interrupted { at: stage.moment(), signal });
            }
            stage.counters.cutbacks += 1;
            self.length = 0.5 * length;
            if let (Some(failure), true) = (failure, self.length < SHORTEST * self.first) {
                let named = stage.name_failure(failure, &stage.assembly.system);
                stage.state.copy_from(&self.here.state);
                return Err(named);
            }
        }
    }

    /// True if a motion is not longer than the next step.
    pub fn is_within_a_step(&self, stage: &StageRun, moved: &[Vec3]) -> bool {
        squared(stage, moved) * self.scale <= self.length * self.length
    }

    /// The least cosine between the tangents at the ends of a step, and between a tangent and its chord.
    fn least_cosine(&self) -> f64 {
        if self.has_begun { MIN_COSINE } else { MIN_COSINE_OF_FIRST }
    }

    /// The longest step where the path is straight: it brings as much load as the longest one at
    /// the beginning.
    fn longest(&self, load_rate: f64) -> f64 {
        LONGEST * self.wanted * (self.first_rate / load_rate).abs().clamp(1.0, STRETCH)
    }

    /// How far a point is from here; over its length along the tangent, the cosine between both.
    fn chord(&self, stage: &StageRun, next: &PathPoint) -> f64 {
        let moved: Vec<Vec3> = next.state.q.iter().zip(&self.here.state.q).map(|(q, here)| *q - *here).collect();
        let risen = next.state.load - self.here.state.load;
        (squared(stage, &moved) * self.scale + risen * risen).sqrt()
    }

    /// True if a step may have gone to another branch: along a path one pivot
    /// changes its sign where the load turns, and else only where another branch begins, which a
    /// short step passes by.
    fn may_have_jumped(&self, next: &PathPoint) -> bool {
        let (Some(before), Some(after)) = (self.here.signature, next.signature) else { return false };
        // On a limit point the load has turned already.
        let turned = !self.here.on_limit && (next.load_rate > 0.0) != (self.here.load_rate > 0.0);
        before.changes_to(after) != usize::from(turned)
    }

    /// Goes `length` along the tangent and back to the path; leaves the run's state there and
    /// returns how the corrections went.
    fn advance(&self, stage: &mut StageRun, length: f64, largest_contraction: f64) -> Result<Corrected, NewtonFailure> {
        let mut load = self.predict(stage, length);
        stage.assembly.forget();
        let round_off = stage.assembly.round_off(stage.state);
        let mut last: Option<f64> = None;
        let mut done = Corrected { iterations: 0, contraction: 0.0, charts_changed: false };
        let mut history = Vec::new();
        loop {
            NewtonFailure::unless_interrupted()?;
            // Held directions are put where they belong, free of the round-off of predictor and
            // corrections.
            stage.schedule.set_clock(stage.model, stage.state, self.here.state.time, load);
            let pull = stage.load_derivative();
            let StageRun { assembly, newton, prescribed_increment, .. } = stage;
            let seconds = &mut stage.counters.work.evaluation_seconds;
            timed(seconds, || assembly.evaluate(stage.state, Weights::STIFFNESS, Some(prescribed_increment)));
            let Judgement { verdict, residual } =
                newton.convergence.judge(stage.model, &assembly.system, round_off, last);
            history.push(residual.ratio);
            NewtonFailure::unless_interrupted()?;
            match verdict {
                Verdict::Converged | Verdict::Noisy => {
                    stage.refuse_departures()?;
                    return Ok(done);
                }
                Verdict::Continue if is_round_off(&history, last) => {
                    stage.refuse_departures()?;
                    return Ok(done);
                }
                Verdict::NotFinite => return Err(NewtonFailure::not_finite(assembly, stage.state)),
                Verdict::Continue if done.iterations == newton.max_iterations => {
                    return Err(NewtonFailure::NotConverged { residual, history });
                }
                Verdict::Continue => {}
            }
            let (dq, dl) = self.correction(stage, &pull)?;
            let wild = dq.iter().any(|d| !d.is_finite()) || !dl.is_finite();
            let size = solve::size(stage.model, &dq);
            done.contraction = done.contraction.max(solve::contraction(last, size));
            let flies = squared(stage, &dq) * self.scale + dl * dl > (FLIGHT * length).powi(2);
            if wild || flies || done.contraction > largest_contraction {
                return Err(NewtonFailure::NotConverged { residual, history });
            }
            load += dl;
            let switched = correct(stage, &dq);
            done.charts_changed |= switched;
            // What was a correction before is none in a new chart.
            last = Some(if switched { f64::INFINITY } else { size });
            done.iterations += 1;
        }
    }

    /// The state `length` along the tangent, aside by the bend of the path; its load factor.
    fn predict(&self, stage: &mut StageRun, length: f64) -> f64 {
        let here = &self.here;
        stage.state.copy_from(&here.state);
        let mut ahead: Vec<Vec3> = here.tangent.iter().map(|t| *t * length).collect();
        let mut load = here.state.load + here.load_rate * length;
        if let Some(bend) = here.bend.as_ref().filter(|bend| self.may_follow(stage, bend, length)) {
            let aside = 0.5 * length * length;
            ahead.iter_mut().zip(&bend.rate).for_each(|(d, b)| *d += *b * aside);
            load += bend.load_rate * aside;
        }
        charts::carry(stage.state, &ahead, &stage.charted.rotations);
        stage.state.q.iter_mut().zip(&ahead).for_each(|(q, d)| *q += *d);
        load
    }

    /// True if a step may follow this bend over a length.
    fn may_follow(&self, stage: &StageRun, bend: &Bend, length: f64) -> bool {
        let size = (squared(stage, &bend.rate) * self.scale + bend.load_rate.powi(2)).sqrt();
        length <= LONGEST_OF_BEND * bend.over && length * size <= LARGEST_BEND
    }

    /// The correction of Newton within the plane normal to the tangent: of the unknowns, and of the
    /// load factor. The assembly holds forces and tangent of the run's state.
    fn correction(&self, stage: &mut StageRun, pull: &[Vec3]) -> Result<(Vec<Vec3>, f64), NewtonFailure> {
        let StageRun { assembly, newton, prescribed_increment, .. } = stage;
        let (system, solver, work) = (&assembly.system, &mut newton.solver, &mut stage.counters.work);
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
        NewtonFailure::unless_interrupted()?;
        if !solved {
            return Err(NewtonFailure::Singular(mechanism(
                solver,
                &mut Tangent::that_stays(assembly, stage.state),
                stage.model,
            )));
        }
        let (mut a, mut b) = (vec![Vec3::ZERO; slots], vec![Vec3::ZERO; slots]);
        system.pattern.dof_map.scatter(&back, None, &mut a);
        system.pattern.dof_map.scatter(&along, Some(prescribed_increment), &mut b);
        let part = |d: &[Vec3]| dot(stage, &self.here.tangent, d) * self.scale;
        let dl = -part(&a) / (part(&b) + self.here.load_rate);
        Ok((a.iter().zip(&b).map(|(a, b)| *a + *b * dl).collect(), dl))
    }

    /// The nearest of the special points between here and `next`, or `next` itself.
    pub fn nearest(
        &mut self,
        stage: &mut StageRun,
        next: PathPoint,
        length: f64,
        targets: &[PathTarget],
    ) -> (PathPoint, Option<PathTarget>) {
        let mut best = (next, length, None);
        for &target in targets {
            if let Some((point, at)) = self.locate(stage, &best.0, best.1, target) {
                best = (point, at, Some(target));
            }
        }
        (best.0, best.2)
    }

    /// The point `at` ahead along the tangent, where the tangent there is regular.
    fn point(&self, stage: &mut StageRun, at: f64) -> Option<PathPoint> {
        let Corrected { charts_changed, .. } = self.advance(stage, at, f64::INFINITY).ok()?;
        self.arrive(stage, at, charts_changed).ok()
    }

    /// Where a function of the path has its zero between here and a point `length` ahead (Illinois'
    /// regula falsi); `None` where it has none.
    fn locate(
        &mut self,
        stage: &mut StageRun,
        end: &PathPoint,
        length: f64,
        target: PathTarget,
    ) -> Option<(PathPoint, f64)> {
        let mut low = Bracket { at: 0.0, value: target.value(&self.here) };
        let mut high = Bracket { at: length, value: target.value(end) };
        if low.value * high.value > 0.0 {
            return None;
        }
        let size = low.value.abs().max(high.value.abs());
        let mut found = (end.clone(), length);
        for _ in 0..MOST_LOOKS {
            let share = if high.value == low.value { 0.5 } else { -low.value / (high.value - low.value) };
            let at = low.at + (high.at - low.at) * share.clamp(0.02, 0.98);
            let (at, point) =
                [at, at + ASIDE * length].into_iter().find_map(|at| Some((at, self.point(stage, at)?)))?;
            let value = target.value(&point);
            found = (point, at);
            if value.abs() <= LOCATED * size || (high.at - low.at).abs() <= LOCATED * length {
                break;
            }
            if value * high.value <= 0.0 {
                low = high;
            } else {
                low.value *= 0.5;
            }
            high = Bracket { at, value };
        }
        Some(found)
    }
}

/// How the corrections of a step went.
struct Corrected {
    iterations: usize,
    /// The largest correction over the one before it: on the way back to the path corrections shrink
    contraction: f64,
    /// Nodes have changed their charts.
    charts_changed: bool,
}

/// A length along the tangent, and the value that is looked for there.
#[derive(Clone, Copy)]
struct Bracket {
    at: f64,
    value: f64,
}

/// True where corrections go on without making a small residual smaller: what is left is its round-off, more of it than
/// was estimated. `history`: the residuals, relative to what is allowed; `last`: the size of the last correction.
fn is_round_off(history: &[f64], last: Option<f64>) -> bool {
    let [.., before, now] = history[..] else { return false };
    now <= NEARLY_ALLOWED && now > STALLED * before && last.is_some_and(|size| size <= TINY_CORRECTION)
}

/// Adds a correction; whether nodes changed their charts by it.
fn correct(stage: &mut StageRun, dq: &[Vec3]) -> bool {
    stage.assembly.extrapolate(stage.state, dq);
    charts::carry(stage.state, dq, &stage.charted.rotations);
    stage.state.q.iter_mut().zip(dq).for_each(|(q, d)| *q += *d);
    let switched = charts::switch(stage.state, &stage.charted.rotations, charts::STATIC_BAND, None);
    if switched > 0 {
        stage.counters.work.chart_switches += switched as u64;
        charts::freeze(stage.state, &stage.charted.elements);
    }
    switched > 0
}

/// The sum over displacements of squares; rotations follow.
fn squared(stage: &StageRun, field: &[Vec3]) -> f64 {
    dot(stage, field, field)
}

fn dot(stage: &StageRun, a: &[Vec3], b: &[Vec3]) -> f64 {
    let slots = stage.model.kinds.iter().zip(a.iter().zip(b));
    slots.filter(|(kind, _)| **kind == SlotKind::Displacement).map(|(_, (a, b))| a.dot(*b)).sum()
}
