//! The deck of a blade of BeamDyn or windIO.

use super::beamdyn::{Blade, BladeStation, Driver, KeyPoint, Origin};
use super::deck_text::{Imported, comment, list, number, quoted, wrapped};
use crate::scene::{NaturalSpline, Spline};
use beamsim_core::sorting::sort_by;
use beamsim_core::tensor::Vec3;
use nalgebra::Matrix6;
use std::f64::consts::PI;
use std::fmt::Write;
use std::ops::Range;

/// Fractions of the length that are one place.
const ONE_PLACE: f64 = 1e-6;

/// Distance of a key point from a station, over the length, that needs no station of its own: the
/// twist at the station is that of the spline.
const KEY_AT_STATION: f64 = 1e-4;

/// The longest element over the length of the blade.
const LONGEST_ELEMENT: f64 = 1.0 / 16.0;

/// Parts of the way between key points at which the curved line of a blade is sampled: its splines
/// are over z, those of a deck over the sum of chords.
const SAMPLES: usize = 4;

/// The largest difference, in rad, of the twist between stations from that of the blade's spline: between
/// stations of a deck it is linear.
const LINEAR_TWIST: f64 = 1e-3;

/// Places between two stations at which the twist is compared.
const TWIST_SAMPLES: usize = 16;

/// The deck of a blade that is clamped at its root: with the loads of a driver, or with its modes.
pub fn blade_deck(blade: &Blade, driver: Option<&Driver>) -> Imported {
    let axis = Axis::new(blade);
    let places = places(blade, &axis, driver);
    let mut text = String::new();
    let notes: Vec<String> =
        blade.notes.iter().chain(driver.into_iter().flat_map(|driver| &driver.notes)).cloned().collect();
    head(&mut text, blade, driver, &notes);
    joints(&mut text, &axis);
    for (number, &place) in places.iter().enumerate() {
        section(&mut text, &section_name(number, places.len()), &station(blade, place));
    }
    for number in 0..axis.members.len() {
        beam(&mut text, &axis, number, &places);
    }
    let _ = writeln!(text, "[[support]]\nat = \"{}@start\"\nfix = \"all\"\n", axis.beam_name(0));
    if let Some(mu) = blade.mu {
        let _ = writeln!(
            text,
            "# mu of BeamDyn, in the order of strains here. Couplings of the stiffness have geometric means.\n\
             [damping]\nstiffness = {}\n",
            list(&mu)
        );
    }
    match driver {
        Some(driver) => loads(&mut text, blade, driver, &axis, &places),
        None => {
            text += match blade.origin {
                Origin::BeamDyn => {
                    "# The modes of the clamped blade. With a driver file there are its loads instead.\n"
                }
                Origin::WindIo => "# The modes of the clamped blade.\n",
            };
            text += "[[stage]]\nkind = \"modal\"\nmodes = 10\n";
        }
    }
    Imported { deck: text, notes }
}

/// The reference axis of a blade: a beam for each member.
struct Axis {
    members: Vec<Member>,
    length: f64,
}

/// The line of a member, with a natural spline of its own.
struct Member {
    /// x, y and twist over z
    over_z: NaturalSpline,
    /// Points from its start to its end: two if it is straight
    points: Vec<Vec3>,
    line: Spline,
    /// Arc lengths from its start to its key points
    keys: Vec<f64>,
    /// Fraction of the length of the blade at its start
    start: f64,
    /// Fraction of the length of the blade at its end
    end: f64,
}

impl Member {
    fn new(keys: &[KeyPoint]) -> Self {
        let values: Vec<Vec3> = keys.iter().map(|key| Vec3([key.place[0], key.place[1], key.twist])).collect();
        let z: Vec<f64> = keys.iter().map(|key| key.place[2]).collect();
        let over_z = NaturalSpline::new(&values, &z);
        let last = keys.len() - 1;
        let is_straight = keys.iter().all(|key| key.place[..2] == keys[0].place[..2]);
        let sample = |k: usize| {
            let [key, part] = [k / SAMPLES, k % SAMPLES];
            if part == 0 {
                return Vec3(keys[key].place);
            }
            let height = z[key] + part as f64 / SAMPLES as f64 * (z[key + 1] - z[key]);
            let Vec3([x, y, _]) = over_z.at(height);
            Vec3([x, y, height])
        };
        let points: Vec<Vec3> = match is_straight {
            true => vec![Vec3(keys[0].place), Vec3(keys[last].place)],
            false => (0..=SAMPLES * last).map(sample).collect(),
        };
        let line = Spline::new(&points, None);
        let length_to = |k: usize| if is_straight { z[k] - z[0] } else { line.length_to(SAMPLES * k) };
        let keys = (0..=last).map(length_to).collect();
        Self { over_z, points, line, keys, start: 0.0, end: 1.0 }
    }

