//! `beamsim check`

use super::load::Loaded;
use super::run::status_of;
use super::{Status, Verdict, json, load, on_threads, say, threads_of};
use crate::scene::{Mesh, Scene};
use crate::study::forecast::{Forecast, forecast};
use beamsim_core::model::beam_element::{ElementGeometry, Rule};
use beamsim_core::model::{Assembly, EffectSize, Schedule, SectionMatrices};
use beamsim_core::run::{Failure, Moment, refusal};
use beamsim_core::system::StageKind;
use beamsim_core::tensor::{Mat3, Vec3};
use beamsim_core::threads;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How long a run is watched to tell how long it will take.
const PATIENCE: Duration = Duration::from_millis(250);

/// Reads decks and tells what would be simulated, and how long it will take.
pub fn check(decks: &[PathBuf], settings: &[String]) -> Status {
    let mut verdict = Verdict::default();
    for path in decks {
        let begun = Instant::now();
        match load::deck(path, settings) {
            Ok(loaded) => {
                let reading = begun.elapsed();
                say::line(&format!("{}: {}", path.display(), loaded.scene.title.as_deref().unwrap_or("(no title)")));
                let told = tell(&loaded.scene).map_err(Failure::Deck).and_then(|()| tell_time(&loaded, reading));
                match told {
                    Ok(seconds) => json::check(path, &loaded.scene, Some(seconds)),
                    Err(failure) => {
                        hint(&failure, &loaded.scene);
                        verdict.fail(status_of(&failure), failure.name(), failure.to_string());
                    }
                }
            }
            Err(refusal) => verdict.refuse(refusal),
        }
    }
    verdict.finish(decks.len())
}

fn tell(scene: &Scene) -> Result<(), String> {
    tell_beams(&scene.mesh);
    tell_mass(scene);
    let size = tell_size(scene);
    let shares = size.as_ref().map_or(&[][..], |shares| shares);
    say::line("effects");
    let width = scene.reasons.iter().map(|r| r.name.len()).max().unwrap_or(0);
    for reason in &scene.reasons {
        let mark = if reason.active { "on " } else { "off" };
        let share = shares.iter().find(|share| reason.active && share.name == reason.name);
        let added = share.map_or(String::new(), |EffectSize { instances, unknowns, entries, .. }| {
            format!(
                " ({instances} in the first stage; {unknowns} unknowns and {entries} entries of the matrix come from nothing else)"
            )
        });
        say::line(&format!("  {mark} {:<width$}  {}{added}", reason.name, reason.reason));
    }
    size.map(|_| ())
}

/// How long a run will take; `Err` where it ends before it has computed anything. One that an accuracy is wanted of begins with a search
/// among other meshes and steps.
fn tell_time(loaded: &Loaded, reading: Duration) -> Result<f64, Failure> {
    let count = threads_of(&loaded.scene, None);
    let Forecast { seconds, watched, ended, computed, at } = threads::on(count, || forecast(&loaded.scene, PATIENCE));
    let whole = duration(seconds + reading.as_secs_f64());
    let Moment { stage, time, load } = at;
    let how = match &ended {
        Some(Ok(())) => "it was run to its end".into(),
        Some(Err(_)) => "it was run, and fails".into(),
        None => format!("{} of it led to stage {stage}, time {time:.3e}, load factor {load:.3}", duration(watched)),
    };
    match ended {
        Some(Err(failure)) if !computed || failure.is_of_start() => {
            return Err(failure);
        }
        Some(Err(failure)) => {
            say::note(&format!("warning: a run ends as `{}`: {failure}", failure.name()));
            hint(&failure, &loaded.scene);
            say::count_warnings(1);
        }
        _ => {}
    }
    let own = if loaded.deck.accuracy.is_some() { ", with its own elements and steps" } else { "" };
    say::line(&format!("run: about {whole} on this machine{}{own} ({how})", on_threads(count)));
    Ok(seconds + reading.as_secs_f64())
}

/// What to try after a failure.
fn hint(failure: &Failure, scene: &Scene) {
    if let Some(hint) = failure.hint(&scene.plan) {
        say::note(&format!("hint: {hint}"));
    }
}

/// In few digits: more are not known.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 0.0095 => format!("{:.1} ms", 1e3 * s),
        s if s < 0.95 => format!("{:.0} ms", 1e3 * s),
        s if s < 99.5 => format!("{s:.1} s"),
        s if s < 99.5 * 60.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3600.0),
    }
}

/// A number, with a power of ten where it is very large or very small.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-5..1e16).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

