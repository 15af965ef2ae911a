//! The role of contacts for pairs of beams.

use super::BeamPairs;
use super::point::{PairPoint, PairsNow, sort};
use crate::effect::contact::late_touch::{LateTouch, PointFriction};
use crate::effect::contact::laws::{ContactLaws, RELEVANT_FORCE};
use crate::effect::contact_role::TOLD_PENETRATION;
use crate::effect::{ContactChange, ContactResultant, ContactSurvey, Penetration};
use crate::kernel::Weights;
use crate::kernel::contact::Status;
use crate::system::{Assembler, ListedPair, PairPointKind, PairPointMemory, Slot, State};
use crate::tensor::Vec3;
use std::sync::Arc;

/// Penetrations between points with forces that are told, over those at such points, or over the allowed one.
const MOST_HIDDEN: f64 = 2.0;

/// Pairs of beams with the laws of their contacts.
#[derive(Clone, Copy)]
pub(in crate::effect::contact) struct PairRole<'a> {
    pub(crate) pairs: &'a BeamPairs,
    pub(crate) laws: &'a [ContactLaws],
}

impl<'a> PairRole<'a> {
    pub(super) fn now(self, at: &'a State) -> PairsNow<'a> {
        PairsNow::new(self.pairs, self.laws, at, &at.contacts.pairs.list)
    }

    fn each(self, at: &'a State, visit: &mut dyn FnMut(&PairPoint)) {
        self.now(at).each_point(Weights::NONE, &mut |point, _| visit(point));
    }

    pub(in crate::effect::contact) fn law_of(self, meeting: u32) -> &'a ContactLaws {
        &self.laws[self.pairs.contact_of(meeting as usize)]
    }

    fn acts(self, pair: &ListedPair, at: &State) -> bool {
        at.amplitude[self.law_of(pair.meeting).amplitude] != 0.0
    }

    pub(super) fn slot_of(self, pair: &ListedPair) -> Slot {
        self.pairs.nodes_of(pair)[0][0].node.u
    }

    /// Adds forces and tangent; instance `first` is the first pair.
    pub fn add(self, at: &State, list: &[ListedPair], weights: Weights, first: usize, out: &mut Assembler) {
        PairsNow::new(self.pairs, self.laws, at, list).each_point(weights, &mut |point, system| {
            if point.state.status() != Status::Open {
                out.add(first + point.number, system);
            }
        });
    }

    pub fn strain_of(self, at: &State, field: &[Vec3], length: f64) -> f64 {
        let mut largest = 0.0f64;
        self.each(at, &mut |point| {
            if point.state.status() == Status::Open {
                return;
            }
            let nodes = self.pairs.nodes_of(&point.pair);
            let moved = [0, 1].map(|side| {
                let of_nodes = nodes[side].iter().zip(point.shapes[side]);
                of_nodes.fold(Vec3::ZERO, |sum, (node, factor)| sum + field[node.node.u as usize] * factor)
            });
            let apart = moved[0] - moved[1];
            let sticks = point.state.status() == Status::Sticks;
            let strain = if sticks { apart.norm() } else { apart.dot(point.normal()).abs() };
            largest = largest.max(strain / length);
        });
        largest
    }

    /// Writes the points with a force into the memory of a state.
    pub fn remember(self, at: &mut State, accepts: bool) {
        let known = at.contacts.pairs.points.clone();
        let mut goes_on = vec![accepts; known.len()];
        let mut points = Vec::new();
        let now = self.now(at);
        now.each_point(Weights::NONE, &mut |point, _| {
            if point.state.normal_force.force > 0.0 {
                points.push(now.memory_of(point, accepts));
                point.successions().for_each(|number| goes_on[number] = true);
            }
        });
        let open = known.iter().zip(&goes_on).filter(|(_, goes_on)| !**goes_on);
        points.extend(open.filter_map(|(known, _)| Some(PairPointMemory { point: known.point.opened()?, ..*known })));
        sort(&mut points);
        at.contacts.pairs.points = Arc::new(points);
        if accepts && self.rubs() {
            at.contacts.pairs.nodes = Arc::new(self.pairs.poses(at));
        }
    }

