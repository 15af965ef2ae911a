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
    /// Lengths of bodies: radii of gyration and of contact
    pub sizes: Vec<f64>,
    /// True where static and dynamic stages are linear in the displacements
    pub linear: bool,
}

impl ModelParts {
    /// The model on these nodes, whose slots are numbered without gaps, in space.
    pub fn assemble(self, nodes: &[PlacedNode]) -> Model {
        let length = self.length_of(nodes);
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
            length,
        }
    }

    /// The length to which displacements are compared: how far apart nodes are, or the size of bodies where all nodes
    /// are at one place, or 1.
    fn length_of(&self, nodes: &[PlacedNode]) -> f64 {
        let places: Vec<Vec3> = nodes.iter().map(|node| node.place).collect();
        let bodies = || self.sizes.iter().copied().fold(0.0, f64::max);
        let length = Some(largest_distance(&places)).filter(|length| *length > 0.0).unwrap_or_else(bodies);
        if length.is_finite() && length > 0.0 { length } else { 1.0 }
    }
}

/// Steps from one place to the one that is the farthest from it, at most.
const MOST_STEPS: usize = 8;

/// The distance of two places that are the farthest from each other, or nearly so, found from the mean place on. Unlike
/// the box around the places it does not depend on how the axes lie.
fn largest_distance(places: &[Vec3]) -> f64 {
    let mean = places.iter().fold(Vec3::ZERO, |sum, place| sum + *place) * (1.0 / places.len().max(1) as f64);
    let (mut from, mut length) = (mean, 0.0);
    for step in 0..MOST_STEPS {
        let distance = |place: &Vec3| (*place - from).norm();
        let Some(farthest) = places.iter().copied().max_by(|a, b| distance(a).total_cmp(&distance(b))) else { break };
        let apart = distance(&farthest);
        // The first step is from the mean.
        if step > 0 && apart <= length {
            break;
        }
        length = if step > 0 { apart } else { 0.0 };
        from = farthest;
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_distance_is_that_of_the_farthest_places() {
        let at = |x: f64, y: f64| Vec3([x, y, 0.0]);
        assert_eq!(largest_distance(&[]), 0.0);
        assert_eq!(largest_distance(&[at(3.0, 1.0); 2]), 0.0);
        assert_eq!(largest_distance(&[at(0.0, 0.0), at(1.0, 0.0), at(10.0, 0.0)]), 10.0);
        // A frame has the diagonal of its box.
        let frame = [at(0.0, 0.0), at(0.0, 3.0), at(4.0, 3.0), at(4.0, 0.0)];
        assert_eq!(largest_distance(&frame), 5.0);
        // In any axes.
        for angle in [0.3, 1.0, 2.4] {
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            let turned =
                frame.map(|place| at(cos * place.0[0] - sin * place.0[1], sin * place.0[0] + cos * place.0[1]));
            assert!((largest_distance(&turned) - 5.0).abs() < 1e-14);
        }
    }
}
