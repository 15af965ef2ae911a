//! Resultants along whole beams at the end of each stage.

use super::beam_point::{BeamPoint, ElementCache};
use crate::run::{Moment, Snapshot};
use crate::section::recovery::PlacedRecovery;
use serde::{Deserialize, Serialize};

/// A place along a beam.
#[derive(Clone)]
pub struct ProfilePlace {
    /// The place
    pub inside: BeamPoint,
    /// Stresses of its section, where they are known
    pub section: Option<PlacedRecovery>,
}

/// Resultants along beams.
pub struct Profile {
    places: Vec<ProfilePlace>,
    ends: Vec<StageEnd>,
}

/// The last state of a stage.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct StageEnd {
    /// When
    pub moment: Moment,
    /// N1 N2 N3 M1 M2 M3, place by place
    pub resultants: Vec<[f64; 6]>,
}

impl Profile {
    /// A profile at places, with the ends of stages that lie behind.
    pub fn new(places: Vec<ProfilePlace>, ends: Vec<StageEnd>) -> Self {
        Self { places, ends }
    }

    /// The places.
    pub fn places(&self) -> &[ProfilePlace] {
        &self.places
    }

    /// The last states of the stages so far.
    pub fn ends(&self) -> &[StageEnd] {
        &self.ends
    }

    /// Takes a converged state.
    pub fn row(&mut self, at: &Snapshot) {
        let mut cache = ElementCache::new(at.state, at.origin);
        let of_place = |place: &ProfilePlace| place.inside.strain_and_stress(&mut cache)[1];
        let end = StageEnd { moment: at.moment(), resultants: self.places.iter().map(of_place).collect() };
        self.ends.retain(|known| known.moment.stage != at.stage);
        self.ends.push(end);
    }
}
