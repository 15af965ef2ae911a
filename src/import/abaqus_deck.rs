//! The deck of beams of Abaqus or CalculiX.

use super::abaqus::{Analysis, BeamSection, Model, Profile};
use super::deck_text::{Imported, list, number, quoted};
use super::lines::ImportError;
use beamsim_core::tensor::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Sine of the angle between two elements of one straight beam, at most.
const STRAIGHT: f64 = 1e-6;

/// Words of the six directions of supports.
const DIRECTIONS: [&str; 6] = ["ux", "uy", "uz", "rx", "ry", "rz"];

/// A straight run of elements with one section.
struct Run {
    name: String,
    nodes: Vec<u64>,
    /// The order of its elements
    order: usize,
    /// Local axis 3: n2
    axis3: [f64; 3],
}

/// The deck of a model: a beam for each straight run of elements with one section.
pub fn abaqus_deck(model: &Model) -> Result<Imported, ImportError> {
    let mut text = String::new();
    head(&mut text, model);
    let mut used: BTreeSet<u64> = BTreeSet::new();
    let mut names: BTreeSet<String> = BTreeSet::new();
    let mut beams = String::new();
    let mut sections = String::new();
    let mut of_set: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for section in &model.sections {
        let name = unique(&plain(&section.set), &mut names);
        write_section(&mut sections, model, section, &name)?;
        for run in runs(model, section, &name)? {
            used.extend(&run.nodes);
            write_beam(&mut beams, &run, &name);
            of_set.entry(&section.set).or_default().push(run.name);
        }
    }
    if let Some(element) = model.elements.values().find(|element| !used.contains(&element.nodes[0])) {
        return Err(wrong(model, element.line, "this element has no *BEAM SECTION"));
    }
    text += "[point]\n";
    for (node, place) in model.nodes.iter().filter(|(node, _)| used.contains(node)) {
        let _ = writeln!(text, "n{node} = {}", list(place));
    }
    text += "\n";
    write_materials(&mut text, model)?;
    text += &sections;
    text += &beams;
    write_supports(&mut text, model, &used);
    write_loads(&mut text, model, &used, &of_set);
    write_stage(&mut text, model);
    Ok(Imported { deck: text, notes: model.notes.clone() })
}

fn wrong(model: &Model, line: usize, message: impl Into<String>) -> ImportError {
    ImportError { file: model.file.clone(), at: Some([line, 1]), message: message.into() }
}

fn head(text: &mut String, model: &Model) {
    let _ = writeln!(text, "#:schema beamsim.schema.json");
    let _ = writeln!(text, "# From {}", model.file);
    *text += "#\n# Local axes 2 and 3 are n1 and n2. Node 12 is the point n12; straight runs of elements are beams.\n";
    for note in &model.notes {
        let _ = writeln!(text, "# Not imported: {note}");
    }
    let _ = writeln!(text, "title = {}", quoted(&model.title));
    if model.gravity != [0.0; 3] {
        let _ = writeln!(text, "gravity = {}", list(&model.gravity));
    }
    *text += "\n";
}

/// A name as a deck can have it.
fn plain(name: &str) -> String {
    let kept: String = name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    kept.to_lowercase()
}

fn unique(name: &str, names: &mut BTreeSet<String>) -> String {
    let mut found = name.to_string();
    let mut number = 2;
    while !names.insert(found.clone()) {
        found = format!("{name}_{number}");
        number += 1;
    }
    found
}

