//! Functions of time (or of the load factor), with exact first and second derivatives.

use super::StageKind;

/// A function of one variable.
pub trait History: Send + Sync {
    /// Value, first and second derivative at `x`.
    fn at(&self, x: f64) -> [f64; 3];

    /// The first place behind `x` where it takes another course, if it knows of one.
    fn next_corner(&self, _x: f64) -> Option<f64> {
        None
    }

    /// The value in a stage, and its derivatives over time. In statics the load takes the place of the time, and nothing moves.
    fn in_stage(&self, kind: StageKind, time: f64, load: f64) -> [f64; 3] {
        if kind == StageKind::Static { [self.at(load)[0], 0.0, 0.0] } else { self.at(time) }
    }

    /// The first time behind `time` in a stage where it takes another course.
    fn next_corner_in_stage(&self, kind: StageKind, time: f64) -> Option<f64> {
        if kind == StageKind::Dynamic { self.next_corner(time) } else { None }
    }
}

/// A table: linear between its points and constant outside; or smooth, each interval by s^3 (10 - 15 s + 6 s^2), whose
/// first and second derivatives vanish at both ends.
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
        let (width, rise) = (self.times[k + 1] - self.times[k], self.values[k + 1] - self.values[k]);
        let s = (x - self.times[k]) / width;
        if !self.smooth {
            return [self.values[k] + rise * s, rise / width, 0.0];
        }
        let value = s * s * s * (10.0 - s * (15.0 - 6.0 * s));
        let slope = 30.0 * s * s * (1.0 - s) * (1.0 - s);
        let bend = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s);
        [self.values[k] + rise * value, rise * slope / width, rise * bend / (width * width)]
    }

    fn next_corner(&self, x: f64) -> Option<f64> {
        self.times.get(self.times.partition_point(|&t| t <= x)).copied()
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
            let (before, after) = (ramp.at(x - h), ramp.at(x + h));
            assert!((slope - (after[0] - before[0]) / (2.0 * h)).abs() < 1e-8);
            assert!((bend - (after[1] - before[1]) / (2.0 * h)).abs() < 1e-8);
        }
    }
}
