//! Loads at a point: dead and following forces and moments, with their tangents (equations (72)–(75), (A4)).
//!
//! Everything is returned as g = -f_ext and dg, see [`crate::kernel`].

use crate::real::Real;
use crate::rotation::Rotation;
use crate::tensor::{Mat3, Vec3};

/// A moment that stays fixed in space: M_I = T^T R^T m = T m; its tangent C1(m) is not symmetric, since such a moment has
/// no potential.
#[inline(always)]
pub fn spatial_moment<T: Real>(rotation: &Rotation<T>, moment: Vec3<T>) -> (Vec3<T>, Mat3<T>) {
    (-(rotation.t * moment), -rotation.c1(moment))
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
