//! The whole shape of a scene at the rows of its history, few enough to be carried about.

use super::super::{HistoryReader, Row, Units};
use super::encode::{base64, quantised};
use crate::scene::Scene;
use beamsim_core::effect::contact::{ContactParty, SceneSurface};
use beamsim_core::kernel::contact::Shape;
use beamsim_core::model::SlotKind;
use beamsim_core::probe::{Figure, Look, Place};
use beamsim_core::run::{Moment, Snapshot};
use beamsim_core::system::{Node, State};
use beamsim_core::tensor::{Mat3, Vec3};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::HashSet;

/// Nodes that are shown, about; more are seen by nobody.
const MOST_POINTS: usize = 2000;
/// Nodes times frames, and frames.
const MOST_LOOKS: usize = 250_000;
const MOST_FRAMES: usize = 1500;
const LEAST_FRAMES: usize = 60;
/// Nodes times frames even of scenes of very many short beams, whose ends all stay.
const MOST_LOOKS_EVER: usize = 1_000_000;
/// Events that are marked.
const MOST_EVENTS: usize = 5000;

/// Times and load factors that differ by this part of the largest are those of two moments.
const OTHER_MOMENT: f64 = 1e-9;

/// Fields below this part of the largest of their kind are round-off.
const NOTHING: f64 = 1e-9;

/// A field that colours show.
struct Field {
    name: &'static str,
    label: &'static str,
    /// Fields of one kind are compared with the largest of them
    kind: FieldKind,
}

#[derive(Clone, Copy, PartialEq)]
enum FieldKind {
    Force,
    Moment,
    EnergyPerLength,
    Stress,
}

impl FieldKind {
    /// An energy per length has the unit of a force.
    fn unit(self, units: &Units) -> Option<String> {
        match self {
            Self::Force | Self::EnergyPerLength => units.force(),
            Self::Moment => units.moment(),
            Self::Stress => units.stress(),
        }
    }
}

const fn field(name: &'static str, label: &'static str, kind: FieldKind) -> Field {
    Field { name, label, kind }
}

/// Fields of a node
const FIELD_COUNT: usize = 8;

const FIELDS: [Field; FIELD_COUNT] = [
    field("N1", "axial force N1", FieldKind::Force),
    field("N2", "shear force N2", FieldKind::Force),
    field("N3", "shear force N3", FieldKind::Force),
    field("M1", "torque M1", FieldKind::Moment),
    field("M2", "bending moment M2", FieldKind::Moment),
    field("M3", "bending moment M3", FieldKind::Moment),
    field("energy", "strain energy per length", FieldKind::EnergyPerLength),
    field("vm", "largest von Mises stress", FieldKind::Stress),
];

/// Watches a run.
pub struct Film {
    figure: Figure,
    /// Numbers of the nodes that are shown, beam by beam, then the bodies, then the ends of links
    shown: Vec<Vec<usize>>,
    names: Vec<(String, usize)>,
    reel: Reel,
    /// Rows after which it is complete, if it has an end of its own
    rows: Option<usize>,
    supports: Vec<usize>,
    joints: Vec<usize>,
}

/// What was recorded so far.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Reel {
    /// Rows of the history so far
    written: usize,
    frames: Vec<Frame>,
    /// Each n-th row has a frame
    stride: usize,
    /// The last row, where it has no frame yet
    pending: Option<PendingFrame>,
    events: Vec<FilmEvent>,
    before: [u64; 2],
}

/// Something that happened on the way to a row.
#[derive(Clone, Debug, Deserialize, Serialize)]
struct FilmEvent {
    /// Of the history
    row: usize,
    kind: String,
    text: String,
}

