//! `beamsim plot`

use super::load::Refusal;
use super::{Status, Verdict, json, load, say};
use crate::deck::nearest;
use crate::output::{
    Axis, Boundary, HistoryReader, Line, LinePlot, LineStyle, PartFile, Record, Scale, Units, quantity_of,
};
use std::path::{Path, PathBuf};

/// Columns that are drawn where none is named.
const USUAL: usize = 6;
/// Displacements that change by less than this part of the largest change are still, but for round-off.
const STILL: f64 = 1e-9;
/// Columns that belong to every history.
const CLOCKS: [&str; 3] = ["stage", "time", "load"];

/// What is drawn.
#[derive(clap::Args)]
pub struct Wanted {
    /// Folders of results, or histories (CSV); several are drawn on the same axes
    #[arg(required = true, value_name = "RESULTS")]
    results: Vec<PathBuf>,
    /// A column, such as tip.ux (default: displacements that change)
    #[arg(long = "column", value_name = "COLUMN")]
    columns: Vec<String>,
    /// The column of the horizontal axis (default: time; if all stages are static, the load factor, stage by stage)
    #[arg(long, value_name = "COLUMN")]
    x: Option<String>,
    /// A stored history (CSV) to compare with
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// The picture, .svg or (in builds with `--features png`) .png (default: plot.svg in the first folder)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// A history with its name in the legend.
struct NamedHistory {
    name: String,
    /// Where it was read
    path: PathBuf,
    history: HistoryReader,
    /// Of its run, where run.json lies beside the history
    record: Option<Record>,
    is_reference: bool,
}

/// What the horizontal axis shows.
enum Abscissa {
    /// A column
    Column(String),
    /// The load factors of static stages, one stage after the other
    StageByStage,
}

/// Draws histories.
pub fn plot(wanted: &Wanted) -> Status {
    let mut verdict = Verdict::default();
    if let Err(refusal) = draw(wanted) {
        verdict.refuse(refusal);
    }
    verdict.finish(1)
}

fn draw(wanted: &Wanted) -> Result<(), Refusal> {
    let mut runs = wanted.results.iter().map(|path| read(path, false)).collect::<Result<Vec<_>, _>>()?;
    runs.extend(wanted.reference.as_ref().map(|path| read(path, true)).transpose()?);
    tell_apart(&mut runs);
    let columns = columns(wanted, &runs[0].history)?;
    let abscissa = match &wanted.x {
        Some(name) => find(&runs[0].history, name).map(|_| Abscissa::Column(name.clone()))?,
        None => usual_abscissa(&runs),
    };
    let units = common_units(&runs);
    let y_title = y_title(&columns, &units);
    let mut lines = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        for (place, column) in columns.iter().enumerate() {
            // A stored history need not have all columns.
            if run.is_reference && !run.history.names.contains(column) {
                continue;
            }
            let of_column = if y_title.is_empty() { units.title(column, column) } else { column.clone() };
            // One column needs no name on each line, and its runs differ by colour.
            let (name, colour, dash) = match (runs.len(), columns.len()) {
                (1, _) => (of_column, place, 0),
                (_, 1) => (run.name.clone(), number, number),
                _ => (format!("{}: {of_column}", run.name), place, number),
            };
            let (points, bars) = points(run, &abscissa, column)?;
            lines.push(Line { name, points, bars, beside: Vec::new(), style: LineStyle::Dashed { colour, dash } });
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
    let path = wanted.out.clone().unwrap_or_else(|| beside(&wanted.results[0]));
    let picture = picture(&plot, &path)?;
    PartFile::write_to(&path, &picture).map_err(Refusal::io)?;
    say::line(&format!("{}", path.display()));
    json::wrote("plot", &path);
    Ok(())
}

/// The title of the deck of one run, else the names of the runs.
fn title(runs: &[NamedHistory]) -> String {
    let drawn: Vec<&NamedHistory> = runs.iter().filter(|run| !run.is_reference).collect();
    let names: Vec<&str> = drawn.iter().map(|run| run.name.as_str()).collect();
    match &drawn[..] {
        [run] => run.record.as_ref().and_then(Record::title).unwrap_or(&run.name).into(),
        _ => names.join(", "),
    }
}

/// The units that all runs with a deck share; a stored history has those of the runs that it is compared with.
fn common_units(runs: &[NamedHistory]) -> Units {
    let mut known = runs.iter().filter_map(|run| run.record.as_ref()).map(Record::units);
    let first = known.next().unwrap_or_default();
    if known.all(|units| units == first) {
        return first;
    }
    say::note("warning: the runs have different units, which are left out of the picture");
    Units::default()
}

/// The column, or the quantity where all columns show the same; else nothing, and the legend tells the units.
fn y_title(columns: &[String], units: &Units) -> String {
    if let [column] = columns {
        return units.title(column, column);
    }
    let quantity = quantity_of(&columns[0]);
    let is_common = columns.iter().all(|column| quantity_of(column) == quantity);
    quantity.filter(|_| is_common).map_or(String::new(), |quantity| units.title(quantity, &columns[0]))
}

impl Abscissa {
    fn title(&self, units: &Units) -> String {
        match self {
            Self::Column(name) if name == "load" => "load factor".into(),
            Self::Column(name) => units.title(name, name),
            Self::StageByStage => "load factor, stage by stage".into(),
        }
    }

    /// Its value in each row.
    fn values(&self, run: &NamedHistory) -> Result<Vec<f64>, Refusal> {
        match self {
            Self::Column(name) => run.column(name),
            Self::StageByStage => Ok(stage_by_stage(&run.column("stage")?, &run.column("load")?)),
        }
    }

    /// Where stages begin, if the axis tells them apart.
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
        found.sort_by(|a, b| a.at.total_cmp(&b.at));
        found
    }
}

/// Load factors one stage after the other: each stage is as long as the range of its load factor, which begins at 0 or below.
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

/// In the format that the name of the file asks for.
fn picture(plot: &LinePlot, path: &Path) -> Result<Vec<u8>, Refusal> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        None | Some("svg") => Ok(plot.to_svg().into_bytes()),
        Some("png") => png(plot),
        Some(other) => {
            let message = format!("`.{other}`: pictures are written as .svg or .png");
            Err(Refusal::of(Status::Wrong, "usage", message))
        }
    }
}

