//! `beamsim plot`: histories; profiles along beams are in `plot_profile.rs`.

use super::error::CommandError;
use super::picture::{Format, PlotArguments};
use super::plotted::{OneOf, PlottedRun, line_of, unknown, write, y_title};
use super::status::Status;
use super::verdict::Verdict;
use super::{console, load, outputs, plot_profile};
use crate::output::{Axis, Boundary, HistoryReader, Line, LinePlot, Record, Scale, Units};
use beamsim_core::probe::{Quantity, clocks, quantity};
use beamsim_core::sorting::sort_by;
use std::path::{Path, PathBuf};

/// Largest number of columns that are drawn without `--column`.
const MAX_DEFAULT_COLUMNS: usize = 6;
/// Largest number of columns that a message names.
const MAX_NAMED_COLUMNS: usize = 8;
/// Smallest change of a displacement relative to the largest one; smaller changes are round-off.
const MIN_CHANGE: f64 = 1e-9;

/// A history with its name in the legend.
struct NamedHistory {
    name: String,
    /// The path that the user gave
    path: PathBuf,
    history: HistoryReader,
    /// The run that it belongs to
    run: PlottedRun,
    is_reference: bool,
}

/// Columns that are drawn without `--column`.
struct DefaultColumns {
    names: Vec<String>,
    /// The rule that chose them, as a message
    rule: String,
    /// Columns of the history that the plot does not show
    omitted: Vec<String>,
}

/// The quantity of the horizontal axis.
enum Abscissa {
    /// A column of the histories
    Column(String),
    /// The load factors of static stages, one stage after the other
    StageByStage,
}

/// Draws histories.
pub fn plot(wanted: &PlotArguments) -> Status {
    let mut verdict = Verdict::default();
    if let Err(error) = draw(wanted) {
        verdict.fail(error);
    }
    verdict.finish(1)
}

fn draw(wanted: &PlotArguments) -> Result<(), CommandError> {
    if let Some(profile) = plot_profile::profile_of(&wanted.results)? {
        return plot_profile::draw(wanted, profile);
    }
    for (option, is_given) in [("--beam", !wanted.beams.is_empty()), ("--stage", wanted.stage.is_some())] {
        if is_given {
            let message = format!("`{option}` is for profiles along beams: give results/NAME/profile.csv");
            return Err(CommandError::Usage(message));
        }
    }
    let path = wanted.out.clone().unwrap_or_else(|| beside(&wanted.results[0]));
    let format = Format::of(&path)?;
    outputs::check_file(&path, format.kind())?;
    let mut runs = wanted.results.iter().map(|path| read(path, false)).collect::<Result<Vec<_>, _>>()?;
    runs.extend(wanted.reference.as_ref().map(|path| read(path, true)).transpose()?);
    tell_apart(&mut runs);
    runs.iter().filter_map(|run| run.run.warning("history", &run.path)).for_each(|warning| console::note(&warning));
    let columns = columns(wanted, &runs[0].history)?;
    let abscissa = match &wanted.x {
        Some(name) => find(&runs[0].history, name).map(|_| Abscissa::Column(name.clone()))?,
        None => usual_abscissa(&runs),
    };
    let units = common_units(&runs);
    let y_title = y_title(&columns, &units, str::to_string);
    let mut lines = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        for (place, column) in columns.iter().enumerate() {
            // A stored history need not have all columns.
            if run.is_reference && !run.history.names.contains(column) {
                continue;
            }
            let of_column = if y_title.is_empty() { units.title(column, column) } else { column.clone() };
            let (name, style) = line_of(
                OneOf { name: run.legend(), number, count: runs.len() },
                OneOf { name: of_column, number: place, count: columns.len() },
            );
            let (points, bars) = points(run, &abscissa, column)?;
            lines.push(Line { name, points, bars, beside: Vec::new(), style });
        }
    }
    let plot = LinePlot {
        title: title(&runs),
        x: Axis { title: abscissa.title(&units), scale: Scale::Linear },
        y: Axis { title: y_title, scale: Scale::Linear },
        lines,
        level: None,
        boundaries: abscissa.boundaries(&runs),
    };
    write(&plot, &path, format)
}

/// The title of the deck if all runs share it, else the names of the runs.
fn title(runs: &[NamedHistory]) -> String {
    let drawn: Vec<&NamedHistory> = runs.iter().filter(|run| !run.is_reference).collect();
    let of_deck = |run: &&NamedHistory| run.run.title().map(str::to_string);
    let common =
        drawn.first().and_then(of_deck).filter(|title| drawn.iter().all(|run| of_deck(run).as_ref() == Some(title)));
    match &drawn[..] {
        [run] => common.unwrap_or(run.name.clone()) + &run.run.remark(),
        _ => common.unwrap_or_else(|| drawn.iter().map(|run| run.name.as_str()).collect::<Vec<_>>().join(", ")),
    }
}

