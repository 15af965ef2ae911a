//! Lobatto IIIA with three stages: collocation at the start, the middle and the end of a step
//! (Hairer & Wanner 1996, doi:10.1007/978-3-642-05221-7, sections IV.5 and IV.8).
//!
//! Of order four, symmetric and without dissipation: the trapezoidal rule is the member of the
//! family with two stages. Velocities integrate the parabola through the accelerations of the three
//! stages, displacements that through their velocities. With the unknowns q at the middle (m) and
//! the end (1) of the step, over which corrections dq change rates by
//!
//! ```text
//! dv = D dq / h,  D = [ 2  1/2]      da = D^2 dq / h^2,  D^2 = [  0   3]
//!                     [-8   4 ]                                [-48  12]
//! ```
//!
//! both stages are in balance where f(q) + M a = 0. Eliminating one stage after the other would
//! take a complex matrix. Instead each stage is corrected in turn with the one real matrix
//! P = K + sqrt(12)/h C + 12/h^2 M, the end first: of an oscillation of frequency w, with
//! x = (h w)^2, two such corrections leave the share 12 x/(x + 12)^2 <= 1/4 of an error, which is
//! next to nothing for all that the step resolves. Two different lengths of the correction of the
//! middle, in turn, reduce that to a tenth ([`Lobatto::relaxation`]).

use crate::kernel::Weights;
use crate::system::State;
use crate::tensor::Vec3;
use crate::threads::{self, PART};

/// The time of the middle stage, in steps.
pub const MIDDLE: f64 = 0.5;

/// The weight of mass over 1/h^2 in the matrix of corrections: the size of the eigenvalues of D^2,
/// 6 (1 +- i sqrt(3)).
const MASS_WEIGHT: f64 = 12.0;

/// Lengths of the correction of the middle in turn: the reciprocal roots of the Chebyshev
/// polynomial of second degree over [3/4, 1], the eigenvalues of a round of corrections.
const RELAXATIONS: [f64; 2] = [1.038, 1.271];

/// One step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobatto {
    /// h, the length of the step, a time
    pub(crate) length: f64,
}

/// The stages of a step that are solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The middle of the step
    Middle,
    /// The end of the step
    End,
}

/// The changes of a stage with a correction, over the correction.
#[derive(Clone, Copy)]
struct Change {
    unknown: f64,
    /// Over 1/h
    velocity: f64,
    /// Over 1/h^2
    acceleration: f64,
}

impl Lobatto {
    /// The weights of stiffness, damping and mass in the matrix of corrections.
    pub fn weights(&self) -> Weights {
        let h = self.length;
        Weights { stiffness: 1.0, damping: MASS_WEIGHT.sqrt() / h, mass: MASS_WEIGHT / (h * h) }
    }

    /// The length of the correction of a stage in a round of corrections, over that of the
    /// solution.
    pub fn relaxation(&self, stage: Stage, round: usize) -> f64 {
        match stage {
            Stage::Middle => RELAXATIONS[round % RELAXATIONS.len()],
            Stage::End => 1.0,
        }
    }

    /// Predicts both stages with the acceleration at the start of the step, where the states are.
    pub fn predict(&self, middle: &mut State, end: &mut State) {
        predict(middle, MIDDLE * self.length);
        predict(end, self.length);
    }

    /// Adds a correction of a stage, times `factor`, and the changes of the rates of both.
    pub fn correct(&self, middle: &mut State, end: &mut State, stage: Stage, dq: &[Vec3], factor: f64) {
        let (of_middle, of_end) = match stage {
            Stage::Middle => (
                Change { unknown: 1.0, velocity: 2.0, acceleration: 0.0 },
                Change { unknown: 0.0, velocity: -8.0, acceleration: -48.0 },
            ),
            Stage::End => (
                Change { unknown: 0.0, velocity: 0.5, acceleration: 3.0 },
                Change { unknown: 1.0, velocity: 4.0, acceleration: 12.0 },
            ),
        };
        self.add(middle, of_middle, dq, factor);
        self.add(end, of_end, dq, factor);
    }

    fn add(&self, state: &mut State, change: Change, dq: &[Vec3], factor: f64) {
        let velocity = factor * change.velocity / self.length;
        let acceleration = factor * change.acceleration / (self.length * self.length);
        let unknown = factor * change.unknown;
        let State { q, v, a, .. } = state;
        let rates = v.chunks_mut(PART).zip(a.chunks_mut(PART));
        threads::each(q.chunks_mut(PART).zip(rates).zip(dq.chunks(PART)), |((q, (v, a)), dq)| {
            // Prescribed motions are not corrected: their rates stay as prescribed.
            for (k, &dq) in dq.iter().enumerate().filter(|(_, dq)| **dq != Vec3::ZERO) {
                q[k] += dq * unknown;
                v[k] += dq * velocity;
                a[k] += dq * acceleration;
            }
        });
    }
}

/// Moves a state by a time with its acceleration.
fn predict(state: &mut State, time: f64) {
    let State { q, v, a, .. } = state;
    let rates = v.chunks_mut(PART).zip(a.chunks_mut(PART));
    threads::each(q.chunks_mut(PART).zip(rates), |(q, (v, a))| {
        for k in 0..q.len() {
            q[k] += v[k] * time + a[k] * (0.5 * time * time);
            v[k] += a[k] * time;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    /// D and its square are the inverse of the coefficients of Lobatto IIIA, and its square.
    #[test]
    fn rates_follow_from_the_coefficients_of_the_method() {
        let coefficients = Matrix2::new(1.0 / 3.0, -1.0 / 24.0, 2.0 / 3.0, 1.0 / 6.0);
        let rates = coefficients.try_inverse().unwrap();
        for (column, stage) in [Stage::Middle, Stage::End].into_iter().enumerate() {
            let [mut middle, mut end] = [(); 2].map(|()| State::rest(1, 0, 0, 0));
            let step = Lobatto { length: 0.5 };
            step.correct(&mut middle, &mut end, stage, &[Vec3([1.0, 0.0, 0.0])], 1.0);
            for (row, state) in [&middle, &end].into_iter().enumerate() {
                assert_eq!(state.q[0].0[0], if row == column { 1.0 } else { 0.0 });
                assert!((state.v[0].0[0] - 2.0 * rates[(row, column)]).abs() < 1e-12);
                assert!((state.a[0].0[0] - 4.0 * (rates * rates)[(row, column)]).abs() < 1e-11);
            }
        }
    }

    /// Two rounds leave at most a hundredth of an error of any frequency.
    #[test]
    fn rounds_contract_at_all_frequencies() {
        let step = Lobatto { length: 1.0 };
        let mass = step.weights().mass;
        let rates2 = Matrix2::new(0.0, 3.0, -48.0, 12.0);
        for exponent in -40..=60 {
            let stiffness = 10.0_f64.powf(0.1 * f64::from(exponent));
            let error = |mut q: [f64; 2]| {
                for round in 0..3 {
                    for (row, stage) in [(1, Stage::End), (0, Stage::Middle)] {
                        let rest = stiffness * q[row] + rates2[(row, 0)] * q[0] + rates2[(row, 1)] * q[1];
                        q[row] -= step.relaxation(stage, round) * rest / (stiffness + mass);
                    }
                }
                q[0].abs().max(0.25 * q[1].abs())
            };
            assert!(error([1.0, 0.0]) < 0.06 && error([0.0, 1.0]) < 0.06, "{stiffness}");
        }
    }
}
