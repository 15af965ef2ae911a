//! Straight parts whose spin about their own axis nothing resists.

use super::{Composer, stage_set};
use crate::deck::{EffectWord, Frame, Load, LoadTarget, MotionWhat, Spanned, Stage, StageBody};
use crate::scene::joints::FoundJoint;
use crate::scene::mesh::MeshBeam;
use beamsim_core::effect::spin_hold::{HeldIn, SpinHold, SpinningPart};
use beamsim_core::system::{Slot, StageSet};
use beamsim_core::tensor::{Mat3, Vec3};
use std::collections::{BTreeMap, HashSet};

/// Distance of a node from a straight line that still counts as on it, relative to the length of the line.
const STRAIGHT: f64 = 1e-9;

/// The drag against spins that nothing drives: it takes GJ/L for so many times the time of all dynamic stages to turn a
/// part by a radian. The moments of mesh errors that would turn one are some 1e-3 of that.
const DRAG: f64 = 10.0;

/// No beam, in lists by slot.
const NONE: usize = usize::MAX;

/// Beams that are joined rigidly along one line.
struct StraightPart<'m> {
    beams: Vec<&'m MeshBeam>,
    /// The rotations at its two ends
    ends: [Slot; 2],
    hold: SpinningPart,
}

impl StraightPart<'_> {
    /// It is straight without load, and bends and turns about all axes alike: a spin in a bend strains nothing, nor does it move mass.
    fn is_round(&self) -> bool {
        let has_round_sections =
            |beam: &MeshBeam| beam.fractions.iter().all(|&fraction| beam.section.at(fraction).is_round());
        self.beams.iter().all(|beam| beam.free_strain.is_none() && has_round_sections(beam))
    }
}

