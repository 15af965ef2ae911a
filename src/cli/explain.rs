//! `beamsim explain`

use super::console;
use super::status::Status;
use crate::deck::{self, Entry};

/// Line width of explanations, in columns of the terminal.
const WIDTH: usize = 96;

/// Prints the description of a key or a table of the deck.
pub fn explain(key: &str) -> Status {
    match deck::explain(key) {
        Ok(entries) => {
            let texts: Vec<String> = entries.iter().map(describe).collect();
            console::answer(&texts.join("\n\n"));
            Status::Fine
        }
        Err(meant) => {
            let help = match meant {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => "keys and tables are listed by `beamsim explain deck`".into(),
            };
            console::error("usage", &format!("a deck has no `{key}`: {help}"));
            Status::Wrong
        }
    }
}

fn describe(entry: &Entry) -> String {
    let key = entry.path.rsplit('.').next().unwrap_or(&entry.path);
    let needed = if entry.required { " (required)" } else { "" };
    let mut lines = vec![format!("{key}, in {}{needed}", entry.table)];
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
