//! One round of a search: a variant, and the runs that tell the shares of its error.

use super::is_offer;
use crate::study::cost::{Crew, Point, Refusal, Trial};

/// A variant, and what it is compared with.
pub struct Round {
    /// The variant
    pub own: Point,
    /// With a longer step, and how many times as long that is
    pub longer: Option<(Point, f64)>,
    /// On another mesh, and how many times as wide its elements are, less than one where they are narrower. Its steps may be the longer
    /// ones: what a mesh errs by depends little on them, and they cost less.
    pub remeshed: Option<(Point, f64)>,
}

/// What came of a round.
pub struct Trials {
    /// Of the variant
    pub own: Trial,
    /// With a longer step
    pub longer: Option<Trial>,
    /// On another mesh
    pub remeshed: Option<Trial>,
    /// How many runs that were
    pub runs: usize,
}

impl Round {
    /// Its runs.
    pub fn points(&self) -> Vec<Point> {
        let others = [&self.longer, &self.remeshed].into_iter().flatten();
        std::iter::once(&self.own).chain(others.map(|(point, _)| point)).cloned().collect()
    }

    /// The other mesh with the steps of the variant.
    pub fn remeshed_alike(&self) -> Option<Point> {
        self.remeshed.as_ref().map(|(point, _)| Point { pace: self.own.pace, ..point.clone() })
    }

    /// Runs them; `None` where the budget left one out.
    pub fn run(&mut self, crew: &mut Crew) -> Result<Option<Trials>, Refusal> {
        let points = self.points();
        crew.forget_all_but(&points);
        // A step on offer is tried alone: where it is too long for the first one, nothing is compared with it.
        let alone = if is_offer(&self.own) { 1 } else { points.len() };
        crew.expect(alone);
        let mut trials = crew.run(&points[..alone])?;
        if alone < points.len() && trials[0].as_ref().is_some_and(|own| own.status != "limit") {
            crew.expect(points.len() - alone);
            trials.extend(crew.run(&points[alone..])?);
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
            return self.run_meshes_alike(trials, crew);
        }
        Ok(Some(trials))
    }

    /// Where the longer step is too long, the meshes are compared with the other one.
    fn run_meshes_alike(&mut self, trials: Trials, crew: &mut Crew) -> Result<Option<Trials>, Refusal> {
        let pace = self.remeshed.as_ref().map(|(point, _)| point.pace);
        let Some(alike) = self.remeshed_alike().filter(|alike| Some(alike.pace) != pace) else {
            return Ok(Some(trials));
        };
        crew.expect(1);
        let again = crew.run(std::slice::from_ref(&alike))?.remove(0);
        if let Some((point, _)) = &mut self.remeshed {
            *point = alike;
        }
        let runs = trials.runs + 1;
        Ok(again.map(|remeshed| Trials { remeshed: Some(remeshed), runs, ..trials }))
    }
}
