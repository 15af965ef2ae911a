//! The points of an element against a surface: shape functions with two derivatives over s in [0,
//! 1], and the local minima of the distance between the ends.
//!
//! ```text
//! F(s) = phi(y(s)),   F_s = n.y',   F_ss = n.y'' + y'.H y'
//! ```
//!
//! At a minimum the contact force has no component along the element, so that elements slide over
//! obstacles without snagging at their nodes.

use super::distance::Distance;
use super::minimum::{Slopes, interior_minima};
use crate::scalar::Real;
use crate::tensor::Vec3;

/// F_ss of a minimum exceeds this part of |y'|: flatter ones, as along a line that lies on a
/// plane, have no place of their own.
const MIN_CURVATURE: f64 = 1e-9;

/// F_ss of a sharp minimum is at least this part of y'.H y': otherwise the element follows the
/// surface. A beam that wraps itself round a drum needs 12 corrections a load level with this
/// limit, and does not converge without (elements of three and four nodes).
const MIN_OWN_BEND: f64 = 0.5;

/// y'.H y' of a sharp minimum is at least this part of F_ss: otherwise the bend of the element alone
/// makes the minimum, as on a plane. A beam that sags onto a floor needs 10 corrections a load level
/// with this limit, and 130 without (elements of three nodes).
const MIN_SURFACE_BEND: f64 = 0.1;

/// At a smooth minimum F_s is below this part of |y'|.
const MAX_SLOPE: f64 = 1e-9;

/// The largest number of parts of an element in which minima are looked for.
pub const MOST_INTERVALS: usize = 24;

/// The largest number of minima between the ends of an element: neighbouring parts cannot both have one.
pub const MAX_MINIMA: usize = MOST_INTERVALS / 2;

/// Lagrange shape functions of N equally spaced nodes at a point s in [0, 1].
#[derive(Clone, Copy, Debug)]
pub struct ShapeAt<const N: usize, T = f64> {
    /// N_i
    pub(crate) values: [T; N],
    /// dN_i/ds
    pub(crate) slopes: [T; N],
    /// d2N_i/ds2
    pub(super) bends: [T; N],
}

impl<const N: usize, T: Real> ShapeAt<N, T> {
    /// The shape functions at `s`. One node stands for itself at any s.
    pub fn new(s: T) -> Self {
        let mut out = Self { values: [T::one(); N], slopes: [T::zero(); N], bends: [T::zero(); N] };
        for i in 0..N {
            for k in (0..N).filter(|&k| k != i) {
                out.multiply(i, k, s);
            }
        }
        out
    }

    /// Multiplies N_i by the factor that vanishes at node k.
    fn multiply(&mut self, i: usize, k: usize, s: T) {
        let last = (N - 1) as f64;
        let slope = last / (i as f64 - k as f64);
        let factor = (s - T::constant(k as f64 / last)) * slope;
        self.bends[i] = self.bends[i] * factor + self.slopes[i] * (2.0 * slope);
        self.slopes[i] = self.slopes[i] * factor + self.values[i] * slope;
        self.values[i] = self.values[i] * factor;
    }
}

/// The sum of vectors at the nodes times `factors`: the values of shape functions, or their
/// derivatives.
pub fn weighted_sum<const N: usize, T: Real>(factors: &[T; N], of: impl Fn(usize) -> Vec3<T>) -> Vec3<T> {
    let mut sum = Vec3::zero();
    for i in 0..N {
        sum += of(i) * factors[i];
    }
    sum
}

/// The shape of a local minimum of the distance along an element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MinimumKind {
    /// The surface bends away from the element: the closest point has a place of its own
    #[default]
    Sharp,
    /// Surface and element run side by side, or the element alone bends: the distance hardly
    /// changes along the element, or the place of its minimum is that of a small bend. Points at
    /// nodes carry the force better.
    Conforming,
    /// The normal jumps there, as at an edge that protrudes into a tube of straight pieces, or on
    /// the medial axis of a body: F_s is not zero, and the place has no derivative.
    Kink,
}

/// A local minimum of the distance along an element.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Minimum {
    /// Its place, in (0, 1)
    pub(crate) s: f64,
    /// Its shape
    pub(crate) kind: MinimumKind,
}

/// Local minima of the distance along an element, in the order of s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Minima {
    count: usize,
    found: [Minimum; MAX_MINIMA],
}

impl Minima {
    /// One minimum at most.
    pub(super) fn of(minimum: Option<Minimum>) -> Self {
        let mut out = Self::default();
        minimum.into_iter().for_each(|minimum| out.push(minimum));
        out
    }

