//! Rigid surfaces by their signed distance phi, its gradient n and its Hessian H, at a point y in
//! the axes of the surface's carrier (lengths).
//!
//! Outside of a body: phi > 0 in free space, n points from the body to the point, |n| = 1, H n = 0.
//! Inside of it all three change their sign. The gap of a round section is phi - r.
//!
//! ```text
//! plane      phi = e.(y-a)                             H = 0
//! sphere     l=|y-c|, phi=l-R, n=(y-c)/l               H = (I-nn)/l
//! cylinder   d=(I-ee)(y-a), l=|d|, phi=l-R, n=d/l      H = (I-ee-nn)/l
//! capsule    by z=e.(y-a): sphere at an end (z<=0, z>=L) or cylinder
//! cone       hull of two spheres (a,Ra),(b,Rb), k=(Ra-Rb)/L, c=sqrt(1-k^2), z=e.(y-a),
//!            q=(I-ee)(y-a), l=|q|, s=z-lk/c; s<=0, s>=L: spheres;
//!            else phi=cl+kz-Ra, n=cq/l+ke, H=c tt/l, t=e x q/l
//! torus      z=e.d, q=d-ez, l=|q|, m=q/l, v=(l-A)m+ez, s=|v|, n=v/s, b=e x m
//!            phi=s-R, H=(I-nn-bb)/s + (1-A/l)bb/s
//! box        q=|y|-h: any q>0: v=max(q,0) sign y, l=|v|, n=v/l, H=(diag(q>0)-nn)/l;
//!            otherwise the face of the largest q, H=0
//! tube       see [`super::tube`]
//! mesh       see [`super::mesh`]
//! ```
//!
//! Inside of round walls and in the holes of rings the distance l from the axis is rounded off near it: there |n| < 1,
//! and H n is not zero (`distance::RoundedLength`). At the joints of straight pieces of a tube and at round ends the
//! rounded values differ by up to 4e-5 of the radius.
//!
//! H jumps where the closest point passes from one part of a surface to another (the ends of
//! capsules and cones, the borders of the faces of a box seen from outside). n jumps on the medial
//! axis: inside a box where two faces are equally near, and where two pieces of a tube of straight
//! pieces are. There the piece of the lower number is taken. [`Undefined`] names the points without
//! a normal.

use super::along::{MOST_INTERVALS, intervals_of_convex};
use super::cone::Cone;
use super::distance::{
    Distance, Feature, MIN_RELATIVE_DISTANCE, RoundedLength, Rounding, Side, Undefined, cylinder, plane, sphere,
};
use super::mesh::TriangleMesh;
use super::tube::Tube;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};
use std::sync::Arc;

/// Parts of an element as long as the radius of a surface in which minima are looked for.
const INTERVALS_OF_RADIUS: f64 = 6.0;

/// The shape of a rigid surface, in the axes of its carrier. Directions are unit vectors, radii and
/// half lengths positive.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// The half space behind a plane
    Plane {
        /// A point of the plane
        point: Vec3,
        /// The normal into free space
        normal: Vec3,
    },
    /// A sphere
    Sphere {
        /// The centre
        centre: Vec3,
        /// The radius
        radius: f64,
    },
    /// A cylinder without ends
    Cylinder {
        /// A point of the axis
        point: Vec3,
        /// The direction of the axis
        axis: Vec3,
        /// The radius
        radius: f64,
    },
    /// A capsule or a cone with spherical ends
    Cone(Cone),
    /// A torus
    Torus {
        /// The centre
        centre: Vec3,
        /// The direction of the axis
        axis: Vec3,
        /// A, the radius of the ring's centre line
        ring: f64,
        /// R, the radius of the ring's section
        radius: f64,
    },
    /// A box
    Box {
        /// The centre
        centre: Vec3,
        /// The directions of its edges, as columns of a rotation
        axes: Mat3,
        /// Half of its edges
        half: [f64; 3],
    },
    /// A tube along a curve
    Tube(Tube),
    /// A closed triangle mesh
    Mesh(Arc<TriangleMesh>),
}

