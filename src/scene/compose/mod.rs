//! Which effects act: for each table that stands in the deck one effect, and for each the reason.

mod connections;
mod contact_reason;
mod contacts;
mod fading;
mod inertia;
mod loads;
mod sliders;
mod spins;

pub use sliders::SliderMotion;

use super::constraints::find_history;
use super::joints::FoundJoint;
use super::mesh::{BeamElement, Mesh};
use super::output::needs;
use crate::deck::{self, Damping, Deck, Diagnostic, EffectWord, HistoryUse, InterpolationWord, Span};
use beamsim_core::effect::Effect;
use beamsim_core::effect::contact::SurfaceContacts;
use beamsim_core::effect::elasticity::{ElasticElements, RotationInterpolation, StressField, Viscosity};
use beamsim_core::effect::inertia::Body;
use beamsim_core::effect::spring::{GroundSpring, Link};
use beamsim_core::kernel::law::{Stiffness, Strain};
use beamsim_core::model::beam_element::{SectionPoint, push_elastic};
use beamsim_core::model::{Amplitude, History, SlotKind, StageSet, Support};
use beamsim_core::probe::Need;
use beamsim_core::run::Driven;
use beamsim_core::system::{Node, Slot};
use beamsim_core::tensor::{Mat3, Vec3};
use std::collections::HashMap;
use std::sync::Arc;

/// An effect that a scene may have: acting or not, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Reason {
    /// The effect
    pub name: &'static str,
    /// True if it acts
    pub active: bool,
    /// The reason for that
    pub reason: String,
}

/// A table that a history drives, for messages.
#[derive(Clone)]
pub struct DrivenTable {
    /// The driven motion or motor
    pub(super) drives: Driven,
    /// Its name in messages
    pub(super) what: &'static str,
    /// Its place in the deck
    pub(super) span: Span,
    /// Its history, if it has one
    pub(super) history: Option<HistoryUse>,
}

/// The effects of a scene with what they need.
pub struct Composition {
    /// The effects
    pub(super) effects: Vec<Arc<dyn Effect>>,
    /// Every effect that beamsim knows, acting or not
    pub(super) reasons: Vec<Reason>,
    /// The factors of loads and springs
    pub(super) amplitudes: Vec<Amplitude>,
    /// The elasticity, for resultants
    pub(super) elasticity: Vec<Arc<dyn StressField>>,
    /// Surfaces and contacts, for pictures
    pub(crate) contacts: Option<Arc<SurfaceContacts>>,
    /// Beams that spin freely about their own axis in dynamic stages, without inertia about it, and do not bend about all
    /// axes alike
    pub(super) loose_spins: Vec<String>,
    /// Rigid bodies
    pub(super) bodies: Vec<Body>,
    /// Springs and cables between nodes
    pub(super) links: Vec<Link>,
    /// Springs to ground
    pub(super) springs: Vec<GroundSpring>,
    /// Nodes with a force of a [[load]]
    pub(super) with_force: Vec<Node>,
    /// Nodes with a moment of a [[load]]
    pub(super) with_moment: Vec<Node>,
    /// Slots of multipliers, behind those of the mesh: what they hold, and the joint
    pub(super) multipliers: Vec<(SlotKind, String)>,
    /// Components of these that nothing uses
    pub(super) idle_multipliers: Vec<Support>,
    /// Prescribed sliding
    pub(super) slider_motions: Vec<SliderMotion>,
    /// Nodes whose rotation a joint takes hold of
    pub(super) jointed: Vec<usize>,
    /// Tables that histories drive, but for motions
    pub(super) driven: Vec<DrivenTable>,
    /// The slots of the rotations on both sides of each of them
    pub(super) sprung_joints: Vec<[Option<Slot>; 2]>,
}

