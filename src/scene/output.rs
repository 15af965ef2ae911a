//! The columns that a deck writes or watches, found by name and bound to nodes, beams and the
//! scene.

use super::beam_points::BeamPoints;
use super::mesh::Mesh;
use super::names::{Found, unknown};
use super::stress::SectionStresses;
use crate::deck::{Contact, Deck, Diagnostic, ExpectBody, Span, Spanned, hint, nearest, one_of};
use beamsim_core::probe::{
    BeamPoint, COLUMNS, ColumnGroup, ENERGY_WITH_CONTACTS, Need, Place, Probe, ProfilePlace, Reading, STRESS_AT_POINT,
    STRESS_WITH_INDEX, Source, StressPlace, StressPoint, clocks, find_column, group,
};
use beamsim_core::sorting::sort_numbers;
use beamsim_core::system::Node;

/// Groups that are written where a deck asks for none.
const DEFAULT_GROUPS: [&str; 2] = ["u", "r"];

/// Distance of two places on a beam, as a part of its length, that is round-off.
const SAME_PLACE: f64 = 1e-9;

/// Finder of columns by their names.
pub struct Columns<'a> {
    /// The deck
    pub(super) deck: &'a Deck,
    /// The mesh
    pub(super) mesh: &'a Mesh,
    /// Points of beams, for strains and resultants
    pub(super) points: BeamPoints<'a>,
    /// Stresses of sections
    pub(super) stresses: &'a SectionStresses<'a>,
}

