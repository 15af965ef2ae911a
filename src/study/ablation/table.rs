//! effects.csv

use super::Ablation;
use csv::Writer;

impl Ablation {
    /// A table of comma-separated values: a line for each output and each variant, the cheapest one last.
    pub fn to_csv(&self) -> Result<Vec<u8>, csv::Error> {
        let mut table = Writer::from_writer(Vec::new());
        table.write_record(["without", "status", "iterations", "seconds", "output", "change"])?;
        let number = |x: f64| if x.is_nan() { String::new() } else { format!("{x:?}") };
        let iterations = self.whole.counters.work.iterations.to_string();
        table.write_record(["", "finished", &iterations, &number(self.whole.seconds), "", ""])?;
        for variant in self.variants.iter().chain([&self.cheapest]) {
            let without = variant.without.iter().map(|word| word.key()).collect::<Vec<_>>().join("+");
            let Some(outcome) = variant.outcome() else {
                table.write_record([&without, "failed", "", "", "", ""])?;
                continue;
            };
            let (iterations, seconds) = (outcome.counters.work.iterations.to_string(), number(outcome.seconds));
            for (column, change) in self.columns.iter().zip(&variant.changes) {
                table.write_record([&without, "finished", &iterations, &seconds, column, &number(*change)])?;
            }
        }
        table.into_inner().map_err(|error| error.into_error().into())
    }
}