    fn length(&self) -> f64 {
        self.keys[self.keys.len() - 1]
    }

    /// The fraction of its length at a fraction of the length of the blade.
    fn own(&self, place: f64) -> f64 {
        if place <= self.start + 2.0 * ONE_PLACE {
            0.0
        } else if place >= self.end - 2.0 * ONE_PLACE {
            1.0
        } else {
            (place - self.start) / (self.end - self.start)
        }
    }

    /// The numbers of those of these places, which increase, that lie on it.
    fn range(&self, places: &[f64]) -> Range<usize> {
        let first = places.partition_point(|place| *place < self.start - 2.0 * ONE_PLACE);
        first..places.partition_point(|place| *place <= self.end + 2.0 * ONE_PLACE)
    }

    /// The angle of the section axes about the tangent at a fraction of its length, against axes
    /// whose third one is the part of y normal to the tangent. BeamDyn turns x by the twist about
    /// -z in the plane of x and y, and then along the tangent into the section.
    fn angle(&self, own: f64) -> f64 {
        let tangent = self.line.tangent(own * self.length());
        let z = self.line.place(own * self.length()).0[2];
        let twist = -self.over_z.at(z).0[2];
        let (sin, cos) = libm::sincos(twist);
        let Vec3([t1, t2, t3]) = tangent;
        let across = Vec3([t3 * cos, t3 * sin, -(t1 * cos + t2 * sin)]);
        let normal = Vec3::UNIT[1] - tangent * tangent.dot(Vec3::UNIT[1]);
        let e3 = normal * (1.0 / normal.norm());
        let e2 = e3.cross(tangent);
        libm::atan2(across.dot(e3), across.dot(e2))
    }
}

impl Axis {
    fn new(blade: &Blade) -> Self {
        let member = |ends: &[usize]| Member::new(&blade.key_points[ends[0]..=ends[1]]);
        let mut members: Vec<Member> = blade.member_ends.windows(2).map(member).collect();
        let length: f64 = members.iter().map(Member::length).sum();
        let mut before = 0.0;
        let last = members.len() - 1;
        for (number, member) in members.iter_mut().enumerate() {
            member.start = before / length;
            before += member.length();
            member.end = if number == last { 1.0 } else { before / length };
        }
        Self { members, length }
    }

    fn beam_name(&self, member: usize) -> String {
        if self.members.len() == 1 { "blade".into() } else { format!("blade_{}", member + 1) }
    }

    /// A place of the deck at a fraction of the length of the blade.
    fn place_name(&self, place: f64) -> String {
        let last = self.members.len() - 1;
        let member = self.members.partition_point(|member| member.end + 2.0 * ONE_PLACE < place).min(last);
        format!("{}@{}", self.beam_name(member), number(self.members[member].own(place)))
    }

    /// Parts of the way between two places, on one member, in which the twist is nearly linear.
    fn parts_of_linear_twist(&self, [from, to]: [f64; 2]) -> usize {
        let holds = |member: &&Member| to <= member.end + 2.0 * ONE_PLACE;
        let Some(member) = self.members.iter().find(holds) else { return 1 };
        let part = |k: usize| k as f64 / TWIST_SAMPLES as f64;
        let mut angles: Vec<f64> =
            (0..=TWIST_SAMPLES).map(|k| member.angle(member.own(from + (to - from) * part(k)))).collect();
        continue_turns(&mut angles);
        let linear = |k: usize| angles[0] + (angles[TWIST_SAMPLES] - angles[0]) * part(k);
        let off = (0..=TWIST_SAMPLES).map(|k| (angles[k] - linear(k)).abs()).fold(0.0, f64::max);
        // The difference falls with the square of the length.
        (off / LINEAR_TWIST).sqrt().ceil().max(1.0) as usize
    }

