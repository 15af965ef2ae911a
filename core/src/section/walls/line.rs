//! The line of a wall with the faces of its plies.

use super::wall::{Bend, Wall, Walls};
use crate::section::Point;
use crate::section::blocks::Arc;
use crate::section::error::{SectionError, check_positive, check_slenderness};
use crate::section::mesh::Tangent;
use crate::section::outline::{arc_angles, distance};
use std::f64::consts::TAU;

/// Faces nearer than this part of the thickness of a chain are one
pub(super) const SAME_FACE: f64 = 1e-6;

/// The line of a wall, in the direction of its chain.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub(super) ends: [Point; 2],
    /// Indices of the points
    pub(super) joints: [usize; 2],
    pub(super) bend: Option<Bend>,
    /// Offsets of the faces of plies to the left, descending
    pub(super) faces: Vec<f64>,
    /// Region of each ply
    regions: Vec<usize>,
    /// The wall tangent of the plies: always that of the wall as it was given
    pub(super) tangent: Tangent,
}

impl Walls {
    /// The lines of the walls, whose regions are numbered ply by ply.
    pub(super) fn lines(&self) -> Result<Vec<Line>, SectionError> {
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
    pub(super) fn reverse(&mut self) {
        self.ends.reverse();
        self.joints.reverse();
        self.regions.reverse();
        self.faces = self.faces.iter().rev().map(|face| -face).collect();
        if let Some(bend) = &mut self.bend {
            bend.counterclockwise = !bend.counterclockwise;
        }
    }

    /// Offsets of the outer faces, looking away from an end of the line.
    pub(super) fn faces_away(&self, end: usize) -> [f64; 2] {
        let [left, right] = self.outer_faces();
        if end == 0 { [left, right] } else { [-right, -left] }
    }

    pub(super) fn thickness(&self) -> f64 {
        let [left, right] = self.outer_faces();
        left - right
    }

    /// Offsets of the left and the right face.
    pub(super) fn outer_faces(&self) -> [f64; 2] {
        [self.faces[0], self.faces[self.faces.len() - 1]]
    }

    /// Angles of the ends of a bend; equal ends are a full circle.
    fn angles(&self, bend: &Bend) -> [f64; 2] {
        let [start, end] = arc_angles(self.ends[0], self.ends[1], bend.centre, bend.counterclockwise);
        if (end - start).abs() > 1e-9 { [start, end] } else { [start, start + bend.sense() * TAU] }
    }

    pub(super) fn length(&self) -> f64 {
        match &self.bend {
            None => distance(self.ends[0], self.ends[1]),
            Some(bend) => {
                let [start, end] = self.angles(bend);
                distance(self.ends[0], bend.centre) * (end - start).abs()
            }
        }
    }

    /// The point of the line at a part of its length.
    pub(super) fn at(&self, part: f64) -> Point {
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
    pub(super) fn tangent_at(&self, part: f64) -> Point {
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
    pub(super) fn face_arc(&self, face: f64, parts: [f64; 2]) -> Option<Arc> {
        let bend = self.bend.as_ref()?;
        let [start, end] = self.angles(bend);
        let radius = distance(self.ends[0], bend.centre) - bend.sense() * face;
        Some(Arc { centre: bend.centre, semi_axes: [radius; 2], angles: parts.map(|s| start + s * (end - start)) })
    }

    /// The region at an offset to the left.
    pub(super) fn region_at(&self, offset: f64) -> Option<usize> {
        let ply = self.faces.windows(2).position(|pair| pair[0] > offset && offset > pair[1])?;
        Some(self.regions[ply])
    }
}
