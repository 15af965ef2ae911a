//! Loads at a point: dead and following forces and moments, with their tangents (equations (72)–(75), (A4)).
//!
//! Everything is returned as g = -f_ext and dg, see [`crate::kernel`].

use super::element::{NodeMotion, Weights};
use super::inertia::Inertia;
use super::volume::{Blocks, VolumeForce, VolumeKernel};
use crate::real::Real;
use crate::rotation::Rotation;
use crate::tensor::{Mat3, Vec3};

/// A moment that stays fixed in space: M_I = T^T M with M = R^T m; its tangent C2(M) + T^T M~ T is not symmetric, since such
/// a moment has no potential. For total vectors the two are T m and C1(m); for increments after another rotation they are not.
#[inline(always)]
pub fn spatial_moment<T: Real>(rotation: &Rotation<T>, moment: Vec3<T>) -> (Vec3<T>, Mat3<T>) {
    let (t, material) = (rotation.t, rotation.r.transpose_mul(moment));
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

/// A force fixed in space that acts at the material offset `d`: what it does to P, T^T (d x R^T f), and the tangent.
#[inline(always)]
pub fn offset_force<T: Real>(rotation: &Rotation<T>, offset: Vec3<T>, force: Vec3<T>) -> (Vec3<T>, Mat3<T>) {
    (-rotation.potential_gradient(offset, force), -rotation.potential_hessian(offset, force))
}

/// Force and moment per initial length, and the number of their amplitude.
#[derive(Clone, Copy, Debug)]
pub struct Intensity {
    /// Force per length
    pub force: Vec3,
    /// Moment per length
    pub moment: Vec3,
    /// The number of the amplitude
    pub amplitude: usize,
}

impl Intensity {
    #[inline(always)]
    fn at<T: Real>(&self, amplitudes: &[f64]) -> (Vec3<T>, Vec3<T>) {
        let amplitude = amplitudes[self.amplitude];
        (Vec3::constant(self.force * amplitude), Vec3::constant(self.moment * amplitude))
    }
}

/// Line loads fixed in space.
pub struct SpatialLine<'a> {
    /// The amplitudes of the state
    pub amplitudes: &'a [f64],
}

impl VolumeKernel for SpatialLine<'_> {
    type Quantity = Intensity;
    const BLOCKS: Blocks = Blocks::Both;
    const RATES: bool = false;

    #[inline(always)]
    fn evaluate<T: Real>(&self, load: &Intensity, motion: &NodeMotion<T>, weights: Weights) -> VolumeForce<T> {
        let (force, moment) = load.at::<T>(self.amplitudes);
        let mut out = VolumeForce { u: -force, ..VolumeForce::zero() };
        if load.moment != Vec3::ZERO {
            let (p, pp) = spatial_moment(&Rotation::new(motion.p), moment);
            (out.p, out.pp) = (p, pp.scale(weights.stiffness));
        }
        out
    }
}

/// Line loads that turn with the section.
pub struct MaterialLine<'a> {
    /// The amplitudes of the state
    pub amplitudes: &'a [f64],
}

impl VolumeKernel for MaterialLine<'_> {
    type Quantity = Intensity;
    const BLOCKS: Blocks = Blocks::Both;
    const RATES: bool = false;

    #[inline(always)]
    fn evaluate<T: Real>(&self, load: &Intensity, motion: &NodeMotion<T>, weights: Weights) -> VolumeForce<T> {
        let (force, moment) = load.at::<T>(self.amplitudes);
        let rotation = Rotation::new(motion.p);
        let ((u, up), (p, pp)) = (material_force(&rotation, force), material_moment(&rotation, moment));
        let s = weights.stiffness;
        VolumeForce { u, p, up: up.scale(s), pp: pp.scale(s), ..VolumeForce::zero() }
    }
}

/// Weight per length. Mass on the centre line needs no rotation and no tangent.
pub struct Weight {
    /// The acceleration of gravity
    pub acceleration: Vec3,
}

impl VolumeKernel for Weight {
    type Quantity = Inertia;
    const BLOCKS: Blocks = Blocks::Both;
    const RATES: bool = false;

    #[inline(always)]
    fn evaluate<T: Real>(&self, inertia: &Inertia, motion: &NodeMotion<T>, weights: Weights) -> VolumeForce<T> {
        let force = Vec3::constant(self.acceleration * inertia.mass);
        let mut out = VolumeForce { u: -force, ..VolumeForce::zero() };
        if inertia.offset != Vec3::ZERO {
            let (p, pp) = offset_force(&Rotation::new(motion.p), Vec3::constant(inertia.offset), force);
            (out.p, out.pp) = (p, pp.scale(weights.stiffness));
        }
        out
    }
}
