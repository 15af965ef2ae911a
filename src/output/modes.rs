//! modes.csv and buckling.csv: results of modal and buckling stages.

use super::{OutputError, ResultFolder};
use beamsim_core::run::{CriticalLoad, Mode, StageResult};
use serde::{Deserialize, Serialize};

/// Collects modes and critical loads, and writes them when the run has ended.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub struct ModesWriter {
    modes: Vec<Numbered<Mode>>,
    loads: Vec<Numbered<CriticalLoad>>,
}

/// A result of a stage.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
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

    /// Writes the files that have rows, and returns their names.
    pub fn finish(&self, folder: &ResultFolder) -> Result<Vec<&'static str>, OutputError> {
        // Debug formatting is the shortest text that reads back to the same float.
        let mode = |Numbered { stage, number, result: Mode { omega, growth, .. } }: &Numbered<Mode>| {
            format!("{stage},{number},{omega:?},{growth:?}")
        };
        let load = |Numbered { stage, number, result: CriticalLoad { load, kind } }: &Numbered<CriticalLoad>| {
            format!("{stage},{number},{load:?},{}", kind.name())
        };
        let modes: Vec<String> = self.modes.iter().map(mode).collect();
        let loads: Vec<String> = self.loads.iter().map(load).collect();
        let tables = [("modes.csv", "stage,mode,omega,growth", modes), ("buckling.csv", "stage,mode,load,kind", loads)];
        let mut names = Vec::new();
        for (name, head, rows) in tables.into_iter().filter(|(_, _, rows)| !rows.is_empty()) {
            folder.write(name, format!("{head}\n{}\n", rows.join("\n")).as_bytes())?;
            names.push(name);
        }
        Ok(names)
    }
}
