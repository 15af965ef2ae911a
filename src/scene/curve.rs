//! Cubic splines and helices, by arc length.

use beamsim_core::kernel::shape;
use beamsim_core::kernel::spline::cubics;
use beamsim_core::tensor::Vec3;
use std::f64::consts::PI;

/// Parts of a segment between two points over which the speed is integrated by one Gauss rule of
/// four points.
const PANELS: usize = 8;

/// Iterations from an arc length to its parameter; Newton's method needs about four.
const MOST_ITERATIONS: usize = 30;

/// A cubic spline of vectors over a parameter, with two continuous derivatives and none of second
/// order at its ends (natural).
#[derive(Clone, Debug)]
pub struct NaturalSpline {
    segments: Vec<Segment>,
    /// The parameter at each value
    parameters: Vec<f64>,
}

impl NaturalSpline {
    /// The spline through two or more values at parameters that increase.
    pub fn new(values: &[Vec3], parameters: &[f64]) -> Self {
        let spacing: Vec<f64> = parameters.windows(2).map(|ends| ends[1] - ends[0]).collect();
        Self { segments: segments(values, &spacing, None), parameters: parameters.to_vec() }
    }

    /// The value at a parameter.
    pub fn at(&self, parameter: f64) -> Vec3 {
        let next = self.parameters.partition_point(|&start| start <= parameter).clamp(1, self.segments.len());
        self.segments[next - 1].place(parameter - self.parameters[next - 1])
    }
}

/// A cubic spline through points, with two continuous derivatives over its parameter, which is the
/// sum of the chords (Floater, M. S.: Chordal cubic spline interpolation is fourth-order accurate,
/// IMA J. Numer. Anal. 26 (2006) 25-33).
#[derive(Clone, Debug)]
pub struct Spline {
    segments: Vec<Segment>,
    /// Arc length at the start of each panel, and at last that of all
    lengths: Vec<f64>,
}

/// x(u) = c0 + c1 u + c2 u² + c3 u³, u from 0 to `chord`, the difference of its parameters
#[derive(Clone, Debug)]
struct Segment {
    c: [Vec3; 4],
    chord: f64,
}

impl Segment {
    fn place(&self, u: f64) -> Vec3 {
        let [c0, c1, c2, c3] = self.c;
        c0 + (c1 + (c2 + c3 * u) * u) * u
    }

    fn derivative(&self, u: f64) -> Vec3 {
        let [_, c1, c2, c3] = self.c;
        c1 + (c2 * 2.0 + c3 * (3.0 * u)) * u
    }

    /// Arc length between two parameters.
    fn length(&self, from: f64, to: f64) -> f64 {
        let half = 0.5 * (to - from);
        let speed = |xi: f64| self.derivative(from + half * (1.0 + xi)).norm();
        shape::gauss(4).iter().map(|&(xi, weight)| weight * speed(xi)).sum::<f64>() * half
    }
}

impl Spline {
    /// The spline through two or more points, of which none is equal to the one before it;
    /// `tangents`: unit tangents at start and end, or no second derivative there.
    pub fn new(points: &[Vec3], tangents: Option<[Vec3; 2]>) -> Self {
        let chords: Vec<f64> = points.windows(2).map(|ends| (ends[1] - ends[0]).norm()).collect();
        let segments = segments(points, &chords, tangents);
        let mut lengths = vec![0.0];
        let mut length = 0.0;
        for segment in &segments {
            for panel in 0..PANELS {
                length += segment.length(panel_start(segment, panel), panel_start(segment, panel + 1));
                lengths.push(length);
            }
        }
        Self { segments, lengths }
    }

    /// Arc length from the start to a point.
    pub fn length_to(&self, point: usize) -> f64 {
        self.lengths[PANELS * point]
    }

    /// The place at an arc length.
    pub fn place(&self, length: f64) -> Vec3 {
        let (segment, u) = self.locate(length);
        segment.place(u)
    }

    /// The unit tangent at an arc length.
    pub fn tangent(&self, length: f64) -> Vec3 {
        let (segment, u) = self.locate(length);
        let derivative = segment.derivative(u);
        derivative * (1.0 / derivative.norm())
    }

