//! Loads at nodes and along beams.

use super::Composer;
use crate::deck::{self, Diagnostic, EffectWord, Frame, InterpolationWord, LoadTarget, LoadVector};
use crate::scene::mesh::BeamElement;
use crate::scene::names;
use beamsim_core::effect::load::{LineLoad, LineLoadKind, NodeForce, NodeLoad, NodeLoadKind};
use beamsim_core::effect::{ByOrder, Effect};
use beamsim_core::kernel::load::Intensity;
use beamsim_core::model::beam_element::{ElementGeometry, Rule, Station, push_volume};
use beamsim_core::tensor::{Mat3, Vec3};

impl Composer<'_> {
    /// Loads at nodes, and beside them those that line loads on relative beams leave there.
    pub(super) fn node_loads(&mut self, mut loads: NodeLoads) {
        for load in &self.deck.loads {
            let LoadTarget::At(at) = &load.target else { continue };
            let Some((node, on)) = self.node(at) else { continue };
            let Some(amplitude) = self.amplitude_of_load(load) else { continue };
            let Some(frame) = self.load_axes(load, at, node, on) else { continue };
            let node = self.mesh.nodes[node].node;
            self.out.with_force.extend(load.force.map(|_| node));
            self.out.with_moment.extend(load.moment.map(|_| node));
            let at_node = |vector: LoadVector| NodeForce { node, vector: frame * Vec3(vector.start), amplitude };
            let own = loads.in_frame(load.frame);
            own.forces.extend(load.force.map(at_node));
            own.moments.extend(load.moment.map(at_node));
        }
        let tangent = self.deck.effects.allow(EffectWord::FollowerTangent);
        let NodeLoads { dead, following } = loads;
        let kinds = [
            (NodeLoadKind::SpatialForce, dead.forces),
            (NodeLoadKind::SpatialMoment, dead.moments),
            (NodeLoadKind::MaterialForce, following.forces),
            (NodeLoadKind::MaterialMoment, following.moments),
        ];
        for (kind, loads) in kinds {
            let effect = NodeLoad { kind, loads, tangent };
            if effect.loads.is_empty() {
                self.reason(effect.name(), false, "no [[load]] of this kind at a node");
            } else {
                let reason = format!("{} at nodes", effect.loads.len());
                self.push(effect, reason);
            }
        }
    }

    fn amplitude_of_load(&mut self, load: &deck::Load) -> Option<usize> {
        self.amplitude_of("load", &load.span, load.history.as_ref(), load.stages.as_ref())
    }

    /// From the components of a load at a node to global ones at the start.
    fn load_axes(
        &mut self,
        load: &deck::Load,
        at: &deck::Spanned<String>,
        node: usize,
        on: Option<(usize, f64)>,
    ) -> Option<Mat3> {
        if load.frame != Frame::Section {
            return Some(Mat3::IDENTITY);
        }
        let beams = self.mesh.beams_at(&names::Found::Node(node, on));
        match beams[..] {
            [(beam, fraction)] => Some(self.mesh.beams[beam].frame(fraction)),
            [] => {
                let message = format!("frame = \"section\" needs a section, and no beam meets the node `{}`", at.value);
                self.diagnostics.push(Diagnostic::error(message, at.span.clone()));
                None
            }
            [(first, fraction), _, ..] => {
                let message = format!("several beams meet at `{}`, so that the section is ambiguous", at.value);
                let end = if fraction > 0.5 { "end" } else { "start" };
                let help = format!("name the node on a beam, such as `{}@{end}`", self.mesh.beams[first].name);
                self.diagnostics.push(Diagnostic::error(message, at.span.clone()).help(help));
                None
            }
        }
    }

    /// Line loads; those that turn with a relative beam are returned as loads at its nodes.
    pub(super) fn line_loads(&mut self) -> NodeLoads {
        let mut spatial = ByOrder::default();
        let mut material = ByOrder::default();
        let mut nodal = NodeLoads::default();
        for load in &self.deck.loads {
            let LoadTarget::Along(along) = &load.target else { continue };
            let Some(beam) = self.mesh.beams.named(&along.value) else {
                self.diagnostics.extend(names::unknown_beam(self.deck, along));
                continue;
            };
            let Some(amplitude) = self.amplitude_of_load(load) else { continue };
            let out = if load.frame == Frame::Space { &mut spatial } else { &mut material };
            let turning = load.frame != Frame::Space || load.moment.is_some();
            for element in self.mesh.elements_of(beam) {
                if turning && beam.interpolation == InterpolationWord::Relative {
                    add_nodal_loads(&mut nodal, load, &element, amplitude);
                    continue;
                }
                let stations = element.stations(Rule::Volume);
                push_volume(out, &element, &stations, |k| intensity(load, &element, &stations[k], amplitude));
            }
        }
        let tangent = self.deck.effects.allow(EffectWord::FollowerTangent);
        let kinds = [
            (LineLoadKind::Spatial, spatial, !nodal.dead.is_empty()),
            (LineLoadKind::Material, material, !nodal.following.is_empty()),
        ];
        for (kind, mut elements, acts_at_nodes) in kinds {
            elements.shrink_to_fit();
            let effect = LineLoad { kind, elements, tangent };
            if effect.elements.is_empty() {
                let but = if acts_at_nodes { ", except on `relative` beams, where it acts at the nodes" } else { "" };
                self.reason(effect.name(), false, format!("no [[load]] of this kind along a beam{but}"));
            } else {
                self.push(effect, "[[load]] along a beam".into());
            }
        }
        nodal
    }
}

/// Forces and moments at nodes.
#[derive(Default)]
pub(super) struct ForcesAndMoments {
    forces: Vec<NodeForce>,
    moments: Vec<NodeForce>,
}

impl ForcesAndMoments {
    fn is_empty(&self) -> bool {
        self.forces.is_empty() && self.moments.is_empty()
    }
}

/// Loads at nodes by their frame.
#[derive(Default)]
pub(super) struct NodeLoads {
    /// Fixed in space
    dead: ForcesAndMoments,
    /// Turning with the section
    following: ForcesAndMoments,
}

impl NodeLoads {
    fn in_frame(&mut self, frame: Frame) -> &mut ForcesAndMoments {
        match frame {
            Frame::Space => &mut self.dead,
            Frame::Body | Frame::Section => &mut self.following,
        }
    }
}

/// A load along an element, taken at its nodes.
fn add_nodal_loads(out: &mut NodeLoads, load: &deck::Load, element: &BeamElement, amplitude: usize) {
    for (station, &node) in element.stations(Rule::Nodal).iter().zip(element.nodes) {
        let Intensity { force, moment, .. } = intensity(load, element, station, amplitude);
        let node = element.mesh.nodes[node].node;
        let at_node = |vector: Vec3| NodeForce { node, vector: vector * station.weight, amplitude };
        let own = out.in_frame(load.frame);
        own.forces.extend((force != Vec3::ZERO).then(|| at_node(force)));
        own.moments.extend((moment != Vec3::ZERO).then(|| at_node(moment)));
    }
}

fn intensity(load: &deck::Load, element: &BeamElement, station: &Station, amplitude: usize) -> Intensity {
    let axes = if load.frame == Frame::Section { element.exact_axes(station) } else { Mat3::IDENTITY };
    let at = |vector: Option<LoadVector>| {
        let [start, end] = vector.map_or([[0.0; 3]; 2], |v| [v.start, v.end]).map(Vec3);
        axes * (start + (end - start) * station.fraction)
    };
    Intensity { force: at(load.force), moment: at(load.moment), amplitude }
}
