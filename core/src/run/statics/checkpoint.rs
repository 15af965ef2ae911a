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
    pub reached: usize,
    pub(super) levels: Levels,
    /// The signs of pivots are followed.
    pub follows_signs: bool,
    /// The stiffness of the last level is the first tangent of the next.
    pub is_given: bool,
    /// The unknowns that this stiffness belongs to, if they are not those of the state
    pub unflattened: Vec<Vec3>,
    /// The signs of pivots at the last level
    pub signature: Option<Signature>,
    /// The signs of pivots before the first level
    pub at_start: Option<Signature>,
}

/// A stage of arc length between two rows.
#[derive(Deserialize, Serialize)]
pub(in crate::run) struct ArcLengthCheckpoint {
    pub path: Path,
    pub progress: PathProgress,
}

/// How far a path has been followed.
#[derive(Clone, Copy, Deserialize, Serialize)]
pub(in crate::run) struct PathProgress {
    /// Increments so far
    pub increments: usize,
    /// Of these the last ones that came to no higher load than those before
    pub in_vain: usize,
    /// The highest load factor so far
    pub highest: f64,
    pub signs: RateSigns,
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
    pub rising: bool,
    /// The displacement that the loads do work on grows.
    pub working: bool,
}
