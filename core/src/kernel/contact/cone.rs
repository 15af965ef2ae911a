//! The hull of two spheres: a capsule if their radii are equal, otherwise a cone with round ends.
//! The formulas are those of [`super::surface`].

use super::distance::{Distance, Feature, MIN_RELATIVE_DISTANCE, RoundedLength, Undefined, sphere};
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// A line segment with the spheres at its ends whose hull is a capsule (equal radii) or a cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    from: Vec3,
    /// Unit vector from the first to the second end
    axis: Vec3,
    length: f64,
    /// Radii at the first and the second end
    radii: [f64; 2],
    /// k = (Ra - Rb)/L, the component of the normal along the axis
    tilt: f64,
    /// c = sqrt(1 - k^2), the component of the normal across the axis
    across: f64,
}

impl Cone {
    /// The hull of the spheres with radii `radii` at `from` and `to`; `None` if one of them
    /// contains the other.
    pub fn new(from: Vec3, to: Vec3, radii: [f64; 2]) -> Option<Self> {
        let axis = (to - from).normalized()?;
        let length = (to - from).norm();
        let tilt = (radii[0] - radii[1]) / length;
        let across = (1.0 - tilt * tilt).sqrt();
        (tilt.abs() < 1.0 && across > 0.0).then_some(Self { from, axis, length, radii, tilt, across })
    }

    /// The distance from the hull, outside of it. `blunt`: see [`RoundedLength`].
    pub(super) fn distance<T: Real>(&self, y: Vec3<T>, blunt: f64) -> Result<Distance<T>, Undefined> {
        let e = Vec3::constant(self.axis);
        let d = y - Vec3::constant(self.from);
        let z = e.dot(d);
        let q = d - e * z;
        let l = q.norm();
        let s = z.largest() - l.largest() * (self.tilt / self.across);
        if s <= 0.0 {
            return sphere(d, self.radii[0], blunt);
        }
        if s >= self.length {
            return sphere(d - e * T::constant(self.length), self.radii[1], blunt);
        }
        if let Some(rounded) = RoundedLength::of(q, blunt) {
            return Ok(Distance {
                value: rounded.value * self.across + z * self.tilt - T::constant(self.radii[0]),
                normal: q * (rounded.slope * self.across) + e.scale(self.tilt),
                curvature: rounded.hessian(q, Mat3::identity() - e.outer(e)).scale(self.across),
                feature: Feature::Face,
            });
        }
        if l.largest() <= MIN_RELATIVE_DISTANCE * self.radii[0].max(self.radii[1]) {
            return Err(Undefined::Axis);
        }
        let inverse = T::one() / l;
        let m = q * inverse;
        let t = e.cross(m);
        Ok(Distance {
            value: l * self.across + z * self.tilt - T::constant(self.radii[0]),
            normal: m.scale(self.across) + e.scale(self.tilt),
            curvature: t.outer(t) * (inverse * self.across),
            feature: Feature::Face,
        })
    }

    /// The centres of the spheres at both ends.
    pub fn ends(&self) -> [Vec3; 2] {
        [self.from, self.from + self.axis * self.length]
    }

    /// The direction from the first to the second end.
    pub(super) fn axis(&self) -> Vec3 {
        self.axis
    }

    /// The component of the normal of its side along the axis.
    pub(super) fn tilt(&self) -> f64 {
        self.tilt
    }

    /// The radii at both ends.
    pub(super) fn radii(&self) -> [f64; 2] {
        self.radii
    }

    /// The smaller one of the radii.
    pub fn least_radius(&self) -> f64 {
        self.radii[0].min(self.radii[1])
    }

    /// True if the plane through the first end, normal to the axis, has the point behind it.
    pub(super) fn is_before(&self, y: Vec3) -> bool {
        self.axis.dot(y - self.from) < 0.0
    }

    /// True if the point is beyond the plane through the second end, normal to the axis.
    pub(super) fn is_after(&self, y: Vec3) -> bool {
        self.axis.dot(y - self.from) > self.length
    }

    /// A lower bound of the distance from the hull, outside of it: that of a sphere around it.
    pub(super) fn lower_bound(&self, y: Vec3) -> f64 {
        let middle = self.from + self.axis * (0.5 * self.length);
        (y - middle).norm() - 0.5 * self.length - self.radii[0].max(self.radii[1])
    }
}
