//! Walls of plies along lines: open, closed and branched, straight and round, as blocks of
//! quadrilaterals.
//!
//! At a point where two walls meet they are mitred. Where more meet, the two that continue each
//! other best go through, and the others end at their faces (butt joints). Walls that go through
//! one another's ends make up a chain, which is one strip of blocks: all walls of a chain have
//! blocks between the same faces, so that plies may begin and end at joints.

use super::Point;
use super::blocks::{Arc, BlockMesher};
use super::divide::{End, divide};
use super::error::{SectionError, check_positive, check_slenderness, show};
use super::grid::Fineness;
use super::mesh::{Mesh, ReentrantCorner, Region, Tangent};
use super::outline::{arc_angles, distance};
use crate::sorting::sort_by;
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Sine of the turn up to which a round wall continues its neighbour
const SMOOTH_JOINT: f64 = 1e-6;

/// Sine of the turn above which a joint counts as a re-entrant corner
const SHARP_JOINT: f64 = 0.4;

/// Cosine of the turn below which two walls fold back on each other
const MIN_MITRE: f64 = -0.95;

/// Faces nearer than this part of the thickness of a chain are one
const SAME_FACE: f64 = 1e-6;

/// The end of a ply of a branch may move by this part of the ply to a bend of the wall that it
/// meets
const SNAP: f64 = 0.05;

/// A step of thickness at a branch is moved along the thinner wall by this many thicknesses of the
/// branch
const STEP_BEHIND_BRANCH: f64 = 1.5;

/// Passes in which faces of branches are carried over to branches on the other side
const MAX_PASSES: usize = 5;

/// Number of plies above which a coarse mesh need not divide them
const MANY_PLIES: f64 = 24.0;

/// A wall is divided along its length like one of at most this many thicknesses
const FULL_LENGTH: f64 = 10.0;

/// A ply of a wall.
#[derive(Clone, Debug, PartialEq)]
pub struct Ply {
    /// Name, for messages
    pub name: String,
    /// Index of the material
    pub material: usize,
    /// Thickness
    pub thickness: f64,
    /// Angle of the fibre from axis 1 towards the wall tangent, rad
    pub theta: f64,
}

/// The curve of a round wall: part of a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Centre of the circle
    pub centre: Point,
    /// From axis 2 towards axis 3
    pub counterclockwise: bool,
}

/// A wall between two points.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// Indices of its points
    pub ends: [usize; 2],
    /// Its curve, if it is not straight
    bend: Option<Bend>,
    /// Distance from the line between the points to the left face, looking along the wall
    left: f64,
    /// Plies from left to right; a clockwise closed line has its outside on the left
    pub plies: Vec<Ply>,
}

/// Walls that meet in points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Walls {
    /// Points
    pub points: Vec<Point>,
    /// Walls
    pub walls: Vec<Wall>,
}

impl Walls {
    /// Walls with the same plies along a line through points; closed if the last is the first.
    pub fn line(points: &[Point], left: f64, plies: &[Ply]) -> Self {
        let mut walls = Self::default();
        for pair in points.windows(2) {
            walls.add(pair[0], pair[1], None, left, plies);
        }
        walls
    }

    /// Adds a wall; its ends are points already there if they are equal.
    pub fn add(&mut self, from: Point, to: Point, bend: Option<Bend>, left: f64, plies: &[Ply]) {
        let ends = [from, to].map(|at| match self.points.iter().position(|point| *point == at) {
            Some(index) => index,
            None => {
                self.points.push(at);
                self.points.len() - 1
            }
        });
        self.walls.push(Wall { ends, bend, left, plies: plies.to_vec() });
    }

    /// The lines of the walls, whose regions are numbered ply by ply.
    fn lines(&self) -> Result<Vec<Line>, SectionError> {
        let mut lines = Vec::new();
        let mut regions = 0;
        for wall in &self.walls {
            if wall.ends.iter().any(|&end| end >= self.points.len()) {
                return Err(SectionError::Dimensions { message: "a wall has no end point".to_string() });
            }
            lines.push(Line::new(self, wall, regions)?);
            regions += wall.plies.len();
        }
        Ok(lines)
    }

    /// Walls whose thickness does not change where a third one branches off: the thicker of two
    /// that go through a joint goes on beyond it.
    fn with_steps_away_from_branches(&self) -> Result<Self, SectionError> {
        let lines = self.lines()?;
        let mut changed = self.clone();
        for joint in joints(self, &lines)?.iter().filter(|joint| !joint.stems.is_empty()) {
            let [first, second] = joint.through[..] else { continue };
            let is_straight = [first, second].iter().all(|end| lines[end.wall].bend.is_none());
            let [before, after] =
                [lines[first.wall].faces_away(1 - first.end), lines[second.wall].faces_away(second.end)];
            let tolerance = SAME_FACE * lines[first.wall].thickness();
            if !is_straight || before.iter().zip(after).all(|(a, b)| (a - b).abs() <= tolerance) {
                continue;
            }
            let is_first_thicker = lines[first.wall].thickness() >= lines[second.wall].thickness();
            let (thick, thin) = if is_first_thicker { (first, second) } else { (second, first) };
            let branch = joint.stems.iter().map(|stem| lines[stem.wall].thickness()).fold(0.0, f64::max);
            let part = STEP_BEHIND_BRANCH * branch / lines[thin.wall].length();
            if part < 0.5 {
                changed.extend_beyond(thick, thin, if thin.end == 0 { part } else { 1.0 - part }, &lines);
            }
        }
        Ok(changed)
    }

