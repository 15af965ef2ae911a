//! Which effects act: for each table that stands in the deck one effect, and for each the reason.

mod connections;
mod fading;
mod inertia;
mod loads;
mod spins;

use super::constraints::find_history;
use super::joints::FoundJoint;
use super::mesh::{BeamElement, Mesh, Rule, Station};
use super::output::needs;
use crate::deck::{self, Deck, Diagnostic, EffectWord, HistoryUse, InterpolationWord, Span};
use beamsim_core::effect::beam_elasticity::{BeamElasticity, ElasticElements, StressField};
use beamsim_core::effect::elastic_element::ElasticElement;
use beamsim_core::effect::interpolation::{Interpolation, RelativeVectors, TotalVectors};
use beamsim_core::effect::rigid_body::Body;
use beamsim_core::effect::strain_rate_damping::StrainRateDamping;
use beamsim_core::effect::{Connection, Effect, VolumeElement, VolumeElements};
use beamsim_core::effect::{link, spring};
use beamsim_core::kernel::beam::StiffnessPoint;
use beamsim_core::kernel::elastic::Strain;
use beamsim_core::kernel::volume::VolumePoint;
use beamsim_core::model::{Amplitude, History, SlotKind, StageSet, Support};
use beamsim_core::probe::Need;
use beamsim_core::run::Driven;
use beamsim_core::system::Slot;
use beamsim_core::tensor::{Mat3, Vec3};
use std::collections::HashMap;
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

/// A table that a history drives, for messages.
#[derive(Clone)]
pub struct DrivenTable {
    /// What it drives
    pub drives: Driven,
    /// What it is called
    pub what: &'static str,
    /// Where it stands
    pub span: Span,
    /// Its history, if it has one
    pub history: Option<HistoryUse>,
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
    /// Springs and cables between nodes
    pub links: Vec<link::Instance>,
    /// Springs to ground
    pub springs: Vec<spring::Instance>,
    /// Slots of multipliers, behind those of the mesh: what they hold, and the joint
    pub multipliers: Vec<(SlotKind, String)>,
    /// Components of these that nothing uses
    pub idle_multipliers: Vec<Support>,
    /// Nodes whose rotation a joint takes hold of
    pub jointed: Vec<usize>,
    /// What histories drive, but for motions
    pub driven: Vec<DrivenTable>,
    /// How many joints remember their angle
    pub angles: usize,
    /// The slots of the rotations on both sides of each of them
    pub sprung_joints: Vec<[Option<Slot>; 2]>,
}

/// What makes amplitudes one: the name of the history with its stages, and the stages of what it drives.
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

