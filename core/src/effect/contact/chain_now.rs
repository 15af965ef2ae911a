//! A beam or a body against one surface in a state: its contact points with their forces.

use super::chain::{Candidate, Chain, shape};
use super::laws::ContactLaws;
use super::predecessors::Predecessors;
use super::strand::ChainNode;
use super::surface::{SceneSurface, SurfaceCarrier};
use crate::kernel::contact::along::place_on;
use crate::kernel::contact::{Carrier, ContactLaw, ContactNode, NodeBefore, NodeTurning, PointState, add_point};
use crate::kernel::{ElementSystem, Weights};
use crate::system::{ChainMemory, ContactRegime, PointMemory, Slot, State};
use crate::tensor::{Mat3, Vec3};

/// A chain in a state.
pub(super) struct ChainNow<'a> {
    pub(super) chain: &'a Chain,
    pub(super) laws: &'a ContactLaws,
    pub(super) surface: &'a SceneSurface,
    pub(super) carrier: Carrier,
    pub(super) memory: Option<&'a ChainMemory>,
    pub(super) at: &'a State,
    pub(super) candidates: Vec<Candidate>,
    /// The points in memory that the candidates were
    pub(super) predecessors: Vec<Predecessors>,
}

/// A point in a state.
pub(super) struct PointNow<'a> {
    pub(super) candidate: &'a Candidate,
    pub(super) predecessors: &'a Predecessors,
    /// The memory of the point that it was
    pub(super) partner: Option<&'a PointMemory>,
    pub(super) law: &'a ContactLaw,
    pub(super) state: &'a PointState,
}

/// A node as its surface sees it in a state, for the memory.
pub(super) fn before_of(node: &ChainNode, carrier: &Carrier, at: &State) -> NodeBefore {
    let place = node.place + at.q[node.node.u as usize];
    NodeBefore::of(place, at.rotation(node.node.p).r, carrier.place, &carrier.rotation.r)
}

impl<'a> ChainNow<'a> {
    /// Visits all candidates with their forces, and the system of the element or of the node of each.
    pub(super) fn each_point(&self, weights: Weights, visit: &mut dyn FnMut(&PointNow, &ElementSystem)) {
        if self.candidates.is_empty() {
            return;
        }
        let of_carrier = if self.carrier.is_node { 2 } else { 0 };
        let system_of = |nodes: usize| ElementSystem::new(self.laws.blocks_of_node().of(nodes) + of_carrier);
        let mut of_node = system_of(1);
        let mut of_element = system_of(self.chain.order + 1);
        for (candidate, predecessors) in self.candidates.iter().zip(&self.predecessors) {
            let partner = predecessors.own.and_then(|number| self.memory?.points.get(number));
            let law = self.law(candidate, predecessors, partner);
            let node = self.chain.node_at(candidate);
            let system = if node.is_some() { &mut of_node } else { &mut of_element };
            system.clear_for(weights);
            let first = node.unwrap_or(candidate.element * self.chain.order);
            let state = match node.map_or(self.chain.order, |_| 0) {
                0 => self.add::<1>(candidate, first, &law, weights, system),
                1 => self.add::<2>(candidate, first, &law, weights, system),
                2 => self.add::<3>(candidate, first, &law, weights, system),
                _ => self.add::<4>(candidate, first, &law, weights, system),
            };
            let Some(state) = state else { continue };
            visit(&PointNow { candidate, predecessors, partner, law: &law, state: &state }, system);
        }
    }

    /// Adds forces and tangent of a candidate on the N nodes from `first` on; `None` where the surface has no normal.
    fn add<const N: usize>(
        &self,
        candidate: &Candidate,
        first: usize,
        law: &ContactLaw,
        weights: Weights,
        out: &mut ElementSystem,
    ) -> Option<PointState> {
        let shape = shape::<N>(candidate);
        let nodes = &self.chain.nodes[first..first + N];
        let turning = |i: usize| self.turning(&nodes[i], first + i);
        let turning: Option<[NodeTurning; N]> = self.laws.rubs().then(|| std::array::from_fn(turning));
        let nodes: [ContactNode; N] = std::array::from_fn(|i| self.node(&nodes[i]));
        let place = (0..N).fold(Vec3::ZERO, |sum, i| sum + nodes[i].place * shape.values[i]);
        let distance = candidate.distance(&self.surface.surface, self.carrier.on_surface(place))?;
        Some(add_point((&nodes, turning.as_ref()), &shape, &self.carrier, &distance, law, weights, out))
    }

