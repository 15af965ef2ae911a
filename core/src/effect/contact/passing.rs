//! Nodes that pass through a surface, or out of it on another side, within one step.

use super::chain::Chain;
use super::surface::SceneSurface;
use crate::kernel::Weights;
use crate::kernel::contact::Surface;
use crate::system::State;
use crate::tensor::Vec3;

/// The shortest step on a way that is looked at, over the radius of the sphere that goes it.
const SHORTEST_LOOK: f64 = 0.1;

/// The number of a node of a chain that may have passed through a surface on the way from one state to
/// another.
pub(super) fn passed(chain: &Chain, surface: &SceneSurface, from: &State, to: &State) -> Option<usize> {
    let depth = surface.depth();
    if depth == f64::INFINITY {
        return None;
    }
    let [before, after] = [from, to].map(|at| with_middles(chain.seen(&surface.carrier(at, Weights::NONE), at)));
    let passes = |(before, after): (&Vec3, &Vec3)| {
        let moved = (*after - *before).norm();
        if moved <= chain.radius.min(depth) {
            return false;
        }
        if goes_deeper(&surface.surface, *before, *after, chain.radius) {
            return true;
        }
        if moved <= depth {
            return false;
        }
        let [from, to] = [before, after].map(|place| surface.surface.distance(*place).ok());
        let reach = from.map_or(0.0, |from| from.value + depth);
        // Along a surface nodes may go farther; on its other side the normal is turned over.
        let has_turned = from.zip(to).is_none_or(|(from, to)| from.normal.dot(to.normal) < 0.0);
        moved > reach && has_turned
    };
    before.iter().zip(&after).position(passes).map(|number| number % chain.nodes.len())
}

/// True if a sphere that goes the straight way between two places, in the axes of a surface, is
/// deeper in it on the way than at both ends by half of its radius: whoever is out again at the end
/// may have come out on another side. Steps are as long as the distance is from that depth, which
/// cannot be reached in a shorter one.
fn goes_deeper(surface: &Surface, from: Vec3, to: Vec3, radius: f64) -> bool {
    let [Ok(first), Ok(last)] = [from, to].map(|place| surface.distance(place)) else { return false };
    let least = first.value.min(last.value).min(radius) - 0.5 * radius;
    let way = to - from;
    let length = way.norm();
    let mut done = 0.0;
    while done < length {
        let Ok(here) = surface.distance(from + way * (done / length)) else { return false };
        if here.value < least {
            return true;
        }
        done += (here.value - least).max(SHORTEST_LOOK * radius);
    }
    false
}

/// Places, followed by the middles between each two neighbours.
fn with_middles(mut places: Vec<Vec3>) -> Vec<Vec3> {
    let middles: Vec<Vec3> = places.windows(2).map(|pair| (pair[0] + pair[1]) * 0.5).collect();
    places.extend(middles);
    places
}
