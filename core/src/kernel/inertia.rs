//! Inertia at a point of a cross-section or of a rigid body (equations (51), (52), (68)–(71) of
//! Makinen 2007, and their form for a mass centre with an offset).

use super::element::{NodeMotion, Weights};
use super::volume::{Blocks, VolumeForce, VolumeKernel};
use crate::rotation::Rotation;
use crate::scalar::{LANES, Lanes, Pack, Real, pack};
use crate::tensor::{Mat3, Vec3};

/// Mass properties in global components of the initial placement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia<T = f64> {
    /// m: mass, or mass per length
    pub mass: T,
    /// d: the vector from the node or the centre line to the mass centre, a length
    pub offset: Vec3<T>,
    /// J0: the inertia about the node or the centre line (not about the mass centre), mass times
    /// length squared, or that per length
    pub about_node: Mat3<T>,
}

impl Inertia {
    /// The radius of gyration about the node or the centre line; zero without mass.
    pub fn radius_of_gyration(&self) -> f64 {
        let [xx, yy, zz] = [0, 1, 2].map(|k| self.about_node.0[k][k]);
        if self.mass > 0.0 { (0.5 * (xx + yy + zz) / self.mass).sqrt() } else { 0.0 }
    }
}

impl Pack for Inertia {
    type Packed = Inertia<Lanes>;

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Self::Packed {
        Inertia { mass: pack!(of.mass), offset: pack!(of.offset), about_node: pack!(of.about_node) }
    }
}

impl Inertia {
    /// The inertia of a massless body.
    pub const NONE: Self = Self { mass: 0.0, offset: Vec3::ZERO, about_node: Mat3::ZERO };

    /// These mass properties as constants of another scalar, say dual numbers.
    pub fn lifted<T: Real>(&self) -> Inertia<T> {
        let offset = Vec3::constant(self.offset);
        let about_node = Mat3::constant(self.about_node);
        Inertia { mass: T::constant(self.mass), offset, about_node }
    }

    /// The mass properties of this body joined rigidly with another one at the same node.
    pub fn with(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        let moment = self.offset * self.mass + other.offset * other.mass;
        let offset = if mass > 0.0 { moment * (1.0 / mass) } else { Vec3::ZERO };
        Self { mass, offset, about_node: self.about_node + other.about_node }
    }

    /// The inertia about the mass centre (Steiner): J0 - m [(d.d) I - d(x)d]
    pub fn about_centre(&self) -> Mat3 {
        let d = self.offset;
        self.about_node - (Mat3::diagonal([d.squared(); 3]) - d.outer(d)) * self.mass
    }
}

/// The spin of a point: Omega = T Pd, Acc = T Pdd + Td Pd, both material.
#[derive(Clone, Copy, Debug)]
pub struct Spin<T = f64> {
    /// R, T and the derivative tensors
    pub rotation: Rotation<T>,
    /// Omega, material angular velocity
    pub omega: Vec3<T>,
    /// Acc, material angular acceleration
    pub acceleration: Vec3<T>,
    rates: Rates<T>,
}

/// The unknowns that a spin depends on.
#[derive(Clone, Copy, Debug)]
enum Rates<T> {
    /// The rotation vector P and its rates, Pd and Pdd
    OfVector { p_rate: Vec3<T>, p_rate2: Vec3<T> },
    /// The increment of a time step alone, with the derivatives over it
    OfIncrement(Derivatives<T>),
}

/// Derivatives of a spin over its rotation unknown: the weighted ones over a rotation vector and
/// its rates, or those over the increment of a time step.
#[derive(Clone, Copy, Debug)]
pub struct Derivatives<T = f64> {
    /// dOmega, of the material angular velocity
    pub(crate) d_omega: Mat3<T>,
    /// dAcc, of the material angular acceleration
    pub(super) d_acceleration: Mat3<T>,
}

impl<T: Real> Derivatives<T> {
    /// Zero: the derivatives of a prescribed spin.
    pub fn none() -> Self {
        Self { d_omega: Mat3::zero(), d_acceleration: Mat3::zero() }
    }
}

