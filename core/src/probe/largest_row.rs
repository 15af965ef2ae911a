//! The row of a run with the largest stress of a section, without a search over the section in each
//! row.
//!
//! Measures are convex and proportional to the load. So the value of a row is bounded by those of
//! rows that were looked at: by one of them (a multiple of it, and what is left), and between two of
//! them by the chord. Loads of successive rows are near each other: the last row that was searched
//! bounds those after it, and its point with the largest value is likely to be theirs. Rows that may
//! be the largest wait until there is a batch of them. The row that is likely to be the largest is
//! looked at first, and excludes most others: if stress grows in every row, nearly all of a batch.

use crate::run::Moment;
use crate::section::recovery::{Criterion, PlacedRecovery, SearchedPoint};
use crate::section::unit_peaks::UnitPeaks;
use crate::section::{Point, Vector6};
use serde::{Deserialize, Serialize};

/// Rows that wait, at most
const BATCH: usize = 128;

/// The part of the floor down to which values of rows are estimated
const KNOWN_BELOW: f64 = 0.8;

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
    /// The last load whose value was estimated
    recent: Option<Recent>,
}

/// A load with an estimate of its value.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
struct Recent {
    known: Known,
    /// The point of the section that had the largest value last; none before one was found
    at: Option<SearchedPoint>,
}

/// A load with bounds of its value.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
struct Known {
    /// Resultants of the section
    load: [f64; 6],
    least: f64,
    most: f64,
}

/// Resultants of the beam in a row.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Row {
    /// When
    pub(crate) moment: Moment,
    /// N1 N2 N3 M1 M2 M3
    pub(crate) resultant: [f64; 6],
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

impl Extreme {
    /// The largest value of a measure divided by a number.
    pub(super) fn over(self, divisor: f64) -> Self {
        Self { value: self.value / divisor, ..self }
    }
}

