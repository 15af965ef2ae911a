//! What a run tells its user beside its results, each thing once.

use super::analysis_results::Mode;
use super::failure::Moment;
use super::findings::{StageTimeError, Warning};
use super::guard::{Imbalance, is_unbalanced};
use super::plan::StageWork;
use super::stage_run::{Run, StageRun};
use super::vibrations::Vibrations;
use crate::integrate::{Largest, Rotations};
use crate::model::{StageKind, charts};
use crate::system::Slot;
use crate::warning::WarningKind;
use std::f64::consts::PI;

/// The largest relative error of the curvature of two-node elements with total vectors, over the square of the relative rotation of
/// their nodes: measured over 4000 orientations.
const FRAME_ERROR: f64 = 0.0533;

/// Of what moves, the estimated error of displacements that is told: of random runs with a true error of 5 % the lowest estimates were 2.5 %
/// to 3 %.
const MOST: f64 = 0.03;
/// The estimated error of rotations that is told, in radians: where displacements tell, too, and where nothing else moves. Beside
/// displacements small parts may turn to and fro faster than steps resolve, which errs by no more than they turn.
const MOST_BESIDE: f64 = PI;
const MOST_ALONE: f64 = 0.3;
/// What has gone less than this, over the length of the scene, does not move.
const STILL: f64 = 1e-6;
/// The error that a step is proposed for, over the one that is told.
const AIM: f64 = 0.4;
/// The least part of a step that is proposed where another scheme does with the step as it is.
const LEAST_PART: f64 = 0.1;

/// What has been told already.
#[derive(Clone, Debug)]
pub(super) struct IssuedWarnings {
    /// That an element turns far from node to node
    pub coarse: bool,
    /// How many limit and branch points
    pub points: usize,
    /// How uncertain round-off leaves displacements; below the first value nothing is worth a warning.
    uncertainty: f64,
    /// By how much strains depend on the orientation; below the first value nothing is worth a warning.
    frame: f64,
    soft: bool,
    axis: bool,
    subdivision: bool,
    /// How far a node has gone in a dynamic stage of fixed steps
    moved: f64,
    /// That the account of the energy is off
    unbalanced: bool,
    /// The stage in which the plane would be left
    pub unstable: Option<usize>,
}

impl Default for IssuedWarnings {
    fn default() -> Self {
        Self {
            coarse: false,
            points: 0,
            uncertainty: 1e-7,
            frame: 1e-2,
            soft: false,
            axis: false,
            subdivision: false,
            moved: 0.0,
            unbalanced: false,
            unstable: None,
        }
    }
}

