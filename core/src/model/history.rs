//! Functions of time (or of the load factor), with exact first and second derivatives.

use super::{StageKind, StageSet};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A function of one variable.
pub trait History: Send + Sync {
    /// Value, first and second derivative at `x`; where the first derivative jumps, the derivatives
    /// after `x`.
    fn at(&self, x: f64) -> [f64; 3];

    /// The first derivative just before `x`.
    fn slope_before(&self, x: f64) -> f64 {
        self.at(x)[1]
    }

    /// True if the function knows where it bends. Others are sampled.
    fn knows_corners(&self) -> bool {
        false
    }

    /// The first abscissa after `x` where the function is not smooth, changes its formula, or bends most between such
    /// places; `None` if there is none.
    fn next_corner(&self, _x: f64) -> Option<f64> {
        None
    }

    /// The first abscissa after `x` where the first derivative jumps noticeably; `None` if there is
    /// none.
    fn next_kink(&self, _x: f64) -> Option<f64> {
        None
    }

    /// The sum of the jumps of the first derivative after `from` and up to `to`.
    fn jumped(&self, _from: f64, _to: f64) -> f64 {
        0.0
    }

    /// The largest magnitude of the first derivative, if it is known.
    fn fastest(&self) -> Option<f64> {
        None
    }
}

/// A history read by a load or a motion: in all stages, or in chosen ones.
///
/// Static stages read it over the load factor, dynamic ones over the time of the run. A history of
/// chosen stages is read over the time spent in its dynamic stages instead, so that it begins with
/// the first of them.
#[derive(Clone)]
pub struct Reading {
    function: Arc<dyn History>,
    stages: StageSet,
}

/// The clock of a history of chosen stages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct HistoryClock {
    /// The time spent in earlier stages of the history
    passed: f64,
    /// The time of the run at the history's time 0, during one of its dynamic stages
    origin: Option<f64>,
}

impl HistoryClock {
    /// The time of the run at the history's time 0; zero for a history of all stages.
    fn origin(&self) -> f64 {
        self.origin.unwrap_or(0.0)
    }
}

/// The position of a stage relative to the stages of a history.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The history has not begun.
    Before,
    /// The stage belongs to the history.
    In,
    /// An earlier stage belongs to the history, which keeps its last value.
    Behind,
}

impl Reading {
    /// A reading of `function` in `stages`.
    pub fn new(function: Arc<dyn History>, stages: StageSet) -> Self {
        Self { function, stages }
    }

    /// True if the history belongs to chosen stages only.
    pub fn has_own_stages(&self) -> bool {
        self.stages.0.is_some()
    }

    /// The phase of stage number `stage`, from 0.
    pub fn phase(&self, stage: usize) -> Phase {
        let has_begun = self.stages.0.iter().flatten().any(|&own| own < stage);
        match self.stages.contains(stage) {
            true => Phase::In,
            false if has_begun => Phase::Behind,
            false => Phase::Before,
        }
    }

    /// The value before the history begins.
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

    /// The value in a stage, and its derivatives over time. In statics the load factor takes the
    /// place of the time, and derivatives over time are zero.
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

    /// The first time after `time` in a dynamic stage at which the function is not smooth or
    /// changes its formula.
    pub fn next_corner(&self, clock: &HistoryClock, time: f64) -> Option<f64> {
        next_on_clock(clock, time, |x| self.function.next_corner(x))
    }

    /// True if the function knows where it bends.
    pub fn knows_corners(&self) -> bool {
        self.function.knows_corners()
    }

    /// What readings share that have the same values in a stage: the place of the function in memory, and the bits of the time
    /// at which it begins.
    pub fn identity(&self, clock: &HistoryClock) -> (usize, u64) {
        (Arc::as_ptr(&self.function).cast::<()>() as usize, clock.origin().to_bits())
    }

    /// The first time after `time` in a dynamic stage at which the first derivative jumps
    /// noticeably.
    pub fn next_kink(&self, clock: &HistoryClock, time: f64) -> Option<f64> {
        next_on_clock(clock, time, |x| self.function.next_kink(x))
    }

    /// The sum of the jumps of the first derivative after the time `from` and up to `to`.
    pub fn jumped(&self, clock: &HistoryClock, from: f64, to: f64) -> f64 {
        self.function.jumped(from - clock.origin(), to - clock.origin())
    }

    /// The largest magnitude of the first derivative, if it is known.
    pub fn fastest(&self) -> Option<f64> {
        self.function.fastest()
    }
}

/// The first time after `time`, both on the clock of the run, that `next` finds on the clock of a
/// history.
fn next_on_clock(clock: &HistoryClock, time: f64, next: impl Fn(f64) -> Option<f64>) -> Option<f64> {
    let origin = clock.origin();
    let mut x = next(time - origin)?;
    // Rounding on the clock of the run may give `time` itself.
    while x + origin <= time {
        x = next(x)?;
    }
    Some(x + origin)
}

/// A function by a table, constant outside of its points. Between them it is linear, or smooth with
/// s^3 (10 - 15 s + 6 s^2) over each interval, whose first and second derivatives vanish at both
/// ends.
#[derive(Clone, Debug)]
pub struct Table {
    /// Increasing abscissas
    pub times: Vec<f64>,
    /// The values at the abscissas
    pub values: Vec<f64>,
    /// True if intervals are smooth, false if they are linear
    pub smooth: bool,
}

impl History for Table {
    fn knows_corners(&self) -> bool {
        true
    }

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
        let next = self.times.partition_point(|&t| t <= x);
        let end = *self.times.get(next)?;
        if !self.smooth || next == 0 || self.values[next] == self.values[next - 1] {
            return Some(end);
        }
        let start = self.times[next - 1];
        let bends = BENDS.map(|part| start + part * (end - start));
        Some(bends.into_iter().find(|&bend| bend > x).unwrap_or(end))
    }

    fn jumped(&self, from: f64, to: f64) -> f64 {
        if self.smooth { 0.0 } else { self.at(to)[1] - self.at(from)[1] }
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

/// Where in its interval a smooth step has 97 % of its largest acceleration. At the ends and in the middle of the interval
/// the acceleration is zero, so that a time step over all of it would see none.
const BENDS: [f64; 2] = [0.25, 0.75];

/// The smallest noticeable jump of a velocity, over the largest velocity: smaller ones are those of
/// a smooth motion sampled in a table.
pub const NOTICED: f64 = 0.05;

impl Table {
    /// The slope of interval `k` of a linear table.
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
    fn a_smooth_table_tells_where_it_bends() {
        let table = Table { times: vec![1.0, 2.0, 3.0], values: vec![0.0, 4.0, 4.0], smooth: true };
        let corners: Vec<f64> =
            std::iter::successors(table.next_corner(0.0), |&corner| table.next_corner(corner)).collect();
        assert_eq!(corners, [1.0, 1.25, 1.75, 2.0, 3.0]);
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
        // A sampled smooth curve has no noticeable kinks.
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
