//! The edges that beams touch: of boxes from outside, of triangle meshes where they protrude, and the
//! rims of the open ends of tubes.
//!
//! A beam that lies across a box touches its edges, also where the distance from the box has no
//! minimum along the beam, as over a face that the beam is parallel to. Each edge is touched at the
//! closest point to it, with its middle m, its direction e and half of its length h:
//!
//! ```text
//! z = e.(y-m);  |z| <= h: d = (I-ee)(y-m), H = (I-ee-nn)/l;  else: d = y-m-eh sign z, H = (I-nn)/l
//! l = |d|, phi = l, n = d/l
//! ```
//!
//! Beside the edge this is the distance from the box ([`super::surface`]); over its faces it is
//! larger. Of the edges that meet at a corner one touches what is nearest to the corner.
//!
//! A rim is the circle where the wall of a tube ends; its distance is that of a torus of no thickness
//! ([`super::surface`]). Its force on a wire is normal to the wire at the closest point, not to the
//! wall: it does no work where the wire slides along itself.

use super::along::intervals_of_convex;
use super::distance::{Distance, Feature, Rounding, Side, Undefined, cylinder, sphere};
use super::surface::{Shape, Surface, torus};
use super::tube::Rim;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// Number of edges of a box.
const EDGES: u32 = 12;

/// An edge, in the axes of the surface's carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Edge {
    /// Of a box or a mesh
    Straight(StraightEdge),
    /// Of an open end of a tube, with the side of the wall on which beams are
    Rim(Rim, Side),
}

/// An edge of a box or a mesh, in the axes of the surface's carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StraightEdge {
    middle: Vec3,
    /// Its direction
    along: Vec3,
    /// Half of its length
    half: f64,
    /// The normals of its two faces
    normals: [Vec3; 2],
    /// Half lengths of the box along them; infinite for meshes, of which other edges have places of
    /// their own
    depths: [f64; 2],
}

impl Surface {
    /// True if closest points to edges are contact points of their own.
    pub fn has_edges(&self) -> bool {
        match &self.shape {
            Shape::Tube(tube) => tube.rims().is_some(),
            Shape::Plane { .. }
            | Shape::Sphere { .. }
            | Shape::Cylinder { .. }
            | Shape::Cone(_)
            | Shape::Torus { .. }
            | Shape::Box { .. }
            | Shape::Mesh(_) => self.is_faceted(),
        }
    }

    /// True if flat faces meet at its edges.
    pub fn is_faceted(&self) -> bool {
        match &self.shape {
            Shape::Box { .. } => self.side == Side::Outside,
            Shape::Mesh(_) => true,
            Shape::Plane { .. }
            | Shape::Sphere { .. }
            | Shape::Cylinder { .. }
            | Shape::Cone(_)
            | Shape::Torus { .. }
            | Shape::Tube(_) => false,
        }
    }

    /// False where the closest point of an edge to `y` is a corner that another edge has: one of which
    /// the closest point is between its ends, or the one with the smallest number.
    pub fn owns_corner(&self, number: u32, y: Vec3) -> bool {
        let Some(Edge::Straight(edge)) = self.edge(number) else { return true };
        let along = edge.along.dot(y - edge.middle);
        if along.abs() < edge.half {
            return true;
        }
        let has_it = |(other, end): (u32, f64)| {
            let Some(Edge::Straight(edge)) = self.edge(other).filter(|_| other != number) else { return false };
            let along = edge.along.dot(y - edge.middle);
            along.abs() < edge.half || (other < number && along * end > 0.0)
        };
        !self.edges_at_end(number, along.signum()).into_iter().any(has_it)
    }

    /// Numbers of the edges that meet at the end of an edge, each with the end of it that is there:
    /// 1 or -1 along it.
    fn edges_at_end(&self, number: u32, end: f64) -> Vec<(u32, f64)> {
        match &self.shape {
            Shape::Mesh(mesh) => mesh.edges_at_end(number, end, self.side),
            Shape::Box { .. } => edges_at_corner_of_box(number, end),
            Shape::Plane { .. }
            | Shape::Sphere { .. }
            | Shape::Cylinder { .. }
            | Shape::Cone(_)
            | Shape::Torus { .. }
            | Shape::Tube(_) => Vec::new(),
        }
    }

