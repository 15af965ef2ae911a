//! From a deck to a scene: the one place that sees words and numbers both.

mod along;
mod beam_points;
mod check;
mod compose;
mod computed;
mod constraints;
mod contacts;
mod curve;
mod figure;
mod joints;
mod memory;
mod mesh;
mod mesh_surface;
mod names;
mod output;
mod path;
mod planar;
mod rehearsal;
mod scheme;
mod section;
mod stress;
mod surfaces;
mod switches;

pub use compose::Reason;
pub use computed::{Solution, SolvedSection, solved, warning as section_warning};
pub use curve::{NaturalSpline, Spline};
pub use mesh::{Mesh, MeshBeam};
pub use names::Spot;
pub use section::matrices as section_matrices;
pub use stress::{coarse_stresses, recovery as section_stresses};

use crate::deck::{
    self, Deck, Diagnostic, ExpectBody, Instant, PointRef, Reduce, Severity, Spanned, StageBody, Target, Words, words,
};
use beam_points::{ActionsAtNodes, BeamPoints};
use beamsim_core::effect::contact::SurfaceContacts;
use beamsim_core::effect::elasticity::StressField;
use beamsim_core::effect::inertia::Body;
use beamsim_core::effect::spring::{GroundSpring, Link};
use beamsim_core::model::{ElementInfo, ModelParts, StageKind};
use beamsim_core::probe::{Figure, Need, Probe, ProfilePlace, StressPlace};
use beamsim_core::run::{Approach, InitialMotion, Plan, Snapshot, Stage, StageWork, TimeStepping, Until, Warning};
use beamsim_core::sorting::sort_by_key;
use beamsim_core::system::Node;
use beamsim_core::tensor::{Mat3, Vec3};
use beamsim_core::warning::WarningKind;
use constraints::SceneConstraints;
use output::Columns;
use std::collections::HashSet;
use std::sync::Arc;
use stress::SectionStresses;

/// A deck made ready to run.
pub struct Scene {
    /// Title of the deck
    pub(crate) title: Option<String>,
    /// Model and stages
    pub plan: Plan,
    /// The columns of the history
    pub probes: Vec<Probe>,
    /// Each n-th row is written.
    pub(crate) every: usize,
    /// True if fields are written for ParaView
    pub(crate) vtk: bool,
    /// Places at which the largest stresses of a run are followed, if they are
    pub(crate) envelope: Option<Vec<StressPlace>>,
    /// Places of which resultants are written at the end of each stage, if they are
    pub(crate) profile: Option<Vec<ProfilePlace>>,
    /// Expectations
    pub(crate) expectations: Vec<Expectation>,
    /// Warnings about the deck itself, where the scene was built by [`from_deck`]
    pub(crate) warnings: Vec<Warning>,
    /// Effects that act, and those that do not, with the reason
    pub reasons: Vec<Reason>,
    /// Nodes, beams, elements
    pub mesh: Mesh,
    /// Rigid bodies
    pub(crate) bodies: Vec<Body>,
    /// Springs and cables between nodes
    links: Vec<Link>,
    /// The deck with expressions replaced by numbers
    pub(crate) resolved: serde_json::Value,
    /// Beam elasticity, the source of stress resultants
    elasticity: Vec<Arc<dyn StressField>>,
    /// What acts at the nodes between elements
    actions: ActionsAtNodes,
    /// Surfaces and contacts, for pictures
    contacts: Option<Arc<SurfaceContacts>>,
    /// The deck, if pictures show the stresses of its sections
    stress_deck: Option<Arc<Deck>>,
}

impl Scene {
    /// Its whole shape, for pictures.
    pub fn figure(&self) -> Figure {
        let contacts = self.contacts.clone();
        // Sections at all nodes are prepared for pictures alone: most runs have none.
        let sections = self.stress_deck.as_ref().map(|deck| SectionStresses::new(deck).at_nodes(&self.mesh));
        let points = BeamPoints {
            mesh: &self.mesh,
            elasticity: &self.elasticity,
            effects: &self.plan.model.effects,
            actions: &self.actions,
        };
        figure::figure(points, &self.bodies, &self.links, &sections.unwrap_or_default(), contacts)
    }

