//! `beamsim check`

use super::accuracy::study_error;
use super::error::CommandError;
use super::load::Loaded;
use super::status::Status;
use super::thread_count::{on_threads, threads_of};
use super::verdict::Verdict;
use super::{console, json, load};
use crate::scene::{self, Mesh, Scene};
use crate::study::forecast::{Forecast, forecast};
use crate::study::{accuracy, cost};
use beamsim_core::model::beam_element::{ElementGeometry, Rule};
use beamsim_core::model::{Assembly, EffectSize, Schedule, SectionMatrices};
use beamsim_core::run::{Failure, Moment, refusal};
use beamsim_core::section::Matrix6;
use beamsim_core::section::saint_venant::spd_inverse;
use beamsim_core::tensor::{Mat3, Vec3};
use beamsim_core::threads;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time limit of the trial run from which the duration of the whole run is predicted.
const TRIAL_TIME: Duration = Duration::from_millis(250);

/// Reads decks and prints what would be simulated, and how long it will take.
pub fn check(decks: &[PathBuf], settings: &[String]) -> Status {
    let mut verdict = Verdict::default();
    for path in decks {
        if let Err(error) = one(path, settings) {
            verdict.fail(error);
        }
    }
    verdict.finish(decks.len())
}

fn one(path: &Path, settings: &[String]) -> Result<(), CommandError> {
    let begun = Instant::now();
    let loaded = load::deck(path, settings)?;
    let reading = begun.elapsed();
    let Loaded { deck, scene, .. } = &loaded;
    accuracy::refuse_outputs(deck, scene)
        .and_then(|()| cost::refuse_outputs(deck, scene))
        .map_err(|found| study_error(found.into(), path, &loaded))?;
    let title = loaded.scene.title.as_deref().unwrap_or("(no title)");
    console::line(&format!("{}: {title}", path.display()));
    print_computed_sections(&loaded);
    print_scene(&loaded.scene).map_err(CommandError::Run)?;
    let seconds = print_time(&loaded, reading).map_err(|failure| {
        print_hint(&failure, &loaded.scene);
        CommandError::Run(failure)
    })?;
    json::check(path, &loaded.scene, seconds);
    Ok(())
}

/// Prints a line for each section of beams that is computed from its shape.
fn print_computed_sections(loaded: &Loaded) {
    let deck = &loaded.deck;
    let is_used = |name: &str| deck.beams.iter().any(|beam| beam.sections.iter().any(|own| own.value == name));
    for section in deck.sections.iter().filter(|section| is_used(&section.name.value)) {
        let Some(Ok(solved)) = scene::solved(section, deck) else { continue };
        let Some(solution) = solved.solution else { continue };
        console::line(&format!(
            "section {}: computed with {} nodes, estimated relative error {:.1e}; more by `beamsim section`",
            section.name.value,
            solution.analysis.mesh.nodes.len(),
            solution.analysis.estimate
        ));
    }
}

fn print_scene(scene: &Scene) -> Result<(), Failure> {
    print_beams(&scene.mesh);
    print_mass(scene);
    let size = print_size(scene);
    let shares = size.as_ref().map_or(&[][..], |shares| shares);
    console::line("effects");
    let width = scene.reasons.iter().map(|r| r.name.len()).max().unwrap_or(0);
    for reason in &scene.reasons {
        let mark = if reason.active { "on " } else { "off" };
        let share = shares.iter().find(|share| reason.active && share.name == reason.name);
        let added = share.map_or(String::new(), describe_share);
        console::line(&format!("  {mark} {:<width$}  {}{added}", reason.name, reason.reason));
    }
    size.map(|_| ())
}

/// The size of an effect, and the part of the equations that would vanish without it, where there
/// is one.
fn describe_share(share: &EffectSize) -> String {
    let EffectSize { instances, unknowns, entries, .. } = share;
    let mut text = format!(" ({instances} in the first stage");
    if *unknowns > 0 || *entries > 0 {
        text += &format!("; adds {unknowns} unknowns and {entries} matrix entries");
    }
    text + ")"
}

