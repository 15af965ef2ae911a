//! Results from the 6x6 matrices: centres, torsional stiffness, principal axes, and a change
//! of reference point or axes.

use super::{Matrix6, Point, Vector6};
use nalgebra::{Matrix2, Matrix3};

/// Numbers of engineers, from the compliance of a section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Properties {
    /// Tension stiffness with free curvature and twist, 1 / S11
    pub ea: f64,
    /// Torsional stiffness about the shear centre, 1 / S44 (not K44, which contains the Steiner
    /// part of the shear centre)
    pub gj: f64,
    /// Shear stiffness along 2 and 3 of forces through the shear centre, with free curvature
    pub ga: [f64; 2],
    /// The point at which a shear force makes no twist
    pub shear_centre: Point,
    /// The point at which an axial force makes no curvature
    pub tension_centre: Point,
    /// Larger and smaller bending stiffness, with free twist and extension
    pub ei: [f64; 2],
    /// Angle from axis 2 to the axis of the larger bending stiffness, rad, in (-pi/2, pi/2]
    pub principal_angle: f64,
}

impl Properties {
    /// From compliance, about the reference point of the compliance. The shear centre is that of
    /// the section itself: coupling of bending and twist makes it depend on the distance to the
    /// load.
    pub fn new(compliance: &Matrix6) -> Self {
        let s = compliance;
        let shear_centre = [-s[(3, 2)] / s[(3, 3)], s[(3, 1)] / s[(3, 3)]];
        // Curvature from N1 at (x2, x3): S51 + S55 x3 - S56 x2 = 0 and the same for 6.
        let system = Matrix2::new(-s[(4, 5)], s[(4, 4)], -s[(5, 5)], s[(5, 4)]);
        let determinant = system.determinant();
        let right = [-s[(4, 0)], -s[(5, 0)]];
        let tension_centre = [
            (right[0] * system[(1, 1)] - right[1] * system[(0, 1)]) / determinant,
            (right[1] * system[(0, 0)] - right[0] * system[(1, 0)]) / determinant,
        ];
        let (flexible, angle) = principal([s[(4, 4)], s[(5, 5)], s[(4, 5)]]);
        let about_shear_centre = moved_compliance(compliance, shear_centre);
        Self {
            ga: [1.0 / about_shear_centre[(1, 1)], 1.0 / about_shear_centre[(2, 2)]],
            ea: 1.0 / moved_compliance(compliance, tension_centre)[(0, 0)],
            gj: 1.0 / s[(3, 3)],
            shear_centre,
            tension_centre,
            ei: [1.0 / flexible[1], 1.0 / flexible[0]],
            principal_angle: angle,
        }
    }
}

/// Eigenvalues of [[a, c], [c, b]], larger first, and the angle of the axis of the smaller one.
fn principal([a, b, c]: [f64; 3]) -> ([f64; 2], f64) {
    let half_difference = 0.5 * (a - b);
    let radius = libm::hypot(half_difference, c);
    let mean = 0.5 * (a + b);
    let angle = if radius <= 1e-12 * mean { 0.0 } else { 0.5 * libm::atan2(0.0 - c, -half_difference) };
    ([mean + radius, mean - radius], angle)
}

/// Centre of mass, from the 6x6 mass.
pub fn mass_centre(mass: &Matrix6) -> Point {
    [mass[(3, 2)] / mass[(0, 0)], -mass[(3, 1)] / mass[(0, 0)]]
}

/// T of psi_old = T psi_new for a reference point at `to` in the old coordinates: the strain of the
/// old axis is G_new + K x d, where d = -to is the place of the old origin.
fn shift(to: Point) -> Matrix6 {
    let mut shift = Matrix6::identity();
    let [d2, d3] = [-to[0], -to[1]];
    // K x d with d = (0, d2, d3).
    shift[(0, 4)] = d3;
    shift[(0, 5)] = -d2;
    shift[(1, 3)] = -d3;
    shift[(2, 3)] = d2;
    shift
}

/// Stiffness or mass about another reference point.
pub fn moved(matrix: &Matrix6, to: Point) -> Matrix6 {
    let shift = shift(to);
    symmetric(&(shift.transpose() * matrix * shift))
}

/// Compliance about another reference point: theta_old = T^-T theta_new, and T^-1 moves back.
pub fn moved_compliance(compliance: &Matrix6, to: Point) -> Matrix6 {
    let back = shift([-to[0], -to[1]]);
    symmetric(&(back * compliance * back.transpose()))
}

/// Resultants about the origin, from those about another reference point: M + p x N.
pub fn load_about_origin(load: &Vector6, reference: Point) -> Vector6 {
    shift([-reference[0], -reference[1]]).transpose() * load
}

/// Stiffness, mass or compliance in axes that are turned by an angle from axis 2 towards axis 3.
pub fn turned(matrix: &Matrix6, angle: f64) -> Matrix6 {
    let (sin, cos) = libm::sincos(angle);
    // Rows are the new axes in the old ones.
    let axes = Matrix3::new(1.0, 0.0, 0.0, 0.0, cos, sin, 0.0, -sin, cos);
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(&axes);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(&axes);
    symmetric(&(both * matrix * both.transpose()))
}

