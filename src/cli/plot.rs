//! `beamsim plot`

use super::load::Refusal;
use super::{Status, Verdict, json, load, say};
use crate::deck::nearest;
use crate::output::{Curve, Curves, HistoryReader, PartFile};
use beamsim_core::probe::{Quantity, clocks, quantity};
use std::path::{Path, PathBuf};

/// Columns that are drawn where none is named.
const USUAL: usize = 6;

/// What is drawn.
#[derive(clap::Args)]
pub struct Wanted {
    /// Folders of results, or histories (CSV); several stand on one axis
    #[arg(required = true, value_name = "RESULTS")]
    results: Vec<PathBuf>,
    /// A column, such as tip.ux (default: displacements)
    #[arg(long = "column", value_name = "COLUMN")]
    columns: Vec<String>,
    /// What stands on the horizontal axis (default: the time, or the load factor where no time passes)
    #[arg(long, value_name = "COLUMN")]
    x: Option<String>,
    /// A stored history (CSV) to compare with
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// The picture, .svg or, where that was built in, .png (default: plot.svg in the first folder)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// A history with its name in the legend.
struct Named {
    name: String,
    history: HistoryReader,
    stored: bool,
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
    let columns = columns(wanted, &runs[0].history)?;
    let x = match &wanted.x {
        Some(name) => find(&runs[0].history, name).map(|_| name.clone())?,
        None => clock(&runs).into(),
    };
    let mut curves = Vec::new();
    for (dash, run) in runs.iter().enumerate() {
        for (colour, column) in columns.iter().enumerate() {
            // A stored history need not have all columns.
            if run.stored && !run.history.names.contains(column) {
                continue;
            }
            // One column needs no name on each line, and its runs differ by colour.
            let (name, colour, dash) = match (runs.len(), columns.len()) {
                (1, _) => (column.clone(), colour, 0),
                (_, 1) => (run.name.clone(), dash, dash),
                _ => (format!("{}: {column}", run.name), colour, dash),
            };
            curves.push(curve(run, &x, column, Curve { name, points: Vec::new(), bars: None, colour, dash })?);
        }
    }
    let title = runs.iter().filter(|run| !run.stored).map(|run| run.name.as_str()).collect::<Vec<_>>().join(", ");
    let y = if let [column] = &columns[..] { column.clone() } else { String::new() };
    let path = wanted.out.clone().unwrap_or_else(|| beside(&wanted.results[0]));
    let picture = picture(&Curves { title, x, y, curves }, &path)?;
    PartFile::write_to(&path, &picture).map_err(Refusal::io)?;
    say::line(&format!("{}", path.display()));
    json::wrote("plot", &path);
    Ok(())
}

/// In the format that the name of the file asks for.
fn picture(curves: &Curves, path: &Path) -> Result<Vec<u8>, Refusal> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        None | Some("svg") => Ok(curves.to_svg().into_bytes()),
        Some("png") => png(curves),
        Some(other) => {
            let message = format!("`.{other}`: pictures are written as .svg or .png");
            Err(Refusal::of(Status::Wrong, "usage", message))
        }
    }
}

#[cfg(feature = "png")]
fn png(curves: &Curves) -> Result<Vec<u8>, Refusal> {
    curves.to_png().map_err(|why| Refusal::of(Status::Wrong, "usage", format!("the picture cannot be drawn: {why}")))
}

#[cfg(not(feature = "png"))]
fn png(_curves: &Curves) -> Result<Vec<u8>, Refusal> {
    let message =
        "this build draws .svg only: `cargo install --path . --locked --features png` makes one that draws .png";
    Err(Refusal::of(Status::Wrong, "usage", message.into()))
}

/// The history in a folder, or the file itself.
fn read(path: &Path, stored: bool) -> Result<Named, Refusal> {
    let file = HistoryReader::of_results(path).unwrap_or_else(|| path.to_path_buf());
    let history = HistoryReader::read(&file).map_err(Refusal::io)?;
    // `results/arm/history.csv` is `arm`.
    let place = if file.file_stem().is_some_and(|stem| stem.to_string_lossy().starts_with("history")) {
        file.parent()
    } else {
        None
    };
    let whole = place.and_then(|place| std::fs::canonicalize(place).ok());
    Ok(Named { name: load::name(whole.as_deref().unwrap_or(&file)), history, stored })
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

/// The columns that are named; or the displacements, or the first.
fn columns(wanted: &Wanted, history: &HistoryReader) -> Result<Vec<String>, Refusal> {
    if !wanted.columns.is_empty() {
        return wanted.columns.iter().map(|name| find(history, name).map(|_| name.clone())).collect();
    }
    let shown = |name: &&String| {
        clocks().all(|clock| clock != name.as_str()) && !name.ends_with(".err") && Some(*name) != wanted.x.as_ref()
    };
    let moved = |name: &&String| quantity(name) == Some(Quantity::Displacement);
    let all: Vec<String> = history.names.iter().filter(shown).cloned().collect();
    let some: Vec<String> = all.iter().filter(|name| moved(name)).cloned().collect();
    let usual = if some.is_empty() { all } else { some };
    if usual.is_empty() {
        return Err(Refusal::of(Status::Wrong, "usage", "the history has no columns to draw".into()));
    }
    Ok(usual.into_iter().take(USUAL).collect())
}

/// What tells the rows of all runs apart.
fn clock(runs: &[Named]) -> &'static str {
    let passes = |run: &Named| {
        let time = run.history.names.iter().position(|name| name == "time");
        time.is_none_or(|k| run.history.rows.last().zip(run.history.rows.first()).is_some_and(|(a, b)| a[k] > b[k]))
    };
    let has = |name: &str| runs.iter().all(|run| run.history.names.iter().any(|known| known == name));
    if (has("time") && runs.iter().any(passes)) || !has("load") { "time" } else { "load" }
}

fn curve(run: &Named, x: &str, column: &str, empty: Curve) -> Result<Curve, Refusal> {
    let place = |column: &str| {
        find(&run.history, column).map_err(|why| Refusal { message: format!("{}: {}", run.name, why.message), ..why })
    };
    let (x, y) = (place(x)?, place(column)?);
    let points: Vec<(f64, f64)> = run.history.rows.iter().map(|row| (row[x], row[y])).collect();
    if let Some(row) = points.iter().position(|(x, y)| !(x.is_finite() && y.is_finite())) {
        let message = format!("{}: row {} of `{column}` is not finite", run.name, row + 1);
        return Err(Refusal::of(Status::Wrong, "usage", message));
    }
    let bars = run.history.names.iter().position(|name| *name == format!("{column}.err"));
    let bars = bars.map(|k| run.history.rows.iter().map(|row| row[k]).collect::<Vec<f64>>());
    Ok(Curve { points, bars: bars.filter(|bars| bars.iter().all(|bar| bar.is_finite())), ..empty })
}

/// plot.svg in the folder of the results.
fn beside(results: &Path) -> PathBuf {
    if results.is_dir() { results.join("plot.svg") } else { results.with_file_name("plot.svg") }
}
