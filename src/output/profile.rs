//! Reading of profile.csv: resultants and stresses along all beams at the end of each stage.

use super::OutputError;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Columns of the clock and the place
const PLACE: [&str; 6] = ["stage", "time", "load", "beam", "fraction", "length"];

/// A table of numbers along beams.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileReader {
    /// Names of the columns after the place
    pub(crate) names: Vec<String>,
    /// Places, in the order of the file
    pub(crate) rows: Vec<ProfileRow>,
}

/// A place along a beam at the end of a stage.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileRow {
    /// Number of the stage, from 1
    pub(crate) stage: usize,
    /// Name of the beam
    pub(crate) beam: String,
    /// Length from the start of the beam
    pub(crate) length: f64,
    /// Numbers after the place; none where a stress is not known
    pub(crate) values: Vec<Option<f64>>,
}

impl ProfileReader {
    /// True if the first line of a file is that of a profile.
    pub fn is_profile(path: &Path) -> bool {
        let head = PLACE.join(",") + ",";
        let mut found = vec![0; head.len()];
        path.is_file()
            && File::open(path).and_then(|mut file| file.read_exact(&mut found)).is_ok()
            && found == head.as_bytes()
    }

    /// Reads a table.
    pub fn read(path: &Path) -> Result<Self, OutputError> {
        let wrong = |message: String| OutputError::content(path, message);
        let mut reader = csv::Reader::from_path(path).map_err(|error| wrong(error.to_string()))?;
        let header = reader.headers().map_err(|error| wrong(error.to_string()))?.clone();
        let names = header.iter().skip(PLACE.len()).map(str::to_string).collect();
        let mut rows = Vec::new();
        for (number, record) in reader.records().enumerate() {
            let record = record.map_err(|error| wrong(error.to_string()))?;
            let cell = |k: usize| {
                let text = record.get(k).unwrap_or("");
                let name = header.get(k).unwrap_or("");
                let bad = || wrong(format!("row {}: `{text}` in column `{name}` is no number", number + 1));
                text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(bad)
            };
            let value = |k: usize| if record.get(k) == Some("") { Ok(None) } else { cell(k).map(Some) };
            let values = (PLACE.len()..header.len()).map(value).collect::<Result<Vec<_>, _>>()?;
            let beam = record.get(3).unwrap_or("").to_string();
            rows.push(ProfileRow { stage: cell(0)? as usize, beam, length: cell(5)?, values });
        }
        Ok(Self { names, rows })
    }

    /// The names of the beams, in the order of the file.
    pub fn beams(&self) -> Vec<&str> {
        let mut beams: Vec<&str> = Vec::new();
        for row in &self.rows {
            if !beams.contains(&row.beam.as_str()) {
                beams.push(&row.beam);
            }
        }
        beams
    }
}
