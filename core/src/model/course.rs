//! How loads and prescribed motions go through the stages: the part of it that never changes
//! ([`Amplitude`]), and the part that does ([`Progress`]).

use super::history::{HistoryClock, Phase, Reading};
use crate::system::{StageKind, StageSet};
use serde::{Deserialize, Serialize};

/// Values that differ by this part of a ramp are the same: those of motions are read back from rounded
/// places.
const SAME_VALUE: f64 = 1e-9;

/// The way of a load or a motion through one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub enum Course {
    /// It does nothing.
    #[default]
    Off,
    /// It keeps a value.
    Hold(f64),
    /// It goes with the load factor.
    Ramp(Ramp),
    /// It follows its history, as stages of this kind read it.
    History(StageKind),
}

/// Values at the load factors 0 and 1, linear between them.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Ramp {
    /// At load factor 0
    from: f64,
    /// At load factor 1
    to: f64,
}

impl Ramp {
    fn at(&self, load: f64) -> f64 {
        self.from + (self.to - self.from) * load
    }

    fn grows(&self) -> bool {
        self.from != self.to
    }
}

/// How something enters and leaves the stages in which it acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Entry {
    /// Static stages ramp it up, and down where it acts no more; it acts in full from the start of
    /// dynamic ones.
    Load,
    /// It is there or not.
    Switch,
    /// Static stages ramp it up; a dynamic stage behind one in which it has acted keeps it where it
    /// is.
    Motion,
}

/// The aim of a load or a motion in a stage in which it acts.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Goal {
    /// Its full size, or that part of it with which its history will begin
    Value(f64),
    /// Its history
    History,
    /// Nothing: its history is over, or pauses.
    Stay,
}

/// When a load or a motion acts, and what leads it there.
#[derive(Clone)]
pub struct Amplitude {
    history: Option<Reading>,
    stages: StageSet,
    entry: Entry,
    /// The value that a factor of 1 stands for
    full: f64,
}

impl Default for Amplitude {
    /// That of a load without a history, in all stages.
    fn default() -> Self {
        Self::of_load(None, StageSet::default())
    }
}

impl Amplitude {
    /// The factor of a load with this history, or with the default one: up with the load factor of
    /// the first static stage in which it acts, then in full; in full from the start of a dynamic
    /// stage.
    pub fn of_load(history: Option<Reading>, stages: StageSet) -> Self {
        Self { history, stages, entry: Entry::Load, full: 1.0 }
    }

    /// The factor of something that is there or not: springs.
    pub fn of_switch(stages: StageSet) -> Self {
        Self { history: None, stages, entry: Entry::Switch, full: 1.0 }
    }

    /// A displacement or angle `full`, multiplied by its history or by the load factor.
    pub fn of_motion(full: f64, history: Option<Reading>, stages: StageSet) -> Self {
        Self { history, stages, entry: Entry::Motion, full }
    }

    /// The value that a factor of 1 stands for: 1 for loads, a displacement or an angle for motions.
    pub fn full(&self) -> f64 {
        self.full
    }

    /// The stages in which it acts.
    pub fn stages(&self) -> &StageSet {
        &self.stages
    }

    /// Tells whether its history belongs to some stages only; `None` without a history.
    pub fn has_own_stages(&self) -> Option<bool> {
        self.history.as_ref().map(Reading::has_own_stages)
    }

    /// Tells whether it acts in stage number `stage`, from 0.
    pub fn acts_in(&self, stage: usize) -> bool {
        self.stages.contains(stage)
    }

    /// The largest rate of its value in a dynamic stage, if it is known.
    pub fn fastest(&self) -> Option<f64> {
        let fastest = self.history.as_ref()?.fastest()?;
        Some((fastest * self.full).abs())
    }

    /// The factor that leads it in stage number `stage`.
    fn goal(&self, stage: usize) -> Goal {
        let Some(history) = &self.history else { return Goal::Value(1.0) };
        match history.phase(stage) {
            Phase::Before => Goal::Value(history.first()),
            Phase::In => Goal::History,
            Phase::Behind => Goal::Stay,
        }
    }
}

/// A stage that begins, as loads and motions see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct StageStart {
    /// From 0
    pub(super) number: usize,
    pub(super) kind: StageKind,
    /// The run's clock
    pub(super) time: f64,
    /// Tells whether loads or motions act for the first time in it
    pub(super) fresh: bool,
}

