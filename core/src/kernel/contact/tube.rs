//! Tubes: the points within a radius R of a centre line c, both along straight pieces or along a
//! natural cubic spline, which has continuous second derivatives.
//!
//! Straight pieces are a union of cones: the smallest distance counts. Along a spline, with l =
//! |y-c(u)|, the distance is the least F = l - R(u):
//!
//! ```text
//! F_u  = -(y-c).c'/l - R' = 0
//! F_uu = (|c'|^2 - (y-c).c'')/l - ((y-c).c')^2/l^3 - R''  > 0
//! phi = F,   n = (y-c)/l,   H = (I-nn)/l - aa/F_uu,   a = F_uy = -(c' - n(n.c'))/l
//! ```
//!
//! All of the centre line is searched (pieces beyond reach of the nearest point so far are passed
//! over), so that the distance is a function of the point alone.

use super::cone::Cone;
use super::distance::{Distance, Feature, MIN_RELATIVE_DISTANCE, RoundedLength, Rounding, Undefined, sphere};
use super::minimum::{Slopes, interior_minima};
use crate::kernel::spline::cubics;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// Intervals of a spline's piece that are searched for a closest point.
const INTERVALS: usize = 4;

/// Points of a spline's piece at which radius and curvature are examined.
const EXAMINED: usize = 16;

/// The ends of a tube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TubeEnds {
    /// Nothing is beyond the ends: wires enter and leave
    Open,
    /// Half spheres of the radius at the ends
    Round,
}

/// Reasons for which there is no tube along a centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TubeError {
    /// Fewer than two points, or not a radius for each
    Points,
    /// A point, by its number, is equal to the one before it
    Repeated(usize),
    /// The radius is not positive after this point
    Radius(usize),
    /// The radius changes by as much as the centre line advances after this point
    Steep(usize),
    /// The radius of curvature of the centre line is smaller than the tube's radius after this
    /// point
    Curved(usize),
}

/// A tube.
#[derive(Clone, Debug, PartialEq)]
pub struct Tube {
    line: CentreLine,
    ends: TubeEnds,
    /// At the first and the last end, where those are open
    rims: Option<[Rim; 2]>,
    least_radius: f64,
}

/// The circle where the wall of a tube ends, in the axes of the carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rim {
    pub(super) centre: Vec3,
    /// Unit vector along the centre line, out of the tube
    pub(super) outward: Vec3,
    pub(super) radius: f64,
}

impl Rim {
    /// The rim of a wall around an end of a centre line, of a radius there. `tilt`: the component along `outward`
    /// of the wall's normal.
    fn of_end(end: Vec3, outward: Vec3, radius: f64, tilt: f64) -> Self {
        Self { centre: end + outward * (radius * tilt), outward, radius: radius * (1.0 - tilt * tilt).sqrt() }
    }

    /// How far a point is beyond the plane of the rim, and from its axis.
    pub(super) fn along_and_across(&self, y: Vec3) -> [f64; 2] {
        let d = y - self.centre;
        let beyond = self.outward.dot(d);
        [beyond, (d - self.outward * beyond).norm()]
    }

    /// True if a point is no farther than `reach` from the circle.
    pub(super) fn is_within(&self, reach: f64, y: Vec3) -> bool {
        let [beyond, across] = self.along_and_across(y);
        beyond.hypot(across - self.radius) <= reach
    }
}

#[derive(Clone, Debug, PartialEq)]
enum CentreLine {
    Straight(Vec<Cone>),
    Smooth(Vec<Piece>),
}

/// A piece of a spline: c and R as cubics of u in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    /// Coefficients of 1, u, u^2, u^3 of x, y, z, R
    coefficients: [[f64; 4]; 4],
    /// A sphere around the piece of the centre line: middle and radius
    middle: Vec3,
    reach: f64,
    /// The largest radius of the tube
    widest: f64,
}

/// Centre and radius of a tube with their first two derivatives over u.
struct Section<T> {
    place: [Vec3<T>; 3],
    radius: [T; 3],
}

impl Piece {
    fn at<T: Real>(&self, u: T) -> Section<T> {
        let mut values = [[T::zero(); 4]; 3];
        for (k, &[c0, c1, c2, c3]) in self.coefficients.iter().enumerate() {
            values[0][k] = ((u * c3 + T::constant(c2)) * u + T::constant(c1)) * u + T::constant(c0);
            values[1][k] = (u * (3.0 * c3) + T::constant(2.0 * c2)) * u + T::constant(c1);
            values[2][k] = u * (6.0 * c3) + T::constant(2.0 * c2);
        }
        Section { place: values.map(|[x, y, z, _]| Vec3([x, y, z])), radius: values.map(|[_, _, _, radius]| radius) }
    }

