//! Stresses of circles, tubes and rectangles of one isotropic material, in closed form: tension and
//! bending of straight beams, Saint-Venant torsion and flexure.

use super::{Matrix6, Point};
use std::f64::consts::{PI, TAU};

/// Terms of series. The slowest ones, at the sides of a rectangle, alternate and fall with the
/// square of their number.
const TERMS: i32 = 200;

/// A section with closed forms for its stresses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosedForm {
    /// Shape
    pub shape: ClosedShape,
    /// Poisson's ratio
    pub nu: f64,
}

/// Shapes with closed forms, with their centre at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClosedShape {
    /// Circle or tube
    Ring {
        /// Inner and outer radius; the inner one of a circle is zero
        radii: [f64; 2],
    },
    /// Rectangle
    Rectangle {
        /// Half the sides along 2 and 3
        half: [f64; 2],
    },
}

impl ClosedForm {
    /// Stresses at a point under the six unit resultants about the centre, by columns.
    pub fn unit(&self, at: Point) -> Matrix6 {
        let [x2, x3] = at;
        let [area, about_2, about_3] = self.areas();
        let mut unit = Matrix6::zeros();
        unit[(0, 0)] = 1.0 / area;
        unit[(0, 4)] = x3 / about_2;
        unit[(0, 5)] = -x2 / about_3;
        let mut shear = |column: usize, [s12, s13]: [f64; 2]| {
            unit[(5, column)] = s12;
            unit[(4, column)] = s13;
        };
        match self.shape {
            ClosedShape::Ring { radii } => {
                let polar = about_2 + about_3;
                shear(3, [-x3 / polar, x2 / polar]);
                shear(1, ring_flexure(radii, self.nu, about_3, at));
                // A force along 3 is one along 2 that is turned by a right angle: 2 to 3, 3 to -2.
                let [along, across] = ring_flexure(radii, self.nu, about_2, [x3, -x2]);
                shear(2, [-across, along]);
            }
            ClosedShape::Rectangle { half } => {
                let [a, b] = half;
                shear(3, rectangle_torsion(half, at));
                shear(1, rectangle_flexure([a, b], self.nu, at));
                let [along, across] = rectangle_flexure([b, a], self.nu, [x3, x2]);
                shear(2, [across, along]);
            }
        }
        unit
    }

    /// Area, and second moments of area about 2 and 3.
    fn areas(&self) -> [f64; 3] {
        match self.shape {
            ClosedShape::Ring { radii: [inner, outer] } => {
                let [inner_2, outer_2] = [inner * inner, outer * outer];
                let second = 0.25 * PI * (outer_2 * outer_2 - inner_2 * inner_2);
                [PI * (outer_2 - inner_2), second, second]
            }
            ClosedShape::Rectangle { half: [a, b] } => {
                [4.0 * a * b, 4.0 / 3.0 * a * b * b * b, 4.0 / 3.0 * b * a * a * a]
            }
        }
    }

    /// True if a point belongs to the section, within a part of its size.
    pub fn contains(&self, at: Point, tolerance: f64) -> bool {
        match self.shape {
            ClosedShape::Ring { radii: [inner, outer] } => {
                let radius = libm::hypot(at[0], at[1]);
                let slack = tolerance * outer;
                inner - slack <= radius && radius <= outer + slack
            }
            ClosedShape::Rectangle { half } => {
                (0..2).all(|axis| at[axis].abs() <= half[axis] + tolerance * half[0].max(half[1]))
            }
        }
    }

    /// Lowest and highest of two coordinates that cover the section: radius and angle, or x2 and x3.
    pub fn domain(&self) -> [[f64; 2]; 2] {
        match self.shape {
            ClosedShape::Ring { radii } => [radii, [0.0, TAU]],
            ClosedShape::Rectangle { half } => half.map(|half| [-half, half]),
        }
    }

    /// The point at coordinates of the domain.
    pub fn point(&self, [u, v]: [f64; 2]) -> Point {
        match self.shape {
            ClosedShape::Ring { .. } => {
                let (sin, cos) = libm::sincos(v);
                [u * cos, u * sin]
            }
            ClosedShape::Rectangle { .. } => [u, v],
        }
    }

    /// Intervals between samples along both coordinates of the domain.
    pub fn samples(&self) -> [usize; 2] {
        match self.shape {
            ClosedShape::Ring { .. } => [6, 48],
            ClosedShape::Rectangle { .. } => [16, 16],
        }
    }

    /// True if the ends of a coordinate of the domain are one.
    pub fn is_closed(&self, axis: usize) -> bool {
        axis == 1 && matches!(self.shape, ClosedShape::Ring { .. })
    }
}

