//! Facts that stages leave to later ones.

use crate::system::State;
use serde::{Deserialize, Serialize};

/// Facts that stages leave to later ones, beside the state and the account of the energy.
#[derive(Clone, Default, Deserialize, Serialize)]
pub(super) struct EarlierStages {
    /// The first row is written.
    pub(super) started: bool,
    /// A dynamic stage has begun.
    pub(super) moving: bool,
    /// The state in which the first linear stage began
    pub(super) origin: Option<State>,
}