impl Columns<'_> {
    /// Probes of the history, in the order of its columns: node by node, then the whole scene.
    pub fn written(&self, diagnostics: &mut Vec<Diagnostic>) -> Vec<Probe> {
        let groups = self.written_groups(diagnostics);
        let mut probes = Vec::new();
        let mut blamed: Vec<&str> = Vec::new();
        for node in self.written_nodes(diagnostics) {
            for group in groups.iter().filter(|group| group.is_of_node()) {
                match self.node_probe(&node, group) {
                    Ok(probe) => probes.push(probe),
                    Err(diagnostic) => match self.word_of_default_nodes(group) {
                        None => diagnostics.push(diagnostic),
                        Some(_) if blamed.contains(&group.key) => {}
                        Some(word) => {
                            blamed.push(group.key);
                            diagnostics.push(at_word(diagnostic, word));
                        }
                    },
                }
            }
            if groups.iter().any(|group| is_stress(group)) {
                self.add_stress_points(&node, &mut probes, diagnostics);
            }
            probes.extend(self.line_contact(&node, &groups));
        }
        if groups.iter().any(|group| group.is_of_contact()) {
            probes.extend((0..self.deck.contacts.len()).filter_map(|number| self.contact_probe(number)));
        }
        probes.extend(groups.iter().filter_map(|group| whole_probe(group)));
        probes
    }

    /// Groups of columns that the deck asks for, each once.
    fn written_groups(&self, diagnostics: &mut Vec<Diagnostic>) -> Vec<&'static ColumnGroup> {
        let Some(keys) = &self.deck.output.columns else {
            return DEFAULT_GROUPS.iter().filter_map(|key| group(key)).collect();
        };
        let mut known: Vec<&'static ColumnGroup> = Vec::new();
        for key in keys {
            let Some(group) = group_of(self.deck, &key.value) else {
                diagnostics.push(unknown_group(key));
                continue;
            };
            if known.iter().any(|other| other.key == group.key) {
                diagnostics.push(Diagnostic::error(format!("`{}` is listed twice", key.value), key.span.clone()));
                continue;
            }
            if let Some(other) = known.iter().find(|other| other.has_columns_of(group)) {
                let message = format!("`{}` and `{}` have the same columns: ask for one of them", other.key, group.key);
                diagnostics.push(Diagnostic::error(message, key.span.clone()));
            }
            known.push(group);
        }
        known
    }

    /// The word that asks for a group of columns at all points, where no `nodes` are named.
    fn word_of_default_nodes(&self, group: &ColumnGroup) -> Option<&Span> {
        let is_default = self.deck.output.nodes.is_none();
        let keys = self.deck.output.columns.iter().flatten();
        keys.filter(|_| is_default).find(|key| key.value == group.key).map(|key| &key.span)
    }

    fn written_nodes(&self, diagnostics: &mut Vec<Diagnostic>) -> Vec<Spanned<String>> {
        let Some(nodes) = &self.deck.output.nodes else {
            let points = self.deck.points.iter().filter(|(name, _)| self.mesh.points.contains_key(&name.value));
            return points.map(|(name, _)| name.clone()).collect();
        };
        for (k, node) in nodes.iter().enumerate() {
            if nodes[..k].iter().any(|other| other.value == node.value) {
                diagnostics
                    .push(Diagnostic::error(format!("node `{}` is listed twice", node.value), node.span.clone()));
            }
        }
        nodes.clone()
    }

    /// Probe of a group at a node.
    fn node_probe(&self, name: &Spanned<String>, group: &'static ColumnGroup) -> Result<Probe, Diagnostic> {
        let found = self.mesh.find(self.deck, name)?;
        let place = self.mesh.place(&found);
        if is_stress(group) {
            return self.stress_probe(name);
        }
        let reading = match group.source {
            Source::Place(read) => Reading::Place(place, read),
            Source::Node(read) => Reading::Node(node_of(&place, name)?, read),
            Source::BeamPoint(read) => Reading::BeamPoint(self.beam_point(name, &found)?, read),
            Source::Stress(_) | Source::StressPoint(_) | Source::Contact(_) => return Err(no_column(name)),
            Source::Scene(read) | Source::Run(read) => Reading::Whole(read),
        };
        Ok(Probe { names: group.names_at(&name.value), group, reading })
    }

    /// Probe of the largest stresses at a place on a beam, with the failure index where the section has
    /// strengths.
    fn stress_probe(&self, name: &Spanned<String>) -> Result<Probe, Diagnostic> {
        let inside = self.beam_point(name, &self.mesh.find(self.deck, name)?)?;
        let beam = &self.mesh.beams[inside.beam].name;
        let section = self.stresses.at(beam, inside.fraction, &name.span)?;
        let plain = group("stress").ok_or_else(|| no_column(name))?;
        let group = if section.section().has_strength() { &STRESS_WITH_INDEX } else { plain };
        let Source::Stress(read) = group.source else { return Err(no_column(name)) };
        let names = group.names_at(&name.value);
        Ok(Probe { names, group, reading: Reading::Stress(StressPlace { inside, section }, read) })
    }

    /// Probe of the stresses at a point of the section at a place on a beam: `arm@0.5` and `top`.
    fn point_probe(&self, name: &Spanned<String>, point: &str) -> Result<Probe, Diagnostic> {
        let inside = self.beam_point(name, &self.mesh.find(self.deck, name)?)?;
        let beam = &self.mesh.beams[inside.beam].name;
        let stress = self.stresses.at_point(beam, inside.fraction, point, name)?;
        let Source::StressPoint(read) = STRESS_AT_POINT.source else { return Err(no_column(name)) };
        let names = STRESS_AT_POINT.names_at(&format!("{}.{point}", name.value));
        let reading = Reading::StressPoint(StressPoint { inside, stress }, read);
        Ok(Probe { names, group: &STRESS_AT_POINT, reading })
    }

    /// Adds the stresses at all points of the section at a node.
    fn add_stress_points(&self, node: &Spanned<String>, probes: &mut Vec<Probe>, diagnostics: &mut Vec<Diagnostic>) {
        // The probe of the largest stresses reports errors of the place.
        let Some(inside) = self.mesh.find(self.deck, node).ok().and_then(|at| self.beam_point(node, &at).ok()) else {
            return;
        };
        for point in self.stresses.points(&self.mesh.beams[inside.beam].name, inside.fraction) {
            match self.point_probe(node, &point.name.value) {
                Ok(probe) => probes.push(probe),
                Err(diagnostic) => diagnostics.push(diagnostic),
            }
        }
    }

    /// Probe and component of a column of stresses, by its name.
    fn find_stress(&self, name: &Spanned<String>) -> Result<(Probe, usize), Diagnostic> {
        let (owner, suffix) = name.value.rsplit_once('.').ok_or_else(|| no_column(name))?;
        // Names of points begin with a letter, parts of a number do not: `arm@0.5`.
        let is_point = |name: &str| name.starts_with(char::is_alphabetic);
        let at = |place: &str| Spanned { value: place.to_string(), span: name.span.clone() };
        let probe = match owner.rsplit_once('.') {
            Some((place, point)) if is_point(point) => self.point_probe(&at(place), point)?,
            Some(_) | None => self.stress_probe(&at(owner))?,
        };
        match probe.group.component(suffix) {
            Some(component) => Ok((probe, component)),
            None if suffix == "index" => {
                let message = format!("`{}` needs a `strength` or `strain_limit` of a material", name.value);
                Err(Diagnostic::error(message, name.span.clone()))
            }
            None => {
                let message = format!("`{}` needs the name of a point of the section", name.value);
                Err(Diagnostic::error(message, name.span.clone()).help("such as `arm@0.5.top.s11`"))
            }
        }
    }

    /// Places along beams at which the largest stresses are followed. Places between sections without
    /// a shape of their own are left out; beams without any stress are errors about `span`.
    pub fn stress_places(&self, span: &Span, diagnostics: &mut Vec<Diagnostic>) -> Vec<StressPlace> {
        let mut places = Vec::new();
        for (number, beam) in self.mesh.beams.iter().enumerate() {
            let mut failed = None;
            let before = places.len();
            for fraction in self.fractions(number) {
                match self.stresses.at(&beam.name, fraction, span) {
                    Ok(section) => places.push(StressPlace { inside: self.inside(number, fraction), section }),
                    Err(diagnostic) => failed = Some(diagnostic),
                }
            }
            if places.len() == before {
                diagnostics.extend(failed);
            }
        }
        places
    }

    /// Places along beams of which resultants are written, with the stresses of their sections where
    /// they are known: both sides of those where resultants jump.
    pub fn profile_places(&self, span: &Span) -> Vec<ProfilePlace> {
        let of_beam = |number: usize| {
            let places = move |fraction: f64| {
                let section = self.stresses.at(&self.mesh.beams[number].name, fraction, span).ok();
                let of_side = move |inside: BeamPoint| ProfilePlace { inside, section: section.clone() };
                self.inside(number, fraction).by_jumps().into_iter().map(of_side)
            };
            self.fractions(number).into_iter().flat_map(places)
        };
        (0..self.mesh.beams.len()).flat_map(of_beam).collect()
    }

    /// Fractions of the length of the nodes and the stations of a beam.
    fn fractions(&self, number: usize) -> Vec<f64> {
        let beam = &self.mesh.beams[number];
        let stations = self.stresses.stations(&beam.name);
        let mut fractions: Vec<f64> = beam.fractions.iter().copied().chain(stations).collect();
        sort_numbers(&mut fractions);
        fractions.dedup_by(|a, b| (*a - *b).abs() <= SAME_PLACE);
        fractions
    }

    /// Forces of contacts per length at a node of a beam, which the group `contact` has, too.
    fn line_contact(&self, name: &Spanned<String>, groups: &[&'static ColumnGroup]) -> Option<Probe> {
        let own = group("line_contact")?;
        if !groups.iter().any(|group| group.is_of_contact()) || groups.iter().any(|group| group.key == own.key) {
            return None;
        }
        let probe = self.node_probe(name, own).ok()?;
        let Reading::BeamPoint(point, _) = &probe.reading else { return None };
        let beam = &self.mesh.beams[point.beam].name;
        let touches = |contact: &Contact| contact.beams.iter().chain(&contact.with).any(|name| name.value == *beam);
        self.deck.contacts.iter().any(touches).then_some(probe)
    }

    /// Probe of the columns of a contact.
    fn contact_probe(&self, number: usize) -> Option<Probe> {
        let group = group("contact")?;
        let Source::Contact(read) = group.source else { return None };
        let names = group.names_at(&self.deck.contacts[number].name.value);
        Some(Probe { names, group, reading: Reading::Contact(number, read) })
    }

    /// Point of a beam for strains and resultants.
    fn beam_point(&self, node: &Spanned<String>, found: &Found) -> Result<BeamPoint, Diagnostic> {
        let refuse = |message: String| Diagnostic::error(message, node.span.clone());
        let beams = self.mesh.beams_at(found);
        let &[(number, fraction)] = &beams[..] else {
            return Err(if beams.is_empty() {
                refuse(format!("no beam meets the node `{}`: it has no resultants", node.value))
            } else {
                let (first, fraction) = beams[0];
                let end = if fraction > 0.5 { "end" } else { "start" };
                refuse(format!("several beams meet at `{}`, so that the resultants are ambiguous", node.value))
                    .help(format!("name the place on a beam, such as `{}@{end}`", self.mesh.beams[first].name))
            });
        };
        Ok(self.inside(number, fraction))
    }

    /// The point at a fraction of the length of a beam, with both sides where it is a node.
    fn inside(&self, number: usize, fraction: f64) -> BeamPoint {
        let beam = &self.mesh.beams[number];
        let (element, xi) = beam.element_at(fraction);
        let is_between = xi > 1.0 - 1e-9 && element + 1 < beam.elements.end;
        self.points.point(number, fraction, (element, xi), is_between.then_some((element + 1, -1.0)))
    }

    /// Probe and component of a column, by its name.
    pub fn find(&self, name: &Spanned<String>) -> Result<(Probe, usize), Diagnostic> {
        let (group, component) = column_of(self.deck, &name.value).ok_or_else(|| no_column(name))?;
        if let Some(probe) = whole_probe(group) {
            return Ok((probe, component));
        }
        if is_stress(group) {
            return self.find_stress(name);
        }
        let node = name.value.rsplit_once('.').map_or("", |(node, _)| node);
        if group.is_of_contact() {
            let number = self.deck.contacts.iter().position(|contact| contact.name.value == node);
            let probe = number.and_then(|number| self.contact_probe(number)).ok_or_else(|| no_column(name))?;
            return Ok((probe, component));
        }
        let node = Spanned { value: node.to_string(), span: name.span.clone() };
        Ok((self.node_probe(&node, group)?, component))
    }
}

