//! The signed distance of a point from a rigid surface, with its first two derivatives.

use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// Points nearer to a centre or an axis than this part of the radius have no normal: round-off of
/// its direction would exceed 1e-7 rad.
pub(super) const MIN_RELATIVE_DISTANCE: f64 = 1e-9;

/// The side of a surface on which beams are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Beams are outside of the body
    Outside,
    /// Beams are inside, as a wire in a tube
    Inside,
}

/// The part of a surface that is closest to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// A face or a lateral surface
    Face,
    /// An edge of a box
    Edge,
    /// A corner of a box
    Corner,
    /// The spherical end of a capsule, a cone or a closed tube
    End,
}

/// Reasons for which a point has no distance with a normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Undefined {
    /// The point is the centre of a sphere or of a spherical end
    Centre,
    /// The point lies on the axis of a cylinder, a capsule, a cone or a torus, or on the centre
    /// line of a tube
    Axis,
    /// The point lies on the centre line of the ring of a torus
    Ring,
    /// The point lies beyond an open end of a tube: nothing is there to touch
    BeyondEnd,
    /// The point is farther from the centre line of a tube than the line's radius of curvature: its
    /// closest point is not unique
    NotUnique,
}

/// The signed distance of a point from a surface.
#[derive(Clone, Copy, Debug)]
pub struct Distance<T = f64> {
    /// phi, a length, positive in free space
    pub(crate) value: T,
    /// n, the gradient of phi, a unit vector into free space, in the axes of the carrier
    pub(crate) normal: Vec3<T>,
    /// H, the Hessian of phi, one over length, in the axes of the carrier
    pub(super) curvature: Mat3<T>,
    /// The closest part of the surface
    pub(super) feature: Feature,
}

impl<T: Real> Distance<T> {
    /// The distance from the other side.
    pub(super) fn reversed(self) -> Self {
        Self { value: -self.value, normal: -self.normal, curvature: -self.curvature, ..self }
    }
}

/// The distance from a sphere, for the place `d` of the point from its centre.
pub(super) fn sphere<T: Real>(d: Vec3<T>, radius: f64) -> Result<Distance<T>, Undefined> {
    let l = d.norm();
    if l.largest() <= MIN_RELATIVE_DISTANCE * radius {
        return Err(Undefined::Centre);
    }
    let inverse = T::one() / l;
    let n = d * inverse;
    Ok(Distance {
        value: l - T::constant(radius),
        normal: n,
        curvature: (Mat3::identity() - n.outer(n)) * inverse,
        feature: Feature::End,
    })
}

/// The distance of the point `y` from a plane.
pub(super) fn plane<T: Real>(y: Vec3<T>, point: Vec3, normal: Vec3) -> Distance<T> {
    let normal = Vec3::constant(normal);
    let value = normal.dot(y - Vec3::constant(point));
    Distance { value, normal, curvature: Mat3::zero(), feature: Feature::Face }
}

/// The distance from a cylinder, for the place `d` of the point from a point of its axis.
pub(super) fn cylinder<T: Real>(d: Vec3<T>, axis: Vec3, radius: f64) -> Result<Distance<T>, Undefined> {
    let e = Vec3::constant(axis);
    let q = d - e * e.dot(d);
    let l = q.norm();
    if l.largest() <= MIN_RELATIVE_DISTANCE * radius {
        return Err(Undefined::Axis);
    }
    let inverse = T::one() / l;
    let n = q * inverse;
    let t = e.cross(n);
    Ok(Distance { value: l - T::constant(radius), normal: n, curvature: t.outer(t) * inverse, feature: Feature::Face })
}
