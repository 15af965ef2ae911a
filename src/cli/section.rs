//! `beamsim section`: the properties of sections, a picture, and a table to paste into a deck.

use super::error::CommandError;
use super::status::Status;
use super::verdict::Verdict;
use super::{console, folders, json, load, outputs, section_stress};
use crate::deck::{self, Deck};
use crate::output::{OutputKind, PartFile, SectionPicture, Units};
use crate::scene::{self, Solution, SolvedSection};
use beamsim_core::model::SectionMatrices;
use beamsim_core::probe::Dimension;
use beamsim_core::section::properties::{Properties, mass_centre};
use beamsim_core::section::saint_venant::spd_inverse;
use beamsim_core::section::{Matrix6, Point};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Shear coefficients of one material below this deserve a remark
const SOFT_IN_SHEAR: f64 = 0.3;

/// Sections of a deck.
#[derive(clap::Args)]
pub struct SectionArguments {
    /// Deck (TOML file)
    #[arg(value_name = "DECK")]
    deck: PathBuf,
    /// Names of sections (default: all)
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Change a value of the deck; may be repeated: section.beam.t_f=0.01
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder of the pictures (default: results/<deck name>)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Resultants of which stresses are shown, in the axes of the beam (default: each unit resultant)
    #[arg(long, value_name = "N1,N2,N3,M1,M2,M3", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    load: Vec<f64>,
}

/// Prints properties of sections and draws those that were computed.
pub fn section(wanted: &SectionArguments) -> Status {
    let mut verdict = Verdict::default();
    if let Err(error) = all(wanted) {
        verdict.fail(error);
    }
    verdict.finish(1)
}

fn all(wanted: &SectionArguments) -> Result<(), CommandError> {
    let path = &wanted.deck;
    let read = load::read(path, &load::deck_text(path)?, &wanted.set)?;
    if read.found.iter().any(|found| !found.is_warning()) {
        return Err(read.refuse(path, &read.found));
    }
    let deck = &read.deck;
    let units = Units::of_deck(&deck.resolved);
    let folder = folders::folder(wanted.out.as_deref(), &load::name(path), false);
    let loads = section_stress::loads(&wanted.load)?;
    let mut warnings = Vec::new();
    for section in chosen(deck, &wanted.names)? {
        let matrices = scene::section_matrices(section, deck).map_err(|found| read.refuse(path, &[found]))?;
        let solved = scene::solved(section, deck).transpose().map_err(|found| read.refuse(path, &[found]))?;
        let report = Report::new(section, &matrices, solved.as_ref(), &units);
        report.print();
        let stresses = solved.as_ref().map(|_| scene::section_stresses(section, deck, &section.name.span));
        let stresses = stresses.transpose().map_err(|found| read.refuse(path, &[found]))?;
        if stresses.is_none() && !wanted.load.is_empty() {
            console::line("  no stress: the section is given by numbers, not by a shape");
        }
        let shown =
            stresses.as_ref().map_or(Vec::new(), |stresses| section_stress::show(stresses, &loads, &units, digits));
        report.table().lines().for_each(console::line);
        let picture = picture_name(&section.name.value, deck);
        let pictures = match (solved.as_ref().and_then(|solved| solved.solution.as_ref()), &stresses) {
            (Some(solution), Some(stresses)) => {
                let drawn = section_stress::pictures(solution, stresses, &loads, &units, digits)?;
                draw(&report, solution, drawn, &folder, &picture)?
            }
            (Some(_) | None, _) => Vec::new(),
        };
        json::section(&report.summary(path, shown, &pictures));
        warnings.extend(scene::section_warning(section, deck));
        warnings.extend(scene::coarse_stresses(section, deck));
    }
    read.warn(path, warnings)
}

/// The sections with the given names; all without names.
fn chosen<'d>(deck: &'d Deck, names: &[String]) -> Result<Vec<&'d deck::Section>, CommandError> {
    if deck.sections.is_empty() {
        return Err(CommandError::Usage("the deck has no [section.NAME]".into()));
    }
    if names.is_empty() {
        return Ok(deck.sections.iter().collect());
    }
    let find = |name: &String| {
        deck.sections.named(name).ok_or_else(|| {
            let known = deck::one_of(deck.sections.names());
            CommandError::Usage(format!("the deck has no section `{name}`, only {known}"))
        })
    };
    names.iter().map(find).collect()
}

