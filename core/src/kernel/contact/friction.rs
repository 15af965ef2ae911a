//! Coulomb friction with elastic stick: the traction t on the first party of a contact by return
//! mapping, in the axes of the carrier.
//!
//! A contact has at the last converged state the traction t0 and the normal n0. The smallest
//! rotation n0 -> n carries t0, and keeps |t0|. With a, the sliding since then, and K_t, the
//! stiffness of stick:
//!
//! ```text
//! u  = a - n (n.a)
//! t* = t0 - (n.t0) s (n0+n) - K_t u,   s = 1/(1 + n0.n)
//! t  = t* if |t*| <= mu p, otherwise mu p t*/|t*|
//! ```
//!
//! and, with e = t*/|t*|,
//!
//! ```text
//! dt* = -(n0+n) (t0 s - (n.t0) s^2 n0).dn - (n.t0) s dn - K_t du
//! du  = da - n (n.da) - dn (n.a) - n (a.dn)
//! stick dt = dt*;   slip dt = mu e dp + (mu p/|t*|) (dt* - e (e.dt*))
//! ```
//!
//! The tangent of slip is not symmetric.
//!
//! A contact that slid goes on at its limit while p rises: its spring, which would have to be drawn
//! further first, is stiffer on the way onward. With the direction e0 of its traction, carried to e1
//! as t0 is, and the way onward f = -u.e1 > 0,
//!
//! ```text
//! t* = (as above) + e1 (mu p - |t0|) min(1, f/d),   d = c mu p/K_t,   where mu p > |t0|
//! ```
//!
//! and d is a small part c of the way on which stick alone would reach the limit. So that its spring
//! gives back no more energy than it has taken, it is stiffer from then on: K_t is h times that of the
//! law, with |t|^2/(2 h K_t) the energy before and the work on the way d.

use crate::scalar::Real;
use crate::tensor::{Mat3, Vec3};
use serde::{Deserialize, Serialize};

/// Normals that turn by more than 120 degrees between converged states: 1 + n0.n is below this.
const MIN_NORMAL_COSINE: f64 = 0.5;

/// A traction of at least this part of its limit is at the limit, but for round-off.
const AT_LIMIT: f64 = 1.0 - 1e-9;

/// c: the way on which a contact that slid is again at its limit, over that of one that stuck.
const ONWARD: f64 = 1e-2;

/// Coulomb's law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionLaw {
    /// mu
    pub(crate) coefficient: f64,
    /// K_t, the stiffness of stick, force per length
    pub(crate) stiffness: f64,
}

/// The traction of a contact at the last converged state. A contact that was open has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct CarriedTraction {
    /// t0, force on the first party, in the axes of the carrier at that state
    pub(crate) force: Vec3,
    /// n0, the normal to which it was tangential
    pub(crate) normal: Vec3,
    /// h, the factor on K_t; 1 where it is less
    pub(crate) hardening: f64,
    /// True if it was at its limit
    pub(crate) slides: bool,
    /// e0, the direction of the traction of a contact that slid and has gone on that way, tangential to
    /// n0; zero otherwise
    pub(crate) onward: Vec3,
    /// True if a contact that slid, with its force at the limit, goes on sliding in the first tangent
    /// of a step. Otherwise all points would stick there, and a rope that is pulled over a drum would
    /// be torn apart by each first correction.
    pub(crate) goes_on: bool,
}

impl CarriedTraction {
    /// The traction carried by the smallest rotation n0 -> n; zero if the contact was open.
    pub fn carried_to(&self, n: Vec3) -> Vec3 {
        if self.force == Vec3::ZERO {
            return Vec3::ZERO;
        }
        Turn::new(self.normal, n).of(self.force).value
    }

    /// It in other axes.
    pub fn turned(&self, rotation: &Mat3) -> Self {
        let [force, normal, onward] = [self.force, self.normal, self.onward].map(|vector| *rotation * vector);
        Self { force, normal, onward, ..*self }
    }

    /// True if it slid, and goes on if it is moved that way.
    pub fn goes_onward(&self) -> bool {
        self.onward != Vec3::ZERO
    }

    /// h
    pub fn factor(&self) -> f64 {
        self.hardening.max(1.0)
    }