impl<T: Real> Spin<T> {
    /// The spin that belongs to a rotation vector and its rates.
    #[inline(always)]
    pub fn new(p: Vec3<T>, p_rate: Vec3<T>, p_rate2: Vec3<T>) -> Self {
        let rotation = Rotation::new(p);
        let omega = rotation.t * p_rate;
        let acceleration = rotation.t * p_rate2 + rotation.t_rate(p_rate) * p_rate;
        Self { rotation, omega, acceleration, rates: Rates::OfVector { p_rate, p_rate2 } }
    }

    /// A spin that is a function of the increment of a time step; `over` holds its derivatives over
    /// the increment.
    #[inline]
    pub fn direct(rotation: Rotation<T>, omega: Vec3<T>, acceleration: Vec3<T>, over: Derivatives<T>) -> Self {
        Self { rotation, omega, acceleration, rates: Rates::OfIncrement(over) }
    }

    /// This spin if gyroscopic forces count; otherwise one without velocity, whose only forces come
    /// from its acceleration.
    #[inline(always)]
    pub fn with_gyroscopic_forces(mut self, they_count: bool) -> Self {
        if !they_count {
            // All gyroscopic forces are products of the spin with itself.
            self.omega = Vec3::zero();
        }
        self
    }

    /// The derivatives over the increment of a time step; `None` for a spin of a rotation vector
    /// and its rates.
    pub fn over_unknown(&self) -> Option<&Derivatives<T>> {
        match &self.rates {
            Rates::OfVector { .. } => None,
            Rates::OfIncrement(over) => Some(over),
        }
    }

    /// The weighted derivative of Omega with respect to the rotation unknowns, s dOmega/dP + d
    /// dOmega/dPd.
    pub fn omega_derivative(&self, weights: Weights) -> Mat3<T> {
        self.derivatives(weights).d_omega
    }

    /// The weighted derivatives of Acc and of Omega with respect to the rotation unknowns:
    ///
    /// ```text
    /// dAcc   = s (C5 + C1(Pdd)) + d C4 + m T          dOmega = s C1(Pd) + d T
    /// ```
    ///
    /// A spin of an increment returns its own derivatives, in which the weights of the step are
    /// already.
    #[inline(always)]
    fn derivatives(&self, w: Weights) -> Derivatives<T> {
        let rotation = &self.rotation;
        let (p_rate, p_rate2) = match self.rates {
            Rates::OfVector { p_rate, p_rate2 } => (p_rate, p_rate2),
            Rates::OfIncrement(over) => {
                debug_assert!(
                    w.stiffness == 1.0 || w == Weights::NONE,
                    "the weights of a step stand in the derivatives"
                );
                return over;
            }
        };
        let mut acceleration = rotation.t.scale(w.mass);
        let mut omega = Mat3::zero();
        if w.damping != 0.0 {
            acceleration += rotation.c4(p_rate).scale(w.damping);
            omega += rotation.t.scale(w.damping);
        }
        if w.stiffness != 0.0 {
            acceleration += (rotation.c5(p_rate) + rotation.c1(p_rate2)).scale(w.stiffness);
            omega += rotation.c1(p_rate).scale(w.stiffness);
        }
        Derivatives { d_omega: omega, d_acceleration: acceleration }
    }
}

/// Force and tangent of rotary inertia without an offset, conjugate to P:
///
/// ```text
/// h = J Acc + Omega x J Omega,  f = T^T h
/// J_PP = T^T [J dAcc + G dOmega] + s C2(h),  G = Omega~ J - (J Omega)~
/// ```
#[inline(always)]
pub fn rotary<T: Real>(j: Mat3<T>, spin: &Spin<T>, weights: Weights) -> (Vec3<T>, Mat3<T>) {
    let rotation = &spin.rotation;
    let omega = spin.omega;
    let momentum = j * omega;
    let h = j * spin.acceleration + omega.cross(momentum);
    let force = rotation.t.transpose_mul(h);
    if weights == Weights::NONE {
        return (force, Mat3::zero());
    }
    let Derivatives { d_omega, d_acceleration } = spin.derivatives(weights);
    let gyroscopic = Mat3::skew_mul(omega, j) - momentum.skew();
    let mut tangent = rotation.t.transpose_matmul(j * d_acceleration + gyroscopic * d_omega);
    if weights.stiffness != 0.0 {
        tangent += rotation.c2(h).scale(weights.stiffness);
    }
    (force, tangent)
}

