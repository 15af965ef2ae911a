//! Nodes in contact as a carrier sees them, and the derivatives of a contact force over what it
//! depends on. Points on surfaces and pairs of beams share them.
//!
//! With the rotation Q of the carrier and S_i = Q^T R_i, a node has turned since the last converged
//! state by theta_i = log(S_i S0_i^T), and d(theta_i) = T(theta_i)^-T times the spin of S_i. The
//! rolling of a contact is Theta = sum N_i r theta_i, a length: with the radius r as arm.

use super::along::{ShapeAt, weighted_sum};
use crate::rotation::{Rotation, log};
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};
use serde::{Deserialize, Serialize};

/// A node as the carrier saw it at the last converged state.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct NodeBefore {
    /// y0 = Q0^T (x0 - c0)
    pub(crate) place: Vec3,
    /// S0 = Q0^T R0
    pub(crate) rotation: Mat3,
}

impl NodeBefore {
    /// A node as a carrier with the place `c` and the rotation `q` sees it now: the memory for the
    /// next step.
    pub fn of(place: Vec3, rotation: Mat3, c: Vec3, q: &Mat3) -> Self {
        Self { place: q.transpose_mul(place - c), rotation: q.transpose_matmul(rotation) }
    }
}

/// A node of an element in contact.
#[derive(Clone, Copy, Debug)]
pub struct ContactNode<T = f64> {
    /// x, its place, spatial
    pub(crate) place: Vec3<T>,
    /// dx/dt; zero in statics
    pub(crate) velocity: Vec3<T>,
}

/// A node of an element whose contact has friction: its rotation, and its state before.
#[derive(Clone, Copy, Debug)]
pub struct NodeTurning<T = f64> {
    /// Its rotation, with the tensor T of the unknown
    pub(crate) rotation: Rotation<T>,
    /// The node at the last converged state
    pub(crate) before: NodeBefore,
}

/// The blocks of a node in the system of a contact point: all points of a contact have the same, also those without
/// friction of a contact whose coefficient is zero at one end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeBlocks {
    /// Its displacements
    Place,
    /// Its displacements, and its rotation
    PlaceAndRotation,
}

impl NodeBlocks {
    /// Those of a contact with friction, or without.
    pub const fn with(friction: bool) -> Self {
        if friction { Self::PlaceAndRotation } else { Self::Place }
    }

    /// The number of blocks of a node.
    pub const fn count(self) -> usize {
        match self {
            Self::Place => 1,
            Self::PlaceAndRotation => 2,
        }
    }

    /// The block of the displacements of node `i`; that of its rotation follows.
    pub const fn of(self, i: usize) -> usize {
        i * self.count()
    }
}

/// Rotations of the nodes as the carrier sees them, for friction.
pub(super) struct Turned<'a, const N: usize, T> {
    /// R_i, T_i and S0_i
    pub(super) nodes: &'a [NodeTurning<T>; N],
    /// S_i
    pub(super) rotations: [Mat3<T>; N],
    /// theta_i
    pub(super) angles: [Vec3<T>; N],
    /// T(theta_i)^-T
    pub(super) maps: [Mat3<T>; N],
    /// theta
    pub(super) angle: Vec3<T>,
}

impl<'a, const N: usize, T: Real> Turned<'a, N, T> {
    pub(super) fn new(nodes: &'a [NodeTurning<T>; N], shape: &ShapeAt<N, T>, q: &Mat3<T>) -> Self {
        let mut out = Self {
            nodes,
            rotations: [Mat3::zero(); N],
            angles: [Vec3::zero(); N],
            maps: [Mat3::zero(); N],
            angle: Vec3::zero(),
        };
        for i in 0..N {
            let rotation = q.transpose_matmul(nodes[i].rotation.r);
            let angle = log(rotation * Mat3::constant(nodes[i].before.rotation).transpose());
            out.rotations[i] = rotation;
            out.angles[i] = angle;
            out.maps[i] = Rotation::new(angle).t_inverse().transpose();
            out.angle += angle * shape.values[i];
        }
        out
    }

    /// The sum of y0_i times factors.
    pub(super) fn before(&self, factors: &[T; N]) -> Vec3<T> {
        weighted_sum(factors, |i| Vec3::constant(self.nodes[i].before.place))
    }
}

/// A force or moment with its derivatives: over y at constant p, Theta, y0 and p.
#[derive(Clone, Copy)]
pub(super) struct Derived<T> {
    pub(super) value: Vec3<T>,
    pub(super) over_place: Mat3<T>,
    pub(super) over_rolling: Mat3<T>,
    pub(super) over_before: Mat3<T>,
    pub(super) over_pressure: Vec3<T>,
}

/// Changes of what forces depend on, by a change of one scalar.
pub(super) struct Change<T> {
    pub(super) place: Vec3<T>,
    pub(super) rolling: Vec3<T>,
    pub(super) before: Vec3<T>,
    pub(super) pressure: T,
}

/// The derivatives over a block of three unknowns, weighted, of what forces depend on.
pub(super) struct Column<T> {
    /// dy
    pub(super) place: Mat3<T>,
    /// dTheta
    pub(super) rolling: Mat3<T>,
    /// dp, a row
    pub(super) pressure: Vec3<T>,
}

impl<T: Real> Derived<T> {
    pub(super) fn zero() -> Self {
        let (o, matrix) = (Vec3::zero(), Mat3::zero());
        Self { value: o, over_place: matrix, over_rolling: matrix, over_before: matrix, over_pressure: o }
    }

    pub(super) fn by(&self, change: &Change<T>) -> Vec3<T> {
        self.over_place * change.place
            + self.over_rolling * change.rolling
            + self.over_before * change.before
            + self.over_pressure * change.pressure
    }

    pub(super) fn over(&self, column: &Column<T>) -> Mat3<T> {
        self.over_place * column.place + self.over_rolling * column.rolling + self.over_pressure.outer(column.pressure)
    }
}
