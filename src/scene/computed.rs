//! Sections that are computed from their shape: from the words of the deck to a geometry, its
//! solution, which is kept for the whole process, and matrices about the line of the beam.

use super::names;
use super::section::{self, Closed, PlainSection};
use crate::deck::{
    self, ComputedSection, ComputedShape, Deck, Diagnostic, Elastic, Fibre, Reference, ReferenceWord, SectionBody,
    Shape, Span, Spanned, ThetaSenseWord, WallPlies, WallSideWord,
};
use beamsim_core::model::{MassPerLength, SectionMatrices};
use beamsim_core::section::airfoil;
use beamsim_core::section::analysis::{self, Analysis, MeshAim, SectionWarning, analyse};
use beamsim_core::section::geometry::{self, Geometry, Profile};
use beamsim_core::section::grid::Rect;
use beamsim_core::section::material::{self, Material};
use beamsim_core::section::mesh::{Region, Tangent};
use beamsim_core::section::outline::Outline;
use beamsim_core::section::properties::{mass_centre, moved, moved_compliance, turned};
use beamsim_core::section::triangulate::PlanarRegion;
use beamsim_core::section::walls::{Bend, Ply, Walls};
use beamsim_core::section::{Matrix6, Point, SectionError};
use beamsim_core::tensor::{Mat3, Vec3};
use beamsim_core::warning::WarningKind;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Couplings below this part of the root of the product of both diagonals are round-off
const NO_COUPLING: f64 = 1e-9;

/// Outlines and walls further from their origin than this many times their size are solved about
/// their middle: the distance would cost digits
const FAR: f64 = 100.0;

/// Solutions that are kept, at most: a sweep over dimensions of a section must not fill the memory
const MOST_KEPT: usize = 64;

/// A section of the deck as computed.
#[derive(Clone)]
pub struct SolvedSection {
    /// Mesh and solution; none for closed forms
    pub solution: Option<Solution>,
    /// The point of the shape through which the line of the beam goes
    pub place: Point,
    /// Stiffness and mass about the line of the beam
    pub matrices: SectionMatrices,
    /// Compliance about the line of the beam, for shapes far from their origin: the inverse of their
    /// stiffness may have lost its digits
    pub compliance: Option<Matrix6>,
}

/// A solution by finite elements and the materials of its regions.
#[derive(Clone)]
pub struct Solution {
    /// Mesh and solution
    pub analysis: Arc<Analysis>,
    /// Materials
    pub(crate) materials: Vec<Material>,
    /// Origin of mesh and solution in the coordinates of the shape
    pub(crate) origin: Point,
}

/// A shape, ready to be solved.
struct Draft<'d> {
    deck: &'d Deck,
    section: &'d deck::Section,
    body: &'d ComputedSection,
    materials: Vec<Material>,
    /// Places of the text by the name of the region that they describe
    regions: Vec<(String, Span)>,
}

/// A section that is computed from its shape; `None` for others.
pub fn solved(section: &deck::Section, deck: &Deck) -> Option<Result<SolvedSection, Diagnostic>> {
    match &section.body {
        SectionBody::Resultants { .. } | SectionBody::Full { .. } => None,
        SectionBody::Computed(body) => Some(solve(section, body, deck)),
    }
}

