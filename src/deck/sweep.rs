//! `sweep.toml`: the file of `beamsim sweep`.

use super::parameters::Parameters;
use super::reader::{Context, Item, Table, kind_of, literal};
use super::{Diagnostic, Spanned};
use std::cell::RefCell;
use toml::de::{DeTable, DeValue};

/// A sweep as it stands in its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SweepFile {
    /// The deck, seen from the folder of the file
    pub(crate) deck: String,
    /// Changes to the deck for all points, as in `--set`
    pub(crate) set: Vec<String>,
    /// Varied keys, in order
    pub(crate) vary: Vec<VaryTable>,
    /// True where the first values of all keys make the first point, and so on
    pub(crate) zip: bool,
    /// Number of samples
    pub(crate) sample: Option<usize>,
    /// Random seed
    pub(crate) seed: Option<u64>,
    /// Observables
    pub(crate) outputs: Vec<String>,
    /// True where errors of these are estimated
    pub(crate) error_bars: bool,
}

/// A key that is varied.
#[derive(Clone, Debug, PartialEq)]
pub struct VaryTable {
    /// As in `--set`
    pub(crate) key: Spanned<String>,
    /// Its values
    pub(crate) body: VaryBody,
}

/// Values of a key.
#[derive(Clone, Debug, PartialEq)]
pub enum VaryBody {
    /// These, each as TOML
    List(Vec<String>),
    /// Some between two numbers, or any
    Range {
        /// The first
        from: f64,
        /// The last
        to: f64,
        /// Number of values; none: samples are drawn
        count: Option<usize>,
        /// True where equal steps are equal factors
        log: bool,
    },
}

/// Keys of a sweep file.
const KEYS: [&str; 8] = ["deck", "vary", "set", "zip", "sample", "seed", "outputs", "error_bars"];
/// Keys of a range of values.
const RANGE_KEYS: [&str; 4] = ["from", "to", "count", "log"];
/// Most samples of a sweep, and most values of a key.
const MOST_SAMPLES: usize = 10_000_000;
/// Largest seed: floats hold whole numbers exactly up to here.
const LARGEST_SEED: usize = 1 << 53;

impl SweepFile {
    /// True if a text is a sweep: it names a deck.
    pub fn is_one(text: &str) -> bool {
        DeTable::parse(text).is_ok_and(|document| document.get_ref().contains_key("deck"))
    }

    /// Reads a sweep.
    pub fn read(text: &str) -> Result<Self, Vec<Diagnostic>> {
        let (document, syntax) = DeTable::parse_recoverable(text);
        if !syntax.is_empty() {
            return Err(super::describe_syntax(text, &syntax));
        }
        let context = Context {
            parameters: Parameters::default(),
            stage_count: 0,
            diagnostics: RefCell::default(),
            resolved: RefCell::default(),
        };
        let file = Self::of(&context, document.get_ref());
        let found = context.diagnostics.take();
        file.filter(|_| found.is_empty()).ok_or(found)
    }

    fn of(context: &Context, document: &DeTable) -> Option<Self> {
        let top = Table::top(context, document, "the sweep", &KEYS);
        let texts = |key: &str| top.get(key).map_or(Some(Vec::new()), |item| context.texts(item));
        let plain = |texts: Vec<Spanned<String>>| texts.into_iter().map(|text| text.value).collect();
        let whole = |key: &str, least, most| top.get(key).and_then(|item| context.whole(item, least, most));
        let zip = top.flag("zip").unwrap_or(false);
        if zip && top.has("sample") {
            return top.wrong_key("zip", "`sample` draws random points: remove `zip`, or `sample`");
        }
        let vary = Table::of_names(context, top.required("vary")?, "[vary]")?;
        Some(Self {
            deck: context.text(top.required("deck")?)?.value,
            set: plain(texts("set")?),
            vary: vary.entries().filter_map(|(key, item)| read_vary(context, key, item)).collect(),
            zip,
            sample: whole("sample", 1, MOST_SAMPLES).map(|count| count.value),
            seed: whole("seed", 0, LARGEST_SEED).map(|seed| seed.value as u64),
            outputs: plain(texts("outputs")?),
            error_bars: top.flag("error_bars").unwrap_or(false),
        })
    }
}

fn read_vary<'a>(context: &'a Context, key: Spanned<String>, item: &'a Item<'a>) -> Option<VaryTable> {
    let body = match item.get_ref() {
        DeValue::Array(values) => {
            VaryBody::List(values.iter().map(|value| as_toml(context, value)).collect::<Option<_>>()?)
        }
        DeValue::Table(_) => {
            let table = Table::new(context, item, format!("`{}`", key.value), &RANGE_KEYS)?;
            let from = table.required_number("from");
            let to = table.required_number("to");
            let count = table.optional("count", |context, item| context.whole(item, 1, MOST_SAMPLES));
            VaryBody::Range {
                from: from?.value,
                to: to?.value,
                count: count?.map(|count| count.value),
                log: table.flag("log").unwrap_or(false),
            }
        }
        other => {
            let message =
                format!("expected a list of values, or {{ from = …, to = …, count = … }}, found {}", kind_of(other));
            return context.wrong(item.span(), message);
        }
    };
    Some(VaryTable { key, body })
}

/// A value as it would stand in a deck.
fn as_toml(context: &Context, item: &Item) -> Option<String> {
    match item.get_ref() {
        DeValue::String(text) => Some(toml_edit::Value::from(text.as_ref()).to_string()),
        DeValue::Boolean(value) => Some(value.to_string()),
        DeValue::Array(values) => {
            let values: Vec<String> = values.iter().map(|value| as_toml(context, value)).collect::<Option<_>>()?;
            Some(format!("[{}]", values.join(", ")))
        }
        value => match (literal(value), value) {
            (Some(number), DeValue::Integer(_)) => Some(format!("{number}")),
            (Some(number), _) => Some(format!("{number:?}")),
            (None, other) => context.wrong(item.span(), format!("a value in a deck cannot be {}", kind_of(other))),
        },
    }
}
