//! Steps whose rotational unknowns are increments from the last converged rotation.
//!
//! Between steps a state holds total rotation vectors, as everywhere. While a step is iterated it holds, for each rotation,
//! the increment X with R = R_n exp(X), the material spin Omega and its rate (Bruls, Cardona & Arnold 2012,
//! doi:10.1016/j.mechmachtheory.2011.07.017); nothing then depends on where the total vector happens to be.

use super::charts::DYNAMIC_BAND;
use crate::kernel::inertia::Spin;
use crate::rotation::{Rotation, complement, log};
use crate::system::{Slot, State};
use crate::tensor::{Mat3, Vec3};
use std::f64::consts::PI;

/// The algorithmic acceleration of rotations becomes that of the spin.
pub fn start(state: &mut State, rotations: &[Slot]) {
    for &slot in rotations {
        state.algorithmic[slot as usize] = state.spin(slot).acceleration;
    }
}

/// From total vectors to increments.
pub fn begin(state: &mut State, rotations: &[Slot]) {
    let mut bases = vec![Mat3::IDENTITY; state.q.len()];
    for &slot in rotations {
        let (k, spin) = (slot as usize, state.spin(slot));
        bases[k] = spin.rotation.r;
        state.q[k] = Vec3::ZERO;
        state.v[k] = spin.omega;
        state.a[k] = spin.acceleration;
    }
    state.base = Some(bases);
}

/// From increments to total vectors, each in the chart of `before` unless that has been left; returns how many have.
pub fn end(state: &mut State, before: &State, rotations: &[Slot]) -> usize {
    let Some(bases) = state.base.take() else { return 0 };
    let mut switched = 0;
    for &slot in rotations {
        let k = slot as usize;
        let increment = Rotation::new(state.q[k]).after(bases[k]);
        let short = log(increment.r);
        let far = complement(short);
        let nearer = (far - before.q[k]).squared() < (short - before.q[k]).squared();
        let within = far.squared() <= (PI + DYNAMIC_BAND) * (PI + DYNAMIC_BAND);
        switched += usize::from(nearer && !within);
        let p = if nearer && within { far } else { short };
        let (velocity, acceleration) = rates(p, state.v[k], state.a[k]);
        (state.q[k], state.v[k], state.a[k]) = (p, velocity, acceleration);
    }
    switched
}

/// Pd = T^-1 Omega, Pdd = T^-1 (Acc - Td Pd)
fn rates(p: Vec3, omega: Vec3, acceleration: Vec3) -> (Vec3, Vec3) {
    let rotation = Rotation::new(p);
    let inverse = rotation.t_inverse();
    let velocity = inverse * omega;
    (velocity, inverse * (acceleration - rotation.t_rate(velocity) * velocity))
}

/// The spin's acceleration at a slot of a state with total vectors.
pub fn spin_acceleration(state: &State, slot: Slot) -> Vec3 {
    let k = slot as usize;
    Spin::new(state.q[k], state.v[k], state.a[k]).acceleration
}
