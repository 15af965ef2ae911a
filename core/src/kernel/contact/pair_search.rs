//! Closest points of two elements, and the advance that keeps their centre lines apart.

use super::along::{Minima, Minimum, MinimumKind, ShapeAt, intervals_of_convex, minima, weighted_sum};
use super::distance::sphere;
use crate::tensor::Vec3;

/// The largest change of s and e in a step of Newton's method.
const MAX_STEP: f64 = 0.2;

/// Newton's method converges quadratically, or leaves the elements within as many steps.
const MAX_ITERATIONS: usize = 30;

/// Halvings of a step that does not bring the points nearer to each other. The last one is taken in
/// any case: round-off alone may be in the way.
const MAX_HALVINGS: usize = 5;

/// Changes of s and e below which the closest points are found.
const RESOLUTION: f64 = 1e-15;

/// Part of the present distance of centre lines that additive advancement keeps.
const KEPT_DISTANCE: f64 = 0.1;

/// Part of the safe advance that is taken in each step of additive advancement.
const CAUTION: f64 = 0.9;

/// Steps of additive advancement, which needs 6 in the mean: what has been proven safe by then
/// counts.
const MAX_ADVANCES: usize = 200;

/// The square of the sine between straight elements up to which they have no closest points of their own.
const PARALLEL: f64 = 1e-20;

/// Closest points of two elements, or of two segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPair {
    /// The parameter on A, in [0, 1]
    pub(crate) s: f64,
    /// The parameter on B, in [0, 1]
    pub(crate) e: f64,
    /// The distance of the points
    pub(crate) distance: f64,
}

/// Two segments: A from `a[0]` to `a[1]`, B from `b[0]` to `b[1]`.
#[derive(Clone, Copy, Debug)]
pub struct Segments {
    /// The ends of A
    pub(crate) a: [Vec3; 2],
    /// The ends of B
    pub(crate) b: [Vec3; 2],
}

impl Segments {
    /// The closest points. Of parallel segments, which have many, one pair.
    pub fn closest(&self) -> ClosestPair {
        let mut best = self.of_point_on_b(0.0);
        for candidate in [self.of_point_on_b(1.0), self.of_point_on_a(0.0), self.of_point_on_a(1.0)] {
            if candidate.distance < best.distance {
                best = candidate;
            }
        }
        match self.between_the_ends() {
            Some(inner) if inner.distance < best.distance => inner,
            _ => best,
        }
    }

    /// The closest points of the two lines if both lie between the ends.
    fn between_the_ends(&self) -> Option<ClosestPair> {
        let u = self.a[1] - self.a[0];
        let v = self.b[1] - self.b[0];
        let w = self.a[0] - self.b[0];
        let (uu, uv, vv) = (u.squared(), u.dot(v), v.squared());
        let determinant = uu * vv - uv * uv;
        let s = (uv * v.dot(w) - vv * u.dot(w)) / determinant;
        let e = (uu * v.dot(w) - uv * u.dot(w)) / determinant;
        // False for parallel segments, whose parameters are not numbers.
        let between = s > 0.0 && s < 1.0 && e > 0.0 && e < 1.0;
        between.then(|| self.at(s, e))
    }

    fn at(&self, s: f64, e: f64) -> ClosestPair {
        let a = self.a[0] + (self.a[1] - self.a[0]) * s;
        let b = self.b[0] + (self.b[1] - self.b[0]) * e;
        ClosestPair { s, e, distance: (a - b).norm() }
    }

    fn of_point_on_a(&self, s: f64) -> ClosestPair {
        let point = self.a[0] + (self.a[1] - self.a[0]) * s;
        self.at(s, foot(point, self.b))
    }

    fn of_point_on_b(&self, e: f64) -> ClosestPair {
        let point = self.b[0] + (self.b[1] - self.b[0]) * e;
        self.at(foot(point, self.a), e)
    }

    fn moved(&self, by: &Self, part: f64) -> Self {
        let ends = |ends: [Vec3; 2], by: [Vec3; 2]| [ends[0] + by[0] * part, ends[1] + by[1] * part];
        Self { a: ends(self.a, by.a), b: ends(self.b, by.b) }
    }
}

/// The parameter of the point of a segment closest to a point.
fn foot(point: Vec3, ends: [Vec3; 2]) -> f64 {
    let along = ends[1] - ends[0];
    let square = along.squared();
    if square > 0.0 { ((point - ends[0]).dot(along) / square).clamp(0.0, 1.0) } else { 0.0 }
}