    /// Replaces the plies of a wall between a joint and a part of its length by those of another
    /// wall at the joint.
    fn extend_beyond(&mut self, thick: WallEnd, thin: WallEnd, part: f64, lines: &[Line]) {
        let step = self.points.len();
        self.points.push(lines[thin.wall].at(part));
        let mut piece = self.walls[thick.wall].clone();
        piece.ends = self.walls[thin.wall].ends;
        piece.ends[1 - thin.end] = step;
        self.walls[thin.wall].ends[thin.end] = step;
        if thick.end == thin.end {
            // The walls run against each other.
            piece.left = lines[thick.wall].thickness() - piece.left;
            piece.plies.reverse();
            piece.plies.iter_mut().for_each(|ply| ply.theta = -ply.theta);
        }
        self.walls.push(piece);
    }
}

/// Meshes walls.
pub fn mesh_walls(walls: &Walls, fineness: Fineness) -> Result<Mesh, SectionError> {
    let walls = &walls.with_steps_away_from_branches()?;
    let lines = walls.lines()?;
    let joints = joints(walls, &lines)?;
    let mut strips = Strips::new(walls, lines, joints)?;
    strips.add_faces()?;
    strips.cut()?;
    strips.mesh(fineness)
}

/// The line of a wall, in the direction of its chain.
#[derive(Clone, Debug)]
struct Line {
    ends: [Point; 2],
    /// Indices of the points
    joints: [usize; 2],
    bend: Option<Bend>,
    /// Offsets of the faces of plies to the left, descending
    faces: Vec<f64>,
    /// Region of each ply
    regions: Vec<usize>,
    /// The wall tangent of the plies: always that of the wall as it was given
    tangent: Tangent,
}

impl Line {
    /// `first_region` is the region of the first ply.
    fn new(walls: &Walls, wall: &Wall, first_region: usize) -> Result<Self, SectionError> {
        let ends = wall.ends.map(|end| walls.points[end]);
        if let Some(bend) = wall.bend {
            let [first, second] = ends.map(|end| distance(end, bend.centre));
            if (first - second).abs() > 1e-6 * first {
                let message = "the ends of a round wall have different distances from its centre".to_string();
                return Err(SectionError::Dimensions { message });
            }
        }
        let mut faces = vec![wall.left];
        for ply in &wall.plies {
            check_positive(format!("the thickness of ply `{}`", ply.name), ply.thickness)?;
            faces.push(faces[faces.len() - 1] - ply.thickness);
        }
        let regions = (first_region..first_region + wall.plies.len()).collect();
        let tangent = Tangent::Fixed(0.0);
        let mut line = Self { ends, joints: wall.ends, bend: wall.bend, faces, regions, tangent };
        let length = line.length();
        let thickness = line.thickness();
        check_positive("the length of a wall", length)?;
        check_positive("the thickness of a wall", thickness)?;
        check_slenderness(length / thickness)?;
        line.tangent = match wall.bend {
            Some(Bend { centre, counterclockwise }) => Tangent::Around { centre, counterclockwise },
            None => {
                let [t2, t3] = line.tangent_at(0.0);
                Tangent::Fixed(libm::atan2(t3, t2))
            }
        };
        Ok(line)
    }

    /// Turns the direction of the line around; the wall tangent of plies stays.
    fn reverse(&mut self) {
        self.ends.reverse();
        self.joints.reverse();
        self.regions.reverse();
        self.faces = self.faces.iter().rev().map(|face| -face).collect();
        if let Some(bend) = &mut self.bend {
            bend.counterclockwise = !bend.counterclockwise;
        }
    }

    /// Offsets of the outer faces, looking away from an end of the line.
    fn faces_away(&self, end: usize) -> [f64; 2] {
        let [left, right] = self.outer_faces();
        if end == 0 { [left, right] } else { [-right, -left] }
    }

    fn thickness(&self) -> f64 {
        let [left, right] = self.outer_faces();
        left - right
    }

    /// Offsets of the left and the right face.
    fn outer_faces(&self) -> [f64; 2] {
        [self.faces[0], self.faces[self.faces.len() - 1]]
    }

    /// Angles of the ends of a bend; equal ends are a full circle.
    fn angles(&self, bend: &Bend) -> [f64; 2] {
        let [start, end] = arc_angles(self.ends[0], self.ends[1], bend.centre, bend.counterclockwise);
        if (end - start).abs() > 1e-9 { [start, end] } else { [start, start + bend.sense() * TAU] }
    }

