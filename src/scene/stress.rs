//! Stresses of the sections of a deck at places on its beams.

use super::computed::{self, Solution, SolvedSection};
use super::figure::SectionsAtNodes;
use super::mesh::{Mesh, MeshBeam};
use super::section::{PlainSection, Taper, find_material, solid_material};
use super::{names, path};
use crate::deck::{self, Beam, CornerWord, Deck, Diagnostic, SectionBody, Shape, Span, Spanned, Strength};
use beamsim_core::section::closed::{ClosedForm, ClosedShape};
use beamsim_core::section::material::Material;
use beamsim_core::section::mesh::Region;
use beamsim_core::section::recovery::{PlacedRecovery, Placement, PointStress, Recovery};
use beamsim_core::section::strength::{FailureLaw, Strengths};
use beamsim_core::section::stress::Corners;
use beamsim_core::warning::WarningKind;
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

/// Distance of a place from a station, as a part of the length, that is round-off
const AT_STATION: f64 = 1e-9;

/// The section at a place of a beam.
enum Found<'d> {
    /// One of the deck
    Named(&'d deck::Section),
    /// Between two, at a part of the way
    Between([&'d deck::Section; 2], f64),
}

/// Finder of the stresses of sections; each is made once.
pub struct SectionStresses<'d> {
    deck: &'d Deck,
    made: RefCell<HashMap<String, Arc<Recovery>>>,
}

impl<'d> SectionStresses<'d> {
    /// For the sections of a deck.
    pub fn new(deck: &'d Deck) -> Self {
        Self { deck, made: RefCell::new(HashMap::new()) }
    }

    /// The section at a fraction of the length of a beam; errors are about `span`.
    pub fn at(&self, beam: &str, fraction: f64, span: &Span) -> Result<PlacedRecovery, Diagnostic> {
        let known = self.beam(beam, span)?;
        let section = match self.find(known, fraction)? {
            Found::Named(section) => self.of_section(section, span)?,
            Found::Between(ends, along) => self.between(ends, along, (beam, fraction), span)?,
        };
        Ok(placed(section, known, fraction))
    }

    /// Stresses at a fixed point of the section at a fraction of the length of a beam, the place
    /// `name`.
    pub fn at_point(
        &self,
        beam: &str,
        fraction: f64,
        point: &str,
        name: &Spanned<String>,
    ) -> Result<PointStress, Diagnostic> {
        let span = &name.span;
        let known = self.beam(beam, span)?;
        let Found::Named(section) = self.find(known, fraction)? else {
            let message = format!(
                "the section of beam `{beam}` varies there, so that it has no point `{point}`: ask for it where the \
                 section is one of the deck"
            );
            return Err(Diagnostic::error(message, span.clone()));
        };
        let Some(point) = section.probes.iter().find(|known| known.name.value == point) else {
            let message = format!("the section at `{}` has no point `{point}`", name.value);
            let help = "name it in [section.NAME]: probe = { NAME = [x2, x3] }";
            return Err(Diagnostic::error(message, span.clone()).help(help));
        };
        let stresses = placed(self.of_section(section, span)?, known, fraction);
        stress_at_point(&stresses, section, point, self.deck, span)
    }

    /// The points of the section at a place, if it is one of the deck.
    pub fn points(&self, beam: &str, fraction: f64) -> &'d [deck::SectionProbe] {
        match self.beam(beam, &(0..0)).and_then(|known| self.find(known, fraction)) {
            Ok(Found::Named(section)) => &section.probes,
            Ok(Found::Between(..)) | Err(_) => &[],
        }
    }

    /// Fractions of the length at which a beam has a section of the deck by its stations.
    pub fn stations(&self, beam: &str) -> Vec<f64> {
        self.beam(beam, &(0..0)).map_or(Vec::new(), stations)
    }

    /// The sections at the nodes of each beam of a mesh, where their stresses are known.
    pub fn at_nodes(&self, mesh: &Mesh) -> SectionsAtNodes {
        let of_beam = |beam: &MeshBeam| {
            let section = |&fraction: &f64| self.at(&beam.name, fraction, &(0..0)).ok();
            beam.fractions.iter().map(section).collect()
        };
        mesh.beams.iter().map(of_beam).collect()
    }

    fn beam(&self, name: &str, span: &Span) -> Result<&'d Beam, Diagnostic> {
        let known = self.deck.beams.named(name);
        known.ok_or_else(|| Diagnostic::error(format!("there is no beam `{name}`"), span.clone()))
    }

    fn find(&self, known: &'d Beam, fraction: f64) -> Result<Found<'d>, Diagnostic> {
        let section = |k: usize| {
            let name = &known.sections[k];
            let found = self.deck.sections.named(&name.value);
            found.ok_or_else(|| names::unknown("section", name, self.deck.sections.names()))
        };
        let stations = stations(known);
        if let Some(k) = stations.iter().position(|station| (station - fraction).abs() <= AT_STATION) {
            return section(k).map(Found::Named);
        }
        let next = stations.partition_point(|&station| station <= fraction).clamp(1, stations.len().max(2) - 1);
        let [start, end] = [next - 1, next.min(known.sections.len() - 1)];
        if known.sections[start].value == known.sections[end].value {
            return section(start).map(Found::Named);
        }
        let along = (fraction - stations[start]) / (stations[end] - stations[start]);
        Ok(Found::Between([section(start)?, section(end)?], along.clamp(0.0, 1.0)))
    }

    /// Warnings of sections whose stresses are those of a coarser mesh than was aimed at.
    pub fn warnings(&self) -> Vec<Diagnostic> {
        let is_made = |section: &&deck::Section| self.made.borrow().contains_key(&section.name.value);
        self.deck.sections.iter().filter(is_made).filter_map(|section| coarse_stresses(section, self.deck)).collect()
    }

    fn of_section(&self, section: &deck::Section, span: &Span) -> Result<Arc<Recovery>, Diagnostic> {
        if let Some(made) = self.made.borrow().get(&section.name.value) {
            return Ok(made.clone());
        }
        let made = Arc::new(recovery(section, self.deck, span)?);
        self.made.borrow_mut().insert(section.name.value.clone(), made.clone());
        Ok(made)
    }

    /// Between two circles, tubes or rectangles of one isotropic material dimensions are linear, as in
    /// the stiffness. Other sections in between have no shape.
    fn between(
        &self,
        ends: [&deck::Section; 2],
        along: f64,
        (beam, fraction): (&str, f64),
        span: &Span,
    ) -> Result<Arc<Recovery>, Diagnostic> {
        let [first, second] = ends;
        if let Some(taper) = Taper::new(ends, self.deck)? {
            let name = format!("{}-{}", first.name.value, second.name.value);
            return Ok(Arc::new(closed(&name, &taper.at(along), law_of_solid(first, self.deck)?)));
        }
        for section in ends {
            self.of_section(section, span)?;
        }
        let message = format!(
            "the stress between the sections `{}` and `{}` is not known at {fraction} of beam `{beam}`: their \
             stiffness is interpolated there, but not their shape",
            first.name.value, second.name.value
        );
        let stations: Vec<String> = self.stations(beam).iter().map(|at| format!("`{beam}@{at}`")).collect();
        let help = format!("ask for it where the section is one of the deck: {}", stations.join(", "));
        Err(Diagnostic::error(message, span.clone()).help(help))
    }
}