impl LargestRow {
    /// Bytes that rows take while they wait, at most.
    pub const WAITING_BYTES: usize = BATCH * size_of::<Waiting>();

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
        // The row that reaches the floor waits already: others that are its equal do not matter.
        let limit = self.floor * (1.0 + ROUND_OFF);
        let load = search.load(&row.resultant);
        if search.peaks().bound(&load) <= limit {
            return;
        }
        let mut at_least = f64::NEG_INFINITY;
        for known in [Some(search.known(best)), self.recent.map(|recent| recent.known)].into_iter().flatten() {
            let [least, most] = search.around(&known, &load);
            if most <= limit {
                return;
            }
            at_least = at_least.max(least);
        }
        if at_least <= self.floor {
            let point = self.recent.and_then(|recent| recent.at);
            at_least = at_least.max(point.map_or(at_least, |at| search.value_at(at, &load)));
        }
        if at_least <= self.floor {
            match self.estimate(search, &load) {
                Some(reached) => at_least = at_least.max(reached),
                None => return,
            }
        }
        self.floor = self.floor.max(at_least);
        self.waiting.push(Waiting { number, row, at_least });
        if self.waiting.len() == BATCH {
            self.settle(search);
        }
    }

    /// A value that a load reaches, if its largest value may be above the floor. The search begins
    /// below the floor, so that its bounds exclude the rows that follow as long as they are near.
    fn estimate(&mut self, search: Search, load: &Vector6) -> Option<f64> {
        let below = KNOWN_BELOW * self.floor;
        let estimate = search.section.section().estimate(search.criterion, load, below);
        let [least, most] = estimate.map_or([0.0, below], |found| [found.least, found.most]);
        let at = estimate.map(|found| found.at).or(self.recent.and_then(|recent| recent.at));
        self.recent = Some(Recent { known: Known { load: (*load).into(), least, most }, at });
        estimate.filter(|found| found.most > self.floor).map(|found| found.least)
    }

    /// The largest row so far.
    pub fn found(&self, section: &PlacedRecovery, criterion: Criterion) -> Option<Extreme> {
        let mut settled = self.clone();
        settled.settle(Search { section, criterion });
        settled.best.map(|best| best.extreme)
    }

    /// The value that a row that waits must exceed to matter.
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
                let ends = before.iter().chain(&behind).map(|end| search.around(&search.known(end), load)[1]);
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

    /// The load of a row that was looked at, whose value is known.
    fn known(&self, Looked { extreme, .. }: &Looked) -> Known {
        let Extreme { value, resultant, .. } = *extreme;
        Known { load: self.load(&resultant).into(), least: value, most: value }
    }

    /// Lower and upper bound of the value of a load by those of another one.
    fn around(&self, known: &Known, load: &Vector6) -> [f64; 2] {
        self.peaks().around(load, &Vector6::from(known.load), [known.least, known.most])
    }

    fn value_at(&self, at: SearchedPoint, load: &Vector6) -> f64 {
        self.section.section().value_at(self.criterion, at, load)
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
    use crate::section::analysis::{MeshAim, analyse};
    use crate::section::closed::{ClosedForm, ClosedShape};
    use crate::section::geometry::{Geometry, Profile, Shape};
    use crate::section::material::Material;
    use crate::section::mesh::Region;
    use crate::section::recovery::{Placement, Recovery};
    use crate::section::strength::{FailureLaw, Strengths};
    use crate::section::stress::Corners;
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
        shapes.into_iter().enumerate().map(made).chain([i_section()]).collect()
    }

    fn i_section() -> PlacedRecovery {
        let profile = Profile::I { d: 2.0, b: 1.0, t_f: 0.1, t_w: 0.06, r: 0.0, b_top: 1.0, t_f_top: 0.1 };
        let geometry = Geometry::new(Shape::Profile { profile, region: Region::new("i", 0) });
        let materials = [Material::isotropic("steel", 1.0, 0.3, 1.0)];
        let analysis = analyse(&geometry, &materials, MeshAim::Usual).expect("a section");
        let field = analysis.stresses(&materials).expect("stresses");
        let law = FailureLaw { yield_stress: Some(2.0), ..FailureLaw::default() };
        let section = Recovery::computed("i", field, Placement::default(), Corners::Exclude, &[Some(law)]);
        PlacedRecovery::new(Arc::new(section), [0.0; 2], 0.0)
    }

    fn wave(i: usize) -> f64 {
        libm::sin(78.233 * i as f64) * 43758.5453 % 1.0
    }

    /// Courses of resultants: at random, growing, growing along a curve, vibrating, at rest, and turning
    /// with small vibrations.
    fn courses() -> [fn(usize, usize) -> f64; 6] {
        [
            |row, k| wave(6 * row + k),
            |row, k| wave(k) * (1 + row) as f64,
            |row, k| wave(k) * row as f64 + wave(k + 10) * (row * row) as f64 / 300.0 + wave(k + 20),
            |row, k| {
                wave(k) * libm::sin(0.1 * row as f64) + wave(k + 10) * libm::cos((0.37 + 0.01 * k as f64) * row as f64)
            },
            |row, k| wave(k) * (1.0 + if row < 50 { row as f64 / 50.0 } else { 1.0 + 1e-15 * wave(row) }),
            |row, k| {
                let lag = [0.0, 0.0, 0.5, 0.7, 0.0, 0.5][k] * std::f64::consts::PI;
                let small = 0.02 * libm::sin((0.9 + 0.1 * k as f64) * row as f64);
                libm::cos(0.15 * row as f64 - lag) + small
            },
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

    /// A course between two rows.
    fn between(course: fn(usize, usize) -> f64, row: f64, k: usize) -> f64 {
        let before = row.floor();
        let part = row - before;
        (1.0 - part) * course(before as usize, k) + part * course(before as usize + 1, k)
    }

    /// Prints the nanoseconds of a row by section and course.
    #[test]
    #[ignore = "a study"]
    fn costs_of_rows() {
        const ROWS: usize = 10_000;
        for (number, section) in sections().iter().enumerate() {
            for (kind, course) in courses().into_iter().enumerate() {
                let rows: Vec<[f64; 6]> = (0..ROWS)
                    .map(|row| std::array::from_fn(|k| between(course, 400.0 * row as f64 / ROWS as f64, k)))
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