/// The units that all runs with a deck share. A stored history is taken to have the units of the runs
/// that it is compared with.
fn common_units(runs: &[NamedHistory]) -> Units {
    let mut known = runs.iter().filter_map(|run| run.run.record.as_ref()).map(Record::units);
    let first = known.next().unwrap_or_default();
    if known.all(|units| units == first) {
        return first;
    }
    console::note("warning: the runs have different units; the plot shows no units");
    Units::default()
}

impl Abscissa {
    fn title(&self, units: &Units) -> String {
        match self {
            Self::Column(name) if name == "load" => "load factor".into(),
            Self::Column(name) => units.title(name, name),
            Self::StageByStage => "load factor, stage by stage".into(),
        }
    }

    /// The values of the axis, one per row of a history.
    fn values(&self, run: &NamedHistory) -> Result<Vec<f64>, CommandError> {
        match self {
            Self::Column(name) => run.column(name),
            Self::StageByStage => Ok(stage_by_stage(&run.column("stage")?, &run.column("load")?)),
        }
    }

    /// Starts of stages, on axes on which stages follow one another.
    fn boundaries(&self, runs: &[NamedHistory]) -> Vec<Boundary> {
        let is_ordered = match self {
            Self::Column(name) => name == "time",
            Self::StageByStage => true,
        };
        let mut found: Vec<Boundary> = Vec::new();
        for run in runs.iter().filter(|_| is_ordered) {
            let (Ok(stages), Ok(values)) = (run.column("stage"), self.values(run)) else { continue };
            for row in 1..stages.len() {
                let boundary = Boundary { at: values[row - 1], name: format!("stage {}", stages[row]) };
                if stages[row] != stages[row - 1] && !found.contains(&boundary) {
                    found.push(boundary);
                }
            }
        }
        sort_by(&mut found, |a, b| a.at.total_cmp(&b.at));
        found
    }
}

/// Load factors, one stage after another. The length of a stage on the axis is the range of its load
/// factor, which includes 0.
fn stage_by_stage(stages: &[f64], loads: &[f64]) -> Vec<f64> {
    let mut values = Vec::new();
    let mut start = 0.0;
    for stage in stages.chunk_by(|a, b| a == b) {
        let loads = &loads[values.len()..][..stage.len()];
        let low = loads.iter().fold(0.0, |low: f64, load| low.min(*load));
        let high = loads.iter().fold(low, |high, load| high.max(*load));
        values.extend(loads.iter().map(|load| start + load - low));
        start += high - low;
    }
    values
}

/// The history in a folder, or the file itself.
fn read(path: &Path, is_reference: bool) -> Result<NamedHistory, CommandError> {
    let file = HistoryReader::of_results(path)?.unwrap_or_else(|| path.to_path_buf());
    if file.is_dir() {
        return Err(CommandError::Io(format!("{}: no history.csv is in this folder", path.display())));
    }
    let history = HistoryReader::read(&file)?;
    let run = PlottedRun::of(&file, "history");
    // `results/arm/history.csv` is `arm`.
    let name = run.folder.as_deref().map_or_else(|| load::without_extension(&file, ".csv"), load::folder_name);
    if history.rows.is_empty() {
        let reason =
            run.failure.map_or(String::new(), |failure| format!(": the run failed before its first state ({failure})"));
        return Err(CommandError::Usage(format!("{} has no rows{reason}", file.display())));
    }
    Ok(NamedHistory { name, path: path.into(), history, run, is_reference })
}

/// Renames runs that share a name: they are named by their paths.
fn tell_apart(runs: &mut [NamedHistory]) {
    let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
    for run in runs {
        if names.iter().filter(|name| **name == run.name).count() > 1 {
            run.name = run.path.display().to_string();
        }
    }
}

impl NamedHistory {
    /// The values of a column.
    fn column(&self, name: &str) -> Result<Vec<f64>, CommandError> {
        let place =
            find(&self.history, name).map_err(|error| CommandError::Usage(format!("{}: {error}", self.name)))?;
        Ok(self.history.rows.iter().map(|row| row[place]).collect())
    }

    /// The name of the run in the legend.
    fn legend(&self) -> String {
        self.name.clone() + &self.run.remark()
    }

    /// True if the values of a column differ.
    fn varies(&self, name: &str) -> bool {
        self.column(name).is_ok_and(|values| values.iter().any(|value| *value != values[0]))
    }
}