    /// Makes the list of an accepted state.
    pub fn renew_list(self, before: &State, at: &mut State) {
        let mut memory = at.contacts.pairs.clone();
        self.pairs.renew_list(before, &mut memory, at);
        at.contacts.pairs = memory;
    }

    /// Lets points share what multipliers held.
    pub fn begin_penalty(self, at: &mut State) {
        at.contacts.pairs.points = Arc::new(self.now(at).holding_points());
    }

    /// The largest penetration of a pair in a balanced state. Straight elements side by side are held at the nodes of
    /// both, which leaves less freedom than the beams have: there it does not become smaller with motions.
    fn tolerance(self, pair: &ListedPair, way: f64) -> f64 {
        let may_lock = self.pairs.both(pair.meeting as usize).iter().all(|strand| strand.order == 1);
        self.law_of(pair.meeting).tolerance(if may_lock { f64::INFINITY } else { way })
    }

    /// Adds to what was found of other contacts in a balanced state, whose nodes have moved by up to `way`.
    pub fn survey(self, at: &State, way: f64, out: &mut ContactSurvey) {
        let mut largest = 0.0f64;
        self.each(at, &mut |point| largest = largest.max(point.state.normal_force.force));
        self.each(at, &mut |point| {
            let force = point.state.normal_force.force;
            let gap = point.state.gap;
            out.points += usize::from(force > 0.0);
            out.work_in_penetration += point.candidate.weight * force * self.law_of(point.pair.meeting).penetration;
            let is_relevant = gap < 0.0 || force > RELEVANT_FORCE * largest;
            let violation = gap.abs() / self.tolerance(&point.pair, way);
            if is_relevant && violation > out.violation {
                *out = ContactSurvey { violation, gap, slot: self.slot_of(&point.pair), ..*out };
            }
        });
    }

    /// The change of points with a force since the accepted state `before`.
    pub fn change(self, before: &State, at: &State) -> ContactChange {
        let known = &before.contacts.pairs.points;
        let now = self.now(at);
        let mut active = 0;
        let mut is_other = false;
        let mut slides = false;
        now.each_point(Weights::NONE, &mut |point, _| {
            if point.state.normal_force.force > 0.0 {
                active += 1;
                is_other = is_other || !now.is_among(point, known);
                slides = slides || point.state.status() == Status::Slides;
            }
        });
        if slides {
            ContactChange::Slides
        } else if is_other || active != known.len() {
            ContactChange::Touches
        } else {
            ContactChange::None
        }
    }

    /// Adds the friction of all points of a balanced state after the accepted state `before`.
    pub fn add_late(self, before: &State, at: &State, out: &mut LateTouch) {
        if !self.rubs() {
            return;
        }
        let earlier = PairsNow::new(self.pairs, self.laws, before, &at.contacts.pairs.list);
        let touched = |meeting: u32| before.contacts.pairs.points.iter().any(|point| point.meeting == meeting);
        self.each(at, &mut |point| {
            let meeting = point.pair.meeting;
            let was_apart = || !touched(meeting) && earlier.gap(&point.pair) > self.law_of(meeting).penetration;
            let friction = PointFriction::of(point.law.friction.as_ref(), &point.state, point.candidate.weight);
            out.add(self.pairs.contact_of(meeting as usize), friction, was_apart);
        });
    }

    /// Shows the listed pairs that act and penetrate, with their depth, a length, and the one that is allowed.
    fn each_penetration(self, at: &State, show: &mut dyn FnMut(&ListedPair, f64, f64)) {
        let now = self.now(at);
        for pair in now.list.iter().filter(|pair| self.acts(pair, at)) {
            if self.pairs.chord_gap(pair, &now.places) < 0.0 {
                show(pair, -now.gap(pair), self.law_of(pair.meeting).penetration);
            }
        }
    }

