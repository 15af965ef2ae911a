//! Sections of beams as matrices in their own axes: the first is the tangent of the centre line.

use crate::kernel::elastic::Stiffness;
use crate::kernel::inertia::Inertia;
use crate::tensor::{Mat3, Vec3};

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

    /// The section with a mass per length on the centre line, and inertia per length about the section axes.
    pub fn with_mass(self, mass: f64, about_axes: [f64; 3]) -> Self {
        let mass = MassPerLength { mass, offset: Vec3::ZERO, about_line: Mat3::diagonal(about_axes) };
        Self { mass: Some(mass), ..self }
    }

    /// The stiffness in global components, for section axes R0.
    pub fn stiffness_in(&self, r0: Mat3) -> Stiffness {
        let block = |row: usize, column: usize| {
            Mat3([0, 1, 2].map(|i| [0, 1, 2].map(|j| self.stiffness[3 * row + i][3 * column + j])))
        };
        let turned = |m: Mat3| r0 * m * r0.transpose();
        let coupling = block(0, 1);
        Stiffness {
            cn: turned(block(0, 0)),
            cm: turned(block(1, 1)),
            cc: (coupling != Mat3::ZERO).then(|| turned(coupling)),
        }
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
