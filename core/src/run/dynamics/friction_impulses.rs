//! The impulse of friction over fixed time steps, and the part of it that they miss.

use crate::effect::RubbingPoint;
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};

/// The parts in which friction follows the motion of a step.
const PARTS: usize = 64;

/// Sums over the points of contact and the steps of a stage: force times time.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
pub(super) struct FrictionImpulses {
    /// What the mean of the friction that steps take misses of the mean along their motion
    missed: f64,
    /// The mean of the friction that steps take
    all: f64,
}

impl FrictionImpulses {
    /// Those of a point in a step of some length, with the sliding in a step at the velocities of both ends, and
    /// the mean friction that the step takes.
    pub(super) fn of_point(
        start: &RubbingPoint,
        end: &RubbingPoint,
        rates: [Vec3; 2],
        seen: Vec3,
        length: f64,
    ) -> Self {
        let missed = mean_friction(start, end, rates) - seen;
        let impulse = length * end.weight;
        Self { missed: impulse * missed.norm(), all: impulse * seen.norm() }
    }

    pub(super) fn with(self, other: Self) -> Self {
        Self { missed: self.missed + other.missed, all: self.all + other.all }
    }

    /// The part of friction that is missed.
    pub(super) fn missed_part(self) -> f64 {
        if self.all > 0.0 { self.missed / self.all } else { 0.0 }
    }
}

/// The mean of the friction of a point over a step. The point slides along a cubic with its way and
/// its velocities (over the step) at both ends, and the limit of friction changes in proportion to time.
fn mean_friction(start: &RubbingPoint, end: &RubbingPoint, [from, to]: [Vec3; 2]) -> Vec3 {
    let way = |part: f64| {
        let rest = 1.0 - part;
        end.sliding * (part * part * (3.0 - 2.0 * part)) + (from * rest - to * part) * (part * rest)
    };
    let mut force = start.force;
    let mut sum = Vec3::ZERO;
    for k in 0..PARTS {
        let [before, now] = [k, k + 1].map(|k| k as f64 / PARTS as f64);
        force -= (way(now) - way(before)) * end.stiffness;
        let limit = start.limit + (end.limit - start.limit) * now;
        let size = force.norm();
        if size > limit {
            force = force * (limit / size);
        }
        sum += force;
    }
    sum * (1.0 / PARTS as f64)
}
