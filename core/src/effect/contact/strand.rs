//! A beam or a body in contact: its nodes, its radius, its stiffness.

use crate::kernel::contact::NodeBlocks;
use crate::system::{ContactStiffness, Node, Slot};
use crate::tensor::Vec3;

/// A node of a strand.
#[derive(Clone, Copy, Debug)]
pub struct ChainNode {
    /// Its slots
    pub node: Node,
    /// Its initial place
    pub place: Vec3,
    /// The part of the length of the beam before it
    pub fraction: f64,
}

impl ChainNode {
    /// The slots of its blocks.
    pub fn slots(&self, blocks: NodeBlocks) -> impl Iterator<Item = Slot> + use<> {
        [self.node.u, self.node.p].into_iter().take(blocks.count())
    }
}

/// A beam or a body in contact.
#[derive(Clone, Debug)]
pub struct Strand {
    /// Number of the contact that it belongs to
    pub contact: usize,
    /// Number of the beam in the scene; `None` for a body
    pub beam: Option<usize>,
    /// Radius of the section, or of the sphere of a body
    pub radius: f64,
    /// Length of the beam; zero for a body
    pub length: f64,
    /// The nodes in their order; one for a body
    pub nodes: Vec<ChainNode>,
    /// Nodes of an element less one; zero for a body
    pub order: usize,
    /// Stiffness by element
    pub stiffness: Vec<ContactStiffness>,
    /// True if the ends are half spheres, false if they do not touch
    pub has_caps: bool,
}

impl Strand {
    /// The number of elements; one for a body.
    pub fn elements(&self) -> usize {
        self.stiffness.len()
    }

    /// True for a ring: the last node is the first one.
    pub(super) fn is_closed(&self) -> bool {
        self.order > 0 && self.nodes[0].node.u == self.nodes[self.nodes.len() - 1].node.u
    }

    /// The element beyond an end of an element, 0 or 1.
    pub(super) fn neighbour(&self, element: usize, end: f64) -> Option<usize> {
        let count = self.elements();
        let is_last = element == if end == 1.0 { count - 1 } else { 0 };
        let step = if end == 1.0 { 1 } else { count - 1 };
        (!is_last || self.is_closed()).then(|| (element + step) % count)
    }

    /// The length of element `k`; zero for a body.
    pub(super) fn element_length(&self, k: usize) -> f64 {
        let nodes = self.nodes_of(k);
        self.length * (nodes[nodes.len() - 1].fraction - nodes[0].fraction)
    }

    /// The distance along the beam of two places, in elements; of a ring the shorter way round.
    pub(super) fn shift(&self, a: f64, b: f64) -> f64 {
        let direct = (a - b).abs();
        if self.is_closed() { direct.min(self.elements() as f64 - direct) } else { direct }
    }

    /// Nodes of element `k`.
    pub fn nodes_of(&self, k: usize) -> &[ChainNode] {
        &self.nodes[k * self.order..=(k + 1) * self.order]
    }

    /// The length of the beam that a point at a place carries the force of: its element, or half of
    /// the way to both neighbours of a node.
    pub(super) fn share(&self, along: f64) -> f64 {
        if self.order == 0 {
            return 0.0;
        }
        let last = self.nodes.len() - 1;
        let at = along * self.order as f64;
        if self.is_closed() && (at == 0.0 || at == last as f64) {
            let [first, before_last] = [1, last - 1].map(|node| self.nodes[node].fraction);
            return 0.5 * self.length * (first + 1.0 - before_last);
        }
        let (from, to) = if at.fract() == 0.0 {
            let node = at as usize;
            (node.saturating_sub(1), (node + 1).min(last))
        } else {
            let element = (along as usize).min(self.elements() - 1);
            (element * self.order, (element + 1) * self.order)
        };
        let width = self.length * (self.nodes[to].fraction - self.nodes[from].fraction);
        if at.fract() == 0.0 { 0.5 * width } else { width }
    }

    /// The place in elements at a part of the length of the beam.
    pub(super) fn along(&self, fraction: f64) -> f64 {
        let next = self.nodes.partition_point(|node| node.fraction < fraction).clamp(1, self.nodes.len() - 1);
        let [from, to] = [self.nodes[next - 1].fraction, self.nodes[next].fraction];
        (next as f64 - 1.0 + (fraction - from) / (to - from)) / self.order as f64
    }
}
