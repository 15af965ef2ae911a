//! Lanes: several elements side by side, one number of each in every operation.
//!
//! No operation mixes lanes, so that the results of an element do not depend on the elements beside
//! it. Operations and their order are equal on every instruction set.

use super::Real;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};
use std::sync::OnceLock;

/// The number of elements side by side: the numbers in an AVX2 register.
pub const LANES: usize = 4;

/// Lanes: a number of each of several elements.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Lanes(pub [f64; LANES]);

/// The array of f(k) for each lane k, written out: no closure that the compiler may leave outside
/// of a kernel, no bounds checks.
macro_rules! each_lane {
    (|$k:ident| $f:expr) => {
        [
            {
                let $k = 0;
                $f
            },
            {
                let $k = 1;
                $f
            },
            {
                let $k = 2;
                $f
            },
            {
                let $k = 3;
                $f
            },
        ]
    };
}
pub(crate) use each_lane;

/// Packs a field of several elements into lanes.
macro_rules! pack {
    ($of:ident.$($field:tt)+) => {
        $crate::scalar::Pack::pack($crate::scalar::each_lane!(|k| &$of[k].$($field)+))
    };
}
pub(crate) use pack;

impl Add for Lanes {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Lanes(each_lane!(|k| self.0[k] + other.0[k]))
    }
}

impl Sub for Lanes {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Lanes(each_lane!(|k| self.0[k] - other.0[k]))
    }
}

impl Mul for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Lanes(each_lane!(|k| self.0[k] * other.0[k]))
    }
}

impl Div for Lanes {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Lanes(each_lane!(|k| self.0[k] / other.0[k]))
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Lanes(each_lane!(|k| -self.0[k]))
    }
}

impl Mul<f64> for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Lanes(each_lane!(|k| self.0[k] * factor))
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Lanes {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Real for Lanes {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Lanes(each_lane!(|k| self.0[k].sqrt()))
    }

    fn atan2(self, x: Self) -> Self {
        Self(each_lane!(|k| libm::atan2(self.0[k], x.0[k])))
    }

    #[inline(always)]
    fn largest(self) -> f64 {
        self.0[0].max(self.0[1]).max(self.0[2].max(self.0[3]))
    }

    #[inline(always)]
    fn above(self, limit: f64, then: Self, otherwise: Self) -> Self {
        Lanes(each_lane!(|k| if self.0[k] > limit { then.0[k] } else { otherwise.0[k] }))
    }
}

/// Data of elements that can be packed into lanes.
pub trait Pack: Sized {
    /// The data of several elements, with lanes for numbers
    type Packed: Copy;

    /// Packs the data of several elements, lane by lane.
    fn pack(of: [&Self; LANES]) -> Self::Packed;
}

impl Pack for f64 {
    type Packed = Lanes;

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Lanes {
        Lanes(each_lane!(|k| *of[k]))
    }
}

impl<A: Pack, const N: usize> Pack for [A; N] {
    type Packed = [A::Packed; N];

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Self::Packed {
        let mut out = [A::pack(each_lane!(|k| &of[k][0])); N];
        for i in 1..N {
            out[i] = A::pack(each_lane!(|k| &of[k][i]));
        }
        out
    }
}

impl<A: Pack, B: Pack> Pack for (A, B) {
    type Packed = (A::Packed, B::Packed);

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Self::Packed {
        (pack!(of.0), pack!(of.1))
    }
}

/// `None` if all lanes are; otherwise an absent value counts as the default, zero.
impl<A: Pack + Default> Pack for Option<A> {
    type Packed = Option<A::Packed>;

    #[inline(always)]
    fn pack(of: [&Self; LANES]) -> Self::Packed {
        if of.iter().all(|one| one.is_none()) {
            return None;
        }
        let nothing = A::default();
        Some(A::pack(each_lane!(|k| of[k].as_ref().unwrap_or(&nothing))))
    }
}

/// The instruction set that lanes run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instructions {
    /// The instruction set that every machine of this architecture has
    Baseline,
    /// AVX2 on x86-64: 256-bit registers
    Avx2,
}

impl Instructions {
    /// The widest instruction set of this machine, or the baseline if the environment variable
    /// `BEAMSIM_INSTRUCTIONS` is `baseline`. Results do not depend on it.
    pub fn here() -> Self {
        static HERE: OnceLock<Instructions> = OnceLock::new();
        *HERE.get_or_init(|| match std::env::var("BEAMSIM_INSTRUCTIONS") {
            Ok(wanted) if wanted == "baseline" => Self::Baseline,
            _ => Self::widest(),
        })
    }
}

#[cfg(target_arch = "x86_64")]
impl Instructions {
    fn widest() -> Self {
        if pulp::x86::V3::is_available() { Self::Avx2 } else { Self::Baseline }
    }

    /// Runs `work`, compiled for this instruction set together with everything in it that is
    /// `#[inline(always)]`.
    #[inline(always)]
    pub fn run<R>(self, work: impl FnOnce() -> R) -> R {
        match pulp::x86::V3::try_new() {
            Some(wide) if self == Self::Avx2 => wide.vectorize(work),
            _ => work(),
        }
    }

    /// Runs work on lanes, compiled for this instruction set; `None` on the baseline, whose
    /// registers of two numbers make lanes no faster than single elements.
    #[inline(always)]
    pub fn run_side_by_side<R>(self, work: impl FnOnce() -> R) -> Option<R> {
        match pulp::x86::V3::try_new() {
            Some(wide) if self == Self::Avx2 => Some(wide.vectorize(work)),
            _ => None,
        }
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl Instructions {
    fn widest() -> Self {
        Self::Baseline
    }

    /// Runs `work`.
    pub fn run<R>(self, work: impl FnOnce() -> R) -> R {
        work()
    }

    /// `None`: on this architecture lanes have not been measured to be faster than single elements.
    pub fn run_side_by_side<R>(self, _work: impl FnOnce() -> R) -> Option<R> {
        None
    }
}
