//! Planar scenes: scenes that are their own mirror images in a plane.
//!
//! A structure that lies in a plane and is loaded in it moves in it, since a motion out of the
//! plane would have to choose a side. Displacements then have two components, and rotation vectors
//! are parallel to the normal of the plane.

use crate::tensor::{Mat3, Vec3};
use std::fmt;

/// Largest distance from a plane, relative to the size of the scene or to the length of the vector,
/// of what counts as lying in it: some hundreds of units in the last place, the round-off of sines,
/// cosines and a few sums in a deck.
const PLANE_ROUND_OFF: f64 = 1e-13;

/// A normal is replaced by a global axis if the norm of their difference is smaller than this, so
/// that vectors in coordinate planes have exact zeros. The scene is checked against the resulting
/// plane afterwards.
const AXIS_SNAP_DISTANCE: f64 = 1e-12;

/// Two directions determine a plane only if their cross product exceeds this part of the squared
/// length of the longer one: below, the normal would have fewer than ten correct digits.
const MIN_CROSS_PRODUCT_RATIO: f64 = 1e-6;

/// A datum of a scene, with its behaviour under reflection in a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MirrorData {
    /// Position
    Place(Vec3),
    /// Displacement, velocity or force
    Vector(Vec3),
    /// Axial vector: rotation, spin or moment
    Axial(Vec3),
    /// Axis without sense
    Line(Vec3),
    /// Tensor that maps vectors to vectors, or axial vectors to axial vectors
    Tensor(Mat3),
    /// Tensor that maps axial vectors to vectors
    Coupling(Mat3),
    /// Datum of an effect that has no planar kernel
    Spatial,
}

impl fmt::Display for MirrorData {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (what, v) = match self {
            Self::Place(v) => ("the place", v),
            Self::Vector(v) => ("the vector", v),
            Self::Axial(v) => ("the rotation or moment about", v),
            Self::Line(v) => ("the axis", v),
            Self::Tensor(_) => {
                return f.write_str(
                    "a stiffness, an inertia or a support whose axes are neither in the plane nor normal to it",
                );
            }
            Self::Coupling(_) => {
                return f.write_str(
                    "a section that couples strain in the plane with torsion or with bending out of the plane",
                );
            }
            Self::Spatial => return f.write_str("an effect without a planar form"),
        };
        write!(f, "{what} {}", rounded(*v))
    }
}

/// A vector in six significant digits, for messages, without negative zeros.
pub fn rounded(v: Vec3) -> String {
    let rounded = |component: f64| format!("{component:.5e}").parse().unwrap_or(component) + 0.0;
    format!("{:?}", v.0.map(rounded))
}

/// Visits the data of a scene: calls its argument with the name of the owner and each datum.
pub type Shown<'a> = dyn Fn(&mut dyn FnMut(&'static str, MirrorData)) + 'a;

/// A plane through an unspecified point, by its normal and two axes in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    axes: Mat3,
}

impl Plane {
    /// Plane with the given normal, of any length; `None` for the zero vector. The normal of the
    /// plane has a positive largest component.
    pub fn normal_to(normal: Vec3) -> Option<Self> {
        let mut e = normal.normalized()?;
        let nearest = (0..3).fold(0, |best, k| if e.0[k].abs() > e.0[best].abs() { k } else { best });
        if e.0[nearest] < 0.0 {
            e = -e;
        }
        if (e - Vec3::UNIT[nearest]).norm() < AXIS_SNAP_DISTANCE {
            let [x, y, z] = Vec3::UNIT;
            let [a, b] = [[y, z], [z, x], [x, y]][nearest];
            return Some(Self { axes: Mat3::from_columns(a, b, Vec3::UNIT[nearest]) });
        }
        let aside = Vec3::UNIT[(nearest + 1) % 3];
        let a = (aside - e * e.dot(aside)).normalized()?;
        Some(Self { axes: Mat3::from_columns(a, e.cross(a), e) })
    }

    /// Two orthonormal axes in the plane and its normal, as columns (global components).
    #[inline]
    pub fn axes(&self) -> &Mat3 {
        &self.axes
    }

