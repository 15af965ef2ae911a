//! `beamsim plot results/NAME/profile.csv`: diagrams of resultants and stresses along beams.

use super::error::CommandError;
use super::picture::{Format, PlotArguments};
use super::{console, json, load, outputs};
use crate::deck::nearest;
use crate::output::{Axis, Line, LinePlot, LineStyle, PartFile, ProfileReader, Record, Scale, Units, quantity_of};
use std::path::Path;

/// Columns that are drawn without `--column`: the first of these groups of which something is not zero
const DEFAULT_COLUMNS: [&[&str]; 3] = [&["M1", "M2", "M3"], &["N1", "N2", "N3"], &["vm"]];

/// A column that is smaller than this part of the largest one of its group is round-off
const MIN_PART: f64 = 1e-9;

/// The profile among the results, if there is one: it must be alone.
pub fn profile_of(results: &[impl AsRef<Path>]) -> Result<Option<&Path>, CommandError> {
    let mut paths = results.iter().map(AsRef::as_ref);
    match paths.find(|path| ProfileReader::is_profile(path)) {
        None => Ok(None),
        Some(path) if results.len() == 1 => Ok(Some(path)),
        Some(path) => {
            let message = format!("{} is a profile along beams, which is drawn alone: give one file", path.display());
            Err(CommandError::Usage(message))
        }
    }
}

/// Draws a profile.
pub fn draw(wanted: &PlotArguments, file: &Path) -> Result<(), CommandError> {
    for (option, is_given) in [("--x", wanted.x.is_some()), ("--reference", wanted.reference.is_some())] {
        if is_given {
            return Err(CommandError::Usage(format!(
                "`{option}` is for histories: a profile is over the length of beams"
            )));
        }
    }
    let path = wanted.out.clone().unwrap_or_else(|| file.with_extension("svg"));
    let format = Format::of(&path)?;
    outputs::check_file(&path, format.kind())?;
    let profile = ProfileReader::read(file)?;
    if profile.rows.is_empty() {
        return Err(CommandError::Usage(format!("{} has no rows", file.display())));
    }
    let record = file.parent().and_then(|folder| Record::read(folder).ok());
    let units = record.as_ref().map(Record::units).unwrap_or_default();
    let stage = stage(wanted, &profile)?;
    let beams = beams(wanted, &profile)?;
    let columns = columns(wanted, &profile, stage)?;
    let lines = lines(&profile, stage, &beams, &columns, &units);
    let name =
        record.as_ref().and_then(Record::title).map_or_else(|| load::without_extension(file, ".csv"), str::to_string);
    let title = if last_stage(&profile) == 1 { name } else { format!("{name}: end of stage {stage}") };
    let plot = LinePlot {
        title,
        x: Axis { title: length_title(&units), scale: Scale::Linear },
        y: Axis { title: y_title(&columns, &units), scale: Scale::Linear },
        lines,
        level: None,
        boundaries: Vec::new(),
    };
    PartFile::write_to(&path, &format.draw(&plot)?)?;
    console::line(&format!("{}", path.display()));
    json::wrote("plot", &path);
    Ok(())
}

fn last_stage(profile: &ProfileReader) -> usize {
    profile.rows.iter().map(|row| row.stage).max().unwrap_or(1)
}

fn stage(wanted: &PlotArguments, profile: &ProfileReader) -> Result<usize, CommandError> {
    let stage = wanted.stage.unwrap_or_else(|| last_stage(profile));
    if profile.rows.iter().any(|row| row.stage == stage) {
        return Ok(stage);
    }
    Err(CommandError::Usage(format!("the profile has no stage {stage}: it has stages up to {}", last_stage(profile))))
}

fn beams(wanted: &PlotArguments, profile: &ProfileReader) -> Result<Vec<String>, CommandError> {
    let known = profile.beams();
    for name in &wanted.beams {
        if !known.contains(&name.as_str()) {
            return Err(unknown("beam", name, &known));
        }
    }
    let all = || known.iter().map(ToString::to_string).collect();
    Ok(if wanted.beams.is_empty() { all() } else { wanted.beams.clone() })
}

