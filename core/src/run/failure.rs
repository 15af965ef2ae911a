//! What a run can end with, by name and with its numbers.

use crate::model::{Jump, Model, MotionKind, MotorJump, SlotKind, StageError, StageKind};
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
    /// Whether round-off takes the stiffness of the softest motion
    pub soft: bool,
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

    /// Whether the deck itself asks for what cannot be: in a stage that cannot begin, or with a mechanism before anything is loaded.
    pub fn is_of_start(&self) -> bool {
        match self {
            Self::Deck(_) | Self::Limit(_) => true,
            Self::Singular { at, .. } => at.stage == 1 && at.time == 0.0 && at.load == 0.0,
            Self::NotConverged { .. }
            | Self::TurnsTooFar { .. }
            | Self::LimitPoint { .. }
            | Self::StepTooSmall { .. }
            | Self::NonFinite { .. }
            | Self::MeshTooCoarse { .. }
            | Self::EnergyGrowth { .. }
            | Self::Io(_)
            | Self::Interrupted { .. } => false,
        }
    }

    /// Whether no balance was found: another way to it may find one.
    pub(super) fn is_of_balance(&self) -> bool {
        matches!(self, Self::NotConverged { .. } | Self::Singular { .. })
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

impl std::error::Error for Failure {}

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

/// Why a stage cannot begin.
pub fn refusal(error: &StageError, model: &Model) -> String {
    let node = |slot: u32| model.node_at(slot as usize);
    match error {
        StageError::Conflict(conflict) => format!(
            "constraints on node \"{}\" act along directions that are neither the same nor orthogonal",
            node(conflict.slot)
        ),
        StageError::Jump(Jump { motion, from, to }) => {
            let motion = &model.motions[*motion];
            let turns = motion.kind == MotionKind::Rotation;
            let name = node(motion.slot);
            if from == to {
                return format!("the motion of node \"{name}\" turns it about another axis than it has turned about");
            }
            let (from, to) = (size(*from, turns), size(*to, turns));
            format!("the motion of node \"{name}\" would have to jump from {from} to {to}")
        }
        StageError::TurnedHinge(slot) => format!(
            "a support takes hold of single rotation components of node \"{}\", which has already turned",
            node(*slot)
        ),
        StageError::MotorJump(MotorJump { slot, turns, from, to, .. }) => {
            let (from, to) = (size(*from, *turns), size(*to, *turns));
            format!("the motor of the {} would have to jump from {from} to {to}", node(*slot))
        }
        StageError::NothingGrows(StageKind::Buckling) => {
            "no load and no motion grows with the load factor: nothing can buckle".into()
        }
        StageError::NothingGrows(_) => {
            "control = \"arc_length\" needs a load or a motion that grows with the load factor".into()
        }
        StageError::NoMass => "a modal stage needs mass: nothing that is free to move has any".into(),
    }
}

/// What helps where stage number `stage` (from 0) cannot begin.
pub fn refusal_help(error: &StageError, model: &Model, stage: usize) -> Option<String> {
    let driven = |own_stages: Option<bool>| match own_stages {
        None if stage == 0 => {
            "a dynamic stage starts where the scene is: give it a `history` that begins with 0".into()
        }
        None => "give it a `history` that begins there".into(),
        Some(false) => format!(
            "a history is read over the load factor in static stages and over the clock in dynamic ones: `history = {{ name = …, \
             stages = [{}] }}` begins with this stage and holds its first value before",
            stage + 1
        ),
        Some(true) => "its history must begin where the stages before have left it".into(),
    };
    match error {
        StageError::Jump(Jump { from, to, .. }) if from == to => None,
        StageError::Jump(jump) => {
            // At the very start there is no stage before that could hold anything.
            match model.motions[jump.motion].amplitude.has_own_stages() {
                Some(false) if stage == 0 => Some(START.into()),
                own_stages => Some(driven(own_stages)),
            }
        }
        StageError::MotorJump(jump) => match model.amplitudes[jump.amplitude].has_own_stages() {
            Some(_) if stage == 0 => Some(START.into()),
            own_stages => Some(driven(own_stages)),
        },
        StageError::TurnedHinge(_) => Some("hold all three, or hold them from the first stage on".into()),
        StageError::Conflict(_) | StageError::NothingGrows(_) | StageError::NoMass => None,
    }
}

/// What helps where the first stage is dynamic.
const START: &str =
    "a dynamic stage starts where the scene is: its history must begin with 0 there, or a static stage come before it";

/// A displacement, or an angle in radians and degrees.
fn size(value: f64, turns: bool) -> String {
    let short = (value * 1e4).round() / 1e4;
    match turns {
        true if value == 0.0 => "0".into(),
        true => format!("{short} rad ({:.1}°)", value.to_degrees()),
        false => value.to_string(),
    }
}
