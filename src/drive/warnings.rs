//! What a run tells its user beside its results, each thing once.

use super::failure::Moment;
use super::findings::Warning;
use super::guard::EnergyGuard;
use super::run::{Mode, Run, Workshop};
use super::vibrations::Vibrations;
use crate::model::{StageKind, charts};
use crate::system::Slot;
use crate::warning::WarningKind;

/// The largest relative error of the curvature of two-node elements with total vectors, over the square of the relative rotation of
/// their nodes: measured over 4000 orientations.
const FRAME_ERROR: f64 = 0.0533;

/// What has been told already.
#[derive(Clone, Debug)]
pub(super) struct Told {
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
    /// The stage in which the plane would be left
    pub unstable: Option<usize>,
}

impl Default for Told {
    fn default() -> Self {
        Self {
            coarse: false,
            points: 0,
            uncertainty: 1e-7,
            frame: 1e-2,
            soft: false,
            axis: false,
            subdivision: false,
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

    /// Energy that a scheme takes is a motion that its steps do not resolve.
    pub(super) fn warn_of_loss(&mut self, workshop: &Workshop) {
        if let Some(share) = workshop.guard.as_ref().and_then(EnergyGuard::loss) {
            let message = format!(
                "stage {}: the scheme has taken {:.0} % of the largest energy: its steps do not resolve part of the motion (a smaller \
                 `step`, or less dissipation)",
                self.stage + 1,
                100.0 * share
            );
            self.warn(WarningKind::EnergyLoss, message);
        }
    }

    /// Total rotation vectors are interpolated in charts that do not turn with the element: the strains of a turned scene differ.
    pub(super) fn warn_of_frame(&mut self) {
        // Rotations about one axis are interpolated without any error.
        if self.plane.is_some() {
            return;
        }
        let angle = charts::widest_in_one_chart(&self.state, &self.model.charted.elements);
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

    /// The same where pivots do not tell.
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