    /// F_u and F_uu; `None` on the centre line, unless the distance from it is rounded off.
    fn slopes<T: Real>(&self, y: Vec3<T>, u: T, blunt: f64) -> Option<[T; 2]> {
        let Section { place: [c, c1, c2], radius: [radius, r1, r2] } = self.at(u);
        let d = y - c;
        if let Some(rounded) = RoundedLength::of(d, blunt) {
            let along = d.dot(c1);
            let second = (c1.squared() - d.dot(c2)) * rounded.slope + along * along * rounded.bend - r2;
            return Some([-along * rounded.slope - r1, second]);
        }
        let l = d.norm();
        if l.largest() <= MIN_RELATIVE_DISTANCE * radius.largest() {
            return None;
        }
        let inverse = T::one() / l;
        let along = d.dot(c1) * inverse;
        let first = -along - r1;
        let second = (c1.squared() - d.dot(c2) - along * along) * inverse - r2;
        Some([first, second])
    }

    /// F, a distance from the tube if u is that of the closest point.
    fn value(&self, y: Vec3, u: f64, blunt: f64) -> f64 {
        let section = self.at(u);
        let d = y - section.place[0];
        RoundedLength::of(d, blunt).map_or_else(|| d.norm(), |rounded| rounded.value) - section.radius[0]
    }

    fn lower_bound(&self, y: Vec3) -> f64 {
        (y - self.middle).norm() - self.reach - self.widest
    }

    /// The closest of the ends and the local minima of a piece.
    fn closest(&self, y: Vec3, blunt: f64) -> Closest {
        let mut best = Closest { u: 0.0, value: self.value(y, 0.0, blunt) };
        let mut offer = |u: f64| {
            let value = self.value(y, u, blunt);
            if value < best.value {
                best = Closest { u, value };
            }
        };
        offer(1.0);
        let slopes = |u: f64| self.slopes(y, u, blunt).map(|[first, second]| Slopes { first, second });
        // A point of the centre line has no slope there, and may lie where two intervals meet.
        (1..INTERVALS).map(|k| k as f64 / INTERVALS as f64).filter(|&u| slopes(u).is_none()).for_each(&mut offer);
        interior_minima(INTERVALS, &slopes, &mut offer);
        best
    }
}

/// A point of a piece of a centre line.
#[derive(Clone, Copy)]
struct Closest {
    u: f64,
    /// F
    value: f64,
}

impl CentreLine {
    /// The rims of open ends. The wall ends where its closest point is that of the centre line's end. Straight
    /// pieces have spheres at their ends, so that the wall of a piece that widens outwards goes on to the
    /// plane of its end.
    fn rims(&self) -> Option<[Rim; 2]> {
        Some(match self {
            Self::Straight(cones) => {
                let (first, last) = (cones.first()?, cones.last()?);
                [
                    Rim::of_end(first.ends()[0], -first.axis(), first.radii()[0], (-first.tilt()).max(0.0)),
                    Rim::of_end(last.ends()[1], last.axis(), last.radii()[1], last.tilt().max(0.0)),
                ]
            }
            Self::Smooth(pieces) => {
                let of_end = |piece: &Piece, u: f64| {
                    let Section { place: [c, c1, _], radius: [radius, r1, _] } = piece.at(u);
                    let outward = c1 * ((2.0 * u - 1.0) / c1.norm());
                    Rim::of_end(c, outward, radius, -r1 * (2.0 * u - 1.0) / c1.norm())
                };
                [of_end(pieces.first()?, 0.0), of_end(pieces.last()?, 1.0)]
            }
        })
    }
}

impl Tube {
    /// The tube with straight pieces between `points`.
    pub fn straight(points: &[Vec3], radii: &[f64], ends: TubeEnds) -> Result<Self, TubeError> {
        check_points(points, radii)?;
        let piece = |k: usize| Cone::new(points[k], points[k + 1], [radii[k], radii[k + 1]]).ok_or(TubeError::Steep(k));
        let cones: Result<Vec<Cone>, TubeError> = (0..points.len() - 1).map(piece).collect();
        let least_radius = radii.iter().copied().fold(f64::INFINITY, f64::min);
        Ok(Self::of(CentreLine::Straight(cones?), ends, least_radius))
    }