    /// The smallest speed over the parameter, whose mean is about 1: it vanishes at cusps.
    pub fn slowest(&self) -> f64 {
        let at = |segment: &Segment, step: usize| {
            segment.derivative(segment.chord * step as f64 / (4 * PANELS) as f64).norm()
        };
        let of = |segment: &Segment| (0..=4 * PANELS).map(|step| at(segment, step)).fold(f64::INFINITY, f64::min);
        self.segments.iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// The segment and its parameter at an arc length.
    fn locate(&self, length: f64) -> (&Segment, f64) {
        let panel = self.lengths.partition_point(|&start| start <= length).clamp(1, self.lengths.len() - 1) - 1;
        let segment = &self.segments[panel / PANELS];
        let from = panel_start(segment, panel % PANELS);
        let to = panel_start(segment, panel % PANELS + 1);
        let wanted = length - self.lengths[panel];
        let whole = self.lengths[panel + 1] - self.lengths[panel];
        let mut u = from + (to - from) * (wanted / whole);
        for _ in 0..MOST_ITERATIONS {
            let change = (wanted - segment.length(from, u)) / segment.derivative(u).norm();
            u = (u + change).clamp(from, to);
            if change.abs() <= 4.0 * f64::EPSILON * segment.chord {
                break;
            }
        }
        (segment, u)
    }
}

fn panel_start(segment: &Segment, panel: usize) -> f64 {
    segment.chord * (panel as f64 / PANELS as f64)
}

/// The cubics between points whose parameters differ by `chords`.
fn segments(points: &[Vec3], chords: &[f64], tangents: Option<[Vec3; 2]>) -> Vec<Segment> {
    let components = [0, 1, 2].map(|axis: usize| {
        let values: Vec<f64> = points.iter().map(|point| point.0[axis]).collect();
        cubics(&values, chords, tangents.map(|ends| ends.map(|tangent| tangent.0[axis])))
    });
    let segment = |(k, &chord): (usize, &f64)| {
        let c = [0, 1, 2, 3].map(|power: usize| Vec3([0, 1, 2].map(|axis: usize| components[axis][k][power])));
        Segment { c, chord }
    };
    chords.iter().enumerate().map(segment).collect()
}

/// A helix: x(t) = centre + radius (cos a e + sin a f) + t advance axis, a = t angle, t from 0 to 1.
#[derive(Clone, Debug)]
pub struct Helix {
    centre: Vec3,
    radius: f64,
    /// From the axis to the start
    e: Vec3,
    /// axis x e
    f: Vec3,
    axis: Vec3,
    /// Angle about the axis, of either sign
    angle: f64,
    /// Way along the axis
    advance: f64,
}

impl Helix {
    /// The helix from `start` about the axis through `point`; `None` where the start lies on the
    /// axis.
    pub fn new(start: Vec3, point: Vec3, axis: Vec3, pitch: f64, turns: f64) -> Option<Self> {
        let arm = start - point;
        let across = arm - axis * arm.dot(axis);
        let radius = across.norm();
        // Squares of what is smaller are lost in the difference.
        let e = if radius > 1e-9 * arm.norm() { across.normalized()? } else { return None };
        let centre = start - across;
        let f = axis.cross(e);
        Some(Self { centre, radius, e, f, axis, angle: 2.0 * PI * turns, advance: pitch * turns.abs() })
    }

    /// Arc length.
    pub fn length(&self) -> f64 {
        libm::hypot(self.radius * self.angle, self.advance)
    }

    /// The place at the fraction `t` of the length.
    pub fn place(&self, t: f64) -> Vec3 {
        let a = t * self.angle;
        let round = (self.e * libm::cos(a) + self.f * libm::sin(a)) * self.radius;
        self.centre + round + self.axis * (t * self.advance)
    }

    /// The unit tangent at the fraction `t` of the length.
    pub fn tangent(&self, t: f64) -> Vec3 {
        let a = t * self.angle;
        let round = (self.f * libm::cos(a) - self.e * libm::sin(a)) * (self.radius * self.angle);
        (round + self.axis * self.advance) * (1.0 / self.length())
    }

    /// Turns about the axis, without sign.
    pub fn turns(&self) -> f64 {
        self.angle.abs() / (2.0 * PI)
    }

