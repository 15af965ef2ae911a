//! How much the outputs of one run differ from those of another.

use crate::study::outcome::Outcome;
use crate::study::scale::scales;

/// The largest change of each column over all rows, relative to the largest value of its kind in the whole scene: of all displacements,
/// rotations, forces, ….
pub(super) fn changes(columns: &[String], length: f64, whole: &Outcome, other: &Outcome) -> Vec<f64> {
    let of_history = columns.len() - whole.modes.len();
    let scales =
        scales(columns, length, whole.rows.iter().map(|row| (0, &row[..])).chain([(of_history, &whole.modes[..])]));
    let mut changes = vec![0.0_f64; columns.len()];
    let mut compare = |column: usize, came: f64, was: f64| {
        let (difference, scale) = ((came - was).abs(), scales[column]);
        let same = difference == 0.0 || (came.is_nan() && was.is_nan());
        let now = if same { 0.0 } else { difference / scale };
        changes[column] = match now {
            // What is always zero has nothing that a change would compare with.
            _ if scale == 0.0 && !same => f64::NAN,
            now if now.is_nan() => f64::INFINITY,
            now if changes[column].is_nan() => now,
            now => changes[column].max(now),
        };
    };
    for (k, row) in whole.rows.iter().enumerate() {
        let Some(there) = other.at(whole, k) else { continue };
        there.iter().zip(row).enumerate().for_each(|(column, (came, was))| compare(column, *came, *was));
    }
    // A mode that was not found again is a change without measure.
    for (k, was) in whole.modes.iter().enumerate() {
        compare(of_history + k, other.modes.get(k).copied().unwrap_or(f64::NAN), *was);
    }
    changes
}

impl Outcome {
    /// The row that belongs to row `k` of another run: at its clock, between two rows where there is none. Of stages whose clock goes
    /// back, and of others that ended elsewhere, the last row is compared with the last.
    fn at(&self, other: &Self, k: usize) -> Option<Vec<f64>> {
        let (stage, clock) = other.clock(k);
        if k < self.rows.len() && self.clock(k) == (stage, clock) {
            return self.rows.get(k).cloned();
        }
        if k + 1 == other.rows.len() {
            return self.rows.last().cloned();
        }
        let goes_on = |outcome: &Self| {
            let own = outcome.clocks().filter(|(s, _)| *s == stage).map(|(_, clock)| clock);
            own.is_sorted()
        };
        if !(goes_on(self) && goes_on(other)) {
            return None;
        }
        let after = self.clocks().position(|(s, c)| s == stage && c >= clock)?;
        let (_, c1) = self.clock(after);
        if c1 == clock {
            return Some(self.rows[after].clone());
        }
        let (s, c0) = self.clock(after.checked_sub(1)?);
        let share = (s == stage).then(|| (clock - c0) / (c1 - c0))?;
        let (a, b) = (&self.rows[after - 1], &self.rows[after]);
        Some(a.iter().zip(b).map(|(a, b)| a + (b - a) * share).collect())
    }
}
