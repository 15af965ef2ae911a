//! Sliding joints along beams.

use super::{Composer, stage_set};
use crate::deck::{self, Deck, Diagnostic, EffectWord, Sliding, Spanned, StageBody};
use crate::scene::names::unknown_beam;
use beamsim_core::effect::sliding::{Guide, GuideNode, Slider, Sliders};
use beamsim_core::model::{Amplitude, Motion, MotionKind, SlotKind, Support};
use beamsim_core::run::Driven;
use beamsim_core::system::{Direction, Slot};
use beamsim_core::tensor::Vec3;

/// The largest distance of a node from the line at the start, over the distance of the nodes of the
/// beam there: about that of a node on an arc from the curve through the nodes.
const OFF_THE_LINE: f64 = 1e-3;

/// A prescribed sliding, which the model adds to its motions.
#[derive(Clone)]
pub struct SliderMotion {
    /// The motion
    pub(crate) motion: Motion,
    /// The table, whose driven motion gets its number later
    pub(crate) table: super::DrivenTable,
}

impl Composer<'_> {
    pub(super) fn sliders(&mut self) {
        let deck = self.deck;
        if deck.sliders.is_empty() {
            return self.reason("sliding joints", false, "no [[slider]]");
        }
        if !deck.effects.allow(EffectWord::LargeRotations) {
            let message =
                "a [[slider]] needs large rotations: the place on the beam is not linear in the displacements";
            self.diagnostics.push(Diagnostic::error(message, deck.sliders[0].span.clone()));
            return;
        }
        refuse_stages(deck, self.diagnostics);
        let mut out = Sliders::default();
        for table in &deck.sliders {
            self.add_slider(table, &mut out);
        }
        let reason = format!("{} node(s) of {} [[slider]] table(s)", out.sliders.len(), deck.sliders.len());
        self.push(out, reason);
    }

    fn add_slider(&mut self, table: &deck::Slider, out: &mut Sliders) {
        let Some(beam) = self.beam_number(&table.on) else { return };
        let Some(nodes) = self.sliding_nodes(table, beam) else { return };
        let Some(guide) = self.guide(table, beam) else { return };
        for node in nodes {
            self.slide(table, node, &guide, out);
        }
        out.guides.push(guide);
    }

    fn beam_number(&mut self, name: &Spanned<String>) -> Option<usize> {
        let found = self.mesh.beams.number(&name.value);
        if found.is_none() {
            self.diagnostics.extend(unknown_beam(self.deck, name));
        }
        found
    }

    /// The numbers of the nodes that slide.
    fn sliding_nodes(&mut self, table: &deck::Slider, on: usize) -> Option<Vec<usize>> {
        match &table.slides {
            Sliding::Nodes(names) => {
                let found: Vec<Option<usize>> = names.iter().map(|name| Some(self.node(name)?.0)).collect();
                found.into_iter().collect()
            }
            Sliding::Beam { beam, part: [from, to] } => {
                let number = self.beam_number(beam)?;
                if number == on {
                    let message = format!("beam `{}` cannot slide on itself", beam.value);
                    self.diagnostics.push(Diagnostic::error(message, beam.span.clone()));
                    return None;
                }
                let beam = &self.mesh.beams[number];
                let is_within = |fraction: f64| (from - 1e-12..=to + 1e-12).contains(&fraction);
                let nodes = beam.nodes.iter().zip(&beam.fractions).filter(|(_, fraction)| is_within(**fraction));
                let nodes: Vec<usize> = nodes.map(|(&node, _)| node).collect();
                if nodes.is_empty() {
                    let name = &beam.name;
                    let message = format!("no node of beam `{name}` is in the `part` from {from} to {to}: none slides");
                    let spacing = 1.0 / (beam.nodes.len() - 1) as f64;
                    let help = format!(
                        "name a longer part, or more `elements`: nodes of `{name}` are about {spacing:.3} of its \
                         length apart"
                    );
                    self.diagnostics.push(Diagnostic::error(message, table.span.clone()).help(help));
                    return None;
                }
                Some(nodes)
            }
        }
    }

    fn guide(&mut self, table: &deck::Slider, beam: usize) -> Option<Guide> {
        let beam = &self.mesh.beams[beam];
        let placed = beam.nodes.iter().map(|&node| &self.mesh.nodes[node]);
        let nodes: Vec<GuideNode> = placed.map(|node| GuideNode { u: node.node.u, place: node.place }).collect();
        if nodes[0].u == nodes[nodes.len() - 1].u {
            let message = format!("nodes cannot slide on beam `{}`, which is closed", table.on.value);
            let diagnostic = Diagnostic::error(message, table.on.span.clone());
            self.diagnostics.push(diagnostic.help("divide it into two beams that share their ends"));
            return None;
        }
        Some(Guide::new(nodes))
    }

    fn slide(&mut self, table: &deck::Slider, node: usize, guide: &Guide, out: &mut Sliders) {
        let placed = self.mesh.nodes[node];
        let name = self.mesh.name_of(node);
        if guide.nodes.iter().any(|other| other.u == placed.node.u) {
            let message = format!("node `{name}` belongs to beam `{}` and cannot slide on it", table.on.value);
            let diagnostic = Diagnostic::error(message, table.span.clone());
            self.diagnostics.push(diagnostic.help("give the node a point of its own at the same place"));
            return;
        }
        if out.sliders.iter().any(|other| other.u == placed.node.u) {
            let message = format!("node `{name}` already slides on a beam");
            self.diagnostics.push(Diagnostic::error(message, table.span.clone()));
            return;
        }
        let (start, place) = guide.nearest(placed.place);
        let distance = (placed.place - place).norm();
        let spacing = guide.length() / guide.elements() as f64;
        if distance > OFF_THE_LINE * spacing {
            let message = format!("node `{name}` is {distance:.3e} off the line of beam `{}`", table.on.value);
            let help = "place it on the line through the nodes of the beam; a finer beam follows its arc more closely";
            self.diagnostics.push(Diagnostic::error(message, table.span.clone()).help(help));
            return;
        }
        let joint = format!("slider of {name}");
        let slide = self.joint_slot(SlotKind::Sliding, joint.clone());
        let force = self.joint_slot(SlotKind::Force, joint);
        let idle = [1, 2].map(|k| Direction { slot: slide, axis: Vec3::UNIT[k] });
        self.out.idle_multipliers.push(Support { directions: idle.to_vec(), stages: stage_set(None) });
        let guide = out.guides.len();
        out.sliders.push(Slider { u: placed.node.u, place, guide, start, slide, force });
        if let Some(drive) = &table.drive {
            self.drive_slider(table, drive, slide);
        }
    }

    fn joint_slot(&mut self, kind: SlotKind, name: String) -> Slot {
        self.out.multipliers.push((kind, name));
        (self.mesh.slots() + self.out.multipliers.len() - 1) as Slot
    }

    fn drive_slider(&mut self, table: &deck::Slider, drive: &deck::SliderDrive, slot: Slot) {
        let found = crate::scene::constraints::find_history(self.deck, self.histories, drive.history.as_ref());
        let Some(history) = found.map_err(|diagnostic| self.diagnostics.push(diagnostic)).ok() else { return };
        let amplitude = Amplitude::of_motion(drive.displacement, history, stage_set(None));
        let motion = Motion { kind: MotionKind::Translation, slot, axis: Vec3::UNIT[0], amplitude };
        let table = super::DrivenTable {
            drives: Driven::Motion(0),
            what: "slider",
            span: table.span.clone(),
            history: drive.history.clone(),
        };
        self.out.slider_motions.push(SliderMotion { motion, table });
    }
}

/// Refuses sliders in stages that cannot treat them.
fn refuse_stages(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) {
    for stage in &deck.stages {
        if matches!(stage.body, StageBody::Static { .. } | StageBody::Dynamic { .. }) {
            continue;
        }
        let message = format!("{} does not support [[slider]]", stage.body.in_words());
        let diagnostic = Diagnostic::error(message, stage.span.clone());
        diagnostics.push(diagnostic.context(deck.sliders[0].span.clone(), "this slider"));
    }
}
