//! The parts of a closed triangle mesh: triangles, edges and corners with their normals, and the
//! checks that the mesh bounds a body.

use crate::tensor::Vec3;
use std::collections::HashMap;

/// Triangles whose smallest height is below this part of their longest edge have no normal.
const MIN_HEIGHT: f64 = 1e-9;

/// Edges whose faces are turned by less than this angle (radians) are flat: nothing touches them.
const FLAT: f64 = 1e-6;

/// Reasons for which triangles do not bound a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeshError {
    /// Fewer than four triangles
    Few,
    /// A vertex, by its number, has a coordinate that is no finite number
    NotFinite(usize),
    /// A triangle, by its number, names a vertex that does not exist
    NoVertex(usize),
    /// A triangle, by its number, has no area; its first corner
    Degenerate(usize, Vec3),
    /// An edge between these places belongs to one triangle only: the mesh has a hole
    Open([Vec3; 2]),
    /// An edge between these places belongs to more than two triangles
    Branched([Vec3; 2]),
    /// A triangle, by its number, has the opposite orientation of a neighbour; the edge between them
    Turned(usize, [Vec3; 2]),
    /// Two triangles at an edge between these places lie on one another
    Folded([Vec3; 2]),
    /// All triangles have their normals inward
    InsideOut,
}

/// Faces lie on one another if the cosine between their normals is below this.
const FOLDED: f64 = -1.0 + 1e-9;

/// The bend of the surface at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bend {
    /// The edge protrudes from the body
    Convex,
    /// The faces are parts of one plane
    Flat,
    /// The edge is a notch
    Reflex,
}

/// A triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Face {
    /// Numbers of its corners
    pub(crate) corners: [u32; 3],
    /// Its normal out of the body
    pub(crate) normal: Vec3,
    /// Numbers of its edges: from corner 0 to 1, 1 to 2, 2 to 0
    pub(crate) edges: [u32; 3],
}

/// An edge between two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeshEdge {
    /// Numbers of its ends
    pub(crate) ends: [u32; 2],
    /// Numbers of its faces
    pub(crate) faces: [u32; 2],
    /// Its direction
    pub(crate) along: Vec3,
    /// Its length
    pub(crate) length: f64,
    /// The bend of the surface there
    pub(crate) bend: Bend,
}

/// The parts of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Parts {
    places: Vec<Vec3>,
    pub(crate) faces: Vec<Face>,
    pub(crate) edges: Vec<MeshEdge>,
    /// Normals at the corners: those of the faces, weighted by their angles there
    pub(crate) normals: Vec<Vec3>,
    /// Numbers of the edges at each corner: from `first[k]` to `first[k + 1]`
    first: Vec<u32>,
    around: Vec<u32>,
}

impl Parts {
    pub fn new(places: Vec<Vec3>, triangles: &[[u32; 3]]) -> Result<Self, MeshError> {
        if triangles.len() < 4 {
            return Err(MeshError::Few);
        }
        if let Some(vertex) = places.iter().position(|place| !place.is_finite()) {
            return Err(MeshError::NotFinite(vertex));
        }
        let mut faces = Vec::with_capacity(triangles.len());
        for (k, &corners) in triangles.iter().enumerate() {
            faces.push(face(&places, k, corners)?);
        }
        let edges = edges(&places, &mut faces)?;
        let mut normals = vec![Vec3::ZERO; places.len()];
        for face in &faces {
            for (corner, angle) in face.corners.iter().zip(angles(&places, face.corners)) {
                normals[*corner as usize] += face.normal * angle;
            }
        }
        let (first, around) = around(places.len(), &edges);
        let parts = Self { places, faces, edges, normals, first, around };
        if parts.volume() > 0.0 { Ok(parts) } else { Err(MeshError::InsideOut) }
    }

    pub fn place(&self, corner: u32) -> Vec3 {
        self.places[corner as usize]
    }

    pub fn corners(&self, face: u32) -> [Vec3; 3] {
        self.faces[face as usize].corners.map(|corner| self.place(corner))
    }

    /// Numbers of the edges that meet at a corner.
    pub fn edges_at(&self, corner: u32) -> &[u32] {
        let k = corner as usize;
        &self.around[self.first[k] as usize..self.first[k + 1] as usize]
    }

    fn volume(&self) -> f64 {
        let origin = self.places[self.faces[0].corners[0] as usize];
        let of_face = |face: &Face| {
            let [a, b, c] = face.corners.map(|corner| self.place(corner) - origin);
            a.dot(b.cross(c))
        };
        self.faces.iter().map(of_face).sum()
    }
}

