//! Folders of results.

use super::error::CommandError;
use super::load;
use std::path::{Path, PathBuf};

/// The folder of the results of a deck, which is one of several or the only one.
pub fn folder(out: Option<&Path>, name: &str, several: bool) -> PathBuf {
    match out {
        Some(folder) if several => folder.join(name),
        Some(folder) => folder.into(),
        None => Path::new("results").join(name),
    }
}

/// Refuses decks of the same name: their results would overwrite each other.
pub fn check_names(decks: &[PathBuf]) -> Result<(), CommandError> {
    let names: Vec<String> = decks.iter().map(|deck| load::name(deck)).collect();
    for (k, name) in names.iter().enumerate() {
        if names[..k].contains(name) {
            let message = format!("two decks are called `{name}`: their results would overwrite each other");
            return Err(CommandError::Usage(message));
        }
    }
    Ok(())
}
