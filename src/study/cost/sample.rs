//! Which numbers of a run are compared with those of another.

use super::grid::{Pace, dynamic_stages};
use super::order::Expected;
use super::places::Places;
use crate::deck::{Deck, Diagnostic, NormWord, Path, StageBody};
use crate::scene::Scene;
use crate::study::outcome::{Outcome, columns, columns_of_history};
use crate::study::scale::{mesh_error, scales};
use crate::study::{Recorder, expected_values};
use beamsim_core::probe::{MeshError, Nearest, Probe};
use std::ops::Range;

/// Instants of a stage that are compared, at most.
const MOST_INSTANTS: usize = 200;

/// How often the coarsest step of a search may be halved for its first instant to be compared.
const HALVINGS: i32 = 10;

/// Round-off of counts of steps, relative.
const SAME: f64 = 1e-9;

/// Where a run is looked at, and how differences are measured.
pub struct Sampler {
    /// The names of all outputs: columns of the history, then modes
    pub columns: Vec<String>,
    /// Numbers of those whose error counts
    pub outputs: Vec<usize>,
    /// How
    pub norm: NormWord,
    /// Columns of the history
    of_history: usize,
    /// Diagonal of the scene
    length: f64,
    /// Columns whose values are not unique, such as rotation vectors that are not continued from turn to turn
    ambiguous: Vec<Ambiguous>,
    /// Whether the initial line of a beam is one that elements only come near
    curved: bool,
    /// Whether something is lumped to nodes where rotations are relative
    lumped: bool,
    /// Where its columns lie on beams
    pub places: Places,
    /// What is looked at
    looks: Look,
}

/// What is lumped to the nodes of relative elements.
const LUMPED: [&str; 4] =
    ["rotary inertia", "eccentric section inertia", "section inertia at nodes", "following line loads"];

/// Columns of a group whose values are not unique.
struct Ambiguous {
    /// Numbers of the columns
    columns: Range<usize>,
    /// Replaces the first values by those that mean the same and are nearest to the second
    nearest: Nearest,
}

/// What is looked at in a run.
enum Look {
    /// Rows with these stages (from 1) and clocks, the last row, and modes
    At(Vec<(usize, f64)>),
    /// What the deck expects
    Expected,
}

/// The numbers of a run that are compared: instant by instant all columns of the history, then modes.
pub type Samples = Vec<f64>;

impl Sampler {
    /// For the columns of a scene, compared with a run of the same deck at the coarsest pace of the study.
    pub fn of_rows(deck: &Deck, scene: &Scene, outputs: Vec<usize>, pace: Pace) -> Self {
        let looks = Look::At(instants(deck, pace, 0));
        Self { outputs, looks, ..Self::new(deck, scene, columns(scene), columns_of_history(scene)) }
    }

    /// The same, over whole histories whatever the deck says of studies, and also at first instants that only shorter steps have: what a
    /// jump leaves after one step is less than what it leaves after a longer one.
    pub fn of_histories(deck: &Deck, scene: &Scene, outputs: Vec<usize>, pace: Pace) -> Self {
        let looks = Look::At(instants(deck, pace, HALVINGS));
        Self { norm: NormWord::History, looks, ..Self::of_rows(deck, scene, outputs, pace) }
    }

    /// For the columns of a scene, compared with a table that has rows with these stages and clocks.
    pub fn of_table(deck: &Deck, scene: &Scene, outputs: Vec<usize>, instants: Vec<(usize, f64)>) -> Self {
        Self { outputs, looks: Look::At(instants), ..Self::new(deck, scene, columns(scene), columns_of_history(scene)) }
    }

