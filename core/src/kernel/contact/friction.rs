//! Coulomb friction with elastic stick: the traction t on the first party of a contact by return
//! mapping, in the axes of the carrier.
//!
//! A contact has at the last converged state the traction t0 and the normal n0. The smallest
//! rotation n0 -> n carries t0, and keeps |t0|. With a, the sliding since then, and K_t, the
//! stiffness of stick:
//!
//! ```text
//! u  = a - n (n.a)
//! t* = t0 - l (n0+n) - K_t u,   l = (n-n0).t0 s,  s = 1/(1 + n0.n)
//! t  = t* if |t*| <= mu p, otherwise mu p t*/|t*|
//! ```
//!
//! and, with e = t*/|t*|,
//!
//! ```text
//! dt* = -(n0+n) (t0 s - l s n0).dn - l dn - K_t du
//! du  = da - n (n.da) - dn (n.a) - n (a.dn)
//! stick dt = dt*;   slip dt = mu e dp + (mu p/|t*|) (dt* - e (e.dt*))
//! ```
//!
//! The tangent of slip is not symmetric. In the middle of a hole that a contact fills n is the mean of the normals all
//! round, and shorter than one: t may have a part along it there.

use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};
use serde::{Deserialize, Serialize};

/// Normals that turn by more than 120 degrees between converged states: 1 + n0.n is below this.
const MIN_NORMAL_COSINE: f64 = 0.5;

/// A normal whose square is below this is the mean of those all round a hole.
const UNIT: f64 = 1.0 - 1e-9;

/// A traction of at least this part of its limit is at the limit, but for round-off.
const AT_LIMIT: f64 = 1.0 - 1e-9;

/// Coulomb's law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionLaw {
    /// mu
    pub(crate) coefficient: f64,
    /// K_t, the stiffness of stick, force per length
    pub(crate) stiffness: f64,
    /// A stiffness against sliding in the tangent alone, force per length; zero for the true tangent
    pub(crate) resistance: f64,
    /// True if a contact that slid, with its force at the limit, goes on sliding in the first tangent of
    /// a step. Otherwise all points would stick there, and a rope that is pulled over a drum would be
    /// torn apart by each first correction.
    pub(crate) goes_on: bool,
    /// True if the traction of a contact that stuck has no limit: before the first correction of a
    /// level a surface may have moved far, and what sticks to it has yet to follow. The tangent of
    /// sliding has no stiffness that would take it along.
    pub(crate) holds_on: bool,
}

/// The traction of a contact at the last converged state. A contact that was open has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct CarriedTraction {
    /// t0, force on the first party, in the axes of the carrier at that state
    pub(crate) force: Vec3,
    /// n0, the normal to which it was tangential
    pub(crate) normal: Vec3,
    /// True if it was at its limit
    pub(crate) slides: bool,
}

impl CarriedTraction {
    /// The traction carried by the smallest rotation n0 -> n; zero if the contact was open.
    pub fn carried_to(&self, n: Vec3) -> Vec3 {
        if self.force == Vec3::ZERO {
            return Vec3::ZERO;
        }
        Turn::new(self.normal, n).of(self.force).value
    }

    /// The normal about which a contact has rolled to the normal n since then: the mean along the arc between them, so
    /// that a roll of any size on a round surface slides nowhere; n where the contact was open, or where the normals
    /// are more than a right angle apart.
    ///
    /// With b the angle between them it is (n0 + n) tan(b/2)/b, a function of s = tan^2(b/2) = (1 - n0.n)/(1 + n0.n):
    /// of the continued fraction of atan four terms are taken, which err by 1e-3 at a right angle, 1e-5 at half of it.
    /// In the middle of a hole it is the mean of both.
    pub fn rolling_normal<T: Real>(&self, n: Vec3<T>) -> RollingNormal<T> {
        let n0 = Vec3::constant(self.normal);
        let cosine = n0.dot(n);
        let number = T::constant;
        if self.normal != Vec3::ZERO && (self.normal.squared() < UNIT || n.squared().largest() < UNIT) {
            return RollingNormal { value: (n0 + n) * number(0.5), over_normal: Mat3::diagonal([number(0.5); 3]) };
        }
        if cosine.largest() <= 0.0 {
            return RollingNormal { value: n, over_normal: Mat3::identity() };
        }
        let one = T::one();
        let inverse = one / (one + cosine);
        let s = (one - cosine) * inverse;
        let inner = one / (number(5.0) + s * number(9.0 / 7.0));
        let outer = one / (number(3.0) + s * inner * number(4.0));
        let factor = (one + s * outer) * number(0.5);
        // d(1/outer)/ds, and with it d factor/d(n0.n)
        let bend = inner * number(4.0) - s * inner * inner * number(36.0 / 7.0);
        let over_cosine = -(outer - s * outer * outer * bend) * inverse * inverse;
        let sum = n0 + n;
        RollingNormal { value: sum * factor, over_normal: Mat3::identity() * factor + sum.outer(n0 * over_cosine) }
    }

