//! Static stages as parts of a checkpoint.

use super::levels::Levels;
use super::path_point::{Path, PathPoint};
use crate::solve::Signature;
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};

/// A stage of load levels between two rows.
#[derive(Deserialize, Serialize)]
pub(in crate::run) struct LevelsCheckpoint {
    /// The number of levels that are reached
    pub(super) reached: usize,
    pub(super) levels: Levels,
    /// The signs of pivots are followed.
    pub(super) follows_signs: bool,
    /// The stiffness of the last level is the first tangent of the next.
    pub(super) is_given: bool,
    /// The unknowns that this stiffness belongs to, if they are not those of the state
    pub(super) unflattened: Vec<Vec3>,
    /// The signs of pivots at the last level
    pub(super) signature: Option<Signature>,
    /// The signs of pivots before the first level
    pub(super) at_start: Option<Signature>,
}

/// A stage of arc length between two rows.
#[derive(Deserialize, Serialize)]
pub(in crate::run) struct ArcLengthCheckpoint {
    pub(super) path: Path,
    pub(super) progress: PathProgress,
}

/// How far a path has been followed.
#[derive(Clone, Copy, Deserialize, Serialize)]
pub(in crate::run) struct PathProgress {
    /// Increments so far
    pub(super) increments: usize,
    /// Of these the last ones that came to no higher load than those before
    pub(super) in_vain: usize,
    /// The highest load factor so far
    pub(super) highest: f64,
    pub(super) signs: RateSigns,
}

impl PathProgress {
    /// At the beginning of a path.
    pub fn new(path: &Path) -> Self {
        let PathPoint { load_rate, work_rate, state, .. } = &path.here;
        let signs = RateSigns { rising: *load_rate > 0.0, working: *work_rate > 0.0 };
        Self { increments: 0, in_vain: 0, highest: state.load, signs }
    }
}

/// The signs that were passed last: on a located point itself they are nobody's.
#[derive(Clone, Copy, Deserialize, Serialize)]
pub(in crate::run) struct RateSigns {
    /// The load factor grows.
    pub(super) rising: bool,
    /// The displacement that the loads do work on grows.
    pub(super) working: bool,
}
