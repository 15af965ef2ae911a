//! How strongly a load acts: through stages, along the load factor, over time.

use super::history::{Phase, Reading};
use crate::system::{StageKind, StageSet};

/// What an amplitude does in the present stage.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    Hold(f64),
    Ramp { from: f64, to: f64 },
    History(StageKind),
}

/// What leads a load or a motion through a stage in which it acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Goal {
    /// Its full size, or that part of it with which its history will begin
    Value(f64),
    /// Its history
    History,
    /// Nothing: its history is over, or pauses.
    Stay,
}

impl Goal {
    /// Of what has this history in stage number `stage`.
    pub fn of(history: Option<&Reading>, stage: usize) -> Self {
        match history.map(|history| (history.phase(stage), history)) {
            None => Self::Value(1.0),
            Some((Phase::Before, history)) => Self::Value(history.first()),
            Some((Phase::In, _)) => Self::History,
            Some((Phase::Behind, _)) => Self::Stay,
        }
    }
}

/// The factor of a load.
#[derive(Clone)]
pub struct Amplitude {
    history: Option<Reading>,
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
    pub fn of_load(history: Option<Reading>, stages: StageSet) -> Self {
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
        let grows = matches!(Goal::of(self.history.as_ref(), stage), Goal::Value(value) if value != 0.0);
        self.stages.contains(stage) && !self.has_acted && !self.switched && grows
    }

    /// Settles what it does in stage number `stage`, which begins at `time`. A buckling stage goes on where the last static one has
    /// stopped, unless there are loads that are `fresh` in it: then these alone grow.
    pub fn begin_stage(&mut self, stage: usize, kind: StageKind, time: f64, fresh: bool) {
        let acts = self.stages.contains(stage);
        let grows = self.is_fresh(stage);
        // A modal stage only looks.
        self.has_acted |= acts && kind != StageKind::Modal;
        self.history.iter_mut().for_each(|history| history.begin_stage(stage, kind, time));
        let goal = Goal::of(self.history.as_ref(), stage);
        self.course = match (acts, kind, goal) {
            (true, ..) if self.switched => Course::Hold(1.0),
            (true, StageKind::Modal, _) | (true, _, Goal::Stay) => Course::Hold(self.reached),
            (true, StageKind::Buckling, goal) => match (fresh, grows, goal) {
                (true, true, Goal::Value(to)) => Course::Ramp { from: 0.0, to },
                (false, ..) => self.grown.map_or(Course::Hold(self.reached), |(from, to)| Course::Ramp { from, to }),
                _ => Course::Hold(self.reached),
            },
            (true, kind, Goal::History) => Course::History(kind),
            (true, StageKind::Static, Goal::Value(to)) => Course::Ramp { from: self.reached, to },
            (true, _, Goal::Value(to)) => Course::Hold(to),
            (false, StageKind::Static, _) if !self.switched => Course::Ramp { from: self.reached, to: 0.0 },
            (false, ..) => Course::Hold(0.0),
        };
        match (self.course, goal) {
            (Course::Ramp { from, to }, _) if from != to => self.grown = Some((from, to)),
            // In full from the start of a dynamic stage: in proportion to its load factor of 1.
            (Course::Hold(_), Goal::Value(to)) if acts && kind == StageKind::Dynamic && !self.switched => {
                self.grown = self.grown.or(Some((0.0, to)));
            }
            _ => {}
        }
    }

    /// Whether it goes with the load factor in the present stage.
    pub fn grows(&self) -> bool {
        matches!(self.course, Course::Ramp { from, to } if from != to)
    }

    /// Whether it follows a history in the present stage.
    pub fn follows_history(&self) -> bool {
        matches!(self.course, Course::History(_))
    }

    /// Whether its history, if it has one, belongs to some stages only.
    pub fn has_own_stages(&self) -> Option<bool> {
        self.history.as_ref().map(Reading::has_own_stages)
    }

