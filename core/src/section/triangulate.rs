//! Meshes of six-node triangles for sections of any outline, with holes and several regions.
//!
//! Sides are divided first, finely near re-entrant corners; constrained Delaunay triangulation with
//! refinement (crate spade) then fills the regions.

use super::Point;
use super::element::{ElementKind, MAX_NODES};
use super::error::{SectionError, check_slenderness};
use super::grid::Fineness;
use super::mesh::{Element, Mesh, ReentrantCorner, Region, lines_cross};
use super::outline::{Outline, Side, arc_angles, distance};
use crate::sorting::{sort_by, sort_numbers};
use spade::{AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Points nearer than this part of the size of the section are one
const SAME_POINT: f64 = 1e-9;

/// Smallest angles of triangles away from small angles of outlines, degrees, in the order in which
/// they are tried. Refinement need not end above 30, and rarely does not below.
const MIN_ANGLES: [f64; 3] = [28.0, 20.0, 10.0];

/// Most vertices that refinement may add
const MAX_VERTICES: usize = 300_000;

/// Most triangles that the box around a section may hold
const MAX_TRIANGLES: f64 = 3e6;

/// Largest area of a triangle, as a part of the square of the largest edge
const MAX_AREA: f64 = 0.45;

/// A re-entrant corner turns by more than this beyond a straight line, rad. Less is a bend of an
/// outline of short sides, with hardly a singularity.
const CORNER_ANGLE: f64 = 0.4;

/// Round-off of a sum of angles, rad
const ROUND_OFF: f64 = 1e-9;

/// Chords of an arc in the test for crossings
const CHORDS_OF_ARC: usize = 16;

/// A region and its boundary.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanarRegion {
    /// Its name, material and orientation
    pub region: Region,
    /// Its outer boundary
    pub outline: Outline,
    /// Holes; other regions may lie in them
    pub holes: Vec<Outline>,
}

/// A piece of a side between two vertices of the triangulation.
#[derive(Clone, Copy, Debug)]
struct Chord {
    ends: [Point; 2],
    /// Centre, radius and the angles of both ends, for arcs
    arc: Option<ChordArc>,
}

#[derive(Clone, Copy, Debug)]
struct ChordArc {
    centre: Point,
    radius: f64,
    angles: [f64; 2],
}

impl ChordArc {
    /// The point of the arc at a part of the chord's angle.
    fn at(&self, s: f64) -> Point {
        let (sin, cos) = libm::sincos(self.angles[0] + s * (self.angles[1] - self.angles[0]));
        [self.centre[0] + self.radius * cos, self.centre[1] + self.radius * sin]
    }
}

/// All boundaries, with common points made equal.
struct Boundaries {
    /// Outlines with the material on their left, and their regions
    loops: Vec<(usize, Outline)>,
    size: f64,
}

/// Sizes of triangles.
struct Sizes {
    largest: f64,
    /// Number of edges between a re-entrant corner and one wall thickness
    per_wall: f64,
    corners: Vec<ReentrantCorner>,
}

impl Sizes {
    /// Length of edges at a point: with the third power of their number from a corner.
    fn at(&self, at: Point) -> f64 {
        let near = self.corners.iter().map(|corner| {
            let smallest = corner.wall / self.per_wall.powi(3);
            let part = distance(at, corner.at) / corner.wall;
            (3.0 / self.per_wall * libm::pow(part, 2.0 / 3.0) * corner.wall).max(smallest)
        });
        near.fold(self.largest, f64::min)
    }
}

/// Meshes regions that share sides or lie apart.
pub fn mesh_regions(regions: &[PlanarRegion], fineness: Fineness) -> Result<Mesh, SectionError> {
    if regions.is_empty() {
        return Err(SectionError::Dimensions { message: "the section has no region".to_string() });
    }
    let boundaries = Boundaries::new(regions)?;
    let corners = boundaries.corners();
    let area: f64 = boundaries.loops.iter().map(|(_, outline)| outline.area()).sum();
    let perimeter: f64 = boundaries.loops.iter().map(|(_, outline)| outline.perimeter()).sum();
    let thickness = 2.0 * area / perimeter;
    let sizes = Sizes { largest: thickness / (0.75 * fineness.least), per_wall: 2.0 * fineness.density, corners };
    let walls = 2.0 * area / boundaries.free_perimeter();
    if walls > 0.0 {
        check_slenderness(boundaries.extent(0).max(boundaries.extent(1)) / walls)?;
    }
    // Also refuses holes that are larger than what they are in.
    let triangles = boundaries.box_area() / (MAX_AREA * sizes.largest * sizes.largest);
    if area <= 0.0 || triangles > MAX_TRIANGLES || !triangles.is_finite() {
        return Err(SectionError::Meshing {
            region: regions[0].region.name.clone(),
            message: "its walls are too thin for triangles, or holes leave nothing of it".to_string(),
        });
    }
    let chords = boundaries.chords(&sizes, fineness);
    let triangulation = triangulate(regions, &chords, &sizes)?;
    let owners = owners(&triangulation, regions, &chords)?;
    let mut mesh = elements(&triangulation, &owners, &chords.list, boundaries.size);
    mesh.regions = regions.iter().map(|planar| planar.region.clone()).collect();
    mesh.corners = sizes.corners;
    Ok(mesh)
}

