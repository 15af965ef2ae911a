//! From a motion to a static stage, see [`crate::effect::inertia::FadingInertia`].

use super::stage_run::StageRun;
use crate::effect::inertia::fading_force;
use crate::kernel::Weights;
use crate::model::{SlotKind, StageKind};
use crate::system::{Category, Fading, System};
use crate::tensor::Vec3;
use crate::threads;
use std::sync::Arc;

impl StageRun<'_> {
    /// At the end of a stage: what a static stage that comes is to take over.
    pub fn hand_over(&mut self) {
        let kind = self.stage().work.kind();
        let mut later = self.plan.stages[self.number + 1..].iter().map(|stage| stage.work.kind());
        if kind.advances_time() && later.any(StageKind::ramps_load) {
            self.leave_inertia_behind();
        } else if kind.ramps_load() && self.state.load == 1.0 {
            self.state.fading = Arc::default();
        } else if kind.ramps_load() {
            let rest = 1.0 - self.state.load;
            let fading = Arc::make_mut(&mut self.state.fading);
            fading.iter_mut().for_each(|fading| fading.force = fading.force * rest);
        }
    }

    /// Keeps the forces of inertia and damping of the state.
    fn leave_inertia_behind(&mut self) {
        let Self { assembly, state, model, .. } = self;
        // Charts may have changed since forces were looked at.
        assembly.evaluate(state, Weights::NONE, None);
        let system = &assembly.system;
        let force = |slot: usize| carried(model.kinds[slot], system, slot);
        let fading = threads::list(state.q.len(), |slot| Fading { force: force(slot), at: state.q[slot] });
        state.fading = Arc::new(fading);
    }

    /// At the start of a static stage: what it knows itself of inertia, as seen from a frame that
    /// rotates, does not fade.
    pub fn take_over(&mut self) {
        if self.state.fading.is_empty() {
            return;
        }
        let Self { assembly, state, model, .. } = self;
        assembly.evaluate(state, Weights::NONE, None);
        let system = &assembly.system;
        let rest = |slot: usize| {
            let (kind, at) = (model.kinds[slot], state.q[slot]);
            let (force, _) = fading_force(&state.fading[slot], kind == SlotKind::Rotation, at);
            Fading { force: force - carried(kind, system, slot), at }
        };
        let fading = threads::list(state.q.len(), rest);
        state.fading = Arc::new(fading);
    }
}

/// The force of inertia and damping at a slot of a node.
fn carried(kind: SlotKind, system: &System, slot: usize) -> Vec3 {
    let [inertia, damping] = [Category::Inertia, Category::Damping].map(|category| system.part_of(category, slot));
    if kind.is_multiplier() { Vec3::ZERO } else { inertia + damping }
}
