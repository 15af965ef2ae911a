//! Springs, cables and joints.

use super::{Composer, DrivenTable, stage_set};
use crate::deck::{self, Diagnostic};
use crate::scene::joints::FoundJoint;
use beamsim_core::effect::joint::{Drive, FreeCoordinate, Joint, Joints, Motor, SpringDamper};
use beamsim_core::effect::spring::{GroundSpring, GroundSprings, Link, Links};
use beamsim_core::model::{Amplitude, SlotKind, StageSet, Support};
use beamsim_core::run::Driven;
use beamsim_core::system::{Direction, Node};
use beamsim_core::tensor::{Mat3, Vec3};

impl Composer<'_> {
    pub(super) fn springs(&mut self) {
        let mut springs = Vec::new();
        for spring in &self.deck.springs {
            let deck::SpringBody::Ground { at, stiffness: k, damping: c, axes } = &spring.body else { continue };
            let Some((node, _)) = self.node(at) else { continue };
            let axes = crate::scene::constraints::axes(*axes);
            let turned = |k: [f64; 3]| axes * Mat3::diagonal(k) * axes.transpose();
            springs.push(GroundSpring {
                node: self.mesh.nodes[node].node,
                translation: turned([k[0], k[1], k[2]]),
                rotation: turned([k[3], k[4], k[5]]),
                translation_damping: turned([c[0], c[1], c[2]]),
                rotation_damping: turned([c[3], c[4], c[5]]),
                amplitude: self.switch(spring.stages.as_ref()),
            });
        }
        if springs.is_empty() {
            self.reason("springs to ground", false, "no [[spring]]");
        } else {
            let reason = format!("{} [[spring]] table(s)", springs.len());
            self.out.springs = springs.clone();
            self.push(GroundSprings { springs }, reason);
        }
    }

    /// The number of an amplitude that is 1 in these stages and 0 in others.
    pub(super) fn switch(&mut self, stages: Option<&Vec<usize>>) -> usize {
        self.out.amplitudes.push(Amplitude::of_switch(stage_set(stages)));
        self.out.amplitudes.len() - 1
    }

    pub(super) fn links(&mut self) {
        let mut links = Vec::new();
        for spring in &self.deck.springs {
            let deck::SpringBody::Between { nodes: [a, b], stiffness, damping, length, tension_only } = &spring.body
            else {
                continue;
            };
            let (Some((a, _)), Some((b, _))) = (self.node(a), self.node(b)) else { continue };
            let [a, b] = [a, b].map(|node| &self.mesh.nodes[node]);
            let distance = (b.place - a.place).norm();
            if a.node.u == b.node.u || distance == 0.0 {
                let message = "a spring between nodes needs two nodes at different places";
                self.diagnostics.push(Diagnostic::error(message, spring.span.clone()));
                continue;
            }
            links.push(Link {
                nodes: [a.node, b.node],
                places: [a.place, b.place],
                stiffness: *stiffness,
                damping: *damping,
                length: length.unwrap_or(distance),
                tension_only: *tension_only,
                amplitude: self.switch(spring.stages.as_ref()),
            });
        }
        if links.is_empty() {
            return self.reason("springs and cables between nodes", false, "no [[spring]] `between` nodes");
        }
        let reason = format!("{} [[spring]] table(s) `between` nodes", links.len());
        self.out.links.clone_from(&links);
        self.push(Links { links }, reason);
    }

    /// Joints that need multipliers, and springs and dampers of those that do not.
    pub(super) fn joints(&mut self, connections: &[FoundJoint]) {
        let joints: Vec<Joint> = connections.iter().filter_map(|c| self.joint(c)).collect();
        if joints.is_empty() {
            let why = if connections.is_empty() {
                "no [[joint]]"
            } else {
                "every [[joint]] is modelled by supports or shared nodes"
            };
            return self.reason("joints", false, why);
        }
        let reason = format!("{} [[joint]] table(s)", joints.len());
        self.push(Joints { joints }, reason);
    }

    /// `None` where supports or shared nodes do all its work, or where something is wrong.
    fn joint(&mut self, connection: &FoundJoint) -> Option<Joint> {
        let joint = connection.joint;
        let kind = joint.kind;
        let support = connection.is_support();
        let normal = if support { kind.ground.normal } else { kind.normal };
        // The motor of a support is a motion of its node.
        if support && (joint.motor.is_some() || (normal.is_empty() && !is_sprung(joint))) {
            return None;
        }
        let drive = match kind.driven {
            Some(coordinate) => self.drive(joint, coordinate)?,
            None => None,
        };
        let nodes = connection.nodes.map(|node| node.map(|node| self.mesh.nodes[node].node));
        let shared = matches!(nodes, [Some(a), Some(b)] if a.u == b.u);
        if shared && (connection.arms != [Vec3::ZERO; 2] || !kind.shares_displacement()) {
            let message = "another joint at this point already connects these parts";
            let diagnostic = Diagnostic::error(message, joint.span.clone());
            self.diagnostics.push(diagnostic.help("give each part its own point, and connect these by the joint"));
            return None;
        }
        if shared && drive.is_none() && normal.is_empty() {
            return None;
        }
        let turns = matches!(drive, Some(Drive::Motor(FreeCoordinate::Angle, _)));
        let has_along = !shared && !support;
        let has_between = !normal.is_empty() || turns;
        let found = Joint {
            held: kind.held,
            normal,
            nodes,
            places: connection.nodes.map(|node| node.map_or(connection.place, |node| self.mesh.nodes[node].place)),
            arms: connection.arms,
            axes: connection.axes,
            along: has_along.then(|| self.multiplier(SlotKind::Force, connection)),
            between: has_between.then(|| self.multiplier(SlotKind::Moment, connection)),
            drive,
            angle: self.remembered_angle(joint, nodes),
        };
        self.out.jointed.extend(connection.nodes.into_iter().flatten());
        self.out.driven.extend(found.motor_slot().map(|slot| DrivenTable {
            drives: Driven::Motor(slot),
            what: "motor",
            span: joint.span.clone(),
            history: joint.motor.as_ref().and_then(|motor| motor.history.clone()),
        }));
        self.hold_idle_multipliers(&found);
        Some(found)
    }

    /// The number of a joint's angle among those that the state remembers, where a spring or damper turns.
    fn remembered_angle(&mut self, joint: &deck::Joint, nodes: [Option<Node>; 2]) -> Option<usize> {
        if !is_sprung(joint) || joint.kind.driven != Some(FreeCoordinate::Angle) {
            return None;
        }
        self.out.sprung_joints.push(nodes.map(|node| node.map(|node| node.p)));
        Some(self.out.sprung_joints.len() - 1)
    }

    /// Components of multipliers that a joint does not use are held at zero.
    fn hold_idle_multipliers(&mut self, joint: &Joint) {
        for slot in [joint.along, joint.between].into_iter().flatten() {
            let used = joint.used(slot);
            let directions = (0..3).filter(|&k| !used[k]).map(|k| Direction { slot, axis: Vec3::UNIT[k] }).collect();
            self.out.idle_multipliers.push(Support { directions, stages: StageSet::default() });
        }
    }

    /// The drive of a joint on its free coordinate: a motor takes the place of spring and damper. The outer `None` is an unknown history.
    fn drive(&mut self, joint: &deck::Joint, coordinate: FreeCoordinate) -> Option<Option<Drive>> {
        if let Some(motor) = &joint.motor {
            let amplitude = self.amplitude_of("motor", &joint.span, motor.history.as_ref(), None)?;
            return Some(Some(Drive::Motor(coordinate, Motor { value: motor.value, amplitude })));
        }
        let spring = SpringDamper { stiffness: joint.stiffness, damping: joint.damping };
        Some(is_sprung(joint).then_some(Drive::Spring(coordinate, spring)))
    }

    fn multiplier(&mut self, kind: SlotKind, connection: &FoundJoint) -> u32 {
        let names = connection.nodes.into_iter().flatten().map(|node| self.mesh.name_of(node));
        let node = format!("joint of {}", names.collect::<Vec<_>>().join(" and "));
        self.out.multipliers.push((kind, node));
        (self.mesh.slots() + self.out.multipliers.len() - 1) as u32
    }
}

/// A joint with a spring or a damper.
fn is_sprung(joint: &deck::Joint) -> bool {
    joint.stiffness != 0.0 || joint.damping != 0.0
}
