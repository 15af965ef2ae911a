//! Sliding that turns round within a time step: what slides with friction comes to rest and slides back,
//! while its friction still acts as it did, along the motion.
//!
//! The accelerations at both ends of such a step agree, so that its local error does not show it.

use super::Dynamics;
use super::smooth_start::advance;
use crate::effect::RubbingPoint;
use crate::system::State;

/// The way back within a step that is allowed, over the way on which friction builds up.
const MAX_WAY_BACK: f64 = 0.1;

/// The part of a step by which a state is moved on to see the velocity of sliding.
const VELOCITY_STEP: f64 = 1e-3;

impl Dynamics<'_, '_> {
    /// True if a point of contact has slid back within the step of some length that has just been solved,
    /// by more than the local error that the step is allowed (over the length of the scene).
    pub(super) fn slides_back(&self, length: f64, allowed: f64) -> bool {
        let Some(contacts) = self.stage.model.contacts().filter(|contacts| contacts.rubs()) else { return false };
        let at_end = contacts.rubbing(self.stage.state);
        if at_end.iter().all(|point| point.stick_way.is_none()) {
            return false;
        }
        let in_middle = contacts.rubbing(&self.moved(-0.5 * length));
        let ahead = contacts.rubbing(&self.moved(VELOCITY_STEP * length));
        let way_back = |end: &RubbingPoint| -> Option<(f64, f64)> {
            let (stick_way, along) = (end.stick_way?, end.force.normalized()?);
            let way = |point: &RubbingPoint| -along.dot(point.sliding);
            let [middle, ahead] = [&in_middle, &ahead].map(|points| end.nearest_of(points).map(way));
            let (middle, end, ahead) = (middle?, way(end), ahead?);
            // With a velocity that changes in proportion to time it came to rest before the end.
            let beyond = (end - ahead).max(0.0) / VELOCITY_STEP;
            let back = if beyond > 0.0 { 0.25 * beyond * beyond / (end.max(0.0) + beyond) } else { 0.0 };
            Some((back.max(-middle).max(middle - end), stick_way))
        };
        let allowed = allowed * self.stage.model.length;
        at_end.iter().filter_map(way_back).any(|(back, stick_way)| back > allowed.max(MAX_WAY_BACK * stick_way))
    }

    /// The state at the end of the step, moved by a time, with surfaces and prescribed motions. Only whole
    /// steps are refused for turning too far.
    fn moved(&self, time: f64) -> State {
        let mut moved = State::clone(self.stage.state);
        advance(&mut moved, time, None);
        let _ = self.stage.schedule.set_clock(self.stage.model, &mut moved, self.stage.state.time + time, 1.0);
        moved
    }
}