/// Prints how long a run will take, in seconds; `Err` where it fails before it has computed
/// anything. A run with a wanted accuracy begins with a search, whose time is not included.
fn print_time(loaded: &Loaded, reading: Duration) -> Result<f64, Failure> {
    let count = threads_of(&loaded.scene, None);
    let Forecast { seconds, watched, ended, computed, at } = threads::on(count, || forecast(&loaded.scene, TRIAL_TIME));
    let whole = duration(seconds + reading.as_secs_f64());
    let Moment { stage, time, load } = at;
    let how = match ended {
        Some(Err(failure)) if !computed || failure.is_of_start() => return Err(failure),
        Some(Err(failure)) => {
            console::note(&format!("warning: the run will fail with `{}`: {failure}", failure.name()));
            print_hint(&failure, &loaded.scene);
            console::count_warnings(1);
            "the trial run failed".into()
        }
        Some(Ok(())) => "measured".into(),
        None => {
            let watched = duration(watched);
            format!(
                "extrapolated: a trial run of {watched} reached stage {stage}, time {time:.3e}, load factor {load:.3}"
            )
        }
    };
    let own = if loaded.deck.accuracy.is_some() { ", with the elements and steps of the deck" } else { "" };
    console::line(&format!("run: about {whole} on this machine{}{own} ({how})", on_threads(count)));
    Ok(seconds + reading.as_secs_f64())
}

/// Prints advice after a failure.
fn print_hint(failure: &Failure, scene: &Scene) {
    if let Some(hint) = failure.hint(&scene.plan) {
        console::note(&format!("hint: {hint}"));
    }
}

/// A predicted time with about two digits.
fn duration(seconds: f64) -> String {
    if seconds < 0.0095 {
        format!("{:.1} ms", 1e3 * seconds)
    } else if seconds < 0.95 {
        format!("{:.0} ms", 1e3 * seconds)
    } else if seconds < 99.5 {
        format!("{seconds:.1} s")
    } else if seconds < 99.5 * 60.0 {
        format!("{:.0} min", seconds / 60.0)
    } else {
        format!("{:.0} h", seconds / 3600.0)
    }
}

/// A number, with a power of ten where it is very large or very small.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-5..1e16).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

/// A positive number with three digits.
fn rounded(value: f64) -> f64 {
    rounded_to(3, value)
}

/// A number with some digits.
fn rounded_to(digits: usize, value: f64) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

fn print_beams(mesh: &Mesh) {
    for beam in &mesh.beams {
        let count = beam.elements.len();
        let lengths = beam.graded_lengths().map_or(String::new(), |[shortest, longest]| {
            format!(" and lengths {} to {}", number(rounded(shortest)), number(rounded(longest)))
        });
        console::line(&format!(
            "beam {}: length {}, {count} elements of order {}{lengths}, {} nodes",
            beam.name,
            number(beam.line.length),
            beam.order,
            beam.nodes.len()
        ));
        let start = beam.section.at(0.0);
        let end = beam.section.at(1.0);
        print_section(&start, if start == end { "" } else { " at the start" });
        if start != end {
            print_section(&end, " at the end");
        }
    }
}

fn print_section(section: &SectionMatrices, place: &str) {
    let k = section.stiffness;
    console::line(&format!(
        "  section{place}: EA {} GA [{}, {}] GJ {} EI [{}, {}]",
        number(k[0][0]),
        number(k[1][1]),
        number(k[2][2]),
        number(torsional_stiffness(section)),
        number(k[4][4]),
        number(k[5][5])
    ));
    let coupled = (0..6).any(|i| (0..i).any(|j| k[i][j] != 0.0));
    if coupled {
        console::line("  the stiffness matrix has off-diagonal entries");
    }
    if let Some(mass) = &section.mass {
        let j = mass.about_line.0;
        console::line(&format!(
            "  rhoA {} rhoJ [{}, {}, {}] mass centre {:?}",
            number(mass.mass),
            number(j[0][0]),
            number(j[1][1]),
            number(j[2][2]),
            mass.offset.0
        ));
    }
}

/// Stiffness under a torque alone, 1/S44: not K44, which contains the distance to the shear centre.
fn torsional_stiffness(section: &SectionMatrices) -> f64 {
    let k = section.stiffness;
    let is_coupled = (0..6).any(|j| j != 3 && k[3][j] != 0.0);
    if !is_coupled {
        return k[3][3];
    }
    let stiffness = Matrix6::from_fn(|i, j| k[i][j]);
    spd_inverse(&stiffness).map_or(k[3][3], |compliance| rounded_to(10, 1.0 / compliance[(3, 3)]))
}

