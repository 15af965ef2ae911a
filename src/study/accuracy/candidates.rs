//! The errors of the variants of a round, and the variants that are accurate enough.

use super::estimate::ErrorShare;
use super::round::{Compared, Round};
use crate::study::cost::{Pace, Variant};
use beamsim_core::sorting::sort_by;

/// The error of a variant.
pub struct Estimate {
    /// The part that comes from the mesh
    pub(super) mesh: ErrorShare,
    /// The part that comes from the steps
    pub(super) step: ErrorShare,
}

impl Estimate {
    /// The largest ratio of the error of an output to the wanted error.
    pub fn ratio(&self) -> f64 {
        self.mesh.largest + self.step.largest
    }
}

/// The errors of the variants of a round.
pub struct Estimates {
    /// The error of its own variant
    pub(super) own: Estimate,
    /// The mesh error of the variant on another mesh
    pub(super) remeshed: Option<ErrorShare>,
}

/// A variant that is accurate enough.
pub struct Candidate {
    /// The variant
    pub(super) variant: Variant,
    /// Its error
    pub(super) estimate: Estimate,
    /// True if the round has run it
    pub(super) has_run: bool,
}

impl Estimates {
    /// The variants of a round that are accurate enough, the cheapest first.
    pub fn accurate_enough(&self, round: &Round) -> Vec<Candidate> {
        let step = |pace: Pace| if pace == round.own.pace { self.own.step.clone() } else { self.own.step.of_coarser() };
        let of = |variant: &Variant, mesh: &ErrorShare, has_run| {
            let estimate = Estimate { mesh: mesh.clone(), step: step(variant.pace) };
            Candidate { variant: variant.clone(), estimate, has_run }
        };
        let mut all = vec![of(&round.own, &self.own.mesh, true)];
        all.extend(round.longer.as_ref().map(|longer| of(&longer.variant, &self.own.mesh, true)));
        if let (Some(share), Some(Compared { variant: remeshed, .. })) = (&self.remeshed, &round.remeshed) {
            all.push(of(remeshed, share, true));
            let alike = round.remeshed_alike().filter(|alike| alike.pace != remeshed.pace);
            all.extend(alike.map(|alike| of(&alike, share, false)));
        }
        all.retain(|candidate| candidate.estimate.ratio() <= 1.0);
        sort_by(&mut all, |a, b| a.variant.work().total_cmp(&b.variant.work()));
        all
    }
}