fn columns(wanted: &PlotArguments, profile: &ProfileReader, stage: usize) -> Result<Vec<String>, CommandError> {
    let known: Vec<&str> = profile.names.iter().map(String::as_str).collect();
    if let Some(name) = wanted.columns.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(unknown("column", name, &known));
    }
    if !wanted.columns.is_empty() {
        return Ok(wanted.columns.clone());
    }
    let size = |name: &str| {
        let Some(k) = known.iter().position(|other| *other == name) else { return 0.0 };
        let rows = profile.rows.iter().filter(|row| row.stage == stage);
        rows.filter_map(|row| row.values[k]).fold(0.0, |size: f64, value| size.max(value.abs()))
    };
    let of_group = |group: &&[&'static str]| {
        let largest = group.iter().map(|name| size(name)).fold(0.0, f64::max);
        group.iter().copied().filter(|name| size(name) > MIN_PART * largest).collect::<Vec<_>>()
    };
    let chosen = DEFAULT_COLUMNS.iter().map(of_group).find(|group| !group.is_empty());
    let chosen: Vec<String> = match chosen {
        Some(group) => group.iter().map(ToString::to_string).collect(),
        None => vec!["M2".into()],
    };
    let others: Vec<&str> = known.into_iter().filter(|name| !chosen.iter().any(|other| other == name)).collect();
    console::line(&format!(
        "drawn: {}; not drawn: {}; choose columns by --column",
        chosen.join(", "),
        others.join(", ")
    ));
    Ok(chosen)
}

fn unknown(kind: &str, name: &str, known: &[&str]) -> CommandError {
    let help = match nearest(name, known.iter().copied()) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => format!("there are {}", known.join(", ")),
    };
    CommandError::Usage(format!("the profile has no {kind} `{name}`: {help}"))
}

/// A line for each column of each beam. One beam needs no name, and its columns differ by colour.
fn lines(profile: &ProfileReader, stage: usize, beams: &[String], columns: &[String], units: &Units) -> Vec<Line> {
    let has_one_quantity = !y_title(columns, units).is_empty();
    let mut lines = Vec::new();
    for (number, beam) in beams.iter().enumerate() {
        for (place, column) in columns.iter().enumerate() {
            let Some(k) = profile.names.iter().position(|name| name == column) else { continue };
            let rows = profile.rows.iter().filter(|row| row.stage == stage && row.beam == *beam);
            let points = rows.filter_map(|row| Some((row.length, row.values[k]?))).collect();
            let of_column = if has_one_quantity { column.clone() } else { units.title(column, &at_place(column)) };
            let (name, colour, dash) = match (beams.len(), columns.len()) {
                (1, _) => (of_column, place, 0),
                (_, 1) => (beam.clone(), number, number),
                _ => (format!("{beam}: {of_column}"), place, number),
            };
            lines.push(Line {
                name,
                points,
                bars: None,
                beside: Vec::new(),
                style: LineStyle::Dashed { colour, dash },
            });
        }
    }
    lines
}

/// The column of a history with the same quantity.
fn at_place(column: &str) -> String {
    format!("beam@0.{column}")
}

fn length_title(units: &Units) -> String {
    units.length().map_or("length along the beam".into(), |unit| format!("length along the beam [{unit}]"))
}

/// The title of the vertical axis: the column, or the quantity if all columns show the same one.
/// Otherwise it is empty, and the legend shows the units.
fn y_title(columns: &[String], units: &Units) -> String {
    let place = at_place(&columns[0]);
    if let [column] = columns {
        return units.title(column, &place);
    }
    let quantity = quantity_of(&place);
    let is_common = columns.iter().all(|column| quantity_of(&at_place(column)) == quantity);
    quantity.filter(|_| is_common).map_or(String::new(), |quantity| units.title(quantity, &place))
}
