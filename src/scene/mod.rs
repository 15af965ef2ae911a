//! From a deck to a scene: the one place that sees words and numbers both.

mod check;
mod compose;
mod constraints;
mod figure;
mod forced;
mod joints;
mod mesh;
mod names;
mod output;
mod path;
mod planar;
mod rehearsal;
mod section;

pub use compose::Reason;
pub use mesh::{Mesh, MeshBeam, Rule};
pub use names::Spot;
pub use section::{MassPerLength, SectionMatrices};

use crate::deck::{
    self, Deck, Diagnostic, ExpectBody, Instant, PointRef, Reduce, SchemeWord, Severity, Spanned, StageBody,
};
use beamsim_core::effect::beam_elasticity::StressField;
use beamsim_core::effect::link;
use beamsim_core::effect::rigid_body::Body;
use beamsim_core::integrate::Scheme;
use beamsim_core::model::{Charted, ElementInfo, Model, SlotKind, StageKind};
use beamsim_core::probe::{Figure, Need, Probe};
use beamsim_core::run::{Approach, InitialMotion, Plan, Stage, StageWork, Until, Warning};
use beamsim_core::system::Node;
use beamsim_core::tensor::{Mat3, Vec3};
use beamsim_core::warning::WarningKind;
use constraints::SceneConstraints;
use output::Columns;
use std::sync::Arc;

/// A deck made ready to run.
pub struct Scene {
    /// What it is about
    pub title: Option<String>,
    /// What is to be done
    pub plan: Plan,
    /// The columns of the history
    pub probes: Vec<Probe>,
    /// Each n-th row is written.
    pub every: usize,
    /// Whether fields are written
    pub vtk: bool,
    /// What is expected
    pub expectations: Vec<Expectation>,
    /// Warnings about the deck itself, where the scene was built by [`from_deck`]
    pub warnings: Vec<Warning>,
    /// Which effects act, and why
    pub reasons: Vec<Reason>,
    /// Nodes, beams, elements
    pub mesh: Mesh,
    /// Rigid bodies
    pub bodies: Vec<Body>,
    /// Springs and cables between nodes
    pub links: Vec<link::Instance>,
    /// The deck with expressions replaced by numbers
    pub resolved: serde_json::Value,
    /// What knows of resultants
    elasticity: Vec<Arc<dyn StressField>>,
}

impl Scene {
    /// Its whole shape, for pictures.
    pub fn figure(&self) -> Figure {
        figure::figure(&self.mesh, &self.bodies, &self.links, &self.elasticity)
    }
}

/// What is expected of a run.
#[derive(Clone)]
pub struct Expectation {
    /// The column, failure or warning as it stands in the deck
    pub name: String,
    /// What is expected
    pub kind: ExpectationKind,
    /// Where the number comes from
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
        /// Its name, without `run.`
        name: String,
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

/// A number of a mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModeQuantity {
    /// Imaginary part
    Omega,
    /// Real part
    Growth,
    /// Critical load factor
    Load,
}

/// The bounds of an expected number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// value, atol, rtol
    pub value: Option<(f64, f64, f64)>,
    /// Upper bound
    pub below: Option<f64>,
    /// Lower bound
    pub above: Option<f64>,
}

/// Counters that an expectation can look at.
pub const RUN_COUNTERS: [&str; 5] = ["steps", "iterations", "cutbacks", "chart_switches", "mixed_elements"];

/// Messages beyond this many help nobody.
const MOST_DIAGNOSTICS: usize = 200;

/// Builds a scene from the text of a deck; the second part holds warnings. `Err` holds everything that is wrong.
pub fn from_text(text: &str) -> Result<(Scene, Vec<Diagnostic>), Vec<Diagnostic>> {
    let (deck, found) = deck::read(text)?;
    from_deck(&deck, found)
}

