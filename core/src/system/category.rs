//! The categories that forces are summed in.

/// Categories of forces, which the stop test of Newton and the energy account look at apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Category {
    /// Stress resultants and springs
    Internal,
    /// Mass times acceleration, in all its forms
    Inertia,
    /// Loads, entered with the opposite sign
    External,
    /// What takes energy away with velocities
    Damping,
}

impl Category {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Internal, Self::Inertia, Self::External, Self::Damping];
}
