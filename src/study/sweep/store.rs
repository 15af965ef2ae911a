//! The results of points, a small file each: processes on several machines write at the same time,
//! and a killed one leaves no half result.

use super::point::PointResult;
use crate::output::{OutputError, PartFile, remove_dead_parts, remove_if_there};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// The folder of a sweep's points.
pub struct Store {
    folder: PathBuf,
}

/// The content of a file: the identity of the point, and its result.
#[derive(Serialize, Deserialize)]
struct StoredPoint {
    identity: String,
    #[serde(flatten)]
    result: PointResult,
}

/// The path of a point.
struct Place {
    folder: PathBuf,
    name: String,
}

impl Store {
    /// The store in the folder of a sweep's results.
    pub fn of(folder: &Path) -> Self {
        Self { folder: folder.join("points") }
    }

    /// The folder of the points.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Removes what processes that died have left half-written.
    pub fn clean(&self) {
        let folders = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        folders.for_each(|folder| remove_dead_parts(&folder.path()));
    }

    /// The path of a point. It depends on the identity and not on the number, so that a larger
    /// sweep finds the results of a smaller one.
    fn place(&self, identity: &str) -> Place {
        let mark = identity.rsplit(' ').next().unwrap_or(identity);
        Place { folder: self.folder.join(&mark[..mark.len().min(2)]), name: format!("{mark}.json") }
    }

    /// Saves the result of a point.
    pub fn keep(&self, identity: &str, result: &PointResult) -> Result<(), OutputError> {
        let Place { folder, name } = self.place(identity);
        let stored = StoredPoint { identity: identity.into(), result: result.clone() };
        let path = folder.join(&name);
        let content = serde_json::to_vec(&stored).map_err(|error| OutputError::content(&path, error))?;
        let (part, _file) = PartFile::written(&folder, &name, &content)?;
        part.rename(&name)
    }

    /// The result of a point, where there is one.
    pub fn find(&self, identity: &str) -> Option<PointResult> {
        let Place { folder, name } = self.place(identity);
        let stored: StoredPoint = serde_json::from_slice(&fs::read(folder.join(name)).ok()?).ok()?;
        (stored.identity == identity).then_some(stored.result)
    }

    /// Removes the result of a point.
    pub fn forget(&self, identity: &str) -> Result<(), OutputError> {
        let Place { folder, name } = self.place(identity);
        remove_if_there(&folder, &name)
    }
}
