//! modes.csv and buckling.csv: results of modal and buckling stages.

use super::OutputError;
use super::files::{PartFile, remove_if_there};
use beamsim_core::run::{CriticalLoad, Mode, StageResult};
use std::path::Path;

/// Collects modes and critical loads, and writes them when the run has ended.
#[derive(Clone, Debug, Default)]
pub struct ModesWriter {
    modes: Vec<Numbered<Mode>>,
    loads: Vec<Numbered<CriticalLoad>>,
}

/// A result of a stage.
#[derive(Clone, Copy, Debug)]
struct Numbered<T> {
    /// Stage, from 1
    stage: usize,
    /// Number within the stage, from 1
    number: usize,
    result: T,
}

fn numbered<T: Copy>(stage: usize, results: &[T]) -> impl Iterator<Item = Numbered<T>> {
    results.iter().enumerate().map(move |(k, &result)| Numbered { stage, number: k + 1, result })
}

impl ModesWriter {
    /// Adds the result of a stage (from 1).
    pub fn push(&mut self, stage: usize, result: &StageResult) {
        match result {
            StageResult::Modes(modes) => self.modes.extend(numbered(stage, modes)),
            StageResult::CriticalLoads(loads) => self.loads.extend(numbered(stage, loads)),
        }
    }

    /// Writes the files that have rows, and removes those of an earlier run.
    pub fn finish(&self, folder: &Path) -> Result<(), OutputError> {
        // Debug formatting is the shortest text that reads back to the same float.
        let mode = |Numbered { stage, number, result: Mode { omega, growth, .. } }: &Numbered<Mode>| {
            format!("{stage},{number},{omega:?},{growth:?}")
        };
        let load = |Numbered { stage, number, result: CriticalLoad { load, kind } }: &Numbered<CriticalLoad>| {
            format!("{stage},{number},{load:?},{}", kind.name())
        };
        let modes: Vec<String> = self.modes.iter().map(mode).collect();
        let loads: Vec<String> = self.loads.iter().map(load).collect();
        write(folder, "modes.csv", "stage,mode,omega,growth", &modes)?;
        write(folder, "buckling.csv", "stage,mode,load,kind", &loads)
    }
}

fn write(folder: &Path, name: &str, head: &str, rows: &[String]) -> Result<(), OutputError> {
    if rows.is_empty() {
        return remove_if_there(folder, name);
    }
    let text = format!("{head}\n{}\n", rows.join("\n"));
    PartFile::write(folder, name, text.as_bytes())
}
