//! cost.csv

use super::variant::Pace;
use super::{CostRun, CostStudy};
use crate::deck::Words;
use csv::Writer;

impl CostStudy {
    /// The content of the file: comma-separated values, a line for each run.
    pub fn to_csv(&self) -> Result<Vec<u8>, csv::Error> {
        let mut table = Writer::from_writer(Vec::new());
        let own = [
            "order",
            "interpolation",
            "scheme",
            "elements",
            "step",
            "step_tolerance",
            "status",
            "error",
            "steps",
            "iterations",
            "factorisations",
            "cpu_seconds",
            "wall_seconds",
            "spread",
            "alone",
            "frontier",
            "limited_by",
            "settings",
        ];
        let errors = self.columns.iter().map(|column| format!("error.{column}"));
        table.write_record(own.iter().map(ToString::to_string).chain(errors))?;
        for run in &self.runs {
            table.write_record(fields(run))?;
        }
        table.into_inner().map_err(|error| error.into_error().into())
    }
}

fn fields(run: &CostRun) -> Vec<String> {
    let number = |x: f64| if x.is_finite() { format!("{x:?}") } else { String::new() };
    let family = &run.variant.family;
    let count =
        |pick: fn(&super::Trial) -> u64| run.trial.as_ref().map_or(String::new(), |trial| pick(trial).to_string());
    let step = if let Pace::Steps(factor) = run.variant.pace { number(factor) } else { String::new() };
    let tolerance = if let Pace::Adapts(tolerance) = run.variant.pace { number(tolerance) } else { String::new() };
    let own = [
        family.order.map_or(String::new(), |order| order.to_string()),
        family.interpolation.map_or(String::new(), |word| word.word().into()),
        family.scheme.map_or(String::new(), |name| name.word().into()),
        run.variant.count().to_string(),
        step,
        tolerance,
        run.trial.as_ref().map_or("left out".into(), |trial| trial.status.clone()),
        number(run.error),
        count(|trial| trial.steps),
        count(|trial| trial.iterations),
        count(|trial| trial.factorisations),
        number(run.timing.seconds.cpu),
        number(run.timing.seconds.wall),
        number(run.timing.spread),
        run.timing.alone.to_string(),
        run.frontier.to_string(),
        run.limit.map_or(String::new(), |limit| limit.name().into()),
        run.settings().join(" "),
    ];
    own.into_iter().chain(run.errors.iter().map(|&error| number(error))).collect()
}
