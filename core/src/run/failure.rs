//! The failures of a run, with their numbers.

use crate::failure::{Cause, FailureKind};
use crate::model::{Model, SlotKind};
use crate::tensor::Vec3;
use serde::{Deserialize, Serialize};
use std::fmt;

/// When something happened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
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

/// Attempts at a balance that was not found, and a known cause.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Attempts {
    /// Attempts that were taken back
    pub cutbacks: u64,
    /// Round-off takes the stiffness of the softest motion.
    pub(super) soft: bool,
    /// Contacts touch in the last balance.
    pub(super) touches: bool,
    /// Beams touch beams there.
    pub(crate) beams_touch: bool,
    /// There are elements of order 2 or 3.
    pub(super) curved: bool,
    /// There are contacts that may touch.
    pub(super) may_touch: bool,
}

/// A failure of a run, with its numbers.
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
        /// Attempts before it
        tried: Attempts,
    },
    /// A surface is turned so far at once that the sliding of beams on it is unknown.
    SurfaceTurnsTooFar {
        /// When
        at: Moment,
        /// Its name
        surface: String,
        /// Radians
        angle: f64,
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
        /// The error that the step is allowed
        share: f64,
    },
    /// A mechanism or a loose part
    Singular {
        /// When
        at: Moment,
        /// The node and the direction that move freely
        place: Option<Place>,
    },
    /// A contact penetrates too deeply after the largest number of augmentations.
    Penetration {
        /// When
        at: Moment,
        /// The node
        node: String,
        /// The depth, a length
        depth: f64,
    },
    /// A beam or a body penetrates a surface where its contact begins to act.
    ContactStart {
        /// When
        at: Moment,
        /// The contact
        contact: String,
        /// The surface, or the other beam
        surface: String,
        /// The node
        node: String,
        /// The depth, a length
        depth: f64,
    },
    /// A node may have passed through a surface.
    ContactPassed {
        /// When
        at: Moment,
        /// The node
        node: String,
    },
    /// A node has slid to the end of the beam on which it slides.
    SliderEnd {
        /// When
        at: Moment,
        /// The node
        node: String,
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
        /// SIGHUP is 1, SIGINT 2, SIGTERM 15
        signal: i32,
    },
}

impl Moment {
    /// The failure of something that exceeds a bound at this moment; `why` in words.
    pub(super) fn limit(&self, why: &str) -> Failure {
        Failure::Limit(format!("{why} ({self})"))
    }
}

impl Place {
    /// The place of a slot, along `direction`.
    pub(super) fn of(model: &Model, slot: usize, direction: Vec3) -> Self {
        Self {
            node: model.node_at(slot),
            kind: model.kinds[slot],
            direction: direction.normalized().unwrap_or(Vec3::ZERO),
        }
    }

    /// True if it is a condition of a joint.
    pub fn is_joint(&self) -> bool {
        matches!(self.kind, SlotKind::Force | SlotKind::Moment)
    }
}

impl Failure {
    /// Its kind, which has a name.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Deck(_) => FailureKind::Deck,
            Self::NotConverged { .. }
            | Self::TurnsTooFar { .. }
            | Self::SurfaceTurnsTooFar { .. }
            | Self::LimitPoint { .. }
            | Self::StepTooSmall { .. }
            | Self::Penetration { .. } => FailureKind::NotConverged,
            Self::ContactStart { .. } => FailureKind::ContactStart,
            Self::ContactPassed { .. } => FailureKind::ContactPassed,
            Self::SliderEnd { .. } => FailureKind::SliderEnd,
            Self::Singular { .. } => FailureKind::Singular,
            Self::NonFinite { .. } => FailureKind::NonFinite,
            Self::MeshTooCoarse { .. } => FailureKind::MeshTooCoarse,
            Self::EnergyGrowth { .. } => FailureKind::EnergyGrowth,
            Self::Limit(_) => FailureKind::Limit,
            Self::Io(_) => FailureKind::Io,
            Self::Interrupted { .. } => FailureKind::Interrupted,
        }
    }

    /// The name of its kind.
    pub fn name(&self) -> &'static str {
        self.kind().name()
    }

    /// True if the deck itself asks for what cannot be: in a stage that cannot begin, or with a
    /// mechanism before anything is loaded.
    pub fn is_of_start(&self) -> bool {
        if let Self::Singular { at, .. } = self {
            return at.stage == 1 && at.time == 0.0 && at.load == 0.0;
        }
        self.kind().cause() == Cause::Deck
    }

    /// True if no balance was found: another way to it may find one.
    pub(super) fn is_of_balance(&self) -> bool {
        matches!(self, Self::NotConverged { .. } | Self::Singular { .. } | Self::Penetration { .. })
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "stage {}, time {}, load factor {}", self.stage, ShortNumber(self.time), ShortNumber(self.load))
    }
}