/// True if a column that a deck writes, expects or ends a stage by needs this part of the model or
/// run.
pub fn needs(deck: &Deck, need: Need) -> bool {
    let written = deck.output.columns.iter().flatten().filter_map(|key| group(&key.value));
    let expected = deck.expects.iter().filter_map(|expect| match &expect.body {
        ExpectBody::Column { column, .. } => Some(column),
        ExpectBody::Fails(_) | ExpectBody::Warns(_) | ExpectBody::Quiet => None,
    });
    let watched = deck.stages.iter().filter_map(|stage| stage.until.as_ref()).map(|until| &until.column);
    let named = expected.chain(watched).filter_map(|column| column_of(deck, &column.value));
    written.chain(named.map(|(group, _)| group)).any(|group| group.needs.contains(&need))
}

/// Group and component of a column, by its name. Of groups with the same columns, the one that the
/// deck writes.
fn column_of(deck: &Deck, name: &str) -> Option<(&'static ColumnGroup, usize)> {
    if let Some((owner, suffix)) = name.rsplit_once('.') {
        let of_contact = deck.contacts.iter().any(|contact| contact.name.value == owner);
        if of_contact || owner == "energy" {
            let group = group_of(deck, if of_contact { "contact" } else { owner })?;
            return Some((group, group.component(suffix)?));
        }
    }
    let (first, component) = find_column(name)?;
    let mut written = deck.output.columns.iter().flatten().filter_map(|key| group(&key.value));
    let instead = written.find(|group| group.has_columns_of(first));
    Some((instead.unwrap_or(first), component))
}

