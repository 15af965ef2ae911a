//! Mass of beams and bodies, and what acts on mass: gravity, rotating frames, mass-proportional
//! damping.

use super::{Composer, SWITCHED_OFF};
use crate::deck::{self, Diagnostic, EffectWord, InterpolationWord};
use crate::scene::mesh::{BeamElement, MeshBeam};
use crate::scene::names;
use beamsim_core::effect::inertia::{
    BeamMass, BeamMassDamping, Body, BodyMassDamping, FrameMotion, FrameRamp, RigidBody, RotaryInertia, RotatingFrame,
    SectionInertia,
};
use beamsim_core::effect::load::{BeamGravity, BodyGravity};
use beamsim_core::effect::{ByOrder, VolumeElements};
use beamsim_core::kernel::inertia::Inertia;
use beamsim_core::model::MassPerLength;
use beamsim_core::model::beam_element::{
    ElementGeometry, NodalInertia, PlacedNode, Rule, Station, body_inertia, push_volume,
};
use beamsim_core::tensor::{Mat3, Vec3};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Why no effect has the masses of beams along their elements, where nodes have them.
const ALL_LUMPED: &str = "all masses of beams are eccentric and lumped at the nodes";

impl Composer<'_> {
    /// Mass on the centre line, rotary inertia, and eccentric mass: each only where some section
    /// has it.
    pub(super) fn beam_inertia(&mut self) {
        let names = ["beam mass", "rotary inertia", "eccentric section inertia", "section inertia at nodes"];
        if !self.dynamic || self.mesh.element_count == 0 {
            let why = if self.mesh.element_count == 0 { "no beams" } else { "no dynamic stage" };
            return names.into_iter().for_each(|name| self.reason(name, false, why));
        }
        let wanted = self.deck.effects.allow(EffectWord::RotaryInertia);
        let gyroscopic = self.deck.effects.allow(EffectWord::Gyroscopic);
        let mut mass = ByOrder::default();
        let mut rotary = ByOrder::default();
        let mut eccentric = ByOrder::default();
        let bodies = self.each_inertia(|element, stations, found| {
            if found.iter().any(|m| m.offset != Vec3::ZERO) {
                return push_volume(&mut eccentric, element, stations, |k| found[k]);
            }
            if found.iter().any(|m| m.mass != 0.0) {
                push_volume(&mut mass, element, stations, |k| found[k].mass);
            }
            if found.iter().any(|m| m.about_node != Mat3::ZERO) {
                push_volume(&mut rotary, element, stations, |k| found[k].about_node);
            }
        });
        let mass = BeamMass::new(&mass);
        rotary.shrink_to_fit();
        eccentric.shrink_to_fit();
        let rotary = RotaryInertia { elements: rotary, gyroscopic };
        let eccentric = SectionInertia { elements: eccentric, gyroscopic };
        let has_lumped_mass = bodies.iter().any(|body| body.inertia.mass > 0.0);
        if mass.is_empty() {
            self.reason(
                names[0],
                false,
                if has_lumped_mass { ALL_LUMPED } else { "no section has mass on its centre line" },
            );
        } else {
            self.push(mass, "sections have `rhoA`, and stages or columns need mass".into());
        }
        match (rotary.elements.is_empty(), wanted) {
            (_, false) => self.reason(names[1], false, SWITCHED_OFF),
            (true, _) if !bodies.is_empty() => {
                self.reason(names[1], false, "the rotary inertia of sections is lumped at the nodes")
            }
            (true, _) => self.reason(names[1], false, "no section has rotary inertia (`rhoJ`)"),
            (false, true) => self.push(rotary, "sections have rotary inertia, and stages or columns need mass".into()),
        }
        if bodies.is_empty() {
            self.reason(
                names[3],
                false,
                if !wanted {
                    "rotary inertia is switched off in [effects], and no relative beam has eccentric mass"
                } else {
                    "no beam with interpolation = \"relative\" has rotary inertia or eccentric mass"
                },
            );
        } else {
            self.push(
                RigidBody { name: names[3], bodies, gyroscopic },
                "relative beams with rotary inertia or eccentric mass".into(),
            );
        }
        if eccentric.elements.is_empty() {
            let why = match has_lumped_mass {
                true => "eccentric masses of relative beams are lumped at the nodes",
                false => "no section has its mass centre off the centre line",
            };
            self.reason(names[2], false, why);
        } else {
            self.push(eccentric, "sections with an eccentric `mass`".into());
        }
    }

    pub(super) fn bodies(&mut self) -> Vec<Body> {
        let bodies = &self.deck.bodies;
        bodies.iter().filter_map(|body| self.body(body)).collect()
    }

    fn body(&mut self, body: &deck::Body) -> Option<Body> {
        let (node, _) = self.node(&body.at)?;
        let centre = Mat3(body.inertia.unwrap_or([[0.0; 3]; 3]));
        if let Some(inertia) = body.inertia
            && !is_inertia(inertia)
        {
            let message = "`inertia` of a body has positive principal values, none larger than the sum of the others";
            self.diagnostics.push(Diagnostic::error(message, body.span.clone()));
            return None;
        }
        let inertia = Arc::new(body_inertia(body.mass, Vec3(body.offset), centre));
        let PlacedNode { node, place } = self.mesh.nodes[node];
        Some(Body { node, place, inertia })
    }

    pub(super) fn body_inertia(&mut self) {
        let bodies = self.out.bodies.clone();
        match (bodies.is_empty(), self.dynamic) {
            (true, _) => self.reason("rigid body inertia", false, "no [[body]]"),
            (false, false) => self.reason("rigid body inertia", false, "no dynamic stage"),
            (false, true) => {
                let reason = format!("{} [[body]] table(s), and stages or columns need mass", bodies.len());
                let gyroscopic = self.deck.effects.allow(EffectWord::Gyroscopic);
                self.push(RigidBody { name: "rigid body inertia", bodies, gyroscopic }, reason);
            }
        }
    }

    /// For each stage with a `frame` an effect of its own.
    pub(super) fn rotating_frames(&mut self) {
        let framed = self.framed_stages();
        if framed.is_empty() {
            return self.reason("rotating frame", false, "no stage has a `frame`");
        }
        let mut ramps = self.frame_ramps(&framed);
        let (elements, nodal) =
            self.inertia_elements(|element, station, inertia| (inertia, element.between(&station.shape)));
        let bodies = [nodal, self.out.bodies.clone()].concat();
        for (&stage, &motion) in &framed {
            let (elements, bodies) = (elements.clone(), bodies.clone());
            self.out.effects.push(Arc::new(RotatingFrame {
                stage,
                motion,
                ramp: ramps.remove(&stage),
                elements,
                bodies,
            }));
        }
        self.reason("rotating frame", true, format!("{} stage(s) with a `frame`", framed.len()));
    }

    /// The motions of the frames of stages, by their numbers from 0.
    fn framed_stages(&mut self) -> BTreeMap<usize, FrameMotion> {
        let mut framed = BTreeMap::new();
        for (number, stage) in self.deck.stages.iter().enumerate() {
            let Some(frame) = &stage.frame else { continue };
            match frame.about.as_ref().map_or(Ok(Vec3::ZERO), |point| names::place(self.deck, point)) {
                Ok(about) => drop(framed.insert(number, FrameMotion { spin: Vec3(frame.spin), about })),
                Err(diagnostic) => self.diagnostics.push(diagnostic),
            }
        }
        framed
    }

    /// How static stages come to the motions of their frames: from that of the stage before, or from
    /// rest about the same axis. Stages with one motion have one amplitude: what one has brought in
    /// stays for the next.
    fn frame_ramps(&mut self, framed: &BTreeMap<usize, FrameMotion>) -> BTreeMap<usize, FrameRamp> {
        let deck = self.deck;
        let moving = deck.stages.iter().enumerate().filter(|(_, stage)| stage.body.kind().advances_state());
        let mut groups: Vec<(FrameMotion, Vec<usize>)> = Vec::new();
        let mut before: Option<FrameMotion> = None;
        for (number, stage) in moving {
            let motion = framed.get(&number).filter(|_| stage.body.kind().ramps_load()).copied();
            match (motion, groups.last_mut()) {
                (Some(motion), Some((_, group))) if before == Some(motion) => group.push(number),
                (Some(motion), _) => {
                    let at_rest = FrameMotion { spin: Vec3::ZERO, about: motion.about };
                    groups.push((before.unwrap_or(at_rest), vec![number]));
                }
                (None, _) => {}
            }
            before = motion;
        }
        let mut ramps = BTreeMap::new();
        for (from, group) in groups {
            let numbers: Vec<usize> = group.iter().map(|stage| stage + 1).collect();
            let Some(amplitude) = self.amplitude(None, Some(&numbers)) else { continue };
            ramps.extend(group.into_iter().map(|stage| (stage, FrameRamp { from, amplitude })));
        }
        ramps
    }

    /// Visits the elements with the mass properties of their volume points, about the centre line
    /// and in global axes, and returns what sits at nodes instead: on beams whose rotations are
    /// relative all that turns with the section, because no chart matters there.
    fn each_inertia(&self, mut visit: impl FnMut(&BeamElement, &[Station], &[Inertia])) -> Vec<Body> {
        let rotary = self.deck.effects.allow(EffectWord::RotaryInertia);
        let mut nodal = NodalInertia::new(self.mesh.nodes.len());
        self.each_element(|element| {
            let beam = element.beam;
            let stations = element.stations(Rule::Volume);
            let relative = beam.interpolation == InterpolationWord::Relative;
            let eccentric = stations.iter().any(|station| mass_at(beam, station).offset != Vec3::ZERO);
            if relative && eccentric {
                return add_at_nodes(&mut nodal, element, |whole| whole);
            }
            if relative && rotary {
                add_at_nodes(&mut nodal, element, |whole| Inertia { mass: 0.0, ..whole });
            }
            let turns = eccentric || (rotary && !relative);
            let at = |station: &Station| {
                let whole = mass_at(beam, station).turned(station.axes);
                if turns { whole } else { Inertia { about_node: Mat3::ZERO, ..whole } }
            };
            let found: Vec<Inertia> = stations.iter().map(at).collect();
            visit(element, &stations, &found);
        });
        nodal.bodies(|node| self.mesh.nodes[node])
    }

    /// All mass of beams: elements with a quantity of each of their points, and the bodies that sit
    /// at nodes instead.
    fn inertia_elements<Q: Copy + PartialEq>(
        &self,
        quantity: impl Fn(&BeamElement, &Station, Inertia) -> Q,
    ) -> (VolumeElements<Q>, Vec<Body>) {
        let mut elements = VolumeElements::default();
        let nodal = self.each_inertia(|element, stations, found| {
            push_volume(&mut elements, element, stations, |k| quantity(element, &stations[k], found[k]));
        });
        elements.shrink_to_fit();
        (elements, nodal)
    }

    pub(super) fn gravity(&mut self) {
        let mut bodies = self.out.bodies.clone();
        let acceleration = self.deck.gravity.as_ref().map(|g| Vec3(g.value)).filter(|g| *g != Vec3::ZERO);
        let Some(acceleration) = acceleration else {
            let why = if !self.deck.effects.allow(EffectWord::Gravity) {
                SWITCHED_OFF
            } else if self.deck.gravity.is_some() {
                "`gravity` is zero"
            } else {
                "no `gravity`"
            };
            self.reason("gravity on beams", false, why);
            return self.reason("gravity on bodies", false, why);
        };
        let Some(amplitude) = self.amplitude(None, None) else { return };
        if self.mesh.element_count == 0 {
            self.reason("gravity on beams", false, "no beams");
        } else {
            let (elements, nodal) = self.inertia_elements(|_, _, inertia| inertia);
            bodies.extend(nodal.into_iter().filter(|body| body.inertia.mass > 0.0));
            if elements.is_empty() {
                self.reason("gravity on beams", false, ALL_LUMPED);
            } else {
                self.push(BeamGravity { acceleration, amplitude, elements }, "`gravity` is set".into());
            }
        }
        if bodies.is_empty() {
            self.reason("gravity on bodies", false, "no [[body]]");
        } else {
            self.push(BodyGravity { acceleration, amplitude, bodies }, "`gravity` is set".into());
        }
    }

    /// Rayleigh damping, each part only where its factor is not zero.
    pub(super) fn damping(&mut self) {
        let names = ["mass-proportional damping of beams", "mass-proportional damping of bodies"];
        let mass = self.deck.damping.map_or(0.0, |damping| damping.mass);
        if mass == 0.0 || !self.dynamic {
            let why = if !self.deck.effects.allow(EffectWord::Damping) {
                SWITCHED_OFF
            } else if mass == 0.0 {
                "no `mass` in [damping]"
            } else {
                "no stage with motion"
            };
            return names.into_iter().for_each(|name| self.reason(name, false, why));
        }
        let (elements, nodal) = self.inertia_elements(|_, _, inertia| inertia);
        if elements.is_empty() {
            self.reason(names[0], false, if nodal.is_empty() { "no beams with mass" } else { ALL_LUMPED });
        } else {
            self.push(BeamMassDamping { factor: mass, elements }, "`mass` in [damping]".into());
        }
        let bodies = [nodal, self.out.bodies.clone()].concat();
        if bodies.is_empty() {
            self.reason(names[1], false, "no bodies");
        } else {
            self.push(BodyMassDamping { factor: mass, bodies }, "`mass` in [damping]".into());
        }
    }
}

/// Adds the sections of an element to its nodes, each with the part of its mass properties that `pick` leaves.
fn add_at_nodes(nodal: &mut NodalInertia, element: &BeamElement, pick: impl Fn(Inertia) -> Inertia) {
    for (station, &node) in element.stations(Rule::Nodal).iter().zip(element.nodes) {
        let own = pick(mass_at(element.beam, station).turned(station.axes));
        nodal.add(node, &own, station.weight);
    }
}

fn mass_at(beam: &MeshBeam, station: &Station) -> MassPerLength {
    beam.section.at(station.fraction).mass_per_length()
}

/// True if a matrix can be the inertia of a body: no principal value negative, none larger than the
/// sum of the others.
fn is_inertia(matrix: [[f64; 3]; 3]) -> bool {
    let eigen = nalgebra::SymmetricEigen::new(nalgebra::Matrix3::from_fn(|i, j| matrix[i][j])).eigenvalues;
    let slack = 1e-9 * eigen.amax();
    let sum = eigen.sum();
    eigen.iter().all(|&value| value >= -slack && 2.0 * value <= sum + slack)
}
