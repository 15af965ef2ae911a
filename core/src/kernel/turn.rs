//! The rotation of a node over one time step, as a function of its increment alone.
//!
//! The step starts at R0 with the spin Omega0; all vectors of the formulas stand in the axes of R0.
//! With R = R0 E, E = exp(X), and a constant symmetric J, let w = E Omega be the spin in space, L =
//! E J Omega the momentum that is carried, and b = dL/dt. L and X advance as coordinates do in the
//! generalised-alpha method, with B for the algorithmic rate of L:
//!
//! ```text
//! L1 = L0 + h [(1-gamma) B0 + gamma B1]
//! (1-alpha_m) B1 + alpha_m B0 = (1-alpha_f) b1 + alpha_f b0
//! X = h/2 (w0 + w1) + h^2 (beta - gamma/2) (E J^-1 E^T B1 - J^-1 B0)
//!     + h^2/12 (phi0 - E phi1 - w0 x w1)
//! b = E (J Acc + Omega x J Omega)            phi(Omega) = -J^-1 (Omega x J Omega)
//! ```
//!
//! Without the last bracket and with J = I this is the spatial counterpart of the method of Bruls,
//! Cardona & Arnold (2012, doi:10.1016/j.mechmachtheory.2011.07.017), who add spins of the body.
//! The last bracket is of the order of the error of a step: phi is the rate of a spin without a
//! moment (Euler), and with the bracket the sum is the fourth-order integral of a spin (Hermite's
//! quadrature; the commutator of successive rotations after Magnus 1954,
//! doi:10.1002/cpa.3160070404). phi1 is taken at the momentum L0, so that all is explicit in X.
//!
//! With J the inertia, L is the angular momentum: without moments it is constant, and the remaining
//! error is that of the bracket, of order four. Any J keeps order two, but the error grows with the
//! ratio of the principal values of J.

use super::inertia::{Derivatives, Spin};
use crate::rotation::Rotation;
use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};

/// The coefficients of a step of a generalised-alpha method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepCoefficients {
    /// beta
    pub beta: f64,
    /// gamma
    pub gamma: f64,
    /// alpha_m
    pub alpha_m: f64,
    /// alpha_f
    pub alpha_f: f64,
    /// h, the length of the step, a time
    pub length: f64,
}

/// The tensor J that takes a spin to its momentum; material, in global components of the initial
/// placement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carrier {
    /// J, symmetric and positive definite
    pub tensor: Mat3,
    /// J^-1
    pub inverse: Mat3,
}

impl Carrier {
    /// J = I: the momentum is the spin itself.
    pub const SPIN: Self = Self { tensor: Mat3::IDENTITY, inverse: Mat3::IDENTITY };

    /// The rate b of the momentum in the axes of the body: J Acc + Omega x J Omega.
    pub fn rate(&self, omega: Vec3, acceleration: Vec3) -> Vec3 {
        self.tensor * acceleration + omega.cross(self.tensor * omega)
    }
}

/// The rotation of a node and its rates at the start of a time step.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// R0
    pub rotation: Mat3,
    /// Omega0, material
    pub omega: Vec3,
    /// Acc0, material
    pub acceleration: Vec3,
    /// B0, spatial
    pub algorithmic: Vec3,
    /// b at the start of the step before, spatial
    pub earlier: Vec3,
    /// The change of the length of the step
    pub stretch: Stretch,
}

/// The length of a step over that of the step before, where an algorithmic acceleration A0 of the
/// step before begins one of another length.
///
/// A0 belongs to a time that lies (alpha_m - alpha_f) h ahead of the true acceleration a0, so that
/// the smooth part of A0 - a0, (alpha_m - alpha_f)(a0 - a_1) with a_1 at the start of the step
/// before, grows with the step. The rest is an oscillation from step to step that a jump of
/// accelerations leaves: it dies away by |alpha_m/(1 - alpha_m)| a step, and must not grow with
/// steps that grow.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// Length of the step over that of the step before
    ratio: f64,
    /// alpha_m - alpha_f
    lag: f64,
}

impl Stretch {
    /// From a step of the length `before` to one of the length `length`, of a method with the lag
    /// alpha_m - alpha_f.
    pub fn new(length: f64, before: f64, lag: f64) -> Self {
        Self { ratio: length / before, lag }
    }

    /// A0 for the new step from `own`, that of the step before, with a0 (`now`) and a_1 (`earlier`),
    /// which is NaN after a change of chart.
    #[inline]
    pub fn of(self, own: Vec3, now: Vec3, earlier: Vec3) -> Vec3 {
        if self.ratio == 1.0 || earlier.0[0].is_nan() {
            return self.of_smooth(own, now);
        }
        let smooth = (now - earlier) * self.lag;
        now + smooth * self.ratio + (own - now - smooth) * (1.0 / self.ratio).min(1.0)
    }