    /// Fractions of the length of the blade at which stations of its sections stand for key points.
    fn key_places(&self) -> impl Iterator<Item = f64> {
        self.members.iter().flat_map(|member| member.keys.iter().map(|key| member.start + key / self.length))
    }
}

/// Angles that go on from one to the next, without jumps of a whole turn.
fn continue_turns(angles: &mut [f64]) {
    for k in 1..angles.len() {
        angles[k] += 2.0 * PI * ((angles[k - 1] - angles[k]) / (2.0 * PI)).round();
    }
}

/// A station of the deck: one of the blade file, or between two of them.
struct Station {
    fraction: f64,
    stiffness: Matrix6<f64>,
    mass: Matrix6<f64>,
    source: String,
}

/// Fractions of the length at which the deck has stations and elements end: the stations of the
/// blade file, ends of members, key points, point loads, and places between these where the twist
/// bends.
fn places(blade: &Blade, axis: &Axis, driver: Option<&Driver>) -> Vec<f64> {
    let own: Vec<f64> = blade.stations.iter().map(|station| station.eta).collect();
    let is_away = |place: &f64| {
        let next = own.partition_point(|eta| eta < place);
        own[next.saturating_sub(1)..own.len().min(next + 1)].iter().all(|eta| (eta - place).abs() > KEY_AT_STATION)
    };
    let keys = axis.key_places().filter(is_away);
    let ends = axis.members.iter().map(|member| member.end);
    let loads = driver.into_iter().flat_map(|driver| driver.points.iter().map(|(eta, _)| *eta));
    let others = keys.chain(ends).chain(loads).map(|place| (place, false));
    let mut all: Vec<(f64, bool)> = own.iter().map(|&eta| (eta, true)).chain(others).collect();
    sort_by(&mut all, |a, b| a.0.total_cmp(&b.0));
    let mut kept: Vec<(f64, bool)> = Vec::new();
    for (place, is_own) in all {
        match kept.last_mut() {
            Some(before) if place - before.0 <= ONE_PLACE && !is_own => {}
            Some(before) if place - before.0 <= ONE_PLACE && !before.1 => *before = (place, is_own),
            Some(_) | None => kept.push((place, is_own)),
        }
    }
    let stations: Vec<f64> = kept.into_iter().map(|(place, _)| place).collect();
    let divided = |pair: &[f64]| -> Vec<f64> {
        let [from, to] = [pair[0], pair[1]];
        let parts = axis.parts_of_linear_twist([from, to]);
        (1..parts).map(|k| from + (to - from) * k as f64 / parts as f64).chain([to]).collect()
    };
    stations[..1].iter().copied().chain(stations.windows(2).flat_map(divided)).collect()
}

/// The one of these places, which increase, that is next to a place.
fn nearest(places: &[f64], place: f64) -> f64 {
    let next = places.partition_point(|&known| known < place).clamp(1, places.len() - 1);
    let [before, after] = [places[next - 1], places[next]];
    if place - before <= after - place { before } else { after }
}

fn station(blade: &Blade, fraction: f64) -> Station {
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
        stiffness: between(&from.stiffness, &to.stiffness),
        mass: between(&from.mass, &to.mass),
        source,
    }
}

