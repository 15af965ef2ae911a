//! Why a stage cannot begin.

use crate::system::{FrameConflict, Slot, StageKind};

/// Largest jump of a motor at the start of a dynamic stage, in radians or relative to the scene's
/// length.
pub const LARGEST_GAP: f64 = 1e-6;

/// Why a stage cannot begin.
#[derive(Clone, Debug, PartialEq)]
pub enum StageError {
    /// Two constraints on one node are neither the same nor orthogonal.
    Conflict(FrameConflict),
    /// A motion would have to jump.
    Jump(Jump),
    /// A support would hold single components of a rotation that is not zero there.
    TurnedHinge(Slot),
    /// A motor would have to jump.
    MotorJump(MotorJump),
    /// A surface would have to jump.
    SurfaceJump(SurfaceJump),
    /// A path or a search for critical loads, and nothing goes with the load factor.
    NothingGrows(StageKind),
    /// A search for modes, and nothing that is free to move has mass.
    NoMass,
}

/// A motion that would have to jump when a stage begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Jump {
    /// The number of the motion in the deck
    pub motion: usize,
    /// Where the node is
    pub(crate) from: f64,
    /// Where the motion begins
    pub(crate) to: f64,
}

/// A motor that would have to jump when a stage begins.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorJump {
    /// The slot of its multiplier
    pub slot: Slot,
    /// The number of its amplitude
    pub(crate) amplitude: usize,
    /// True where it turns, false where it slides
    pub(crate) turns: bool,
    /// The angle or displacement that it has reached
    pub(crate) from: f64,
    /// Where it begins
    pub(crate) to: f64,
}

/// A surface that would have to jump when a dynamic stage begins.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceJump {
    /// Its name
    pub(crate) surface: String,
    /// The number of its amplitude
    pub amplitude: usize,
    /// True where it turns, false where it is displaced
    pub(crate) turns: bool,
    /// The angle or displacement that it has reached
    pub(crate) from: f64,
    /// Where it begins
    pub(crate) to: f64,
}
