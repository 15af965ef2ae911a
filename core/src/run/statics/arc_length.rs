//! Arc-length control: a path of equilibrium is followed to a load factor, around the points where
//! it turns back.

use super::begin;
use super::checkpoint::{ArcLengthCheckpoint, PathProgress, RateSigns};
use super::levels::Levels;
use super::path::PathTarget;
use super::path_point::{Path, PathPoint};
use super::stability::{conclude, tell_of_points};
use crate::kernel::Weights;
use crate::model::{StageError, StageKind};
use crate::run::checkpoint::AnalysisCheckpoint;
use crate::run::failure::Failure;
use crate::run::results::EventKind;
use crate::run::spatial::SpatialLook;
use crate::run::stage_run::{Analysis, StageRun};
use crate::solve::Signature;
use crate::tensor::Vec3;
use crate::warning::WarningKind;

/// Increments that a detour of load control may take without coming to a higher load than before,
/// at least.
const LONGEST_DETOUR: usize = 1000;
/// Increments that a detour may take without coming to a higher load, at least, times the levels of
/// the stage.
const DETOUR_OF_LEVEL: f64 = 10.0;
/// Increments of a path, times those that bring no higher load.
const LONGEST_PATH: usize = 100;
/// Load increments whose length a detour begins with, the least and the largest.
const DETOUR: (f64, f64) = (0.01, 0.05);

/// How long a path is followed.
#[derive(Clone, Copy)]
struct Bounds {
    /// Increments in all
    increments: usize,
    /// Increments one after the other that come to no higher load than those before
    patience: usize,
    /// The increments are all of the stage, and tell its progress.
    are_whole_stage: bool,
}

/// How following a path ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// At the load factor that it was to go to
    Goal,
    /// By the stage's `until`
    Until,
    /// Neither came in sight
    OutOfSteps,
    /// There is no path: nothing grows with the load factor
    Nowhere,
}

/// A static stage by arc length.
pub(in crate::run) struct ArcLength<'s, 'r> {
    pub(crate) stage: &'s mut StageRun<'r>,
    /// The first increment is that of one of so many load levels.
    pub(crate) steps: usize,
    /// Most increments
    pub(crate) max_steps: usize,
}

impl<'r> Analysis<'r> for ArcLength<'_, 'r> {
    fn stage(&mut self) -> &mut StageRun<'r> {
        self.stage
    }

    /// Follows the path until the load factor first reaches 1, or `until`, or `max_steps`.
    fn run(&mut self) -> Result<(), Failure> {
        let mut space = SpatialLook::default();
        let (mut path, progress) = match self.stage.resumed.take() {
            Some(AnalysisCheckpoint::ArcLength(ArcLengthCheckpoint { path, progress })) => (path, progress),
            None | Some(AnalysisCheckpoint::Levels(_) | AnalysisCheckpoint::Dynamics(_)) => self.begin(&mut space)?,
        };
        let Self { stage, max_steps, .. } = self;
        let bounds = Bounds { increments: *max_steps, patience: *max_steps, are_whole_stage: true };
        let arrival = Follower { stage, space: &mut space, path: &mut path, progress }.go_to(1.0, bounds)?;
        if arrival == Arrival::OutOfSteps {
            let at = stage.moment();
            let message = format!("the path was stopped after `max_steps` = {max_steps} increments at {at}");
            stage.warn(WarningKind::PathEnds, message);
        }
        conclude(stage, &mut space, path.here.signature, path.here.on_limit)
    }

    fn judge(&mut self) {
        self.stage.warn_of_standstill();
        self.stage.warn_of_layers();
    }
}

impl ArcLength<'_, '_> {
    /// Begins the path.
    fn begin(&mut self, space: &mut SpatialLook) -> Result<(Path, PathProgress), Failure> {
        if let Some(loose) = begin(self.stage, space)? {
            return Err(loose);
        }
        let Some(path) = Path::new(self.stage, self.steps)? else {
            return Err(self.stage.describe(StageError::NothingGrows(StageKind::Static)));
        };
        let progress = PathProgress::new(&path);
        Ok((path, progress))
    }
}

/// From the present state along its path until that comes to the load factor `goal`: around limit
/// points that load control cannot pass.
pub fn detour(stage: &mut StageRun, space: &mut SpatialLook, levels: &Levels, goal: f64) -> Result<Arrival, Failure> {
    let increment = levels.level.clamp(DETOUR.0, DETOUR.1);
    let Some(mut path) = Path::onward(stage, &levels.start, increment)? else { return Ok(Arrival::Nowhere) };
    let patience = LONGEST_DETOUR.max((DETOUR_OF_LEVEL / levels.level).ceil() as usize);
    let bounds = Bounds { increments: LONGEST_PATH * patience, patience, are_whole_stage: false };
    let progress = PathProgress::new(&path);
    Follower { stage, space, path: &mut path, progress }.go_to(goal, bounds)
}

impl RateSigns {
    fn pass(&mut self, target: Option<PathTarget>) {
        match target {
            Some(PathTarget::Limit) => self.rising = !self.rising,
            Some(PathTarget::Turning) => self.working = !self.working,
            Some(PathTarget::Load(_)) | None => {}
        }
    }
}

