//! Steps whose rotational unknowns are increments.
//!
//! Between steps a state holds total rotation vectors, as everywhere. While a step is iterated it holds, for each rotation,
//! the increment X with R = R_n exp(X), and the spin that belongs to it (see [`crate::kernel::turn`]); nothing then depends on where
//! the total vector happens to be.

use super::Step;
use crate::kernel::inertia::Inertia;
use crate::kernel::turn::{Carrier, Start, Turn};
use crate::model::charts::DYNAMIC_BAND;
use crate::model::{Model, StageKind};
use crate::rotation::{Rotation, complement, log};
use crate::system::{DofMap, Slot, State};
use crate::tensor::{Mat3, Vec3};
use nalgebra::{Matrix3, SymmetricEigen};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Principal values of a carrier are at least the largest over this: the smaller they are, the more they make of the error of
/// a momentum.
const LARGEST_RATIO: f64 = 10.0;

/// What h^4 w^2 times a change of phi is divided by to be the error of a rotation.
const FREE: f64 = 240.0;

/// Part of the largest principal value below which there is no inertia.
const MASSLESS: f64 = 1e-12;

/// The rotations of a scene, and the momentum that each carries from step to step.
pub struct Increments {
    carriers: Vec<(Slot, Carrier)>,
}

impl Increments {
    /// For a stage of this kind with these equations.
    pub fn new(model: &Model, kind: StageKind, dof_map: &DofMap) -> Self {
        let bodies = bodies_by_rotation(model);
        let carrier = |&slot: &Slot| {
            // A hinge turns about a fixed axis: its spin has one component, its momentum three.
            let turns_freely = dof_map.of(slot).iter().all(|&number| number != DofMap::HELD);
            let carrier = bodies.get(&slot).filter(|_| turns_freely).and_then(|(u, body)| {
                let moves = dof_map.of(*u).iter().all(|&number| number != DofMap::HELD);
                momentum(if moves { body.about_centre() } else { body.about_node })
            });
            (slot, carrier.unwrap_or(Carrier::SPIN))
        };
        Self { carriers: model.charted(kind).rotations.iter().map(carrier).collect() }
    }

    /// At the start of a stage, after [`super::Scheme::start`]: the same of momenta.
    pub fn start(&self, state: &mut State) {
        for &(slot, carrier) in &self.carriers {
            let spin = state.spin(slot);
            state.algorithmic[slot as usize] = spin.rotation.r * carrier.rate(spin.omega, spin.acceleration);
        }
    }

    /// From total vectors to increments. `before` is the length of the step before.
    pub fn begin(&self, state: &mut State, step: &Step, before: f64) {
        state.unwrapped_mut();
        let mut turns = std::mem::take(&mut state.turns);
        turns.resize(state.q.len(), None);
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
        let mut turns = std::mem::take(&mut state.turns);
        for (k, turn) in turns.drain(..).enumerate() {
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
        // The room is kept for the next step.
        state.turns = turns;
        switched
    }

    /// The local errors of rotations over a step between two states with total vectors, with their slots. What moments give, mu = E J^-1 E^T b,
    /// is integrated to second order, with the error factor h^2 (mu1 - mu0). The rest of the acceleration, phi, is integrated to
    /// fourth order: h^5/720 of the fourth derivative of the spin, which is about |w|^2 times the second, (phi1 - phi0)/h, and as
    /// much again from each of the two next terms of Magnus' series.
    pub fn errors<'a>(
        &'a self,
        start: &'a State,
        end: &'a State,
        length: f64,
        factor: f64,
    ) -> impl Iterator<Item = (f64, usize)> + 'a {
        let h2 = length * length;
        self.accelerations(start).zip(self.accelerations(end)).map(move |(before, after)| {
            let driven = (after.driven - before.driven).norm() * (factor * h2);
            let free = (after.free - before.free).norm() * (h2 * h2 * after.spin.squared() / FREE);
            (driven + free, after.slot as usize)
        })
    }

    /// The accelerations of all rotations in a state with total vectors.
    pub fn accelerations<'a>(&'a self, state: &'a State) -> impl Iterator<Item = Accelerations> + 'a {
        self.carriers.iter().map(|&(slot, carrier)| {
            let spin = state.spin(slot);
            let driven = carrier.inverse * carrier.rate(spin.omega, spin.acceleration);
            let r = spin.rotation.r;
            Accelerations { slot, driven: r * driven, free: r * (spin.acceleration - driven), spin: spin.omega }
        })
    }
}

/// What the acceleration of a rotation comes from, spatial.
pub struct Accelerations {
    /// The rotation
    pub slot: Slot,
    /// mu: moments
    pub driven: Vec3,
    /// phi: its own spin
    pub free: Vec3,
    /// Its spin, material
    pub spin: Vec3,
}

/// What sits at each rotation, taken together, with the slot of its displacement.
fn bodies_by_rotation(model: &Model) -> BTreeMap<Slot, (Slot, Inertia)> {
    let mut sums: BTreeMap<Slot, (Slot, Inertia)> = BTreeMap::new();
    for masses in model.effects.iter().filter_map(|effect| effect.roles().masses) {
        masses.bodies(&mut |node, body| {
            let sum = sums.entry(node.p).or_insert((node.u, Inertia::NONE));
            sum.1 = sum.1.with(body);
        });
    }
    sums
}

/// The carrier of an angular momentum; `None` without inertia about some axis. Of slender inertias the small principal values are raised.
fn momentum(inertia: Mat3) -> Option<Carrier> {
    let SymmetricEigen { eigenvectors, eigenvalues } =
        SymmetricEigen::new(Matrix3::from_fn(|i, j| 0.5 * (inertia.0[i][j] + inertia.0[j][i])));
    let largest = eigenvalues.max();
    // Nothing resists a turn about this axis: its momentum says nothing of its spin.
    if eigenvalues.min() <= MASSLESS * largest {
        return None;
    }
    let with = |f: &dyn Fn(f64) -> f64| {
        let diagonal = Matrix3::from_diagonal(&eigenvalues.map(|value| f(value.max(largest / LARGEST_RATIO))));
        let whole = eigenvectors * diagonal * eigenvectors.transpose();
        Mat3([0, 1, 2].map(|i| [0, 1, 2].map(|j| whole[(i, j)])))
    };
    Some(Carrier { tensor: with(&|value| value), inverse: with(&|value| 1.0 / value) })
}

/// Pd = T^-1 Omega, Pdd = T^-1 (Acc - Td Pd)
fn rates(p: Vec3, omega: Vec3, acceleration: Vec3) -> (Vec3, Vec3) {
    let rotation = Rotation::new(p);
    let inverse = rotation.t_inverse();
    let velocity = inverse * omega;
    (velocity, inverse * (acceleration - rotation.t_rate(velocity) * velocity))
}
