//! Sections as matrices in their local axes, from resultants, full matrices, or shape and material.

use super::along::Along;
use super::computed;
use crate::deck::{
    self, Deck, Diagnostic, EffectWord, Effects, Elastic, Isotropic, SectionBody, Shape, ShearFactor, Span, Spanned,
    StationsWord,
};
use beamsim_core::kernel::inertia::Inertia;
use beamsim_core::model::beam_element::body_inertia;
use beamsim_core::model::{MassPerLength, SectionMatrices};
use beamsim_core::section::properties::{moved, turned};
use beamsim_core::tensor::{Mat3, Vec3};
use nalgebra::{Matrix6, SymmetricEigen};
use std::f64::consts::PI;

/// The section of a beam from its start to its end.
#[derive(Clone, Debug)]
pub enum SectionCourse {
    /// One section
    Uniform(SectionMatrices),
    /// Dimensions linear in arc length
    Shaped(Box<Taper>),
    /// Each entry linear in arc length
    Blended([SectionMatrices; 2]),
    /// From station to station
    Stations {
        /// Places of the stations, from 0 to 1
        fractions: Vec<f64>,
        /// Between each two
        courses: Vec<SectionCourse>,
    },
    /// Another course, whose origin lies beside the line of the beam
    Placed {
        /// The sections about their own origins, in their own axes
        course: Box<SectionCourse>,
        /// Place of the origin along axes 2 and 3 of the beam
        offset: Along<2>,
        /// Angle of the axes of the section about axis 1
        turn: Along<1>,
    },
    /// Another course, so stiff against these of its strains that they vanish
    Rigid(Box<SectionCourse>, [bool; 6]),
    /// Another course, whose torsion is not coupled with other strains
    Uncoupled(Box<SectionCourse>),
}

/// Factor on the stiffness of strains that are switched off, of which a hundredth is left. A much
/// larger one would need shorter time steps than all else.
const RIGID: f64 = 1e2;

/// The number of the torsion kappa_1 among the strains of a section.
const TORSION: usize = 3;

/// Couplings below this part of the geometric mean of both stiffnesses are round-off.
const ROUND_OFF: f64 = 1e-9;

/// Poisson's ratio of an incompressible material, and some round-off of E/(2G) - 1
const LARGEST_POISSON: f64 = 0.5 + 1e-9;

/// Relative difference of lengths in tables and of beams that is taken for rounding.
const SAME_LENGTH: f64 = 1e-3;

impl SectionCourse {
    /// The section at the fraction `s` of the arc length.
    pub fn at(&self, s: f64) -> SectionMatrices {
        match self {
            Self::Uniform(section) => section.clone(),
            Self::Shaped(taper) => taper.at(s).matrices(),
            Self::Blended([a, b]) => blend(a, b, s),
            Self::Stations { fractions, courses } => {
                let next = fractions.partition_point(|&station| station <= s).clamp(1, courses.len());
                let from = fractions[next - 1];
                let to = fractions[next];
                courses[next - 1].at(((s - from) / (to - from)).clamp(0.0, 1.0))
            }
            Self::Placed { course, offset, turn } => placed(course.at(s), offset.at(s), turn.at(s)),
            Self::Rigid(course, strains) => {
                let section = course.at(s);
                let stiffness = stiffened(&section.stiffness, strains);
                SectionMatrices { stiffness, ..section }
            }
            Self::Uncoupled(course) => {
                let section = course.at(s);
                let stiffness = without_torsion_coupling(&section.stiffness);
                SectionMatrices { stiffness, ..section }
            }
        }
    }

    /// True if torsion is coupled with other strains, before `[effects]` takes that out.
    pub fn couples_torsion(&self) -> bool {
        match self {
            Self::Stations { courses, .. } => courses.iter().any(Self::couples_torsion),
            Self::Uncoupled(course) | Self::Rigid(course, _) => course.couples_torsion(),
            Self::Uniform(_) | Self::Shaped(_) | Self::Blended(_) | Self::Placed { .. } => {
                [0.0, 1.0].into_iter().any(|s| couples_torsion(&self.at(s).stiffness))
            }
        }
    }

