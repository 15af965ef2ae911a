//! From a motion to a static stage, see [`crate::effect::inertia::FadingInertia`].

use super::stage_run::{Run, StageRun};
use crate::effect::inertia::fading_force;
use crate::kernel::Weights;
use crate::model::{SlotKind, StageKind};
use crate::system::{Category, Fading, System};
use crate::tensor::Vec3;
use crate::threads;
use std::sync::Arc;

impl Run<'_> {
    /// At the end of a stage: what a static stage that comes is to take over.
    pub(super) fn hand_over(&mut self, workshop: &mut StageRun) {
        let mut later = self.plan.stages[self.stage + 1..].iter().map(|stage| stage.work.kind());
        match self.plan.stages[self.stage].work.kind() {
            StageKind::Dynamic if later.any(|kind| kind == StageKind::Static) => {
                // Charts may have changed since forces were looked at.
                workshop.assembly.evaluate(&self.state, Weights::NONE, None);
                let (kinds, q) = (&self.model.kinds, &self.state.q);
                let force = |slot: usize| carried(kinds[slot], &workshop.assembly.system, slot);
                let fading = threads::list(q.len(), |slot| Fading { force: force(slot), at: q[slot] });
                self.state.fading = Arc::new(fading);
            }
            StageKind::Static if self.state.load == 1.0 => self.state.fading = Arc::default(),
            StageKind::Static => {
                let rest = 1.0 - self.state.load;
                Arc::make_mut(&mut self.state.fading).iter_mut().for_each(|fading| fading.force = fading.force * rest);
            }
            _ => {}
        }
    }

    /// At the start of a static stage: what it knows itself of inertia, as seen from a frame that rotates, does not fade.
    pub(super) fn take_over(&mut self, workshop: &mut StageRun) {
        if self.state.fading.is_empty() {
            return;
        }
        workshop.assembly.evaluate(&self.state, Weights::NONE, None);
        let (kinds, state) = (&self.model.kinds, &self.state);
        let rest = |slot: usize| {
            let (kind, at) = (kinds[slot], state.q[slot]);
            let (force, _) = fading_force(&state.fading[slot], kind == SlotKind::Rotation, at);
            Fading { force: force - carried(kind, &workshop.assembly.system, slot), at }
        };
        let fading = threads::list(state.q.len(), rest);
        self.state.fading = Arc::new(fading);
    }
}

/// What inertia and damping do at a slot of a node.
fn carried(kind: SlotKind, system: &System, slot: usize) -> Vec3 {
    let [inertia, damping] = [Category::Inertia, Category::Damping].map(|category| system.part_of(category, slot));
    if kind.is_multiplier() { Vec3::ZERO } else { inertia + damping }
}
