//! Forces per initial length that depend on u, P and their rates, but not on slopes: inertia,
//! weight, line loads.

use super::beam::interpolate;
use super::element::{ElementSystem, NodeMotion, Weights};
use crate::scalar::{LANES, Lanes, Pack, Real, pack};
use crate::tensor::{Mat3, Vec3};

/// An integration point of a force per initial length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumePoint<const N: usize, Q, T = f64> {
    /// Shape functions
    pub shape: [T; N],
    /// Gauss weight times ds/dxi, a length
    pub weight: T,
    /// The data of the kernel at this point, per initial length
    pub quantity: Q,
}

/// Force and tangent at a point, conjugate to u (spatial) and P.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct VolumeForce<T = f64> {
    pub u: Vec3<T>,
    pub p: Vec3<T>,
    pub uu: Mat3<T>,
    pub up: Mat3<T>,
    pub pu: Mat3<T>,
    pub pp: Mat3<T>,
}

impl<T: Real> VolumeForce<T> {
    /// No force.
    #[inline(always)]
    pub fn zero() -> Self {
        let v = Vec3::zero();
        let m = Mat3::zero();
        Self { u: v, p: v, uu: m, up: m, pu: m, pp: m }
    }
}

impl<T: Real> VolumeForce<T> {
    /// Overwrites the system of an element of one node with this force and, unless all weights are
    /// zero, this tangent.
    #[inline(always)]
    pub fn write(&self, weights: Weights, out: &mut ElementSystem<T>) {
        out.set_force(0, self.u);
        out.set_force(1, self.p);
        if weights != Weights::NONE {
            out.set_tangent(0, 0, &self.uu);
            out.set_tangent(0, 1, &self.up);
            out.set_tangent(1, 0, &self.pu);
            out.set_tangent(1, 1, &self.pp);
        }
    }
}

/// The unknowns of nodes that a kernel couples, and so the blocks of its element: P1, P2, … or u1,
/// P1, u2, ….
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blocks {
    /// Rotation vectors alone
    Rotations,
    /// Displacements and rotation vectors
    Both,
}

impl Blocks {
    /// The blocks of an element of `nodes` nodes.
    pub fn count(self, nodes: usize) -> usize {
        if self == Self::Both { 2 * nodes } else { nodes }
    }

    /// The block of the rotation of node j.
    #[inline(always)]
    pub fn rotation(self, j: usize) -> usize {
        if self == Self::Both { 2 * j + 1 } else { j }
    }
}

/// A force per initial length as a function of the motion of a point.
pub trait VolumeKernel {
    /// Constant data of a point.
    type Quantity: Copy;
    /// Data of a point at the present time, over any scalar.
    type Present<T: Real>: Copy;
    /// The unknowns that the force couples
    const BLOCKS: Blocks;
    /// True if the force depends on rates of P
    const RATES: bool;

    /// The data of a point at the present time.
    fn at_present(&self, quantity: &Self::Quantity) -> Self::Present<f64>;

    /// Force per initial length and, unless all weights are zero, its tangent.
    fn evaluate<T: Real>(&self, present: &Self::Present<T>, motion: &NodeMotion<T>, weights: Weights)
    -> VolumeForce<T>;
}

impl<const N: usize, Q: Copy> VolumePoint<N, Q> {
    /// The point with `change` applied to its quantity.
    #[inline(always)]
    pub fn map<P>(&self, change: impl Fn(&Q) -> P) -> VolumePoint<N, P> {
        VolumePoint { shape: self.shape, weight: self.weight, quantity: change(&self.quantity) }
    }

    /// The point over another scalar, with `lift` applied to its quantity.
    pub fn lifted<T: Real, P>(&self, lift: impl Fn(&Q) -> P) -> VolumePoint<N, P, T> {
        let shape = self.shape.map(T::constant);
        let weight = T::constant(self.weight);
        VolumePoint { shape, weight, quantity: lift(&self.quantity) }
    }
}

impl<const N: usize, Q: Pack> Pack for VolumePoint<N, Q> {
    type Packed = VolumePoint<N, Q::Packed, Lanes>;

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Self::Packed {
        VolumePoint { shape: pack!(of.shape), weight: pack!(of.weight), quantity: pack!(of.quantity) }
    }
}

impl<const N: usize, Q: Copy, T: Real> VolumePoint<N, Q, T> {
    /// The interpolated motion at this point.
    #[inline(always)]
    pub fn motion(&self, nodes: &[NodeMotion<T>; N]) -> NodeMotion<T> {
        let shape = &self.shape;
        NodeMotion {
            u: interpolate(shape, |i| nodes[i].u),
            u_rate: interpolate(shape, |i| nodes[i].u_rate),
            u_rate2: interpolate(shape, |i| nodes[i].u_rate2),
            p: interpolate(shape, |i| nodes[i].p),
            p_rate: interpolate(shape, |i| nodes[i].p_rate),
            p_rate2: interpolate(shape, |i| nodes[i].p_rate2),
        }
    }

    /// Adds the force of `kernel` and, unless all weights are zero, its tangent.
    #[inline(always)]
    pub fn add<K: VolumeKernel<Present<T> = Q>>(
        &self,
        kernel: &K,
        nodes: &[NodeMotion<T>; N],
        weights: Weights,
        out: &mut ElementSystem<T>,
    ) {
        let force = kernel.evaluate(&self.quantity, &self.motion(nodes), weights);
        for i in 0..N {
            let w = self.weight * self.shape[i];
            match K::BLOCKS {
                Blocks::Rotations => out.add_force(i, force.p * w),
                Blocks::Both => {
                    out.add_force(2 * i, force.u * w);
                    out.add_force(2 * i + 1, force.p * w);
                }
            }
            if weights == Weights::NONE {
                continue;
            }
            for j in 0..N {
                let w = w * self.shape[j];
                match K::BLOCKS {
                    Blocks::Rotations => out.add_tangent(i, j, force.pp * w),
                    Blocks::Both => {
                        out.add_tangent(2 * i, 2 * j, force.uu * w);
                        out.add_tangent(2 * i, 2 * j + 1, force.up * w);
                        out.add_tangent(2 * i + 1, 2 * j, force.pu * w);
                        out.add_tangent(2 * i + 1, 2 * j + 1, force.pp * w);
                    }
                }
            }
        }
    }
}