/// The straight runs of the elements of a section, in the order of the elements.
fn runs(model: &Model, section: &BeamSection, name: &str) -> Result<Vec<Run>, ImportError> {
    let Some(set) = model.element_sets.get(&section.set) else {
        return Err(wrong(model, section.line, format!("there is no set of elements {}", section.set)));
    };
    let own: Vec<u64> = set.iter().copied().filter(|number| model.elements.contains_key(number)).collect();
    let ends = |number: u64| {
        let nodes = &model.elements[&number].nodes;
        [nodes[0], nodes[nodes.len() - 1]]
    };
    let mut starting: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
    let mut ending: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
    for &number in &own {
        let [start, end] = ends(number);
        starting.entry(start).or_default().push(number);
        ending.entry(end).or_default().push(number);
    }
    let mut next: BTreeMap<u64, u64> = BTreeMap::new();
    for &number in &own {
        let [start, end] = ends(number);
        let nodes = &model.elements[&number].nodes;
        if nodes.windows(2).any(|pair| direction(model, pair[0], pair[1]).is_none()) {
            return Err(wrong(model, model.elements[&number].line, "this element has no length"));
        }
        let [Some([after]), Some([_])] = [starting.get(&end), ending.get(&end)].map(|list| list.map(Vec::as_slice))
        else {
            continue;
        };
        let orders_alike = model.elements[after].nodes.len() == model.elements[&number].nodes.len();
        if orders_alike && is_straight(model, start, end, ends(*after)[1]) {
            next.insert(number, *after);
        }
    }
    let followers: BTreeSet<u64> = next.values().copied().collect();
    let heads: Vec<u64> = own.iter().copied().filter(|number| !followers.contains(number)).collect();
    let run = |(k, &head): (usize, &u64)| {
        let order = model.elements[&head].nodes.len() - 1;
        let mut nodes = model.elements[&head].nodes.clone();
        let mut at = head;
        while let Some(&after) = next.get(&at) {
            nodes.extend(&model.elements[&after].nodes[1..]);
            at = after;
        }
        let name = if heads.len() == 1 { name.to_string() } else { format!("{name}_{}", k + 1) };
        Ok(Run { axis3: axis3(model, section, &nodes)?, name, nodes, order })
    };
    heads.iter().enumerate().map(run).collect()
}

fn place(model: &Model, node: u64) -> Vec3 {
    Vec3(model.nodes[&node])
}

fn direction(model: &Model, from: u64, to: u64) -> Option<Vec3> {
    (place(model, to) - place(model, from)).normalized()
}

fn is_straight(model: &Model, a: u64, b: u64, c: u64) -> bool {
    let both = direction(model, a, b).zip(direction(model, b, c));
    both.is_some_and(|(first, second)| first.cross(second).norm() < STRAIGHT && first.dot(second) > 0.0)
}

/// n2 = t x n1
fn axis3(model: &Model, section: &BeamSection, nodes: &[u64]) -> Result<[f64; 3], ImportError> {
    let tangent = direction(model, nodes[0], nodes[nodes.len() - 1]).unwrap_or(Vec3::UNIT[0]);
    let n1 = Vec3(section.n1);
    let n2 = tangent.cross(n1);
    match n2.normalized() {
        Some(axis) if n2.norm() > STRAIGHT * n1.norm() => Ok(axis.0),
        _ => {
            let message = format!("n1 = {:?} is parallel to the element at node {}", section.n1, nodes[0]);
            Err(wrong(model, section.line, message))
        }
    }
}

fn write_beam(text: &mut String, run: &Run, section: &str) {
    let _ = writeln!(text, "[[beam]]\nname = \"{}\"\nsection = \"{section}\"", run.name);
    let points: Vec<String> = run.nodes.iter().map(|node| format!("\"n{node}\"")).collect();
    let _ = writeln!(text, "through = [{}]\nelements = 1\norder = {}", points.join(", "), run.order);
    let _ = writeln!(text, "axis3 = {}\n", list(&run.axis3));
}

