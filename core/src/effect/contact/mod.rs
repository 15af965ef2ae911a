//! Contact of beams and bodies with rigid surfaces, of beams with beams, and with themselves.
//!
//! Forces and tangents are those of [`crate::kernel::contact`]. This effect finds the points, gives
//! them the multipliers and tractions of the memory in the state, and writes that memory when a
//! state is accepted.

mod aside;
mod chain;
mod chain_now;
mod late_touch;
mod laws;
mod pairs;
mod passing;
mod predecessors;
mod resultant;
mod shown;
mod strand;
mod surface;

pub use chain::Chain;
pub use laws::ContactLaws;
pub use pairs::{BeamPairs, Meeting};
pub use shown::{ContactParty, NodeContact, NodeContacts};
pub use strand::{ChainNode, Strand};
pub use surface::{SceneSurface, SurfaceCarrier};

use super::{
    ContactChange, ContactResultant, ContactSurvey, Contacts, DrivenCoordinates, Effect, ElasticStick, Missed,
    Penetration, Roles, RubbingPoint, TOLD_PENETRATION, TangentForm,
};
use crate::kernel::Weights;
use crate::kernel::contact::Status;
use crate::system::{
    Assembler, Category, ChainMemory, Connectivity, ContactRegime, ListedPair, Memory, MirrorData, PointMemory, Slot,
    State,
};
use crate::tensor::Vec3;
use chain_now::{ChainNow, before_of};
use late_touch::{LateTouch, PointFriction};
use laws::RELEVANT_FORCE;
use pairs::PairRole;
use std::sync::Arc;

/// Factor of the first stiffness of points that are held in modal stages: about that of elements.
const HELD: f64 = 1e4;

/// The name of the effect
pub const NAME: &str = "contact";

/// The angle, in radians, by which a prescribed rotation may turn a surface in one step past beams
/// that rub on it: the way of sliding is the chord of the true one, 1 % shorter for this angle.
const LARGEST_TURN_IN_FRICTION: f64 = 0.25;

/// The same where beams are near and none rubs on the surface: they are looked for along chords.
const LARGEST_TURN_NEARBY: f64 = 1.0;

/// The cosine between a force and an element up to which it pushes the element aside.
const MOST_ALONG: f64 = 0.8;

/// All contacts with rigid surfaces, and of beams with each other.
#[derive(Clone, Debug, Default)]
pub struct SurfaceContacts {
    /// The contacts
    pub laws: Vec<ContactLaws>,
    /// The surfaces
    pub surfaces: Vec<SceneSurface>,
    /// Beams and bodies, each against one surface
    pub chains: Vec<Chain>,
    /// Beams that may touch each other
    pub pairs: BeamPairs,
}

impl SurfaceContacts {
    /// The nodes of all beams that may touch something.
    pub fn nodes_of_beams(&self) -> impl Iterator<Item = crate::system::Node> {
        let chains = self.chains.iter().map(|chain| &chain.strand);
        let beams = chains.chain(self.pairs.strands()).filter(|strand| strand.beam.is_some());
        beams.flat_map(|strand| strand.nodes.iter().map(|at| at.node))
    }

