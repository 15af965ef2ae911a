//! Elastic materials and the orientation of their axes.

use super::error::{SectionError, check_positive};
use super::{Matrix6, Vector6};
use nalgebra::Matrix3;

/// Largest Poisson's ratio of an isotropic material
const MAX_POISSON_RATIO: f64 = 0.4999;

/// Pairs of axes of the six components 11 22 33 23 13 12
const AXES_OF_COMPONENT: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

/// A linear elastic material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name, for messages
    pub name: String,
    /// Elastic constants
    pub elastic: Elastic,
    /// Density, mass per volume
    pub density: f64,
}

/// Elastic constants. Orthotropic materials have axes 1 (fibre), 2 (in the ply) and 3 (normal).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Elastic {
    /// Equal in all directions
    Isotropic {
        /// Young's modulus
        e: f64,
        /// Poisson's ratio
        nu: f64,
    },
    /// Different in three normal directions; nu_ij / E_i = nu_ji / E_j
    Orthotropic {
        /// E1, E2, E3
        e: [f64; 3],
        /// G12, G13, G23
        g: [f64; 3],
        /// nu12, nu13, nu23
        nu: [f64; 3],
    },
}

impl Material {
    /// An isotropic material.
    pub fn isotropic(name: &str, e: f64, nu: f64, density: f64) -> Self {
        Self { name: name.to_string(), elastic: Elastic::Isotropic { e, nu }, density }
    }

    /// True if orientation does not matter.
    pub fn is_isotropic(&self) -> bool {
        matches!(self.elastic, Elastic::Isotropic { .. })
    }

    /// Shear modulus of an isotropic material.
    pub fn shear_modulus(&self) -> Option<f64> {
        match self.elastic {
            Elastic::Isotropic { e, nu } => Some(0.5 * e / (1.0 + nu)),
            Elastic::Orthotropic { .. } => None,
        }
    }