/// Parts into which pieces of a centre line are cut to look along it.
const PARTS_OF_PIECE: usize = 16;

/// A rigid surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Its shape
    pub shape: Shape,
    /// The side on which beams are
    pub side: Side,
}

impl Surface {
    /// The signed distance of the point `y`, in the axes of the carrier.
    pub fn distance<T: Real>(&self, y: Vec3<T>) -> Result<Distance<T>, Undefined> {
        self.rounded_distance(y, Rounding::of(self.side))
    }

    /// The distance that is rounded off in the middle of holes as `rounding` says.
    fn rounded_distance<T: Real>(&self, y: Vec3<T>, rounding: Rounding) -> Result<Distance<T>, Undefined> {
        let outside = self.shape.distance(y, rounding)?;
        match self.side {
            Side::Outside => Ok(outside),
            Side::Inside => Ok(outside.reversed()),
        }
    }

    /// Parts of an element, each of which has one local minimum of the distance at most. Along a straight
    /// element the distance from a convex body is a convex function outside, and a concave one inside. Elsewhere it
    /// rises and falls on ways as long as the radius, of which there are more in elements of four radii.
    pub fn intervals(&self, nodes: &[Vec3]) -> usize {
        let at_least = 2 * nodes.len().saturating_sub(1);
        let is_convex = match &self.shape {
            Shape::Plane { .. } | Shape::Sphere { .. } | Shape::Cylinder { .. } | Shape::Cone(_) => true,
            Shape::Torus { .. } | Shape::Tube(_) => false,
            // Edges have minima of their own.
            Shape::Box { .. } | Shape::Mesh(_) => return at_least,
        };
        if is_convex && nodes.len() == 2 {
            return intervals_of_convex(2);
        }
        let chords: f64 = nodes.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum();
        let needed = INTERVALS_OF_RADIUS * chords / self.shape.depth();
        at_least.max((needed as usize).min(MOST_INTERVALS))
    }

    /// The exact signed distance of a point, also where it has no normal: on an axis, at a centre. There
    /// it is that of a point beside it, by a millionth of `size` at first, which is a length of the
    /// order of gaps. `None` where nothing is there to touch.
    pub fn value(&self, y: Vec3, size: f64) -> Option<f64> {
        // Not along any axis that users choose.
        const ASIDE: Vec3 = Vec3([0.613, 0.524, 0.592]);
        let distance = |y: Vec3| self.rounded_distance(y, Rounding::NONE);
        match distance(y) {
            Ok(distance) => Some(distance.value),
            Err(Undefined::BeyondEnd) => None,
            Err(Undefined::Centre | Undefined::Axis | Undefined::Ring | Undefined::NotUnique) => {
                let steps = [1e-6, 1e-3, 1.0];
                let beside = steps.into_iter().find_map(|step| distance(y + ASIDE * (step * size)).ok());
                beside.map(|distance| distance.value)
            }
        }
    }

    /// Places along the centre line of a tube that holds points within it; none of other surfaces.
    pub fn centre_line_of_lumen(&self) -> Vec<Vec3> {
        let (Shape::Tube(tube), Side::Inside) = (&self.shape, self.side) else { return Vec::new() };
        let between = |ends: &[(Vec3, f64)]| {
            let [(from, _), (to, _)] = [ends[0], ends[1]];
            (0..=PARTS_OF_PIECE).map(move |k| from + (to - from) * (k as f64 / PARTS_OF_PIECE as f64))
        };
        tube.sections().windows(2).flat_map(between).collect()
    }

    /// True for a plane: the closest point of an element has no place of its own there, since the element alone bends.
    pub fn is_flat(&self) -> bool {
        matches!(self.shape, Shape::Plane { .. })
    }

    /// True if points inside of a body may have no normal: on an axis, at a centre.
    pub fn may_lose_points(&self) -> bool {
        let has_axis = match &self.shape {
            Shape::Sphere { .. } | Shape::Cylinder { .. } | Shape::Cone(_) | Shape::Torus { .. } | Shape::Tube(_) => {
                true
            }
            Shape::Plane { .. } | Shape::Box { .. } | Shape::Mesh(_) => false,
        };
        has_axis && self.side == Side::Outside
    }

