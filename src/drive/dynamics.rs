//! Time stepping.

use super::failure::Failure;
use super::run::{Run, Workshop};
use crate::integrate::Newmark;
use crate::model::charts;
use crate::solve::NewtonFailure;

impl Run<'_> {
    /// All steps of a dynamic stage: rows at start + k step, the last one at `end`.
    pub(super) fn run_dynamic(
        &mut self,
        workshop: &mut Workshop,
        end: f64,
        step: f64,
        beta: f64,
        gamma: f64,
    ) -> Result<(), Failure> {
        self.start_dynamic(workshop)?;
        while self.state.time < end {
            let grid = self.next_grid(end, step);
            for number in 1..=grid.steps {
                let (next, h) = grid.step(number);
                self.observer.progress(self.moment(), self.dynamic_progress(next, end))?;
                self.advance(workshop, Newmark { beta, gamma, step: h }, next)?;
                self.counters.steps += 1;
                self.show(workshop)?;
                if self.is_over(workshop) {
                    return Ok(());
                }
                self.change_charts();
            }
        }
        Ok(())
    }

    /// Predict, prescribe, iterate, account.
    fn advance(&mut self, workshop: &mut Workshop, method: Newmark, next: f64) -> Result<(), Failure> {
        self.good.copy_from(&self.state);
        method.predict(&mut self.state);
        let solved = match self.model.set_clock(&mut self.state, next, 1.0) {
            Some((slot, angle)) => Err(NewtonFailure::TurnsTooFar { slot: slot as usize, angle }),
            None => {
                let Workshop { assembly, newton, .. } = &mut *workshop;
                newton.solve(&self.model, assembly, &mut self.state, &method, None, &mut self.counters.work)
            }
        };
        if let Err(failure) = solved {
            let named = self.name_failure(failure, &workshop.assembly.system);
            self.state.copy_from(&self.good);
            return Err(named);
        }
        self.accept(workshop)
    }

    /// Between steps, nodes beyond pi change their chart, and elements settle theirs.
    pub(super) fn change_charts(&mut self) {
        let switched = charts::switch(&mut self.state, &self.model.rotations, charts::DYNAMIC_BAND);
        self.counters.work.chart_switches += switched as u64;
        charts::freeze(&mut self.state, &self.model.elements);
    }

    /// The steps to the end; where rows are wanted at multiples of an interval, equal steps to the next of those.
    fn next_grid(&self, end: f64, step: f64) -> Grid {
        let start = self.state.time;
        let Some(interval) = self.plan.interval else { return Grid::over(start, end, step) };
        let next = ((start / interval + 1e-9).floor() + 1.0) * interval;
        let last = next >= end - 1e-9 * interval;
        Grid::equal(start, if last { end } else { next }, step)
    }

    fn dynamic_progress(&self, time: f64, end: f64) -> f64 {
        let done = if end > 0.0 { (time / end).clamp(0.0, 1.0) } else { 1.0 };
        (self.stage as f64 + done) / self.plan.stages.len() as f64
    }
}

/// Steps of one length, the last perhaps shorter.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Grid {
    start: f64,
    end: f64,
    step: f64,
    steps: u64,
}

impl Grid {
    /// Steps of length `step`, the last shortened to hit `end`.
    fn over(start: f64, end: f64, step: f64) -> Self {
        let steps = ((end - start) / step - 1e-9).ceil().max(1.0);
        Self { start, end, step, steps: steps as u64 }
    }

    /// Equal steps not longer than `step`.
    fn equal(start: f64, end: f64, step: f64) -> Self {
        let steps = ((end - start) / step - 1e-9).ceil().max(1.0);
        Self { start, end, step: (end - start) / steps, steps: steps as u64 }
    }

    /// The end and the length of step `number`, from 1. Times are multiples, not sums, so that they do not drift; steps
    /// that are equal but for the round-off of times have one length to the last bit.
    fn step(&self, number: u64) -> (f64, f64) {
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
