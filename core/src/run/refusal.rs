//! Why stages cannot begin, in words.

use crate::model::{Jump, Model, MotionKind, MotorJump, StageError, StageKind, SurfaceJump};

/// Why a stage cannot begin.
pub fn refusal(error: &StageError, model: &Model) -> String {
    let node = |slot: u32| model.node_at(slot as usize);
    match error {
        StageError::Conflict(conflict) => format!(
            "constraints on node \"{}\" have directions that are neither parallel nor orthogonal, which is not \
             supported",
            node(conflict.slot)
        ),
        StageError::Jump(Jump { motion, from, to }) => {
            let motion = &model.motions[*motion];
            let turns = motion.kind == MotionKind::Rotation;
            let name = node(motion.slot);
            if from == to {
                return format!(
                    "the motion of node \"{name}\" changes its axis of rotation: the node has already turned about \
                     another axis"
                );
            }
            let (from, to) = (size(*from, turns), size(*to, turns));
            format!("the motion of node \"{name}\" must start at {from}, where the node is, but starts at {to}")
        }
        StageError::TurnedHinge(slot) => {
            format!("a support fixes single rotation components of node \"{}\", which has already rotated", node(*slot))
        }
        StageError::MotorJump(MotorJump { slot, turns, from, to, .. }) => {
            let (from, to) = (size(*from, *turns), size(*to, *turns));
            format!("the motor of the {} must start at {from}, where the joint is, but starts at {to}", node(*slot))
        }
        StageError::SurfaceJump(SurfaceJump { surface, turns, from, to, .. }) => {
            let (from, to) = (size(*from, *turns), size(*to, *turns));
            format!(
                "the motion of surface \"{surface}\" must start at {from}, where the surface is, but starts at {to}"
            )
        }
        StageError::NothingGrows(StageKind::Buckling) => {
            "a buckling stage needs a load or a motion that grows with the load factor".into()
        }
        StageError::NothingGrows(_) => {
            "control = \"arc_length\" needs a load or a motion that grows with the load factor".into()
        }
        StageError::NoMass => "a modal stage needs mass: no node that is free to move has mass".into(),
    }
}

/// A cure where stage number `stage` (from 0) cannot begin.
pub fn refusal_help(error: &StageError, model: &Model, stage: usize) -> Option<String> {
    let driven = |own_stages: Option<bool>| match own_stages {
        None if stage == 0 => "a stage starts from the current state: give it a `history` that starts at 0".into(),
        None => "give it a `history` that starts at the current value".into(),
        Some(false) => format!(
            "a history is a function of the load factor in static stages and of time in dynamic ones: `history = {{ \
             name = …, stages = [{}] }}` starts with this stage and keeps its first value before",
            stage + 1
        ),
        Some(true) => "its history must start at the value that the previous stage ended with".into(),
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
        StageError::MotorJump(MotorJump { amplitude, .. }) | StageError::SurfaceJump(SurfaceJump { amplitude, .. }) => {
            match model.amplitudes[*amplitude].has_own_stages() {
                Some(_) if stage == 0 => Some(START.into()),
                own_stages => Some(driven(own_stages)),
            }
        }
        StageError::TurnedHinge(_) => Some("fix all three, or fix them from the first stage on".into()),
        StageError::Conflict(_) | StageError::NothingGrows(_) | StageError::NoMass => None,
    }
}

/// The cure where the first stage jumps.
const START: &str =
    "a stage starts from the current state: the history must start at 0, or a static stage must come before";

/// A displacement, or an angle in radians and degrees.
fn size(value: f64, turns: bool) -> String {
    let short = (value * 1e4).round() / 1e4;
    match turns {
        true if value == 0.0 => "0".into(),
        true => format!("{short} rad ({:.1}°)", value.to_degrees()),
        false => value.to_string(),
    }
}