    /// True for a point inside of a body at which it has no normal: no force pushes it out. `size`: see
    /// [`Surface::value`].
    pub fn is_lost(&self, y: Vec3, size: f64) -> bool {
        self.distance(y).is_err() && self.value(y, size).is_some_and(|value| value < 0.0)
    }
}

impl Shape {
    /// The distance from outside.
    fn distance<T: Real>(&self, y: Vec3<T>, rounding: Rounding) -> Result<Distance<T>, Undefined> {
        match self {
            Self::Plane { point, normal } => Ok(plane(y, *point, *normal)),
            Self::Sphere { centre, radius } => {
                let ball = sphere(y - Vec3::constant(*centre), *radius, rounding.inside * radius)?;
                Ok(Distance { feature: Feature::Face, ..ball })
            }
            Self::Cylinder { point, axis, radius } => {
                cylinder(y - Vec3::constant(*point), *axis, *radius, rounding.inside * radius)
            }
            Self::Cone(cone) => cone.distance(y, rounding.inside * cone.least_radius()),
            Self::Torus { centre, axis, ring, radius } => {
                torus(y - Vec3::constant(*centre), *axis, [*ring, *radius], rounding)
            }
            Self::Box { centre, axes, half } => Ok(cuboid(y - Vec3::constant(*centre), *axes, *half)),
            Self::Tube(tube) => tube.distance(y, rounding),
            Self::Mesh(mesh) => mesh.distance(y),
        }
    }

    /// The radius within which a point that penetrates still finds its way out: from the surface
    /// inward to the points where the normal is undefined or jumps. Infinite for planes.
    pub fn depth(&self) -> f64 {
        match self {
            Self::Plane { .. } => f64::INFINITY,
            Self::Sphere { radius, .. } | Self::Cylinder { radius, .. } | Self::Torus { radius, .. } => *radius,
            Self::Cone(cone) => cone.least_radius(),
            Self::Box { half, .. } => half[0].min(half[1]).min(half[2]),
            Self::Tube(tube) => tube.least_radius(),
            Self::Mesh(mesh) => mesh.depth(),
        }
    }
}

/// The distance from a torus, for the place `d` of the point from its centre.
pub(super) fn torus<T: Real>(
    d: Vec3<T>,
    axis: Vec3,
    [ring, radius]: [f64; 2],
    rounding: Rounding,
) -> Result<Distance<T>, Undefined> {
    let e = Vec3::constant(axis);
    let z = e.dot(d);
    let q = d - e * z;
    if let Some(rounded) = RoundedLength::of(q, rounding.hole * (ring - radius)) {
        let v = [rounded.value - T::constant(ring), z];
        let s = (v[0] * v[0] + v[1] * v[1]).sqrt();
        let inverse = T::one() / s;
        let n = q * (rounded.slope * v[0] * inverse) + e * (z * inverse);
        let slope = q * rounded.slope;
        let bent = slope.outer(slope) + rounded.hessian(q, Mat3::identity() - e.outer(e)) * v[0] + e.outer(e);
        return Ok(Distance {
            value: s - T::constant(radius),
            normal: n,
            curvature: (bent - n.outer(n)) * inverse,
            feature: Feature::Face,
        });
    }
    let l = q.norm();
    if l.largest() <= MIN_RELATIVE_DISTANCE * ring {
        return Err(Undefined::Axis);
    }
    let m = q * (T::one() / l);
    let v = m * (l - T::constant(ring)) + e * z;
    if let Some(rounded) = RoundedLength::of(v, rounding.inside * radius) {
        let b = e.cross(m);
        let across = Mat3::identity() - b.outer(b) * (T::constant(ring) / l);
        return Ok(Distance {
            value: rounded.value - T::constant(radius),
            normal: v * rounded.slope,
            curvature: rounded.hessian(v, across),
            feature: Feature::Face,
        });
    }
    let s = v.norm();
    if s.largest() <= MIN_RELATIVE_DISTANCE * radius {
        return Err(Undefined::Ring);
    }
    let inverse = T::one() / s;
    let n = v * inverse;
    let b = e.cross(m);
    let t = n.cross(b);
    let around = (T::one() - T::constant(ring) / l) * inverse;
    Ok(Distance {
        value: s - T::constant(radius),
        normal: n,
        curvature: t.outer(t) * inverse + b.outer(b) * around,
        feature: Feature::Face,
    })
}