/// The course of a load or a motion in the present stage, and the traces of earlier stages: all of
/// it that changes in a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Progress {
    course: Course,
    /// The value where the stage before has ended
    pub(super) reached: f64,
    /// The value where the last stage in which it acted has ended
    kept: f64,
    /// It acts in the present stage, and the state goes on in it
    acts: bool,
    has_acted: bool,
    /// The last ramp that went anywhere
    last_ramp: Option<Ramp>,
    /// Where that ramp began, with those that it goes on with after an early end of their stages
    origin: f64,
    clock: HistoryClock,
}

impl Progress {
    /// Tells whether it would grow for the first time in a static stage with this number.
    pub(super) fn is_fresh(&self, amplitude: &Amplitude, stage: usize) -> bool {
        let grows = matches!(amplitude.goal(stage), Goal::Value(factor) if factor != 0.0);
        amplitude.acts_in(stage) && !self.has_acted && amplitude.entry != Entry::Switch && grows
    }

    /// Settles the course of a stage. A buckling stage goes on where the last static one has
    /// stopped, unless there are loads that are fresh in it: then these alone grow.
    pub(super) fn begin_stage(&mut self, amplitude: &Amplitude, start: &StageStart) {
        if let Some(history) = &amplitude.history {
            history.begin_stage(&mut self.clock, start.number, start.kind, start.time);
        }
        if self.acts {
            self.kept = self.reached;
        }
        let acts = amplitude.acts_in(start.number);
        self.acts = acts && start.kind.advances_state();
        self.course =
            if acts { self.course_acting(amplitude, start) } else { self.course_absent(amplitude, start.kind) };
        // A modal stage only looks.
        self.has_acted |= acts && start.kind != StageKind::Modal;
        let comes_at_once = acts && start.kind == StageKind::Dynamic && amplitude.entry == Entry::Load;
        if let Course::Ramp(ramp) = self.course {
            if ramp.grows() {
                self.note_ramp(ramp);
            }
        } else if let Goal::Value(to) = amplitude.goal(start.number)
            && comes_at_once
        {
            // In full from the start of a dynamic stage: in proportion to its load factor of 1.
            self.last_ramp = self.last_ramp.or(Some(Ramp { from: 0.0, to }));
        }
    }

    fn course_acting(&self, amplitude: &Amplitude, start: &StageStart) -> Course {
        let stay = Course::Hold(self.reached);
        let ramp = |factor: f64| Course::Ramp(Ramp { from: self.reached, to: amplitude.full * factor });
        match (amplitude.entry, start.kind, amplitude.goal(start.number)) {
            (Entry::Switch, ..) => Course::Hold(amplitude.full),
            (_, StageKind::Modal, _) | (_, StageKind::Buckling, Goal::Stay) => stay,
            (_, StageKind::Buckling, goal) => match goal {
                Goal::Value(factor) if start.fresh && self.is_fresh(amplitude, start.number) => ramp(factor),
                Goal::Value(_) | Goal::History | Goal::Stay if start.fresh => stay,
                Goal::Value(_) | Goal::History | Goal::Stay => self.whole_ramp().map_or(stay, Course::Ramp),
            },
            (_, StageKind::Static | StageKind::Dynamic, Goal::History) => Course::History(start.kind),
            (_, StageKind::Static, Goal::Value(factor)) => ramp(factor),
            // Behind a stage in which it did not act, it comes back.
            (_, StageKind::Static, Goal::Stay) => Course::Ramp(Ramp { from: self.reached, to: self.kept }),
            (Entry::Load, StageKind::Dynamic, Goal::Stay) => Course::Hold(self.kept),
            (Entry::Motion, StageKind::Dynamic, Goal::Stay) => stay,
            (Entry::Motion, StageKind::Dynamic, Goal::Value(_)) if self.has_acted => stay,
            (_, StageKind::Dynamic, Goal::Value(factor)) => Course::Hold(amplitude.full * factor),
        }
    }

