//! `[cost]`: what a study of accuracy and time varies, and what it looks at.

use super::Deck;
use super::diagnostic::{Diagnostic, Spanned};
use super::geometry::InterpolationWord;
use super::reader::{Context, Item, Table, choose};
use beamsim_core::warning::WarningKind;
use toml::de::DeValue;

/// `[cost]`; what is left out is chosen by the study.
#[derive(Clone, Debug, Default)]
pub struct Cost {
    /// Columns whose error counts; default: all that are written
    pub outputs: Option<Vec<Spanned<String>>>,
    /// How the error of a column is measured
    pub norm: Option<NormWord>,
    /// Factors of the numbers of elements of the deck, for its own order
    pub elements: Option<Vec<f64>>,
    /// Polynomial orders of all elements
    pub order: Option<Vec<usize>>,
    /// Interpolations of all beams
    pub interpolation: Option<Vec<InterpolationWord>>,
    /// Schemes of all dynamic stages
    pub scheme: Option<Vec<&'static str>>,
    /// Factors of the steps of the deck
    pub step: Option<Vec<f64>>,
    /// Tolerances of steps that adapt
    pub step_tolerance: Option<Vec<f64>>,
}

/// How the difference between two histories of a column becomes a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormWord {
    /// The largest difference at any compared instant
    #[default]
    History,
    /// The root of the mean square over compared instants
    Rms,
    /// The difference at the end
    End,
    /// The difference of the largest magnitudes over all converged rows
    Max,
}

impl NormWord {
    const WORDS: [(&'static str, Self); 4] =
        [("history", Self::History), ("rms", Self::Rms), ("end", Self::End), ("max", Self::Max)];

    /// How it is measured, as the end of a sentence about an error.
    pub fn described(self) -> &'static str {
        match self {
            Self::History => "the largest difference at any compared instant",
            Self::Rms => "the root of the mean square over compared instants",
            Self::End => "the difference at the end",
            Self::Max => "the difference of the largest magnitudes",
        }
    }
}

/// The schemes by their words in the deck.
pub const SCHEMES: [&str; 4] = ["newmark", "hht", "generalized_alpha", "lie_generalized_alpha"];

const KEYS: [&str; 8] = ["outputs", "norm", "elements", "order", "interpolation", "scheme", "step", "step_tolerance"];

impl Cost {
    pub(super) fn read(top: &Table) -> Self {
        let Some(item) = top.get("cost") else { return Self::default() };
        let Some(table) = Table::new(top.context, item, "[cost]", &KEYS) else { return Self::default() };
        if let (true, true) = (table.has("step"), table.has("step_tolerance")) {
            let message = "give factors of `step`, or `step_tolerance` of steps that adapt, not both";
            table.context.wrong::<()>(table.key_span("step_tolerance"), message);
        }
        let words = NormWord::WORDS.map(|(word, _)| word);
        let norm = table.word("norm", &words).and_then(|word| NormWord::WORDS.into_iter().find(|n| n.0 == word.value));
        Self {
            outputs: table.get("outputs").and_then(|item| one_or_more(table.context, item, Context::text)),
            norm: norm.map(|(_, norm)| norm),
            elements: positive(&table, "elements"),
            order: table.get("order").and_then(|item| {
                one_or_more(table.context, item, |context, item| context.whole(item, 1, 3).map(|n| n.value))
            }),
            interpolation: chosen(&table, "interpolation", &["relative", "total"]).map(|words| {
                let word = |word| if word == "total" { InterpolationWord::Total } else { InterpolationWord::Relative };
                words.into_iter().map(word).collect()
            }),
            scheme: chosen(&table, "scheme", &SCHEMES),
            step: positive(&table, "step"),
            step_tolerance: positive(&table, "step_tolerance"),
        }
    }
}

/// Keys that vary what the deck has nothing of.
pub fn warn_of_idle_keys(top: &Table, deck: &Deck) {
    let Some(DeValue::Table(given)) = top.get("cost").map(|item| item.get_ref()) else { return };
    let moves = deck.stages.iter().any(|stage| stage.body.advances_time());
    for key in given.keys() {
        let message = match key.get_ref().as_ref() {
            "elements" | "order" | "interpolation" if deck.beams.is_empty() => {
                "there are no beams whose mesh could vary"
            }
            "step" | "step_tolerance" | "scheme" if !moves => "there is no dynamic stage whose steps could vary",
            _ => continue,
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

/// Factors are no further from one than this.
const FARTHEST_FACTOR: f64 = 1e3;
/// And tolerances.
const FARTHEST_TOLERANCE: f64 = 1e12;

fn positive(table: &Table, key: &str) -> Option<Vec<f64>> {
    let farthest = if key == "step_tolerance" { FARTHEST_TOLERANCE } else { FARTHEST_FACTOR };
    one_or_more(table.context, table.get(key)?, |context, item| {
        let number = context.number(item)?;
        match (1.0 / farthest..=farthest).contains(&number.value) {
            true => Some(number.value),
            false => {
                let message = format!("`{key}` lies from {:e} to {farthest:e}, found {}", 1.0 / farthest, number.value);
                context.wrong(number.span, message)
            }
        }
    })
}

fn chosen(table: &Table, key: &str, words: &[&'static str]) -> Option<Vec<&'static str>> {
    one_or_more(table.context, table.get(key)?, |context, item| {
        choose(context, &context.text(item)?, key, words).map(|word| word.value)
    })
}