    /// It in other axes.
    pub fn turned(&self, rotation: &Mat3) -> Self {
        let [force, normal] = [self.force, self.normal].map(|vector| *rotation * vector);
        Self { force, normal, ..*self }
    }

    /// Two tractions in one contact: the second one is turned to the normal of the first, and lost where
    /// the normals are opposite.
    pub fn with(self, other: Self) -> Self {
        if self.force == Vec3::ZERO {
            return other;
        }
        if self.normal.dot(other.normal) <= 0.0 {
            return self;
        }
        Self { force: self.force + other.carried_to(self.normal), slides: self.slides && other.slides, ..self }
    }
}

/// The normal about which a contact rolls over a step.
#[derive(Clone, Copy, Debug)]
pub struct RollingNormal<T> {
    pub(crate) value: Vec3<T>,
    /// Its derivative over the normal at the end of the step
    pub(crate) over_normal: Mat3<T>,
}

/// The smallest rotation n0 -> n, of vectors normal to n0.
#[derive(Clone, Copy)]
struct Turn<T> {
    n0: Vec3<T>,
    n: Vec3<T>,
    /// 1 + n0.n
    cosine: T,
}

/// A turned vector with its derivative over n.
#[derive(Clone, Copy)]
struct TurnedVector<T> {
    value: Vec3<T>,
    over_normal: Mat3<T>,
}

impl<T: Real> Turn<T> {
    fn new(n0: Vec3, n: Vec3<T>) -> Self {
        let n0 = Vec3::constant(n0);
        Self { n0, n, cosine: T::one() + n0.dot(n) }
    }

    fn of(&self, vector: Vec3) -> TurnedVector<T> {
        let Self { n0, n, cosine } = *self;
        let vector = Vec3::constant(vector);
        let s = T::one() / cosine;
        let lift = (n - n0).dot(vector) * s;
        let by_normal = (n0 + n).outer(vector * s - n0 * (lift * s)) + Mat3::identity() * lift;
        TurnedVector { value: vector - (n0 + n) * lift, over_normal: -by_normal }
    }
}

/// The state of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// No force
    Open,
    /// A normal force alone
    Frictionless,
    /// Friction below its limit
    Sticks,
    /// Friction at its limit
    Slides,
}

/// A traction with its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Traction<T = f64> {
    /// t, force on the first party
    pub(crate) force: Vec3<T>,
    /// Stick or slip
    pub(crate) status: Status,
    /// u, the tangential sliding since the last converged state; in the middle of a hole a, all of it
    pub(crate) sliding: Vec3<T>,
    /// True if the normal has turned by more than 120 degrees: the step is too large
    pub(crate) turned_over: bool,
    /// dt/da
    pub(super) over_sliding: Mat3<T>,
    /// dt/dn
    pub(super) over_normal: Mat3<T>,
    /// dt/dp
    pub(super) over_pressure: Vec3<T>,
}

impl<T: Real> Traction<T> {
    /// No traction.
    pub fn none() -> Self {
        let o = Vec3::zero();
        Self {
            force: o,
            status: Status::Frictionless,
            sliding: o,
            turned_over: false,
            over_sliding: Mat3::zero(),
            over_normal: Mat3::zero(),
            over_pressure: o,
        }
    }
}

impl Traction {
    /// The work of friction since the last converged state: that of the mean of both tractions over
    /// the sliding; negative where friction takes energy.
    pub fn work(&self, carried: &CarriedTraction, n: Vec3) -> f64 {
        (self.force + carried.carried_to(n)).dot(self.sliding) * 0.5
    }
}

