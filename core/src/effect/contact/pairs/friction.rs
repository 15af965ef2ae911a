//! Friction of beams on beams.
//!
//! Memory holds places and rotations of nodes, tractions and normals at the last converged state in
//! global axes. A node of the second beam carries a pair: its rotation then, and its rotation now,
//! lead from global axes to those in which the friction law sees both beams.

use super::candidate::PairCandidate;
use super::point::PairsNow;
use super::{BeamPairs, PairRole};
use crate::effect::contact::laws::ContactLaws;
use crate::effect::{ElasticStick, RubbingPoint};
use crate::kernel::Weights;
use crate::kernel::contact::{CarriedTraction, FrictionLaw, NodeBefore};
use crate::system::{ListedPair, PairPointMemory, PointMemory, Slot, State};
use crate::tensor::Mat3;

impl BeamPairs {
    /// Places and rotations of all nodes in a state (global axes).
    pub(super) fn poses(&self, at: &State) -> Vec<NodeBefore> {
        let nodes = self.strands.iter().flat_map(|strand| &strand.nodes);
        let pose = |node: &super::ChainNode| NodeBefore {
            place: node.place + at.q[node.node.u as usize],
            rotation: at.rotation(node.node.p).r,
        };
        nodes.map(pose).collect()
    }
}

impl<'a> PairsNow<'a> {
    /// Coulomb's law at a candidate; `None` without friction. The coefficient is that at the place on
    /// the first beam; where a beam touches itself it is the mean of both places.
    pub(super) fn friction(
        &self,
        pair: &ListedPair,
        candidate: &PairCandidate,
        laws: &ContactLaws,
    ) -> Option<FrictionLaw> {
        if !laws.rubs() {
            return None;
        }
        let strands = self.pairs.both(pair.meeting as usize);
        let coefficient_on = |side: usize| {
            let [from, to] = super::arcs_of(strands[side], pair.elements[side] as usize);
            let fraction = (from + (to - from) * candidate.at[side]) / strands[side].length;
            laws.friction_at(fraction)
        };
        let coefficient = if self.pairs.meetings[pair.meeting as usize].is_own() {
            0.5 * (coefficient_on(0) + coefficient_on(1))
        } else {
            coefficient_on(0)
        };
        laws.friction(
            self.pairs.contact_of(pair.meeting as usize),
            coefficient,
            &self.stiffness(pair),
            &self.at.contacts,
        )
    }

    /// The node of the second element that carries a pair. It stays where the point moves along the
    /// element: the node nearest to the place of the point at the last converged state, or one in the
    /// middle.
    pub(super) fn carrier(&self, pair: &ListedPair, partner: Option<&PairPointMemory>) -> usize {
        let strand = self.pairs.both(pair.meeting as usize)[1];
        let order = strand.order;
        let Some(partner) = partner else { return order.div_ceil(2) };
        let mut along = partner.on_second - f64::from(pair.elements[1]);
        if strand.is_closed() {
            // The shorter way round from the middle of the element.
            let count = strand.elements() as f64;
            along -= count * ((along - 0.5) / count).round();
        }
        let along = along * order as f64;
        along.round().clamp(0.0, order as f64) as usize
    }

    /// A traction at the last converged state (global axes then), in the axes of its carrier.
    pub(super) fn on_carrier(&self, pair: &ListedPair, carrier: usize, traction: CarriedTraction) -> CarriedTraction {
        let axes = self.pose(pair, [1, carrier]).rotation.transpose();
        traction.turned(&axes)
    }

    /// A node of a pair, by its side and its number, as the carrier saw it at the last converged
    /// state.
    pub(super) fn before(&self, pair: &ListedPair, carrier: usize, node: [usize; 2]) -> NodeBefore {
        let carrier = self.pose(pair, [1, carrier]);
        let node = self.pose(pair, node);
        NodeBefore::of(node.place, node.rotation, carrier.place, &carrier.rotation)
    }

    /// A node of a pair at the last converged state, or at the start of the run.
    fn pose(&self, pair: &ListedPair, [side, node]: [usize; 2]) -> NodeBefore {
        let of = self.pairs.elements_of(pair)[side];
        let strand = &self.pairs.strands[of.strand];
        let number = of.element * strand.order + node;
        let known = self.at.contacts.pairs.nodes.get(self.pairs.first_nodes[of.strand] + number);
        let initial = NodeBefore { place: strand.nodes[number].place, rotation: Mat3::IDENTITY };
        known.copied().unwrap_or(initial)
    }
}

