//! `[cost]`: variants and outputs of a study of accuracy and time.

use super::Deck;
use super::beam::InterpolationWord;
use super::diagnostic::{Diagnostic, Spanned};
use super::reader::{Context, Item, Table};
use super::scheme::SchemeName;
use super::words::{Words, words};
use beamsim_core::warning::WarningKind;
use toml::de::DeValue;

/// `[cost]`; the study chooses values of keys that are left out.
#[derive(Clone, Debug, Default)]
pub struct Cost {
    /// Columns whose error counts; default: all that are written
    pub(crate) outputs: Option<Vec<Spanned<String>>>,
    /// Measure of the error of a column
    pub(crate) norm: Option<NormWord>,
    /// Factors of the numbers of elements of the deck, for its own order
    pub(crate) elements: Option<Vec<f64>>,
    /// Polynomial orders of all elements
    pub(crate) order: Option<Vec<usize>>,
    /// Interpolations of all beams
    pub(crate) interpolation: Option<Vec<InterpolationWord>>,
    /// Schemes of all dynamic stages
    pub(crate) scheme: Option<Vec<SchemeName>>,
    /// Factors of the steps of the deck
    pub(crate) step: Option<Vec<f64>>,
    /// Tolerances of steps that adapt
    pub(crate) step_tolerance: Option<Vec<f64>>,
}

words! {
    /// Measure of the difference between two histories of a column.
    #[derive(Default)]
    pub enum NormWord {
        /// The largest difference at any compared instant
        #[default]
        History = "history",
        /// The root of the mean square over compared instants
        Rms = "rms",
        /// The difference at the end
        End = "end",
        /// The difference of the largest magnitudes over all converged rows
        Max = "max",
    }
}

impl NormWord {
    /// The measure in words, as the end of a sentence about an error.
    pub fn described(self) -> &'static str {
        match self {
            Self::History => "the largest difference at any compared instant",
            Self::Rms => "the root of the mean square over compared instants",
            Self::End => "the difference at the end",
            Self::Max => "the difference of the largest magnitudes",
        }
    }
}

/// Keys of `[cost]`.
pub(super) const KEYS: [&str; 8] =
    ["outputs", "norm", "elements", "order", "interpolation", "scheme", "step", "step_tolerance"];

impl Cost {
    pub(super) fn read(top: &Table) -> Self {
        let Some(item) = top.get("cost") else { return Self::default() };
        let Some(table) = Table::new(top.context, item, "[cost]", &KEYS) else { return Self::default() };
        if table.has("step") {
            table.refuse("step_tolerance", "give factors of `step`, or `step_tolerance` of steps that adapt, not both");
        }
        let order = |context: &Context, item: &Item| context.whole(item, 1, 3).map(|order| order.value);
        Self {
            outputs: table.get("outputs").and_then(|item| one_or_more(table.context, item, Context::text)),
            norm: table.word("norm").map(|norm| norm.value),
            elements: read_factors(&table, "elements", FARTHEST_FACTOR),
            order: table.get("order").and_then(|item| one_or_more(table.context, item, order)),
            interpolation: read_words(&table, "interpolation"),
            scheme: read_words(&table, "scheme"),
            step: read_factors(&table, "step", FARTHEST_FACTOR),
            step_tolerance: read_factors(&table, "step_tolerance", FARTHEST_TOLERANCE),
        }
    }
}

/// Keys of `[cost]` that vary the mesh of beams.
const OF_BEAMS: [&str; 3] = ["elements", "order", "interpolation"];
/// Keys of `[cost]` that vary the steps of dynamic stages.
const OF_STEPS: [&str; 3] = ["step", "step_tolerance", "scheme"];

/// Warns of keys that vary beams or dynamic stages where the deck has none.
pub fn warn_of_idle_keys(top: &Table, deck: &Deck) {
    let Some(DeValue::Table(given)) = top.get("cost").map(|item| item.get_ref()) else { return };
    let moves = deck.stages.iter().any(|stage| stage.body.kind().advances_time());
    for key in given.keys() {
        let name: &str = key.get_ref();
        let message = if OF_BEAMS.contains(&name) && deck.beams.is_empty() {
            "there are no beams whose mesh could vary"
        } else if OF_STEPS.contains(&name) && !moves {
            "there is no dynamic stage whose steps could vary"
        } else {
            continue;
        };
        top.context.report(Diagnostic::warning(WarningKind::IdleCostKey, message, key.span()));
    }
}

/// A list that is not empty, or one entry of it.
fn one_or_more<T>(context: &Context, item: &Item, read: impl Fn(&Context, &Item) -> Option<T>) -> Option<Vec<T>> {
    let DeValue::Array(array) = item.get_ref() else { return Some(vec![read(context, item)?]) };
    if array.is_empty() {
        return context.wrong(item.span(), "the list must not be empty");
    }
    array.iter().map(|entry| read(context, entry)).collect()
}

/// Largest factor of `elements` and `step`, and the inverse of the smallest.
const FARTHEST_FACTOR: f64 = 1e3;
/// Largest `step_tolerance`, and the inverse of the smallest.
const FARTHEST_TOLERANCE: f64 = 1e12;

fn read_factors(table: &Table, key: &str, farthest: f64) -> Option<Vec<f64>> {
    one_or_more(table.context, table.get(key)?, |context, item| {
        let number = context.number(item)?;
        if (1.0 / farthest..=farthest).contains(&number.value) {
            return Some(number.value);
        }
        let message = format!("`{key}` must be between {:e} and {farthest:e}, found {}", 1.0 / farthest, number.value);
        context.wrong(number.span, message)
    })
}

fn read_words<W: Words>(table: &Table, key: &str) -> Option<Vec<W>> {
    one_or_more(table.context, table.get(key)?, |context, item| context.word(item, key).map(|word| word.value))
}
