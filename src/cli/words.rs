//! What a user may want to read: the schema of the deck, what keys mean, starter decks, completions and the manual page.

use super::{Status, say};
use crate::deck::{Entry, SCHEMA, explain as explained};
use beamsim_core::failure::FailureKind;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Columns of a terminal that text is broken at.
const WIDTH: usize = 96;

/// `beamsim schema`
pub fn schema() -> Status {
    say::answer(SCHEMA.trim_end());
    Status::Fine
}

/// `beamsim explain`
pub fn explain(word: &str) -> Status {
    match explained(word) {
        Ok(entries) => {
            let told: Vec<String> = entries.iter().map(describe).collect();
            say::answer(&told.join("\n\n"));
            Status::Fine
        }
        Err(meant) => {
            let help = match meant {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => "keys and tables are listed by `beamsim explain deck`".into(),
            };
            say::error("usage", &format!("a deck has no `{word}`: {help}"));
            Status::Wrong
        }
    }
}

fn describe(entry: &Entry) -> String {
    let key = entry.path.rsplit('.').next().unwrap_or(&entry.path);
    let needed = if entry.required { " (needed)" } else { "" };
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

/// A deck to begin with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Template {
    /// A rod, clamped at one end, with a force at the other
    #[default]
    Cantilever,
    /// A portal that sways, with a distributed load, to its critical load
    Frame,
    /// A crank, driven by a motor through two joints
    Mechanism,
    /// A blade on a hub that spins up, and its modes while it turns
    RotatingBlade,
    /// A rod that flies freely, turned and bent
    FreeBody,
    /// A closed ring, squeezed by springs
    Ring,
}

impl Template {
    fn text(self) -> &'static str {
        match self {
            Self::Cantilever => include_str!("templates/cantilever.toml"),
            Self::Frame => include_str!("templates/frame.toml"),
            Self::Mechanism => include_str!("templates/mechanism.toml"),
            Self::RotatingBlade => include_str!("templates/rotating-blade.toml"),
            Self::FreeBody => include_str!("templates/free-body.toml"),
            Self::Ring => include_str!("templates/ring.toml"),
        }
    }
}

/// `beamsim new`: writes a deck where none is.
pub fn new(template: Template, out: Option<&Path>) -> Status {
    use clap::ValueEnum;
    let name = template.to_possible_value().map_or(String::new(), |value| value.get_name().to_string());
    let path = out.map_or_else(|| Path::new(&name).with_extension("toml"), Path::to_path_buf);
    let file = OpenOptions::new().write(true).create_new(true).open(&path);
    match file.and_then(|mut file| file.write_all(template.text().as_bytes())).and_then(|()| schema_beside(&path)) {
        Ok(()) => {
            let path = path.display();
            say::line(&format!("{path}: next `beamsim check {path}`, then `beamsim run {path}`"));
            Status::Fine
        }
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            say::error(
                FailureKind::Io.name(),
                &format!("{}: is there already, and is left as it is (--out names another)", path.display()),
            );
            Status::Io
        }
        Err(error) => {
            say::error(FailureKind::Io.name(), &format!("{}: {error}", path.display()));
            Status::Io
        }
    }
}

/// The schema that the deck names in its first line, for editors.
fn schema_beside(path: &Path) -> std::io::Result<()> {
    let schema = path.with_file_name("beamsim.schema.json");
    if schema.exists() { Ok(()) } else { std::fs::write(schema, SCHEMA) }
}

/// `beamsim completions`
pub fn completions(shell: clap_complete::Shell, mut command: clap::Command) -> Status {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut command, "beamsim", &mut text);
    say::answer(String::from_utf8_lossy(&text).trim_end());
    Status::Fine
}

/// `beamsim manual`: the manual page, and one of each command.
pub fn manual(command: clap::Command, folder: Option<&Path>) -> Status {
    let page = |command: &clap::Command| {
        let mut text = Vec::new();
        clap_mangen::Man::new(command.clone()).render(&mut text).map(|()| text)
    };
    let done = match folder {
        None => page(&command).map(|text| say::answer(String::from_utf8_lossy(&text).trim_end())),
        Some(folder) => std::fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(command, folder)),
    };
    match done {
        Ok(()) => Status::Fine,
        Err(error) => {
            say::error(FailureKind::Io.name(), &error.to_string());
            Status::Io
        }
    }
}