    /// All texts of the deck that may name a place on a beam.
    pub fn places_in_texts(&self) -> Vec<&str> {
        fn collect<'a>(value: &'a serde_json::Value, found: &mut Vec<&'a str>) {
            match value {
                serde_json::Value::String(text) if text.contains(['@', ':']) => found.push(text),
                serde_json::Value::Array(entries) => entries.iter().for_each(|entry| collect(entry, found)),
                serde_json::Value::Object(entries) => entries.values().for_each(|entry| collect(entry, found)),
                serde_json::Value::String(_)
                | serde_json::Value::Null
                | serde_json::Value::Bool(_)
                | serde_json::Value::Number(_) => {}
            }
        }
        let mut found = Vec::new();
        collect(&self.resolved, &mut found);
        found
    }

    /// Gamma, K, N and M at the integration points of an element, material and in global
    /// components.
    pub fn stresses(&self, element: usize, at: &Snapshot) -> Vec<[[f64; 3]; 4]> {
        let fields = &mut self.elasticity.iter();
        let found = fields.find_map(|field| field.stresses(element as u32, at.state, at.origin));
        let values = found.map(|stresses| stresses.at_points()).unwrap_or_default();
        values.iter().map(|(strain, stress)| [strain.gamma.0, strain.kappa.0, stress.n.0, stress.m.0]).collect()
    }
}

/// An expected number, failure or warning of a run.
#[derive(Clone)]
pub struct Expectation {
    /// The column, failure or warning as it stands in the deck
    pub(crate) name: String,
    /// Kind, with bounds
    pub(crate) kind: ExpectationKind,
    /// Origin of the number
    pub source: Option<String>,
}

/// Kinds of expectations.
#[derive(Clone)]
pub enum ExpectationKind {
    /// Of a column of the history
    Column {
        /// The probe and the component of it
        probe: Probe,
        /// See `probe`
        component: usize,
        /// Over which rows
        reduce: Reduce,
        /// In which bounds
        bounds: Bounds,
    },
    /// Of a counter of the run
    Counter {
        /// The counter
        counter: RunCounter,
        /// In which bounds
        bounds: Bounds,
    },
    /// Of the modes of the last modal stage, or the critical loads of the last buckling stage
    Mode {
        /// Which of their numbers
        quantity: ModeQuantity,
        /// From 0
        number: usize,
        /// In which bounds
        bounds: Bounds,
    },
    /// That it fails
    Fails,
    /// A warning of this kind
    Warns(WarningKind),
    /// No warning that puts an answer in doubt
    Quiet,
}

words! {
    /// A number of a mode.
    pub enum ModeQuantity {
        /// Imaginary part
        Omega = "omega",
        /// Real part
        Growth = "growth",
        /// Critical load factor
        Load = "load",
    }
}

/// The bounds of an expected number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Value with its tolerances
    pub(crate) value: Option<Target>,
    /// Upper bound
    pub(crate) below: Option<f64>,
    /// Lower bound
    pub(crate) above: Option<f64>,
}

words! {
    /// Counters of a run, as `run.steps` in expectations.
    pub enum RunCounter {
        /// Load levels, increments and time steps
        Steps = "steps",
        /// Iterations of Newton's method
        Iterations = "iterations",
        /// Steps that failed and were taken in smaller ones
        Cutbacks = "cutbacks",
        /// Changes of rotation charts
        ChartSwitches = "chart_switches",
        /// Elements across charts
        MixedElements = "mixed_elements",
    }
}

/// Most diagnostics that are reported.
const MOST_DIAGNOSTICS: usize = 200;

/// Builds a scene from the text of a deck; the second part holds warnings. `Err` holds everything
/// that is wrong.
pub fn from_text(text: &str) -> Result<(Scene, Vec<Diagnostic>), Vec<Diagnostic>> {
    let (deck, found) = deck::read(text)?;
    from_deck(&deck, found)
}