impl Boundaries {
    fn new(regions: &[PlanarRegion]) -> Result<Self, SectionError> {
        let mut loops = Vec::new();
        for (index, planar) in regions.iter().enumerate() {
            for (is_hole, outline) in
                std::iter::once((false, &planar.outline)).chain(planar.holes.iter().map(|hole| (true, hole)))
            {
                let area = outline.area();
                if area.abs() <= 1e-12 * outline.size().powi(2) || !area.is_finite() {
                    check_own_sides(outline)?;
                    let message = "has no area".to_string();
                    return Err(SectionError::Outline { region: planar.region.name.clone(), message });
                }
                let turned = (area > 0.0) == is_hole;
                loops.push((index, if turned { outline.reversed() } else { outline.clone() }));
            }
        }
        let size = loops.iter().flat_map(|(_, o)| o.points.iter().flatten()).fold(0.0, |a: f64, b| a.max(b.abs()));
        let mut boundaries = Self { loops, size };
        let points = boundaries.merge_points();
        boundaries.split_lines(&points);
        boundaries.check_crossings()?;
        Ok(boundaries)
    }

    /// Refuses sides that cross each other, arcs by chords.
    fn check_crossings(&self) -> Result<(), SectionError> {
        struct Piece {
            side: usize,
            ends: [Point; 2],
        }
        let mut pieces: Vec<Piece> = Vec::new();
        let mut sides: Vec<[Point; 2]> = Vec::new();
        for (_, outline) in &self.loops {
            for side in 0..outline.sides.len() {
                let chords = if outline.sides[side] == Side::Line { 1 } else { CHORDS_OF_ARC };
                let [from, to] = outline.ends(side);
                let at = |k: usize| match k {
                    0 => from,
                    _ if k == chords => to,
                    _ => outline.at(side, k as f64 / chords as f64),
                };
                pieces.extend((0..chords).map(|k| Piece { side: sides.len(), ends: [at(k), at(k + 1)] }));
                sides.push([from, to]);
            }
        }
        // Sorted by their left ends, pieces can only cross those that begin before they end.
        let left = |piece: &Piece| piece.ends[0][0].min(piece.ends[1][0]);
        let right = |piece: &Piece| piece.ends[0][0].max(piece.ends[1][0]);
        sort_by(&mut pieces, |a, b| left(a).total_cmp(&left(b)));
        for (k, first) in pieces.iter().enumerate() {
            for second in pieces[k + 1..].iter().take_while(|second| left(second) <= right(first)) {
                if first.side != second.side && lines_cross(first.ends, second.ends, SAME_POINT * self.size) {
                    return Err(SectionError::CrossingEdges { first: sides[first.side], second: sides[second.side] });
                }
            }
        }
        Ok(())
    }

    /// Makes points equal that are nearer than the tolerance; gives the different points.
    fn merge_points(&mut self) -> Vec<Point> {
        let tolerance = SAME_POINT * self.size;
        let mut known: Vec<Point> = Vec::new();
        let mut merge = |point: &mut Point| match known.iter().find(|other| distance(**other, *point) <= tolerance) {
            Some(other) => *point = *other,
            None => known.push(*point),
        };
        for (_, outline) in &mut self.loops {
            outline.points.iter_mut().for_each(&mut merge);
        }
        let points = known.clone();
        let mut centres: Vec<Point> = Vec::new();
        for (_, outline) in &mut self.loops {
            for side in &mut outline.sides {
                if let Side::Arc { centre, .. } = side {
                    match centres.iter().find(|other| distance(**other, *centre) <= tolerance) {
                        Some(other) => *centre = *other,
                        None => centres.push(*centre),
                    }
                }
            }
        }
        points
    }