/// The part of a motion in [0, 1] that keeps two segments apart by at least a tenth of their
/// present distance, whatever the way between the positions that it is cut into (additive
/// continuous collision detection: Li, Kaufman, Jiang 2021, doi:10.1145/3450626.3459767).
///
/// `motion` has the displacements of the ends. The mean motion is subtracted; then no point of A
/// comes nearer to a point of B by more than l = max|A| + max|B| in the whole motion, so that
/// advances by 0.9 (distance - kept)/l are safe. `sag` bounds how far curved elements are from their
/// chords, both together. Of distances above `enough` a tenth of that is kept.
pub fn safe_part(segments: &Segments, motion: &Segments, sag: f64, enough: f64) -> f64 {
    let mean = (motion.a[0] + motion.a[1] + motion.b[0] + motion.b[1]) * 0.25;
    let size = |ends: [Vec3; 2]| (ends[0] - mean).norm().max((ends[1] - mean).norm());
    let fastest = size(motion.a) + size(motion.b);
    let distance = |part: f64| (segments.moved(motion, part).closest().distance - sag).max(0.0);
    let start = distance(0.0);
    let kept = KEPT_DISTANCE * start.min(enough);
    if start - kept >= fastest {
        return 1.0;
    }
    let mut part = 0.0;
    let mut free = start;
    for _ in 0..MAX_ADVANCES {
        let next = part + CAUTION * (free - kept) / fastest;
        if next >= 1.0 {
            return 1.0;
        }
        free = distance(next);
        if free <= kept || next <= part {
            break;
        }
        part = next;
    }
    part
}

/// The local minima of the distance between two elements with both points between the ends, at most
/// one for each pair of chords between neighbouring nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairMinima {
    count: usize,
    found: [Option<ClosestPair>; 9],
}

impl PairMinima {
    /// The minima.
    pub fn found(&self) -> impl Iterator<Item = ClosestPair> + '_ {
        self.found[..self.count].iter().copied().flatten()
    }

    fn offer(&mut self, pair: ClosestPair) {
        const SAME: f64 = 1e-6;
        let known = self.found().any(|other| (other.s - pair.s).abs() < SAME && (other.e - pair.e).abs() < SAME);
        if !known && self.count < self.found.len() {
            self.found[self.count] = Some(pair);
            self.count += 1;
        }
    }
}

/// The bilateral closest points of two elements with nodes at `a` and `b`. Straight elements have a closed form; others a
/// descent from the closest points of their chords by Newton's method, which ends as nothing outside of the elements,
/// and where the second derivatives of the distance are not positive definite.
pub fn bilateral<const NA: usize, const NB: usize>(a: &[Vec3; NA], b: &[Vec3; NB]) -> PairMinima {
    let mut out = PairMinima::default();
    if let ([a0, a1], [b0, b1]) = (&a[..], &b[..]) {
        let segments = Segments { a: [*a0, *a1], b: [*b0, *b1] };
        let [u, v] = [segments.a, segments.b].map(|[from, to]| to - from);
        // Those of parallel ones are round-off.
        let are_apart = u.cross(v).squared() > PARALLEL * u.squared() * v.squared();
        segments.between_the_ends().filter(|_| are_apart).into_iter().for_each(|pair| out.offer(pair));
        return out;
    }
    for i in 1..NA {
        for k in 1..NB {
            let chords = Segments { a: [a[i - 1], a[i]], b: [b[k - 1], b[k]] };
            let ClosestPair { s, e, .. } = chords.closest();
            let start = [(s + (i - 1) as f64) / (NA - 1) as f64, (e + (k - 1) as f64) / (NB - 1) as f64];
            if let Some(pair) = refine(a, b, start) {
                out.offer(pair);
            }
        }
    }
    out
}

/// Half of the squared distance of two points of elements, with its derivatives over s and e.
struct SquaredDistance {
    value: f64,
    gradient: [f64; 2],
    /// Second derivatives ss, se, ee
    hessian: [f64; 3],
    /// Second derivatives of straight elements in the place of these: never negative
    straight: [f64; 3],
}

impl SquaredDistance {
    fn at<const NA: usize, const NB: usize>(a: &[Vec3; NA], b: &[Vec3; NB], s: f64, e: f64) -> Self {
        let on_a = ShapeAt::<NA>::new(s);
        let on_b = ShapeAt::<NB>::new(e);
        let apart = weighted_sum(&on_a.values, |i| a[i]) - weighted_sum(&on_b.values, |k| b[k]);
        let za = weighted_sum(&on_a.slopes, |i| a[i]);
        let zb = weighted_sum(&on_b.slopes, |k| b[k]);
        let straight = [za.squared(), -za.dot(zb), zb.squared()];
        let bent_a = apart.dot(weighted_sum(&on_a.bends, |i| a[i]));
        let bent_b = apart.dot(weighted_sum(&on_b.bends, |k| b[k]));
        Self {
            value: 0.5 * apart.squared(),
            gradient: [apart.dot(za), -apart.dot(zb)],
            hessian: [straight[0] + bent_a, straight[1], straight[2] - bent_b],
            straight,
        }
    }