    /// Chains whose contact acts in a state, with its laws and the surface.
    fn acting<'a>(&'a self, at: &'a State) -> impl Iterator<Item = (&'a Chain, &'a ContactLaws, &'a SceneSurface)> {
        let with_parts = |chain: &'a Chain| (chain, &self.laws[chain.contact], &self.surfaces[chain.surface]);
        self.chains.iter().map(with_parts).filter(|(_, laws, _)| at.amplitude[laws.amplitude] != 0.0)
    }

    /// True if a chain may touch its surface in a state, or touched it before, and its contact acts.
    fn is_near(&self, number: usize, at: &State) -> bool {
        let chain = &self.chains[number];
        at.contacts.clearance(number).is_none()
            && at.amplitude[self.laws[chain.contact].amplitude] != 0.0
            && (at.contacts.has_points(number) || chain.clearance(&self.surfaces[chain.surface], at).is_none())
    }

    /// Visits the chains that may touch their surfaces in a state, or touched them before.
    fn each_chain<'a>(&'a self, at: &'a State, weights: Weights, visit: &mut dyn FnMut(usize, &ChainNow<'a>)) {
        for number in (0..self.chains.len()).filter(|&number| self.is_near(number, at)) {
            visit(number, &self.chain_now(number, at, weights));
        }
    }

    fn chain_now<'a>(&'a self, number: usize, at: &'a State, weights: Weights) -> ChainNow<'a> {
        let chain = &self.chains[number];
        let surface = &self.surfaces[chain.surface];
        let carrier = surface.carrier(at, weights);
        let memory = at.contacts.chains.get(number);
        let candidates = chain.candidates(&surface.surface, &carrier, memory, at);
        let predecessors = chain.predecessors(&candidates, memory);
        ChainNow { chain, laws: &self.laws[chain.contact], surface, carrier, memory, at, candidates, predecessors }
    }

    /// The pairs of beams with the laws of their contacts.
    fn pairs(&self) -> PairRole<'_> {
        PairRole { pairs: &self.pairs, laws: &self.laws }
    }

    /// The number of the first instance of a chain.
    fn first_instance(&self, number: usize) -> usize {
        self.chains[..number].iter().map(Chain::instances).sum()
    }

    /// True if no chain touches, or touched, and none has friction, which follows nodes that do not
    /// touch, unless it is put aside: there is nothing to remember.
    fn is_clear(&self, at: &State) -> bool {
        let is_far = |chain: &Chain| {
            !self.laws[chain.contact].rubs() && chain.clearance(&self.surfaces[chain.surface], at).is_some()
        };
        let is_clear = |number: usize| at.contacts.clearance(number).is_some() || is_far(&self.chains[number]);
        self.pairs.is_empty() && !at.contacts.touches() && (0..self.chains.len()).all(is_clear)
    }

    /// Writes a new memory of all contacts.
    fn remember(&self, at: &mut State, accepts: bool) {
        let mut chains = vec![ChainMemory::default(); self.chains.len()];
        for (number, chain) in self.chains.iter().enumerate() {
            let old = at.contacts.chains.get(number);
            let new = &mut chains[number];
            if accepts && self.laws[chain.contact].rubs() && at.contacts.clearance(number).is_none() {
                let carrier = self.surfaces[chain.surface].carrier(at, Weights::NONE);
                new.nodes = chain.nodes.iter().map(|node| before_of(node, &carrier, at)).collect();
            } else if let Some(old) = old {
                new.nodes.clone_from(&old.nodes);
            }
            if self.is_near(number, at) {
                new.points = self.chain_now(number, at, Weights::NONE).points(accepts);
            }
        }
        at.contacts.chains = Arc::new(chains);
        self.pairs().remember(at, accepts);
    }

    /// Gives each point in memory the weight and the stiffness of its candidate in the stage that begins: its force
    /// stays.
    fn share_held(&self, at: &mut State) {
        let mut chains = (*at.contacts.chains).clone();
        for (number, memory) in chains.iter_mut().enumerate().filter(|(number, _)| self.is_near(*number, at)) {
            let chain = self.chain_now(number, at, Weights::NONE);
            for (candidate, predecessors) in chain.candidates.iter().zip(&chain.predecessors) {
                if let Some(own) = predecessors.own {
                    memory.points[own].reweigh(candidate.weight);
                    memory.points[own].stiffness = self.chains[number].stiffness[candidate.element];
                }
            }
        }
        at.contacts.chains = Arc::new(chains);
    }

    /// The energy of elastic stick of the points in memory.
    fn stick_energy(&self, at: &State) -> f64 {
        self.energy_of_springs(at, &|_, point| point.carried.force.squared())
    }

    /// The energy of the springs of points in memory, with the squares of their forces.
    fn energy_of_springs(&self, at: &State, squared: &dyn Fn(&ContactLaws, &PointMemory) -> f64) -> f64 {
        let mut energy = 0.0;
        self.each_spring(at, &mut |chain, point, stiffness| {
            energy += point.weight * squared(&self.laws[chain.contact], point) / (2.0 * stiffness);
        });
        energy + self.pairs().energy_of_springs(at, squared)
    }

    /// Shows the points in memory of chains with friction, with the stiffness K_t of stick.
    fn each_spring(&self, at: &State, show: &mut dyn FnMut(&Chain, &PointMemory, f64)) {
        for (chain, memory) in self.chains.iter().zip(&*at.contacts.chains) {
            let laws = &self.laws[chain.contact];
            let points = if laws.rubs() { &memory.points[..] } else { &[] };
            for point in points {
                show(chain, point, laws.stick_stiffness(chain.contact, &point.stiffness, &at.contacts));
            }
        }
    }

    /// The length of beams with a force, or without one between points that have some, as where a
    /// beam lies flat.
    fn length_in_contact(&self, number: usize, at: &State) -> f64 {
        let mut length = 0.0;
        self.each_chain(at, Weights::NONE, &mut |_, chain| {
            if chain.chain.contact != number {
                return;
            }
            // Length without force since the last point with one, if all of it is near.
            let mut between: Option<f64> = None;
            chain.each_point(Weights::NONE, &mut |point, _| {
                let share = chain.chain.share(point.candidate.along());
                if point.partner.is_some() {
                    length += share + between.unwrap_or_default();
                    between = Some(0.0);
                } else if point.state.gap <= chain.laws.penetration {
                    between = between.map(|length| length + share);
                } else {
                    between = None;
                }
            });
        });
        length
    }

    /// Changes the memory of all points with a force.
    fn change_points(&self, at: &mut State, change: impl Fn(&mut PointMemory)) {
        let mut chains = (*at.contacts.chains).clone();
        chains.iter_mut().flat_map(|memory| &mut memory.points).for_each(&change);
        at.contacts.chains = Arc::new(chains);
        let mut points = (*at.contacts.pairs.points).clone();
        points.iter_mut().for_each(|known| change(&mut known.point));
        at.contacts.pairs.points = Arc::new(points);
    }

    /// Notes the deepest penetration and the shortest contact of a time step.
    fn judge_penalty(&self, at: &mut State) {
        let mut deepest = 0.0f64;
        let mut shortest: Option<u32> = None;
        self.each_chain(at, Weights::NONE, &mut |_, chain| {
            let mut stays = vec![false; chain.memory.map_or(0, |memory| memory.points.len())];
            chain.each_point(Weights::NONE, &mut |point, _| {
                deepest = deepest.max(-point.state.gap / chain.laws.penetration);
                if point.state.normal_force.force > 0.0 {
                    point.predecessors.all().for_each(|number| stays[number] = true);
                }
            });
            let points = chain.memory.map_or(&[][..], |memory| &memory.points);
            let ended = points.iter().zip(&stays).filter(|(_, stays)| !**stays).map(|(point, _)| point.steps);
            shortest = shortest.into_iter().chain(ended.filter(|&steps| steps > 0)).min();
        });
        let contacts = &mut at.contacts;
        contacts.deepest = contacts.deepest.max(deepest);
        contacts.shortest = contacts.shortest.into_iter().chain(shortest).min();
        self.pairs().judge_penalty(at);
    }

    /// A node at a point that may be on a wrong side of its surface: one on the axis of a body, where no force
    /// pushes it out; one with friction whose normal has turned over since the last converged state `from`; after
    /// a time step also one that is nearer to the middle of the surface than to its face, from where it may come
    /// out on another side, or that has come out.
    fn strayed(&self, from: &State, at: &State) -> Option<Slot> {
        let is_penalty = at.contacts.regime == ContactRegime::Penalty;
        let may_sink = |chain: &Chain| is_penalty && self.surfaces[chain.surface].depth().is_finite();
        let may_stray = |chain: &Chain| may_sink(chain) || self.laws[chain.contact].rubs();
        let may_lose = |chain: &Chain| self.surfaces[chain.surface].surface.may_lose_points();
        let mut strayed = None;
        let looked_at = |chain: &Chain| may_lose(chain) || may_stray(chain);
        for number in (0..self.chains.len()).filter(|&k| looked_at(&self.chains[k]) && self.is_near(k, at)) {
            let chain = self.chain_now(number, at, Weights::NONE);
            if let Some(slot) = chain.without_normal() {
                return Some(slot);
            }
            if !may_stray(chain.chain) {
                continue;
            }
            let sinks = may_sink(chain.chain);
            chain.each_point(Weights::NONE, &mut |point, _| {
                if point.state.traction.turned_over || (sinks && chain.has_sunk(point, from)) {
                    strayed = Some(chain.slot_of(point.candidate));
                }
            });
        }
        strayed
    }

    /// A slot of an element that crosses a box or a mesh, and that no point pushes out: a force along the element, as
    /// of a node on the next face, does not.
    fn crossing(&self, number: usize, at: &State) -> Option<Slot> {
        let (chain, surface) = (&self.chains[number], &self.surfaces[self.chains[number].surface]);
        if !surface.surface.is_faceted() || !self.is_near(number, at) {
            return None;
        }
        let crossings = chain.crossings(&surface.surface, &surface.carrier(at, Weights::NONE), at);
        if crossings.is_empty() {
            return None;
        }
        let mut pushed = Vec::new();
        let now = self.chain_now(number, at, Weights::NONE);
        now.each_point(Weights::NONE, &mut |point, _| {
            let element = point.candidate.element;
            let is_across = || now.chord(element).dot(point.state.normal).abs() < MOST_ALONG;
            pushed.extend((point.state.normal_force.force > 0.0 && is_across()).then_some(element));
        });
        let lost = crossings.into_iter().find(|crossing| !pushed.contains(&crossing.element))?;
        Some(chain.nodes_of(lost.element)[0].node.u)
    }

    fn damping_power(&self, at: &State) -> f64 {
        let mut power = 0.0;
        if at.contacts.regime == ContactRegime::Penalty && self.laws.iter().any(|laws| laws.damping != 0.0) {
            self.each_chain(at, Weights::NONE, &mut |_, chain| {
                chain.each_point(Weights::NONE, &mut |point, _| {
                    let of_point = point.law.normal.damping_power(point.state.gap, point.state.normal_force.force);
                    power += point.candidate.weight * of_point;
                });
            });
            power += self.pairs().damping_power(at);
        }
        power
    }
}

