//! Joints between two nodes as gaps that Lagrange multipliers close.
//!
//! A joint sits at the ends of two rigid arms, d_A and d_B, and has the axes e_1, e_2, e_3
//! (material, global components at the start, carried by both nodes). With w = x_B + R_B d_B - x_A
//! there are gaps of two kinds:
//!
//! ```text
//! along an axis:      (R_A e_k) . w - e_k . d_A      (the slide of B along an axis of A, a length)
//! between directions: (R_A a) . (R_B b)              (a cosine, zero while both stay normal)
//! ```
//!
//! Forces are the derivatives of L = lambda . gaps, conjugate to u_A, P_A, u_B, P_B and the
//! multipliers.

use super::element::ElementSystem;
use crate::rotation::Rotation;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// One of the two nodes of a joint.
#[derive(Clone, Copy, Debug)]
pub struct End<T = f64> {
    /// x, its place, spatial
    pub place: Vec3<T>,
    /// R, its rotation from the initial placement
    pub rotation: Rotation<T>,
}

/// The blocks of a joint's system.
pub mod block {
    /// Displacements of A
    pub const U_A: usize = 0;
    /// Rotation of A
    pub const P_A: usize = 1;
    /// Displacements of B
    pub const U_B: usize = 2;
    /// Rotation of B
    pub const P_B: usize = 3;
    /// Multipliers of gaps along axes
    pub const ALONG: usize = 4;
    /// Multipliers of gaps between directions
    pub const BETWEEN: usize = 5;
    /// The number of blocks
    pub const COUNT: usize = 6;
}
use block::{ALONG, BETWEEN, P_A, P_B, U_A, U_B};

/// A direction that A carries and one that B carries: material, global components at the start.
#[derive(Clone, Copy, Debug)]
pub struct DirectionPair<T = f64> {
    /// The direction that A carries
    pub a: Vec3<T>,
    /// The direction that B carries
    pub b: Vec3<T>,
}

/// Factors of the tangent that a gap adds.
#[derive(Clone, Copy, Debug)]
pub struct GapFactors {
    /// Factor of the tangent of the gap's forces
    pub(crate) forces: f64,
    /// Factor of the row and the column of the gap's multiplier
    pub(crate) multiplier: f64,
}

impl GapFactors {
    /// Forces without a tangent, and without the row and the column of the multiplier
    pub const NONE: Self = Self { forces: 0.0, multiplier: 0.0 };
    /// The tangent of forces alone. With a multiplier of one, forces are the gradient of the gap
    /// and their tangent is its Hessian.
    pub const HESSIAN: Self = Self { forces: 1.0, multiplier: 0.0 };
}

/// Gaps along the axes, (R_A e_k) . w - e_k . d_A: lengths by which B has slid from the end of A's
/// arm along the three axes of A.
pub fn slides<T: Real>(axes: &Mat3, arms: &[Vec3; 2], a: &End<T>, b: &End<T>) -> Vec3<T> {
    let w = b.place + b.rotation.r * Vec3::constant(arms[1]) - a.place;
    let seen = a.rotation.r.transpose_mul(w) - Vec3::constant(arms[0]);
    Mat3::constant(*axes).transpose_mul(seen)
}

/// The gap between two directions, the cosine of their present angle: (R_A a) . (R_B b).
pub fn cosine<T: Real>(directions: DirectionPair<T>, a: &End<T>, b: &End<T>) -> T {
    (a.rotation.r * directions.a).dot(b.rotation.r * directions.b)
}

/// Adds the forces that `force` (components along the axes of A) makes on both nodes, their
/// tangent, and the rows and columns of the multipliers along the axes.
pub fn add_along<T: Real>(
    axes: &Mat3,
    arms: &[Vec3; 2],
    ends: &[End<T>; 2],
    force: Vec3<T>,
    factors: GapFactors,
    out: &mut ElementSystem<T>,
) {
    let GapFactors { forces: weight, multiplier: couple } = factors;
    let [a, b] = ends;
    let ra = &a.rotation;
    let rb = &b.rotation;
    let e = Mat3::constant(*axes);
    let arm = Vec3::constant(arms[1]);
    let w = b.place + rb.r * arm - a.place;
    let s = e * force;
    let pull = ra.r * s;
    out.add_force(U_A, -pull);
    out.add_force(U_B, pull);
    out.add_force(P_A, ra.potential_gradient(s, w));
    out.add_force(P_B, rb.potential_gradient(arm, pull));
    let mut both = |row: usize, column: usize, block: Mat3<T>| {
        out.add_tangent(row, column, block);
        out.add_tangent(column, row, block.transpose());
    };
    if weight != 0.0 {
        let turned = (ra.r * Mat3::skew_mul(s, ra.t)).scale(weight);
        both(U_A, P_A, turned);
        both(U_B, P_A, -turned);
        let across = Mat3::skew_mul(s, ra.r.transpose() * rb.r) * Mat3::skew_mul(arm, rb.t);
        both(P_A, P_B, -ra.t.transpose_matmul(across).scale(weight));
    }
    if couple != 0.0 {
        let directions = (ra.r * e).scale(couple);
        both(U_A, ALONG, -directions);
        both(U_B, ALONG, directions);
        let seen = ra.r.transpose_mul(w);
        both(P_A, ALONG, -ra.t.transpose_matmul(Mat3::skew_mul(seen, e)).scale(couple));
        let carried = Mat3::skew_mul(arm, rb.r.transpose() * ra.r * e);
        both(P_B, ALONG, rb.t.transpose_matmul(carried).scale(couple));
    }
    if weight != 0.0 {
        out.add_tangent(P_A, P_A, ra.potential_hessian(s, w).scale(weight));
        out.add_tangent(P_B, P_B, rb.potential_hessian(arm, pull).scale(weight));
    }
}

/// Adds the forces of a multiplier on a gap between two directions, their tangent, and the row and
/// column of the multiplier, which is number `row` of the block [`BETWEEN`].
pub fn add_between<T: Real>(
    directions: DirectionPair<T>,
    ends: &[End<T>; 2],
    multiplier: T,
    factors: GapFactors,
    row: usize,
    out: &mut ElementSystem<T>,
) {
    let GapFactors { forces: weight, multiplier: couple } = factors;
    let [a, b] = ends;
    let ra = &a.rotation;
    let rb = &b.rotation;
    let DirectionPair { a: da, b: db } = directions;
    let wa = rb.r * db;
    let wb = ra.r * da;
    let ga = ra.potential_gradient(da, wa);
    let gb = rb.potential_gradient(db, wb);
    out.add_force(P_A, ga * multiplier);
    out.add_force(P_B, gb * multiplier);
    if weight != 0.0 {
        let scale = multiplier * weight;
        out.add_tangent(P_A, P_A, ra.potential_hessian(da, wa) * scale);
        out.add_tangent(P_B, P_B, rb.potential_hessian(db, wb) * scale);
        let across = Mat3::skew_mul(da, ra.r.transpose() * rb.r) * Mat3::skew_mul(db, rb.t);
        let cross = ra.t.transpose_matmul(across) * -scale;
        out.add_tangent(P_A, P_B, cross);
        out.add_tangent(P_B, P_A, cross.transpose());
    }
    if couple != 0.0 {
        let mut unit = Vec3::zero();
        unit.0[row] = T::constant(couple);
        for (block, gradient) in [(P_A, ga), (P_B, gb)] {
            let column = gradient.outer(unit);
            out.add_tangent(block, BETWEEN, column);
            out.add_tangent(BETWEEN, block, column.transpose());
        }
    }
}