    /// Unit normal (global components).
    pub fn normal(&self) -> Vec3 {
        self.axes.column(2)
    }

    /// True if the three axes are the global ones.
    pub fn is_global(&self) -> bool {
        self.axes == Mat3::IDENTITY
    }

    /// True if the normal is not a global axis, so that vectors in the plane have round-off out of
    /// it.
    pub fn is_tilted(&self) -> bool {
        !Vec3::UNIT.contains(&self.normal())
    }

    /// True if a vector is normal to the plane, up to `PLANE_ROUND_OFF` times its length.
    pub fn is_normal(&self, v: Vec3) -> bool {
        let e = self.normal();
        (v - e * v.dot(e)).norm() <= PLANE_ROUND_OFF * v.norm()
    }

    /// True if a vector lies in the plane, up to `PLANE_ROUND_OFF` times its length.
    pub fn is_along(&self, v: Vec3) -> bool {
        v.dot(self.normal()).abs() <= PLANE_ROUND_OFF * v.norm()
    }

    /// True if a datum is its own mirror image. Positions are compared with `origin`, a point of
    /// the plane, in a scene of the given length.
    fn mirrors(&self, aspect: &MirrorData, origin: Vec3, length: f64) -> bool {
        let e = self.normal();
        // A tensor is symmetric under reflection if it maps the normal to a multiple of itself, and
        // so does its transpose.
        let across = |m: Mat3| {
            let left = m.transpose_mul(e);
            let right = m * e;
            let along = e * e.dot(right);
            (left - along).norm().max((right - along).norm())
        };
        match *aspect {
            MirrorData::Place(x) => (x - origin).dot(e).abs() <= PLANE_ROUND_OFF * length.max(x.norm()),
            MirrorData::Vector(v) => self.is_along(v),
            MirrorData::Axial(v) => self.is_normal(v),
            MirrorData::Line(v) => self.is_along(v) || self.is_normal(v),
            MirrorData::Tensor(m) => across(m) <= PLANE_ROUND_OFF * m.max_abs(),
            // A coupling is symmetric under reflection if it maps the normal (axial) into the
            // plane, and axial vectors in the plane to the normal.
            MirrorData::Coupling(m) => {
                let right = m * e;
                let left = m.transpose_mul(e);
                let along = right.dot(e);
                let rest = m - right.outer(e) - e.outer(left) + e.outer(e).scale(along);
                rest.max_abs().max(along.abs()) <= PLANE_ROUND_OFF * m.max_abs()
            }
            MirrorData::Spatial => false,
        }
    }

    /// Plane of a scene of the given length whose data are visited by `shown`. `Err`: the reason
    /// why the scene is spatial.
    pub fn of(length: f64, shown: &Shown) -> Result<Self, String> {
        let search = PlaneSearch::through(length, shown);
        if let Some(name) = search.spatial {
            return Err(format!("{name} has no planar form"));
        }
        let mut apart = None;
        for plane in search.normals().filter_map(Self::normal_to) {
            match search.first_apart(&plane, shown) {
                None => return Ok(plane),
                // The error names the datum that contradicts the last candidate.
                found => apart = found,
            }
        }
        match apart {
            None => Err("the plane is undefined: all points and loads lie on one line".into()),
            Some((name, aspect)) => Err(format!("{name}: {aspect} does not fit the plane of the rest of the scene")),
        }
    }
}

/// Quantities collected from the data of a scene to find candidate normals.
#[derive(Default)]
struct PlaneSearch {
    origin: Option<Vec3>,
    /// Span of positions relative to the origin
    places: VectorSpan,
    /// Span of relative positions and of vectors scaled to the length of the scene
    vectors: VectorSpan,
    axial: Option<Vec3>,
    spatial: Option<&'static str>,
    length: f64,
}

/// Plane spanned by some vectors.
#[derive(Default)]
struct VectorSpan {
    longest: Vec3,
    /// Cross product of largest norm of the longest vector with another
    product: Vec3,
}

impl VectorSpan {
    fn measure(&mut self, v: Vec3) {
        if v.norm() > self.longest.norm() {
            self.longest = v;
        }
    }

