//! Beams and bodies too far from a surface to touch it in the next step.
//!
//! They are put aside when a step ends: in the next one nobody asks where they touch. When that step has ended, the
//! way between its ends is looked at. If it may lead to the surface, the step is taken again, with contact there.

use super::chain_now::before_of;
use super::{Missed, SurfaceContacts};
use crate::kernel::Weights;
use crate::system::{Clearance, Slot, State};
use std::sync::Arc;

/// So many steps like the last one must lead nowhere near a surface from which something is put aside.
const STEPS_AHEAD: f64 = 2.0;

impl SurfaceContacts {
    /// The clearance of a chain whose contact acts and that touches nothing.
    fn clearance(&self, number: usize, at: &State) -> Option<Clearance> {
        let chain = &self.chains[number];
        if at.amplitude[self.laws[chain.contact].amplitude] == 0.0 || at.contacts.has_points(number) {
            return None;
        }
        chain.clearance(&self.surfaces[chain.surface], at)
    }

    /// True if a chain keeps its clearance on the way between two states.
    fn lasts(&self, number: usize, ends: [&Clearance; 2], from: &State, to: &State) -> bool {
        let surface = &self.surfaces[self.chains[number].surface];
        ends[0].lasts_until(ends[1], surface.off_chord(ends.map(|end| end.middle), from, to))
    }

    /// Puts aside in `to`, where a step has ended, what is far from its surface. Looks again in `from`, where it
    /// began, at what was put aside there and may have come near: the step is to be taken again.
    pub(super) fn put_aside(&self, from: &mut State, to: &mut State) -> Missed {
        let clearances = self.clearances(to);
        if let Some(slot) = self.look_again(from, to, &clearances) {
            return Missed::Listed(slot);
        }
        let stays = |(number, clearance): (usize, Option<Clearance>)| {
            let was_aside = from.contacts.clearance(number).is_some();
            clearance.filter(|now| was_aside || !self.comes_soon(number, now, from))
        };
        to.contacts.clearances = Arc::new(clearances.into_iter().enumerate().map(stays).collect());
        Missed::None
    }

    /// True if the next step, which may go as far as the last one from `from`, may end near the surface.
    fn comes_soon(&self, number: usize, now: &Clearance, from: &State) -> bool {
        let chain = &self.chains[number];
        let middle = self.surfaces[chain.surface].on_surface(chain.middle(from), from);
        now.gap - now.reach < STEPS_AHEAD * (now.middle - middle).norm()
    }

    /// The clearances of all chains in a state.
    pub(super) fn clearances(&self, at: &State) -> Vec<Option<Clearance>> {
        (0..self.chains.len()).map(|number| self.clearance(number, at)).collect()
    }

    /// Looks again in `from` at what is put aside there and may have come near to its surface on the way to a state
    /// with other clearances; a slot of the first such chain.
    pub(super) fn look_again(&self, from: &mut State, to: &State, after: &[Option<Clearance>]) -> Option<Slot> {
        let came_near = |number: &usize| match (from.contacts.clearance(*number), &after[*number]) {
            (None, _) => false,
            (Some(_), None) => true,
            (Some(before), Some(after)) => !self.lasts(*number, [before, after], from, to),
        };
        let near: Vec<usize> = (0..after.len()).filter(came_near).collect();
        if !near.is_empty() {
            self.look_at(&near, from);
        }
        near.first().map(|&first| self.chains[first].nodes[0].node.u)
    }

    /// The chains that are put aside in a state.
    pub(super) fn aside(&self, at: &State) -> Vec<usize> {
        (0..self.chains.len()).filter(|&number| at.contacts.clearance(number).is_some()).collect()
    }

    /// Looks again at some chains that were put aside in an accepted state.
    pub(super) fn look_at(&self, numbers: &[usize], at: &mut State) {
        let mut clearances = (*at.contacts.clearances).clone();
        let mut chains = (*at.contacts.chains).clone();
        chains.resize_with(self.chains.len(), Default::default);
        for &number in numbers {
            clearances[number] = None;
            let chain = &self.chains[number];
            // Friction has not followed the nodes of what was put aside.
            if self.laws[chain.contact].rubs() {
                let carrier = self.surfaces[chain.surface].carrier(at, Weights::NONE);
                chains[number].nodes = chain.nodes.iter().map(|node| before_of(node, &carrier, at)).collect();
            }
        }
        at.contacts.clearances = Arc::new(clearances);
        at.contacts.chains = Arc::new(chains);
    }
}