fn cuboid<T: Real>(d: Vec3<T>, axes: Mat3, half: [f64; 3]) -> Distance<T> {
    let axes = Mat3::constant(axes);
    let local = axes.transpose_mul(d);
    let signs = local.0.map(|component| if component.largest() < 0.0 { -1.0 } else { 1.0 });
    let mut excess = [T::zero(); 3];
    for i in 0..3 {
        excess[i] = local.0[i] * signs[i] - T::constant(half[i]);
    }
    let beyond = excess.map(|q| q.largest() > 0.0);
    match beyond.iter().filter(|&&is| is).count() {
        0 | 1 => face(&axes, &excess, &signs),
        2 => rounded(&axes, &excess, &signs, beyond, Feature::Edge),
        _ => rounded(&axes, &excess, &signs, beyond, Feature::Corner),
    }
}

/// The distance from the face of a box from which the point is farthest.
fn face<T: Real>(axes: &Mat3<T>, excess: &[T; 3], signs: &[f64; 3]) -> Distance<T> {
    let mut largest = 0;
    for i in 1..3 {
        if excess[i].largest() > excess[largest].largest() {
            largest = i;
        }
    }
    Distance {
        value: excess[largest],
        normal: axes.column(largest).scale(signs[largest]),
        curvature: Mat3::zero(),
        feature: Feature::Face,
    }
}