/// Builds a scene from a deck and what was found in reading it; results as those of [`from_text`].
pub fn from_deck(deck: &Deck, mut diagnostics: Vec<Diagnostic>) -> Result<(Scene, Vec<Diagnostic>), Vec<Diagnostic>> {
    let mut found = Vec::new();
    let scene = build(deck, &mut found);
    if !diagnostics.iter().all(Diagnostic::is_warning) {
        // Where tables could not be read only errors about names are kept: all others may follow
        // from the missing tables.
        found.retain(|d| d.unknown.as_ref().is_some_and(|name| !deck.broken.iter().any(|b| about(name, b))));
    }
    diagnostics.append(&mut found);
    sort_by_key(&mut diagnostics, Diagnostic::is_warning);
    let mut told: Vec<Diagnostic> = Vec::new();
    let mut hidden = 0;
    let mut hides_errors = false;
    for diagnostic in diagnostics {
        let again =
            |known: &Diagnostic| known == &diagnostic || (known.unknown.is_some() && known.span == diagnostic.span);
        if told.iter().any(again) {
            continue;
        }
        if told.len() < MOST_DIAGNOSTICS {
            told.push(diagnostic);
        } else {
            hidden += 1;
            hides_errors |= !diagnostic.is_warning();
        }
    }
    if hides_errors {
        told.push(Diagnostic::whole(format!("{hidden} more messages are not shown: correct the first ones")));
    } else if let Some(last) = told.last_mut().filter(|_| hidden > 0) {
        last.message += &format!(" ({hidden} more warnings are not shown)");
    }
    match scene {
        Some(scene) if told.iter().all(Diagnostic::is_warning) => {
            let warnings = told.iter().filter_map(before_the_run).collect();
            Ok((Scene { warnings, ..scene }, told))
        }
        _ => Err(told),
    }
}

/// The warning of a diagnostic, with the help that belongs to it.
fn before_the_run(diagnostic: &Diagnostic) -> Option<Warning> {
    let Severity::Warning(kind) = diagnostic.severity else { return None };
    let message = match &diagnostic.help {
        Some(help) => format!("{}: {help}", diagnostic.message),
        None => diagnostic.message.clone(),
    };
    Some(Warning { kind, at: None, message })
}

/// True if a name refers to a table: `arm`, `arm@end`, `arm:3`.
fn about(name: &str, table: &str) -> bool {
    name.split(['@', ':']).next() == Some(table)
}

/// Builds a scene from a deck that was read or made; errors and warnings go to `diagnostics`.
/// `None` where errors leave no scene.
pub fn build(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) -> Option<Scene> {
    check::deck(deck, diagnostics);
    switches::refuse_impossible(deck, diagnostics);
    let before = diagnostics.len();
    memory::check(deck, diagnostics);
    if diagnostics.len() > before {
        return None;
    }
    let mesh = Mesh::new(deck, diagnostics);
    build_on(deck, mesh, diagnostics)
}

