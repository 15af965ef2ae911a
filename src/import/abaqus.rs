//! Beams of input files of Abaqus and CalculiX.

use super::keywords::{Block, blocks, label, numbers};
use super::lines::{ImportError, Lines, Word, shown};
use std::collections::{BTreeMap, BTreeSet};

/// Entries of generated sets, at most.
const MOST: u64 = 2_000_000;

/// A beam element.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamElement {
    /// Its nodes from start to end: two or three
    pub nodes: Vec<u64>,
    /// Line in the file, from 1
    pub line: usize,
}

/// The shape of a section, in its axes n1 and n2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// Radius
    Circle(f64),
    /// Widths along n1 and n2
    Ellipse([f64; 2]),
    /// Outer radius and thickness
    Pipe([f64; 2]),
    /// Widths along n1 and n2
    Rectangle([f64; 2]),
    /// Widths along n1 and n2, thickness of walls along n2 and along n1
    Box([f64; 4]),
    /// Height of the origin, height, widths of the flanges at the bottom and the top, their
    /// thicknesses, thickness of the web
    I([f64; 7]),
}

/// `*BEAM SECTION`
#[derive(Clone, Debug, PartialEq)]
pub struct BeamSection {
    /// Name of its set of elements, in capitals
    pub set: String,
    /// Name of its material, in capitals
    pub material: String,
    /// Shape
    pub profile: Profile,
    /// Direction of n1
    pub n1: [f64; 3],
    /// Line in the file, from 1
    pub line: usize,
}

/// An isotropic material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Elastic {
    /// Young's modulus and Poisson's ratio
    pub elastic: Option<[f64; 2]>,
    /// Density
    pub density: Option<f64>,
}

/// The first analysis of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Analysis {
    /// Of equilibrium, with large rotations or without
    Static {
        /// NLGEOM
        large: bool,
    },
    /// Of so many modes
    Modes(usize),
    /// Over time: end and step
    Dynamic([f64; 2]),
}

/// What is read of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Name of the file
    pub file: String,
    /// First line of `*HEADING`
    pub title: String,
    /// Places of nodes
    pub nodes: BTreeMap<u64, [f64; 3]>,
    /// Elements of beams
    pub elements: BTreeMap<u64, BeamElement>,
    /// Sets of elements
    pub element_sets: BTreeMap<String, BTreeSet<u64>>,
    /// Sets of nodes
    pub node_sets: BTreeMap<String, BTreeSet<u64>>,
    /// Materials
    pub materials: BTreeMap<String, Elastic>,
    /// Sections
    pub sections: Vec<BeamSection>,
    /// Directions (0 to 5) in which nodes are held
    pub held: BTreeMap<u64, BTreeSet<usize>>,
    /// Forces and moments at nodes
    pub loads: BTreeMap<u64, [f64; 6]>,
    /// Forces per length on sets of elements
    pub line_loads: Vec<(String, [f64; 3])>,
    /// Acceleration of gravity
    pub gravity: [f64; 3],
    /// The first analysis
    pub analysis: Option<Analysis>,
    /// What was not imported
    pub notes: Vec<String>,
}

/// Keywords that say nothing about the structure.
const SILENT: [&str; 24] = [
    "STEP",
    "ENDSTEP",
    "OUTPUT",
    "NODEOUTPUT",
    "ELEMENTOUTPUT",
    "NODEFILE",
    "ELFILE",
    "NODEPRINT",
    "ELPRINT",
    "PREPRINT",
    "RESTART",
    "PART",
    "ENDPART",
    "ASSEMBLY",
    "ENDASSEMBLY",
    "INSTANCE",
    "ENDINSTANCE",
    "MATERIAL",
    "HEADING",
    "ENERGYOUTPUT",
    "MONITOR",
    "CONTROLS",
    "SOLIDCONTROLS",
    "FILEFORMAT",
];

/// Reads an input file.
pub fn read_abaqus(name: &str, text: &str) -> Result<Model, ImportError> {
    let lines = Lines::new(name, text);
    let all = blocks(&lines)?;
    let mut reader = Reader { lines, model: Model { file: name.into(), ..Model::default() }, steps: 0, material: None };
    for block in &all {
        reader.block(block)?;
    }
    let Reader { lines, model, .. } = reader;
    if model.elements.is_empty() {
        return Err(lines.wrong("there are no beam elements (B21, B22, B31, B32, B33) in this file"));
    }
    Ok(model)
}

struct Reader<'t> {
    lines: Lines<'t>,
    model: Model,
    /// Number of the present step
    steps: usize,
    /// Name of the material to which properties belong
    material: Option<String>,
}

