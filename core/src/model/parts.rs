//! The parts that a model is put together from.

use super::beam_element::PlacedNode;
use super::{Amplitude, Charted, ElementInfo, Model, Motion, Names, SlotKind, Support};
use crate::effect::Effect;
use crate::system::Slot;
use crate::tensor::Vec3;
use std::sync::Arc;

/// The parts of a scene beside its nodes.
#[derive(Default)]
pub struct ModelParts {
    /// The names of the nodes, by their slots
    pub names: Names,
    /// The slots of joints, which follow those of the nodes: multipliers and sliding, with the names
    /// of the joints
    pub multipliers: Vec<(SlotKind, String)>,
    /// The beam elements in their order
    pub elements: Vec<ElementInfo>,
    /// The rotations on which springs to ground act
    pub sprung: Vec<Slot>,
    /// The rotations on the two sides of each joint that remembers its angle
    pub sprung_joints: Vec<[Option<Slot>; 2]>,
    /// The effects in the order in which their forces are added
    pub effects: Vec<Arc<dyn Effect>>,
    /// The factors of loads and springs, by the numbers that effects know them by
    pub amplitudes: Vec<Amplitude>,
    /// Supports
    pub supports: Vec<Support>,
    /// Prescribed motions
    pub motions: Vec<Motion>,
    /// True where static and dynamic stages are linear in the displacements
    pub linear: bool,
}

impl ModelParts {
    /// The model on these nodes, whose slots are numbered without gaps, in space.
    pub fn assemble(self, nodes: &[PlacedNode]) -> Model {
        let Self { mut names, multipliers, elements, sprung, sprung_joints, .. } = self;
        let rotations: Vec<Slot> = nodes.iter().map(|node| node.node.p).collect();
        let slots = rotations.iter().map(|&slot| slot as usize + 1).max().unwrap_or(0);
        let mut kinds = Vec::with_capacity(slots + multipliers.len());
        kinds.resize(slots, SlotKind::Displacement);
        rotations.iter().for_each(|&slot| kinds[slot as usize] = SlotKind::Rotation);
        for (kind, name) in multipliers {
            names.give(kinds.len() as Slot, &name);
            kinds.push(kind);
        }
        Model {
            multipliers: (slots as Slot..kinds.len() as Slot).filter(|&k| kinds[k as usize].is_multiplier()).collect(),
            kinds: Arc::new(kinds),
            names: Arc::new(names),
            angles: sprung_joints.len(),
            sprung,
            sprung_joints,
            elements: elements.len(),
            rotating: Charted { rotations, elements },
            effects: self.effects,
            amplitudes: self.amplitudes,
            supports: self.supports,
            motions: self.motions,
            plane: None,
            linear: self.linear,
            length: diagonal(nodes.iter().map(|node| node.place)),
        }
    }
}

/// The diagonal of the box around some places, or 1 where it has none: the length to which
/// displacements are compared.
fn diagonal(places: impl Iterator<Item = Vec3>) -> f64 {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for place in places {
        for k in 0..3 {
            low[k] = low[k].min(place.0[k]);
            high[k] = high[k].max(place.0[k]);
        }
    }
    let diagonal = Vec3([0, 1, 2].map(|k| high[k] - low[k])).norm();
    if diagonal.is_finite() && diagonal > 0.0 { diagonal } else { 1.0 }
}