    fn is_convex(&self) -> bool {
        let [ss, se, ee] = self.hessian;
        ss > 0.0 && ss * ee > se * se
    }

    /// A step that descends: of Newton's method, or of straight elements where that does not.
    fn step(&self) -> [f64; 2] {
        let [g_s, g_e] = self.gradient;
        let [ss, se, ee] = if self.is_convex() {
            self.hessian
        } else {
            let [ss, se, ee] = self.straight;
            [ss * SAFE, se, ee * SAFE]
        };
        let determinant = ss * ee - se * se;
        [(se * g_e - ee * g_s) / determinant, (se * g_s - ss * g_e) / determinant]
    }
}

/// Makes the second derivatives of parallel straight elements definite.
const SAFE: f64 = 1.01;

fn refine<const NA: usize, const NB: usize>(a: &[Vec3; NA], b: &[Vec3; NB], start: [f64; 2]) -> Option<ClosestPair> {
    let [mut s, mut e] = start;
    let mut here = SquaredDistance::at(a, b, s, e);
    for _ in 0..MAX_ITERATIONS {
        let [step_s, step_e] = here.step();
        let mut part = (MAX_STEP / step_s.abs().max(step_e.abs())).min(1.0);
        let mut next = SquaredDistance::at(a, b, s + part * step_s, e + part * step_e);
        for _ in 0..MAX_HALVINGS {
            if next.value <= here.value {
                break;
            }
            part *= 0.5;
            next = SquaredDistance::at(a, b, s + part * step_s, e + part * step_e);
        }
        s += part * step_s;
        e += part * step_e;
        here = next;
        let near = |parameter: f64| (-MAX_STEP..=1.0 + MAX_STEP).contains(&parameter);
        if !(near(s) && near(e)) {
            return None;
        }
        if step_s.abs().max(step_e.abs()) <= RESOLUTION {
            break;
        }
    }
    let inside = s > 0.0 && s < 1.0 && e > 0.0 && e < 1.0;
    (inside && here.is_convex()).then(|| ClosestPair { s, e, distance: (2.0 * here.value).sqrt() })
}

/// The local minima of the distance from a point, between the ends of an element.
pub fn closest_to_point<const N: usize>(point: Vec3, nodes: &[Vec3; N]) -> Minima {
    if let [from, to] = nodes[..] {
        let along = to - from;
        let s = (point - from).dot(along) / along.squared();
        let is_on_line = (from + along * s - point).squared() == 0.0;
        let kind = if is_on_line { MinimumKind::Kink } else { MinimumKind::Sharp };
        return Minima::of((s > 0.0 && s < 1.0).then_some(Minimum { s, kind }));
    }
    minima(nodes, intervals_of_convex(N), &|y| sphere(y - point, 0.0, 0.0).ok())
}

#[cfg(test)]
mod tests {
    use super::super::dual::Random;
    use super::*;
    use std::array::from_fn;

    fn random_segments(random: &mut Random, size: f64) -> Segments {
        Segments { a: from_fn(|_| random.vector(size)), b: from_fn(|_| random.vector(size)) }
    }

    #[test]
    fn segments_have_their_closest_points() {
        let mut random = Random(41);
        for case in 0..300 {
            let mut segments = random_segments(&mut random, 1.0);
            if case % 3 == 0 {
                // Parallel ones
                segments.b[1] = segments.b[0] + (segments.a[1] - segments.a[0]) * random.between(-2.0, 2.0);
            }
            let best = segments.closest();
            for i in 0..=40 {
                for k in 0..=40 {
                    let other = segments.at(f64::from(i) / 40.0, f64::from(k) / 40.0);
                    assert!(best.distance <= other.distance + 1e-14, "{segments:?}");
                }
            }
        }
        let point = Segments { a: [Vec3::ZERO; 2], b: [Vec3::UNIT[0]; 2] };
        assert_eq!(point.closest().distance, 1.0);
    }

    #[test]
    fn safe_motions_do_not_cross() {
        let mut random = Random(42);
        let mut least = f64::INFINITY;
        let mut whole = 0;
        for _ in 0..3000 {
            let segments = random_segments(&mut random, 1.0);
            let motion = random_segments(&mut random, 2.0);
            let part = safe_part(&segments, &motion, 0.0, f64::INFINITY);
            assert!(part > 0.0 && part <= 1.0);
            whole += usize::from(part == 1.0);
            let start = segments.closest().distance;
            for k in 0..=300 {
                let now = segments.moved(&motion, part * f64::from(k) / 300.0).closest().distance;
                least = least.min(now / start);
            }
        }
        println!("least distance {least} of the one at the start; {whole} of 3000 motions are whole");
        assert!(least >= KEPT_DISTANCE - 1e-12);
    }