/// Group with this key in a deck: energies of contacts are there only where a contact is.
fn group_of(deck: &Deck, key: &str) -> Option<&'static ColumnGroup> {
    let group = group(key)?;
    Some(if key == "energy" && !deck.contacts.is_empty() { &ENERGY_WITH_CONTACTS } else { group })
}

/// Probe of a group that belongs to no node.
fn whole_probe(group: &'static ColumnGroup) -> Option<Probe> {
    match group.source {
        Source::Scene(read) | Source::Run(read) => {
            Some(Probe { names: group.own_names(), group, reading: Reading::Whole(read) })
        }
        Source::Place(_)
        | Source::Node(_)
        | Source::BeamPoint(_)
        | Source::Stress(_)
        | Source::StressPoint(_)
        | Source::Contact(_) => None,
    }
}

/// An error about one of all points, where the deck names no nodes: at the word that asks for the
/// columns.
fn at_word(diagnostic: Diagnostic, word: &Span) -> Diagnostic {
    let message = format!("{} (without `nodes`, columns are written at all points)", diagnostic.message);
    Diagnostic::error(message, word.clone()).help("name the places in `nodes`, such as `nodes = [\"arm@0.5\"]`")
}

/// True for columns of stresses, whose groups depend on the section.
fn is_stress(group: &ColumnGroup) -> bool {
    matches!(group.source, Source::Stress(_) | Source::StressPoint(_))
}