/// Force and tangent of the inertia of a body whose mass centre has the offset d, conjugate to u
/// (spatial) and P. With s = Acc x d + Omega x (Omega x d) and h = J0 Acc + Omega x J0 Omega + m d
/// x R^T u'':
///
/// ```text
/// f_u = m (u'' + R s),  f_P = T^T h
/// ```
#[inline(always)]
pub fn body<T: Real>(inertia: &Inertia<T>, u_rate2: Vec3<T>, spin: &Spin<T>, weights: Weights) -> VolumeForce<T> {
    let r = spin.rotation.r;
    let t = spin.rotation.t;
    let omega = spin.omega;
    let d = inertia.offset;
    let j0 = inertia.about_node;
    let m = inertia.mass;
    let momentum = j0 * omega;
    let pull = r.transpose_mul(u_rate2);
    let omega_d = omega.cross(d);
    let s = spin.acceleration.cross(d) + omega.cross(omega_d);
    let h = j0 * spin.acceleration + omega.cross(momentum) + d.cross(pull) * m;
    let mut out = VolumeForce::zero();
    out.u = (u_rate2 + r * s) * m;
    out.p = t.transpose_mul(h);
    if weights == Weights::NONE {
        return out;
    }
    let Derivatives { d_omega, d_acceleration } = spin.derivatives(weights);
    let gyroscopic = Mat3::skew_mul(omega, j0) - momentum.skew();
    let coriolis = omega_d.skew() + Mat3::skew_mul(omega, d.skew());
    let mut up = -(Mat3::skew_mul(d, d_acceleration) + coriolis * d_omega);
    let mut pp = j0 * d_acceleration + gyroscopic * d_omega;
    if weights.stiffness != 0.0 {
        up -= Mat3::skew_mul(s, t).scale(weights.stiffness);
        pp += Mat3::skew_mul(d, Mat3::skew_mul(pull, t)) * (m * weights.stiffness);
    }
    out.uu = Mat3::identity() * (m * weights.mass);
    out.up = (r * up) * m;
    out.pu = t.transpose_matmul(Mat3::skew_mul(d, r.transpose())) * (m * weights.mass);
    out.pp = t.transpose_matmul(pp);
    if weights.stiffness != 0.0 {
        out.pp += spin.rotation.c2(h).scale(weights.stiffness);
    }
    out
}

/// Force and tangent of the inertia of a body whose mass centre is its node: [`body`] with d = 0.
#[inline(always)]
pub fn centred_body<T: Real>(
    inertia: &Inertia<T>,
    u_rate2: Vec3<T>,
    spin: &Spin<T>,
    weights: Weights,
) -> VolumeForce<T> {
    let mut out = VolumeForce::zero();
    out.u = u_rate2 * inertia.mass;
    out.uu = Mat3::identity() * (inertia.mass * weights.mass);
    (out.p, out.pp) = rotary(inertia.about_node, spin, weights);
    out
}

