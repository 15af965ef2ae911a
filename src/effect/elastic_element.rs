//! Elastic elements as they are kept: what neighbours have in common stands once.

use super::Connection;
use crate::kernel::beam::StiffnessPoint;
use crate::real::{LANES, Lanes, Pack, each_lane, pack};
use std::sync::Arc;

/// An element of N nodes with G = N - 1 points for internal forces.
#[derive(Clone, Debug)]
pub struct ElasticElement<const N: usize, const G: usize> {
    /// Its place in the scene
    pub connection: Connection<N>,
    slope: [[f64; N]; G],
    weight: [f64; G],
    /// All else of its points, for it and neighbours with the same sections in the same axes
    common: Arc<[StiffnessPoint<N>; G]>,
    free: Option<u32>,
}

impl<const N: usize, const G: usize> ElasticElement<N, G> {
    /// With these points, and the number of the amplitude of its free strain; it shares with a neighbour what both have in common.
    pub fn new(
        connection: Connection<N>,
        points: [StiffnessPoint<N>; G],
        free: Option<usize>,
        neighbour: Option<&Self>,
    ) -> Self {
        let alike = |neighbour: &&Self| neighbour.common.iter().zip(&points).all(|(a, b)| are_alike(a, b));
        Self {
            connection,
            slope: points.map(|point| point.slope),
            weight: points.map(|point| point.weight),
            common: neighbour.filter(alike).map_or_else(|| Arc::new(points), |neighbour| neighbour.common.clone()),
            free: free.map(|number| number as u32),
        }
    }

    /// Its integration points.
    #[inline(always)]
    pub fn points(&self) -> [StiffnessPoint<N>; G] {
        let mut points = *self.common;
        for g in 0..G {
            (points[g].slope, points[g].weight) = (self.slope[g], self.weight[g]);
        }
        points
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
            true => elements[0].common[g].lifted(),
            false => StiffnessPoint::pack(each_lane!(|k| &elements[k].common[g])),
        };
        StiffnessPoint { slope: pack!(elements.slope[g]), weight: pack!(elements.weight[g]), ..common }
    }
}

/// Whether points differ at most by how long their elements are.
fn are_alike<const N: usize>(a: &StiffnessPoint<N>, b: &StiffnessPoint<N>) -> bool {
    (a.shape, a.tangent, a.stiffness, a.free) == (b.shape, b.tangent, b.stiffness, b.free)
}
