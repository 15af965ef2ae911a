//! Contact of beams with beams, and of beams with themselves.
//!
//! A list in the state holds the pairs of elements that are near each other ([`list`]); nothing else
//! is looked at. Elements that cross carry a force at their closest points; elements side by side
//! carry it at the nodes of both ([`candidate`], [`sharing`]).

mod candidate;
mod friction;
mod holding;
mod list;
mod point;
mod role;
mod sharing;

pub(super) use role::PairRole;

use super::strand::{ChainNode, Strand};
use crate::kernel::contact::NodeBlocks;
use crate::system::{ListedPair, Slot, State};
use crate::tensor::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

/// Two strands that may touch, or one that may touch itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Meeting {
    /// Numbers of the first and of the second strand, in rising order; equal for a strand that may
    /// touch itself
    pub strands: [usize; 2],
}

impl Meeting {
    /// True for a strand and itself.
    pub fn is_own(&self) -> bool {
        self.strands[0] == self.strands[1]
    }
}

/// A node that two strands of a meeting share, or two nodes that joints connect.
#[derive(Clone, Copy, Debug)]
struct Join {
    /// The lengths of the strands before it
    arcs: [f64; 2],
    /// The distance of both nodes
    apart: f64,
}

/// Beams that may touch each other.
#[derive(Clone, Debug, Default)]
pub struct BeamPairs {
    strands: Vec<Strand>,
    /// The names of the beams of the strands
    names: Vec<String>,
    meetings: Vec<Meeting>,
    /// The meeting of two strands
    by_strands: BTreeMap<[usize; 2], usize>,
    /// The nodes that the strands of each meeting share
    joins: Vec<Vec<Join>>,
    /// The number of the first node of each strand among all, and their number
    first_nodes: Vec<usize>,
    /// The number of the first element of each strand among all, and their number
    first_elements: Vec<usize>,
}

/// The strand of each element, and its number there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ElementOf {
    strand: usize,
    element: usize,
}

impl BeamPairs {
    /// The beams.
    pub fn strands(&self) -> &[Strand] {
        &self.strands
    }

    /// Meetings of beams: each strand is a beam with its name. `connected` has the slots of
    /// displacement of nodes that joints connect.
    pub fn new(beams: Vec<(String, Strand)>, meetings: Vec<Meeting>, connected: &[[Slot; 2]]) -> Self {
        let (names, strands): (Vec<String>, Vec<Strand>) = beams.into_iter().unzip();
        let sums = |count: fn(&Strand) -> usize| {
            let mut sum = 0;
            let mut sums = vec![0];
            sums.extend(strands.iter().map(|strand| {
                sum += count(strand);
                sum
            }));
            sums
        };
        let groups = JointGroups::new(connected);
        Self {
            first_nodes: sums(|strand| strand.nodes.len()),
            first_elements: sums(Strand::elements),
            by_strands: meetings.iter().enumerate().map(|(k, meeting)| (meeting.strands, k)).collect(),
            joins: meetings.iter().map(|meeting| joins(meeting, &strands, &groups)).collect(),
            strands,
            names,
            meetings,
        }
    }

    /// True if no beams may meet.
    pub fn is_empty(&self) -> bool {
        self.meetings.is_empty()
    }

    /// The number of meetings.
    pub fn len(&self) -> usize {
        self.meetings.len()
    }

    /// The number of pairs of elements that can meet: those that are no neighbours.
    pub fn element_pairs(&self) -> usize {
        (0..self.len()).map(|meeting| self.all_pairs(meeting) - self.neighbours(meeting)).sum()
    }

    fn all_pairs(&self, meeting: usize) -> usize {
        let [a, b] = self.both(meeting).map(Strand::elements);
        if self.meetings[meeting].is_own() { a * (a - 1) / 2 } else { a * b }
    }

    /// The number of pairs of elements of a meeting that cannot touch, without the element itself.
    fn neighbours(&self, meeting: usize) -> usize {
        let strands = self.both(meeting);
        let is_own = self.meetings[meeting].is_own();
        let arcs = strands.map(|strand| (0..strand.elements()).map(|k| arcs_of(strand, k)).collect::<Vec<_>>());
        let longest = arcs.iter().flatten().map(|[from, to]| to - from).fold(0.0, f64::max);
        let least = 0.5 * PI * (strands[0].radius + strands[1].radius) + longest;
        let mut found = BTreeSet::new();
        let mut note = |a: usize, b: usize| {
            let elements = if is_own { [a.min(b), a.max(b)] } else { [a, b] };
            if !(is_own && a == b) && self.are_neighbours(meeting, elements) {
                found.insert(elements);
            }
        };
        // Elements by their ends: those that reach beyond a place, up to those that begin before another.
        let near = |side: usize, from: f64, to: f64| {
            let first = arcs[side].partition_point(|arc| arc[1] < from);
            let end = arcs[side].partition_point(|arc| arc[0] <= to);
            first..end
        };
        if is_own {
            for (a, arc) in arcs[0].iter().enumerate() {
                near(0, arc[0], arc[1] + least).for_each(|b| note(a, b));
            }
        }
        for join in &self.joins[meeting] {
            let [on_a, on_b] = [0, 1].map(|side| near(side, join.arcs[side] - least, join.arcs[side] + least));
            on_a.for_each(|a| on_b.clone().for_each(|b| note(a, b)));
        }
        found.len()
    }

