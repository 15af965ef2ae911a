//! Stresses of a section for `beamsim section`: a table, and pictures of computed sections.

use super::error::CommandError;
use super::{console, json};
use crate::output::{SectionPicture, StressShade, Units};
use crate::scene::Solution;
use beamsim_core::probe::Dimension;
use beamsim_core::section::Vector6;
use beamsim_core::section::recovery::{Measure, Recovery};
use beamsim_core::section::stress::{Peak, von_mises};

/// Names of the resultants
const RESULTANTS: [&str; 6] = ["N1", "N2", "N3", "M1", "M2", "M3"];

/// End of the names of pictures of stresses
const STRESS: &str = "-stress";

/// The dimension of stresses: force / length²
const STRESS_UNIT: Dimension = Dimension { length: -2, ..Dimension::FORCE };

/// Resultants whose stresses are shown, with their names.
pub struct Loads {
    all: Vec<(String, Vector6)>,
    /// True where they are given and not units
    is_given: bool,
}

/// The given resultants, or each unit resultant.
pub fn loads(given: &[f64]) -> Result<Loads, CommandError> {
    if given.is_empty() {
        let unit = |k: usize| (RESULTANTS[k].to_string(), Vector6::ith(k, 1.0));
        return Ok(Loads { all: (0..6).map(unit).collect(), is_given: false });
    }
    if let Some(number) = given.iter().find(|number| !number.is_finite()) {
        return Err(CommandError::Usage(format!("--load needs finite numbers, found {number}")));
    }
    if given.len() != 6 {
        let count = given.len();
        return Err(CommandError::Usage(format!(
            "--load needs the six resultants N1,N2,N3,M1,M2,M3, found {count}: --load 0,0,100,0,50,0"
        )));
    }
    Ok(Loads { all: vec![("the load".into(), Vector6::from_column_slice(given))], is_given: true })
}

/// Ends of the names of all pictures.
pub fn endings() -> impl Iterator<Item = String> {
    std::iter::once(STRESS.to_string()).chain(RESULTANTS.iter().map(|name| format!("{STRESS}-{name}")))
}

/// Prints the largest stresses: von Mises of units, and all measures of a given load.
pub fn show(
    section: &Recovery,
    loads: &Loads,
    units: &Units,
    digits: impl Fn(f64) -> String,
) -> Vec<json::SectionStress> {
    let mut all = Vec::new();
    if section.left_out > 0 {
        console::line(&format!(
            "  stress: {} points near sharp corners that point into the material are left out, where it is infinite",
            section.left_out
        ));
    }
    let unit = units.label(STRESS_UNIT).map_or(String::new(), |unit| format!(" {unit}"));
    let one = if loads.is_given { "" } else { " = 1" };
    for (name, load) in &loads.all {
        let mut print = |measure: &str, sign: f64, unit: &str, found: Option<Peak>| {
            let Some(Peak { value, at: [x2, x3], region }) = found else { return };
            let value = sign * value;
            let place = format!("at ({}, {})", digits(x2), digits(x3));
            let region = section.regions.get(region).cloned().unwrap_or_default();
            let of_region = if section.regions.len() > 1 { format!(", {region}") } else { String::new() };
            console::line(&format!("  {measure} under {name}{one}: {}{unit} {place}{of_region}", digits(value)));
            let measure = measure.to_string();
            all.push(json::SectionStress { load: name.clone(), measure, value, at: [x2, x3], region });
        };
        let count = if loads.is_given { Measure::ALL.len() } else { 1 };
        for (measure, column, sign) in Measure::ALL.into_iter().take(count) {
            print(column, sign, &unit, section.largest(measure, load, f64::NEG_INFINITY));
        }
        if section.has_strength() && loads.is_given {
            print("index", 1.0, "", section.largest_index(load, f64::NEG_INFINITY));
        }
    }
    all
}

/// Pictures of the von Mises stress of a computed section, with the ends of their names.
pub fn pictures<'a>(
    solution: &'a Solution,
    section: &Recovery,
    loads: &Loads,
    units: &Units,
    digits: impl Fn(f64) -> String,
) -> Result<Vec<(String, SectionPicture<'a>)>, CommandError> {
    let field = solution.analysis.stresses(&solution.materials);
    let field = field.map_err(|error| CommandError::Usage(format!("section `{}`: {error}", section.name)))?;
    let unit = units.label(STRESS_UNIT).map_or(String::new(), |unit| format!(" {unit}"));
    let picture = |(name, load): &(String, Vector6)| {
        let largest = section.largest(Measure::VonMises, load, f64::NEG_INFINITY).map_or(0.0, |peak| peak.value);
        let end = if loads.is_given { STRESS.to_string() } else { format!("{STRESS}-{name}") };
        let one = if loads.is_given { "" } else { " = 1" };
        let picture = SectionPicture {
            title: format!("section {}: von Mises stress under {name}{one}", section.name),
            mesh: &field.mesh,
            materials: Vec::new(),
            points: Vec::new(),
            warping: None,
            stress: Some(StressShade {
                of_elements: field.nodal.of_elements(&section.field_load(load), von_mises),
                largest,
                legend: format!("{}{unit}", digits(largest)),
            }),
        };
        (end, picture)
    };
    Ok(loads.all.iter().map(picture).collect())
}
