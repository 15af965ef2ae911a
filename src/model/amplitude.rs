//! How strongly a load acts: through stages, along the load factor, over time.

use super::history::History;
use crate::system::{StageKind, StageSet};
use std::sync::Arc;

/// What an amplitude does in the present stage.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    Hold(f64),
    Ramp { from: f64, to: f64 },
    History(StageKind),
}

/// The factor of a load.
#[derive(Clone)]
pub struct Amplitude {
    history: Option<Arc<dyn History>>,
    stages: StageSet,
    /// Switched at once instead of ramped: springs.
    switched: bool,
    course: Course,
    reached: f64,
    has_acted: bool,
    /// The last ramp that went anywhere, over the load factor
    grown: Option<(f64, f64)>,
}

impl Amplitude {
    /// Of a load with this history, or the default one: up with the load factor of the first static stage in which it
    /// acts, then in full; in full from the start of a dynamic stage.
    pub fn of_load(history: Option<Arc<dyn History>>, stages: StageSet) -> Self {
        Self {
            history,
            stages,
            switched: false,
            course: Course::Hold(0.0),
            reached: 0.0,
            has_acted: false,
            grown: None,
        }
    }

    /// Of something that is there or not.
    pub fn of_switch(stages: StageSet) -> Self {
        Self { switched: true, ..Self::of_load(None, stages) }
    }

    /// Whether it would ramp up for the first time in a static stage with this number.
    pub fn is_fresh(&self, stage: usize) -> bool {
        self.stages.contains(stage) && !self.has_acted && !self.switched && self.history.is_none()
    }

    /// Settles what it does in stage number `stage`. A buckling stage goes on where the last static one has stopped, unless
    /// there are loads that are `fresh` in it: then these alone grow.
    pub fn begin_stage(&mut self, stage: usize, kind: StageKind, fresh: bool) {
        let acts = self.stages.contains(stage);
        let grows = self.is_fresh(stage);
        // A modal stage only looks.
        self.has_acted |= acts && kind != StageKind::Modal;
        self.course = match (acts, kind, &self.history) {
            (true, StageKind::Modal, _) if !self.switched => Course::Hold(self.reached),
            (true, StageKind::Buckling, _) if !self.switched => match (fresh, grows) {
                (true, true) => Course::Ramp { from: 0.0, to: 1.0 },
                (false, _) => self.grown.map_or(Course::Hold(self.reached), |(from, to)| Course::Ramp { from, to }),
                (true, false) => Course::Hold(self.reached),
            },
            (true, ..) if self.switched => Course::Hold(1.0),
            (true, kind, Some(_)) => Course::History(kind),
            (true, StageKind::Static, None) => Course::Ramp { from: self.reached, to: 1.0 },
            (true, _, None) => Course::Hold(1.0),
            (false, StageKind::Static, _) if !self.switched => Course::Ramp { from: self.reached, to: 0.0 },
            (false, ..) => Course::Hold(0.0),
        };
        match self.course {
            Course::Ramp { from, to } if from != to => self.grown = Some((from, to)),
            // In full from the start of a dynamic stage: in proportion to its load factor of 1.
            Course::Hold(_) if acts && kind == StageKind::Dynamic && !self.switched => {
                self.grown = self.grown.or(Some((0.0, 1.0)));
            }
            _ => {}
        }
    }

    /// Remembers where the stage ended.
    pub fn end_stage(&mut self, time: f64, load: f64) {
        self.reached = self.at(time, load)[0];
    }

    /// The first time behind `time` at which it takes another course.
    pub fn next_corner(&self, time: f64) -> Option<f64> {
        match self.course {
            Course::History(kind) => self.history.as_ref()?.next_corner_in_stage(kind, time),
            _ => None,
        }
    }

    /// The factor at `time` and `load`, and its first and second derivative over time.
    pub fn at(&self, time: f64, load: f64) -> [f64; 3] {
        match self.course {
            Course::Hold(value) => [value, 0.0, 0.0],
            Course::Ramp { from, to } => [from + (to - from) * load, 0.0, 0.0],
            Course::History(kind) => self.history.as_ref().map_or([1.0, 0.0, 0.0], |h| h.in_stage(kind, time, load)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use StageKind::{Dynamic, Static};

    /// The factor at the half of each stage, stage after stage.
    fn halves(mut amplitude: Amplitude, kinds: &[StageKind]) -> Vec<f64> {
        let half = |(stage, &kind): (usize, &StageKind)| {
            amplitude.begin_stage(stage, kind, false);
            let [value, ..] = amplitude.at(0.0, if kind == Static { 0.5 } else { 1.0 });
            amplitude.end_stage(0.0, 1.0);
            value
        };
        kinds.iter().enumerate().map(half).collect()
    }

    #[test]
    fn a_load_without_history_ramps_once_and_stays() {
        let load = || Amplitude::of_load(None, StageSet::default());
        assert_eq!(halves(load(), &[Static, Static, Dynamic]), [0.5, 1.0, 1.0]);
        assert_eq!(halves(load(), &[Dynamic, Static]), [1.0, 1.0]);
    }

    #[test]
    fn a_load_that_rests_a_stage_comes_back() {
        let load = || Amplitude::of_load(None, StageSet(Some(vec![0, 2])));
        assert_eq!(halves(load(), &[Static, Static, Static]), [0.5, 0.5, 0.5]);
        assert_eq!(halves(load(), &[Static, Static, Dynamic]), [0.5, 0.5, 1.0]);
    }

    #[test]
    fn a_load_whose_stage_ended_early_goes_on_from_there() {
        let mut load = Amplitude::of_load(None, StageSet::default());
        load.begin_stage(0, Static, false);
        load.end_stage(0.0, 0.4);
        load.begin_stage(1, Static, false);
        assert_eq!([load.at(0.0, 0.0)[0], load.at(0.0, 1.0)[0]], [0.4, 1.0]);
    }

    #[test]
    fn a_load_whose_stage_is_over_is_ramped_down_or_dropped() {
        let first = || Amplitude::of_load(None, StageSet(Some(vec![0])));
        assert_eq!(halves(first(), &[Static, Static, Static]), [0.5, 0.5, 0.0]);
        assert_eq!(halves(first(), &[Static, Dynamic]), [0.5, 0.0]);
    }

    #[test]
    fn a_switch_is_never_ramped() {
        let second = Amplitude::of_switch(StageSet(Some(vec![1])));
        assert_eq!(halves(second, &[Static, Static, Static]), [0.0, 1.0, 0.0]);
    }
}
