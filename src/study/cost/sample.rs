//! The numbers of a run that are compared with those of another.

use super::order::Expected;
use super::places::Places;
use super::variant::{Pace, dynamic_stages};
use crate::deck::{Deck, Diagnostic, NormWord, StageBody};
use crate::scene::Scene;
use crate::study::outcome::{Outcome, StageClock, columns, columns_of_history};
use crate::study::scale::{ScaleRow, mesh_error, scales};
use crate::study::{Recorder, expected_values};
use beamsim_core::probe::{MeshError, Nearest, Probe};
use std::ops::Range;

/// The largest number of instants of a stage that are compared.
const MOST_INSTANTS: usize = 200;

/// Halvings of the coarsest step of a search that still give first instants to compare.
const HALVINGS: i32 = 10;

/// Relative round-off of counts of steps.
const SAME: f64 = 1e-9;

/// Chooses the compared numbers of runs, and measures their differences.
pub struct Sampler {
    /// The names of all outputs: columns of the history, then modes
    pub(crate) columns: Vec<String>,
    /// Numbers of the columns whose error counts
    pub(crate) outputs: Vec<usize>,
    /// How differences become one number
    pub(super) norm: NormWord,
    /// The number of columns of the history
    of_history: usize,
    /// Diagonal of the scene, to compare translations with rotations
    length: f64,
    /// Columns whose values are not unique, such as rotation vectors that are not continued from
    /// turn to turn
    ambiguous: Vec<Ambiguous>,
    /// True if the line of a beam is curved, so that elements approximate it
    curved: bool,
    /// True if masses or loads are lumped to nodes of elements with relative rotations
    lumped: bool,
    /// The positions of the columns on beams
    pub(super) places: Places,
    /// The compared rows
    rows: ComparedRows,
}

/// Effects whose masses or loads are lumped to the nodes of elements with relative rotations.
const LUMPED: [&str; 4] =
    ["rotary inertia", "eccentric section inertia", "section inertia at nodes", "following line loads"];

/// Columns of a group whose values are not unique.
struct Ambiguous {
    /// Numbers of the columns
    columns: Range<usize>,
    /// Replaces the first values by the equivalent ones that are nearest to the second
    nearest: Nearest,
}

/// The rows of a run that are compared.
enum ComparedRows {
    /// Rows at these instants, the last row, and modes
    At(Vec<StageClock>),
    /// The values of [[expect]]
    Expected,
}

/// The differences of a column over all compared rows.
#[derive(Clone, Copy, Default)]
struct Differences {
    largest: f64,
    /// The sum of their squares
    squares: f64,
    count: u64,
}

impl Differences {
    fn add(&mut self, difference: f64) {
        self.largest = self.largest.max(difference);
        self.squares += difference * difference;
        self.count += 1;
    }
}

/// The numbers of a run that are compared: instant by instant all columns of the history, then
/// modes.
pub type Samples = Vec<f64>;

impl Sampler {
    /// Compares the columns of a scene with those of a run of the same deck at the coarsest pace of
    /// the study.
    pub fn of_rows(deck: &Deck, scene: &Scene, outputs: Vec<usize>, pace: Pace) -> Self {
        let rows = ComparedRows::At(instants(deck, pace, 0));
        Self { outputs, rows, ..Self::new(deck, scene, columns(scene), columns_of_history(scene)) }
    }

    /// Compares whole histories of the columns of a scene, whatever norm [cost] of the deck names.
    /// The first instants include some that only shorter steps have, since the error after a jump
    /// depends on the length of the first step.
    pub fn of_histories(deck: &Deck, scene: &Scene, outputs: Vec<usize>, pace: Pace) -> Self {
        let rows = ComparedRows::At(instants(deck, pace, HALVINGS));
        Self { norm: NormWord::History, rows, ..Self::of_rows(deck, scene, outputs, pace) }
    }

    /// Compares the columns of a scene with those of a table that has rows at these instants.
    pub fn of_table(deck: &Deck, scene: &Scene, outputs: Vec<usize>, mut instants: Vec<StageClock>) -> Self {
        // The last row is compared in any case.
        instants.pop();
        Self {
            outputs,
            rows: ComparedRows::At(instants),
            ..Self::new(deck, scene, columns(scene), columns_of_history(scene))
        }
    }

