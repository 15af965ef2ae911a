//! `[[support]]`: held directions of a node.

use super::axes::{Axes, read_axes};
use super::diagnostic::{Diagnostic, Span, Spanned};
use super::hints;
use super::reader::{Context, Item, Table, kind_of};
use super::stage::read_stages;
use super::words::{Words, words};
use toml::de::DeValue;

/// `[[support]]`
#[derive(Clone, Debug)]
pub struct Support {
    /// The node
    pub(crate) at: Spanned<String>,
    /// Held ones of ux uy uz rx ry rz
    pub(crate) fix: [bool; 6],
    /// Directions of these; left out: the global axes
    pub axes: Option<Axes>,
    /// Stages from 1; left out: all
    pub stages: Option<Vec<usize>>,
    /// Place of the table
    pub(crate) span: Span,
}

words! {
    /// One direction of `fix`.
    pub enum DirectionWord {
        /// Displacement along the first axis
        Ux = "ux",
        /// Displacement along the second axis
        Uy = "uy",
        /// Displacement along the third axis
        Uz = "uz",
        /// First component of the rotation vector
        Rx = "rx",
        /// Second component of the rotation vector
        Ry = "ry",
        /// Third component of the rotation vector
        Rz = "rz",
    }
}

words! {
    /// Several directions of `fix` by one word.
    pub enum DirectionsWord {
        /// All six
        All = "all",
        /// The displacements
        Pin = "pin",
    }
}

impl DirectionsWord {
    fn held(self) -> [bool; 6] {
        match self {
            Self::All => [true; 6],
            Self::Pin => [true, true, true, false, false, false],
        }
    }
}

/// Keys of `[[support]]`.
pub(super) const KEYS: [&str; 4] = ["at", "fix", "axes", "stages"];

pub(super) fn read_support<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Support> {
    let table = Table::new(context, item, "[[support]]", &KEYS)?;
    let at = table.required_text("at");
    let fix = table.required("fix").and_then(|item| read_fix(context, item));
    let axes = read_axes(&table);
    let stages = read_stages(&table);
    Some(Support { at: at?, fix: fix?, axes: axes?, stages: stages?, span: table.span.clone() })
}

/// The forms that `fix` takes.
const FIX: &str = "`fix` must be \"all\", \"pin\" or a list of ux uy uz rx ry rz";

fn read_fix(context: &Context, item: &Item) -> Option<[bool; 6]> {
    match item.get_ref() {
        DeValue::String(word) => {
            if let Some(several) = DirectionsWord::of(word) {
                return Some(several.held());
            }
            if let Some(one) = DirectionWord::of(word) {
                return Some(std::array::from_fn(|k| k == one as usize));
            }
            let known: Vec<&str> = DirectionsWord::words().chain(DirectionWord::words()).collect();
            let help = hints::for_word("fix", word, &known).help();
            context.report(unknown_direction(word, item.span()).help(help.unwrap_or(FIX.into())));
            None
        }
        DeValue::Array(list) if list.iter().any(|entry| matches!(entry.get_ref(), DeValue::Integer(_))) => {
            context.wrong(item.span(), format!("{FIX}, not numbers"))
        }
        DeValue::Array(_) => {
            let words = context.texts(item)?;
            let mut fix = [false; 6];
            for word in &words {
                let Some(direction) = DirectionWord::of(&word.value) else {
                    let known: Vec<&str> = DirectionWord::words().collect();
                    let help = hints::for_word("fix", &word.value, &known).help();
                    let unknown = unknown_direction(&word.value, word.span.clone());
                    context.report(unknown.help(help.unwrap_or(FIX.into())));
                    return None;
                };
                let held = &mut fix[direction as usize];
                if *held {
                    return context.wrong(word.span.clone(), format!("`{}` is listed twice", word.value));
                }
                *held = true;
            }
            if words.is_empty() {
                return context.wrong(item.span(), "`fix` must not be empty");
            }
            Some(fix)
        }
        other => context.wrong(item.span(), format!("{FIX}, found {}", kind_of(other))),
    }
}

fn unknown_direction(word: &str, span: Span) -> Diagnostic {
    Diagnostic::error(format!("`{word}` is not a direction of `fix`"), span)
}
