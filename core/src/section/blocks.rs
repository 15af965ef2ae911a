//! Structured meshes of nine-node quadrilaterals: blocks with four sides that share vertices and
//! edges.
//!
//! Nodes of neighbouring blocks are merged by the numbers of their vertices, never by distance.

use super::Point;
use super::element::{ElementKind, MAX_NODES};
use super::error::SectionError;
use super::mesh::{Element, Mesh, Region};
use std::collections::HashMap;

/// An arc of an ellipse with axes along 2 and 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Its centre
    pub(super) centre: Point,
    /// Half axes along 2 and 3
    pub(super) semi_axes: [f64; 2],
    /// Parameter at the start and at the end, rad
    pub(super) angles: [f64; 2],
}

impl Arc {
    /// The point at a part of the range of angles.
    pub fn at(&self, s: f64) -> Point {
        let angle = self.angles[0] + s * (self.angles[1] - self.angles[0]);
        let (sin, cos) = libm::sincos(angle);
        [self.centre[0] + self.semi_axes[0] * cos, self.centre[1] + self.semi_axes[1] * sin]
    }
}

/// Builds a mesh from blocks.
pub struct BlockMesher {
    mesh: Mesh,
    arcs: HashMap<[u32; 2], Arc>,
    /// Nodes of an edge, from its smaller vertex to its larger one
    edges: HashMap<[u32; 2], Vec<u32>>,
}

impl BlockMesher {
    /// An empty mesh with the regions of the section.
    pub fn new(regions: Vec<Region>) -> Self {
        let mesh = Mesh { regions, ..Mesh::default() };
        Self { mesh, arcs: HashMap::new(), edges: HashMap::new() }
    }

    /// The mesh.
    pub fn finish(self) -> Mesh {
        self.mesh
    }

    /// Adds a vertex.
    pub fn vertex(&mut self, at: Point) -> u32 {
        self.mesh.nodes.push(at);
        self.mesh.nodes.len() as u32 - 1
    }

    /// Makes the edge between two vertices an arc.
    pub fn arc(&mut self, from: u32, to: u32, arc: Arc) {
        let [start, end] = arc.angles;
        if from < to {
            self.arcs.insert([from, to], arc);
        } else {
            self.arcs.insert([to, from], Arc { angles: [end, start], ..arc });
        }
    }

    /// Adds a block with counterclockwise corners. `u` are the ends of its cells from corner 0 to
    /// 1 (and 3 to 2), `v` those from 0 to 3 (and 1 to 2), from 0 to 1.
    pub fn block(&mut self, corners: [u32; 4], u: &[f64], v: &[f64], region: u32) -> Result<(), SectionError> {
        let [c0, c1, c2, c3] = corners;
        let u = with_middles(u);
        let v = with_middles(v);
        let bottom = self.edge(c0, c1, &u, region)?;
        let top = self.edge(c3, c2, &u, region)?;
        let left = self.edge(c0, c3, &v, region)?;
        let right = self.edge(c1, c2, &v, region)?;
        let (columns, rows) = (u.len(), v.len());
        let mut grid = vec![0_u32; columns * rows];
        for j in 0..rows {
            for i in 0..columns {
                grid[j * columns + i] = if j == 0 {
                    bottom[i]
                } else if j == rows - 1 {
                    top[i]
                } else if i == 0 {
                    left[j]
                } else if i == columns - 1 {
                    right[j]
                } else {
                    let sides = [bottom[i], top[i], left[j], right[j]];
                    let at = self.blend(corners, sides, u[i], v[j]);
                    self.vertex(at)
                };
            }
        }
        self.add_cells(&grid, columns, rows, region);
        Ok(())
    }

    /// Transfinite interpolation between four sides (Coons patch).
    fn blend(&self, corners: [u32; 4], [bottom, top, left, right]: [u32; 4], u: f64, v: f64) -> Point {
        let at = |node: u32, axis: usize| self.mesh.nodes[node as usize][axis];
        std::array::from_fn(|axis| {
            let between_sides =
                (1.0 - v) * at(bottom, axis) + v * at(top, axis) + (1.0 - u) * at(left, axis) + u * at(right, axis);
            let [c0, c1, c2, c3] = corners.map(|corner| at(corner, axis));
            between_sides - (1.0 - v) * ((1.0 - u) * c0 + u * c1) - v * ((1.0 - u) * c3 + u * c2)
        })
    }

    /// Nodes of an edge in the given direction, made at its first use.
    fn edge(&mut self, from: u32, to: u32, parameters: &[f64], region: u32) -> Result<Vec<u32>, SectionError> {
        let key = [from.min(to), from.max(to)];
        if !self.edges.contains_key(&key) {
            let nodes = self.new_edge(from, to, parameters);
            self.edges.insert(key, nodes);
        }
        let mut nodes = self.edges[&key].clone();
        if from > to {
            nodes.reverse();
        }
        if nodes.len() == parameters.len() {
            return Ok(nodes);
        }
        Err(SectionError::Meshing {
            region: self.mesh.regions[region as usize].name.clone(),
            message: "two parts divide their common edge differently".to_string(),
        })
    }

    /// Nodes of a new edge, from its smaller vertex to its larger one.
    fn new_edge(&mut self, from: u32, to: u32, parameters: &[f64]) -> Vec<u32> {
        let forward = from < to;
        let (low, high) = (from.min(to), from.max(to));
        let arc = self.arcs.get(&[low, high]).copied();
        let start = self.mesh.nodes[low as usize];
        let end = self.mesh.nodes[high as usize];
        let inner = parameters.len() - 2;
        let mut nodes = vec![low];
        for k in 1..=inner {
            let s = if forward { parameters[k] } else { 1.0 - parameters[inner + 1 - k] };
            let at = match &arc {
                Some(arc) => arc.at(s),
                None => [start[0] + s * (end[0] - start[0]), start[1] + s * (end[1] - start[1])],
            };
            nodes.push(self.vertex(at));
        }
        nodes.push(high);
        nodes
    }

    /// Elements of a grid of nodes with an odd number of columns and rows.
    fn add_cells(&mut self, grid: &[u32], columns: usize, rows: usize, region: u32) {
        for j in (0..rows - 1).step_by(2) {
            for i in (0..columns - 1).step_by(2) {
                let node = |di: usize, dj: usize| grid[(j + dj) * columns + i + di];
                let nodes: [u32; MAX_NODES] = [
                    node(0, 0),
                    node(2, 0),
                    node(2, 2),
                    node(0, 2),
                    node(1, 0),
                    node(2, 1),
                    node(1, 2),
                    node(0, 1),
                    node(1, 1),
                ];
                self.mesh.elements.push(Element { kind: ElementKind::Q9, nodes, region });
            }
        }
    }
}

/// Ends of cells and their middles.
fn with_middles(ends: &[f64]) -> Vec<f64> {
    let mut all = vec![ends[0]];
    for pair in ends.windows(2) {
        all.push(0.5 * (pair[0] + pair[1]));
        all.push(pair[1]);
    }
    all
}