impl FrictionLaw {
    /// The largest traction of a contact with the force `p`.
    pub fn limit<T: Real>(&self, p: T) -> T {
        p * self.coefficient
    }

    /// The traction of a contact with the normal `n`, the force `p` and the sliding `a`.
    pub fn traction<T: Real>(&self, carried: &CarriedTraction, n: Vec3<T>, p: T, a: Vec3<T>) -> Traction<T> {
        let trial = self.trial(carried, n, a);
        let limit = self.limit(p);
        let size = trial.force.norm();
        let is_tied = size.largest() > 0.0 && size.largest() >= AT_LIMIT * limit.largest();
        let goes_on = self.goes_on && carried.slides && is_tied;
        let holds_on = self.holds_on && !carried.slides && carried.normal != Vec3::ZERO;
        if holds_on || (size.largest() <= limit.largest() && !goes_on) {
            return Traction { status: Status::Sticks, ..trial };
        }
        let inverse = T::one() / size;
        let e = trial.force * inverse;
        let across = (Mat3::identity() - e.outer(e)) * (limit * inverse);
        let resistance = (n.outer(n) - Mat3::identity()).scale(self.resistance);
        Traction {
            force: e * limit,
            status: Status::Slides,
            over_sliding: across * trial.over_sliding + resistance,
            over_normal: across * trial.over_normal,
            over_pressure: across * trial.over_pressure + e.scale(self.coefficient),
            ..trial
        }
    }

    /// The traction t* without a limit.
    fn trial<T: Real>(&self, carried: &CarriedTraction, n: Vec3<T>, a: Vec3<T>) -> Traction<T> {
        let along = n.dot(a);
        let sliding = a - n * along;
        let stiffness = self.stiffness;
        let is_unit = n.squared().largest() >= UNIT;
        let mut trial = Traction {
            force: -sliding.scale(stiffness),
            sliding: if is_unit { sliding } else { a },
            over_sliding: (n.outer(n) - Mat3::identity()).scale(stiffness),
            over_normal: (Mat3::diagonal([along; 3]) + n.outer(a)).scale(stiffness),
            ..Traction::none()
        };
        if carried.force == Vec3::ZERO {
            return trial;
        }
        let turn = Turn::new(carried.normal, n);
        trial.turned_over = turn.cosine.largest() < MIN_NORMAL_COSINE;
        let before = turn.of(carried.force);
        trial.force += before.value;
        trial.over_normal += before.over_normal;
        trial
    }
}

#[cfg(test)]
mod tests {
    use super::super::dual::{Dual, Random, jacobian, variables};
    use super::*;

    impl FrictionLaw {
        /// A law with the true tangent.
        pub fn plain(coefficient: f64, stiffness: f64) -> Self {
            Self { coefficient, stiffness, resistance: 0.0, goes_on: false, holds_on: false }
        }

        /// The work of the present traction over the sliding, less the growth of the energy of elastic
        /// stick. It is not negative; in stick it is |t - t0|^2/(2 K_t).
        pub fn dissipation(&self, carried: &CarriedTraction, traction: &Traction) -> f64 {
            let stored = |traction: Vec3| traction.squared() / (2.0 * self.stiffness);
            -traction.force.dot(traction.sliding) - stored(traction.force) + stored(carried.force)
        }
    }

    fn random_law(random: &mut Random) -> FrictionLaw {
        FrictionLaw::plain(random.between(0.1, 0.8), random.between(0.5, 5.0))
    }

    fn random_traction(random: &mut Random) -> CarriedTraction {
        let normal = random.direction();
        let free = random.vector(1.0);
        CarriedTraction { force: free - normal * normal.dot(free), normal, ..CarriedTraction::default() }
    }

