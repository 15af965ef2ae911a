//! Which variants of a deck a study of cost runs: families of elements, interpolations and schemes, each on several meshes and with
//! several steps.

use super::order::Expected;
use super::sample::Sampler;
use super::trial;
use crate::deck::{Beam, Cost, Deck, InterpolationWord, SchemeName, SchemeWord, StageBody, Words};

/// Orders, unless the deck names some.
const ORDERS: [usize; 3] = [1, 2, 3];
/// Interpolations, unless the deck names some.
const INTERPOLATIONS: [InterpolationWord; 2] = [InterpolationWord::Relative, InterpolationWord::Total];
/// Factors of the numbers of elements in scenes without time, where runs are cheap.
const ELEMENTS_STATIC: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// And with time.
const ELEMENTS_DYNAMIC: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
/// Factors of steps.
const STEPS: [f64; 4] = [2.0, 1.0, 0.5, 0.25];
/// Tolerances of steps that adapt.
const TOLERANCES: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];

/// Largest part of the elements of a deck that is tried.
const MOST_PARTS: usize = 8;

/// What the runs of one line of the plot share; `None` for what the deck says, or has nothing of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Family {
    /// Polynomial order of all elements
    pub order: Option<usize>,
    /// Interpolation of all beams
    pub interpolation: Option<InterpolationWord>,
    /// Scheme of all dynamic stages
    pub scheme: Option<SchemeName>,
}

/// How time goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// There is no dynamic stage
    Timeless,
    /// With the steps of the deck times a factor
    Steps(f64),
    /// With steps that adapt to a tolerance
    Adapts(f64),
}

/// One variant of the deck.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Its family
    pub family: Family,
    /// Elements of each piece of each beam
    pub elements: Vec<Vec<usize>>,
    /// How time goes on
    pub pace: Pace,
    /// Factor of the tolerances of Newton's method
    pub newton: f64,
}

/// A fixed step as it is taken: where rows are wanted at multiples of an interval, an equal part of that.
pub fn equal_part(deck: &Deck, step: f64) -> f64 {
    deck.output.interval.map_or(step, |interval| interval / (interval / step - 1e-9).ceil().max(1.0))
}

/// The variants of a study: every family on every mesh with every pace, from coarse to fine.
pub struct Grid {
    /// The families
    pub families: Vec<Family>,
    /// Factors of the numbers of elements, rising
    pub meshes: Vec<f64>,
    /// How time goes on, ever finer
    pub paces: Vec<Pace>,
}

impl Family {
    /// Its name in tables and plots.
    pub fn name(&self) -> String {
        let order = self.order.map(|order| format!("order {order}"));
        let interpolation = self.interpolation.map(|word| word.word().to_string());
        let scheme = self.scheme.map(|scheme| scheme.word().to_string());
        let parts: Vec<String> = [order, interpolation, scheme].into_iter().flatten().collect();
        if parts.is_empty() { "the deck's".into() } else { parts.join(", ") }
    }
}

impl Grid {
    /// What the deck asks for, and the rest by custom.
    pub fn of(deck: &Deck) -> Self {
        let Cost { elements, order, interpolation, scheme, step, step_tolerance, .. } = deck.cost.clone();
        let bent = !deck.beams.is_empty();
        let dynamic = dynamic_stages(deck).next().is_some();
        // A list of one "nothing" keeps the product of all lists.
        let of_beams = |n: Vec<usize>| if bent { n.into_iter().map(Some).collect() } else { vec![None] };
        let orders = of_beams(order.unwrap_or(ORDERS.to_vec()));
        let words = interpolation.unwrap_or(INTERPOLATIONS.to_vec());
        let words = if bent { words.into_iter().map(Some).collect() } else { vec![None] };
        let schemes = scheme.filter(|_| dynamic).map_or(vec![None], |list| list.into_iter().map(Some).collect());
        let mut families = Vec::new();
        for scheme in schemes {
            for &interpolation in &words {
                families.extend(orders.iter().map(|&order| Family { order, interpolation, scheme }));
            }
        }
        let usual = if dynamic { ELEMENTS_DYNAMIC.to_vec() } else { ELEMENTS_STATIC.to_vec() };
        let mut meshes = if bent { elements.unwrap_or(usual) } else { vec![1.0] };
        meshes.sort_by(f64::total_cmp);
        Self { families, meshes, paces: paces(deck, step, step_tolerance) }
    }