    /// With stations as fractions of the length; `Err` with the last where it is not the end of the
    /// beam. Without a unit, 1 as well as the length is the end.
    pub fn along(self, length: f64, unit: Option<StationsWord>) -> Result<Self, f64> {
        let Self::Stations { fractions, courses } = self else { return Ok(self) };
        let last = fractions.last().copied().unwrap_or(1.0);
        let is_whole = last == 1.0;
        let is_length = (last - length).abs() <= SAME_LENGTH * length;
        let is_end = match unit {
            None => is_whole || is_length,
            Some(StationsWord::Fraction) => is_whole,
            Some(StationsWord::Length) => is_length,
        };
        if !is_end {
            return Err(last);
        }
        Ok(Self::Stations { fractions: fractions.iter().map(|s| s / last).collect(), courses })
    }

    /// The course with its origin at `offset` from the line of the beam, along axes 2 and 3, turned
    /// about axis 1 by `turn`.
    pub fn placed(self, offset: Along<2>, turn: Along<1>) -> Self {
        if offset.is_zero() && turn.is_zero() {
            return self;
        }
        Self::Placed { course: Box::new(self), offset, turn }
    }

    /// The course as `[effects]` wants it.
    pub fn forced(self, effects: &Effects) -> Self {
        let shear = effects.allow(EffectWord::Shear);
        let extension = effects.allow(EffectWord::Extension);
        let coupled = effects.allow(EffectWord::TorsionCoupling);
        let course = if coupled { self } else { Self::Uncoupled(Box::new(self)) };
        if shear && extension {
            return course;
        }
        Self::Rigid(Box::new(course), [!extension, !shear, !shear, false, false, false])
    }
}

/// True if entries of a stiffness that couple torsion with other strains exceed round-off.
fn couples_torsion(stiffness: &[[f64; 6]; 6]) -> bool {
    let is_coupled = |k: usize| {
        let size = libm::sqrt(stiffness[TORSION][TORSION] * stiffness[k][k]);
        k != TORSION && stiffness[TORSION][k].abs() > ROUND_OFF * size
    };
    (0..6).any(is_coupled)
}

/// A stiffness whose torsion does nothing to other strains, with the same compliance otherwise: a
/// torque alone and loads without a torque each have the strains of their own kind that they had.
fn without_torsion_coupling(stiffness: &[[f64; 6]; 6]) -> [[f64; 6]; 6] {
    let inverse = |matrix: Matrix6<f64>| matrix.cholesky().map(|factor| factor.inverse());
    let uncoupled = |compliance: Matrix6<f64>| {
        Matrix6::from_fn(|i, j| if (i == TORSION) == (j == TORSION) { compliance[(i, j)] } else { 0.0 })
    };
    let own = Matrix6::from_fn(|i, j| stiffness[i][j]);
    let Some(found) = inverse(own).and_then(|compliance| inverse(uncoupled(compliance))) else { return *stiffness };
    std::array::from_fn(|i| std::array::from_fn(|j| found[(i, j)]))
}