/// A row that gets a frame if no other follows.
#[derive(Clone, Debug, Deserialize, Serialize)]
struct PendingFrame {
    /// Of the history
    row: usize,
    /// When it is
    at: Moment,
    state: State,
    /// The state about which the stage is linear
    origin: Option<State>,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
struct Frame {
    /// Of the history
    row: usize,
    /// When it is
    at: Moment,
    places: Vec<[f32; 3]>,
    turns: Vec<[i16; 4]>,
    fields: Vec<[f32; FIELD_COUNT]>,
    /// Rotation by rows and shift of each surface
    poses: Vec<[f32; 12]>,
    /// Place and force of each contact point
    forces: Vec<[f32; 6]>,
}

impl Film {
    /// Of a scene.
    pub fn of(scene: &Scene) -> Self {
        let figure = scene.figure();
        let named = named(scene);
        let shown = shown(&figure, &named);
        let places = initial(&figure, &shown);
        let names = named.iter().filter_map(|(name, place)| Some((name.clone(), nearest(&places, place)?))).collect();
        Self {
            figure,
            shown,
            names,
            reel: Reel { written: 0, frames: Vec::new(), stride: 1, pending: None, events: Vec::new(), before: [0; 2] },
            rows: None,
            supports: supported(scene, &places),
            joints: parted(&places),
        }
    }

    /// Of a scene whose run is resumed.
    pub fn resume(scene: &Scene, reel: Reel) -> Self {
        Self { reel, ..Self::of(scene) }
    }

    /// Ends after so many rows of the history.
    pub fn until(self, rows: usize) -> Self {
        Self { rows: Some(rows), ..self }
    }

    /// True once its last row is recorded.
    pub fn is_complete(&self) -> bool {
        self.rows.is_some_and(|rows| self.reel.written >= rows)
    }

    /// What was recorded so far.
    pub fn reel(&self) -> &Reel {
        &self.reel
    }

    /// Takes a converged state, if its row is written.
    pub fn row(&mut self, at: &Snapshot, row: Row) {
        self.note_events(at);
        let due = row.wanted && self.reel.written.is_multiple_of(self.reel.stride);
        self.reel.pending = None;
        if due {
            self.reel.frames.push(self.frame(self.reel.written, at.moment(), at.state, at.origin));
            self.thin();
        } else {
            let (row, state, origin) = (self.reel.written, at.state.clone(), at.origin.cloned());
            // The last row is always written.
            self.reel.pending = Some(PendingFrame { row, at: at.moment(), state, origin });
        }
        self.reel.written += usize::from(row.wanted);
    }

    fn note_events(&mut self, at: &Snapshot) {
        let now = [at.counters.work.chart_switches, at.counters.cutbacks];
        for (k, (kind, one)) in [("chart_switch", "chart switch"), ("cutback", "cut-back")].into_iter().enumerate() {
            let count = now[k] - self.reel.before[k];
            if count > 0 && self.reel.events.len() < MOST_EVENTS {
                let text = if count == 1 { one.to_string() } else { format!("{count} × {one}") };
                self.reel.events.push(FilmEvent { row: self.reel.written, kind: kind.into(), text });
            }
        }
        self.reel.before = now;
    }

    fn frame(&self, row: usize, at: Moment, state: &State, origin: Option<&State>) -> Frame {
        let looks = self.figure.looks(state, origin);
        let stress = self.stress(&looks);
        let numbers = || self.shown.iter().flatten().copied();
        let of = || numbers().map(|k| &looks[k]);
        let contacts = &self.figure.contacts;
        Frame {
            row,
            at,
            places: of().map(|look| look.place.0.map(|x| x as f32)).collect(),
            turns: of().map(|look| quaternion(look.axes)).collect(),
            fields: numbers().map(|k| fields(&looks[k], stress[k])).collect(),
            poses: self.surfaces().iter().map(|surface| pose(surface, state)).collect(),
            forces: contacts.iter().flat_map(|contacts| contacts.forces(state)).map(force).collect(),
        }
    }

    /// The surfaces of the scene.
    fn surfaces(&self) -> &[SceneSurface] {
        self.figure.contacts.as_ref().map_or(&[], |contacts| &contacts.surfaces)
    }

