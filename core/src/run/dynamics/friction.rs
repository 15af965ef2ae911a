//! Friction that changes within a time step: what slides comes to rest, sticks or slides back.
//!
//! Friction at the end of a step acts along the whole motion of the step, and accelerations at both ends
//! do not show what that misses: adaptive steps refuse such steps, and for fixed steps it is summed up.

use super::Dynamics;
use super::friction_impulses::FrictionImpulses;
use super::smooth_start::advance;
use crate::effect::{Contacts, RubbingPoint};
use crate::system::State;
use crate::tensor::Vec3;

/// The way back within a step that is allowed, over the way on which friction builds up.
const MAX_WAY_BACK: f64 = 0.1;

/// The part of a step by which a state is moved on to see the velocity of sliding.
const VELOCITY_STEP: f64 = 1e-3;

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

    /// Adds the friction of the step of some length that has just been solved to that of the stage.
    pub(super) fn add_friction(&mut self, length: f64) {
        let Some(contacts) = self.rubbing_contacts() else { return };
        let ends = self.step_ends();
        let instants: Vec<(f64, Vec<RubbingPoint>)> =
            ends.instants().into_iter().map(|(weight, at)| (weight, contacts.rubbing(at))).collect();
        let (Some((_, at_start)), Some((_, at_end))) = (instants.first(), instants.last()) else { return };
        if !at_start.iter().chain(at_end).any(|point| point.slides) {
            return;
        }
        let ahead = [ends.from, ends.to].map(|at| contacts.rubbing(&self.moved(at, VELOCITY_STEP * length)));
        let of_point = |end: &RubbingPoint| -> Option<FrictionImpulses> {
            let start = end.nearest_of(at_start)?;
            let rate = |now: &RubbingPoint, ahead: &[RubbingPoint]| {
                Some((end.nearest_of(ahead)?.sliding - now.sliding) * (1.0 / VELOCITY_STEP))
            };
            let rates = [rate(start, &ahead[0])?, rate(end, &ahead[1])?];
            let force = |(weight, points): &(f64, Vec<RubbingPoint>)| Some(end.nearest_of(points)?.force * *weight);
            let seen = instants.iter().map(force).try_fold(Vec3::ZERO, |sum, force| Some(sum + force?))?;
            Some(FrictionImpulses::of_point(start, end, rates, seen, length))
        };
        let sum = at_end.iter().filter_map(of_point).fold(FrictionImpulses::default(), FrictionImpulses::with);
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
