//! Storage of elastic elements: neighbours with equal data share them.

use crate::effect::{Connection, RoundOff, shared};
use crate::kernel::beam::StiffnessPoint;
use crate::kernel::law::{Linear, SectionLaw};
use crate::scalar::{LANES, Lanes, Pack, each_lane};
use crate::tensor::Vec3;
use std::f64::consts::PI;
use std::sync::Arc;

/// The law of all sections. It is one type, so that elements of different sections can be packed
/// into lanes.
pub type BeamLaw<T = f64> = Linear<T>;

/// An integration point of a beam for internal forces.
pub type ElasticPoint<const N: usize, T = f64> = StiffnessPoint<N, T, BeamLaw<T>>;

/// An element of N nodes with G = N - 1 points for internal forces.
#[derive(Clone, Debug)]
pub struct ElasticElement<const N: usize, const G: usize> {
    /// The number and the nodes of the element
    pub(crate) connection: Connection<N>,
    /// The index of the amplitude of its free strain; `None` without free strain
    free: Option<u32>,
    /// Its length over that of the shared data. Round-off makes lengths of equal elements differ,
    /// which is kept: equal round-off in the stiffness of a mechanism would add up over elements,
    /// and pass for a stiffness.
    length: f64,
    /// Data shared with neighbours of (nearly) equal length, with equal sections in equal axes
    common: Arc<SharedElasticData<N, G>>,
}

/// The data that neighbouring elastic elements share.
#[derive(Debug, PartialEq)]
struct SharedElasticData<const N: usize, const G: usize> {
    /// The initial places of the nodes from the first node
    arms: [Vec3; N],
    points: [ElasticPoint<N>; G],
    /// Round-off of the force at each point, and of its moment for shape functions of slope one
    rounding: [RoundOff; G],
}

impl<const N: usize, const G: usize> SharedElasticData<N, G> {
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
    /// An element that is `length` times as long as `arms` (initial places from the first node) and
    /// `points` say. `free` is the index of the amplitude of its free strain. Data that equal those
    /// of the `neighbour` are shared.
    pub fn new(
        connection: Connection<N>,
        length: f64,
        arms: [Vec3; N],
        points: [ElasticPoint<N>; G],
        free: Option<usize>,
        neighbour: Option<&Self>,
    ) -> Self {
        let common = shared(SharedElasticData::new(arms, points), neighbour.map(|neighbour| &neighbour.common));
        Self { connection, free: free.map(|number| number as u32), length, common }
    }

    /// True if it shares its data with another element.
    pub fn is_like(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.common, &other.common)
    }

    /// The integration points of the element.
    #[inline(always)]
    pub fn points(&self) -> [ElasticPoint<N>; G] {
        let mut points = self.common.points;
        points.iter_mut().for_each(|point| point.lengthen(self.length));
        points
    }

    /// The nodes of the element with their initial places.
    #[inline(always)]
    pub fn member(&self) -> ElementNodes<'_, N> {
        ElementNodes { connection: &self.connection, arms: self.common.arms.map(|arm| arm * self.length) }
    }

    /// Calls `show` with the round-off of force and moment at each point, for displacements of at
    /// most `u`. Displacements and rotations carry a relative error of one unit in the last place;
    /// strains divide it by the element's length, and stiff sections multiply it.
    #[inline]
    pub fn each_round_off(&self, u: f64, mut show: impl FnMut(RoundOff)) {
        for (point, rounding) in self.common.points.iter().zip(&self.common.rounding) {
            let steepest = point.slope.iter().fold(0.0_f64, |s, d| s.max(d.abs()));
            let RoundOff { force: at_rest, moment } = *rounding;
            let force = at_rest + at_rest * steepest * u;
            show(RoundOff { force, moment: moment * steepest + force * point.weight });
        }
    }

    /// The index of the amplitude of its free strain; `None` without free strain.
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

/// The nodes of an element with their initial places.
#[derive(Clone, Copy, Debug)]
pub struct ElementNodes<'e, const N: usize> {
    /// Number and nodes of the element
    pub(crate) connection: &'e Connection<N>,
    /// The initial places of the nodes from the first node
    pub(crate) arms: [Vec3; N],
}