impl Effect for SurfaceContacts {
    fn name(&self) -> &'static str {
        NAME
    }

    fn category(&self) -> Category {
        Category::Internal
    }

    fn connectivity(&self) -> Connectivity {
        let mut connectivity = Connectivity::default();
        for chain in &self.chains {
            let carrier = self.surfaces[chain.surface].slots();
            let blocks = self.laws[chain.contact].blocks_of_node();
            for nodes in chain.nodes_of_instances() {
                let slots = nodes.iter().flat_map(|node| node.slots(blocks));
                connectivity.push(slots.chain(carrier.into_iter().flatten()));
            }
        }
        connectivity
    }

    fn connectivity_with(&self, pairs: &[ListedPair]) -> Connectivity {
        let mut connectivity = self.connectivity();
        for pair in pairs {
            let blocks = self.pairs().law_of(pair.meeting).blocks_of_node();
            connectivity.push(self.pairs.slots(pair, blocks));
        }
        connectivity
    }

    fn tangent(&self) -> TangentForm {
        let damps = |laws: &ContactLaws| laws.damping != 0.0;
        TangentForm::symmetric(!self.laws.iter().any(|laws| laws.rubs() || damps(laws)))
    }

    fn mirror_data(&self, show: &mut dyn FnMut(MirrorData)) {
        for chain in &self.chains {
            self.surfaces[chain.surface].mirror_data(chain.nodes[0].place, show);
            chain.nodes.iter().filter(|_| chain.beam.is_none()).for_each(|node| show(MirrorData::Place(node.place)));
        }
    }

    fn add(&self, at: &State, memory: &Memory, weights: Weights, out: &mut Assembler) {
        if !self.pairs.is_empty() {
            self.pairs().add(at, &memory.pairs, weights, self.first_instance(self.chains.len()), out);
        }
        self.each_chain(at, weights, &mut |number, chain| {
            let first = self.first_instance(number);
            chain.each_point(weights, &mut |point, system| {
                if point.state.status() != Status::Open {
                    out.add(first + chain.chain.instance_of(point.candidate), system);
                }
            });
        });
    }

    fn strain_of(&self, at: &State, field: &[Vec3], length: f64) -> f64 {
        let mut largest = 0.0f64;
        self.each_chain(at, Weights::NONE, &mut |_, chain| {
            chain.each_point(Weights::NONE, &mut |point, _| {
                if point.state.status() == Status::Open {
                    return;
                }
                let nodes = chain.chain.nodes_of(point.candidate.element);
                let nearest = (point.candidate.s * chain.chain.order as f64).round() as usize;
                let moved = field[nodes[nearest.min(nodes.len() - 1)].node.u as usize];
                let carried = chain.surface.slots().map_or(Vec3::ZERO, |[u, _]| field[u as usize]);
                let seen = chain.carrier.rotation.r.transpose_mul(moved - carried);
                let sticks = point.state.status() == Status::Sticks;
                let strain = if sticks { seen.norm() } else { seen.dot(point.state.normal).abs() };
                largest = largest.max(strain / length);
            });
        });
        largest.max(self.pairs().strain_of(at, field, length))
    }

    fn roles(&self) -> Roles<'_> {
        let is_driven = |surface: &SceneSurface| {
            matches!(surface.carrier, SurfaceCarrier::Shift { .. } | SurfaceCarrier::Turn { .. })
        };
        let driven: Option<&dyn DrivenCoordinates> =
            if self.surfaces.iter().any(is_driven) { Some(self) } else { None };
        Roles { contacts: Some(self), driven, ..Roles::NONE }
    }
}