    #[test]
    fn safe_parts_are_not_timid() {
        // Head on: all but a tenth of the distance.
        let segments = Segments { a: [Vec3::ZERO, Vec3::UNIT[0]], b: [Vec3([0.5, -1.0, 1.0]), Vec3([0.5, 1.0, 1.0])] };
        let up = Segments { a: [Vec3([0.0, 0.0, 2.0]); 2], b: [Vec3::ZERO; 2] };
        let part = safe_part(&segments, &up, 0.0, f64::INFINITY);
        assert!((part - 0.45).abs() < 1e-9, "{part}");
        // A common motion is no approach.
        let far = Segments { a: [Vec3([9.0, 0.0, 2.0]); 2], b: [Vec3([9.0, 0.0, 2.0]); 2] };
        assert_eq!(safe_part(&segments, &far, 0.0, f64::INFINITY), 1.0);
        // With a sag of all the distance nothing is proven.
        assert_eq!(safe_part(&segments, &up, 1.0, f64::INFINITY), 0.0);
    }

    fn compare<const NA: usize, const NB: usize>(random: &mut Random) -> [usize; 2] {
        const COUNT: usize = 40;
        let mut counts = [0; 2];
        for _ in 0..40 {
            let element = |random: &mut Random, direction: Vec3, shift: Vec3| {
                let middle = random.vector(0.3) + shift;
                move |i: usize, n: usize| middle + direction * (i as f64 / (n - 1) as f64 - 0.5)
            };
            let a = element(random, Vec3([1.0, 0.1, 0.0]), Vec3::ZERO);
            let b = element(random, Vec3([0.2, 1.0, 0.1]), Vec3([0.0, 0.0, 0.5]));
            let a: [Vec3; NA] = from_fn(|i| a(i, NA) + random.vector(0.04));
            let b: [Vec3; NB] = from_fn(|i| b(i, NB) + random.vector(0.04));
            let at = |i: usize, k: usize| {
                let on_a = ShapeAt::<NA>::new(i as f64 / COUNT as f64);
                let on_b = ShapeAt::<NB>::new(k as f64 / COUNT as f64);
                (weighted_sum(&on_a.values, |i| a[i]) - weighted_sum(&on_b.values, |k| b[k])).norm()
            };
            let mut least = (0, 0, f64::INFINITY);
            for i in 0..=COUNT {
                for k in 0..=COUNT {
                    let distance = at(i, k);
                    if distance < least.2 {
                        least = (i, k, distance);
                    }
                }
            }
            let inside = |i: usize| (2..=COUNT - 2).contains(&i);
            let minima = bilateral(&a, &b);
            if inside(least.0) && inside(least.1) {
                let found = minima.found().any(|pair| pair.distance <= least.2);
                counts[usize::from(!found)] += 1;
            }
        }
        counts
    }

    #[test]
    fn bilateral_closest_points_are_found() {
        let mut random = Random(43);
        let counts = [
            compare::<2, 2>(&mut random),
            compare::<2, 3>(&mut random),
            compare::<3, 3>(&mut random),
            compare::<4, 3>(&mut random),
            compare::<4, 4>(&mut random),
        ];
        println!("bilateral points found and missed: {counts:?}");
        assert!(counts.iter().all(|&[found, missed]| found > 15 && missed == 0), "{counts:?}");
    }

    #[test]
    fn points_are_projected_onto_elements() {
        let nodes = [Vec3::ZERO, Vec3([0.5, 0.1, 0.0]), Vec3([1.0, 0.0, 0.0])];
        let found = closest_to_point(Vec3([0.5, 0.0, 1.0]), &nodes);
        assert_eq!(found.found().len(), 1);
        assert!((found.found()[0].s - 0.5).abs() < 1e-12);
        assert!(closest_to_point(Vec3([3.0, 0.0, 0.0]), &nodes).found().is_empty());
        let straight = [Vec3([1.0, 0.0, 0.0]), Vec3([3.0, 0.0, 0.0])];
        for (point, expected) in [
            (Vec3([1.5, 0.0, 2.0]), Some(Minimum { s: 0.25, kind: MinimumKind::Sharp })),
            (Vec3([2.0, 0.0, 0.0]), Some(Minimum { s: 0.5, kind: MinimumKind::Kink })),
            (Vec3([0.5, 0.0, 1.0]), None),
            (Vec3([3.5, 0.0, 1.0]), None),
        ] {
            assert_eq!(closest_to_point(point, &straight).found().first(), expected.as_ref(), "{point:?}");
        }
    }
}