fn build_on(deck: &Deck, mesh: Mesh, diagnostics: &mut Vec<Diagnostic>) -> Option<Scene> {
    let deck = &*switches::deck(deck);
    let complete = mesh.beams.len() == deck.beams.len();
    let histories = constraints::histories(deck);
    let mut found = Vec::new();
    let connections = joints::find(deck, &mesh, &mut found);
    let composition = compose::compose(deck, &mesh, &histories, &connections, &mut found);
    let SceneConstraints { supports, mut motions, mut driven } =
        constraints::constraints(deck, &mesh, &histories, &connections, &mut found);
    for slid in composition.slider_motions.iter().cloned() {
        driven.push(compose::DrivenTable { drives: beamsim_core::run::Driven::Motion(motions.len()), ..slid.table });
        motions.push(slid.motion);
    }
    let stresses = SectionStresses::new(deck);
    let supported = supports.iter().flat_map(|support| &support.directions).map(|direction| direction.slot);
    let moved = motions.iter().map(|motion| motion.slot);
    let actions = ActionsAtNodes::new(supported.chain(moved).chain(composition.acting_at_nodes()).collect());
    let points = BeamPoints {
        mesh: &mesh,
        elasticity: &composition.elasticity,
        effects: &composition.effects,
        actions: &actions,
    };
    let columns = Columns { deck, mesh: &mesh, points, stresses: &stresses };
    let probes = columns.written(&mut found);
    let envelope = deck.output.envelope.as_ref().map(|span| columns.stress_places(span, &mut found));
    let profile = deck.output.profile.as_ref().map(|span| columns.profile_places(span));
    let stress_deck = shows_stress(deck).then(|| Arc::new(deck.clone()));
    let stages = stages(deck, &columns, &mut found);
    let expectations = expectations(deck, &columns, &mut found);
    diagnostics.extend(stresses.warnings());
    let initial = initial_motions(deck, &mesh, &mut found);
    // Where a beam could not be meshed, points may seem to be no nodes: only errors about unknown
    // names are kept.
    diagnostics.extend(found.into_iter().filter(|d| complete || d.unknown.is_some()));
    check::warn_of_undamped_multipliers(deck, &composition, diagnostics);
    check::warn_of_extreme_stiffness(&mesh, deck, diagnostics);
    let loose = check::loose_rotations(deck, &mesh, &composition, &supports);
    check::refuse_moments(deck, &mesh, &loose, diagnostics);
    let is_sprung = |spring: &&GroundSpring| spring.rotation != Mat3::ZERO;
    let sizes = composition.sizes();
    let parts = ModelParts {
        names: mesh.names.clone(),
        multipliers: composition.multipliers,
        elements: mesh.beams.iter().flat_map(|beam| element_infos(&mesh, beam)).collect(),
        sprung: composition.springs.iter().filter(is_sprung).map(|spring| spring.node.p).collect(),
        sprung_joints: composition.sprung_joints,
        effects: composition.effects,
        amplitudes: composition.amplitudes,
        supports: [supports, loose, composition.idle_multipliers].concat(),
        motions,
        sizes,
        linear: !deck.effects.allow(deck::EffectWord::LargeRotations),
    };
    let mut model = parts.assemble(&mesh.nodes);
    let initial: Vec<InitialMotion> = initial.into_iter().rev().collect();
    let (plane, planar) = planar::plane(deck, &model, &mesh, &initial, diagnostics);
    model.plane = plane;
    if model.plane.is_none() {
        check::warn_of_loose_spins(&composition.loose_spins, deck, diagnostics);
    }
    let plan = Plan {
        energy: output::needs(deck, Need::EnergyAccount),
        watched: probes.iter().filter_map(Probe::watched).collect(),
        continued: output::needs(deck, Need::ContinuedRotations),
        model: Arc::new(model),
        initial,
        places: places(&mesh, &stages),
        stages,
        interval: deck.output.interval,
    };
    // Of a deck that could be read in part the stages may be others.
    if plan.stages.len() == deck.stage_count && diagnostics.iter().all(Diagnostic::is_warning) {
        rehearsal::tell(deck, &plan, &[composition.driven, driven].concat(), diagnostics);
    }
    Some(Scene {
        title: deck.title.clone(),
        plan,
        probes,
        every: deck.output.every,
        vtk: deck.output.vtk,
        envelope,
        profile,
        expectations,
        warnings: Vec::new(),
        reasons: [vec![planar], composition.reasons].concat(),
        mesh,
        bodies: composition.bodies,
        links: composition.links,
        resolved: deck.resolved.clone(),
        elasticity: composition.elasticity,
        actions,
        contacts: composition.contacts,
        stress_deck,
    })
}

/// True if pictures of the whole scene show stresses: those of a deck that asks for stresses.
fn shows_stress(deck: &Deck) -> bool {
    let output = &deck.output;
    let has_columns = output.columns.iter().flatten().any(|key| key.value == "stress");
    has_columns || output.envelope.is_some() || output.profile.is_some()
}

/// The coordinates of a point that a deck gives by its name or its coordinates.
pub fn place(deck: &Deck, point: &Spanned<PointRef>) -> Option<Vec3> {
    names::place(deck, point).ok()
}

/// The initial places of all nodes, where a modal stage asks for them.
fn places(mesh: &Mesh, stages: &[Stage]) -> Vec<(Node, Vec3)> {
    let is_modal = |stage: &Stage| stage.work.kind() == StageKind::Modal;
    let wanted = stages.iter().any(is_modal);
    mesh.nodes.iter().filter(|_| wanted).map(|node| (node.node, node.place)).collect()
}

