//! Whether a motion that looks free in the tangent has stiffness after all.
//!
//! The entries of a tangent carry the round-off of the stiffest direction: with very slender beams on fine meshes that hides the
//! softest one. The energy does not: it is a sum of squares of strains, and a strain is a small number with a small error. Of a
//! motion d x from a state without stress
//!
//! ```text
//! E(d) = a d^2 + b d^4 + ...,   a = (16 E(d/2) - E(d)) / (3 d^2)
//! ```
//!
//! A mechanism has a = 0, and what is computed for it goes up and down with d. Where a is the same over a range of d it is
//! a stiffness.

use crate::model::Model;
use crate::solve::NullVector;
use crate::system::{State, System};
use crate::tensor::Vec3;

/// Ratio of neighbouring d.
const RATIO: f64 = 2.0;
/// The smallest d is this power of the ratio.
const MOST: i32 = 40;
/// So many neighbours must agree,
const RANGE: usize = 5;
/// to this factor.
const AGREEMENT: f64 = 1.5;

/// Whether the motion stores energy as a stiff one does. Under stress the tangent alone can tell, and the answer is no.
pub(super) fn is_stiff(model: &Model, state: &State, system: &System, vector: &NullVector) -> bool {
    if model.energy(state).strain != 0.0 {
        return false;
    }
    let mut motion = vec![Vec3::ZERO; model.slots.len()];
    system.pattern.equations.scatter(&vector.motion, None, &mut motion);
    let parts = motion.iter().zip(&model.slots).filter(|(_, info)| !info.is_multiplier());
    let size = parts.map(|(x, info)| x.norm() * info.arm(model.length) / model.length).fold(0.0, f64::max);
    let energy = |d: f64| {
        let mut there = state.clone();
        there.q.iter_mut().zip(&motion).for_each(|(q, x)| *q += *x * (d / size));
        model.energy(&there).strain
    };
    let energies: Vec<(f64, f64)> = (2..MOST).map(|k| RATIO.powi(-k)).map(|d| (d, energy(d))).collect();
    let stiffness = |pair: &[(f64, f64)]| (16.0 * pair[1].1 - pair[0].1) / (3.0 * pair[0].0 * pair[0].0);
    let found: Vec<f64> = energies.windows(2).map(stiffness).collect();
    found.windows(RANGE).any(|near| {
        let (least, most) =
            (near.iter().copied().fold(f64::INFINITY, f64::min), near.iter().copied().fold(0.0, f64::max));
        least > 0.0 && most < AGREEMENT * least
    })
}
