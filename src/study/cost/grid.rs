//! The variants that a study of cost runs: families of elements, interpolations and schemes, each
//! on several meshes and with several steps.

use super::mesher::Mesher;
use super::variant::{Family, Pace, Variant, dynamic_stages, may_take_lobatto};
use crate::deck::{Cost, Deck, InterpolationWord, SchemeName, StageBody};
use crate::scene::Scene;
use beamsim_core::sorting::{sort_by, sort_numbers};

/// Orders, unless the deck names some.
const ORDERS: [usize; 3] = [1, 2, 3];
/// Interpolations, unless the deck names some.
const INTERPOLATIONS: [InterpolationWord; 2] = [InterpolationWord::Relative, InterpolationWord::Total];
/// Factors of the numbers of elements in scenes without dynamic stages, where runs are cheap.
const ELEMENTS_STATIC: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Factors of the numbers of elements in scenes with dynamic stages.
const ELEMENTS_DYNAMIC: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
/// Factors of fixed steps.
const STEPS: [f64; 4] = [2.0, 1.0, 0.5, 0.25];
/// Tolerances of adaptive steps.
const TOLERANCES: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];

/// The variants of a study: every family on every mesh with every pace, from coarse to fine.
pub struct Grid {
    /// The families
    pub(super) families: Vec<Family>,
    /// Factors of the numbers of elements, rising
    pub(super) meshes: Vec<f64>,
    /// The time steps, from coarse to fine
    pub(super) paces: Vec<Pace>,
}

impl Grid {
    /// The variants that [cost] of the deck asks for, with defaults for the rest: the scheme of the
    /// deck, and where it suits, Lobatto's with one interpolation.
    pub fn of(deck: &Deck, scene: &Scene) -> Self {
        let Cost { elements, order, interpolation, scheme, step, step_tolerance, .. } = deck.cost.clone();
        let bent = !deck.beams.is_empty();
        let dynamic = dynamic_stages(deck).next().is_some();
        // A list of one `None` keeps the product of all lists.
        let of_beams = |n: Vec<usize>| if bent { n.into_iter().map(Some).collect() } else { vec![None] };
        let orders = of_beams(order.unwrap_or(ORDERS.to_vec()));
        let words = interpolation.unwrap_or(INTERPOLATIONS.to_vec());
        let words = if bent { words.into_iter().map(Some).collect() } else { vec![None] };
        let schemes = scheme.filter(|_| dynamic).map_or(vec![None], |list| list.into_iter().map(Some).collect());
        let paces = paces(deck, step, step_tolerance);
        let mut families = Vec::new();
        for &scheme in &schemes {
            for &interpolation in &words {
                families.extend(orders.iter().map(|&order| Family { order, interpolation, scheme }));
            }
        }
        let chooses_scheme = schemes == [None] && matches!(paces[0], Pace::Steps(_));
        if chooses_scheme && may_take_lobatto(deck, scene) {
            let scheme = Some(SchemeName::Lobatto);
            families.extend(orders.iter().map(|&order| Family { order, interpolation: words[0], scheme }));
        }
        let usual = if dynamic { ELEMENTS_DYNAMIC.to_vec() } else { ELEMENTS_STATIC.to_vec() };
        let mut meshes = if bent { elements.unwrap_or(usual) } else { vec![1.0] };
        sort_numbers(&mut meshes);
        Self { families, meshes, paces }
    }

    /// Every variant once, by family, mesh and pace; two coarse meshes may be the same after
    /// rounding.
    pub fn variants(&self, mesher: &Mesher) -> Vec<Variant> {
        let mut variants: Vec<Variant> = Vec::new();
        for family in &self.families {
            for &mesh in &self.meshes {
                let elements = mesher.elements(family.order, mesh);
                for &pace in &self.paces {
                    let variant = Variant::new(family.clone(), elements.clone(), pace);
                    if !variants.contains(&variant) {
                        variants.push(variant);
                    }
                }
            }
        }
        variants
    }
}

/// The time steps of a study, from coarse to fine.
fn paces(deck: &Deck, step: Option<Vec<f64>>, step_tolerance: Option<Vec<f64>>) -> Vec<Pace> {
    let mut adapts =
        dynamic_stages(deck).map(|(_, body)| matches!(body, StageBody::Dynamic { step_tolerance: Some(_), .. }));
    let Some(first) = adapts.next() else { return vec![Pace::Timeless] };
    let falling = |mut list: Vec<f64>| {
        sort_by(&mut list, |a, b| b.total_cmp(a));
        list
    };
    if step_tolerance.is_some() || (first && step.is_none()) {
        return falling(step_tolerance.unwrap_or(TOLERANCES.to_vec())).into_iter().map(Pace::Adapts).collect();
    }
    falling(step.unwrap_or(STEPS.to_vec())).into_iter().map(Pace::Steps).collect()
}