/// The numbers of a section.
struct Report<'a> {
    name: &'a str,
    stiffness: Matrix6,
    /// 6x6 mass per length, where materials have a density
    mass: Option<Matrix6>,
    /// Centres and stiffnesses about the line of the beam; `None` without a positive definite
    /// stiffness
    properties: Option<Properties>,
    solved: Option<&'a SolvedSection>,
    units: &'a Units,
}

impl<'a> Report<'a> {
    fn new(
        section: &'a deck::Section,
        matrices: &SectionMatrices,
        solved: Option<&'a SolvedSection>,
        units: &'a Units,
    ) -> Self {
        let stiffness = Matrix6::from_fn(|i, j| matrices.stiffness[i][j]);
        let compliance = solved.and_then(|solved| solved.compliance).or_else(|| spd_inverse(&stiffness));
        let properties = compliance.map(|compliance| Properties::new(&compliance));
        Self { name: &section.name.value, stiffness, mass: mass_matrix(matrices), properties, solved, units }
    }

    fn print(&self) {
        console::line(&format!("section {}", self.name));
        let solution = self.solved.and_then(|solved| solved.solution.as_ref());
        let place = self.solved.map(|solved| solved.place);
        match solution {
            Some(Solution { analysis, .. }) => {
                let solution = &analysis.solution;
                let size = format!("{} nodes, {} elements", analysis.mesh.nodes.len(), analysis.mesh.elements.len());
                let error = format!("estimated relative error of the stiffness {:.1e}", analysis.estimate);
                console::line(&format!("  {size}, {error}, of resultants {:.1e}", solution.resultant_check));
                self.value("area", solution.area, Dimension { length: 2, ..Dimension::NUMBER });
            }
            None if self.solved.is_some() => console::line("  closed forms"),
            None => {}
        }
        if let Some(place) = place {
            self.point("line of the beam, in the coordinates of the shape", place);
        }
        let moment_of_area = Dimension { length: 2, ..Dimension::FORCE };
        if let Some(Properties { ea, gj, ga, shear_centre, tension_centre, ei, principal_angle }) = self.properties {
            console::line("  from the line of the beam, in its axes 2 and 3:");
            // Of a centre on an axis only round-off is left.
            let size = (ei[0] / ea).sqrt();
            let [tension_centre, shear_centre] = [tension_centre, shear_centre].map(|at| without_round_off(at, size));
            self.point("tension centre", tension_centre);
            self.point("shear centre", shear_centre);
            if let Some(mass) = self.mass.filter(|mass| mass[(0, 0)] > 0.0) {
                self.point("mass centre", without_round_off(mass_centre(&mass), size));
            }
            self.value("EA (1/S11, about the tension centre)", ea, Dimension::FORCE);
            self.value("GA2 (1/S22, about the shear centre)", ga[0], Dimension::FORCE);
            self.value("GA3 (1/S33, about the shear centre)", ga[1], Dimension::FORCE);
            self.value("GJ (1/S44)", gj, moment_of_area);
            self.value("EI, larger", ei[0], moment_of_area);
            self.value("EI, smaller", ei[1], moment_of_area);
            self.value("angle from 2 to the axis of the larger EI", principal_angle, Dimension::ANGLE);
            self.print_shear_coefficients(solution, ga);
        }
        if let Some(mass) = self.mass {
            self.value("mass per length", mass[(0, 0)], MASS_PER_LENGTH);
        }
    }

    /// Shear stiffness over that of uniform shear, for sections of one isotropic material.
    fn print_shear_coefficients(&self, solution: Option<&Solution>, ga: [f64; 2]) {
        let Some(Solution { analysis, materials, .. }) = solution else { return };
        let [material] = &materials[..] else { return };
        let Some(shear) = material.shear_modulus() else { return };
        let coefficients = ga.map(|ga| ga / (shear * analysis.solution.area));
        let [first, second] = coefficients;
        console::line(&format!("  shear coefficients GA2/(G A), GA3/(G A): {first:.6}, {second:.6}"));
        if first.min(second) < SOFT_IN_SHEAR {
            let remark = "a wide, flat section is soft in shear for long waves only: check by `shear_factor` of a \
                          rectangle whether it matters";
            console::line(&format!("  {remark}"));
        }
    }