    /// The tube along the natural cubic spline through `points`, over the length of the chords
    /// between them; the radius is a spline of the same kind.
    pub fn smooth(points: &[Vec3], radii: &[f64], ends: TubeEnds) -> Result<Self, TubeError> {
        check_points(points, radii)?;
        let chords: Vec<f64> = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
        let value = |k: usize, point: usize| if k < 3 { points[point].0[k] } else { radii[point] };
        let component = |k: usize| {
            let values: Vec<f64> = (0..points.len()).map(|point| value(k, point)).collect();
            cubics(&values, &chords, None)
        };
        let components = [component(0), component(1), component(2), component(3)];
        let mut least_radius = f64::INFINITY;
        let mut pieces = vec![];
        for k in 0..chords.len() {
            // From u in [0, chord] to u in [0, 1].
            let scales = [1.0, chords[k], chords[k].powi(2), chords[k].powi(3)];
            let scaled = |of: usize| [0, 1, 2, 3].map(|power: usize| components[of][k][power] * scales[power]);
            let piece = Piece::new([0, 1, 2, 3].map(scaled));
            least_radius = least_radius.min(piece.examine(k)?);
            pieces.push(piece);
        }
        Ok(Self::of(CentreLine::Smooth(pieces), ends, least_radius))
    }

    fn of(line: CentreLine, ends: TubeEnds, least_radius: f64) -> Self {
        let rims = match ends {
            TubeEnds::Open => line.rims(),
            TubeEnds::Round => None,
        };
        Self { line, ends, rims, least_radius }
    }

    /// Places of the centre line with their radii, close enough to draw it.
    pub(super) fn sections(&self) -> Vec<(Vec3, f64)> {
        match &self.line {
            CentreLine::Straight(cones) => {
                let ends = |cone: &Cone| cone.ends().into_iter().zip(cone.radii()).collect::<Vec<_>>();
                let first = cones.first().map(|cone| ends(cone)[0]);
                first.into_iter().chain(cones.iter().map(|cone| ends(cone)[1])).collect()
            }
            CentreLine::Smooth(pieces) => {
                let at = |k: usize| {
                    let piece = (k / INTERVALS).min(pieces.len() - 1);
                    let section = pieces[piece].at(k as f64 / INTERVALS as f64 - piece as f64);
                    (section.place[0], section.radius[0])
                };
                (0..=INTERVALS * pieces.len()).map(at).collect()
            }
        }
    }

    /// The least radius.
    pub fn least_radius(&self) -> f64 {
        self.least_radius
    }

    /// The rims of its first and its last end, where those are open.
    pub(super) fn rims(&self) -> Option<&[Rim; 2]> {
        self.rims.as_ref()
    }

    /// The distance from the tube, outside of it.
    pub(super) fn distance<T: Real>(&self, y: Vec3<T>, rounding: Rounding) -> Result<Distance<T>, Undefined> {
        let here = Vec3(y.0.map(T::largest));
        let blunt = rounding.inside * self.least_radius;
        match &self.line {
            CentreLine::Straight(cones) => self.distance_from_cones(cones, y, here, blunt),
            CentreLine::Smooth(pieces) => self.distance_from_spline(pieces, y, here, blunt),
        }
    }

    fn distance_from_cones<T: Real>(
        &self,
        cones: &[Cone],
        y: Vec3<T>,
        here: Vec3,
        blunt: f64,
    ) -> Result<Distance<T>, Undefined> {
        let mut best: Option<(usize, f64)> = None;
        for (k, cone) in cones.iter().enumerate() {
            if best.is_some_and(|(_, value)| cone.lower_bound(here) >= value) {
                continue;
            }
            let value = cone.distance(here, blunt)?.value;
            if best.is_none_or(|(_, least)| value < least) {
                best = Some((k, value));
            }
        }
        let Some((k, _)) = best else { return Err(Undefined::BeyondEnd) };
        let distance = cones[k].distance(y, blunt)?;
        let beyond = distance.feature == Feature::End
            && ((k == 0 && cones[k].is_before(here)) || (k + 1 == cones.len() && cones[k].is_after(here)));
        match self.ends {
            TubeEnds::Open if beyond => Err(Undefined::BeyondEnd),
            TubeEnds::Open | TubeEnds::Round => Ok(distance),
        }
    }

