//! Steps whose rotational unknowns are increments.
//!
//! Between steps a state holds total rotation vectors, as everywhere. While a step is iterated it holds, for each rotation,
//! the increment X with R = R_n exp(X), and the spin that belongs to it (see [`crate::kernel::turn`]); nothing then depends on where
//! the total vector happens to be.

use super::Step;
use crate::kernel::inertia::Spin;
use crate::kernel::turn::{Carrier, Start, Turn};
use crate::model::Model;
use crate::model::charts::DYNAMIC_BAND;
use crate::rotation::{Rotation, complement, log};
use crate::system::{Equations, Slot, State};
use crate::tensor::{Mat3, Vec3};
use nalgebra::{Matrix3, SymmetricEigen};
use std::f64::consts::PI;

/// An inertia with principal values farther apart than this makes no momentum that a spin could be found from.
const LARGEST_RATIO: f64 = 1e8;

/// The rotations of a scene, and the momentum that each carries from step to step.
pub struct Increments {
    carriers: Vec<(Slot, Carrier)>,
}

impl Increments {
    /// For a stage with these equations.
    pub fn new(model: &Model, equations: &Equations) -> Self {
        let inertia = model.inertia_of_rotations();
        let carrier = |&slot: &Slot| {
            // A hinge turns about a fixed axis: its spin has one component, its momentum three.
            let free = equations.of(slot).iter().all(|&number| number != Equations::HELD);
            (slot, Some(inertia[slot as usize]).filter(|_| free).and_then(momentum).unwrap_or(Carrier::SPIN))
        };
        Self { carriers: model.rotations.iter().map(carrier).collect() }
    }

    /// At the start of a stage, what is algorithmic is what is.
    pub fn start(&self, state: &mut State) {
        for &(slot, carrier) in &self.carriers {
            let spin = state.spin(slot);
            let (r, inertia) = (spin.rotation.r, carrier.tensor);
            let rate = inertia * spin.acceleration + spin.omega.cross(inertia * spin.omega);
            state.algorithmic[slot as usize] = r * rate;
        }
    }

    /// From total vectors to increments. `before` is the length of the step before.
    pub fn begin(&self, state: &mut State, step: &Step, before: f64) {
        let mut turns = vec![None; state.q.len()];
        for &(slot, carrier) in &self.carriers {
            let (k, spin) = (slot as usize, state.spin(slot));
            let start = Start {
                rotation: spin.rotation.r,
                omega: spin.omega,
                acceleration: spin.acceleration,
                algorithmic: state.algorithmic[k],
                stretch: step.length / before,
            };
            turns[k] = Some(Turn::new(step.coefficients(), carrier, &start));
            (state.q[k], state.v[k], state.a[k]) = (Vec3::ZERO, spin.omega, spin.acceleration);
        }
        state.turns = turns;
    }

    /// From increments to total vectors, each in the chart of `before` unless that has been left; returns how many have.
    pub fn end(&self, state: &mut State, before: &State) -> usize {
        let mut switched = 0;
        for (k, turn) in std::mem::take(&mut state.turns).into_iter().enumerate() {
            let Some(turn) = turn else { continue };
            state.algorithmic[k] = turn.algorithmic(state.q[k], state.v[k]);
            let short = log(turn.base() * Rotation::new(state.q[k]).r);
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

    /// The spatial acceleration of the spin at a slot of a state with total vectors.
    pub fn spin_acceleration(state: &State, slot: Slot) -> Vec3 {
        let k = slot as usize;
        let spin = Spin::new(state.q[k], state.v[k], state.a[k]);
        spin.rotation.r * spin.acceleration
    }
}

/// The carrier of an angular momentum, where the inertia is definite enough.
fn momentum(inertia: Mat3) -> Option<Carrier> {
    let matrix = Matrix3::from_fn(|i, j| inertia.0[i][j]);
    let values = SymmetricEigen::new(matrix).eigenvalues;
    let definite = values.min() * LARGEST_RATIO > values.max();
    let inverse = matrix.try_inverse().filter(|_| definite)?;
    Some(Carrier { tensor: inertia, inverse: Mat3([0, 1, 2].map(|i| [0, 1, 2].map(|j| inverse[(i, j)]))) })
}

/// Pd = T^-1 Omega, Pdd = T^-1 (Acc - Td Pd)
fn rates(p: Vec3, omega: Vec3, acceleration: Vec3) -> (Vec3, Vec3) {
    let rotation = Rotation::new(p);
    let inverse = rotation.t_inverse();
    let velocity = inverse * omega;
    (velocity, inverse * (acceleration - rotation.t_rate(velocity) * velocity))
}