/// Force and tangent of mass-proportional damping, conjugate to u (spatial) and P. With the
/// velocity v = du/dt, the damping factor alpha (1/time) and h = J0 Omega + m d x R^T v
///
/// ```text
/// f_u = alpha m (v + R (Omega x d)),  f_P = alpha T^T h
/// ```
#[inline(always)]
pub fn drag<T: Real>(
    inertia: &Inertia<T>,
    velocity: Vec3<T>,
    spin: &Spin<T>,
    alpha: f64,
    weights: Weights,
) -> VolumeForce<T> {
    let r = spin.rotation.r;
    let t = spin.rotation.t;
    let omega = spin.omega;
    let d = inertia.offset;
    let j0 = inertia.about_node;
    let m = inertia.mass;
    let carried = omega.cross(d);
    let pull = r.transpose_mul(velocity);
    let h = (j0 * omega + d.cross(pull) * m).scale(alpha);
    let mut out = VolumeForce::zero();
    out.u = (velocity + r * carried) * (m * alpha);
    out.p = t.transpose_mul(h);
    if weights.stiffness == 0.0 && weights.damping == 0.0 {
        return out;
    }
    let s = weights.stiffness;
    let d_omega = spin.omega_derivative(weights);
    let turned = Mat3::skew_mul(carried, t).scale(s);
    out.uu = Mat3::identity() * (m * (alpha * weights.damping));
    out.up = -(r * (Mat3::skew_mul(d, d_omega) + turned)) * (m * alpha);
    out.pu = t.transpose_matmul(Mat3::skew_mul(d, r.transpose())) * (m * (alpha * weights.damping));
    let pulled = Mat3::skew_mul(d, Mat3::skew_mul(pull, t)) * (m * s);
    out.pp = t.transpose_matmul((j0 * d_omega + pulled).scale(alpha)) + spin.rotation.c2(h).scale(s);
    out
}

/// Mass-proportional damping of a beam, force per initial length: see [`drag`].
pub struct Drag {
    /// alpha, 1/time
    pub(crate) factor: f64,
}

impl VolumeKernel for Drag {
    type Quantity = Inertia;
    type Present<T: Real> = Inertia<T>;
    const BLOCKS: Blocks = Blocks::Both;
    const RATES: bool = true;

    fn at_present(&self, quantity: &Self::Quantity) -> Self::Quantity {
        *quantity
    }

    #[inline(always)]
    fn evaluate<T: Real>(&self, inertia: &Inertia<T>, motion: &NodeMotion<T>, weights: Weights) -> VolumeForce<T> {
        let spin = Spin::new(motion.p, motion.p_rate, motion.p_rate2);
        drag(inertia, motion.u_rate, &spin, self.factor, weights)
    }
}

/// Centrifugal forces on a body at rest in a frame that turns with the constant angular velocity w
/// about x0, in components of that frame, and their derivatives for small motions. `spin` is w, and
/// `from_axis` is x - x0. With W = R^T w and a = w x (w x (x - x0)) they are those of [`body`] for
/// Omega = W, Acc = 0, u'' = a, with the derivatives
///
/// ```text
/// dOmega = s W~ T + d T,   dAcc = d W~ T + m T,   da = s w~ w~ + 2 d w~ + m I
/// ```
#[inline(always)]
pub fn steadily_turned<T: Real>(
    inertia: &Inertia<T>,
    spin: Vec3<T>,
    from_axis: Vec3<T>,
    rotation: &Rotation<T>,
    weights: Weights,
) -> VolumeForce<T> {
    let r = rotation.r;
    let t = rotation.t;
    let d = inertia.offset;
    let j0 = inertia.about_node;
    let m = inertia.mass;
    let w = r.transpose_mul(spin);
    let w_skew = spin.skew();
    let a = spin.cross(spin.cross(from_axis));
    let pull = r.transpose_mul(a);
    let w_d = w.cross(d);
    let momentum = j0 * w;
    let s = w.cross(w_d);
    let h = w.cross(momentum) + d.cross(pull) * m;
    let mut out = VolumeForce::zero();
    out.u = (a + r * s) * m;
    out.p = t.transpose_mul(h);
    if weights == Weights::NONE {
        return out;
    }
    let Weights { stiffness, damping, mass } = weights;
    let w_t = Mat3::skew_mul(w, t);
    let d_omega = w_t.scale(stiffness) + t.scale(damping);
    let d_acc = w_t.scale(damping) + t.scale(mass);
    let da = (w_skew * w_skew).scale(stiffness) + w_skew.scale(2.0 * damping) + Mat3::identity().scale(mass);
    let gyroscopic = Mat3::skew_mul(w, j0) - momentum.skew();
    let coriolis = w_d.skew() + Mat3::skew_mul(w, d.skew());
    let ds = -(Mat3::skew_mul(d, d_acc) + coriolis * d_omega + Mat3::skew_mul(s, t).scale(stiffness));
    let pulled = Mat3::skew_mul(d, Mat3::skew_mul(pull, t)) * (m * stiffness);
    out.uu = da * m;
    out.up = (r * ds) * m;
    out.pu = t.transpose_matmul(Mat3::skew_mul(d, r.transpose() * da)) * m;
    out.pp = t.transpose_matmul(j0 * d_acc + gyroscopic * d_omega + pulled) + rotation.c2(h).scale(stiffness);
    out
}

