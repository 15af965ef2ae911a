//! Springs from nodes to ground.
//!
//! A rotational spring acts on the unwrapped rotation vector, which is continued through whole
//! turns from the start of the run (`State::unwrapped`): after two turns its moment is 4 pi times
//! its stiffness, and it does not depend on the chart of the node. With the unwrapped vector Pw = P
//! + 2 pi k n, D = dPw/dP and stiffness K: energy Pw.K Pw/2, f_P = D^T K Pw.

use crate::effect::{Effect, Energy, Roles, TangentForm};
use crate::kernel::{ElementSystem, Weights};
use crate::rotation::{Complement, Rotation, log, nearest_turn, unwound};
use crate::scalar::Real;
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Node, Slot, State};
use crate::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

/// The length, in radians, below which a rotation vector counts as a whole turn, which has no axis.
const MAX_WHOLE_TURN: f64 = 1e-9;

/// Forces of a damper to ground and their tangents.
struct DamperForce {
    /// Spatial force
    force: Vec3,
    /// Moment conjugate to the rotation unknown
    moment: Vec3,
    /// Weighted derivative of the force over the displacement
    over_u: Mat3,
    /// Weighted derivative of the moment over the rotation unknown
    over_p: Mat3,
}

/// A spring with a damper from a node to ground.
#[derive(Clone, Copy, Debug)]
pub struct GroundSpring {
    /// The node
    pub node: Node,
    /// Stiffness against displacement, force per length in global components
    pub translation: Mat3,
    /// Stiffness against rotation, moment per radian in global components
    pub rotation: Mat3,
    /// Damping of displacement, force per velocity in global components
    pub translation_damping: Mat3,
    /// Damping of the spatial angular velocity, moment times time in global components
    pub rotation_damping: Mat3,
    /// The index of its amplitude, which is 0 in stages without the spring and otherwise 1
    pub amplitude: usize,
}

/// All springs to ground.
#[derive(Clone, Debug, Default)]
pub struct GroundSprings {
    /// The springs
    pub springs: Vec<GroundSpring>,
}

impl Effect for GroundSprings {
    fn name(&self) -> &'static str {
        "springs to ground"
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn damps(&self) -> bool {
        self.springs.iter().any(GroundSpring::is_damped)
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::default();
        self.springs.iter().for_each(|spring| connectivity.push([spring.node.u, spring.node.p]));
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        TangentForm::symmetric(!self.damps())
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        for spring in &self.springs {
            let GroundSpring { translation, rotation, translation_damping, rotation_damping, .. } = *spring;
            for tensor in [translation, rotation, translation_damping, rotation_damping] {
                show(MirrorData::Tensor(tensor));
            }
        }
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Assembler) {
        let mut system = ElementSystem::new(2);
        for (k, spring) in self.springs.iter().enumerate() {
            let u = at.q[spring.node.u as usize];
            let on = at.amplitude[spring.amplitude];
            let (moment, tangent) = turned(spring.rotation * on, at, spring.node.p);
            system.clear();
            system.add_force(0, spring.translation * u * on);
            system.add_force(1, moment);
            system.add_tangent(0, 0, spring.translation * (on * weights.stiffness));
            system.add_tangent(1, 1, tangent * weights.stiffness);
            let moves = weights.damping != 0.0
                || at.v[spring.node.u as usize] != Vec3::ZERO
                || at.v[spring.node.p as usize] != Vec3::ZERO;
            let damping = (spring.is_damped() && moves).then(|| spring.damping(at, weights));
            if let Some(DamperForce { force, moment, over_u, over_p }) = damping {
                system.add_tangent(0, 0, over_u * on);
                system.add_tangent(1, 1, over_p * on);
                out.add(k, &system);
                out.add_damping(k, &[force * on, moment * on]);
            } else {
                out.add(k, &system);
            }
        }
    }

    fn energy(&self, at: &State) -> Energy {
        let one = |spring: &GroundSpring| {
            let u = at.q[spring.node.u as usize];
            let p = at.q[spring.node.p as usize];
            let unwrapped = unwound(p, at.unwrapped_at(spring.node.p));
            0.5 * at.amplitude[spring.amplitude]
                * (u.dot(spring.translation * u) + unwrapped.dot(spring.rotation * unwrapped))
        };
        Energy { kinetic: 0.0, strain: self.springs.iter().map(one).sum() }
    }

    fn strain_of(&self, at: &State, field: &[Vec3], length: f64) -> f64 {
        let held = |stiffness: Mat3, along: Vec3| {
            let largest = stiffness.max_abs();
            if largest == 0.0 { 0.0 } else { (along.dot(stiffness * along) / largest).max(0.0).sqrt() }
        };
        let one = |spring: &GroundSpring| {
            let u = field[spring.node.u as usize];
            let p = field[spring.node.p as usize];
            held(spring.translation, u).max(held(spring.rotation, p) * length) / length
        };
        let acting = self.springs.iter().filter(|spring| at.amplitude[spring.amplitude] != 0.0);
        acting.map(one).fold(0.0, f64::max)
    }