    /// Every variant once, by family, mesh and pace; coarse meshes may be the same after rounding.
    pub fn points(&self, mesher: &Mesher) -> Vec<Point> {
        let mut points: Vec<Point> = Vec::new();
        for family in &self.families {
            for &mesh in &self.meshes {
                let elements = mesher.elements(family.order, mesh);
                for &pace in &self.paces {
                    let point = Point::new(family.clone(), elements.clone(), pace);
                    if !points.contains(&point) {
                        points.push(point);
                    }
                }
            }
        }
        points
    }
}

/// Finds meshes on which a deck still makes sense: there are nodes where something acts.
pub struct Mesher<'a> {
    /// The text of the deck
    pub text: &'a str,
    /// The deck
    pub deck: &'a Deck,
    /// What is looked at
    pub sampler: &'a Sampler,
    /// The interpolation of all beams; `None` for those of the deck
    pub interpolation: Option<InterpolationWord>,
    /// Whether outputs that are nodes of the deck's mesh shall be nodes of other meshes, too
    pub keeps_places: bool,
}

impl Mesher<'_> {
    /// Elements of each piece of each beam, as many as span a factor times the nodes of the deck; where that leaves something without its node,
    /// a multiple, or a whole part, of the elements of the deck.
    pub fn elements(&self, order: Option<usize>, factor: f64) -> Vec<Vec<usize>> {
        let ratio = |beam: &Beam| (beam.order as f64 / order.unwrap_or(beam.order) as f64) * factor;
        let each = |count: &dyn Fn(&Beam, usize) -> usize| -> Vec<Vec<usize>> {
            let of_beam = |beam: &Beam| beam.elements.value.iter().map(|&n| count(beam, n)).collect();
            self.deck.beams.iter().map(of_beam).collect()
        };
        let rounded = each(&|beam, n| (n as f64 * ratio(beam)).round().max(1.0) as usize);
        let rounded = self.by_units(order, &rounded, |count, unit| ((count + unit / 2) / unit).max(1) * unit);
        if self.makes_sense(order, &rounded) {
            return rounded;
        }
        let parts = (2..=MOST_PARTS).rev().filter(|q| {
            let whole = |beam: &Beam| *q as f64 * ratio(beam) <= 1.0 && beam.elements.value.iter().all(|n| n % q == 0);
            self.deck.beams.iter().all(whole)
        });
        let parts = parts.map(|q| each(&|_, n| n / q));
        let multiples = (0..MOST_PARTS).map(|more| each(&|beam, n| n * (ratio(beam).ceil() as usize + more)));
        parts.chain(multiples).find(|elements| self.makes_sense(order, elements)).unwrap_or(rounded)
    }

    /// A mesh to compare another with, and how many times as wide its elements are, at least: one with half the elements of each piece, or,
    /// where some piece has but one, with twice as many.
    pub fn companion(&self, order: Option<usize>, elements: &[Vec<usize>]) -> (Vec<Vec<usize>>, f64) {
        let each = |change: &dyn Fn(usize) -> usize| -> Vec<Vec<usize>> {
            elements.iter().map(|beam| beam.iter().map(|&count| change(count)).collect()).collect()
        };
        let coarse = self.by_units(order, elements, |count, unit| match count % unit {
            0 => (count / unit).div_ceil(2) * unit,
            _ => count.div_ceil(2),
        });
        let pairs = elements.iter().flatten().zip(coarse.iter().flatten());
        let ratio = pairs.map(|(&fine, &coarse)| fine as f64 / coarse as f64).fold(2.0, f64::min);
        if ratio > 1.0 && self.makes_sense(order, &coarse) {
            return (coarse, ratio);
        }
        (each(&|count| count.saturating_mul(2)), 0.5)
    }

    /// Changes the numbers of elements, with those that they are to be multiples of.
    fn by_units(
        &self,
        order: Option<usize>,
        elements: &[Vec<usize>],
        change: impl Fn(usize, usize) -> usize,
    ) -> Vec<Vec<usize>> {
        let orders = self.orders(order);
        let of_piece = |beam: usize, piece: usize, count: usize| {
            let Sampler { places, outputs, .. } = self.sampler;
            let unit = if self.keeps_places { places.unit((beam, piece), orders[beam], outputs, 2 * count) } else { 1 };
            change(count, unit)
        };
        let of_beam = |(beam, counts): (usize, &Vec<usize>)| {
            counts.iter().enumerate().map(|(piece, &count)| of_piece(beam, piece, count)).collect()
        };
        elements.iter().enumerate().map(of_beam).collect()
    }

    /// The orders of all beams.
    fn orders(&self, order: Option<usize>) -> Vec<usize> {
        self.deck.beams.iter().map(|beam| order.unwrap_or(beam.order)).collect()
    }

    /// For each column whether it lies between nodes of a mesh.
    pub fn between(&self, order: Option<usize>, elements: &[Vec<usize>]) -> Vec<bool> {
        self.sampler.places.between(elements, &self.orders(order))
    }

    /// Whether the deck makes sense with these elements of an order.
    pub fn makes_sense(&self, order: Option<usize>, elements: &[Vec<usize>]) -> bool {
        let family = Family { order, interpolation: self.interpolation, ..Family::default() };
        let point = Point::new(family, elements.to_vec(), Pace::Timeless);
        trial::makes_sense(self.text, &point.settings(self.deck, self.text), self.sampler)
    }
}

