//! A mesh of a section, with its regions.

use super::Point;
use super::element::{ElementKind, MAX_NODES, SectionPoint};
use super::error::SectionError;
use crate::sorting::sort_by;
use std::collections::HashMap;

/// Boundaries nearer than this part of the size of the section are on one line
const SAME_LINE: f64 = 1e-9;

/// A connected part of a section with one material and one orientation.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Its name, for messages
    pub name: String,
    /// Index of the material
    pub material: usize,
    /// Angle of the fibre from axis 1 towards the wall tangent, rad
    pub theta: f64,
    /// The wall tangent
    pub tangent: Tangent,
}

impl Region {
    /// A region whose wall tangent is axis 2.
    pub fn new(name: &str, material: usize) -> Self {
        Self { name: name.to_string(), material, theta: 0.0, tangent: Tangent::Fixed(0.0) }
    }
}

/// The direction of a wall in the section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tangent {
    /// A constant direction: angle from axis 2 towards axis 3, rad
    Fixed(f64),
    /// Along circles about a centre, from axis 2 towards axis 3 if `counterclockwise`
    Around {
        /// Centre of the circles
        centre: Point,
        /// The sense
        counterclockwise: bool,
    },
}

impl Tangent {
    /// Angle of the tangent from axis 2 towards axis 3 at a point, rad.
    pub fn beta(&self, at: Point) -> f64 {
        match self {
            Self::Fixed(beta) => *beta,
            Self::Around { centre, counterclockwise } => {
                let radial = libm::atan2(at[1] - centre[1], at[0] - centre[0]);
                let quarter = std::f64::consts::FRAC_PI_2;
                radial + if *counterclockwise { quarter } else { -quarter }
            }
        }
    }
}

/// An element of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Element {
    /// Triangle or quadrilateral
    pub kind: ElementKind,
    /// Its nodes; those beyond the number of its kind are zero
    pub nodes: [u32; MAX_NODES],
    /// Index of its region
    pub(super) region: u32,
}

impl Element {
    /// The nodes of the element.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.kind.nodes()]
    }
}

/// A sharp corner that points into the material: stresses are infinite there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReentrantCorner {
    /// The corner
    pub at: Point,
    /// Thickness of the thinner wall that adjoins
    pub wall: f64,
}

/// Nodes, elements and regions of a section.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Positions
    pub nodes: Vec<Point>,
    /// Elements
    pub elements: Vec<Element>,
    /// Regions
    pub regions: Vec<Region>,
    /// Re-entrant corners
    pub corners: Vec<ReentrantCorner>,
}

impl Mesh {
    /// Positions of the nodes of an element, in the first places of the array.
    #[inline]
    pub fn positions(&self, element: &Element) -> [Point; MAX_NODES] {
        let mut positions = [[0.0; 2]; MAX_NODES];
        for (position, &node) in positions.iter_mut().zip(element.nodes()) {
            *position = self.nodes[node as usize];
        }
        positions
    }

    /// The region of an element.
    pub fn region(&self, element: &Element) -> &Region {
        &self.regions[element.region as usize]
    }

    /// The longest straight distance between neighbouring corners of an element.
    pub fn longest_side(&self) -> f64 {
        let length = |element: &Element, side: usize| {
            let [a, b, _] = element.kind.side(side).map(|local| self.nodes[element.nodes[local] as usize]);
            libm::hypot(a[0] - b[0], a[1] - b[1])
        };
        let sides = self.elements.iter().flat_map(|e| (0..e.kind.corners()).map(move |side| length(e, side)));
        sides.fold(0.0, f64::max)
    }

    /// Moves the section by a vector.
    pub fn shift(&mut self, by: Point) {
        let move_point = |point: &mut Point| *point = [point[0] + by[0], point[1] + by[1]];
        self.nodes.iter_mut().for_each(move_point);
        self.corners.iter_mut().for_each(|corner| move_point(&mut corner.at));
        for region in &mut self.regions {
            if let Tangent::Around { centre, .. } = &mut region.tangent {
                move_point(centre);
            }
        }
    }

    /// Turns the section about the origin from axis 2 towards axis 3, with its wall tangents.
    pub fn turn(&mut self, angle: f64) {
        let (sin, cos) = libm::sincos(angle);
        let turn_point = |point: &mut Point| {
            *point = [cos * point[0] - sin * point[1], sin * point[0] + cos * point[1]];
        };
        self.nodes.iter_mut().for_each(turn_point);
        self.corners.iter_mut().for_each(|corner| turn_point(&mut corner.at));
        for region in &mut self.regions {
            match &mut region.tangent {
                Tangent::Fixed(beta) => *beta += angle,
                Tangent::Around { centre, .. } => turn_point(centre),
            }
        }
    }

