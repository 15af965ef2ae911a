//! What a run can end with, by name and with its numbers.

use crate::model::{Model, SlotKind};
use crate::tensor::Vec3;
use std::fmt;

/// When something happened.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Stage, from 1
    pub stage: usize,
    /// The run's clock
    pub time: f64,
    /// The load factor
    pub load: f64,
}

/// Where something happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// The name of the node
    pub node: String,
    /// Displacement or rotation
    pub kind: SlotKind,
    /// Direction, global components
    pub direction: Vec3,
}

/// A failure of a run. The names are part of the contract with users.
#[derive(Clone, Debug, PartialEq)]
pub enum Failure {
    /// Something in the deck that only shows when a stage begins
    Deck(String),
    /// Newton's iteration found no balance.
    NotConverged {
        /// When
        at: Moment,
        /// The worst residual's place
        place: Place,
        /// Its size
        residual: f64,
        /// The force it is compared to
        force: f64,
        /// Iterations of the last attempt
        iterations: usize,
        /// Cut-backs tried before giving up
        cutbacks: u64,
        /// Whether it was a time step
        dynamic: bool,
    },
    /// Steps that adapt have become as small as they may, and their error is still too large.
    StepTooSmall {
        /// When
        at: Moment,
        /// Where the error is
        place: Place,
        /// Relative to the scene's length, or in radians
        error: f64,
        /// What the step is allowed
        share: f64,
    },
    /// A mechanism or a loose part
    Singular {
        /// When
        at: Moment,
        /// What moves freely
        place: Option<Place>,
    },
    /// A force, a motion or a result that is not finite
    NonFinite {
        /// When
        at: Moment,
        /// The effect that gave it, or what else is not finite
        effect: Option<&'static str>,
        /// The node
        node: String,
    },
    /// Neighbouring nodes turn too far against each other.
    MeshTooCoarse {
        /// When
        at: Moment,
        /// First and second node of the pair's element
        nodes: [String; 2],
        /// Radians
        relative_rotation: f64,
    },
    /// The total energy grows where nothing brings any.
    EnergyGrowth {
        /// When
        at: Moment,
        /// How much it has grown by
        grown: f64,
        /// The largest sum of kinetic energy, strain energy and work from outside so far
        largest: f64,
    },
    /// Larger than the stated bounds
    Limit(String),
    /// A file that could not be written
    Io(String),
    /// Stopped by a signal
    Interrupted {
        /// When
        at: Moment,
        /// SIGINT is 2, SIGTERM 15
        signal: i32,
    },
}

impl Place {
    /// Whether it is a condition of a joint.
    pub fn is_joint(&self) -> bool {
        matches!(self.kind, SlotKind::Force | SlotKind::Moment)
    }
}

impl Failure {
    /// The name of the failure.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Deck(_) => "deck",
            Self::NotConverged { .. } | Self::StepTooSmall { .. } => "not_converged",
            Self::Singular { .. } => "singular",
            Self::NonFinite { .. } => "non_finite",
            Self::MeshTooCoarse { .. } => "mesh_too_coarse",
            Self::EnergyGrowth { .. } => "energy_growth",
            Self::Limit(_) => "limit",
            Self::Io(_) => "io",
            Self::Interrupted { .. } => "interrupted",
        }
    }

    /// What to try.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            Self::NotConverged { dynamic: false, cutbacks: 1.., .. } => Some(
                "smaller load levels were tried: a limit point (the load cannot grow further on this path) or a buckling \
                 load may lie just ahead, or the mesh is too coarse where it turns most",
            ),
            Self::NotConverged { dynamic: false, .. } => {
                Some("let the stage take smaller levels: `adaptive`, or more `steps`")
            }
            Self::NotConverged { .. } => Some("try a finer mesh where it turns most, or a smaller `step`"),
            Self::StepTooSmall { .. } => Some(
                "accelerations jump there from step to step: let the scheme damp them (a smaller `rho_inf`), take fixed steps, or a larger \
                 `step_tolerance`",
            ),
            Self::Singular { place: Some(place), .. } if place.is_joint() => Some(
                "a support, another joint or a loop of rigid parts holds the same already: release one of them, for example by a \
                 spherical joint in place of a revolute one",
            ),
            Self::Singular { .. } => {
                Some("add a support, a spring or a joint that holds this direction, or give it mass")
            }
            Self::MeshTooCoarse { .. } => Some("use more `elements` there"),
            Self::EnergyGrowth { .. } => Some(
                "the time step does not resolve the motion: damp what it cannot resolve (scheme = \"generalized_alpha\"), or take a \
                 smaller `step`; where the growth is meant, raise `energy_limit`",
            ),
            Self::NonFinite { .. } => Some("look for values near the limits of floating-point numbers in the deck"),
            Self::Deck(_) | Self::Limit(_) | Self::Io(_) | Self::Interrupted { .. } => None,
        }
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "stage {}, time {}, load factor {}", self.stage, self.time, self.load)
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let what = match self.kind {
            SlotKind::Displacement => "displacement",
            SlotKind::Rotation => "rotation",
            SlotKind::Force | SlotKind::Moment => {
                return f.write_str(&self.node);
            }
        };
        let [x, y, z] = self.direction.0;
        let axis = ["x", "y", "z"].into_iter().zip(self.direction.0).find(|(_, c)| c.abs() > 0.999_999);
        match (axis, what) {
            (Some((name, _)), "displacement") => write!(f, "node \"{}\", displacement along {name}", self.node),
            (Some((name, _)), _) => write!(f, "node \"{}\", rotation about {name}", self.node),
            (None, what) => write!(f, "node \"{}\", {what} [{x:.3}, {y:.3}, {z:.3}]", self.node),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Deck(message) | Self::Limit(message) | Self::Io(message) => f.write_str(message),
            Self::NotConverged { at, place, residual, force, iterations, cutbacks, .. } => write!(
                f,
                "no balance at {at}: after {iterations} iterations and {cutbacks} cut-backs the residual at {place} is \
                 {residual:.3e}, the largest force {force:.3e}"
            ),
            Self::StepTooSmall { at, place, error, share } => write!(
                f,
                "the smallest step has an error of {error:.3e} at {place}, where it may have {share:.3e} ({at})"
            ),
            Self::Singular { at, place: Some(place) } if place.is_joint() => {
                write!(f, "the {place} holds what is held already ({at})")
            }
            Self::Singular { at, place: Some(place) } => {
                write!(f, "nothing holds {place} ({at}): a mechanism or a loose part")
            }
            Self::Singular { at, place: None } => write!(f, "the tangent cannot be solved with at {at}"),
            Self::NonFinite { at, effect, node } => {
                let effect = effect.unwrap_or("the sum of forces");
                write!(f, "{effect} is not finite at \"{node}\" ({at})")
            }
            Self::MeshTooCoarse { at, nodes: [a, b], relative_rotation } => write!(
                f,
                "the element between \"{a}\" and \"{b}\" turns by {relative_rotation:.3} rad from node to node ({at})"
            ),
            Self::EnergyGrowth { at, grown, largest } => write!(
                f,
                "the total energy has grown by {grown:.3e}, where the largest energies so far add up to {largest:.3e} ({at})"
            ),
            Self::Interrupted { at, signal } => write!(f, "stopped by signal {signal} at {at}"),
        }
    }
}

/// The place of a slot, along `direction`.
pub(super) fn place(model: &Model, slot: usize, direction: Vec3) -> Place {
    let info = &model.slots[slot];
    Place { node: info.node.clone(), kind: info.kind, direction: direction.normalized().unwrap_or(Vec3::ZERO) }
}
