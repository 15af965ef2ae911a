//! Failure indices: the stress relative to the strength of a material.
//!
//! All measures are strength ratios inverted: 1 at failure, and proportional to the load.

use super::Vector6;
use super::material::Material;
use super::stress::von_mises;

/// Strengths in the axes of an orthotropic material, all positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strengths {
    /// In tension along 1, 2, 3
    pub tension: [f64; 3],
    /// In compression along 1, 2, 3
    pub compression: [f64; 3],
    /// In shear: 23, 13, 12
    pub shear: [f64; 3],
}

impl Strengths {
    /// Strengths of a ply: Xt, Xc, Yt, Yc and S12. Those along 3 are those along 2, all shear
    /// strengths are one.
    pub fn ply(xt: f64, xc: f64, yt: f64, yc: f64, s12: f64) -> Self {
        Self { tension: [xt, yt, yt], compression: [xc, yc, yc], shear: [s12; 3] }
    }

    /// Inverse of the factor R by which a load grows to failure after Tsai and Wu 1971
    /// (doi:10.1177/002199837100500106): a R^2 + b R = 1, with interaction F_ij = -sqrt(F_ii F_jj)
    /// / 2.
    pub fn tsai_wu_index(&self, stress: &Vector6) -> f64 {
        let mut linear = 0.0;
        let mut quadratic = 0.0;
        let mut square_roots = [0.0; 3];
        for axis in 0..3 {
            let s = stress[axis];
            let [tension, compression] = [self.tension[axis], self.compression[axis]];
            linear += s * (1.0 / tension - 1.0 / compression);
            quadratic += s * s / (tension * compression);
            quadratic += (stress[3 + axis] / self.shear[axis]).powi(2);
            square_roots[axis] = s / (tension * compression).sqrt();
        }
        let [first, second, third] = square_roots;
        quadratic -= first * second + first * third + second * third;
        // 1 / R from R = (-b + sqrt(b^2 + 4 a)) / (2 a), written without a division by a.
        0.5 * (linear + (linear * linear + 4.0 * quadratic.max(0.0)).sqrt())
    }
}

/// What a material bears: the largest of the indices of its laws counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FailureLaw {
    /// Von Mises stress at yield
    pub yield_stress: Option<f64>,
    /// Strengths in the axes of the material, after Tsai and Wu
    pub strengths: Option<Strengths>,
    /// Strain along the fibre per stress in material axes, over the largest strain
    pub(crate) fibre_strain: Option<Vector6>,
}

impl FailureLaw {
    /// With a largest strain along the fibre of a material.
    pub fn with_strain_limit(self, material: &Material, limit: f64) -> Self {
        Self { fibre_strain: Some(material.compliance().row(0).transpose() / limit), ..self }
    }

    /// True if only von Mises stress counts.
    pub fn is_yield_alone(&self) -> bool {
        self.strengths.is_none() && self.fibre_strain.is_none()
    }

    /// The index of a stress in material axes.
    pub fn index(&self, stress: &Vector6) -> f64 {
        let yielding = self.yield_stress.map_or(0.0, |limit| von_mises(stress) / limit);
        let breaking = self.strengths.map_or(0.0, |strengths| strengths.tsai_wu_index(stress));
        let straining = self.fibre_strain.map_or(0.0, |strain| strain.dot(stress).abs());
        yielding.max(breaking).max(straining)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_are_one_at_the_strength_in_each_direction() {
        let strengths = Strengths::ply(1200.0, 800.0, 50.0, 160.0, 70.0);
        let mut states = vec![(5, 70.0), (4, -70.0), (3, 70.0)];
        for axis in 0..3 {
            states.push((axis, strengths.tension[axis]));
            states.push((axis, -strengths.compression[axis]));
        }
        for (component, value) in states {
            for factor in [0.5, 1.0, 2.0] {
                let stress = Vector6::ith(component, factor * value);
                assert!((strengths.tsai_wu_index(&stress) - factor).abs() < 1e-12);
            }
        }
        assert_eq!(strengths.tsai_wu_index(&Vector6::zeros()), 0.0);
    }
}
