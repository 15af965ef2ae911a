//! The instants of fixed steps.

/// Steps of one length, the last perhaps shorter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    start: f64,
    end: f64,
    step: f64,
    pub(super) steps: u64,
}

impl Grid {
    /// Steps of length `step`, the last shortened to hit `end`.
    pub fn over(start: f64, end: f64, step: f64) -> Self {
        let steps = ((end - start) / step - 1e-9).ceil().max(1.0);
        Self { start, end, step, steps: steps as u64 }
    }

    /// Equal steps not longer than `step`.
    pub fn equal(start: f64, end: f64, step: f64) -> Self {
        let steps = ((end - start) / step - 1e-9).ceil().max(1.0);
        Self { start, end, step: (end - start) / steps, steps: steps as u64 }
    }

    /// The end and the length of step `number`, from 1. Times are multiples, not sums, so that they
    /// do not drift; steps that are equal but for the round-off of times have one length to the
    /// last bit.
    pub fn step(&self, number: u64) -> (f64, f64) {
        if number < self.steps {
            return (self.start + number as f64 * self.step, self.step);
        }
        let h = self.end - (self.start + (number - 1) as f64 * self.step);
        let full = (h - self.step).abs() <= 1e-9 * self.step;
        (self.end, if full { self.step } else { h })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_step_hits_the_end() {
        let grid = Grid::over(0.0, 1.0, 0.3);
        assert_eq!(grid.steps, 4);
        assert_eq!(grid.step(3), (0.3 * 3.0, 0.3));
        let (end, h) = grid.step(4);
        assert_eq!(end, 1.0);
        assert!((h - 0.1).abs() < 1e-15);
    }

    #[test]
    fn a_whole_number_of_steps_keeps_its_step() {
        let grid = Grid::over(0.0, 3.0, 0.01);
        assert_eq!(grid.steps, 300);
        assert_eq!(grid.step(300), (3.0, 0.01));
    }
}