/// Centrifugal forces per initial length in a turning frame, see [`steadily_turned`]. The quantity
/// of a point is its mass properties and its initial place.
pub struct SteadilyTurned {
    /// w, the angular velocity of the frame, 1/time
    pub(crate) spin: Vec3,
    /// x0, a point on the axis of the frame
    pub(crate) about: Vec3,
}

impl VolumeKernel for SteadilyTurned {
    type Quantity = (Inertia, Vec3);
    type Present<T: Real> = (Inertia<T>, Vec3<T>);
    const BLOCKS: Blocks = Blocks::Both;
    const RATES: bool = false;

    fn at_present(&self, quantity: &Self::Quantity) -> Self::Quantity {
        *quantity
    }

    #[inline(always)]
    fn evaluate<T: Real>(
        &self,
        (inertia, place): &(Inertia<T>, Vec3<T>),
        motion: &NodeMotion<T>,
        weights: Weights,
    ) -> VolumeForce<T> {
        let from_axis = *place - Vec3::constant(self.about) + motion.u;
        steadily_turned(inertia, Vec3::constant(self.spin), from_axis, &Rotation::new(motion.p), weights)
    }
}

/// Rotary inertia of a beam per initial length, see [`rotary`].
pub struct Rotary {
    /// True if gyroscopic and centrifugal forces count
    pub gyroscopic: bool,
}

impl VolumeKernel for Rotary {
    type Quantity = Mat3;
    type Present<T: Real> = Mat3<T>;
    const BLOCKS: Blocks = Blocks::Rotations;
    const RATES: bool = true;

    fn at_present(&self, quantity: &Self::Quantity) -> Self::Quantity {
        *quantity
    }

    #[inline(always)]
    fn evaluate<T: Real>(&self, j: &Mat3<T>, motion: &NodeMotion<T>, weights: Weights) -> VolumeForce<T> {
        let spin = Spin::new(motion.p, motion.p_rate, motion.p_rate2).with_gyroscopic_forces(self.gyroscopic);
        let (p, pp) = rotary(*j, &spin, weights);
        VolumeForce { p, pp, ..VolumeForce::zero() }
    }
}

/// Inertia of a beam with an eccentric mass per initial length, see [`body`].
pub struct Eccentric {
    /// True if gyroscopic and centrifugal forces count
    pub gyroscopic: bool,
}

impl VolumeKernel for Eccentric {
    type Quantity = Inertia;
    type Present<T: Real> = Inertia<T>;
    const BLOCKS: Blocks = Blocks::Both;
    const RATES: bool = true;

    fn at_present(&self, quantity: &Self::Quantity) -> Self::Quantity {
        *quantity
    }

    #[inline(always)]
    fn evaluate<T: Real>(&self, inertia: &Inertia<T>, motion: &NodeMotion<T>, weights: Weights) -> VolumeForce<T> {
        let spin = Spin::new(motion.p, motion.p_rate, motion.p_rate2).with_gyroscopic_forces(self.gyroscopic);
        body(inertia, motion.u_rate2, &spin, weights)
    }
}
