//! sweep.csv: a row for each point.

use super::{PointResult, Sweep};
use crate::output::harmless;

/// The status of a point without a result.
const MISSING: &str = "missing";

impl Sweep {
    /// The content of the file. It holds no times, so that all ways of running the points give the
    /// same bytes.
    pub fn to_csv(&self, results: &[Option<PointResult>]) -> Result<Vec<u8>, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let mut write = |cells: Vec<String>| writer.write_record(cells.iter().map(|cell| harmless(cell).into_owned()));
        write(self.header())?;
        for (k, result) in results.iter().enumerate() {
            write(self.row(k, result.as_ref()))?;
        }
        writer.into_inner().map_err(|error| error.into_error().into())
    }

    fn header(&self) -> Vec<String> {
        let mut names = vec!["point".to_string()];
        names.extend(self.keys.iter().cloned());
        names.push("status".into());
        names.extend(self.outputs.iter().map(|output| output.name()));
        if self.error_bars {
            names.extend(self.outputs.iter().map(|output| format!("{}.err", output.name())));
        }
        names.extend(["steps", "iterations", "factorisations", "message"].map(String::from));
        names
    }

    fn row(&self, point: usize, result: Option<&PointResult>) -> Vec<String> {
        let mut cells = vec![(point + 1).to_string()];
        cells.extend(self.points[point].iter().cloned());
        cells.push(result.map_or(MISSING, |result| &result.status).into());
        let number = |x: Option<&f64>| x.filter(|x| !x.is_nan()).map_or(String::new(), |x| format!("{x:?}"));
        let numbers = |of: fn(&PointResult) -> &Vec<f64>| {
            (0..self.outputs.len()).map(move |k| number(result.and_then(|result| of(result).get(k))))
        };
        cells.extend(numbers(|result| &result.values));
        if self.error_bars {
            cells.extend(numbers(|result| &result.errors));
        }
        let work = |k: usize| result.map_or(String::new(), |result| result.work[k].to_string());
        cells.extend((0..3).map(work));
        cells.push(result.map_or(String::new(), |result| result.message.clone()));
        cells
    }
}