fn head(text: &mut String, blade: &Blade, driver: Option<&Driver>, notes: &[String]) {
    let _ = writeln!(text, "#:schema beamsim.schema.json");
    let _ = match blade.origin {
        Origin::BeamDyn => writeln!(
            text,
            "# From files of BeamDyn: {} (key points), {} (sections)",
            comment(&blade.primary),
            comment(&blade.file)
        ),
        Origin::WindIo => writeln!(text, "# From a file of windIO: the blade (six_x_six) of {}", comment(&blade.file)),
    };
    if let Some(driver) = driver {
        let _ = writeln!(text, "# and {} (loads)", comment(&driver.file));
    }
    *text += "#\n# Global axes are those of the root frame of the blade. Local axes 1, 2, 3 are z, x, y of its sections, so that\n\
              # rows x y z x y z of its matrices are rows 2 3 1 2 3 1 here. The twist of the file is about -z.\n";
    for note in notes {
        let _ = writeln!(text, "# {}", comment(note));
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
    let _ = writeln!(text, "[section.{name}] # at {}: {}", number(station.fraction), comment(&station.source));
    let _ = writeln!(text, "stiffness = {}", rows(&station.stiffness));
    let _ = writeln!(text, "mass = {}\n", rows(&station.mass));
}

/// Points at which members meet.
fn joints(text: &mut String, axis: &Axis) {
    if axis.members.len() == 1 {
        return;
    }
    *text += "# Members of the blade are beams, which meet at these points.\n[point]\n";
    for (number, member) in axis.members.iter().enumerate().skip(1) {
        let _ = writeln!(text, "member_{} = {}", number + 1, list(&member.points[0].0));
    }
    *text += "\n";
}

/// Places where the elements of a member end, without its own: its stations, and equal parts of
/// what is long.
fn element_ends(stations: &[f64], longest: f64) -> Vec<f64> {
    let parts = |pair: &[f64]| {
        let [from, to] = [pair[0], pair[1]];
        let count = ((to - from) / longest).ceil().max(1.0) as usize;
        (1..=count).map(|k| if k == count { to } else { from + (to - from) * k as f64 / count as f64 }).collect()
    };
    let mut all: Vec<f64> = stations.windows(2).flat_map::<Vec<f64>, _>(parts).collect();
    all.pop();
    all
}

fn beam(text: &mut String, axis: &Axis, number: usize, places: &[f64]) {
    let member = &axis.members[number];
    let mut stations: Vec<(usize, f64)> = member.range(places).map(|k| (k, member.own(places[k]))).collect();
    stations.dedup_by_key(|station| station.1);
    let names: Vec<String> = stations.iter().map(|(k, _)| format!("\"{}\"", section_name(*k, places.len()))).collect();
    let fractions: Vec<f64> = stations.iter().map(|(_, own)| *own).collect();
    let mut angles: Vec<f64> = fractions.iter().map(|own| member.angle(*own)).collect();
    continue_turns(&mut angles);
    let mut points: Vec<String> = member.points.iter().map(|point| list(&point.0)).collect();
    if number > 0 {
        points[0] = format!("\"member_{}\"", number + 1);
    }
    if let Some(point) = points.last_mut().filter(|_| number + 1 < axis.members.len()) {
        *point = format!("\"member_{}\"", number + 2);
    }
    let line = if points.len() == 2 { "through" } else { "spline" };
    let _ = writeln!(text, "[[beam]]\nname = \"{}\"", axis.beam_name(number));
    let _ = writeln!(text, "section = {}", wrapped(&names));
    let _ = writeln!(text, "stations = {}", list(&fractions));
    let _ = writeln!(text, "stations_in = \"fraction\"");
    let _ = writeln!(text, "twist = {} # rad, about axis 1", list(&angles));
    let _ = writeln!(text, "{line} = {}", wrapped(&points));
    *text += "axis3 = [0, 1, 0]\n";
    let ends = element_ends(&fractions, LONGEST_ELEMENT / (member.end - member.start));
    let _ = match ends.is_empty() {
        true => writeln!(text, "elements = 1"),
        false => writeln!(text, "elements = [{}] # they end at the stations", list(&ends)),
    };
    *text += "order = 2\n\n";
}

fn loads(text: &mut String, blade: &Blade, driver: &Driver, axis: &Axis, places: &[f64]) {
    let last = axis.beam_name(axis.members.len() - 1);
    let along = (0..axis.members.len()).map(|number| ("along", axis.beam_name(number), driver.along));
    let tip = ("at", format!("{last}@end"), driver.tip);
    let points = driver.points.iter().map(|(eta, load)| ("at", axis.place_name(nearest(places, *eta)), *load));
    for (key, place, load) in along.chain([tip]).chain(points) {
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
    let _ = writeln!(text, "\n[output]\nnodes = [\"{last}@end\"]\ncolumns = [\"u\", \"r\"]");
}

fn rows(matrix: &Matrix6<f64>) -> String {
    let row = |i: usize| {
        let entries: Vec<String> = (0..6).map(|j| number(matrix[(i, j)])).collect();
        format!("  [{}],\n", entries.join(", "))
    };
    format!("[\n{}]", (0..6).map(row).collect::<String>())
}
