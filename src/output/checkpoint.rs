//! The file `checkpoint` in a folder of results: a run that can go on from one of its rows.
//!
//! It begins with a line of text and a checksum of the rest, which holds the version of the program
//! and a fingerprint of the deck before everything else, so that they can be read from files of
//! other versions.

use super::folder::CHECKPOINT;
use super::history::SavedHistory;
use super::{ModesWriter, OutputError, Reel, ResultFolder, SavedBars, SavedFields};
use crate::scene::Scene;
use beamsim_core::probe::{Followed, StageEnd};
use beamsim_core::run::Checkpoint;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::fs;
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// The first line of the file.
const MAGIC: &[u8] = b"beamsim checkpoint\n";
/// The version of the program, and that of the form of the file, which changes with any structure
/// that is stored.
const PROGRAM: &str = concat!(env!("CARGO_PKG_VERSION"), " 21");
/// The length of the checksum, in bytes
const CHECKSUM: usize = 8;

/// Who wrote a checkpoint, and of what.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
struct Origin {
    program: String,
    /// The first stage whose end may change, from 0
    first_open: usize,
    /// Of the deck, see [`fingerprint`]
    deck: u64,
}

/// A run that can go on, with its files as far as they are written. `R` is the run itself:
/// [`Checkpoint`], or a reference to it.
#[derive(Deserialize, Serialize)]
pub struct SavedRun<R> {
    /// How often the run has been resumed already
    pub(crate) resumed: u32,
    /// Converged states so far
    pub(crate) rows: u64,
    /// The rows of the history that are written
    pub(crate) history: SavedHistory,
    /// Modes and critical loads so far
    pub(crate) modes: ModesWriter,
    /// The fields that are written
    pub(crate) fields: Option<SavedFields>,
    /// The shapes for the report so far
    pub(crate) reel: Option<Reel>,
    /// The error bars so far
    pub(crate) bars: Option<SavedBars>,
    /// Rows with the largest stresses so far, where they are followed
    pub(crate) envelope: Option<Vec<Followed>>,
    /// Resultants at the ends of stages so far, where they are written
    pub(crate) profile: Option<Vec<StageEnd>>,
    /// The run
    pub(crate) run: R,
}

/// A checkpoint that was found in a folder of results.
pub enum FoundCheckpoint {
    /// There is none.
    Nothing,
    /// One of this deck and program
    Own(Box<SavedRun<Checkpoint>>),
    /// One that cannot be used, and why
    Other(String),
}

impl SavedRun<&Checkpoint> {
    /// Writes the checkpoint of a scene, whole or not at all. The files that it tells of must be
    /// safe on the disk.
    pub fn write(&self, scene: &Scene, folder: &ResultFolder) -> Result<(), OutputError> {
        let path = folder.path().join(CHECKPOINT);
        let wrong = |error: postcard::Error| OutputError::content(&path, error);
        // Error bars come from runs that have ended where the deck says.
        let first_open = if self.bars.is_some() { usize::MAX } else { self.run.stage() };
        let origin = Origin { program: PROGRAM.into(), first_open, deck: fingerprint(scene, first_open) };
        let body = postcard::to_stdvec(&origin).map_err(wrong)?;
        let body = postcard::to_extend(self, body).map_err(wrong)?;
        let checksum = xxh3_64(&body).to_le_bytes();
        folder.replace(CHECKPOINT, &[MAGIC, &checksum, &body].concat())
    }
}

impl FoundCheckpoint {
    /// The checkpoint in a folder, as one of this scene.
    pub fn read(scene: &Scene, folder: &Path) -> Result<Self, OutputError> {
        let path = folder.join(CHECKPOINT);
        if !path.exists() {
            return Ok(Self::Nothing);
        }
        let bytes = fs::read(&path).map_err(|error| OutputError::file(&path, error))?;
        let Some(body) = body(&bytes) else { return Ok(Self::Other("it is damaged".into())) };
        let damaged = |_| Ok(Self::Other(format!("it was not written by beamsim {}", env!("CARGO_PKG_VERSION"))));
        let (origin, rest) = match postcard::take_from_bytes::<Origin>(body) {
            Ok(read) => read,
            Err(error) => return damaged(error),
        };
        if origin.program != PROGRAM {
            return Ok(Self::Other("it was written by another version of beamsim".into()));
        }
        if origin.deck != fingerprint(scene, origin.first_open) {
            return Ok(Self::Other("it belongs to another deck, or to this one with other settings or columns".into()));
        }
        postcard::from_bytes(rest).map_or_else(damaged, |saved| Ok(Self::Own(Box::new(saved))))
    }
}

/// What follows the checksum, if that is right.
fn body(bytes: &[u8]) -> Option<&[u8]> {
    let (checksum, body) = bytes.strip_prefix(MAGIC)?.split_first_chunk::<CHECKSUM>()?;
    (xxh3_64(body).to_le_bytes() == *checksum).then_some(body)
}

/// A fingerprint of a deck as far as it decides what a run computes: its numbers and words without
/// what may change when a run is resumed: title, expectations, the choice of rows, and the ends of
/// stages from number `first_open` on, from 0.
fn fingerprint(scene: &Scene, first_open: usize) -> u64 {
    let all = scene.resolved.as_object();
    let meshes = all.and_then(|deck| deck.get("mesh")).and_then(Value::as_object);
    // Megabytes of triangles are not copied and printed for each checkpoint.
    let hash = |mesh: &Value| mesh.get("data").and_then(Value::as_str).map_or(0, |data| xxh3_64(data.as_bytes()));
    let meshes: Vec<u64> = meshes.into_iter().flat_map(|meshes| meshes.values()).map(hash).collect();
    let entries = all.into_iter().flatten().filter(|(key, _)| *key != "mesh");
    let mut deck: Value = entries.map(|(key, value)| (key.clone(), value.clone())).collect();
    let stages = deck.get_mut("stage").and_then(Value::as_array_mut);
    for stage in stages.into_iter().flatten().skip(first_open).filter_map(Value::as_object_mut) {
        stage.retain(|key, _| !["end", "until"].contains(&key.as_str()));
    }
    if let Some(output) = deck.get_mut("output").and_then(Value::as_object_mut) {
        output.retain(|key, _| !["every", "interval"].contains(&key.as_str()));
    }
    if let Some(deck) = deck.as_object_mut() {
        // A choice of rows may have brought the table.
        let is_empty_output =
            |key: &str, value: &Value| key == "output" && value.as_object().is_some_and(Map::is_empty);
        deck.retain(|key, value| !["title", "expect"].contains(&key.as_str()) && !is_empty_output(key, value));
    }
    xxh3_64(format!("{deck}{meshes:?}").as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damaged_file_is_told_from_a_whole_one() {
        let content = b"anything";
        let whole = [MAGIC, &xxh3_64(content).to_le_bytes(), content].concat();
        assert_eq!(body(&whole), Some(&content[..]));
        for cut in 0..whole.len() {
            assert_eq!(body(&whole[..cut]), None, "cut at {cut}");
            let mut flipped = whole.clone();
            flipped[cut] ^= 1;
            assert_eq!(body(&flipped), None, "flipped at {cut}");
        }
    }
}
