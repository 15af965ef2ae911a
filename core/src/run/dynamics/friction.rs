//! Friction that changes within a time step: what slides comes to rest, sticks or slides back.
//!
//! Friction at the end of a step acts along the whole motion of the step. Accelerations at both ends
//! do not show what that misses: adaptive steps refuse such steps, and for fixed steps it is summed up.

use super::Dynamics;
use super::smooth_start::advance;
use crate::effect::{Contacts, RubbingPoint};
use crate::system::State;
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};

/// The way back within a step that is allowed, over the way on which friction builds up.
const MAX_WAY_BACK: f64 = 0.1;

/// The part of a step by which a state is moved on to see the velocity of sliding.
const VELOCITY_STEP: f64 = 1e-3;

/// The parts in which friction follows the motion of a step.
const PARTS: usize = 64;

/// Sums over the points of contact and the steps of a stage: force times time.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize)]
pub(super) struct FrictionImpulses {
    /// What the mean of the friction at both ends of a step misses of the mean over the step
    missed: f64,
    /// The mean of the friction at both ends
    all: f64,
}

impl FrictionImpulses {
    fn with(self, other: Self) -> Self {
        Self { missed: self.missed + other.missed, all: self.all + other.all }
    }

    /// The part of friction that is missed.
    pub(super) fn missed_part(self) -> f64 {
        if self.all > 0.0 { self.missed / self.all } else { 0.0 }
    }
}

impl Dynamics<'_, '_> {
    /// True if a point of contact has slid back within the step of some length that has just been solved,
    /// by more than the local error that the step is allowed (over the length of the scene).
    pub(super) fn slides_back(&self, length: f64, allowed: f64) -> bool {
        let Some(contacts) = self.rubbing_contacts() else { return false };
        let at_end = contacts.rubbing(self.stage.state);
        if !at_end.iter().any(|point| point.slides) {
            return false;
        }
        let in_middle = contacts.rubbing(&self.moved(self.stage.state, -0.5 * length));
        let ahead = contacts.rubbing(&self.moved(self.stage.state, VELOCITY_STEP * length));
        let way_back = |end: &RubbingPoint| -> Option<(f64, f64)> {
            let along = end.force.normalized()?;
            let way = |point: &RubbingPoint| -along.dot(point.sliding);
            let [middle, ahead] = [&in_middle, &ahead].map(|points| end.nearest_of(points).map(way));
            let (middle, end_way, ahead) = (middle?, way(end), ahead?);
            // With a velocity that changes in proportion to time it came to rest before the end.
            let beyond = (end_way - ahead).max(0.0) / VELOCITY_STEP;
            let back = if beyond > 0.0 { 0.25 * beyond * beyond / (end_way.max(0.0) + beyond) } else { 0.0 };
            Some((back.max(-middle).max(middle - end_way), end.stick_way()))
        };
        let allowed = allowed * self.stage.model.length;
        let sliding = at_end.iter().filter(|point| point.slides);
        sliding.filter_map(way_back).any(|(back, stick_way)| back > allowed.max(MAX_WAY_BACK * stick_way))
    }

    /// Adds the friction of the step of some length that has just been solved.
    pub(super) fn add_friction(&mut self, length: f64) {
        let Some(contacts) = self.rubbing_contacts() else { return };
        let states: [&State; 2] = [self.stage.good, self.stage.state];
        let ends = states.map(|at| contacts.rubbing(at));
        if !ends.iter().flatten().any(|point| point.slides) {
            return;
        }
        let ahead = states.map(|at| contacts.rubbing(&self.moved(at, VELOCITY_STEP * length)));
        let of_point = |end: &RubbingPoint| -> Option<FrictionImpulses> {
            let start = end.nearest_of(&ends[0])?;
            let rate = |now: &RubbingPoint, ahead: &[RubbingPoint]| {
                Some((end.nearest_of(ahead)?.sliding - now.sliding) * (1.0 / VELOCITY_STEP))
            };
            let rates = [rate(start, &ahead[0])?, rate(end, &ahead[1])?];
            let seen = (start.force + end.force) * 0.5;
            let missed = mean_friction(start, end, rates) - seen;
            let impulse = length * end.weight;
            Some(FrictionImpulses { missed: impulse * missed.norm(), all: impulse * seen.norm() })
        };
        let sum = ends[1].iter().filter_map(of_point).fold(FrictionImpulses::default(), FrictionImpulses::with);
        self.friction = self.friction.with(sum);
    }

    fn rubbing_contacts(&self) -> Option<&dyn Contacts> {
        self.stage.model.contacts().filter(|contacts| contacts.rubs())
    }

    /// A state moved by a time, with surfaces and prescribed motions. Only whole steps are refused for
    /// turning too far.
    fn moved(&self, from: &State, time: f64) -> State {
        let mut moved = State::clone(from);
        advance(&mut moved, time, None);
        let _ = self.stage.schedule.set_clock(self.stage.model, &mut moved, from.time + time, 1.0);
        moved
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