/// The triangle number `k` without its edges.
fn face(places: &[Vec3], k: usize, corners: [u32; 3]) -> Result<Face, MeshError> {
    if corners.iter().any(|&corner| corner as usize >= places.len()) {
        return Err(MeshError::NoVertex(k));
    }
    let [a, b, c] = corners.map(|corner| places[corner as usize]);
    let longest = [b - a, c - b, a - c].iter().map(|side| side.norm()).fold(0.0, f64::max);
    let area = (b - a).cross(c - a);
    match area.normalized() {
        Some(normal) if area.norm() > MIN_HEIGHT * longest * longest => Ok(Face { corners, normal, edges: [0; 3] }),
        Some(_) | None => Err(MeshError::Degenerate(k, a)),
    }
}

/// The edges of triangles, each between two of them.
fn edges(places: &[Vec3], faces: &mut [Face]) -> Result<Vec<MeshEdge>, MeshError> {
    let mut edges: Vec<MeshEdge> = Vec::with_capacity(faces.len() * 3 / 2);
    let mut numbers: HashMap<[u32; 2], u32> = HashMap::with_capacity(faces.len() * 3 / 2);
    const NONE: u32 = u32::MAX;
    for k in 0..faces.len() {
        for side in 0..3 {
            let [from, to] = [faces[k].corners[side], faces[k].corners[(side + 1) % 3]];
            let [start, end] = [from, to].map(|corner| places[corner as usize]);
            let number = *numbers.entry([from.min(to), from.max(to)]).or_insert(edges.len() as u32);
            faces[k].edges[side] = number;
            if number as usize == edges.len() {
                let length = (end - start).norm();
                let along = (end - start) * (1.0 / length);
                edges.push(MeshEdge { ends: [from, to], faces: [k as u32, NONE], along, length, bend: Bend::Flat });
                continue;
            }
            let edge = &mut edges[number as usize];
            if edge.faces[1] != NONE {
                return Err(MeshError::Branched([start, end]));
            }
            if edge.ends == [from, to] {
                return Err(MeshError::Turned(k, [start, end]));
            }
            edge.faces[1] = k as u32;
        }
    }
    for edge in &mut edges {
        if edge.faces[1] == NONE {
            return Err(MeshError::Open(edge.ends.map(|corner| places[corner as usize])));
        }
        edge.bend = bend(edge, faces);
        let [first, second] = edge.faces.map(|face| faces[face as usize].normal);
        if first.dot(second) < FOLDED {
            return Err(MeshError::Folded(edge.ends.map(|corner| places[corner as usize])));
        }
    }
    Ok(edges)
}

/// The bend at an edge that runs as its first face does.
fn bend(edge: &MeshEdge, faces: &[Face]) -> Bend {
    let [first, second] = edge.faces.map(|face| faces[face as usize].normal);
    // The faces open towards their outside if the second normal is turned about the edge from the
    // first one.
    let turned = first.cross(second).dot(edge.along);
    let is_folded = first.dot(second) < 0.0;
    if turned.abs() < FLAT && !is_folded {
        Bend::Flat
    } else if turned > 0.0 {
        Bend::Convex
    } else {
        Bend::Reflex
    }
}

/// The angles of a triangle at its corners.
fn angles(places: &[Vec3], corners: [u32; 3]) -> [f64; 3] {
    let points = corners.map(|corner| places[corner as usize]);
    std::array::from_fn(|k| {
        let [to_next, to_last] = [points[(k + 1) % 3] - points[k], points[(k + 2) % 3] - points[k]];
        libm::atan2(to_next.cross(to_last).norm(), to_next.dot(to_last))
    })
}

/// Numbers of the edges at each corner, and where those of a corner begin.
fn around(corners: usize, edges: &[MeshEdge]) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0u32; corners + 1];
    edges.iter().flat_map(|edge| edge.ends).for_each(|end| first[end as usize + 1] += 1);
    for k in 0..corners {
        first[k + 1] += first[k];
    }
    let mut next = first.clone();
    let mut around = vec![0u32; 2 * edges.len()];
    for (number, edge) in edges.iter().enumerate() {
        for end in edge.ends {
            let place = &mut next[end as usize];
            around[*place as usize] = number as u32;
            *place += 1;
        }
    }
    (first, around)
}
