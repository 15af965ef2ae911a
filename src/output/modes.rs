//! modes.csv and buckling.csv: what modal and buckling stages find.

use super::files::{PartFile, remove_if_there};
use beamsim_core::run::{CriticalLoad, Mode, StageResult};
use std::io;
use std::path::Path;

/// Collects modes and critical loads, and writes them when the run has ended.
#[derive(Clone, Debug, Default)]
pub struct ModesWriter {
    modes: Vec<(usize, usize, Mode)>,
    loads: Vec<(usize, usize, CriticalLoad)>,
}

impl ModesWriter {
    /// Takes the result of stage number `stage`, from 1.
    pub fn push(&mut self, stage: usize, result: &StageResult) {
        match result {
            StageResult::Modes(modes) => {
                self.modes.extend(modes.iter().enumerate().map(|(k, &mode)| (stage, k + 1, mode)));
            }
            StageResult::CriticalLoads(loads) => {
                self.loads.extend(loads.iter().enumerate().map(|(k, &load)| (stage, k + 1, load)));
            }
        }
    }

    /// Writes the files that have rows, and removes those that an earlier run has left.
    pub fn finish(&self, folder: &Path) -> io::Result<()> {
        // Debug formatting is the shortest text that reads back to the same float.
        let mode = |(stage, number, m): &(usize, usize, Mode)| format!("{stage},{number},{:?},{:?}", m.omega, m.growth);
        let load = |(stage, number, CriticalLoad { load, kind }): &(usize, usize, CriticalLoad)| {
            format!("{stage},{number},{load:?},{}", kind.name())
        };
        let modes: Vec<String> = self.modes.iter().map(mode).collect();
        let loads: Vec<String> = self.loads.iter().map(load).collect();
        write(folder, "modes.csv", "stage,mode,omega,growth", &modes)?;
        write(folder, "buckling.csv", "stage,mode,load,kind", &loads)
    }
}

fn write(folder: &Path, name: &str, head: &str, rows: &[String]) -> io::Result<()> {
    if rows.is_empty() {
        return remove_if_there(folder, name);
    }
    let text = format!("{head}\n{}\n", rows.join("\n"));
    PartFile::write(folder, name, text.as_bytes())
}