    fn distance_from_spline<T: Real>(
        &self,
        pieces: &[Piece],
        y: Vec3<T>,
        here: Vec3,
        blunt: f64,
    ) -> Result<Distance<T>, Undefined> {
        let mut best: Option<(usize, Closest)> = None;
        for (k, piece) in pieces.iter().enumerate() {
            if best.is_some_and(|(_, closest)| piece.lower_bound(here) >= closest.value) {
                continue;
            }
            let closest = piece.closest(here, blunt);
            if best.is_none_or(|(_, least)| closest.value < least.value) {
                best = Some((k, closest));
            }
        }
        let Some((k, Closest { u, .. })) = best else { return Err(Undefined::BeyondEnd) };
        let piece = &pieces[k];
        let at_end = (k == 0 && u == 0.0) || (k + 1 == pieces.len() && u == 1.0);
        let Some([first, second]) = piece.slopes(y, T::constant(u), blunt) else { return Err(Undefined::Axis) };
        let outward = if u == 0.0 { first.largest() } else { -first.largest() };
        if at_end && outward > 0.0 {
            return match self.ends {
                TubeEnds::Open => Err(Undefined::BeyondEnd),
                TubeEnds::Round => {
                    let Section { place: [c, ..], radius: [radius, ..] } = piece.at(u);
                    sphere(y - Vec3::constant(c), radius, blunt)
                }
            };
        }
        if second.largest() <= 0.0 {
            return Err(Undefined::NotUnique);
        }
        // A step of Newton's method in the scalar of the point: its derivatives follow.
        piece.distance(y, T::constant(u) - first / second, blunt)
    }
}

impl Piece {
    fn new(coefficients: [[f64; 4]; 4]) -> Self {
        let mut piece = Self { coefficients, middle: Vec3::ZERO, reach: 0.0, widest: 0.0 };
        let points = piece.control_points();
        piece.middle = (points[0].place + points[3].place) * 0.5;
        // The piece lies in the hull of its control points.
        piece.reach = points.iter().map(|point| (point.place - piece.middle).norm()).fold(0.0, f64::max);
        piece.widest = points.iter().map(|point| point.radius).fold(0.0, f64::max);
        piece
    }

    /// Control points of the piece as a Bezier curve.
    fn control_points(&self) -> [ControlPoint; 4] {
        let component = |k: usize| {
            let [c0, c1, c2, c3] = self.coefficients[k];
            let first = c0 + c1 / 3.0;
            [c0, first, first + (c1 + c2) / 3.0, c0 + c1 + c2 + c3]
        };
        let components = [component(0), component(1), component(2), component(3)];
        [0, 1, 2, 3].map(|j: usize| ControlPoint {
            place: Vec3([components[0][j], components[1][j], components[2][j]]),
            radius: components[3][j],
        })
    }

    /// The least radius of piece `k`, or what is wrong with it.
    fn examine(&self, k: usize) -> Result<f64, TubeError> {
        let mut least = f64::INFINITY;
        for j in 0..=EXAMINED {
            let Section { place: [_, c1, c2], radius: [radius, r1, _] } = self.at(j as f64 / EXAMINED as f64);
            let speed = c1.norm();
            if radius.is_nan() || radius <= 0.0 {
                return Err(TubeError::Radius(k));
            }
            if r1.abs() >= speed {
                return Err(TubeError::Steep(k));
            }
            if radius * c1.cross(c2).norm() >= speed * speed * speed {
                return Err(TubeError::Curved(k));
            }
            least = least.min(radius);
        }
        Ok(least)
    }

    /// The distance from the tube at the closest point `u`.
    fn distance<T: Real>(&self, y: Vec3<T>, u: T, blunt: f64) -> Result<Distance<T>, Undefined> {
        let Section { place: [c, c1, _], radius: [radius, ..] } = self.at(u);
        let Some([_, second]) = self.slopes(y, u, blunt) else { return Err(Undefined::Axis) };
        let d = y - c;
        if let Some(rounded) = RoundedLength::of(d, blunt) {
            let hessian = rounded.hessian(d, Mat3::identity());
            let a = hessian * c1;
            return Ok(Distance {
                value: rounded.value - radius,
                normal: d * rounded.slope,
                curvature: hessian - a.outer(a) * (T::one() / second),
                feature: Feature::Face,
            });
        }
        let l = d.norm();
        let inverse = T::one() / l;
        let n = d * inverse;
        let a = -(c1 - n * n.dot(c1)) * inverse;
        Ok(Distance {
            value: l - radius,
            normal: n,
            curvature: (Mat3::identity() - n.outer(n)) * inverse - a.outer(a) * (T::one() / second),
            feature: Feature::Face,
        })
    }
}

struct ControlPoint {
    place: Vec3,
    radius: f64,
}

fn check_points(points: &[Vec3], radii: &[f64]) -> Result<(), TubeError> {
    if points.len() < 2 || radii.len() != points.len() {
        return Err(TubeError::Points);
    }
    if let Some(k) = (1..points.len()).find(|&k| points[k] == points[k - 1]) {
        return Err(TubeError::Repeated(k));
    }
    match radii.iter().position(|&radius| radius.is_nan() || radius <= 0.0) {
        Some(k) => Err(TubeError::Radius(k)),
        None => Ok(()),
    }
}
