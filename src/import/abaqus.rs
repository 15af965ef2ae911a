//! Readers of the keywords of Abaqus and CalculiX that describe beams.

use super::abaqus_model::{Analysis, BeamElement, BeamSection, Elastic, Model, Profile};
use super::keywords::{Block, blocks, label, numbers, set_name};
use super::lines::{ImportError, Lines, Word, shown};
use super::parameters::unread_parameters;
use beamsim_core::tensor::Vec3;
use std::collections::{BTreeMap, BTreeSet};

/// Entries of generated sets, at most.
const MOST: u64 = 2_000_000;

/// Keywords that say nothing about the structure.
const SILENT: [&str; 18] = [
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
    "ENDPART",
    "ENDASSEMBLY",
    "ENDINSTANCE",
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
    let mut reader = Reader {
        lines,
        model: Model { file: name.into(), ..Model::default() },
        steps: 0,
        material: None,
        parts: BTreeSet::new(),
        is_assembly: false,
        scopes: BTreeMap::new(),
    };
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
    /// PART and INSTANCE, once they have been
    parts: BTreeSet<String>,
    /// True after `*ASSEMBLY`
    is_assembly: bool,
    /// True for a set of the assembly, by its keyword and its name
    scopes: BTreeMap<(String, String), bool>,
}

