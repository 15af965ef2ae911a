//! Closed triangle meshes: the signed distance from the closest face, edge or corner.
//!
//! ```text
//! face     phi = n.(y-a)                                 H = 0
//! edge     q = (I-ee)(y-a), l = |q|, phi = +-l, n = +-q/l   H = +-(I-ee-nn)/l
//! corner   d = y-a, l = |d|, phi = +-l, n = +-d/l           H = +-(I-nn)/l
//! ```
//!
//! The sign is that of the normal of the closest part times y-a: of an edge the sum of the normals of
//! its faces, of a corner the sum weighted by their angles (J. A. Baerentzen, H. Aanaes, Signed
//! distance computation using the angle weighted pseudonormal, 2005, doi:10.1109/TVCG.2005.49).
//! Points whose closest point lies exactly on the border of a face, as on a diagonal of a flat side,
//! belong to the face.

use super::distance::{Distance, Feature, Side, Undefined, cylinder, plane, sphere};
use super::mesh_parts::{Bend, MeshEdge, MeshError, Parts};
use super::mesh_tree::{Tree, from_line};
use crate::scalar::Real;
use crate::tensor::Vec3;

/// Cosine of the angle from a normal, 1e-7 rad, within which a point beside an edge is above a face.
const ABOVE_FACE: f64 = 1.0 - 5e-15;

/// Cosine of the angle to an edge below which a point beside a corner is beside the edge.
const BESIDE_EDGE: f64 = 1e-7;

/// Points nearer to an edge than this part of the mesh's size have the normal of a face.
const MIN_RELATIVE_DISTANCE: f64 = 1e-12;

/// Faces at which the thickness of a body is measured, at most.
const MEASURED_FACES: usize = 2000;

/// Faces are the two sides of a wall if the cosine between their normals is below this.
const OPPOSITE: f64 = -0.5;

/// Edges in a picture, about.
const MOST_DRAWN: usize = 1500;

/// Edges are drawn whose faces have normals with a cosine below this.
const SHARP: f64 = 0.9;

/// A closed triangle mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    parts: Parts,
    tree: Tree,
    /// The diagonal of the box around it
    size: f64,
    depth: f64,
}

/// The bend of edges that protrude to a side.
fn protruding_to(side: Side) -> Bend {
    match side {
        Side::Outside => Bend::Convex,
        Side::Inside => Bend::Reflex,
    }
}

/// A part of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Face(u32),
    Edge(u32),
    Corner(u32),
}

/// The closest part of a mesh to a point.
#[derive(Clone, Copy)]
struct Closest {
    squared: f64,
    part: Part,
    /// The face on which the closest point was found
    face: u32,
}

impl TriangleMesh {
    /// The mesh of triangles with numbers of their corners, counter-clockwise from outside. Places of
    /// vertices are in the axes of the carrier.
    pub fn new(vertices: Vec<Vec3>, triangles: &[[u32; 3]]) -> Result<Self, MeshError> {
        let parts = Parts::new(vertices, triangles)?;
        let corners: Vec<[Vec3; 3]> = (0..triangles.len() as u32).map(|face| parts.corners(face)).collect();
        let [mut low, mut high] = [corners[0][0]; 2];
        for point in corners.iter().flatten() {
            low = Vec3(std::array::from_fn(|k| low.0[k].min(point.0[k])));
            high = Vec3(std::array::from_fn(|k| high.0[k].max(point.0[k])));
        }
        let extent = high - low;
        let mut mesh = Self { parts, tree: Tree::new(&corners), size: extent.norm(), depth: 0.0 };
        mesh.depth = 0.5 * mesh.thickness(extent.0.into_iter().fold(f64::INFINITY, f64::min));
        Ok(mesh)
    }

    /// The number of triangles.
    pub fn face_count(&self) -> usize {
        self.parts.faces.len()
    }

    /// Half of the smallest thickness of its walls.
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// The distance from the body, outside of it.
    pub(super) fn distance<T: Real>(&self, y: Vec3<T>) -> Result<Distance<T>, Undefined> {
        let here = Vec3(y.0.map(T::largest));
        let closest = self.closest(here);
        self.to_part(closest.part, closest.face, y, here)
    }