    fn turn(&mut self, v: Vec3) {
        let product = self.longest.cross(v);
        if product.norm() > self.product.norm() {
            self.product = product;
        }
    }

    /// Normal, of any length; `None` if the vectors are nearly parallel.
    fn normal(&self) -> Option<Vec3> {
        let tells = self.product.norm() > MIN_CROSS_PRODUCT_RATIO * self.longest.squared().max(f64::MIN_POSITIVE);
        tells.then_some(self.product)
    }
}

impl PlaneSearch {
    fn through(length: f64, shown: &Shown) -> Self {
        let mut search = Self { length, ..Self::default() };
        shown(&mut |name, aspect| search.look(name, &aspect));
        shown(&mut |_, aspect| search.each_span(&aspect, VectorSpan::turn));
        search
    }

    fn each_span(&mut self, aspect: &MirrorData, show: impl Fn(&mut VectorSpan, Vec3)) {
        let Some(v) = self.vector(aspect) else { return };
        if matches!(aspect, MirrorData::Place(_)) {
            show(&mut self.places, v);
        }
        show(&mut self.vectors, v);
    }

    fn look(&mut self, name: &'static str, aspect: &MirrorData) {
        match *aspect {
            MirrorData::Place(x) => _ = self.origin.get_or_insert(x),
            MirrorData::Axial(v) if v != Vec3::ZERO && self.axial.is_none() => self.axial = Some(v),
            MirrorData::Spatial if self.spatial.is_none() => self.spatial = Some(name),
            MirrorData::Vector(_)
            | MirrorData::Axial(_)
            | MirrorData::Line(_)
            | MirrorData::Tensor(_)
            | MirrorData::Coupling(_)
            | MirrorData::Spatial => {}
        }
        self.each_span(aspect, VectorSpan::measure);
    }

    fn vector(&self, aspect: &MirrorData) -> Option<Vec3> {
        match *aspect {
            MirrorData::Place(x) => self.origin.map(|origin| x - origin),
            MirrorData::Vector(v) => v.normalized().map(|v| v * self.length),
            MirrorData::Axial(_)
            | MirrorData::Line(_)
            | MirrorData::Tensor(_)
            | MirrorData::Coupling(_)
            | MirrorData::Spatial => None,
        }
    }

    /// Candidate normals: the first axial vector, which is free of round-off; the normal of
    /// positions and vectors, as shallow arches determine theirs to a few digits only; and that of
    /// positions, which tells whether structure or load is out of plane.
    fn normals(&self) -> impl Iterator<Item = Vec3> {
        [self.axial, self.vectors.normal(), self.places.normal()].into_iter().flatten()
    }