impl Composer<'_> {
    pub(super) fn spin_holds(&mut self, connections: &[FoundJoint]) {
        let rests = self.deck.stages.iter().any(|stage| !stage.body.kind().needs_inertia());
        let [mut in_motion, mut in_statics] = [HeldIn::Motion, HeldIn::Statics].map(|held_in| (held_in, Vec::new()));
        let mut loose = Vec::new();
        for (resisted, stages) in self.stages_by_resistance(connections) {
            let parts = self.straight_parts(&resisted);
            if stages.iter().any(|&stage| self.deck.stages[stage].body.kind().advances_time()) {
                let jumps = |part: &&StraightPart| !part.is_round() && !self.has_spin_inertia(part);
                loose.extend(parts.iter().filter(jumps).map(|part| part.beams[0].name.clone()));
            }
            let add = |(held_in, holds): &mut (HeldIn, Vec<SpinHold>), is_free: &dyn Fn(&StraightPart) -> bool| {
                let drag = |part: &StraightPart| match held_in {
                    HeldIn::Motion => self.drag(part),
                    HeldIn::Statics => 0.0,
                };
                let hold = |part: &StraightPart| SpinningPart { drag: drag(part), ..part.hold.clone() };
                let parts = parts.iter().filter(|part| is_free(part)).map(hold).collect();
                let is_of_kind = |stage: &usize| HeldIn::stages_of(self.deck.stages[*stage].body.kind()) == *held_in;
                let stages: Vec<usize> = stages.iter().copied().filter(is_of_kind).collect();
                if !stages.is_empty() {
                    holds.push(SpinHold { parts, held_in: *held_in, stages: StageSet(Some(stages)) });
                }
            };
            add(&mut in_motion, &|part| self.dynamic && !self.has_spin_inertia(part));
            add(&mut in_statics, &|part| rests && !self.feels_loads(part));
        }
        self.out.loose_spins = loose;
        let parts = "straight part(s) free to spin about their own axis";
        self.hold_spins(in_motion, &format!("{parts}, without inertia about it"));
        self.hold_spins(in_statics, &format!("{parts}, which no load resists: the spin is fixed"));
    }

    /// Holds of one kind, each in its stages.
    fn hold_spins(&mut self, (held_in, holds): (HeldIn, Vec<SpinHold>), which: &str) {
        let differ = holds.len() > 1;
        let held: Vec<SpinHold> = holds.into_iter().filter(|hold| !hold.parts.is_empty()).collect();
        if held.is_empty() {
            self.reason(held_in.name(), false, format!("no {which}"));
        }
        for hold in held {
            let count = hold.parts.len();
            let stages = if differ { format!(", in stages {}", numbers(&hold.stages)) } else { String::new() };
            self.push(hold, format!("{count} {which}{stages}"));
        }
    }

    /// The rotations that something resists, each time with the stages in which it does.
    fn stages_by_resistance(&self, connections: &[FoundJoint]) -> Vec<(HashSet<Slot>, Vec<usize>)> {
        let mut found: Vec<(HashSet<Slot>, Vec<usize>)> = Vec::new();
        for stage in 0..self.deck.stages.len() {
            let resisted = self.resisted_rotations(connections, stage);
            match found.iter_mut().find(|(known, _)| *known == resisted) {
                Some((_, stages)) => stages.push(stage),
                None => found.push((resisted, vec![stage])),
            }
        }
        found
    }

    /// Parts on a straight line whose rotation nothing takes hold of.
    fn straight_parts(&self, resisted: &HashSet<Slot>) -> Vec<StraightPart<'_>> {
        let beams = &self.mesh.beams;
        let slot = |node: usize| self.mesh.nodes[node].node.p as usize;
        let mut held = vec![false; self.mesh.slots()];
        resisted.iter().for_each(|&slot| held[slot as usize] = true);
        let is_held: Vec<bool> = beams.iter().map(|beam| beam.nodes.iter().any(|&node| held[slot(node)])).collect();
        if is_held.iter().all(|&held| held) {
            return Vec::new();
        }
        // Beams that share a rotation are one part, which is named after its first beam.
        let mut part_of: Vec<usize> = (0..beams.len()).collect();
        let mut beam_at = vec![NONE; self.mesh.slots()];
        for (number, beam) in beams.iter().enumerate() {
            for place in beam.nodes.iter().map(|&node| slot(node)) {
                match std::mem::replace(&mut beam_at[place], number) {
                    NONE => {}
                    other => join(&mut part_of, number, other),
                }
            }
        }
        let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        (0..beams.len()).for_each(|number| parts.entry(root(&part_of, number)).or_default().push(number));
        let free = parts.into_values().filter(|part| !part.iter().any(|&number| is_held[number]));
        free.filter_map(|part| self.straight_part(part.iter().map(|&number| &beams[number]).collect())).collect()
    }

    /// `None` where it is not straight.
    fn straight_part<'m>(&'m self, beams: Vec<&'m MeshBeam>) -> Option<StraightPart<'m>> {
        let nodes: Vec<_> =
            beams.iter().flat_map(|beam| beam.nodes.iter().map(|&node| &self.mesh.nodes[node])).collect();
        let first = nodes.first()?.place;
        let farthest =
            |from: Vec3| nodes.iter().max_by(|a, b| (a.place - from).squared().total_cmp(&(b.place - from).squared()));
        let first_end = farthest(first)?;
        let start = first_end.place;
        let second_end = farthest(start)?;
        let end = second_end.place;
        let axis = (end - start).normalized()?;
        let length = (end - start).norm();
        let aside = |place: Vec3| (place - start - axis * axis.dot(place - start)).norm();
        if nodes.iter().any(|node| aside(node.place) > STRAIGHT * length) {
            return None;
        }
        let beam = beams[0];
        let middle = beams[0].nodes.len() / 2;
        let stiffness = beam.section.at(beam.fractions[middle]).stiffness;
        let hold = SpinningPart {
            node: nodes[middle].node,
            nodes: nodes.iter().map(|node| node.node).collect(),
            axis,
            torsion: stiffness[3][3] / length,
            drag: 0.0,
            stretching: stiffness[0][0] * length,
        };
        Some(StraightPart { beams, ends: [first_end.node.p, second_end.node.p], hold })
    }

    /// The drag of a part against its spin in dynamic stages; zero where something may turn it.
    fn drag(&self, part: &StraightPart) -> f64 {
        let rubs = self.deck.contacts.iter().any(|contact| contact.friction != [0.0; 2]);
        if rubs || !part.is_round() || self.feels_loads(part) {
            return 0.0;
        }
        let time = |stage: &Stage| if let StageBody::Dynamic { end, .. } = stage.body { end } else { 0.0 };
        DRAG * part.hold.torsion * self.deck.stages.iter().map(time).sum::<f64>()
    }

    /// Something of it is turned by gravity, or resists a spin by its inertia.
    fn has_spin_inertia(&self, part: &StraightPart) -> bool {
        let rotary = self.deck.effects.allow(EffectWord::RotaryInertia);
        let of_beam = |beam: &&MeshBeam| {
            let mass = beam.section.at(beam.fractions[beam.nodes.len() / 2]).mass;
            mass.is_some_and(|mass| mass.offset != Vec3::ZERO || (rotary && mass.about_line.0[0][0] > 0.0))
        };
        let of_body =
            self.deck.bodies.iter().filter(|body| body.inertia.is_some()).any(|body| self.is_on(part, &body.at));
        part.beams.iter().any(of_beam) || of_body
    }

    /// Loads may turn it about its axis: moments, loads that turn with it, weight beside its axis, in rotating frames all inertia; and
    /// where it bends about one axis more easily than about another, or is curved by itself, whatever bends it.
    fn feels_loads(&self, part: &StraightPart) -> bool {
        let acts_on = |load: &Load| match &load.target {
            LoadTarget::At(at) => self.is_on(part, at),
            LoadTarget::Along(along) => part.beams.iter().any(|beam| beam.name == along.value),
        };
        let turns =
            self.deck.loads.iter().any(|load| (load.moment.is_some() || load.frame != Frame::Space) && acts_on(load));
        let along = self.deck.loads.iter().any(|load| matches!(load.target, LoadTarget::Along(_)) && acts_on(load));
        let inside = |load: &Load| matches!(&load.target, LoadTarget::At(at) if self.is_on(part, at) && !self.is_at_end(part, at));
        let bends = along || self.deck.gravity.is_some() || self.deck.loads.iter().any(inside);
        let is_eccentric = |beam: &&MeshBeam| {
            let mass = beam.section.at(beam.fractions[beam.nodes.len() / 2]).mass;
            mass.is_some_and(|mass| mass.offset != Vec3::ZERO)
        };
        let rotates = self.deck.stages.iter().any(|stage| stage.frame.is_some());
        let mut heavy = self.deck.bodies.iter().filter(|body| body.inertia.is_some());
        let inert = rotates && (!part.is_round() || heavy.any(|body| self.is_on(part, &body.at)));
        turns || (bends && !part.is_round()) || part.beams.iter().any(is_eccentric) || inert
    }

    /// A node of a part is one of its ends.
    fn is_at_end(&self, part: &StraightPart, name: &Spanned<String>) -> bool {
        let found = self.mesh.find_node(self.deck, name).ok();
        found.is_some_and(|(number, _)| part.ends.contains(&self.mesh.nodes[number].node.p))
    }

    /// A node of a part has this name.
    fn is_on(&self, part: &StraightPart, name: &Spanned<String>) -> bool {
        let found = self.mesh.find_node(self.deck, name).ok();
        found.is_some_and(|(number, _)| part.hold.nodes.contains(&self.mesh.nodes[number].node))
    }

    /// Rotations that supports, motions, joints, springs or bodies beside their node take part in, in a
    /// stage.
    fn resisted_rotations(&self, connections: &[FoundJoint], stage: usize) -> HashSet<Slot> {
        let acts = |stages: &Option<Vec<usize>>| stage_set(stages.as_ref()).contains(stage);
        let slot = |number: usize| self.mesh.nodes[number].node.p;
        let named = |name: &Spanned<String>| self.mesh.find_node(self.deck, name).ok().map(|(number, _)| slot(number));
        let supports = self.deck.supports.iter().filter(|support| acts(&support.stages));
        let held = supports.filter(|support| support.fix[3..].contains(&true));
        let motions = self.deck.motions.iter().filter(|motion| acts(&motion.stages));
        let turned = motions.filter(|motion| matches!(motion.what, MotionWhat::Rotation { .. }));
        let joined = connections.iter().filter(|connection| connection.joint.kind.holds_rotation());
        let aside = connections.iter().filter(|connection| connection.arms != [Vec3::ZERO; 2]);
        let springs = self.out.springs.iter().filter(|s| self.out.amplitudes[s.amplitude].stages().contains(stage));
        let sprung = springs.filter(|s| s.rotation != Mat3::ZERO || s.rotation_damping != Mat3::ZERO);
        let heavy = self.deck.bodies.iter().filter(|body| body.offset != [0.0; 3]);
        let mut found: HashSet<Slot> = held.filter_map(|support| named(&support.at)).collect();
        found.extend(turned.filter_map(|motion| named(&motion.at)));
        found.extend(joined.chain(aside).flat_map(|connection| connection.nodes).flatten().map(slot));
        found.extend(sprung.map(|spring| spring.node.p));
        found.extend(heavy.filter_map(|body| named(&body.at)));
        found
    }
}

/// The numbers of stages as a deck counts them.
fn numbers(stages: &StageSet) -> String {
    let numbers = stages.0.iter().flatten().map(|stage| (stage + 1).to_string());
    numbers.collect::<Vec<_>>().join(", ")
}

/// The first of what is joined with a beam.
fn root(part_of: &[usize], mut number: usize) -> usize {
    while part_of[number] != number {
        number = part_of[number];
    }
    number
}

fn join(part_of: &mut [usize], a: usize, b: usize) {
    let a = root(part_of, a);
    let b = root(part_of, b);
    part_of[a.max(b)] = a.min(b);
}
