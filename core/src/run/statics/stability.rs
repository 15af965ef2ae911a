//! The stability of equilibria: signs of pivots from step to step, and what is told of the end of a
//! stage.

use crate::kernel::Weights;
use crate::run::failure::Failure;
use crate::run::findings::{StabilityVerdict, StageStability};
use crate::run::modal::{Vibrations, pivots_tell, vibrations};
use crate::run::results::{Event, EventKind, Mode};
use crate::run::spatial::SpatialLook;
use crate::run::stage_run::StageRun;
use crate::solve::{Signature, Tangent};
use crate::tensor::Vec3;
use crate::warning::WarningKind;

/// Limit and branch points of a run that are told one by one.
const MOST_TOLD: usize = 10;

/// A step whose corrections grow has left the neighbourhood of the path: where they do not
/// contract, it was too long (Deuflhard 2011, Newton Methods for Nonlinear Problems, 5.1).
pub(in crate::run) const LARGEST_CONTRACTION: f64 = 1.0;

/// Where pivots do not count whether a step ended on another branch, no correction may be larger
/// than this part of the one before it.
pub(super) const LARGEST_UNCOUNTED: f64 = 0.5;

/// Follows the signs of pivots from step to step.
pub(super) struct Stability {
    /// Pivots are followed.
    counts: bool,
    pub(super) signature: Option<Signature>,
}

impl Stability {
    /// At the start of a stage.
    pub fn new(stage: &mut StageRun) -> Self {
        // The start was assembled with its stiffness.
        let StageRun { assembly, newton, state, counters, .. } = stage;
        let mut tangent = Tangent::that_may_go(assembly, state, Weights::STIFFNESS);
        let signature = newton.signature(&mut tangent, &mut counters.work);
        newton.begin_with(&assembly.system);
        // What is linear keeps its tangent.
        Self { counts: !stage.is_linear(), signature }
    }

    /// Where a checkpoint has left it.
    pub fn again(counts: bool, signature: Option<Signature>) -> Self {
        Self { counts, signature }
    }

    /// True if pivots are followed.
    pub fn counts(&self) -> bool {
        self.counts
    }

    /// At the run's state; `None` where it is not known.
    pub fn look(&mut self, stage: &mut StageRun) -> Option<Signature> {
        if !self.counts {
            return None;
        }
        let StageRun { assembly, newton, state, counters, .. } = stage;
        let signature = newton.signature_at(assembly, state, &mut counters.work);
        // Where nothing tells, nothing will next.
        self.counts = signature.is_some();
        signature
    }

    /// Forms and factorises the tangent of the run's state again, as [`Stability::look`] has left
    /// it for the next solution: that of the `unflattened` unknowns, if there are any.
    pub fn follow_again(stage: &mut StageRun, unflattened: Vec<Vec3>) {
        let StageRun { assembly, newton, state, counters, .. } = stage;
        let flat = state.q.clone();
        if !unflattened.is_empty() {
            state.q = unflattened;
        }
        newton.signature_at(assembly, state, &mut counters.work);
        state.q = flat;
        newton.begin_with(&assembly.system);
    }

    /// The number of eigenvalues whose sign has changed, at least.
    pub fn changes_to(&self, signature: Option<Signature>) -> usize {
        self.signature.zip(signature).map_or(0, |(before, after)| before.changes_to(after))
    }

    /// True if a step was too long to tell that it follows the path: its corrections did not
    /// contract, or it passed several critical points at once, of which each may have a branch that
    /// the path turns into.
    pub fn may_have_strayed(&self, contraction: f64, signature: Option<Signature>) -> bool {
        contraction > self.largest_contraction(signature) || self.changes_to(signature) > 1
    }

    /// The largest contraction of corrections that is trusted on the way to a state with this
    /// signature.
    pub fn largest_contraction(&self, signature: Option<Signature>) -> f64 {
        let is_counted = [self.signature, signature].iter().all(|s| s.and_then(Signature::negative).is_some());
        if is_counted { LARGEST_CONTRACTION } else { LARGEST_UNCOUNTED }
    }
}