/// Why what a scene has does not act
const SWITCHED_OFF: &str = "switched off in [effects]";
/// The same of parts of the tangent, whose pivots tell whether a state is stable
const UNSTRESSED: &str = "switched off in [effects]: what stress makes unstable is not told";
const UNTURNED: &str = "switched off in [effects]: negative pivots are those of a tangent without it";

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
        links: Vec::new(),
        springs: Vec::new(),
        multipliers: Vec::new(),
        idle_multipliers: Vec::new(),
        jointed: Vec::new(),
        driven: Vec::new(),
        angles: 0,
        sprung_joints: Vec::new(),
    };
    let mut composer = Composer { deck, mesh, histories, diagnostics, out, known_amplitudes: HashMap::new(), dynamic };
    composer.formulation();
    composer.elasticity();
    composer.springs();
    composer.links();
    composer.joints(connections);
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
        let (large, linear) = ("large rotations", "switched off in [effects]: static and dynamic stages are linear");
        match self.deck.effects.allow(EffectWord::LargeRotations) {
            true => self.reason(large, true, "forces and tangents of the present state"),
            false => self.reason(large, false, linear),
        }
        let parts = [
            (EffectWord::Shear, "shear", "sections have `GA`"),
            (EffectWord::Extension, "extension", "sections have `EA`"),
            (
                EffectWord::GeometricStiffness,
                "geometric stiffness",
                "the tangent knows how stress turns with the beams",
            ),
        ];
        for (word, name, why) in parts {
            let off = if word == EffectWord::GeometricStiffness { UNSTRESSED } else { SWITCHED_OFF };
            self.part(word, name, beams, [why, off, "no beams"]);
        }
    }

    fn elasticity(&mut self) {
        self.elasticity_of::<TotalVectors>(InterpolationWord::Total);
        self.elasticity_of::<RelativeVectors>(InterpolationWord::Relative);
    }

    fn elasticity_of<I: Interpolation>(&mut self, way: InterpolationWord) {
        let free: HashMap<String, usize> = self.free_strains();
        let mut elements = ElasticElements::default();
        self.each_element(|element| {
            if element.beam.interpolation != way {
                return;
            }
            let free = free.get(&element.beam.name).copied();
            match element.nodes.len() {
                2 => elements.two.push(elastic(element, free, elements.two.last())),
                3 => elements.three.push(elastic(element, free, elements.three.last())),
                _ => elements.four.push(elastic(element, free, elements.four.last())),
            }
        });
        elements.shrink_to_fit();
        if elements.is_empty() {
            return self.reason(
                I::NAME,
                false,
                if self.mesh.element_count == 0 { "no beams" } else { "no such beams" },
            );
        }
        let count = elements.two.len() + elements.three.len() + elements.four.len();
        let effect = BeamElasticity::<I>::new(elements);
        let stressed = self.deck.effects.allow(EffectWord::GeometricStiffness);
        let effect = Arc::new(if stressed { effect } else { effect.without_geometric_stiffness() });
        self.reason(I::NAME, true, format!("{count} beam elements"));
        self.out.elasticity.push(effect.clone());
        self.out.effects.push(effect.clone());
        match self.deck.damping {
            Some([_, factor]) if factor != 0.0 && self.dynamic => {
                self.push(StrainRateDamping { elasticity: effect, factor }, "`stiffness` in [damping]".into());
            }
            _ if !self.deck.effects.allow(EffectWord::Damping) => self.reason(I::DAMPING_NAME, false, SWITCHED_OFF),
            _ => self.reason(I::DAMPING_NAME, false, "no `stiffness` in [damping], or nothing moves in time"),
        }
    }

    /// The amplitudes of free strains, by beam.
    fn free_strains(&mut self) -> HashMap<String, usize> {
        let deck = self.deck;
        let of_beam = |name: &str| deck.beams.iter().find(|beam| beam.name.value == name);
        let mut numbered = HashMap::new();
        for beam in self.mesh.beams.iter().filter_map(|beam| of_beam(&beam.name)) {
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
        let (turns, loaded) = (acts(&inertia), acts(&loads));
        let spin = "inertia against rotation has forces of its spin alone";
        let why = [spin, SWITCHED_OFF, "nothing has inertia against rotation"];
        self.part(EffectWord::Gyroscopic, "gyroscopic forces", turns, why);
        let why = ["the tangent knows how loads turn", UNTURNED, "no load follows, and no moment stands fixed"];
        self.part(EffectWord::FollowerTangent, "follower tangent", loaded, why);
    }

    /// A part of what may be there: why it acts, was switched off, or has nothing that it belongs to.
    fn part(&mut self, word: EffectWord, name: &'static str, there: bool, [acts, off, nowhere]: [&str; 3]) {
        match (there, self.deck.effects.allow(word)) {
            (false, _) => self.reason(name, false, nowhere),
            (true, false) => self.reason(name, false, off),
            (true, true) => self.reason(name, true, acts),
        }
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
    }
}