/// A stiffness K that is [`RIGID`] times as stiff against some strains F and has the same compliance
/// in the others R, so that centres, torsion and bending stay: K + (RIGID - 1) K_.F K_FF^-1 K_F.
/// divides by RIGID what of the compliance S_FF is due to F alone, K_FF^-1.
fn stiffened(stiffness: &[[f64; 6]; 6], strains: &[bool; 6]) -> [[f64; 6]; 6] {
    let of =
        |i: usize, j: usize| if strains[i] && strains[j] { stiffness[i][j] } else { f64::from(i == j && !strains[i]) };
    let block = Matrix6::from_fn(of);
    let coupling = Matrix6::from_fn(|i, j| if strains[i] && !strains[j] { stiffness[i][j] } else { 0.0 });
    let Some(within) = block.cholesky().map(|factor| coupling.transpose() * factor.solve(&coupling)) else {
        return *stiffness;
    };
    let entry = |i: usize, j: usize| match (strains[i], strains[j]) {
        (false, false) => stiffness[i][j] + (RIGID - 1.0) * within[(i, j)],
        (true, _) | (_, true) => RIGID * stiffness[i][j],
    };
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

/// Matrices about a line from which the origin of the section is seen at `offset`, in axes against
/// which the section is turned by `turn` from axis 2 towards axis 3.
fn placed(section: SectionMatrices, offset: [f64; 2], [turn]: [f64; 1]) -> SectionMatrices {
    let own = Matrix6::from_fn(|i, j| section.stiffness[i][j]);
    let stiffness = moved(&turned(&own, -turn), offset.map(|x| -x));
    let (sin, cos) = libm::sincos(turn);
    let axes = Mat3([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]]);
    let mass = section.mass.map(|mass| {
        let turned = mass.turned(axes);
        let from_line = turned.offset + Vec3([0.0, offset[0], offset[1]]);
        let Inertia { mass, offset, about_node } = body_inertia(turned.mass, from_line, turned.about_centre());
        MassPerLength { mass, offset, about_line: about_node }
    });
    SectionMatrices { stiffness: std::array::from_fn(|i| std::array::from_fn(|j| stiffness[(i, j)])), mass }
}

fn mix(a: f64, b: f64, s: f64) -> f64 {
    a + (b - a) * s
}

fn mix_each(a: [f64; 2], b: [f64; 2], s: f64) -> [f64; 2] {
    [0, 1].map(|k| mix(a[k], b[k], s))
}

/// The shape between two of one kind, with dimensions linear along the way.
fn blend_shapes([a, b]: [Shape; 2], s: f64) -> Shape {
    match (a, b) {
        (Shape::Circle { radius: a }, Shape::Circle { radius: b }) => Shape::Circle { radius: mix(a, b, s) },
        (Shape::Tube { radius: a, thickness: ta }, Shape::Tube { radius: b, thickness: tb }) => {
            Shape::Tube { radius: mix(a, b, s), thickness: mix(ta, tb, s) }
        }
        (Shape::Rectangle { width: wa, height: ha }, Shape::Rectangle { width: wb, height: hb }) => {
            Shape::Rectangle { width: mix(wa, wb, s), height: mix(ha, hb, s) }
        }
        (other, _) => other,
    }
}

fn blend(a: &SectionMatrices, b: &SectionMatrices, s: f64) -> SectionMatrices {
    let stiffness = std::array::from_fn(|i| std::array::from_fn(|j| mix(a.stiffness[i][j], b.stiffness[i][j], s)));
    let mass = a.mass.zip(b.mass).map(|(a, b)| {
        let mass = mix(a.mass, b.mass, s);
        let first = a.offset * (a.mass * (1.0 - s)) + b.offset * (b.mass * s);
        MassPerLength {
            mass,
            offset: if mass > 0.0 { first * (1.0 / mass) } else { Vec3::ZERO },
            about_line: a.about_line * (1.0 - s) + b.about_line * s,
        }
    });
    SectionMatrices { stiffness, mass }
}

/// The matrices of a section of the deck.
pub fn matrices(section: &deck::Section, deck: &Deck) -> Result<SectionMatrices, Diagnostic> {
    let span = &section.name.span;
    match &section.body {
        SectionBody::Resultants { stiffness, mass, rotary } => {
            let diagonal = Mat3::diagonal(rotary.unwrap_or([0.0; 3]));
            let mass = match (mass, rotary) {
                (None, None) => None,
                (mass, _) => {
                    Some(MassPerLength { mass: mass.unwrap_or(0.0), offset: Vec3::ZERO, about_line: diagonal })
                }
            };
            Ok(SectionMatrices { mass, ..SectionMatrices::diagonal(*stiffness) })
        }
        SectionBody::Full { stiffness, mass } => full(section, stiffness, mass.as_ref(), span),
        SectionBody::Computed(body) => Ok(computed::solve(section, body, deck)?.matrices),
    }
}