/// A time or load factor in a message: with an exponent where that spares many zeros.
pub(super) struct ShortNumber(pub f64);

impl fmt::Display for ShortNumber {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || (1e-6..1e15).contains(&size) { write!(f, "{}", self.0) } else { write!(f, "{:e}", self.0) }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let what = match self.kind {
            SlotKind::Displacement => "displacement",
            SlotKind::Rotation => "rotation",
            SlotKind::Force | SlotKind::Moment | SlotKind::Sliding => {
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

impl std::error::Error for Failure {}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Deck(message) | Self::Limit(message) | Self::Io(message) => f.write_str(message),
            Self::NotConverged { at, place, residual, force, history, tried } => write!(
                f,
                "no convergence at {at}: after {} iterations and {} cut-backs the residual at {place} is \
                 {residual:.3e} (largest force {force:.3e})",
                history.len().saturating_sub(1),
                tried.cutbacks
            ),
            Self::TurnsTooFar { at, node, angle } => {
                write!(
                    f,
                    "node \"{node}\" turns by {angle:.3} rad in one step ({at}): near half a turn and above, the \
                     direction of rotation is ambiguous"
                )
            }
            Self::SurfaceTurnsTooFar { at, surface, angle } => {
                write!(
                    f,
                    "surface \"{surface}\" is turned by {angle:.3} rad in one step ({at}): how far beams slide on it, \
                     and whether they pass through it, would be unknown"
                )
            }
            Self::LimitPoint { at, goal, increments, end } => write!(
                f,
                "load factor {} was not reached: load control stopped at {at}; the equilibrium path was then \
                 followed by {increments} arc-length increments, to load factor {}",
                ShortNumber(*goal),
                ShortNumber(end.load)
            ),
            Self::StepTooSmall { at, place, error, share } => write!(
                f,
                "the smallest step has an estimated error of {error:.3e} at {place}; allowed is {share:.3e} ({at})"
            ),
            Self::Singular { at, place: Some(place) } if place.is_joint() => {
                write!(f, "the {place} is redundant: other constraints already fix the same motion ({at})")
            }
            Self::Singular { at, place: Some(place) } => {
                write!(f, "{place} is not constrained ({at}): the structure is a mechanism, or a part is loose")
            }
            Self::Singular { at, place: None } => write!(f, "the tangent matrix is singular at {at}"),
            Self::Penetration { at, node, depth } => write!(
                f,
                "a contact at node \"{node}\" penetrates by {depth:.3e}, more than `penetration` allows, after the \
                 largest number of augmentations ({at})"
            ),
            Self::ContactStart { at, contact, surface, node, depth } => write!(
                f,
                "contact \"{contact}\" begins with a penetration of {depth:.3e} into \"{surface}\" near node \"{node}\" \
                 ({at})"
            ),
            Self::ContactPassed { at, node } => write!(
                f,
                "node \"{node}\" may have passed through a surface or a beam: in one step it moves by more than the \
                 depth of the surface, or the contact is too soft to keep them apart ({at})"
            ),
            Self::SliderEnd { at, node } => {
                write!(f, "node \"{node}\" slides beyond the end of the beam on which it slides ({at})")
            }
            Self::NonFinite { at, effect, node } => {
                let effect = effect.unwrap_or("the sum of forces");
                write!(f, "{effect} is infinite or not a number at \"{node}\" ({at})")
            }
            Self::MeshTooCoarse { at, nodes: [a, b], relative_rotation } => write!(
                f,
                "the mesh is too coarse between \"{a}\" and \"{b}\": neighbouring nodes are rotated by \
                 {relative_rotation:.3} rad relative to each other ({at})"
            ),
            Self::EnergyGrowth { at, grown, largest } => write!(
                f,
                "the total energy has grown by {grown:.3e}; the largest energies so far add up to {largest:.3e} ({at})"
            ),
            // Between the runs of a study.
            Self::Interrupted { at, signal } if at.stage == 0 => write!(f, "stopped by signal {signal}"),
            Self::Interrupted { at, signal } => write!(f, "stopped by signal {signal} at {at}"),
        }
    }
}