    /// Compares the expectations of a deck; also gives the expected values.
    pub fn of_expectations(deck: &Deck, scene: &Scene) -> (Self, Samples) {
        let (names, values): (Vec<_>, Vec<_>) = expected_values(&scene.expectations).into_iter().unzip();
        let count = names.len();
        (Self { norm: NormWord::End, ambiguous: Vec::new(), ..Self::new(deck, scene, names, count) }, values)
    }

    fn new(deck: &Deck, scene: &Scene, columns: Vec<String>, of_history: usize) -> Self {
        Self {
            places: Places::of(deck, scene, &columns),
            outputs: (0..columns.len()).collect(),
            columns,
            norm: deck.cost.norm.unwrap_or_default(),
            of_history,
            length: scene.plan.model.length,
            ambiguous: ambiguous(scene),
            curved: deck.beams.iter().any(|beam| beam.path.is_curved()),
            lumped: scene.reasons.iter().any(|reason| reason.active && LUMPED.contains(&reason.name)),
            rows: ComparedRows::Expected,
        }
    }

    /// True if runs of a deck have no instants in common but the ends of stages.
    pub fn compares_ends_only(&self, deck: &Deck, coarsest: Pace) -> bool {
        let whole = matches!(self.norm, NormWord::History | NormWord::Rms) && matches!(self.rows, ComparedRows::At(_));
        let adapts = matches!(coarsest, Pace::Adapts(_)) && deck.output.interval.is_none();
        whole && adapts && dynamic_stages(deck).next().is_some()
    }

    /// True if a scene has the compared outputs.
    pub fn suits(&self, scene: &Scene) -> bool {
        matches!(self.rows, ComparedRows::Expected) || columns(scene) == self.columns
    }

    /// A recorder of the expectations of a scene, where these are compared.
    pub fn recorder(&self, scene: &Scene) -> Option<Recorder> {
        matches!(self.rows, ComparedRows::Expected).then(|| Recorder::new(scene))
    }

    /// The compared numbers of a run; NaN where it has no row.
    pub fn of(&self, outcome: &Outcome) -> Samples {
        let ComparedRows::At(instants) = &self.rows else { return outcome.expected.clone() };
        let nothing = || vec![f64::NAN; self.of_history];
        let mut samples = match self.norm {
            NormWord::End => outcome.rows.last().cloned().unwrap_or_else(nothing),
            NormWord::Max => {
                let largest =
                    |best: Vec<f64>, row: &Vec<f64>| best.iter().zip(row).map(|(b, v)| b.max(v.abs())).collect();
                outcome.rows.iter().fold(nothing(), largest)
            }
            NormWord::History | NormWord::Rms => self.at_instants(instants, outcome),
        };
        samples.extend(&outcome.modes);
        samples
    }

    /// The rows at the compared instants, and the last row.
    fn at_instants(&self, instants: &[StageClock], outcome: &Outcome) -> Samples {
        let mut samples = Vec::new();
        let mut from = 0;
        for &at in instants {
            match outcome.row_at(from, at) {
                Some(row) => {
                    from = row;
                    samples.extend(&outcome.rows[row]);
                }
                None => samples.resize(samples.len() + self.of_history, f64::NAN),
            }
        }
        match outcome.rows.last() {
            Some(last) => samples.extend(last),
            None => samples.resize(samples.len() + self.of_history, f64::NAN),
        }
        samples
    }

    /// The largest value of each column's kind.
    pub fn scales(&self, samples: &Samples) -> Vec<f64> {
        scales(&self.columns, self.length, self.split(samples))
    }

    /// Refuses outputs that are all zero: there is no size to relate errors to.
    pub fn refuse_nothing(&self, scales: &[f64]) -> Result<(), Diagnostic> {
        if self.outputs.iter().any(|&k| scales[k] > 0.0) {
            return Ok(());
        }
        let message = "all outputs are zero throughout: relative errors are undefined";
        Err(Diagnostic::whole(message)
            .help("check that a load moves the nodes in [output], or choose other `nodes` or `columns`"))
    }

