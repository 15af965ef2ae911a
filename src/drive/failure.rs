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

/// What had been tried where no balance was found, and what is known that may be its cause.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tried {
    /// Attempts that were taken back
    pub cutbacks: u64,
    /// Whether it was a time step
    pub dynamic: bool,
    /// Whether it was an increment of arc length
    pub path: bool,
    /// Whether it was a load level that is not linear in the load factor, so that arc length could not follow
    pub nonlinear: bool,
    /// Whether round-off takes the stiffness of the softest motion
    pub soft: bool,
    /// Whether there are beams, whose mesh may be too coarse
    pub beams: bool,
}

impl Tried {
    fn hint(&self) -> &'static str {
        match self {
            Self { soft: true, .. } => {
                "round-off takes the stiffness of the softest motion (see the warning): use fewer elements of a higher order"
            }
            Self { dynamic: true, beams: true, .. } => {
                "smaller steps were tried: damp what the step does not resolve (`generalized_alpha` with a smaller `rho_inf`), take a smaller `step`, or more \
                 elements where it turns most"
            }
            Self { dynamic: true, .. } => {
                "smaller steps were tried: damp what the step does not resolve (`generalized_alpha` with a smaller `rho_inf`), or take a smaller `step`"
            }
            Self { path: true, .. } => {
                "shorter increments were tried: the mesh may be too coarse where it turns most, or a branch cross the path (a small side \
                 force chooses one)"
            }
            Self { nonlinear: true, cutbacks: 1.., .. } => {
                "smaller load levels were tried: a limit load may lie just ahead, around which only arc length leads, and that follows no \
                 `history` and no `frame` (load and unload in stages of their own, with `stages = [1]` in a load)"
            }
            Self { cutbacks: 1.., .. } => {
                "smaller load levels and arc length were tried: the mesh may be too coarse where it turns most, or a buckling load \
                 lie just ahead (a small side force chooses a branch)"
            }
            _ => "let the stage take smaller levels: `adaptive`, or more `steps`",
        }
    }
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
        /// The largest residual of each iterate of the last attempt, over what is allowed
        history: Vec<f64>,
        /// What had been tried
        tried: Tried,
    },
    /// A node turns so far at once that nobody could tell which way.
    TurnsTooFar {
        /// When
        at: Moment,
        /// The node
        node: String,
        /// Radians
        angle: f64,
    },
    /// The load does not grow to the next level, neither by load control nor along the path.
    LimitPoint {
        /// Where load control stood still
        at: Moment,
        /// The load factor of the next level
        goal: f64,
        /// Increments of arc length
        increments: u64,
        /// Where they ended
        end: Moment,
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
            Self::NotConverged { .. }
            | Self::TurnsTooFar { .. }
            | Self::LimitPoint { .. }
            | Self::StepTooSmall { .. } => "not_converged",
            Self::Singular { .. } => "singular",
            Self::NonFinite { .. } => "non_finite",
            Self::MeshTooCoarse { .. } => "mesh_too_coarse",
            Self::EnergyGrowth { .. } => "energy_growth",
            Self::Limit(_) => "limit",
            Self::Io(_) => "io",
            Self::Interrupted { .. } => "interrupted",
        }
    }

    /// Whether no balance was found: another way to it may find one.
    pub(super) fn is_of_balance(&self) -> bool {
        matches!(self, Self::NotConverged { .. } | Self::Singular { .. })
    }

    /// What to try.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            Self::NotConverged { tried, .. } => Some(tried.hint()),
            Self::TurnsTooFar { .. } => Some(
                "use smaller steps; in a dynamic stage in which nothing should turn so fast the step does not resolve the motion: damp \
                 what it cannot resolve (a smaller `rho_inf`)",
            ),
            Self::LimitPoint { .. } => Some(
                "the path it is on does not come to this load (the rows follow it beyond its limit points): more `steps` may keep it on another; else \
                 load it less, \
                 prescribe a motion in place of the load, or let it move in a dynamic stage",
            ),
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
                "the time step does not resolve the motion: damp what it cannot resolve (scheme = \"generalized_alpha\", or a smaller \
                 `rho_inf` where it is that already), or take a smaller `step`; where the growth is meant, raise `energy_limit`",
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
            (None, "displacement") => write!(f, "node \"{}\", displacement along [{x:.3}, {y:.3}, {z:.3}]", self.node),
            (None, _) => write!(f, "node \"{}\", rotation about [{x:.3}, {y:.3}, {z:.3}]", self.node),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Deck(message) | Self::Limit(message) | Self::Io(message) => f.write_str(message),
            Self::NotConverged { at, place, residual, force, history, tried } => write!(
                f,
                "no balance at {at}: after {} iterations and {} cut-backs the residual at {place} is {residual:.3e}, the \
                 largest force {force:.3e}",
                history.len().saturating_sub(1),
                tried.cutbacks
            ),
            Self::TurnsTooFar { at, node, angle } => {
                write!(
                    f,
                    "node \"{node}\" turns by {angle:.3} rad at once ({at}), so that its direction cannot be told"
                )
            }
            Self::LimitPoint { at, goal, increments, end } => write!(
                f,
                "the load does not grow to the factor {goal}: load control stands still at {at}, and {increments} increments of arc \
                 length along the path end at load factor {}",
                end.load
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
            // Between the runs of a study.
            Self::Interrupted { at, signal } if at.stage == 0 => write!(f, "stopped by signal {signal}"),
            Self::Interrupted { at, signal } => write!(f, "stopped by signal {signal} at {at}"),
        }
    }
}

/// The place of a slot, along `direction`.
pub(super) fn place(model: &Model, slot: usize, direction: Vec3) -> Place {
    Place {
        node: model.node_at(slot),
        kind: model.kinds[slot],
        direction: direction.normalized().unwrap_or(Vec3::ZERO),
    }
}
