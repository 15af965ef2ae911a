//! Sections of beams as matrices in their own axes: the first is the tangent of the centre line.

use crate::effect::elasticity::BeamLaw;
use crate::kernel::inertia::Inertia;
use crate::kernel::law::{Linear, Stiffness};
use crate::tensor::{Mat3, Vec3};

/// Largest relative difference of stiffnesses, or of inertias, about two axes that a section does not tell apart.
const ALIKE: f64 = 1e-9;

/// Stiffness and mass of a section, local axes, order Gamma1 Gamma2 Gamma3 K1 K2 K3.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionMatrices {
    /// Stiffness
    pub stiffness: [[f64; 6]; 6],
    /// Mass per length, where given
    pub mass: Option<MassPerLength>,
}

/// Mass properties per length, local axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassPerLength {
    /// Mass
    pub mass: f64,
    /// Mass centre in the section
    pub offset: Vec3,
    /// Inertia about the centre line
    pub about_line: Mat3,
}

impl SectionMatrices {
    /// Uncoupled and without mass: EA, GA2, GA3, GJ, EI2, EI3.
    pub fn diagonal(resultants: [f64; 6]) -> Self {
        let entry = |i: usize, j: usize| if i == j { resultants[i] } else { 0.0 };
        Self { stiffness: std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j))), mass: None }
    }

    /// The section with a mass per length on the centre line, and inertia per length about the
    /// section axes.
    pub fn with_mass(self, mass: f64, about_axes: [f64; 3]) -> Self {
        let mass = MassPerLength { mass, offset: Vec3::ZERO, about_line: Mat3::diagonal(about_axes) };
        Self { mass: Some(mass), ..self }
    }

    /// The viscosity that damps each strain i by a factor f_i of its own, in global components, for
    /// section axes R0. A coupling has the geometric mean of two factors, sqrt(f_i f_j), so that the
    /// viscosity is symmetric and never gives energy.
    pub fn viscosity_in(&self, r0: Mat3, factors: &[f64; 6]) -> Stiffness {
        let entry = |i: usize, j: usize| match i == j {
            true => factors[i] * self.stiffness[i][i],
            false => (factors[i] * factors[j]).sqrt() * self.stiffness[i][j],
        };
        let stiffness = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
        Self { stiffness, mass: None }.law_in(r0).stiffness
    }

    /// The law in global components, for section axes R0.
    pub fn law_in(&self, r0: Mat3) -> BeamLaw {
        let block = |row: usize, column: usize| {
            Mat3([0, 1, 2].map(|i| [0, 1, 2].map(|j| self.stiffness[3 * row + i][3 * column + j])))
        };
        let turned = |m: Mat3| r0 * m * r0.transpose();
        let coupling = block(0, 1);
        let stiffness = Stiffness {
            cn: turned(block(0, 0)),
            cm: turned(block(1, 1)),
            cc: (coupling != Mat3::ZERO).then(|| turned(coupling)),
        };
        Linear { stiffness }
    }

    /// True if the section bends, shears and has inertia about all axes across the beam alike, and couples nothing.
    pub fn is_round(&self) -> bool {
        let Self { stiffness: k, mass } = self;
        let j = mass.map_or(Mat3::ZERO, |mass| mass.about_line).0;
        let turns_alike = (j[1][1] - j[2][2]).abs() <= ALIKE * j[1][1].abs() && [j[0][1], j[0][2], j[1][2]] == [0.0; 3];
        let size = |i: usize| k[i][i].abs();
        let alike = |i: usize, j: usize| (k[i][i] - k[j][j]).abs() <= ALIKE * size(i).max(size(j));
        let apart = |i: usize, j: usize| i == j || k[i][j].abs() <= ALIKE * (size(i) * size(j)).sqrt();
        turns_alike && alike(1, 2) && alike(4, 5) && (0..6).all(|i| (0..6).all(|j| apart(i, j)))
    }

    /// The mass per length: zero where none is given.
    pub fn mass_per_length(&self) -> MassPerLength {
        self.mass.unwrap_or(MassPerLength { mass: 0.0, offset: Vec3::ZERO, about_line: Mat3::ZERO })
    }
}

impl MassPerLength {
    /// The mass properties in global components, for section axes R0.
    pub fn turned(&self, r0: Mat3) -> Inertia {
        Inertia { mass: self.mass, offset: r0 * self.offset, about_node: r0 * self.about_line * r0.transpose() }
    }
}
