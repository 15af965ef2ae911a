//! Steps whose rotational unknowns are increments.
//!
//! Between steps a state holds total rotation vectors. During the iteration of a step it holds, for
//! each rotation, the increment X with R = R_n exp(X), and its spin (see [`crate::kernel::turn`]);
//! results then do not depend on the length of the total vector.

use super::Step;
use crate::kernel::inertia::Inertia;
use crate::kernel::turn::{Carrier, Start, Stretch, Turn};
use crate::model::charts::DYNAMIC_BAND;
use crate::model::{Model, StageKind};
use crate::rotation::{Rotation, complement, log};
use crate::system::{DofMap, Slot, State};
use crate::tensor::{Mat3, Vec3};
use nalgebra::{Matrix3, SymmetricEigen};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// The largest ratio of principal values of a carrier; smaller values are raised. The spins of
/// small ones amplify errors of the momentum.
const MAX_PRINCIPAL_RATIO: f64 = 10.0;

/// The divisor of h^4 w^2 times a change of phi in the local error of a rotation, without unit.
const FREE_SPIN_DIVISOR: f64 = 240.0;

/// The share of the largest principal value below which an inertia counts as none.
const MIN_INERTIA_SHARE: f64 = 1e-12;

/// The rotations of a scene, and the momentum that each carries from step to step.
pub struct Increments {
    carriers: Vec<(Slot, Carrier)>,
}

impl Increments {
    /// The rotations of a stage of a kind, with its degrees of freedom.
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

    /// Starts a stage, after [`super::Scheme::start`]: the algorithmic rates of momenta begin as the
    /// true ones. Those of rotations that joints hold begin as the true ones `at_lag`, if given, and
    /// those of the step before as if momenta went on alike from there.
    pub fn start(&self, state: &mut State, at_lag: Option<AtLag>) {
        for &(slot, carrier) in &self.carriers {
            let rate = |state: &State| {
                let spin = state.spin(slot);
                spin.rotation.r * carrier.rate(spin.omega, spin.acceleration)
            };
            let k = slot as usize;
            let now = rate(state);
            (state.algorithmic[k], state.earlier[k]) = (now, now);
            if let Some(AtLag { state: there, lag, .. }) = at_lag.filter(|at_lag| at_lag.jerk[k] != Vec3::ZERO) {
                let then = rate(there);
                (state.algorithmic[k], state.earlier[k]) = (then, now - (then - now) * (1.0 / lag));
            }
        }
    }

    /// Begins a step: replaces total vectors by increments. `before` is the length of the step
    /// before.
    pub fn begin(&self, state: &mut State, step: &Step, before: f64) {
        state.unwrapped_mut();
        let stretch = Stretch::new(step.length, before, step.scheme.lag());
        let mut turns = std::mem::take(&mut state.turns);
        turns.resize(state.q.len(), None);
        for &(slot, carrier) in &self.carriers {
            let k = slot as usize;
            let spin = state.spin(slot);
            let start = Start {
                rotation: spin.rotation.r,
                omega: spin.omega,
                acceleration: spin.acceleration,
                algorithmic: state.algorithmic[k],
                earlier: state.earlier[k],
                stretch,
            };
            let turn = Turn::new(step.coefficients(), carrier, &start);
            state.earlier[k] = turn.rate();
            turns[k] = Some(turn);
            state.q[k] = Vec3::ZERO;
            state.v[k] = spin.omega;
            state.a[k] = spin.acceleration;
        }
        state.turns = turns;
    }