    /// Rows of the history, then the modes.
    fn split<'s>(&self, samples: &'s [f64]) -> impl Iterator<Item = ScaleRow<'s>> {
        let modes = self.columns.len() - self.of_history;
        let (history, modes) = samples.split_at(samples.len().saturating_sub(modes));
        let modes = (!modes.is_empty()).then_some(ScaleRow { first: self.of_history, values: modes });
        history.chunks(self.of_history.max(1)).map(|values| ScaleRow { first: 0, values }).chain(modes)
    }

    /// The difference of each column over its scale; NaN where there is nothing to compare.
    pub fn differences(&self, came: &Samples, reference: &Samples, scales: &[f64]) -> Vec<f64> {
        let mut sums = vec![Differences::default(); self.columns.len()];
        if came.len() != reference.len() {
            return vec![f64::NAN; self.columns.len()];
        }
        for (a, b) in self.split(came).zip(self.split(reference)) {
            let mut nearest = a.values.to_vec();
            self.take_nearest(a.first, &mut nearest, b.values);
            for (k, (one, other)) in nearest.iter().zip(b.values).enumerate() {
                if !(one.is_nan() || other.is_nan()) {
                    sums[a.first + k].add((one - other).abs());
                }
            }
        }
        let norm = |(sum, &scale): (&Differences, &f64)| {
            let Differences { largest, squares, count } = *sum;
            if count == 0 || scale == 0.0 {
                return f64::NAN;
            }
            match self.norm {
                NormWord::Rms => (squares / count as f64).sqrt() / scale,
                NormWord::History | NormWord::End | NormWord::Max => largest / scale,
            }
        };
        sums.iter().zip(scales).map(norm).collect()
    }

    /// The largest difference of the outputs that count.
    pub fn distance(&self, came: &Samples, reference: &Samples, scales: &[f64]) -> f64 {
        self.worst(&self.differences(came, reference, scales))
    }

    /// The largest of the differences that count; NaN where none can be compared.
    pub fn worst(&self, differences: &[f64]) -> f64 {
        self.outputs.iter().map(|&k| differences[k]).fold(f64::NAN, f64::max)
    }

    /// Adds to `one` its difference from `other`, times `weight`.
    pub fn extrapolated(&self, one: &Samples, other: &Samples, weight: f64) -> Samples {
        let mut all = Vec::with_capacity(one.len());
        for (a, b) in self.split(one).zip(self.split(other)) {
            let mut nearest = b.values.to_vec();
            self.take_nearest(a.first, &mut nearest, a.values);
            all.extend(a.values.iter().zip(&nearest).map(|(a, b)| a + weight * (a - b)));
        }
        all
    }

    /// The order of the error over the width of elements, for smooth scenes: at nodes twice the
    /// order of the elements, or less on curved lines and with lumped masses or loads; between
    /// nodes one more than the order of the elements. `None` where outputs that are not motions
    /// count.
    pub fn order_in_space(&self, order: usize, relative: bool) -> Option<Expected> {
        let motion = |&k: &usize| mesh_error(&self.columns[k]) == MeshError::Nodes;
        let between = |&k: &usize| {
            let node = self.columns[k].rsplit_once('.').map_or("", |(node, _)| node);
            let place = node.split_once('@').map_or("", |(_, place)| place);
            node.contains(':') || !["", "start", "end"].contains(&place)
        };
        // The order of the approximation of a curved line: for even orders, errors cancel from end
        // to end of an element.
        let line = 2 * ((order + 2) / 2);
        let expected = if self.outputs.iter().any(between) {
            Expected { order: (1 + order) as f64, at_least: true }
        } else if self.curved || (relative && self.lumped) {
            Expected { order: line.min(2 * order) as f64, at_least: line < 2 * order }
        } else {
            Expected { order: (2 * order) as f64, at_least: false }
        };
        self.outputs.iter().all(motion).then_some(expected)
    }

    /// Replaces values of a row that are not unique by the equivalent ones that are nearest to
    /// those of another row: each rotation has two rotation vectors of up to 2 pi, and two unit
    /// quaternions. `first` is the number of the first column of both rows.
    pub fn take_nearest(&self, first: usize, row: &mut [f64], to: &[f64]) {
        for group in &self.ambiguous {
            // The modes have no such columns: their rows begin after the columns of the history.
            let own = group.columns.start.wrapping_sub(first)..group.columns.end.wrapping_sub(first);
            if let (Some(values), Some(goal)) = (row.get_mut(own.clone()), to.get(own)) {
                (group.nearest)(values, goal);
            }
        }
    }
}