impl DrivenCoordinates for SurfaceContacts {
    fn act_at_once(&self) -> bool {
        false
    }

    fn drives(&self, at: &State, _origin: Option<&State>, show: &mut dyn FnMut(f64, f64)) {
        for (number, chain) in self.chains.iter().enumerate() {
            let surface = &self.surfaces[chain.surface];
            let Some((amplitude, _)) = surface.driven(at, Vec3::ZERO, Vec3::ZERO) else { continue };
            let points = at.contacts.chains.get(number).map_or(&[][..], |memory| &memory.points);
            let of_point = |point: &PointMemory| surface.driven(at, point.push, point.at).map_or(0.0, |(_, f)| f);
            show(amplitude, points.iter().map(of_point).sum());
        }
    }
}

impl Contacts for SurfaceContacts {
    fn rubs(&self) -> bool {
        self.laws.iter().any(ContactLaws::rubs)
    }

    fn friction_work(&self, at: &State) -> f64 {
        let mut work = 0.0;
        if self.rubs() {
            self.each_chain(at, Weights::NONE, &mut |_, chain| {
                chain.each_point(Weights::NONE, &mut |point, _| work += point.friction_work());
            });
            work += self.pairs().friction_work(at);
        }
        work
    }

    fn rubbing(&self, at: &State) -> Vec<RubbingPoint> {
        let mut points = Vec::new();
        if self.rubs() {
            self.each_chain(at, Weights::NONE, &mut |number, chain| {
                chain.each_point(Weights::NONE, &mut |point, _| {
                    let place = (number, point.candidate.along());
                    let of_law = |law| RubbingPoint::of(place, &law, point.law.weight, point.state);
                    points.extend(point.law.friction.map(of_law));
                });
            });
            self.pairs().add_rubbing(at, self.chains.len(), &mut points);
        }
        points
    }