/// A warning about a section whose stresses are those of a coarser mesh than was aimed at.
pub fn coarse_stresses(section: &deck::Section, deck: &Deck) -> Option<Diagnostic> {
    let Solution { analysis, materials, .. } = computed::solved(section, deck)?.ok()?.solution?;
    let error = analysis.stresses(&materials).ok()?.coarse.as_ref()?;
    let name = &section.name;
    let message = format!(
        "stresses of section `{}` are those of the coarse mesh of its stiffness: the finer one failed ({error})",
        name.value
    );
    let help = "give the mesh by `mesh = { size = … }`, and compare two sizes";
    Some(Diagnostic::warning(WarningKind::CoarseSection, message, name.span.clone()).help(help))
}

/// Stresses at a point of a section of the deck.
fn stress_at_point(
    stresses: &PlacedRecovery,
    section: &deck::Section,
    point: &deck::SectionProbe,
    deck: &Deck,
    span: &Span,
) -> Result<PointStress, Diagnostic> {
    let solved = solved(section, deck, span)?;
    let found = match &solved.solution {
        None => stresses.at(point.at, None),
        Some(Solution { analysis, materials, .. }) => {
            let field = analysis.stresses(materials).map_err(|error| broken(section, &error, span))?;
            let is_oriented = |region: &Region| !materials[region.material].is_isotropic();
            let is_oriented: Vec<bool> = field.mesh.regions.iter().map(is_oriented).collect();
            stresses.at(point.at, Some((field, &is_oriented)))
        }
    };
    found.ok_or_else(|| {
        let [x2, x3] = point.at;
        let message =
            format!("the point `{}` at [{x2}, {x3}] lies outside section `{}`", point.name.value, section.name.value);
        let help = "`probe` takes coordinates of the shape, as `beamsim section` shows them";
        Diagnostic::error(message, point.name.span.clone()).help(help)
    })
}

