//! Contact points of listed pairs in a state, with their forces.

use super::candidate::{Kinds, PairCandidate, Side, candidates};
use super::{BeamPairs, ElementOf};
use crate::effect::contact::laws::{ContactLaws, TOUCHING};
use crate::effect::contact::predecessors::{LARGEST_SHIFT, Link, Predecessors, Relation};
use crate::kernel::contact::along::weighted_sum;
use crate::kernel::contact::{
    CarriedTraction, ContactNode, NodeTurning, PairLaw, PairSide, PointState, ShapeAt, add_pair,
};
use crate::kernel::{ElementSystem, Weights};
use crate::system::{ContactRegime, ContactStiffness, ListedPair, PairPointKind, PairPointMemory, PointMemory, State};
use crate::tensor::{Mat3, Vec3};
use std::borrow::Cow;

/// A contact point of two beams in a state.
pub(super) struct PairPoint<'a> {
    /// Number of the pair in the list
    pub(super) number: usize,
    pub(super) pair: ListedPair,
    pub(super) candidate: PairCandidate,
    /// The points of its meeting in memory that it was
    predecessors: Predecessors,
    /// The number of the first point of its meeting in memory
    first_known: usize,
    /// The memory of the point that it was
    partner: Option<&'a PairPointMemory>,
    /// The traction that it took over (global axes at the last converged state)
    carried: CarriedTraction,
    pub(super) law: PairLaw,
    /// Normal and traction in the axes of the carrier
    pub(super) state: PointState,
    /// The rotation of the carrier
    carrier: Mat3,
    /// The place on the centre line of the first beam
    place: Vec3,
    /// The number of nodes to both sides, and their shape functions
    pub(super) shapes: [[f64; 4]; 2],
}

impl PairPoint<'_> {
    /// The normal, from the second beam to the first (global axes).
    pub fn normal(&self) -> Vec3 {
        self.carrier * self.state.normal
    }

    /// Numbers of the points in memory of which it is the successor.
    pub fn successions(&self) -> impl Iterator<Item = usize> + '_ {
        self.predecessors.all().map(|number| self.first_known + number)
    }

    /// The friction on the first beam without the weight (global axes).
    pub fn traction(&self) -> Vec3 {
        self.carrier * self.state.traction.force
    }
}

/// A candidate with the number of its pair.
pub(super) struct Found {
    pub(super) number: usize,
    pub(super) candidate: PairCandidate,
}

/// A candidate with its pair, and the points in memory that it was.
struct Part<'a> {
    number: usize,
    pair: ListedPair,
    candidate: PairCandidate,
    predecessors: Predecessors,
    first_known: usize,
    partner: Option<&'a PairPointMemory>,
    carried: CarriedTraction,
}

/// A look at listed pairs in a state.
pub(super) struct PairsNow<'a> {
    pub(super) pairs: &'a BeamPairs,
    pub(super) laws: &'a [ContactLaws],
    pub(super) at: &'a State,
    /// The list, which is that of the state but in an assembly of another one
    pub(super) list: &'a [ListedPair],
    pub(super) places: Vec<Vec3>,
    /// Directions of the beams at all nodes at the last converged state, or of now where it has none
    pub(super) directions: Cow<'a, [Vec3]>,
    /// Places of all nodes at the last converged state, or of now where it has none
    pub(super) accepted: Cow<'a, [Vec3]>,
}

/// Calls a function of two numbers of nodes, for elements of given orders.
macro_rules! of_orders {
    ($orders:expr, $of:ident . $function:ident $arguments:tt) => {
        match $orders {
            [1, 1] => $of.$function::<2, 2> $arguments,
            [1, 2] => $of.$function::<2, 3> $arguments,
            [1, _] => $of.$function::<2, 4> $arguments,
            [2, 1] => $of.$function::<3, 2> $arguments,
            [2, 2] => $of.$function::<3, 3> $arguments,
            [2, _] => $of.$function::<3, 4> $arguments,
            [_, 1] => $of.$function::<4, 2> $arguments,
            [_, 2] => $of.$function::<4, 3> $arguments,
            [_, _] => $of.$function::<4, 4> $arguments,
        }
    };
}