    /// The points with a force, for memory. Points that an augmentation finds open keep the traction of
    /// the last converged state, which returns with the contact.
    pub(super) fn points(&self, accepts: bool) -> Vec<PointMemory> {
        let known = self.memory.map_or(&[][..], |memory| &memory.points);
        let mut goes_on = vec![accepts; known.len()];
        let mut points = Vec::new();
        self.each_point(Weights::NONE, &mut |point, _| {
            if point.state.normal_force.force > 0.0 {
                points.push(self.memory_of(point, accepts));
                point.predecessors.all().for_each(|number| goes_on[number] = true);
            }
        });
        let opened =
            known.iter().zip(&goes_on).filter(|(_, goes_on)| !**goes_on).filter_map(|(point, _)| point.opened());
        points.extend(opened);
        points.sort_by(|a, b| a.place.total_cmp(&b.place));
        points
    }

    fn node(&self, node: &ChainNode) -> ContactNode {
        let slot = node.node.u as usize;
        ContactNode { place: node.place + self.at.q[slot], velocity: self.at.v[slot] }
    }

    fn turning(&self, node: &ChainNode, number: usize) -> NodeTurning {
        let known = self.memory.and_then(|memory| memory.nodes.get(number));
        let before = known.copied().unwrap_or_else(|| self.initial(node));
        NodeTurning { rotation: self.at.rotation(node.node.p), before }
    }

    /// A node as the surface saw it at the start of the run.
    fn initial(&self, node: &ChainNode) -> NodeBefore {
        let carrier = match self.surface.carrier {
            SurfaceCarrier::Node { place, .. } | SurfaceCarrier::Turn { about: place, .. } => place,
            SurfaceCarrier::Ground | SurfaceCarrier::Shift { .. } => Vec3::ZERO,
        };
        NodeBefore { place: node.place - carrier, rotation: Mat3::IDENTITY }
    }

    fn law(&self, candidate: &Candidate, predecessors: &Predecessors, partner: Option<&PointMemory>) -> ContactLaw {
        let contacts = &self.at.contacts;
        let stiffness = self.chain.stiffness[candidate.element];
        let multiplier = partner.map_or(0.0, |point| point.multiplier);
        let offset = partner.map_or(0.0, |point| point.offset_at(candidate.weight));
        let normal = self.laws.normal_law(multiplier, offset, &stiffness, contacts);
        let coefficient = self.laws.friction_at(self.chain.fraction(candidate));
        let friction = self.laws.friction(self.chain.contact, coefficient, &stiffness, contacts);
        let points = self.memory.map_or(&[][..], |memory| &memory.points);
        let carried = predecessors.traction(candidate.weight, &|number| &points[number]);
        let Candidate { place, weight, .. } = *candidate;
        ContactLaw { radius: self.chain.radius, normal, friction, carried, place, weight }
    }

    /// The memory of a point with a force. Before a state is accepted, traction and normal remain
    /// those of the last one.
    fn memory_of(&self, point: &PointNow, accepts: bool) -> PointMemory {
        let PointNow { candidate, state, law, .. } = point;
        let rotation = &self.carrier.rotation.r;
        let stiffness = self.chain.stiffness[candidate.element];
        let first = stiffness.first(self.at.contacts.regime);
        let carried = if accepts { self.laws.carried(law.friction.is_some(), first, state) } else { law.carried };
        let contact = self.place(candidate) - *rotation * state.normal * self.chain.radius;
        let (gap, force) = (state.gap, state.normal_force.force);
        // The next level begins with the first stiffness.
        let next = stiffness.augmented * self.at.contacts.first_factor;
        let multiplier = if accepts { force + next * gap } else { force };
        let is_penalty = self.at.contacts.regime == ContactRegime::Penalty;
        let before = point.partner.filter(|_| is_penalty);
        PointMemory {
            place: candidate.along(),
            edge: candidate.edge,
            weight: candidate.weight,
            force,
            multiplier,
            stiffness,
            gap,
            carried,
            offset: law.normal.offset(),
            steps: before.map_or(0, |before| before.steps) + u32::from(is_penalty),
            push: *rotation * state.force() * candidate.weight,
            at: contact,
        }
    }