    /// Numbers of the edges that beams can touch, in ascending order: all that are within `reach` of
    /// the line between two points, and maybe others.
    pub fn edges_near(&self, line: [Vec3; 2], reach: f64) -> Vec<u32> {
        match &self.shape {
            Shape::Mesh(mesh) => mesh.edges_near(line, reach, self.side),
            Shape::Box { .. } if self.side == Side::Outside => (0..EDGES).collect(),
            Shape::Tube(tube) => {
                let (middle, half) = ((line[0] + line[1]) * 0.5, 0.5 * (line[1] - line[0]).norm());
                let is_near = |number: &u32| {
                    let rim = tube.rims().map(|rims| rims[*number as usize]);
                    rim.is_some_and(|rim| rim.is_within(half + reach, middle))
                };
                (0..2).filter(is_near).collect()
            }
            Shape::Box { .. }
            | Shape::Plane { .. }
            | Shape::Sphere { .. }
            | Shape::Cylinder { .. }
            | Shape::Cone(_)
            | Shape::Torus { .. } => Vec::new(),
        }
    }

    /// The edge with a number; `None` for surfaces without edges.
    pub fn edge(&self, number: u32) -> Option<Edge> {
        match &self.shape {
            Shape::Box { centre, axes, half } => Some(Edge::Straight(edge_of_box(*centre, axes, *half, number))),
            Shape::Tube(tube) => Some(Edge::Rim(*tube.rims()?.get(number as usize)?, self.side)),
            Shape::Mesh(mesh) => {
                let (middle, along, half, outward) = mesh.edge(number)?;
                let normals = match self.side {
                    Side::Outside => outward,
                    Side::Inside => outward.map(|normal| -normal),
                };
                let edge = StraightEdge { middle, along, half, normals, depths: [f64::INFINITY; 2] };
                Some(Edge::Straight(edge))
            }
            Shape::Plane { .. }
            | Shape::Sphere { .. }
            | Shape::Cylinder { .. }
            | Shape::Cone(_)
            | Shape::Torus { .. } => None,
        }
    }
}

/// The edges of a box at an end of one of them.
fn edges_at_corner_of_box(number: u32, end: f64) -> Vec<(u32, f64)> {
    let along = (number / 4) as usize;
    let mut signs = [end; 3];
    for (bit, axis) in [(1, (along + 1) % 3), (2, (along + 2) % 3)] {
        signs[axis] = if number & bit == 0 { 1.0 } else { -1.0 };
    }
    let edge = |axis: usize| {
        let bit = |axis: usize, bit: u32| if signs[axis % 3] > 0.0 { 0 } else { bit };
        (4 * axis as u32 + bit(axis + 1, 1) + bit(axis + 2, 2), signs[axis])
    };
    (0..3).map(edge).collect()
}

fn edge_of_box(centre: Vec3, axes: &Mat3, half: [f64; 3], number: u32) -> StraightEdge {
    let along = (number / 4) as usize;
    let others = [(along + 1) % 3, (along + 2) % 3];
    let signs = [1, 2].map(|bit| if number & bit == 0 { 1.0 } else { -1.0 });
    let normals = [0, 1].map(|k| axes.column(others[k]) * signs[k]);
    let depths = others.map(|axis| half[axis]);
    let middle = centre + normals[0] * depths[0] + normals[1] * depths[1];
    StraightEdge { middle, along: axes.column(along), half: half[along], normals, depths }
}