    /// A table to paste into a deck.
    fn table(&self) -> String {
        let unit = |dimension: Dimension| self.units.label(dimension).map_or(String::new(), |unit| format!(" {unit}"));
        let [force, moment] = [Dimension::FORCE, Dimension::MOMENT].map(unit);
        let bending = unit(Dimension { length: 2, ..Dimension::FORCE });
        let units = if force.is_empty() { String::new() } else { format!(":{force},{moment},{bending}") };
        let mut text = format!("[section.{}]\n", key(self.name));
        text += &format!("# rows N1 N2 N3 M1 M2 M3, columns G1 G2 G3 K1 K2 K3{units}\n");
        text += &format!("stiffness = {}\n", rows(&self.stiffness));
        if let Some(mass) = &self.mass {
            text += "# mass per length in the same order\n";
            text += &format!("mass = {}\n", rows(mass));
        }
        text
    }

    fn value(&self, name: &str, value: f64, dimension: Dimension) {
        let unit = self.units.label(dimension).map_or(String::new(), |unit| format!(" {unit}"));
        console::line(&format!("  {name}: {}{unit}", digits(value)));
    }

    fn point(&self, name: &str, [x2, x3]: Point) {
        let unit = self.units.length().map_or(String::new(), |unit| format!(" {unit}"));
        console::line(&format!("  {name}: ({}, {}){unit}", digits(x2), digits(x3)));
    }

    fn summary(&self, deck: &Path, stress: Vec<json::SectionStress>, pictures: &[PathBuf]) -> json::Section {
        let analysis = self.solved.and_then(|solved| solved.solution.as_ref()).map(|solution| &solution.analysis);
        let rows = |matrix: &Matrix6| (0..6).map(|i| (0..6).map(|j| matrix[(i, j)]).collect()).collect();
        let text = |path: &Path| path.display().to_string();
        json::Section {
            deck: text(deck),
            section: self.name.into(),
            nodes: analysis.map(|analysis| analysis.mesh.nodes.len()),
            estimate: analysis.map(|analysis| analysis.estimate),
            area: analysis.map(|analysis| analysis.solution.area),
            line: self.solved.map(|solved| solved.place),
            tension_centre: self.properties.map(|p| p.tension_centre),
            shear_centre: self.properties.map(|p| p.shear_centre),
            mass_centre: self.mass.filter(|mass| mass[(0, 0)] > 0.0).map(|mass| mass_centre(&mass)),
            ea: self.properties.map(|p| p.ea),
            ga: self.properties.map(|p| p.ga),
            gj: self.properties.map(|p| p.gj),
            ei: self.properties.map(|p| p.ei),
            principal_angle: self.properties.map(|p| p.principal_angle),
            stress,
            stiffness: rows(&self.stiffness),
            mass: self.mass.as_ref().map(rows),
            pictures: pictures.iter().map(|path| text(path)).collect(),
        }
    }
}

/// The dimension of mass per length: force · time² / length².
const MASS_PER_LENGTH: Dimension = Dimension { angle: 0, length: -2, force: 1, time: 2 };