/// A circle, tube or rectangle of an isotropic material: its matrices and stresses have closed forms.
#[derive(Clone, Copy, Debug)]
pub struct PlainSection {
    /// Shape and dimensions
    pub(super) shape: Shape,
    /// Constants of the material, with Poisson's ratio as [`contraction`] has it
    pub(super) elastic: Isotropic,
    /// Density, where given
    density: Option<f64>,
    /// Shear factors along 2 and 3, if not Cowper's
    shear_factor: Option<ShearFactor>,
    /// The point of the shape through which the line of the beam goes
    pub(super) place: [f64; 2],
    /// Turn of the shape about the line of the beam, from axis 2 towards axis 3, rad
    pub(super) turn: f64,
}

impl PlainSection {
    /// A section that has closed forms; `None` for others.
    pub fn of(section: &deck::Section, deck: &Deck) -> Result<Option<Self>, Diagnostic> {
        let SectionBody::Computed(body) = &section.body else { return Ok(None) };
        let Some((shape, material)) = body.solid_without_mesh() else { return Ok(None) };
        let found = find_material(material, &deck.materials)?;
        let Elastic::Isotropic(elastic) = found.elastic else { return Ok(None) };
        let elastic = Isotropic { poisson: contraction(&elastic), ..elastic };
        let deck::ComputedSection { shear_factor, turn, .. } = **body;
        let place = body.place_of_solid();
        Ok(Some(Self { shape, elastic, density: found.density, shear_factor, place, turn }))
    }

    /// Stiffness and mass about the line of the beam.
    pub fn matrices(&self) -> SectionMatrices {
        let own = shaped(self.shape, self.elastic, self.density, self.shear_factor);
        if self.place == [0.0; 2] && self.turn == 0.0 {
            return own;
        }
        computed::about_line(&Closed::of(&own), self.place, self.turn, own.mass.is_some())
    }
}

/// Two sections with closed forms, of one kind of shape and one material: between them dimensions,
/// place and turn are linear.
#[derive(Clone, Debug)]
pub struct Taper {
    ends: [PlainSection; 2],
}

impl Taper {
    /// Between two sections of the deck; `None` where the sections between have no closed form.
    pub fn new(ends: [&deck::Section; 2], deck: &Deck) -> Result<Option<Self>, Diagnostic> {
        let [Some(a), Some(b)] = [PlainSection::of(ends[0], deck)?, PlainSection::of(ends[1], deck)?] else {
            return Ok(None);
        };
        let [material, other] = ends.map(|section| solid_material(section).map(|name| &name.value));
        let alike = std::mem::discriminant(&a.shape) == std::mem::discriminant(&b.shape) && material == other;
        let has_factors = blend_factors([a.shear_factor, b.shear_factor], 0.0).is_some();
        Ok((alike && has_factors).then_some(Self { ends: [a, b] }))
    }

    /// The section at a part of the way.
    pub fn at(&self, s: f64) -> PlainSection {
        let [a, b] = self.ends;
        let shear_factor = blend_factors([a.shear_factor, b.shear_factor], s).flatten();
        let place = mix_each(a.place, b.place, s);
        let turn = mix(a.turn, b.turn, s);
        PlainSection { shape: blend_shapes([a.shape, b.shape], s), shear_factor, place, turn, ..a }
    }
}

/// The name of the material of a circle, tube or rectangle without a wanted mesh; `None` for others.
pub fn solid_material(section: &deck::Section) -> Option<&Spanned<String>> {
    match &section.body {
        SectionBody::Computed(body) => body.solid_without_mesh().map(|(_, material)| material),
        SectionBody::Resultants { .. } | SectionBody::Full { .. } => None,
    }
}

