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

/// The fingerprint of a file: XXH3 of 64 bits. It finds files that have changed; it does not prove
/// who wrote them.
pub fn fingerprint(content: &[u8]) -> String {
    format!("xxh3:{:016x}", xxh3_64(content))
}