    /// A slot of a candidate inside of the surface where that has no normal.
    pub(super) fn without_normal(&self) -> Option<Slot> {
        let is_lost = |candidate: &&Candidate| {
            let seen = self.carrier.on_surface(self.place(candidate));
            candidate.edge.is_none() && self.surface.surface.is_lost(seen, self.chain.radius)
        };
        self.candidates.iter().find(is_lost).map(|candidate| self.slot_of(candidate))
    }

    /// True if a point is nearer to the middle of the surface than to its face, or has come through it since
    /// an earlier state.
    pub(super) fn has_sunk(&self, point: &PointNow, from: &State) -> bool {
        let before = point.partner.map_or(Vec3::ZERO, |before| before.carried.normal);
        let has_turned = before.dot(point.state.normal) < 0.0;
        let height = point.state.gap + self.chain.radius;
        height < -0.5 * self.surface.depth() || (has_turned && self.came_through(point.candidate, from))
    }

    /// True if the surface is deeper half-way between the places of a candidate in an earlier state and now,
    /// as inside of a body, and not between two faces.
    fn came_through(&self, candidate: &Candidate, from: &State) -> bool {
        let seen = |carrier: &Carrier, at: &State| carrier.on_surface(self.place_in(candidate, at));
        let before = seen(&self.surface.carrier(from, Weights::NONE), from);
        let after = seen(&self.carrier, self.at);
        let heights = [before, (before + after) * 0.5, after]
            .map(|place| candidate.distance(&self.surface.surface, place).map_or(f64::NEG_INFINITY, |it| it.value));
        heights[1] < heights[0].min(heights[2])
    }

    /// The gap of a candidate in another state; infinite where the surface has no normal.
    pub(super) fn gap_in(&self, candidate: &Candidate, at: &State) -> f64 {
        let seen = self.surface.carrier(at, Weights::NONE).on_surface(self.place_in(candidate, at));
        candidate.distance(&self.surface.surface, seen).map_or(f64::INFINITY, |it| it.value) - self.chain.radius
    }

    /// The direction of an element from its first node to its last one, in the axes of the carrier.
    pub(super) fn chord(&self, element: usize) -> Vec3 {
        let nodes = self.chain.nodes_of(element);
        let [from, to] = [&nodes[0], &nodes[nodes.len() - 1]].map(|node| self.carrier.sees(self.node(node).place));
        (to - from).normalized().unwrap_or(Vec3::ZERO)
    }

    /// The place of a candidate (global components).
    fn place(&self, candidate: &Candidate) -> Vec3 {
        self.place_in(candidate, self.at)
    }

    fn place_in(&self, candidate: &Candidate, at: &State) -> Vec3 {
        let nodes = self.chain.nodes_of(candidate.element);
        let places: Vec<Vec3> = nodes.iter().map(|node| node.place + at.q[node.node.u as usize]).collect();
        place_on(&places, candidate.s)
    }

    /// The factor on the stiffness of stick that a point needs.
    pub(super) fn needed_stick_factor(&self, point: &PointNow) -> f64 {
        let Some(law) = &point.law.friction else { return 0.0 };
        let limit = law.limit(point.state.normal_force.force);
        let element = point.candidate.element;
        let length = self.chain.element_length(element);
        self.laws.needed_stick_factor(limit, &self.chain.stiffness[element], length, self.chain.radius)
    }

    pub(super) fn slot_of(&self, candidate: &Candidate) -> Slot {
        let nodes = self.chain.nodes_of(candidate.element);
        let nearest = (candidate.s * self.chain.order as f64).round() as usize;
        nodes[nearest.min(nodes.len() - 1)].node.u
    }
}

impl PointNow<'_> {
    /// The work of friction since the last converged state.
    pub(super) fn friction_work(&self) -> f64 {
        self.candidate.weight * self.state.traction.work(&self.law.carried, self.state.normal)
    }
}
