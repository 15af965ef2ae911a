//! How far corrections may go near surfaces.

use super::SurfaceContacts;
use crate::kernel::Weights;
use crate::kernel::contact::Side;
use crate::system::{ContactRegime, State};
use crate::tensor::Vec3;

impl SurfaceContacts {
    /// The part of an increment, up to 1, on which no node goes deeper into a surface around it by more
    /// than its radius. A long wire in a tube is nearly without stiffness until it touches: a whole
    /// correction may lead far out of the tube, where all nodes push back at once.
    pub(super) fn part_within_reach(&self, at: &State, increment: &[Vec3]) -> f64 {
        let mut part = 1.0f64;
        if at.contacts.regime == ContactRegime::Penalty {
            return part;
        }
        for (chain, _, surface) in self.acting(at).filter(|(_, _, surface)| surface.surface.side == Side::Inside) {
            let carrier = surface.carrier(at, Weights::NONE);
            let carried = surface.slots().map_or(Vec3::ZERO, |[u, _]| increment[u as usize]);
            for node in &chain.nodes {
                let moved = increment[node.node.u as usize] - carried;
                if moved.norm() > chain.radius {
                    let from = carrier.on_surface(node.place + at.q[node.node.u as usize]);
                    let to = from + carrier.rotation.r.transpose_mul(moved);
                    let [before, after] = [from, to].map(|y| surface.surface.value(y, chain.radius));
                    part = part.min(part_of_way(before, after, chain.radius));
                }
            }
        }
        part
    }
}

/// The part of a way, up to 1, on which a section of a radius does not go deeper by more than that;
/// distances of its centre are given before and after it.
fn part_of_way(before: Option<f64>, after: Option<f64>, radius: f64) -> f64 {
    let (Some(before), Some(after)) = (before, after) else { return 1.0 };
    let allowed = (before - radius).max(0.0) + radius;
    if before - after > allowed { allowed / (before - after) } else { 1.0 }
}
