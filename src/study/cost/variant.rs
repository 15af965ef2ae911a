//! Variants of a deck: other elements, orders, interpolations, schemes, steps and tolerances.

use super::order::Expected;
use super::placement::Placement;
use crate::deck::{Beam, Deck, Division, InterpolationWord, SchemeName, SchemeWord, StageBody, Words};
use crate::scene::Scene;
use crate::study::built::BuiltDeck;
use crate::study::change::Change;
use std::sync::Arc;

/// The work of a step of Lobatto's scheme over that of a step of the Newmark family.
const LOBATTO_WORK: f64 = 3.0;

/// A deck that a study varies.
#[derive(Clone, Copy)]
pub struct Original<'a> {
    /// Its text
    pub(crate) text: &'a str,
    /// The deck
    pub(crate) deck: &'a Deck,
}

impl Original<'_> {
    /// True if the text names nodes of a beam by number or place, as in `rod:3`.
    fn names_nodes_of(&self, beam: &Beam) -> bool {
        self.text.contains(&format!("{}:", beam.name.value))
    }
}

/// The part of a variant that all points of one line of the plot share. `None` stands for the
/// deck's own value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Family {
    /// Polynomial order of all elements
    pub order: Option<usize>,
    /// Interpolation of all beams
    pub interpolation: Option<InterpolationWord>,
    /// Scheme of all dynamic stages
    pub scheme: Option<SchemeName>,
}

/// The time steps of a variant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// The deck has no dynamic stage
    Timeless,
    /// The steps of the deck times a factor
    Steps(f64),
    /// Steps that adapt to a tolerance
    Adapts(f64),
}

/// A variant of a deck.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// Order, interpolation and scheme
    pub family: Family,
    /// Elements of each piece of each beam
    pub(crate) elements: Vec<Vec<usize>>,
    /// The places of their ends; `None` where the shape of the deck's mesh is kept. Then each piece
    /// has its own number of elements.
    pub(crate) placement: Option<Arc<Placement>>,
    /// The time steps
    pub pace: Pace,
    /// Factor of the tolerances of Newton's method
    pub(crate) newton: f64,
}

/// The fixed step that is taken: with rows at multiples of an interval, the largest whole part of
/// the interval up to `step`.
pub fn equal_part(deck: &Deck, step: f64) -> f64 {
    deck.output.interval.map_or(step, |interval| interval / (interval / step - 1e-9).ceil().max(1.0))
}

impl Family {
    /// Its name in tables and plots.
    pub fn name(&self) -> String {
        let order = self.order.map(|order| format!("order {order}"));
        let interpolation = self.interpolation.map(|word| word.word().to_string());
        let scheme = self.scheme.map(|name| name.word().to_string());
        let parts: Vec<String> = [order, interpolation, scheme].into_iter().flatten().collect();
        if parts.is_empty() { "the deck's".into() } else { parts.join(", ") }
    }
}

/// The dynamic stages of a deck with their numbers, from 0.
pub(in crate::study) fn dynamic_stages(deck: &Deck) -> impl Iterator<Item = (usize, StageBody)> {
    let stages = deck.stages.iter().enumerate().map(|(k, stage)| (k, stage.body));
    stages.filter(|(_, body)| matches!(body, StageBody::Dynamic { .. }))
}

impl Variant {
    /// A variant with the deck's tolerances of Newton's method.
    pub fn new(family: Family, elements: Vec<Vec<usize>>, pace: Pace) -> Self {
        Self { family, elements, placement: None, pace, newton: 1.0 }
    }

    /// The number of elements of all beams, with all their pieces.
    pub fn elements_of_all(&self, deck: &Deck) -> usize {
        let of_beam = |(beam, counts): (&Beam, &Vec<usize>)| match counts[..] {
            [each] => each * beam.pieces(),
            _ => counts.iter().sum(),
        };
        deck.beams.iter().zip(&self.elements).map(of_beam).sum()
    }

    /// The number of elements of all beams; a beam whose pieces share one number counts once.
    pub fn count(&self) -> usize {
        self.elements.iter().flatten().sum()
    }

    /// The width of its elements relative to the beams: errors are powers of it.
    pub fn width(&self) -> f64 {
        1.0 / self.count().max(1) as f64
    }

    /// The step of the first dynamic stage as it is taken (see `equal_part`), where steps are
    /// fixed.
    pub fn step(&self, deck: &Deck) -> Option<f64> {
        let Pace::Steps(factor) = self.pace else { return None };
        let StageBody::Dynamic { step, .. } = dynamic_stages(deck).next()?.1 else { return None };
        Some(equal_part(deck, step * factor))
    }

    /// An estimate of the work, to compare variants of one deck.
    pub fn work(&self) -> f64 {
        self.work_with(self.count())
    }

    /// The work if all pieces of all beams together have so many elements.
    pub fn work_with(&self, elements: usize) -> f64 {
        let order = self.family.order.unwrap_or(1) as f64;
        let paces = match self.pace {
            Pace::Timeless => 1.0,
            Pace::Steps(factor) => 1.0 / factor,
            Pace::Adapts(tolerance) => tolerance.powf(-1.0 / 3.0),
        };
        let of_scheme = if self.family.scheme == Some(SchemeName::Lobatto) { LOBATTO_WORK } else { 1.0 };
        (4.0 + elements as f64 * order * order) * paces * of_scheme
    }