/// Builds a scene from a deck and what was found in reading it; results as those of [`from_text`].
pub fn from_deck(deck: &Deck, mut diagnostics: Vec<Diagnostic>) -> Result<(Scene, Vec<Diagnostic>), Vec<Diagnostic>> {
    let mut found = Vec::new();
    let scene = build(deck, &mut found);
    if !diagnostics.iter().all(Diagnostic::is_warning) {
        // Of a deck that could be read in part only what is said about names is no consequence of that.
        found.retain(|d| d.unknown.as_ref().is_some_and(|name| !deck.broken.iter().any(|b| about(name, b))));
    }
    diagnostics.append(&mut found);
    diagnostics.sort_by_key(Diagnostic::is_warning);
    let mut told: Vec<Diagnostic> = Vec::new();
    for diagnostic in diagnostics {
        let again =
            |known: &Diagnostic| known == &diagnostic || (known.unknown.is_some() && known.span == diagnostic.span);
        if told.len() < MOST_DIAGNOSTICS && !told.iter().any(again) {
            told.push(diagnostic);
        }
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

/// Whether a name speaks of a table: `arm`, `arm@end`, `arm:3`.
fn about(name: &str, table: &str) -> bool {
    name.split(['@', ':']).next() == Some(table)
}

/// Builds a scene from a deck that was read or made; what is wrong, and warnings, go to `diagnostics`. `None` where something is so
/// wrong that there is no scene.
pub fn build(deck: &Deck, diagnostics: &mut Vec<Diagnostic>) -> Option<Scene> {
    check::deck(deck, diagnostics);
    forced::refuse_impossible(deck, diagnostics);
    let mesh = Mesh::new(deck, diagnostics);
    build_on(deck, mesh, diagnostics)
}

fn build_on(deck: &Deck, mesh: Mesh, diagnostics: &mut Vec<Diagnostic>) -> Option<Scene> {
    let deck = &*forced::deck(deck);
    let complete = mesh.beams.len() == deck.beams.len();
    let histories = constraints::histories(deck);
    let mut found = Vec::new();
    let connections = joints::find(deck, &mesh, &mut found);
    let composition = compose::compose(deck, &mesh, &histories, &connections, &mut found);
    let SceneConstraints { supports, motions, driven } =
        constraints::constraints(deck, &mesh, &histories, &connections, &mut found);
    let columns = Columns { deck, mesh: &mesh, elasticity: &composition.elasticity };
    let probes = columns.written(&mut found);
    let stages = stages(deck, &columns, &mut found);
    let expectations = expectations(deck, &columns, &mut found);
    let initial = deck.initials.iter().rev().filter_map(|i| initial(deck, &mesh, i, &mut found)).collect::<Vec<_>>();
    // Where a beam could not be meshed, points may seem to be no nodes; names that are unknown are so all the same.
    diagnostics.extend(found.into_iter().filter(|d| complete || d.unknown.is_some()));
    check::warn_of_undamped_multipliers(deck, &composition, diagnostics);
    let loose = check::loose_rotations(deck, &mesh, &composition, &supports);
    check::refuse_moments(deck, &mesh, &loose, diagnostics);
    let first_multiplier = mesh.slots() as u32;
    let multipliers = composition.multipliers.len();
    let rotating = Arc::new(charted(&mesh));
    let (mut kinds, mut names) = (kinds(&mesh), mesh.names.clone());
    for (kind, name) in composition.multipliers {
        names.give(kinds.len() as u32, &name);
        kinds.push(kind);
    }
    let mut model = Model {
        kinds: Arc::new(kinds),
        names: Arc::new(names),
        multipliers: (first_multiplier..first_multiplier + multipliers as u32).collect(),
        angles: composition.angles,
        sprung: composition.springs.iter().filter(|s| s.rotation != Mat3::ZERO).map(|s| s.node.p).collect(),
        sprung_joints: composition.sprung_joints,
        elements: mesh.element_count,
        charted: rotating.clone(),
        rotating,
        effects: composition.effects,
        amplitudes: composition.amplitudes,
        supports: [supports, loose, composition.idle_multipliers].concat(),
        motions,
        plane: None,
        linear: !deck.effects.allow(deck::EffectWord::LargeRotations),
        length: check::diagonal(&mesh),
    };
    let initial: Vec<InitialMotion> = initial.into_iter().rev().collect();
    let (plane, planar) = planar::plane(deck, &model, &mesh, &initial, diagnostics);
    model.plane = plane;
    let plan = Plan {
        energy: output::needs(deck, Need::EnergyAccount),
        continued: output::needs(deck, Need::ContinuedRotations),
        model,
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
        expectations,
        warnings: Vec::new(),
        reasons: [vec![planar], composition.reasons].concat(),
        mesh,
        bodies: composition.bodies,
        links: composition.links,
        resolved: deck.resolved.clone(),
        elasticity: composition.elasticity,
    })
}

/// Where a point is that stands in a deck by its name or its coordinates.
pub fn place(deck: &Deck, point: &Spanned<PointRef>) -> Option<Vec3> {
    names::place(deck, point).ok()
}

/// The initial places of all nodes, where a modal stage asks for them.
fn places(mesh: &Mesh, stages: &[Stage]) -> Vec<(Node, Vec3)> {
    let is_modal = |stage: &Stage| stage.work.kind() == StageKind::Modal;
    let wanted = stages.iter().any(is_modal);
    mesh.nodes.iter().filter(|_| wanted).map(|node| (node.node, node.place)).collect()
}

/// The rotations of all nodes, and the elements beam by beam.
fn charted(mesh: &Mesh) -> Charted {
    let info = |beam: &MeshBeam, number: usize| {
        let rotations = beam.nodes_of(number).iter().map(|&n| mesh.nodes[n].node.p);
        ElementInfo::new(rotations, beam.interpolation == deck::InterpolationWord::Total)
    };
    let of = |beam: &MeshBeam| beam.elements.clone().map(|number| info(beam, number)).collect::<Vec<_>>();
    Charted {
        rotations: mesh.nodes.iter().map(|n| n.node.p).collect(),
        elements: mesh.beams.iter().flat_map(of).collect(),
    }
}

/// What each slot of the mesh holds.
fn kinds(mesh: &Mesh) -> Vec<SlotKind> {
    let mut kinds = vec![SlotKind::Displacement; mesh.slots()];
    mesh.nodes.iter().for_each(|node| kinds[node.node.p as usize] = SlotKind::Rotation);
    kinds
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
                // Along a path the load factor goes back: only what is linear in it may be followed there.
                let linear = stage.frame.is_none() && check::histories_in(deck, stages.len() + 1).next().is_none();
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
                StageWork::Dynamic { end, step, scheme: coefficients(scheme), adaptive: step_tolerance, energy_limit }
            }
        };
        let (tolerance, max_iterations) = (stage.tolerance, stage.max_iterations);
        stages.push(Stage { work, tolerance, max_iterations, until, rotating: stage.frame.is_some() });
    }
    stages
}

