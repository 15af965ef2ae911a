//! The points that a process is running. If it dies, these are known: one of them may be the reason,
//! and would end the next process as well.

use crate::output::OutputError;
use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// End of the names of the files.
const EXTENSION: &str = "running";

/// A list of points that have begun. The process holds a lock on its file while it lives.
pub struct InFlight {
    path: PathBuf,
    file: Mutex<File>,
}

impl InFlight {
    /// A new list of this process, in the folder of the points.
    pub fn begin(folder: &Path) -> Result<Self, OutputError> {
        fs::create_dir_all(folder).map_err(|error| OutputError::file(folder, error))?;
        let mut number = 0;
        loop {
            let path = folder.join(format!("{}-{number}.{EXTENSION}", std::process::id()));
            match OpenOptions::new().append(true).create_new(true).open(&path) {
                Ok(file) => {
                    // Where files cannot be locked, a list that is left behind counts as one of a
                    // process that died.
                    let _ = file.try_lock();
                    return Ok(Self { path, file: Mutex::new(file) });
                }
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => number += 1,
                Err(error) => return Err(OutputError::file(&path, error)),
            }
        }
    }

    /// Notes that a point begins.
    pub fn note(&self, identity: &str) -> Result<(), OutputError> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let line = format!("{}\n", mark(identity));
        file.write_all(line.as_bytes()).map_err(|error| OutputError::file(&self.path, error))
    }
}

/// The process ends in order, and knows which points have results.
impl Drop for InFlight {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// Lists that processes have left behind which died.
pub struct LeftBehind {
    paths: Vec<PathBuf>,
    marks: BTreeSet<String>,
}

impl LeftBehind {
    /// The lists in the folder of the points, except those of processes that are alive.
    pub fn find(folder: &Path) -> Self {
        let mut found = Self { paths: Vec::new(), marks: BTreeSet::new() };
        let Ok(entries) = fs::read_dir(folder) else { return found };
        for path in entries.flatten().map(|entry| entry.path()) {
            let is_list = path.extension().is_some_and(|extension| extension == EXTENSION);
            if !is_list || !path.is_file() {
                continue;
            }
            let Ok(file) = OpenOptions::new().append(true).open(&path) else { continue };
            if matches!(file.try_lock(), Err(fs::TryLockError::WouldBlock)) {
                continue;
            }
            let text = fs::read_to_string(&path).unwrap_or_default();
            found.marks.extend(text.lines().map(str::to_string));
            found.paths.push(path);
        }
        found
    }

    /// True if a point was being run, or had ended, when a process died.
    pub fn contains(&self, identity: &str) -> bool {
        self.marks.contains(mark(identity))
    }

    /// Removes the lists: their points have been run again.
    pub fn remove(&self) {
        for path in &self.paths {
            let _ = fs::remove_file(path);
        }
    }
}

/// The last word of an identity, which is its fingerprint.
fn mark(identity: &str) -> &str {
    identity.rsplit(' ').next().unwrap_or(identity)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_living_processes_are_left_alone() {
        let folder = std::env::temp_dir().join(format!("beamsim-in-flight-{}", std::process::id()));
        let list = InFlight::begin(&folder).unwrap();
        list.note("[\"a=1\"] 00ff").unwrap();
        assert!(!LeftBehind::find(&folder).contains("[\"a=1\"] 00ff"));
        // A list without its process.
        fs::write(folder.join("1-0.running"), "00aa\n00bb\n").unwrap();
        let left = LeftBehind::find(&folder);
        assert!(left.contains("x 00aa") && left.contains("y 00bb") && !left.contains("z 00ff"));
        left.remove();
        drop(list);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        fs::remove_dir(&folder).unwrap();
    }
}