    fn needed_stick_factors(&self, at: &State) -> Vec<f64> {
        let mut needed = vec![0.0; self.laws.len()];
        if self.rubs() {
            self.each_chain(at, Weights::NONE, &mut |_, chain| {
                let of_contact: &mut f64 = &mut needed[chain.chain.contact];
                chain.each_point(Weights::NONE, &mut |point, _| {
                    *of_contact = of_contact.max(chain.needed_stick_factor(point));
                });
            });
            self.pairs().add_needed_stick_factors(at, &mut needed);
        }
        needed
    }

    fn largest_displacement(&self, at: &State) -> f64 {
        let strands = self.chains.iter().map(|chain| &chain.strand).chain(self.pairs.strands());
        let moved = strands.flat_map(|strand| &strand.nodes).map(|node| at.q[node.node.u as usize].squared());
        moved.fold(0.0, f64::max).sqrt()
    }

    fn survey(&self, at: &State, way: f64) -> ContactSurvey {
        let mut out = ContactSurvey::default();
        let mut largest_force = 0.0f64;
        // Of each point the force, the gap, that over what is allowed, and a slot.
        let mut points = Vec::new();
        self.each_chain(at, Weights::NONE, &mut |_, chain| {
            chain.each_point(Weights::NONE, &mut |point, _| {
                let (force, gap) = (point.state.normal_force.force, point.state.gap);
                largest_force = largest_force.max(force);
                out.points += usize::from(force > 0.0);
                out.work_in_penetration += force * chain.laws.penetration;
                if gap < 0.0 || force > 0.0 {
                    points.push((force, gap, gap.abs() / chain.laws.tolerance(way), chain.slot_of(point.candidate)));
                }
            });
        });
        for (force, gap, violation, slot) in points {
            let is_relevant = gap < 0.0 || force > RELEVANT_FORCE * largest_force;
            if is_relevant && violation > out.violation {
                (out.violation, out.gap, out.slot) = (violation, gap, slot);
            }
        }
        self.pairs().survey(at, way, &mut out);
        out
    }

