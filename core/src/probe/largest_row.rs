//! The row of a run with the largest stress of a section, without a search over the section in each
//! row.
//!
//! Measures are convex and proportional to the load. So the value of a row is bounded by those of
//! rows that were looked at: by one of them (a multiple of it, and what is left), and between two of
//! them by the chord. Rows that may be the largest wait until there is a batch of them. The row that
//! is likely to be the largest is looked at first, and excludes most others: if stress grows in every
//! row, nearly all of a batch.

use crate::run::Moment;
use crate::section::recovery::{Criterion, PlacedRecovery};
use crate::section::unit_peaks::UnitPeaks;
use crate::section::{Point, Vector6};
use serde::{Deserialize, Serialize};

/// Rows that wait, at most
const BATCH: usize = 128;

/// The part of a value that is round-off
const ROUND_OFF: f64 = 1e-12;

/// The largest value so far, with when and where it was.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Extreme {
    /// The value
    pub value: f64,
    /// When
    pub moment: Moment,
    /// Coordinates 2 and 3 of the shape
    pub at: Point,
    /// Index of the region
    pub region: usize,
    /// N1 N2 N3 M1 M2 M3 then
    pub resultant: [f64; 6],
}

/// The largest row so far, and rows that may be larger.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct LargestRow {
    best: Option<Looked>,
    waiting: Vec<Waiting>,
    /// A value that one of these rows reaches
    floor: f64,
    /// Number of rows so far
    count: u64,
}

/// Resultants of the beam in a row.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Row {
    /// When
    pub moment: Moment,
    /// N1 N2 N3 M1 M2 M3
    pub resultant: [f64; 6],
}

/// A row that waits.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
struct Waiting {
    number: u64,
    row: Row,
    /// A lower bound of its value
    at_least: f64,
}

/// A row whose section was searched.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
struct Looked {
    number: u64,
    extreme: Extreme,
}

/// A section with what is looked for in it.
#[derive(Clone, Copy)]
struct Search<'a> {
    section: &'a PlacedRecovery,
    criterion: Criterion,
}

impl LargestRow {
    /// Takes the next row.
    pub fn row(&mut self, section: &PlacedRecovery, criterion: Criterion, row: Row) {
        let search = Search { section, criterion };
        let number = self.count;
        self.count += 1;
        let Some(best) = &self.best else {
            self.best = search.look(number, row);
            self.floor = self.best.map_or(0.0, |best| best.extreme.value);
            return;
        };
        let limit = self.limit();
        let load = search.load(&row.resultant);
        if search.peaks().bound(&load) <= limit {
            return;
        }
        let [least, most] = search.around(best, &load);
        if most <= limit {
            return;
        }
        let at_least = if least > self.floor {
            least
        } else {
            match section.section().may_exceed(criterion, &load, self.floor) {
                None => return,
                Some(reached) => reached.max(least),
            }
        };
        self.floor = self.floor.max(at_least);
        self.waiting.push(Waiting { number, row, at_least });
        if self.waiting.len() == BATCH {
            self.settle(search);
        }
    }

    /// The largest row so far.
    pub fn found(&self, section: &PlacedRecovery, criterion: Criterion) -> Option<Extreme> {
        let mut settled = self.clone();
        settled.settle(Search { section, criterion });
        settled.best.map(|best| best.extreme)
    }

    /// The value that a row must exceed to matter.
    fn limit(&self) -> f64 {
        let best = self.best.map_or(f64::NEG_INFINITY, |best| best.extreme.value);
        (best * (1.0 + ROUND_OFF)).max(self.floor * (1.0 - ROUND_OFF))
    }

    /// Decides about all rows that wait.
    fn settle(&mut self, search: Search) {
        let rows = std::mem::take(&mut self.waiting);
        self.settle_between(search, self.best, &rows, None);
    }

    /// Decides about rows between two that were looked at, the first of which may be much earlier.
    fn settle_between(&mut self, search: Search, before: Option<Looked>, rows: &[Waiting], behind: Option<Looked>) {
        let limit = self.limit();
        let left: Vec<Waiting> = rows
            .iter()
            .filter(|waiting| {
                let load = &search.load(&waiting.row.resultant);
                let ends = before.iter().chain(&behind).map(|end| search.around(end, load)[1]);
                let chord = before.zip(behind).map(|(before, behind)| search.chord([&before, &behind], load));
                // Not `>`: a bound that is not a number must not hide anything.
                !ends.chain(chord).any(|most| most <= limit)
            })
            .copied()
            .collect();
        let likely = (0..left.len()).max_by(|&a, &b| left[a].at_least.total_cmp(&left[b].at_least));
        let Some(likely) = likely else { return };
        let Waiting { number, row, .. } = left[likely];
        let looked = search.look(number, row);
        let is_larger = |looked: &Looked| {
            self.best.is_none_or(|best| {
                let [new, old] = [looked.extreme.value, best.extreme.value];
                new > old || (new == old && looked.number < best.number)
            })
        };
        if let Some(looked) = looked.filter(is_larger) {
            self.floor = self.floor.max(looked.extreme.value);
            self.best = Some(looked);
        }
        self.settle_between(search, before, &left[..likely], looked);
        self.settle_between(search, looked, &left[likely + 1..], behind);
    }
}

