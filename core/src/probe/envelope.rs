//! The largest stresses over the time of a run, at places along beams.

use super::beam_point::{ElementCache, StressPlace};
use super::largest_row::{Extreme, LargestRow, Row};
use crate::run::Snapshot;
use crate::section::recovery::{Criterion, PlacedRecovery};
use serde::{Deserialize, Serialize};

/// The largest stresses so far.
pub struct Envelope {
    places: Vec<StressPlace>,
    followed: Vec<Followed>,
}

/// The rows of a place that have, or may have, its largest stresses.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Followed {
    von_mises: LargestRow,
    index: LargestRow,
}

/// True if the largest failure index does not follow from the largest von Mises stress.
fn has_own_index(section: &PlacedRecovery) -> bool {
    section.section().has_strength() && section.section().yield_stress_alone().is_none()
}

/// The largest stresses of a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    /// Largest von Mises stress
    pub von_mises: Option<Extreme>,
    /// Largest failure index, in sections with strengths
    pub index: Option<Extreme>,
}

impl Envelope {
    /// An envelope at places, before the first row.
    pub fn new(places: Vec<StressPlace>) -> Self {
        let followed = vec![Followed::default(); places.len()];
        Self { places, followed }
    }

    /// An envelope that goes on from rows that were followed before.
    pub fn resume(places: Vec<StressPlace>, followed: Vec<Followed>) -> Self {
        let mut envelope = Self::new(places);
        envelope.followed.iter_mut().zip(followed).for_each(|(new, old)| *new = old);
        envelope
    }

    /// The places.
    pub fn places(&self) -> &[StressPlace] {
        &self.places
    }

    /// The rows that have, or may have, the largest stresses, place by place.
    pub fn followed(&self) -> &[Followed] {
        &self.followed
    }

    /// The largest stresses so far, place by place.
    pub fn found(&self) -> Vec<Extremes> {
        let of_place = |(place, followed): (&StressPlace, &Followed)| Extremes {
            von_mises: followed.von_mises.found(&place.section, Criterion::VonMises),
            index: match place.section.section().yield_stress_alone() {
                Some(limit) => {
                    followed.von_mises.found(&place.section, Criterion::VonMises).map(|found| found.over(limit))
                }
                None => followed.index.found(&place.section, Criterion::FailureIndex),
            },
        };
        self.places.iter().zip(&self.followed).map(of_place).collect()
    }

    /// Takes a converged state.
    pub fn row(&mut self, at: &Snapshot) {
        let moment = at.moment();
        let mut cache = ElementCache::new(at.state, at.origin);
        for (place, Followed { von_mises, index }) in self.places.iter().zip(&mut self.followed) {
            // At a node with a force or a moment both sides differ.
            for [_, resultant] in place.inside.at_sides(&mut cache) {
                von_mises.row(&place.section, Criterion::VonMises, Row { moment, resultant });
                if has_own_index(&place.section) {
                    index.row(&place.section, Criterion::FailureIndex, Row { moment, resultant });
                }
            }
        }
    }
}