/// The shear factors at a part of the way between two; `None` where both are of different kinds.
fn blend_factors([a, b]: [Option<ShearFactor>; 2], s: f64) -> Option<Option<ShearFactor>> {
    match (a, b) {
        (None, None) => Some(None),
        (Some(ShearFactor::Energy), Some(ShearFactor::Energy)) => Some(Some(ShearFactor::Energy)),
        (Some(ShearFactor::Given(a)), Some(ShearFactor::Given(b))) => Some(Some(ShearFactor::Given(mix_each(a, b, s)))),
        (None, Some(ShearFactor::Energy | ShearFactor::Given(_)))
        | (Some(ShearFactor::Energy | ShearFactor::Given(_)), None)
        | (Some(ShearFactor::Energy), Some(ShearFactor::Given(_)))
        | (Some(ShearFactor::Given(_)), Some(ShearFactor::Energy)) => None,
    }
}

/// Refuses resultants of a shape that no floating-point number holds.
pub fn within_range(found: SectionMatrices, section: &deck::Section) -> Result<SectionMatrices, Diagnostic> {
    let is_finite = found.stiffness.iter().flatten().all(|entry| entry.is_finite());
    let stiff = is_finite && (0..6).all(|k| found.stiffness[k][k] > 0.0);
    let heavy = found.mass.as_ref().is_none_or(|mass| mass.mass.is_finite() && mass.about_line.max_abs().is_finite());
    if stiff && heavy {
        return Ok(found);
    }
    let name = &section.name;
    let message =
        format!("the stiffness or mass of section `{}` is beyond the range of floating-point numbers", name.value);
    Err(Diagnostic::error(message, name.span.clone()).help("check its dimensions and its material"))
}

/// The course of a taper between two sections.
pub fn taper(ends: [&deck::Section; 2], deck: &Deck) -> Result<SectionCourse, Diagnostic> {
    // Between the ends nothing is larger, or smaller, than at both.
    let matrices = [matrices(ends[0], deck)?, matrices(ends[1], deck)?];
    Ok(match Taper::new(ends, deck)? {
        Some(taper) => SectionCourse::Shaped(Box::new(taper)),
        None => SectionCourse::Blended(matrices),
    })
}

/// The largest part by which a stiffness that is linear between two computed sections would exceed
/// that of linear dimensions, with whose fourth power it grows; `None` where it is not linear, or
/// where it was given in numbers.
pub fn excess_of_taper(ends: [&deck::Section; 2], deck: &Deck) -> Option<f64> {
    let is_computed = |section: &&deck::Section| matches!(section.body, SectionBody::Computed(_));
    if !ends.iter().all(is_computed) || Taper::new(ends, deck).ok()?.is_some() {
        return None;
    }
    let [a, b] = [matrices(ends[0], deck).ok()?, matrices(ends[1], deck).ok()?];
    let excess = |k: usize| {
        let ratio = b.stiffness[k][k] / a.stiffness[k][k];
        // (1 + r s)/(1 + d s)^4 is largest at this part of the way.
        let (r, d) = (ratio - 1.0, libm::pow(ratio, 0.25) - 1.0);
        let s = if r == 0.0 { 0.5 } else { (r - 4.0 * d) / (3.0 * r * d) };
        (1.0 + r * s) / fourth(1.0 + d * s) - 1.0
    };
    (0..6).map(excess).max_by(f64::total_cmp)
}

/// Poisson's ratio of a material in sections with closed forms. E and G of materials that are not
/// isotropic, such as timber along its grain, give one that is impossible: their fibres hinder the
/// contraction of the section, which is left out.
pub fn contraction(elastic: &Isotropic) -> f64 {
    if elastic.poisson <= LARGEST_POISSON { elastic.poisson } else { 0.0 }
}

/// The material with this name.
pub fn find_material<'a>(
    name: &Spanned<String>,
    materials: &'a [deck::Material],
) -> Result<&'a deck::Material, Diagnostic> {
    materials
        .iter()
        .find(|m| m.name.value == name.value)
        .ok_or_else(|| super::names::unknown("material", name, materials.iter().map(|m| m.name.value.as_str())))
}