impl Edge {
    /// The distance of the point `y` from the edge.
    pub fn distance<T: Real>(&self, y: Vec3<T>) -> Result<Distance<T>, Undefined> {
        match self {
            Self::Straight(edge) => edge.distance(y),
            Self::Rim(rim, _) => {
                let ring =
                    torus(y - Vec3::constant(rim.centre), rim.outward, [rim.radius, 0.0], Rounding::of(Side::Outside))?;
                Ok(Distance { feature: Feature::Edge, ..ring })
            }
        }
    }

    /// The distance of the point `y`, also where it has no normal, and without the rounding in the middle of a rim.
    pub fn value(&self, y: Vec3) -> f64 {
        match self {
            Self::Straight(edge) => {
                let d = y - edge.middle;
                (d - edge.along * edge.along.dot(d).clamp(-edge.half, edge.half)).norm()
            }
            Self::Rim(rim, _) => {
                let [beyond, across] = rim.along_and_across(y);
                beyond.hypot(across - rim.radius)
            }
        }
    }

    /// True if the point `y` is outside of the faces of the edge, or the wall of a tube, and nearer to this edge than
    /// to those on the other sides of its faces.
    pub fn is_beside(&self, y: Vec3) -> bool {
        match self {
            Self::Straight(edge) => edge.is_beside(y),
            Self::Rim(rim, side) => {
                let [beyond, across] = rim.along_and_across(y);
                let is_off_the_wall = match side {
                    Side::Inside => across < rim.radius,
                    Side::Outside => across > rim.radius,
                };
                beyond > 0.0 || is_off_the_wall
            }
        }
    }

    /// Parts of an element, each of which has one local minimum of the distance at most.
    pub fn intervals(&self, surface: &Surface, nodes: &[Vec3]) -> usize {
        match self {
            Self::Straight(_) => intervals_of_convex(nodes.len()),
            Self::Rim(..) => surface.intervals(nodes),
        }
    }
}

impl StraightEdge {
    fn distance<T: Real>(&self, y: Vec3<T>) -> Result<Distance<T>, Undefined> {
        let d = y - Vec3::constant(self.middle);
        let along = Vec3::constant(self.along).dot(d).largest();
        if along.abs() <= self.half {
            Ok(Distance { feature: Feature::Edge, ..cylinder(d, self.along, 0.0, 0.0)? })
        } else {
            let corner = self.along * (self.half * along.signum());
            Ok(Distance { feature: Feature::Corner, ..sphere(d - Vec3::constant(corner), 0.0, 0.0)? })
        }
    }

    fn is_beside(&self, y: Vec3) -> bool {
        let d = y - self.middle;
        let heights = self.normals.map(|normal| normal.dot(d));
        let is_outside = heights[0] > 0.0 || heights[1] > 0.0;
        let is_on_its_side = heights[0] >= -self.depths[0] && heights[1] >= -self.depths[1];
        is_outside && is_on_its_side
    }
}

#[cfg(test)]
mod tests {
    use super::super::dual::{Random, jacobian, variables};
    use super::super::tube::{Tube, TubeEnds};
    use super::*;

    fn cuboid(random: &mut Random) -> Surface {
        let shape = Shape::Box { centre: random.vector(0.2), axes: random.rotation(3.0).r, half: [0.4, 0.6, 0.9] };
        Surface { shape, side: Side::Outside }
    }

    #[test]
    fn normals_and_curvatures_are_derivatives() {
        let mut random = Random(5);
        let surface = cuboid(&mut random);
        for number in 0..EDGES {
            let edge = surface.edge(number).unwrap();
            for _ in 0..50 {
                let y = random.vector(2.0);
                let (Ok(exact), Ok(here)) = (edge.distance(variables::<3>(y, 0)), edge.distance(y)) else { continue };
                let size = 1.0 + here.curvature.max_abs();
                assert!((Vec3(exact.value.partials) - here.normal).max_abs() < 1e-13 * size);
                assert!((jacobian(exact.normal, 0) - here.curvature).max_abs() < 1e-13 * size * size);
            }
        }
    }

