//! The family of generalised-alpha methods, as coefficients. The unknowns are displacements and
//! total rotation vectors, or increments of rotation ([`super::Increments`]).
//!
//! Equilibrium is kept at the end of each step with the true acceleration a = q''; beside it an
//! algorithmic acceleration A is carried, which approximates q'' at t + (alpha_m - alpha_f) h:
//!
//! ```text
//! (1 - alpha_m) A1 + alpha_m A0 = (1 - alpha_f) a1 + alpha_f a0
//! q1 = q0 + h v0 + h^2 [(1/2 - beta) A0 + beta A1]        v1 = v0 + h [(1 - gamma) A0 + gamma A1]
//! ```
//!
//! Newmark (1959, doi:10.1061/JMCEA3.0000098): alpha_m = alpha_f = 0, A = a. Hilber, Hughes &
//! Taylor (1977, doi:10.1002/eqe.4290050306): alpha_m = 0. Chung & Hulbert (1993,
//! doi:10.1115/1.2900803): alpha_m and alpha_f from the spectral radius at infinite frequency.

use super::Method;
use crate::kernel::Weights;
use crate::kernel::turn::{StepCoefficients, Stretch, Turn};
use crate::system::{Field, State};
use crate::tensor::Vec3;
use crate::threads::{self, PART};
use serde::{Deserialize, Serialize};
use std::iter::repeat_with;

/// The coefficients of a generalised-alpha method (Chung & Hulbert 1993, doi:10.1115/1.2900803).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Scheme {
    /// beta
    pub(crate) beta: f64,
    /// gamma
    pub(crate) gamma: f64,
    /// alpha_m
    pub(crate) alpha_m: f64,
    /// alpha_f
    pub(crate) alpha_f: f64,
    /// The unknowns of rotations in a step
    pub rotations: Rotations,
    /// The instants of a step at which there is balance
    pub stages: Stages,
}

/// The unknowns of rotations in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub enum Rotations {
    /// Total rotation vectors with their rates
    Totals,
    /// Increments from the last converged rotation, with material spins as velocities: see
    /// [`super::Increments`]
    Increments,
}

/// The instants of a step at which there is balance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub enum Stages {
    /// The end
    End,
    /// The middle and the end, see [`super::Lobatto`]. The coefficients are those of the trapezoidal
    /// rule, by which the estimated error of such steps goes on.
    MiddleAndEnd,
}

/// The local error of Lobatto IIIA over h^5 q^(5), see [`super::carried_error`].
pub(super) const LOBATTO_ERROR: f64 = 1.0 / 720.0;

/// Factors of the local error below this, without unit, count as zero.
const LEAST_ERROR_FACTOR: f64 = 1e-6;

impl Scheme {
    /// Newmark's family; beta = 1/4, gamma = 1/2 is the trapezoidal rule: second order, without
    /// dissipation.
    pub fn newmark(beta: f64, gamma: f64) -> Self {
        Self { beta, gamma, alpha_m: 0.0, alpha_f: 0.0, rotations: Rotations::Totals, stages: Stages::End }
    }

    /// HHT-alpha with alpha in [0, 1/3]: second order, dissipates high frequencies.
    pub fn hht(alpha: f64) -> Self {
        let beta = 0.25 * (1.0 + alpha) * (1.0 + alpha);
        Self { gamma: 0.5 + alpha, alpha_f: alpha, ..Self::newmark(beta, 0.5) }
    }

    /// Generalised-alpha with the spectral radius rho in [0, 1] at infinite frequency: second
    /// order, with the least dissipation of low frequencies for that of high ones.
    pub fn generalized_alpha(rho: f64) -> Self {
        let alpha_m = (2.0 * rho - 1.0) / (rho + 1.0);
        let alpha_f = rho / (rho + 1.0);
        let gamma = 0.5 + alpha_f - alpha_m;
        let beta = 0.25 * (gamma + 0.5) * (gamma + 0.5);
        Self { alpha_m, alpha_f, ..Self::newmark(beta, gamma) }
    }