    /// The minima.
    pub fn found(&self) -> &[Minimum] {
        &self.found[..self.count]
    }

    fn push(&mut self, minimum: Minimum) {
        if self.count < MAX_MINIMA {
            self.found[self.count] = minimum;
            self.count += 1;
        }
    }
}

/// The bend of the distance along an element at a point.
struct Bend {
    slopes: Slopes,
    /// y'.H y', the part of F_ss that is due to the surface
    of_surface: f64,
    /// |y'|
    speed: f64,
}

impl Bend {
    fn at<const N: usize>(nodes: &[Vec3; N], shape: &ShapeAt<N>, distance: &Distance) -> Self {
        let first = weighted_sum(&shape.slopes, |i| nodes[i]);
        let second = weighted_sum(&shape.bends, |i| nodes[i]);
        let n = distance.normal;
        let of_surface = first.dot(distance.curvature * first);
        let slopes = Slopes { first: n.dot(first), second: n.dot(second) + of_surface };
        Self { slopes, of_surface, speed: first.norm() }
    }

    /// The kind of a minimum; `None` if the distance is constant.
    fn kind(&self) -> Option<MinimumKind> {
        if self.slopes.first.abs() > MAX_SLOPE * self.speed {
            return Some(MinimumKind::Kink);
        }
        let second = self.slopes.second;
        if second <= MIN_CURVATURE * self.speed {
            return None;
        }
        let is_sharp = second >= MIN_OWN_BEND * self.of_surface && self.of_surface >= MIN_SURFACE_BEND * second;
        Some(if is_sharp { MinimumKind::Sharp } else { MinimumKind::Conforming })
    }
}

/// The place at s of an element of one to four nodes, and its derivative.
pub fn place_and_slope(nodes: &[Vec3], s: f64) -> [Vec3; 2] {
    fn sums<const N: usize>(nodes: &[Vec3], s: f64) -> [Vec3; 2] {
        let shape = ShapeAt::<N>::new(s);
        [shape.values, shape.slopes].map(|factors| weighted_sum(&factors, |i| nodes[i]))
    }
    match nodes.len() {
        0 | 1 => sums::<1>(nodes, s),
        2 => sums::<2>(nodes, s),
        3 => sums::<3>(nodes, s),
        _ => sums::<4>(nodes, s),
    }
}

/// The place at s of an element of one to four nodes.
pub fn place_on(nodes: &[Vec3], s: f64) -> Vec3 {
    place_and_slope(nodes, s)[0]
}

/// F_s and F_ss of the distance along an element.
pub fn slopes<const N: usize>(nodes: &[Vec3; N], shape: &ShapeAt<N>, distance: &Distance) -> Slopes {
    Bend::at(nodes, shape, distance).slopes
}

/// Parts of an element with `nodes` nodes, each of which has one local minimum of a convex distance at most: a straight
/// element as a whole.
pub const fn intervals_of_convex(nodes: usize) -> usize {
    if nodes == 2 { 1 } else { 2 * nodes.saturating_sub(1) }
}

/// The local minima between the ends of an element whose nodes are at `nodes` in the axes of the
/// surface's carrier, one in each of `intervals` equal parts at most. `distance` is that of the surface; `None`
/// where it is undefined.
pub fn minima<const N: usize>(
    nodes: &[Vec3; N],
    intervals: usize,
    distance: &dyn Fn(Vec3) -> Option<Distance>,
) -> Minima {
    let mut out = Minima::default();
    let at = |s: f64| {
        let shape = ShapeAt::<N>::new(s);
        let here = distance(weighted_sum(&shape.values, |i| nodes[i]))?;
        Some(Bend::at(nodes, &shape, &here))
    };
    interior_minima(intervals, &|s| at(s).map(|bend| bend.slopes), &mut |s| {
        let kind = at(s).map_or(Some(MinimumKind::Kink), |bend| bend.kind());
        if let Some(kind) = kind {
            out.push(Minimum { s, kind });
        }
    });
    out
}

