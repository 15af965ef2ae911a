//! `[history.NAME]`, and the key `history` of the tables that it drives.

use super::diagnostic::Spanned;
use super::expression::Expression;
use super::point::check_name;
use super::reader::{Context, Item, Table};
use super::stage::read_stages;
use toml::de::DeValue;

/// `history = "h"`, or `history = { name = "h", stages = [2] }`
#[derive(Clone, Debug)]
pub struct HistoryUse {
    /// The name of the history
    pub(crate) name: Spanned<String>,
    /// The stages that it belongs to, from 1: in others it stands still. Left out: it is read in
    /// all.
    pub(crate) stages: Option<Vec<usize>>,
}

impl HistoryUse {
    /// True where it is read in a stage, from 1.
    pub fn goes_on_in(&self, stage: usize) -> bool {
        self.stages.as_ref().is_none_or(|stages| stages.contains(&stage))
    }
}

/// `[history.NAME]`
#[derive(Clone, Debug)]
pub struct HistoryTable {
    /// Name of the table
    pub(crate) name: Spanned<String>,
    /// Table or expression
    pub(crate) body: HistoryBody,
}

/// A table or an expression of t.
#[derive(Clone, Debug)]
pub enum HistoryBody {
    /// Times and values
    Table {
        /// Increasing
        times: Vec<f64>,
        /// As many
        values: Vec<f64>,
        /// True where intervals are smooth steps, false where they are linear
        smooth: bool,
    },
    /// An expression of t, with the parameters put in
    Expression(Expression),
}

impl HistoryBody {
    /// The shortest interval in which a smooth table changes; `None` for others.
    pub fn shortest_smooth_step(&self) -> Option<f64> {
        let Self::Table { times, values, smooth: true } = self else { return None };
        let changes = times.windows(2).zip(values.windows(2)).filter(|(_, values)| values[0] != values[1]);
        changes.map(|(times, _)| times[1] - times[0]).reduce(f64::min)
    }
}

/// Keys of `[history.NAME]`.
pub(super) const KEYS: [&str; 6] = ["times", "values", "smooth", "expr", "csv", "column"];
/// Keys of `history = { … }`.
pub(super) const USE_KEYS: [&str; 2] = ["name", "stages"];

/// The history that a table names; `None` where it names none, or a wrong one, which is reported.
/// `acting`: the stages in which the table itself acts, where it does not in all.
pub(super) fn read_history_use(table: &Table, acting: Option<&Vec<usize>>) -> Option<HistoryUse> {
    let context = table.context;
    let item = table.get("history")?;
    if !matches!(item.get_ref(), DeValue::Table(_)) {
        return Some(HistoryUse { name: context.text(item)?, stages: None });
    }
    let named = Table::new(context, item, "`history`", &USE_KEYS)?;
    let name = named.required_text("name");
    let stages = read_stages(&named)?;
    let name = name?;
    let idle = |stage: &&usize| acting.is_some_and(|acting| !acting.contains(stage));
    if let Some(stage) = stages.iter().flatten().find(idle) {
        let message = format!(
            "the history `{}` is for stage {stage}, but {} is not active in that stage",
            name.value, table.what
        );
        named.refuse("stages", message);
    }
    Some(HistoryUse { name, stages })
}

pub(super) fn read_history<'a>(
    context: &'a Context,
    name: Spanned<String>,
    item: &'a Item<'a>,
) -> Option<HistoryTable> {
    let name = check_name(context, name)?;
    let what = format!("[history.{}]", name.value);
    let table = Table::new(context, item, what.clone(), &KEYS)?;
    if let Some(key) = ["csv", "column"].into_iter().find(|key| table.has(key)) {
        // Where the deck is a file, tables beside it stand in its text by now.
        return table.wrong_key(
            key,
            format!("`{key}` of {what} refers to a table that was not read: write `csv = \"file.csv\"`"),
        );
    }
    let body = if table.has("expr") {
        if let Some(key) = ["times", "values", "smooth"].into_iter().find(|key| table.has(key)) {
            return table.wrong_key(key, format!("{what} takes either `times` and `values`, or `expr`, not both"));
        }
        HistoryBody::Expression(read_expression(&table)?)
    } else {
        read_table(&table)?
    };
    Some(HistoryTable { name, body })
}

fn read_table(table: &Table) -> Option<HistoryBody> {
    let context = table.context;
    let times = table.required("times").and_then(|item| context.numbers(item, None));
    let values = table.required("values").and_then(|item| context.numbers(item, None));
    let smooth = table.flag_or("smooth", false)?;
    let times = times?;
    let values = values?;
    if times.value.is_empty() {
        return context.wrong(times.span, "`times` must not be empty");
    }
    if times.value.len() != values.value.len() {
        let message = format!("`times` has {} entries and `values` {}", times.value.len(), values.value.len());
        return context.wrong(values.span, message);
    }
    if let Some(pair) = times.value.windows(2).find(|pair| pair[1] <= pair[0]) {
        return context.wrong(times.span, format!("`times` must increase, but {} comes after {}", pair[1], pair[0]));
    }
    Some(HistoryBody::Table { times: times.value, values: values.value, smooth })
}

/// An expression of t, tried at t = 0.
fn read_expression(table: &Table) -> Option<Expression> {
    let context = table.context;
    let item = table.get("expr")?;
    let text = match item.get_ref() {
        DeValue::Integer(_) | DeValue::Float(_) => context.number(item)?.map(|v| v.to_string()),
        _ => context.text(item)?,
    };
    let value = |name: &str| if name == "t" { Some([0.0, 1.0, 0.0]) } else { context.parameters.get(name) };
    let tried = Expression::parse(&text.value).and_then(|expression| {
        expression.evaluate(&mut |name| value(name))?;
        Ok(expression)
    });
    match tried {
        Ok(expression) => Some(expression),
        Err(_) if context.parameters.is_broken(&text.value) => None,
        Err(error) => {
            context.report(error.diagnostic(&text.value, &text.span));
            None
        }
    }
}
