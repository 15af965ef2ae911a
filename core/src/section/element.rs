//! The two elements of section meshes: triangles of six nodes and quadrilaterals of nine.
//!
//! Sides are isoparametric, so that curved boundaries are followed to fourth order.

use super::Point;
use std::sync::LazyLock;

/// Most nodes of an element
pub const MAX_NODES: usize = 9;

/// The kind of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementKind {
    /// Triangle: three corners, then the middles of sides 01, 12, 20
    T6,
    /// Quadrilateral: four corners, the middles of sides 01, 12, 23, 30, then the centre
    Q9,
}

impl ElementKind {
    /// The number of nodes.
    pub fn nodes(self) -> usize {
        match self {
            Self::T6 => 6,
            Self::Q9 => 9,
        }
    }

    /// The number of corners, which is that of sides.
    pub fn corners(self) -> usize {
        match self {
            Self::T6 => 3,
            Self::Q9 => 4,
        }
    }

    /// Local nodes of a side: first corner, second corner, middle.
    pub fn side(self, side: usize) -> [usize; 3] {
        let corners = self.corners();
        [side, (side + 1) % corners, corners + side]
    }

    /// Integration points: six (degree 4) of triangles, 3 x 3 of quadrilaterals.
    pub fn integration_points(self) -> &'static [ReferencePoint] {
        match self {
            Self::T6 => &T6_INTEGRATION,
            Self::Q9 => &Q9_INTEGRATION,
        }
    }

    /// The nodes, as points of evaluation (without weight).
    pub fn node_points(self) -> &'static [ReferencePoint] {
        match self {
            Self::T6 => &T6_NODES,
            Self::Q9 => &Q9_NODES,
        }
    }

    /// Shape functions at a point of the reference element.
    pub fn at(self, xi: Point, weight: f64) -> ReferencePoint {
        match self {
            Self::T6 => t6(xi, weight),
            Self::Q9 => q9(xi, weight),
        }
    }

    /// The middle of the reference element.
    pub fn middle(self) -> Point {
        match self {
            Self::T6 => [1.0 / 3.0; 2],
            Self::Q9 => [0.0; 2],
        }
    }

    /// True if a point of the reference element is inside, up to a tolerance.
    pub fn contains(self, xi: Point, tolerance: f64) -> bool {
        match self {
            Self::T6 => xi[0] >= -tolerance && xi[1] >= -tolerance && xi[0] + xi[1] <= 1.0 + tolerance,
            Self::Q9 => xi[0].abs() <= 1.0 + tolerance && xi[1].abs() <= 1.0 + tolerance,
        }
    }
}

/// Shape functions and their derivatives at a point of the reference element.
#[derive(Clone, Copy, Debug)]
pub struct ReferencePoint {
    /// Weight of integration over the reference element
    weight: f64,
    /// Shape functions
    pub(super) shape: [f64; MAX_NODES],
    /// Derivatives by the first and second reference coordinate
    pub(super) derivatives: [[f64; 2]; MAX_NODES],
}

/// Shape functions at a point of an element of the section.
#[derive(Clone, Copy, Debug)]
pub struct SectionPoint {
    /// Area of the point: weight times determinant
    pub(super) area: f64,
    /// Determinant of the map from the reference element
    pub(super) determinant: f64,
    /// The point
    pub(super) at: Point,
    /// Shape functions
    pub(super) shape: [f64; MAX_NODES],
    /// Derivatives by axes 2 and 3
    pub(super) gradient: [[f64; 2]; MAX_NODES],
}

impl SectionPoint {
    /// Maps a reference point into an element with the given node positions.
    #[inline]
    pub fn new(reference: &ReferencePoint, nodes: &[Point]) -> Self {
        let mut at = [0.0; 2];
        let mut map = [[0.0; 2]; 2];
        for (a, node) in nodes.iter().enumerate() {
            for axis in 0..2 {
                at[axis] += reference.shape[a] * node[axis];
                map[axis][0] += reference.derivatives[a][0] * node[axis];
                map[axis][1] += reference.derivatives[a][1] * node[axis];
            }
        }
        let determinant = map[0][0] * map[1][1] - map[0][1] * map[1][0];
        let mut gradient = [[0.0; 2]; MAX_NODES];
        for a in 0..nodes.len() {
            let [first, second] = reference.derivatives[a];
            gradient[a][0] = (first * map[1][1] - second * map[1][0]) / determinant;
            gradient[a][1] = (second * map[0][0] - first * map[0][1]) / determinant;
        }
        Self { area: reference.weight * determinant, determinant, at, shape: reference.shape, gradient }
    }
}

/// Shape functions of the triangle; reference coordinates from 0 to 1.
fn t6([x, y]: Point, weight: f64) -> ReferencePoint {
    let z = 1.0 - x - y;
    let mut shape = [0.0; MAX_NODES];
    shape[..6].copy_from_slice(&[
        z * (2.0 * z - 1.0),
        x * (2.0 * x - 1.0),
        y * (2.0 * y - 1.0),
        4.0 * z * x,
        4.0 * x * y,
        4.0 * y * z,
    ]);
    let mut derivatives = [[0.0; 2]; MAX_NODES];
    derivatives[..6].copy_from_slice(&[
        [1.0 - 4.0 * z, 1.0 - 4.0 * z],
        [4.0 * x - 1.0, 0.0],
        [0.0, 4.0 * y - 1.0],
        [4.0 * (z - x), -4.0 * x],
        [4.0 * y, 4.0 * x],
        [-4.0 * y, 4.0 * (z - y)],
    ]);
    ReferencePoint { weight, shape, derivatives }
}