impl Composition {
    /// Slots of displacements at which loads, bodies, springs and contacts act, and of rotations at which loads do.
    pub fn acting_at_nodes(&self) -> impl Iterator<Item = Slot> {
        let bodies = self.bodies.iter().map(|body| body.node);
        let springs = self.springs.iter().map(|spring| spring.node);
        let links = self.links.iter().flat_map(|link| link.nodes);
        let touching = self.contacts.iter().flat_map(|contacts| contacts.nodes_of_beams());
        let forces = self.with_force.iter().copied().chain(bodies).chain(springs).chain(links).chain(touching);
        forces.map(|node| node.u).chain(self.with_moment.iter().map(|node| node.p))
    }

    /// Lengths of bodies: radii of gyration and of contact.
    pub fn sizes(&self) -> Vec<f64> {
        let chains = self.contacts.iter().flat_map(|contacts| &contacts.chains);
        let of_contacts = chains.filter(|chain| chain.strand.beam.is_none()).map(|chain| chain.strand.radius);
        self.bodies.iter().map(|body| body.inertia.radius_of_gyration()).chain(of_contacts).collect()
    }
}

/// Tables with the same key share an amplitude: the history with its stages, and the stages of the
/// table.
type AmplitudeKey = (Option<(String, Option<Vec<usize>>)>, Option<Vec<usize>>);

/// Collects effects while the tables of the deck are walked through.
struct Composer<'a> {
    deck: &'a Deck,
    mesh: &'a Mesh,
    histories: &'a HashMap<String, Arc<dyn History>>,
    diagnostics: &'a mut Vec<Diagnostic>,
    out: Composition,
    known_amplitudes: HashMap<AmplitudeKey, usize>,
    dynamic: bool,
}