impl Run<'_> {
    /// Warns of something at the present moment.
    pub(super) fn warn(&mut self, kind: WarningKind, message: impl Into<String>) {
        self.warn_at(kind, self.moment(), message);
    }

    /// Warns of something that happened at some moment.
    pub(super) fn warn_at(&mut self, kind: WarningKind, at: Moment, message: impl Into<String>) {
        let warning = Warning { kind, at: Some(at), message: message.into() };
        self.observer.warn(&warning);
        self.counters.findings.warnings.push(warning);
    }

    /// Says where the answer has fewer digits than it shows.
    pub(super) fn warn_of_round_off(&mut self) {
        let uncertainty = self.counters.work.uncertainty;
        if uncertainty > 10.0 * self.told.uncertainty {
            self.told.uncertainty = uncertainty;
            let message = format!(
                "round-off has taken about {:.0} of 16 digits: displacements are uncertain by about {uncertainty:.0e} of the \
                 largest (very slender beams on very fine meshes lose them: use fewer elements of a higher order)",
                16.0 + uncertainty.log10()
            );
            self.warn(WarningKind::LostDigits, message);
        }
    }

    /// The tangent has lost the stiffness of a motion that something holds.
    pub(super) fn warn_of_softness(&mut self) {
        self.soft = true;
        if !std::mem::replace(&mut self.told.soft, true) {
            self.warn(
                WarningKind::LostStiffness,
                "the softest motion has less than 1e-15 of the stiffness of the terms it is the difference of: a linear solve loses \
                 all 16 digits of it; corrections are refined for as long as that helps (fewer elements of a higher order lose less)",
            );
        }
    }

    /// An account of the energy that does not close.
    pub(super) fn warn_of_imbalance(&mut self, workshop: &StageRun) {
        // The energy of the full theory is not that of the linear one.
        if self.is_linear() {
            return;
        }
        match self.plan.stages[self.stage].work {
            StageWork::Dynamic { .. } => self.warn_of_scheme(workshop),
            StageWork::Static { .. } | StageWork::Path { .. } | StageWork::Buckling { .. } => self.warn_of_standstill(),
            // What moved goes on behind it.
            StageWork::Modal { .. } => {}
        }
    }

    /// An account that time steps do not close, or found open.
    fn warn_of_scheme(&mut self, workshop: &StageRun) {
        let Some(guard) = &workshop.guard else { return };
        let Some(Imbalance { share, is_own }) = guard.imbalance(self.bookkeeper.scale()) else { return };
        let is_told = std::mem::replace(&mut self.told.unbalanced, true);
        if !is_own && is_told {
            return;
        }
        let stage = self.stage + 1;
        let percent = 100.0 * share.abs();
        if !is_own {
            let message = format!(
                "stage {stage}: energy.total is off by {percent:.0} % of the largest energy, most of it from the stages before: their work is \
                 summed by the trapezoidal rule from load level to load level (more `steps` there)"
            );
            self.warn(WarningKind::EnergyBalance, message);
        } else if share < 0.0 {
            let message = format!(
                "stage {stage}: the scheme has taken {percent:.0} % of the largest energy: its steps do not resolve part of the motion (a \
                 smaller `step`, or less dissipation)"
            );
            self.warn(WarningKind::EnergyLoss, message);
        } else {
            let message = format!(
                "stage {stage}: the total energy is off by {percent:.0} % of the largest energy, which comes from nothing: the steps do not \
                 resolve part of the motion (a smaller `step`, or a scheme that dissipates)"
            );
            self.warn(WarningKind::EnergyGain, message);
        }
    }

    /// A stage that ends at rest takes kinetic energy away from what moved before.
    fn warn_of_standstill(&mut self) {
        let (Some(first), true) = (self.bookkeeper.first(), self.plan.energy && self.moving) else { return };
        let share = (self.bookkeeper.ledger().total() - first) / self.bookkeeper.scale();
        if is_unbalanced(share) && !std::mem::replace(&mut self.told.unbalanced, true) {
            let stage = self.stage + 1;
            let percent = 100.0 * share.abs();
            let message = format!(
                "stage {stage}: energy.total is off by {percent:.0} % of the largest energy: what moved stands still since the stage began, and \
                 works are summed by the trapezoidal rule from load level to load level"
            );
            self.warn(WarningKind::EnergyBalance, message);
        }
    }

    /// Notes the estimated errors of fixed steps, and warns of steps that are too long.
    pub(super) fn judge_steps(&mut self, workshop: &mut StageRun) {
        let StageWork::Dynamic { step, scheme, .. } = self.plan.stages[self.stage].work else { return };
        let StageRun { assembly, newton, increments, .. } = workshop;
        let Some(error) = &mut newton.time_error else { return };
        error.sum_up(&assembly.system.pattern.dof_map, &self.state, increments.as_ref());
        let largest = error.largest();
        self.counters.findings.time_errors.push(StageTimeError { stage: self.stage + 1, largest });
        let Largest { displacement, rotation, moved } = largest;
        // What is left of a motion that has died away may err by its own size.
        self.told.moved = self.told.moved.max(moved);
        let moved = self.told.moved;
        let is_moving = moved > STILL * self.model.length;
        let of_displacements = if is_moving { displacement / moved } else { 0.0 };
        let allowed = if is_moving { MOST_BESIDE } else { MOST_ALONE };
        let (over, what) = if of_displacements > MOST {
            let size = percent(of_displacements);
            (of_displacements / MOST, format!("displacements is {size} of the largest motion"))
        } else if rotation > allowed {
            (rotation / allowed, format!("rotations is {}", radians(rotation)))
        } else {
            return;
        };
        // Beyond its own size an error that grows linearly tells no more.
        let shorter = round_down(step * (AIM / over.min(1.0 / MOST)).sqrt());
        let is_of_rotations = of_displacements <= MOST && scheme.rotations == Rotations::Totals;
        let advice = if !is_of_rotations {
            format!("`step = {shorter}`")
        } else if (AIM / over).sqrt() < LEAST_PART {
            "`scheme = \"lie_generalized_alpha\"`".into()
        } else {
            format!("`step = {shorter}`, or `scheme = \"lie_generalized_alpha\"`")
        };
        let message = format!(
            "stage {}: the time steps are too long: the estimated error of {what} (try {advice})",
            self.stage + 1
        );
        self.warn(WarningKind::LongSteps, message);
    }

    /// Total rotation vectors are interpolated in charts that do not turn with the element: the strains of a turned scene differ.
    pub(super) fn warn_of_frame(&mut self) {
        // Rotations about one axis are interpolated without any error.
        if self.plane.is_some() {
            return;
        }
        let angle = charts::widest_in_one_chart(&self.state, &self.schedule.charted(&self.model).elements);
        let error = FRAME_ERROR * angle * angle;
        if error > self.told.frame {
            self.told.frame = 2.0 * error;
            let message = format!(
                "interpolation = \"total\": neighbouring nodes are turned by up to {angle:.2} rad against each other, so that curvatures of \
                 two-node elements depend on the orientation of the scene by up to {:.1} % (\"relative\" has no such error; it falls with \
                 the square of the element's length)",
                100.0 * error
            );
            self.warn(WarningKind::FrameDependence, message);
        }
    }

    /// A planar scene that a stage does not find in its plane.
    pub(super) fn warn_of_space(&mut self, kind: StageKind) {
        let planar = self.model.plane.is_some() && matches!(kind, StageKind::Static | StageKind::Dynamic);
        if planar && self.plane.is_none() {
            let stage = self.stage + 1;
            let message = format!(
                "stage {stage} is simulated in space: the state in which it begins is not in the plane of the scene to the last digits"
            );
            self.warn(WarningKind::SimulatedInSpace, message);
        }
    }

    /// The plane would be left.
    pub(super) fn warn_out_of_plane(&mut self, count: usize) {
        self.told.unstable = Some(self.stage);
        let at = self.moment();
        let message = format!(
            "unstable out of plane ({at}): in space {count} more pivot(s) are negative than in the plane that this scene is treated in: \
             what it would do is seen with a small load or imperfection out of the plane"
        );
        self.warn(WarningKind::UnstableOutOfPlane, message);
    }

    /// A node passed a whole turn aside of its axis.
    pub(super) fn warn_of_lost_axis(&mut self, slot: Slot) {
        if !std::mem::replace(&mut self.told.axis, true) {
            let (at, node) = (self.moment(), self.model.node_at(slot as usize));
            let message = format!(
                "node \"{node}\" left its axis near a whole turn ({at}): how its rotation vector continues is not defined there; `rc` counts \
                 its increments from there on, and depends on the steps (`r` does not)"
            );
            self.warn(WarningKind::LostAxis, message);
        }
    }

    /// A fixed step fails, and is not the last that does.
    pub(super) fn warn_of_subdivision(&mut self) {
        if !std::mem::replace(&mut self.told.subdivision, true) {
            let at = self.moment();
            let message = format!("a step fails at {at} and is taken in smaller ones, as are others that fail");
            self.warn(WarningKind::StepSubdivided, message);
        }
    }

    /// An equilibrium that a stage ends in, judged by the small vibrations about it: pivots do not tell.
    pub(super) fn warn_of_vibrations(&mut self, vibrations: Vibrations) {
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
        let stage = self.stage + 1;
        self.warn(WarningKind::Unstable, format!("stage {stage} ends in an unstable equilibrium ({how}"));
    }

    /// An equilibrium that a stage ends in, and that the next begins with. `negative`: its number of negative pivots, where it is known.
    pub(super) fn warn_of_instability(&mut self, negative: Option<usize>) {
        if let Some(count @ 1..) = negative {
            let stage = self.stage + 1;
            let pivots = if count == 1 { "pivot" } else { "pivots" };
            let message = format!(
                "stage {stage} ends in an unstable equilibrium ({count} negative {pivots}): a real structure would leave it"
            );
            self.warn(WarningKind::Unstable, message);
        }
    }
}

/// A share, of which more than the whole tells nothing.
fn percent(share: f64) -> String {
    if share < 1.0 { format!("{:.0} %", 100.0 * share) } else { "100 % or more".into() }
}

fn radians(angle: f64) -> String {
    if angle < PI { format!("{angle:.1} rad") } else { "half a turn or more".into() }
}

/// One, two or five times a power of ten, not more than a number.
fn round_down(x: f64) -> f64 {
    let power = x.log10().floor();
    let digit = x / 10.0_f64.powf(power);
    let rounded = if digit < 2.0 {
        1
    } else if digit < 5.0 {
        2
    } else {
        5
    };
    // As text, so that it is the number that is meant.
    format!("{rounded}e{power}").parse().unwrap_or(x)
}