fn node_of(place: &Place, name: &Spanned<String>) -> Result<Node, Diagnostic> {
    place.node().ok_or_else(|| {
        let message = format!("`{}` lies inside an element; reactions exist only at nodes", name.value);
        Diagnostic::error(message, name.span.clone())
    })
}

fn no_column(name: &Spanned<String>) -> Diagnostic {
    let diagnostic = Diagnostic::error(format!("there is no column `{}`", name.value), name.span.clone());
    let suffix = name.value.rsplit_once('.').map_or(name.value.as_str(), |(_, suffix)| suffix);
    match nearest(suffix, COLUMNS.iter().flat_map(ColumnGroup::suffixes)) {
        Some(meant) if name.value.contains('.') => diagnostic.help(format!("did you mean `.{meant}`?")),
        Some(_) | None => {
            diagnostic.help("a column is a node and a component, such as `tip.ux`, or `energy.total`, `momentum.px`")
        }
    }
}

/// Keys of the groups that a deck may ask for.
fn group_keys() -> impl Iterator<Item = &'static str> {
    COLUMNS.iter().map(|group| group.key).filter(|key| clocks().all(|clock| clock != *key))
}

fn unknown_group(key: &Spanned<String>) -> Diagnostic {
    let known: Vec<&'static str> = group_keys().collect();
    let diagnostic = unknown("group of columns", key, known.iter().copied());
    let suffix = key.value.rsplit_once('.').map_or(key.value.as_str(), |(_, suffix)| suffix);
    if let Some(group) = COLUMNS.iter().find(|group| group.component(suffix).is_some()) {
        return diagnostic.help(format!("`{suffix}` is a column of the group `{}`", group.key));
    }
    match hint("columns", &key.value, &known) {
        Some(help) => diagnostic.help(help),
        None => diagnostic.help(format!("known groups: {}", one_of(known))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::SCHEMA;
    use serde_json::Value;

    #[test]
    fn the_schema_lists_all_groups_of_columns() {
        let schema: Value = serde_json::from_str(SCHEMA).unwrap();
        let listed = schema["properties"]["output"]["properties"]["columns"]["items"]["enum"].as_array().unwrap();
        assert!(listed.iter().filter_map(Value::as_str).eq(group_keys()));
    }
}