/// Inertia is there for dynamic stages, where momenta are looked at, and where only small vibrations tell whether a static stage ends stable.
fn needs_mass(deck: &Deck) -> bool {
    let inertia =
        |body: &deck::StageBody| matches!(body, deck::StageBody::Dynamic { .. } | deck::StageBody::Modal { .. });
    let dynamic = deck.stages.iter().any(|stage| inertia(&stage.body) || stage.frame.is_some());
    dynamic || needs(deck, Need::Mass) || may_flutter(deck)
}

/// Whether a static stage may end under loads that turn, whose tangents are not symmetric.
fn may_flutter(deck: &Deck) -> bool {
    let turns = |load: &deck::Load| match load.frame {
        deck::Frame::Space => load.moment.is_some(),
        deck::Frame::Body | deck::Frame::Section => true,
    };
    let settles = |body: &deck::StageBody| match body {
        deck::StageBody::Static { .. } | deck::StageBody::Path { .. } => true,
        deck::StageBody::Modal { .. } | deck::StageBody::Buckling { .. } | deck::StageBody::Dynamic { .. } => false,
    };
    deck.loads.iter().any(turns) && deck.stages.iter().any(|stage| settles(&stage.body))
}

/// The stages of the deck count from 1, those of a run from 0.
pub fn stage_set(stages: Option<&Vec<usize>>) -> StageSet {
    StageSet(stages.map(|stages| stages.iter().map(|s| s - 1).collect()))
}

fn connect<const N: usize>(element: &BeamElement) -> Connection<N> {
    let node = |i: usize| &element.mesh.nodes[element.nodes[i]];
    Connection { element: element.number as u32, nodes: std::array::from_fn(|i| node(i).node) }
}

/// Pushes an element with these volume points into the batch of its order.
fn push_volume<Q: Copy + PartialEq>(
    batches: &mut VolumeElements<Q>,
    element: &BeamElement,
    stations: &[Station],
    quantity: impl Fn(usize) -> Q,
) {
    match element.nodes.len() {
        2 => batches.two.push(volume(element, stations, quantity, batches.two.last())),
        3 => batches.three.push(volume(element, stations, quantity, batches.three.last())),
        _ => batches.four.push(volume(element, stations, quantity, batches.four.last())),
    }
}

fn volume<const N: usize, Q: Copy + PartialEq>(
    element: &BeamElement,
    stations: &[Station],
    quantity: impl Fn(usize) -> Q,
    neighbour: Option<&VolumeElement<N, Q>>,
) -> VolumeElement<N, Q> {
    let point = |k: usize| {
        let Station { shape, weight, .. } = &stations[k];
        VolumePoint { shape: std::array::from_fn(|i| shape[i]), weight: *weight, quantity: quantity(k) }
    };
    let points = std::array::from_fn(point);
    VolumeElement::new(connect(element), element.place(), element.arms(), points, neighbour)
}

fn elastic<const N: usize, const G: usize>(
    element: &BeamElement,
    free: Option<usize>,
    neighbour: Option<&ElasticElement<N, G>>,
) -> ElasticElement<N, G> {
    let (beam, stations) = (element.beam, element.stations(Rule::Inner));
    let point = |k: usize| {
        let station = &stations[k];
        StiffnessPoint {
            shape: std::array::from_fn(|i| station.shape[i]),
            slope: std::array::from_fn(|i| station.slope[i]),
            weight: station.weight,
            tangent: station.axes.column(0),
            stiffness: beam.section.at(station.fraction).stiffness_in(station.axes),
            free: beam.free_strain.as_ref().map(|free| free_strain(free.strain, station.axes)),
        }
    };
    let (arms, points) = (element.arms(), std::array::from_fn(point));
    ElasticElement::new(connect(element), element.rounding(), arms, points, free, neighbour)
}

/// From section axes to global components.
fn free_strain(strain: [f64; 6], axes: Mat3) -> Strain {
    let [g1, g2, g3, k1, k2, k3] = strain;
    Strain { gamma: axes * Vec3([g1, g2, g3]), kappa: axes * Vec3([k1, k2, k3]) }
}
