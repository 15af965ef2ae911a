//! The largest stresses over the time of a run, at places along beams.

use super::place::StressPlace;
use crate::run::{Moment, Snapshot};
use crate::section::recovery::Measure;
use crate::section::stress::Peak;
use crate::section::{Point, Vector6};
use serde::{Deserialize, Serialize};

/// The largest stresses so far.
pub struct Envelope {
    places: Vec<StressPlace>,
    found: Vec<Extremes>,
}

/// The largest stresses of a place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct Extremes {
    /// Largest von Mises stress
    pub von_mises: Option<Extreme>,
    /// Largest failure index, in sections with strengths
    pub index: Option<Extreme>,
}

/// The largest value so far, with when and where it was.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Extreme {
    /// The value
    pub value: f64,
    /// When
    pub moment: Moment,
    /// Coordinates 2 and 3 of the shape
    pub at: Point,
    /// Index of the region
    pub region: usize,
    /// N1 N2 N3 M1 M2 M3 then
    pub resultant: [f64; 6],
}

impl Envelope {
    /// An envelope at places, before the first row.
    pub fn new(places: Vec<StressPlace>) -> Self {
        let found = vec![Extremes::default(); places.len()];
        Self { places, found }
    }

    /// An envelope that goes on from what was found before.
    pub fn resume(places: Vec<StressPlace>, found: Vec<Extremes>) -> Self {
        let mut envelope = Self::new(places);
        envelope.found.iter_mut().zip(found).for_each(|(new, old)| *new = old);
        envelope
    }

    /// The places.
    pub fn places(&self) -> &[StressPlace] {
        &self.places
    }

    /// The largest stresses so far, place by place.
    pub fn found(&self) -> &[Extremes] {
        &self.found
    }

    /// Takes a converged state.
    pub fn row(&mut self, at: &Snapshot) {
        for (place, found) in self.places.iter().zip(&mut self.found) {
            let load = place.inside.resultant(at.state, at.origin);
            let floor = |extreme: &Option<Extreme>| extreme.map_or(f64::NEG_INFINITY, |extreme| extreme.value);
            let extreme = |Peak { value, at: point, region }: Peak| Extreme {
                value,
                moment: at.moment(),
                at: point,
                region,
                resultant: resultants(&load),
            };
            let section = &place.section;
            if let Some(peak) = section.largest(Measure::VonMises, &load, floor(&found.von_mises)) {
                found.von_mises = Some(extreme(peak));
            }
            if let Some(peak) = section.largest_index(&load, floor(&found.index)) {
                found.index = Some(extreme(peak));
            }
        }
    }
}

fn resultants(load: &Vector6) -> [f64; 6] {
    std::array::from_fn(|k| load[k])
}