#[cfg(feature = "png")]
fn png(plot: &LinePlot) -> Result<Vec<u8>, Refusal> {
    plot.to_png().map_err(|why| Refusal::of(Status::Wrong, "usage", format!("the picture cannot be drawn: {why}")))
}

#[cfg(not(feature = "png"))]
fn png(_plot: &LinePlot) -> Result<Vec<u8>, Refusal> {
    let message =
        "this build draws .svg only: `cargo install --path . --locked --features png` makes one that draws .png";
    Err(Refusal::of(Status::Wrong, "usage", message.into()))
}

/// The history in a folder, or the file itself.
fn read(path: &Path, is_reference: bool) -> Result<NamedHistory, Refusal> {
    let file = HistoryReader::of_results(path).unwrap_or_else(|| path.to_path_buf());
    let history = HistoryReader::read(&file).map_err(Refusal::io)?;
    let is_of_run = file.file_name().is_some_and(|name| name == "history.csv" || name == "history.partial.csv");
    let folder = file.parent().filter(|_| is_of_run).and_then(|folder| std::fs::canonicalize(folder.join(".")).ok());
    // `results/arm/history.csv` is `arm`.
    let name = folder.as_deref().map_or_else(|| load::without_extension(&file, ".csv"), load::folder_name);
    let record = folder.and_then(|folder| Record::read(&folder).ok());
    Ok(NamedHistory { name, path: path.into(), history, record, is_reference })
}