    /// Largest von Mises stress of the section at each node. Between nodes where it is known it is
    /// linear, as far as pictures go; not a number where nothing of a beam is known.
    fn stress(&self, looks: &[Look]) -> Vec<f64> {
        let Some(mut all) = self.figure.von_mises(looks) else { return vec![f64::NAN; looks.len()] };
        let mut first = 0;
        for line in &self.figure.lines {
            let fractions: Vec<f64> = line.points.iter().map(|point| point.inside.fraction).collect();
            fill_gaps(&fractions, &mut all[first..first + line.points.len()]);
            first += line.points.len();
        }
        all
    }

    /// Drops every other frame where there are too many.
    fn thin(&mut self) {
        let forces = self.reel.frames.last().map_or(0, |frame| frame.forces.len());
        let points = self.shown.iter().map(Vec::len).sum::<usize>() + forces;
        let most =
            (MOST_LOOKS / points.max(1)).clamp(LEAST_FRAMES, MOST_FRAMES).min(MOST_LOOKS_EVER.div_ceil(points.max(1)));
        if self.reel.frames.len() > 2 * most {
            self.reel.stride *= 2;
            let stride = self.reel.stride;
            self.reel.frames.retain(|frame| frame.row.is_multiple_of(stride));
        }
    }

    /// Ends with the run; the history without the row of an interruption has so many rows.
    pub fn end(&mut self, rows: usize) {
        let last = self.reel.pending.take();
        let last = last.map(|PendingFrame { row, at, state, origin }| self.frame(row, at, &state, origin.as_ref()));
        self.reel.frames.extend(last);
        // A run that was stopped has written less than the one that was filmed for it.
        self.reel.frames.retain(|frame| frame.row < rows);
        self.reel.events.retain(|event| event.row < rows);
    }

    /// Rows of the history that have a frame.
    pub fn frame_rows(&self) -> Vec<usize> {
        self.reel.frames.iter().map(|frame| frame.row).collect()
    }

    /// True if the frames are those of their rows in the history. A run that was resumed with other
    /// steps or rows is not repeated by its deck.
    pub fn belongs_to(&self, history: &HistoryReader) -> bool {
        let column = |name: &str| history.names.iter().position(|other| other == name);
        let columns = [column("stage"), column("time"), column("load")];
        let moment = |frame: &Frame| [frame.at.stage as f64, frame.at.time, frame.at.load];
        let size = |k: usize| self.reel.frames.iter().fold(0.0_f64, |size, frame| size.max(moment(frame)[k].abs()));
        let sizes = [0, 1, 2].map(size);
        self.reel.frames.iter().all(|frame| {
            let Some(row) = history.rows.get(frame.row) else { return false };
            let is_same = |k: usize| {
                columns[k].is_none_or(|column| (row[column] - moment(frame)[k]).abs() <= OTHER_MOMENT * sizes[k])
            };
            (0..3).all(is_same)
        })
    }

    /// Drops all frames.
    pub fn clear(&mut self) {
        self.reel.frames.clear();
        self.reel.events.clear();
    }