/// Computes a section.
pub fn solve(section: &deck::Section, body: &ComputedSection, deck: &Deck) -> Result<SolvedSection, Diagnostic> {
    if let Some(plain) = PlainSection::of(section, deck)? {
        let matrices = section::within_range(plain.matrices(), section)?;
        return Ok(SolvedSection { solution: None, place: plain.place, matrices, compliance: None });
    }
    let near = far_middle(&body.shape).map(|origin| (origin, near_origin(body, origin)));
    let (origin, body) = near.as_ref().map_or(([0.0; 2], body), |(origin, near)| (*origin, near));
    let mut draft = Draft { deck, section, body, materials: Vec::new(), regions: Vec::new() };
    if let Some(deck::ShearFactor::Given(_)) = body.shear_factor {
        let message = format!(
            "section `{}` is computed by finite elements, which find the shear stiffness: remove `shear_factor`",
            section.name.value
        );
        return Err(Diagnostic::error(message, body.span.clone()));
    }
    let shape = draft.shape()?;
    let geometry = Geometry::new(shape);
    let aim = match body.mesh {
        None => MeshAim::Usual,
        Some(deck::MeshAim::Error(error)) => MeshAim::Error(error),
        Some(deck::MeshAim::Size(size)) => MeshAim::Size(size),
    };
    let analysis = kept(&geometry, &draft.materials, aim).map_err(|error| draft.explain(&error.moved(origin)))?;
    let own = Closed { stiffness: analysis.solution.stiffness, mass: analysis.solution.mass };
    let place = draft.place(&analysis);
    let matrices = section::within_range(about_line(&own, place, body.turn, has_density(body, deck)), section)?;
    let compliance = near.is_some().then(|| {
        let compliance = moved_compliance(&analysis.solution.compliance, place);
        turned(&compliance, -body.turn)
    });
    let place = [place[0] + origin[0], place[1] + origin[1]];
    let solution = Some(Solution { analysis, materials: draft.materials, origin });
    Ok(SolvedSection { solution, place, matrices, compliance })
}

/// A warning about a section whose error is large, or larger than it was to be.
pub fn warning(section: &deck::Section, deck: &Deck) -> Option<Diagnostic> {
    let solution = solved(section, deck)?.ok()?.solution?;
    let name = &section.name;
    let message = match solution.analysis.warnings().first()? {
        SectionWarning::PoorEstimate { estimate } => {
            format!("the stiffness of section `{}` has an estimated relative error of {estimate:.1e}", name.value)
        }
        SectionWarning::AimNotMet { estimate } => format!(
            "the stiffness of section `{}` has an estimated relative error of {estimate:.1e}, more than aimed at: \
             a finer mesh would take long",
            name.value
        ),
    };
    let diagnostic = Diagnostic::warning(WarningKind::CoarseSection, message, name.span.clone());
    let help = "round off sharp corners that point into the material, or give `mesh`: a larger error needs fewer nodes, \
                and with `mesh = 1e-3` meshes may have three times as many as without `mesh`";
    Some(diagnostic.help(help))
}

/// The solution of a geometry: computed once a process.
fn kept(geometry: &Geometry, materials: &[Material], aim: MeshAim) -> Result<Arc<Analysis>, SectionError> {
    type Slot = Arc<Mutex<Option<Result<Arc<Analysis>, SectionError>>>>;
    static KEPT: Mutex<VecDeque<(String, Slot)>> = Mutex::new(VecDeque::new());
    // Numbers in it are written with all their digits.
    let key = format!("{geometry:?} {materials:?} {aim:?}");
    let slot = {
        let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        match kept.iter().find(|(known, _)| *known == key) {
            Some((_, slot)) => slot.clone(),
            None => {
                let slot = Slot::default();
                kept.push_back((key, slot.clone()));
                if kept.len() > MOST_KEPT {
                    kept.pop_front();
                }
                slot
            }
        }
    };
    // Others who want this section wait for it.
    let mut slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = &*slot {
        return known.clone();
    }
    let found = analyse(geometry, materials, aim).map(Arc::new);
    if !matches!(found, Err(SectionError::Interrupted)) {
        *slot = Some(found.clone());
    }
    found
}