    /// The direction of the axis.
    pub fn axis(&self) -> Vec3 {
        self.axis
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curve whose arc length is known: a quarter of a circle of radius 2 with a rise.
    fn exact(t: f64) -> Vec3 {
        let a = t * 0.5 * PI;
        Vec3([2.0 * libm::cos(a), 2.0 * libm::sin(a), 0.7 * t])
    }

    fn spline(count: usize, tangents: bool) -> Spline {
        let points: Vec<Vec3> = (0..=count).map(|k| exact(k as f64 / count as f64)).collect();
        let rate = Vec3([0.0, PI, 0.7]);
        let end = Vec3([-PI, 0.0, 0.7]);
        Spline::new(&points, tangents.then_some([rate, end].map(|d| d * (1.0 / d.norm()))))
    }

    #[test]
    fn clamped_splines_are_of_fourth_order() {
        let length = libm::hypot(PI, 0.7);
        let errors = [4, 8, 16].map(|count| {
            let spline = spline(count, true);
            let all = spline.length_to(count);
            let off = |k: usize| (spline.place(all * k as f64 / 50.0) - exact(k as f64 / 50.0)).norm();
            let place = (0..=50).map(off).fold(0.0, f64::max);
            [(all - length).abs() / length, place]
        });
        for what in 0..2 {
            let ratios = [errors[0][what] / errors[1][what], errors[1][what] / errors[2][what]];
            assert!(ratios.iter().all(|ratio| (12.0..22.0).contains(ratio)), "{errors:?}");
        }
        assert!(errors[2][1] < 2e-6, "{errors:?}");
    }

    #[test]
    fn natural_splines_have_no_curvature_at_their_ends() {
        let spline = spline(7, false);
        let first = &spline.segments[0];
        let last = &spline.segments[6];
        assert!(first.c[2].norm() < 1e-14);
        assert!((last.c[2] * 2.0 + last.c[3] * (6.0 * last.chord)).norm() < 1e-13);
        let straight = Spline::new(&[0.0, 1.0, 3.0].map(|x| Vec3([x, 2.0 * x, 0.0])), None);
        assert!((straight.length_to(2) - 3.0 * 5.0_f64.sqrt()).abs() < 1e-14);
        assert!((straight.place(5.0_f64.sqrt()) - Vec3([1.0, 2.0, 0.0])).norm() < 1e-14);
    }

    #[test]
    fn natural_splines_pass_through_their_values() {
        let values = [0.0, 1.0, -1.0, 2.0].map(|x| Vec3([x, 2.0 * x, 1.0]));
        let spline = NaturalSpline::new(&values, &[0.0, 1.0, 3.0, 4.0]);
        for (k, z) in [0.0, 1.0, 3.0, 4.0].into_iter().enumerate() {
            assert!((spline.at(z) - values[k]).norm() < 1e-14);
        }
        let line = NaturalSpline::new(&[Vec3::ZERO, Vec3::UNIT[0]], &[0.0, 2.0]);
        assert!((line.at(0.5) - Vec3([0.25, 0.0, 0.0])).norm() < 1e-15);
    }

    #[test]
    fn places_of_splines_are_by_arc_length() {
        let spline = spline(5, false);
        let all = spline.length_to(5);
        let step = 1e-5 * all;
        for k in 1..100 {
            let s = all * f64::from(k) / 100.0;
            let rate = (spline.place(s + step) - spline.place(s - step)) * (0.5 / step);
            assert!((rate - spline.tangent(s)).norm() < 1e-8, "{k}: {rate:?}");
        }
        assert!((spline.place(all) - exact(1.0)).norm() < 1e-14);
        assert!((spline.place(spline.length_to(2)) - exact(0.4)).norm() < 1e-13);
    }

    #[test]
    fn helices_advance_by_their_pitch() {
        let start = Vec3([3.0, 0.0, 1.0]);
        for turns in [2.5, -2.5] {
            let helix = Helix::new(start, Vec3([1.0, 0.0, -7.0]), Vec3::UNIT[2], 0.4, turns).unwrap();
            assert!((helix.length() - libm::hypot(10.0 * PI, 1.0)).abs() < 1e-13);
            assert!((helix.place(0.0) - start).norm() < 1e-15);
            assert!((helix.place(1.0) - Vec3([-1.0, 0.0, 2.0])).norm() < 1e-13);
            let quarter = helix.place(0.1);
            assert!((quarter - Vec3([1.0, 2.0 * turns.signum(), 1.1])).norm() < 1e-14);
        }
        assert!(Helix::new(start, start + Vec3::UNIT[2], Vec3::UNIT[2], 0.4, 1.0).is_none());
    }
}