    /// Gives each part of the material a node of its own at points in which parts only touch, as
    /// where the corner of a hole lies on the outline. A common node would hold them together by a
    /// force in one point, which the exact solution does not have.
    pub fn separate_parts_at_points(&mut self) {
        let mut first_corner = Vec::with_capacity(self.elements.len());
        let mut corners = 0;
        for element in &self.elements {
            first_corner.push(corners);
            corners += element.kind.corners();
        }
        // Corners of elements at a node hang together by common sides.
        let mut parts = UnionFind::new(corners);
        let mut on_side: HashMap<[u32; 2], [usize; 2]> = HashMap::new();
        for (element, first) in self.elements.iter().zip(&first_corner) {
            for side in 0..element.kind.corners() {
                let [a, b, _] = element.kind.side(side);
                let [at_a, at_b] = [a, b].map(|local| (element.nodes[local], first + local));
                let [low, high] = if at_a.0 < at_b.0 { [at_a, at_b] } else { [at_b, at_a] };
                let known = *on_side.entry([low.0, high.0]).or_insert([low.1, high.1]);
                parts.unite(known[0], low.1);
                parts.unite(known[1], high.1);
            }
        }
        let mut node_of_part: HashMap<usize, u32> = HashMap::new();
        let mut is_taken = vec![false; self.nodes.len()];
        for (element, first) in self.elements.iter_mut().zip(&first_corner) {
            for local in 0..element.kind.corners() {
                let node = element.nodes[local];
                element.nodes[local] = *node_of_part.entry(parts.root(first + local)).or_insert_with(|| {
                    if std::mem::replace(&mut is_taken[node as usize], true) {
                        self.nodes.push(self.nodes[node as usize]);
                        self.nodes.len() as u32 - 1
                    } else {
                        node
                    }
                });
            }
        }
    }

    /// Checks that no element is folded and that the section is one piece.
    pub fn check(&self) -> Result<(), SectionError> {
        self.check_elements()?;
        self.check_connected()
    }

    /// Checks that the boundary does not cross itself and does not run twice along a line with the
    /// material on one side: walls that cross without a common point, or lie on one line, would
    /// otherwise cover the same place twice.
    pub fn check_overlap(&self) -> Result<(), SectionError> {
        self.check_common_sides()?;
        let slack = SAME_LINE * self.size();
        let mut pieces = self.boundary();
        let low = |piece: &BoundaryPiece, axis: usize| piece.ends[0][axis].min(piece.ends[1][axis]);
        let high = |piece: &BoundaryPiece, axis: usize| piece.ends[0][axis].max(piece.ends[1][axis]);
        sort_by(&mut pieces, |a, b| low(a, 0).total_cmp(&low(b, 0)));
        for (k, first) in pieces.iter().enumerate() {
            // Pieces that begin further right than this one ends cannot cross it.
            for second in pieces[k + 1..].iter().take_while(|second| low(second, 0) <= high(first, 0) + slack) {
                let apart = low(second, 1) > high(first, 1) + slack || high(second, 1) < low(first, 1) - slack;
                let overlaps =
                    || lines_cross(first.ends, second.ends, 0.0) || lines_cover(first.ends, second.ends, slack);
                if !apart && overlaps() {
                    let name = |piece: &BoundaryPiece| self.regions[piece.region as usize].name.clone();
                    return Err(SectionError::OverlappingRegions { first: name(first), second: name(second) });
                }
            }
        }
        Ok(())
    }

    /// Refuses two elements on the same side of a common side. Sides go around elements
    /// counterclockwise, so that neighbours have opposite directions.
    fn check_common_sides(&self) -> Result<(), SectionError> {
        let mut owners: HashMap<[u32; 2], u32> = HashMap::new();
        for element in &self.elements {
            for side in 0..element.kind.corners() {
                let [a, b, _] = element.kind.side(side).map(|local| element.nodes[local]);
                if let Some(other) = owners.insert([a, b], element.region) {
                    let [first, second] = [other, element.region].map(|r| self.regions[r as usize].name.clone());
                    return Err(SectionError::OverlappingRegions { first, second });
                }
            }
        }
        Ok(())
    }