/// The elements of a beam as changes of chart see them.
fn element_infos(mesh: &Mesh, beam: &MeshBeam) -> impl Iterator<Item = ElementInfo> {
    let in_one_chart = beam.interpolation == deck::InterpolationWord::Total;
    let rotations = |number: usize| beam.nodes_of(number).iter().map(|&node| mesh.nodes[node].node.p);
    beam.elements.clone().map(move |number| ElementInfo::new(rotations(number), in_one_chart))
}

fn stages(deck: &Deck, columns: &Columns, diagnostics: &mut Vec<Diagnostic>) -> Vec<Stage> {
    let mut stages = Vec::new();
    for stage in &deck.stages {
        let until = stage.until.as_ref().and_then(|until| match columns.find(&until.column) {
            Ok((probe, component)) => {
                let column = Arc::new(move |at: &beamsim_core::run::Snapshot| {
                    let mut values = Vec::new();
                    probe.read(at, &mut values);
                    values[component]
                });
                Some(Until { column, below: until.below, above: until.above })
            }
            Err(diagnostic) => {
                diagnostics.push(diagnostic);
                None
            }
        });
        let work = match stage.body {
            StageBody::Static { steps, adaptive } => {
                // Along a path the load factor goes back: only what is linear in it may be followed
                // there.
                let linear = stage.frame.is_none()
                    && deck.contacts.is_empty()
                    && check::histories_in(deck, stages.len() + 1).next().is_none();
                let approach = match (adaptive, linear) {
                    (false, _) => Approach::Straight,
                    (true, false) => Approach::Parts,
                    (true, true) => Approach::Path,
                };
                StageWork::Static { steps, approach }
            }
            StageBody::Path { steps, max_steps } => StageWork::Path { steps, max_steps },
            StageBody::Modal { modes } => StageWork::Modal { modes },
            StageBody::Buckling { modes } => StageWork::Buckling { modes },
            StageBody::Dynamic { end, step, scheme, step_tolerance, energy_limit } => {
                let scheme = scheme::coefficients(scheme);
                StageWork::Dynamic(TimeStepping { end, step, scheme, adaptive: step_tolerance, energy_limit })
            }
        };
        let tolerance = stage.tolerance;
        let max_iterations = stage.max_iterations;
        stages.push(Stage { work, tolerance, max_iterations, until, rotating: stage.frame.is_some() });
    }
    stages
}

fn expectations(deck: &Deck, columns: &Columns, diagnostics: &mut Vec<Diagnostic>) -> Vec<Expectation> {
    let mut found = Vec::new();
    for expect in &deck.expects {
        let source = expect.source.clone();
        match &expect.body {
            ExpectBody::Fails(failure) => {
                found.push(Expectation { name: failure.word().into(), kind: ExpectationKind::Fails, source });
            }
            ExpectBody::Warns(kind) => {
                found.push(Expectation { name: kind.name().into(), kind: ExpectationKind::Warns(*kind), source });
            }
            ExpectBody::Quiet => {
                found.push(Expectation { name: "no warning".into(), kind: ExpectationKind::Quiet, source });
            }
            ExpectBody::Column { column, reduce, value, below, above } => {
                let bounds = Bounds { value: *value, below: *below, above: *above };
                match expected_column(column, *reduce, bounds, columns) {
                    Ok(kind) => found.push(Expectation { name: column.value.clone(), kind, source }),
                    Err(diagnostic) => diagnostics.push(diagnostic),
                }
            }
        }
    }
    found
}

