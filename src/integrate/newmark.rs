//! Newmark's family (1959, doi:10.1061/JMCEA3.0000098) in displacements and total rotation vectors.

use super::Method;
use crate::kernel::Weights;
use crate::system::State;
use crate::tensor::Vec3;

/// One step of length h.
///
/// ```text
/// q1 = q0 + h v0 + h^2 [(1/2 - beta) a0 + beta a1]        v1 = v0 + h [(1 - gamma) a0 + gamma a1]
/// ```
///
/// beta = 1/4, gamma = 1/2 is the trapezoidal rule: second order, without dissipation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newmark {
    /// beta
    pub beta: f64,
    /// gamma
    pub gamma: f64,
    /// h
    pub step: f64,
}

impl Newmark {
    /// Predicts the end of the step with the acceleration of its start.
    pub fn predict(&self, state: &mut State) {
        let h = self.step;
        for slot in 0..state.q.len() {
            let (v, a) = (state.v[slot], state.a[slot]);
            state.q[slot] += v * h + a * (0.5 * h * h);
            state.v[slot] += a * h;
        }
    }
}

impl Method for Newmark {
    fn weights(&self) -> Weights {
        let h = self.step;
        Weights { stiffness: 1.0, damping: self.gamma / (self.beta * h), mass: 1.0 / (self.beta * h * h) }
    }

    fn correct(&self, state: &mut State, dq: &[Vec3]) {
        let Weights { damping, mass, .. } = self.weights();
        for (slot, &dq) in dq.iter().enumerate() {
            state.q[slot] += dq;
            state.v[slot] += dq * damping;
            state.a[slot] += dq * mass;
        }
    }
}
