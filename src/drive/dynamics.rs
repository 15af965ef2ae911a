//! Time stepping.

use super::failure::Failure;
use super::run::{Run, Workshop};
use crate::integrate::Newmark;
use crate::model::{StageKind, charts};

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
        for grid in self.grids(end, step) {
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
        self.model.set_clock(&mut self.state, next, 1.0);
        let Workshop { assembly, solver, newton, .. } = workshop;
        let work = &mut self.counters.work;
        let kind = StageKind::Dynamic;
        let solved = newton.solve(&self.model, assembly, solver, &mut self.state, &method, kind, None, work);
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

    /// Equal steps to the end; where rows are wanted at multiples of an interval, equal steps between those.
    fn grids(&self, end: f64, step: f64) -> Vec<Grid> {
        let start = self.state.time;
        let Some(interval) = self.plan.interval else { return Grid::over(start, end, step).into_iter().collect() };
        let first = (start / interval + 1e-9).floor() as i64 + 1;
        let mut stops: Vec<f64> =
            (first..).map(|k| k as f64 * interval).take_while(|&t| t < end - 1e-9 * interval).collect();
        stops.push(end);
        let starts = std::iter::once(start).chain(stops.clone());
        starts.zip(stops).filter_map(|(from, to)| Grid::equal(from, to, step)).collect()
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
    fn over(start: f64, end: f64, step: f64) -> Option<Self> {
        let steps = ((end - start) / step - 1e-9).ceil();
        (steps >= 1.0).then_some(Self { start, end, step, steps: steps as u64 })
    }

    /// Equal steps not longer than `step`.
    fn equal(start: f64, end: f64, step: f64) -> Option<Self> {
        let steps = ((end - start) / step - 1e-9).ceil();
        (steps >= 1.0).then(|| Self { start, end, step: (end - start) / steps, steps: steps as u64 })
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
        let grid = Grid::over(0.0, 1.0, 0.3).unwrap();
        assert_eq!(grid.steps, 4);
        assert_eq!(grid.step(3), (0.3 * 3.0, 0.3));
        let (end, h) = grid.step(4);
        assert_eq!(end, 1.0);
        assert!((h - 0.1).abs() < 1e-15);
    }

    #[test]
    fn a_whole_number_of_steps_keeps_its_step() {
        let grid = Grid::over(0.0, 3.0, 0.01).unwrap();
        assert_eq!(grid.steps, 300);
        assert_eq!(grid.step(300), (3.0, 0.01));
    }

    #[test]
    fn nothing_is_left_to_do_at_the_end() {
        assert_eq!(Grid::over(2.0, 2.0, 0.1), None);
    }
}