/// At the end of a static stage: notes whether the equilibrium is stable, and warns where it is
/// not. `signature`: of its tangent, as the stage is treated, where it is known; `on_limit`: the
/// state is a limit point, with the pivots behind it.
pub(super) fn conclude(
    stage: &mut StageRun,
    space: &mut SpatialLook,
    signature: Option<Signature>,
    on_limit: bool,
) -> Result<(), Failure> {
    stage.unless_interrupted()?;
    let negative = signature.and_then(Signature::negative).filter(|&count| pivots_tell(count, stage.stage().rotating));
    stage.warn_of_instability(negative);
    let number = stage.number + 1;
    let aside = match negative {
        None => None,
        // There the look in space was taken behind it.
        Some(_) if on_limit => (stage.issued.unstable != Some(stage.number)).then_some(0),
        Some(in_plane) => space.count(stage, in_plane)?,
    };
    let mut found = StageStability::of_pivots(number, negative, aside);
    if found.verdict == StabilityVerdict::Unknown && !on_limit {
        let vibrations = vibrations(stage, signature)?;
        stage.warn_of_vibrations(vibrations);
        found = stability_of(number, vibrations);
    }
    stage.unless_interrupted()?;
    stage.counters.findings.stability.push(found);
    match aside {
        Some(more @ 1..) if stage.issued.unstable != Some(stage.number) => stage.warn_out_of_plane(more),
        _ => {}
    }
    Ok(())
}

/// The stability of an equilibrium as small vibrations tell it.
fn stability_of(stage: usize, vibrations: Vibrations) -> StageStability {
    let verdict = match vibrations {
        Vibrations::Counted(negative) => return StageStability::of_pivots(stage, Some(negative), Some(0)),
        Vibrations::Bounded => StabilityVerdict::Stable,
        Vibrations::Growing(_) | Vibrations::Diverging => StabilityVerdict::Unstable,
        Vibrations::Unknown => StabilityVerdict::Unknown,
    };
    StageStability { stage, verdict, negative: None }
}

/// Names limit and turning points, and branches that were passed: where the signs of pivots
/// changed.
pub(super) fn tell_of_points(
    stage: &mut StageRun,
    space: &mut SpatialLook,
    kind: Option<EventKind>,
    before: Option<Signature>,
    after: Option<Signature>,
) -> Result<(), Failure> {
    stage.unless_interrupted()?;
    let changed = before.zip(after).is_some_and(|(before, after)| before.changes_to(after) > 0);
    let after = after.and_then(Signature::negative);
    let kind = kind.or_else(|| changed.then_some(EventKind::Branch));
    let Some(kind) = kind else { return Ok(()) };
    let tells = after.is_none_or(|count| pivots_tell(count, stage.stage().rotating));
    let event = Event { at: stage.moment(), kind, negative_pivots: after, pivots_tell: tells };
    match stage.issued.points {
        0..MOST_TOLD => stage.warn(kind.warning(), event.to_string()),
        MOST_TOLD => {
            let message = "more limit and branch points follow: all are listed in run.json under `events`";
            stage.warn(WarningKind::MorePoints, message);
        }
        _ => {}
    }
    stage.issued.points += 1;
    stage.counters.findings.events.push(event);
    if kind == EventKind::Limit { Ok(()) } else { space.warn_of_instability(stage, after) }
}

impl StageRun<'_> {
    /// An equilibrium that a stage ends in, judged by the small vibrations about it: pivots do not
    /// tell.
    fn warn_of_vibrations(&mut self, vibrations: Vibrations) {
        let how = match vibrations {
            Vibrations::Bounded | Vibrations::Unknown => return,
            Vibrations::Counted(negative) => return self.warn_of_instability(Some(negative)),
            Vibrations::Diverging => {
                "its tangent has a negative real eigenvalue: divergence): a real structure would leave it".into()
            }
            Vibrations::Growing(Mode { omega: 0.0, growth }) => {
                format!("a small motion grows with exp({growth:.4} t): divergence): a real structure would leave it")
            }
            Vibrations::Growing(Mode { omega, growth }) => format!(
                "a small vibration of angular frequency {omega:.4} grows with exp({growth:.4} t): flutter): a real structure would \
                 leave it, unless it has more damping than the scene (about {:.2} % of critical)",
                100.0 * growth / omega.hypot(growth)
            ),
        };
        let stage = self.number + 1;
        self.warn(WarningKind::Unstable, format!("stage {stage} ends in an unstable equilibrium ({how}"));
    }

    /// An equilibrium that a stage ends in, and that the next begins with. `negative`: its number
    /// of negative pivots, where it is known.
    fn warn_of_instability(&mut self, negative: Option<usize>) {
        if let Some(count @ 1..) = negative {
            let stage = self.number + 1;
            let pivots = if count == 1 { "pivot" } else { "pivots" };
            let message = format!(
                "stage {stage} ends in an unstable equilibrium ({count} negative {pivots}): a real structure would leave it"
            );
            self.warn(WarningKind::Unstable, message);
        }
    }
}