    fn length(&self) -> f64 {
        match &self.bend {
            None => distance(self.ends[0], self.ends[1]),
            Some(bend) => {
                let [start, end] = self.angles(bend);
                distance(self.ends[0], bend.centre) * (end - start).abs()
            }
        }
    }

    /// The point of the line at a part of its length.
    fn at(&self, part: f64) -> Point {
        match &self.bend {
            None => {
                let [from, to] = self.ends;
                [from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1])]
            }
            Some(bend) => {
                let [start, end] = self.angles(bend);
                let radius = distance(self.ends[0], bend.centre);
                let (sin, cos) = libm::sincos(start + part * (end - start));
                [bend.centre[0] + radius * cos, bend.centre[1] + radius * sin]
            }
        }
    }

    /// Unit tangent at a part of the length.
    fn tangent_at(&self, part: f64) -> Point {
        match &self.bend {
            None => {
                let [from, to] = self.ends;
                let length = distance(from, to);
                [(to[0] - from[0]) / length, (to[1] - from[1]) / length]
            }
            Some(bend) => {
                let at = self.at(part);
                let radius = distance(at, bend.centre);
                let sense = bend.sense();
                [-sense * (at[1] - bend.centre[1]) / radius, sense * (at[0] - bend.centre[0]) / radius]
            }
        }
    }

    /// The arc of a face between two parts of the length, for round walls.
    fn face_arc(&self, face: f64, parts: [f64; 2]) -> Option<Arc> {
        let bend = self.bend.as_ref()?;
        let [start, end] = self.angles(bend);
        let radius = distance(self.ends[0], bend.centre) - bend.sense() * face;
        Some(Arc { centre: bend.centre, semi_axes: [radius; 2], angles: parts.map(|s| start + s * (end - start)) })
    }
}

impl Bend {
    fn sense(&self) -> f64 {
        if self.counterclockwise { 1.0 } else { -1.0 }
    }
}

/// One end of a wall: 0 its start, 1 its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct WallEnd {
    wall: usize,
    end: usize,
}

/// The ends of walls at a point.
#[derive(Clone, Debug)]
struct Joint {
    at: Point,
    /// One end where a wall is free, else the two that continue each other
    through: Vec<WallEnd>,
    /// Ends of walls that butt against the others
    stems: Vec<WallEnd>,
}

/// Sorts the ends of walls at each point.
fn joints(walls: &Walls, lines: &[Line]) -> Result<Vec<Joint>, SectionError> {
    let mut joints = Vec::new();
    for (point, &at) in walls.points.iter().enumerate() {
        let mut ends = Vec::new();
        for (wall, line) in lines.iter().enumerate() {
            ends.extend((0..2).filter(|&end| line.joints[end] == point).map(|end| WallEnd { wall, end }));
        }
        let away = |end: &WallEnd| {
            let [t2, t3] = lines[end.wall].tangent_at(end.end as f64);
            if end.end == 0 { [t2, t3] } else { [-t2, -t3] }
        };
        let mut best: Option<(f64, usize, usize)> = None;
        for i in 0..ends.len() {
            for j in i + 1..ends.len() {
                let [first, second] = [away(&ends[i]), away(&ends[j])];
                let cosine = first[0] * second[0] + first[1] * second[1];
                if best.is_none_or(|(smallest, ..)| cosine < smallest - 1e-9) {
                    best = Some((cosine, i, j));
                }
            }
        }
        let through = match best {
            None => ends.clone(),
            Some((cosine, ..)) if cosine > -MIN_MITRE => {
                let message = format!("two walls fold back on each other at {}", show(at));
                return Err(SectionError::Dimensions { message });
            }
            Some((_, i, j)) => vec![ends[i], ends[j]],
        };
        let stems = ends.into_iter().filter(|end| !through.contains(end)).collect();
        joints.push(Joint { at, through, stems });
    }
    Ok(joints)
}

/// A line across a wall between blocks.
#[derive(Clone, Debug)]
struct Station {
    /// Part of the length of the line
    part: f64,
    /// The joint, for the two ends of the line
    joint: Option<usize>,
    /// Stems with a face that ends here: the end and the index of the face in its chain
    stems: Vec<(WallEnd, usize)>,
}

/// The meeting of the end of a stem with the walls that go through a joint.
struct Butt {
    stem: WallEnd,
    /// Offset of the face of the walls against which it butts
    face: f64,
    /// Direction of the stem in its chain
    along: Point,
    /// To the left of it
    normal: Point,
    /// Offset, in the chain of the stem, of the place where the two walls meet
    bend: f64,
}

/// Walls as strips of blocks.
struct Strips {
    lines: Vec<Line>,
    joints: Vec<Joint>,
    chain_of: Vec<usize>,
    /// Faces of each chain, descending
    faces: Vec<Vec<f64>>,
    stations: Vec<Vec<Station>>,
    /// True where a chain has re-entrant corners at its left face, and at its right one
    is_singular: Vec<[bool; 2]>,
    regions: Vec<Region>,
}