/// Runs of the same name are named by their paths.
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
    fn column(&self, name: &str) -> Result<Vec<f64>, Refusal> {
        let place = find(&self.history, name)
            .map_err(|why| Refusal { message: format!("{}: {}", self.name, why.message), ..why })?;
        Ok(self.history.rows.iter().map(|row| row[place]).collect())
    }

    /// Whether a column changes.
    fn varies(&self, name: &str) -> bool {
        self.column(name).is_ok_and(|values| values.iter().any(|value| *value != values[0]))
    }
}

/// The place of a column.
fn find(history: &HistoryReader, name: &str) -> Result<usize, Refusal> {
    history.names.iter().position(|known| known == name).ok_or_else(|| {
        let help = match nearest(name, history.names.iter().map(String::as_str)) {
            Some(meant) => format!("did you mean `{meant}`?"),
            None => format!("there are {}", history.names.join(", ")),
        };
        Refusal::of(Status::Wrong, "usage", format!("the history has no column `{name}`: {help}"))
    })
}

/// The columns that the user names; else displacements that change, all displacements, or any columns.
fn columns(wanted: &Wanted, history: &HistoryReader) -> Result<Vec<String>, Refusal> {
    if !wanted.columns.is_empty() {
        return wanted.columns.iter().map(|name| find(history, name).map(|_| name.clone())).collect();
    }
    let shown = |name: &&String| {
        !CLOCKS.contains(&name.as_str()) && !name.ends_with(".err") && Some(*name) != wanted.x.as_ref()
    };
    let moved = |name: &&String| [".ux", ".uy", ".uz"].iter().any(|suffix| name.ends_with(suffix));
    let all: Vec<String> = history.names.iter().filter(shown).cloned().collect();
    let displacements: Vec<String> = all.iter().filter(|name| moved(name)).cloned().collect();
    let changes: Vec<f64> = displacements.iter().map(|name| change(history, name)).collect();
    let largest = changes.iter().copied().fold(0.0, f64::max);
    let changing = displacements.iter().zip(&changes).filter(|(_, change)| **change > STILL * largest);
    let candidates = [changing.map(|(name, _)| name.clone()).collect(), displacements, all];
    let usual = candidates.into_iter().find(|names: &Vec<String>| !names.is_empty()).unwrap_or_default();
    if usual.is_empty() {
        return Err(Refusal::of(Status::Wrong, "usage", "the history has no columns to draw".into()));
    }
    Ok(usual.into_iter().take(USUAL).collect())
}

/// The difference of the largest and the smallest value of a column.
fn change(history: &HistoryReader, name: &str) -> f64 {
    let Some(place) = history.names.iter().position(|known| known == name) else { return 0.0 };
    let values = || history.rows.iter().map(|row| row[place]);
    values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
}

/// The time where it advances in a run; else the load factor, of several stages one after the other.
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

/// Points of a column, and their error bars where the history has finite ones.
type PointsAndBars = (Vec<(f64, f64)>, Option<Vec<f64>>);

fn points(run: &NamedHistory, abscissa: &Abscissa, column: &str) -> Result<PointsAndBars, Refusal> {
    let points: Vec<(f64, f64)> = abscissa.values(run)?.into_iter().zip(run.column(column)?).collect();
    if let Some(row) = points.iter().position(|(x, y)| !(x.is_finite() && y.is_finite())) {
        let message = format!("{}: row {} of `{column}` is not finite", run.name, row + 1);
        return Err(Refusal::of(Status::Wrong, "usage", message));
    }
    let bars = run.column(&format!("{column}.err")).ok();
    Ok((points, bars.filter(|bars| bars.iter().all(|bar| bar.is_finite()))))
}

/// plot.svg in the folder of the results.
fn beside(results: &Path) -> PathBuf {
    if results.is_dir() { results.join("plot.svg") } else { results.with_file_name("plot.svg") }
}