    /// The distance from a part that has the closest point, which was found on `face`.
    fn to_part<T: Real>(&self, part: Part, face: u32, y: Vec3<T>, here: Vec3) -> Result<Distance<T>, Undefined> {
        match part {
            Part::Face(face) => Ok(self.to_face(face, y)),
            Part::Edge(number) => {
                let edge = &self.parts.edges[number as usize];
                let d = here - self.parts.place(edge.ends[0]);
                let q = d - edge.along * edge.along.dot(d);
                let normals = edge.faces.map(|face| self.parts.faces[face as usize].normal);
                if let Some(above) = self.face_below(q, face, edge.faces) {
                    return Ok(self.to_face(above, y));
                }
                let start = Vec3::constant(self.parts.place(edge.ends[0]));
                let outside = Distance { feature: Feature::Edge, ..cylinder(y - start, edge.along, 0.0, 0.0)? };
                Ok(if (normals[0] + normals[1]).dot(q) < 0.0 { outside.reversed() } else { outside })
            }
            Part::Corner(corner) => {
                let d = here - self.parts.place(corner);
                let edges = self.parts.edges_at(corner);
                let faces = edges.iter().flat_map(|&edge| self.parts.edges[edge as usize].faces);
                if let Some(above) = self.face_below(d, face, faces) {
                    return Ok(self.to_face(above, y));
                }
                let length = d.norm();
                let is_beside = |edge: &&u32| {
                    let edge = &self.parts.edges[**edge as usize];
                    edge.bend != Bend::Flat && edge.along.dot(d).abs() <= BESIDE_EDGE * length
                };
                if let Some(&edge) = edges.iter().find(is_beside) {
                    return self.to_part(Part::Edge(edge), face, y, here);
                }
                let at = Vec3::constant(self.parts.place(corner));
                let outside = Distance { feature: Feature::Corner, ..sphere(y - at, 0.0, 0.0)? };
                Ok(if self.parts.normals[corner as usize].dot(d) < 0.0 { outside.reversed() } else { outside })
            }
        }
    }

    /// The face above or below which a point lies that is at `d` from a point of its border; `face` if
    /// it lies on the border.
    fn face_below(&self, d: Vec3, face: u32, faces: impl IntoIterator<Item = u32>) -> Option<u32> {
        let length = d.norm();
        if length <= MIN_RELATIVE_DISTANCE * self.size {
            return Some(face);
        }
        let is_above = |face: &u32| self.parts.faces[*face as usize].normal.dot(d).abs() >= ABOVE_FACE * length;
        faces.into_iter().find(is_above)
    }

    fn to_face<T: Real>(&self, face: u32, y: Vec3<T>) -> Distance<T> {
        let [a, _, _] = self.parts.corners(face);
        plane(y, a, self.parts.faces[face as usize].normal)
    }

    fn closest(&self, y: Vec3) -> Closest {
        let mut best = Closest { squared: f64::INFINITY, part: Part::Face(0), face: 0 };
        self.tree.nearest(y, &mut |face| {
            let (place, part) = self.closest_of_face(face, y);
            let squared = (y - place).squared();
            if squared < best.squared {
                best = Closest { squared, part, face };
            }
            best.squared
        });
        best
    }