impl Strips {
    /// Finds chains, and turns walls into the directions of their chains.
    fn new(walls: &Walls, mut lines: Vec<Line>, mut joints: Vec<Joint>) -> Result<Self, SectionError> {
        let mut chain_of = vec![usize::MAX; lines.len()];
        let mut chains = 0;
        for seed in 0..lines.len() {
            if chain_of[seed] != usize::MAX {
                continue;
            }
            chain_of[seed] = chains;
            let mut reached = vec![seed];
            while let Some(wall) = reached.pop() {
                for end in 0..2 {
                    let joint = &joints[lines[wall].joints[end]];
                    let here = WallEnd { wall, end };
                    if joint.through.len() != 2 || !joint.through.contains(&here) {
                        continue;
                    }
                    let other = if joint.through[0] == here { joint.through[1] } else { joint.through[0] };
                    if chain_of[other.wall] != usize::MAX {
                        continue;
                    }
                    chain_of[other.wall] = chains;
                    reached.push(other.wall);
                    if other.end == end {
                        lines[other.wall].reverse();
                        for joint in &mut joints {
                            let all = joint.through.iter_mut().chain(&mut joint.stems);
                            all.filter(|known| known.wall == other.wall).for_each(|known| known.end = 1 - known.end);
                        }
                    }
                }
            }
            chains += 1;
        }
        let mut regions = Vec::new();
        for (wall, line) in walls.walls.iter().zip(&lines) {
            regions.extend(wall.plies.iter().map(|ply| Region {
                name: ply.name.clone(),
                material: ply.material,
                theta: ply.theta,
                tangent: line.tangent,
            }));
        }
        let mut faces = vec![Vec::new(); chains];
        for (line, &chain) in lines.iter().zip(&chain_of) {
            faces[chain].extend_from_slice(&line.faces);
        }
        for faces in &mut faces {
            sort_faces(faces);
        }
        let stations = lines.iter().map(|line| {
            let station = |end: usize| Station { part: end as f64, joint: Some(line.joints[end]), stems: Vec::new() };
            vec![station(0), station(1)]
        });
        let stations = stations.collect();
        let mut strips = Self { lines, joints, chain_of, faces, stations, is_singular: Vec::new(), regions };
        strips.check_round_walls()?;
        strips.is_singular = strips.singular_faces();
        Ok(strips)
    }

    /// Refuses kinks between round walls and others: their faces would not meet.
    fn check_round_walls(&self) -> Result<(), SectionError> {
        for (joint, known) in self.joints.iter().enumerate() {
            let Some(through) = self.through(joint) else { continue };
            let is_round = through.iter().any(|&wall| self.lines[wall].bend.is_some());
            if is_round && self.turn(joint).abs() > SMOOTH_JOINT {
                let message = format!("at {} a round wall does not continue its neighbour smoothly", show(known.at));
                return Err(SectionError::Dimensions { message });
            }
        }
        Ok(())
    }

    /// The two walls that go through a joint: the one that ends there and the one that begins.
    fn through(&self, joint: usize) -> Option<[usize; 2]> {
        match self.joints[joint].through[..] {
            [first, second] if first.end == 1 => Some([first.wall, second.wall]),
            [first, second] => Some([second.wall, first.wall]),
            _ => None,
        }
    }

    /// The vector from a joint to the mitre, per offset to the left.
    fn mitre(&self, joint: usize) -> Point {
        let tangents = match self.through(joint) {
            Some([before, after]) => [self.lines[before].tangent_at(1.0), self.lines[after].tangent_at(0.0)],
            None => match self.joints[joint].through.first() {
                Some(end) => [self.lines[end.wall].tangent_at(end.end as f64); 2],
                None => [[1.0, 0.0]; 2],
            },
        };
        let [first, second] = tangents;
        let cosine = first[0] * second[0] + first[1] * second[1];
        [-(first[1] + second[1]) / (1.0 + cosine), (first[0] + second[0]) / (1.0 + cosine)]
    }

    /// Sine of the turn of the chain at a joint, positive to the left.
    fn turn(&self, joint: usize) -> f64 {
        self.through(joint).map_or(0.0, |[before, after]| {
            let [first, second] = [self.lines[before].tangent_at(1.0), self.lines[after].tangent_at(0.0)];
            first[0] * second[1] - first[1] * second[0]
        })
    }