/// From coarse to fine.
fn paces(deck: &Deck, step: Option<Vec<f64>>, step_tolerance: Option<Vec<f64>>) -> Vec<Pace> {
    let mut adapts =
        dynamic_stages(deck).map(|(_, body)| matches!(body, StageBody::Dynamic { step_tolerance: Some(_), .. }));
    let Some(first) = adapts.next() else { return vec![Pace::Timeless] };
    let falling = |mut list: Vec<f64>| {
        list.sort_by(|a, b| b.total_cmp(a));
        list
    };
    if step_tolerance.is_some() || (first && step.is_none()) {
        return falling(step_tolerance.unwrap_or(TOLERANCES.to_vec())).into_iter().map(Pace::Adapts).collect();
    }
    falling(step.unwrap_or(STEPS.to_vec())).into_iter().map(Pace::Steps).collect()
}

/// The dynamic stages of a deck with their numbers, from 0.
pub(in crate::study) fn dynamic_stages(deck: &Deck) -> impl Iterator<Item = (usize, StageBody)> {
    let stages = deck.stages.iter().enumerate().map(|(k, stage)| (k, stage.body));
    stages.filter(|(_, body)| matches!(body, StageBody::Dynamic { .. }))
}

impl Point {
    /// With Newton's method as in the deck.
    pub fn new(family: Family, elements: Vec<Vec<usize>>, pace: Pace) -> Self {
        Self { family, elements, pace, newton: 1.0 }
    }

    /// Elements of a mesh of all beams, as far as their numbers stand in the deck.
    pub fn count(&self) -> usize {
        self.elements.iter().flatten().sum()
    }

    /// How coarse its mesh is: the order of an error is a power of this.
    pub fn width(&self) -> f64 {
        1.0 / self.count().max(1) as f64
    }

    /// The step of the first dynamic stage: where rows are wanted at multiples of an interval, an equal part of that.
    pub fn step(&self, deck: &Deck) -> Option<f64> {
        let Pace::Steps(factor) = self.pace else { return None };
        let StageBody::Dynamic { step, .. } = dynamic_stages(deck).next()?.1 else { return None };
        Some(equal_part(deck, step * factor))
    }