impl PairRole<'_> {
    /// The work of friction on both beams since the last converged state.
    pub(in crate::effect::contact) fn friction_work(self, at: &State) -> f64 {
        let mut work = 0.0;
        if self.rubs() {
            self.now(at).each_point(Weights::NONE, &mut |point, _| {
                let traction = &point.state.traction;
                let of_point = traction.work(&point.law.carried, point.state.normal);
                work += point.candidate.weight * of_point;
            });
        }
        work
    }

    /// Adds the points with friction that may touch; meetings of beams count from `first`.
    pub(in crate::effect::contact) fn add_rubbing(self, at: &State, first: usize, points: &mut Vec<RubbingPoint>) {
        if self.rubs() {
            self.now(at).each_point(Weights::NONE, &mut |point, _| {
                let [on_first, _] = point.pair.elements;
                let place = (first + point.pair.meeting as usize, f64::from(on_first) + point.candidate.at[0]);
                let of_law = |law| RubbingPoint::of(place, &law, point.law.weight, &point.state);
                points.extend(point.law.friction.map(of_law));
            });
        }
    }

    /// Raises the factors on the stiffness of stick that contacts need to those of their pairs.
    pub(in crate::effect::contact) fn add_needed_stick_factors(self, at: &State, needed: &mut [f64]) {
        let now = self.now(at);
        now.each_point(Weights::NONE, &mut |point, _| {
            let Some(law) = &point.law.friction else { return };
            let meeting = point.pair.meeting as usize;
            let contact = self.pairs.contact_of(meeting);
            let [a, b] = self.pairs.both(meeting);
            let [j, k] = point.pair.elements.map(|element| element as usize);
            let length = a.element_length(j).min(b.element_length(k));
            let limit = law.limit(point.state.normal_force.force);
            let stiffness = now.stiffness(&point.pair);
            let of_point = self.laws[contact].needed_stick_factor(limit, &stiffness, length, a.radius.min(b.radius));
            needed[contact] = needed[contact].max(of_point);
        });
    }

    /// The energy of the springs of points in memory, with the squares of their forces.
    pub(in crate::effect::contact) fn energy_of_springs(
        self,
        at: &State,
        squared: &dyn Fn(&ContactLaws, &PointMemory) -> f64,
    ) -> f64 {
        let mut energy = 0.0;
        self.each_spring(at, &mut |PairPointMemory { point, meeting, .. }, stiffness| {
            energy += point.weight * squared(self.law_of(*meeting), point) / (2.0 * stiffness);
        });
        energy
    }

    /// Compares the points that stick with the softest one so far, by the smaller radius of both beams.
    pub(in crate::effect::contact) fn add_softest_stick(self, at: &State, softest: &mut Option<ElasticStick>) {
        self.each_spring(at, &mut |point, stiffness| {
            if point.point.sticks() {
                let [a, b] = self.pairs.both(point.meeting as usize);
                let way = point.point.carried.force.norm() / stiffness;
                ElasticStick::compare(softest, &self.law_of(point.meeting).name, way, a.radius.min(b.radius));
            }
        });
    }

    /// Shows the points in memory of contacts with friction, with the stiffness K_t of stick.
    fn each_spring(self, at: &State, show: &mut dyn FnMut(&PairPointMemory, f64)) {
        for point in at.contacts.pairs.points.iter() {
            let laws = self.law_of(point.meeting);
            if laws.rubs() {
                let contact = self.pairs.contact_of(point.meeting as usize);
                show(point, laws.stick_stiffness(contact, &point.point.stiffness, &at.contacts));
            }
        }
    }

    /// A node at a point with friction whose normal has turned over since the last converged state.
    pub(in crate::effect::contact) fn turned_over(self, at: &State) -> Option<Slot> {
        let mut turned = None;
        if self.rubs() {
            self.now(at).each_point(Weights::NONE, &mut |point, _| {
                if point.state.traction.turned_over {
                    turned = Some(self.slot_of(&point.pair));
                }
            });
        }
        turned
    }

    /// True if some contact of beams has friction.
    pub(super) fn rubs(self) -> bool {
        self.pairs.meetings.iter().enumerate().any(|(k, _)| self.laws[self.pairs.contact_of(k)].rubs())
    }
}
