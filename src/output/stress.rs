//! stress.csv: the largest stresses of a run along all beams. profile.csv: resultants and stresses
//! along all beams at the end of each stage.

use super::cells::harmless;
use super::folder::{PROFILE, STRESS};
use super::{Extent, OutputError, ResultFolder};
use crate::scene::Mesh;
use beamsim_core::probe::{BeamPoint, Envelope, Extreme, Extremes, Profile, ProfilePlace, StageEnd, StressPlace};
use beamsim_core::section::Vector6;
use beamsim_core::section::recovery::{Measure, PlacedRecovery, Recovery};

/// Columns of a place.
const PLACE: [&str; 3] = ["beam", "fraction", "length"];

/// Columns of a largest value, after the value.
const EXTREME: [&str; 12] = ["stage", "time", "load", "x2", "x3", "region", "N1", "N2", "N3", "M1", "M2", "M3"];

/// Resultants
const RESULTANTS: [&str; 6] = ["N1", "N2", "N3", "M1", "M2", "M3"];

/// Writes the table of largest stresses of a run, as far as it came; gives its name.
pub fn write_envelope(
    folder: &ResultFolder,
    mesh: &Mesh,
    envelope: &Envelope,
    extent: Extent,
) -> Result<&'static str, OutputError> {
    let mut header: Vec<String> = PLACE.iter().chain(&["section", "vm"]).map(ToString::to_string).collect();
    header.extend(EXTREME.map(String::from));
    let found = envelope.found();
    let has_index = found.iter().any(|found| found.index.is_some());
    if has_index {
        header.push("index".into());
        header.extend(EXTREME.map(|name| format!("index.{name}")));
    }
    let row = |(place, found): (&StressPlace, &Extremes)| {
        let mut cells = place_cells(mesh, &place.inside);
        cells.push(harmless(&place.section.section().name).into_owned());
        cells.extend(extreme_cells(place.section.section(), found.von_mises.as_ref()));
        if has_index {
            cells.extend(extreme_cells(place.section.section(), found.index.as_ref()));
        }
        cells
    };
    let rows = envelope.places().iter().zip(&found).map(row);
    write(folder, extent.name(STRESS), &header, rows)
}

/// Writes the table of resultants of a run, as far as it came; gives its name.
pub fn write_profile(
    folder: &ResultFolder,
    mesh: &Mesh,
    profile: &Profile,
    extent: Extent,
) -> Result<&'static str, OutputError> {
    let known = || profile.places().iter().filter_map(|place| place.section.as_ref());
    let has_stress = known().next().is_some();
    let has_index = known().any(|section| section.section().has_strength());
    let stress = has_stress.then_some("vm").into_iter().chain(has_index.then_some("index"));
    let clocks = ["stage", "time", "load"];
    let header: Vec<&str> = clocks.into_iter().chain(PLACE).chain(RESULTANTS).chain(stress).collect();
    let row = |end: &StageEnd, place: &ProfilePlace, resultants: &[f64; 6]| {
        let moment = end.moment;
        let mut cells = vec![moment.stage.to_string(), number(moment.time), number(moment.load)];
        cells.extend(place_cells(mesh, &place.inside));
        cells.extend(resultants.iter().copied().map(number));
        let load = Vector6::from(*resultants);
        let lowest = f64::NEG_INFINITY;
        let of_section = |find: &dyn Fn(&PlacedRecovery) -> Option<f64>| {
            place.section.as_ref().and_then(find).map_or(String::new(), number)
        };
        if has_stress {
            cells.push(of_section(&|section| Some(section.largest(Measure::VonMises, &load, lowest)?.value)));
        }
        if has_index {
            cells.push(of_section(&|section| Some(section.largest_index(&load, lowest)?.value)));
        }
        cells
    };
    let rows = profile.ends().iter().flat_map(|end| {
        profile.places().iter().zip(&end.resultants).map(|(place, resultants)| row(end, place, resultants))
    });
    write(folder, extent.name(PROFILE), &header, rows)
}

fn write<H: AsRef<[u8]>>(
    folder: &ResultFolder,
    name: &'static str,
    header: &[H],
    rows: impl Iterator<Item = Vec<String>>,
) -> Result<&'static str, OutputError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header)?;
    for row in rows {
        writer.write_record(row)?;
    }
    let bytes = writer.into_inner().map_err(|error| OutputError::content(&folder.part(name), error))?;
    folder.write(name, &bytes)?;
    Ok(name)
}

/// Beam, fraction of its length, and length from its start.
fn place_cells(mesh: &Mesh, place: &BeamPoint) -> Vec<String> {
    let beam = &mesh.beams[place.beam];
    vec![harmless(&beam.name).into_owned(), number(place.fraction), number(place.fraction * beam.line.length)]
}

/// A largest value with when and where it was; empty cells if there is none.
fn extreme_cells(section: &Recovery, found: Option<&Extreme>) -> Vec<String> {
    let Some(Extreme { value, moment, at, region, resultant }) = found else {
        return vec![String::new(); 1 + EXTREME.len()];
    };
    let mut cells = vec![number(*value), moment.stage.to_string(), number(moment.time), number(moment.load)];
    cells.extend(at.map(number));
    cells.push(harmless(section.regions.get(*region).map_or("", String::as_str)).into_owned());
    cells.extend(resultant.map(number));
    cells
}

/// The shortest text that reads back to the same number.
fn number(value: f64) -> String {
    format!("{value:?}")
}
