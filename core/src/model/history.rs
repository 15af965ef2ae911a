//! Functions of time (or of the load factor), with exact first and second derivatives.

use super::{StageKind, StageSet};
use std::sync::Arc;

/// A function of one variable.
pub trait History: Send + Sync {
    /// Value, first and second derivative at `x`; where the first jumps, those behind `x`.
    fn at(&self, x: f64) -> [f64; 3];

    /// The first derivative just before `x`.
    fn slope_before(&self, x: f64) -> f64 {
        self.at(x)[1]
    }

    /// The first place behind `x` where it takes another course, if it knows of one.
    fn next_corner(&self, _x: f64) -> Option<f64> {
        None
    }

    /// The first place behind `x` where its first derivative jumps noticeably, if it knows of one.
    fn next_kink(&self, _x: f64) -> Option<f64> {
        None
    }

    /// The largest first derivative, if it is known.
    fn fastest(&self) -> Option<f64> {
        None
    }
}

/// A history as a load or a motion reads it: in all stages, or in those that it belongs to.
///
/// Static stages read it over the load factor, dynamic ones over the clock. A history that belongs
/// to stages reads the time that has passed in its dynamic stages instead, so that it begins where
/// the first of them does.
#[derive(Clone)]
pub struct Reading {
    function: Arc<dyn History>,
    stages: StageSet,
}

/// The clock of a history that belongs to stages.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HistoryClock {
    /// The time spent in earlier stages of the history
    passed: f64,
    /// The run's clock at the history's time 0, while it goes on in a dynamic stage of its own
    origin: Option<f64>,
}

impl HistoryClock {
    /// The time 0 of the history on the run's clock: that of the run for a history of all stages.
    fn origin(&self) -> f64 {
        self.origin.unwrap_or(0.0)
    }
}

/// Where a stage lies as seen from a history.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The history has not begun.
    Before,
    /// It goes on.
    In,
    /// It stands where an earlier stage has left it.
    Behind,
}

impl Reading {
    /// In these stages.
    pub fn new(function: Arc<dyn History>, stages: StageSet) -> Self {
        Self { function, stages }
    }

    /// Whether it belongs to some stages only.
    pub fn has_own_stages(&self) -> bool {
        self.stages.0.is_some()
    }

    /// Where stage number `stage` (from 0) lies.
    pub fn phase(&self, stage: usize) -> Phase {
        let has_begun = self.stages.0.iter().flatten().any(|&own| own < stage);
        match self.stages.contains(stage) {
            true => Phase::In,
            false if has_begun => Phase::Behind,
            false => Phase::Before,
        }
    }

    /// The value that holds before it begins.
    pub fn first(&self) -> f64 {
        self.function.at(0.0)[0]
    }

    /// Sets a clock for stage number `stage`, which begins at `time`.
    pub fn begin_stage(&self, clock: &mut HistoryClock, stage: usize, kind: StageKind, time: f64) {
        if self.stages.0.is_none() {
            return;
        }
        if let Some(origin) = clock.origin.take() {
            clock.passed = time - origin;
        }
        if kind == StageKind::Dynamic && self.stages.contains(stage) {
            clock.origin = Some(time - clock.passed);
        }
    }

    /// The value in a stage, and its derivatives over time. In statics the load takes the place of
    /// the time, and nothing moves.
    pub fn at(&self, clock: &HistoryClock, kind: StageKind, time: f64, load: f64) -> [f64; 3] {
        match kind {
            StageKind::Static => [self.function.at(load)[0], 0.0, 0.0],
            StageKind::Dynamic | StageKind::Modal | StageKind::Buckling => self.function.at(time - clock.origin()),
        }
    }

    /// The first derivative over time just before `time` in a dynamic stage.
    pub fn slope_before(&self, clock: &HistoryClock, time: f64) -> f64 {
        self.function.slope_before(time - clock.origin())
    }

    /// The first time behind `time` in a dynamic stage where it takes another course.
    pub fn next_corner(&self, clock: &HistoryClock, time: f64) -> Option<f64> {
        next_on_clock(clock, time, |x| self.function.next_corner(x))
    }

    /// The first time behind `time` in a dynamic stage where its first derivative jumps.
    pub fn next_kink(&self, clock: &HistoryClock, time: f64) -> Option<f64> {
        next_on_clock(clock, time, |x| self.function.next_kink(x))
    }

    /// The largest first derivative, if it is known.
    pub fn fastest(&self) -> Option<f64> {
        self.function.fastest()
    }
}

/// The first time behind `time` on the run's clock that `next` finds on the clock of a history.
fn next_on_clock(clock: &HistoryClock, time: f64, next: impl Fn(f64) -> Option<f64>) -> Option<f64> {
    let origin = clock.origin();
    let mut x = next(time - origin)?;
    // On the run's clock the place is rounded: it may be where the clock stands.
    while x + origin <= time {
        x = next(x)?;
    }
    Some(x + origin)
}

/// A table: linear between its points and constant outside; or smooth, each interval by s^3 (10 -
/// 15 s + 6 s^2), whose first and second derivatives vanish at both ends.
#[derive(Clone, Debug)]
pub struct Table {
    /// Increasing abscissas
    pub times: Vec<f64>,
    /// The values there
    pub values: Vec<f64>,
    /// Whether intervals are smooth
    pub smooth: bool,
}