    /// The deepest penetration among listed pairs that act, if it is larger than `allowed` times that of
    /// the deck; `begins`: see [`Contacts::penetrates`](crate::effect::Contacts::penetrates).
    fn deepest(self, at: &State, allowed: f64, begins: &dyn Fn(usize) -> bool) -> Option<(ListedPair, f64)> {
        let mut deepest: Option<(ListedPair, f64)> = None;
        self.each_penetration(at, &mut |pair, depth, of_deck| {
            let is_deepest = deepest.is_none_or(|(_, deepest)| depth > deepest);
            if depth > allowed * of_deck && is_deepest && begins(self.law_of(pair.meeting).amplitude) {
                deepest = Some((*pair, depth));
            }
        });
        deepest
    }

    /// The deepest penetration of beams anywhere, over the one that is allowed; zero without one.
    fn deepest_over_allowed(self, at: &State) -> f64 {
        let mut deepest = 0.0f64;
        self.each_penetration(at, &mut |_, depth, allowed| deepest = deepest.max(depth / allowed));
        deepest
    }

    fn penetration_of(self, (pair, depth): (ListedPair, f64)) -> Penetration {
        let laws = self.law_of(pair.meeting);
        let second = self.pairs.meetings[pair.meeting as usize].strands[1];
        Penetration {
            contact: laws.name.clone(),
            surface: self.pairs.names[second].clone(),
            slot: self.slot_of(&pair),
            depth,
            allowed: laws.penetration,
        }
    }

    /// The deepest penetration, if it is larger than allowed.
    pub fn penetrates(self, at: &State, begins: &dyn Fn(usize) -> bool) -> Option<Penetration> {
        self.deepest(at, 1.0, begins).map(|found| self.penetration_of(found))
    }

    /// The deepest penetration, if it exceeds the allowed one by more than augmentations leave.
    pub fn hidden_penetration(self, at: &State) -> Option<Penetration> {
        self.deepest(at, TOLD_PENETRATION, &|_| true).map(|found| self.penetration_of(found))
    }

    /// A node of a pair whose centre lines may have crossed on the way.
    pub fn passed(self, from: &State, to: &State) -> Option<Slot> {
        let list = &from.contacts.pairs.list;
        if list.is_empty() {
            return None;
        }
        let [before, after] = [from, to].map(|at| self.pairs.places(at));
        let passes = |pair: &&ListedPair| {
            let [a, b] = self.pairs.both(pair.meeting as usize);
            let touching = a.radius + b.radius;
            // A fast approach from far away may come near, but for a tenth of the distance in contact.
            if self.pairs.least_part(pair, &before, &after, [0.0, touching]) < 1.0 {
                return true;
            }
            // An end may go past the other centre line: whoever was deeper on the way by half of that distance has gone
            // through material.
            let apart = [&before, &after].map(|places| self.pairs.chord_distance(pair, places));
            let least = apart[0].min(apart[1]).min(touching) - 0.5 * touching;
            least > 0.0 && self.pairs.least_part(pair, &before, &after, [least, touching]) < 1.0
        };
        list.iter().filter(|pair| self.acts(pair, to)).find(passes).map(|pair| self.slot_of(pair))
    }

    /// The part of an increment on which centre lines stay apart.
    pub fn safe_part(self, at: &State, increment: &[Vec3]) -> f64 {
        let list = &at.contacts.pairs.list;
        if list.is_empty() {
            return 1.0;
        }
        let before = self.pairs.places(at);
        let nodes = self.pairs.strands.iter().flat_map(|strand| &strand.nodes);
        let after: Vec<Vec3> = nodes.zip(&before).map(|(node, x)| *x + increment[node.node.u as usize]).collect();
        let part = |pair: &ListedPair| self.pairs.least_part(pair, &before, &after, [0.0, f64::INFINITY]);
        list.iter().filter(|pair| self.acts(pair, at)).map(part).fold(1.0, f64::min)
    }

    /// The energy of penalties in a dynamic stage.
    pub fn energy(self, at: &State) -> f64 {
        let mut energy = 0.0;
        self.each(at, &mut |point| energy += point.candidate.weight * point.law.normal.energy(point.state.gap));
        energy
    }