    /// As the page takes it; `row` gives the number of a row of the history among those that are shown.
    pub fn to_json(&self, row: &dyn Fn(usize) -> usize, units: &Units) -> Value {
        let places = initial(&self.figure, &self.shown);
        let radii: Vec<(ContactParty, f64)> =
            self.figure.contacts.iter().flat_map(|contacts| contacts.radii()).collect();
        let radius = |of: ContactParty| radii.iter().find(|(party, _)| *party == of).map(|(_, radius)| *radius);
        let mut first = 0;
        let mut beams = Vec::new();
        for (number, (line, shown)) in self.figure.lines.iter().zip(&self.shown).enumerate() {
            // Of a thinned beam elements are not whole.
            let order = if shown.len() == line.points.len() { line.order } else { 1 };
            let nodes: Vec<usize> = (first..first + shown.len()).collect();
            let radius = radius(ContactParty::Beam(number));
            beams.push(json!({ "name": line.name, "nodes": nodes, "order": order, "closed": false, "radius": radius }));
            first += shown.len();
        }
        let nodes = |all: &[usize]| all.iter().map(|node| json!({ "node": node })).collect::<Vec<_>>();
        let body = |k: usize| json!({ "node": k, "radius": radius(ContactParty::Body(places[k].0.u)) });
        let bodies: Vec<Value> = (first..first + self.figure.bodies.len()).map(body).collect();
        let ends: Vec<usize> = (first + bodies.len()..places.len()).collect();
        let frames = || self.reel.frames.iter();
        json!({
            "nodes": places.len(),
            "names": self.names.iter().map(|(name, node)| json!({ "name": name, "node": node })).collect::<Vec<_>>(),
            "beams": beams,
            "bodies": bodies,
            "links": ends.as_chunks::<2>().0,
            "supports": nodes(&self.supports),
            "joints": nodes(&self.joints),
            "initial": base64(places.iter().flat_map(|(_, place)| place.0).flat_map(|x| (x as f32).to_le_bytes())),
            "rows": frames().map(|frame| row(frame.row)).collect::<Vec<_>>(),
            "places": base64(frames().flat_map(|frame| frame.places.as_flattened()).flat_map(|x| x.to_le_bytes())),
            "turns": base64(frames().flat_map(|frame| frame.turns.as_flattened()).flat_map(|x| x.to_le_bytes())),
            "fields": self.fields(units),
            "contacts": self.contacts(&places),
            "events": self.reel.events.iter().map(|event| at_row(event, row)).collect::<Vec<_>>(),
        })
    }

    /// Surfaces, how they move, and the forces of contacts; null in scenes without them.
    fn contacts(&self, places: &[(Node, Vec3)]) -> Value {
        if self.figure.contacts.is_none() {
            return Value::Null;
        }
        let middle =
            places.iter().fold(Vec3::ZERO, |sum, (_, place)| sum + *place) * (1.0 / places.len().max(1) as f64);
        let reach = places.iter().map(|(_, place)| (*place - middle).norm()).fold(0.0, f64::max);
        let reach = if reach > 0.0 { 1.2 * reach } else { 1.0 };
        let surface = |surface: &SceneSurface| {
            let lines = surface.surface.outline(middle, reach);
            let counts: Vec<usize> = lines.iter().map(Vec::len).collect();
            let numbers = lines.iter().flatten().flat_map(|point| point.0).flat_map(|x| (x as f32).to_le_bytes());
            let is_endless = matches!(surface.surface.shape, Shape::Plane { .. } | Shape::Cylinder { .. });
            json!({ "name": surface.name, "counts": counts, "lines": base64(numbers), "endless": is_endless })
        };
        let frames = || self.reel.frames.iter();
        let bytes = |numbers: &[f32]| numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        json!({
            "surfaces": self.surfaces().iter().map(surface).collect::<Vec<_>>(),
            "poses": base64(frames().flat_map(|frame| bytes(frame.poses.as_flattened()))),
            "counts": frames().map(|frame| frame.forces.len()).collect::<Vec<_>>(),
            "forces": base64(frames().flat_map(|frame| bytes(frame.forces.as_flattened()))),
        })
    }