/// A section where a beam has it at a fraction of its length: beside its line and turned, by `offset`
/// and `turn` of the beam.
fn placed(section: Arc<Recovery>, beam: &Beam, fraction: f64) -> PlacedRecovery {
    let offset = path::along(beam, beam.offset.as_ref()).at(fraction);
    let [turn] = path::along(beam, beam.turn.as_ref()).at(fraction);
    PlacedRecovery::new(section, offset, turn)
}

/// Places of the sections of a beam as fractions of its length.
fn stations(beam: &Beam) -> Vec<f64> {
    match (path::stations(beam), beam.sections.len()) {
        (Some(stations), _) => stations,
        (None, 2) => vec![0.0, 1.0],
        (None, _) => vec![0.0],
    }
}

/// The solution of a section that has a shape.
fn solved(section: &deck::Section, deck: &Deck, span: &Span) -> Result<SolvedSection, Diagnostic> {
    computed::solved(section, deck).unwrap_or_else(|| {
        let message = format!("section `{}` has no stress: it is given by numbers, not by a shape", section.name.value);
        let help = "give its `shape` and `material`, and `beamsim section` shows the stiffness that follows";
        Err(Diagnostic::error(message, span.clone()).help(help))
    })
}

/// The stresses of a section of the deck.
pub fn recovery(section: &deck::Section, deck: &Deck, span: &Span) -> Result<Recovery, Diagnostic> {
    let SolvedSection { solution, place, .. } = solved(section, deck, span)?;
    let name = &section.name.value;
    if let Some(plain) = PlainSection::of(section, deck)? {
        return Ok(closed(name, &plain, law_of_solid(section, deck)?));
    }
    let (SectionBody::Computed(body), Some(Solution { analysis, materials, origin })) = (&section.body, solution)
    else {
        return Err(Diagnostic::error("a section without a solution", section.name.span.clone()));
    };
    let line = [place[0] - origin[0], place[1] - origin[1]];
    let placement = Placement { line, turn: body.turn, origin };
    let law = |material: &Material| {
        let of_deck = deck.materials.iter().find(|known| known.name.value == material.name)?;
        failure_law(of_deck)
    };
    let laws: Vec<Option<FailureLaw>> = materials.iter().map(law).collect();
    let corners = match section.corner {
        CornerWord::Exclude => Corners::Exclude,
        CornerWord::Include => Corners::Include,
    };
    let field = analysis.stresses(&materials).map_err(|error| broken(section, &error, span))?;
    Ok(Recovery::computed(name, field, placement, corners, &laws))
}

fn broken(section: &deck::Section, error: &beamsim_core::section::SectionError, span: &Span) -> Diagnostic {
    Diagnostic::error(format!("section `{}`: {error}", section.name.value), span.clone())
}

/// The stresses of a section that has closed forms.
fn closed(name: &str, plain: &PlainSection, law: Option<FailureLaw>) -> Recovery {
    let shape = match plain.shape {
        Shape::Circle { radius } => ClosedShape::Ring { radii: [0.0, radius] },
        Shape::Tube { radius, thickness } => ClosedShape::Ring { radii: [radius - thickness, radius] },
        Shape::Rectangle { width, height } => ClosedShape::Rectangle { half: [0.5 * width, 0.5 * height] },
    };
    let form = ClosedForm::new(shape, plain.elastic.poisson);
    let placement = Placement { line: plain.place, turn: plain.turn, origin: [0.0; 2] };
    Recovery::closed(name, form, placement, law)
}

/// The law of the material of a circle, tube or rectangle.
fn law_of_solid(section: &deck::Section, deck: &Deck) -> Result<Option<FailureLaw>, Diagnostic> {
    let material = solid_material(section).map(|name| find_material(name, &deck.materials)).transpose()?;
    Ok(material.and_then(failure_law))
}

/// The law of a material that has strengths.
fn failure_law(material: &deck::Material) -> Option<FailureLaw> {
    if material.strength.is_none() && material.strain_limit.is_none() {
        return None;
    }
    let mut law = FailureLaw::default();
    match material.strength {
        None => {}
        Some(Strength::Yield(stress)) => law.yield_stress = Some(stress),
        Some(Strength::Ply { tension, compression, shear: [s12, s13, s23] }) => {
            law.strengths = Some(Strengths { tension, compression, shear: [s23, s13, s12] });
        }
    }
    let Some(limit) = material.strain_limit else { return Some(law) };
    let own =
        Material { name: material.name.value.clone(), elastic: computed::elastic_of(&material.elastic), density: 0.0 };
    Some(law.with_strain_limit(&own, limit))
}
