//! `[[expect]]`: numbers, failures and warnings that a run is compared with.

use super::diagnostic::{Diagnostic, Spanned, one_of};
use super::hints::{self, nearest};
use super::reader::{Context, Item, Table, kind_of};
use super::words::{Words, words};
use beamsim_core::failure::FailureKind;
use beamsim_core::warning::WarningKind;
use toml::de::DeValue;

/// `[[expect]]`
#[derive(Clone, Debug)]
pub struct Expect {
    /// Expected number, failure or warning
    pub(crate) body: ExpectBody,
    /// Origin of the number
    pub(crate) source: Option<String>,
}

/// Kinds of expectations.
#[derive(Clone, Debug)]
pub enum ExpectBody {
    /// A number
    Column {
        /// Of this column
        column: Spanned<String>,
        /// Over rows or at one
        reduce: Reduce,
        /// Value with its tolerances
        value: Option<Target>,
        /// Upper bound
        below: Option<f64>,
        /// Lower bound
        above: Option<f64>,
    },
    /// A failure
    Fails(FailureKind),
    /// A warning of this kind
    Warns(WarningKind),
    /// No warning that puts an answer in doubt
    Quiet,
}

/// An expected value: a number may differ from it by atol + rtol |value|.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Expected number
    pub(crate) value: f64,
    /// Absolute tolerance
    pub(crate) atol: f64,
    /// Tolerance relative to the value
    pub(crate) rtol: f64,
}

/// The rows that an expectation reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reduce {
    /// One instant
    At(Instant),
    /// All rows
    Over(Reduction),
}

words! {
    /// One number from all rows of a column.
    pub enum Reduction {
        /// Largest
        Max = "max",
        /// Smallest
        Min = "min",
        /// Largest magnitude
        AbsMax = "absmax",
        /// Mean over rows
        Mean = "mean",
        /// Largest departure from the first row
        Drift = "drift",
    }
}

/// One instant of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Instant {
    /// The last row
    End,
    /// A time
    Time(f64),
    /// The first crossing of a load factor
    Load(f64),
}

words! {
    /// `at = …` by a word
    pub enum InstantWord {
        /// The last row
        End = "end",
    }
}

impl Words for FailureKind {
    const ALL: &'static [Self] = FailureKind::ALL;

    fn word(self) -> &'static str {
        self.name()
    }
}

/// Keys of `[[expect]]`.
pub(super) const KEYS: [&str; 11] =
    ["column", "at", "reduce", "value", "rtol", "atol", "below", "above", "source", "fails", "warns"];
/// Keys of `at = { … }`.
pub(super) const AT_KEYS: [&str; 1] = ["load"];

pub(super) fn read_expect<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Expect> {
    let table = Table::new(context, item, "[[expect]]", &KEYS)?;
    let source = table.text("source").map(|t| t.value);
    let body = if table.has("fails") {
        read_fails(&table)
    } else if table.has("warns") {
        read_warns(&table)
    } else {
        read_column(&table)
    };
    Some(Expect { body: body?, source })
}

/// Reports the first key beside `own` that an expectation of a whole run has no use for.
fn refuse_keys_beside(table: &Table, own: &str, what: &str) -> Option<()> {
    match KEYS.into_iter().find(|key| ![own, "source"].contains(key) && table.has(key)) {
        Some(key) => table.wrong_key(key, format!("`{key}` is not allowed in {what}")),
        None => Some(()),
    }
}

fn read_warns(table: &Table) -> Option<ExpectBody> {
    let context = table.context;
    refuse_keys_beside(table, "warns", "an expected warning")?;
    let item = table.get("warns")?;
    let name = match item.get_ref() {
        DeValue::Boolean(false) => return Some(ExpectBody::Quiet),
        DeValue::String(name) => name,
        _ => return context.wrong(item.span(), "`warns` must be the name of a warning, or false"),
    };
    if let Some(kind) = WarningKind::of(name) {
        return Some(ExpectBody::Warns(kind));
    }
    let names = WarningKind::ALL.iter().map(|kind| kind.name());
    let diagnostic = Diagnostic::error(format!("there is no warning `{name}`"), item.span());
    context.report(match nearest(name, names) {
        Some(meant) => diagnostic.help(format!("did you mean `{meant}`?")),
        None => diagnostic.help("`beamsim explain expect.warns` lists the warnings"),
    });
    None
}

fn read_fails(table: &Table) -> Option<ExpectBody> {
    refuse_keys_beside(table, "fails", "an expected failure")?;
    let name = table.text("fails")?;
    if let Some(failure) = FailureKind::of(&name.value) {
        return Some(ExpectBody::Fails(failure));
    }
    let known: Vec<&str> = FailureKind::words().collect();
    let hint = hints::for_word("fails", &name.value, &known).help();
    let help = hint.unwrap_or_else(|| format!("known failures: {}", one_of(known)));
    table.context.report(Diagnostic::error(format!("there is no failure `{}`", name.value), name.span).help(help));
    None
}

fn read_column(table: &Table) -> Option<ExpectBody> {
    let column = table.required_text("column");
    let reduce = read_reduce(table);
    let below = table.number("below").map(|v| v.value);
    let above = table.number("above").map(|v| v.value);
    if !table.has("value") {
        if let Some(key) = ["rtol", "atol"].into_iter().find(|key| table.has(key)) {
            return table.wrong_key(key, format!("`{key}` is only allowed with `value`"));
        }
        if !table.has("below") && !table.has("above") {
            return table.wrong("[[expect]] needs `value`, `below`, `above`, `fails` or `warns`");
        }
    }
    if let (Some(below), Some(above)) = (below, above)
        && above >= below
    {
        return table.wrong_key("above", format!("no number is above {above} and below {below}"));
    }
    let value = table.optional("value", |_, _| read_target(table));
    Some(ExpectBody::Column { column: column?, reduce: reduce?, value: value?, below, above })
}

fn read_target(table: &Table) -> Option<Target> {
    let value = table.number("value");
    let atol = table.non_negative_or("atol", 0.0);
    let rtol = table.non_negative_or("rtol", 0.0);
    if !table.has("atol") && !table.has("rtol") {
        return table.wrong_key("value", "`value` needs a tolerance: `rtol` or `atol`");
    }
    Some(Target { value: value?.value, atol: atol?, rtol: rtol? })
}

fn read_reduce(table: &Table) -> Option<Reduce> {
    let context = table.context;
    match (table.get("at"), table.get("reduce")) {
        (None, None) => Some(Reduce::At(Instant::End)),
        (Some(item), None) => read_instant(context, item).map(Reduce::At),
        (None, Some(_)) => table.word("reduce").map(|reduction| Reduce::Over(reduction.value)),
        (Some(_), Some(item)) => {
            context.wrong(item.span(), "use either `at` (one instant) or `reduce` (over all rows), not both")
        }
    }
}

fn read_instant<'a>(context: &'a Context, item: &'a Item<'a>) -> Option<Instant> {
    match item.get_ref() {
        DeValue::String(text) => match InstantWord::of(text) {
            Some(InstantWord::End) => Some(Instant::End),
            None => context.number(item).map(|v| Instant::Time(v.value)),
        },
        DeValue::Table(_) => {
            let table = Table::new(context, item, "`at`", &AT_KEYS)?;
            table.required_number("load").map(|v| Instant::Load(v.value))
        }
        DeValue::Integer(_) | DeValue::Float(_) => context.number(item).map(|v| Instant::Time(v.value)),
        other => context
            .wrong(item.span(), format!("`at` must be \"end\", a time or {{ load = … }}, found {}", kind_of(other))),
    }
}