    /// The stiffness in material axes, checked to be positive definite.
    pub fn stiffness(&self) -> Result<Matrix6, SectionError> {
        self.check_constants()?;
        let not_definite = || SectionError::NotPositiveDefinite { material: self.name.clone() };
        let compliance = self.compliance();
        // Scaled to a unit diagonal, so that the units of the moduli do not matter.
        let scale = Vector6::from_fn(|i, _| 1.0 / compliance[(i, i)].sqrt());
        let scaled = Matrix6::from_fn(|i, j| compliance[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky().ok_or_else(not_definite)?.inverse();
        let stiffness = Matrix6::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
        if stiffness.iter().all(|entry| entry.is_finite()) { Ok(stiffness) } else { Err(not_definite()) }
    }

    /// Signs and limits of the constants.
    fn check_constants(&self) -> Result<(), SectionError> {
        let name = &self.name;
        let positive = |what: &str, value: f64| check_positive(format!("{what} of material `{name}`"), value);
        if self.density < 0.0 || !self.density.is_finite() {
            positive("the density", self.density)?;
        }
        match self.elastic {
            Elastic::Isotropic { e, nu } => {
                positive("E", e)?;
                if nu <= -1.0 || nu > MAX_POISSON_RATIO || nu.is_nan() {
                    return Err(SectionError::PoissonRatio { material: name.clone(), nu });
                }
            }
            Elastic::Orthotropic { e, g, .. } => {
                for (what, value) in ["E1", "E2", "E3"].iter().zip(e).chain(["G12", "G13", "G23"].iter().zip(g)) {
                    positive(what, value)?;
                }
            }
        }
        Ok(())
    }

    /// The compliance in material axes.
    pub fn compliance(&self) -> Matrix6 {
        let (e, g, nu) = match self.elastic {
            Elastic::Isotropic { e, nu } => ([e; 3], [0.5 * e / (1.0 + nu); 3], [nu; 3]),
            Elastic::Orthotropic { e, g, nu } => (e, g, nu),
        };
        let mut compliance = Matrix6::zeros();
        for axis in 0..3 {
            compliance[(axis, axis)] = 1.0 / e[axis];
        }
        for (i, j, ratio) in [(0, 1, nu[0]), (0, 2, nu[1]), (1, 2, nu[2])] {
            compliance[(i, j)] = -ratio / e[i];
            compliance[(j, i)] = -ratio / e[i];
        }
        for (component, modulus) in [(5, g[0]), (4, g[1]), (3, g[2])] {
            compliance[(component, component)] = 1.0 / modulus;
        }
        compliance
    }
}

/// Axes of a material in the section, as rows fibre, transverse and normal.
///
/// The wall tangent is t = (0, cos beta, sin beta), the normal n = e1 x t. The fibre is
/// cos theta e1 + sin theta t: positive theta turns it from axis 1 towards the tangent.
pub fn material_axes(beta: f64, theta: f64) -> Matrix3<f64> {
    let (sin_beta, cos_beta) = libm::sincos(beta);
    let (sin_theta, cos_theta) = libm::sincos(theta);
    Matrix3::new(
        cos_theta,
        sin_theta * cos_beta,
        sin_theta * sin_beta,
        -sin_theta,
        cos_theta * cos_beta,
        cos_theta * sin_beta,
        0.0,
        -sin_beta,
        cos_beta,
    )
}

/// T of e_m = T e: engineering strains in rotated axes (the rows of `axes`).
pub fn strain_rotation(axes: &Matrix3<f64>) -> Matrix6 {
    Matrix6::from_fn(|row, column| {
        let (a, b) = AXES_OF_COMPONENT[row];
        let (c, d) = AXES_OF_COMPONENT[column];
        let straight = axes[(a, c)] * axes[(b, d)];
        let crossed = axes[(a, d)] * axes[(b, c)];
        match (a == b, c == d) {
            (true, _) => straight,
            (false, true) => 2.0 * straight,
            (false, false) => straight + crossed,
        }
    })
}

/// The stiffness in section axes of a material with the given axes: T' Q_m T.
pub fn rotated_stiffness(in_material_axes: &Matrix6, axes: &Matrix3<f64>) -> Matrix6 {
    let rotation = strain_rotation(axes);
    let rotated = rotation.transpose() * in_material_axes * rotation;
    0.5 * (rotated + rotated.transpose())
}

/// Stresses in material axes: R s R' with R the rows of `axes`.
pub fn stress_in_material_axes(stress: &Vector6, axes: &Matrix3<f64>) -> Vector6 {
    from_tensor(&(axes * tensor(stress) * axes.transpose()))
}

/// The symmetric tensor of six stresses.
pub fn tensor(s: &Vector6) -> Matrix3<f64> {
    Matrix3::new(s[0], s[5], s[4], s[5], s[1], s[3], s[4], s[3], s[2])
}

/// The six components of a symmetric tensor of stresses.
fn from_tensor(tensor: &Matrix3<f64>) -> Vector6 {
    Vector6::from_fn(|component, _| {
        let (a, b) = AXES_OF_COMPONENT[component];
        tensor[(a, b)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ply() -> Material {
        let elastic = Elastic::Orthotropic { e: [142e9, 9.8e9, 9.8e9], g: [6e9, 6e9, 4.8e9], nu: [0.3, 0.3, 0.34] };
        Material { name: "ply".to_string(), elastic, density: 1600.0 }
    }

    #[test]
    fn isotropic_stiffness_is_lames() {
        let q = Material::isotropic("steel", 210.0, 0.3, 1.0).stiffness().unwrap();
        let lambda = 210.0 * 0.3 / (1.3 * 0.4);
        let shear = 210.0 / 2.6;
        assert!((q[(0, 0)] - (lambda + 2.0 * shear)).abs() < 1e-10);
        assert!((q[(0, 1)] - lambda).abs() < 1e-10);
        assert!((q[(3, 3)] - shear).abs() < 1e-10);
    }

    #[test]
    fn isotropic_stiffness_does_not_change_by_turning() {
        let q = Material::isotropic("steel", 210.0, 0.3, 1.0).stiffness().unwrap();
        let turned = rotated_stiffness(&q, &material_axes(0.7, -0.4));
        assert!((q - turned).abs().max() < 1e-12 * q[(0, 0)]);
    }

    #[test]
    fn quarter_turn_exchanges_fibre_and_tangent() {
        let q = ply().stiffness().unwrap();
        let turned = rotated_stiffness(&q, &material_axes(0.0, std::f64::consts::FRAC_PI_2));
        assert!((turned[(1, 1)] - q[(0, 0)]).abs() < 1e-6 * q[(0, 0)]);
        assert!((turned[(4, 4)] - q[(3, 3)]).abs() < 1e-6 * q[(0, 0)]);
    }

    #[test]
    fn positive_theta_couples_tension_with_positive_shear_stress() {
        // A fibre along cos theta e1 + sin theta e2 carries a stress s f f': s11 and s12 of one
        // sign.
        let q = rotated_stiffness(&ply().stiffness().unwrap(), &material_axes(0.0, 0.3));
        assert!(q[(0, 5)] > 0.0 && q[(0, 4)].abs() < 1e-3);
    }

    #[test]
    fn stresses_and_strains_rotate_with_the_same_energy() {
        let axes = material_axes(0.4, 1.1);
        let strain = Vector6::new(0.1, -0.2, 0.3, 0.5, -0.7, 0.2);
        let stress = Vector6::new(1.0, 3.0, -2.0, 0.3, 0.9, -0.4);
        let turned = stress_in_material_axes(&stress, &axes).dot(&(strain_rotation(&axes) * strain));
        assert!((turned - stress.dot(&strain)).abs() < 1e-12);
    }

    #[test]
    fn impossible_constants_are_refused() {
        let mut bad = ply();
        bad.elastic = Elastic::Orthotropic { e: [10.0, 1.0, 1.0], g: [1.0; 3], nu: [3.5, 0.1, 0.1] };
        assert!(matches!(bad.stiffness(), Err(SectionError::NotPositiveDefinite { .. })));
        let rubber = Material::isotropic("rubber", 1.0, 0.5, 1.0);
        assert!(matches!(rubber.stiffness(), Err(SectionError::PoissonRatio { .. })));
        let negative = Material::isotropic("none", -1.0, 0.3, 1.0);
        assert!(negative.stiffness().unwrap_err().to_string().contains("E of material `none`"));
    }
}