impl Reader<'_> {
    fn block(&mut self, block: &Block) -> Result<(), ImportError> {
        let notes = unread_parameters(&self.lines, block)?;
        self.model.notes.extend(notes);
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
            "PART" | "INSTANCE" => self.part(block),
            "ASSEMBLY" => {
                self.is_assembly = true;
                Ok(())
            }
            "MATERIAL" => {
                let name = block.name_of(&self.lines, "NAME")?;
                if self.model.materials.insert(name.clone(), Elastic::default()).is_some() {
                    return Err(self.lines.error(block.line, 1, format!("the material {name} is given twice")));
                }
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
        let note = format!("line {}: *{} {why}", block.line + 1, shown(&block.name));
        self.model.notes.push(note);
    }

    /// True in what stands before the first step or in it.
    fn in_first_step(&mut self, block: &Block) -> bool {
        if self.steps > 1 {
            self.note(block, "is not imported: only the first step is");
        }
        self.steps <= 1
    }

    /// Numbers of nodes and elements are those of one part that stands once, where it was drawn.
    fn part(&mut self, block: &Block) -> Result<(), ImportError> {
        if !self.parts.insert(block.name.clone()) {
            let message = format!("a second *{} is not imported: numbers of nodes would mean two things", block.name);
            return Err(self.lines.error(block.line, 1, message));
        }
        match block.data.first() {
            Some(&line) if block.name == "INSTANCE" => {
                Err(self.lines.error(line, 1, "an *INSTANCE that is moved or turned is not imported"))
            }
            Some(_) | None => Ok(()),
        }
    }

    /// Refuses a set of the assembly with the name of a set of the part.
    fn enter_set(&mut self, block: &Block, kind: &str, name: &str) -> Result<(), ImportError> {
        let scope = self.scopes.entry((kind.into(), name.into())).or_insert(self.is_assembly);
        if *scope == self.is_assembly {
            return Ok(());
        }
        let message = format!("the set {name} is one of the part and one of the assembly: give them two names");
        Err(self.lines.error(block.line, 1, message))
    }

    fn nodes(&mut self, block: &Block) -> Result<(), ImportError> {
        let set = block.get("NSET").map(|word| word.text.to_uppercase());
        if let Some(name) = &set {
            self.enter_set(block, "NSET", name)?;
        }
        for &line in &block.data {
            let fields = self.lines.fields(line);
            let number = label(&self.lines, line, fields[0])?;
            let mut place = [0.0; 3];
            for (x, field) in place.iter_mut().zip(fields.iter().skip(1)) {
                *x = if field.text.is_empty() { 0.0 } else { self.lines.number_of(line, *field)? };
            }
            if let Some(word) = fields.iter().skip(4).find(|word| !word.text.is_empty()) {
                return Err(self.lines.error(line, word.column, "a normal at a node is not imported"));
            }
            if self.model.nodes.insert(number, place).is_some() {
                return Err(self.lines.error(line, fields[0].column, format!("node {number} is given twice")));
            }
            if let Some(name) = &set {
                self.model.node_sets.entry(name.clone()).or_default().insert(number);
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
                0
            }
        };
        let set = block.get("ELSET").map(|word| word.text.to_uppercase());
        if let Some(name) = &set {
            self.enter_set(block, "ELSET", name)?;
            self.model.element_sets.entry(name.clone()).or_default();
        }
        if count == 0 {
            return Ok(());
        }
        if self.steps > 0 {
            return Err(self.lines.error(block.line, 1, "elements must stand above the first *STEP"));
        }
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
            if let Some(word) = fields.iter().skip(count + 1).find(|word| !word.text.is_empty()) {
                let message = "a node of orientation is not imported: give n1 in the second line of *BEAM SECTION";
                return Err(self.lines.error(line, word.column, message));
            }
            let is_planar = kind.starts_with("B2");
            if is_planar && labels[1..].iter().any(|node| self.model.nodes[node][2] != 0.0) {
                return Err(self.lines.error(
                    line,
                    1,
                    format!("an element of type {kind} must lie in the plane z = 0"),
                ));
            }
            let element = BeamElement { nodes: labels[1..].to_vec(), is_planar, line: line + 1 };
            if self.model.elements.insert(labels[0], element).is_some() {
                return Err(self.lines.error(line, fields[0].column, format!("element {} is given twice", labels[0])));
            }
            if let Some(name) = &set {
                self.model.element_sets.entry(name.clone()).or_default().insert(labels[0]);
            }
        }
        Ok(())
    }

    fn set(&mut self, block: &Block) -> Result<(), ImportError> {
        let name = block.name_of(&self.lines, &block.name)?;
        self.enter_set(block, &block.name, &name)?;
        let mut members = BTreeSet::new();
        for &line in &block.data {
            let fields = self.lines.fields(line);
            if block.has("GENERATE") {
                let of = |k: usize| fields.get(k).map(|word| label(&self.lines, line, *word)).transpose();
                let (Some(from), Some(to)) = (of(0)?, of(1)?) else {
                    return Err(self.lines.error(line, 1, "GENERATE needs first, last and step"));
                };
                if to < from {
                    return Err(self.lines.error(line, 1, format!("GENERATE goes up, but {to} is below {from}")));
                }
                if to - from > MOST {
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
        if let Some(set) = sets.get(&set_name(word)) {
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
        if let Some(&second) = block.data.get(1) {
            let message = format!("*{} that depends on temperature is not imported: leave one line", block.name);
            return Err(self.lines.error(second, 1, message));
        }
        let twice = self.lines.error(block.line, 1, format!("the material {name} has *{} twice", block.name));
        let material = self.model.materials.entry(name).or_default();
        match (block.name.as_str(), &found[..]) {
            ("ELASTIC", _) if block.get("TYPE").is_some_and(|word| !word.text.to_uppercase().starts_with("ISO")) => {
                Err(self.lines.error(block.line, 1, "only isotropic elasticity is imported"))
            }
            ("ELASTIC", _) if material.elastic.is_some() => Err(twice),
            ("DENSITY", _) if material.density.is_some() => Err(twice),
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
                    let to = last.map_or(Ok(from), |word| self.direction(line, *word))?;
                    if to < from {
                        let message = format!("the last direction, {}, is below the first, {}", to + 1, from + 1);
                        return Err(self.lines.error(line, fields[2].column, message));
                    }
                    from..=to
                }
            };
            let value = fields.get(3).map_or(Ok(0.0), |word| self.lines.number_of(line, *word))?;
            if value != 0.0 {
                let note = format!("line {}: a prescribed displacement is not imported: it is zero", line + 1);
                self.model.notes.push(note);
            }
            for node in nodes {
                let held = self.model.held.entry(node).or_default();
                held.directions.extend(range.clone());
                held.line = line + 1;
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
                let load = self.model.loads.entry(node).or_default();
                load.vector[direction] += value;
                load.line = line + 1;
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
                for number in self.loaded(line, set)? {
                    self.model.line_loads.entry(number).or_default()[axis] += value;
                }
            } else if kind.text.eq_ignore_ascii_case("GRAV") {
                self.gravity(line, set, value, rest)?;
            } else {
                let note = format!("line {}: the load {} is not imported", line + 1, shown(kind.text));
                self.model.notes.push(note);
            }
        }
        Ok(())
    }

    /// The beam elements of a set or a number; all of them where the field is empty.
    fn loaded(&self, line: usize, set: Word) -> Result<BTreeSet<u64>, ImportError> {
        let is_beam = |number: &u64| self.model.elements.contains_key(number);
        let elements: BTreeSet<u64> = match set.text.is_empty() {
            true => self.model.elements.keys().copied().collect(),
            false => self.members("ELSET", line, set)?.into_iter().filter(is_beam).collect(),
        };
        match elements.is_empty() {
            true => Err(self.lines.error(line, set.column, format!("`{}` has no beam elements", shown(set.text)))),
            false => Ok(elements),
        }
    }

    /// GRAV: acceleration, and the components of its direction, whose length does not count.
    fn gravity(&mut self, line: usize, set: Word, value: f64, direction: &[Word]) -> Result<(), ImportError> {
        let wrong = |column: usize, message: &str| Err(self.lines.error(line, column, message));
        if self.loaded(line, set)?.len() < self.model.elements.len() {
            return wrong(set.column, "GRAV is imported only for all beam elements: this set lacks some");
        }
        if self.model.gravity.is_some() {
            return wrong(1, "a second GRAV is not imported: give one line with the sum");
        }
        let mut vector = [0.0; 3];
        for (x, word) in vector.iter_mut().zip(direction) {
            *x = if word.text.is_empty() { 0.0 } else { self.lines.number_of(line, *word)? };
        }
        let Some(unit) = Vec3(vector).normalized() else {
            return wrong(1, "GRAV needs an acceleration and the three components of its direction");
        };
        self.model.gravity = Some((unit * value).0);
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
