//! How the levels of a static stage are approached, and how a step to another branch is noticed.

use crate::model::{Model, SlotKind};
use crate::run::distance::{NO_MOTION, distance};
use crate::run::plan::Approach;
use crate::scalar::CompressedField;
use crate::system::State;
use crate::tensor::Vec3;
use crate::threads;
use serde::{Deserialize, Serialize};

/// The smallest part of a level that is tried.
const SMALLEST_PART: f64 = 1.0 / 4096.0;

/// The smallest part of a stage that is tried where it has few levels.
const SMALLEST_OF_STAGE: f64 = 1.0 / 65536.0;

/// The smallest part of a level where round-off takes the stiffness: smaller ones hardly help.
const SMALLEST_SOFT_PART: f64 = 1.0 / 16.0;

/// The part of a level to which a step is cut back over which the signs of pivots change: it may
/// have jumped.
const CLOSE: f64 = 1.0 / 256.0;

/// The motion over such a step, over that of the path so far by such a part of the load, beyond
/// which it has jumped.
const JUMP: f64 = 8.0;

/// The motion, over the length of the scene or in radians, up to which what slides has not jumped, however sudden it is.
const FAR: f64 = 0.05;

/// A step that goes against the tangent it set out along, by a cosine below this, may have gone to
/// another branch.
const BACK: f64 = -0.5;

/// How a stage has come to its last good state. Where levels lead on, one that is not reached is a
/// limit of the path: the state of rest behind it is not looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
pub(super) enum ReachedBy {
    /// It is that of its start.
    Start,
    /// By load levels
    Levels,
    /// By a motion to a state of rest, before or after levels
    Rest,
}

/// The levels of a stage.
#[derive(Clone, Deserialize, Serialize)]
pub(super) struct Levels {
    /// The state before the first
    pub(super) start: State,
    /// Load factor from one to the next
    pub(super) level: f64,
    pub(super) approach: Approach,
    pub(super) reached_by: ReachedBy,
    /// Load factor from the last good state to the next one
    increment: f64,
}

impl Levels {
    /// `count` levels from a state on.
    pub fn new(start: State, count: usize, approach: Approach) -> Self {
        let level = 1.0 / count as f64;
        Self { start, level, approach, reached_by: ReachedBy::Start, increment: level }
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

    /// Takes the next step half as long; `false` where it may not be. `soft`: round-off takes the
    /// stiffness of the softest motion.
    pub fn halve(&mut self, soft: bool) -> bool {
        let may = self.may_halve(soft);
        self.increment *= if may { 0.5 } else { 1.0 };
        may
    }

    /// True if the next step may be half as long.
    pub fn may_halve(&self, soft: bool) -> bool {
        let smallest = match soft {
            true => SMALLEST_SOFT_PART * self.level,
            false => (SMALLEST_PART * self.level).min(SMALLEST_OF_STAGE),
        };
        self.approach != Approach::Straight && 0.5 * self.increment >= smallest
    }

    /// The last step that was tried was no longer than this.
    pub fn shorten_to(&mut self, tried: f64) {
        self.increment = self.increment.min(tried);
    }

    /// After a step that was taken: the next one is twice as long, unless the ratio of its corrections
    /// would exceed `largest`. This ratio, `contraction` in the last step, grows in proportion to the step.
    pub fn lengthen(&mut self, contraction: f64, largest: f64) {
        if 2.0 * contraction <= largest {
            self.increment = (2.0 * self.increment).min(self.level);
        }
    }

    /// Load control begins anew.
    pub fn restart(&mut self) {
        self.increment = self.level;
    }

    /// True if a step may have gone to another branch: it went back against the `first` correction,
    /// or it has changed the signs of some eigenvalues and is not small, or the state has moved
    /// further than on a path that goes on.
    pub fn may_have_jumped(
        &self,
        model: &Model,
        states: [&State; 2],
        first: &CompressedField<3>,
        changes: usize,
    ) -> bool {
        let [from, to] = states;
        if self.approach == Approach::Straight {
            return false;
        }
        if changes == 0 {
            // A stage may begin out of balance: its first step need not go along a path.
            return from.load > self.start.load && has_turned_back(model, from, to, first);
        }
        let usual = self.usual_motion(model, states).unwrap_or(f64::INFINITY);
        !self.is_close(to.load - from.load) || distance(model, from, to) > (JUMP * usual).max(NO_MOTION)
    }

    /// True if something has moved much further in a step than on the way to it.
    pub fn has_moved_far(&self, model: &Model, states: [&State; 2]) -> bool {
        let usual = self.usual_motion(model, states).unwrap_or(0.0);
        self.approach != Approach::Straight && distance(model, states[0], states[1]) > (JUMP * usual).max(FAR)
    }

    /// True if a step is so short that what moves far in it has jumped.
    pub fn is_close(&self, step: f64) -> bool {
        step <= CLOSE * self.level
    }

    /// The motion in a step that moves as the stage has done before it; `None` in its first step.
    fn usual_motion(&self, model: &Model, [from, to]: [&State; 2]) -> Option<f64> {
        let risen = from.load - self.start.load;
        (risen > 0.0).then(|| distance(model, &self.start, from) / risen * (to.load - from.load))
    }
}

/// True if a step has moved against the `first` correction of its iteration, which goes along the
/// tangent of the path: nodes' displacements tell.
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
