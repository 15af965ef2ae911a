//! Blocks of strips, divided into cells.

use super::joints::WallEnd;
use super::line::SAME_FACE;
use super::strips::{SHARP_JOINT, Station, Strips};
use crate::section::blocks::BlockMesher;
use crate::section::divide::{End, divide};
use crate::section::error::SectionError;
use crate::section::grid::Fineness;
use crate::section::mesh::{Mesh, ReentrantCorner};
use crate::section::outline::distance;
use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

/// Number of plies above which a coarse mesh need not divide them
const MANY_PLIES: f64 = 24.0;

/// Radius over thickness up to which a quarter of a circle needs no more cells than its turn asks for. In thinner walls a
/// cell of angle a stiffens torsion of open sections by about 1e-4 a^4 (radius/thickness)^2, so that their number grows
/// with the root of radius/thickness.
const THICK_CURVE: f64 = 2.0;

/// A wall is divided along its length like one of at most this many thicknesses
const FULL_LENGTH: f64 = 10.0;

impl Strips {
    /// Makes the blocks.
    pub(super) fn mesh(&self, fineness: Fineness) -> Result<Mesh, SectionError> {
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
        let around = line.bend.as_ref().map_or(0.0, |bend| {
            let radius = distance(line.ends[0], bend.centre);
            let quarters = length / (FRAC_PI_2 * radius);
            quarters * (radius / (THICK_CURVE * line.thickness())).sqrt().max(1.0)
        });
        let share = (length / (FULL_LENGTH * line.thickness())).min(1.0);
        divide(length, ends, fineness.least * (share + around), fineness.density)
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