    fn roles(&self) -> Roles<'_> {
        Roles::NONE
    }
}

impl GroundSpring {
    fn is_damped(&self) -> bool {
        self.translation_damping != Mat3::ZERO || self.rotation_damping != Mat3::ZERO
    }

    /// Forces of the damper and their tangents. Its spatial moment is c w, with the spatial spin w
    /// = R Omega: f_P = T c w, whose tangent is C1(c w) + T c dw, dw = R (dOmega - Omega~ T dP).
    fn damping(&self, at: &State, weights: Weights) -> DamperForce {
        let force = self.translation_damping * at.v[self.node.u as usize];
        let over_velocity = self.translation_damping * weights.damping;
        if self.rotation_damping == Mat3::ZERO {
            return DamperForce { force, moment: Vec3::ZERO, over_u: over_velocity, over_p: Mat3::ZERO };
        }
        let spin = at.spin(self.node.p);
        let rotation = &spin.rotation;
        let moment = self.rotation_damping * (rotation.r * spin.omega);
        // For total vectors T^T R^T = T, but not for an increment after a base rotation.
        let back = rotation.t.transpose() * rotation.r.transpose();
        let material = rotation.r.transpose_mul(moment);
        let turned = Mat3::skew_mul(spin.omega, rotation.t) * -weights.stiffness;
        let d_spatial = rotation.r * (spin.omega_derivative(weights) + turned);
        let tangent = back * (self.rotation_damping * d_spatial)
            + (rotation.c2(material) + rotation.t.transpose_matmul(Mat3::skew_mul(material, rotation.t)))
                * weights.stiffness;
        DamperForce { force, moment: back * moment, over_u: over_velocity, over_p: tangent }
    }
}

/// Force and tangent of a rotational spring, conjugate to the unknown of the state: the total
/// vector P, or an increment X whose rotation has the total vector P. With the material moment M =
/// T(P)^-T f_P and a material spin t: f_X = T(X)^T M, and dM = T(P)^-T (K_P - C2(M)) T(P)^-1 t.
fn turned(stiffness: Mat3, at: &State, slot: Slot) -> (Vec3, Mat3) {
    let unwrapped = at.unwrapped_at(slot);
    if at.turn(slot).is_none() {
        return unwrapped_spring(stiffness, at.q[slot as usize], unwrapped);
    }
    if stiffness == Mat3::ZERO {
        return (Vec3::ZERO, Mat3::ZERO);
    }
    let increment = at.rotation(slot);
    let total = Rotation::new(log(increment.r));
    let (force, tangent) = unwrapped_spring(stiffness, total.p, unwrapped);
    let inverse = total.t_inverse();
    let moment = inverse.transpose_mul(force);
    let spun = inverse.transpose_matmul(tangent - total.c2(moment)) * inverse;
    let t = increment.t;
    (t.transpose_mul(moment), t.transpose_matmul(spun * t) + increment.c2(moment))
}

/// Force and tangent, conjugate to P, of a rotational spring whose node had the unwrapped vector
/// `unwrapped` in the last converged state. At a whole turn P has no axis and keeps that of
/// `unwrapped`.
fn unwrapped_spring(stiffness: Mat3, p: Vec3, unwrapped: Vec3) -> (Vec3, Mat3) {
    if p.norm() < MAX_WHOLE_TURN {
        (stiffness * unwound(p, unwrapped), stiffness)
    } else {
        rotational(stiffness, nearest_turn(p, unwrapped), p)
    }
}

/// The unwrapped vector Pw = P + 2 pi k n for k whole `turns`.
fn unwrapped_vector<T: Real>(turns: f64, p: Vec3<T>) -> Vec3<T> {
    if turns == 0.0 { p } else { p * (T::one() + T::constant(2.0 * PI * turns) / p.norm()) }
}

/// Force and tangent, conjugate to P, of a rotational spring whose node has gone through k whole
/// `turns`.
pub fn rotational<T: Real>(stiffness: Mat3, turns: f64, p: Vec3<T>) -> (Vec3<T>, Mat3<T>) {
    let k = Mat3::constant(stiffness);
    if turns == 0.0 {
        return (k * p, k);
    }
    // D = I + k (I - B), with the tensor B of the complement chart.
    let b = Complement::new(p, Vec3::zero(), Vec3::zero()).b;
    let d = Mat3::identity() + (Mat3::identity() - b).scale(turns);
    let pull = k * unwrapped_vector(turns, p);
    (d.transpose_mul(pull), d.transpose_matmul(k * d) - Complement::geometric(p, pull).scale(turns))
}