impl Draft<'_> {
    /// The reference point in the coordinates of the shape.
    fn place(&self, analysis: &Analysis) -> Point {
        let reference = match self.body.reference {
            Some(Reference::Point(at)) => analysis::Reference::Point(at),
            Some(Reference::Word(ReferenceWord::Centroid)) => analysis::Reference::Centroid,
            Some(Reference::Word(ReferenceWord::ShearCentre)) => analysis::Reference::ShearCentre,
            Some(Reference::Word(ReferenceWord::TensionCentre)) => analysis::Reference::TensionCentre,
            // Without mass the centre is that of the area.
            Some(Reference::Word(ReferenceWord::MassCentre)) if analysis.solution.mass[(0, 0)] == 0.0 => {
                analysis::Reference::Centroid
            }
            Some(Reference::Word(ReferenceWord::MassCentre)) => analysis::Reference::MassCentre,
            None if self.body.shape.has_own_origin() => analysis::Reference::Point([0.0; 2]),
            None => analysis::Reference::TensionCentre,
        };
        // A centre on an axis of the shape is there exactly.
        let round_off = NO_COUPLING * analysis.solution.area.sqrt();
        analysis.place(reference).map(|x| if x.abs() <= round_off { 0.0 } else { x })
    }

    /// The index of a material among those of the section.
    fn material(&mut self, name: &Spanned<String>) -> Result<usize, Diagnostic> {
        let found = section::find_material(name, &self.deck.materials)?;
        if let Some(known) = self.materials.iter().position(|material| material.name == name.value) {
            return Ok(known);
        }
        let elastic = elastic_of(&found.elastic);
        self.materials.push(Material { name: name.value.clone(), elastic, density: found.density.unwrap_or(0.0) });
        Ok(self.materials.len() - 1)
    }

    /// A region with a name for messages.
    fn region(
        &mut self,
        name: &str,
        material: &Spanned<String>,
        fibre: Fibre,
        span: Span,
    ) -> Result<Region, Diagnostic> {
        let material = self.material(material)?;
        self.regions.push((name.to_string(), span));
        Ok(Region { theta: fibre.theta, tangent: Tangent::Fixed(fibre.beta), ..Region::new(name, material) })
    }

    /// The material of the whole section.
    fn own_material(&self) -> Result<Spanned<String>, Diagnostic> {
        let message = || format!("section `{}` needs `material`", self.section.name.value);
        self.body.material.clone().ok_or_else(|| Diagnostic::error(message(), self.body.span.clone()))
    }

    fn shape(&mut self) -> Result<geometry::Shape, Diagnostic> {
        let profile = match self.body.shape {
            ComputedShape::Regions(ref regions) => return self.regions_shape(regions),
            ComputedShape::Walls(ref walls) => return Ok(geometry::Shape::Walls(self.walls(walls)?)),
            ComputedShape::Airfoil(ref airfoil) => return Ok(geometry::Shape::Walls(self.airfoil(airfoil)?)),
            ComputedShape::Polygon { ref outline, ref holes } => {
                let region = self.own_region()?;
                let outline = self.outline(outline, &region.name)?;
                let holes = holes.iter().map(|hole| self.outline(hole, &region.name)).collect::<Result<_, _>>()?;
                return Ok(geometry::Shape::Regions(vec![PlanarRegion { region, outline, holes }]));
            }
            ComputedShape::Solid(Shape::Circle { radius }) => return self.ellipse([radius; 2], None),
            ComputedShape::Solid(Shape::Tube { radius, thickness }) => {
                return self.ellipse([radius; 2], Some(thickness));
            }
            ComputedShape::Ellipse { size, thickness } => return self.ellipse(size.map(|full| 0.5 * full), thickness),
            ComputedShape::Solid(Shape::Rectangle { width, height }) => Profile::Rectangle { d: height, b: width },
            ComputedShape::I { body: deck::Flanged { d, b, t_f, t_w, r }, top: [b_top, t_f_top] } => {
                Profile::I { d, b, t_f, t_w, r, b_top, t_f_top }
            }
            ComputedShape::Channel(deck::Flanged { d, b, t_f, t_w, r }) => Profile::Channel { d, b, t_f, t_w, r },
            ComputedShape::T(deck::Flanged { d, b, t_f, t_w, r }) => Profile::T { d, b, t_f, t_w, r },
            ComputedShape::Angle { d, b, t, r_r, r_t } => Profile::Angle { d, b, t, r_r, r_t },
            ComputedShape::Box { d, b, t_f, t_w, r_out } => Profile::Box { d, b, t_f, t_w, r_out },
        };
        Ok(geometry::Shape::Profile { profile, region: self.own_region()? })
    }

    /// The region of a section of one material.
    fn own_region(&mut self) -> Result<Region, Diagnostic> {
        let material = self.own_material()?;
        let name = self.section.name.value.clone();
        self.region(&name, &material, self.body.fibre, self.body.span.clone())
    }

    fn ellipse(&mut self, semi_axes: [f64; 2], thickness: Option<f64>) -> Result<geometry::Shape, Diagnostic> {
        // A wall as thick as the radius leaves no hole.
        let thickness = thickness.filter(|&thickness| thickness < semi_axes[0].min(semi_axes[1]));
        Ok(geometry::Shape::Ellipse { semi_axes, thickness, region: self.own_region()? })
    }

    fn outline(&self, outline: &deck::Outline, region: &str) -> Result<Outline, Diagnostic> {
        match outline {
            deck::Outline::Circle { centre, radius } => Ok(Outline::circle(*centre, *radius)),
            deck::Outline::Corners(corners) => Outline::rounded(corners, region).map_err(|error| self.explain(&error)),
        }
    }

    /// Rectangles and rings have meshes of their own.
    fn regions_shape(&mut self, regions: &[deck::Region]) -> Result<geometry::Shape, Diagnostic> {
        let mut planar = Vec::new();
        for (number, region) in regions.iter().enumerate() {
            let material = match &region.material {
                Some(material) => material.clone(),
                None => self.own_material()?,
            };
            let name = format!("{} ({})", number + 1, material.value);
            let made = self.region(&name, &material, region.fibre, region.span.clone())?;
            let outline = self.outline(&region.outline, &name)?;
            let holes = region.holes.iter().map(|hole| self.outline(hole, &name)).collect::<Result<Vec<_>, _>>()?;
            planar.push(PlanarRegion { region: made, outline, holes });
        }
        let made: Vec<Region> = planar.iter().map(|planar| planar.region.clone()).collect();
        let rect = |(number, region): (usize, &deck::Region)| match &region.outline {
            deck::Outline::Corners(corners) if region.holes.is_empty() => rect_of(corners, number),
            deck::Outline::Corners(_) | deck::Outline::Circle { .. } => None,
        };
        if let Some(rects) = regions.iter().enumerate().map(rect).collect::<Option<Vec<_>>>() {
            return Ok(geometry::Shape::Rects { rects, regions: made });
        }
        Ok(geometry::Shape::Regions(planar))
    }

    fn walls(&mut self, walls: &deck::Walls) -> Result<Walls, Diagnostic> {
        let mut made = Walls::default();
        for wall in &walls.walls {
            let mut ends = [[0.0; 2]; 2];
            for (end, name) in ends.iter_mut().zip(&wall.ends) {
                let found = walls.points.iter().find(|(known, _)| known.value == name.value);
                let known = walls.points.iter().map(|(known, _)| known.value.as_str());
                *end = found.ok_or_else(|| names::unknown("point of the section", name, known))?.1;
            }
            let [from, to] = ends;
            let name = format!("{}-{}", wall.ends[0].value, wall.ends[1].value);
            let flips = walls.theta_sense == ThetaSenseWord::Fixed && to[0] < from[0];
            let plies = self.plies(&wall.plies, &name, flips, &wall.span)?;
            let thickness: f64 = plies.iter().map(|ply| ply.thickness).sum();
            let left = match wall.side {
                WallSideWord::Left => thickness,
                WallSideWord::Middle => 0.5 * thickness,
                WallSideWord::Right => 0.0,
            };
            let bend = match wall.arc {
                None => None,
                Some(between) => Some(bend_through(from, between, to).ok_or_else(|| {
                    let message = "`arc` of a wall must be a point beside the line between its ends";
                    Diagnostic::error(message, wall.span.clone())
                })?),
            };
            made.add(from, to, bend, left, &plies);
        }
        Ok(made)
    }

    fn airfoil(&mut self, airfoil: &deck::Airfoil) -> Result<Walls, Diagnostic> {
        let span = &airfoil.profile.span;
        if airfoil.trailing_edge == deck::TrailingEdgeWord::Fill {
            let message = "`te = \"fill\"` is not supported yet: only `\"close\"` is";
            return Err(Diagnostic::error(message, self.body.span.clone()));
        }
        let mut skin = Vec::new();
        for (number, part) in airfoil.skin.iter().enumerate() {
            let name = format!("skin {}", number + 1);
            let layup = WallPlies::Layup(part.layup.clone());
            let plies = self.plies(&layup, &name, false, &part.layup.span)?;
            let sides = match part.side {
                deck::SkinSideWord::Upper => [true, false],
                deck::SkinSideWord::Lower => [false, true],
                deck::SkinSideWord::Both => [true; 2],
            };
            skin.push(airfoil::SkinPart { ends: part.ends, sides, plies });
        }
        let mut webs = Vec::new();
        for (number, web) in airfoil.webs.iter().enumerate() {
            let name = format!("web {}", number + 1);
            let plies = self.plies(&WallPlies::Layup(web.layup.clone()), &name, false, &web.span)?;
            webs.push(airfoil::Web { at: web.at, plies });
        }
        self.regions.push(("profile".to_string(), span.clone()));
        let made = airfoil::Airfoil {
            profile: airfoil.profile.value.clone(),
            chord: airfoil.chord,
            pitch_axis: airfoil.pitch_axis,
            leads_to_plus: airfoil.leading_edge == deck::LeadingEdgeWord::Plus,
            skin,
            webs,
            fixed_sense: airfoil.theta_sense == ThetaSenseWord::Fixed,
        };
        made.walls().map_err(|error| self.explain(&error))
    }

    /// Plies of a wall or a part of a skin. `flips` turns all angles around.
    fn plies(&mut self, plies: &WallPlies, wall: &str, flips: bool, span: &Span) -> Result<Vec<Ply>, Diagnostic> {
        let layup = match plies {
            WallPlies::Thickness(thickness) => {
                let material = self.own_material()?;
                let ply = deck::Ply { material, thickness: *thickness, theta: 0.0 };
                deck::Layup { name: Spanned { value: wall.to_string(), span: span.clone() }, plies: vec![ply] }
            }
            WallPlies::Layup(name) => {
                let known = self.deck.layups.iter().map(|layup| layup.name.value.as_str());
                let found = self.deck.layups.iter().find(|layup| layup.name.value == name.value);
                found.ok_or_else(|| names::unknown("layup", name, known))?.clone()
            }
        };
        let mut made = Vec::new();
        for (number, ply) in layup.plies.iter().enumerate() {
            let name = format!("{wall} ply {} ({})", number + 1, ply.material.value);
            let material = self.material(&ply.material)?;
            self.regions.push((name.clone(), span.clone()));
            let theta = if flips { -ply.theta } else { ply.theta };
            made.push(Ply { name, material, thickness: ply.thickness, theta });
        }
        Ok(made)
    }

    /// The error at the part of the deck that it is about.
    fn explain(&self, error: &SectionError) -> Diagnostic {
        let message = format!("section `{}`: {error}", self.section.name.value);
        let of_material =
            |name: &String| self.deck.materials.iter().find(|m| m.name.value == *name).map(|m| m.name.span.clone());
        let of_region =
            |name: &String| self.regions.iter().find(|(known, _)| known == name).map(|(_, span)| span.clone());
        let span = match error {
            SectionError::NotPositiveDefinite { material } | SectionError::PoissonRatio { material, .. } => {
                of_material(material)
            }
            SectionError::Outline { region, .. }
            | SectionError::EmptyRegion { region }
            | SectionError::Meshing { region, .. }
            | SectionError::InvertedElement { region, .. } => of_region(region),
            SectionError::OverlappingRegions { second, .. } | SectionError::NotConnected { second, .. } => {
                of_region(second)
            }
            SectionError::NotPositive { .. }
            | SectionError::Dimensions { .. }
            | SectionError::CrossingEdges { .. }
            | SectionError::TooThin { .. }
            | SectionError::TooLarge { .. }
            | SectionError::Singular
            | SectionError::Interrupted => None,
        };
        let span = span.unwrap_or(self.body.span.clone());
        match error {
            SectionError::TooThin { .. } | SectionError::TooLarge { .. } => Diagnostic::limit(message, span),
            SectionError::NotPositiveDefinite { .. }
            | SectionError::PoissonRatio { .. }
            | SectionError::Outline { .. }
            | SectionError::EmptyRegion { .. }
            | SectionError::Meshing { .. }
            | SectionError::InvertedElement { .. }
            | SectionError::OverlappingRegions { .. }
            | SectionError::NotConnected { .. }
            | SectionError::NotPositive { .. }
            | SectionError::Dimensions { .. }
            | SectionError::CrossingEdges { .. }
            | SectionError::Singular
            | SectionError::Interrupted => Diagnostic::error(message, span),
        }
    }
}