/// The place of a column.
fn find(history: &HistoryReader, name: &str) -> Result<usize, CommandError> {
    let known: Vec<&str> = history.names.iter().map(String::as_str).collect();
    let place = known.iter().position(|known| *known == name);
    place.ok_or_else(|| unknown("history", "column", name, &known))
}

/// The columns that the user names, or the default ones with a line about those that are left out.
fn columns(wanted: &PlotArguments, history: &HistoryReader) -> Result<Vec<String>, CommandError> {
    if !wanted.columns.is_empty() {
        return wanted.columns.iter().map(|name| find(history, name).map(|_| name.clone())).collect();
    }
    let DefaultColumns { names, rule, omitted } = default_columns(history, wanted.x.as_ref());
    if names.is_empty() {
        return Err(CommandError::Usage("the history has no columns to plot".into()));
    }
    if !omitted.is_empty() {
        let named = omitted.iter().take(MAX_NAMED_COLUMNS).cloned().collect::<Vec<_>>().join(", ");
        let more = omitted.len().saturating_sub(MAX_NAMED_COLUMNS);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        console::line(&format!("drawn: {rule}; not drawn: {named}{more}; choose columns by --column"));
    }
    Ok(names)
}

/// The displacements that change, or all displacements, or all columns; not more than
/// [`MAX_DEFAULT_COLUMNS`].
fn default_columns(history: &HistoryReader, x: Option<&String>) -> DefaultColumns {
    let is_shown =
        |name: &&String| clocks().all(|clock| clock != name.as_str()) && !name.ends_with(".err") && Some(*name) != x;
    let is_displacement = |name: &&String| quantity(name) == Some(Quantity::Displacement);
    let all: Vec<String> = history.names.iter().filter(is_shown).cloned().collect();
    let displacements: Vec<String> = all.iter().filter(is_displacement).cloned().collect();
    let changes: Vec<f64> = displacements.iter().map(|name| change(history, name)).collect();
    let largest = changes.iter().copied().fold(0.0, f64::max);
    let changing = displacements.iter().zip(&changes).filter(|(_, change)| **change > MIN_CHANGE * largest);
    let changing: Vec<String> = changing.map(|(name, _)| name.clone()).collect();
    let (candidates, kind) = if !changing.is_empty() {
        (changing, "displacements that change")
    } else if !displacements.is_empty() {
        (displacements, "displacements")
    } else {
        (all.clone(), "columns (there are no displacements)")
    };
    let count = candidates.len();
    let names: Vec<String> = candidates.into_iter().take(MAX_DEFAULT_COLUMNS).collect();
    let rule = if count > names.len() { format!("the first {} of {count} {kind}", names.len()) } else { kind.into() };
    let omitted = all.into_iter().filter(|name| !names.contains(name)).collect();
    DefaultColumns { names, rule, omitted }
}

/// The difference of the largest and the smallest value of a column.
fn change(history: &HistoryReader, name: &str) -> f64 {
    let Some(place) = history.names.iter().position(|known| known == name) else { return 0.0 };
    let values = || history.rows.iter().map(|row| row[place]);
    values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
}

/// Time if it advances in any run; else the load factor, stage by stage if there are several stages.
fn usual_abscissa(runs: &[NamedHistory]) -> Abscissa {
    let has = |name: &str| runs.iter().all(|run| run.history.names.iter().any(|known| known == name));
    let varies = |name: &str| runs.iter().any(|run| run.varies(name));
    if (has("time") && varies("time")) || !has("load") {
        Abscissa::Column("time".into())
    } else if has("stage") && varies("stage") {
        Abscissa::StageByStage
    } else {
        Abscissa::Column("load".into())
    }
}

/// The points of a column, and their error bars if the history has finite ones.
type PointsAndBars = (Vec<(f64, f64)>, Option<Vec<f64>>);

fn points(run: &NamedHistory, abscissa: &Abscissa, column: &str) -> Result<PointsAndBars, CommandError> {
    let points: Vec<(f64, f64)> = abscissa.values(run)?.into_iter().zip(run.column(column)?).collect();
    if let Some(row) = points.iter().position(|(x, y)| !(x.is_finite() && y.is_finite())) {
        let message = format!("{}: row {} of `{column}` is not finite", run.name, row + 1);
        return Err(CommandError::Usage(message));
    }
    let bars = run.column(&format!("{column}.err")).ok();
    Ok((points, bars.filter(|bars| bars.iter().all(|bar| bar.is_finite()))))
}

/// plot.svg in the folder of the results.
fn beside(results: &Path) -> PathBuf {
    if results.is_dir() { results.join("plot.svg") } else { results.with_file_name("plot.svg") }
}
