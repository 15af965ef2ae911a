//! What a stage does, as far as effects and amplitudes need to know.

/// What a stage does with the clock and the load factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StageKind {
    /// The load factor goes from 0 to 1, the clock stands.
    Static,
    /// The clock runs, the load factor is 1.
    Dynamic,
    /// Small motions about the state that was reached: nothing goes on.
    Modal,
    /// The load factor goes on to where the state loses its stiffness.
    Buckling,
}

impl StageKind {
    /// The clock runs: inertia and damping act, and histories are read over the time.
    pub fn advances_time(self) -> bool {
        match self {
            Self::Dynamic => true,
            Self::Static | Self::Modal | Self::Buckling => false,
        }
    }

    /// The load factor goes from 0 to 1: histories are read over it.
    pub fn ramps_load(self) -> bool {
        match self {
            Self::Static => true,
            Self::Dynamic | Self::Modal | Self::Buckling => false,
        }
    }

    /// It leads to another state, in which the next stage begins.
    pub fn advances_state(self) -> bool {
        match self {
            Self::Static | Self::Dynamic => true,
            Self::Modal | Self::Buckling => false,
        }
    }

    /// The mass matrix is formed.
    pub fn needs_inertia(self) -> bool {
        match self {
            Self::Dynamic | Self::Modal => true,
            Self::Static | Self::Buckling => false,
        }
    }

    /// It cannot begin where nothing that is free to move has mass.
    pub fn needs_mass(self) -> bool {
        match self {
            Self::Modal => true,
            Self::Static | Self::Dynamic | Self::Buckling => false,
        }
    }

    /// The load factor that it begins with, where the stages before have come to `reached`;
    /// `fresh`: whether loads act for the first time.
    pub fn first_load(self, reached: f64, fresh: bool) -> f64 {
        match self {
            Self::Static => 0.0,
            Self::Dynamic => 1.0,
            Self::Buckling if fresh => 0.0,
            Self::Modal | Self::Buckling => reached,
        }
    }

    /// The load factor that it ends with, where it began with `begun`.
    pub fn last_load(self, begun: f64) -> f64 {
        match self {
            Self::Static | Self::Dynamic => 1.0,
            Self::Modal | Self::Buckling => begun,
        }
    }
}

/// The stages in which something acts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StageSet(pub Option<Vec<usize>>);

impl StageSet {
    /// Whether stage number `stage` (from 0) is one of them; no list means all.
    pub fn contains(&self, stage: usize) -> bool {
        self.0.as_ref().is_none_or(|stages| stages.contains(&stage))
    }
}

/// A stage as effects see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageContext {
    /// From 0
    pub number: usize,
    /// What it does
    pub kind: StageKind,
    /// Whether it is seen from a frame that rotates, whose own effect then holds all inertia
    pub rotating: bool,
}
