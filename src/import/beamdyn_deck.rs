//! The deck of a blade of BeamDyn.

use super::beamdyn::{Blade, BladeStation, Driver};
use super::deck_text::{Imported, list, number, quoted, wrapped};
use crate::scene::{NaturalSpline, Spline};
use beamsim_core::tensor::Vec3;
use nalgebra::Matrix6;
use std::fmt::Write;

/// Fractions of the length that are one place.
const ONE_PLACE: f64 = 1e-6;

/// The longest element over the length of the blade.
const LONGEST_ELEMENT: f64 = 1.0 / 16.0;

/// Parts of the way between key points at which the curved line of a blade is sampled: its splines
/// are over z, those of a deck over the sum of chords.
const SAMPLES: usize = 4;

/// The deck of a blade that is clamped at its root: with the loads of a driver, or with its modes.
pub fn beamdyn_deck(blade: &Blade, driver: Option<&Driver>) -> Imported {
    let axis = Axis::new(blade);
    let stations = stations(blade, &axis, driver);
    let mut text = String::new();
    let notes: Vec<String> =
        blade.notes.iter().chain(driver.into_iter().flat_map(|driver| &driver.notes)).cloned().collect();
    head(&mut text, blade, driver, &notes);
    for (number, station) in stations.iter().enumerate() {
        section(&mut text, &section_name(number, stations.len()), station);
    }
    beam(&mut text, &axis, &stations, &element_ends(blade, driver));
    if let Some(mu) = blade.mu {
        let _ = writeln!(
            text,
            "# mu of BeamDyn, in the order of strains here. Couplings of the stiffness have geometric means.\n\
             [damping]\nstiffness = {}\n",
            list(&mu)
        );
    }
    match driver {
        Some(driver) => loads(&mut text, blade, driver),
        None => {
            text += "# The modes of the clamped blade. With a driver file there are its loads instead.\n[[stage]]\nkind = \"modal\"\nmodes = 10\n"
        }
    }
    Imported { deck: text, notes }
}

/// The reference axis of a blade.
struct Axis {
    /// Natural splines of x, y and twist over z, one for each member, with the z of its end
    members: Vec<(NaturalSpline, f64)>,
    /// Points from root to tip: two if it is straight
    points: Vec<Vec3>,
    line: Spline,
    length: f64,
}

impl Axis {
    fn new(blade: &Blade) -> Self {
        let z = |k: usize| blade.key_points[k].place[2];
        let member = |ends: &[usize]| {
            let keys = &blade.key_points[ends[0]..=ends[1]];
            let values: Vec<Vec3> = keys.iter().map(|key| Vec3([key.place[0], key.place[1], key.twist])).collect();
            let parameters: Vec<f64> = keys.iter().map(|key| key.place[2]).collect();
            (NaturalSpline::new(&values, &parameters), parameters[parameters.len() - 1])
        };
        let members: Vec<_> = blade.member_ends.windows(2).map(member).collect();
        let last = blade.key_points.len() - 1;
        let place = |z: f64| {
            let Vec3([x, y, _]) = value_at(&members, z);
            Vec3([x, y, z])
        };
        let first = Vec3(blade.key_points[0].place);
        let is_straight = blade.key_points.iter().all(|key| key.place[..2] == first.0[..2]);
        let points: Vec<Vec3> = if is_straight {
            vec![first, Vec3(blade.key_points[last].place)]
        } else {
            let sample = |k: usize| {
                let part = (k % SAMPLES) as f64 / SAMPLES as f64;
                let from = z(k / SAMPLES);
                place(if k.is_multiple_of(SAMPLES) { from } else { from + part * (z(k / SAMPLES + 1) - from) })
            };
            (0..=SAMPLES * last).map(sample).collect()
        };
        let line = Spline::new(&points, None);
        let length = line.length_to(points.len() - 1);
        Self { members, points, line, length }
    }

    /// The fraction of the length of a key point.
    fn fraction_of_key(&self, number: usize, z: f64) -> f64 {
        if self.points.len() == 2 {
            return (z - self.points[0].0[2]) / self.length;
        }
        self.line.length_to(SAMPLES * number) / self.length
    }

