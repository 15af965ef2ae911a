//! Differences between the outputs of two runs.

use crate::study::outcome::{Outcome, StageClock};
use crate::study::scale::{ScaleRow, scales};

/// The largest change of each column over all rows, relative to the largest value of its kind in
/// the whole scene: of all displacements, rotations, forces, ….
pub(super) fn changes(columns: &[String], length: f64, whole: &Outcome, other: &Outcome) -> Vec<f64> {
    let of_history = columns.len() - whole.modes.len();
    let history = whole.rows.iter().map(|row| ScaleRow { first: 0, values: row });
    let modes = ScaleRow { first: of_history, values: &whole.modes };
    let scales = scales(columns, length, history.chain([modes]));
    let mut changes = vec![0.0_f64; columns.len()];
    let mut compare = |column: usize, came: f64, was: f64| {
        let difference = (came - was).abs();
        let scale = scales[column];
        let same = difference == 0.0 || (came.is_nan() && was.is_nan());
        let now = if same { 0.0 } else { difference / scale };
        changes[column] = if scale == 0.0 && !same {
            // There is nothing to relate the change of a column to that is always zero.
            f64::NAN
        } else if now.is_nan() {
            f64::INFINITY
        } else if changes[column].is_nan() {
            now
        } else {
            changes[column].max(now)
        };
    };
    for (k, row) in whole.rows.iter().enumerate() {
        let Some(there) = other.at(whole, k) else { continue };
        there.iter().zip(row).enumerate().for_each(|(column, (came, was))| compare(column, *came, *was));
    }
    // A mode that was not found again counts as an infinite change.
    for (k, was) in whole.modes.iter().enumerate() {
        compare(of_history + k, other.modes.get(k).copied().unwrap_or(f64::NAN), *was);
    }
    changes
}

impl Outcome {
    /// The numbers that belong to row `k` of another run: those of a row at its clock, or
    /// interpolated ones. The last rows belong together. `None` for stages whose clock goes back,
    /// and after the end of the run.
    fn at(&self, other: &Self, k: usize) -> Option<Vec<f64>> {
        let StageClock { stage, clock } = other.clock(k);
        if k < self.rows.len() && self.clock(k) == other.clock(k) {
            return self.rows.get(k).cloned();
        }
        if k + 1 == other.rows.len() {
            return self.rows.last().cloned();
        }
        let goes_on = |outcome: &Self| {
            let own = outcome.clocks().filter(|at| at.stage == stage).map(|at| at.clock);
            own.is_sorted()
        };
        if !(goes_on(self) && goes_on(other)) {
            return None;
        }
        let after = self.clocks().position(|at| at.stage == stage && at.clock >= clock)?;
        let end = self.clock(after).clock;
        if end == clock {
            return Some(self.rows[after].clone());
        }
        let before = self.clock(after.checked_sub(1)?);
        let part = (before.stage == stage).then(|| (clock - before.clock) / (end - before.clock))?;
        let pairs = self.rows[after - 1].iter().zip(&self.rows[after]);
        Some(pairs.map(|(a, b)| a + (b - a) * part).collect())
    }
}