/// Shear stresses s12 and s13 of a ring under a unit force along 2 (Love, Mathematical Theory of
/// Elasticity, 4th ed., art. 231): both from the harmonic function
/// chi = -(3/4 + nu/2) ((a^2 + b^2) r + a^2 b^2/r) cos(phi) + r^3 cos(3 phi)/4.
fn ring_flexure([inner, outer]: [f64; 2], nu: f64, second: f64, [x, y]: Point) -> [f64; 2] {
    let [a2, b2] = [outer * outer, inner * inner];
    let factor = -(0.75 + 0.5 * nu);
    let [mut along, mut across] = [factor * (a2 + b2), 0.0];
    if inner > 0.0 {
        let r2 = x * x + y * y;
        let hole = factor * a2 * b2 / (r2 * r2);
        along += hole * (y * y - x * x);
        across -= 2.0 * hole * x * y;
    }
    along += 0.75 * (x * x - y * y) + 0.5 * nu * x * x + (1.0 - 0.5 * nu) * y * y;
    across += (0.5 + nu) * x * y;
    let scale = -1.0 / (2.0 * (1.0 + nu) * second);
    [scale * along, scale * across]
}

/// Shear stresses s12 and s13 of a rectangle with half sides (a, b) along (2, 3) under a unit
/// torque, from the series of the stress function in one direction or the other: the one that
/// converges faster at the point (Timoshenko & Goodier, Theory of Elasticity, art. 109).
fn rectangle_torsion([a, b]: [f64; 2], [x2, x3]: Point) -> [f64; 2] {
    let stress = |a: f64, b: f64, x: f64, y: f64| {
        let mut sum = [0.0; 2];
        for number in (1..2 * TERMS).step_by(2) {
            let k = f64::from(number) * PI / (2.0 * a);
            let sign = if number % 4 == 1 { 1.0 } else { -1.0 };
            let (sin, cos) = libm::sincos(k * x);
            let [cosh, sinh] = over_cosh(k, y, b);
            let size = sign / f64::from(number).powi(2);
            sum[0] += size * sinh * cos;
            sum[1] += size * cosh * sin;
            if k * (b - y.abs()) > ROUND_OFF_EXPONENT {
                break;
            }
        }
        // For a twist of 1 with G = 1; the parabola 1 - (x/a)^2 is the part that is no series.
        let scale = 16.0 * a / (PI * PI);
        [-scale * sum[0], 2.0 * x - scale * sum[1]]
    };
    let torsion = torsion_constant([a, b]);
    if (b - x3.abs()) * b >= (a - x2.abs()) * a {
        let [along, across] = stress(a, b, x2, x3);
        [along / torsion, across / torsion]
    } else {
        let [along, across] = stress(b, a, x3, x2);
        [-across / torsion, -along / torsion]
    }
}

/// Factors below exp(-x) of this x do not matter
const ROUND_OFF_EXPONENT: f64 = 40.0;

/// cosh(k y)/cosh(k b) and sinh(k y)/cosh(k b) without overflow, |y| <= b.
fn over_cosh(k: f64, y: f64, b: f64) -> [f64; 2] {
    let outer = libm::exp(k * (y.abs() - b)) / (1.0 + libm::exp(-2.0 * k * b));
    let inner = libm::exp(-2.0 * k * y.abs());
    [outer * (1.0 + inner), outer * (1.0 - inner) * y.signum()]
}

/// The torsion constant of a rectangle with half sides a and b.
fn torsion_constant([a, b]: [f64; 2]) -> f64 {
    let [long, short] = [2.0 * a.max(b), 2.0 * a.min(b)];
    let term = |number: i32| {
        let n = f64::from(number);
        libm::tanh(0.5 * n * PI * long / short) / n.powi(5)
    };
    let sum: f64 = (1..2 * TERMS).step_by(2).map(term).sum();
    long * short.powi(3) * (1.0 / 3.0 - 64.0 / PI.powi(5) * (short / long) * sum)
}

