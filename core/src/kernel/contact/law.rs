//! The normal force p of a contact from its gap g (negative where bodies penetrate) and the gap's
//! rate.
//!
//! ```text
//! statics    p = max(0, L - K g)                           augmented Lagrangian
//! dynamics   p = K max(0, g0 - g) max(0, 1 - c dg/dt)   penalty with damping
//! ```
//!
//! The force begins at the gap g0, which is zero unless a static stage has left a force. With damping,
//! a body that hits at speed v rebounds at e v, where z = c v and z (1+e) = ln((1+z)/(1-e z)):
//! [`restitution`]. It does not depend on K.

use crate::scalar::Real;

/// The law of a normal force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalLaw {
    /// Augmented Lagrangian: exact once the multiplier has converged
    Augmented {
        /// L, force of the last augmentation
        multiplier: f64,
        /// K, force per length
        stiffness: f64,
        /// The gap up to which a point without a force counts as touching: its tangent is that of a
        /// contact
        touching: f64,
    },
    /// Penalty with damping
    Penalty {
        /// K, force per length
        stiffness: f64,
        /// c, time per length
        damping: f64,
        /// g0, the gap at which the force begins
        offset: f64,
    },
}

/// A normal force with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct NormalForce<T = f64> {
    /// p, not negative
    pub(crate) force: T,
    /// dp/dg
    pub(super) over_gap: T,
    /// dp/d(dg/dt)
    pub(super) over_rate: T,
}

impl<T: Real> NormalForce<T> {
    /// True if neither a force nor a tangent is there.
    pub fn is_open(&self) -> bool {
        self.force.largest() <= 0.0 && self.over_gap.largest() == 0.0
    }

    fn none() -> Self {
        Self { force: T::zero(), over_gap: T::zero(), over_rate: T::zero() }
    }
}

impl NormalLaw {
    /// The force of a gap that changes at `rate`.
    pub fn force<T: Real>(&self, gap: T, rate: T) -> NormalForce<T> {
        match *self {
            Self::Augmented { multiplier, stiffness, touching } => {
                let force = T::constant(multiplier) - gap * stiffness;
                if force.largest() <= -touching * stiffness {
                    return NormalForce::none();
                }
                let force = if force.largest() > 0.0 { force } else { T::zero() };
                NormalForce { force, over_gap: T::constant(-stiffness), over_rate: T::zero() }
            }
            Self::Penalty { stiffness, damping, offset } => {
                let factor = T::one() - rate * damping;
                let depth = T::constant(offset) - gap;
                if depth.largest() <= 0.0 || factor.largest() <= 0.0 {
                    return NormalForce::none();
                }
                NormalForce {
                    force: depth * factor * stiffness,
                    over_gap: -factor * stiffness,
                    over_rate: depth * (-stiffness * damping),
                }
            }
        }
    }

    /// K, force per length.
    pub fn stiffness(&self) -> f64 {
        match *self {
            Self::Augmented { stiffness, .. } | Self::Penalty { stiffness, .. } => stiffness,
        }
    }

    /// The stored energy of a gap: zero for the augmented Lagrangian, whose force is a reaction.
    pub fn energy(&self, gap: f64) -> f64 {
        match *self {
            Self::Augmented { .. } => 0.0,
            Self::Penalty { stiffness, offset, .. } => 0.5 * stiffness * (offset - gap).max(0.0).powi(2),
        }
    }

    /// Energy per time that damping takes, p_el c (dg/dt)^2, where the gap has this force.
    pub fn damping_power(&self, gap: f64, force: f64) -> f64 {
        let Self::Penalty { stiffness, damping, offset } = *self else { return 0.0 };
        let elastic = stiffness * (offset - gap).max(0.0);
        if elastic == 0.0 || damping == 0.0 {
            return 0.0;
        }
        // force = elastic (1 - c rate) where it is positive.
        let rate = (1.0 - force / elastic) / damping;
        (elastic - force) * rate
    }

    /// The gap at which the force begins.
    pub fn offset(&self) -> f64 {
        match *self {
            Self::Augmented { .. } => 0.0,
            Self::Penalty { offset, .. } => offset,
        }
    }
}

/// The damping of a [`NormalLaw::Penalty`], time per length, with which a body that hits at `speed`
/// rebounds at `restitution` times that speed. `None` unless 0 < restitution <= 1 and the speed is
/// positive: no finite damping keeps a body from rebounding.
pub fn damping_of(restitution: f64, speed: f64) -> Option<f64> {
    let possible = restitution > 0.0 && restitution <= 1.0 && speed > 0.0 && speed.is_finite();
    if !possible {
        return None;
    }
    // The left side less the right side is positive below the root z and negative above it, up to
    // 1/e.
    let excess = |z: f64| z * (1.0 + restitution) - libm::log1p(z) + libm::log1p(-restitution * z);
    let [low, _] = around_root(&excess, 1.0 / restitution);
    Some(low / speed)
}