    /// The face against which a stem butts: its offset in the chain of the walls that go through.
    fn butt_face(&self, joint: usize, stem: WallEnd) -> Result<f64, SectionError> {
        let fail = |message: &str| {
            let at = show(self.joints[joint].at);
            Err(SectionError::Dimensions { message: format!("at {at} {message}") })
        };
        let Some([before, after]) = self.through(joint) else { return fail("no wall goes through") };
        if [before, after, stem.wall].iter().any(|&wall| self.lines[wall].bend.is_some()) {
            return fail("a round wall meets a branch: put a short straight wall between them");
        }
        let mitre = self.mitre(joint);
        let away = self.away(stem);
        let side = away[0] * mitre[0] + away[1] * mitre[1];
        let sides = [before, after].map(|wall| self.lines[wall].outer_faces()[if side > 0.0 { 0 } else { 1 }]);
        match (sides[0] - sides[1]).abs() <= SAME_FACE * self.lines[before].thickness() {
            true => Ok(sides[0]),
            false => fail("walls of different thickness meet where a third branches off: move the step away"),
        }
    }

    /// Unit vector from a joint along a wall.
    fn away(&self, end: WallEnd) -> Point {
        let [t2, t3] = self.lines[end.wall].tangent_at(end.end as f64);
        if end.end == 0 { [t2, t3] } else { [-t2, -t3] }
    }

    /// The offset, in the chain of a stem, of the bend of the face that it meets.
    fn offset_of_bend(&self, joint: usize, stem: WallEnd, face: f64) -> f64 {
        let mitre = self.mitre(joint);
        let [t2, t3] = self.lines[stem.wall].tangent_at(stem.end as f64);
        face * (-t3 * mitre[0] + t2 * mitre[1])
    }

    /// Adds faces to stems where the walls that they meet are joined, and where faces of a stem on
    /// the other side end, so that each block of a stem meets one block.
    fn add_faces(&mut self) -> Result<(), SectionError> {
        for _ in 0..MAX_PASSES {
            let mut added = false;
            for joint in 0..self.joints.len() {
                for stem in self.joints[joint].stems.clone() {
                    let butt = self.butt(joint, stem)?;
                    added |= self.add_face(stem, butt.bend);
                    for other in self.joints[joint].stems.clone() {
                        let across = self.butt(joint, other)?;
                        if across.face == butt.face {
                            continue;
                        }
                        for (wall, part) in
                            self.meetings(joint, &across)?.into_iter().map(|(_, wall, part)| (wall, part))
                        {
                            let [x2, x3] = self.on_face(wall, part, butt.face);
                            let at = self.joints[joint].at;
                            let offset = (x2 - at[0]) * butt.normal[0] + (x3 - at[1]) * butt.normal[1];
                            added |= self.add_face(stem, offset);
                        }
                    }
                }
            }
            if !added {
                break;
            }
        }
        Ok(())
    }

    /// Adds a face to the chain of a stem if it lies inside the stem and away from other faces.
    fn add_face(&mut self, stem: WallEnd, offset: f64) -> bool {
        let own = self.lines[stem.wall].outer_faces();
        let faces = &mut self.faces[self.chain_of[stem.wall]];
        let is_taken = faces.iter().enumerate().any(|(k, &known)| (known - offset).abs() <= SNAP * gap(faces, k));
        let is_inside = offset < own[0] && offset > own[1];
        if is_inside && !is_taken {
            faces.push(offset);
            sort_faces(faces);
        }
        is_inside && !is_taken
    }

    /// The meeting of a stem with the walls that go through a joint.
    fn butt(&self, joint: usize, stem: WallEnd) -> Result<Butt, SectionError> {
        let face = self.butt_face(joint, stem)?;
        let along = self.lines[stem.wall].tangent_at(stem.end as f64);
        let bend = self.offset_of_bend(joint, stem, face);
        Ok(Butt { stem, face, along, normal: [-along[1], along[0]], bend })
    }

    /// For each face of a stem (index in its chain), the wall that it meets and the part of its
    /// length; two walls at their common end.
    fn meetings(&self, joint: usize, butt: &Butt) -> Result<Vec<(usize, usize, f64)>, SectionError> {
        let line = &self.lines[butt.stem.wall];
        let own = line.outer_faces();
        let tolerance = SAME_FACE * line.thickness();
        let faces = &self.faces[self.chain_of[butt.stem.wall]];
        let mut meetings = Vec::new();
        for (k, &offset) in faces.iter().enumerate() {
            if offset > own[0] + tolerance || offset < own[1] - tolerance {
                continue;
            }
            let is_bend = (offset - butt.bend).abs() <= SNAP * gap(faces, k);
            for (which, wall) in self.through(joint).into_iter().flatten().enumerate() {
                let end = 1 - which;
                let away = self.away(WallEnd { wall, end });
                // The wall lies on one side of the stem's line through the bend.
                let side = away[0] * butt.normal[0] + away[1] * butt.normal[1];
                if is_bend {
                    meetings.push((k, wall, end as f64));
                } else if (offset - butt.bend) * side > 0.0 {
                    meetings.push((k, wall, self.part_of_face(joint, wall, butt, offset)?));
                }
            }
        }
        Ok(meetings)
    }