fn full(
    section: &deck::Section,
    stiffness: &[[f64; 6]; 6],
    mass: Option<&[[f64; 6]; 6]>,
    span: &Span,
) -> Result<SectionMatrices, Diagnostic> {
    let name = &section.name.value;
    if Matrix6::from_fn(|i, j| stiffness[i][j]).cholesky().is_none() {
        let message = format!("`stiffness` of section `{name}` must be positive definite");
        return Err(Diagnostic::error(message, span.clone()));
    }
    let mass = match mass {
        None => None,
        Some(mass) => Some(mass_properties(mass).map_err(|why| {
            Diagnostic::error(format!("`mass` of section `{name}` {why}"), span.clone())
                .help("a mass matrix is [m I, -m d~; m d~, J] with the mass m, the mass centre d and the inertia J about the centre line")
        })?),
    };
    Ok(SectionMatrices { stiffness: *stiffness, mass })
}

/// m, d and J of [m I, -m d~; m d~, J].
fn mass_properties(matrix: &[[f64; 6]; 6]) -> Result<MassPerLength, String> {
    let m = matrix[0][0];
    let scale = matrix.iter().flatten().fold(0.0_f64, |s, v| s.max(v.abs()));
    let mut first = Vec3::ZERO;
    if m > 0.0 {
        first = Vec3([matrix[5][1], matrix[3][2], matrix[4][0]]);
    }
    let coupling = first.skew();
    for i in 0..3 {
        for j in 0..3 {
            let translation = if i == j { m } else { 0.0 };
            let off = (matrix[i][j] - translation).abs().max((matrix[3 + i][j] - coupling.0[i][j]).abs());
            if off > 1e-9 * scale {
                return Err("is not the mass of a rigid section".into());
            }
        }
    }
    let eigen = SymmetricEigen::new(Matrix6::from_fn(|i, j| matrix[i][j]));
    if eigen.eigenvalues.min() < -1e-12 * scale {
        return Err("must not have negative eigenvalues".into());
    }
    let about_line = Mat3([0, 1, 2].map(|i| [0, 1, 2].map(|j| matrix[3 + i][3 + j])));
    Ok(MassPerLength { mass: m, offset: if m > 0.0 { first * (1.0 / m) } else { first }, about_line })
}

/// EA, GA with Cowper's (1966) shear factors, GJ with Saint-Venant torsion, EI.
fn shaped(
    shape: Shape,
    material: Isotropic,
    density: Option<f64>,
    shear_factor: Option<ShearFactor>,
) -> SectionMatrices {
    let Geometry { area, bending, torsion, shear } = geometry(shape, material.poisson);
    let [k2, k3] = match shear_factor {
        None => shear,
        Some(ShearFactor::Given(factors)) => factors,
        Some(ShearFactor::Energy) => shear_factors_of_energy(shape, material.poisson),
    };
    let e = material.young;
    let g = material.shear;
    let diagonal = [e * area, g * area * k2, g * area * k3, g * torsion, e * bending[0], e * bending[1]];
    let mass = density.map(|rho| MassPerLength {
        mass: rho * area,
        offset: Vec3::ZERO,
        about_line: Mat3::diagonal([bending[0] + bending[1], bending[0], bending[1]].map(|i| rho * i)),
    });
    SectionMatrices { mass, ..SectionMatrices::diagonal(diagonal) }
}

fn cube(x: f64) -> f64 {
    x * x * x
}

fn fourth(x: f64) -> f64 {
    x * x * x * x
}

struct Geometry {
    area: f64,
    /// Second moments of area about axes 2 and 3
    bending: [f64; 2],
    torsion: f64,
    /// Shear factors along 2 and 3
    shear: [f64; 2],
}

