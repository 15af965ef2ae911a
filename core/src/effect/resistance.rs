//! An artificial resistance against motion, with which a static stage finds the state of rest of
//! structures that only their loads hold.
//!
//! Each node is pulled back to its place and rotation (index n) in an anchored state, by the
//! potential
//!
//! ```text
//! c/2 (|u - u_n|^2 + l^2 |theta|^2),   theta = log(R_n^T R)
//! ```
//!
//! with the resistance c, a force per displacement, and an arm l. Balance against it is a step of
//! an implicit Euler scheme for a motion along the forces, c dq/dt = -g (proximal point method:
//! Rockafellar 1976, doi:10.1137/0314056). It belongs to no scene: a stage adds it while it looks
//! for rest, and it vanishes at the balance that is found.

use super::{Effect, Roles, TangentForm, one_by_one, own_part};
use crate::kernel::{ElementSystem, Weights};
use crate::rotation::{Rotation, log};
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Slot, StageContext, State};
use crate::tensor::{Mat3, Vec3};

/// Artificial resistance at all slots of nodes. It acts only in states with an anchor.
#[derive(Clone, Debug)]
pub struct Resistance {
    /// The slots of nodes; true for those of rotations
    pub(crate) slots: Vec<(Slot, bool)>,
    /// The arm l, a length, by which rotations compare with displacements
    pub(crate) arm: f64,
}

impl Effect for Resistance {
    fn name(&self) -> &'static str {
        "artificial resistance"
    }

    /// Damping: the energy balance books its work as damped.
    fn category(&self) -> Category {
        Category::Damping
    }

    fn connectivity(&self) -> Connectivity {
        one_by_one(&self.slots)
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::Symmetric
    }

    fn acts(&self, _stage: &StageContext) -> bool {
        true
    }

    /// Forces of resistance lie in the plane of a planar motion: there are no data to show.
    fn mirror_data(&self, _show: &mut dyn FnMut(MirrorData)) {}

    /// Adds force and tangent; the tangent of rotations is that at theta = 0, up to terms of order
    /// theta.
    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let Some(anchor) = &at.anchor else { return };
        let mut system = ElementSystem::new(1);
        for k in own_part(0, self.slots.len(), &out.instances()) {
            let (slot, turns) = self.slots[k];
            let q = at.q[slot as usize];
            let before = anchor.q[slot as usize];
            system.clear();
            if turns {
                let rotation = Rotation::new(q);
                let base = Rotation::new(before);
                let t = rotation.t;
                let resistance = anchor.resistance * self.arm * self.arm;
                let theta = log(base.r.transpose() * rotation.r);
                system.add_force(0, t.transpose_mul(theta) * resistance);
                system.add_tangent(0, 0, (t.transpose() * t).scale(resistance * weights.stiffness));
            } else {
                system.add_force(0, (q - before) * anchor.resistance);
                system.add_tangent(0, 0, Mat3::diagonal([anchor.resistance * weights.stiffness; 3]));
            }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::complement;

    /// The moment of a unit resistance, conjugate to the rotation vector.
    fn moment(p: Vec3, base: Vec3) -> Vec3 {
        let rotation = Rotation::new(p);
        let base = Rotation::new(base);
        rotation.t.transpose_mul(log(base.r.transpose() * rotation.r))
    }

    #[test]
    fn moments_are_the_gradient_of_the_potential_in_every_chart() {
        let potential =
            |p: Vec3, base: Vec3| 0.5 * log(Rotation::new(base).r.transpose() * Rotation::new(p).r).squared();
        let base = Vec3([0.4, 2.2, -1.1]);
        for p in [Vec3([0.9, 1.9, -0.6]), complement(Vec3([0.9, 2.9, -0.6])), base] {
            for axis in Vec3::UNIT {
                let step = axis * 1e-5;
                let slope = (potential(p + step, base) - potential(p - step, base)) / 2e-5;
                assert!((slope - moment(p, base).dot(axis)).abs() < 1e-8, "{p:?} {axis:?}");
            }
        }
    }
}