    fn list_pairs(&self, at: &mut State) {
        if at.contacts.pairs.places.is_empty() && !self.pairs.is_empty() {
            at.contacts.pairs = self.pairs.list(at);
        }
    }

    fn list_missed(&self, from: &mut State, to: &mut State) -> Missed {
        let of_pairs = if self.pairs.is_empty() { Missed::None } else { self.pairs.add_missed(from, to) };
        match of_pairs {
            Missed::TooMany(_) | Missed::Listed(_) => of_pairs,
            Missed::None => self.put_aside(from, to),
        }
    }

    fn look_for(&self, from: &mut State, to: &State) -> Option<Slot> {
        let clearances = self.clearances(to);
        self.look_again(from, to, &clearances)
    }

    fn look_everywhere(&self, at: &mut State) {
        self.look_at(&self.aside(at), at);
        at.contacts.clearances = Arc::default();
    }

    fn safe_part(&self, at: &State, increment: &[Vec3]) -> f64 {
        self.pairs().safe_part(at, increment)
    }

    fn augment(&self, at: &mut State) {
        self.remember(at, false);
    }

    fn hold(&self, at: &mut State) {
        at.contacts.factor = HELD;
        self.change_points(at, |point| {
            point.multiplier = point.force + point.stiffness.augmented * HELD * point.gap;
        });
    }

    fn begin_augmented(&self, at: &mut State) {
        at.contacts.regime = ContactRegime::Augmented;
        self.share_held(at);
    }

    fn begin_penalty(&self, at: &mut State) {
        at.contacts.deepest = 0.0;
        at.contacts.deepest_between = 0.0;
        at.contacts.shortest = None;
        let before = Contacts::energy(self, at);
        at.contacts.regime = ContactRegime::Penalty;
        self.share_held(at);
        self.pairs().begin_penalty(at);
        self.change_points(at, |point| {
            point.offset = point.force / point.stiffness.penalty + point.gap;
            point.steps = 0;
        });
        at.contacts.taken_over = Contacts::energy(self, at) - before;
    }

    fn begin_motion(&self, at: &mut State) {
        if at.contacts.touches() {
            return;
        }
        self.remember(at, true);
        // None of them has lasted a step.
        self.change_points(at, |point| point.steps = 0);
        at.contacts.damping_power = self.damping_power(at);
    }

    fn accept(&self, before: &State, at: &mut State) {
        at.contacts.is_clear = self.is_clear(at);
        if at.contacts.is_clear && at.contacts.damping_power == 0.0 {
            at.contacts.factor = at.contacts.first_factor;
            return;
        }
        if at.contacts.regime == ContactRegime::Penalty {
            self.judge_penalty(at);
        }
        let work = self.friction_work(at);
        self.remember(at, true);
        // What friction has taken is its work, less what elastic stick has stored.
        let dissipated = self.stick_energy(before) - work - self.stick_energy(at);
        let power = self.damping_power(at);
        let passed = at.time - before.time;
        at.contacts.dissipated += dissipated + 0.5 * (at.contacts.damping_power + power) * passed;
        at.contacts.damping_power = power;
        at.contacts.factor = at.contacts.first_factor;
        if !self.pairs.is_empty() {
            self.pairs().renew_list(before, at);
        }
    }