impl Reader<'_> {
    fn block(&mut self, block: &Block) -> Result<(), ImportError> {
        match block.name.as_str() {
            "NODE" => self.nodes(block),
            "ELEMENT" => self.elements(block),
            "NSET" | "ELSET" => self.set(block),
            "BEAMSECTION" => self.section(block),
            "ELASTIC" | "DENSITY" => self.property(block),
            "BOUNDARY" => self.boundary(block),
            "CLOAD" => self.loads(block),
            "DLOAD" => self.distributed(block),
            "STATIC" | "FREQUENCY" | "DYNAMIC" => self.analysis(block),
            "INCLUDE" => Err(self.lines.error(block.line, 1, "*INCLUDE is not imported: put the file in its place")),
            "INSTANCE" if !block.data.is_empty() => {
                Err(self.lines.error(block.data[0], 1, "an *INSTANCE that is moved or turned is not imported"))
            }
            "MATERIAL" => {
                let name = block.name_of(&self.lines, "NAME")?;
                self.model.materials.entry(name.clone()).or_default();
                self.material = Some(name);
                Ok(())
            }
            "STEP" => {
                self.steps += 1;
                if self.steps == 1 {
                    let large = block.has("NLGEOM")
                        && block.get("NLGEOM").is_none_or(|word| !word.text.eq_ignore_ascii_case("no"));
                    self.model.analysis = Some(Analysis::Static { large });
                } else {
                    self.note(block, "is not imported: only the first step is");
                }
                Ok(())
            }
            "HEADING" => {
                self.model.title = block.data.first().map_or("", |&line| self.lines.line(line)).trim().to_string();
                Ok(())
            }
            name if SILENT.contains(&name) => Ok(()),
            _ => {
                self.note(block, "is not imported");
                Ok(())
            }
        }
    }

    fn note(&mut self, block: &Block, why: &str) {
        let note = format!("line {}: *{} {why}", block.line + 1, block.name);
        self.model.notes.push(note);
    }

    /// True in what stands before the first step or in it.
    fn in_first_step(&mut self, block: &Block) -> bool {
        if self.steps > 1 {
            self.note(block, "is not imported: only the first step is");
        }
        self.steps <= 1
    }

    fn nodes(&mut self, block: &Block) -> Result<(), ImportError> {
        for &line in &block.data {
            let fields = self.lines.fields(line);
            let number = label(&self.lines, line, fields[0])?;
            let mut place = [0.0; 3];
            for (x, field) in place.iter_mut().zip(fields.iter().skip(1)) {
                *x = if field.text.is_empty() { 0.0 } else { self.lines.number_of(line, *field)? };
            }
            self.model.nodes.insert(number, place);
            if let Some(set) = block.get("NSET") {
                self.model.node_sets.entry(set.text.to_uppercase()).or_default().insert(number);
            }
        }
        Ok(())
    }

    fn elements(&mut self, block: &Block) -> Result<(), ImportError> {
        let kind = block.name_of(&self.lines, "TYPE")?;
        let count = match kind.as_str() {
            "B21" | "B21H" | "B23" | "B23H" | "B31" | "B31H" | "B31R" | "B33" | "B33H" => 2,
            "B22" | "B22H" | "B32" | "B32H" | "B32R" => 3,
            _ => {
                self.note(block, &format!("of type {} is not imported", shown(&kind)));
                return Ok(());
            }
        };
        for &line in &block.data {
            let fields = self.lines.fields(line);
            if fields.len() <= count {
                let message = format!("an element of type {kind} has a number and {count} nodes");
                return Err(self.lines.error(line, 1, message));
            }
            let labels: Vec<u64> =
                fields[..=count].iter().map(|word| label(&self.lines, line, *word)).collect::<Result<_, _>>()?;
            if let Some(k) = (1..=count).find(|&k| !self.model.nodes.contains_key(&labels[k])) {
                let message = format!("there is no node {} above this line", labels[k]);
                return Err(self.lines.error(line, fields[k].column, message));
            }
            self.model.elements.insert(labels[0], BeamElement { nodes: labels[1..].to_vec(), line: line + 1 });
            if let Some(set) = block.get("ELSET") {
                self.model.element_sets.entry(set.text.to_uppercase()).or_default().insert(labels[0]);
            }
        }
        Ok(())
    }

    fn set(&mut self, block: &Block) -> Result<(), ImportError> {
        let name = block.name_of(&self.lines, &block.name)?;
        let mut members = BTreeSet::new();
        for &line in &block.data {
            let fields = self.lines.fields(line);
            if block.has("GENERATE") {
                let of = |k: usize| fields.get(k).map(|word| label(&self.lines, line, *word)).transpose();
                let (Some(from), Some(to)) = (of(0)?, of(1)?) else {
                    return Err(self.lines.error(line, 1, "GENERATE needs first, last and step"));
                };
                if to.saturating_sub(from) > MOST {
                    return Err(self.lines.error(line, 1, format!("more than {MOST} entries")));
                }
                members.extend((from..=to).step_by(of(2)?.unwrap_or(1) as usize));
                continue;
            }
            for field in fields.into_iter().filter(|field| !field.text.is_empty()) {
                members.extend(self.members(&block.name, line, field)?);
            }
        }
        let sets = if block.name == "NSET" { &mut self.model.node_sets } else { &mut self.model.element_sets };
        sets.entry(name).or_default().extend(members);
        Ok(())
    }

    /// A number, or those of a set of nodes (`NSET`) or elements.
    fn members(&self, kind: &str, line: usize, word: Word) -> Result<BTreeSet<u64>, ImportError> {
        let sets = if kind == "NSET" { &self.model.node_sets } else { &self.model.element_sets };
        // A set of a part or an instance: `beam-1.tip`.
        let name = word.text.rsplit('.').next().unwrap_or(word.text).trim_matches('"').to_uppercase();
        if let Some(set) = sets.get(&name) {
            return Ok(set.clone());
        }
        if word.text.parse::<u64>().is_ok() {
            return Ok(BTreeSet::from([label(&self.lines, line, word)?]));
        }
        Err(self.lines.error(line, word.column, format!("there is no set `{}` above this line", shown(word.text))))
    }

    fn section(&mut self, block: &Block) -> Result<(), ImportError> {
        let shape = block.name_of(&self.lines, "SECTION")?;
        let &[line, ref rest @ ..] = &block.data[..] else {
            return Err(self.lines.error(block.line, 1, "*BEAM SECTION needs a line of dimensions"));
        };
        let found = numbers(&self.lines, line)?;
        let wrong = |message: &str| self.lines.error(line, 1, message);
        if found.iter().any(|size| *size < 0.0) {
            return Err(wrong("a dimension is negative"));
        }
        let profile = match (shape.as_str(), &found[..]) {
            // One number is the radius (Abaqus); two are the widths (CalculiX).
            ("CIRC", &[radius]) => Profile::Circle(radius),
            ("CIRC", &[a, b, ..]) if a == b => Profile::Circle(0.5 * a),
            ("CIRC", &[a, b, ..]) => Profile::Ellipse([a, b]),
            ("PIPE", &[radius, thickness, ..]) => Profile::Pipe([radius, thickness]),
            ("RECT", &[a, b, ..]) => Profile::Rectangle([a, b]),
            ("BOX", &[a, b, t1, t2, t3, t4, ..]) if t1 == t3 && t2 == t4 => Profile::Box([a, b, t1, t2]),
            ("BOX", &[_, _, _, _, _, _, ..]) => {
                return Err(wrong("a BOX whose opposite walls differ in thickness is not imported"));
            }
            ("I", &[l, h, b1, b2, t1, t2, t3, ..]) => Profile::I([l, h, b1, b2, t1, t2, t3]),
            ("CIRC" | "PIPE" | "RECT" | "BOX" | "I", _) => {
                return Err(wrong(&format!("too few dimensions of SECTION={shape}")));
            }
            _ => {
                let message =
                    format!("SECTION={} is not imported: known are CIRC, PIPE, RECT, BOX and I", shown(&shape));
                return Err(self.lines.error(block.line, 1, message));
            }
        };
        let n1 = match rest.first() {
            Some(&line) => match numbers(&self.lines, line)?[..] {
                [x, y, z, ..] => [x, y, z],
                _ => return Err(self.lines.error(line, 1, "expected the three components of the direction n1")),
            },
            None => [0.0, 0.0, -1.0],
        };
        if n1 == [0.0; 3] {
            return Err(self.lines.error(rest[0], 1, "the direction n1 is zero"));
        }
        let set = block.name_of(&self.lines, "ELSET")?;
        let material = block.name_of(&self.lines, "MATERIAL")?;
        self.model.sections.push(BeamSection { set, material, profile, n1, line: block.line + 1 });
        Ok(())
    }

    fn property(&mut self, block: &Block) -> Result<(), ImportError> {
        let Some(name) = self.material.clone() else {
            return Err(self.lines.error(block.line, 1, format!("*{} belongs to no *MATERIAL", block.name)));
        };
        let Some(&line) = block.data.first() else {
            return Err(self.lines.error(block.line, 1, format!("*{} needs a line of numbers", block.name)));
        };
        let found = numbers(&self.lines, line)?;
        let material = self.model.materials.entry(name).or_default();
        match (block.name.as_str(), &found[..]) {
            ("ELASTIC", _) if block.get("TYPE").is_some_and(|word| !word.text.to_uppercase().starts_with("ISO")) => {
                Err(self.lines.error(block.line, 1, "only isotropic elasticity is imported"))
            }
            ("ELASTIC", &[young, poisson, ..]) => {
                material.elastic = Some([young, poisson]);
                Ok(())
            }
            ("DENSITY", &[density, ..]) => {
                material.density = Some(density);
                Ok(())
            }
            _ => Err(self.lines.error(line, 1, "too few numbers")),
        }
    }

    fn boundary(&mut self, block: &Block) -> Result<(), ImportError> {
        if !self.in_first_step(block) {
            return Ok(());
        }
        for &line in &block.data {
            let fields = self.lines.fields(line);
            let nodes = self.members("NSET", line, fields[0])?;
            let Some(first) = fields.get(1) else {
                return Err(self.lines.error(line, 1, "expected a node, and the directions that are held"));
            };
            let range = match first.text.to_uppercase().as_str() {
                "ENCASTRE" => 0..=5,
                "PINNED" => 0..=2,
                _ => {
                    let from = self.direction(line, *first)?;
                    let last = fields.get(2).filter(|word| !word.text.is_empty());
                    from..=last.map_or(Ok(from), |word| self.direction(line, *word))?
                }
            };
            let value = fields.get(3).map_or(Ok(0.0), |word| self.lines.number_of(line, *word))?;
            if value != 0.0 {
                let note = format!("line {}: a prescribed displacement is not imported: it is zero", line + 1);
                self.model.notes.push(note);
            }
            for node in nodes {
                self.model.held.entry(node).or_default().extend(range.clone());
            }
        }
        Ok(())
    }

    /// A direction 1 to 6, from 0.
    fn direction(&self, line: usize, word: Word) -> Result<usize, ImportError> {
        match word.text.parse::<usize>() {
            Ok(direction) if (1..=6).contains(&direction) => Ok(direction - 1),
            Ok(_) | Err(_) => {
                let message = format!("expected a direction from 1 to 6, found `{}`", shown(word.text));
                Err(self.lines.error(line, word.column, message))
            }
        }
    }

    fn loads(&mut self, block: &Block) -> Result<(), ImportError> {
        if !self.in_first_step(block) {
            return Ok(());
        }
        for &line in &block.data {
            let fields = self.lines.fields(line);
            let &[at, direction, value, ..] = &fields[..] else {
                return Err(self.lines.error(line, 1, "expected a node, a direction and a force"));
            };
            let direction = self.direction(line, direction)?;
            let value = self.lines.number_of(line, value)?;
            for node in self.members("NSET", line, at)? {
                self.model.loads.entry(node).or_default()[direction] += value;
            }
        }
        Ok(())
    }

    fn distributed(&mut self, block: &Block) -> Result<(), ImportError> {
        if !self.in_first_step(block) {
            return Ok(());
        }
        for &line in &block.data {
            let fields = self.lines.fields(line);
            let &[set, kind, value, ref rest @ ..] = &fields[..] else {
                return Err(self.lines.error(line, 1, "expected elements, a kind of load and its value"));
            };
            let value = self.lines.number_of(line, value)?;
            let axis = ["PX", "PY", "PZ"].iter().position(|known| kind.text.eq_ignore_ascii_case(known));
            if let Some(axis) = axis {
                let mut force = [0.0; 3];
                force[axis] = value;
                let name = set.text.rsplit('.').next().unwrap_or(set.text).to_uppercase();
                if !self.model.element_sets.contains_key(&name) {
                    return Err(self.lines.error(line, set.column, "a line load needs the name of a set of elements"));
                }
                self.model.line_loads.push((name, force));
            } else if kind.text.eq_ignore_ascii_case("GRAV") && rest.len() >= 3 {
                for (k, word) in rest.iter().take(3).enumerate() {
                    self.model.gravity[k] = value * self.lines.number_of(line, *word)?;
                }
            } else {
                let note = format!("line {}: the load {} is not imported", line + 1, shown(kind.text));
                self.model.notes.push(note);
            }
        }
        Ok(())
    }

    fn analysis(&mut self, block: &Block) -> Result<(), ImportError> {
        if !self.in_first_step(block) || block.name == "STATIC" {
            return Ok(());
        }
        let found = block.data.first().map_or(Ok(Vec::new()), |&line| numbers(&self.lines, line))?;
        let wrong = |message: &str| Err(self.lines.error(block.line, 1, message));
        self.model.analysis = Some(match (block.name.as_str(), &found[..]) {
            ("FREQUENCY", &[count, ..]) if count >= 1.0 => Analysis::Modes(count.min(1e4) as usize),
            ("FREQUENCY", _) => Analysis::Modes(10),
            ("DYNAMIC", &[step, end, ..]) if step > 0.0 && end > 0.0 => Analysis::Dynamic([end, step]),
            _ => return wrong("*DYNAMIC needs a line with its time step and its end"),
        });
        Ok(())
    }
}