    /// The longer side of the box around the section.
    fn size(&self) -> f64 {
        let extent = |axis: usize| {
            let values = self.nodes.iter().map(|node| node[axis]);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        extent(0).max(extent(1))
    }

    /// Halves of the sides that belong to one element only.
    fn boundary(&self) -> Vec<BoundaryPiece> {
        let mut count: HashMap<[u32; 2], u32> = HashMap::new();
        let key = |a: u32, b: u32| [a.min(b), a.max(b)];
        let sides = |element: &Element| {
            let element = *element;
            (0..element.kind.corners()).map(move |side| element.kind.side(side).map(|local| element.nodes[local]))
        };
        for [a, b, _] in self.elements.iter().flat_map(sides) {
            *count.entry(key(a, b)).or_default() += 1;
        }
        let mut pieces = Vec::new();
        for element in &self.elements {
            for [a, b, middle] in sides(element).filter(|&[a, b, _]| count[&key(a, b)] == 1) {
                for ends in [[a, middle], [middle, b]] {
                    let ends = ends.map(|node| self.nodes[node as usize]);
                    pieces.push(BoundaryPiece { ends, region: element.region });
                }
            }
        }
        pieces
    }

    /// Checks the determinants at the integration points.
    fn check_elements(&self) -> Result<(), SectionError> {
        for element in &self.elements {
            let positions = self.positions(element);
            let nodes = &positions[..element.kind.nodes()];
            for reference in element.kind.integration_points() {
                let point = SectionPoint::new(reference, nodes);
                // A number that is none is refused too.
                if point.determinant <= 0.0 || !point.determinant.is_finite() {
                    let region = self.region(element).name.clone();
                    return Err(SectionError::InvertedElement { region, at: point.at });
                }
            }
        }
        Ok(())
    }

    /// Checks that all elements hang together by common sides. A common corner is not enough: the
    /// parts would turn about it.
    fn check_connected(&self) -> Result<(), SectionError> {
        let mut parts = UnionFind::new(self.elements.len());
        let mut owner_of_side: HashMap<[u32; 2], usize> = HashMap::new();
        for (index, element) in self.elements.iter().enumerate() {
            for side in 0..element.kind.corners() {
                let [a, b, _] = element.kind.side(side).map(|local| element.nodes[local]);
                let owner = *owner_of_side.entry([a.min(b), a.max(b)]).or_insert(index);
                parts.unite(index, owner);
            }
        }
        let Some(first) = self.elements.first() else {
            return Err(SectionError::Dimensions { message: "the section has no area".to_string() });
        };
        for (index, element) in self.elements.iter().enumerate() {
            if parts.root(index) != parts.root(0) {
                return Err(SectionError::NotConnected {
                    first: self.region(first).name.clone(),
                    second: self.region(element).name.clone(),
                    near: self.nodes[element.nodes[0] as usize],
                });
            }
        }
        Ok(())
    }
}

/// Half of a side at the boundary.
struct BoundaryPiece {
    ends: [Point; 2],
    region: u32,
}

/// True if two lines cross between their ends; nearer than the tolerance, an end does not count.
pub fn lines_cross(first: [Point; 2], second: [Point; 2], tolerance: f64) -> bool {
    let side_of = |[a, b]: [Point; 2], p: Point| {
        let [along, to] = [[b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]];
        let length = libm::hypot(along[0], along[1]);
        let distance = (along[0] * to[1] - along[1] * to[0]) / length;
        // Round-off of coordinates must not look like a crossing of lines that touch.
        if distance.abs() <= tolerance.max(1e-9 * length) { 0.0 } else { distance.signum() }
    };
    let ends = |line: [Point; 2], other: [Point; 2]| side_of(line, other[0]) * side_of(line, other[1]);
    ends(first, second) < 0.0 && ends(second, first) < 0.0
}

/// True if two lines of one direction cover a common stretch; nearer than the tolerance is common.
fn lines_cover(first: [Point; 2], second: [Point; 2], tolerance: f64) -> bool {
    let [a, b] = first;
    let length = libm::hypot(b[0] - a[0], b[1] - a[1]);
    let along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    let place = |p: Point| {
        let to = [p[0] - a[0], p[1] - a[1]];
        [along[0] * to[0] + along[1] * to[1], along[0] * to[1] - along[1] * to[0]]
    };
    let [[from, above], [to, beside]] = second.map(place);
    let is_on_line = above.abs() <= tolerance && beside.abs() <= tolerance;
    let covered = to.min(length) - from.max(0.0);
    is_on_line && covered > tolerance.max(1e-6 * length)
}

/// Disjoint sets.
struct UnionFind {
    parent: Vec<usize>,
}

impl UnionFind {
    fn new(count: usize) -> Self {
        Self { parent: (0..count).collect() }
    }

    /// The representative of the set of an item; paths are halved on the way.
    fn root(&mut self, mut item: usize) -> usize {
        while self.parent[item] != item {
            self.parent[item] = self.parent[self.parent[item]];
            item = self.parent[item];
        }
        item
    }

    fn unite(&mut self, a: usize, b: usize) {
        let root = self.root(a);
        let other = self.root(b);
        self.parent[root.max(other)] = root.min(other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_one_direction_cover_each_other() {
        let line = |from: f64, to: f64, height: f64| [[from, height], [to, height]];
        let covers = |second: [Point; 2]| lines_cover(line(0.0, 2.0, 0.0), second, 1e-9);
        assert!(covers(line(1.0, 3.0, 0.0)) && covers(line(0.5, 1.5, 0.0)) && covers(line(-1.0, 3.0, 0.0)));
        // Faces that touch have opposite directions; neighbours on a face have a common point.
        assert!(!covers(line(3.0, 1.0, 0.0)) && !covers(line(2.0, 3.0, 0.0)) && !covers(line(0.0, 2.0, 1e-3)));
    }
}