/// [`minima`] of an element of two to four nodes; a single node has none.
pub fn minima_on(nodes: &[Vec3], intervals: usize, distance: &dyn Fn(Vec3) -> Option<Distance>) -> Minima {
    match *nodes {
        [a, b] => minima(&[a, b], intervals, distance),
        [a, b, c] => minima(&[a, b, c], intervals, distance),
        [a, b, c, d] => minima(&[a, b, c, d], intervals, distance),
        _ => Minima::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::cone::Cone;
    use super::super::distance::Side;
    use super::super::dual::{Dual, Random};
    use super::super::surface::{Shape, Surface};
    use super::*;
    use std::array::from_fn;
    use std::ops::Range;

    fn shapes_hold<const N: usize>() {
        for s in [0.0, 0.13, 0.5, 0.77, 1.0] {
            let shape = ShapeAt::<N, Dual<1>>::new(Dual::variable(s, 0));
            let here = ShapeAt::<N>::new(s);
            let on_parent = crate::kernel::shape::values::<N>(2.0 * s - 1.0);
            let at = |i: usize| Vec3([i as f64 / (N - 1) as f64, 1.0, 0.0]);
            let place = weighted_sum(&here.values, at);
            assert!((place.0[0] - s).abs() < 1e-15 && (place.0[1] - 1.0).abs() < 1e-15);
            for i in 0..N {
                assert!((shape.values[i].value - on_parent[i]).abs() < 1e-14);
                assert!((shape.values[i].partials[0] - here.slopes[i]).abs() < 1e-13);
                assert!((shape.slopes[i].partials[0] - here.bends[i]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn shape_functions_have_their_derivatives() {
        shapes_hold::<2>();
        shapes_hold::<3>();
        shapes_hold::<4>();
        let one = ShapeAt::<1>::new(0.3);
        assert_eq!((one.values, one.slopes, one.bends), ([1.0], [0.0], [0.0]));
    }

    /// Minima of the distance among many points along the element: those that are deeper than their surroundings by five
    /// ten-thousandths of the element.
    fn scanned<const N: usize>(nodes: &[Vec3; N], surface: &Surface) -> Option<Vec<f64>> {
        const COUNT: usize = 1000;
        let value = |k: usize| {
            let shape = ShapeAt::<N>::new(k as f64 / COUNT as f64);
            surface.distance(weighted_sum(&shape.values, |i| nodes[i])).ok().map(|distance| distance.value)
        };
        let values: Option<Vec<f64>> = (0..=COUNT).map(value).collect();
        let values = values?;
        let near = COUNT / 12;
        let prominent = 5e-4 * (nodes[N - 1] - nodes[0]).norm();
        let is_least = |&k: &usize| {
            let sides = [k.saturating_sub(near)..k, k + 1..(k + near + 1).min(COUNT + 1)];
            let highest = |side: Range<usize>| values[side].iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let is_deep = || sides.into_iter().all(|side| highest(side) - values[k] > prominent);
            values[k] < values[k - 1] && values[k] <= values[k + 1] && is_deep()
        };
        Some((1..COUNT).filter(is_least).map(|k| k as f64 / COUNT as f64).collect())
    }

    /// Elements near a surface, with a bend of up to `bend` of their length: the number of minima
    /// found, and of those that only the scan finds.
    fn compare<const N: usize>(bend: f64, surface: &Surface) -> (usize, usize) {
        let mut random = Random(21);
        let distance = |y: Vec3| surface.distance(y).ok();
        let mut found_in_all = 0;
        let mut missed = 0;
        for _ in 0..600 {
            let from = random.vector(1.5);
            let along = random.direction() * random.between(0.2, 1.0);
            let nodes: [Vec3; N] =
                from_fn(|i| from + along * (i as f64 / (N - 1) as f64) + random.vector(bend * along.norm()));
            let found = minima(&nodes, surface.intervals(&nodes), &distance);
            let Some(scanned) = scanned(&nodes, surface) else { continue };
            found_in_all += found.found().len();
            for s in &scanned {
                if !found.found().iter().any(|minimum| (minimum.s - s).abs() < 2e-3) {
                    missed += 1;
                }
            }
            for &Minimum { s, kind } in found.found() {
                assert_ne!(kind, MinimumKind::Kink);
                let shape = ShapeAt::<N>::new(s);
                let here = surface.distance(weighted_sum(&shape.values, |i| nodes[i])).unwrap();
                let slopes = slopes(&nodes, &shape, &here);
                assert!(slopes.second > 0.0 && s > 0.0 && s < 1.0);
                assert!(slopes.first.abs() < 1e-13 + 1e-15 * slopes.second, "{slopes:?}");
                let values = [-1e-3, 0.0, 1e-3].map(|shift| {
                    let shape = ShapeAt::<N>::new(s + shift);
                    surface.distance(weighted_sum(&shape.values, |i| nodes[i])).map_or(f64::INFINITY, |it| it.value)
                });
                assert!(values[1] < values[0].min(values[2]), "{s} {values:?}");
            }
        }
        (found_in_all, missed)
    }

    #[test]
    fn minima_along_elements_are_found() {
        let mut random = Random(22);
        for _ in 0..5 {
            let axis = random.direction();
            let mut centre = || random.vector(0.3);
            let torus = Shape::Torus { centre: centre(), axis, ring: 1.1, radius: 0.4 };
            let cylinder = Shape::Cylinder { point: centre(), axis, radius: 0.4 };
            let from = centre();
            let cone = Shape::Cone(Cone::new(from, from + axis, [0.5, 0.2]).unwrap());
            let ball = Shape::Sphere { centre: centre(), radius: 0.6 };
            let inside = [torus.clone(), cylinder.clone()].map(|shape| Surface { shape, side: Side::Inside });
            let outside = [torus, cylinder, cone, ball].map(|shape| Surface { shape, side: Side::Outside });
            for surface in inside.into_iter().chain(outside) {
                let counts = [compare::<2>(0.0, &surface), compare::<3>(0.05, &surface), compare::<4>(0.03, &surface)];
                println!("minima found and missed, {surface:?}: {counts:?}");
                let is_concave = surface.side == Side::Inside && matches!(surface.shape, Shape::Cylinder { .. });
                assert!(is_concave || counts.iter().all(|&(found, _)| found >= 15), "{surface:?} {counts:?}");
                assert!(counts.iter().all(|&(_, missed)| missed == 0), "{surface:?} {counts:?}");
            }
        }
    }

    #[test]
    fn lines_on_a_plane_have_no_minima() {
        let shape = Shape::Plane { point: Vec3::ZERO, normal: Vec3::UNIT[2] };
        let plane = Surface { shape, side: Side::Outside };
        let distance = |y: Vec3| plane.distance(y).ok();
        let line = |height: f64| [Vec3::ZERO, Vec3([1.0, 0.0, height])];
        assert!(minima(&line(0.0), 1, &distance).found().is_empty());
        assert!(minima(&line(0.1), 1, &distance).found().is_empty());
        let bent = [Vec3([0.0, 0.0, 1.0]), Vec3([0.5, 0.0, 0.0]), Vec3([1.0, 0.0, 1.0])];
        assert_eq!(minima(&bent, 4, &distance).found(), [Minimum { s: 0.5, kind: MinimumKind::Conforming }]);
    }

    #[test]
    fn edges_are_told_from_smooth_minima() {
        let half = [1.0; 3];
        let shape = Shape::Box { centre: Vec3::ZERO, axes: crate::tensor::Mat3::IDENTITY, half };
        let cuboid = Surface { shape, side: Side::Outside };
        let distance = |y: Vec3| cuboid.distance(y).ok();
        // A line across an edge, outside of the box and through its body.
        let line = |shift: f64| [Vec3([0.6 + shift, 1.2 + shift, 0.0]), Vec3([1.3 + shift, 0.5 + shift, 0.0])];
        let outside = minima(&line(0.2), 1, &distance);
        assert!(matches!(outside.found(), [Minimum { kind: MinimumKind::Sharp, .. }]), "{outside:?}");
        let inside = minima(&line(0.0), 1, &distance);
        assert!(matches!(inside.found(), [Minimum { kind: MinimumKind::Kink, .. }]), "{inside:?}");
    }

    #[test]
    fn elements_that_follow_the_surface_are_told() {
        let cylinder = |radius: f64| Surface {
            shape: Shape::Cylinder { point: Vec3::ZERO, axis: Vec3::UNIT[2], radius },
            side: Side::Outside,
        };
        let kinds = |nodes: &[Vec3; 3], radius: f64| -> Vec<MinimumKind> {
            let surface = cylinder(radius);
            minima(nodes, 4, &|y| surface.distance(y).ok()).found().iter().map(|minimum| minimum.kind).collect()
        };
        let straight = [Vec3([-0.1, 1.0, 0.0]), Vec3([0.0, 1.0, 0.0]), Vec3([0.1, 1.0, 0.0])];
        // Nearly an arc of radius one, and a bend towards the cylinder.
        let wrapped = [Vec3([-0.1, 0.9955, 0.0]), Vec3([0.0, 1.0, 0.0]), Vec3([0.1, 0.9955, 0.0])];
        let bent = [Vec3([-0.1, 1.1, 0.0]), Vec3([0.0, 1.0, 0.0]), Vec3([0.1, 1.1, 0.0])];
        assert_eq!(kinds(&straight, 0.9), [MinimumKind::Sharp]);
        assert_eq!(kinds(&wrapped, 0.9), [MinimumKind::Conforming]);
        assert_eq!(kinds(&bent, 0.9), [MinimumKind::Conforming]);
    }
}
