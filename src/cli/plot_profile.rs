//! `beamsim plot results/NAME/profile.csv`: diagrams of resultants and stresses along beams.

use super::error::CommandError;
use super::picture::{Format, PlotArguments};
use super::plotted::{OneOf, PlottedRun, line_of, unknown, write, y_title};
use super::{console, load, outputs};
use crate::output::{Axis, Line, LinePlot, ProfileReader, Record, Scale, Units};
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
    let run = PlottedRun::of(file, "profile");
    if profile.rows.is_empty() {
        return Err(CommandError::Usage(format!("{} has no rows{}", file.display(), run.remark())));
    }
    run.warning("profile", file).iter().for_each(|warning| console::note(warning));
    let units = run.record.as_ref().map(Record::units).unwrap_or_default();
    let stage = stage(wanted, &profile)?;
    let beams = beams(wanted, &profile)?;
    let columns = columns(wanted, &profile, stage)?;
    let lines = lines(&profile, stage, &beams, &columns, &units);
    let name = run.title().map_or_else(|| load::without_extension(file, ".csv"), str::to_string);
    let title = if last_stage(&profile) == 1 { name } else { format!("{name}: end of stage {stage}") };
    let title = title + &run.remark();
    let plot = LinePlot {
        title,
        x: Axis { title: length_title(&units), scale: Scale::Linear },
        y: Axis { title: y_title(&columns, &units, at_place), scale: Scale::Linear },
        lines,
        level: None,
        boundaries: Vec::new(),
    };
    write(&plot, &path, format)
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
            return Err(unknown("profile", "beam", name, &known));
        }
    }
    let all = || known.iter().map(ToString::to_string).collect();
    Ok(if wanted.beams.is_empty() { all() } else { wanted.beams.clone() })
}

fn columns(wanted: &PlotArguments, profile: &ProfileReader, stage: usize) -> Result<Vec<String>, CommandError> {
    let known: Vec<&str> = profile.names.iter().map(String::as_str).collect();
    if let Some(name) = wanted.columns.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(unknown("profile", "column", name, &known));
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

/// A line for each column of each beam.
fn lines(profile: &ProfileReader, stage: usize, beams: &[String], columns: &[String], units: &Units) -> Vec<Line> {
    let has_one_quantity = !y_title(columns, units, at_place).is_empty();
    let mut lines = Vec::new();
    for (number, beam) in beams.iter().enumerate() {
        for (place, column) in columns.iter().enumerate() {
            let Some(k) = profile.names.iter().position(|name| name == column) else { continue };
            let rows = profile.rows.iter().filter(|row| row.stage == stage && row.beam == *beam);
            let points = rows.filter_map(|row| Some((row.length, row.values[k]?))).collect();
            let of_column = if has_one_quantity { column.clone() } else { units.title(column, &at_place(column)) };
            let (name, style) = line_of(
                OneOf { name: beam.clone(), number, count: beams.len() },
                OneOf { name: of_column, number: place, count: columns.len() },
            );
            lines.push(Line { name, points, bars: None, beside: Vec::new(), style });
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
