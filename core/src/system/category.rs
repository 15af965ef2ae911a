//! Categories of nodal forces.

/// Categories of forces, which the stop test of Newton's iteration and the energy account treat
/// separately.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Category {
    /// Forces of stress resultants and springs
    Internal,
    /// Inertia forces, mass times acceleration in all forms
    Inertia,
    /// Loads, added with the opposite sign
    External,
    /// Dissipative forces, functions of velocities
    Damping,
}

impl Category {
    /// All categories, in the order of their indices.
    pub const ALL: [Self; 4] = [Self::Internal, Self::Inertia, Self::External, Self::Damping];
}
