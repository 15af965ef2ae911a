//! Which effects act: for each table that stands in the deck one effect, and for each the reason.

use super::joints::FoundJoint;
use super::mesh::{Mesh, MeshBeam, MeshElement, Station};
use super::names;
use super::section::MassPerLength;
use crate::deck::{self, Deck, Diagnostic, Frame, InterpolationWord, JointKind, LoadTarget, LoadVector};
use crate::effect::beam_elasticity::{BeamElasticity, ElasticElement, ElasticElements, StressField};
use crate::effect::beam_mass::BeamMass;
use crate::effect::gravity::{BeamGravity, BodyGravity};
use crate::effect::interpolation::{Interpolation, RelativeVectors, TotalVectors};
use crate::effect::joint::{self, Joints};
use crate::effect::line_load::{LineLoad, LineLoadKind};
use crate::effect::link::{self, Links};
use crate::effect::mass_damping::{BeamMassDamping, BodyMassDamping};
use crate::effect::node_load::{self, NodeLoad, NodeLoadKind};
use crate::effect::rigid_body::{Body, RigidBody};
use crate::effect::rotary_inertia::RotaryInertia;
use crate::effect::rotating_frame::RotatingFrame;
use crate::effect::section_inertia::SectionInertia;
use crate::effect::spring::{self, Spring};
use crate::effect::strain_rate_damping::StrainRateDamping;
use crate::effect::{ByOrder, Connection, Effect, VolumeElement, VolumeElements};
use crate::kernel::beam::StiffnessPoint;
use crate::kernel::elastic::Strain;
use crate::kernel::inertia::Inertia;
use crate::kernel::load::Intensity;
use crate::kernel::volume::VolumePoint;
use crate::model::{Amplitude, History, SlotInfo, SlotKind, StageSet, Support};
use crate::system::Direction;
use crate::tensor::{Mat3, Vec3};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// An effect that a scene may have: acting or not, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Reason {
    /// The effect
    pub name: &'static str,
    /// Whether it acts
    pub active: bool,
    /// Why
    pub reason: String,
}

/// The effects of a scene with what they need.
pub struct Composition {
    /// The effects
    pub effects: Vec<Arc<dyn Effect>>,
    /// Every effect that beamsim knows, acting or not
    pub reasons: Vec<Reason>,
    /// The factors of loads and springs
    pub amplitudes: Vec<Amplitude>,
    /// The elasticity, for resultants
    pub elasticity: Vec<Arc<dyn StressField>>,
    /// Rigid bodies
    pub bodies: Vec<Body>,
    /// Springs to ground
    pub springs: Vec<spring::Instance>,
    /// Slots of multipliers, behind those of the mesh
    pub multipliers: Vec<SlotInfo>,
    /// Components of these that nothing uses
    pub idle_multipliers: Vec<Support>,
    /// Nodes whose rotation a joint takes hold of
    pub jointed: Vec<usize>,
    /// How many joints remember their angle
    pub angles: usize,
}

/// Collects effects while the tables of the deck are walked through.
struct Composer<'a> {
    deck: &'a Deck,
    mesh: &'a Mesh,
    histories: &'a HashMap<String, Arc<dyn History>>,
    diagnostics: &'a mut Vec<Diagnostic>,
    out: Composition,
    known_amplitudes: HashMap<(Option<String>, Option<Vec<usize>>), usize>,
    dynamic: bool,
}

/// Composes the effects of a deck.
pub fn compose(
    deck: &Deck,
    mesh: &Mesh,
    histories: &HashMap<String, Arc<dyn History>>,
    connections: &[FoundJoint],
    diagnostics: &mut Vec<Diagnostic>,
) -> Composition {
    let dynamic = needs_mass(deck);
    let out = Composition {
        effects: Vec::new(),
        reasons: Vec::new(),
        amplitudes: Vec::new(),
        elasticity: Vec::new(),
        bodies: Vec::new(),
        springs: Vec::new(),
        multipliers: Vec::new(),
        idle_multipliers: Vec::new(),
        jointed: Vec::new(),
        angles: 0,
    };
    let mut composer = Composer { deck, mesh, histories, diagnostics, out, known_amplitudes: HashMap::new(), dynamic };
    composer.elasticity();
    composer.springs();
    composer.links();
    composer.joints(connections);
    composer.beam_inertia();
    composer.out.bodies = composer.bodies();
    composer.gravity();
    composer.body_inertia();
    composer.damping();
    composer.rotating_frames();
    let along = composer.line_loads();
    composer.node_loads(along);
    composer.never();
    composer.out
}

