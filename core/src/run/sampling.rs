//! What fixed time steps see of a load's history: its values at their ends, between which they take it
//! for linear.

/// The share of a history's impulse from which what steps miss of it is told.
const TOLD: f64 = 0.05;

/// Corners this near to the end of a step, over its length, lie on it.
const ON_GRID: f64 = 1e-6;

/// The largest error of the impulse up to some time that steps of the length `step` make between the
/// times `from` and `to`, over the whole impulse; `None` if it is small. The impulse is that of the
/// change of `value` from `first`; corners are where `value` may bend, as `next_corner` tells them.
pub fn missed_part(
    value: impl Fn(f64) -> f64,
    next_corner: impl Fn(f64) -> Option<f64>,
    first: f64,
    [from, to]: [f64; 2],
    step: f64,
) -> Option<f64> {
    let change = |time: f64| value(time) - first;
    let corners = || {
        std::iter::successors(next_corner(from), |&corner| next_corner(corner)).take_while(move |&corner| corner < to)
    };
    let (mut whole, mut start) = (0.0, from);
    for end in corners().chain([to]) {
        whole += integral(change, start, end).abs();
        start = end;
    }
    let (mut error, mut largest) = (0.0_f64, 0.0_f64);
    let mut corners = corners().peekable();
    while let Some(corner) = corners.next() {
        let number = ((corner - from) / step).floor();
        let begin = from + number * step;
        let end = (begin + step).min(to);
        if (corner - begin).min(end - corner) < ON_GRID * step {
            continue;
        }
        let mut exact = integral(change, begin, corner);
        let mut start = corner;
        while let Some(next) = corners.next_if(|&next| next < end - ON_GRID * step) {
            exact += integral(change, start, next);
            start = next;
        }
        exact += integral(change, start, end);
        error += 0.5 * (change(begin) + change(end)) * (end - begin) - exact;
        largest = largest.max(error.abs());
    }
    (largest > TOLD * whole).then_some(largest / whole)
}

/// The integral of a polynomial of degree five or less (Gauss, three points).
fn integral(function: impl Fn(f64) -> f64, start: f64, end: f64) -> f64 {
    let (middle, half) = (0.5 * (start + end), 0.5 * (end - start));
    let outer = 0.6_f64.sqrt() * half;
    (5.0 * (function(middle - outer) + function(middle + outer)) + 8.0 * function(middle)) * half / 9.0
}

#[cfg(test)]
mod tests {
    use super::missed_part;
    use crate::model::{History, Table};

    fn missed(times: &[f64], values: &[f64], smooth: bool, step: f64) -> Option<f64> {
        let table = Table { times: times.to_vec(), values: values.to_vec(), smooth };
        missed_part(|time| table.at(time)[0], |time| table.next_corner(time), table.at(0.0)[0], [0.0, 1.0], step)
    }

    #[test]
    fn a_pulse_within_a_step_is_missed_as_a_whole() {
        for smooth in [false, true] {
            let part = missed(&[0.51, 0.52, 0.53], &[2.0, 3.0, 2.0], smooth, 0.05).unwrap();
            assert!((part - 1.0).abs() < 1e-12, "{part}");
        }
        // Its middle is the end of a step: the sum of its values there is 3 for the impulse 1.5.
        let part = missed(&[0.47, 0.5, 0.53], &[0.0, 50.0, 0.0], false, 0.05).unwrap();
        assert!((part - 2.0 / 3.0).abs() < 1e-12, "{part}");
    }

    #[test]
    fn steps_over_a_smooth_motion_miss_its_way() {
        let missed = |times: &[f64], values: &[f64], smooth: bool, step: f64| {
            let table = Table { times: times.to_vec(), values: values.to_vec(), smooth };
            missed_part(|time| table.at(time)[1], |time| table.next_corner(time), 0.0, [0.0, 1.0], step)
        };
        assert_eq!(missed(&[0.5, 0.51], &[0.0, 1.0], true, 0.01), Some(1.0));
        assert!(missed(&[0.5, 0.52], &[0.0, 1.0], true, 0.01).is_some());
        assert_eq!(missed(&[0.5, 0.54], &[0.0, 1.0], true, 0.01), None);
        // A constant speed in decimals.
        let times = [0.0, 0.063, 0.118, 0.569, 0.761, 0.802, 1.0];
        assert_eq!(missed(&times, &times.map(|time| 0.7 * time), false, 0.02), None);
    }

    #[test]
    fn steps_that_end_at_corners_miss_nothing() {
        assert_eq!(missed(&[0.5, 0.55, 0.6], &[0.0, 1.0, 0.0], false, 0.05), None);
        assert_eq!(missed(&[0.0, 1.0], &[0.0, 1.0], true, 0.3), None);
        // A sudden load: half a step of its impulse.
        assert_eq!(missed(&[0.5, 0.501], &[0.0, 1.0], false, 0.01), None);
        // A sampled curve between steps.
        let times: Vec<f64> = (0..=1000).map(|k| f64::from(k) / 1000.0).collect();
        let values: Vec<f64> = times.iter().map(|time| (6.0 * time).sin()).collect();
        assert_eq!(missed(&times, &values, false, 0.0123), None);
    }
}