    /// Takes a ramp that goes somewhere: it may go on where one has ended early.
    fn note_ramp(&mut self, ramp: Ramp) {
        let done = (ramp.from - self.origin) / (ramp.to - self.origin);
        let goes_on = self.last_ramp.is_some_and(|last| last.to == ramp.to) && 0.0 < done && done < 1.0;
        self.origin = if goes_on { self.origin } else { ramp.from };
        self.last_ramp = Some(ramp);
    }

    /// The last ramp; from where all of it began, if it has reached its end.
    fn whole_ramp(&self) -> Option<Ramp> {
        let last = self.last_ramp?;
        let is_at_end = (self.reached - last.to).abs() <= SAME_VALUE * (last.to - self.origin).abs();
        Some(if is_at_end { Ramp { from: self.origin, ..last } } else { last })
    }

    fn course_absent(&self, amplitude: &Amplitude, kind: StageKind) -> Course {
        match amplitude.entry {
            Entry::Motion => Course::Off,
            Entry::Load if kind == StageKind::Static => Course::Ramp(Ramp { from: self.reached, to: 0.0 }),
            Entry::Load | Entry::Switch => Course::Hold(0.0),
        }
    }

    /// Tells whether it goes with the load factor in the present stage.
    pub(super) fn grows(&self) -> bool {
        matches!(self.course, Course::Ramp(ramp) if ramp.grows())
    }
}

/// The present course of a load or a motion, with the history that it may follow.
#[derive(Clone, Copy)]
pub struct Timeline<'a> {
    amplitude: &'a Amplitude,
    progress: &'a Progress,
}

impl<'a> Timeline<'a> {
    pub(super) fn new(amplitude: &'a Amplitude, progress: &'a Progress) -> Self {
        Self { amplitude, progress }
    }

    /// Tells whether it acts in the present stage.
    pub fn acts(&self) -> bool {
        self.progress.course != Course::Off
    }

    /// Tells whether it follows a history in the present stage.
    pub fn follows_history(&self) -> bool {
        matches!(self.progress.course, Course::History(_))
    }

    /// The value where the stage before has ended.
    pub fn reached(&self) -> f64 {
        self.progress.reached
    }

    /// The value at a time and a load factor, and its first and second derivative over time.
    pub fn at(&self, time: f64, load: f64) -> [f64; 3] {
        match self.progress.course {
            Course::Off => [0.0; 3],
            Course::Hold(value) => [value, 0.0, 0.0],
            Course::Ramp(ramp) => [ramp.at(load), 0.0, 0.0],
            Course::History(kind) => {
                let history = self.amplitude.history.as_ref();
                let factors = history.map_or([1.0, 0.0, 0.0], |h| h.at(&self.progress.clock, kind, time, load));
                factors.map(|factor| self.amplitude.full * factor)
            }
        }
    }

    /// The first time behind `time` at which it takes another course, or bends most.
    pub fn next_corner(&self, time: f64) -> Option<f64> {
        self.dynamic_history()?.next_corner(&self.progress.clock, time)
    }

    /// The first load factor behind `load` in a static stage at which its history is not smooth, or bends most.
    pub fn next_corner_of_load(&self, load: f64) -> Option<f64> {
        // Load factors have no clock of their own.
        self.amplitude.history.as_ref()?.next_corner(&HistoryClock::default(), load)
    }

    /// True if its history knows where it bends.
    pub fn knows_corners(&self) -> bool {
        self.amplitude.history.as_ref().is_some_and(Reading::knows_corners)
    }

    /// What those share that follow the same history in the present stage; `None` for what follows none, or does not move by it.
    pub fn history_identity(&self) -> Option<(usize, u64)> {
        let history =
            self.amplitude.history.as_ref().filter(|_| self.follows_history() && self.amplitude.full != 0.0)?;
        Some(history.identity(&self.progress.clock))
    }

    /// The first time behind `time` at which its rate jumps.
    pub fn next_kink(&self, time: f64) -> Option<f64> {
        self.dynamic_history()?.next_kink(&self.progress.clock, time)
    }

    /// The sum of the jumps of its rate after the time `from` and up to `to`.
    pub fn jumped(&self, from: f64, to: f64) -> f64 {
        let jumps = |history: &Reading| history.jumped(&self.progress.clock, from, to);
        self.dynamic_history().map_or(0.0, |history| self.amplitude.full * jumps(history))
    }