    /// Two tractions in one contact, with the energy of both: the second one is turned to the normal of
    /// the first, and lost where the normals are opposite.
    pub fn with(self, other: Self) -> Self {
        if self.force == Vec3::ZERO {
            return other;
        }
        if self.normal.dot(other.normal) <= 0.0 {
            return self;
        }
        let force = self.force + other.carried_to(self.normal);
        let energy = self.force.squared() / self.factor() + other.force.squared() / other.factor();
        let hardening = (force.squared() / energy).clamp(1.0, 1.0 / ONWARD);
        let larger = if other.force.squared() > self.force.squared() { &other } else { &self };
        let goes_onward = larger.goes_onward();
        let onward = force.normalized().filter(|_| goes_onward).unwrap_or(Vec3::ZERO);
        Self { force, hardening, slides: self.slides && other.slides, onward, ..self }
    }
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
        let lift = n.dot(vector) * s;
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
    pub(super) status: Status,
    /// u, the tangential sliding since the last converged state
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
    /// The traction of a contact with the normal `n`, the force `p` and the sliding `a`.
    pub fn traction<T: Real>(&self, carried: &CarriedTraction, n: Vec3<T>, p: T, a: Vec3<T>) -> Traction<T> {
        let trial = self.trial(carried, n, p, a);
        let limit = p * self.coefficient;
        let size = trial.force.norm();
        let is_tied = size.largest() > 0.0 && size.largest() >= AT_LIMIT * limit.largest();
        let goes_on = carried.goes_on && carried.goes_onward() && is_tied;
        if size.largest() <= limit.largest() && !goes_on {
            return Traction { status: Status::Sticks, ..trial };
        }
        let inverse = T::one() / size;
        let e = trial.force * inverse;
        let across = (Mat3::identity() - e.outer(e)) * (limit * inverse);
        Traction {
            force: e * limit,
            status: Status::Slides,
            over_sliding: across * trial.over_sliding,
            over_normal: across * trial.over_normal,
            over_pressure: across * trial.over_pressure + e.scale(self.coefficient),
            ..trial
        }
    }

    /// The traction to carry from an accepted state, in its axes: `found` with the normal `n` and the
    /// force `p` after `carried`.
    pub fn to_carry(&self, carried: &CarriedTraction, found: &Traction, n: Vec3, p: f64) -> CarriedTraction {
        let slides = found.status == Status::Slides;
        let way = if carried.goes_onward() && 1.0 + carried.normal.dot(n) >= MIN_NORMAL_COSINE {
            -Turn::new(carried.normal, n).of(carried.onward).value.dot(found.sliding)
        } else {
            0.0
        };
        let force = found.force;
        let mut hardening = carried.factor();
        if way > 0.0 {
            let [before, after] = [carried.force.norm(), force.norm()];
            let driven = way.min(ONWARD * self.coefficient * p / self.stiffness);
            let energy = before * before / (2.0 * hardening) + 0.5 * (before + after) * driven * self.stiffness;
            hardening = (after * after / (2.0 * energy)).clamp(1.0, 1.0 / ONWARD);
        }
        let goes_onward = slides || way > 0.0;
        let onward = force.normalized().filter(|_| goes_onward).unwrap_or(Vec3::ZERO);
        CarriedTraction { force, normal: n, hardening, slides, onward, goes_on: false }
    }

    /// The traction t* without a limit.
    fn trial<T: Real>(&self, carried: &CarriedTraction, n: Vec3<T>, p: T, a: Vec3<T>) -> Traction<T> {
        let along = n.dot(a);
        let sliding = a - n * along;
        let stiffness = self.stiffness * carried.factor();
        let mut trial = Traction {
            force: -sliding.scale(stiffness),
            sliding,
            over_sliding: (n.outer(n) - Mat3::identity()).scale(stiffness),
            over_normal: (Mat3::diagonal([along; 3]) + n.outer(a)).scale(stiffness),
            ..Traction::none()
        };
        let turn = Turn::new(carried.normal, n);
        let is_opposite = turn.cosine.largest() < MIN_NORMAL_COSINE;
        // A contact that begins beside another one on the opposite side has nothing of it.
        if carried.force == Vec3::ZERO && (is_opposite || !carried.goes_onward()) {
            return trial;
        }
        trial.turned_over = is_opposite;
        let before = turn.of(carried.force);
        trial.force += before.value;
        trial.over_normal += before.over_normal;
        if carried.goes_onward() {
            self.add_onward(turn.of(carried.onward), carried.force.norm(), p, [n, a], &mut trial);
        }
        trial
    }

    /// Adds e1 (mu p - |t0|) min(1, f/d) to a traction. `before`: |t0|.
    fn add_onward<T: Real>(
        &self,
        e1: TurnedVector<T>,
        before: f64,
        p: T,
        [n, a]: [Vec3<T>; 2],
        trial: &mut Traction<T>,
    ) {
        let direction = e1.value;
        let limit = p * self.coefficient;
        let way = -direction.dot(trial.sliding);
        if limit.largest() <= before || way.largest() <= 0.0 {
            return;
        }
        let missing = limit - T::constant(before);
        // (mu p - |t0|)/d
        let stiffness = missing / limit * (self.stiffness / ONWARD);
        let by_way = way * stiffness;
        let added = if missing.largest() <= by_way.largest() {
            trial.over_pressure += direction.scale(self.coefficient);
            missing
        } else {
            // df = -e1.du - u.de1
            let over_sliding = -(direction - n * n.dot(direction));
            let over_normal = direction * n.dot(a) + a * n.dot(direction) - e1.over_normal.transpose_mul(trial.sliding);
            trial.over_sliding += direction.outer(over_sliding * stiffness);
            trial.over_normal += direction.outer(over_normal * stiffness);
            trial.over_pressure += direction * (way * (self.stiffness / ONWARD * before) / (limit * p));
            by_way
        };
        trial.force += direction * added;
        trial.over_normal += e1.over_normal * added;
    }
}