    /// For what a deck expects, and the expected values.
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
            curved: deck.beams.iter().any(|beam| matches!(beam.path, Path::Arc(_))),
            lumped: scene.reasons.iter().any(|reason| reason.active && LUMPED.contains(&reason.name)),
            looks: Look::Expected,
        }
    }

    /// Whether the steps of a deck leave no instants in common but ends.
    pub fn looks_at_ends_only(&self, deck: &Deck, coarsest: Pace) -> bool {
        let whole = matches!(self.norm, NormWord::History | NormWord::Rms) && matches!(self.looks, Look::At(_));
        let adapts = matches!(coarsest, Pace::Adapts(_)) && deck.output.interval.is_none();
        whole && adapts && dynamic_stages(deck).next().is_some()
    }

    /// Whether a scene has the outputs that are looked at.
    pub fn suits(&self, scene: &Scene) -> bool {
        matches!(self.looks, Look::Expected) || columns(scene) == self.columns
    }

    /// What records the expectations of a scene, where these are looked at.
    pub fn recorder(&self, scene: &Scene) -> Option<Recorder> {
        matches!(self.looks, Look::Expected).then(|| Recorder::new(scene))
    }

    /// What is compared of a run; NaN where it has no row.
    pub fn of(&self, outcome: &Outcome) -> Samples {
        let Look::At(instants) = &self.looks else { return outcome.expected.clone() };
        let nothing = || vec![f64::NAN; self.of_history];
        let mut samples = match self.norm {
            NormWord::End => outcome.rows.last().cloned().unwrap_or_else(nothing),
            NormWord::Max => {
                let largest =
                    |best: Vec<f64>, row: &Vec<f64>| best.iter().zip(row).map(|(b, v)| b.max(v.abs())).collect();
                outcome.rows.iter().fold(nothing(), largest)
            }
            NormWord::History | NormWord::Rms => self.rows(instants, outcome),
        };
        samples.extend(&outcome.modes);
        samples
    }

    /// The rows at the compared instants, and the last.
    fn rows(&self, instants: &[(usize, f64)], outcome: &Outcome) -> Samples {
        let mut samples = Vec::new();
        let mut from = 0;
        for &(stage, clock) in instants {
            match outcome.row_at(from, stage, clock) {
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

    /// Outputs that are zero throughout have no size that an error could be measured by.
    pub fn refuse_nothing(&self, scales: &[f64]) -> Result<(), Diagnostic> {
        if self.outputs.iter().any(|&k| scales[k] > 0.0) {
            return Ok(());
        }
        let message = "all outputs are zero from beginning to end: no error can be measured of them";
        Err(Diagnostic::whole(message).help("does a load act on what [output] names? name other `nodes` or `columns`"))
    }

    /// Rows of the history, then the modes, each with the number of the column that it begins with.
    fn split<'s>(&self, samples: &'s [f64]) -> impl Iterator<Item = (usize, &'s [f64])> {
        let modes = self.columns.len() - self.of_history;
        let (history, modes) = samples.split_at(samples.len().saturating_sub(modes));
        let modes = (!modes.is_empty()).then_some((self.of_history, modes));
        history.chunks(self.of_history.max(1)).map(|row| (0, row)).chain(modes)
    }

    /// The difference of each column, over its scale; NaN where there is nothing to compare.
    pub fn differences(&self, came: &Samples, reference: &Samples, scales: &[f64]) -> Vec<f64> {
        let mut sums = vec![(0.0_f64, 0.0_f64, 0_u64); self.columns.len()];
        if came.len() != reference.len() {
            return vec![f64::NAN; self.columns.len()];
        }
        for ((first, a), (_, b)) in self.split(came).zip(self.split(reference)) {
            let mut nearest = a.to_vec();
            self.take_nearest(first, &mut nearest, b);
            for (k, (a, b)) in nearest.iter().zip(b).enumerate().filter(|(_, (a, b))| !(a.is_nan() || b.is_nan())) {
                let difference = (a - b).abs();
                let (largest, squares, count) = &mut sums[first + k];
                (*largest, *squares, *count) =
                    (largest.max(difference), *squares + difference * difference, *count + 1);
            }
        }
        let norm = |(&(largest, squares, count), &scale): (&(f64, f64, u64), &f64)| match self.norm {
            _ if count == 0 || scale == 0.0 => f64::NAN,
            NormWord::Rms => (squares / count as f64).sqrt() / scale,
            _ => largest / scale,
        };
        sums.iter().zip(scales).map(norm).collect()
    }

    /// The largest difference of all outputs that count.
    pub fn distance(&self, came: &Samples, reference: &Samples, scales: &[f64]) -> f64 {
        self.worst(&self.differences(came, reference, scales))
    }

    /// The largest of the outputs that count; NaN where none can be compared.
    pub fn worst(&self, differences: &[f64]) -> f64 {
        self.outputs.iter().map(|&k| differences[k]).fold(f64::NAN, f64::max)
    }

    /// `one` and `weight` times its departure from `other`, number by number.
    pub fn extrapolated(&self, one: &Samples, other: &Samples, weight: f64) -> Samples {
        let mut all = Vec::with_capacity(one.len());
        for ((first, a), (_, b)) in self.split(one).zip(self.split(other)) {
            let mut nearest = b.to_vec();
            self.take_nearest(first, &mut nearest, a);
            all.extend(a.iter().zip(&nearest).map(|(a, b)| a + weight * (a - b)));
        }
        all
    }

    /// The order over the width of elements of an order at which errors of smooth scenes fall: twice that at nodes, or that at which the elements
    /// come near a curved line, and at which nodes stand for what is lumped to them; one more than that between nodes; `None` where outputs count that are not motions.
    pub fn order_in_space(&self, order: usize, relative: bool) -> Option<Expected> {
        let motion = |&k: &usize| mesh_error(&self.columns[k]) == MeshError::Nodes;
        let between = |&k: &usize| {
            let node = self.columns[k].rsplit_once('.').map_or("", |(node, _)| node);
            let place = node.split_once('@').map_or("", |(_, place)| place);
            node.contains(':') || !["", "start", "end"].contains(&place)
        };
        // An even order's errors of the line itself cancel from end to end of an element.
        let line = 2 * ((order + 2) / 2);
        let (expected, at_least) = match () {
            () if self.outputs.iter().any(between) => (1 + order, true),
            () if self.curved || (relative && self.lumped) => (line.min(2 * order), line < 2 * order),
            () => (2 * order, false),
        };
        self.outputs.iter().all(motion).then_some(Expected { order: expected as f64, at_least })
    }

    /// Replaces values of a row that are not unique by those that mean the same and are nearest to another row's. `first`
    /// is the number of the first column of the rows.
    pub fn take_nearest(&self, first: usize, row: &mut [f64], to: &[f64]) {
        for group in &self.ambiguous {
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

/// Levels of static stages, and multiples of the coarsest step of dynamic ones, after that step halved some times; paths have no instants in
/// common but their ends.
fn instants(deck: &Deck, coarsest: Pace, halvings: i32) -> Vec<(usize, f64)> {
    let mut all = Vec::new();
    let mut start = 0.0;
    for (k, stage) in deck.stages.iter().enumerate() {
        match stage.body {
            StageBody::Static { steps, .. } => {
                all.extend(thinned(steps).map(|level| (k + 1, level as f64 / steps as f64)));
            }
            StageBody::Dynamic { end, step, .. } => {
                let own = if let Pace::Steps(factor) = coarsest { Some(step * factor) } else { None };
                // Rows at multiples of an interval are there with any step.
                let (first, apart) = match deck.output.interval {
                    Some(interval) => ((start / interval * (1.0 + SAME)).floor() * interval, Some(interval)),
                    None => (start, own),
                };
                if let Some(apart) = apart {
                    all.extend((1..=halvings).rev().map(|n| (k + 1, first + apart * 0.5_f64.powi(n))));
                    let count = ((end - first) / apart * (1.0 + SAME)).floor() as usize;
                    all.extend(thinned(count).map(|n| (k + 1, first + n as f64 * apart)));
                }
                all.push((k + 1, end));
                start = end;
            }
            _ => {}
        }
    }
    all
}

/// Numbers from 1 to `count`, evenly, not too many; and, as motions begin with what jumps, some of the first.
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
}