    /// The part of the length of a wall's face at which the line of a stem's face meets it.
    fn part_of_face(&self, joint: usize, wall: usize, butt: &Butt, offset: f64) -> Result<f64, SectionError> {
        let at = self.joints[joint].at;
        let tangent = self.lines[wall].tangent_at(0.0);
        // Where offset normal + v along and face n + u t are one point, seen from the joint.
        let start =
            [offset * butt.normal[0] + butt.face * tangent[1], offset * butt.normal[1] - butt.face * tangent[0]];
        let u = cross(start, butt.along) / cross(tangent, butt.along);
        let met = [at[0] - butt.face * tangent[1] + u * tangent[0], at[1] + butt.face * tangent[0] + u * tangent[1]];
        let [from, to] = [0, 1].map(|end| self.end_of_face(wall, end, butt.face));
        let ahead = (met[0] - from[0]) * tangent[0] + (met[1] - from[1]) * tangent[1];
        let part = ahead / distance(from, to);
        match part > 0.0 && part < 1.0 {
            true => Ok(part),
            false => {
                let message = format!("at {} a wall is too short for the branch that meets it", show(at));
                Err(SectionError::Dimensions { message })
            }
        }
    }

    /// Cuts walls where the faces of stems meet them.
    fn cut(&mut self) -> Result<(), SectionError> {
        for joint in 0..self.joints.len() {
            for stem in self.joints[joint].stems.clone() {
                let butt = self.butt(joint, stem)?;
                let faces = self.faces[self.chain_of[stem.wall]].clone();
                for (k, wall, part) in self.meetings(joint, &butt)? {
                    let same = SNAP * gap(&faces, k) / self.lines[wall].length();
                    let stations = &mut self.stations[wall];
                    match stations.iter_mut().find(|station| (station.part - part).abs() <= same) {
                        Some(station) => station.stems.push((stem, k)),
                        None => stations.push(Station { part, joint: None, stems: vec![(stem, k)] }),
                    }
                }
            }
        }
        for stations in &mut self.stations {
            sort_by(stations, |a, b| a.part.total_cmp(&b.part));
        }
        self.check_stems()
    }

    /// Checks that each block of a stem meets one block of a wall.
    fn check_stems(&self) -> Result<(), SectionError> {
        for joint in 0..self.joints.len() {
            for stem in &self.joints[joint].stems {
                let faces = &self.faces[self.chain_of[stem.wall]];
                for k in 0..faces.len() - 1 {
                    if self.lines[stem.wall].region_at(0.5 * (faces[k] + faces[k + 1])).is_none() {
                        continue;
                    }
                    let meets = |pair: &[Station]| {
                        let has = |station: &Station, k: usize| station.stems.contains(&(*stem, k));
                        has(&pair[0], k) && has(&pair[1], k + 1) || has(&pair[1], k) && has(&pair[0], k + 1)
                    };
                    let through = self.through(joint).into_iter().flatten();
                    if !through.into_iter().any(|wall| self.stations[wall].windows(2).any(meets)) {
                        let at = show(self.joints[joint].at);
                        let message = format!(
                            "at {at} branches meet a wall too close to each other: move one of them, or \
                             describe the section as regions"
                        );
                        return Err(SectionError::Dimensions { message });
                    }
                }
            }
        }
        Ok(())
    }

    /// Makes the blocks.
    fn mesh(&self, fineness: Fineness) -> Result<Mesh, SectionError> {
        let mut vertices = Vertices { mesher: BlockMesher::new(self.regions.clone()), known: HashMap::new() };
        for wall in 0..self.lines.len() {
            let line = &self.lines[wall];
            let faces = &self.faces[self.chain_of[wall]];
            for pair in self.stations[wall].windows(2) {
                let along = self.divide_stretch(wall, pair, fineness);
                for k in 0..faces.len() - 1 {
                    let Some(region) = line.region_at(0.5 * (faces[k] + faces[k + 1])) else { continue };
                    // The right face is below the left one, looking along the wall.
                    let corners = [
                        vertices.at(self, wall, &pair[0], k + 1),
                        vertices.at(self, wall, &pair[1], k + 1),
                        vertices.at(self, wall, &pair[1], k),
                        vertices.at(self, wall, &pair[0], k),
                    ];
                    for (face, ends) in [(k + 1, [corners[0], corners[1]]), (k, [corners[3], corners[2]])] {
                        if let Some(arc) = line.face_arc(faces[face], [pair[0].part, pair[1].part]) {
                            if arc.semi_axes[0] <= 0.0 {
                                let message = "a round wall is thicker than its radius".to_string();
                                return Err(SectionError::Dimensions { message });
                            }
                            vertices.mesher.arc(ends[0], ends[1], arc);
                        }
                    }
                    let through = self.divide_through(self.chain_of[wall], k, fineness);
                    vertices.mesher.block(corners, &along, &through, region as u32)?;
                }
            }
        }
        let mut mesh = vertices.mesher.finish();
        mesh.corners = self.corners();
        Ok(mesh)
    }