    /// The names of both beams of each meeting.
    pub fn names(&self) -> impl Iterator<Item = [&str; 2]> {
        self.meetings.iter().map(|meeting| meeting.strands.map(|strand| self.names[strand].as_str()))
    }

    /// The contact that a meeting belongs to.
    fn contact_of(&self, meeting: usize) -> usize {
        self.strands[self.meetings[meeting].strands[0]].contact
    }

    /// Both strands of a meeting.
    pub(super) fn both(&self, meeting: usize) -> [&Strand; 2] {
        self.meetings[meeting].strands.map(|strand| &self.strands[strand])
    }

    /// The slots that a pair of elements couples: those of the blocks of each node.
    pub(super) fn slots(&self, pair: &ListedPair, blocks: NodeBlocks) -> impl Iterator<Item = Slot> {
        let [a, b] = self.nodes_of(pair);
        a.iter().chain(b).flat_map(move |node| node.slots(blocks))
    }

    /// The nodes of both elements of a pair.
    fn nodes_of(&self, pair: &ListedPair) -> [&[ChainNode]; 2] {
        let [a, b] = self.both(pair.meeting as usize);
        [a.nodes_of(pair.elements[0] as usize), b.nodes_of(pair.elements[1] as usize)]
    }

    /// Places of all nodes in a state.
    fn places(&self, at: &State) -> Vec<Vec3> {
        let nodes = self.strands.iter().flat_map(|strand| &strand.nodes);
        nodes.map(|node| node.place + at.q[node.node.u as usize]).collect()
    }

    /// Vectors at the nodes of an element from those at all nodes.
    fn of_element<'p>(&self, of: ElementOf, places: &'p [Vec3]) -> &'p [Vec3] {
        let order = self.strands[of.strand].order;
        let first = self.first_nodes[of.strand] + of.element * order;
        &places[first..=first + order]
    }

    /// Both elements of a pair.
    fn elements_of(&self, pair: &ListedPair) -> [ElementOf; 2] {
        let [a, b] = self.meetings[pair.meeting as usize].strands;
        let [i, j] = pair.elements.map(|element| element as usize);
        [ElementOf { strand: a, element: i }, ElementOf { strand: b, element: j }]
    }

    /// The strand of an element by its number among all.
    fn element(&self, number: usize) -> ElementOf {
        let strand = self.first_elements.partition_point(|&first| first <= number) - 1;
        ElementOf { strand, element: number - self.first_elements[strand] }
    }

    /// True for elements of one beam, or of beams that share a node, which are so near each other
    /// along the beams that they cannot touch but by the bend of the beams between.
    fn are_neighbours(&self, meeting: usize, elements: [usize; 2]) -> bool {
        let strands = self.both(meeting);
        let arcs = [0, 1].map(|side| arcs_of(strands[side], elements[side]));
        let longest = arcs.map(|[from, to]| to - from).into_iter().fold(0.0, f64::max);
        let least = 0.5 * PI * (strands[0].radius + strands[1].radius) + longest;
        if self.meetings[meeting].is_own() && arcs[1][0] - arcs[0][1] < least {
            return true;
        }
        let beside = |[from, to]: [f64; 2], at: f64| (from - at).max(at - to).max(0.0);
        self.joins[meeting].iter().any(|join| {
            let way = beside(arcs[0], join.arcs[0]) + join.apart + beside(arcs[1], join.arcs[1]);
            way < least
        })
    }
}

/// The lengths of a beam before and behind an element.
fn arcs_of(strand: &Strand, element: usize) -> [f64; 2] {
    let nodes = strand.nodes_of(element);
    [nodes[0].fraction, nodes[nodes.len() - 1].fraction].map(|fraction| fraction * strand.length)
}

/// Nodes that joints connect, by the slots of their displacement.
struct JointGroups {
    /// Another slot of the group; slots that are not there stand for their group
    towards: BTreeMap<Slot, Slot>,
}

impl JointGroups {
    fn new(connected: &[[Slot; 2]]) -> Self {
        let mut groups = Self { towards: BTreeMap::new() };
        for pair in connected {
            let [a, b] = pair.map(|slot| groups.of(slot));
            if a != b {
                groups.towards.insert(a, b);
            }
        }
        groups
    }

    /// The slot that stands for the group of a node.
    fn of(&self, slot: Slot) -> Slot {
        let mut slot = slot;
        while let Some(&next) = self.towards.get(&slot) {
            slot = next;
        }
        slot
    }
}

/// The nodes that the strands of a meeting share, and those that joints connect.
fn joins(meeting: &Meeting, strands: &[Strand], groups: &JointGroups) -> Vec<Join> {
    let [a, b] = meeting.strands.map(|strand| &strands[strand]);
    let mut known: BTreeMap<Slot, Vec<usize>> = BTreeMap::new();
    a.nodes.iter().enumerate().for_each(|(k, node)| known.entry(groups.of(node.node.u)).or_default().push(k));
    let mut joins = Vec::new();
    for (j, node) in b.nodes.iter().enumerate() {
        let group = groups.of(node.node.u);
        for &k in known.get(&group).into_iter().flatten().filter(|&&k| !(meeting.is_own() && k == j)) {
            let arcs = [a.nodes[k].fraction * a.length, node.fraction * b.length];
            joins.push(Join { arcs, apart: (a.nodes[k].place - node.place).norm() });
        }
    }
    joins
}