/// The reason of effects that are switched off
const SWITCHED_OFF: &str = "switched off in [effects]";
/// The reason of a switched-off geometric stiffness
const UNSTRESSED: &str = "switched off in [effects]: buckling is not detected";
/// The reason of a switched-off tangent of following loads
const UNTURNED: &str = "switched off in [effects]: the number of negative pivots ignores it";

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
        contacts: None,
        loose_spins: Vec::new(),
        bodies: Vec::new(),
        links: Vec::new(),
        springs: Vec::new(),
        with_force: Vec::new(),
        with_moment: Vec::new(),
        multipliers: Vec::new(),
        idle_multipliers: Vec::new(),
        slider_motions: Vec::new(),
        jointed: Vec::new(),
        driven: Vec::new(),
        sprung_joints: Vec::new(),
    };
    let mut composer = Composer { deck, mesh, histories, diagnostics, out, known_amplitudes: HashMap::new(), dynamic };
    composer.formulation();
    composer.elasticity();
    composer.springs();
    composer.links();
    composer.joints(connections);
    composer.sliders();
    composer.beam_inertia();
    composer.spin_holds(connections);
    composer.out.bodies = composer.bodies();
    composer.gravity();
    composer.body_inertia();
    composer.damping();
    composer.rotating_frames();
    let along = composer.line_loads();
    composer.node_loads(along);
    composer.fading_inertia();
    composer.contacts(connections);
    composer.parts();
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
    fn amplitude(&mut self, history: Option<&HistoryUse>, stages: Option<&Vec<usize>>) -> Option<usize> {
        let key = (history.map(|h| (h.name.value.clone(), h.stages.clone())), stages.cloned());
        if let Some(&number) = self.known_amplitudes.get(&key) {
            return Some(number);
        }
        let found = find_history(self.deck, self.histories, history);
        let function = found.map_err(|diagnostic| self.diagnostics.push(diagnostic)).ok()?;
        self.out.amplitudes.push(Amplitude::of_load(function, stage_set(stages)));
        self.known_amplitudes.insert(key, self.out.amplitudes.len() - 1);
        Some(self.out.amplitudes.len() - 1)
    }

    /// The number of the amplitude of a table of the deck.
    fn amplitude_of(
        &mut self,
        what: &'static str,
        span: &Span,
        history: Option<&HistoryUse>,
        stages: Option<&Vec<usize>>,
    ) -> Option<usize> {
        let number = self.amplitude(history, stages)?;
        if let Some(history) = history.cloned() {
            let drives = Driven::Amplitude(number);
            self.out.driven.push(DrivenTable { drives, what, span: span.clone(), history: Some(history) });
        }
        Some(number)
    }

    fn node(&mut self, name: &deck::Spanned<String>) -> Option<(usize, Option<(usize, f64)>)> {
        self.mesh.find_node(self.deck, name).map_err(|d| self.diagnostics.push(d)).ok()
    }

    /// Parts of the mechanics that [effects] may switch off.
    fn formulation(&mut self) {
        let beams = self.mesh.element_count > 0;
        let large = "large rotations";
        let linear = "switched off in [effects]: static and dynamic stages are linear";
        if self.deck.effects.allow(EffectWord::LargeRotations) {
            self.reason(large, true, "forces and tangents follow the current shape");
        } else {
            self.reason(large, false, linear);
        }
        let parts = [
            (EffectWord::Shear, "shear", "sections have `GA`"),
            (EffectWord::Extension, "extension", "sections have `EA`"),
            (
                EffectWord::GeometricStiffness,
                "geometric stiffness",
                "the tangent includes how stress rotates with the beams",
            ),
        ];
        for (word, name, why) in parts {
            let off = if word == EffectWord::GeometricStiffness { UNSTRESSED } else { SWITCHED_OFF };
            self.part(word, name, beams, [why, off, "no beams"]);
        }
        let couples = self.mesh.beams.iter().any(|beam| beam.section.couples_torsion());
        let why = ["sections couple torsion with other strains", SWITCHED_OFF, "no section couples torsion"];
        self.part(EffectWord::TorsionCoupling, "torsion coupling", couples, why);
    }

    fn elasticity(&mut self) {
        self.elasticity_of(InterpolationWord::Total, RotationInterpolation::Total);
        self.elasticity_of(InterpolationWord::Relative, RotationInterpolation::Relative);
    }

    fn elasticity_of(&mut self, word: InterpolationWord, interpolation: RotationInterpolation) {
        let free: HashMap<String, usize> = self.free_strains();
        let mut elements = ElasticElements::default();
        let Damping { stiffness: factors, .. } = self.deck.damping.unwrap_or(Damping::NONE);
        let damped = factors != [0.0; 6] && self.dynamic;
        let proportional = factors == [factors[0]; 6];
        let mut viscosities: [Vec<Stiffness>; 3] = Default::default();
        self.each_element(|element| {
            if element.beam.interpolation != word {
                return;
            }
            let beam = element.beam;
            push_elastic(&mut elements, element, free.get(&beam.name).copied(), |station| {
                let section = beam.section.at(station.fraction);
                if damped && !proportional {
                    viscosities[beam.order - 1].push(section.viscosity_in(station.axes, &factors));
                }
                SectionPoint {
                    law: section.law_in(station.axes),
                    free: beam.free_strain.as_ref().map(|free| free_strain(free.strain, station.axes)),
                }
            });
        });
        elements.shrink_to_fit();
        let name = interpolation.elasticity_name();
        if elements.is_empty() {
            let why = if self.mesh.element_count == 0 { "no beams" } else { "no such beams" };
            return self.reason(name, false, why);
        }
        let count = elements.two.len() + elements.three.len() + elements.four.len();
        let stressed = self.deck.effects.allow(EffectWord::GeometricStiffness);
        let viscosity = if proportional { Viscosity::Proportional(factors[0]) } else { Viscosity::Points(viscosities) };
        let damping = damped.then_some(viscosity);
        let beams = interpolation.build(elements, stressed, damping);
        self.reason(name, true, format!("{count} beam elements"));
        self.out.elasticity.push(beams.stresses);
        self.out.effects.push(beams.elasticity);
        let damping_name = interpolation.damping_name();
        if let Some(damping) = beams.damping {
            self.reason(damping_name, true, "`stiffness` in [damping]");
            self.out.effects.push(damping);
        } else if !self.deck.effects.allow(EffectWord::Damping) {
            self.reason(damping_name, false, SWITCHED_OFF);
        } else {
            self.reason(damping_name, false, "no `stiffness` in [damping], or no stage with motion");
        }
    }

    /// The amplitudes of free strains, by beam.
    fn free_strains(&mut self) -> HashMap<String, usize> {
        let deck = self.deck;
        let mut numbered = HashMap::new();
        for beam in self.mesh.beams.iter().filter_map(|beam| deck.beams.named(&beam.name)) {
            let Some(free) = &beam.free_strain else { continue };
            let number = self.amplitude_of("free strain", &beam.span, free.history.as_ref(), None);
            numbered.extend(number.map(|number| (beam.name.value.clone(), number)));
        }
        numbered
    }

    fn each_element(&self, mut visit: impl FnMut(&BeamElement)) {
        let beams = self.mesh.beams.iter();
        beams.flat_map(|beam| self.mesh.elements_of(beam)).for_each(|element| visit(&element));
    }

    /// Parts of other effects that can be left out.
    fn parts(&mut self) {
        let acts = |of: &[&str]| self.out.reasons.iter().any(|reason| reason.active && of.contains(&reason.name));
        let inertia = ["rotary inertia", "eccentric section inertia", "section inertia at nodes", "rigid body inertia"];
        let loads = ["following line loads", "following forces", "following moments", "dead moments"];
        let turns = acts(&inertia);
        let loaded = acts(&loads);
        let spin = "rotary inertia causes gyroscopic forces";
        let why = [spin, SWITCHED_OFF, "nothing has rotary inertia"];
        self.part(EffectWord::Gyroscopic, "gyroscopic forces", turns, why);
        let why = [
            "the tangent includes how follower loads and fixed moments change with rotation",
            UNTURNED,
            "no follower load and no moment that is fixed in space",
        ];
        self.part(EffectWord::FollowerTangent, "follower tangent", loaded, why);
    }

    /// The reason of a switchable part: it acts, was switched off, or has nothing to act on.
    fn part(&mut self, word: EffectWord, name: &'static str, there: bool, [acts, off, nowhere]: [&str; 3]) {
        match (there, self.deck.effects.allow(word)) {
            (false, _) => self.reason(name, false, nowhere),
            (true, false) => self.reason(name, false, off),
            (true, true) => self.reason(name, true, acts),
        }
    }

    /// Reasons of effects that are known and never act yet.
    fn never(&mut self) {
        let seams = self.mesh.beams.iter().any(|beam| beam.interpolation == InterpolationWord::Total);
        let why = if seams {
            "used where neighbouring nodes of beams with interpolation = \"total\" are in different rotation charts"
        } else {
            "no beam with interpolation = \"total\""
        };
        self.reason("mixed elements", seams, why);
    }
}