impl History for Table {
    fn at(&self, x: f64) -> [f64; 3] {
        let last = self.times.len() - 1;
        if x < self.times[0] {
            return [self.values[0], 0.0, 0.0];
        }
        if x >= self.times[last] {
            return [self.values[last], 0.0, 0.0];
        }
        let k = self.times.partition_point(|&t| t <= x) - 1;
        let width = self.times[k + 1] - self.times[k];
        let rise = self.values[k + 1] - self.values[k];
        let s = (x - self.times[k]) / width;
        if !self.smooth {
            return [self.values[k] + rise * s, rise / width, 0.0];
        }
        let value = s * s * s * (10.0 - s * (15.0 - 6.0 * s));
        let slope = 30.0 * s * s * (1.0 - s) * (1.0 - s);
        let bend = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s);
        [self.values[k] + rise * value, rise * slope / width, rise * bend / (width * width)]
    }

    fn slope_before(&self, x: f64) -> f64 {
        let behind = self.times.partition_point(|&t| t < x);
        if self.smooth || behind == 0 || behind == self.times.len() {
            return self.at(x)[1];
        }
        self.slope(behind - 1)
    }

    fn next_corner(&self, x: f64) -> Option<f64> {
        self.times.get(self.times.partition_point(|&t| t <= x)).copied()
    }

    fn next_kink(&self, x: f64) -> Option<f64> {
        if self.smooth {
            return None;
        }
        let next = self.times.partition_point(|&t| t <= x);
        let noticed = NOTICED * self.fastest()?;
        let is_kink = |&k: &usize| {
            let before = if k == 0 { 0.0 } else { self.slope(k - 1) };
            let behind = if k + 1 == self.times.len() { 0.0 } else { self.slope(k) };
            (behind - before).abs() > noticed
        };
        (next..self.times.len()).find(is_kink).map(|k| self.times[k])
    }

    fn fastest(&self) -> Option<f64> {
        (0..self.times.len() - 1).map(|k| self.slope(k).abs()).reduce(f64::max)
    }
}

/// A velocity that jumps by less than this part of the largest one is that of a smooth motion as a
/// table samples it.
pub const NOTICED: f64 = 0.05;

impl Table {
    /// The slope of an interval of a table that is not smooth.
    fn slope(&self, k: usize) -> f64 {
        (self.values[k + 1] - self.values[k]) / (self.times[k + 1] - self.times[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_table_is_constant_outside() {
        let hat = Table { times: vec![0.0, 1.0, 2.0], values: vec![0.0, 4.0, 0.0], smooth: false };
        assert_eq!(hat.at(-1.0), [0.0, 0.0, 0.0]);
        assert_eq!(hat.at(0.25), [1.0, 4.0, 0.0]);
        assert_eq!(hat.at(1.5), [2.0, -4.0, 0.0]);
        assert_eq!(hat.at(9.0), [0.0, 0.0, 0.0]);
    }

    #[test]
    fn derivatives_of_a_smooth_table_agree_with_differences() {
        let ramp = Table { times: vec![0.5, 2.0], values: vec![1.0, 3.0], smooth: true };
        let h = 1e-5;
        for x in [0.6, 1.0, 1.7] {
            let [_, slope, bend] = ramp.at(x);
            let before = ramp.at(x - h);
            let after = ramp.at(x + h);
            assert!((slope - (after[0] - before[0]) / (2.0 * h)).abs() < 1e-8);
            assert!((bend - (after[1] - before[1]) / (2.0 * h)).abs() < 1e-8);
        }
    }

    #[test]
    fn kinks_are_where_slopes_jump() {
        let table = |smooth| Table { times: vec![0.0, 1.0, 2.0, 3.0], values: vec![0.0, 2.0, 4.0, 4.0], smooth };
        let kinks = |table: &Table| {
            let mut all: Vec<f64> = table.next_kink(-1.0).into_iter().collect();
            while let Some(next) = all.last().and_then(|&x| table.next_kink(x)) {
                all.push(next);
            }
            all
        };
        assert_eq!(kinks(&table(false)), [0.0, 2.0]);
        assert!(kinks(&table(true)).is_empty());
        // A sampled curve has none that anybody would notice.
        let times: Vec<f64> = (0..=200).map(|k| f64::from(k) / 200.0).collect();
        let values = times.iter().map(|t| t * t * t * (10.0 - t * (15.0 - 6.0 * t))).collect();
        assert!(kinks(&Table { times, values, smooth: false }).is_empty());
        let slopes = [0.0, 0.5, 2.0, 2.5, 3.0, 4.0].map(|x| table(false).slope_before(x));
        assert_eq!(slopes, [2.0, 2.0, 2.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn a_history_that_belongs_to_stages_counts_their_time() {
        use StageKind::{Dynamic, Static};
        let ramp = Arc::new(Table { times: vec![0.0, 10.0], values: vec![1.0, 11.0], smooth: false });
        let mut clock = HistoryClock::default();
        let reading = Reading::new(ramp, StageSet(Some(vec![1, 3])));
        let phases = [0, 1, 2, 3, 4].map(|stage| reading.phase(stage));
        assert_eq!(phases, [Phase::Before, Phase::In, Phase::Behind, Phase::In, Phase::Behind]);
        assert_eq!(reading.first(), 1.0);
        reading.begin_stage(&mut clock, 0, Dynamic, 0.0);
        reading.begin_stage(&mut clock, 1, Dynamic, 5.0);
        assert_eq!(reading.at(&clock, Dynamic, 7.0, 1.0)[0], 3.0);
        reading.begin_stage(&mut clock, 2, Dynamic, 8.0);
        reading.begin_stage(&mut clock, 3, Dynamic, 20.0);
        assert_eq!([20.0, 21.0].map(|time| reading.at(&clock, Dynamic, time, 1.0)[0]), [4.0, 5.0]);
        assert_eq!(reading.next_corner(&clock, 20.0), Some(27.0));
        reading.begin_stage(&mut clock, 3, Static, 20.0);
        assert_eq!(reading.at(&clock, Static, 20.0, 0.5)[0], 1.5);
    }
}