    /// Ends of cells between two stations of a wall, from 0 to 1.
    fn divide_stretch(&self, wall: usize, pair: &[Station], fineness: Fineness) -> Vec<f64> {
        // Under a stem, cells are those of its plies; theirs go from the right face to the left.
        for (stem, k) in &pair[0].stems {
            let chain = self.chain_of[stem.wall];
            for (_, l) in pair[1].stems.iter().filter(|(other, _)| other == stem) {
                if *k == l + 1 {
                    return self.divide_through(chain, *l, fineness);
                }
                if *l == k + 1 {
                    let through = self.divide_through(chain, *k, fineness);
                    return through.iter().rev().map(|s| 1.0 - s).collect();
                }
            }
        }
        let line = &self.lines[wall];
        let length = (pair[1].part - pair[0].part) * line.length();
        let ends = [0, 1].map(|k| self.end(wall, &pair[k], k, length));
        let turns = line.bend.as_ref().map_or(0.0, |bend| length / (FRAC_PI_2 * distance(line.ends[0], bend.centre)));
        let share = (length / (FULL_LENGTH * line.thickness())).min(1.0);
        divide(length, ends, fineness.least * (share + turns), fineness.density)
    }

    /// Ends of cells between two faces of a chain, from 0 at the right one to 1 at the left one.
    /// Their number grows with the fineness, so that two levels also show the error of shear
    /// between plies.
    fn divide_through(&self, chain: usize, k: usize, fineness: Fineness) -> Vec<f64> {
        let faces = &self.faces[chain];
        let plies = faces.len() - 1;
        let thickness = faces[k] - faces[k + 1];
        let factor = fineness.least / Fineness::level(0).least;
        let in_many_plies = factor * (MANY_PLIES / plies as f64).min(1.0);
        let least = (fineness.least / plies as f64).max(in_many_plies);
        let [left, right] = self.is_singular[chain];
        let end = |singular: bool, count: f64| match singular {
            true => End::Singular { radius: thickness / count },
            false => End::Smooth,
        };
        let ends = [right && k + 1 == plies, left && k == 0];
        let count = if ends[0] && ends[1] { 2.0 } else { 1.0 };
        divide(thickness, ends.map(|singular| end(singular, count)), least, fineness.density)
    }

    /// True where a chain has re-entrant corners at its left face, and at its right one.
    fn singular_faces(&self) -> Vec<[bool; 2]> {
        let mut singular = vec![[false; 2]; self.faces.len()];
        for (joint, known) in self.joints.iter().enumerate() {
            let Some([before, _]) = self.through(joint) else { continue };
            let turn = self.turn(joint);
            let of_chain = self.chain_of[before];
            if turn.abs() > SHARP_JOINT {
                singular[of_chain][if turn > 0.0 { 0 } else { 1 }] = true;
            }
            for stem in &known.stems {
                singular[self.chain_of[stem.wall]] = [true; 2];
                if let Ok(face) = self.butt_face(joint, *stem) {
                    let faces = &self.lines[before].faces;
                    let is_left = (face - faces[0]).abs() < 0.5 * self.lines[before].thickness();
                    singular[of_chain][if is_left { 0 } else { 1 }] = true;
                }
            }
        }
        singular
    }

    /// The behaviour of the solution at an end of a stretch.
    fn end(&self, wall: usize, station: &Station, end: usize, length: f64) -> End {
        let line = &self.lines[wall];
        let thickness = line.thickness();
        let singular = End::Singular { radius: thickness.min(0.5 * length) };
        if !station.stems.is_empty() {
            return singular;
        }
        let Some(joint) = station.joint else { return End::Smooth };
        let is_stem = self.joints[joint].stems.contains(&WallEnd { wall, end });
        if is_stem || self.turn(joint).abs() > SHARP_JOINT {
            return singular;
        }
        match self.through(joint) {
            None => {
                let thinnest = line.faces.windows(2).map(|pair| pair[0] - pair[1]).fold(thickness, f64::min);
                End::Layer { thickness: thinnest }
            }
            Some([before, after]) => {
                let [first, second] = [before, after].map(|wall| &self.lines[wall]);
                let tolerance = SAME_FACE * thickness;
                let same = first.faces.len() == second.faces.len()
                    && first.faces.iter().zip(&second.faces).all(|(a, b)| (a - b).abs() <= tolerance);
                match (same, first.bend.is_some() == second.bend.is_some()) {
                    (true, true) => End::Smooth,
                    (true, false) => End::Layer { thickness },
                    (false, _) => singular,
                }
            }
        }
    }

