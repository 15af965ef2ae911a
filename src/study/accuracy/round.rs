//! One round of a search: a variant, and the runs from which its errors are estimated.

use super::has_long_steps;
use crate::study::StudyError;
use crate::study::cost::{Pool, Trial, Variant};
use beamsim_core::failure::FailureKind;

/// A variant, and those that it is compared with.
pub struct Round {
    /// The variant
    pub(super) own: Variant,
    /// The variant with a longer step
    pub(super) longer: Option<Compared>,
    /// A variant on another mesh. It may have the longer steps, which cost less: the mesh error
    /// hardly depends on the step.
    pub(super) remeshed: Option<Compared>,
}

/// A variant that another one is compared with.
pub struct Compared {
    /// The variant
    pub(super) variant: Variant,
    /// Its step, or the width of its elements, over that of the other
    pub(super) ratio: f64,
}

/// The runs of a round.
pub struct Trials {
    /// The run of the variant
    pub(super) own: Trial,
    /// The run with a longer step
    pub(super) longer: Option<Trial>,
    /// The run on another mesh
    pub(super) remeshed: Option<Trial>,
    /// The number of runs
    pub(super) runs: usize,
}

impl Round {
    /// All its variants.
    pub fn variants(&self) -> Vec<Variant> {
        let others = [&self.longer, &self.remeshed].into_iter().flatten();
        std::iter::once(&self.own).chain(others.map(|other| &other.variant)).cloned().collect()
    }

    /// The other mesh with the steps of the variant.
    pub fn remeshed_alike(&self) -> Option<Variant> {
        self.remeshed.as_ref().map(|other| Variant { pace: self.own.pace, ..other.variant.clone() })
    }

    /// Runs its variants; `None` where the budget skipped one.
    pub fn run(&mut self, pool: &mut Pool) -> Result<Option<Trials>, StudyError> {
        let variants = self.variants();
        pool.forget_all_but(&variants);
        // A long step is tried alone first: if it is too long, there is nothing to compare with.
        let alone = if has_long_steps(&self.own) { 1 } else { variants.len() };
        pool.expect(alone);
        let mut trials = pool.run(&variants[..alone])?;
        if alone < variants.len() && trials[0].as_ref().is_some_and(|own| !own.failed_as(FailureKind::Limit)) {
            pool.expect(variants.len() - alone);
            trials.extend(pool.run(&variants[alone..])?);
        }
        let runs = trials.len();
        let Some(trials) = trials.into_iter().collect::<Option<Vec<Trial>>>() else { return Ok(None) };
        let mut trials = trials.into_iter();
        let Some(own) = trials.next() else { return Ok(None) };
        let longer = self.longer.as_ref().and_then(|_| trials.next());
        let remeshed = self.remeshed.as_ref().and_then(|_| trials.next());
        let trials = Trials { own, longer, remeshed, runs };
        let failed = |trial: &Option<Trial>| trial.as_ref().is_some_and(|trial| !trial.finished());
        if trials.own.finished() && (failed(&trials.longer) || failed(&trials.remeshed)) {
            return self.run_meshes_alike(trials, pool);
        }
        Ok(Some(trials))
    }

    /// Compares the meshes with the shorter step, where the longer one is too long.
    fn run_meshes_alike(&mut self, trials: Trials, pool: &mut Pool) -> Result<Option<Trials>, StudyError> {
        let pace = self.remeshed.as_ref().map(|other| other.variant.pace);
        let Some(alike) = self.remeshed_alike().filter(|alike| Some(alike.pace) != pace) else {
            return Ok(Some(trials));
        };
        pool.expect(1);
        let again = pool.run(std::slice::from_ref(&alike))?.remove(0);
        if let Some(other) = &mut self.remeshed {
            other.variant = alike;
        }
        let runs = trials.runs + 1;
        Ok(again.map(|remeshed| Trials { remeshed: Some(remeshed), runs, ..trials }))
    }
}
