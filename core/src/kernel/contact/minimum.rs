//! Local minima of a function of one variable s in [0, 1], from its first two derivatives: closest
//! points along an element or along a piece of a centre line.

/// First and second derivative of a function.
#[derive(Clone, Copy, Debug)]
pub struct Slopes {
    /// The first derivative
    pub(crate) first: f64,
    /// The second derivative
    pub(super) second: f64,
}

/// Brackets between neighbouring numbers below 1 are no wider.
const RESOLUTION: f64 = f64::EPSILON;

/// The largest step of Newton's method that is the last one: the error behind it is about the square.
const LAST_STEP: f64 = 1e-9;

/// Halvings that take any bracket to round-off.
const MAX_ITERATIONS: usize = 80;

/// Shows the local minima between 0 and 1, not the ends: each interval of `intervals` equal ones
/// with a slope that changes from negative to positive has one. Intervals where the function has no
/// slope (`None`) are passed over.
pub fn interior_minima(intervals: usize, slopes: &dyn Fn(f64) -> Option<Slopes>, show: &mut dyn FnMut(f64)) {
    let mut low = (0.0, slopes(0.0));
    for k in 1..=intervals {
        let s = k as f64 / intervals as f64;
        let high = (s, slopes(s));
        if let (Some(before), Some(after)) = (low.1, high.1) {
            let rises = after.first > 0.0 || (after.first == 0.0 && k < intervals);
            if before.first < 0.0 && rises {
                // Where a straight line between the slopes is zero: of a chord on a round surface, nearly.
                let part = before.first / (before.first - after.first);
                show(minimum_between(low.0, high.0, low.0 + (high.0 - low.0) * part, slopes));
            }
        }
        low = high;
    }
}

/// The zero of the slope between `low`, where it is negative, and `high`, where it is not, from a `guess`: Newton's
/// method within a bracket, halved where a step would leave it. A point without a slope on the way,
/// as on the axis of a surface, is the minimum: the function has a kink there.
fn minimum_between(low: f64, high: f64, guess: f64, slopes: &dyn Fn(f64) -> Option<Slopes>) -> f64 {
    let mut low = low;
    let mut high = high;
    let mut s = guess;
    for _ in 0..MAX_ITERATIONS {
        let Some(here) = slopes(s) else { return s };
        if here.first == 0.0 {
            return s;
        }
        if here.first < 0.0 {
            low = s;
        } else {
            high = s;
        }
        let newton = s - here.first / here.second;
        let is_inside = newton >= low && newton <= high;
        let next = if is_inside { newton } else { 0.5 * (low + high) };
        if (is_inside && (next - s).abs() <= LAST_STEP) || high - low <= RESOLUTION {
            return next;
        }
        s = next;
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_minima_of_a_wave_are_found() {
        let mut found = vec![];
        // -cos(12 s + 2) has minima where 12 s + 2 = 2 pi k
        let slopes = |s: f64| {
            let angle = 12.0 * s + 2.0;
            Some(Slopes { first: 12.0 * libm::sin(angle), second: 144.0 * libm::cos(angle) })
        };
        interior_minima(6, &slopes, &mut |s| found.push(s));
        assert_eq!(found.len(), 2);
        for (k, s) in found.iter().enumerate() {
            let exact = (2.0 * std::f64::consts::PI * (k + 1) as f64 - 2.0) / 12.0;
            assert!((s - exact).abs() < 4e-16, "{s} {exact}");
        }
    }

    #[test]
    fn ends_are_no_interior_minima() {
        let mut count = 0;
        for shift in [0.0, -0.3, 1.0, 1.2] {
            let slopes = |s: f64| Some(Slopes { first: s - shift, second: 1.0 });
            interior_minima(2, &slopes, &mut |_| count += 1);
        }
        let nowhere = |_: f64| None;
        interior_minima(2, &nowhere, &mut |_| count += 1);
        assert_eq!(count, 0);
    }

    #[test]
    fn a_minimum_at_the_border_of_two_intervals_is_found_once() {
        let mut found = vec![];
        let slopes = |s: f64| Some(Slopes { first: s - 0.5, second: 1.0 });
        interior_minima(2, &slopes, &mut |s| found.push(s));
        assert_eq!(found, [0.5]);
    }
}