    /// Sharp corners of mitres and branches.
    fn corners(&self) -> Vec<ReentrantCorner> {
        let mut corners = Vec::new();
        for joint in 0..self.joints.len() {
            let turn = self.turn(joint);
            if let Some([before, after]) = self.through(joint).filter(|_| turn.abs() > SHARP_JOINT) {
                let face = self.lines[after].outer_faces()[if turn > 0.0 { 0 } else { 1 }];
                let wall = self.lines[before].thickness().min(self.lines[after].thickness());
                corners.push(ReentrantCorner { at: self.joint_vertex(joint, face), wall });
            }
        }
        for (wall, stations) in self.stations.iter().enumerate() {
            for station in stations {
                for (stem, k) in &station.stems {
                    let line = &self.lines[stem.wall];
                    let offset = self.faces[self.chain_of[stem.wall]][*k];
                    let tolerance = SAME_FACE * line.thickness();
                    if line.outer_faces().iter().all(|face| (face - offset).abs() > tolerance) {
                        continue;
                    }
                    let Ok(face) = self.butt_face(line.joints[stem.end], *stem) else { continue };
                    let thickness = line.thickness().min(self.lines[wall].thickness());
                    corners.push(ReentrantCorner { at: self.point(wall, station, face), wall: thickness });
                }
            }
        }
        corners
    }

    /// The point of a joint at an offset to the left.
    fn joint_vertex(&self, joint: usize, face: f64) -> Point {
        let at = self.joints[joint].at;
        let mitre = self.mitre(joint);
        [at[0] + face * mitre[0], at[1] + face * mitre[1]]
    }

    /// A point of a face of a straight wall.
    fn on_face(&self, wall: usize, part: f64, face: f64) -> Point {
        let [from, to] = [0, 1].map(|end| self.end_of_face(wall, end, face));
        [from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1])]
    }

    /// The end of a face of a straight wall: on the mitre, or, of a stem, across the joint.
    fn end_of_face(&self, wall: usize, end: usize, face: f64) -> Point {
        let joint = self.lines[wall].joints[end];
        if !self.joints[joint].stems.contains(&WallEnd { wall, end }) {
            return self.joint_vertex(joint, face);
        }
        let at = self.joints[joint].at;
        let [t2, t3] = self.lines[wall].tangent_at(end as f64);
        [at[0] - face * t3, at[1] + face * t2]
    }

    /// The point of a station at an offset to the left.
    fn point(&self, wall: usize, station: &Station, face: f64) -> Point {
        match station.joint {
            Some(joint) => self.joint_vertex(joint, face),
            None => self.on_face(wall, station.part, face),
        }
    }
}

impl Line {
    /// The region at an offset to the left.
    fn region_at(&self, offset: f64) -> Option<usize> {
        let ply = self.faces.windows(2).position(|pair| pair[0] > offset && offset > pair[1])?;
        Some(self.regions[ply])
    }
}

/// Vertices of blocks, made at their first use.
struct Vertices {
    mesher: BlockMesher,
    known: HashMap<VertexKey, u32>,
}

/// The place of a vertex among walls.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum VertexKey {
    /// The mitre of a joint, at a face of the chain through it
    Joint(usize, usize),
    /// A station of a wall (by the bits of its part of the length), at a face
    Station(usize, u64, usize),
}

impl Vertices {
    /// The vertex of a station of a wall at a face of its chain.
    fn at(&mut self, strips: &Strips, wall: usize, station: &Station, k: usize) -> u32 {
        if let Some(joint) = station.joint {
            let end = WallEnd { wall, end: station.part as usize };
            if strips.joints[joint].stems.contains(&end) {
                return self.of_stem(strips, end, k);
            }
        }
        let key = match station.joint {
            Some(joint) => VertexKey::Joint(joint, k),
            None => VertexKey::Station(wall, station.part.to_bits(), k),
        };
        let at = strips.point(wall, station, strips.faces[strips.chain_of[wall]][k]);
        *self.known.entry(key).or_insert_with(|| self.mesher.vertex(at))
    }

    /// The vertex of a stem where it butts: one of the wall that it meets.
    fn of_stem(&mut self, strips: &Strips, stem: WallEnd, k: usize) -> u32 {
        let joint = strips.lines[stem.wall].joints[stem.end];
        for wall in strips.through(joint).into_iter().flatten() {
            let found = strips.stations[wall].iter().find(|station| station.stems.contains(&(stem, k)));
            let (Some(station), Ok(face)) = (found, strips.butt_face(joint, stem)) else { continue };
            let faces = &strips.faces[strips.chain_of[wall]];
            let nearest = (0..faces.len()).min_by(|&a, &b| (faces[a] - face).abs().total_cmp(&(faces[b] - face).abs()));
            return self.at(strips, wall, station, nearest.unwrap_or(0));
        }
        // Not reached: every face of a stem has a station.
        self.mesher.vertex(strips.joints[joint].at)
    }
}

/// Sorts faces from left to right, with those that are one dropped.
fn sort_faces(faces: &mut Vec<f64>) {
    sort_by(faces, |a, b| b.total_cmp(a));
    let thickness = faces[0] - faces[faces.len() - 1];
    faces.dedup_by(|a, b| (*a - *b).abs() <= SAME_FACE * thickness);
}

/// Distance from a face to the nearer of its neighbours.
fn gap(faces: &[f64], k: usize) -> f64 {
    let before = if k > 0 { faces[k - 1] - faces[k] } else { f64::MAX };
    let after = if k + 1 < faces.len() { faces[k] - faces[k + 1] } else { f64::MAX };
    before.min(after)
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
