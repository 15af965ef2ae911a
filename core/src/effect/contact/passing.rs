//! Beams and bodies that pass through a surface, or out of it on another side, within one step.

use super::chain::{Chain, REACH, SHORTEST_LOOK};
use super::surface::SceneSurface;
use crate::kernel::Weights;
use crate::kernel::contact::Surface;
use crate::kernel::contact::along::place_on;
use crate::system::State;
use crate::tensor::Vec3;

/// Places between two nodes of an element whose ways are looked at, at most.
const MOST_PLACES: f64 = 32.0;

/// The number of a node of a chain at which the beam or body may have passed through a surface on the way
/// from one state to another.
pub(super) fn passed(chain: &Chain, surface: &SceneSurface, from: &State, to: &State) -> Option<usize> {
    let depth = surface.depth();
    if depth == f64::INFINITY {
        return None;
    }
    let [before, after] = [from, to].map(|at| chain.seen(&surface.carrier(at, Weights::NONE), at));
    let way = Way { surface: &surface.surface, radius: chain.radius, depth };
    let node = before.iter().zip(&after).position(|(before, after)| way.passes(*before, *after));
    node.or_else(|| {
        let order = chain.order;
        let nodes = |k: usize| k * order..=(k + 1) * order;
        let passes = |&k: &usize| order > 0 && way.element_passes(&before[nodes(k)], &after[nodes(k)]);
        Some((0..chain.elements()).find(passes)? * order)
    })
}

/// The way of a sphere to or through a surface.
struct Way<'a> {
    surface: &'a Surface,
    /// Of the sphere
    radius: f64,
    /// The depth from which a point still finds its way out of the surface
    depth: f64,
}

impl Way<'_> {
    /// True if a sphere that goes the straight way between two places may have passed.
    fn passes(&self, before: Vec3, after: Vec3) -> bool {
        let moved = (after - before).norm();
        if moved <= self.radius.min(self.depth) {
            return false;
        }
        if goes_deeper(self.surface, before, after, self.radius) {
            return true;
        }
        if moved <= self.depth {
            return false;
        }
        let [from, to] = [before, after].map(|place| self.surface.distance(place).ok());
        let reach = from.map_or(0.0, |from| from.value + self.depth);
        // Along a surface nodes may go farther; on its other side the normal is turned over.
        let has_turned = from.zip(to).is_none_or(|(from, to)| from.normal.dot(to.normal) < 0.0);
        moved > reach && has_turned
    }

    /// The same for places on an element, so near to each other that the surface does not fit between them,
    /// unless the part between two nodes is longer than 32 times its thickness. `before`, `after`: of its nodes.
    fn element_passes(&self, before: &[Vec3], after: &[Vec3]) -> bool {
        let factor = REACH[before.len()];
        let moved = before.iter().zip(after).map(|(before, after)| (*after - *before).norm()).fold(0.0, f64::max);
        if factor * moved <= self.radius.min(self.depth) {
            return false;
        }
        let length_of = |nodes: &[Vec3]| nodes.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum::<f64>();
        let length = length_of(before).max(length_of(after));
        let middle = place_on(before, 0.5);
        let farthest = before.iter().map(|node| (*node - middle).norm()).fold(0.0, f64::max);
        let reach = factor * (farthest + moved) + self.radius;
        if self.surface.distance(middle).is_ok_and(|distance| distance.value > reach) {
            return false;
        }
        let parts = (before.len() - 1) as f64;
        let places = (length / parts / (self.radius + self.depth)).ceil().clamp(2.0, MOST_PLACES) * parts;
        let mut between = (1..places as usize).map(|k| k as f64 / places);
        between.any(|at| self.passes(place_on(before, at), place_on(after, at)))
    }
}

/// True if a sphere that goes the straight way between two places, in the axes of a surface, is
/// deeper in it on the way than at both ends by half of its radius: whoever is out again at the end
/// may have come out on another side. Steps are as long as the distance is from that depth, which
/// cannot be reached in a shorter one.
fn goes_deeper(surface: &Surface, from: Vec3, to: Vec3, radius: f64) -> bool {
    // Also on an axis, where there is no normal
    let height = |place: Vec3| surface.value(place, radius);
    let [Some(first), Some(last)] = [from, to].map(height) else { return false };
    let least = first.min(last).min(radius) - 0.5 * radius;
    let way = to - from;
    let length = way.norm();
    let mut done = 0.0;
    while done < length {
        let Some(here) = height(from + way * (done / length)) else { return false };
        if here < least {
            return true;
        }
        done += (here - least).max(SHORTEST_LOOK * radius);
    }
    false
}
