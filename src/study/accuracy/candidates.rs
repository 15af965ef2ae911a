//! What a round tells of the errors of variants, and which of these are accurate enough.

use super::estimate::Share;
use super::round::Round;
use crate::study::cost::{Pace, Point};

/// The error of a variant.
pub struct Estimate {
    /// What comes from the mesh
    pub mesh: Share,
    /// And from the steps
    pub step: Share,
}

impl Estimate {
    /// The largest of all outputs, over what is wanted of it.
    pub fn ratio(&self) -> f64 {
        self.mesh.largest + self.step.largest
    }
}

/// The errors that a round tells of.
pub struct Estimates {
    /// Of its variant
    pub own: Estimate,
    /// The share of the other mesh
    pub remeshed: Option<Share>,
}

/// A variant that is accurate enough.
pub struct Candidate {
    /// The variant
    pub point: Point,
    /// Its error
    pub estimate: Estimate,
    /// Whether the round has run it
    pub has_run: bool,
}

impl Estimates {
    /// The variants of a round that are accurate enough, the cheapest first.
    pub fn accurate_enough(&self, round: &Round) -> Vec<Candidate> {
        let step = |pace: Pace| if pace == round.own.pace { self.own.step.clone() } else { self.own.step.of_coarser() };
        let of = |point: &Point, mesh: &Share, has_run| {
            let estimate = Estimate { mesh: mesh.clone(), step: step(point.pace) };
            Candidate { point: point.clone(), estimate, has_run }
        };
        let mut all = vec![of(&round.own, &self.own.mesh, true)];
        all.extend(round.longer.as_ref().map(|(longer, _)| of(longer, &self.own.mesh, true)));
        if let (Some(share), Some((remeshed, _))) = (&self.remeshed, &round.remeshed) {
            all.push(of(remeshed, share, true));
            let alike = round.remeshed_alike().filter(|alike| alike.pace != remeshed.pace);
            all.extend(alike.map(|alike| of(&alike, share, false)));
        }
        all.retain(|candidate| candidate.estimate.ratio() <= 1.0);
        all.sort_by(|a, b| a.point.work().total_cmp(&b.point.work()));
        all
    }
}