fn expected_column(
    column: &Spanned<String>,
    reduce: Reduce,
    bounds: Bounds,
    columns: &Columns,
) -> Result<ExpectationKind, Diagnostic> {
    if let Some(counter) = column.value.strip_prefix("run.") {
        let Some(counter) = RunCounter::of(counter) else {
            let name = Spanned { value: counter.to_string(), span: column.span.clone() };
            return Err(names::unknown("counter", &name, RunCounter::words()));
        };
        if reduce != Reduce::At(Instant::End) {
            let message = "counters are only available at the end of the run";
            return Err(Diagnostic::error(message, column.span.clone()));
        }
        return Ok(ExpectationKind::Counter { counter, bounds });
    }
    if let Some((quantity, number)) = mode_quantity(&column.value) {
        let wanted = |stage: &deck::Stage| match (quantity, stage.body) {
            (ModeQuantity::Load, StageBody::Buckling { modes }) => modes,
            (ModeQuantity::Omega | ModeQuantity::Growth, StageBody::Modal { modes }) => modes,
            (
                ModeQuantity::Omega | ModeQuantity::Growth | ModeQuantity::Load,
                StageBody::Static { .. }
                | StageBody::Path { .. }
                | StageBody::Dynamic { .. }
                | StageBody::Modal { .. }
                | StageBody::Buckling { .. },
            ) => 0,
        };
        let known = columns.deck.stages.iter().map(wanted).max().unwrap_or(0);
        if number >= known {
            let message = format!("no stage of this deck computes `{}`", column.value);
            return Err(Diagnostic::error(message, column.span.clone()));
        }
        if reduce != Reduce::At(Instant::End) {
            let message = "modes have no history: remove `at` and `reduce`";
            return Err(Diagnostic::error(message, column.span.clone()));
        }
        return Ok(ExpectationKind::Mode { quantity, number, bounds });
    }
    let (probe, component) = columns.find(column)?;
    Ok(ExpectationKind::Column { probe, component, reduce, bounds })
}

/// `mode1.omega`, `mode1.growth`, `buckling1.load`: the quantity and the number of the mode from 0.
fn mode_quantity(name: &str) -> Option<(ModeQuantity, usize)> {
    let (mode, quantity) = name.split_once('.')?;
    let quantity = ModeQuantity::of(quantity)?;
    let digits = mode.strip_prefix(match quantity {
        ModeQuantity::Omega | ModeQuantity::Growth => "mode",
        ModeQuantity::Load => "buckling",
    })?;
    Some((quantity, digits.parse::<usize>().ok()?.checked_sub(1)?))
}

/// The initial motions, last first: a node takes that of the last table that names it. Tables that give none to any node are
/// told.
fn initial_motions(deck: &Deck, mesh: &Mesh, found: &mut Vec<Diagnostic>) -> Vec<InitialMotion> {
    let mut taken = HashSet::new();
    let mut motions = Vec::new();
    for table in deck.initials.iter().rev() {
        let Some(motion) = initial(deck, mesh, table, found) else { continue };
        let given = motion.nodes.iter().filter(|(node, _)| taken.insert((node.u, node.p))).count();
        if given == 0 {
            let message = "all nodes of this table have a later table, and the last one applies";
            let help = "give `velocity` and `spin` of a motion in one table";
            found.push(Diagnostic::warning(WarningKind::IdleInitial, message, table.span.clone()).help(help));
        }
        motions.push(motion);
    }
    motions
}

fn initial(
    deck: &Deck,
    mesh: &Mesh,
    initial: &deck::Initial,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<InitialMotion> {
    let nodes: Vec<usize> = match &initial.target {
        deck::InitialTarget::All => (0..mesh.nodes.len()).collect(),
        deck::InitialTarget::At(at) => match mesh.find_node(deck, at) {
            Ok((node, _)) => vec![node],
            Err(diagnostic) => {
                diagnostics.push(diagnostic);
                return None;
            }
        },
        deck::InitialTarget::Beam(name) => match mesh.beams.named(&name.value) {
            Some(beam) => beam.nodes.clone(),
            None => {
                diagnostics.extend(names::unknown_beam(deck, name));
                return None;
            }
        },
    };
    let about = match initial.about.as_ref().map_or(Ok(Vec3::ZERO), |point| names::place(deck, point)) {
        Ok(place) => place,
        Err(diagnostic) => {
            diagnostics.push(diagnostic);
            return None;
        }
    };
    let nodes: Vec<(Node, Vec3)> = nodes.into_iter().map(|n| (mesh.nodes[n].node, mesh.nodes[n].place)).collect();
    Some(InitialMotion { nodes, velocity: Vec3(initial.velocity), spin: Vec3(initial.spin), about })
}