    /// Ends a step: replaces increments by total vectors, each in the chart of `before` as long as
    /// it is within the band. Returns the number of rotations that have changed their chart.
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
            state.q[k] = p;
            state.v[k] = velocity;
            state.a[k] = acceleration;
        }
        // The memory is kept for the next step.
        state.turns = turns;
        switched
    }

    /// The local errors of rotations, in radians, over a step between two states with total
    /// vectors, with their slots.
    ///
    /// The acceleration by moments, mu = E J^-1 E^T b, is integrated to second order, with the
    /// error factor h^2 (mu1 - mu0). The rest of the acceleration, phi, is integrated to fourth
    /// order: h^5/720 of the fourth derivative of the spin, which is about |w|^2 times the second,
    /// (phi1 - phi0)/h, and as much again from each of the two next terms of Magnus' series (Magnus
    /// 1954, doi:10.1002/cpa.3160070404).
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
            let free = (after.free - before.free).norm() * (h2 * h2 * after.spin.squared() / FREE_SPIN_DIVISOR);
            (driven + free, after.slot as usize)
        })
    }

    /// The angular accelerations of all rotations in a state with total vectors.
    pub fn accelerations<'a>(&'a self, state: &'a State) -> impl Iterator<Item = Accelerations> + 'a {
        self.carriers.iter().map(|&(slot, carrier)| {
            let spin = state.spin(slot);
            let driven = carrier.inverse * carrier.rate(spin.omega, spin.acceleration);
            let r = spin.rotation.r;
            let (tensor, omega) = (carrier.tensor, spin.omega);
            let of_free = carrier.inverse * (driven.cross(tensor * omega) + omega.cross(tensor * driven));
            let free = spin.acceleration - driven;
            Accelerations { slot, driven: r * driven, free: r * free, lead: r * of_free * (-1.0 / 12.0), spin: omega }
        })
    }
}

/// The time to which algorithmic accelerations belong at the start of a stage.
#[derive(Clone, Copy)]
pub struct AtLag<'a> {
    /// The state at that time
    pub state: &'a State,
    /// The time from the start, in steps
    pub lag: f64,
    /// Third rates that keep the gaps of joints closed, by slot; zero where joints hold nothing
    pub jerk: &'a [Vec3],
}

/// The angular acceleration of a rotation by its causes, spatial.
pub struct Accelerations {
    /// The slot of the rotation
    pub(crate) slot: Slot,
    /// mu: the part by moments
    pub(crate) driven: Vec3,
    /// phi: the part by the spin itself, without moments
    pub(crate) free: Vec3,
    /// -(1/12) dphi/dOmega mu = (1/12) E J^-1 (mu x J Omega + Omega x J mu) with material mu: steps take
    /// phi at their end from the momentum of their start, and so leave out how moments change phi. The
    /// spins of smooth steps are those of the motion less h^2 [(beta - 1/6 + (alpha_m - alpha_f)/2) mu' + this]
    pub(crate) lead: Vec3,
    /// The spin, material
    pub(crate) spin: Vec3,
}

/// The mass properties at each rotation, summed up, with the slot of the displacement of its node.
pub(super) fn bodies_by_rotation(model: &Model) -> BTreeMap<Slot, (Slot, Inertia)> {
    let mut sums: BTreeMap<Slot, (Slot, Inertia)> = BTreeMap::new();
    for masses in model.effects.iter().filter_map(|effect| effect.roles().masses) {
        masses.bodies(&mut |node, body| {
            let sum = sums.entry(node.p).or_insert((node.u, Inertia::NONE));
            sum.1 = sum.1.with(body);
        });
    }
    sums
}

/// The carrier of an angular momentum, whose small principal values are raised to the largest over
/// [`MAX_PRINCIPAL_RATIO`]. `None` without inertia about some axis.
fn momentum(inertia: Mat3) -> Option<Carrier> {
    let SymmetricEigen { eigenvectors, eigenvalues } =
        SymmetricEigen::new(Matrix3::from_fn(|i, j| 0.5 * (inertia.0[i][j] + inertia.0[j][i])));
    let largest = eigenvalues.max();
    // Without inertia about an axis the momentum does not determine the spin about it.
    if eigenvalues.min() <= MIN_INERTIA_SHARE * largest {
        return None;
    }
    let with = |f: &dyn Fn(f64) -> f64| {
        let diagonal = Matrix3::from_diagonal(&eigenvalues.map(|value| f(value.max(largest / MAX_PRINCIPAL_RATIO))));
        let whole = eigenvectors * diagonal * eigenvectors.transpose();
        Mat3([0, 1, 2].map(|i| [0, 1, 2].map(|j| whole[(i, j)])))
    };
    Some(Carrier { tensor: with(&|value| value), inverse: with(&|value| 1.0 / value) })
}

/// Rates of a total rotation vector from material spins: Pd = T^-1 Omega, Pdd = T^-1 (Acc - Td Pd).
fn rates(p: Vec3, omega: Vec3, acceleration: Vec3) -> (Vec3, Vec3) {
    let rotation = Rotation::new(p);
    let inverse = rotation.t_inverse();
    let velocity = inverse * omega;
    (velocity, inverse * (acceleration - rotation.t_rate(velocity) * velocity))
}