    /// A0 for the new step where all of A0 - a0 counts as smooth.
    #[inline]
    pub fn of_smooth(self, own: Vec3, now: Vec3) -> Vec3 {
        if self.ratio == 1.0 { own } else { now + (own - now) * self.ratio }
    }
}

/// A change of the [start](Start) of a step.
#[derive(Clone, Copy, Debug)]
pub struct StartChange {
    /// The rotation vector by which R0 turns, material
    pub(crate) turned: Vec3,
    /// The change of Omega0, material
    pub(crate) omega: Vec3,
    /// The change of Acc0, material
    pub(crate) acceleration: Vec3,
    /// The change of B0, spatial
    pub(crate) algorithmic: Vec3,
}

/// The rotation of a node over a time step, as a function of its increment X.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    base: Mat3,
    carrier: Carrier,
    step: StepCoefficients,
    /// Omega0
    omega: Vec3,
    /// L0
    momentum: Vec3,
    /// b0
    rate: Vec3,
    /// B0
    algorithmic: Vec3,
    /// B0 as the step before has left it
    own: Vec3,
    /// b at the start of the step before
    earlier: Vec3,
    /// ((beta h/gamma) I - (h^2/12) w0~)^-1
    gain: Mat3,
}

impl Turn {
    /// The step that begins at `start`.
    pub fn new(step: StepCoefficients, carrier: Carrier, start: &Start) -> Self {
        let omega = start.omega;
        let momentum = carrier.tensor * start.omega;
        let rate = carrier.rate(omega, start.acceleration);
        let [own, earlier] = [start.algorithmic, start.earlier].map(|spatial| start.rotation.transpose_mul(spatial));
        let h = step.length;
        Self {
            base: start.rotation,
            carrier,
            step,
            omega,
            momentum,
            rate,
            algorithmic: start.stretch.of(own, rate, earlier),
            own,
            earlier,
            gain: inverse(step.beta * h / step.gamma, h * h / 12.0, omega),
        }
    }

    /// The step from a start that differs by `by`. `stretch` is [`Start::stretch`] of this step.
    pub fn changed(&self, by: &StartChange, stretch: Stretch) -> Self {
        let Self { base, carrier, step, .. } = *self;
        let own = carrier.inverse * (self.rate - self.omega.cross(self.momentum));
        let start = Start {
            rotation: base * Rotation::new(by.turned).r,
            omega: self.omega + by.omega,
            acceleration: own + by.acceleration,
            algorithmic: base * self.own + by.algorithmic,
            earlier: base * self.earlier,
            stretch,
        };
        Self::new(step, carrier, &start)
    }

    /// b0, spatial.
    pub fn rate(&self) -> Vec3 {
        self.base * self.rate
    }

    /// R0, the rotation at the start of the step.
    pub fn base(&self) -> Mat3 {
        self.base
    }

    /// The predictor of X: the increment of a step over which the rate of the momentum does not
    /// change.
    pub fn guess(&self) -> Vec3 {
        let StepCoefficients { beta, gamma, alpha_m, length: h, .. } = self.step;
        let algorithmic = (self.rate - self.algorithmic * alpha_m) * (1.0 / (1.0 - alpha_m));
        let momentum = self.momentum + (self.algorithmic * (1.0 - gamma) + algorithmic * gamma) * h;
        let turned = Rotation::new(self.omega * h).r;
        let spin = turned * (self.carrier.inverse * turned.transpose_mul(momentum));
        let linear = spin * (beta * h / gamma) - self.omega.cross(spin) * (h * h / 12.0);
        linear + self.constant() + turned * self.carried(turned).0
    }

    /// Omega and Acc (material) after the increment `x`.
    pub fn rates<T: Real>(&self, x: Vec3<T>) -> (Vec3<T>, Vec3<T>) {
        let turned = Rotation::new(x).r;
        let [inertia, inverse] = [self.carrier.tensor, self.carrier.inverse].map(Mat3::constant);
        let known = Vec3::constant(self.constant()) + turned * self.carried(turned).0;
        let omega = turned.transpose_mul(Mat3::constant(self.gain) * (x - known));
        let momentum = inertia * omega;
        let rate = (turned * momentum).scale(self.stiffness()) + Vec3::constant(self.rest());
        (omega, inverse * (turned.transpose_mul(rate) - omega.cross(momentum)))
    }