fn coefficients(scheme: SchemeWord) -> Scheme {
    match scheme {
        SchemeWord::Newmark(beta, gamma) => Scheme::newmark(beta, gamma),
        SchemeWord::Hht(alpha) => Scheme::hht(alpha),
        SchemeWord::GeneralizedAlpha(rho) => Scheme::generalized_alpha(rho),
        SchemeWord::LieGeneralizedAlpha(rho) => Scheme::lie_generalized_alpha(rho),
    }
}

fn expectations(deck: &Deck, columns: &Columns, diagnostics: &mut Vec<Diagnostic>) -> Vec<Expectation> {
    let mut found = Vec::new();
    for expect in &deck.expects {
        let source = expect.source.clone();
        match &expect.body {
            ExpectBody::Fails(name) => {
                found.push(Expectation { name: name.value.clone(), kind: ExpectationKind::Fails, source });
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
        if !RUN_COUNTERS.contains(&counter) {
            let name = Spanned { value: counter.to_string(), span: column.span.clone() };
            return Err(names::unknown("counter", &name, RUN_COUNTERS.into_iter()));
        }
        if reduce != Reduce::At(Instant::End) {
            let message = "a counter is looked at at the end of the run";
            return Err(Diagnostic::error(message, column.span.clone()));
        }
        return Ok(ExpectationKind::Counter { name: counter.into(), bounds });
    }
    if let Some((quantity, number)) = mode_quantity(&column.value) {
        let wanted = |stage: &deck::Stage| match (quantity, stage.body) {
            (ModeQuantity::Load, StageBody::Buckling { modes }) => modes,
            (ModeQuantity::Omega | ModeQuantity::Growth, StageBody::Modal { modes }) => modes,
            _ => 0,
        };
        let known = columns.deck.stages.iter().map(wanted).max().unwrap_or(0);
        if number >= known {
            let message = format!("no stage of this deck asks for `{}`", column.value);
            return Err(Diagnostic::error(message, column.span.clone()));
        }
        if reduce != Reduce::At(Instant::End) {
            let message = "a mode has no history: leave `at` and `reduce` out";
            return Err(Diagnostic::error(message, column.span.clone()));
        }
        return Ok(ExpectationKind::Mode { quantity, number, bounds });
    }
    let (probe, component) = columns.find(column)?;
    Ok(ExpectationKind::Column { probe, component, reduce, bounds })
}

/// `mode1.omega`, `mode1.growth`, `buckling1.load`: the quantity and the number of the mode from 0.
pub fn mode_quantity(name: &str) -> Option<(ModeQuantity, usize)> {
    let (mode, quantity) = name.split_once('.')?;
    let (quantity, digits) = match quantity {
        "omega" => (ModeQuantity::Omega, mode.strip_prefix("mode")?),
        "growth" => (ModeQuantity::Growth, mode.strip_prefix("mode")?),
        "load" => (ModeQuantity::Load, mode.strip_prefix("buckling")?),
        _ => return None,
    };
    Some((quantity, digits.parse::<usize>().ok()?.checked_sub(1)?))
}

fn initial(
    deck: &Deck,
    mesh: &Mesh,
    initial: &deck::Initial,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<InitialMotion> {
    let mut report = |diagnostic: Diagnostic| diagnostics.push(diagnostic);
    let nodes: Vec<usize> = match &initial.target {
        deck::InitialTarget::All => (0..mesh.nodes.len()).collect(),
        deck::InitialTarget::At(at) => match mesh.find_node(deck, at) {
            Ok((node, _)) => vec![node],
            Err(diagnostic) => {
                report(diagnostic);
                return None;
            }
        },
        deck::InitialTarget::Beam(name) => match mesh.beams.iter().find(|b| b.name == name.value) {
            Some(beam) => beam.nodes.clone(),
            None => {
                report(names::unknown("beam", name, deck.beams.iter().map(|b| b.name.value.as_str())));
                return None;
            }
        },
    };
    let about = match initial.about.as_ref().map_or(Ok(Vec3::ZERO), |point| names::place(deck, point)) {
        Ok(place) => place,
        Err(diagnostic) => {
            report(diagnostic);
            return None;
        }
    };
    let nodes: Vec<(Node, Vec3)> = nodes.into_iter().map(|n| (mesh.nodes[n].node, mesh.nodes[n].place)).collect();
    Some(InitialMotion { nodes, velocity: Vec3(initial.velocity), spin: Vec3(initial.spin), about })
}
