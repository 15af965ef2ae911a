//! The signed distance of a point from a rigid surface, with its first two derivatives.

use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// Points nearer to a centre or an axis than this part of the radius have no normal: round-off of
/// its direction would exceed 1e-7 rad.
pub(super) const MIN_RELATIVE_DISTANCE: f64 = 1e-9;

/// Inside of a round wall, and in the hole of a ring, the distance from the axis is rounded off over this part of the
/// radius: what fills the hole touches all round, and the mean of the normals there has a component along the axis
/// alone. Without it no force would hold what is pushed into a funnel along its axis. With a tenth of it 1 of 24
/// balls beside the axis of a funnel does not converge.
const BLUNT: f64 = 1e-4;

/// The side of a surface on which beams are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Beams are outside of the body
    Outside,
    /// Beams are inside, as a wire in a tube
    Inside,
}

/// Where distances from an axis are rounded off, see [`RoundedLength`]: up to a part of the radius of the wall or hole.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rounding {
    /// Inside of a wall
    pub(super) inside: f64,
    /// In the hole of a ring
    pub(super) hole: f64,
}

impl Rounding {
    /// Distances are exact, and have no normal in the middle.
    pub(super) const NONE: Self = Self { inside: 0.0, hole: 0.0 };

    /// Beams are on this side.
    pub(super) fn of(side: Side) -> Self {
        match side {
            Side::Outside => Self { hole: BLUNT, ..Self::NONE },
            Side::Inside => Self { inside: BLUNT, ..Self::NONE },
        }
    }
}

/// The length l of a vector v that is rounded off near zero, with its derivatives:
///
/// ```text
/// h = b (3/8 + 3/4 x^2 - 1/8 x^4),  x = l/b <= 1;   dh = s v.dv,   d2h = s dv.dv + k (v.dv)^2
/// ```
///
/// h, its slope and its second derivative are those of l at x = 1.
pub(super) struct RoundedLength<T> {
    /// h
    pub(super) value: T,
    /// s
    pub(super) slope: T,
    /// k
    pub(super) bend: T,
}

impl<T: Real> RoundedLength<T> {
    /// `None` for vectors as long as `blunt`, the b of the formula, and longer ones.
    pub(super) fn of(vector: Vec3<T>, blunt: f64) -> Option<Self> {
        if blunt == 0.0 {
            return None;
        }
        let square = vector.squared();
        (square.largest() < blunt * blunt).then(|| {
            let square = square * (1.0 / (blunt * blunt));
            Self {
                value: (square * (T::constant(0.75) - square * 0.125) + T::constant(0.375)) * blunt,
                slope: (T::constant(1.5) - square * 0.5) * (1.0 / blunt),
                bend: T::constant(-1.0 / (blunt * blunt * blunt)),
            }
        })
    }

    /// The Hessian of h for a vector `of` in the space that `projector` projects on.
    pub(super) fn hessian(&self, of: Vec3<T>, projector: Mat3<T>) -> Mat3<T> {
        projector * self.slope + of.outer(of) * self.bend
    }
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

/// Reasons for which a point has no distance with a normal. In the middle of holes it has one, since the distance from
/// the axis is rounded off there.
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
    /// n, the gradient of phi, into free space, in the axes of the carrier; a unit vector, but shorter near the axis of a
    /// hole, where the distance from it is rounded off
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

/// The distance from a sphere, for the place `d` of the point from its centre. `blunt`: see [`RoundedLength`].
pub(super) fn sphere<T: Real>(d: Vec3<T>, radius: f64, blunt: f64) -> Result<Distance<T>, Undefined> {
    if let Some(rounded) = RoundedLength::of(d, blunt) {
        return Ok(Distance {
            value: rounded.value - T::constant(radius),
            normal: d * rounded.slope,
            curvature: rounded.hessian(d, Mat3::identity()),
            feature: Feature::End,
        });
    }
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

/// The distance from a cylinder, for the place `d` of the point from a point of its axis. `blunt`: see [`RoundedLength`].
pub(super) fn cylinder<T: Real>(d: Vec3<T>, axis: Vec3, radius: f64, blunt: f64) -> Result<Distance<T>, Undefined> {
    let e = Vec3::constant(axis);
    let q = d - e * e.dot(d);
    if let Some(rounded) = RoundedLength::of(q, blunt) {
        return Ok(Distance {
            value: rounded.value - T::constant(radius),
            normal: q * rounded.slope,
            curvature: rounded.hessian(q, Mat3::identity() - e.outer(e)),
            feature: Feature::Face,
        });
    }
    let l = q.norm();
    if l.largest() <= MIN_RELATIVE_DISTANCE * radius {
        return Err(Undefined::Axis);
    }
    let inverse = T::one() / l;
    let n = q * inverse;
    let t = e.cross(n);
    Ok(Distance { value: l - T::constant(radius), normal: n, curvature: t.outer(t) * inverse, feature: Feature::Face })
}