impl<'a> PairsNow<'a> {
    pub fn new(pairs: &'a BeamPairs, laws: &'a [ContactLaws], at: &'a State, list: &'a [ListedPair]) -> Self {
        let places = if list.is_empty() { Vec::new() } else { pairs.places(at) };
        let known = &at.contacts.pairs;
        // Without pairs there are no places.
        let directions = if list.is_empty() {
            Cow::Borrowed(&[][..])
        } else if known.directions.len() == places.len() {
            Cow::Borrowed(&known.directions[..])
        } else {
            Cow::Owned(pairs.directions(&places))
        };
        let accepted = if known.accepted.len() == places.len() {
            Cow::Borrowed(&known.accepted[..])
        } else {
            Cow::Owned(places.clone())
        };
        Self { pairs, laws, at, list, places, directions, accepted }
    }

    /// Visits the points of all pairs that act, with their systems.
    pub fn each_point(&self, weights: Weights, visit: &mut dyn FnMut(&PairPoint<'a>, &ElementSystem)) {
        let mut first = 0;
        for group in self.list.chunk_by(|a, b| a.meeting == b.meeting) {
            let meeting = group[0].meeting as usize;
            let laws = &self.laws[self.pairs.contact_of(meeting)];
            if self.at.amplitude[laws.amplitude] != 0.0 {
                self.each_of_meeting(first, group, laws, weights, visit);
            }
            first += group.len();
        }
    }

    fn each_of_meeting(
        &self,
        first: usize,
        group: &[ListedPair],
        laws: &'a ContactLaws,
        weights: Weights,
        visit: &mut dyn FnMut(&PairPoint<'a>, &ElementSystem),
    ) {
        let (first_known, known) = self.memory_of_meeting(group[0].meeting);
        let found = self.found(first, group, self.reach(known, laws));
        let all = self.predecessors(&found, known, laws);
        let orders = self.pairs.both(group[0].meeting as usize).map(|strand| strand.order);
        let mut system = ElementSystem::new(laws.blocks_of_node().of(orders[0] + orders[1] + 2));
        for (&Found { number, candidate }, predecessors) in found.iter().zip(all) {
            let partner = predecessors.own.map(|own| &known[own]);
            let carried = predecessors.traction(candidate.weight, &|own| &known[own].point);
            let part = Part { number, pair: self.list[number], candidate, predecessors, first_known, partner, carried };
            let law = self.law(&part, laws);
            system.clear_for(weights);
            let point = of_orders!(orders, self.point(part, law, weights, &mut system));
            if let Some(point) = point {
                visit(&point, &system);
            }
        }
    }

    /// The candidates of the pairs of a meeting, of which `first` is the number of the first one. `reach`: the
    /// largest gap with a force.
    pub(super) fn found(&self, first: usize, group: &[ListedPair], reach: f64) -> Vec<Found> {
        let mut found = Vec::new();
        for (number, pair) in (first..).zip(group) {
            if self.pairs.chord_gap(pair, &self.places) <= reach {
                let candidates = self.sharing_candidates(pair, reach);
                found.extend(candidates.into_iter().map(|candidate| Found { number, candidate }));
            }
        }
        self.share_among_near(&mut found, reach);
        found
    }

    /// The points of a meeting that had a force, and the number of the first of them.
    pub(super) fn memory_of_meeting(&self, meeting: u32) -> (usize, &'a [PairPointMemory]) {
        let points = &self.at.contacts.pairs.points;
        let first = points.partition_point(|point| point.meeting < meeting);
        let end = points.partition_point(|point| point.meeting <= meeting);
        (first, &points[first..end])
    }

    /// The largest gap at which points of a meeting may have a force, or touch.
    fn reach(&self, memory: &[PairPointMemory], laws: &ContactLaws) -> f64 {
        let touching = TOUCHING * laws.penetration;
        let of_point = |point: &PairPointMemory| match self.at.contacts.regime {
            ContactRegime::Penalty => point.point.offset,
            ContactRegime::Augmented => {
                point.point.multiplier / (point.point.stiffness.augmented * self.at.contacts.factor)
            }
        };
        memory.iter().map(of_point).fold(touching, f64::max)
    }

    /// The stiffness of the contact of two elements: that of both in series.
    pub fn stiffness(&self, pair: &ListedPair) -> ContactStiffness {
        let strands = self.pairs.both(pair.meeting as usize);
        let [a, b] = [0, 1].map(|side| strands[side].stiffness[pair.elements[side] as usize]);
        let in_series = |a: f64, b: f64| a * b / (a + b);
        ContactStiffness { augmented: in_series(a.augmented, b.augmented), penalty: in_series(a.penalty, b.penalty) }
    }

    pub(super) fn candidates(&self, pair: &ListedPair, kinds: Kinds) -> Vec<PairCandidate> {
        let orders = self.pairs.both(pair.meeting as usize).map(|strand| strand.order);
        of_orders!(orders, self.candidates_of(pair, kinds))
    }

    fn candidates_of<const NA: usize, const NB: usize>(&self, pair: &ListedPair, kinds: Kinds) -> Vec<PairCandidate> {
        let [a, b] = self.pairs.elements_of(pair);
        let mut out = Vec::new();
        candidates(&self.side::<NA>(a), &self.side::<NB>(b), kinds, &mut out);
        out
    }

    fn side<const N: usize>(&self, of: ElementOf) -> Side<N> {
        let strand = &self.pairs.strands[of.strand];
        let nodes = |element: usize| {
            let places = self.pairs.of_element(ElementOf { strand: of.strand, element }, &self.places);
            std::array::from_fn(|i| places[i])
        };
        let slope_at_start = |nodes: [Vec3; N]| weighted_sum(&ShapeAt::<N>::new(0.0).slopes, |i| nodes[i]);
        let is_closed = strand.is_closed();
        let next = if is_closed { (of.element + 1) % strand.elements() } else { of.element + 1 };
        Side {
            nodes: nodes(of.element),
            next: (next < strand.elements()).then(|| slope_at_start(nodes(next))),
            is_first: of.element == 0 && !is_closed,
            has_caps: strand.has_caps,
        }
    }

    /// The least gap of the surfaces of a pair.
    pub fn gap(&self, pair: &ListedPair) -> f64 {
        let strands = self.pairs.both(pair.meeting as usize);
        let bound = self.pairs.chord_gap(pair, &self.places);
        // Ends that do not touch are no candidates.
        if strands.iter().all(|strand| strand.order == 1 && strand.has_caps) {
            return bound;
        }
        let candidates = self.candidates(pair, Kinds::ALL);
        let distances = candidates.iter().map(|candidate| self.distance(pair, candidate.at));
        distances.fold(f64::INFINITY, f64::min) - strands[0].radius - strands[1].radius
    }

    /// The distance of the centre lines between two places of a pair.
    pub(super) fn distance(&self, pair: &ListedPair, at: [f64; 2]) -> f64 {
        let elements = self.pairs.elements_of(pair);
        let [a, b] = [0, 1].map(|side| self.place_and_slope(elements[side], at[side])[0]);
        (a - b).norm()
    }

    /// True if a point continues one in memory.
    pub fn is_among(&self, point: &PairPoint, memory: &[PairPointMemory]) -> bool {
        let first = memory.partition_point(|known| known.meeting < point.pair.meeting);
        let end = memory.partition_point(|known| known.meeting <= point.pair.meeting);
        let links = self.links(&point.pair, &point.candidate, &memory[first..end]);
        links.iter().any(|link| link.relation == Relation::Same)
    }

    /// The points in memory that each candidate was.
    pub(super) fn predecessors(
        &self,
        found: &[Found],
        known: &[PairPointMemory],
        laws: &ContactLaws,
    ) -> Vec<Predecessors> {
        let mut all = Vec::new();
        for (candidate, Found { number, candidate: at }) in found.iter().enumerate() {
            let links = self.links(&self.list[*number], at, known);
            all.extend(links.into_iter().map(|link| Link { candidate, ..link }));
        }
        // Friction alone is taken over from points beside.
        all.retain(|link| laws.rubs() || link.relation == Relation::Same);
        Predecessors::of(all, found.len(), known.len())
    }

    fn law(&self, part: &Part, laws: &ContactLaws) -> PairLaw {
        let Part { pair, candidate, partner, .. } = part;
        let contacts = &self.at.contacts;
        let stiffness = self.stiffness(pair);
        let multiplier = partner.map_or(0.0, |known| known.point.multiplier);
        let offset = partner.map_or(0.0, |known| known.point.offset_at(candidate.weight));
        let normal = laws.normal_law(multiplier, offset, &stiffness, contacts);
        let [a, b] = self.pairs.both(pair.meeting as usize);
        let friction = self.friction(pair, candidate, laws);
        let (carrier, carried) = match friction {
            None => (0, CarriedTraction::default()),
            Some(_) => {
                let carrier = self.carrier(pair, *partner);
                (carrier, self.on_carrier(pair, carrier, part.carried))
            }
        };
        PairLaw {
            radii: [a.radius, b.radius],
            normal,
            friction,
            carried,
            carrier,
            free: candidate.free,
            weight: candidate.weight,
        }
    }

    fn point<const NA: usize, const NB: usize>(
        &self,
        part: Part<'a>,
        law: PairLaw,
        weights: Weights,
        out: &mut ElementSystem,
    ) -> Option<PairPoint<'a>> {
        let Part { number, pair, candidate, predecessors, first_known, partner, carried } = part;
        let a = self.pair_side::<NA>(&pair, 0, candidate.at[0], &law);
        let b = self.pair_side::<NB>(&pair, 1, candidate.at[1], &law);
        let state = add_pair(&a, &b, &law, weights, out)?;
        let mut shapes = [[0.0; 4]; 2];
        shapes[0][..NA].copy_from_slice(&a.shape.values);
        shapes[1][..NB].copy_from_slice(&b.shape.values);
        let turning = law.friction.and(b.turning.as_ref());
        let carrier = turning.map_or(Mat3::IDENTITY, |turning| turning[law.carrier].rotation.r);
        let place = a.place();
        Some(PairPoint {
            number,
            pair,
            candidate,
            predecessors,
            first_known,
            partner,
            carried,
            law,
            state,
            carrier,
            place,
            shapes,
        })
    }

    /// One of both elements of a pair at the place of a point.
    fn pair_side<const N: usize>(&self, pair: &ListedPair, side: usize, at: f64, law: &PairLaw) -> PairSide<N> {
        let nodes = self.pairs.nodes_of(pair)[side];
        let node = |i: usize| {
            let slot = nodes[i].node.u as usize;
            ContactNode { place: nodes[i].place + self.at.q[slot], velocity: self.at.v[slot] }
        };
        let turning = |i: usize| {
            let before = self.before(pair, law.carrier, [side, i]);
            NodeTurning { rotation: self.at.rotation(nodes[i].node.p), before }
        };
        let turning = self.rubs(pair).then(|| std::array::from_fn(turning));
        PairSide { nodes: std::array::from_fn(node), turning, shape: ShapeAt::new(at) }
    }

    /// True if the contact of a pair has friction somewhere.
    fn rubs(&self, pair: &ListedPair) -> bool {
        self.laws[self.pairs.contact_of(pair.meeting as usize)].rubs()
    }

    /// The memory of a point with a force. Before a state is accepted, traction and normal remain
    /// those of the last one.
    pub fn memory_of(&self, point: &PairPoint, accepts: bool) -> PairPointMemory {
        let PairPoint { pair, candidate, state, law, .. } = point;
        let [a, _] = self.pairs.both(pair.meeting as usize);
        let contacts = &self.at.contacts;
        let (gap, force) = (state.gap, state.normal_force.force);
        let normal = point.normal();
        let stiffness = self.stiffness(pair);
        // Stages go on with the first stiffness.
        let first = stiffness.augmented * contacts.first_factor;
        let is_penalty = contacts.regime == ContactRegime::Penalty;
        let before = point.partner.filter(|_| is_penalty).map(|before| before.point);
        let carried = if accepts {
            let laws = &self.laws[self.pairs.contact_of(pair.meeting as usize)];
            laws.carried(law.friction.is_some(), stiffness.first(contacts.regime), state).turned(&point.carrier)
        } else {
            point.carried
        };
        PairPointMemory {
            meeting: pair.meeting,
            kind: candidate.kind,
            on_second: f64::from(pair.elements[1]) + candidate.at[1],
            point: PointMemory {
                place: f64::from(pair.elements[0]) + candidate.at[0],
                edge: None,
                weight: candidate.weight,
                force,
                multiplier: if accepts { force + first * gap } else { force },
                stiffness,
                gap,
                carried,
                offset: law.normal.offset(),
                steps: before.map_or(0, |before| before.steps) + u32::from(is_penalty),
                push: (normal * force + point.traction()) * candidate.weight,
                at: point.place - normal * (a.radius + 0.5 * gap),
            },
        }
    }

    /// The points in memory of a meeting near a candidate, which is number 0.
    pub(super) fn links(&self, pair: &ListedPair, candidate: &PairCandidate, memory: &[PairPointMemory]) -> Vec<Link> {
        let strands = self.pairs.both(pair.meeting as usize);
        let along = [0, 1].map(|side| f64::from(pair.elements[side]) + candidate.at[side]);
        // The memory is in the order of places; a ring goes on at its start.
        let goes_round = strands[0].is_closed();
        let is_before = |point: &PairPointMemory| !goes_round && point.point.place < along[0] - LARGEST_SHIFT;
        let first = memory.partition_point(is_before);
        let may_be_near = |point: &&PairPointMemory| goes_round || point.point.place <= along[0] + LARGEST_SHIFT;
        let mut links = Vec::new();
        for (j, point) in memory[first..].iter().take_while(may_be_near).enumerate() {
            let places = [point.point.place, point.on_second];
            let shifts = [0, 1].map(|side| strands[side].shift(places[side], along[side]));
            if shifts.iter().any(|&shift| shift > LARGEST_SHIFT) {
                continue;
            }
            let is_same = point.kind == candidate.kind && is_near(candidate.kind, shifts);
            let relation = if is_same { Relation::Same } else { Relation::Beside };
            links.push(Link { candidate: 0, point: first + j, relation, shift: shifts[0] + shifts[1] });
        }
        links
    }
}

/// True for places along both beams, in elements, that one point may have in two states: at the same
/// node, or near each other.
fn is_near(kind: PairPointKind, shifts: [f64; 2]) -> bool {
    let is_same_node = match kind {
        PairPointKind::Closest => true,
        PairPointKind::NodeOfFirst => shifts[0] == 0.0,
        PairPointKind::NodeOfSecond => shifts[1] == 0.0,
    };
    is_same_node && shifts.iter().all(|&shift| shift <= LARGEST_SHIFT)
}

/// The order of points in memory.
pub(super) fn sort(points: &mut [PairPointMemory]) {
    let places = |point: &PairPointMemory| [point.point.place, point.on_second];
    points.sort_by(|a, b| {
        let [[a0, a1], [b0, b1]] = [places(a), places(b)];
        a.meeting.cmp(&b.meeting).then(a0.total_cmp(&b0)).then(a1.total_cmp(&b1))
    });
}
