//! `beamsim check`

use super::{Status, Verdict, load, say};
use crate::model::{Assembly, Share};
use crate::scene::{Mesh, Rule, Scene};
use crate::tensor::{Mat3, Vec3};
use std::path::PathBuf;

/// Reads decks and tells what would be simulated.
pub fn check(decks: &[PathBuf], settings: &[String]) -> Status {
    let mut verdict = Verdict::default();
    for path in decks {
        match load::scene(path, settings) {
            Ok(scene) => {
                say::line(&format!("{}: {}", path.display(), scene.title.as_deref().unwrap_or("(no title)")));
                if let Err(message) = tell(&scene) {
                    verdict.fail(Status::Wrong, "deck", message);
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
        let added = share.map_or(String::new(), |Share { instances, unknowns, entries, .. }| {
            format!(
                " ({instances} in the first stage, for which alone there are {unknowns} unknowns and {entries} entries)"
            )
        });
        say::line(&format!("  {mark} {:<width$}  {}{added}", reason.name, reason.reason));
    }
    size.map(|_| ())
}

fn tell_beams(mesh: &Mesh) {
    for beam in &mesh.beams {
        let count = beam.elements.len();
        say::line(&format!(
            "beam {}: length {}, {count} elements of order {}, {} nodes",
            beam.name,
            beam.line.length,
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

fn tell_section(section: &crate::scene::SectionMatrices, place: &str) {
    let k = section.stiffness;
    say::line(&format!(
        "  section{place}: EA {} GA [{}, {}] GJ {} EI [{}, {}]",
        k[0][0], k[1][1], k[2][2], k[3][3], k[4][4], k[5][5]
    ));
    let coupled = (0..6).any(|i| (0..i).any(|j| k[i][j] != 0.0));
    if coupled {
        say::line("  its stiffness couples");
    }
    if let Some(mass) = &section.mass {
        let j = mass.about_line.0;
        say::line(&format!(
            "  rhoA {} rhoJ [{}, {}, {}] mass centre {:?}",
            mass.mass, j[0][0], j[1][1], j[2][2], mass.offset.0
        ));
    }
}

/// Mass, centre and inertia about the centre, in the initial placement.
fn tell_mass(scene: &Scene) {
    let (mut mass, mut first, mut about_origin) = (0.0, Vec3::ZERO, Mat3::ZERO);
    let mut add = |m: f64, centre: Vec3, own: Mat3| {
        mass += m;
        first += centre * m;
        about_origin += own + (Mat3::diagonal([centre.squared(); 3]) - centre.outer(centre)) * m;
    };
    for beam in &scene.mesh.beams {
        for element in scene.mesh.elements_of(beam) {
            for station in element.stations(Rule::Volume) {
                let Some(section) = beam.section.at(station.fraction).mass else { continue };
                let inertia = section.turned(station.axes);
                let place = element.between(&station.shape);
                let d = inertia.offset;
                let about_line = inertia.about_node - (Mat3::diagonal([d.squared(); 3]) - d.outer(d)) * inertia.mass;
                add(inertia.mass * station.weight, place + d, about_line * station.weight);
            }
        }
    }
    for body in &scene.bodies {
        let d = body.inertia.offset;
        let own = body.inertia.about_node - (Mat3::diagonal([d.squared(); 3]) - d.outer(d)) * body.inertia.mass;
        add(body.inertia.mass, body.place + d, own);
    }
    if mass == 0.0 {
        return say::line("mass: none given");
    }
    let centre = first * (1.0 / mass);
    let inertia = about_origin - (Mat3::diagonal([centre.squared(); 3]) - centre.outer(centre)) * mass;
    say::line(&format!("mass {mass}, centre {:?}", centre.0));
    say::line(&format!("inertia about the centre {:?}", inertia.0));
}

/// Unknowns, entries of the tangent, memory, and what each effect adds to them; and whether the first stage can begin.
fn tell_size(scene: &Scene) -> Result<Vec<Share>, String> {
    let mut model = scene.plan.model.clone();
    let state = model.rest();
    let kind = scene.plan.stages[0].work.kind();
    let begun = model.begin_stage(0, kind, &state);
    let equations = begun.map_err(|error| format!("the first stage cannot begin: {error:?}"))?;
    let (free, slots) = (equations.count(), model.slots.len());
    let context = scene.plan.stages[0].context(0);
    let shares = model.shares(&context, &equations);
    let assembly = Assembly::new(&context, equations, &model);
    let entries = assembly.system.pattern.nonzeros();
    // The tangent and its factors, the places of its blocks, the state and its copies.
    let bytes = 2 * 8 * assembly.system.pattern.values() + 24 * 16 * slots;
    say::line(&format!(
        "{} nodes, {} elements, {free} free unknowns of {}, {entries} entries in the tangent, about {:.1} MB",
        scene.mesh.nodes.len(),
        scene.mesh.elements.len(),
        3 * slots,
        bytes as f64 / 1e6
    ));
    Ok(shares)
}