/// Matrices about the line of the beam, in its axes: the line goes through `place` of the shape, which
/// is turned about it by `turn` from axis 2 towards axis 3.
pub fn about_line(own: &Closed, place: Point, turn: f64, has_mass: bool) -> SectionMatrices {
    // Axes see a section turned by an angle as turned axes see the other way round.
    let in_axes = |matrix: &Matrix6| without_round_off(&turned(&moved(matrix, place), -turn));
    let stiffness = in_axes(&own.stiffness);
    let mass = in_axes(&own.mass);
    SectionMatrices {
        stiffness: std::array::from_fn(|i| std::array::from_fn(|j| stiffness[(i, j)])),
        mass: has_mass.then(|| mass_per_length(&mass)),
    }
}

/// The constants of a material of the deck.
pub fn elastic_of(elastic: &Elastic) -> material::Elastic {
    match *elastic {
        Elastic::Isotropic(elastic) => material::Elastic::Isotropic { e: elastic.young, nu: elastic.poisson },
        Elastic::Orthotropic { young, shear, poisson } => {
            material::Elastic::Orthotropic { e: young, g: shear, nu: poisson }
        }
    }
}

/// The middle of the box around outlines or walls that lie far from their origin.
fn far_middle(shape: &ComputedShape) -> Option<Point> {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    let mut include = |at: &mut Point, radius: f64| {
        for axis in 0..2 {
            low[axis] = low[axis].min(at[axis] - radius);
            high[axis] = high[axis].max(at[axis] + radius);
        }
    };
    visit_points(&mut shape.clone(), &mut include);
    let middle = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    let is_far = middle.iter().any(|x| x.is_finite() && x.abs() > FAR * size);
    (is_far && middle.iter().all(|x| x.is_finite())).then_some(middle)
}

