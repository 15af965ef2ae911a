//! Written columns, and columns by their names.

use super::mesh::Mesh;
use super::names::{Found, unknown};
use crate::deck::{Deck, Diagnostic, Spanned, hint, nearest, one_of};
use beamsim_core::effect::elasticity::StressField;
use beamsim_core::probe::{BeamPoint, NODE_GROUPS, Probe, Quantity, WHOLE_GROUPS, suffixes};
use std::sync::Arc;

/// Finds probes by name.
pub struct Columns<'a> {
    /// The deck
    pub deck: &'a Deck,
    /// The mesh
    pub mesh: &'a Mesh,
    /// The elasticity, for resultants
    pub elasticity: &'a [Arc<dyn StressField>],
}

impl Columns<'_> {
    /// The probes of the history, in the order of its columns: node by node, then the whole scene.
    pub fn written(&self, diagnostics: &mut Vec<Diagnostic>) -> Vec<Probe> {
        let default = || ["u", "r"].map(|group| Spanned { value: group.to_string(), span: 0..0 }).to_vec();
        let groups = self.deck.output.columns.clone().unwrap_or_else(default);
        let mut known: Vec<&Spanned<String>> = Vec::new();
        for group in &groups {
            if suffixes(&group.value).is_none() {
                diagnostics.push(unknown_group(group));
            } else if known.iter().any(|k| k.value == group.value) {
                diagnostics.push(Diagnostic::error(format!("`{}` is listed twice", group.value), group.span.clone()));
            } else {
                known.push(group);
            }
        }
        if let (Some(_), Some(rc)) = (known.iter().find(|g| g.value == "r"), known.iter().find(|g| g.value == "rc")) {
            let message = "`r` and `rc` have the same columns: ask for one of them";
            diagnostics.push(Diagnostic::error(message, rc.span.clone()));
        }
        let mut probes = Vec::new();
        for node in self.written_nodes(diagnostics) {
            for group in known.iter().filter(|g| NODE_GROUPS.iter().any(|(name, _)| *name == g.value)) {
                match self.node_probe(&node, &group.value) {
                    Ok(probe) => probes.push(probe),
                    Err(diagnostic) => diagnostics.push(diagnostic),
                }
            }
        }
        let whole = known.iter().filter(|g| WHOLE_GROUPS.iter().any(|(name, _)| *name == g.value));
        probes.extend(whole.map(|group| whole_probe(&group.value)));
        probes
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

    /// The probe of a group at a node.
    pub fn node_probe(&self, node: &Spanned<String>, group: &str) -> Result<Probe, Diagnostic> {
        let found = self.mesh.find(self.deck, node)?;
        let place = self.mesh.place(&found);
        let quantity = match group {
            "u" => Quantity::Displacement(place),
            "x" => Quantity::Position(place),
            "r" => Quantity::Rotation(place),
            "rc" => Quantity::Wound(place),
            "d" => Quantity::Axes(place),
            "v" => Quantity::Velocity(place),
            "w" => Quantity::Spin(place),
            "a" => Quantity::Acceleration(place),
            "alpha" => Quantity::AngularAcceleration(place),
            "reaction" => Quantity::Reaction(place.node().ok_or_else(|| {
                let message = format!("`{}` lies inside an element; reactions exist only at nodes", node.value);
                Diagnostic::error(message, node.span.clone())
            })?),
            "resultant" => Quantity::Resultant(self.beam_point(node, &found)?),
            "strain" => Quantity::Strain(self.beam_point(node, &found)?),
            _ => return Err(unknown_group(&Spanned { value: group.to_string(), span: node.span.clone() })),
        };
        let names = suffixes(group).unwrap_or_default().iter().map(|suffix| format!("{}.{suffix}", node.value));
        Ok(Probe { names: names.collect(), quantity })
    }

    /// The point of a beam where resultants are asked for.
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
        let beam = &self.mesh.beams[number];
        let (element, xi) = beam.element_at(fraction);
        let mut sides = vec![(element as u32, xi)];
        if xi > 1.0 - 1e-9 && element + 1 < beam.elements.end {
            sides.push((element as u32 + 1, -1.0));
        }
        Ok(BeamPoint { elasticity: self.elasticity.to_vec(), sides, frame: beam.frame(fraction) })
    }

    /// Any column by its name: the probe and the component.
    pub fn find(&self, name: &Spanned<String>) -> Result<(Probe, usize), Diagnostic> {
        let single = [("stage", Quantity::Stage), ("time", Quantity::Time), ("load", Quantity::Load)];
        if let Some((_, quantity)) = single.into_iter().find(|(column, _)| *column == name.value) {
            return Ok((Probe { names: vec![name.value.clone()], quantity }, 0));
        }
        let Some((node, suffix)) = name.value.rsplit_once('.') else {
            return Err(self.no_column(name));
        };
        if let Some((group, suffixes)) = WHOLE_GROUPS.iter().find(|(group, _)| *group == node) {
            let component = suffixes.iter().position(|s| *s == suffix).ok_or_else(|| self.no_column(name))?;
            return Ok((whole_probe(group), component));
        }
        let group = NODE_GROUPS.iter().find_map(|(group, s)| s.iter().position(|s| *s == suffix).map(|k| (*group, k)));
        let node = Spanned { value: node.to_string(), span: name.span.clone() };
        match group {
            Some(("r", component)) if self.continues_rotations() => Ok((self.node_probe(&node, "rc")?, component)),
            Some((group, component)) => Ok((self.node_probe(&node, group)?, component)),
            None => Err(self.no_column(name)),
        }
    }

    /// True if the columns rx ry rz are continued from row to row.
    fn continues_rotations(&self) -> bool {
        self.deck.output.columns.as_ref().is_some_and(|columns| columns.iter().any(|c| c.value == "rc"))
    }

    fn no_column(&self, name: &Spanned<String>) -> Diagnostic {
        let diagnostic = Diagnostic::error(format!("there is no column `{}`", name.value), name.span.clone());
        let suffix = name.value.rsplit_once('.').map_or(name.value.as_str(), |(_, suffix)| suffix);
        let known = NODE_GROUPS.iter().chain(&WHOLE_GROUPS).flat_map(|(_, suffixes)| suffixes.iter().copied());
        match nearest(suffix, known) {
            Some(meant) if name.value.contains('.') => diagnostic.help(format!("did you mean `.{meant}`?")),
            Some(_) | None => diagnostic
                .help("a column is a node and a component, such as `tip.ux`, or `energy.total`, `momentum.px`"),
        }
    }
}

fn whole_probe(group: &str) -> Probe {
    let names = suffixes(group).unwrap_or_default().iter().map(|suffix| format!("{group}.{suffix}")).collect();
    Probe { names, quantity: if group == "energy" { Quantity::Energy } else { Quantity::Momentum } }
}

fn unknown_group(group: &Spanned<String>) -> Diagnostic {
    let known: Vec<&'static str> = NODE_GROUPS.iter().chain(&WHOLE_GROUPS).map(|(name, _)| *name).collect();
    let diagnostic = unknown("group of columns", group, known.iter().copied());
    match hint("columns", &group.value, &known) {
        Some(help) => diagnostic.help(help),
        None => diagnostic.help(format!("known groups: {}", one_of(known))),
    }
}