/// The restitution of a [`NormalLaw::Penalty`] with `damping` (time per length) at an approach with
/// `speed`: the inverse of [`damping_of`].
pub fn restitution(damping: f64, speed: f64) -> f64 {
    let z = damping * speed;
    if z <= 0.0 || z.is_nan() {
        return 1.0;
    }
    // z (1+e) - ln(1+z) + ln(1-e z) falls with e, from a positive value at e = 0.
    let excess = |e: f64| z * (1.0 + e) - libm::log1p(z) + libm::log1p(-e * z);
    let [low, high] = around_root(&excess, (1.0 / z).min(1.0));
    0.5 * (low + high)
}

/// Neighbouring numbers from 0 to `high` between which a function changes from positive to negative.
fn around_root(function: &impl Fn(f64) -> f64, high: f64) -> [f64; 2] {
    let mut low = 0.0;
    let mut high = high;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if function(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::super::dual::{Dual, Random};
    use super::*;

    const LAWS: [NormalLaw; 4] = [
        NormalLaw::Augmented { multiplier: 3.0, stiffness: 50.0, touching: 0.0 },
        NormalLaw::Penalty { stiffness: 70.0, damping: 0.0, offset: 0.0 },
        NormalLaw::Penalty { stiffness: 70.0, damping: 1.5, offset: 0.0 },
        NormalLaw::Penalty { stiffness: 70.0, damping: 0.8, offset: 0.03 },
    ];

    #[test]
    fn forces_have_their_derivatives() {
        let mut random = Random(3);
        for law in LAWS {
            for _ in 0..300 {
                let gap = random.between(-0.1, 0.1);
                let rate = random.between(-1.0, 1.0);
                let exact = law.force(Dual::<2>::variable(gap, 0), Dual::variable(rate, 1));
                let here = law.force(gap, rate);
                assert!(here.force >= 0.0);
                let [over_gap, over_rate] = exact.force.partials;
                assert!((here.over_gap - over_gap).abs() < 1e-12, "{law:?} {gap} {rate}");
                assert!((here.over_rate - over_rate).abs() < 1e-12, "{law:?} {gap} {rate}");
            }
        }
    }

    #[test]
    fn the_undamped_force_is_the_slope_of_the_energy() {
        let law = |offset| NormalLaw::Penalty { stiffness: 70.0, damping: 0.0, offset };
        for offset in [0.0, 0.03] {
            for k in -100..100 {
                let gap = f64::from(k) * 1e-3 + 3e-4;
                let h = 1e-6;
                let slope = (law(offset).energy(gap + h) - law(offset).energy(gap - h)) / (2.0 * h);
                assert!((slope + law(offset).force(gap, 0.0).force).abs() < 1e-6, "{offset} {gap}");
            }
        }
    }

    /// The rebound of a unit mass, by the Runge-Kutta method.
    fn rebound(law: NormalLaw, speed: f64) -> f64 {
        let h = 1e-4;
        let rates = |[x, v]: [f64; 2]| [v, law.force(x, v).force];
        let moved = |[x, v]: [f64; 2], [dx, dv]: [f64; 2], by: f64| [x + by * dx, v + by * dv];
        let mut state = [0.0, -speed];
        for _ in 0..1_000_000 {
            let k1 = rates(state);
            let k2 = rates(moved(state, k1, 0.5 * h));
            let k3 = rates(moved(state, k2, 0.5 * h));
            let k4 = rates(moved(state, k3, h));
            for (k, factor) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                state = moved(state, k, factor * h / 6.0);
            }
            if state[0] > 0.0 {
                break;
            }
        }
        state[1] / speed
    }

    #[test]
    fn bodies_rebound_with_the_wanted_restitution() {
        assert!((damping_of(0.5, 1.0).unwrap() - 1.432751).abs() < 1e-6);
        assert!((damping_of(0.8, 1.0).unwrap() - 0.373146).abs() < 1e-6);
        for wanted in [0.05, 0.3, 0.5, 0.8, 0.99] {
            for speed in [0.2, 3.0] {
                let damping = damping_of(wanted, speed).unwrap();
                assert!((restitution(damping, speed) - wanted).abs() < 1e-9, "{wanted} {speed}");
                let law = NormalLaw::Penalty { stiffness: 100.0, damping, offset: 0.0 };
                let found = rebound(law, speed);
                assert!((found - wanted).abs() < 1e-5, "{wanted} {speed} {found}");
            }
        }
        assert!((damping_of(1.0, 2.0).unwrap()).abs() < 1e-7);
        assert_eq!(restitution(0.0, 2.0), 1.0);
        for (restitution, speed) in [(0.0, 1.0), (1.1, 1.0), (0.5, 0.0), (f64::NAN, 1.0), (0.5, f64::INFINITY)] {
            assert_eq!(damping_of(restitution, speed), None);
        }
    }
}