/// A section whose shape is moved so that a point becomes its origin.
fn near_origin(body: &ComputedSection, origin: Point) -> ComputedSection {
    let from_origin = |at: Point| [at[0] - origin[0], at[1] - origin[1]];
    let mut near = body.clone();
    visit_points(&mut near.shape, &mut |at, _| *at = from_origin(*at));
    near.reference = match body.reference {
        Some(Reference::Point(at)) => Some(Reference::Point(from_origin(at))),
        None if body.shape.has_own_origin() => Some(Reference::Point(from_origin([0.0; 2]))),
        Some(Reference::Word(_)) | None => body.reference,
    };
    near
}

/// Calls a function with the points of outlines and walls, and with the radius of circles about
/// them; airfoils and profiles are near their origin.
fn visit_points(shape: &mut ComputedShape, visit: &mut dyn FnMut(&mut Point, f64)) {
    match shape {
        ComputedShape::Polygon { outline, holes } => {
            visit_outline(outline, visit);
            holes.iter_mut().for_each(|hole| visit_outline(hole, visit));
        }
        ComputedShape::Regions(regions) => {
            for region in regions {
                visit_outline(&mut region.outline, visit);
                region.holes.iter_mut().for_each(|hole| visit_outline(hole, visit));
            }
        }
        ComputedShape::Walls(walls) => {
            walls.points.iter_mut().for_each(|(_, at)| visit(at, 0.0));
            walls.walls.iter_mut().filter_map(|wall| wall.arc.as_mut()).for_each(|at| visit(at, 0.0));
        }
        ComputedShape::Solid(_)
        | ComputedShape::Ellipse { .. }
        | ComputedShape::I { .. }
        | ComputedShape::Channel(_)
        | ComputedShape::T(_)
        | ComputedShape::Angle { .. }
        | ComputedShape::Box { .. }
        | ComputedShape::Airfoil(_) => {}
    }
}

