//! Fading inertia: static stages take forces of inertia and damping over from a motion before them.

use super::Composer;
use crate::deck::EffectWord;
use beamsim_core::effect::Effect;
use beamsim_core::effect::inertia::FadingInertia;
use beamsim_core::model::StageSet;
use std::collections::BTreeSet;

impl Composer<'_> {
    /// The forces of inertia and damping, in stages that need them.
    pub(super) fn fading_inertia(&mut self) {
        let mesh = self.mesh;
        let stages = self.stages_after_motion();
        let slots = mesh.nodes.iter().flat_map(|node| [(node.node.u, false), (node.node.p, true)]);
        let slots: BTreeSet<_> = if stages.is_empty() { BTreeSet::new() } else { slots.collect() };
        let named: Vec<String> = stages.iter().map(|number| format!("stage {}", number + 1)).collect();
        let effect = FadingInertia { slots: slots.into_iter().collect(), stages: StageSet(Some(stages)) };
        if named.is_empty() {
            return self.reason(effect.name(), false, "no static stage after a dynamic one");
        }
        if !self.deck.effects.allow(EffectWord::LargeRotations) {
            return self.reason(effect.name(), false, "linear stages find the equilibrium from any state");
        }
        self.push(effect, format!("{} starts from a state that may be moving", named.join(", ")));
    }

    /// Static stages after a dynamic one, and after static ones that may have ended before all was
    /// taken away; from 0.
    fn stages_after_motion(&self) -> Vec<usize> {
        let mut stages = Vec::new();
        let mut moves = false;
        for (number, stage) in self.deck.stages.iter().enumerate() {
            if stage.body.kind().advances_time() {
                moves = true;
            } else if stage.body.kind().ramps_load() {
                stages.extend(moves.then_some(number));
                moves &= stage.until.is_some();
            }
        }
        stages
    }
}