    /// The closest point of a triangle, with the part of it on which that lies.
    fn closest_of_face(&self, number: u32, y: Vec3) -> (Vec3, Part) {
        let face = &self.parts.faces[number as usize];
        let [a, b, c] = self.parts.corners(number);
        let [ab, ac, from_a] = [b - a, c - a, y - a];
        let [d1, d2] = [ab.dot(from_a), ac.dot(from_a)];
        if d1 <= 0.0 && d2 <= 0.0 {
            return (a, Part::Corner(face.corners[0]));
        }
        let from_b = y - b;
        let [d3, d4] = [ab.dot(from_b), ac.dot(from_b)];
        if d3 >= 0.0 && d4 <= d3 {
            return (b, Part::Corner(face.corners[1]));
        }
        // Signed areas of the triangles of the projected point with two corners
        let opposite_c = d1 * d4 - d3 * d2;
        if opposite_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return (a + ab * (d1 / (d1 - d3)), Part::Edge(face.edges[0]));
        }
        let from_c = y - c;
        let [d5, d6] = [ab.dot(from_c), ac.dot(from_c)];
        if d6 >= 0.0 && d5 <= d6 {
            return (c, Part::Corner(face.corners[2]));
        }
        let opposite_b = d5 * d2 - d1 * d6;
        if opposite_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return (a + ac * (d2 / (d2 - d6)), Part::Edge(face.edges[2]));
        }
        let opposite_a = d3 * d6 - d5 * d4;
        if opposite_a <= 0.0 && d4 >= d3 && d5 >= d6 {
            let part = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            return (b + (c - b) * part, Part::Edge(face.edges[1]));
        }
        (y - face.normal * face.normal.dot(from_a), Part::Face(number))
    }

    /// Numbers of the edges that protrude to a side, within `reach` of the line between two points;
    /// and some that are farther.
    pub(super) fn edges_near(&self, line: [Vec3; 2], reach: f64, side: Side) -> Vec<u32> {
        let protrudes = protruding_to(side);
        let mut found = Vec::new();
        self.tree.near_line(line, reach, &mut |face| {
            for number in self.parts.faces[face as usize].edges {
                let edge = &self.parts.edges[number as usize];
                let is_near = || from_line(line, self.middle(edge)) <= reach + 0.5 * edge.length;
                // Each edge once: with its first face.
                if edge.bend == protrudes && edge.faces[0] == face && is_near() {
                    found.push(number);
                }
            }
        });
        found.sort_unstable();
        found
    }

    /// Numbers of the edges that protrude to a side and meet at the end of an edge, each with the end of
    /// it that is there: 1 or -1 along it.
    pub(super) fn edges_at_end(&self, number: u32, end: f64, side: Side) -> Vec<(u32, f64)> {
        let ends = self.parts.edges[number as usize].ends;
        let corner = if end > 0.0 { ends[1] } else { ends[0] };
        let at_corner = self.parts.edges_at(corner).iter().map(|&number| (number, &self.parts.edges[number as usize]));
        let protruding = at_corner.filter(|(_, edge)| edge.bend == protruding_to(side));
        protruding.map(|(number, edge)| (number, if edge.ends[1] == corner { 1.0 } else { -1.0 })).collect()
    }

    /// The middle of an edge.
    fn middle(&self, edge: &MeshEdge) -> Vec3 {
        (self.parts.place(edge.ends[0]) + self.parts.place(edge.ends[1])) * 0.5
    }

    /// Middle, direction, half of the length and the normals of both faces of an edge, by its number.
    pub(super) fn edge(&self, number: u32) -> Option<(Vec3, Vec3, f64, [Vec3; 2])> {
        let edge = self.parts.edges.get(number as usize)?;
        let normals = edge.faces.map(|face| self.parts.faces[face as usize].normal);
        Some((self.middle(edge), edge.along, 0.5 * edge.length, normals))
    }

    /// Its sharp edges, and some of the others, for pictures.
    pub(super) fn outline(&self) -> Vec<[Vec3; 2]> {
        let is_sharp = |edge: &&MeshEdge| {
            let [a, b] = edge.faces.map(|face| self.parts.faces[face as usize].normal);
            a.dot(b) < SHARP
        };
        let (sharp, others): (Vec<&MeshEdge>, Vec<&MeshEdge>) = self.parts.edges.iter().partition(is_sharp);
        let bent: Vec<&MeshEdge> = others.into_iter().filter(|edge| edge.bend != Bend::Flat).collect();
        let some = |edges: Vec<&MeshEdge>| {
            let step = edges.len().div_ceil(MOST_DRAWN).max(1);
            let places = |edge: &MeshEdge| edge.ends.map(|end| self.parts.place(end));
            edges.into_iter().step_by(step).map(places).collect::<Vec<_>>()
        };
        [some(sharp), some(bent)].concat()
    }

    /// The smallest thickness of walls, measured at faces spread over the mesh; `otherwise` if none of
    /// them is opposite to another one.
    fn thickness(&self, otherwise: f64) -> f64 {
        let step = self.parts.faces.len().div_ceil(MEASURED_FACES);
        (0..self.parts.faces.len()).step_by(step).filter_map(|face| self.wall_at(face as u32)).fold(otherwise, f64::min)
    }

    /// The thickness of the wall below the middle of a face: the diameter of the largest ball that
    /// touches the face from inside there.
    fn wall_at(&self, face: u32) -> Option<f64> {
        let [a, b, c] = self.parts.corners(face);
        let middle = (a + b + c) * (1.0 / 3.0);
        let normal = self.parts.faces[face as usize].normal;
        let mut radius = 0.5 * self.size;
        // Each closest point within the ball gives a smaller one; a few steps suffice.
        for _ in 0..20 {
            let closest = self.closest(middle - normal * radius);
            let other = self.parts.faces[closest.face as usize].normal;
            if closest.squared.sqrt() >= radius * (1.0 - 1e-6) {
                return (other.dot(normal) < OPPOSITE || closest.face == face).then_some(2.0 * radius);
            }
            let (place, _) = self.closest_of_face(closest.face, middle - normal * radius);
            let d = middle - place;
            let height = d.dot(normal);
            if height <= 1e-9 * self.size {
                return None;
            }
            radius = d.squared() / (2.0 * height);
        }
        None
    }
}