fn geometry(shape: Shape, nu: f64) -> Geometry {
    match shape {
        Shape::Circle { radius } => {
            let second = PI * fourth(radius) / 4.0;
            let factor = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu);
            Geometry { area: PI * radius * radius, bending: [second; 2], torsion: 2.0 * second, shear: [factor; 2] }
        }
        Shape::Tube { radius, thickness } => {
            let inner = radius - thickness;
            let second = PI * (fourth(radius) - fourth(inner)) / 4.0;
            let m = inner / radius;
            let m2 = (1.0 + m * m) * (1.0 + m * m);
            let factor = 6.0 * (1.0 + nu) * m2 / ((7.0 + 6.0 * nu) * m2 + (20.0 + 12.0 * nu) * m * m);
            Geometry {
                area: PI * (radius * radius - inner * inner),
                bending: [second; 2],
                torsion: 2.0 * second,
                shear: [factor; 2],
            }
        }
        Shape::Rectangle { width, height } => {
            let factor = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu);
            Geometry {
                area: width * height,
                bending: [width * cube(height) / 12.0, height * cube(width) / 12.0],
                torsion: rectangle_torsion(width, height),
                shear: [factor; 2],
            }
        }
    }
}

/// Saint-Venant torsion constant of a rectangle (Timoshenko & Goodier, Theory of Elasticity, art.
/// 109): a b^3 [1/3 - (64/pi^5)(b/a) sum tanh(n pi a / 2b)/n^5] over odd n, with a >= b.
fn rectangle_torsion(width: f64, height: f64) -> f64 {
    let a = width.max(height);
    let b = width.min(height);
    let term = |n: f64| libm::tanh(n * PI * a / (2.0 * b)) / (n * fourth(n));
    let sum: f64 = (0..200).map(|k| term(2.0 * f64::from(k) + 1.0)).sum();
    a * cube(b) * (1.0 / 3.0 - 64.0 / (PI * fourth(PI)) * (b / a) * sum)
}

/// Shear factors of the energy of Saint-Venant flexure (Renton 1991).
fn shear_factors_of_energy(shape: Shape, nu: f64) -> [f64; 2] {
    let ring = |m: f64| {
        let square = (1.0 + nu) * (1.0 + nu);
        let m2 = (1.0 + m * m) * (1.0 + m * m);
        let solid = 7.0 + 14.0 * nu + 8.0 * nu * nu;
        let hole = 5.0 + 10.0 * nu + 4.0 * nu * nu;
        6.0 * square * m2 / (solid * m2 + 4.0 * hole * m * m)
    };
    match shape {
        Shape::Circle { .. } => [ring(0.0); 2],
        Shape::Tube { radius, thickness } => [ring((radius - thickness) / radius); 2],
        Shape::Rectangle { width, height } => [rectangle_shear(width, height, nu), rectangle_shear(height, width, nu)],
    }
}

/// The shear factor of a rectangle from the energy of Saint-Venant flexure, for a force along its
/// side `depth`: 1 / (6/5 + A c^2 sum b_n^2 b/k^2 (2a - 2 tanh(k a)/k)) with a and b the half
/// sides, k = n pi / b, b_n = 2b / (n pi) and c = nu / ((1 + nu) I).
fn rectangle_shear(depth: f64, width: f64, nu: f64) -> f64 {
    let b = 0.5 * width;
    let c = 12.0 * nu / ((1.0 + nu) * width * cube(depth));
    let term = |n: f64| {
        let k = n * PI / b;
        let coefficient = 2.0 * b / (n * PI);
        coefficient * coefficient * (b / (k * k)) * (depth - 2.0 * libm::tanh(0.5 * k * depth) / k)
    };
    let sum: f64 = (1..=200).map(|n| term(f64::from(n))).sum();
    1.0 / (1.2 + width * depth * c * c * sum)
}

/// Stiffness and mass about the middle of a shape with a closed form, or about the origin of one
/// that was computed.
pub struct Closed {
    /// 6x6 stiffness
    pub(super) stiffness: Matrix6<f64>,
    /// 6x6 mass; zero where there is none
    pub(super) mass: Matrix6<f64>,
}

