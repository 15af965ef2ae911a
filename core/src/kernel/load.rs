//! Loads at a point: dead and following forces and moments, with their tangents (equations
//! (72)–(75) and (A4) of Makinen 2007).
//!
//! All functions return g = -f_ext and its tangent dg, in the sign of [`crate::kernel`].

use super::element::{NodeMotion, Weights};
use super::inertia::Inertia;
use super::volume::{Blocks, VolumeForce, VolumeKernel};
use crate::rotation::{Complement, Rotation};
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// A moment that stays fixed in space: M_I = T^T M with M = R^T m; its tangent C2(M) + T^T M~ T is
/// not symmetric, since such a moment has no potential. For total vectors the two are T m and
/// C1(m); for increments after another rotation they are not.
#[inline(always)]
pub fn spatial_moment<T: Real>(rotation: &Rotation<T>, moment: Vec3<T>) -> (Vec3<T>, Mat3<T>) {
    let t = rotation.t;
    let material = rotation.r.transpose_mul(moment);
    let tangent = rotation.c2(material) + t.transpose_matmul(Mat3::skew_mul(material, t));
    (-t.transpose_mul(material), -tangent)
}

/// A moment that turns with the section: M_I = T^T M; tangent C2(M).
#[inline(always)]
pub fn material_moment<T: Real>(rotation: &Rotation<T>, moment: Vec3<T>) -> (Vec3<T>, Mat3<T>) {
    (-rotation.t.transpose_mul(moment), -rotation.c2(moment))
}

/// A force that turns with the section: f_u = R F; the tangent couples u and P: -R F~ T.
#[inline(always)]
pub fn material_force<T: Real>(rotation: &Rotation<T>, force: Vec3<T>) -> (Vec3<T>, Mat3<T>) {
    (-(rotation.r * force), rotation.r * Mat3::skew_mul(force, rotation.t))
}

/// The moment of a force f fixed in space that acts at the material offset d, conjugate to P: T^T
/// (d x R^T f), and its tangent.
#[inline(always)]
pub fn offset_force<T: Real>(rotation: &Rotation<T>, offset: Vec3<T>, force: Vec3<T>) -> (Vec3<T>, Mat3<T>) {
    (-rotation.potential_gradient(offset, force), -rotation.potential_hessian(offset, force))
}

/// A force that is conjugate to the complement of a rotation vector P: f_P = B^T f, and its tangent
/// (88).
pub fn force_on_complement<T: Real>(p: Vec3<T>, force: Vec3<T>) -> (Vec3<T>, Mat3<T>) {
    let b = Complement::new(p, Vec3::zero(), Vec3::zero()).b;
    (b.transpose_mul(force), Complement::geometric(p, force))
}

/// A line load: force and moment per initial length at an amplitude of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intensity {
    /// Force per initial length: spatial for a dead load, material for a following one
    pub force: Vec3,
    /// Moment per initial length, in the frame of the force
    pub moment: Vec3,
    /// The index of its amplitude in the amplitudes of a state
    pub amplitude: usize,
}

impl Intensity {
    /// Force and, unless it is zero, moment at the present amplitude.
    #[inline(always)]
    fn at(&self, amplitudes: &[f64]) -> (Vec3, Option<Vec3>) {
        let amplitude = amplitudes[self.amplitude];
        let moment = (self.moment != Vec3::ZERO).then_some(self.moment * amplitude);
        (self.force * amplitude, moment)
    }
}

/// Line loads: fixed in space, or turning with the section if `FOLLOWS`.
pub struct DistributedLoad<'a, const FOLLOWS: bool> {
    /// The amplitudes of the loads at the present time
    pub(crate) amplitudes: &'a [f64],
}

impl<const FOLLOWS: bool> VolumeKernel for DistributedLoad<'_, FOLLOWS> {
    type Quantity = Intensity;
    type Present<T: Real> = (Vec3<T>, Option<Vec3<T>>);
    const BLOCKS: Blocks = Blocks::Both;
    const RATES: bool = false;

    fn at_present(&self, load: &Intensity) -> (Vec3, Option<Vec3>) {
        load.at(self.amplitudes)
    }

    #[inline(always)]
    fn evaluate<T: Real>(
        &self,
        &(force, moment): &(Vec3<T>, Option<Vec3<T>>),
        motion: &NodeMotion<T>,
        weights: Weights,
    ) -> VolumeForce<T> {
        let s = weights.stiffness;
        let mut out = VolumeForce { u: -force, ..VolumeForce::zero() };
        if FOLLOWS {
            let (u, up) = material_force(&Rotation::new(motion.p), force);
            out.u = u;
            out.up = up.scale(s);
        }
        if let Some(moment) = moment {
            let rotation = Rotation::new(motion.p);
            let turning = if FOLLOWS { material_moment } else { spatial_moment };
            let (p, pp) = turning(&rotation, moment);
            out.p = p;
            out.pp = pp.scale(s);
        }
        out
    }
}

/// Weight per initial length. Mass on the centre line needs no rotation and no tangent.
pub struct Weight {
    /// The acceleration of gravity, spatial
    pub(crate) acceleration: Vec3,
}

impl VolumeKernel for Weight {
    type Quantity = Inertia;
    type Present<T: Real> = (Vec3<T>, Option<Vec3<T>>);
    const BLOCKS: Blocks = Blocks::Both;
    const RATES: bool = false;

    fn at_present(&self, inertia: &Inertia) -> (Vec3, Option<Vec3>) {
        (self.acceleration * inertia.mass, (inertia.offset != Vec3::ZERO).then_some(inertia.offset))
    }

    #[inline(always)]
    fn evaluate<T: Real>(
        &self,
        &(force, offset): &(Vec3<T>, Option<Vec3<T>>),
        motion: &NodeMotion<T>,
        weights: Weights,
    ) -> VolumeForce<T> {
        let mut out = VolumeForce { u: -force, ..VolumeForce::zero() };
        if let Some(offset) = offset {
            let (p, pp) = offset_force(&Rotation::new(motion.p), offset, force);
            out.p = p;
            out.pp = pp.scale(weights.stiffness);
        }
        out
    }
}