    /// Generalised-alpha on increments of rotation (Bruls, Cardona & Arnold 2012,
    /// doi:10.1016/j.mechmachtheory.2011.07.017), in the form of [`crate::kernel::turn`], with the
    /// spectral radius rho in [0, 1] at infinite frequency.
    pub fn lie_generalized_alpha(rho: f64) -> Self {
        Self { rotations: Rotations::Increments, ..Self::generalized_alpha(rho) }
    }

    /// Lobatto IIIA with three stages: fourth order, without dissipation.
    pub fn lobatto() -> Self {
        Self { stages: Stages::MiddleAndEnd, ..Self::newmark(0.25, 0.5) }
    }

    /// True if high frequencies die away, at second order: gamma exceeds 1/2.
    pub fn dissipates(&self) -> bool {
        self.gamma > 0.5
    }

    /// The lag of the algorithmic acceleration in steps: it belongs to the time t + lag h.
    pub fn lag(&self) -> f64 {
        self.alpha_m - self.alpha_f
    }

    /// Starts a stage with steps of this length: the algorithmic acceleration begins as the true
    /// one, which is taken for constant before, but for third rates `jerk` by slot, if given. A
    /// scheme without one takes no memory for it.
    pub fn start(&self, state: &mut State, length: f64, jerk: Option<&[Vec3]>) {
        state.algorithmic = if self.has_algorithmic() { state.a.clone() } else { Field::none() };
        state.earlier = state.algorithmic.clone();
        let Some(jerk) = jerk.filter(|_| self.has_algorithmic()) else { return };
        let changes = state.algorithmic.iter_mut().zip(state.earlier.iter_mut()).zip(jerk);
        changes.for_each(|((algorithmic, earlier), &jerk)| {
            *algorithmic += jerk * (self.lag() * length);
            *earlier -= jerk * length;
        });
    }

    /// True if the scheme carries an algorithmic acceleration beside the true one.
    fn has_algorithmic(&self) -> bool {
        self.rotations == Rotations::Increments || self.alpha_m != 0.0 || self.alpha_f != 0.0
    }

    /// The factor of h^2 (a1 - a0) in the local error of a step: beta - 1/6 + (alpha_m -
    /// alpha_f)/2. `None` if it is zero, so that a1 - a0 says nothing about the error.
    pub fn error_factor(&self) -> Option<f64> {
        let factor = self.beta - 1.0 / 6.0 + 0.5 * self.lag();
        (factor.abs() > LEAST_ERROR_FACTOR).then_some(factor)
    }
}

/// One step of a scheme.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Step {
    /// The coefficients
    pub scheme: Scheme,
    /// h, the length of the step, a time
    pub length: f64,
}

impl Step {
    /// Predicts the end of the step with the acceleration of its start.
    ///
    /// `before` is the length of the step that the algorithmic acceleration comes from: see
    /// [`Stretch`]. The stage must have begun with [`Scheme::start`].
    pub fn predict(&self, state: &mut State, before: f64) {
        debug_assert_ne!(self.scheme.has_algorithmic(), state.algorithmic.is_empty(), "the scheme was not started");
        debug_assert_eq!(state.algorithmic.len(), state.earlier.len(), "the scheme was not started");
        let Scheme { beta, gamma, alpha_m, .. } = self.scheme;
        let h = self.length;
        let stretch = Stretch::new(h, before, self.scheme.lag());
        each_part(state, |_, Slots { q, v, a, algorithmic, earlier, turns }| {
            for k in 0..q.len() {
                if let Some(Some(turn)) = turns.get(k) {
                    q[k] = turn.guess();
                    (v[k], a[k]) = turn.rates(q[k]);
                    continue;
                }
                let known = algorithmic.get(k).zip(earlier.get(k));
                let old = known.map_or(a[k], |(own, earlier)| stretch.of(*own, a[k], *earlier));
                let new = if alpha_m == 0.0 { a[k] } else { (a[k] - old * alpha_m) * (1.0 / (1.0 - alpha_m)) };
                q[k] += v[k] * h + (old * (0.5 - beta) + new * beta) * (h * h);
                v[k] += (old * (1.0 - gamma) + new * gamma) * h;
                if let (Some(algorithmic), Some(earlier)) = (algorithmic.get_mut(k), earlier.get_mut(k)) {
                    (*algorithmic, *earlier) = (new, a[k]);
                }
            }
        });
    }

