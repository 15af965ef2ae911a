//! The deck of beams of Abaqus or CalculiX.

use super::abaqus_model::{Analysis, BeamSection, Model, NodeLoad, Profile};
use super::deck_text::{Imported, comment, list, number, quoted};
use super::lines::ImportError;
use beamsim_core::tensor::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Sine of the angle between two elements of one straight beam, at most.
const STRAIGHT: f64 = 1e-6;

/// Nodes in one note, at most.
const MOST_SHOWN: usize = 10;

/// Words of the six directions of supports.
const DIRECTIONS: [&str; 6] = ["ux", "uy", "uz", "rx", "ry", "rz"];

/// Directions in which nodes of planar elements do not move: uz, rx, ry.
const OUT_OF_PLANE: [usize; 3] = [2, 3, 4];

/// A straight run of elements with one section and the same line load.
struct Run {
    name: String,
    nodes: Vec<u64>,
    /// Force per length
    line_load: [f64; 3],
    /// The order of its elements
    order: usize,
    /// Local axis 3: n2
    axis3: [f64; 3],
}

/// The names in a deck that follow from names in a model.
struct Names<'m> {
    materials: BTreeMap<&'m str, String>,
    sections: BTreeSet<String>,
    /// Names of beams and points
    places: BTreeSet<String>,
}

impl<'m> Names<'m> {
    fn new(model: &'m Model) -> Self {
        let mut taken = BTreeSet::new();
        let used: BTreeSet<&str> = model.sections.iter().map(|section| section.material.as_str()).collect();
        let materials = used.into_iter().map(|name| (name, unique(&plain(name), &mut taken))).collect();
        let places = model.nodes.keys().map(|node| format!("n{node}")).collect();
        Self { materials, sections: BTreeSet::new(), places }
    }
}

/// The deck of a model: a beam for each straight run of elements with one section and the same line
/// load.
pub fn abaqus_deck(model: &Model) -> Result<Imported, ImportError> {
    refuse_elements_without_one_section(model)?;
    let mut names = Names::new(model);
    let mut all: Vec<Run> = Vec::new();
    let mut beams = String::new();
    let mut sections = String::new();
    for section in &model.sections {
        let name = unique(&plain(&section.set), &mut names.sections);
        write_section(&mut sections, model, section, &name, &names)?;
        for run in runs(model, section, &mut names.places)? {
            write_beam(&mut beams, &run, &name);
            all.push(run);
        }
    }
    let used: BTreeSet<u64> = all.iter().flat_map(|run| run.nodes.iter().copied()).collect();
    let notes: Vec<String> = model.notes.iter().cloned().chain(away_from_beams(model, &used)).collect();
    let mut text = String::new();
    head(&mut text, model, &notes);
    text += "[point]\n";
    for (node, place) in model.nodes.iter().filter(|(node, _)| used.contains(node)) {
        let _ = writeln!(text, "n{node} = {}", list(place));
    }
    text += "\n";
    write_materials(&mut text, model, &names)?;
    text += &sections;
    text += &beams;
    write_supports(&mut text, model, &used);
    write_loads(&mut text, model, &used, &all);
    write_stage(&mut text, model);
    Ok(Imported { deck: text, notes })
}

/// Each element must be in the set of exactly one section.
fn refuse_elements_without_one_section(model: &Model) -> Result<(), ImportError> {
    let mut lines: BTreeMap<u64, usize> = BTreeMap::new();
    for section in &model.sections {
        let Some(set) = model.element_sets.get(&section.set) else {
            return Err(wrong(model, section.line, format!("there is no set of elements {}", section.set)));
        };
        for &number in set {
            let Some(before) = lines.insert(number, section.line).filter(|_| model.elements.contains_key(&number))
            else {
                continue;
            };
            let message = format!("element {number} has a *BEAM SECTION already, at line {before}");
            return Err(wrong(model, section.line, message));
        }
    }
    match model.elements.iter().find(|(number, _)| !lines.contains_key(number)) {
        Some((number, element)) => Err(wrong(model, element.line, format!("element {number} has no *BEAM SECTION"))),
        None => Ok(()),
    }
}

/// Notes of supports and loads at nodes that belong to no beam.
fn away_from_beams(model: &Model, used: &BTreeSet<u64>) -> Vec<String> {
    let supports = model.held.iter().map(|(node, held)| (held.line, "*BOUNDARY", node));
    let loads = model.loads.iter().map(|(node, load)| (load.line, "*CLOAD", node));
    let mut found: BTreeMap<(usize, &str), Vec<String>> = BTreeMap::new();
    for (line, keyword, node) in supports.chain(loads).filter(|(_, _, node)| !used.contains(node)) {
        found.entry((line, keyword)).or_default().push(node.to_string());
    }
    let note = |((line, keyword), nodes): (&(usize, &str), &Vec<String>)| {
        let shown = nodes.iter().take(MOST_SHOWN).cloned().collect::<Vec<_>>().join(", ");
        let more =
            if nodes.len() > MOST_SHOWN { format!(" and {} more", nodes.len() - MOST_SHOWN) } else { String::new() };
        format!("line {line}: {keyword} is not imported at nodes that belong to no beam: {shown}{more}")
    };
    found.iter().map(note).collect()
}

fn wrong(model: &Model, line: usize, message: impl Into<String>) -> ImportError {
    ImportError { file: model.file.clone(), at: Some([line, 1]), message: message.into() }
}

