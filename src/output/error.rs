//! Errors of reading and writing results.

use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why results could not be read or written.
#[derive(Debug, Error)]
pub enum OutputError {
    /// The operating system refused a file or folder.
    #[error("{}: {source}", path.display())]
    File {
        /// The file or folder
        path: PathBuf,
        /// The answer of the operating system
        source: io::Error,
    },
    /// A file does not hold what its name promises.
    #[error("{}: {reason}", path.display())]
    Content {
        /// The file
        path: PathBuf,
        /// The error in the content
        reason: String,
    },
    /// Another run writes to a folder of results.
    #[error("{}: another run is writing its results there (wait for it, or give another folder with --out)", .0.display())]
    Locked(PathBuf),
    /// A path at which something stands that is not replaced.
    #[error("{} {reason}", path.display())]
    Occupied {
        /// The path
        path: PathBuf,
        /// What stands there, and what to do
        reason: String,
    },
    /// A path that ends in no file name, such as `..`.
    #[error("{}: not a file name", .0.display())]
    NoFileName(PathBuf),
    /// A stream without a path failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A table could not be written.
    #[error(transparent)]
    Table(#[from] csv::Error),
}

impl OutputError {
    /// The error of the operating system about a file or folder.
    pub fn file(path: &Path, source: io::Error) -> Self {
        Self::File { path: path.into(), source }
    }

    /// An error about the content of a file.
    pub fn content(path: &Path, reason: impl ToString) -> Self {
        Self::Content { path: path.into(), reason: reason.to_string() }
    }
}
