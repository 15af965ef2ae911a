//! Warnings that a run has given already.

use crate::effect::Penetration;
use serde::{Deserialize, Serialize};

/// Warnings that have been given already, and how bad what they tell of was.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(super) struct IssuedWarnings {
    /// That an element turns far from node to node
    pub(super) coarse: bool,
    /// That tension makes bending decay over less than elements resolve
    pub(super) layers: bool,
    /// How many limit and branch points
    pub(super) points: usize,
    /// How uncertain round-off leaves displacements; below the first value nothing is worth a
    /// warning.
    pub(super) uncertainty: f64,
    /// By how much strains depend on the orientation; below the first value nothing is worth a
    /// warning.
    pub(super) frame: f64,
    pub(super) soft: bool,
    /// That friction is held by a soft spring
    pub(super) soft_stick: bool,
    pub(super) axis: bool,
    pub(super) subdivision: bool,
    /// How far a node has gone in a dynamic stage of fixed steps
    pub(super) moved: f64,
    /// That the account of the energy is off
    pub(super) unbalanced: bool,
    /// That supports or motions have changed velocities at the start of a dynamic stage
    pub(super) caught: bool,
    /// The stage in which the plane would be left
    pub(super) unstable: Option<usize>,
    /// The deepest penetration between points of contact in rows of the present static stage, and its load factor
    pub(super) hidden: Option<(Penetration, f64)>,
    /// Where friction has turned round in the present static stage
    pub(super) reversals: FrictionReversals,
}

/// The energy that elastic stick stores in rows of a static stage, and gives back where sliding turns round.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
pub(super) struct FrictionReversals {
    /// The energy in the springs of friction in the last row, and what it is where all points slide
    pub(super) in_springs: [f64; 2],
    /// The energy that they have given back, without that of points that are no longer pressed as hard
    pub(super) given_back: f64,
    /// The largest strain energy of rows by which they have given some back
    pub(super) strain: f64,
    /// The contact of the point that had given way farthest in the last of these rows in which one stuck
    pub(super) contact: Option<String>,
    /// What friction had taken at the start of the stage
    pub(super) taken_before: f64,
}

impl Default for IssuedWarnings {
    fn default() -> Self {
        Self {
            coarse: false,
            layers: false,
            points: 0,
            uncertainty: 1e-7,
            frame: 1e-2,
            soft: false,
            soft_stick: false,
            axis: false,
            subdivision: false,
            moved: 0.0,
            unbalanced: false,
            caught: false,
            unstable: None,
            hidden: None,
            reversals: FrictionReversals::default(),
        }
    }
}
