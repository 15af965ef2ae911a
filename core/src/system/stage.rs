//! Properties of a stage that effects and amplitudes depend on.

use serde::{Deserialize, Serialize};

/// Kind of a stage, by its time and load factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub enum StageKind {
    /// The load factor rises from 0 to 1 at constant time.
    Static,
    /// Time advances at load factor 1.
    Dynamic,
    /// Small vibrations about the state reached, at constant time and load factor.
    Modal,
    /// Critical load factors beyond the state reached, at constant time.
    Buckling,
}

impl StageKind {
    /// Tolerance of stages that name none: the part of the largest forces that may be out of balance.
    pub const TOLERANCE: f64 = 1e-9;
    /// Limit of Newton's iterations, of stages that name none.
    pub const MAX_ITERATIONS: usize = 25;

    /// True if time advances: inertia and damping act, and histories are functions of time.
    pub fn advances_time(self) -> bool {
        match self {
            Self::Dynamic => true,
            Self::Static | Self::Modal | Self::Buckling => false,
        }
    }

    /// True if the load factor rises from 0 to 1: histories are functions of it.
    pub fn ramps_load(self) -> bool {
        match self {
            Self::Static => true,
            Self::Dynamic | Self::Modal | Self::Buckling => false,
        }
    }

    /// True if the stage changes the state, in which the next stage begins.
    pub fn advances_state(self) -> bool {
        match self {
            Self::Static | Self::Dynamic => true,
            Self::Modal | Self::Buckling => false,
        }
    }

    /// True if the mass matrix is formed.
    pub fn needs_inertia(self) -> bool {
        match self {
            Self::Dynamic | Self::Modal => true,
            Self::Static | Self::Buckling => false,
        }
    }

    /// True if the stage requires mass at some free unknown.
    pub fn needs_mass(self) -> bool {
        match self {
            Self::Modal => true,
            Self::Static | Self::Dynamic | Self::Buckling => false,
        }
    }

    /// Load factor at the start, if the stages before have ended at load factor `reached`; `fresh`
    /// if some loads act for the first time.
    pub fn first_load(self, reached: f64, fresh: bool) -> f64 {
        match self {
            Self::Static => 0.0,
            Self::Dynamic => 1.0,
            Self::Buckling if fresh => 0.0,
            Self::Modal | Self::Buckling => reached,
        }
    }

    /// Load factor at the end, if the stage began at load factor `begun`.
    pub fn last_load(self, begun: f64) -> f64 {
        match self {
            Self::Static | Self::Dynamic => 1.0,
            Self::Modal | Self::Buckling => begun,
        }
    }
}

/// Numbers of the stages in which an effect or a load acts, from 0; `None` means all.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StageSet(pub Option<Vec<usize>>);

impl StageSet {
    /// True if the set contains the stage of this number (from 0).
    pub fn contains(&self, stage: usize) -> bool {
        self.0.as_ref().is_none_or(|stages| stages.contains(&stage))
    }
}

/// Properties of the current stage that effects depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageContext {
    /// Number of the stage, from 0
    pub number: usize,
    /// Kind of the stage
    pub kind: StageKind,
    /// True for stages in a rotating frame: static, modal and buckling ones, in which one effect represents all inertia.
    pub rotating: bool,
}