    /// The fields that are more than round-off.
    fn fields(&self, units: &Units) -> Vec<Value> {
        let of = |k: usize| self.reel.frames.iter().flat_map(move |frame| frame.fields.iter().map(move |all| all[k]));
        let size = |k: usize| of(k).fold(0.0_f32, |size, x| size.max(x.abs()));
        let sizes: Vec<f32> = (0..FIELDS.len()).map(size).collect();
        let mut shown = Vec::new();
        for (k, Field { name, label, kind }) in FIELDS.iter().enumerate() {
            let of_kind = FIELDS.iter().zip(&sizes).filter(|(field, _)| field.kind == *kind).map(|(_, size)| *size);
            let largest = of_kind.fold(0.0, f32::max);
            if f64::from(sizes[k]) > NOTHING * f64::from(largest) {
                let (low, high, data) = quantised(of(k));
                let unit = kind.unit(units);
                shown.push(
                    json!({ "name": name, "label": label, "unit": unit, "low": low, "high": high, "data": data }),
                );
            }
        }
        shown
    }
}

/// Rotation by rows and shift of a surface.
fn pose(surface: &SceneSurface, state: &State) -> [f32; 12] {
    let (rotation, shift) = surface.pose(state);
    let [a, b, c] = rotation.0;
    let mut all = [a, b, c, shift.0].concat().into_iter().map(|x| x as f32);
    std::array::from_fn(|_| all.next().unwrap_or_default())
}

/// Place and force of a contact point.
fn force([place, push]: [Vec3; 2]) -> [f32; 6] {
    let [x, y, z] = place.0;
    let [fx, fy, fz] = push.0;
    [x, y, z, fx, fy, fz].map(|x| x as f32)
}

/// The nodes whose place is held.
fn supported(scene: &Scene, places: &[(Node, Vec3)]) -> Vec<usize> {
    let model = &scene.plan.model;
    let slots = model.supports.iter().flat_map(|support| &support.directions).map(|direction| direction.slot);
    let held: HashSet<u32> = slots.filter(|&slot| model.kinds[slot as usize] == SlotKind::Displacement).collect();
    (0..places.len()).filter(|&k| held.contains(&places[k].0.u)).collect()
}

/// Where beams were parted: two nodes at one place. Of very many nodes nobody looks for marks.
fn parted(places: &[(Node, Vec3)]) -> Vec<usize> {
    if places.len() > 2 * MOST_POINTS {
        return Vec::new();
    }
    let is_parted = |k: &usize| places.iter().any(|(node, place)| *place == places[*k].1 && node.p != places[*k].0.p);
    (0..places.len()).filter(is_parted).collect()
}

/// An event at the row where it is shown.
fn at_row(event: &FilmEvent, row: &dyn Fn(usize) -> usize) -> Value {
    let FilmEvent { row: of, kind, text } = event;
    json!({ "row": row(*of), "kind": kind, "text": text })
}

fn fields(look: &Look, stress: f64) -> [f32; FIELD_COUNT] {
    let [n1, n2, n3, m1, m2, m3] = look.resultant;
    [n1, n2, n3, m1, m2, m3, look.energy, stress].map(|x| x as f32)
}

/// Replaces values that are no numbers: linear between those that are, and the next one at the ends.
fn fill_gaps(places: &[f64], values: &mut [f64]) {
    let (gaps, known): (Vec<usize>, Vec<usize>) = (0..values.len()).partition(|&k| values[k].is_nan());
    for k in gaps {
        let next = known.partition_point(|&other| other < k);
        let before = next.checked_sub(1).map(|at| known[at]);
        values[k] = match (before, known.get(next)) {
            (None, None) => f64::NAN,
            (Some(only), None) | (None, Some(&only)) => values[only],
            (Some(a), Some(&b)) => {
                let part = (places[k] - places[a]) / (places[b] - places[a]);
                values[a] + part * (values[b] - values[a])
            }
        };
    }
}

/// The nodes of each beam that are shown: all, or each n-th, the ends and those with names; then the bodies; then the
/// ends of links.
fn shown(figure: &Figure, named: &[(String, Place)]) -> Vec<Vec<usize>> {
    let stride = figure.line_points().div_ceil(MOST_POINTS).max(1);
    let mut first = 0;
    let mut all: Vec<Vec<usize>> = Vec::new();
    for line in &figure.lines {
        let last = line.points.len() - 1;
        let is_named = |k: usize| {
            let node = line.points[k].place.node();
            stride > 1 && named.iter().any(|(_, place)| place.node() == node)
        };
        all.push(
            (0..=last).filter(|&k| k.is_multiple_of(stride) || k == last || is_named(k)).map(|k| first + k).collect(),
        );
        first += line.points.len();
    }
    all.push((first..first + figure.bodies.len()).collect());
    first += figure.bodies.len();
    all.push((first..first + figure.links.as_flattened().len()).collect());
    all
}

/// Node and place at the start of what is shown.
fn initial(figure: &Figure, shown: &[Vec<usize>]) -> Vec<(Node, Vec3)> {
    let places: Vec<&Place> = figure.places().collect();
    shown.iter().flatten().filter_map(|&k| Some((places[k].node()?, places[k].initial()))).collect()
}

/// Places that columns of the history name.
fn named(scene: &Scene) -> Vec<(String, Place)> {
    let mut names: Vec<(String, Place)> = Vec::new();
    for probe in &scene.probes {
        let Some(place) = probe.place() else { continue };
        let name = probe.names.first().and_then(|name| name.rsplit_once('.')).map_or("", |(node, _)| node);
        if !names.iter().any(|(known, _)| known == name) {
            names.push((name.into(), place.clone()));
        }
    }
    names
}

/// The node that a place is, or the one of its element that has most to say there.
fn nearest(places: &[(Node, Vec3)], to: &Place) -> Option<usize> {
    let (node, _, _) = to.nodes.iter().max_by(|a, b| a.2.total_cmp(&b.2))?;
    places.iter().position(|(known, _)| known == node)
}

/// w x y z of a rotation, times 32767 (Shepperd 1978, doi:10.2514/3.55767b).
fn quaternion(axes: Mat3) -> [i16; 4] {
    let r = axes.0;
    let trace = r[0][0] + r[1][1] + r[2][2];
    let diagonal = [trace, r[0][0], r[1][1], r[2][2]];
    let largest = (0..4).max_by(|&a, &b| diagonal[a].total_cmp(&diagonal[b])).unwrap_or(0);
    let mut q = [0.0; 4];
    if largest == 0 {
        q = [1.0 + trace, r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
    } else {
        let (i, j, k) = (largest - 1, largest % 3, (largest + 1) % 3);
        q[0] = r[k][j] - r[j][k];
        q[i + 1] = 1.0 + r[i][i] - r[j][j] - r[k][k];
        q[j + 1] = r[j][i] + r[i][j];
        q[k + 1] = r[k][i] + r[i][k];
    }
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| (32767.0 * x / norm).round() as i16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use beamsim_core::rotation::Rotation;

    #[test]
    fn gaps_are_filled_from_both_sides() {
        let mut values = [f64::NAN, 2.0, f64::NAN, 4.0, f64::NAN];
        fill_gaps(&[0.0, 1.0, 1.5, 2.0, 3.0], &mut values);
        assert_eq!(values, [2.0, 2.0, 3.0, 4.0, 4.0]);
        let mut none = [f64::NAN; 2];
        fill_gaps(&[0.0, 1.0], &mut none);
        assert!(none.iter().all(|value| value.is_nan()));
    }

    #[test]
    fn quaternions_are_those_of_their_rotation_vectors() {
        for vector in [[0.0, 0.0, 0.0], [0.3, -0.2, 0.9], [3.0, 0.2, 0.1], [0.1, 3.1, 0.0], [0.0, -0.2, 3.1]] {
            let p = Vec3(vector);
            let (angle, q) = (p.norm(), quaternion(Rotation::new(p).r));
            let part = if angle == 0.0 { 0.0 } else { (0.5 * angle).sin() / angle };
            let exact = [(0.5 * angle).cos(), part * vector[0], part * vector[1], part * vector[2]];
            for (came, exact) in q.iter().zip(exact) {
                assert!((f64::from(*came) - 32767.0 * exact).abs() < 0.51, "{vector:?}: {q:?}");
            }
        }
    }
}