/// The columns of a history whose values are not unique.
fn ambiguous(scene: &Scene) -> Vec<Ambiguous> {
    let mut end = 0;
    let columns = |probe: &Probe| {
        let start = end;
        end += probe.names.len();
        Some(Ambiguous { columns: start..end, nearest: probe.group.nearest? })
    };
    scene.probes.iter().filter_map(columns).collect()
}

/// The instants that all runs of a deck have: levels of static stages, and multiples of the
/// coarsest step of dynamic ones, preceded by halvings of that step. Paths have only their ends in
/// common. The last row of a run is compared beside these.
fn instants(deck: &Deck, coarsest: Pace, halvings: i32) -> Vec<StageClock> {
    let mut all = Vec::new();
    let mut start = 0.0;
    for (k, stage) in deck.stages.iter().enumerate() {
        let at = |clock| StageClock { stage: k + 1, clock };
        match stage.body {
            StageBody::Static { steps, .. } => {
                all.extend(thinned(steps).map(|level| at(level as f64 / steps as f64)));
            }
            StageBody::Dynamic { end, step, .. } => {
                let own = if let Pace::Steps(factor) = coarsest { Some(step * factor) } else { None };
                // Any step gives rows at multiples of the interval.
                let (first, apart) = match deck.output.interval {
                    Some(interval) => ((start / interval * (1.0 + SAME)).floor() * interval, Some(interval)),
                    None => (start, own),
                };
                if let Some(apart) = apart {
                    all.extend((1..=halvings).rev().map(|n| at(first + apart * 0.5_f64.powi(n))));
                    let count = ((end - first) / apart * (1.0 + SAME)).floor() as usize;
                    all.extend(thinned(count).map(|n| at(first + n as f64 * apart)));
                }
                all.push(at(end));
                start = end;
            }
            StageBody::Path { .. } | StageBody::Modal { .. } | StageBody::Buckling { .. } => {}
        }
    }
    all.dedup_by(|next, last| next.stage == last.stage && (next.clock - last.clock).abs() <= SAME * last.clock);
    let moving = deck.stages.iter().rposition(|stage| stage.body.kind().advances_state()).map(|k| &deck.stages[k].body);
    let end = match moving {
        Some(StageBody::Dynamic { end, .. }) => Some(*end),
        Some(StageBody::Static { .. }) => Some(1.0),
        Some(StageBody::Path { .. } | StageBody::Modal { .. } | StageBody::Buckling { .. }) | None => None,
    };
    all.pop_if(|last| end.is_some_and(|end| (last.clock - end).abs() <= SAME * end));
    all
}

/// Evenly spaced numbers from 1 to `count`, not too many, and some more of the first, since motions
/// may begin with a jump.
fn thinned(count: usize) -> impl Iterator<Item = usize> {
    let stride = count.div_ceil(MOST_INSTANTS).max(1);
    let first = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(move |&n| n < stride);
    first.chain((stride..=count).step_by(stride))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_instants_are_all_compared_and_many_evenly_after_the_first() {
        assert!(thinned(200).eq(1..=200));
        let many: Vec<usize> = thinned(2000).collect();
        assert_eq!(many[..6], [1, 2, 4, 8, 10, 20]);
        assert_eq!((many.len(), many.last()), (204, Some(&2000)));
        assert_eq!(thinned(0).count(), 0);
    }

    #[test]
    fn instants_leave_the_last_row_to_itself() {
        let deck = |stages: &str| {
            let text = format!("[point]\na = [0, 0, 0]\n[[body]]\nat = \"a\"\nmass = 1\n{stages}");
            crate::deck::read(&text).unwrap_or_else(|found| panic!("{}", found[0].message)).0
        };
        let clocks = |deck: &Deck| -> Vec<(usize, f64)> {
            instants(deck, Pace::Steps(1.0), 0).into_iter().map(|at| (at.stage, at.clock)).collect()
        };
        let dynamic =
            |end: f64| format!("[[stage]]\nkind = \"dynamic\"\nend = {end:?}\nstep = 0.25\nscheme = \"newmark\"\n");
        assert_eq!(clocks(&deck(&dynamic(0.75))), [(1, 0.25), (1, 0.5)]);
        assert_eq!(clocks(&deck(&dynamic(0.6))), [(1, 0.25), (1, 0.5)]);
        let two = dynamic(0.5) + &dynamic(1.0);
        assert_eq!(clocks(&deck(&two)), [(1, 0.25), (1, 0.5), (2, 0.75)]);
    }
}
