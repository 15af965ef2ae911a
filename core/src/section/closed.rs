//! Stresses of circles, tubes and rectangles of one isotropic material, in closed form: tension and
//! bending of straight beams, Saint-Venant torsion and flexure.

use super::{Matrix6, Point, Vector6};
use std::f64::consts::{PI, TAU};

/// Terms of series. The slowest ones, at the sides of a rectangle, alternate and fall with the
/// square of their number.
const TERMS: i32 = 200;

/// A section with closed forms for its stresses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosedForm {
    shape: ClosedShape,
    /// Poisson's ratio
    nu: f64,
    area: f64,
    /// Second moments of area about 2 and 3
    second: [f64; 2],
    /// Torsion constant of a rectangle; the polar moment of a ring
    torsion: f64,
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
    /// A shape of a material with a Poisson's ratio.
    pub fn new(shape: ClosedShape, nu: f64) -> Self {
        match shape {
            ClosedShape::Ring { radii: [inner, outer] } => {
                let [inner_2, outer_2] = [inner * inner, outer * outer];
                let second = 0.25 * PI * (outer_2 * outer_2 - inner_2 * inner_2);
                Self { shape, nu, area: PI * (outer_2 - inner_2), second: [second; 2], torsion: 2.0 * second }
            }
            ClosedShape::Rectangle { half: [a, b] } => {
                let second = [4.0 / 3.0 * a * b * b * b, 4.0 / 3.0 * b * a * a * a];
                Self { shape, nu, area: 4.0 * a * b, second, torsion: torsion_constant([a, b]) }
            }
        }
    }

    /// The shape.
    pub fn shape(&self) -> ClosedShape {
        self.shape
    }

    /// Stresses at a point under the six unit resultants about the centre, by columns.
    pub fn unit(&self, at: Point) -> Matrix6 {
        Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|k| self.stress(&Vector6::ith(k, 1.0), at)))
    }

    /// The stress at a point under resultants about the centre.
    pub fn stress(&self, load: &Vector6, at: Point) -> Vector6 {
        let [x2, x3] = at;
        let [about_2, about_3] = self.second;
        let axial = load[0] / self.area + load[4] * x3 / about_2 - load[5] * x2 / about_3;
        let mut shear = [0.0; 2];
        let mut add = |size: f64, part: &dyn Fn() -> [f64; 2]| {
            if size != 0.0 {
                let [s12, s13] = part();
                shear = [shear[0] + size * s12, shear[1] + size * s13];
            }
        };
        match self.shape {
            ClosedShape::Ring { radii } => {
                add(load[3], &|| [-x3 / self.torsion, x2 / self.torsion]);
                add(load[1], &|| ring_flexure(radii, self.nu, about_3, at));
                // A force along 3 is one along 2 that is turned by a right angle: 2 to 3, 3 to -2.
                add(load[2], &|| {
                    let [along, across] = ring_flexure(radii, self.nu, about_2, [x3, -x2]);
                    [-across, along]
                });
            }
            ClosedShape::Rectangle { half: [a, b] } => {
                add(load[3], &|| rectangle_torsion([a, b], self.torsion, at));
                add(load[1], &|| rectangle_flexure([a, b], self.nu, at));
                add(load[2], &|| {
                    let [along, across] = rectangle_flexure([b, a], self.nu, [x3, x2]);
                    [across, along]
                });
            }
        }
        Vector6::new(axial, 0.0, 0.0, 0.0, shear[1], shear[0])
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
fn rectangle_torsion([a, b]: [f64; 2], torsion: f64, [x2, x3]: Point) -> [f64; 2] {
    let stress = |a: f64, b: f64, x: f64, y: f64| {
        let mut sum = [0.0; 2];
        let mut term = Term::new(PI / (2.0 * a), [x, y], b, 2);
        for number in (1..2 * TERMS).step_by(2) {
            let sign = if number % 4 == 1 { 1.0 } else { -1.0 };
            let size = sign / f64::from(number * number);
            let [cosh, sinh] = term.over_cosh();
            let [sin, cos] = term.wave;
            sum[0] += size * sinh * cos;
            sum[1] += size * cosh * sin;
            if term.is_round_off() {
                break;
            }
            term.advance();
        }
        // For a twist of 1 with G = 1; the parabola 1 - (x/a)^2 is the part that is no series.
        let scale = 16.0 * a / (PI * PI);
        [-scale * sum[0], 2.0 * x - scale * sum[1]]
    };
    if (b - x3.abs()) * b >= (a - x2.abs()) * a {
        let [along, across] = stress(a, b, x2, x3);
        [along / torsion, across / torsion]
    } else {
        let [along, across] = stress(b, a, x3, x2);
        [-across / torsion, -along / torsion]
    }
}

/// A term of a series in n: sine and cosine of n k x, cosh(n k y)/cosh(n k b) and
/// sinh(n k y)/cosh(n k b) with |y| <= b. All but the first term follow from the one before by
/// products, without overflow.
struct Term {
    /// sin(n k x), cos(n k x)
    wave: [f64; 2],
    turn: [f64; 2],
    /// exp(n k (|y| - b)), exp(-2 n k b), exp(-2 n k |y|)
    decay: [f64; 3],
    factor: [f64; 3],
    sign: f64,
}

/// Terms with a factor below this do not matter
const ROUND_OFF_FACTOR: f64 = 4e-18;

impl Term {
    /// The term of n = 1; n grows by `step`.
    fn new(k: f64, [x, y]: Point, b: f64, step: i32) -> Self {
        let of = |n: f64| {
            let (sin, cos) = libm::sincos(n * k * x);
            let decay = [y.abs() - b, -2.0 * b, -2.0 * y.abs()].map(|length| libm::exp(n * k * length));
            ([sin, cos], decay)
        };
        let (wave, decay) = of(1.0);
        let (turn, factor) = of(f64::from(step));
        Self { wave, turn, decay, factor, sign: y.signum() }
    }

    fn advance(&mut self) {
        let [sin, cos] = self.wave;
        let [turn_sin, turn_cos] = self.turn;
        self.wave = [sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin];
        for (decay, factor) in self.decay.iter_mut().zip(self.factor) {
            *decay *= factor;
        }
    }

    fn over_cosh(&self) -> [f64; 2] {
        let [outer, both, inner] = self.decay;
        let size = outer / (1.0 + both);
        [size * (1.0 + inner), size * (1.0 - inner) * self.sign]
    }

    fn is_round_off(&self) -> bool {
        self.decay[0] < ROUND_OFF_FACTOR
    }
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
    let mut term = Term::new(PI / b, [y, x], a, 1);
    for number in 1..=TERMS {
        let k = f64::from(number) * PI / b;
        let sign = if number % 2 == 1 { 1.0 } else { -1.0 };
        let size = sign * 2.0 / (k * k);
        let [cosh, sinh] = term.over_cosh();
        let [sin, cos] = term.wave;
        sum[0] += size * cosh * cos;
        sum[1] += size * sinh * sin;
        if term.is_round_off() {
            break;
        }
        term.advance();
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
        let ring = |inner| ClosedForm::new(ClosedShape::Ring { radii: [inner, 1.5] }, 0.3);
        let rectangle = |half| ClosedForm::new(ClosedShape::Rectangle { half }, 0.3);
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
            let form = ClosedForm::new(ClosedShape::Rectangle { half: [0.5, 0.5 * ratio] }, 0.3);
            let shear = form.unit([0.5, 0.0])[(4, 3)];
            assert!((shear * ratio * k - 1.0).abs() < 3e-3, "{ratio}: {shear}");
        }
        let square = ClosedForm::new(ClosedShape::Rectangle { half: [0.5, 0.5] }, 0.25);
        let factor = |at| square.unit(at)[(5, 1)] / 1.5;
        assert!((factor([0.0, 0.0]) - 0.940).abs() < 2e-3, "{}", factor([0.0, 0.0]));
        assert!((factor([0.0, 0.5]) - 1.126).abs() < 2e-3, "{}", factor([0.0, 0.5]));
        // Circle: (3 + 2 nu)/(8 (1 + nu)) in the middle, (1 + 2 nu)/(4 (1 + nu)) at the rim.
        let circle = ClosedForm::new(ClosedShape::Ring { radii: [0.0, 1.0] }, 0.3);
        let second = 0.25 * PI;
        assert!((circle.unit([0.0, 0.0])[(5, 1)] * second - 3.6 / 10.4).abs() < 1e-12);
        assert!((circle.unit([0.0, 1.0])[(5, 1)] * second - 1.6 / 5.2).abs() < 1e-12);
    }
}