impl Closed {
    /// From matrices whose mass centre is their origin.
    pub fn of(found: &SectionMatrices) -> Self {
        let MassPerLength { mass, about_line, .. } = found.mass_per_length();
        let mass = Matrix6::from_fn(|i, j| match (i < 3, j < 3) {
            (true, true) if i == j => mass,
            (false, false) => about_line.0[i - 3][j - 3],
            (true, _) | (_, true) => 0.0,
        });
        Self { stiffness: Matrix6::from_fn(|i, j| found.stiffness[i][j]), mass }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stiffened_strains_keep_centres_torsion_and_bending() {
        // A symmetric positive definite matrix that couples all strains.
        let root = Matrix6::from_fn(|i, j| if i == j { 3.0 } else { ((7 * i + 5 * j) as f64).sin() });
        let plain = root * root.transpose();
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| plain[(i, j)]));
        for strains in [[true, false, false, false, false, false], [false, true, true, false, false, false]] {
            let stiff = stiffened(&rows, &strains);
            let stiff = Matrix6::from_fn(|i, j| stiff[i][j]);
            let [before, after] = [plain, stiff].map(|matrix| matrix.try_inverse().expect("it is positive definite"));
            for (i, j) in (0..36).map(|k| (k / 6, k % 6)) {
                if !(strains[i] && strains[j]) {
                    assert!((after[(i, j)] - before[(i, j)]).abs() < 1e-12, "{strains:?} {i} {j}");
                } else {
                    assert!((stiff[(i, j)] - RIGID * plain[(i, j)]).abs() < 1e-12 * RIGID, "{strains:?} {i} {j}");
                }
            }
        }
    }

    #[test]
    fn torsion_of_rectangles_agrees_with_the_published_table() {
        // Timoshenko & Goodier, Theory of Elasticity, table of k1 for b/a = 1, 2, 10.
        for (ratio, k1) in [(1.0, 0.1406), (2.0, 0.229), (10.0, 0.312)] {
            assert!((rectangle_torsion(ratio, 1.0) / ratio - k1).abs() < 6e-4, "{ratio}");
        }
    }

    #[test]
    fn shear_factors_of_energy_are_those_of_the_theory() {
        // Renton 1991 and finite elements, Poisson's ratio 0.3.
        for (depth, width, factor) in
            [(1.0, 1.0, 0.82822), (2.0, 1.0, 0.83294), (1.0, 2.0, 0.78444), (1.0, 10.0, 0.17913)]
        {
            assert!((rectangle_shear(depth, width, 0.3) - factor).abs() < 2e-5, "{depth} {width}");
        }
        let [circle, _] = shear_factors_of_energy(Shape::Circle { radius: 1.0 }, 0.3);
        let [tube, _] = shear_factors_of_energy(Shape::Tube { radius: 1.0, thickness: 0.5 }, 0.3);
        assert!((circle - 0.85067).abs() < 1e-5 && (tube - 0.58713).abs() < 1e-5);
    }

    #[test]
    fn a_tube_without_a_hole_is_a_circle() {
        let (tube, circle) =
            (geometry(Shape::Tube { radius: 2.0, thickness: 2.0 }, 0.3), geometry(Shape::Circle { radius: 2.0 }, 0.3));
        assert!((tube.area - circle.area).abs() < 1e-14 && (tube.shear[0] - circle.shear[0]).abs() < 1e-15);
    }

    #[test]
    fn mass_matrices_of_rigid_sections_are_understood() {
        let m = 2.0;
        let d = Vec3([0.0, 0.1, -0.2]);
        let j = Mat3::diagonal([3.0, 2.0, 1.5]);
        let coupling = d.skew() * m;
        let mut matrix = [[0.0; 6]; 6];
        for i in 0..3 {
            matrix[i][i] = m;
            for k in 0..3 {
                matrix[3 + i][k] = coupling.0[i][k];
                matrix[k][3 + i] = coupling.0[i][k];
                matrix[3 + i][3 + k] = j.0[i][k];
            }
        }
        let properties = mass_properties(&matrix).unwrap();
        assert_eq!((properties.mass, properties.about_line), (m, j));
        assert!((properties.offset - d).norm() < 1e-16);
        matrix[0][1] = 0.5;
        matrix[1][0] = 0.5;
        assert!(mass_properties(&matrix).is_err());
    }
}