    #[test]
    fn tractions_have_their_derivatives() {
        let mut random = Random(5);
        let mut counts = [0; 2];
        let mut worst = 0.0f64;
        for _ in 0..600 {
            let law = random_law(&mut random);
            let carried = random_traction(&mut random);
            let n = (carried.normal + random.vector(0.4)).normalized().unwrap();
            let a = random.vector(0.5);
            let p = random.between(0.1, 4.0);
            type D = Dual<7>;
            let exact = law.traction(&carried, variables::<7>(n, 0), D::variable(p, 6), variables(a, 3));
            let here = law.traction(&carried, n, p, a);
            counts[usize::from(here.status == Status::Slides)] += 1;
            let pressure = Vec3(exact.force.0.map(|c| c.partials[6]));
            for error in [
                (jacobian(exact.force, 0) - here.over_normal).max_abs(),
                (jacobian(exact.force, 3) - here.over_sliding).max_abs(),
                (pressure - here.over_pressure).max_abs(),
                here.force.dot(n).abs(),
            ] {
                worst = worst.max(error);
            }
        }
        println!("tractions: {worst:e}, stick and slip {counts:?}");
        assert!(worst < 1e-13 && counts.iter().all(|&count| count > 100), "{worst:e} {counts:?}");
    }

    #[test]
    fn friction_never_gives_energy() {
        let mut random = Random(6);
        let mut least = f64::INFINITY;
        for _ in 0..10_000 {
            let law = random_law(&mut random);
            let carried = random_traction(&mut random);
            let n = (carried.normal + random.vector(0.5)).normalized().unwrap();
            let traction = law.traction(&carried, n, random.between(0.1, 4.0), random.vector(0.5));
            least = least.min(law.dissipation(&carried, &traction));
        }
        println!("least dissipation {least:e}");
        assert!(least > 0.0);
    }

    /// A contact is dragged to and fro while its normal force changes and its spring becomes stiffer: what it has
    /// given back is never more than what it has taken.
    #[test]
    fn springs_give_back_no_more_than_they_took() {
        let mut random = Random(9);
        let n = Vec3::UNIT[2];
        let mut least = f64::INFINITY;
        for _ in 0..500 {
            let mut law = random_law(&mut random);
            let mut carried = CarriedTraction { normal: n, ..CarriedTraction::default() };
            let mut taken = 0.0;
            for _ in 0..60 {
                law.stiffness *= if random.between(0.0, 1.0) < 0.1 { random.between(1.0, 10.0) } else { 1.0 };
                let way = random.vector(0.3);
                let found = law.traction(&carried, n, random.between(0.1, 30.0), way - n * n.dot(way));
                // The force at the end of a step stands for all of it.
                taken -= found.force.dot(found.sliding);
                carried = CarriedTraction { force: found.force, ..carried };
                least = least.min(taken - carried.force.squared() / (2.0 * law.stiffness));
            }
        }
        println!("least taken beyond what is stored: {least:e}");
        assert!(least > -1e-12, "{least}");
    }

    /// A resistance is in the tangent of what slides, and in no force.
    #[test]
    fn a_resistance_changes_no_force() {
        let mut random = Random(10);
        let mut slid = 0;
        for _ in 0..300 {
            let law = random_law(&mut random);
            let carried = random_traction(&mut random);
            let n = (carried.normal + random.vector(0.4)).normalized().unwrap();
            let p = random.between(0.1, 2.0);
            let sliding = random.vector(0.5);
            let free = law.traction(&carried, n, p, sliding);
            let held = FrictionLaw { resistance: 2.0, ..law }.traction(&carried, n, p, sliding);
            assert_eq!((held.force, held.status), (free.force, free.status));
            let more = held.over_sliding - free.over_sliding;
            let slides = free.status == Status::Slides;
            let expected = if slides { (n.outer(n) - Mat3::identity()).scale(2.0) } else { Mat3::zero() };
            assert!((more - expected).max_abs() < 1e-13);
            slid += usize::from(slides);
        }
        assert!(slid > 50, "{slid}");
    }

    #[test]
    fn carried_tractions_keep_their_size() {
        let mut random = Random(8);
        for _ in 0..300 {
            let carried = random_traction(&mut random);
            let n = (carried.normal + random.vector(0.5)).normalized().unwrap();
            let law = FrictionLaw::plain(1.0, 1.0);
            let traction = law.traction(&carried, n, 1e3, Vec3::ZERO);
            assert_eq!(traction.status, Status::Sticks);
            assert!((traction.force.norm() - carried.force.norm()).abs() < 1e-15);
        }
    }
}
