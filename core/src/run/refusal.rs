//! Why stages cannot begin, in words.

use crate::model::{Jump, Model, MotionKind, MotorJump, StageError, StageKind};

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

/// A cure where stage number `stage` (from 0) cannot begin.
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

/// The cure where the first stage is dynamic.
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