    /// Divides straight sides at points of other outlines that lie on them.
    fn split_lines(&mut self, points: &[Point]) {
        let tolerance = SAME_POINT * self.size;
        for (_, outline) in &mut self.loops {
            let mut divided = Outline { points: Vec::new(), sides: Vec::new() };
            for side in 0..outline.sides.len() {
                let [from, to] = outline.ends(side);
                let mut on_side: Vec<(f64, Point)> = match outline.sides[side] {
                    Side::Line => {
                        points.iter().filter_map(|&p| part_of_line(p, from, to, tolerance).map(|s| (s, p))).collect()
                    }
                    Side::Arc { .. } => Vec::new(),
                };
                sort_by(&mut on_side, |a, b| a.0.total_cmp(&b.0));
                divided.points.push(from);
                divided.sides.push(outline.sides[side]);
                for (_, point) in on_side {
                    divided.points.push(point);
                    divided.sides.push(Side::Line);
                }
            }
            *outline = divided;
        }
    }

    /// Area of the box around all outlines.
    fn box_area(&self) -> f64 {
        self.extent(0) * self.extent(1)
    }

    /// Size of the box around all outlines along an axis.
    fn extent(&self, axis: usize) -> f64 {
        let values = self.loops.iter().flat_map(|(_, outline)| &outline.points).map(|point| point[axis]);
        values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
    }

    /// Length of the sides that belong to one region only.
    fn free_perimeter(&self) -> f64 {
        /// Bits of both ends, and of the centre of an arc
        type Key = ([[u64; 2]; 2], Option<[u64; 2]>);
        let mut sides: HashMap<Key, (usize, f64)> = HashMap::new();
        for (_, outline) in &self.loops {
            for side in 0..outline.sides.len() {
                let [from, to] = outline.ends(side).map(|at| at.map(f64::to_bits));
                let centre = match outline.sides[side] {
                    Side::Line => None,
                    Side::Arc { centre, .. } => Some(centre.map(f64::to_bits)),
                };
                let known = sides.entry(([from.min(to), from.max(to)], centre)).or_insert((0, 0.0));
                known.0 += 1;
                known.1 += outline.length(side);
            }
        }
        // The order of a hash map must not decide about the last digits.
        let mut lengths: Vec<f64> = sides.into_values().filter(|(count, _)| *count == 1).map(|(_, l)| l).collect();
        sort_numbers(&mut lengths);
        lengths.iter().sum()
    }