    fn change(&self, before: &State, at: &State) -> ContactChange {
        let mut change = ContactChange::None;
        self.each_chain(at, Weights::NONE, &mut |number, chain| {
            let memory = before.contacts.chains.get(number);
            let mut active = Vec::new();
            let mut slides = Vec::new();
            chain.each_point(Weights::NONE, &mut |point, _| {
                if point.state.normal_force.force > 0.0 {
                    active.push(*point.candidate);
                    slides.push(point.state.status() == Status::Slides);
                }
            });
            let predecessors = chain.chain.predecessors(&active, memory);
            let is_new = predecessors.iter().any(|predecessors| predecessors.own.is_none());
            let is_other = active.len() != memory.map_or(0, |memory| memory.points.len());
            if slides.contains(&true) {
                change = ContactChange::Slides;
            } else if change == ContactChange::None && (is_other || is_new) {
                change = ContactChange::Touches;
            }
        });
        match self.pairs().change(before, at) {
            ContactChange::None => change,
            ContactChange::Slides => ContactChange::Slides,
            ContactChange::Touches if change == ContactChange::None => ContactChange::Touches,
            ContactChange::Touches => change,
        }
    }

    fn touches_late(&self, before: &State, at: &State) -> bool {
        let mut late = LateTouch::new(self.laws.len());
        self.each_chain(at, Weights::NONE, &mut |number, chain| {
            if !chain.laws.rubs() {
                return;
            }
            // A point of a contact that goes on has come along the beam.
            let touched = before.contacts.has_points(number);
            chain.each_point(Weights::NONE, &mut |point, _| {
                let was_apart = || !touched && chain.gap_in(point.candidate, before) > chain.laws.penetration;
                let friction = PointFriction::of(point.law.friction.as_ref(), point.state, point.candidate.weight);
                late.add(chain.chain.contact, friction, was_apart);
            });
        });
        self.pairs().add_late(before, at, &mut late);
        late.is_decisive()
    }

    fn penetrates(&self, at: &State, begins: &dyn Fn(usize) -> bool) -> Option<Penetration> {
        let mut deepest: Option<Penetration> = None;
        self.each_chain(at, Weights::NONE, &mut |_, chain| {
            if !begins(chain.laws.amplitude) {
                return;
            }
            chain.each_point(Weights::NONE, &mut |point, _| {
                let depth = -point.state.gap;
                let is_deepest = deepest.as_ref().is_none_or(|deepest| depth > deepest.depth);
                if depth > chain.laws.penetration && is_deepest {
                    deepest = Some(penetration(chain.laws, chain.surface, chain.slot_of(point.candidate), depth));
                }
            });
        });
        for (chain, laws, surface) in self.acting(at).filter(|(_, laws, _)| begins(laws.amplitude)) {
            let carrier = surface.carrier(at, Weights::NONE);
            let lost = chain.lost_node(&surface.surface, &carrier, at, laws.penetration);
            let crossing = || {
                let first = chain.crossings(&surface.surface, &carrier, at).into_iter().next()?;
                Some((first.element * chain.order, first.depth))
            };
            let Some((node, depth)) = lost.or_else(crossing) else { continue };
            if deepest.as_ref().is_none_or(|deepest| depth > deepest.depth) {
                let slot = chain.nodes[node].node.u;
                deepest = Some(penetration(laws, surface, slot, depth));
            }
        }
        deeper(deepest, self.pairs().penetrates(at, begins))
    }

    fn hidden_penetration(&self, at: &State) -> Option<Penetration> {
        let mut deepest: Option<Penetration> = None;
        for number in (0..self.chains.len()).filter(|&number| self.is_near(number, at)) {
            let chain = &self.chains[number];
            let (laws, surface) = (&self.laws[chain.contact], &self.surfaces[chain.surface]);
            let depth = -chain.least_gap(&surface.surface, &surface.carrier(at, Weights::NONE), at);
            let is_deepest = deepest.as_ref().is_none_or(|deepest| depth > deepest.depth);
            if depth > TOLD_PENETRATION * laws.penetration && is_deepest {
                let slot = chain.nodes[chain.nodes.len() / 2].node.u;
                deepest = Some(penetration(laws, surface, slot, depth));
            }
        }
        deeper(deepest, self.pairs().hidden_penetration(at))
    }

    fn driven_surfaces(&self, at: &State, show: &mut dyn FnMut(&str, usize, bool)) {
        let acts = |number: &usize| self.acting(at).any(|(chain, ..)| chain.surface == *number);
        for number in (0..self.surfaces.len()).filter(acts) {
            let SceneSurface { name, carrier, .. } = &self.surfaces[number];
            match *carrier {
                SurfaceCarrier::Ground | SurfaceCarrier::Node { .. } => {}
                SurfaceCarrier::Shift { amplitude, .. } => show(name, amplitude, false),
                SurfaceCarrier::Turn { amplitude, .. } => show(name, amplitude, true),
            }
        }
    }

