//! The largest value over a section with a closed form, between its samples: from the best samples by
//! parabolas through neighbours, with the exact stress there.

use super::Point;
use super::closed::{ClosedForm, ClosedShape};

/// Samples from which the largest value of a closed form is looked for, at most
const STARTS: usize = 4;

/// The largest value near samples, the best one first. Each is given by its number.
pub fn largest_near(
    form: ClosedForm,
    samples: impl Iterator<Item = usize>,
    value_at: &dyn Fn(Point) -> f64,
) -> Option<(f64, Point)> {
    let value = |at: [f64; 2]| value_at(form.point(at));
    let mut best: Option<(f64, Point)> = None;
    let mut starts: Vec<[usize; 2]> = Vec::new();
    for number in samples {
        let start = sample(form, number);
        let is_near = |other: &[usize; 2]| (0..2).all(|axis| other[axis].abs_diff(start[axis]) <= 2);
        if starts.iter().any(is_near) {
            continue;
        }
        let (found, at) = climb(form, start, &value);
        let found = cross_centre(form, (found, form.point(at)), value_at);
        if best.is_none_or(|best| found.0 > best.0) {
            best = Some(found);
        }
        starts.push(start);
        if starts.len() == STARTS {
            break;
        }
    }
    best
}

/// Numbers of a sample of a closed form along both coordinates.
fn sample(form: ClosedForm, number: usize) -> [usize; 2] {
    let rows = if form.is_closed(1) { form.samples()[1] } else { form.samples()[1] + 1 };
    [number / rows, number % rows]
}

/// Passes along both coordinates with steps of one length, at most.
const MOST_PASSES: usize = 8;

/// A pass that adds less than this part of the value is the last one with its steps.
const SMALL_GAIN: f64 = 1e-6;

/// From a sample of a closed form to the largest value near it: parabolas along both coordinates,
/// with shorter and shorter steps.
fn climb(form: ClosedForm, start: [usize; 2], value: &dyn Fn([f64; 2]) -> f64) -> (f64, [f64; 2]) {
    let domain = form.domain();
    let counts = form.samples();
    let steps = [0, 1].map(|axis| (domain[axis][1] - domain[axis][0]) / counts[axis] as f64);
    let mut at = [0, 1].map(|axis| domain[axis][0] + steps[axis] * start[axis] as f64);
    let mut best = value(at);
    for shorter in [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125] {
        for _ in 0..MOST_PASSES {
            let before_pass = best;
            for (axis, step) in steps.into_iter().enumerate() {
                climb_along(form, axis, shorter * step, value, &mut at, &mut best);
            }
            if best - before_pass <= SMALL_GAIN * best.abs() {
                break;
            }
        }
    }
    (best, at)
}

/// Smallest step across the centre of a circle, as a part of its radius.
const SMALLEST_STEP: f64 = 1e-3;

/// From a value and its point in a solid circle to the largest value near it, by steps in eight
/// directions: near the centre the angle of a point says little. Other shapes keep the point.
fn cross_centre(form: ClosedForm, start: (f64, Point), value: &dyn Fn(Point) -> f64) -> (f64, Point) {
    let ClosedShape::Ring { radii: [0.0, radius] } = form.shape() else { return start };
    let (mut best, mut at) = start;
    let mut step = radius / form.samples()[0] as f64;
    while step > SMALLEST_STEP * radius {
        let around = (0..8).map(|k| {
            let (sin, cos) = libm::sincos(f64::from(k) * std::f64::consts::FRAC_PI_4);
            [at[0] + step * cos, at[1] + step * sin]
        });
        let inside = around.filter(|to| libm::hypot(to[0], to[1]) <= radius);
        match inside.map(|to| (value(to), to)).max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((found, to)) if found > best => (best, at) = (found, to),
            Some(_) | None => step *= 0.5,
        }
    }
    (best, at)
}

/// From a point of a closed form, with its value, to a larger value along one coordinate: the top of
/// the parabola through it and both neighbours at a distance of `step`, or one of these.
fn climb_along(
    form: ClosedForm,
    axis: usize,
    step: f64,
    value: &dyn Fn([f64; 2]) -> f64,
    at: &mut [f64; 2],
    best: &mut f64,
) {
    let domain = form.domain();
    let start = *at;
    let moved = |by: f64| {
        let mut to = start;
        to[axis] += by;
        // A radius below zero is one on the other side of the centre.
        let [low, high] = if axis == 0 && domain[0][0] == 0.0 { [-domain[0][1], domain[0][1]] } else { domain[axis] };
        let is_inside = low <= to[axis] && to[axis] <= high;
        (is_inside || form.is_closed(axis)).then(|| (value(to), to))
    };
    let (Some(before), Some(behind)) = (moved(-step), moved(step)) else { return };
    let bend = before.0 - 2.0 * *best + behind.0;
    let turn = if bend < 0.0 { 0.5 * step * (before.0 - behind.0) / bend } else { 0.0 };
    let tops = [Some(before), Some(behind), moved(turn.clamp(-step, step))];
    for (found, to) in tops.into_iter().flatten() {
        if found > *best {
            (*best, *at) = (found, to);
        }
    }
}