fn write_section(text: &mut String, model: &Model, section: &BeamSection, name: &str) -> Result<(), ImportError> {
    if !model.materials.contains_key(&section.material) {
        return Err(wrong(model, section.line, format!("there is no *MATERIAL {}", section.material)));
    }
    let keys: Vec<(&str, f64)> = match section.profile {
        Profile::Circle(radius) => vec![("circle", 0.0), ("radius", radius)],
        Profile::Ellipse([a, b]) => vec![("ellipse", 0.0), ("width", a), ("height", b)],
        Profile::Pipe([radius, thickness]) => vec![("tube", 0.0), ("radius", radius), ("thickness", thickness)],
        Profile::Rectangle([a, b]) => vec![("rectangle", 0.0), ("width", a), ("height", b)],
        Profile::Box([a, b, along_2, along_1]) => {
            vec![("box", 0.0), ("b", a), ("d", b), ("t_w", along_2), ("t_f", along_1)]
        }
        Profile::I([_, height, bottom, top, t_bottom, t_top, web]) => {
            let mut keys = vec![("I", 0.0), ("d", height), ("b", bottom), ("t_f", t_bottom), ("t_w", web)];
            if bottom != top || t_bottom != t_top {
                keys.extend([("b_top", top), ("t_f_top", t_top)]);
            }
            keys
        }
    };
    let _ = writeln!(text, "[section.{name}] # {}, line {}", model.file, section.line);
    let _ = writeln!(text, "material = \"{}\"\nshape = \"{}\"", plain(&section.material), keys[0].0);
    for (key, value) in &keys[1..] {
        let _ = writeln!(text, "{key} = {}", number(*value));
    }
    if let Profile::I([origin, height, ..]) = section.profile {
        let _ = writeln!(text, "reference = [0, {}]", number(origin - 0.5 * height));
    }
    *text += "\n";
    Ok(())
}

fn write_materials(text: &mut String, model: &Model) -> Result<(), ImportError> {
    let used: BTreeMap<&str, &BeamSection> =
        model.sections.iter().map(|section| (section.material.as_str(), section)).collect();
    for (name, section) in used {
        let material = model.materials.get(name).copied().unwrap_or_default();
        let Some([young, poisson]) = material.elastic else {
            return Err(wrong(model, section.line, format!("the material {name} has no *ELASTIC")));
        };
        let _ = writeln!(text, "[material.{}]\nE = {}\nnu = {}", plain(name), number(young), number(poisson));
        if let Some(density) = material.density {
            let _ = writeln!(text, "rho = {}", number(density));
        }
        *text += "\n";
    }
    Ok(())
}

fn write_supports(text: &mut String, model: &Model, used: &BTreeSet<u64>) {
    for (node, held) in model.held.iter().filter(|(node, _)| used.contains(node)) {
        let words: Vec<String> = held.iter().map(|&k| format!("\"{}\"", DIRECTIONS[k])).collect();
        let fix = if held.len() == 6 { "\"all\"".into() } else { format!("[{}]", words.join(", ")) };
        let _ = writeln!(text, "[[support]]\nat = \"n{node}\"\nfix = {fix}\n");
    }
}

fn write_loads(text: &mut String, model: &Model, used: &BTreeSet<u64>, of_set: &BTreeMap<&str, Vec<String>>) {
    for (node, load) in model.loads.iter().filter(|(node, _)| used.contains(node)) {
        let _ = writeln!(text, "[[load]]\nat = \"n{node}\"");
        for (name, vector) in [("force", &load[..3]), ("moment", &load[3..])] {
            if vector.iter().any(|&x| x != 0.0) {
                let _ = writeln!(text, "{name} = {}", list(vector));
            }
        }
        *text += "\n";
    }
    for (set, force) in &model.line_loads {
        for beam in of_set.get(set.as_str()).into_iter().flatten() {
            let _ = writeln!(text, "[[load]]\nalong = \"{beam}\"\nforce = {}\n", list(force));
        }
    }
}

fn write_stage(text: &mut String, model: &Model) {
    *text += "[[stage]]\n";
    let _ = match model.analysis.unwrap_or(Analysis::Static { large: false }) {
        Analysis::Static { large: true } => writeln!(text, "kind = \"static\"\nsteps = 10"),
        Analysis::Static { large: false } => {
            writeln!(text, "kind = \"static\"\nsteps = 1\n\n[effects]\nlarge_rotations = false")
        }
        Analysis::Modes(count) => writeln!(text, "kind = \"modal\"\nmodes = {count}"),
        Analysis::Dynamic([end, step]) => {
            writeln!(text, "kind = \"dynamic\"\nend = {}\nstep = {}", number(end), number(step))
        }
    };
}
