//! Springs from nodes to ground.
//!
//! A rotational spring acts on the rotation vector continued since the start (`State::unwrapped`):
//! unwrapped up by two turns it pulls with 4 pi times its stiffness, and it does not notice when
//! the node changes its chart. With the unwrapped vector Pw = P + 2 pi k n, D = dPw/dP and
//! stiffness k: energy Pw.k Pw/2, f_P = D^T k Pw.

use crate::effect::{Effect, Energy, Roles, TangentForm};
use crate::kernel::{ElementSystem, Weights};
use crate::rotation::{Complement, Rotation, log, nearest_turn, unwound};
use crate::scalar::Real;
use crate::system::{Assembler, Category, Connectivity, Memory, MirrorData, Node, Slot, State};
use crate::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

/// Rotation vectors shorter than this have come to a whole turn.
const WHOLE_TURN: f64 = 1e-9;

/// A spring with a damper from a node to ground.
#[derive(Clone, Copy, Debug)]
pub struct GroundSpring {
    /// The node it holds
    pub node: Node,
    /// Its stiffness against displacement, global components
    pub translation: Mat3,
    /// Its stiffness against rotation, global components
    pub rotation: Mat3,
    /// Its damping of displacement, global components
    pub translation_damping: Mat3,
    /// Its damping of the spatial angular velocity, global components
    pub rotation_damping: Mat3,
    /// The number of its amplitude: 0 in stages where it is absent, else 1
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
            if let Some((force, moment, tangents)) = damping {
                system.add_tangent(0, 0, tangents[0] * on);
                system.add_tangent(1, 1, tangents[1] * on);
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

    /// Forces of the damper and their tangents. A moment c w fixed in space, with w = R Omega: f_P
    /// = T c w, whose tangent is C1(c w) + T c dw, dw = R (dOmega - Omega~ T dP).
    fn damping(&self, at: &State, weights: Weights) -> (Vec3, Vec3, [Mat3; 2]) {
        let force = self.translation_damping * at.v[self.node.u as usize];
        let over_velocity = self.translation_damping * weights.damping;
        if self.rotation_damping == Mat3::ZERO {
            return (force, Vec3::ZERO, [over_velocity, Mat3::ZERO]);
        }
        let spin = at.spin(self.node.p);
        let rotation = &spin.rotation;
        let moment = self.rotation_damping * (rotation.r * spin.omega);
        // T^T R^T = T holds for total vectors; of an increment after a base only T^T R^T is meant.
        let back = rotation.t.transpose() * rotation.r.transpose();
        let material = rotation.r.transpose_mul(moment);
        let turned = Mat3::skew_mul(spin.omega, rotation.t) * -weights.stiffness;
        let d_spatial = rotation.r * (spin.omega_derivative(weights) + turned);
        let tangent = back * (self.rotation_damping * d_spatial)
            + (rotation.c2(material) + rotation.t.transpose_matmul(Mat3::skew_mul(material, rotation.t)))
                * weights.stiffness;
        (force, back * moment, [over_velocity, tangent])
    }
}

/// Force and tangent of a rotational spring over the unknown of the state: the total vector, or an
/// increment X after which it is P. With the material moment M = T(P)^-T f_P: f_X = T(X)^T M, and
/// dM = T(P)^-T (K_P - C2(M)) T(P)^-1 t.
fn turned(stiffness: Mat3, at: &State, slot: Slot) -> (Vec3, Mat3) {
    let unwrapped = at.unwrapped_at(slot);
    if at.turn(slot).is_none() {
        return wound_up(stiffness, at.q[slot as usize], unwrapped);
    }
    if stiffness == Mat3::ZERO {
        return (Vec3::ZERO, Mat3::ZERO);
    }
    let increment = at.rotation(slot);
    let total = Rotation::new(log(increment.r));
    let (force, tangent) = wound_up(stiffness, total.p, unwrapped);
    let inverse = total.t_inverse();
    let moment = inverse.transpose_mul(force);
    let spun = inverse.transpose_matmul(tangent - total.c2(moment)) * inverse;
    let t = increment.t;
    (t.transpose_mul(moment), t.transpose_matmul(spun * t) + increment.c2(moment))
}

/// Force and tangent of a rotational spring whose node was last unwrapped by `unwrapped`. At a
/// whole turn P has no axis of its own and keeps the one of before.
fn wound_up(stiffness: Mat3, p: Vec3, unwrapped: Vec3) -> (Vec3, Mat3) {
    if p.norm() < WHOLE_TURN {
        (stiffness * unwound(p, unwrapped), stiffness)
    } else {
        rotational(stiffness, nearest_turn(p, unwrapped), p)
    }
}

/// Pw = P + 2 pi k n
fn wind<T: Real>(turns: f64, p: Vec3<T>) -> Vec3<T> {
    if turns == 0.0 { p } else { p * (T::one() + T::constant(2.0 * PI * turns) / p.norm()) }
}

/// Force and tangent of a rotational spring that has been unwrapped by whole `turns`.
pub fn rotational<T: Real>(stiffness: Mat3, turns: f64, p: Vec3<T>) -> (Vec3<T>, Mat3<T>) {
    let k = Mat3::constant(stiffness);
    if turns == 0.0 {
        return (k * p, k);
    }
    // D = I + k (I - B): the complement chart's B, turned into whole turns the other way.
    let b = Complement::new(p, Vec3::zero(), Vec3::zero()).b;
    let d = Mat3::identity() + (Mat3::identity() - b).scale(turns);
    let pull = k * wind(turns, p);
    (d.transpose_mul(pull), d.transpose_matmul(k * d) - Complement::geometric(p, pull).scale(turns))
}