#[cfg(test)]
mod tests {
    use super::super::dual::{Dual, Random, jacobian, variables};
    use super::*;

    impl FrictionLaw {
        /// The work of the present traction over the sliding, less the growth of the energy of elastic
        /// stick. It is not negative; in stick it is |t - t0|^2/(2 K_t).
        pub fn dissipation(&self, carried: &CarriedTraction, traction: &Traction) -> f64 {
            let stored = |traction: Vec3| traction.squared() / (2.0 * self.stiffness);
            -traction.force.dot(traction.sliding) - stored(traction.force) + stored(carried.force)
        }
    }

    #[test]
    fn tractions_have_their_derivatives() {
        let mut random = Random(5);
        let mut counts = [0; 2];
        let mut worst = 0.0f64;
        for k in 0..1200 {
            let law = FrictionLaw { coefficient: random.between(0.1, 0.8), stiffness: random.between(0.5, 5.0) };
            let n0 = random.direction();
            let free = random.vector(1.0);
            let force = free - n0 * n0.dot(free);
            let onward = if k % 2 == 0 { Vec3::ZERO } else { force.normalized().unwrap() };
            let hardening = random.between(0.5, 3.0);
            let carried = CarriedTraction { force, normal: n0, hardening, onward, ..CarriedTraction::default() };
            let n = (n0 + random.vector(0.4)).normalized().unwrap();
            // Some ways onward are so short that the stiffer spring is not yet at the limit.
            let a = random.vector(if k % 4 == 1 { 5e-3 } else { 0.5 });
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
            let law = FrictionLaw { coefficient: random.between(0.1, 0.8), stiffness: random.between(0.5, 5.0) };
            let n0 = random.direction();
            let free = random.vector(1.0);
            let carried = CarriedTraction { force: free - n0 * n0.dot(free), normal: n0, ..CarriedTraction::default() };
            let n = (n0 + random.vector(0.5)).normalized().unwrap();
            let traction = law.traction(&carried, n, random.between(0.1, 4.0), random.vector(0.5));
            least = least.min(law.dissipation(&carried, &traction));
        }
        println!("least dissipation {least:e}");
        assert!(least > 0.0);
    }

    /// A contact is dragged to and fro while its normal force changes: what it has given back is never more than what
    /// it has taken, whatever the steps.
    #[test]
    fn springs_give_back_no_more_than_they_took() {
        let mut random = Random(9);
        let n = Vec3::UNIT[2];
        let mut least = f64::INFINITY;
        for _ in 0..500 {
            let law = FrictionLaw { coefficient: 0.3, stiffness: 10.0 };
            let mut carried = CarriedTraction { normal: n, ..CarriedTraction::default() };
            let mut taken = 0.0;
            let mut scale = 0.0f64;
            let step = random.between(1e-4, 0.3);
            let mut way = Vec3::UNIT[0];
            for _ in 0..60 {
                if random.between(0.0, 1.0) < 0.1 {
                    way = random.direction();
                    way = way - n * n.dot(way);
                }
                let p = random.between(0.1, 30.0);
                let found = law.traction(&carried, n, p, way * random.between(0.0, step));
                // The force at the end of a step stands for all of it.
                taken -= found.force.dot(found.sliding);
                scale = scale.max(found.force.norm() * found.sliding.norm());
                carried = law.to_carry(&carried, &found, n, p);
                let stored = carried.force.squared() / (2.0 * law.stiffness * carried.factor());
                least = least.min((taken - stored) / scale.max(stored));
            }
        }
        println!("least taken beyond what is stored, relative: {least:e}");
        assert!(least > -0.02, "{least}");
    }

    #[test]
    fn carried_tractions_keep_their_size() {
        let mut random = Random(8);
        for _ in 0..300 {
            let n0 = random.direction();
            let free = random.vector(1.0);
            let carried = CarriedTraction { force: free - n0 * n0.dot(free), normal: n0, ..CarriedTraction::default() };
            let n = (n0 + random.vector(0.5)).normalized().unwrap();
            let law = FrictionLaw { coefficient: 1.0, stiffness: 1.0 };
            let traction = law.traction(&carried, n, 1e3, Vec3::ZERO);
            assert_eq!(traction.status, Status::Sticks);
            assert!((traction.force.norm() - carried.force.norm()).abs() < 1e-15);
        }
    }
}
