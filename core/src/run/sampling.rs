//! What fixed time steps and load levels see of a load's history: its values at their ends, between which steps take it
//! for linear.

/// The share of a history's impulse from which what steps miss of it is told.
const TOLD: f64 = 0.05;

/// Corners this near to the end of a step, over its length, lie on it.
const ON_GRID: f64 = 1e-6;

/// The smallest number of samples of a history whose corners are not known.
const SAMPLES: f64 = 2048.0;

/// Steps up to which such a history is sampled between them.
const MOST_SAMPLED_STEPS: f64 = 2048.0;

/// What [`missed_part`] finds, for a `value` whose corners are not known: it is sampled at equal distances in each step. `None`
/// also for very many steps.
pub fn missed_part_of_samples(value: impl Fn(f64) -> f64, first: f64, [from, to]: [f64; 2], step: f64) -> Option<f64> {
    let change = |time: f64| value(time) - first;
    let steps = ((to - from) / step - ON_GRID).ceil();
    if !(1.0..=MOST_SAMPLED_STEPS).contains(&steps) {
        return None;
    }
    let pairs = (0.5 * SAMPLES / steps).ceil();
    let (mut whole, mut error, mut largest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for number in 0..steps as usize {
        let begin = from + number as f64 * step;
        let width = ((begin + step).min(to) - begin) / pairs;
        let at_begin = change(begin);
        let (mut exact, mut before) = (0.0, at_begin);
        for pair in 0..pairs as usize {
            let start = begin + pair as f64 * width;
            let after = change(start + width);
            let part = (before + 4.0 * change(start + 0.5 * width) + after) * width / 6.0;
            exact += part;
            whole += part.abs();
            before = after;
        }
        error += 0.5 * (at_begin + before) * pairs * width - exact;
        largest = largest.max(error.abs());
    }
    (largest > TOLD * whole).then_some(largest / whole)
}

/// How far a history goes beyond its values at both ends of one of `levels` equal load levels at these load factors, over
/// the range of its values; `None` if that is little.
pub fn missed_peak(value: impl Fn(f64) -> f64, places: &[f64], levels: usize) -> Option<f64> {
    let count = levels as f64;
    let ends = [0.0, 1.0].map(&value);
    let (mut least, mut largest, mut beyond) = (ends[0].min(ends[1]), ends[0].max(ends[1]), 0.0_f64);
    for &place in places {
        let here = value(place);
        let level = (place * count).floor();
        let [before, after] = [level / count, (level + 1.0) / count].map(&value);
        least = least.min(here);
        largest = largest.max(here);
        beyond = beyond.max(here - before.max(after)).max(before.min(after) - here);
    }
    (beyond > TOLD * (largest - least)).then(|| beyond / (largest - least))
}

/// Load factors inside a static stage at equal distances.
pub fn sampled_load_factors() -> Vec<f64> {
    (1..SAMPLES as usize).map(|k| k as f64 / SAMPLES).collect()
}

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
    use super::{missed_part, missed_part_of_samples, missed_peak, sampled_load_factors};
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
    fn a_formula_is_sampled_between_steps() {
        let pulse = |time: f64| time + 50.0 * libm::exp(-((time - 0.5037) / 0.0004_f64).powi(2));
        let part = missed_part_of_samples(pulse, 0.0, [0.0, 1.0], 0.02).expect("the steps miss a pulse");
        // The pulse has 0.035 of the impulse 0.535; samples lie further apart than its width.
        assert!((part - 0.0354 / 0.5354).abs() < 0.02, "{part}");
        let wave = |time: f64| libm::sin(6.0 * time);
        for step in [0.02, 0.3, 1e-4] {
            assert_eq!(missed_part_of_samples(|time| 2.0 * time, 0.0, [0.0, 1.0], step), None);
            assert_eq!(missed_part_of_samples(wave, 0.0, [0.0, 1.0], 0.1 * step), None);
        }
        assert_eq!(missed_part_of_samples(pulse, 0.0, [0.0, 1.0], 1e-4), None);
    }

    #[test]
    fn levels_miss_a_peak_between_them() {
        let missed = |times: &[f64], values: &[f64], levels: usize| {
            let table = Table { times: times.to_vec(), values: values.to_vec(), smooth: false };
            missed_peak(|load| table.at(load)[0], times, levels)
        };
        let (times, values) = ([0.0, 0.25, 0.5, 1.0], [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(missed(&times, &values, 2), Some(1.0));
        assert_eq!(missed(&times, &values, 4), None);
        assert_eq!(missed(&[0.0, 0.25, 1.0], &[0.0, 0.8, 1.0], 2), None);
        let wave = |load: f64| libm::sin(8.0 * std::f64::consts::PI * load);
        let places = sampled_load_factors();
        assert_eq!(missed_peak(wave, &places, 4).map(|part| (part * 1e3).round()), Some(500.0));
        assert_eq!(missed_peak(wave, &places, 64), None);
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