    /// Energy per time that damping takes.
    pub fn damping_power(self, at: &State) -> f64 {
        let mut power = 0.0;
        self.each(at, &mut |point| {
            let of_point = point.law.normal.damping_power(point.state.gap, point.state.normal_force.force);
            power += point.candidate.weight * of_point;
        });
        power
    }

    /// Notes the deepest penetration and the shortest contact of a time step.
    pub fn judge_penalty(self, at: &mut State) {
        let known = at.contacts.pairs.points.clone();
        let mut stays = vec![false; known.len()];
        let mut deepest = 0.0f64;
        self.each(at, &mut |point| {
            deepest = deepest.max(-point.state.gap / self.law_of(point.pair.meeting).penetration);
            if point.state.normal_force.force > 0.0 {
                point.successions().for_each(|number| stays[number] = true);
            }
        });
        let ended = known.iter().zip(&stays).filter(|(_, stays)| !**stays).map(|(point, _)| point.point.steps);
        let between = Some(self.deepest_over_allowed(at)).filter(|between| *between > MOST_HIDDEN * deepest.max(1.0));
        let contacts = &mut at.contacts;
        contacts.deepest = contacts.deepest.max(deepest);
        contacts.deepest_between = contacts.deepest_between.max(between.unwrap_or_default());
        contacts.shortest = contacts.shortest.into_iter().chain(ended.filter(|&steps| steps > 0)).min();
    }

    /// Adds the forces of a contact in an accepted state: on the first party, none where a beam
    /// meets itself.
    pub fn add_resultant(self, number: usize, at: &State, sum: &mut ContactResultant) {
        let memory = &at.contacts.pairs;
        sum.gap = sum.gap.min(self.pairs.least_gap_of(self, number, at));
        for point in memory.points.iter().filter(|point| self.pairs.contact_of(point.meeting as usize) == number) {
            let meeting = &self.pairs.meetings[point.meeting as usize];
            let [first, _] = self.pairs.both(point.meeting as usize);
            sum.normal += point.point.weight * point.point.force;
            sum.friction += point.point.weight * point.point.carried.force.norm();
            sum.points += 1;
            sum.sliding += usize::from(point.point.carried.slides);
            if !meeting.is_own() {
                sum.force += point.point.push;
                sum.moment += point.point.at.cross(point.point.push);
            }
            let share = first.share(point.point.place);
            sum.length += match point.kind {
                PairPointKind::Closest => point.point.weight * share,
                PairPointKind::NodeOfFirst => 2.0 * point.point.weight * share,
                PairPointKind::NodeOfSecond => 0.0,
            };
        }
    }

    /// Normal force and friction per length on a beam at a part of its length: of nodes, and linear
    /// between them.
    pub fn force_along(self, beam: usize, fraction: f64, at: &State) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for (number, strand) in self.pairs.strands.iter().enumerate().filter(|(_, strand)| strand.beam == Some(beam)) {
            let place = strand.along(fraction) * strand.order as f64;
            let before = place.floor();
            let part = place - before;
            for (node, factor) in [(before, 1.0 - part), (before + 1.0, part)] {
                if factor > 0.0 {
                    let force = self.force_at_node(number, node, at);
                    sum = [0, 1].map(|k| sum[k] + factor * force[k]);
                }
            }
        }
        sum
    }

    /// Normal force and friction per length at a node of a strand, by its number there: linear shape
    /// functions distribute the forces of points to the nodes beside them.
    fn force_at_node(self, number: usize, node: f64, at: &State) -> [f64; 2] {
        let strand = &self.pairs.strands[number];
        let order = strand.order as f64;
        let mut forces = [0.0; 2];
        for point in &*at.contacts.pairs.points {
            let strands = self.pairs.meetings[point.meeting as usize].strands;
            for (side, place) in [point.point.place, point.on_second].into_iter().enumerate() {
                if strands[side] == number {
                    let near = (1.0 - order * strand.shift(place, node / order)).max(0.0);
                    forces[0] += point.point.weight * point.point.force * near;
                    forces[1] += point.point.weight * point.point.carried.force.norm() * near;
                }
            }
        }
        forces.map(|force| force / strand.share(node / order))
    }
}