/// The distance from an edge or a corner of a box.
fn rounded<T: Real>(
    axes: &Mat3<T>,
    excess: &[T; 3],
    signs: &[f64; 3],
    beyond: [bool; 3],
    feature: Feature,
) -> Distance<T> {
    let mut v = Vec3::zero();
    let mut open = Mat3::zero();
    for i in 0..3 {
        if beyond[i] {
            v.0[i] = excess[i] * signs[i];
            open.0[i][i] = T::one();
        }
    }
    let l = v.norm();
    let inverse = T::one() / l;
    let n = v * inverse;
    let local = (open - n.outer(n)) * inverse;
    Distance { value: l, normal: *axes * n, curvature: *axes * local * axes.transpose(), feature }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::dual::{Random, jacobian, variables};
    use super::super::tube::{TubeEnds, TubeError};
    use super::*;

    /// A winding centre line with a varying radius.
    pub fn winding() -> (Vec<Vec3>, Vec<f64>) {
        let points = vec![
            Vec3([0.0, 0.0, 0.0]),
            Vec3([1.0, 0.2, 0.1]),
            Vec3([2.1, 0.9, 0.0]),
            Vec3([2.6, 1.9, 0.5]),
            Vec3([3.5, 2.4, 1.2]),
        ];
        (points, vec![0.5, 0.6, 0.55, 0.4, 0.45])
    }

    /// Surfaces of every kind, seen from outside.
    pub fn shapes() -> Vec<(&'static str, Shape)> {
        let mut random = Random(7);
        let (points, radii) = winding();
        let cone = |radii| Cone::new(Vec3([-0.4, 0.2, 0.1]), Vec3([0.7, 0.9, -0.5]), radii).map(Shape::Cone);
        vec![
            ("plane", Shape::Plane { point: random.vector(0.5), normal: random.direction() }),
            ("sphere", Shape::Sphere { centre: random.vector(0.5), radius: 0.7 }),
            ("cylinder", Shape::Cylinder { point: random.vector(0.5), axis: random.direction(), radius: 0.6 }),
            ("capsule", cone([0.4, 0.4]).unwrap()),
            ("cone", cone([0.8, 0.3]).unwrap()),
            ("widening cone", cone([0.2, 0.9]).unwrap()),
            ("torus", Shape::Torus { centre: random.vector(0.5), axis: random.direction(), ring: 1.1, radius: 0.3 }),
            ("box", Shape::Box { centre: random.vector(0.2), axes: random.rotation(3.0).r, half: [0.4, 0.6, 0.9] }),
            ("straight tube", Shape::Tube(Tube::straight(&points, &radii, TubeEnds::Round).unwrap())),
            ("smooth tube", Shape::Tube(Tube::smooth(&points, &radii, TubeEnds::Round).unwrap())),
        ]
    }

    /// The largest errors of n, H, |n| = 1 and H n = 0 at random points, and the number of points.
    fn errors(surface: &Surface, random: &mut Random, scatter: f64) -> ([f64; 4], usize) {
        let mut worst = [0.0f64; 4];
        let mut points = 0;
        while points < 500 {
            let y = random.vector(scatter) + Vec3([0.5, 0.5, 0.0]);
            let Ok(exact) = surface.distance(variables::<3>(y, 0)) else { continue };
            let here = surface.distance(y).unwrap();
            let size = 1.0 + here.curvature.max_abs();
            // Derivatives of unit vectors lose digits near an axis.
            if size > 20.0 {
                continue;
            }
            points += 1;
            let gradient = Vec3(exact.value.partials);
            let hessian = jacobian(exact.normal, 0);
            let errors = [
                (gradient - here.normal).max_abs() / size,
                (hessian - here.curvature).max_abs() / size,
                (here.normal.norm() - 1.0).abs(),
                (here.curvature * here.normal).max_abs() / size,
            ];
            for (worst, error) in worst.iter_mut().zip(errors) {
                *worst = worst.max(error);
            }
        }
        (worst, points)
    }

    #[test]
    fn normals_and_curvatures_are_derivatives() {
        let mut random = Random(11);
        for (name, shape) in shapes() {
            for side in [Side::Outside, Side::Inside] {
                let surface = Surface { shape: shape.clone(), side };
                let (worst, points) = errors(&surface, &mut random, 2.0);
                println!("{name} {side:?}: {worst:?} at {points} points");
                assert!(worst.iter().all(|&error| error < 1e-12), "{name} {side:?}: {worst:?}");
            }
        }
    }

    #[test]
    fn the_distance_leads_to_the_surface() {
        let mut random = Random(12);
        for (name, shape) in shapes() {
            let surface = Surface { shape, side: Side::Outside };
            for _ in 0..300 {
                let y = random.vector(2.0) + Vec3([0.5, 0.5, 0.0]);
                let Ok(here) = surface.distance(y) else { continue };
                if here.value < 0.0 {
                    continue;
                }
                let foot = surface.distance(y - here.normal * here.value).unwrap();
                assert!(foot.value.abs() < 1e-14, "{name}: {foot:?}");
                // phi is 1-Lipschitz: free space in a ball of its radius.
                let other = y + random.direction() * random.between(0.0, 2.0);
                if let Ok(there) = surface.distance(other) {
                    let change = (there.value - here.value).abs();
                    assert!(change <= (other - y).norm() + 1e-14, "{name}: {change}");
                }
            }
        }
    }

    #[test]
    fn points_without_a_normal_are_named() {
        let o = Vec3::ZERO;
        let e = Vec3::UNIT[2];
        let undefined = |shape: Shape, y: Vec3| Surface { shape, side: Side::Outside }.distance(y).unwrap_err();
        let capsule = || Shape::Cone(Cone::new(o, e, [0.2, 0.2]).unwrap());
        let torus = Shape::Torus { centre: o, axis: e, ring: 2.0, radius: 0.5 };
        let line = [o, e, e * 2.0];
        let smooth = |ends| Shape::Tube(Tube::smooth(&line, &[0.2; 3], ends).unwrap());
        let straight = |ends| Shape::Tube(Tube::straight(&line, &[0.2; 3], ends).unwrap());
        assert_eq!(undefined(Shape::Sphere { centre: o, radius: 1.0 }, o), Undefined::Centre);
        assert_eq!(undefined(Shape::Cylinder { point: o, axis: e, radius: 1.0 }, e), Undefined::Axis);
        assert_eq!(undefined(capsule(), e), Undefined::Centre);
        assert_eq!(undefined(capsule(), e * 0.5), Undefined::Axis);
        assert_eq!(undefined(torus, Vec3([2.0, 0.0, 0.0])), Undefined::Ring);
        for ends in [TubeEnds::Open, TubeEnds::Round] {
            assert_eq!(undefined(smooth(ends), e * 0.7), Undefined::Axis);
            assert_eq!(undefined(straight(ends), e * 0.7), Undefined::Axis);
        }
        for beyond in [-0.1, 2.1] {
            assert_eq!(undefined(smooth(TubeEnds::Open), Vec3([0.1, 0.0, beyond])), Undefined::BeyondEnd);
            assert_eq!(undefined(straight(TubeEnds::Open), Vec3([0.1, 0.0, beyond])), Undefined::BeyondEnd);
        }
    }

    /// Surfaces with a hole around the z axis, or around a ring, each with a point of the middle of its hole.
    fn holes() -> Vec<(Surface, Vec3)> {
        let (o, e) = (Vec3::ZERO, Vec3::UNIT[2]);
        let (line, radii) = ([o, e, e * 2.0], [0.5, 0.4, 0.2]);
        let torus = || Shape::Torus { centre: o, axis: e, ring: 2.0, radius: 0.5 };
        let inside = [
            (Shape::Sphere { centre: o, radius: 0.7 }, o),
            (Shape::Cylinder { point: o, axis: e, radius: 0.6 }, e),
            (Shape::Cone(Cone::new(o, e * 2.0, [0.6, 0.3]).unwrap()), e),
            (torus(), Vec3([2.0, 0.0, 0.0])),
            (Shape::Tube(Tube::straight(&line, &radii, TubeEnds::Open).unwrap()), e * 1.3),
            (Shape::Tube(Tube::smooth(&line, &radii, TubeEnds::Open).unwrap()), e * 1.3),
        ];
        let inside = inside.map(|(shape, at)| (Surface { shape, side: Side::Inside }, at));
        let ring = Surface { shape: torus(), side: Side::Outside };
        inside.into_iter().chain([(ring.clone(), o), (ring, e)]).collect()
    }

    /// In the middle of holes the distance has two continuous derivatives, and the normal no direction across the axis.
    #[test]
    fn distances_are_rounded_off_in_the_middle_of_holes() {
        let mut random = Random(31);
        for (surface, middle) in holes() {
            let at_middle = surface.distance(middle).unwrap();
            let across = Vec3([at_middle.normal.0[0], at_middle.normal.0[1], 0.0]).norm();
            assert!(across < 1e-12 && at_middle.normal.norm() < 0.5, "{surface:?} {at_middle:?}");
            for _ in 0..200 {
                let y = middle + random.vector(2e-4);
                let (exact, here) = (surface.distance(variables::<3>(y, 0)).unwrap(), surface.distance(y).unwrap());
                let size = here.curvature.max_abs();
                assert!((Vec3(exact.value.partials) - here.normal).max_abs() < 1e-10, "{surface:?} {here:?}");
                let error = (jacobian(exact.normal, 0) - here.curvature).max_abs();
                assert!(error < 1e-9 * size, "{surface:?} {error:e} of {size:e}");
            }
            // Across the border of what is rounded off.
            for border in [0.2, 0.3, 0.5, 0.6, 0.7, 1.5].map(|radius| 1e-4 * radius) {
                let at = |x: f64| surface.distance(middle + Vec3([border * x, 0.0, 0.0])).unwrap();
                let (before, after) = (at(1.0 - 1e-6), at(1.0 + 1e-6));
                assert!((before.value - after.value).abs() < 1e-9 && (before.normal - after.normal).max_abs() < 1e-4);
            }
        }
    }

    #[test]
    fn parts_of_a_box_are_named() {
        let shape = Shape::Box { centre: Vec3::ZERO, axes: Mat3::IDENTITY, half: [1.0, 2.0, 3.0] };
        let surface = Surface { shape, side: Side::Outside };
        let at = |y| surface.distance(Vec3(y)).unwrap();
        assert_eq!(at([0.0, 0.5, 0.2]).feature, Feature::Face);
        assert_eq!(at([0.0, 0.0, 0.0]).value, -1.0);
        assert_eq!(at([-1.5, 0.5, 0.2]).normal, Vec3([-1.0, 0.0, 0.0]));
        assert_eq!(at([4.0, 6.0, 0.0]).feature, Feature::Edge);
        assert_eq!(at([4.0, 6.0, 0.0]).value, 5.0);
        assert_eq!(at([2.0, 3.0, 4.0]).feature, Feature::Corner);
    }

    #[test]
    fn a_tube_of_one_straight_piece_is_a_cone() {
        let ends = [Vec3([-0.4, 0.2, 0.1]), Vec3([0.7, 0.9, -0.5])];
        let radii = [0.5, 0.3];
        let tube = |tube| Surface { shape: Shape::Tube(tube), side: Side::Inside };
        let smooth = tube(Tube::smooth(&ends, &radii, TubeEnds::Round).unwrap());
        let straight = tube(Tube::straight(&ends, &radii, TubeEnds::Round).unwrap());
        let mut random = Random(13);
        for _ in 0..300 {
            let y = random.vector(1.0);
            let (a, b) = (smooth.distance(y).unwrap(), straight.distance(y).unwrap());
            assert!((a.value - b.value).abs() < 1e-14);
            assert!((a.normal - b.normal).max_abs() < 1e-14);
            let size = 1.0 + b.curvature.max_abs();
            assert!((a.curvature - b.curvature).max_abs() < 1e-13 * size * size);
        }
    }

    #[test]
    fn splines_have_continuous_curvature() {
        let (points, radii) = winding();
        let shape = Shape::Tube(Tube::smooth(&points, &radii, TubeEnds::Round).unwrap());
        let surface = Surface { shape, side: Side::Inside };
        // Near the third point, on both sides of the border of pieces.
        let at = |shift: f64| surface.distance(points[2] + Vec3([0.1 + shift, -0.1 + shift, 0.2])).unwrap();
        let steps = (-50..50).map(|k| f64::from(k) * 2e-3);
        for shift in steps {
            let change = (at(shift + 1e-7).curvature - at(shift).curvature).max_abs();
            assert!(change < 1e-4, "{shift}: {change}");
        }
    }

    #[test]
    fn impossible_tubes_are_refused() {
        let o = Vec3::ZERO;
        let e = Vec3::UNIT[0];
        let smooth = |points: &[Vec3], radii: &[f64]| Tube::smooth(points, radii, TubeEnds::Open).unwrap_err();
        assert_eq!(smooth(&[o], &[1.0]), TubeError::Points);
        assert_eq!(smooth(&[o, e], &[1.0]), TubeError::Points);
        assert_eq!(smooth(&[o, e, e], &[1.0; 3]), TubeError::Repeated(2));
        assert_eq!(smooth(&[o, e], &[1.0, 0.0]), TubeError::Radius(1));
        assert_eq!(smooth(&[o, e], &[1.0, f64::NAN]), TubeError::Radius(1));
        assert_eq!(smooth(&[o, e], &[0.1, 2.0]), TubeError::Steep(0));
        assert_eq!(Tube::straight(&[o, e], &[0.1, 2.0], TubeEnds::Open).unwrap_err(), TubeError::Steep(0));
        let bend = [o, e, e + Vec3::UNIT[1]];
        assert!(matches!(smooth(&bend, &[2.0; 3]), TubeError::Curved(_)));
    }
}
