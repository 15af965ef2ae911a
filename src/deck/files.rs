//! Files beside a deck.

use super::diagnostic::Severity;
use xxhash_rust::xxh3::xxh3_64;

/// Why a file that a deck names could not be read.
#[derive(Clone, Debug, PartialEq)]
pub struct Unreadable {
    /// The reason, with the path
    pub message: String,
    /// The kind of error
    pub severity: Severity,
}

/// A table or a mesh that a deck imports.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedTable {
    /// Its path in the deck
    pub(crate) name: String,
    /// The number of its rows or triangles
    pub(crate) rows: usize,
    /// A fingerprint of the content of its file
    pub(crate) hash: String,
}

/// The fingerprint of a file: XXH3 of 64 bits. It finds files that have changed; it does not prove
/// who wrote them.
pub fn fingerprint(content: &[u8]) -> String {
    format!("xxh3:{:016x}", xxh3_64(content))
}
