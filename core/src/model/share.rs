//! What each effect of a scene adds to a system: how many of it there are, and what is there for it alone.

use super::{Model, StageContext};
use crate::effect::Effect;
use crate::system::{Cliques, Equations, Pattern, Slot, Symmetry};
use std::sync::Arc;

/// What an effect adds to a system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
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
    /// What each effect that acts in a stage adds to the system of these equations.
    pub fn shares(&self, stage: &StageContext, equations: &Equations) -> Vec<Share> {
        let effects = self.acting(stage);
        let cliques: Vec<_> = effects.iter().map(|effect| effect.cliques()).collect();
        let size_without = |left_out: Option<usize>| {
            let others = cliques.iter().enumerate().filter(|(k, _)| Some(*k) != left_out).map(|(_, own)| own.clone());
            let others: Vec<Cliques> = others.collect();
            let mut touched = vec![false; self.slots()];
            others.iter().flat_map(Cliques::iter).flatten().for_each(|&slot| touched[slot as usize] = true);
            let free = |slot: usize| equations.of(slot as Slot).iter().filter(|&&n| n != Equations::HELD).count();
            let unknowns = (0..touched.len()).filter(|&slot| touched[slot]).map(free).sum::<usize>();
            (
                unknowns,
                Pattern::new(equations.clone(), self.groups(equations.layout()), others, Symmetry::None).nonzeros(),
            )
        };
        let (unknowns, entries) = size_without(None);
        let share = |(k, effect): (usize, &Arc<dyn Effect>)| {
            let without = size_without(Some(k));
            let (unknowns, entries) = (unknowns - without.0, entries - without.1);
            Share { name: effect.name(), instances: cliques[k].len(), unknowns, entries }
        };
        effects.iter().enumerate().map(share).collect()
    }
}
