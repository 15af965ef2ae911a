//! What a kernel reads and writes: the motion of a node, weights, and the force and tangent of one element.

use crate::real::Real;
use crate::tensor::{Mat3, Vec3};

/// Most nodes an element has.
pub const MAX_NODES: usize = 4;
const MAX_ROWS: usize = 6 * MAX_NODES;

/// The weights of J = s K + d C + m M. A weight of zero means: do not compute it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// s, of the stiffness K = dg/dq
    pub stiffness: f64,
    /// d, of C = dg/dv
    pub damping: f64,
    /// m, of M = dg/da
    pub mass: f64,
}

impl Weights {
    /// The stiffness alone.
    pub const STIFFNESS: Self = Self { stiffness: 1.0, damping: 0.0, mass: 0.0 };
    /// The gyroscopic and damping matrix alone.
    pub const DAMPING: Self = Self { stiffness: 0.0, damping: 1.0, mass: 0.0 };
    /// The mass matrix alone.
    pub const MASS: Self = Self { stiffness: 0.0, damping: 0.0, mass: 1.0 };
    /// Forces only.
    pub const NONE: Self = Self { stiffness: 0.0, damping: 0.0, mass: 0.0 };
}

/// Displacement, rotation vector and their rates at a node or, interpolated, at a point (global components).
#[derive(Clone, Copy, Debug)]
pub struct NodeMotion<T = f64> {
    /// u
    pub u: Vec3<T>,
    /// du/dt
    pub u_rate: Vec3<T>,
    /// d2u/dt2
    pub u_rate2: Vec3<T>,
    /// P, the rotation vector in the chart of the evaluation
    pub p: Vec3<T>,
    /// dP/dt
    pub p_rate: Vec3<T>,
    /// d2P/dt2
    pub p_rate2: Vec3<T>,
}

impl<T: Real> NodeMotion<T> {
    /// At rest in the initial placement.
    pub fn rest() -> Self {
        let o = Vec3::zero();
        Self { u: o, u_rate: o, u_rate2: o, p: o, p_rate: o, p_rate2: o }
    }
}

/// The force g and the tangent J of one element, in 3-vectors and 3x3 blocks.
///
/// Elements with displacements and rotations order their blocks node by node: u1, P1, u2, P2, …; elements with one kind
/// of unknown: u1, u2, … or P1, P2, ….
#[derive(Clone, Debug)]
pub struct ElementSystem<T = f64> {
    rows: usize,
    force: [T; MAX_ROWS],
    tangent: [T; MAX_ROWS * MAX_ROWS],
}

impl<T: Real> ElementSystem<T> {
    /// Zero, of `blocks` 3-vectors.
    pub fn new(blocks: usize) -> Self {
        assert!(3 * blocks <= MAX_ROWS, "an element has at most {MAX_NODES} nodes");
        Self { rows: 3 * blocks, force: [T::zero(); MAX_ROWS], tangent: [T::zero(); MAX_ROWS * MAX_ROWS] }
    }

    /// Sets force and tangent to zero.
    #[inline]
    pub fn clear(&mut self) {
        self.force[..self.rows].fill(T::zero());
        self.tangent[..self.rows * self.rows].fill(T::zero());
    }

    /// The number of scalar rows.
    #[inline]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The force, one entry a row.
    #[inline]
    pub fn force(&self) -> &[T] {
        &self.force[..self.rows]
    }

    /// The tangent by rows.
    #[inline]
    pub fn tangent(&self) -> &[T] {
        &self.tangent[..self.rows * self.rows]
    }

    /// Adds to the force of a block.
    #[inline(always)]
    pub fn add_force(&mut self, block: usize, f: Vec3<T>) {
        for i in 0..3 {
            self.force[3 * block + i] += f.0[i];
        }
    }

    /// The force of a block.
    #[inline(always)]
    pub fn force_block(&self, block: usize) -> Vec3<T> {
        Vec3([self.force[3 * block], self.force[3 * block + 1], self.force[3 * block + 2]])
    }

    /// Replaces the force of a block.
    #[inline(always)]
    pub fn set_force(&mut self, block: usize, f: Vec3<T>) {
        self.force[3 * block..3 * block + 3].copy_from_slice(&f.0);
    }

    /// Adds to a block of the tangent.
    #[inline(always)]
    pub fn add_tangent(&mut self, row: usize, column: usize, m: Mat3<T>) {
        for i in 0..3 {
            let start = (3 * row + i) * self.rows + 3 * column;
            for j in 0..3 {
                self.tangent[start + j] += m.0[i][j];
            }
        }
    }

    /// A block of the tangent.
    #[inline(always)]
    pub fn tangent_block(&self, row: usize, column: usize) -> Mat3<T> {
        let line = |i: usize| {
            let start = (3 * row + i) * self.rows + 3 * column;
            [self.tangent[start], self.tangent[start + 1], self.tangent[start + 2]]
        };
        Mat3([line(0), line(1), line(2)])
    }

    /// The system of these blocks alone, in their order.
    pub fn part(&self, blocks: &[usize]) -> Self {
        let mut out = Self::new(blocks.len());
        for (row, &i) in blocks.iter().enumerate() {
            out.set_force(row, self.force_block(i));
            for (column, &j) in blocks.iter().enumerate() {
                out.set_tangent(row, column, self.tangent_block(i, j));
            }
        }
        out
    }

    /// Replaces a block of the tangent.
    #[inline(always)]
    pub fn set_tangent(&mut self, row: usize, column: usize, m: Mat3<T>) {
        for i in 0..3 {
            let start = (3 * row + i) * self.rows + 3 * column;
            self.tangent[start..start + 3].copy_from_slice(&m.0[i]);
        }
    }
}