/// Draws a section; gives the paths of the pictures.
fn draw<'a>(
    report: &Report,
    solution: &'a Solution,
    stresses: Vec<(String, SectionPicture<'a>)>,
    folder: &Path,
    file: &str,
) -> Result<Vec<PathBuf>, CommandError> {
    let analysis = &solution.analysis;
    let centres = analysis.properties();
    let place = report.solved.map_or([0.0; 2], |solved| solved.place);
    let line = [place[0] - solution.origin[0], place[1] - solution.origin[1]];
    let mut points = vec![
        ("line of the beam", line),
        ("centroid", analysis.solution.centroid),
        ("tension centre", centres.tension_centre),
        ("shear centre", centres.shear_centre),
    ];
    if analysis.solution.mass[(0, 0)] > 0.0 {
        points.push(("mass centre", mass_centre(&analysis.solution.mass)));
    }
    let name = report.name;
    let of_materials = SectionPicture {
        title: format!("section {name}: axis 2 to the right, axis 3 upwards"),
        mesh: &analysis.mesh,
        materials: solution.materials.iter().map(|material| material.name.clone()).collect(),
        points,
        warping: None,
        stress: None,
    };
    let of_warping = SectionPicture {
        title: format!("section {name}: warping along axis 1 under a torque about it"),
        points: vec![("shear centre", centres.shear_centre)],
        materials: Vec::new(),
        warping: Some(analysis.solution.axial_warping(&analysis.mesh, TORQUE)),
        mesh: &analysis.mesh,
        stress: None,
    };
    outputs::check_folder(folder, &[])?;
    let mut paths = Vec::new();
    let own = [(String::new(), of_materials), (WARPING.into(), of_warping)];
    for (kind, picture) in own.into_iter().chain(stresses) {
        let path = folder.join(format!("{file}{kind}.svg"));
        outputs::check_file(&path, OutputKind::Svg)?;
        PartFile::write_to(&path, picture.to_svg().as_bytes())?;
        console::line(&format!("{}", path.display()));
        paths.push(path);
    }
    Ok(paths)
}

/// Number of the resultant M1 among N1 N2 N3 M1 M2 M3
const TORQUE: usize = 3;

/// The 6x6 mass [m I, -m d~; m d~, J].
fn mass_matrix(matrices: &SectionMatrices) -> Option<Matrix6> {
    let mass = matrices.mass?;
    let coupling = mass.offset.skew() * mass.mass;
    Some(Matrix6::from_fn(|i, j| match (i < 3, j < 3) {
        (true, true) if i == j => mass.mass,
        (true, true) => 0.0,
        (false, true) => coupling.0[i - 3][j],
        (true, false) => coupling.0[j - 3][i],
        (false, false) => mass.about_line.0[i - 3][j - 3],
    }))
}

/// Rows of a matrix as TOML, with the fewest digits that give the same numbers. Adding zero makes -0
/// and 0 one.
fn rows(matrix: &Matrix6) -> String {
    let row = |i: usize| {
        let entries: Vec<String> = (0..6).map(|j| format!("{:?}", matrix[(i, j)] + 0.0)).collect();
        format!("  [{}],\n", entries.join(", "))
    };
    format!("[\n{}]", (0..6).map(row).collect::<String>())
}

/// A point of a section of some size with zeros in the place of round-off.
fn without_round_off(at: Point, size: f64) -> Point {
    at.map(|x| if x.abs() < 1e-9 * size { 0.0 } else { x })
}

/// A number with seven digits; with a power of ten if it is large or small.
fn digits(value: f64) -> String {
    if value == 0.0 {
        return "0.0".into();
    }
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    if (1e-4..1e7).contains(&rounded.abs()) { format!("{rounded:?}") } else { format!("{rounded:e}") }
}

/// The name of the picture of a section: that of the section, with a number if pictures of sections
/// above it in the deck would be overwritten, also where a file system ignores case.
fn picture_name(section: &str, deck: &Deck) -> String {
    let mut taken = HashSet::new();
    for own in &deck.sections {
        let plain = file_name(&own.name.value);
        let numbered = (2_usize..).map(|number| format!("{plain}_{number}"));
        let ends = || section_stress::endings().chain([String::new(), WARPING.into()]);
        let files = |name: &String| ends().map(|end| format!("{name}{end}").to_lowercase()).collect::<Vec<_>>();
        let is_free = |name: &String| files(name).iter().all(|file| !taken.contains(file));
        let found = std::iter::once(plain.clone()).chain(numbered).find(is_free).unwrap_or(plain.clone());
        taken.extend(files(&found));
        if own.name.value == section {
            return found;
        }
    }
    file_name(section)
}

/// End of the name of the picture of the warping
const WARPING: &str = "-warping";

/// The name of a file without signs that mean something in paths.
fn file_name(name: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | ' ');
    name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect()
}

/// A name as a key of TOML.
fn key(name: &str) -> String {
    let is_bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if is_bare { name.into() } else { format!("{name:?}") }
}