impl Composer<'_> {
    fn push(&mut self, effect: impl Effect + 'static, reason: String) {
        self.reason(effect.name(), true, reason);
        self.out.effects.push(Arc::new(effect));
    }

    fn reason(&mut self, name: &'static str, active: bool, reason: impl Into<String>) {
        self.out.reasons.push(Reason { name, active, reason: reason.into() });
    }

    /// The number of the amplitude with this history and these stages.
    fn amplitude(&mut self, history: Option<&deck::Spanned<String>>, stages: Option<&Vec<usize>>) -> Option<usize> {
        let key = (history.map(|h| h.value.clone()), stages.cloned());
        if let Some(&number) = self.known_amplitudes.get(&key) {
            return Some(number);
        }
        let function = match history {
            None => None,
            Some(name) => match self.histories.get(&name.value) {
                Some(function) => Some(function.clone()),
                None => {
                    let known = self.deck.histories.iter().map(|h| h.name.value.as_str());
                    self.diagnostics.push(names::unknown("history", name, known));
                    return None;
                }
            },
        };
        self.out.amplitudes.push(Amplitude::of_load(function, stage_set(stages)));
        self.known_amplitudes.insert(key, self.out.amplitudes.len() - 1);
        Some(self.out.amplitudes.len() - 1)
    }

    fn node(&mut self, name: &deck::Spanned<String>) -> Option<(usize, Option<(usize, f64)>)> {
        self.mesh.find_node(self.deck, name).map_err(|d| self.diagnostics.push(d)).ok()
    }

    fn elasticity(&mut self) {
        self.elasticity_of::<TotalVectors>(InterpolationWord::Total);
        self.elasticity_of::<RelativeVectors>(InterpolationWord::Relative);
    }

    fn elasticity_of<I: Interpolation>(&mut self, way: InterpolationWord) {
        let free: HashMap<String, usize> = self.free_strains();
        let mut elements = ElasticElements::default();
        self.each_element(|beam, number, element, mesh| {
            if beam.interpolation != way {
                return;
            }
            let free = free.get(&beam.name).copied();
            match element.nodes.len() {
                2 => elements.two.push(elastic::<2, 1>(mesh, beam, number, element, free)),
                3 => elements.three.push(elastic::<3, 2>(mesh, beam, number, element, free)),
                _ => elements.four.push(elastic::<4, 3>(mesh, beam, number, element, free)),
            }
        });
        if elements.is_empty() {
            return self.reason(
                I::NAME,
                false,
                if self.mesh.elements.is_empty() { "no beams" } else { "no such beams" },
            );
        }
        let count = elements.two.len() + elements.three.len() + elements.four.len();
        let effect = Arc::new(BeamElasticity::<I>::new(elements));
        self.reason(I::NAME, true, format!("{count} beam elements"));
        self.out.elasticity.push(effect.clone());
        self.out.effects.push(effect.clone());
        match self.deck.damping {
            Some([_, factor]) if factor != 0.0 && self.dynamic => {
                self.push(StrainRateDamping { elasticity: effect, factor }, "`stiffness` in [damping]".into());
            }
            _ => self.reason(I::DAMPING_NAME, false, "no `stiffness` in [damping], or nothing moves in time"),
        }
    }

    /// The amplitudes of free strains, by beam.
    fn free_strains(&mut self) -> HashMap<String, usize> {
        let beams: Vec<(String, deck::FreeStrain)> =
            self.mesh.beams.iter().filter_map(|b| Some((b.name.clone(), b.free_strain.clone()?))).collect();
        let numbered =
            |(name, free): (String, deck::FreeStrain)| Some((name, self.amplitude(free.history.as_ref(), None)?));
        beams.into_iter().filter_map(numbered).collect()
    }

    fn each_element(&self, mut visit: impl FnMut(&MeshBeam, usize, &MeshElement, &Mesh)) {
        for beam in &self.mesh.beams {
            for number in beam.elements.clone() {
                visit(beam, number, &self.mesh.elements[number], self.mesh);
            }
        }
    }

    /// Mass on the centre line, rotary inertia, and eccentric mass: each only where some section has it. Beams whose rotations
    /// are relative have what turns with the section at their nodes, where no chart matters.
    fn beam_inertia(&mut self) {
        let names = ["beam mass", "rotary inertia", "eccentric section inertia", "section inertia at nodes"];
        if !self.dynamic || self.mesh.elements.is_empty() {
            let why = if self.mesh.elements.is_empty() { "no beams" } else { "no dynamic stage" };
            return names.into_iter().for_each(|name| self.reason(name, false, why));
        }
        let wanted = self.deck.effects.rotary_inertia.as_ref().map(|flag| flag.value);
        let (mut mass, mut rotary, mut eccentric) = (ByOrder::default(), ByOrder::default(), ByOrder::default());
        let mut nodal = NodalInertia::default();
        self.each_element(|beam, number, element, mesh| {
            let found: Vec<MassPerLength> = element.volume.iter().map(|s| mass_at(beam, s)).collect();
            let relative = beam.interpolation == InterpolationWord::Relative;
            if relative && found.iter().any(|m| m.offset != Vec3::ZERO) {
                return nodal.add(beam, element, |m| m);
            }
            if relative && found.iter().any(|m| m.about_line != Mat3::ZERO) && wanted != Some(false) {
                nodal.add(beam, element, |m| Inertia { mass: 0.0, ..m });
            }
            if found.iter().any(|m| m.offset != Vec3::ZERO) {
                push_volume(&mut eccentric, mesh, number, element, |k, s| found[k].turned(s.axes));
                return;
            }
            if found.iter().any(|m| m.mass != 0.0) {
                push_volume(&mut mass, mesh, number, element, |k, _| found[k].mass);
            }
            if found.iter().any(|m| m.about_line != Mat3::ZERO) && wanted != Some(false) && !relative {
                push_volume(&mut rotary, mesh, number, element, |k, s| found[k].turned(s.axes).about_node);
            }
        });
        let (mass, rotary, eccentric) =
            (BeamMass { elements: mass }, RotaryInertia { elements: rotary }, SectionInertia { elements: eccentric });
        if mass.elements.is_empty() {
            self.reason(names[0], false, "no section has mass on its centre line");
        } else {
            self.push(mass, "a dynamic stage, and sections with `rhoA`".into());
        }
        match (rotary.elements.is_empty(), wanted) {
            (_, Some(false)) => self.reason(names[1], false, "switched off in [effects]"),
            (true, _) => self.reason(names[1], false, "no section has rotary inertia (`rhoJ`)"),
            _ => self.push(rotary, "a dynamic stage, and sections with rotary inertia".into()),
        }
        let bodies = nodal.bodies(self.mesh);
        if bodies.is_empty() {
            self.reason(
                names[3],
                false,
                "no beam with interpolation = \"relative\" has rotary inertia or eccentric mass",
            );
        } else {
            self.push(
                RigidBody { name: names[3], bodies },
                "relative beams with rotary inertia or eccentric mass".into(),
            );
        }
        if eccentric.elements.is_empty() {
            self.reason(names[2], false, "no section has its mass centre off the centre line");
        } else {
            self.push(eccentric, "sections with an eccentric `mass`".into());
        }
    }

    fn bodies(&mut self) -> Vec<Body> {
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
        let d = Vec3(body.offset);
        let steiner = (Mat3::diagonal([d.squared(); 3]) - d.outer(d)) * body.mass;
        let inertia = Inertia { mass: body.mass, offset: d, about_node: centre + steiner };
        let node = &self.mesh.nodes[node];
        Some(Body { node: node.node, place: node.place, inertia })
    }

    fn body_inertia(&mut self) {
        let bodies = self.out.bodies.clone();
        match (bodies.is_empty(), self.dynamic) {
            (true, _) => self.reason("rigid body inertia", false, "no [[body]]"),
            (_, false) => self.reason("rigid body inertia", false, "no dynamic stage"),
            _ => {
                let reason = format!("{} [[body]] table(s) and a dynamic stage", bodies.len());
                self.push(RigidBody { name: "rigid body inertia", bodies }, reason);
            }
        }
    }

    /// For each stage with a `frame` an effect of its own.
    fn rotating_frames(&mut self) {
        let framed: Vec<(usize, deck::Stage)> =
            self.deck.stages.iter().cloned().enumerate().filter(|(_, stage)| stage.frame.is_some()).collect();
        if framed.is_empty() {
            return self.reason("rotating frame", false, "no stage has a `frame`");
        }
        let is_static =
            |stage: &deck::Stage| matches!(stage.body, deck::StageBody::Static { .. } | deck::StageBody::Path { .. });
        // One amplitude for all static stages: what one has brought in stays for the next.
        let ramped: Vec<usize> = framed.iter().filter(|(_, stage)| is_static(stage)).map(|(k, _)| k + 1).collect();
        let amplitude = if ramped.is_empty() { None } else { self.amplitude(None, Some(&ramped)) };
        let (elements, bodies) = self.placed_inertia();
        for (number, stage) in &framed {
            let Some(frame) = &stage.frame else { continue };
            let about = match &frame.about {
                None => Vec3::ZERO,
                Some(deck::Spanned { value: deck::PointRef::Coordinates(x), .. }) => Vec3(*x),
                Some(deck::Spanned { value: deck::PointRef::Name(name), span }) => {
                    match names::point(self.deck, name) {
                        Some(place) => place,
                        None => {
                            let name = deck::Spanned { value: name.clone(), span: span.clone() };
                            self.diagnostics.push(names::unknown("point", &name, names::points(self.deck)));
                            continue;
                        }
                    }
                }
            };
            self.out.effects.push(Arc::new(RotatingFrame {
                stage: *number,
                spin: Vec3(frame.spin),
                about,
                amplitude: amplitude.filter(|_| is_static(stage)),
                elements: elements.clone(),
                bodies: bodies.clone(),
            }));
        }
        self.reason("rotating frame", true, format!("{} stage(s) with a `frame`", framed.len()));
    }

    /// All mass of the scene with its initial place; that of relative beams which turns with the section sits at their nodes.
    fn placed_inertia(&self) -> (VolumeElements<(Inertia, Vec3)>, Vec<Body>) {
        let rotary = self.deck.effects.rotary_inertia.as_ref().is_none_or(|flag| flag.value);
        let (mut elements, mut nodal) = (ByOrder::default(), NodalInertia::default());
        self.each_element(|beam, number, element, mesh| {
            let found: Vec<MassPerLength> = element.volume.iter().map(|s| mass_at(beam, s)).collect();
            let relative = beam.interpolation == InterpolationWord::Relative;
            let eccentric = found.iter().any(|m| m.offset != Vec3::ZERO);
            if relative && (eccentric || rotary) {
                nodal.add(beam, element, |m| if eccentric { m } else { Inertia { mass: 0.0, ..m } });
            }
            if relative && eccentric {
                return;
            }
            push_volume(&mut elements, mesh, number, element, |k, s| {
                let own = found[k].turned(s.axes);
                let without = relative || !(rotary || eccentric);
                let own = if without { Inertia { about_node: Mat3::ZERO, ..own } } else { own };
                (
                    own,
                    element.nodes.iter().zip(&s.shape).fold(Vec3::ZERO, |sum, (&n, &w)| sum + mesh.nodes[n].place * w),
                )
            });
        });
        (elements, [nodal.bodies(self.mesh), self.out.bodies.clone()].concat())
    }

    fn gravity(&mut self) {
        let mut bodies = self.out.bodies.clone();
        let acceleration = self.deck.gravity.as_ref().map(|g| Vec3(g.value)).filter(|g| *g != Vec3::ZERO);
        let Some(acceleration) = acceleration else {
            let why = if self.deck.gravity.is_some() { "`gravity` is zero" } else { "no `gravity`" };
            self.reason("gravity on beams", false, why);
            return self.reason("gravity on bodies", false, why);
        };
        let Some(amplitude) = self.amplitude(None, None) else { return };
        if self.mesh.elements.is_empty() {
            self.reason("gravity on beams", false, "no beams");
        } else {
            let mut elements = ByOrder::default();
            let mut nodal = NodalInertia::default();
            self.each_element(|beam, number, element, mesh| {
                let found: Vec<MassPerLength> = element.volume.iter().map(|s| mass_at(beam, s)).collect();
                let eccentric = found.iter().any(|m| m.offset != Vec3::ZERO);
                if eccentric && beam.interpolation == InterpolationWord::Relative {
                    return nodal.add(beam, element, |m| m);
                }
                push_volume(&mut elements, mesh, number, element, |k, s| found[k].turned(s.axes));
            });
            bodies.extend(nodal.bodies(self.mesh));
            if elements.is_empty() {
                self.reason("gravity on beams", false, "all masses of beams are eccentric and sit at their nodes");
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

    /// Joints that need multipliers, and springs and dampers of those that do not.
    fn joints(&mut self, connections: &[FoundJoint]) {
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
            // Supports hold it; what is left is its drive, or the one direction of a universal joint.
            match joint.kind {
                JointKind::Universal => kind.held = [true; 3],
                _ if sprung => kind.normal = &[],
                _ => return None,
            }
            if joint.motor.is_some() {
                return None;
            }
        }
        let motor = match &joint.motor {
            None => None,
            Some((value, history)) => {
                self.refuse_jump(joint, history.is_none());
                Some(joint::Motor { value: *value, amplitude: self.amplitude(history.as_ref(), None)? })
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
        self.out.jointed.extend(connection.nodes.into_iter().flatten());
        if !shared && !support {
            instance.along = Some(self.multiplier(SlotKind::Force, connection));
        }
        if !kind.normal.is_empty() || (motor.is_some() && joint.kind == JointKind::Revolute) {
            instance.between = Some(self.multiplier(SlotKind::Moment, connection));
        }
        for slot in [instance.along, instance.between].into_iter().flatten() {
            let used = instance.used(slot);
            let directions = (0..3).filter(|&k| !used[k]).map(|k| Direction { slot, axis: Vec3::UNIT[k] }).collect();
            self.out.idle_multipliers.push(Support { directions, stages: StageSet::default() });
        }
        Some(instance)
    }

    fn multiplier(&mut self, kind: SlotKind, connection: &FoundJoint) -> u32 {
        let names = connection.nodes.into_iter().flatten().map(|node| self.mesh.nodes[node].name.as_str());
        let node = format!("joint of {}", names.collect::<Vec<_>>().join(" and "));
        self.out.multipliers.push(SlotInfo { kind, node, place: connection.place });
        (self.mesh.slots() + self.out.multipliers.len() - 1) as u32
    }

    /// A motor that acts in full from the start would jump.
    fn refuse_jump(&mut self, joint: &deck::Joint, without_history: bool) {
        let dynamic = matches!(self.deck.stages.first().map(|s| &s.body), Some(deck::StageBody::Dynamic { .. }));
        if dynamic && without_history {
            let message = "the motor of this joint would jump: it has no history, and the first stage is dynamic";
            let diagnostic = Diagnostic::error(message, joint.span.clone());
            self.diagnostics.push(diagnostic.help("give it a `history` that begins with 0"));
        }
    }

    fn springs(&mut self) {
        let mut springs = Vec::new();
        for spring in &self.deck.springs {
            let deck::SpringBody::Ground { at, stiffness: k, damping: c, axes } = &spring.body else { continue };
            let Some((node, _)) = self.node(at) else { continue };
            let axes = super::constraints::axes(*axes);
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

    fn links(&mut self) {
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
        self.push(Links { links }, reason);
    }

    /// Rayleigh damping, each part only where its factor is not zero.
    fn damping(&mut self) {
        let names = ["mass-proportional damping of beams", "mass-proportional damping of bodies"];
        let [mass, _] = self.deck.damping.unwrap_or_default();
        if mass == 0.0 || !self.dynamic {
            let why = if mass == 0.0 { "no `mass` in [damping]" } else { "nothing moves in time" };
            return names.into_iter().for_each(|name| self.reason(name, false, why));
        }
        let rotary = self.deck.effects.rotary_inertia.as_ref().is_none_or(|flag| flag.value);
        let (mut elements, mut nodal) = (ByOrder::default(), NodalInertia::default());
        self.each_element(|beam, number, element, mesh| {
            let found: Vec<MassPerLength> = element.volume.iter().map(|s| mass_at(beam, s)).collect();
            let relative = beam.interpolation == InterpolationWord::Relative;
            let eccentric = found.iter().any(|m| m.offset != Vec3::ZERO);
            if relative && (eccentric || rotary) {
                nodal.add(beam, element, |m| if eccentric { m } else { Inertia { mass: 0.0, ..m } });
            }
            if !(relative && eccentric) {
                push_volume(&mut elements, mesh, number, element, |k, s| {
                    let own = found[k].turned(s.axes);
                    let without = relative || !(rotary || eccentric);
                    if without { Inertia { about_node: Mat3::ZERO, ..own } } else { own }
                });
            }
        });
        if elements.is_empty() {
            self.reason(names[0], false, "no beams with mass");
        } else {
            self.push(BeamMassDamping { factor: mass, elements }, "`mass` in [damping]".into());
        }
        let bodies = [nodal.bodies(self.mesh), self.out.bodies.clone()].concat();
        if bodies.is_empty() {
            self.reason(names[1], false, "no bodies");
        } else {
            self.push(BodyMassDamping { factor: mass, bodies }, "`mass` in [damping]".into());
        }
    }

    /// Loads at nodes, and beside them those that line loads on relative beams leave there.
    fn node_loads(&mut self, mut loads: NodeLoads) {
        use NodeLoadKind::{MaterialForce, MaterialMoment, SpatialForce, SpatialMoment};
        let kinds = [SpatialForce, SpatialMoment, MaterialForce, MaterialMoment];
        for load in &self.deck.loads {
            let LoadTarget::At(at) = &load.target else { continue };
            let Some((node, on)) = self.node(at) else { continue };
            let Some(amplitude) = self.amplitude(load.history.as_ref(), load.stages.as_ref()) else { continue };
            let Some(frame) = self.load_axes(load, at, node, on) else { continue };
            let node = self.mesh.nodes[node].node;
            for (vector, kind) in [(load.force, force_kind(load)), (load.moment, force_kind(load) + 1)] {
                if let Some(vector) = vector {
                    loads[kind].push(node_load::Instance { node, vector: frame * Vec3(vector.start), amplitude });
                }
            }
        }
        for (kind, loads) in kinds.into_iter().zip(loads) {
            let effect = NodeLoad { kind, loads };
            if effect.loads.is_empty() {
                self.reason(effect.name(), false, "no such [[load]] at a node");
            } else {
                let reason = format!("{} at nodes", effect.loads.len());
                self.push(effect, reason);
            }
        }
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
            _ => {
                let message = format!("several beams meet at `{}`; whose section is meant?", at.value);
                let (first, fraction) = beams[0];
                let end = if fraction > 0.5 { "end" } else { "start" };
                let help = format!("name the node on a beam, such as `{}@{end}`", self.mesh.beams[first].name);
                self.diagnostics.push(Diagnostic::error(message, at.span.clone()).help(help));
                None
            }
        }
    }

    /// Line loads; those that turn with a relative beam are returned as loads at its nodes.
    fn line_loads(&mut self) -> NodeLoads {
        let (mut spatial, mut material) = (ByOrder::default(), ByOrder::default());
        let mut nodal = NodeLoads::default();
        for load in &self.deck.loads {
            let LoadTarget::Along(along) = &load.target else { continue };
            let Some(beam) = self.mesh.beams.iter().find(|b| b.name == along.value) else {
                if !self.deck.beams.iter().any(|b| b.name.value == along.value) {
                    let known = self.deck.beams.iter().map(|b| b.name.value.as_str());
                    self.diagnostics.push(names::unknown("beam", along, known));
                }
                continue;
            };
            let Some(amplitude) = self.amplitude(load.history.as_ref(), load.stages.as_ref()) else { continue };
            let out = if load.frame == Frame::Space { &mut spatial } else { &mut material };
            let turning = load.frame != Frame::Space || load.moment.is_some();
            for number in beam.elements.clone() {
                let element = &self.mesh.elements[number];
                if turning && beam.interpolation == InterpolationWord::Relative {
                    add_nodal_loads(&mut nodal, load, element, self.mesh, amplitude);
                    continue;
                }
                push_volume(out, self.mesh, number, element, |_, station| intensity(load, station, amplitude));
            }
        }
        for (kind, elements) in [(LineLoadKind::Spatial, spatial), (LineLoadKind::Material, material)] {
            let effect = LineLoad { kind, elements };
            if effect.elements.is_empty() {
                self.reason(effect.name(), false, "no such [[load]] along a beam");
            } else {
                self.push(effect, "[[load]] along a beam".into());
            }
        }
        nodal
    }

    /// What is known and never acts yet.
    fn never(&mut self) {
        let seams = self.mesh.beams.iter().any(|beam| beam.interpolation == InterpolationWord::Total);
        let why = if seams {
            "as soon as neighbouring nodes of beams with interpolation = \"total\" sit in different charts"
        } else {
            "no beam with interpolation = \"total\""
        };
        self.reason("mixed elements", seams, why);
        self.reason("planar", false, "not supported yet: every scene is simulated in three dimensions");
    }
}

/// Inertia is there for dynamic stages, and where momenta are looked at.
fn needs_mass(deck: &Deck) -> bool {
    let inertia =
        |body: &deck::StageBody| matches!(body, deck::StageBody::Dynamic { .. } | deck::StageBody::Modal { .. });
    let dynamic = deck.stages.iter().any(|stage| inertia(&stage.body) || stage.frame.is_some());
    let written = deck.output.columns.iter().flatten().any(|group| group.value == "momentum");
    let expected = deck.expects.iter().any(|expect| match &expect.body {
        deck::ExpectBody::Column { column, .. } => column.value.starts_with("momentum."),
        deck::ExpectBody::Fails(_) => false,
    });
    let watched = deck.stages.iter().filter_map(|s| s.until.as_ref()).any(|u| u.column.value.starts_with("momentum."));
    dynamic || written || expected || watched
}

/// The stages of the deck count from 1, those of a run from 0.
pub fn stage_set(stages: Option<&Vec<usize>>) -> StageSet {
    StageSet(stages.map(|stages| stages.iter().map(|s| s - 1).collect()))
}

fn connect<const N: usize>(mesh: &Mesh, number: usize, element: &MeshElement) -> Connection<N> {
    Connection {
        element: number as u32,
        nodes: std::array::from_fn(|i| mesh.nodes[element.nodes[i]].node),
        places: std::array::from_fn(|i| mesh.nodes[element.nodes[i]].place),
    }
}

/// Pushes an element with volume points into the batch of its order.
fn push_volume<Q: Copy>(
    batches: &mut VolumeElements<Q>,
    mesh: &Mesh,
    number: usize,
    element: &MeshElement,
    quantity: impl Fn(usize, &Station) -> Q,
) {
    match element.nodes.len() {
        2 => batches.two.push(volume(mesh, number, element, quantity)),
        3 => batches.three.push(volume(mesh, number, element, quantity)),
        _ => batches.four.push(volume(mesh, number, element, quantity)),
    }
}

fn volume<const N: usize, Q: Copy>(
    mesh: &Mesh,
    number: usize,
    element: &MeshElement,
    quantity: impl Fn(usize, &Station) -> Q,
) -> VolumeElement<N, Q> {
    let point = |k: usize| {
        let station = &element.volume[k];
        VolumePoint {
            shape: std::array::from_fn(|i| station.shape[i]),
            weight: station.weight,
            quantity: quantity(k, station),
        }
    };
    VolumeElement { connection: connect(mesh, number, element), points: std::array::from_fn(point) }
}

fn elastic<const N: usize, const G: usize>(
    mesh: &Mesh,
    beam: &MeshBeam,
    number: usize,
    element: &MeshElement,
    free: Option<usize>,
) -> ElasticElement<N, G> {
    let point = |k: usize| {
        let station = &element.inner[k];
        StiffnessPoint {
            shape: std::array::from_fn(|i| station.shape[i]),
            slope: std::array::from_fn(|i| station.slope[i]),
            weight: station.weight,
            tangent: station.axes.column(0),
            stiffness: beam.section.at(station.fraction).stiffness_in(station.axes),
            free: beam.free_strain.as_ref().map(|free| free_strain(free.strain, station.axes)),
        }
    };
    ElasticElement { connection: connect(mesh, number, element), points: std::array::from_fn(point), free }
}

/// From section axes to global components.
fn free_strain(strain: [f64; 6], axes: Mat3) -> Strain {
    let [g1, g2, g3, k1, k2, k3] = strain;
    Strain { gamma: axes * Vec3([g1, g2, g3]), kappa: axes * Vec3([k1, k2, k3]) }
}

/// Mass properties of sections, collected at nodes: mass, first moment of mass, inertia about the node.
#[derive(Default)]
struct NodalInertia {
    nodes: BTreeMap<usize, (f64, Vec3, Mat3)>,
}

impl NodalInertia {
    /// Adds what an element brings to its nodes; `pick` may leave parts out.
    fn add(&mut self, beam: &MeshBeam, element: &MeshElement, pick: impl Fn(Inertia) -> Inertia) {
        for (station, &node) in element.nodal.iter().zip(&element.nodes) {
            let own = pick(mass_at(beam, station).turned(station.axes));
            let (mass, moment, about) = self.nodes.entry(node).or_insert((0.0, Vec3::ZERO, Mat3::ZERO));
            *mass += own.mass * station.weight;
            *moment += own.offset * (own.mass * station.weight);
            *about += own.about_node * station.weight;
        }
    }

    fn bodies(self, mesh: &Mesh) -> Vec<Body> {
        let body = |(node, (mass, moment, about_node)): (usize, (f64, Vec3, Mat3))| {
            let offset = if mass > 0.0 { moment * (1.0 / mass) } else { Vec3::ZERO };
            let node = &mesh.nodes[node];
            Body { node: node.node, place: node.place, inertia: Inertia { mass, offset, about_node } }
        };
        self.nodes.into_iter().map(body).collect()
    }
}

/// Loads at nodes by kind: forces and moments fixed in space, then those that turn with the section.
type NodeLoads = [Vec<node_load::Instance>; 4];

/// The place of a load's forces among [`NodeLoads`]; that of its moments is the next.
fn force_kind(load: &deck::Load) -> usize {
    if load.frame == Frame::Space { 0 } else { 2 }
}

/// A load along an element, taken at its nodes.
fn add_nodal_loads(out: &mut NodeLoads, load: &deck::Load, element: &MeshElement, mesh: &Mesh, amplitude: usize) {
    for (station, &node) in element.nodal.iter().zip(&element.nodes) {
        let Intensity { force, moment, .. } = intensity(load, station, amplitude);
        for (vector, kind) in [(force, force_kind(load)), (moment, force_kind(load) + 1)] {
            if vector != Vec3::ZERO {
                let vector = vector * station.weight;
                out[kind].push(node_load::Instance { node: mesh.nodes[node].node, vector, amplitude });
            }
        }
    }
}

fn intensity(load: &deck::Load, station: &Station, amplitude: usize) -> Intensity {
    let axes = if load.frame == Frame::Section { station.exact_axes } else { Mat3::IDENTITY };
    let at = |vector: Option<LoadVector>| {
        let [start, end] = vector.map_or([[0.0; 3]; 2], |v| [v.start, v.end]).map(Vec3);
        axes * (start + (end - start) * station.fraction)
    };
    Intensity { force: at(load.force), moment: at(load.moment), amplitude }
}

fn mass_at(beam: &MeshBeam, station: &Station) -> MassPerLength {
    let none = MassPerLength { mass: 0.0, offset: Vec3::ZERO, about_line: Mat3::ZERO };
    beam.section.at(station.fraction).mass.unwrap_or(none)
}

/// Whether a matrix can be the inertia of a body: principal values not negative, none beyond the sum of the others.
fn is_inertia(matrix: [[f64; 3]; 3]) -> bool {
    let eigen = nalgebra::SymmetricEigen::new(nalgebra::Matrix3::from_fn(|i, j| matrix[i][j])).eigenvalues;
    let slack = 1e-9 * eigen.amax();
    let sum = eigen.sum();
    eigen.iter().all(|&value| value >= -slack && 2.0 * value <= sum + slack)
}