    /// About how much work it is, for runs of one deck.
    pub fn work(&self) -> f64 {
        let order = self.family.order.unwrap_or(1) as f64;
        let paces = match self.pace {
            Pace::Timeless => 1.0,
            Pace::Steps(factor) => 1.0 / factor,
            Pace::Adapts(tolerance) => tolerance.powf(-1.0 / 3.0),
        };
        (4.0 + self.count() as f64 * order * order) * paces
    }

    /// What must be set in a deck to become this variant: nothing where it is the deck as it stands. `text` is that of the deck.
    pub fn settings(&self, deck: &Deck, text: &str) -> Vec<String> {
        let mut settings = Vec::new();
        for (k, (beam, elements)) in deck.beams.iter().zip(&self.elements).enumerate() {
            settings.extend(self.settings_of_beam(k, beam, elements, text));
        }
        for (k, body) in dynamic_stages(deck) {
            settings.extend(self.settings_of_stage(k, body));
        }
        if self.newton != 1.0 {
            let tolerance = |(k, stage): (usize, &crate::deck::Stage)| {
                format!("stage.{k}.tolerance={:?}", stage.tolerance * self.newton)
            };
            settings.extend(deck.stages.iter().enumerate().map(tolerance));
        }
        settings
    }

    fn settings_of_beam(&self, k: usize, beam: &Beam, elements: &[usize], text: &str) -> Vec<String> {
        let order = self.family.order.unwrap_or(beam.order);
        let interpolation = self.family.interpolation.unwrap_or(beam.interpolation);
        let list = |counts: &[usize]| match counts {
            [one] => one.to_string(),
            several => format!("{several:?}").replace(' ', ""),
        };
        let mut settings = Vec::new();
        if elements != beam.elements.value {
            settings.push(format!("beam.{k}.elements={}", list(elements)));
        }
        if order != beam.order {
            settings.push(format!("beam.{k}.order={order}"));
        }
        let moved = !settings.is_empty();
        if interpolation != beam.interpolation {
            settings.push(format!("beam.{k}.interpolation={:?}", interpolation.word()));
        }
        // Numbers of nodes mean the places that they have on the mesh of the deck.
        if moved && beam.numbering.is_none() && text.contains(&format!("{}:", beam.name.value)) {
            let parts: Vec<usize> = beam.elements.value.iter().map(|count| count * beam.order).collect();
            settings.push(format!("beam.{k}.numbering={}", list(&parts)));
        }
        settings
    }

    fn settings_of_stage(&self, k: usize, body: StageBody) -> Vec<String> {
        let StageBody::Dynamic { step, scheme, step_tolerance, .. } = body else { return Vec::new() };
        let mut settings = Vec::new();
        if let Some(wanted) = self.family.scheme.filter(|wanted| *wanted != scheme.name()) {
            settings.push(format!("stage.{k}.scheme={:?}", wanted.word()));
        }
        match self.pace {
            Pace::Timeless => {}
            Pace::Steps(factor) => {
                if factor != 1.0 {
                    settings.push(format!("stage.{k}.step={:?}", step * factor));
                }
                if step_tolerance.is_some() {
                    settings.push(format!("stage.{k}.adaptive=false"));
                }
            }
            Pace::Adapts(tolerance) => {
                if step_tolerance.is_none() {
                    settings.push(format!("stage.{k}.adaptive=true"));
                }
                if step_tolerance != Some(tolerance) {
                    settings.push(format!("stage.{k}.step_tolerance={tolerance:?}"));
                }
            }
        }
        settings
    }
}

/// The order of the scheme of a family's dynamic stages; `None` where they differ.
pub(super) fn order_in_time(deck: &Deck, family: &Family) -> Option<Expected> {
    let of_stage = |(_, body)| match body {
        // A change of scheme is to its usual coefficients.
        StageBody::Dynamic { scheme: SchemeWord::Newmark(_, gamma), .. } if family.scheme.is_none() && gamma != 0.5 => {
            1.0
        }
        _ => 2.0,
    };
    let mut orders = dynamic_stages(deck).map(of_stage);
    let first = orders.next()?;
    orders.all(|order| order == first).then_some(Expected { order: first, at_least: false })
}
