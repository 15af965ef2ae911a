//! Paths of equilibrium and their points, as data.

use crate::solve::Signature;
use crate::system::State;
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};

/// A point of the path and its unit tangent.
#[derive(Clone, Deserialize, Serialize)]
pub struct PathPoint {
    pub(super) state: State,
    pub(super) tangent: Vec<Vec3>,
    /// The tangent's part in the load factor
    pub(super) load_rate: f64,
    /// The rate of the displacement that the loads do work on
    pub(super) work_rate: f64,
    pub(super) signature: Option<Signature>,
    /// It is a limit point: one pivot is next to zero, with the sign of round-off
    pub(super) on_limit: bool,
    /// How the path bends there, where that is known
    pub(super) bend: Option<Bend>,
}

/// The change of the unit tangent over the length along the path, without its part in the tangent.
#[derive(Clone, Deserialize, Serialize)]
pub struct Bend {
    pub(super) rate: Vec<Vec3>,
    /// The part in the load factor
    pub(super) load_rate: f64,
    /// The length between the two tangents that it was taken from
    pub(super) over: f64,
}

/// A path being followed.
#[derive(Clone, Deserialize, Serialize)]
pub struct Path {
    /// The load factor at which it was begun
    pub(super) begun: f64,
    pub(super) here: PathPoint,
    /// The length of the next step
    pub(super) length: f64,
    /// Length of the first step: that which is wanted until it is taken
    pub(super) first: f64,
    /// The length that was wanted for the first step
    pub(super) wanted: f64,
    /// True once the first step is taken
    pub(super) has_begun: bool,
    /// The tangent's part in the load factor at the beginning
    pub(super) first_rate: f64,
    /// 1/U^2
    pub(super) scale: f64,
}