fn symmetric(matrix: &Matrix6) -> Matrix6 {
    0.5 * (matrix + matrix.transpose())
}

/// The largest difference of two matrices, relative to the root of the products of diagonals.
pub fn relative_difference(matrix: &Matrix6, reference: &Matrix6) -> f64 {
    let scaled = |i: usize, j: usize| {
        (matrix[(i, j)] - reference[(i, j)]).abs() / (reference[(i, i)] * reference[(j, j)]).sqrt()
    };
    (0..36).map(|k| scaled(k / 6, k % 6)).fold(0.0, f64::max)
}

/// The largest difference of two stiffness matrices, relative to the second, in the energy of any strain. It does not
/// depend on the point that strains belong to, but for round-off: it should lie in the section. `None` where the second is
/// not positive definite.
pub fn energy_difference(matrix: &Matrix6, reference: &Matrix6) -> Option<f64> {
    let scale = Vector6::from_fn(|i, _| 1.0 / reference[(i, i)].sqrt());
    let scaled = |of: &Matrix6| Matrix6::from_fn(|i, j| of[(i, j)] * scale[i] * scale[j]);
    let factor = scaled(reference).cholesky()?;
    let half = factor.l_dirty().solve_lower_triangular(&scaled(&(matrix - reference)))?;
    let whole = factor.l_dirty().solve_lower_triangular(&half.transpose())?;
    let symmetric = 0.5 * (whole + whole.transpose());
    let values = symmetric.symmetric_eigenvalues();
    values.iter().all(|value| value.is_finite()).then(|| values.amax())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centres_of_a_moved_section_are_found() {
        let diagonal = Matrix6::from_diagonal(&nalgebra::Vector6::new(10.0, 3.0, 4.0, 1.0, 5.0, 7.0));
        let about_corner = moved(&diagonal, [-0.3, 0.2]);
        let found = Properties::new(&about_corner.try_inverse().unwrap());
        for (centre, exact) in [(found.tension_centre, [0.3, -0.2]), (found.shear_centre, [0.3, -0.2])] {
            assert!((0..2).all(|axis| (centre[axis] - exact[axis]).abs() < 1e-12));
        }
        assert!((found.gj - 1.0).abs() < 1e-12 && (found.ea - 10.0).abs() < 1e-11);
        assert!(relative_difference(&moved(&about_corner, [0.3, -0.2]), &diagonal) < 1e-13);
    }

    #[test]
    fn a_difference_of_energies_does_not_depend_on_the_point() {
        let [fine, mut coarse] = [Matrix6::from_diagonal(&nalgebra::Vector6::new(1e3, 1e3, 1e3, 0.02, 50.0, 70.0)); 2];
        coarse[(3, 3)] *= 1.5;
        for at in [[0.0, 0.0], [0.0, 10.0], [-30.0, 4.0]] {
            let [fine, coarse] = [&fine, &coarse].map(|matrix| moved(matrix, at));
            let difference = energy_difference(&coarse, &fine).expect("a positive definite matrix");
            assert!((difference - 0.5).abs() < 1e-6, "{at:?} {difference}");
        }
        assert_eq!(energy_difference(&coarse, &-fine), None);
    }

    #[test]
    fn a_force_at_a_point_has_a_moment_about_the_origin() {
        let force = Vector6::new(1.0, 2.0, 3.0, 0.0, 0.0, 0.0);
        let at_origin = load_about_origin(&force, [0.5, 0.2]);
        // p x N with p = (0, 0.5, 0.2).
        let exact = Vector6::new(1.0, 2.0, 3.0, 0.5 * 3.0 - 0.2 * 2.0, 0.2, -0.5);
        assert!((at_origin - exact).amax() < 1e-15);
        // The energy does not depend on the reference point.
        let diagonal = Matrix6::from_diagonal(&Vector6::new(10.0, 3.0, 4.0, 1.0, 5.0, 7.0));
        let energy = force.dot(&(moved_compliance(&diagonal, [0.5, 0.2]) * force));
        assert!((at_origin.dot(&(diagonal * at_origin)) - energy).abs() < 1e-14);
    }

    #[test]
    fn principal_axes_of_a_turned_section_are_found() {
        let diagonal = Matrix6::from_diagonal(&nalgebra::Vector6::new(10.0, 3.0, 4.0, 1.0, 7.0, 5.0));
        // Axes turned by -0.4 see the section turned by +0.4.
        let found = Properties::new(&turned(&diagonal, -0.4).try_inverse().unwrap());
        assert!((found.ei[0] - 7.0).abs() < 1e-12 && (found.ei[1] - 5.0).abs() < 1e-12);
        assert!((found.principal_angle - 0.4).abs() < 1e-12);
    }

    #[test]
    fn mass_moves_like_a_point_mass() {
        let mut mass = Matrix6::zeros();
        for i in 0..3 {
            mass[(i, i)] = 2.0;
        }
        let moved = moved(&mass, [-0.5, 0.1]);
        let centre = mass_centre(&moved);
        assert!((centre[0] - 0.5).abs() < 1e-14 && (centre[1] + 0.1).abs() < 1e-14);
        assert!((moved[(3, 3)] - 2.0 * 0.26).abs() < 1e-14);
        assert!((moved[(4, 5)] - 2.0 * 0.05).abs() < 1e-14);
    }
}
