//! Elastic elements as they are kept: what neighbours have in common stands once.

use super::{Connection, Noise};
use crate::kernel::beam::StiffnessPoint;
use crate::real::{LANES, Lanes, Pack, each_lane, pack};
use std::f64::consts::PI;
use std::sync::Arc;

/// An element of N nodes with G = N - 1 points for internal forces.
#[derive(Clone, Debug)]
pub struct ElasticElement<const N: usize, const G: usize> {
    /// Its place in the scene
    pub connection: Connection<N>,
    slope: [[f64; N]; G],
    weight: [f64; G],
    /// All else, for it and neighbours with the same sections in the same axes
    common: Arc<Common<N, G>>,
    free: Option<u32>,
}

/// What neighbours share.
#[derive(Debug)]
struct Common<const N: usize, const G: usize> {
    points: [StiffnessPoint<N>; G],
    /// Round-off of the force of each point, and of its moment for slopes of one
    rounding: [Noise; G],
}

impl<const N: usize, const G: usize> Common<N, G> {
    fn new(points: [StiffnessPoint<N>; G]) -> Self {
        let of_point = |point: &StiffnessPoint<N>| Noise {
            force: f64::EPSILON * point.stiffness.cn.max_abs(),
            moment: f64::EPSILON * point.stiffness.cm.max_abs() * PI,
        };
        Self { rounding: points.each_ref().map(of_point), points }
    }
}

impl<const N: usize, const G: usize> ElasticElement<N, G> {
    /// With these points, and the number of the amplitude of its free strain; it shares with a neighbour what both have in common.
    pub fn new(
        connection: Connection<N>,
        points: [StiffnessPoint<N>; G],
        free: Option<usize>,
        neighbour: Option<&Self>,
    ) -> Self {
        let alike = |neighbour: &&Self| neighbour.common.points.iter().zip(&points).all(|(a, b)| are_alike(a, b));
        Self {
            connection,
            slope: points.map(|point| point.slope),
            weight: points.map(|point| point.weight),
            common: match neighbour.filter(alike) {
                Some(neighbour) => neighbour.common.clone(),
                None => Arc::new(Common::new(points)),
            },
            free: free.map(|number| number as u32),
        }
    }

    /// Its integration points.
    #[inline(always)]
    pub fn points(&self) -> [StiffnessPoint<N>; G] {
        let mut points = self.common.points;
        for g in 0..G {
            (points[g].slope, points[g].weight) = (self.slope[g], self.weight[g]);
        }
        points
    }

    /// Shows what round-off may leave of the force of each point, where displacements are at most `u`: these and rotations carry a relative
    /// error of one unit in the last place; strains divide it by the element's length, and stiff sections multiply it.
    #[inline]
    pub fn each_noise(&self, u: f64, mut show: impl FnMut(Noise)) {
        for g in 0..G {
            let steepest = self.slope[g].iter().fold(0.0_f64, |s, d| s.max(d.abs()));
            let Noise { force: at_rest, moment } = self.common.rounding[g];
            let force = at_rest + at_rest * steepest * u;
            show(Noise { force, moment: moment * steepest + force * self.weight[g] });
        }
    }

    /// The number of the amplitude of its free strain.
    #[inline(always)]
    pub fn free(&self) -> Option<usize> {
        self.free.map(|number| number as usize)
    }

    /// The integration points of elements side by side.
    #[inline(always)]
    pub fn points_side_by_side(elements: [&Self; LANES]) -> [StiffnessPoint<N, Lanes>; G] {
        let first = &elements[0].common;
        let share = elements[1..].iter().all(|element| Arc::ptr_eq(&element.common, first));
        let mut points = [Self::side_by_side(elements, share, 0); G];
        for g in 1..G {
            points[g] = Self::side_by_side(elements, share, g);
        }
        points
    }

    #[inline(always)]
    fn side_by_side(elements: [&Self; LANES], share: bool, g: usize) -> StiffnessPoint<N, Lanes> {
        let common = match share {
            true => elements[0].common.points[g].lifted(),
            false => StiffnessPoint::pack(each_lane!(|k| &elements[k].common.points[g])),
        };
        StiffnessPoint { slope: pack!(elements.slope[g]), weight: pack!(elements.weight[g]), ..common }
    }
}

/// Whether points differ at most by how long their elements are.
fn are_alike<const N: usize>(a: &StiffnessPoint<N>, b: &StiffnessPoint<N>) -> bool {
    (a.shape, a.tangent, a.stiffness, a.free) == (b.shape, b.tangent, b.stiffness, b.free)
}