/// Prints mass, centre, and inertia about the centre in the initial placement. Moments are summed
/// about a node: for a scene far from the origin, moments about the origin would be differences of
/// large numbers.
fn print_mass(scene: &Scene) {
    let own = scene.mesh.nodes.first().map(|node| node.place);
    let about = own.or_else(|| scene.bodies.first().map(|body| body.place)).unwrap_or(Vec3::ZERO);
    let mut mass = 0.0;
    let mut first = Vec3::ZERO;
    let mut second = Mat3::ZERO;
    let mut add = |m: f64, centre: Vec3, own: Mat3| {
        let arm = centre - about;
        mass += m;
        first += arm * m;
        second += own + steiner(arm, m);
    };
    for beam in &scene.mesh.beams {
        for element in scene.mesh.elements_of(beam) {
            for station in element.stations(Rule::Volume) {
                let Some(section) = beam.section.at(station.fraction).mass else { continue };
                let inertia = section.turned(station.axes);
                let place = element.between(&station.shape);
                let d = inertia.offset;
                let about_line = inertia.about_node - steiner(d, inertia.mass);
                add(inertia.mass * station.weight, place + d, about_line * station.weight);
            }
        }
    }
    for body in &scene.bodies {
        let d = body.inertia.offset;
        add(body.inertia.mass, body.place + d, body.inertia.about_node - steiner(d, body.inertia.mass));
    }
    if mass == 0.0 {
        return console::line("mass: none");
    }
    let arm = first * (1.0 / mass);
    let inertia = second - steiner(arm, mass);
    if !(mass.is_finite() && arm.is_finite() && inertia.max_abs().is_finite()) {
        return console::line("mass: too large for floating-point numbers");
    }
    console::line(&format!("mass {}, centre {:?}", number(mass), (about + arm).0));
    console::line(&format!("inertia about the centre {:?}", inertia.0));
}

/// The inertia about a point of a mass at `arm` from it (parallel-axis theorem).
fn steiner(arm: Vec3, mass: f64) -> Mat3 {
    (Mat3::diagonal([arm.squared(); 3]) - arm.outer(arm)) * mass
}

/// Memory of a static scene beside its tangent, in vectors per slot (3 numbers each), measured on
/// chains of a million elements: states, forces, mesh, elements and the positions of their blocks.
/// Factors are stored within the tangent.
const VECTORS: usize = 12;

/// Memory of a dynamic scene beside its tangent, in vectors per slot.
const VECTORS_IN_DYNAMICS: usize = 27;

/// Additional memory of a planar scene, which is also set up in space, in vectors per slot.
const VECTORS_IN_SPACE: usize = 6;

/// Prints unknowns, entries of the tangent and memory; gives the part of each effect. `Err` where
/// the first stage cannot begin.
fn print_size(scene: &Scene) -> Result<Vec<EffectSize>, Failure> {
    let model = &scene.plan.model;
    let mut schedule = Schedule::new(model);
    let state = model.rest();
    let kind = scene.plan.stages[0].work.kind();
    let begun = schedule.begin_stage(model, 0, kind, &state);
    let equations = begun.map_err(|error| Failure::Deck(format!("stage 1: {}", refusal(&error, model))))?;
    let free = equations.count();
    let slots = model.slots();
    let context = scene.plan.stages[0].context(0);
    let shares = model.shares(&context, &equations);
    // A planar scene is also set up in space, to check its stability out of the plane.
    let in_space = equations.plane().and_then(|_| schedule.dof_map(model, None).ok());
    let in_space = in_space.map(|equations| Assembly::new(&context, equations, model).system.pattern.values());
    let assembly = Assembly::new(&context, equations, model);
    let entries = assembly.system.pattern.nonzeros();
    let vectors = if kind.advances_time() { VECTORS_IN_DYNAMICS } else { VECTORS };
    let vectors = vectors + in_space.map_or(0, |_| VECTORS_IN_SPACE);
    let bytes = 8 * (assembly.system.pattern.values() + in_space.unwrap_or(0)) + 24 * vectors * slots;
    console::line(&format!(
        "{} nodes, {} elements, {free} free unknowns of {}, {entries} entries in the tangent, about {:.1} MB",
        scene.mesh.nodes.len(),
        scene.mesh.element_count,
        3 * slots,
        bytes as f64 / 1e6
    ));
    Ok(shares)
}
