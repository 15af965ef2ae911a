//! Friction that a time step leaves behind: what slides may come to rest within the step and slide back,
//! while its friction still acts as it did, along the motion.
//!
//! The accelerations at both ends of such a step agree, so that its local error does not show it.

use super::Dynamics;
use super::smooth_start::advance;
use crate::effect::RubbingPoint;
use crate::system::State;
use std::iter::zip;

/// The way back within a step that is allowed, over that on which friction would build up the other way.
const ALLOWED: f64 = 0.1;

/// The part of a step by which a state is moved on for the velocity of sliding.
const SHORT: f64 = 1e-3;

impl Dynamics<'_, '_> {
    /// True if something has slid back within the step of some length that has just been solved.
    pub(super) fn slides_back(&self, length: f64) -> bool {
        let Some(contacts) = self.stage.model.contacts().filter(|contacts| contacts.rubs()) else { return false };
        let at_end = contacts.rubbing(self.stage.state);
        if at_end.iter().all(|point| point.give.is_none()) {
            return false;
        }
        let in_middle = contacts.rubbing(&self.at_middle(length));
        let ahead = contacts.rubbing(&self.ahead(SHORT * length));
        if in_middle.len() != at_end.len() || ahead.len() != at_end.len() {
            return false;
        }
        zip(in_middle, zip(at_end, ahead)).any(|(middle, (end, ahead))| {
            let (Some(give), Some(along)) = (end.give, end.force.normalized()) else { return false };
            let way = |point: RubbingPoint| -along.dot(point.sliding);
            let (middle, end, ahead) = (way(middle), way(end), way(ahead));
            // With a velocity that changes in proportion to time it came to rest before the end.
            let beyond = (end - ahead).max(0.0) / SHORT;
            let back: f64 = if beyond > 0.0 { 0.25 * beyond * beyond / (end.max(0.0) + beyond) } else { 0.0 };
            back.max(-middle).max(middle - end) > ALLOWED * give
        })
    }

    /// The state in the middle of the step, by a cubic through places and velocities at its ends.
    fn at_middle(&self, length: f64) -> State {
        let [from, to] = [self.stage.good, &*self.stage.state];
        let mut middle = State::clone(to);
        for (slot, q) in middle.q.iter_mut().enumerate() {
            *q = (from.q[slot] + to.q[slot]) * 0.5 + (from.v[slot] - to.v[slot]) * (0.125 * length);
        }
        self.set_time_of(&mut middle, to.time - 0.5 * length);
        middle
    }

    /// The state at the end of the step, moved on for a time.
    fn ahead(&self, time: f64) -> State {
        let mut ahead = State::clone(self.stage.state);
        advance(&mut ahead, time, None);
        self.set_time_of(&mut ahead, self.stage.state.time + time);
        ahead
    }

    /// Moves surfaces, and what is prescribed, to where they are at a time.
    fn set_time_of(&self, state: &mut State, time: f64) {
        // What turns too far is looked at for whole steps.
        let _ = self.stage.schedule.set_clock(self.stage.model, state, time, 1.0);
    }
}
