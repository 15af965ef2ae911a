//! What each effect of a scene adds to a system: how many of it there are, and what is there for it
//! alone.

use super::{Model, StageContext};
use crate::effect::Effect;
use crate::system::{Connectivity, DofMap, Pattern, Slot, Symmetry};
use std::sync::Arc;

/// The size of an effect: instances and entries that it adds to a system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectSize {
    /// The effect
    pub name: &'static str,
    /// How many of it there are: elements, loads, …
    pub instances: usize,
    /// Unknowns that nothing else touches
    pub unknowns: usize,
    /// Entries of the tangent that are there for it alone
    pub entries: usize,
}

impl Model {
    /// The sizes of all effects that act in a stage, in the system of these equations.
    pub fn shares(&self, stage: &StageContext, dof_map: &DofMap) -> Vec<EffectSize> {
        let effects = self.acting(stage);
        let connectivity: Vec<_> = effects.iter().map(|effect| effect.connectivity()).collect();
        let size_without = |left_out: Option<usize>| {
            let others =
                connectivity.iter().enumerate().filter(|(k, _)| Some(*k) != left_out).map(|(_, own)| own.clone());
            let others: Vec<Connectivity> = others.collect();
            let mut touched = vec![false; self.slots()];
            others.iter().flat_map(Connectivity::iter).flatten().for_each(|&slot| touched[slot as usize] = true);
            let free = |slot: usize| dof_map.of(slot as Slot).iter().filter(|&&n| n != DofMap::HELD).count();
            let unknowns = (0..touched.len()).filter(|&slot| touched[slot]).map(free).sum::<usize>();
            (
                unknowns,
                Pattern::new(dof_map.clone(), self.node_blocks(dof_map.layout()), others, Symmetry::None).nonzeros(),
            )
        };
        let (unknowns, entries) = size_without(None);
        let share = |(k, effect): (usize, &Arc<dyn Effect>)| {
            let without = size_without(Some(k));
            let (unknowns, entries) = (unknowns - without.0, entries - without.1);
            EffectSize { name: effect.name(), instances: connectivity[k].len(), unknowns, entries }
        };
        effects.iter().enumerate().map(share).collect()
    }
}