/// Shear stresses along and across a unit force of a rectangle, with half sides a along the force
/// and b across it (Timoshenko & Goodier, Theory of Elasticity, art. 122): the parabola of
/// elementary theory, and a part with Poisson's ratio that varies across.
fn rectangle_flexure([a, b]: [f64; 2], nu: f64, [x, y]: Point) -> [f64; 2] {
    let second = 4.0 / 3.0 * b * a * a * a;
    let mut sum = [0.0; 2];
    for number in 1..=TERMS {
        let k = f64::from(number) * PI / b;
        let sign = if number % 2 == 1 { 1.0 } else { -1.0 };
        let size = sign * 2.0 / (k * k);
        let (sin, cos) = libm::sincos(k * y);
        let [cosh, sinh] = over_cosh(k, x, a);
        sum[0] += size * cosh * cos;
        sum[1] += size * sinh * sin;
        if k * (a - x.abs()) > ROUND_OFF_EXPONENT {
            break;
        }
    }
    let coupling = nu / (1.0 + nu);
    let along = 0.5 * (a * a - x * x) - coupling * (b * b / 6.0 - 0.5 * y * y - sum[0]);
    [along / second, -coupling * sum[1] / second]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integrals of s12, s13 and x2 s13 - x3 s12 under each unit resultant.
    fn resultants(form: &ClosedForm, per_side: usize) -> [[f64; 6]; 3] {
        let [[u0, u1], [v0, v1]] = form.domain();
        let mut sums = [[0.0; 6]; 3];
        let steps = [(u1 - u0) / per_side as f64, (v1 - v0) / per_side as f64];
        for i in 0..per_side {
            for j in 0..per_side {
                let [u, v] = [u0 + (i as f64 + 0.5) * steps[0], v0 + (j as f64 + 0.5) * steps[1]];
                let at = form.point([u, v]);
                let weight = steps[0] * steps[1] * if form.is_closed(1) { u } else { 1.0 };
                let unit = form.unit(at);
                for k in 0..6 {
                    sums[0][k] += weight * unit[(5, k)];
                    sums[1][k] += weight * unit[(4, k)];
                    sums[2][k] += weight * (at[0] * unit[(4, k)] - at[1] * unit[(5, k)]);
                }
            }
        }
        sums
    }

    fn forms() -> [ClosedForm; 4] {
        let ring = |inner| ClosedForm { shape: ClosedShape::Ring { radii: [inner, 1.5] }, nu: 0.3 };
        let rectangle = |half| ClosedForm { shape: ClosedShape::Rectangle { half }, nu: 0.3 };
        [ring(0.0), ring(0.9), rectangle([0.5, 1.0]), rectangle([2.0, 0.3])]
    }

    #[test]
    fn shear_stresses_have_the_resultants_that_they_belong_to() {
        for form in forms() {
            let [along_2, along_3, about_1] = resultants(&form, 200);
            for k in 0..6 {
                for (sum, unit) in [(along_2[k], 1), (along_3[k], 2), (about_1[k], 3)] {
                    let exact = if k == unit { 1.0 } else { 0.0 };
                    assert!((sum - exact).abs() < 1e-3, "{form:?} {k} {unit}: {sum}");
                }
            }
        }
    }

    #[test]
    fn no_shear_stress_acts_on_the_sides() {
        for form in forms() {
            let largest = |row: usize| (0..6).map(|k| form.unit([0.3, 0.2])[(row, k)].abs()).fold(0.0, f64::max);
            let scale = largest(4).max(largest(5));
            for step in 0..40 {
                let t = f64::from(step) / 40.0;
                let sides: Vec<(Point, Point)> = match form.shape {
                    ClosedShape::Ring { radii } => {
                        let (sin, cos) = libm::sincos(TAU * t);
                        let rims = radii.into_iter().filter(|&radius| radius > 0.0);
                        rims.map(|radius| ([radius * cos, radius * sin], [cos, sin])).collect()
                    }
                    ClosedShape::Rectangle { half: [a, b] } => {
                        let along = |half: f64| 0.95 * half * (2.0 * t - 1.0);
                        vec![([a, along(b)], [1.0, 0.0]), ([along(a), -b], [0.0, -1.0])]
                    }
                };
                for (at, normal) in sides {
                    let unit = form.unit(at);
                    for k in 0..6 {
                        let across = unit[(5, k)] * normal[0] + unit[(4, k)] * normal[1];
                        assert!(across.abs() < 1e-2 * scale, "{form:?} {at:?} {k}: {across} of {scale}");
                    }
                }
            }
        }
    }

    #[test]
    fn largest_stresses_are_the_published_ones() {
        // Timoshenko & Goodier, art. 109: k = 0.208, 0.246, 0.312 for torsion; art. 122: 1.126 and
        // 1.143 of the mean at the sides of a square with Poisson's ratio 1/4 (their table).
        for (ratio, k) in [(1.0, 0.208), (2.0, 0.246), (10.0, 0.312)] {
            let form = ClosedForm { shape: ClosedShape::Rectangle { half: [0.5, 0.5 * ratio] }, nu: 0.3 };
            let shear = form.unit([0.5, 0.0])[(4, 3)];
            assert!((shear * ratio * k - 1.0).abs() < 3e-3, "{ratio}: {shear}");
        }
        let square = ClosedForm { shape: ClosedShape::Rectangle { half: [0.5, 0.5] }, nu: 0.25 };
        let factor = |at| square.unit(at)[(5, 1)] / 1.5;
        assert!((factor([0.0, 0.0]) - 0.940).abs() < 2e-3, "{}", factor([0.0, 0.0]));
        assert!((factor([0.0, 0.5]) - 1.126).abs() < 2e-3, "{}", factor([0.0, 0.5]));
        // Circle: (3 + 2 nu)/(8 (1 + nu)) in the middle, (1 + 2 nu)/(4 (1 + nu)) at the rim.
        let circle = ClosedForm { shape: ClosedShape::Ring { radii: [0.0, 1.0] }, nu: 0.3 };
        let second = 0.25 * PI;
        assert!((circle.unit([0.0, 0.0])[(5, 1)] * second - 3.6 / 10.4).abs() < 1e-12);
        assert!((circle.unit([0.0, 1.0])[(5, 1)] * second - 1.6 / 5.2).abs() < 1e-12);
    }
}