fn visit_outline(outline: &mut deck::Outline, visit: &mut dyn FnMut(&mut Point, f64)) {
    match outline {
        deck::Outline::Corners(corners) => corners.iter_mut().for_each(|(at, _)| visit(at, 0.0)),
        deck::Outline::Circle { centre, radius } => visit(centre, *radius),
    }
}

/// True if all materials of a section have a density.
pub fn has_density(body: &ComputedSection, deck: &Deck) -> bool {
    let has_one = |name: &&Spanned<String>| {
        deck.materials.iter().any(|material| material.name.value == name.value && material.density.is_some())
    };
    materials_of(body, deck).iter().all(has_one)
}

/// The names of all materials of a section.
fn materials_of<'d>(body: &'d ComputedSection, deck: &'d Deck) -> Vec<&'d Spanned<String>> {
    let own = body.material.iter();
    let of_layup = |name: &Spanned<String>| {
        let layup = deck.layups.iter().find(|layup| layup.name.value == name.value);
        layup.into_iter().flat_map(|layup| layup.plies.iter().map(|ply| &ply.material))
    };
    match &body.shape {
        ComputedShape::Regions(regions) => {
            let of_region = |region: &'d deck::Region| region.material.as_ref().or(body.material.as_ref());
            regions.iter().filter_map(of_region).collect()
        }
        ComputedShape::Walls(walls) => {
            let mut all = Vec::new();
            for wall in &walls.walls {
                match &wall.plies {
                    WallPlies::Thickness(_) => all.extend(own.clone()),
                    WallPlies::Layup(name) => all.extend(of_layup(name)),
                }
            }
            all
        }
        ComputedShape::Airfoil(airfoil) => {
            let skin = airfoil.skin.iter().flat_map(|part| of_layup(&part.layup));
            skin.chain(airfoil.webs.iter().flat_map(|web| of_layup(&web.layup))).collect()
        }
        ComputedShape::Solid(_)
        | ComputedShape::Ellipse { .. }
        | ComputedShape::I { .. }
        | ComputedShape::Channel(_)
        | ComputedShape::T(_)
        | ComputedShape::Angle { .. }
        | ComputedShape::Box { .. }
        | ComputedShape::Polygon { .. } => own.collect(),
    }
}