    /// The factors of the local errors tau of places and tau' of rates, see
    /// [`super::carried_error`]: of the slope of [`super::StepEnds::rate_of_error`] in tau and in
    /// tau', and of the change of that slope over the step in tau'.
    pub(super) fn error_factors(&self) -> [f64; 3] {
        let Scheme { beta, gamma, alpha_m, stages, .. } = self.scheme;
        let lag = self.scheme.lag();
        let h = self.length;
        match stages {
            Stages::End => [
                (1.0 / 6.0 - beta - 0.5 * lag) * h * h * h,
                (0.5 - gamma - lag) * h * h,
                (1.0 / 6.0 - lag * (alpha_m - 0.5) - gamma * (0.5 + lag)) * h * h,
            ],
            Stages::MiddleAndEnd => [LOBATTO_ERROR * h.powi(5), 0.0, -0.25 * LOBATTO_ERROR * h.powi(4)],
        }
    }

    /// The coefficients of a rotation over the step.
    pub fn coefficients(&self) -> StepCoefficients {
        let Scheme { beta, gamma, alpha_m, alpha_f, .. } = self.scheme;
        let length = self.length;
        StepCoefficients { beta, gamma, alpha_m, alpha_f, length }
    }
}

impl Method for Step {
    fn weights(&self) -> Weights {
        let Scheme { beta, gamma, alpha_m, alpha_f, .. } = self.scheme;
        let h = self.length;
        let mass = (1.0 - alpha_m) / ((1.0 - alpha_f) * beta * h * h);
        Weights { stiffness: 1.0, damping: gamma / (beta * h), mass }
    }

    fn correct(&self, state: &mut State, dq: &[Vec3]) {
        let Weights { damping, mass, .. } = self.weights();
        let filtered = 1.0 / (self.scheme.beta * self.length * self.length);
        // Prescribed motions are not corrected: their rates stay as prescribed.
        each_part(state, |start, Slots { q, v, a, algorithmic, turns, .. }| {
            let dq = dq[start..start + q.len()].iter().enumerate();
            for (k, &dq) in dq.filter(|(_, dq)| **dq != Vec3::ZERO) {
                q[k] += dq;
                if let Some(Some(turn)) = turns.get(k) {
                    (v[k], a[k]) = turn.rates(q[k]);
                    continue;
                }
                v[k] += dq * damping;
                a[k] += dq * mass;
                if let Some(algorithmic) = algorithmic.get_mut(k) {
                    *algorithmic += dq * filtered;
                }
            }
        });
    }
}

/// Consecutive slots of a state.
struct Slots<'a> {
    q: &'a mut [Vec3],
    v: &'a mut [Vec3],
    a: &'a mut [Vec3],
    /// Algorithmic accelerations; empty if the scheme has none
    algorithmic: &'a mut [Vec3],
    /// True accelerations at the start of the step before; empty like these
    earlier: &'a mut [Vec3],
    /// Rotations over the step, from the first slot on; empty if the scheme has none
    turns: &'a [Option<Turn>],
}

/// Calls `work` with each part of a state and the number of the part's first slot, in parallel.
fn each_part(state: &mut State, work: impl Fn(usize, Slots) + Send + Sync) {
    let State { q, v, a, algorithmic, earlier, turns, .. } = state;
    let [algorithmic, earlier] =
        [algorithmic, earlier].map(|field| field.chunks_mut(PART).chain(repeat_with(|| &mut [][..])));
    let rates = v.chunks_mut(PART).zip(a.chunks_mut(PART)).zip(algorithmic.zip(earlier));
    threads::each(q.chunks_mut(PART).zip(rates).enumerate(), |(number, (q, ((v, a), (algorithmic, earlier))))| {
        let start = PART * number;
        work(start, Slots { q, v, a, algorithmic, earlier, turns: turns.get(start..).unwrap_or_default() });
    });
}