/// Follows a path.
struct Follower<'f, 'r> {
    stage: &'f mut StageRun<'r>,
    space: &'f mut SpatialLook,
    path: &'f mut Path,
    progress: PathProgress,
}

impl Follower<'_, '_> {
    /// Goes on until the load factor reaches `goal` from below, or `until`, or a bound.
    fn go_to(&mut self, goal: f64, bounds: Bounds) -> Result<Arrival, Failure> {
        let goal = PathTarget::Load(goal);
        while self.progress.increments < bounds.increments && self.progress.in_vain < bounds.patience {
            if bounds.are_whole_stage {
                self.offer_checkpoint()?;
            }
            let behind = self.progress.increments as f64 / bounds.increments as f64;
            self.stage.tell_progress(if bounds.are_whole_stage { behind } else { self.path.begun })?;
            self.progress.increments += 1;
            let (next, length) = self.path.step(self.stage)?;
            let targets = self.targets(&next, self.progress.signs, goal);
            let (mut arrived, mut target) = self.nearest(next, length, &targets)?;
            if targets.contains(&goal) && target.is_none_or(|target| target == goal) {
                let is_hit = self.hit(goal, &mut arrived);
                self.stage.unless_interrupted()?;
                if !is_hit && self.path.shorten() {
                    self.stage.counters.cutbacks += 1;
                    continue;
                }
                target = Some(goal);
            }
            self.progress.signs.pass(target);
            self.arrive(arrived, target)?;
            let PathProgress { in_vain, highest, .. } = &mut self.progress;
            *in_vain = if self.stage.state.load > *highest { 0 } else { *in_vain + 1 };
            *highest = highest.max(self.stage.state.load);
            if self.stage.is_over() {
                return Ok(Arrival::Until);
            }
            if target == Some(goal) {
                return Ok(Arrival::Goal);
            }
        }
        Ok(Arrival::OutOfSteps)
    }

    /// Shows the observer where the path is, if it wants that.
    fn offer_checkpoint(&mut self) -> Result<(), Failure> {
        let Self { stage, path, progress, .. } = self;
        stage.offer_checkpoint(|| {
            let path: &Path = path;
            AnalysisCheckpoint::ArcLength(ArcLengthCheckpoint { path: path.clone(), progress: *progress })
        })
    }

    /// The special points between here and the next point.
    fn targets(&self, next: &PathPoint, signs: RateSigns, goal: PathTarget) -> Vec<PathTarget> {
        let mut targets = Vec::new();
        if (next.load_rate > 0.0) != signs.rising {
            targets.push(PathTarget::Limit);
        }
        if (next.work_rate > 0.0) != signs.working {
            targets.push(PathTarget::Turning);
        }
        if goal.value(&self.path.here) < 0.0 && goal.value(next) >= 0.0 {
            targets.push(goal);
        }
        targets
    }

    /// The nearest of these points, or else the next one, `length` ahead.
    fn nearest(
        &mut self,
        next: PathPoint,
        length: f64,
        targets: &[PathTarget],
    ) -> Result<(PathPoint, Option<PathTarget>), Failure> {
        let behind = next.signature;
        let beyond = (self.stage.plane.is_some() && targets.contains(&PathTarget::Limit)).then(|| next.state.clone());
        let (mut arrived, target) = self.path.nearest(self.stage, next, length, targets);
        if target == Some(PathTarget::Limit) {
            // On a limit point itself one pivot is next to zero: what counts is what lies behind
            // it.
            arrived.signature = behind;
            arrived.on_limit = true;
            if let Some(beyond) = &beyond {
                self.stage.state.copy_from(beyond);
                self.space.warn_of_instability(self.stage, behind.and_then(Signature::negative))?;
            }
        }
        Ok((arrived, target))
    }

    /// From a point near it to a load factor itself, not further away than an increment.
    fn hit(&mut self, goal: PathTarget, point: &mut PathPoint) -> bool {
        let PathTarget::Load(load) = goal else { return false };
        self.stage.state.copy_from(&point.state);
        if self.stage.attempt(load).is_err() {
            return false;
        }
        let moved: Vec<Vec3> = self.stage.state.q.iter().zip(&point.state.q).map(|(q, near)| *q - *near).collect();
        let near = self.path.is_within_a_step(self.stage, &moved);
        if near {
            point.state.copy_from(self.stage.state);
        }
        near
    }

    /// Takes a point of the path: account, row, and a word where something special happened.
    fn arrive(&mut self, point: PathPoint, target: Option<PathTarget>) -> Result<(), Failure> {
        self.stage.good.copy_from(&self.path.here.state);
        self.stage.state.copy_from(&point.state);
        self.stage.assembly.evaluate(self.stage.state, Weights::NONE, None);
        self.stage.accept()?;
        self.stage.counters.steps += 1;
        let kind = match target {
            Some(PathTarget::Limit) => Some(EventKind::Limit),
            Some(PathTarget::Turning) => Some(EventKind::Turning),
            Some(PathTarget::Load(_)) | None => None,
        };
        tell_of_points(self.stage, self.space, kind, self.path.here.signature, point.signature)?;
        self.path.here = point;
        self.path.here.state = self.stage.state.clone();
        self.stage.show()
    }
}
