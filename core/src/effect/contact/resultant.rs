//! Forces and gaps of contacts in an accepted state, for output.

use super::chain::Chain;
use super::surface::SceneSurface;
use crate::effect::ContactResultant;
use crate::kernel::Weights;
use crate::system::{PointMemory, State};
use crate::tensor::Vec3;

/// The forces of contact number `number`.
pub(super) fn resultant(chains: &[Chain], surfaces: &[SceneSurface], number: usize, at: &State) -> ContactResultant {
    let o = Vec3::ZERO;
    let mut sum = ContactResultant {
        gap: f64::INFINITY,
        normal: 0.0,
        friction: 0.0,
        force: o,
        moment: o,
        length: 0.0,
        points: 0,
        sliding: 0,
    };
    for (k, chain) in chains.iter().enumerate().filter(|(_, chain)| chain.contact == number) {
        let surface = &surfaces[chain.surface];
        let carrier = surface.carrier(at, Weights::NONE);
        let about = if carrier.is_node { carrier.place } else { o };
        sum.gap = sum.gap.min(chain.least_gap(&surface.surface, &carrier, at));
        for point in points(k, at) {
            sum.normal += point.weight * point.force;
            sum.friction += point.weight * point.carried.force.norm();
            sum.force += point.push;
            sum.moment += (point.at - about).cross(point.push);
            sum.points += 1;
            sum.sliding += usize::from(point.carried.slides);
        }
    }
    sum
}

/// The points of a chain with a force.
fn points(chain: usize, at: &State) -> &[PointMemory] {
    at.contacts.chains.get(chain).map_or(&[], |memory| &memory.points)
}

/// Normal force and friction per length on a beam at a part of its length: between points linear.
pub(super) fn force_along(chains: &[Chain], beam: usize, fraction: f64, at: &State) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for (k, chain) in chains.iter().enumerate().filter(|(_, chain)| chain.beam == Some(beam)) {
        let here = force_of_chain(chain, points(k, at), chain.along(fraction));
        sum = [sum[0] + here[0], sum[1] + here[1]];
    }
    sum
}

fn force_of_chain(chain: &Chain, points: &[PointMemory], along: f64) -> [f64; 2] {
    let width = 1.0 / chain.order as f64;
    let next = points.partition_point(|point| point.place < along);
    let nearest = [next.checked_sub(1), Some(next)];
    let [before, after] = nearest.map(|number| place_and_force(chain, points, number));
    let is_near = |point: &(f64, [f64; 2])| (point.0 - along).abs() < width;
    match (before.filter(is_near), after.filter(is_near)) {
        (Some((from, a)), Some((to, b))) => {
            let part = (along - from) / (to - from);
            [0, 1].map(|k| a[k] + (b[k] - a[k]) * part)
        }
        (Some((place, force)), None) | (None, Some((place, force))) => {
            let part = 1.0 - (place - along).abs() / width;
            force.map(|force| force * part)
        }
        (None, None) => [0.0; 2],
    }
}

/// The place of a point, and its forces per length. Before the first and after the last one a ring
/// goes on with the points of its other end.
fn place_and_force(chain: &Chain, points: &[PointMemory], number: Option<usize>) -> Option<(f64, [f64; 2])> {
    let round = if chain.is_closed() { chain.elements() as f64 } else { 0.0 };
    let (point, shift) = match number {
        Some(number) if number < points.len() => (&points[number], 0.0),
        Some(_) => (points.first().filter(|_| chain.is_closed())?, round),
        None => (points.last().filter(|_| chain.is_closed())?, -round),
    };
    let per_length = point.weight / chain.share(point.place);
    Some((point.place + shift, [point.force, point.carried.force.norm()].map(|force| force * per_length)))
}
