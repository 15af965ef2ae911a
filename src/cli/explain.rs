//! `beamsim explain`

use super::console;
use super::status::Status;
use crate::deck::{self, Entry, Hint};
use crate::output::Units;
use beamsim_core::probe::{
    COLUMNS, ColumnGroup, ColumnPart, ENERGY_WITH_CONTACTS, STRESS_AT_POINT, STRESS_WITH_INDEX, Source, find_part,
};

/// Line width of explanations, in columns of the terminal.
const WIDTH: usize = 96;

/// Prints the description of a key, a table or a word of the deck, or of a column of results.
pub fn explain(name: &str) -> Status {
    let mut texts: Vec<String> = deck::explain(name).iter().map(describe).collect();
    // `tip.uz` is a column; `stage.load` is none.
    let column = if texts.is_empty() { name.rsplit('.').next().unwrap_or(name) } else { name };
    texts.extend(describe_columns(column.trim()));
    if texts.is_empty() {
        let columns: Vec<&str> = COLUMNS.iter().flat_map(ColumnGroup::suffixes).collect();
        let help = match deck::similar(name, &columns) {
            Hint::Use(meant) => format!("did you mean `{meant}`?"),
            Hint::Near(meant) => format!("did you mean `{meant}`?"),
            Hint::Text(help) => help.into(),
            Hint::None => "tables are listed by `beamsim explain deck`, their keys by their names".into(),
        };
        console::error("usage", &format!("there is no key, word or column `{name}`: {help}"));
        return Status::Wrong;
    }
    console::answer(&texts.join("\n\n"));
    Status::Fine
}

fn describe(entry: &Entry) -> String {
    let needed = if entry.required { " (required)" } else { "" };
    let heading = match &entry.word {
        Some(word) => format!("{word}, a value of `{}` in {}", entry.key(), entry.table),
        None => format!("{}, in {}{needed}", entry.key(), entry.table),
    };
    let mut lines = vec![heading];
    lines.extend(broken(&entry.description, "  "));
    let mut facts = vec![entry.kinds.clone()];
    facts.extend(entry.unit.as_ref().map(|unit| format!("unit: {unit}")));
    facts.extend(entry.default.as_ref().map(|default| format!("default: {default}")));
    facts.retain(|fact| !fact.is_empty());
    lines.extend(broken(&facts.join("; "), "  "));
    if !entry.keys.is_empty() {
        lines.extend(broken(&format!("keys: {}", entry.keys.join(", ")), "  "));
    }
    lines.extend(entry.examples.iter().map(|example| format!("    {example}")));
    lines.join("\n")
}

/// Descriptions of the columns of a group (`u`), or of one column (`uz`, `omega`).
fn describe_columns(name: &str) -> Vec<String> {
    let of_group = |group: &'static ColumnGroup| {
        let is_whole = group.key == name;
        let parts = group.parts.iter().filter(move |part| is_whole || part.suffixes.contains(&name));
        parts.map(|part| describe_part(group, part)).collect::<Vec<_>>()
    };
    let mut texts: Vec<String> = COLUMNS.iter().flat_map(of_group).collect();
    if texts.is_empty() {
        // Columns that a group has in some scenes alone.
        let others = [&ENERGY_WITH_CONTACTS, &STRESS_WITH_INDEX, &STRESS_AT_POINT];
        texts.extend(others.into_iter().flat_map(of_group));
    }
    // Columns of modes and critical loads belong to no group.
    match find_part(name) {
        Some(part) if texts.is_empty() => {
            vec![format!("{name}, a column of modes.csv\n  {}{}", part.title, unit(part))]
        }
        Some(_) | None => texts,
    }
}

fn describe_part(group: &ColumnGroup, part: &ColumnPart) -> String {
    let owner = match group.source {
        Source::Place(_) => "a node or a place on a beam",
        Source::Node(_) => "a node",
        Source::BeamPoint(_) | Source::Stress(_) => "a place on a beam",
        Source::StressPoint(_) => "a point of a section at a place on a beam",
        Source::Contact(_) => "a contact",
        Source::Scene(_) => "the whole scene",
        Source::Run(_) => "the run",
    };
    let before = match group.source {
        Source::StressPoint(_) => "arm@0.5.top",
        Source::Stress(_) => "arm@0.5",
        Source::Place(_) | Source::Node(_) | Source::BeamPoint(_) => "tip",
        Source::Contact(_) | Source::Scene(_) | Source::Run(_) => group.key,
    };
    let names: Vec<String> = part.suffixes.iter().map(|suffix| format!("{before}.{suffix}")).collect();
    let names = if names.is_empty() { group.key.to_string() } else { names.join(", ") };
    let how = match group.source {
        Source::Run(_) => "in every history".to_string(),
        Source::Place(_)
        | Source::Node(_)
        | Source::BeamPoint(_)
        | Source::Stress(_)
        | Source::StressPoint(_)
        | Source::Contact(_)
        | Source::Scene(_) => {
            format!("written by columns = [\"{}\"] in [output]", group.key)
        }
    };
    format!("{names}: columns of {owner}\n  {}{}; {how}", part.title, unit(part))
}

/// The dimension of a column, such as `; unit: force·length`.
fn unit(part: &ColumnPart) -> String {
    Units::dimensions().of_part(part).map_or(String::new(), |unit| format!("; unit: {unit}"))
}

/// Lines that fit a terminal.
fn broken(text: &str, indent: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() < WIDTH => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(format!("{indent}{word}")),
        }
    }
    lines
}
