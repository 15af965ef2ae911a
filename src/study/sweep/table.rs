//! sweep.csv: a row a point.

use super::{Outcome, Sweep};

/// A point of which nothing is known: it was not run, or killed.
const MISSING: &str = "missing";

impl Sweep {
    /// One table of all points. It holds no times, so that every way of running them gives the same bytes.
    pub fn to_csv(&self, outcomes: &[Option<Outcome>]) -> Result<Vec<u8>, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(self.header())?;
        for (k, outcome) in outcomes.iter().enumerate() {
            writer.write_record(self.row(k, outcome.as_ref()))?;
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

    fn row(&self, point: usize, outcome: Option<&Outcome>) -> Vec<String> {
        let mut cells = vec![(point + 1).to_string()];
        cells.extend(self.points[point].iter().cloned());
        cells.push(outcome.map_or(MISSING, |outcome| &outcome.status).into());
        let number = |x: Option<&f64>| x.filter(|x| !x.is_nan()).map_or(String::new(), |x| format!("{x:?}"));
        let numbers = |of: fn(&Outcome) -> &Vec<f64>| {
            (0..self.outputs.len()).map(move |k| number(outcome.and_then(|outcome| of(outcome).get(k))))
        };
        cells.extend(numbers(|outcome| &outcome.values));
        if self.error_bars {
            cells.extend(numbers(|outcome| &outcome.errors));
        }
        let work = |k: usize| outcome.map_or(String::new(), |outcome| outcome.work[k].to_string());
        cells.extend((0..3).map(work));
        cells.push(outcome.map_or(String::new(), |outcome| outcome.message.clone()));
        cells
    }
}