    /// Its rate just before `time`.
    pub fn rate_before(&self, time: f64) -> f64 {
        let slope = |history: &Reading| history.slope_before(&self.progress.clock, time);
        self.dynamic_history().map_or(0.0, |history| self.amplitude.full * slope(history))
    }

    /// The history that it follows over the clock.
    fn dynamic_history(&self) -> Option<&'a Reading> {
        match self.progress.course {
            Course::History(StageKind::Dynamic) => self.amplitude.history.as_ref(),
            Course::History(StageKind::Static | StageKind::Modal | StageKind::Buckling)
            | Course::Off
            | Course::Hold(_)
            | Course::Ramp(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Table;
    use StageKind::{Dynamic, Static};
    use std::sync::Arc;

    fn begin(progress: &mut Progress, amplitude: &Amplitude, number: usize, kind: StageKind) {
        progress.begin_stage(amplitude, &StageStart { number, kind, time: 0.0, fresh: false });
    }

    fn value(progress: &Progress, amplitude: &Amplitude, load: f64) -> f64 {
        Timeline::new(amplitude, progress).at(0.0, load)[0]
    }

    /// The factor at the half of each stage, stage after stage.
    fn halves(amplitude: Amplitude, kinds: &[StageKind]) -> Vec<f64> {
        let mut progress = Progress::default();
        let half = |(number, &kind): (usize, &StageKind)| {
            begin(&mut progress, &amplitude, number, kind);
            let half = value(&progress, &amplitude, if kind == Static { 0.5 } else { 1.0 });
            progress.reached = value(&progress, &amplitude, 1.0);
            half
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
        let load = Amplitude::of_load(None, StageSet::default());
        let mut progress = Progress::default();
        begin(&mut progress, &load, 0, Static);
        progress.reached = value(&progress, &load, 0.4);
        begin(&mut progress, &load, 1, Static);
        assert_eq!([0.0, 1.0].map(|factor| value(&progress, &load, factor)), [0.4, 1.0]);
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
    fn a_history_that_is_over_comes_back_with_its_load() {
        let ramp = Arc::new(Table { times: vec![0.0, 1.0], values: vec![2.0, 4.0], smooth: false });
        let history = Reading::new(ramp.clone(), StageSet(Some(vec![0])));
        let load = |stages: &[usize]| Amplitude::of_load(Some(history.clone()), StageSet(Some(stages.to_vec())));
        assert_eq!(halves(load(&[0, 2, 3]), &[Static, Static, Static, Static]), [3.0, 2.0, 2.0, 4.0]);
        assert_eq!(halves(load(&[0, 2]), &[Static, Dynamic, Dynamic, Static]), [3.0, 0.0, 4.0, 2.0]);
        // A modal or buckling stage that it acts in leaves no value.
        for look in [StageKind::Modal, StageKind::Buckling] {
            assert_eq!(halves(load(&[0, 2, 3]), &[Static, Static, look, Static])[3], 2.0);
        }
        let motion = Amplitude::of_motion(0.5, Some(history.clone()), StageSet(Some(vec![0, 1])));
        let mut progress = Progress::default();
        begin(&mut progress, &motion, 0, Static);
        progress.reached = value(&progress, &motion, 1.0);
        begin(&mut progress, &motion, 1, Static);
        assert_eq!([0.0, 1.0].map(|factor| value(&progress, &motion, factor)), [2.0, 2.0]);
    }

    #[test]
    fn a_switch_is_never_ramped() {
        let second = Amplitude::of_switch(StageSet(Some(vec![1])));
        assert_eq!(halves(second, &[Static, Static, Static]), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn a_motion_stays_where_statics_has_put_it() {
        let motion = |stages: StageSet| Amplitude::of_motion(3.0, None, stages);
        assert_eq!(halves(motion(StageSet::default()), &[Static, Dynamic]), [1.5, 3.0]);
        let early = motion(StageSet::default());
        let mut progress = Progress::default();
        begin(&mut progress, &early, 0, Static);
        progress.reached = value(&progress, &early, 0.5);
        begin(&mut progress, &early, 1, Dynamic);
        assert_eq!(value(&progress, &early, 1.0), 1.5);
        let second = motion(StageSet(Some(vec![1])));
        begin(&mut progress, &second, 0, Static);
        assert!(!Timeline::new(&second, &progress).acts());
    }
}