/// Positions of the nodes of the quadrilateral in its two directions: 0 at -1, 1 at 0, 2 at +1
const Q9_GRID: [[usize; 2]; 9] = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1], [1, 1]];

/// Shape functions of the quadrilateral; reference coordinates from -1 to 1.
fn q9([x, y]: Point, weight: f64) -> ReferencePoint {
    let lagrange = |s: f64| [0.5 * s * (s - 1.0), 1.0 - s * s, 0.5 * s * (s + 1.0)];
    let slope = |s: f64| [s - 0.5, -2.0 * s, s + 0.5];
    let mut shape = [0.0; MAX_NODES];
    let mut derivatives = [[0.0; 2]; MAX_NODES];
    for (a, [i, j]) in Q9_GRID.into_iter().enumerate() {
        shape[a] = lagrange(x)[i] * lagrange(y)[j];
        derivatives[a] = [slope(x)[i] * lagrange(y)[j], lagrange(x)[i] * slope(y)[j]];
    }
    ReferencePoint { weight, shape, derivatives }
}

static T6_INTEGRATION: LazyLock<Vec<ReferencePoint>> = LazyLock::new(|| {
    // Dunavant 1985, doi:10.1002/nme.1620210612, degree 4.
    let orbits =
        [(0.445_948_490_915_964_9, 0.223_381_589_678_011_47), (0.091_576_213_509_770_74, 0.109_951_743_655_321_87)];
    let mut points = Vec::new();
    for (a, weight) in orbits {
        for xi in [[a, a], [1.0 - 2.0 * a, a], [a, 1.0 - 2.0 * a]] {
            points.push(t6(xi, 0.5 * weight));
        }
    }
    points
});

static Q9_INTEGRATION: LazyLock<Vec<ReferencePoint>> = LazyLock::new(|| {
    let place = 0.6_f64.sqrt();
    let line = [(-place, 5.0 / 9.0), (0.0, 8.0 / 9.0), (place, 5.0 / 9.0)];
    line.iter().flat_map(|&(y, wy)| line.iter().map(move |&(x, wx)| q9([x, y], wx * wy))).collect()
});

static T6_NODES: LazyLock<Vec<ReferencePoint>> = LazyLock::new(|| {
    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]].map(|xi| t6(xi, 0.0)).to_vec()
});

static Q9_NODES: LazyLock<Vec<ReferencePoint>> =
    LazyLock::new(|| Q9_GRID.map(|[i, j]| q9([i as f64 - 1.0, j as f64 - 1.0], 0.0)).to_vec());

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_functions_are_one_at_their_node() {
        for kind in [ElementKind::T6, ElementKind::Q9] {
            for (b, point) in kind.node_points().iter().enumerate() {
                for a in 0..kind.nodes() {
                    assert!((point.shape[a] - if a == b { 1.0 } else { 0.0 }).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn derivatives_match_differences() {
        let step = 1e-6;
        for kind in [ElementKind::T6, ElementKind::Q9] {
            let here = kind.at([0.21, 0.34], 1.0);
            for axis in 0..2 {
                let mut ends = [[0.21, 0.34]; 2];
                ends[0][axis] -= step;
                ends[1][axis] += step;
                let [before, after] = ends.map(|xi| kind.at(xi, 1.0));
                for a in 0..kind.nodes() {
                    let difference = (after.shape[a] - before.shape[a]) / (2.0 * step);
                    assert!((difference - here.derivatives[a][axis]).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn triangles_integrate_degree_four() {
        // Integral of x^a y^b over the reference triangle: a! b! / (a + b + 2)!.
        let nodes: Vec<Point> = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];
        let sum = |a: i32, b: i32| -> f64 {
            let points = ElementKind::T6.integration_points().iter().map(|point| SectionPoint::new(point, &nodes));
            points.map(|point| point.area * point.at[0].powi(a) * point.at[1].powi(b)).sum()
        };
        assert!((sum(0, 0) - 0.5).abs() < 1e-15);
        assert!((sum(4, 0) - 24.0 / 720.0).abs() < 1e-15);
        assert!((sum(2, 2) - 4.0 / 720.0).abs() < 1e-15);
        assert!((sum(3, 1) - 6.0 / 720.0).abs() < 1e-15);
    }

    #[test]
    fn gradients_of_a_distorted_quadrilateral_are_those_of_coordinates() {
        let corners = [[0.0, 0.0], [2.0, 0.3], [2.5, 1.7], [-0.2, 1.1]];
        let mut nodes = corners.to_vec();
        for side in 0..4 {
            let next = corners[(side + 1) % 4];
            nodes.push([0.5 * (corners[side][0] + next[0]), 0.5 * (corners[side][1] + next[1])]);
        }
        nodes.push([1.1, 0.8]);
        for reference in ElementKind::Q9.integration_points() {
            let point = SectionPoint::new(reference, &nodes);
            for axis in 0..2 {
                for by in 0..2 {
                    let slope: f64 = (0..9).map(|a| point.gradient[a][by] * nodes[a][axis]).sum();
                    assert!((slope - if by == axis { 1.0 } else { 0.0 }).abs() < 1e-13);
                }
            }
        }
    }
}
