//! Chains of walls as strips of blocks, and the points on their faces.

use super::joints::{Joint, WallEnd};
use super::line::{Line, SAME_FACE};
use super::wall::Walls;
use crate::section::Point;
use crate::section::error::{SectionError, show};
use crate::section::mesh::Region;
use crate::sorting::sort_by;

/// Sine of the turn up to which a round wall continues its neighbour
const SMOOTH_JOINT: f64 = 1e-6;

/// Sine of the turn above which a joint counts as a re-entrant corner
pub(super) const SHARP_JOINT: f64 = 0.4;

/// A line across a wall between blocks.
#[derive(Clone, Debug)]
pub(super) struct Station {
    /// Part of the length of the line
    pub(super) part: f64,
    /// The joint, for the two ends of the line
    pub(super) joint: Option<usize>,
    /// Stems with a face that ends here: the end and the index of the face in its chain
    pub(super) stems: Vec<(WallEnd, usize)>,
}

/// Walls as strips of blocks.
pub(super) struct Strips {
    pub(super) lines: Vec<Line>,
    pub(super) joints: Vec<Joint>,
    pub(super) chain_of: Vec<usize>,
    /// Faces of each chain, descending
    pub(super) faces: Vec<Vec<f64>>,
    pub(super) stations: Vec<Vec<Station>>,
    /// True where a chain has re-entrant corners at its left face, and at its right one
    pub(super) is_singular: Vec<[bool; 2]>,
    pub(super) regions: Vec<Region>,
}

impl Strips {
    /// Finds chains, and turns walls into the directions of their chains.
    pub(super) fn new(walls: &Walls, mut lines: Vec<Line>, mut joints: Vec<Joint>) -> Result<Self, SectionError> {
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
    pub(super) fn through(&self, joint: usize) -> Option<[usize; 2]> {
        match self.joints[joint].through[..] {
            [first, second] if first.end == 1 => Some([first.wall, second.wall]),
            [first, second] => Some([second.wall, first.wall]),
            _ => None,
        }
    }

    /// The vector from a joint to the mitre, per offset to the left.
    pub(super) fn mitre(&self, joint: usize) -> Point {
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
    pub(super) fn turn(&self, joint: usize) -> f64 {
        self.through(joint).map_or(0.0, |[before, after]| {
            let [first, second] = [self.lines[before].tangent_at(1.0), self.lines[after].tangent_at(0.0)];
            first[0] * second[1] - first[1] * second[0]
        })
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

    /// The point of a joint at an offset to the left.
    pub(super) fn joint_vertex(&self, joint: usize, face: f64) -> Point {
        let at = self.joints[joint].at;
        let mitre = self.mitre(joint);
        [at[0] + face * mitre[0], at[1] + face * mitre[1]]
    }

    /// A point of a face of a straight wall.
    pub(super) fn on_face(&self, wall: usize, part: f64, face: f64) -> Point {
        let [from, to] = [0, 1].map(|end| self.end_of_face(wall, end, face));
        [from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1])]
    }

    /// The end of a face of a straight wall: on the mitre, or, of a stem, across the joint.
    pub(super) fn end_of_face(&self, wall: usize, end: usize, face: f64) -> Point {
        let joint = self.lines[wall].joints[end];
        if !self.joints[joint].stems.contains(&WallEnd { wall, end }) {
            return self.joint_vertex(joint, face);
        }
        let at = self.joints[joint].at;
        let [t2, t3] = self.lines[wall].tangent_at(end as f64);
        [at[0] - face * t3, at[1] + face * t2]
    }

    /// The point of a station at an offset to the left.
    pub(super) fn point(&self, wall: usize, station: &Station, face: f64) -> Point {
        match station.joint {
            Some(joint) => self.joint_vertex(joint, face),
            None => self.on_face(wall, station.part, face),
        }
    }
}

/// Sorts faces from left to right, with those that are one dropped.
pub(super) fn sort_faces(faces: &mut Vec<f64>) {
    sort_by(faces, |a, b| b.total_cmp(a));
    let thickness = faces[0] - faces[faces.len() - 1];
    faces.dedup_by(|a, b| (*a - *b).abs() <= SAME_FACE * thickness);
}
