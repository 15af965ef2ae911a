//! How the levels of a static stage are approached, and how a step to another branch is noticed.

use super::failure::Failure;
use super::plan::Approach;
use super::stage_run::{Run, StageRun};
use crate::kernel::Weights;
use crate::model::{Model, SlotKind};
use crate::rotation::{Rotation, relative_angle};
use crate::scalar::CompressedField;
use crate::solve::{Signature, Tangent};
use crate::system::State;
use crate::tensor::Vec3;
use crate::threads;

/// A level is not approached in smaller parts than this.
const SMALLEST_PART: f64 = 1.0 / 4096.0;

/// Nor, in parts of the stage, where it has few levels.
const SMALLEST_OF_STAGE: f64 = 1.0 / 65536.0;

/// Where round-off takes the stiffness smaller parts hardly help.
const SMALLEST_SOFT_PART: f64 = 1.0 / 16.0;

/// A step over which the signs of pivots change is cut back to this part of a level: it may have jumped.
const CLOSE: f64 = 1.0 / 256.0;

/// And it may not have moved further than so many times what the path has moved so far by such a part of the load.
const JUMP: f64 = 8.0;

/// A step whose corrections grow has left the neighbourhood of the path: where they do not contract, it was too long (Deuflhard 2011, Newton
/// Methods for Nonlinear Problems, 5.1).
pub(super) const LARGEST_CONTRACTION: f64 = 1.0;

/// Where pivots do not count whether a step ended on another branch, no correction may be larger than this part of the one before it.
pub(super) const LARGEST_UNCOUNTED: f64 = 0.5;

/// A step that goes against the tangent it set out along, by a cosine below this, may have gone to another branch.
const BACK: f64 = -0.5;

/// What moves less is round-off: relative to the length of the scene, and in radians.
pub(super) const NO_MOTION: f64 = 1e-9;

/// How a stage has come to its last good state. Where levels lead on, one that is not reached is a limit of the path: the state of rest
/// behind it is not looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Way {
    /// It is that of its start.
    Start,
    /// By load levels
    Levels,
    /// By a motion to a state of rest, before or after levels
    Rest,
}

/// Follows the signs of pivots from step to step.
pub(super) struct Stability {
    /// Whether there is something to follow
    counts: bool,
    pub signature: Option<Signature>,
}

impl Stability {
    /// At the start of a stage.
    pub fn new(run: &mut Run, workshop: &mut StageRun) -> Self {
        // The start was assembled with its stiffness.
        let StageRun { assembly, newton, .. } = workshop;
        let mut tangent = Tangent::that_may_go(assembly, &run.state, Weights::STIFFNESS);
        let signature = newton.signature(&mut tangent, &mut run.counters.work);
        newton.begin_with(&assembly.system);
        // What is linear keeps its tangent.
        Self { counts: !run.is_linear(), signature }
    }

    /// At the run's state; `None` where it is not known.
    pub fn look(&mut self, run: &mut Run, workshop: &mut StageRun) -> Option<Signature> {
        if !self.counts {
            return None;
        }
        let StageRun { assembly, newton, .. } = workshop;
        let signature = newton.signature_at(assembly, &run.state, &mut run.counters.work);
        // Where nothing tells, nothing will next.
        self.counts = signature.is_some();
        signature
    }

    /// Of how many eigenvalues the sign changes at least.
    fn changes_to(&self, signature: Option<Signature>) -> usize {
        self.signature.zip(signature).map_or(0, |(before, after)| before.changes_to(after))
    }

    /// Says where a limit or branch point lies behind.
    pub fn pass(
        &mut self,
        run: &mut Run,
        workshop: &mut StageRun,
        signature: Option<Signature>,
    ) -> Result<(), Failure> {
        let before = std::mem::replace(&mut self.signature, signature);
        run.tell_stability(workshop, None, before, signature)
    }
}

/// The levels of a stage.
pub(super) struct Levels {
    /// The state before the first
    pub start: State,
    /// Load factor from one to the next
    pub level: f64,
    pub approach: Approach,
    pub stability: Stability,
    /// What nothing holds before the first level
    pub loose: Option<Failure>,
    pub way: Way,
    increment: f64,
}