    /// The angle of the section axes about the tangent at a fraction of the length, against axes
    /// whose third one is the part of y normal to the tangent. BeamDyn turns x by the twist about -z
    /// in the plane of x and y, and then along the tangent into the section.
    fn angle(&self, fraction: f64) -> f64 {
        let tangent = self.line.tangent(fraction * self.length);
        let z = self.line.place(fraction * self.length).0[2];
        let twist = -value_at(&self.members, z).0[2];
        let (sin, cos) = libm::sincos(twist);
        let Vec3([t1, t2, t3]) = tangent;
        let across = Vec3([t3 * cos, t3 * sin, -(t1 * cos + t2 * sin)]);
        let normal = Vec3::UNIT[1] - tangent * tangent.dot(Vec3::UNIT[1]);
        let e3 = normal * (1.0 / normal.norm());
        let e2 = e3.cross(tangent);
        libm::atan2(across.dot(e3), across.dot(e2))
    }
}

/// x, y and twist at a height z.
fn value_at(members: &[(NaturalSpline, f64)], z: f64) -> Vec3 {
    let found = members.iter().find(|(_, end)| z <= *end).or(members.last());
    found.map_or(Vec3::ZERO, |(spline, _)| spline.at(z))
}

/// A station of the deck: one of the blade file, or between two of them.
struct Station {
    fraction: f64,
    angle: f64,
    stiffness: Matrix6<f64>,
    mass: Matrix6<f64>,
    source: String,
}

/// The stations of the blade file, those of key points, between which the twist varies, and those
/// of point loads.
fn stations(blade: &Blade, axis: &Axis, driver: Option<&Driver>) -> Vec<Station> {
    let own = blade.stations.iter().map(|station| station.eta);
    let keys = blade.key_points.iter().enumerate().map(|(k, key)| axis.fraction_of_key(k, key.place[2]));
    let loads = driver.into_iter().flat_map(|driver| driver.points.iter().map(|(eta, _)| *eta));
    let mut places: Vec<f64> = own.collect();
    for place in keys.chain(loads) {
        if places.iter().all(|known| (known - place).abs() > ONE_PLACE) {
            places.push(place);
        }
    }
    places.sort_by(f64::total_cmp);
    places.into_iter().map(|place| station(blade, axis, place)).collect()
}

fn station(blade: &Blade, axis: &Axis, fraction: f64) -> Station {
    let next = blade.stations.partition_point(|station| station.eta <= fraction).clamp(1, blade.stations.len() - 1);
    let [from, to]: [&BladeStation; 2] = [&blade.stations[next - 1], &blade.stations[next]];
    let part = (fraction - from.eta) / (to.eta - from.eta);
    let between = |a: &Matrix6<f64>, b: &Matrix6<f64>| if part == 1.0 { *b } else { a + (b - a) * part };
    let source = if part == 0.0 {
        format!("{}, line {}", blade.file, from.line)
    } else if part == 1.0 {
        format!("{}, line {}", blade.file, to.line)
    } else {
        format!("between lines {} and {} of {}", from.line, to.line, blade.file)
    };
    Station {
        fraction,
        angle: axis.angle(fraction),
        stiffness: between(&from.stiffness, &to.stiffness),
        mass: between(&from.mass, &to.mass),
        source,
    }
}

fn head(text: &mut String, blade: &Blade, driver: Option<&Driver>, notes: &[String]) {
    let _ = writeln!(text, "#:schema beamsim.schema.json");
    let _ = writeln!(text, "# From files of BeamDyn: {} (key points), {} (sections)", blade.primary, blade.file);
    if let Some(driver) = driver {
        let _ = writeln!(text, "# and {} (loads)", driver.file);
    }
    *text += "#\n# Global axes are those of the root frame of the blade. Local axes 1, 2, 3 are z, x, y of its sections, so that\n\
              # rows x y z x y z of its matrices are rows 2 3 1 2 3 1 here. The twist of BeamDyn is about -z.\n";
    for note in notes {
        let _ = writeln!(text, "# {note}");
    }
    let _ = writeln!(text, "title = {}", quoted(&blade.title));
    *text += "units = { length = \"m\", force = \"N\", time = \"s\" }\n";
    if let Some(driver) = driver.filter(|driver| driver.gravity != [0.0; 3]) {
        let _ = writeln!(text, "gravity = {}", list(&driver.gravity));
    }
    *text += "\n";
}

fn section_name(number: usize, count: usize) -> String {
    let width = count.to_string().len();
    format!("station_{:0width$}", number + 1)
}