    /// Beside an edge or a corner its distance is that of the box.
    #[test]
    fn edges_and_corners_have_the_distance_of_the_box() {
        let mut random = Random(8);
        let surface = cuboid(&mut random);
        let edges: Vec<Edge> = (0..EDGES).filter_map(|number| surface.edge(number)).collect();
        let mut strips = 0;
        for _ in 0..2000 {
            let y = random.vector(1.6);
            let whole = surface.distance(y).unwrap();
            let beside: Vec<&Edge> = edges.iter().filter(|edge| edge.is_beside(y)).collect();
            let distances: Vec<f64> = beside.iter().map(|edge| edge.distance(y).unwrap().value).collect();
            assert!(distances.iter().all(|distance| *distance > whole.value - 1e-14), "{distances:?} {whole:?}");
            if whole.feature == Feature::Edge {
                strips += 1;
                assert!(distances.iter().any(|distance| (distance - whole.value).abs() < 1e-14), "{y:?}");
            } else if whole.feature == Feature::Corner {
                let nearest = distances.iter().filter(|distance| (*distance - whole.value).abs() < 1e-14);
                assert_eq!(nearest.count(), 3, "{y:?}");
            } else if whole.value < 0.0 {
                assert!(distances.is_empty());
            }
        }
        assert!(strips > 200, "{strips}");
    }

    #[test]
    fn rims_have_the_distance_of_a_circle() {
        let mut random = Random(9);
        let points = [Vec3::ZERO, Vec3([1.0, 0.2, 0.1]), Vec3([2.1, 0.9, 0.0])];
        for radii in [[0.3; 3], [0.3, 0.2, 0.25], [0.2, 0.3, 0.4]] {
            let tubes =
                [Tube::straight(&points, &radii, TubeEnds::Open), Tube::smooth(&points, &radii, TubeEnds::Open)];
            for (tube, side) in tubes.into_iter().zip([Side::Inside, Side::Outside]) {
                let surface = Surface { shape: Shape::Tube(tube.unwrap()), side };
                for number in 0..2 {
                    let Some(edge @ Edge::Rim(rim, _)) = surface.edge(number) else { panic!("no rim") };
                    for _ in 0..50 {
                        let y = random.vector(2.0);
                        let (exact, here) = (edge.distance(variables::<3>(y, 0)).unwrap(), edge.distance(y).unwrap());
                        let size = 1.0 + here.curvature.max_abs();
                        assert!((Vec3(exact.value.partials) - here.normal).max_abs() < 1e-13 * size);
                        assert!((jacobian(exact.normal, 0) - here.curvature).max_abs() < 1e-13 * size * size);
                        let foot = edge.distance(y - here.normal * here.value * (1.0 - 1e-9)).unwrap();
                        assert!(foot.value < 1e-8, "{foot:?}");
                    }
                    // The wall ends at the rim: there it is still there, and not beyond.
                    for _ in 0..10 {
                        let across = rim.outward.cross(random.direction()).normalized().unwrap();
                        let on_rim = rim.centre + across * rim.radius;
                        let within = surface.distance(on_rim - rim.outward * 1e-9).unwrap();
                        assert!(within.value.abs() < 1e-8, "{within:?}");
                        let beyond = surface.distance(on_rim + rim.outward * 1e-6);
                        assert_eq!(beyond.unwrap_err(), Undefined::BeyondEnd);
                    }
                }
            }
        }
        let closed = Tube::straight(&points, &[0.3; 3], TubeEnds::Round).unwrap();
        assert!(!Surface { shape: Shape::Tube(closed), side: Side::Inside }.has_edges());
    }

    #[test]
    fn other_surfaces_have_no_edges() {
        let shape = Shape::Sphere { centre: Vec3::ZERO, radius: 1.0 };
        let ball = Surface { shape, side: Side::Outside };
        assert!(!ball.has_edges() && ball.edge(0).is_none());
        let inside = Surface { side: Side::Inside, ..cuboid(&mut Random(1)) };
        assert!(!inside.has_edges() && inside.edges_near([Vec3::ZERO; 2], 9.0).is_empty());
    }
}