    /// Whether it acts in stage number `stage`.
    pub fn acts_in(&self, stage: usize) -> bool {
        self.stages.contains(stage)
    }

    /// The largest rate of its history, if it is known.
    pub fn fastest(&self) -> Option<f64> {
        self.history.as_ref()?.fastest()
    }

    /// Where the last stage has left it.
    pub fn reached(&self) -> f64 {
        self.reached
    }

    /// Remembers where the stage ended.
    pub fn end_stage(&mut self, time: f64, load: f64) {
        self.reached = self.at(time, load)[0];
    }

    /// The first time behind `time` at which it takes another course.
    pub fn next_corner(&self, time: f64) -> Option<f64> {
        match self.course {
            Course::History(StageKind::Dynamic) => self.history.as_ref()?.next_corner(time),
            _ => None,
        }
    }

    /// The first time behind `time` at which its rate jumps.
    pub fn next_kink(&self, time: f64) -> Option<f64> {
        match self.course {
            Course::History(StageKind::Dynamic) => self.history.as_ref()?.next_kink(time),
            _ => None,
        }
    }

    /// Its rate just before `time`.
    pub fn rate_before(&self, time: f64) -> f64 {
        match (self.course, &self.history) {
            (Course::History(StageKind::Dynamic), Some(history)) => history.slope_before(time),
            _ => 0.0,
        }
    }

    /// The factor at `time` and `load`, and its first and second derivative over time.
    pub fn at(&self, time: f64, load: f64) -> [f64; 3] {
        match self.course {
            Course::Hold(value) => [value, 0.0, 0.0],
            Course::Ramp { from, to } => [from + (to - from) * load, 0.0, 0.0],
            Course::History(kind) => self.history.as_ref().map_or([1.0, 0.0, 0.0], |h| h.at(kind, time, load)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Table;
    use StageKind::{Dynamic, Static};
    use std::sync::Arc;

    /// The factor at the half of each stage, stage after stage.
    fn halves(mut amplitude: Amplitude, kinds: &[StageKind]) -> Vec<f64> {
        let half = |(stage, &kind): (usize, &StageKind)| {
            amplitude.begin_stage(stage, kind, 0.0, false);
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
        load.begin_stage(0, Static, 0.0, false);
        load.end_stage(0.0, 0.4);
        load.begin_stage(1, Static, 0.0, false);
        assert_eq!([load.at(0.0, 0.0)[0], load.at(0.0, 1.0)[0]], [0.4, 1.0]);
    }

    #[test]
    fn a_load_whose_stage_is_over_is_ramped_down_or_dropped() {
        let first = || Amplitude::of_load(None, StageSet(Some(vec![0])));
        assert_eq!(halves(first(), &[Static, Static, Static]), [0.5, 0.5, 0.0]);
        assert_eq!(halves(first(), &[Static, Dynamic]), [0.5, 0.0]);
    }

    #[test]
    fn a_history_of_later_stages_holds_its_first_value_before_and_its_last_behind() {
        let ramp = Arc::new(Table { times: vec![0.0, 1.0], values: vec![2.0, 4.0], smooth: false });
        let own = |stages: &[usize]| {
            let history = Reading::new(ramp.clone(), StageSet(Some(stages.to_vec())));
            Amplitude::of_load(Some(history), StageSet::default())
        };
        // The load factor brings the first value in.
        assert_eq!(halves(own(&[2]), &[Static, Static, Static, Static]), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(halves(own(&[1]), &[Dynamic, Static, Dynamic]), [2.0, 3.0, 4.0]);
        assert_eq!(halves(own(&[0, 2]), &[Static, Static, Static]), [3.0, 4.0, 3.0]);
    }

    #[test]
    fn a_switch_is_never_ramped() {
        let second = Amplitude::of_switch(StageSet(Some(vec![1])));
        assert_eq!(halves(second, &[Static, Static, Static]), [0.0, 1.0, 0.0]);
    }
}
