//! Files that a command is about to write: none that this program did not write is replaced.

use super::error::CommandError;
use crate::output::{OutputKind, ResultFolder, may_replace, refuse_no_folder, remove_dead_parts};
use std::path::Path;
use std::sync::OnceLock;

static FORCE: OnceLock<bool> = OnceLock::new();

/// Sets whether plain files of others may be replaced, once.
pub fn configure(force: bool) {
    let _ = FORCE.set(force);
}

/// Refuses to write a file of a kind at a path where something else stands.
pub fn check_file(path: &Path, kind: OutputKind) -> Result<(), CommandError> {
    Ok(may_replace(path, kind, is_forced())?)
}

/// Claims a folder of results for a run.
pub fn claim(folder: &Path) -> Result<ResultFolder, CommandError> {
    Ok(ResultFolder::claim(folder, is_forced())?)
}

/// True if plain files of others may be replaced.
fn is_forced() -> bool {
    FORCE.get().copied().unwrap_or_default()
}

/// Refuses a folder of results that is none, or has something else in the place of its files, and
/// removes what dead processes have left half-written. The folder need not exist.
pub fn check_folder(folder: &Path, files: &[(&str, OutputKind)]) -> Result<(), CommandError> {
    refuse_no_folder(folder)?;
    remove_dead_parts(folder);
    files.iter().try_for_each(|(name, kind)| check_file(&folder.join(name), *kind))
}