    /// The first datum that is not its own mirror image in a plane, with the name of its owner.
    fn first_apart(&self, plane: &Plane, shown: &Shown) -> Option<(&'static str, MirrorData)> {
        let mut apart = None;
        shown(&mut |name, aspect| {
            if apart.is_none() && !plane.mirrors(&aspect, self.origin.unwrap_or(Vec3::ZERO), self.length) {
                apart = Some((name, aspect));
            }
        });
        apart
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TILTED: Vec3 = Vec3([0.36, 0.48, 0.8]);

    fn plane_of(parts: &[MirrorData]) -> Result<Plane, String> {
        Plane::of(1.0, &|show| parts.iter().for_each(|&aspect| show("part", aspect)))
    }

    #[test]
    fn axes_are_right_handed_and_coordinate_planes_exact() {
        for normal in [Vec3::UNIT[0], Vec3::UNIT[1], Vec3::UNIT[2] * -3.0, TILTED, Vec3([1.0, 1e-9, 0.0])] {
            let plane = Plane::normal_to(normal).unwrap();
            let [a, b, e] = [0, 1, 2].map(|k| plane.axes().column(k));
            assert!((a.cross(b) - e).norm() < 1e-15 && plane.is_normal(normal));
        }
        assert!(Plane::normal_to(Vec3([1e-14, 0.0, -2.0])).unwrap().is_global());
    }

    #[test]
    fn loads_turn_a_line_into_a_plane() {
        let line = [MirrorData::Place(Vec3::ZERO), MirrorData::Place(Vec3::UNIT[0])];
        assert!(plane_of(&line).unwrap_err().contains("one line"));
        let with = |aspect| plane_of(&[line[0], line[1], aspect]);
        assert_eq!(with(MirrorData::Vector(Vec3::UNIT[1])).unwrap().normal(), Vec3::UNIT[2]);
        assert_eq!(with(MirrorData::Axial(Vec3::UNIT[1] * -1.0)).unwrap().normal(), Vec3::UNIT[1]);
        assert!(with(MirrorData::Axial(Vec3::UNIT[0])).is_err(), "torsion leaves every plane");
        let apart = plane_of(&[
            line[0],
            line[1],
            MirrorData::Vector(Vec3::UNIT[1]),
            MirrorData::Vector(Vec3([0.0, 1.0, -0.5])),
        ]);
        assert_eq!(
            apart.unwrap_err(),
            "part: the vector [0.0, 1.0, -0.5] does not fit the plane of the rest of the scene"
        );
    }

    /// Positions alone would determine the normal of a shallow arch to a few digits only.
    #[test]
    fn shallow_scenes_lie_in_the_plane_of_their_loads() {
        let plane = Plane::normal_to(TILTED).unwrap();
        let [a, b, e] = [0, 1, 2].map(|k| plane.axes().column(k));
        let arch = |k: i32| {
            let x = f64::from(k) / 20.0;
            MirrorData::Place(a * x + b * (1e-4 * x * (1.0 - x)) + e * (1e-16 * f64::from(k % 3 - 1)))
        };
        let places: Vec<MirrorData> = (0..=20).map(arch).collect();
        for load in [MirrorData::Vector(b * -3.0), MirrorData::Vector(a + b), MirrorData::Axial(e * 2.0)] {
            let found = plane_of(&[&places[..], &[load]].concat()).unwrap();
            assert!((found.normal() - e).norm() < 1e-13 || (found.normal() + e).norm() < 1e-13);
        }
    }

    /// The error names a load out of the plane of the structure, not the structure.
    #[test]
    fn what_leaves_the_plane_of_places_is_named() {
        let places = [Vec3::ZERO, Vec3::UNIT[0], Vec3([1.0, 1.0, 0.0])];
        let aside = Plane::of(1.0, &|show| {
            places.iter().for_each(|&place| show("beams", MirrorData::Place(place)));
            show("load", MirrorData::Vector(Vec3([3.0, -8.0, 1.0])));
        });
        assert!(aside.unwrap_err().starts_with("load:"));
    }

    #[test]
    fn what_stands_aside_by_more_than_round_off_makes_a_scene_spatial() {
        let plane = Plane::normal_to(TILTED).unwrap();
        let [a, b, e] = [0, 1, 2].map(|k| plane.axes().column(k));
        let base = [MirrorData::Place(a), MirrorData::Place(b * 0.5), MirrorData::Vector(a + b)];
        let with = |aspect| plane_of(&[&base[..], &[aspect]].concat());
        let fits = |aspect| with(aspect).is_ok_and(|found| (found.normal() - e).norm() < 1e-13);
        assert!(fits(MirrorData::Place(a * 3.0 + e * 1e-16)) && !fits(MirrorData::Place(a * 3.0 + e * 1e-11)));
        assert!(fits(MirrorData::Line(e)) && fits(MirrorData::Line(a)) && !fits(MirrorData::Line(a + e)));
        assert!(fits(MirrorData::Axial(e)) && !fits(MirrorData::Axial(e + a * 1e-9)));
        let section = a.outer(a) + b.outer(b).scale(3.0) + a.outer(b) + b.outer(a) + e.outer(e).scale(7.0);
        assert!(fits(MirrorData::Tensor(section)) && !fits(MirrorData::Tensor(section + a.outer(e).scale(1e-9))));
        assert!(fits(MirrorData::Coupling(a.outer(e))) && fits(MirrorData::Coupling(e.outer(a) + b.outer(e))));
        assert!(
            !fits(MirrorData::Coupling(e.outer(e)))
                && !fits(MirrorData::Coupling(a.outer(b)))
                && !fits(MirrorData::Spatial)
        );
    }
}