    /// The rotation after the increment `x`, with its rates `omega` and `acceleration` (material)
    /// and their derivatives over the increment. With X = gain^-1 w1 + constant + E y:
    ///
    /// ```text
    /// dOmega = [Omega~ T + E^T gain (I - E (dy - y~) T)] dX
    /// J dAcc = [(J Acc + Omega x J Omega)~ T - k (J Omega)~ T
    ///           + (k J - Omega~ J + (J Omega)~) dOmega] dX
    /// ```
    pub fn spin(&self, x: Vec3, omega: Vec3, acceleration: Vec3) -> Spin {
        let rotation = Rotation::new(x);
        let e = rotation.r;
        let t = rotation.t;
        let inertia = self.carrier.tensor;
        let k = self.stiffness();
        let momentum = inertia * omega;
        let rate = self.carrier.rate(omega, acceleration);
        let (y, dy) = self.carried(e);
        let advance = Mat3::IDENTITY - e * ((dy - y.skew()) * t);
        let d_omega = Mat3::skew_mul(omega, t) + e.transpose_matmul(self.gain * advance);
        let turning = Mat3::skew_mul(rate - momentum * k, t);
        let gyroscopic = Mat3::skew_mul(omega, inertia) - momentum.skew();
        let d_acceleration = self.carrier.inverse * (turning + (inertia.scale(k) - gyroscopic) * d_omega);
        Spin::direct(rotation.after(self.base), omega, acceleration, Derivatives { d_omega, d_acceleration })
    }

    /// B1, spatial, where the step ends with the increment `x` and the spin `omega`.
    pub fn algorithmic(&self, x: Vec3, omega: Vec3) -> Vec3 {
        let StepCoefficients { gamma, length: h, .. } = self.step;
        let gained = Rotation::new(x).r * (self.carrier.tensor * omega) - self.momentum;
        self.base * (gained * (1.0 / (gamma * h)) - self.algorithmic * ((1.0 - gamma) / gamma))
    }

    /// The part of X that does not depend on the end of the step:
    /// h/2 w0 - h^2 (beta - gamma/2) J^-1 B0 + h^2/12 phi0.
    fn constant(&self) -> Vec3 {
        let StepCoefficients { beta, gamma, length: h, .. } = self.step;
        let inverse = self.carrier.inverse;
        let free = inverse * self.omega.cross(self.momentum);
        self.omega * (0.5 * h) - inverse * self.algorithmic * (h * h * (beta - 0.5 * gamma)) - free * (h * h / 12.0)
    }

    /// The vector y of the part E y of X that the momenta of the start bring, and its derivative dy
    /// over a material rotation of E.
    ///
    /// ```text
    /// y = J^-1 E^T s - h^2/12 phi(z),   z = J^-1 E^T L0
    /// s = -(beta - gamma/2)/gamma [h L0 + h^2 (1-gamma) B0]
    /// ```
    fn carried<T: Real>(&self, turned: Mat3<T>) -> (Vec3<T>, Mat3<T>) {
        let StepCoefficients { beta, gamma, length: h, .. } = self.step;
        let [inertia, inverse] = [self.carrier.tensor, self.carrier.inverse].map(Mat3::constant);
        let s = (self.momentum * h + self.algorithmic * (h * h * (1.0 - gamma))) * (0.5 - beta / gamma);
        let s = turned.transpose_mul(Vec3::constant(s));
        let momentum = turned.transpose_mul(Vec3::constant(self.momentum));
        let z = inverse * momentum;
        let y = inverse * (s + z.cross(momentum).scale(h * h / 12.0));
        let gyroscopic = (Mat3::skew_mul(z, inertia) - momentum.skew()) * inverse;
        let dy = s.skew() + (gyroscopic * momentum.skew()).scale(h * h / 12.0);
        (y, inverse * dy)
    }

    /// The factor k of b1 = k L1 + r, the rate of the momentum at the end of the step; 1/time.
    fn stiffness(&self) -> f64 {
        let StepCoefficients { gamma, alpha_m, alpha_f, length: h, .. } = self.step;
        (1.0 - alpha_m) / ((1.0 - alpha_f) * gamma * h)
    }

    /// The constant r of b1 = k L1 + r, the rate of the momentum at the end of the step.
    fn rest(&self) -> Vec3 {
        let StepCoefficients { gamma, alpha_m, alpha_f, .. } = self.step;
        let lagging = self.algorithmic * (alpha_m - (1.0 - alpha_m) * (1.0 - gamma) / gamma) - self.rate * alpha_f;
        lagging * (1.0 / (1.0 - alpha_f)) - self.momentum * self.stiffness()
    }
}