/// The rectangle with sides along the axes that has these corners.
fn rect_of(corners: &[([f64; 2], f64)], region: usize) -> Option<Rect> {
    let [(a, _), (b, _), (c, _), (d, _)] = corners else { return None };
    let is_rect = (a[1] == b[1] && b[0] == c[0] && c[1] == d[1] && d[0] == a[0])
        || (a[0] == b[0] && b[1] == c[1] && c[0] == d[0] && d[1] == a[1]);
    let ordered = |x: f64, y: f64| [x.min(y), x.max(y)];
    is_rect.then(|| Rect { x2: ordered(a[0], c[0]), x3: ordered(a[1], c[1]), region })
}

/// The circle through three points, from the first over the second to the third.
fn bend_through(from: Point, between: Point, to: Point) -> Option<Bend> {
    let [bx, by] = [between[0] - from[0], between[1] - from[1]];
    let [cx, cy] = [to[0] - from[0], to[1] - from[1]];
    let determinant = 2.0 * (bx * cy - by * cx);
    if determinant.abs() <= 1e-12 * (cx * cx + cy * cy) {
        return None;
    }
    let [b, c] = [bx * bx + by * by, cx * cx + cy * cy];
    let centre = [from[0] + (cy * b - by * c) / determinant, from[1] + (bx * c - cx * b) / determinant];
    Some(Bend { centre, counterclockwise: determinant > 0.0 })
}

/// Couplings that are zero but for round-off become zero.
fn without_round_off(matrix: &Matrix6) -> Matrix6 {
    Matrix6::from_fn(|i, j| {
        let limit = NO_COUPLING * (matrix[(i, i)] * matrix[(j, j)]).abs().sqrt();
        if i != j && matrix[(i, j)].abs() <= limit { 0.0 } else { matrix[(i, j)] }
    })
}

/// Mass, its centre, and inertia about the line of the beam.
fn mass_per_length(mass: &Matrix6) -> MassPerLength {
    let m = mass[(0, 0)];
    // Adding zero makes -0 and 0 one.
    let [x2, x3] = if m > 0.0 { mass_centre(mass).map(|x| x + 0.0) } else { [0.0; 2] };
    let inertia = [0, 1, 2].map(|i| [0, 1, 2].map(|j| mass[(3 + i, 3 + j)]));
    MassPerLength { mass: m, offset: Vec3([0.0, x2, x3]), about_line: Mat3(inertia) }
}