impl Levels {
    /// From the run's state on.
    pub fn new(
        run: &mut Run,
        workshop: &mut StageRun,
        steps: usize,
        approach: Approach,
        loose: Option<Failure>,
    ) -> Self {
        let (start, level) = (run.state.kept(), 1.0 / steps as f64);
        Self {
            start,
            level,
            approach,
            stability: Stability::new(run, workshop),
            loose,
            way: Way::Start,
            increment: level,
        }
    }

    /// The next load factor between `load` and `target`.
    pub fn next(&mut self, load: f64, target: f64) -> f64 {
        let rest = target - load;
        if self.approach == Approach::Straight || self.increment >= rest * (1.0 - 1e-9) {
            self.increment = rest;
            return target;
        }
        load + self.increment
    }

    /// Takes the next step half as long; `false` where it may not be. `soft`: round-off takes the stiffness of the softest motion.
    pub fn halve(&mut self, soft: bool) -> bool {
        let smaller = 0.5 * self.increment;
        let smallest = match soft {
            true => SMALLEST_SOFT_PART * self.level,
            false => (SMALLEST_PART * self.level).min(SMALLEST_OF_STAGE),
        };
        let may = self.approach != Approach::Straight && smaller >= smallest;
        self.increment = if may { smaller } else { self.increment };
        may
    }

    /// After a step that was taken.
    pub fn double(&mut self) {
        self.increment = (2.0 * self.increment).min(self.level);
    }

    /// Load control begins anew.
    pub fn restart(&mut self) {
        self.increment = self.level;
    }

    /// Whether a step was too long to tell that it follows the path: its corrections did not contract, or it passed several critical points
    /// at once, of which each may have a branch that the path turns into.
    pub fn may_have_strayed(&self, contraction: f64, signature: Option<Signature>) -> bool {
        let is_counted =
            [self.stability.signature, signature].iter().all(|s| s.and_then(Signature::negative).is_some());
        let largest = if is_counted { LARGEST_CONTRACTION } else { LARGEST_UNCOUNTED };
        contraction > largest || self.stability.changes_to(signature) > 1
    }

    /// Whether a step may have gone to another branch: it went back against the `first` correction, or it changed the signs of pivots and is
    /// not small, or the state has moved further than on a path that goes on.
    pub fn may_have_jumped(
        &self,
        model: &Model,
        states: [&State; 2],
        first: &CompressedField<3>,
        signature: Option<Signature>,
    ) -> bool {
        let [from, to] = states;
        if self.approach == Approach::Straight {
            return false;
        }
        let (step, risen) = (to.load - from.load, from.load - self.start.load);
        if self.stability.changes_to(signature) == 0 {
            // A stage may begin out of balance: its first step need not go along a path.
            return risen > 0.0 && has_turned_back(model, from, to, first);
        }
        let moved = distance(model, from, to);
        let usual = if risen > 0.0 { distance(model, &self.start, from) / risen * step } else { f64::INFINITY };
        step > CLOSE * self.level || moved > (JUMP * usual).max(NO_MOTION)
    }
}

/// Whether a step has moved against the `first` correction of its iteration, which goes along the tangent of the path: nodes'
/// displacements tell.
fn has_turned_back(model: &Model, from: &State, to: &State, first: &CompressedField<3>) -> bool {
    let [along, moved, expected] = threads::sums(first.len(), |part| {
        let [mut along, mut moved, mut expected] = [0.0; 3];
        for slot in part.filter(|&slot| model.kinds[slot] == SlotKind::Displacement) {
            let (step, first) = (to.q[slot] - from.q[slot], Vec3(first.get(slot)));
            along += step.dot(first);
            moved += step.squared();
            expected += first.squared();
        }
        [along, moved, expected]
    });
    let sizes = [moved.sqrt(), expected.sqrt()];
    sizes.iter().all(|&size| size > NO_MOTION * model.length) && along < BACK * sizes[0] * sizes[1]
}

/// The largest difference of two states: displacements over the length of the scene, rotations in radians, whatever their charts.
pub(super) fn distance(model: &Model, a: &State, b: &State) -> f64 {
    let one = |slot: usize| match model.kinds[slot] {
        SlotKind::Displacement => (b.q[slot] - a.q[slot]).norm() / model.length,
        SlotKind::Rotation => relative_angle(Rotation::new(a.q[slot]).r, Rotation::new(b.q[slot]).r),
        SlotKind::Force | SlotKind::Moment => 0.0,
    };
    threads::largest(model.kinds.len(), |part| part.map(one).fold(0.0, f64::max))
}