fn section(text: &mut String, name: &str, station: &Station) {
    let _ = writeln!(text, "[section.{name}] # at {}: {}", number(station.fraction), station.source);
    let _ = writeln!(text, "stiffness = {}", rows(&station.stiffness));
    let _ = writeln!(text, "mass = {}\n", rows(&station.mass));
}

/// Places where elements end, without those of the blade: stations of the blade file, between which
/// matrices are linear, point loads, and equal parts of what is long.
fn element_ends(blade: &Blade, driver: Option<&Driver>) -> Vec<f64> {
    let loads = driver.into_iter().flat_map(|driver| driver.points.iter().map(|(eta, _)| *eta));
    let mut ends: Vec<f64> = blade.stations.iter().map(|station| station.eta).collect();
    for place in loads {
        if ends.iter().all(|known| (known - place).abs() > ONE_PLACE) {
            ends.push(place);
        }
    }
    ends.sort_by(f64::total_cmp);
    let parts = |pair: &[f64]| {
        let [from, to] = [pair[0], pair[1]];
        let count = ((to - from) / LONGEST_ELEMENT).ceil().max(1.0) as usize;
        (1..=count).map(|k| if k == count { to } else { from + (to - from) * k as f64 / count as f64 }).collect()
    };
    let mut all: Vec<f64> = ends.windows(2).flat_map::<Vec<f64>, _>(parts).collect();
    all.pop();
    all
}

fn beam(text: &mut String, axis: &Axis, stations: &[Station], ends: &[f64]) {
    let names: Vec<String> = (0..stations.len()).map(|k| format!("\"{}\"", section_name(k, stations.len()))).collect();
    let fractions: Vec<f64> = stations.iter().map(|station| station.fraction).collect();
    let angles: Vec<f64> = stations.iter().map(|station| station.angle).collect();
    let points: Vec<String> = axis.points.iter().map(|point| list(&point.0)).collect();
    let line = if points.len() == 2 { "through" } else { "spline" };
    let _ = writeln!(text, "[[beam]]\nname = \"blade\"");
    let _ = writeln!(text, "section = {}", wrapped(&names));
    let _ = writeln!(text, "stations = {}", list(&fractions));
    let _ = writeln!(text, "stations_in = \"fraction\"");
    let _ = writeln!(text, "twist = {} # rad, about axis 1", list(&angles));
    let _ = writeln!(text, "{line} = {}", wrapped(&points));
    *text += "axis3 = [0, 1, 0]\n";
    let _ = writeln!(text, "elements = [{}] # they end at the stations of the file", list(ends));
    *text += "order = 2\n\n[[support]]\nat = \"blade@start\"\nfix = \"all\"\n\n";
}

fn loads(text: &mut String, blade: &Blade, driver: &Driver) {
    let along = ("along", "blade".to_string(), driver.along);
    let tip = ("at", "blade@end".to_string(), driver.tip);
    let points = driver.points.iter().map(|(eta, load)| ("at", format!("blade@{}", number(*eta)), *load));
    for (key, place, load) in [along, tip].into_iter().chain(points) {
        let [force, moment] = [&load[..3], &load[3..]];
        if load == [0.0; 6] {
            continue;
        }
        let _ = writeln!(text, "[[load]]\n{key} = \"{place}\"");
        for (name, vector) in [("force", force), ("moment", moment)] {
            if vector.iter().any(|&x| x != 0.0) {
                let _ = writeln!(text, "{name} = {}", list(vector));
            }
        }
        *text += "\n";
    }
    match driver.dynamic {
        None => *text += "[[stage]]\nkind = \"static\"\nsteps = 10\n",
        Some([duration, step]) => {
            let _ = writeln!(
                text,
                "[[stage]]\nkind = \"dynamic\"\nend = {}\nstep = {}\nscheme = \"generalized_alpha\"\nrho_inf = {}",
                number(duration),
                number(step),
                number(blade.rho_inf)
            );
        }
    }
    *text += "\n[output]\nnodes = [\"blade@end\"]\ncolumns = [\"u\", \"r\"]\n";
}

fn rows(matrix: &Matrix6<f64>) -> String {
    let row = |i: usize| {
        let entries: Vec<String> = (0..6).map(|j| number(matrix[(i, j)])).collect();
        format!("  [{}],\n", entries.join(", "))
    };
    format!("[\n{}]", (0..6).map(row).collect::<String>())
}
