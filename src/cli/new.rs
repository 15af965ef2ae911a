//! `beamsim new`

use super::console;
use super::error::CommandError;
use super::status::Status;
use crate::deck::SCHEMA;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Starter decks.
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

/// Writes a starter deck; a file that exists is left as it is.
pub fn new(template: Template, out: Option<&Path>) -> Status {
    use clap::ValueEnum;
    let name = template.to_possible_value().map_or(String::new(), |value| value.get_name().to_string());
    let path = out.map_or_else(|| PathBuf::from(format!("{name}.toml")), Path::to_path_buf);
    match write(template.text(), &path) {
        Ok(()) => Status::Fine,
        Err(error) => {
            error.print();
            error.status()
        }
    }
}

/// Writes a deck with the schema beside it; a file that exists is left as it is.
pub fn write(text: &str, path: &Path) -> Result<(), CommandError> {
    match create(path, text).and_then(|()| schema_beside(path)) {
        Ok(()) => {
            let word = quoted(path);
            let path = path.display();
            console::line(&format!("{path}: next `beamsim check {word}`, then `beamsim run {word}`"));
            Ok(())
        }
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(CommandError::Io(format!(
            "{}: already exists, and decks are not overwritten, not even with --force (use --out for another name)",
            path.display()
        ))),
        Err(error) => Err(CommandError::Io(format!("{}: {error}", path.display()))),
    }
}

/// Creates a file with its whole text, or none.
fn create(path: &Path, text: &str) -> std::io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(text.as_bytes()).inspect_err(|_| drop(std::fs::remove_file(path)))
}

/// A path as one word of a command line.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:=@%".contains(c);
    if text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

/// The schema that the deck names in its first line, for editors.
fn schema_beside(path: &Path) -> std::io::Result<()> {
    let schema = path.with_file_name("beamsim.schema.json");
    // Never through a link that stands there.
    match create(&schema, SCHEMA) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => Err(error),
        Ok(()) | Err(_) => Ok(()),
    }
}