/// The inverse of a I - b w~.
fn inverse(a: f64, b: f64, w: Vec3) -> Mat3 {
    let whole = Mat3::diagonal([a * a; 3]) + w.skew() * (a * b) + w.outer(w) * (b * b);
    whole * (1.0 / (a * (a * a + b * b * w.squared())))
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: StepCoefficients = StepCoefficients { beta: 0.3, gamma: 0.6, alpha_m: 0.2, alpha_f: 0.4, length: 0.3 };

    /// A step of a body with an inclined inertia tensor that starts in motion.
    fn turn(ratio: f64) -> (Turn, Start) {
        let inertia = Mat3([[2.0, 0.3, -0.1], [0.3, 1.5, 0.2], [-0.1, 0.2, 3.0]]);
        let matrix = nalgebra::Matrix3::from_fn(|i, j| inertia.0[i][j]).try_inverse().unwrap();
        let inverse = Mat3([0, 1, 2].map(|i| [0, 1, 2].map(|j| matrix[(i, j)])));
        let start = Start {
            rotation: Rotation::new(Vec3([0.4, -1.0, 0.7])).r,
            omega: Vec3([1.0, -0.5, 0.8]),
            acceleration: Vec3([0.3, 0.9, -0.4]),
            algorithmic: Vec3([0.5, -0.7, 0.2]),
            earlier: Vec3([0.1, 0.2, -0.4]),
            stretch: Stretch::new(ratio, 1.0, STEP.alpha_m - STEP.alpha_f),
        };
        (Turn::new(STEP, Carrier { tensor: inertia, inverse }, &start), start)
    }

    #[test]
    fn the_rates_solve_the_equations_of_the_step() {
        let (turn, start) = turn(1.0);
        let StepCoefficients { beta, gamma, alpha_m, alpha_f, length: h } = STEP;
        let carrier = turn.carrier;
        let x = Vec3([0.2, -0.3, 0.25]);
        let (omega, acceleration) = turn.rates(x);
        let e = Rotation::new(x).r;
        let b0 = carrier.rate(start.omega, start.acceleration);
        let b1 = e * carrier.rate(omega, acceleration);
        let old = start.rotation.transpose_mul(start.algorithmic);
        let new = start.rotation.transpose_mul(turn.algorithmic(x, omega));
        let momentum = carrier.tensor * start.omega;
        let gained = (old * (1.0 - gamma) + new * gamma) * h;
        assert!((e * (carrier.tensor * omega) - momentum - gained).max_abs() < 1e-13);
        let lag = new * (1.0 - alpha_m) + old * alpha_m - b1 * (1.0 - alpha_f) - b0 * alpha_f;
        assert!(lag.max_abs() < 1e-13, "{lag:?}");
        let phi = |omega: Vec3| -(carrier.inverse * omega.cross(carrier.tensor * omega));
        let w0 = start.omega;
        let w1 = e * omega;
        let z = carrier.inverse * e.transpose_mul(momentum);
        let spun = e * (carrier.inverse * e.transpose_mul(new)) - carrier.inverse * old;
        let bracket = phi(w0) - e * phi(z) - w0.cross(w1);
        let whole = (w0 + w1) * (0.5 * h) + spun * (h * h * (beta - 0.5 * gamma)) + bracket * (h * h / 12.0);
        assert!((x - whole).max_abs() < 1e-14, "{x:?} {whole:?}");
    }

    #[test]
    fn the_lag_stretches_with_the_step() {
        let (same, start) = turn(1.0);
        let (longer, _) = turn(2.0);
        let now = same.carrier.rate(start.omega, start.acceleration);
        // The smooth part grows with the step, the rest becomes smaller.
        let earlier = start.rotation.transpose_mul(start.earlier);
        let smooth = (now - earlier) * (STEP.alpha_m - STEP.alpha_f);
        let expected = smooth * 2.0 + (same.algorithmic - now - smooth) * 0.5;
        assert!((longer.algorithmic - now - expected).max_abs() < 1e-15);
        let unknown = Stretch::new(2.0, 1.0, -0.2).of(Vec3::UNIT[0], Vec3::ZERO, Vec3([f64::NAN; 3]));
        assert_eq!(unknown, Vec3::UNIT[0] * 2.0);
    }

    #[test]
    fn steady_turning_is_guessed_exactly() {
        let spin = Vec3([0.0, 0.0, 3.0]);
        let start = Start {
            rotation: Mat3::IDENTITY,
            omega: spin,
            acceleration: Vec3::ZERO,
            algorithmic: Vec3::ZERO,
            earlier: Vec3::ZERO,
            stretch: Stretch::new(1.0, 1.0, 0.0),
        };
        let turn = Turn::new(STEP, Carrier::SPIN, &start);
        assert!((turn.guess() - spin * STEP.length).max_abs() < 1e-15);
    }

    #[test]
    fn the_inverse_is_one() {
        let a = 0.3;
        let b = 0.2;
        let w = Vec3([1.0, -2.0, 0.5]);
        let product = inverse(a, b, w) * (Mat3::diagonal([a; 3]) - w.skew() * b);
        assert!((product - Mat3::IDENTITY).max_abs() < 1e-15);
    }
}