    fn turned(&self, from: &[f64], at: &State) -> Option<(&str, f64)> {
        let too_far = |number: usize| {
            let chain = &self.chains[number];
            let surface = &self.surfaces[chain.surface];
            let angle = surface.turned(from, &at.amplitude);
            if angle <= LARGEST_TURN_IN_FRICTION || !self.is_near(number, at) {
                return None;
            }
            let rubs = at.contacts.has_points(number) && self.laws[chain.contact].rubs();
            (rubs || angle > LARGEST_TURN_NEARBY).then_some((surface.name.as_str(), angle))
        };
        (0..self.chains.len()).find_map(too_far)
    }

    fn passed(&self, from: &State, to: &State) -> Option<Slot> {
        let looked_at = || (0..self.chains.len()).filter(|&number| to.contacts.clearance(number).is_none());
        let of_chain = |number: usize| {
            let chain = &self.chains[number];
            let acts = to.amplitude[self.laws[chain.contact].amplitude] != 0.0;
            let node = passing::passed(chain, &self.surfaces[chain.surface], from, to).filter(|_| acts)?;
            Some(chain.nodes[node].node.u)
        };
        let of_surfaces = looked_at().find_map(of_chain).or_else(|| self.strayed(from, to));
        let of_surfaces = of_surfaces.or_else(|| looked_at().find_map(|number| self.crossing(number, to)));
        of_surfaces.or_else(|| self.pairs().turned_over(to)).or_else(|| self.pairs().passed(from, to))
    }

    fn energy(&self, at: &State) -> f64 {
        if at.contacts.is_clear {
            return 0.0;
        }
        let mut energy = self.stick_energy(at);
        if at.contacts.regime == ContactRegime::Penalty {
            self.each_chain(at, Weights::NONE, &mut |_, chain| {
                chain.each_point(Weights::NONE, &mut |point, _| {
                    energy += point.candidate.weight * point.law.normal.energy(point.state.gap);
                });
            });
            energy += self.pairs().energy(at);
        }
        energy
    }

    fn energy_of_holds(&self, at: &State) -> f64 {
        self.energy_of_springs(at, &|_, point| if point.sticks() { point.carried.force.squared() } else { 0.0 })
    }

    fn energy_of_friction(&self, at: &State) -> [f64; 2] {
        let limit = |laws: &ContactLaws, point: &PointMemory| laws.largest_friction() * point.force;
        [self.stick_energy(at), self.energy_of_springs(at, &|laws, point| limit(laws, point).powi(2))]
    }

    fn softest_stick(&self, at: &State) -> Option<ElasticStick> {
        let mut softest = None;
        self.each_spring(at, &mut |chain, point, stiffness| {
            if point.sticks() {
                let way = point.carried.force.norm() / stiffness;
                ElasticStick::compare(&mut softest, &self.laws[chain.contact].name, way, chain.radius);
            }
        });
        self.pairs().add_softest_stick(at, &mut softest);
        softest
    }

    fn resultant(&self, number: usize, at: &State) -> ContactResultant {
        let mut sum = ContactResultant {
            length: self.length_in_contact(number, at),
            ..resultant::resultant(&self.chains, &self.surfaces, number, at)
        };
        self.pairs().add_resultant(number, at, &mut sum);
        sum
    }

    fn force_along(&self, beam: usize, fraction: f64, at: &State) -> [f64; 2] {
        let [normal, friction] = resultant::force_along(&self.chains, beam, fraction, at);
        let of_pairs = self.pairs().force_along(beam, fraction, at);
        [normal + of_pairs[0], friction + of_pairs[1]]
    }
}

/// A penetration into a surface.
fn penetration(laws: &ContactLaws, surface: &SceneSurface, slot: Slot, depth: f64) -> Penetration {
    Penetration { contact: laws.name.clone(), surface: surface.name.clone(), slot, depth, allowed: laws.penetration }
}

/// The deeper one of two penetrations.
fn deeper(a: Option<Penetration>, b: Option<Penetration>) -> Option<Penetration> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.depth > a.depth { b } else { a }),
        (a, b) => a.or(b),
    }
}
