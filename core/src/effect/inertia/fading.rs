//! Fading inertia: forces of inertia and damping of a structure that a static stage finds in
//! motion, which fade with the load factor.
//!
//! A static stage has no inertia. After a dynamic stage its first state is out of balance by the
//! forces of inertia and damping, and a smaller load level would not bring it nearer to balance. So
//! the stage begins in balance with these forces, and removes them from load factor 0 to 1. Each
//! force is constant and conjugate to the unknowns of its node in the chart at the start of the
//! stage: it has a potential, and its tangent is zero until the chart changes.

use crate::effect::{Effect, Roles, TangentForm, one_by_one, own_part};
use crate::kernel::load::force_on_complement;
use crate::kernel::{ElementSystem, Weights};
use crate::rotation::complement;
use crate::system::{
    Assembler, Category, Connectivity, Fading, Memory, MirrorData, Slot, StageContext, StageSet, State,
};
use crate::tensor::{Mat3, Vec3};

/// Fading forces at all slots of nodes, see `State::fading`.
#[derive(Clone, Debug)]
pub struct FadingInertia {
    /// The slots of nodes; true for those of rotations
    pub slots: Vec<(Slot, bool)>,
    /// The static stages that may begin in motion
    pub stages: StageSet,
}

impl Effect for FadingInertia {
    fn name(&self) -> &'static str {
        "fading inertia"
    }

    fn category(&self) -> Category {
        Category::External
    }

    fn connectivity(&self) -> Connectivity {
        one_by_one(&self.slots)
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::Symmetric
    }

    fn acts(&self, stage: &StageContext) -> bool {
        stage.kind.ramps_load() && self.stages.contains(stage.number)
    }

    /// A motion in a plane has forces in that plane: there are no data to show.
    fn mirror_data(&self, _show: &mut dyn FnMut(MirrorData)) {}

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        if at.fading.is_empty() {
            return;
        }
        let share = 1.0 - at.load;
        let mut system = ElementSystem::new(1);
        for k in own_part(0, self.slots.len(), &out.instances()) {
            let (slot, turns) = self.slots[k];
            let (force, tangent) = fading_force(&at.fading[slot as usize], turns, at.q[slot as usize]);
            system.clear();
            system.add_force(0, force * share);
            system.add_tangent(0, 0, tangent * (share * weights.stiffness));
            out.add(k, &system);
        }
    }

    fn strain_of(&self, _at: &State, _field: &[Vec3], _length: f64) -> f64 {
        0.0
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}

/// The unfaded force, conjugate to the present unknowns `q`, and its tangent; `turns` is true for
/// the slot of a rotation.
pub fn fading_force(fading: &Fading, turns: bool, q: Vec3) -> (Vec3, Mat3) {
    let is_far = |p: Vec3| (complement(p) - fading.at).squared() < (p - fading.at).squared();
    match turns && q != Vec3::ZERO && is_far(q) {
        true => force_on_complement(q, fading.force),
        false => (fading.force, Mat3::ZERO),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The work of a force along a motion does not depend on the present chart of its node.
    #[test]
    fn a_change_of_chart_changes_no_work() {
        let fading = Fading { force: Vec3([1.0, -2.0, 0.5]), at: Vec3([0.2, 2.9, 0.3]) };
        let p = Vec3([0.3, 3.2, 0.4]);
        let increment = Vec3([1e-6, 2e-6, -3e-6]);
        let work = |from: Vec3, to: Vec3| fading_force(&fading, true, from).0.dot(to - from);
        let near = work(p, p + increment);
        let far = work(complement(p), complement(p + increment));
        assert!((near - far).abs() < 1e-11 && near.abs() > 1e-6, "{near} {far}");
        assert_eq!(fading_force(&fading, true, Vec3::ZERO), (fading.force, Mat3::ZERO));
        assert_eq!(fading_force(&fading, false, complement(p)), (fading.force, Mat3::ZERO));
    }
}