    /// The changes that make this variant of a deck; none where it is the deck itself.
    pub fn changes(&self, original: Original) -> Vec<Change> {
        let deck = original.deck;
        let mut changes = Vec::new();
        for (k, (beam, elements)) in deck.beams.iter().zip(&self.elements).enumerate() {
            changes.extend(self.changes_of_beam(k, beam, elements, original));
        }
        for (k, body) in dynamic_stages(deck) {
            changes.extend(self.changes_of_stage(k, body));
        }
        if self.newton != 1.0 {
            for (stage, own) in deck.stages.iter().enumerate() {
                changes.push(Change::Tolerance { stage, tolerance: own.tolerance * self.newton });
            }
        }
        changes
    }

    fn changes_of_beam(&self, k: usize, beam: &Beam, elements: &[usize], original: Original) -> Vec<Change> {
        let order = self.family.order.unwrap_or(beam.order);
        let interpolation = self.family.interpolation.unwrap_or(beam.interpolation);
        let mut changes = Vec::new();
        let own = &beam.elements.value;
        let divisions: Vec<Division> = match &self.placement {
            Some(placement) => (0..).zip(elements).map(|(p, &count)| placement.division(k, p, count)).collect(),
            None => own.iter().zip(elements).map(|(division, &count)| division.with_count(count)).collect(),
        };
        if divisions != *own {
            changes.push(Change::Elements { beam: k, divisions });
        }
        if order != beam.order {
            changes.push(Change::Order { beam: k, order });
        }
        let has_other_nodes = !changes.is_empty();
        if interpolation != beam.interpolation {
            changes.push(Change::Interpolation { beam: k, word: interpolation });
        }
        // Node numbers keep the places that they have on the mesh of the deck.
        if has_other_nodes && beam.numbering.is_none() && original.names_nodes_of(beam) {
            let parts = beam.elements.value.iter().map(|division| division.steps(beam.order)).collect();
            changes.push(Change::Numbering { beam: k, parts });
        }
        changes
    }

    fn changes_of_stage(&self, stage: usize, body: StageBody) -> Vec<Change> {
        let StageBody::Dynamic { step, scheme, step_tolerance, .. } = body else { return Vec::new() };
        let mut changes = Vec::new();
        if let Some(name) = self.family.scheme.filter(|name| *name != scheme.name()) {
            changes.push(Change::Scheme { stage, name });
        }
        match self.pace {
            Pace::Timeless => {}
            Pace::Steps(factor) => {
                if factor != 1.0 {
                    changes.push(Change::Step { stage, step: step * factor });
                }
                if step_tolerance.is_some() {
                    changes.push(Change::Adaptive { stage, adaptive: false });
                }
            }
            Pace::Adapts(tolerance) => {
                if step_tolerance.is_none() {
                    changes.push(Change::Adaptive { stage, adaptive: true });
                }
                if step_tolerance != Some(tolerance) {
                    changes.push(Change::StepTolerance { stage, tolerance });
                }
            }
        }
        changes
    }
}

/// True if Lobatto's scheme may take the place of the scheme of a deck: that is the trapezoidal rule,
/// its sister of second order, and there are neither contacts, whose forces have kinks, nor
/// multipliers, which need dissipation.
pub(in crate::study) fn may_take_lobatto(deck: &Deck, scene: &Scene) -> bool {
    let is_trapezoidal = |body: StageBody| match body {
        StageBody::Dynamic { scheme: SchemeWord::Newmark(beta, gamma), .. } => beta == 0.25 && gamma == 0.5,
        StageBody::Dynamic { .. }
        | StageBody::Static { .. }
        | StageBody::Path { .. }
        | StageBody::Modal { .. }
        | StageBody::Buckling { .. } => false,
    };
    let model = &scene.plan.model;
    let stages: Vec<(usize, StageBody)> = dynamic_stages(deck).collect();
    let suits = !stages.is_empty()
        && stages.iter().all(|&(_, body)| is_trapezoidal(body))
        && model.multipliers.is_empty()
        && model.contacts().is_none();
    let change = |&(stage, _): &(usize, StageBody)| Change::Scheme { stage, name: SchemeName::Lobatto };
    suits && BuiltDeck::changed(deck, &stages.iter().map(change).collect::<Vec<_>>()).is_ok()
}

/// The order of the scheme of a family's dynamic stages; `None` where they differ.
pub(in crate::study) fn order_in_time(deck: &Deck, family: &Family) -> Option<Expected> {
    let of_stage = |(_, body)| match body {
        // A change of scheme is to its usual coefficients.
        StageBody::Dynamic { scheme: SchemeWord::Newmark(_, gamma), .. } if family.scheme.is_none() && gamma != 0.5 => {
            1.0
        }
        StageBody::Dynamic { scheme, .. } if family.scheme.unwrap_or(scheme.name()) == SchemeName::Lobatto => 4.0,
        StageBody::Dynamic { .. }
        | StageBody::Static { .. }
        | StageBody::Path { .. }
        | StageBody::Modal { .. }
        | StageBody::Buckling { .. } => 2.0,
    };
    let mut orders = dynamic_stages(deck).map(of_stage);
    let first = orders.next()?;
    orders.all(|order| order == first).then_some(Expected { order: first, at_least: false })
}
