//! Elastic elements as they are kept: what neighbours have in common stands once.

use crate::effect::{Connection, RoundOff, shared};
use crate::kernel::beam::StiffnessPoint;
use crate::kernel::law::{Linear, SectionLaw};
use crate::scalar::{LANES, Lanes, Pack, each_lane};
use crate::tensor::Vec3;
use std::f64::consts::PI;
use std::sync::Arc;

/// The law of all sections. It is one type, so that elements of different sections stand side by
/// side in lanes.
pub type BeamLaw<T = f64> = Linear<T>;

/// An integration point of a beam.
pub type ElasticPoint<const N: usize, T = f64> = StiffnessPoint<N, T, BeamLaw<T>>;

/// An element of N nodes with G = N - 1 points for internal forces.
#[derive(Clone, Debug)]
pub struct ElasticElement<const N: usize, const G: usize> {
    /// Its place in the scene
    pub connection: Connection<N>,
    /// The number of the amplitude of its free strain
    free: Option<u32>,
    /// Its length over that of what it shares. Round-off makes all of them different, and had
    /// better do so: what it leaves of stiffnesses that are none would add up otherwise, and pass
    /// for one.
    length: f64,
    /// All else, for it and neighbours of the same length with the same sections in the same axes
    common: Arc<Common<N, G>>,
}

/// The data that neighbours share.
#[derive(Debug, PartialEq)]
struct Common<const N: usize, const G: usize> {
    /// The initial places of the nodes as seen from the first
    arms: [Vec3; N],
    points: [ElasticPoint<N>; G],
    /// Round-off of the force of each point, and of its moment for slopes of one
    rounding: [RoundOff; G],
}

impl<const N: usize, const G: usize> Common<N, G> {
    fn new(arms: [Vec3; N], points: [ElasticPoint<N>; G]) -> Self {
        let of_point = |point: &ElasticPoint<N>| {
            let stiffness = point.law.stiffness_at_rest();
            RoundOff {
                force: f64::EPSILON * stiffness.cn.max_abs(),
                moment: f64::EPSILON * stiffness.cm.max_abs() * PI,
            }
        };
        Self { rounding: points.each_ref().map(of_point), arms, points }
    }
}

impl<const N: usize, const G: usize> ElasticElement<N, G> {
    /// So much longer than these arms from its first node and these points tell, and with the
    /// number of the amplitude of its free strain; it shares with a neighbour what both have in
    /// common.
    pub fn new(
        connection: Connection<N>,
        length: f64,
        arms: [Vec3; N],
        points: [ElasticPoint<N>; G],
        free: Option<usize>,
        neighbour: Option<&Self>,
    ) -> Self {
        let common = shared(Common::new(arms, points), neighbour.map(|neighbour| &neighbour.common));
        Self { connection, free: free.map(|number| number as u32), length, common }
    }

    /// It shares all data with another element.
    pub fn is_like(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.common, &other.common)
    }

    /// Its integration points.
    #[inline(always)]
    pub fn points(&self) -> [ElasticPoint<N>; G] {
        let mut points = self.common.points;
        points.iter_mut().for_each(|point| point.lengthen(self.length));
        points
    }

    /// Its nodes, and where they began as seen from the first.
    #[inline(always)]
    pub fn member(&self) -> Member<'_, N> {
        Member { connection: &self.connection, arms: self.common.arms.map(|arm| arm * self.length) }
    }

    /// Shows what round-off may leave of the force of each point, where displacements are at most
    /// `u`: these and rotations carry a relative error of one unit in the last place; strains
    /// divide it by the element's length, and stiff sections multiply it.
    #[inline]
    pub fn each_noise(&self, u: f64, mut show: impl FnMut(RoundOff)) {
        for (point, rounding) in self.common.points.iter().zip(&self.common.rounding) {
            let steepest = point.slope.iter().fold(0.0_f64, |s, d| s.max(d.abs()));
            let RoundOff { force: at_rest, moment } = *rounding;
            let force = at_rest + at_rest * steepest * u;
            show(RoundOff { force, moment: moment * steepest + force * point.weight });
        }
    }

    /// The number of the amplitude of its free strain.
    #[inline(always)]
    pub fn free(&self) -> Option<usize> {
        self.free.map(|number| number as usize)
    }

    /// The integration points of elements side by side.
    #[inline(always)]
    pub fn points_side_by_side(elements: [&Self; LANES]) -> [ElasticPoint<N, Lanes>; G] {
        let share = elements[1..].iter().all(|element| element.is_like(elements[0]));
        let mut points = [Self::side_by_side(elements, share, 0); G];
        for g in 1..G {
            points[g] = Self::side_by_side(elements, share, g);
        }
        points
    }

    #[inline(always)]
    fn side_by_side(elements: [&Self; LANES], share: bool, g: usize) -> ElasticPoint<N, Lanes> {
        let mut point = match share {
            true => elements[0].common.points[g].lifted(),
            false => ElasticPoint::pack(each_lane!(|k| &elements[k].common.points[g])),
        };
        point.lengthen(Lanes(each_lane!(|k| elements[k].length)));
        point
    }
}

/// An element as interpolations see it.
#[derive(Clone, Copy, Debug)]
pub struct Member<'e, const N: usize> {
    /// Its nodes
    pub connection: &'e Connection<N>,
    /// Where they began as seen from the first
    pub arms: [Vec3; N],
}
