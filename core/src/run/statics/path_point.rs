//! Paths of equilibrium and their points, as data.

use crate::solve::Signature;
use crate::system::State;
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};

/// A point of the path and its unit tangent.
#[derive(Clone, Deserialize, Serialize)]
pub struct PathPoint {
    pub state: State,
    pub tangent: Vec<Vec3>,
    /// The tangent's part in the load factor
    pub load_rate: f64,
    /// The rate of the displacement that the loads do work on
    pub work_rate: f64,
    pub signature: Option<Signature>,
    /// It is a limit point: one pivot is next to zero, with the sign of round-off
    pub on_limit: bool,
}

/// A path being followed.
#[derive(Clone, Deserialize, Serialize)]
pub struct Path {
    /// The load factor at which it was begun
    pub begun: f64,
    pub here: PathPoint,
    /// The length of the next step
    pub length: f64,
    /// Length of the first step
    pub first: f64,
    /// The tangent's part in the load factor at the beginning
    pub first_rate: f64,
    /// 1/U^2
    pub scale: f64,
}
