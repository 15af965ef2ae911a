//! Springs, cables and joints.

use super::{Composer, DrivenTable, stage_set};
use crate::deck::{self, Diagnostic, JointKind};
use crate::drive::Driven;
use crate::effect::joint::{self, Joints};
use crate::effect::link::{self, Links};
use crate::effect::spring::{self, Spring};
use crate::model::{Amplitude, SlotKind, StageSet, Support};
use crate::scene::joints::FoundJoint;
use crate::system::Direction;
use crate::tensor::{Mat3, Vec3};

impl Composer<'_> {
    pub(super) fn springs(&mut self) {
        let mut springs = Vec::new();
        for spring in &self.deck.springs {
            let deck::SpringBody::Ground { at, stiffness: k, damping: c, axes } = &spring.body else { continue };
            let Some((node, _)) = self.node(at) else { continue };
            let axes = crate::scene::constraints::axes(*axes);
            let turned = |k: [f64; 3]| axes * Mat3::diagonal(k) * axes.transpose();
            springs.push(spring::Instance {
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
            self.push(Spring { springs }, reason);
        }
    }

    /// The number of an amplitude that is 1 in these stages and 0 in others.
    fn switch(&mut self, stages: Option<&Vec<usize>>) -> usize {
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
            links.push(link::Instance {
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
        let joints: Vec<joint::Instance> = connections.iter().filter_map(|c| self.joint(c)).collect();
        if joints.is_empty() {
            let why = if connections.is_empty() {
                "no [[joint]]"
            } else {
                "every [[joint]] is held by supports or shared nodes"
            };
            return self.reason("joints", false, why);
        }
        let reason = format!("{} [[joint]] table(s)", joints.len());
        self.push(Joints { joints }, reason);
    }

    fn joint(&mut self, connection: &FoundJoint) -> Option<joint::Instance> {
        let joint = connection.joint;
        let node = |k: usize| connection.nodes[k].map(|node| self.mesh.nodes[node].node);
        let nodes = [node(0), node(1)];
        let place = |k: usize| connection.nodes[k].map_or(connection.place, |node| self.mesh.nodes[node].place);
        let places = [place(0), place(1)];
        let sprung = joint.stiffness != 0.0 || joint.damping != 0.0;
        let support = connection.is_support();
        let mut kind = connection.kind();
        if support {
            // Supports hold it; what is left is its drive, or the one direction of a universal
            // joint.
            match joint.kind {
                JointKind::Universal => kind.held = [true; 3],
                JointKind::Spherical | JointKind::Revolute | JointKind::Prismatic | JointKind::Rigid => {
                    if !sprung {
                        return None;
                    }
                    kind.normal = &[];
                }
            }
            if joint.motor.is_some() {
                return None;
            }
        }
        let motor = match &joint.motor {
            None => None,
            Some(motor) => {
                let amplitude = self.amplitude_of("motor", &joint.span, motor.history.as_ref(), None)?;
                Some(joint::Motor { value: motor.value, amplitude })
            }
        };
        let shared = matches!(nodes, [Some(a), Some(b)] if a.u == b.u);
        if shared && (connection.arms != [Vec3::ZERO; 2] || !kind.held[0]) {
            let message = "these parts share their displacement through another joint at the same point";
            let diagnostic = Diagnostic::error(message, joint.span.clone());
            self.diagnostics.push(diagnostic.help("give the parts points of their own, and join these"));
            return None;
        }
        if !sprung && motor.is_none() && shared && kind.normal.is_empty() {
            return None;
        }
        let turns = sprung && joint.kind == JointKind::Revolute;
        let mut instance = joint::Instance {
            kind,
            nodes,
            places,
            arms: connection.arms,
            axes: connection.axes,
            along: None,
            between: None,
            drive: joint::Drive { stiffness: joint.stiffness, damping: joint.damping, motor },
            angle: turns.then_some(self.out.angles),
        };
        self.out.angles += usize::from(turns);
        self.out.sprung_joints.extend(turns.then(|| nodes.map(|node| node.map(|node| node.p))));
        self.out.jointed.extend(connection.nodes.into_iter().flatten());
        if !shared && !support {
            instance.along = Some(self.multiplier(SlotKind::Force, connection));
        }
        if !kind.normal.is_empty() || (motor.is_some() && joint.kind == JointKind::Revolute) {
            instance.between = Some(self.multiplier(SlotKind::Moment, connection));
        }
        if let Some(motor) = &joint.motor {
            let slot = if joint.kind == JointKind::Prismatic { instance.along } else { instance.between };
            let table = |slot| DrivenTable {
                drives: Driven::Motor(slot),
                what: "motor",
                span: joint.span.clone(),
                history: motor.history.clone(),
            };
            self.out.driven.extend(slot.map(table));
        }
        for slot in [instance.along, instance.between].into_iter().flatten() {
            let used = instance.used(slot);
            let directions = (0..3).filter(|&k| !used[k]).map(|k| Direction { slot, axis: Vec3::UNIT[k] }).collect();
            self.out.idle_multipliers.push(Support { directions, stages: StageSet::default() });
        }
        Some(instance)
    }

    fn multiplier(&mut self, kind: SlotKind, connection: &FoundJoint) -> u32 {
        let names = connection.nodes.into_iter().flatten().map(|node| self.mesh.name_of(node));
        let node = format!("joint of {}", names.collect::<Vec<_>>().join(" and "));
        self.out.multipliers.push((kind, node));
        (self.mesh.slots() + self.out.multipliers.len() - 1) as u32
    }
}
