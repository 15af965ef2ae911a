//! What pictures show of contacts in an accepted state.

use super::SurfaceContacts;
use super::strand::Strand;
use crate::kernel::Weights;
use crate::system::{PointMemory, Slot, State};
use crate::tensor::Vec3;
use std::collections::BTreeMap;

/// A beam or a body that may touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ContactParty {
    /// A beam by its number in the scene
    Beam(usize),
    /// A body by the slot of the displacements of its node
    Body(Slot),
}

/// The contacts of a node of a party.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeContact {
    /// The least gap to the surfaces that it may touch, and to beams that it touches; infinite where
    /// there are none
    pub(crate) gap: f64,
    /// The force of all contacts on it (global components)
    pub(crate) force: Vec3,
}

/// A node without contact.
const NONE: NodeContact = NodeContact { gap: f64::INFINITY, force: Vec3::ZERO };

/// Contacts of nodes, by their parties and the slots of their displacements.
pub type NodeContacts = BTreeMap<(ContactParty, Slot), NodeContact>;

impl SurfaceContacts {
    /// The radius of each beam and body in contact.
    pub fn radii(&self) -> impl Iterator<Item = (ContactParty, f64)> + '_ {
        let of_chains = self.chains.iter().map(|chain| &chain.strand);
        let strands = of_chains.chain((0..self.pairs.len()).flat_map(|meeting| self.pairs.both(meeting)));
        strands.map(|strand| (party_of(strand), strand.radius))
    }

    /// Place and force of each contact point: the force on the first of both that touch.
    pub fn forces<'a>(&'a self, at: &'a State) -> impl Iterator<Item = [Vec3; 2]> + 'a {
        let of_chains = at.contacts.chains.iter().flat_map(|memory| &memory.points);
        let points = of_chains.chain(at.contacts.pairs.points.iter().map(|point| &point.point));
        points.map(|point| [point.at, point.push])
    }

    /// Gaps and forces at nodes.
    pub fn at_nodes(&self, at: &State) -> NodeContacts {
        let mut nodes = NodeContacts::new();
        for (number, chain) in self.chains.iter().enumerate() {
            let surface = &self.surfaces[chain.surface];
            let carrier = surface.carrier(at, Weights::NONE);
            for (node, place) in chain.nodes.iter().zip(chain.seen(&carrier, at)) {
                let Some(value) = surface.surface.value(place, chain.radius) else { continue };
                let node = nodes.entry((party_of(chain), node.node.u)).or_insert(NONE);
                node.gap = node.gap.min(value - chain.radius);
            }
            let points = at.contacts.chains.get(number).map_or(&[][..], |memory| &memory.points);
            points.iter().for_each(|point| share(&mut nodes, chain, point.place, point.push, f64::INFINITY));
        }
        for point in at.contacts.pairs.points.iter() {
            let [first, second] = self.pairs.both(point.meeting as usize);
            let PointMemory { place, push, gap, .. } = point.point;
            share(&mut nodes, first, place, push, gap);
            share(&mut nodes, second, point.on_second, -push, gap);
        }
        nodes
    }
}

fn party_of(strand: &Strand) -> ContactParty {
    strand.beam.map_or(ContactParty::Body(strand.nodes[0].node.u), ContactParty::Beam)
}

/// Gives force and gap of a point at a place along a strand to the nodes on both sides.
fn share(nodes: &mut NodeContacts, strand: &Strand, place: f64, force: Vec3, gap: f64) {
    let last = strand.nodes.len() - 1;
    let along = (place * strand.order as f64).clamp(0.0, last as f64);
    let before = (along as usize).min(last);
    let part = along - before as f64;
    for (node, weight) in [(before, 1.0 - part), ((before + 1).min(last), part)] {
        if weight > 0.0 {
            let node = nodes.entry((party_of(strand), strand.nodes[node].node.u)).or_insert(NONE);
            node.force += force * weight;
            node.gap = node.gap.min(gap);
        }
    }
}