fn tell_beams(mesh: &Mesh) {
    for beam in &mesh.beams {
        let count = beam.elements.len();
        say::line(&format!(
            "beam {}: length {}, {count} elements of order {}, {} nodes",
            beam.name,
            number(beam.line.length),
            beam.order,
            beam.nodes.len()
        ));
        let (start, end) = (beam.section.at(0.0), beam.section.at(1.0));
        tell_section(&start, if start == end { "" } else { " at the start" });
        if start != end {
            tell_section(&end, " at the end");
        }
    }
}

fn tell_section(section: &SectionMatrices, place: &str) {
    let k = section.stiffness;
    say::line(&format!(
        "  section{place}: EA {} GA [{}, {}] GJ {} EI [{}, {}]",
        number(k[0][0]),
        number(k[1][1]),
        number(k[2][2]),
        number(k[3][3]),
        number(k[4][4]),
        number(k[5][5])
    ));
    let coupled = (0..6).any(|i| (0..i).any(|j| k[i][j] != 0.0));
    if coupled {
        say::line("  its stiffness couples");
    }
    if let Some(mass) = &section.mass {
        let j = mass.about_line.0;
        say::line(&format!(
            "  rhoA {} rhoJ [{}, {}, {}] mass centre {:?}",
            number(mass.mass),
            number(j[0][0]),
            number(j[1][1]),
            number(j[2][2]),
            mass.offset.0
        ));
    }
}

/// Mass, centre and inertia about the centre, in the initial placement. Moments are taken about a node: far from the origin those about it
/// are differences of large numbers.
fn tell_mass(scene: &Scene) {
    let own = scene.mesh.nodes.first().map(|node| node.place);
    let about = own.or_else(|| scene.bodies.first().map(|body| body.place)).unwrap_or(Vec3::ZERO);
    let (mut mass, mut first, mut second) = (0.0, Vec3::ZERO, Mat3::ZERO);
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
        return say::line("mass: none given");
    }
    let arm = first * (1.0 / mass);
    let inertia = second - steiner(arm, mass);
    if !(mass.is_finite() && arm.is_finite() && inertia.max_abs().is_finite()) {
        return say::line("mass: its sums are beyond the range of floating-point numbers");
    }
    say::line(&format!("mass {}, centre {:?}", number(mass), (about + arm).0));
    say::line(&format!("inertia about the centre {:?}", inertia.0));
}

/// What a mass off an axis adds to the inertia.
fn steiner(arm: Vec3, mass: f64) -> Mat3 {
    (Mat3::diagonal([arm.squared(); 3]) - arm.outer(arm)) * mass
}

/// States, forces, mesh, elements and the places of their blocks: as much as so many vectors a slot, as measured for chains of a million
/// elements, whose factors stand within the tangent.
const VECTORS: usize = 12;

/// The same with rates, masses and what is learnt from steps
const VECTORS_IN_DYNAMICS: usize = 27;

/// What a planar scene takes besides where it is kept in space, too
const VECTORS_IN_SPACE: usize = 6;

/// Unknowns, entries of the tangent, memory, and what each effect adds to them; and whether the first stage can begin.
fn tell_size(scene: &Scene) -> Result<Vec<EffectSize>, String> {
    let model = &scene.plan.model;
    let mut schedule = Schedule::new(model);
    let state = model.rest();
    let kind = scene.plan.stages[0].work.kind();
    let begun = schedule.begin_stage(model, 0, kind, &state);
    let equations = begun.map_err(|error| format!("stage 1: {}", refusal(&error, model)))?;
    let (free, slots) = (equations.count(), model.slots());
    let context = scene.plan.stages[0].context(0);
    let shares = model.shares(&context, &equations);
    // A planar scene is kept in space, too, for the looks out of the plane.
    let in_space = equations.plane().and_then(|_| schedule.dof_map(model, None).ok());
    let in_space = in_space.map(|equations| Assembly::new(&context, equations, model).system.pattern.values());
    let assembly = Assembly::new(&context, equations, model);
    let entries = assembly.system.pattern.nonzeros();
    let vectors = if kind == StageKind::Dynamic { VECTORS_IN_DYNAMICS } else { VECTORS };
    let vectors = vectors + in_space.map_or(0, |_| VECTORS_IN_SPACE);
    let bytes = 8 * (assembly.system.pattern.values() + in_space.unwrap_or(0)) + 24 * vectors * slots;
    say::line(&format!(
        "{} nodes, {} elements, {free} free unknowns of {}, {entries} entries in the tangent, about {:.1} MB",
        scene.mesh.nodes.len(),
        scene.mesh.element_count,
        3 * slots,
        bytes as f64 / 1e6
    ));
    Ok(shares)
}
