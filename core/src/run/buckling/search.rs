//! A critical load closed in between points of the path.

use super::walk::Walked;
use crate::system::State;

/// A critical load is known when it lies between two points of the path this near to each other,
/// relative to itself.
const CLOSED: f64 = 1e-7;
/// Where load control ends, the tangent must see a critical load this near.
const SEEN: f64 = 1e-3;

/// An estimate of a critical load from the tangent at another load.
#[derive(Clone, Copy)]
pub struct Sight {
    pub(super) from: f64,
    pub(super) critical: f64,
}

impl Sight {
    /// How fast it moves with the load from which it is seen.
    pub fn drift_since(&self, last: &Self) -> f64 {
        ((self.critical - last.critical) / (self.from - last.from)).abs()
    }
}

/// A critical load between a state that lies before it and a load that lies beyond.
pub struct CriticalSearch {
    pub(super) here: State,
    beyond: Option<f64>,
    /// The state at the load that lies beyond, where load control comes to it
    pub(super) behind: Option<State>,
    /// The estimate from here
    pub(super) estimate: f64,
    /// How much farther than the estimate the next look goes: it may fall short again and again
    stretch: f64,
    pub(super) way: f64,
    /// The estimate from the last point before it
    seen: f64,
    /// How load control went where what lies beyond is known only from that it did not get there,
    /// or not on this branch
    pub(super) ended: Option<Walked>,
}

impl CriticalSearch {
    /// From a state on, in the direction of an estimate.
    pub fn new(here: State, estimate: f64) -> Self {
        let way = (estimate - here.load).signum();
        Self { here, beyond: None, behind: None, estimate, stretch: 1.0, way, seen: estimate, ended: None }
    }

    /// A load beyond the critical one, which load control comes to, and the state there.
    pub fn close_at(&mut self, load: f64, behind: State) {
        self.beyond = Some(load);
        self.behind = Some(behind);
        self.ended = None;
        self.stretch = 1.0;
    }

    /// The critical load, where the points around it lie together.
    pub fn found(&self) -> Option<f64> {
        let (from, beyond) = (self.here.load, self.beyond?);
        let between = (self.estimate - from) * self.way > 0.0 && (beyond - self.estimate) * self.way > 0.0;
        let closed = (beyond - from).abs() <= CLOSED * beyond.abs();
        closed.then_some(if between { self.estimate } else { 0.5 * (from + beyond) })
    }

    /// The part of the search that lies behind: digits that both points around the load share.
    pub fn come(&self) -> f64 {
        let beyond = self.beyond.filter(|&beyond| beyond != 0.0);
        let apart = beyond.map_or(1.0, |beyond| (beyond - self.here.load).abs() / beyond.abs());
        (apart.ln() / CLOSED.ln()).clamp(0.0, 1.0)
    }

    /// The path by load control ends before this load.
    pub fn end_at(&mut self, load: f64, walked: Walked) {
        self.beyond = Some(load);
        self.behind = None;
        self.ended = Some(walked);
        self.stretch = 1.0;
        self.estimate = 0.5 * (self.here.load + load);
    }

    /// True if load control ends there for want of stiffness: a limit point looks twice as far away
    /// as it is.
    pub fn is_a_limit(&self, found: f64) -> bool {
        match self.ended {
            None => true,
            Some(Walked::TooCoarse) => false,
            Some(_) => (self.seen - found).abs() <= SEEN * found.abs(),
        }
    }

    /// Where to look next: a little beyond the estimate, so that it is closed in from there; in the
    /// middle where the estimate does not lie between.
    pub fn target(&self) -> f64 {
        let from = self.here.load;
        let ahead = self.estimate + self.way * 0.5 * CLOSED * self.estimate.abs();
        let target = from + self.stretch * (ahead - from);
        match self.beyond {
            Some(beyond) if (target - beyond) * self.way >= 0.0 => {
                let before = self.estimate - self.way * 0.4 * CLOSED * self.estimate.abs();
                let inside = (before - from) * self.way > 0.0 && (beyond - before) * self.way > 0.0;
                if inside { before } else { 0.5 * (from + beyond) }
            }
            // Looks a little beyond the middle would not bring both nearer than that.
            Some(beyond) if (beyond - from).abs() <= 2.0 * CLOSED * beyond.abs() => 0.5 * (from + beyond),
            Some(_) | None => target,
        }
    }

    /// The path goes on past what was taken for its end, to this point, with what a critical load
    /// looks like from there.
    pub fn go_on_from(&mut self, state: &State, next: Option<f64>) {
        (self.beyond, self.behind, self.ended) = (None, None, None);
        self.stretch = 1.0;
        self.advance(state, next);
    }

    /// A point that lies before the critical load, with what that looks like from there.
    pub fn advance(&mut self, state: &State, next: Option<f64>) {
        let shorter =
            self.beyond.is_none_or(|beyond| (beyond - state.load).abs() < 0.5 * (beyond - self.here.load).abs());
        self.here = state.clone();
        self.seen = next.unwrap_or(self.seen);
        self.stretch *= 2.0;
        self.estimate = match (next, self.beyond) {
            (Some(next), None) => next,
            (Some(next), Some(beyond)) if shorter && (beyond - next) * self.way > 0.0 => next,
            (_, Some(beyond)) => 0.5 * (state.load + beyond),
            (None, None) => state.load + 2.0 * (self.estimate - state.load).abs().max(CLOSED) * self.way,
        };
    }
}