/// True where effects of inertia are needed: by dynamic and modal stages, by outputs of momentum,
/// and by static stages whose stability only small vibrations show.
fn needs_mass(deck: &Deck) -> bool {
    let dynamic = deck.stages.iter().any(|stage| stage.body.kind().needs_inertia() || stage.frame.is_some());
    dynamic || needs(deck, Need::Mass) || may_flutter(deck)
}

/// True if a static stage may end under loads that turn, whose tangents are not symmetric.
fn may_flutter(deck: &Deck) -> bool {
    let turns = |load: &deck::Load| match load.frame {
        deck::Frame::Space => load.moment.is_some(),
        deck::Frame::Body | deck::Frame::Section => true,
    };
    deck.loads.iter().any(turns) && deck.stages.iter().any(|stage| stage.body.kind().ramps_load())
}

/// The stages of the deck count from 1, those of a run from 0.
pub fn stage_set(stages: Option<&Vec<usize>>) -> StageSet {
    StageSet(stages.map(|stages| stages.iter().map(|s| s - 1).collect()))
}

/// From section axes to global components.
fn free_strain(strain: [f64; 6], axes: Mat3) -> Strain {
    let [g1, g2, g3, k1, k2, k3] = strain;
    Strain { gamma: axes * Vec3([g1, g2, g3]), kappa: axes * Vec3([k1, k2, k3]) }
}