fn head(text: &mut String, model: &Model, notes: &[String]) {
    let _ = writeln!(text, "#:schema beamsim.schema.json");
    let _ = writeln!(text, "# From {}", comment(&model.file));
    *text += "#\n# Local axes 2 and 3 are n1 and n2. Node 12 is the point n12; straight runs of elements are beams.\n";
    for note in notes {
        let _ = writeln!(text, "# {}", comment(note));
    }
    let _ = writeln!(text, "title = {}", quoted(&model.title));
    if let Some(gravity) = model.gravity {
        let _ = writeln!(text, "gravity = {}", list(&gravity));
    }
    *text += "\n";
}

/// A name as a deck can have it.
fn plain(name: &str) -> String {
    let kept: String = name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    let is_word = kept.starts_with(|c: char| c.is_ascii_alphabetic());
    if is_word { kept.to_lowercase() } else { format!("s{}", kept.to_lowercase()) }
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
fn runs(model: &Model, section: &BeamSection, names: &mut BTreeSet<String>) -> Result<Vec<Run>, ImportError> {
    let set = model.element_sets.get(&section.set).into_iter().flatten();
    let own: Vec<u64> = set.copied().filter(|number| model.elements.contains_key(number)).collect();
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
        let is_alike = model.elements[after].nodes.len() == model.elements[&number].nodes.len()
            && line_load(model, *after) == line_load(model, number);
        if is_alike && is_straight(model, start, end, ends(*after)[1]) {
            next.insert(number, *after);
        }
    }
    let followers: BTreeSet<u64> = next.values().copied().collect();
    let heads: Vec<u64> = own.iter().copied().filter(|number| !followers.contains(number)).collect();
    let name = plain(&section.set);
    let run = |(k, &head): (usize, &u64)| {
        let order = model.elements[&head].nodes.len() - 1;
        let mut nodes = model.elements[&head].nodes.clone();
        let mut at = head;
        while let Some(&after) = next.get(&at) {
            nodes.extend(&model.elements[&after].nodes[1..]);
            at = after;
        }
        let name = unique(&if heads.len() == 1 { name.clone() } else { format!("{name}_{}", k + 1) }, names);
        Ok(Run { axis3: axis3(model, section, &nodes)?, name, nodes, line_load: line_load(model, head), order })
    };
    heads.iter().enumerate().map(run).collect()
}

fn line_load(model: &Model, element: u64) -> [f64; 3] {
    model.line_loads.get(&element).copied().unwrap_or_default()
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

fn write_section(
    text: &mut String,
    model: &Model,
    section: &BeamSection,
    name: &str,
    names: &Names,
) -> Result<(), ImportError> {
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
    let _ = writeln!(text, "[section.{name}] # {}, line {}", comment(&model.file), section.line);
    let _ = writeln!(text, "material = \"{}\"\nshape = \"{}\"", names.materials[section.material.as_str()], keys[0].0);
    for (key, value) in &keys[1..] {
        let _ = writeln!(text, "{key} = {}", number(*value));
    }
    if let Profile::I([origin, height, ..]) = section.profile {
        let _ = writeln!(text, "reference = [0, {}]", number(origin - 0.5 * height));
    }
    *text += "\n";
    Ok(())
}

fn write_materials(text: &mut String, model: &Model, names: &Names) -> Result<(), ImportError> {
    let used: BTreeMap<&str, &BeamSection> =
        model.sections.iter().map(|section| (section.material.as_str(), section)).collect();
    for (name, section) in used {
        let material = model.materials.get(name).copied().unwrap_or_default();
        let Some([young, poisson]) = material.elastic else {
            return Err(wrong(model, section.line, format!("the material {name} has no *ELASTIC")));
        };
        let _ = writeln!(text, "[material.{}]\nE = {}\nnu = {}", names.materials[name], number(young), number(poisson));
        if let Some(density) = material.density {
            let _ = writeln!(text, "rho = {}", number(density));
        }
        *text += "\n";
    }
    Ok(())
}

fn write_supports(text: &mut String, model: &Model, used: &BTreeSet<u64>) {
    let mut all: BTreeMap<u64, BTreeSet<usize>> = BTreeMap::new();
    for (node, held) in model.held.iter().filter(|(node, _)| used.contains(node)) {
        all.entry(*node).or_default().extend(&held.directions);
    }
    for element in model.elements.values().filter(|element| element.is_planar) {
        for node in &element.nodes {
            all.entry(*node).or_default().extend(OUT_OF_PLANE);
        }
    }
    for (node, held) in all {
        let words: Vec<String> = held.iter().map(|&k| format!("\"{}\"", DIRECTIONS[k])).collect();
        let fix = if held.len() == 6 { "\"all\"".into() } else { format!("[{}]", words.join(", ")) };
        let _ = writeln!(text, "[[support]]\nat = \"n{node}\"\nfix = {fix}\n");
    }
}

fn write_loads(text: &mut String, model: &Model, used: &BTreeSet<u64>, runs: &[Run]) {
    let is_load = |load: &NodeLoad| load.vector != [0.0; 6];
    for (node, load) in model.loads.iter().filter(|(node, load)| used.contains(node) && is_load(load)) {
        let _ = writeln!(text, "[[load]]\nat = \"n{node}\"");
        for (name, vector) in [("force", &load.vector[..3]), ("moment", &load.vector[3..])] {
            if vector.iter().any(|&x| x != 0.0) {
                let _ = writeln!(text, "{name} = {}", list(vector));
            }
        }
        *text += "\n";
    }
    for run in runs.iter().filter(|run| run.line_load != [0.0; 3]) {
        let _ = writeln!(text, "[[load]]\nalong = \"{}\"\nforce = {}\n", run.name, list(&run.line_load));
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