    /// Re-entrant corners of the whole: points around which material fills more than half a turn,
    /// but not all of it.
    fn corners(&self) -> Vec<ReentrantCorner> {
        let mut filled: HashMap<[u64; 2], (Point, f64)> = HashMap::new();
        for (_, outline) in &self.loops {
            for (k, &at) in outline.points.iter().enumerate() {
                filled.entry(at.map(f64::to_bits)).or_insert((at, 0.0)).1 += outline.interior_angle(k);
            }
        }
        // Around a hole the material fills what the hole leaves of a turn. At a point of several outlines of
        // a region the sum has a whole turn too many for each outline but one.
        let within_turn = |angle: f64| if angle > TAU + ROUND_OFF { angle.rem_euclid(TAU) } else { angle };
        let mut corners: Vec<_> = filled.into_values().map(|(at, angle)| (at, within_turn(angle))).collect();
        corners.retain(|(_, angle)| *angle > PI + CORNER_ANGLE && *angle < TAU - CORNER_ANGLE);
        // The order of a hash map must not decide about the mesh.
        sort_by(&mut corners, |(a, _), (b, _)| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        corners.into_iter().map(|(at, _)| ReentrantCorner { at, wall: self.wall_at(at) }).collect()
    }

    /// Thickness of the thinnest wall at a corner: the way through the material across the sides
    /// that meet there.
    fn wall_at(&self, corner: Point) -> f64 {
        let mut wall = self.size;
        for (_, outline) in &self.loops {
            for k in (0..outline.points.len()).filter(|&k| outline.points[k] == corner) {
                for along in outline.tangents_at(k) {
                    let inwards = [-along[1], along[0]];
                    wall = self.distance_along(corner, inwards).map_or(wall, |found| wall.min(found));
                }
            }
        }
        wall
    }

    /// Distance from a point to the next outer side in a direction; arcs by four chords.
    fn distance_along(&self, from: Point, direction: Point) -> Option<f64> {
        let mut nearest: Option<f64> = None;
        for (_, outline) in &self.loops {
            for side in 0..outline.sides.len() {
                let chords = if outline.sides[side] == Side::Line { 1 } else { 4 };
                for k in 0..chords {
                    let a = outline.at(side, k as f64 / chords as f64);
                    let b = outline.at(side, (k + 1) as f64 / chords as f64);
                    let along = [b[0] - a[0], b[1] - a[1]];
                    let determinant = direction[1] * along[0] - direction[0] * along[1];
                    if determinant.abs() < 1e-9 * libm::hypot(along[0], along[1]) {
                        continue;
                    }
                    let gap = [a[0] - from[0], a[1] - from[1]];
                    let ahead = (gap[1] * along[0] - gap[0] * along[1]) / determinant;
                    let part = (direction[0] * gap[1] - direction[1] * gap[0]) / determinant;
                    let hit = ahead > 1e-6 * self.size && (-1e-9..=1.0 + 1e-9).contains(&part);
                    if hit && nearest.is_none_or(|nearest| ahead < nearest) {
                        nearest = Some(ahead);
                    }
                }
            }
        }
        nearest
    }

    /// Divides all sides.
    fn chords(&self, sizes: &Sizes, fineness: Fineness) -> Chords {
        let mut chords = Chords::default();
        for (index, outline) in &self.loops {
            let mut polygon = Vec::new();
            for side in 0..outline.sides.len() {
                let parts = divide_side(outline, side, sizes, fineness);
                for pair in parts.windows(2) {
                    let arc = match outline.sides[side] {
                        Side::Line => None,
                        Side::Arc { centre, counterclockwise } => {
                            let [from, to] = outline.ends(side);
                            let [start, end] = arc_angles(from, to, centre, counterclockwise);
                            let angle = |s: f64| start + s * (end - start);
                            let angles = [angle(pair[0].0), angle(pair[1].0)];
                            Some(ChordArc { centre, radius: distance(from, centre), angles })
                        }
                    };
                    let ends = [chords.vertex(pair[0].1), chords.vertex(pair[1].1)];
                    polygon.push(pair[0].1);
                    let key = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                    if chords.known.contains_key(&key) {
                        chords.are_shared = true;
                    } else {
                        chords.known.insert(key, chords.list.len());
                        chords.edges.push(ends);
                        chords.list.push(Chord { ends: [pair[0].1, pair[1].1], arc });
                    }
                }
            }
            chords.polygons.push((*index, polygon));
        }
        chords
    }
}

/// Refuses an outline whose straight sides cross each other, which may have no area.
fn check_own_sides(outline: &Outline) -> Result<(), SectionError> {
    let tolerance = SAME_POINT * outline.size();
    let is_line = |side: &usize| outline.sides[*side] == Side::Line;
    let lines: Vec<[Point; 2]> = (0..outline.sides.len()).filter(is_line).map(|side| outline.ends(side)).collect();
    for (k, &first) in lines.iter().enumerate() {
        for &second in &lines[k + 1..] {
            if lines_cross(first, second, tolerance) {
                return Err(SectionError::CrossingEdges { first, second });
            }
        }
    }
    Ok(())
}

/// Divided boundaries.
#[derive(Default)]
struct Chords {
    list: Vec<Chord>,
    /// Numbers of the vertices of each chord
    edges: Vec<[usize; 2]>,
    known: HashMap<[usize; 2], usize>,
    vertices: Vec<Point>,
    number_of: HashMap<[u64; 2], usize>,
    /// Divided outlines and their regions
    polygons: Vec<(usize, Vec<Point>)>,
    /// True if two outlines, or one outline twice, go along an edge
    are_shared: bool,
}

impl Chords {
    /// The number of a vertex.
    fn vertex(&mut self, at: Point) -> usize {
        // Adding zero makes -0 and 0 one.
        let key = at.map(|x| (x + 0.0).to_bits());
        *self.number_of.entry(key).or_insert_with(|| {
            self.vertices.push(at);
            self.vertices.len() - 1
        })
    }
}

/// The part of a line at which a point lies between its ends.
fn part_of_line(point: Point, from: Point, to: Point, tolerance: f64) -> Option<f64> {
    let along = [to[0] - from[0], to[1] - from[1]];
    let length = libm::hypot(along[0], along[1]);
    let gap = [point[0] - from[0], point[1] - from[1]];
    let across = (along[0] * gap[1] - along[1] * gap[0]) / length;
    let ahead = (along[0] * gap[0] + along[1] * gap[1]) / length;
    (across.abs() <= tolerance && ahead > tolerance && ahead < length - tolerance).then_some(ahead / length)
}

/// Parts from 0 to 1 and points of a side. Sides that two regions share have the same points,
/// whichever way they are followed.
fn divide_side(outline: &Outline, side: usize, sizes: &Sizes, fineness: Fineness) -> Vec<(f64, Point)> {
    let [from, to] = outline.ends(side);
    let forward = (from[0], from[1]) <= (to[0], to[1]);
    let canonical = match outline.sides[side] {
        _ if forward => Outline { points: vec![from, to], sides: vec![outline.sides[side]] },
        Side::Line => Outline { points: vec![to, from], sides: vec![Side::Line] },
        Side::Arc { centre, counterclockwise } => {
            Outline { points: vec![to, from], sides: vec![Side::Arc { centre, counterclockwise: !counterclockwise }] }
        }
    };
    // `at` needs a second side to find the end of the first.
    let canonical = Outline { sides: vec![canonical.sides[0], Side::Line], ..canonical };
    let length = canonical.length(0);
    let largest = match canonical.sides[0] {
        Side::Line => f64::MAX,
        Side::Arc { centre, .. } => 1.2 * distance(from, centre) / fineness.least,
    };
    // Places of the integral of 1 / size, denser towards both ends, where corners are.
    const SAMPLES: usize = 200;
    let place = |k: usize| 0.5 * (1.0 - libm::cos(PI * k as f64 / SAMPLES as f64));
    let mut wanted = vec![0.0];
    for k in 0..SAMPLES {
        let middle = 0.5 * (place(k) + place(k + 1));
        let size = sizes.at(canonical.at(0, middle)).min(largest);
        wanted.push(wanted[k] + (place(k + 1) - place(k)) * length / size);
    }
    let count = wanted[SAMPLES].ceil().max(1.0) as usize;
    let mut parts = vec![(0.0, canonical.points[0])];
    let mut k = 0;
    for cell in 1..count {
        let target = wanted[SAMPLES] * cell as f64 / count as f64;
        while k + 1 < SAMPLES && wanted[k + 1] < target {
            k += 1;
        }
        let s = place(k) + (place(k + 1) - place(k)) * (target - wanted[k]) / (wanted[k + 1] - wanted[k]);
        parts.push((s, canonical.at(0, s)));
    }
    parts.push((1.0, canonical.points[1]));
    if !forward {
        parts.reverse();
        parts.iter_mut().for_each(|(s, _)| *s = 1.0 - *s);
    }
    parts
}

type Delaunay = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Triangulates and refines, with smaller angles where refinement does not end with large ones.
fn triangulate(regions: &[PlanarRegion], chords: &Chords, sizes: &Sizes) -> Result<Delaunay, SectionError> {
    for angle in MIN_ANGLES {
        if let Some(triangulation) = triangulate_with(regions, chords, sizes, angle)? {
            return Ok(triangulation);
        }
    }
    let region = regions[0].region.name.clone();
    let message = format!("more than {MAX_VERTICES} points are needed; ask for a coarser mesh");
    Err(SectionError::Meshing { region, message })
}

/// The message where the mesh generator takes no coordinate of a point.
fn out_of_range() -> String {
    "its coordinates are too large or too small for the mesh generator: use another unit of length".to_string()
}

/// Triangulates and refines; `None` if refinement does not end.
fn triangulate_with(
    regions: &[PlanarRegion],
    chords: &Chords,
    sizes: &Sizes,
    min_angle: f64,
) -> Result<Option<Delaunay>, SectionError> {
    let name = || regions[0].region.name.clone();
    let failed = |message: String| SectionError::Meshing { region: name(), message };
    let mut triangulation = Delaunay::new();
    let mut handles = Vec::new();
    for at in &chords.vertices {
        handles.push(triangulation.insert(Point2::new(at[0], at[1])).map_err(|_| failed(out_of_range()))?);
    }
    for (ends, chord) in chords.edges.iter().zip(&chords.list) {
        let [from, to] = ends.map(|end| handles[end]);
        if from == to {
            continue;
        }
        if !triangulation.can_add_constraint(from, to) {
            return Err(crossing(&triangulation, from, to, chord));
        }
        triangulation.add_constraint(from, to);
    }
    // The mesh generator counts how many outlines lie between a face and the outside, which tells
    // material from holes only where each edge belongs to one outline of one region.
    let is_plain = regions.len() == 1 && !chords.are_shared;
    if !is_plain {
        add_frame(&mut triangulation, chords, 2.0 * sizes.largest).map_err(failed)?;
    }
    let parameters = RefinementParameters::<f64>::new()
        .with_angle_limit(AngleLimit::from_radius_to_shortest_edge_ratio(0.5 / libm::sin(min_angle.to_radians())))
        .with_max_allowed_area(MAX_AREA * sizes.largest * sizes.largest)
        .with_max_additional_vertices(MAX_VERTICES)
        .exclude_outer_faces(is_plain);
    let result = triangulation.refine(parameters);
    Ok(result.refinement_complete.then_some(triangulation))
}

/// Adds a box around all vertices: where what is outside is refined too, it must not end at edges
/// that refinement cannot divide.
fn add_frame(triangulation: &mut Delaunay, chords: &Chords, margin: f64) -> Result<(), String> {
    let extent = |axis: usize| {
        let values = chords.vertices.iter().map(|at| at[axis]);
        [values.clone().fold(f64::MAX, f64::min) - margin, values.fold(f64::MIN, f64::max) + margin]
    };
    let [[left, right], [bottom, top]] = [extent(0), extent(1)];
    let mut corners = Vec::new();
    for [x2, x3] in [[left, bottom], [right, bottom], [right, top], [left, top]] {
        corners.push(triangulation.insert(Point2::new(x2, x3)).map_err(|error| error.to_string())?);
    }
    for k in 0..4 {
        triangulation.add_constraint(corners[k], corners[(k + 1) % 4]);
    }
    Ok(())
}

/// The error of two edges that cross.
fn crossing(
    triangulation: &Delaunay,
    from: spade::handles::FixedVertexHandle,
    to: spade::handles::FixedVertexHandle,
    chord: &Chord,
) -> SectionError {
    let other = triangulation.get_conflicting_edges_between_vertices(from, to).next();
    let second = other.map_or(chord.ends, |edge| edge.positions().map(|p| [p.x, p.y]));
    SectionError::CrossingEdges { first: chord.ends, second }
}

/// The region of each face of a triangulation, by flood fill between constrained edges.
fn owners(
    triangulation: &Delaunay,
    regions: &[PlanarRegion],
    chords: &Chords,
) -> Result<Vec<Option<usize>>, SectionError> {
    let faces = triangulation.num_all_faces();
    let mut component = vec![usize::MAX; faces];
    let mut owners = vec![None; faces];
    let mut covered = vec![false; regions.len()];
    for seed in triangulation.inner_faces() {
        if component[seed.fix().index()] != usize::MAX {
            continue;
        }
        let mut members = vec![seed];
        let mut next = 0;
        component[seed.fix().index()] = seed.fix().index();
        let mut open = false;
        while next < members.len() {
            for edge in members[next].adjacent_edges() {
                if edge.as_undirected().is_constraint_edge() {
                    continue;
                }
                match edge.rev().face().as_inner() {
                    None => open = true,
                    Some(face) if component[face.fix().index()] == usize::MAX => {
                        component[face.fix().index()] = seed.fix().index();
                        members.push(face);
                    }
                    Some(_) => {}
                }
            }
            next += 1;
        }
        if open {
            continue;
        }
        let largest = members.iter().max_by(|a, b| a.area().total_cmp(&b.area())).unwrap_or(&seed);
        let centre = largest.center();
        let winding = windings([centre.x, centre.y], regions.len(), chords);
        if let Some(region) = winding.iter().position(|winding| !(0..=1).contains(winding)) {
            let message = "crosses itself, or one of its holes lies outside or in another hole".to_string();
            return Err(SectionError::Outline { region: regions[region].region.name.clone(), message });
        }
        let inside: Vec<usize> = (0..regions.len()).filter(|&region| winding[region] == 1).collect();
        if let [first, second, ..] = inside[..] {
            return Err(SectionError::OverlappingRegions {
                first: regions[first].region.name.clone(),
                second: regions[second].region.name.clone(),
            });
        }
        if let Some(&region) = inside.first() {
            covered[region] = true;
            members.iter().for_each(|face| owners[face.fix().index()] = Some(region));
        }
    }
    match covered.iter().position(|covered| !covered) {
        Some(region) => Err(SectionError::EmptyRegion { region: regions[region].region.name.clone() }),
        None => Ok(owners),
    }
}

/// Winding numbers of the outlines of each region about a point, holes clockwise: 1 inside, 0 outside.
fn windings(at: Point, regions: usize, chords: &Chords) -> Vec<i32> {
    let mut winding = vec![0_i32; regions];
    for (region, polygon) in &chords.polygons {
        for (k, a) in polygon.iter().enumerate() {
            let b = polygon[(k + 1) % polygon.len()];
            if (a[1] <= at[1]) == (b[1] <= at[1]) {
                continue;
            }
            let crossing = a[0] + (at[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            if crossing > at[0] {
                winding[*region] += if b[1] > a[1] { 1 } else { -1 };
            }
        }
    }
    winding
}

/// Triangles of six nodes; nodes on chords of arcs are moved to the arc.
fn elements(triangulation: &Delaunay, owners: &[Option<usize>], chords: &[Chord], size: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let mut node_of_vertex: HashMap<usize, u32> = HashMap::new();
    let mut node_of_edge: HashMap<usize, u32> = HashMap::new();
    let add = |nodes: &mut Vec<Point>, at: Point| {
        nodes.push(at);
        nodes.len() as u32 - 1
    };
    let curved: Vec<(ChordArc, [Point; 2])> = chords.iter().filter_map(|c| c.arc.map(|arc| (arc, c.ends))).collect();
    // Moves of vertices come last: places on chords are found with straight chords.
    let mut moved: HashMap<u32, Point> = HashMap::new();
    for face in triangulation.inner_faces() {
        let Some(region) = owners[face.fix().index()] else { continue };
        let mut nodes = [0_u32; MAX_NODES];
        for (k, edge) in face.adjacent_edges().iter().enumerate() {
            let from = edge.from();
            let at = from.position();
            nodes[k] = *node_of_vertex.entry(from.fix().index()).or_insert_with(|| add(&mut mesh.nodes, [at.x, at.y]));
        }
        for (k, edge) in face.adjacent_edges().iter().enumerate() {
            let [a, b] = edge.positions().map(|p| [p.x, p.y]);
            let edge_number = edge.as_undirected().fix().index();
            let is_new = !node_of_edge.contains_key(&edge_number);
            let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            nodes[3 + k] = *node_of_edge.entry(edge_number).or_insert_with(|| add(&mut mesh.nodes, middle));
            if !is_new || !edge.as_undirected().is_constraint_edge() {
                continue;
            }
            if let Some((arc, [from, to])) = chord_of(&curved, middle, size) {
                for (node, at) in [(nodes[k], a), (nodes[(k + 1) % 3], b), (nodes[3 + k], middle)] {
                    let s = distance(from, at) / distance(from, to);
                    // Ends of chords stay exactly where they are.
                    if s > 1e-9 && s < 1.0 - 1e-9 {
                        moved.insert(node, arc.at(s));
                    }
                }
            }
        }
        mesh.elements.push(Element { kind: ElementKind::T6, nodes, region: region as u32 });
    }
    let straight = mesh.nodes.clone();
    for (node, at) in &moved {
        mesh.nodes[*node as usize] = *at;
    }
    follow_moved_corners(&mut mesh, &straight, &moved);
    mesh
}

/// Moves the middles of straight edges whose ends were moved.
fn follow_moved_corners(mesh: &mut Mesh, straight: &[Point], moved: &HashMap<u32, Point>) {
    for k in 0..mesh.elements.len() {
        let element = mesh.elements[k];
        for side in 0..3 {
            let [a, b, middle] = element.kind.side(side).map(|local| element.nodes[local]);
            if moved.contains_key(&middle) || !(moved.contains_key(&a) || moved.contains_key(&b)) {
                continue;
            }
            debug_assert!(straight.len() > middle as usize);
            let [a, b] = [a, b].map(|node| mesh.nodes[node as usize]);
            mesh.nodes[middle as usize] = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        }
    }
}

/// The arc chord on which a point lies.
fn chord_of(curved: &[(ChordArc, [Point; 2])], at: Point, size: f64) -> Option<(ChordArc, [Point; 2])> {
    let on_chord =
        |(_, [from, to]): &&(ChordArc, [Point; 2])| part_of_line(at, *from, *to, SAME_POINT * size).is_some();
    curved.iter().find(on_chord).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planar(name: &str, points: &[Point]) -> PlanarRegion {
        PlanarRegion {
            region: Region::new(name, 0),
            outline: Outline::polygon(points, name).unwrap(),
            holes: Vec::new(),
        }
    }

    fn rect(name: &str, x: [f64; 2], y: [f64; 2]) -> PlanarRegion {
        planar(name, &[[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])
    }

    fn area(mesh: &Mesh, region: Option<u32>) -> f64 {
        let mut area = 0.0;
        for element in mesh.elements.iter().filter(|element| region.is_none_or(|region| region == element.region)) {
            let positions = mesh.positions(element);
            for reference in element.kind.integration_points() {
                area += crate::section::element::SectionPoint::new(reference, &positions[..6]).area;
            }
        }
        area
    }

    #[test]
    fn a_square_with_a_round_hole_has_its_area() {
        let mut square = rect("square", [-1.0, 1.0], [-1.0, 1.0]);
        square.holes.push(Outline::circle([0.1, 0.0], 0.5));
        let mesh = mesh_regions(&[square], Fineness::level(1)).unwrap();
        mesh.check().unwrap();
        let error = area(&mesh, None) - (4.0 - PI * 0.25);
        assert!(error.abs() < 1e-4, "{error:e}");
    }

    #[test]
    fn a_material_inside_another_is_a_region() {
        let mut outer = rect("outer", [-1.0, 1.0], [-1.0, 1.0]);
        outer.holes.push(rect("hole", [-0.5, 0.5], [-0.5, 0.5]).outline);
        let inner = rect("inner", [-0.5, 0.5], [-0.5, 0.5]);
        let mesh = mesh_regions(&[outer.clone(), inner], Fineness::level(0)).unwrap();
        mesh.check().unwrap();
        assert!((area(&mesh, Some(0)) - 3.0).abs() < 1e-12 && (area(&mesh, Some(1)) - 1.0).abs() < 1e-12);
        assert!(mesh.corners.is_empty());
        // Without it, the hole has four re-entrant corners.
        let mesh = mesh_regions(&[outer], Fineness::level(0)).unwrap();
        assert_eq!(mesh.corners.len(), 4);
        assert!((mesh.corners[0].wall - 0.5).abs() < 1e-9);
    }

    #[test]
    fn sides_may_meet_in_the_middle_of_others() {
        let flange = rect("flange", [-2.0, 2.0], [0.0, 0.5]);
        let web = rect("web", [-0.2, 0.2], [-3.0, 0.0]);
        let mesh = mesh_regions(&[flange, web], Fineness::level(0)).unwrap();
        mesh.check().unwrap();
        assert_eq!(mesh.corners.len(), 2);
        assert!((area(&mesh, None) - 3.2).abs() < 1e-12);
    }

    #[test]
    fn bad_regions_are_refused() {
        let square = rect("square", [0.0, 1.0], [0.0, 1.0]);
        let apart = rect("apart", [2.0, 3.0], [0.0, 1.0]);
        let at_corner = rect("corner", [1.0, 2.0], [1.0, 2.0]);
        for other in [apart, at_corner] {
            let mesh = mesh_regions(&[square.clone(), other], Fineness::level(0)).unwrap();
            assert!(matches!(mesh.check(), Err(SectionError::NotConnected { .. })));
        }
        let crossing = rect("crossing", [0.5, 2.0], [0.3, 0.7]);
        let found = mesh_regions(&[square.clone(), crossing], Fineness::level(0));
        assert!(matches!(found, Err(SectionError::CrossingEdges { .. })), "{found:?}");
        let inside = rect("inside", [0.3, 0.6], [0.3, 0.7]);
        let found = mesh_regions(&[square.clone(), inside], Fineness::level(0));
        assert!(matches!(found, Err(SectionError::OverlappingRegions { .. })));
        let bow_tie = planar("bow", &[[0.0, 0.0], [2.0, 1.0], [2.0, 0.0], [0.0, 1.1]]);
        let found = mesh_regions(&[bow_tie], Fineness::level(0));
        assert!(matches!(found, Err(SectionError::CrossingEdges { .. })));
        let mut holed = square.clone();
        holed.holes.push(rect("hole", [2.0, 3.0], [0.0, 1.0]).outline);
        let found = mesh_regions(&[holed], Fineness::level(0));
        assert!(matches!(found, Err(SectionError::Meshing { .. })), "{found:?}");
        let mut holed = rect("plate", [0.0, 2.0], [0.0, 1.0]);
        holed.holes.push(rect("hole", [3.0, 3.5], [0.0, 0.5]).outline);
        let found = mesh_regions(&[holed], Fineness::level(0));
        assert!(matches!(found, Err(SectionError::Outline { .. })), "{found:?}");
        let found = mesh_regions(&[square.clone(), square], Fineness::level(0));
        assert!(matches!(found, Err(SectionError::OverlappingRegions { .. })));
    }
}