impl Search<'_> {
    fn look(&self, number: u64, Row { moment, resultant }: Row) -> Option<Looked> {
        let peak = self.section.section().largest_of(self.criterion, &self.load(&resultant), f64::NEG_INFINITY)?;
        let extreme = Extreme { value: peak.value, moment, at: peak.at, region: peak.region, resultant };
        Some(Looked { number, extreme })
    }

    /// Resultants of the section from those of the beam.
    fn load(&self, resultant: &[f64; 6]) -> Vector6 {
        self.section.in_section(&Vector6::from(*resultant))
    }

    fn peaks(&self) -> &UnitPeaks {
        self.section.section().unit_peaks(self.criterion)
    }

    /// Lower and upper bound of the value of a load by that of a row.
    fn around(&self, known: &Looked, load: &Vector6) -> [f64; 2] {
        let Extreme { value, resultant, .. } = known.extreme;
        self.peaks().around(load, &self.load(&resultant), value)
    }

    /// Upper bound of the value of a load by the chord between two rows.
    fn chord(&self, rows: [&Looked; 2], load: &Vector6) -> f64 {
        let loads = rows.map(|row| self.load(&row.extreme.resultant));
        self.peaks().chord(load, [0, 1].map(|k| (&loads[k], rows[k].extreme.value)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::closed::{ClosedForm, ClosedShape};
    use crate::section::recovery::{Placement, Recovery};
    use crate::section::strength::{FailureLaw, Strengths};
    use std::sync::Arc;

    fn sections() -> Vec<PlacedRecovery> {
        let shapes = [
            ClosedShape::Ring { radii: [0.0, 1.0] },
            ClosedShape::Ring { radii: [0.7, 1.0] },
            ClosedShape::Rectangle { half: [0.5, 1.0] },
        ];
        let laws = [
            FailureLaw { yield_stress: Some(2.0), ..FailureLaw::default() },
            FailureLaw { strengths: Some(Strengths::ply(3.0, 1.0, 3.0, 1.0, 2.0)), ..FailureLaw::default() },
        ];
        let made = |(number, shape): (usize, ClosedShape)| {
            let form = ClosedForm::new(shape, 0.3);
            let section = Recovery::closed("s", form, Placement::default(), Some(laws[number % 2].clone()));
            PlacedRecovery::new(
                Arc::new(section),
                if number == 1 { [0.2, -0.1] } else { [0.0; 2] },
                0.3 * number as f64,
            )
        };
        shapes.into_iter().enumerate().map(made).collect()
    }

    fn wave(i: usize) -> f64 {
        libm::sin(78.233 * i as f64) * 43758.5453 % 1.0
    }

    /// Courses of resultants: at random, growing, growing along a curve, vibrating, and at rest.
    fn courses() -> [fn(usize, usize) -> f64; 5] {
        [
            |row, k| wave(6 * row + k),
            |row, k| wave(k) * (1 + row) as f64,
            |row, k| wave(k) * row as f64 + wave(k + 10) * (row * row) as f64 / 300.0 + wave(k + 20),
            |row, k| {
                wave(k) * libm::sin(0.1 * row as f64) + wave(k + 10) * libm::cos((0.37 + 0.01 * k as f64) * row as f64)
            },
            |row, k| wave(k) * (1.0 + if row < 50 { row as f64 / 50.0 } else { 1.0 + 1e-15 * wave(row) }),
        ]
    }

    #[test]
    fn the_largest_row_is_that_of_a_search_in_each_row() {
        for (number, section) in sections().iter().enumerate() {
            for (kind, course) in courses().into_iter().enumerate() {
                for criterion in [Criterion::VonMises, Criterion::FailureIndex] {
                    let mut largest = LargestRow::default();
                    let mut exact = f64::NEG_INFINITY;
                    for row in 0..400 {
                        let resultant = std::array::from_fn(|k| course(row, k));
                        let moment = Moment { stage: 1, time: row as f64, load: 1.0 };
                        largest.row(section, criterion, Row { moment, resultant });
                        let load = section.in_section(&Vector6::from(resultant));
                        let peak = section.section().largest_of(criterion, &load, exact);
                        exact = peak.map_or(exact, |peak| peak.value);
                    }
                    let found = largest.found(section, criterion).expect("a row");
                    let error = (found.value / exact - 1.0).abs();
                    assert!(error < 2e-12, "{number} {kind} {criterion:?}: {} {exact}", found.value);
                    let load = section.in_section(&Vector6::from(found.resultant));
                    let again = section.section().largest_of(criterion, &load, f64::NEG_INFINITY);
                    assert_eq!(again.expect("a value").value, found.value);
                }
            }
        }
    }

    /// Prints the nanoseconds of a row by section and course.
    #[test]
    #[ignore = "a study"]
    fn costs_of_rows() {
        const ROWS: usize = 10_000;
        for (number, section) in sections().iter().enumerate() {
            for (kind, course) in courses().into_iter().enumerate() {
                let rows: Vec<[f64; 6]> = (0..ROWS)
                    .map(|row| std::array::from_fn(|k| course(400 * row / ROWS, k) * (1.0 + row as f64 * 1e-5)))
                    .collect();
                for criterion in [Criterion::VonMises, Criterion::FailureIndex] {
                    section.section().unit_peaks(criterion);
                    let start = std::time::Instant::now();
                    let mut largest = LargestRow::default();
                    for (row, &resultant) in rows.iter().enumerate() {
                        let moment = Moment { stage: 1, time: row as f64, load: 1.0 };
                        largest.row(section, criterion, Row { moment, resultant });
                    }
                    let found = largest.found(section, criterion).expect("a row");
                    let cost = start.elapsed().as_nanos() / ROWS as u128;
                    println!("section {number} course {kind} {criterion:?}: {cost} ns a row, {:.4}", found.value);
                }
            }
        }
    }
}
