//! effects.csv

use super::EffectStudy;
use csv::Writer;

impl EffectStudy {
    /// The content of the file: comma-separated values, a line for each output of each reduced
    /// scene, the cheapest scene last.
    pub fn to_csv(&self) -> Result<Vec<u8>, csv::Error> {
        let mut table = Writer::from_writer(Vec::new());
        table.write_record(["without", "status", "iterations", "seconds", "output", "change"])?;
        let number = |x: f64| if x.is_nan() { String::new() } else { format!("{x:?}") };
        let iterations = self.whole.counters.work.iterations.to_string();
        table.write_record(["", "finished", &iterations, &number(self.whole.seconds), "", ""])?;
        for reduced in self.reduced.iter().chain([&self.cheapest]) {
            let without = reduced.without.iter().map(|word| word.key()).collect::<Vec<_>>().join("+");
            let Some(outcome) = reduced.outcome() else {
                table.write_record([&without, "failed", "", "", "", ""])?;
                continue;
            };
            let iterations = outcome.counters.work.iterations.to_string();
            let seconds = number(outcome.seconds);
            for (column, change) in self.columns.iter().zip(&reduced.changes) {
                table.write_record([&without, "finished", &iterations, &seconds, column, &number(*change)])?;
            }
        }
        table.into_inner().map_err(|error| error.into_error().into())
    }
}
