//! Straight beams whose spin about their own axis nothing resists: no inertia, no support, no other beam.

use super::Composer;
use crate::deck::{EffectWord, JointKind, MotionWhat, Spanned};
use crate::effect::spin_hold::{Instance, SpinHold};
use crate::scene::joints::FoundJoint;
use crate::scene::mesh::MeshBeam;
use crate::scene::section::SectionMatrices;
use crate::system::Slot;
use crate::tensor::{Mat3, Vec3};
use std::collections::HashSet;

/// What is nearer to a straight line is one, relative to its length.
const STRAIGHT: f64 = 1e-9;

impl Composer<'_> {
    pub(super) fn spin_holds(&mut self, connections: &[FoundJoint]) {
        let name = "hold of spins without inertia";
        if !self.dynamic {
            return self.reason(name, false, "no dynamic stage");
        }
        let resisted = self.resisted_rotations(connections);
        let beams: Vec<Instance> = self.mesh.beams.iter().filter_map(|beam| self.spin_hold(beam, &resisted)).collect();
        if beams.is_empty() {
            return self.reason(name, false, "nothing spins about its own axis without any inertia");
        }
        let count = beams.len();
        let reason = format!("{count} straight beam(s) without `rhoJ` whose spin about their own axis nothing resists");
        self.push(SpinHold { beams }, reason);
    }

    fn spin_hold(&self, beam: &MeshBeam, resisted: &HashSet<Slot>) -> Option<Instance> {
        let nodes: Vec<_> = beam.nodes.iter().map(|&node| &self.mesh.nodes[node]).collect();
        let (first, last) = (nodes.first()?.place, nodes.last()?.place);
        let axis = (last - first).normalized()?;
        let length = (last - first).norm();
        let aside = |place: Vec3| (place - first - axis * axis.dot(place - first)).norm();
        let straight = nodes.iter().all(|node| aside(node.place) <= STRAIGHT * length);
        let middle = nodes.len() / 2;
        let SectionMatrices { stiffness, mass } = beam.section.at(beam.fractions[middle]);
        let rotary = self.deck.effects.allow(EffectWord::RotaryInertia);
        let own = mass.is_some_and(|mass| mass.offset != Vec3::ZERO || (rotary && mass.about_line.0[0][0] > 0.0));
        if !straight || own || nodes.iter().any(|node| resisted.contains(&node.node.p)) {
            return None;
        }
        let stiffness = stiffness[3][3] / length;
        Some(Instance {
            node: nodes[middle].node,
            nodes: nodes.iter().map(|node| node.node).collect(),
            axis,
            stiffness,
        })
    }

    /// Rotations that supports, motions, joints, springs or bodies take part in, or more than one beam.
    fn resisted_rotations(&self, connections: &[FoundJoint]) -> HashSet<Slot> {
        let slot = |number: usize| self.mesh.nodes[number].node.p;
        let named = |name: &Spanned<String>| self.mesh.find_node(self.deck, name).ok().map(|(number, _)| slot(number));
        let held = self.deck.supports.iter().filter(|support| support.fix[3..].contains(&true));
        let turned = self.deck.motions.iter().filter(|m| matches!(m.what, MotionWhat::Rotation { .. }));
        let joined = connections.iter().filter(|connection| connection.joint.kind != JointKind::Spherical);
        let aside = connections.iter().filter(|connection| connection.arms != [Vec3::ZERO; 2]);
        let sprung = self.out.springs.iter().filter(|s| s.rotation != Mat3::ZERO || s.rotation_damping != Mat3::ZERO);
        let heavy = self.deck.bodies.iter().filter(|body| body.inertia.is_some() || body.offset != [0.0; 3]);
        let mut found: HashSet<Slot> = held.filter_map(|support| named(&support.at)).collect();
        found.extend(turned.filter_map(|motion| named(&motion.at)));
        found.extend(joined.chain(aside).flat_map(|connection| connection.nodes).flatten().map(slot));
        found.extend(sprung.map(|spring| spring.node.p));
        found.extend(heavy.filter_map(|body| named(&body.at)));
        let mut once = HashSet::new();
        found
            .extend(self.mesh.beams.iter().flat_map(|beam| &beam.nodes).map(|&n| slot(n)).filter(|&p| !once.insert(p)));
        found
    }
}
