//! The stresses of a section under the resultants of a beam: the largest over the section of several
//! measures, and those at fixed points. From closed forms, or from a computed section.
//!
//! Resultants N1 N2 N3 M1 M2 M3 of a [`Recovery`] are those about the reference point of the section,
//! in its axes; those of a [`PlacedRecovery`] are about the line of the beam, in the axes of the
//! beam. Places, and stresses at fixed points, are in the coordinates of the shape.

use super::analysis::StressField;
use super::climb::largest_near;
use super::closed::ClosedForm;
use super::material::{material_axes, stress_in_material_axes};
use super::properties::load_about_origin;
use super::search::{Hit, PointTree, Spread};
use super::strength::FailureLaw;
use super::stress::{Corners, Peak, extreme_principal_stresses, von_mises};
use super::unit_peaks::{Parts, UnitPeaks};
use super::{Matrix6, Point, Vector6};
use crate::sorting::sort_by;
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};

/// The part of a value by which a sample of a closed form may be below the largest one between
/// samples
const BETWEEN_SAMPLES: f64 = 0.01;

/// Distance of a point outside a closed form, relative to its size
const INSIDE_TOLERANCE: f64 = 1e-6;

/// Measures of the stress whose largest value over the section is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Von Mises stress
    VonMises,
    /// First principal stress
    FirstPrincipal,
    /// Third principal stress, negative
    MinusThirdPrincipal,
    /// Stress along the beam
    Axial,
    /// Stress along the beam, negative
    MinusAxial,
    /// Largest shear stress on any plane
    Shear,
}

impl Measure {
    const COUNT: usize = 6;

    /// All measures with the names of their columns and the sign of these.
    pub const ALL: [(Self, &str, f64); Self::COUNT] = [
        (Self::VonMises, "vm", 1.0),
        (Self::FirstPrincipal, "s1max", 1.0),
        (Self::MinusThirdPrincipal, "s1min", -1.0),
        (Self::Axial, "s11max", 1.0),
        (Self::MinusAxial, "s11min", -1.0),
        (Self::Shear, "tau", 1.0),
    ];

    fn of(self, s: &Vector6) -> f64 {
        match self {
            Self::VonMises => von_mises(s),
            Self::FirstPrincipal => extreme_principal_stresses(s)[0],
            Self::MinusThirdPrincipal => -extreme_principal_stresses(s)[1],
            Self::Axial => s[0],
            Self::MinusAxial => -s[0],
            Self::Shear => {
                let [first, third] = extreme_principal_stresses(s);
                0.5 * (first - third)
            }
        }
    }
}

/// Measures whose largest value over the rows of a run is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// Von Mises stress
    VonMises,
    /// Failure index
    FailureIndex,
}

impl Criterion {
    const COUNT: usize = 2;
}

/// Bounds of the largest value over a section, from the nodes of a mesh or the samples of a closed
/// form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// A value that a point reaches
    pub(crate) least: f64,
    /// An upper bound of the largest value
    pub(crate) most: f64,
    /// The point that reaches `least`
    pub(crate) at: SearchedPoint,
}

/// A node or sample of a section, among those that are searched for a criterion.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct SearchedPoint {
    /// Number of the law of a material whose points are searched
    search: usize,
    /// Position of the point in the tree of these points
    position: usize,
}

/// Where a shape lies on the beam.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// The point of the shape on the line of the beam, in the coordinates of the stress field
    pub line: Point,
    /// Turn of the shape from axis 2 towards axis 3, rad
    pub turn: f64,
    /// Origin of the stress field in the coordinates of the shape
    pub origin: Point,
}

impl Placement {
    /// Of a section whose origin lies at `offset` from the line of the beam, along axes 2 and 3 of the
    /// beam, and whose axes are turned by `turn`, rad.
    fn beside([x2, x3]: Point, turn: f64) -> Self {
        let (sin, cos) = libm::sincos(turn);
        Self { line: [-(cos * x2 + sin * x3), sin * x2 - cos * x3], turn, origin: [0.0; 2] }
    }

    /// The load of the stress field from resultants of the beam.
    fn to_field(self) -> Matrix6 {
        let (sin, cos) = libm::sincos(self.turn);
        let mut turn = Matrix6::identity();
        for half in [0, 3] {
            turn[(half + 1, half + 1)] = cos;
            turn[(half + 1, half + 2)] = sin;
            turn[(half + 2, half + 1)] = -sin;
            turn[(half + 2, half + 2)] = cos;
        }
        Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|k| {
            load_about_origin(&turn.column(k).into_owned(), self.line)
        }))
    }

    fn in_shape(&self, at: Point) -> Point {
        [at[0] + self.origin[0], at[1] + self.origin[1]]
    }
}

/// Points of the materials of one law, each by its index with the angles beta and theta of its
/// fibres in rad.
type PointsOfLaw = (Option<FailureLaw>, Vec<(u32, [f64; 2])>);

/// A search tree with the spread of one measure, found when it is needed.
#[derive(Clone, Debug)]
struct FailureSearch {
    law: FailureLaw,
    tree: PointTree,
    spread: OnceLock<Spread>,
    /// Number of each point of the tree among all points
    points: Vec<u32>,
}

impl FailureSearch {
    fn spread(&self) -> &Spread {
        self.spread.get_or_init(|| self.tree.spread(|s| self.law.index(s)))
    }
}

/// The stresses of a section.
#[derive(Clone, Debug)]
pub struct Recovery {
    /// Name of the section
    pub name: String,
    /// Names of the regions
    pub regions: Vec<String>,
    /// Points that are left out because they are near a re-entrant corner
    pub left_out: usize,
    closed: Option<ClosedForm>,
    placement: Placement,
    to_field: Matrix6,
    /// Coordinates of the stress field, and region
    points: Vec<(Point, u32)>,
    tree: PointTree,
    spreads: [OnceLock<Spread>; Measure::COUNT],
    failures: Vec<FailureSearch>,
    unit_peaks: [OnceLock<UnitPeaks>; Criterion::COUNT],
}

/// Stresses at a fixed point of a section.
#[derive(Clone, Debug, PartialEq)]
pub struct PointStress {
    /// Stresses under unit resultants, by columns, in the order 11 22 33 23 13 12: in section axes,
    /// or in those of an oriented material
    pub(crate) unit: Matrix6,
}

/// The stresses of a section at a place of a beam: the section may lie beside the line of the beam,
/// and be turned in its axes. Resultants are those about the line, in the axes of the beam.
#[derive(Clone, Debug)]
pub struct PlacedRecovery {
    section: Arc<Recovery>,
    /// From resultants of the beam to those about the origin of the section, in its axes; none if
    /// both are the same
    to_section: Option<Matrix6>,
}

impl PlacedRecovery {
    /// With the origin of the section at `offset` from the line of the beam, along axes 2 and 3 of the
    /// beam, and its axes turned by `turn`, rad.
    pub fn new(section: Arc<Recovery>, offset: Point, turn: f64) -> Self {
        let is_moved = offset != [0.0; 2] || turn != 0.0;
        Self { section, to_section: is_moved.then(|| Placement::beside(offset, turn).to_field()) }
    }

    /// The section, without its place on the beam.
    pub fn section(&self) -> &Recovery {
        &self.section
    }

    /// Resultants of the section from those of the beam.
    pub fn in_section(&self, load: &Vector6) -> Vector6 {
        self.to_section.map_or(*load, |to_section| to_section * load)
    }

    /// The largest value of a measure over the section, if it is above a floor.
    pub fn largest(&self, measure: Measure, load: &Vector6, floor: f64) -> Option<Peak> {
        self.section.largest(measure, &self.in_section(load), floor)
    }

    /// The largest failure index over the section, if it is above a floor.
    pub fn largest_index(&self, load: &Vector6, floor: f64) -> Option<Peak> {
        self.section.largest_index(&self.in_section(load), floor)
    }

    /// Stresses at a fixed point, see [`Recovery::at`].
    pub fn at(&self, at: Point, field: Option<(&StressField, &[bool])>) -> Option<PointStress> {
        let PointStress { unit } = self.section.at(at, field)?;
        Some(PointStress { unit: self.to_section.map_or(unit, |to_section| unit * to_section) })
    }
}

impl Recovery {
    /// Of a closed form.
    pub fn closed(name: &str, form: ClosedForm, placement: Placement, law: Option<FailureLaw>) -> Self {
        let [[u0, u1], [v0, v1]] = form.domain();
        let [columns, rows] = form.samples();
        let last_row = if form.is_closed(1) { rows - 1 } else { rows };
        let along = |i: usize, count: usize, [low, high]: [f64; 2]| low + (high - low) * i as f64 / count as f64;
        let grid = (0..=columns).flat_map(|i| (0..=last_row).map(move |j| [i, j]));
        let point = |[i, j]: [usize; 2]| form.point([along(i, columns, [u0, u1]), along(j, rows, [v0, v1])]);
        let at: Vec<Point> = grid.map(point).collect();
        let units = at.iter().map(|&at| form.unit(at)).collect();
        let count = at.len() as u32;
        let points = at.into_iter().map(|at| (at, 0)).collect();
        let laws = vec![(law, (0..count).map(|number| (number, [0.0; 2])).collect())];
        Self::new(name, vec![name.to_string()], placement, points, units, laws).with_closed(form)
    }

    fn with_closed(self, form: ClosedForm) -> Self {
        Self { closed: Some(form), ..self }
    }

    /// Of a computed section. `laws` are those of the materials, by their index.
    pub fn computed(
        name: &str,
        StressField { mesh, nodal: stresses, .. }: &StressField,
        placement: Placement,
        corners: Corners,
        laws: &[Option<FailureLaw>],
    ) -> Self {
        let kept = stresses.kept(mesh, corners);
        let mut by_law: Vec<PointsOfLaw> = laws.iter().map(|law| (law.clone(), Vec::new())).collect();
        let mut points = Vec::new();
        let mut units = Vec::new();
        for &index in &kept {
            let place = stresses.places[index];
            let at = mesh.nodes[place.node as usize];
            let region = &mesh.regions[place.region as usize];
            by_law[region.material].1.push((points.len() as u32, [region.tangent.beta(at), region.theta]));
            points.push((at, place.region));
            units.push(stresses.unit[index]);
        }
        let regions = mesh.regions.iter().map(|region| region.name.clone()).collect();
        let left_out = stresses.places.len() - kept.len();
        Self { left_out, ..Self::new(name, regions, placement, points, units, by_law) }
    }

    /// From points with unit stresses of the field, and for each material its law with the points
    /// that have it and their angles beta and theta.
    fn new(
        name: &str,
        regions: Vec<String>,
        placement: Placement,
        points: Vec<(Point, u32)>,
        mut units: Vec<Matrix6>,
        laws: Vec<PointsOfLaw>,
    ) -> Self {
        let to_field = placement.to_field();
        units.iter_mut().for_each(|unit| *unit *= to_field);
        let at: Vec<Point> = points.iter().map(|&(at, _)| at).collect();
        let kind: Vec<usize> = points.iter().map(|&(_, region)| region as usize).collect();
        let tree = PointTree::new(&at, &kind, &units);
        let failures = laws.into_iter().filter_map(|(law, members)| {
            let law = law?;
            let of = |values: &[usize]| members.iter().map(|&(k, _)| values[k as usize]).collect::<Vec<_>>();
            let own_at: Vec<Point> = members.iter().map(|&(k, _)| at[k as usize]).collect();
            let own: Vec<Matrix6> =
                members.iter().map(|&(k, angles)| in_material_axes(&units[k as usize], angles)).collect();
            let tree = PointTree::new(&own_at, &of(&kind), &own);
            let points = members.iter().map(|&(k, _)| k).collect();
            Some(FailureSearch { law, tree, spread: OnceLock::new(), points })
        });
        let failures = failures.collect();
        Self {
            name: name.to_string(),
            regions,
            left_out: 0,
            closed: None,
            placement,
            to_field,
            points,
            tree,
            spreads: std::array::from_fn(|_| OnceLock::new()),
            failures,
            unit_peaks: [const { OnceLock::new() }; Criterion::COUNT],
        }
    }

    /// The load of the stress field of a computed section from resultants of the beam.
    pub fn field_load(&self, resultants: &Vector6) -> Vector6 {
        self.to_field * resultants
    }

    /// True if a material of the section has a strength.
    pub fn has_strength(&self) -> bool {
        !self.failures.is_empty()
    }

    /// The largest value of a criterion over the section, if it is above a floor.
    pub fn largest_of(&self, criterion: Criterion, load: &Vector6, floor: f64) -> Option<Peak> {
        match criterion {
            Criterion::VonMises => self.largest(Measure::VonMises, load, floor),
            Criterion::FailureIndex => self.largest_index(load, floor),
        }
    }

    /// The largest values of a criterion under unit resultants, from which bounds follow.
    pub fn unit_peaks(&self, criterion: Criterion) -> &UnitPeaks {
        self.unit_peaks[criterion as usize].get_or_init(|| {
            let value =
                |load: &Vector6| self.largest_of(criterion, load, f64::NEG_INFINITY).map_or(0.0, |peak| peak.value);
            UnitPeaks::new(value, self.parts(criterion))
        })
    }

    /// The way in which values of parts of a load bound the value of the load.
    fn parts(&self, criterion: Criterion) -> Parts {
        let is_von_mises = match criterion {
            Criterion::VonMises => true,
            Criterion::FailureIndex => self.failures.iter().all(|search| search.law.is_yield_alone()),
        };
        match (is_von_mises, self.closed) {
            (true, Some(form)) => {
                let is_central = self.placement.line == [0.0; 2];
                Parts::AxialAndShear { is_round: is_central && form.is_closed(1) }
            }
            (true, None) => Parts::Even,
            (false, _) => Parts::Any,
        }
    }

    /// The largest value of a measure over the section, if it is above a floor.
    pub fn largest(&self, measure: Measure, load: &Vector6, floor: f64) -> Option<Peak> {
        self.search(&self.tree, self.spread(measure), &|s| measure.of(s), load, floor, None)
    }

    /// Bounds of the largest value of a criterion over the section, if it may be above a floor that is
    /// not negative.
    pub fn estimate(&self, criterion: Criterion, load: &Vector6, floor: f64) -> Option<Estimate> {
        let missed = if self.closed.is_some() { BETWEEN_SAMPLES } else { 0.0 };
        let mut found: Option<Estimate> = None;
        let mut look = |tree: &PointTree, spread: &Spread, measure: &dyn Fn(&Vector6) -> f64, search: usize| {
            let below = found.map_or((1.0 - missed) * floor, |found| found.least);
            let Some(Hit { value, position, .. }) = tree.largest(spread, measure, load, below) else { return };
            let at = SearchedPoint { search, position };
            found = Some(Estimate { least: value, most: value / (1.0 - missed), at });
        };
        match criterion {
            Criterion::VonMises => look(&self.tree, self.spread(Measure::VonMises), &von_mises, 0),
            Criterion::FailureIndex => {
                for (number, search) in self.failures.iter().enumerate() {
                    look(&search.tree, search.spread(), &|s| search.law.index(s), number);
                }
            }
        }
        found
    }

    /// The value of a criterion at a point that an estimate for this criterion has told.
    pub fn value_at(
        &self,
        criterion: Criterion,
        SearchedPoint { search, position }: SearchedPoint,
        load: &Vector6,
    ) -> f64 {
        match criterion {
            Criterion::VonMises => von_mises(&self.tree.stress(position, load)),
            Criterion::FailureIndex => {
                self.failures.get(search).map_or(0.0, |search| search.law.index(&search.tree.stress(position, load)))
            }
        }
    }

    /// The strength by which the failure index of the section is its largest von Mises stress, if
    /// nothing else counts at any of its points.
    pub fn yield_stress_alone(&self) -> Option<f64> {
        let [search] = &self.failures[..] else { return None };
        let is_everywhere = search.points.len() == self.points.len();
        search.law.yield_stress.filter(|_| is_everywhere && search.law.is_yield_alone())
    }

    fn spread(&self, measure: Measure) -> &Spread {
        self.spreads[measure as usize].get_or_init(|| self.tree.spread(|s| measure.of(s)))
    }

    /// The largest failure index over the section, if it is above a floor.
    pub fn largest_index(&self, load: &Vector6, floor: f64) -> Option<Peak> {
        let mut best: Option<Peak> = None;
        for search in &self.failures {
            let FailureSearch { law, tree, points, .. } = search;
            let floor = best.map_or(floor, |best| best.value);
            if let Some(found) = self.search(tree, search.spread(), &|s| law.index(s), load, floor, Some(points)) {
                best = Some(found);
            }
        }
        best
    }

    /// The largest value among the points of a tree, if it is above a floor; `points` are their
    /// numbers, if they are some of all points. A closed form has one material, and all points.
    fn search(
        &self,
        tree: &PointTree,
        spread: &Spread,
        measure: &dyn Fn(&Vector6) -> f64,
        load: &Vector6,
        floor: f64,
        points: Option<&[u32]>,
    ) -> Option<Peak> {
        if let Some(form) = self.closed {
            return self.between_samples(form, tree, spread, measure, load, floor);
        }
        let hit = tree.largest(spread, measure, load, floor)?;
        let point = points.map_or(hit.point, |points| points[hit.point] as usize);
        Some(self.peak(Hit { point, ..hit }))
    }

    fn peak(&self, hit: Hit) -> Peak {
        let (at, region) = self.points[hit.point];
        Peak { value: hit.value, at: self.placement.in_shape(at), region: region as usize }
    }

    /// The largest value of a closed form: from the best samples by parabolas through neighbours,
    /// with the exact stress there.
    fn between_samples(
        &self,
        form: ClosedForm,
        tree: &PointTree,
        spread: &Spread,
        measure: &dyn Fn(&Vector6) -> f64,
        load: &Vector6,
        floor: f64,
    ) -> Option<Peak> {
        let below = |value: f64| value - BETWEEN_SAMPLES * value.abs();
        let first = tree.largest(spread, measure, load, below(floor))?;
        let mut hits = tree.above(spread, measure, load, below(first.value));
        sort_by(&mut hits, |a, b| b.value.total_cmp(&a.value).then(a.point.cmp(&b.point)));
        if hits.is_empty() {
            hits.push(first);
        }
        let in_field = self.to_field * load;
        let value_at = |point: Point| measure(&form.stress(&in_field, point));
        let samples = hits.iter().map(|hit| hit.point);
        let (found, at) = largest_near(form, samples, &value_at)?;
        let (value, at) = if found > first.value { (found, at) } else { (first.value, self.points[first.point].0) };
        (value > floor).then(|| Peak { value, at: self.placement.in_shape(at), region: 0 })
    }

    /// Stresses at a fixed point in the coordinates of the shape; `None` outside the section.
    /// `field` is that of a computed section with, for each region, true if its material is
    /// oriented.
    pub fn at(&self, at: Point, field: Option<(&StressField, &[bool])>) -> Option<PointStress> {
        let at = [at[0] - self.placement.origin[0], at[1] - self.placement.origin[1]];
        let unit = match (self.closed, field) {
            (Some(form), _) => form.contains(at, INSIDE_TOLERANCE).then(|| form.unit(at) * self.to_field)?,
            (None, None) => return None,
            (None, Some((field, is_oriented))) => {
                let probes = field.nodal.probe(&field.mesh, at);
                let probe = probes.iter().min_by_key(|probe| probe.region)?;
                let unit = probe.unit * self.to_field;
                let angles = [probe.beta, probe.theta];
                if is_oriented[probe.region] { in_material_axes(&unit, angles) } else { unit }
            }
        };
        Some(PointStress { unit })
    }
}

/// Unit stresses in the axes of a material with angles beta and theta.
fn in_material_axes(unit: &Matrix6, [beta, theta]: [f64; 2]) -> Matrix6 {
    let axes = material_axes(beta, theta);
    Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|k| {
        stress_in_material_axes(&unit.column(k).into_owned(), &axes)
    }))
}

#[cfg(test)]
mod tests {
    use super::super::closed::ClosedShape;
    use super::*;
    use std::f64::consts::PI;

    fn ring(inner: f64) -> Recovery {
        let form = ClosedForm::new(ClosedShape::Ring { radii: [inner, 1.0] }, 0.3);
        Recovery::closed("ring", form, Placement::default(), None)
    }

    #[test]
    fn bending_about_any_axis_with_torsion_is_exact() {
        for angle in [0.0, 0.03, 0.7, 2.0] {
            let (sin, cos) = libm::sincos(angle);
            let load = Vector6::new(0.5, 0.0, 0.0, 3.0, 2.0 * cos, 2.0 * sin);
            let found = ring(0.4).largest(Measure::VonMises, &load, 0.0).expect("a value");
            let second = 0.25 * PI * (1.0 - 0.4_f64.powi(4));
            let axial = 0.5 / (PI * (1.0 - 0.16)) + 2.0 / second;
            let shear = 3.0 / (2.0 * second);
            let exact = (axial * axial + 3.0 * shear * shear).sqrt();
            assert!((found.value / exact - 1.0).abs() < 1e-8, "{angle}: {} {exact}", found.value);
        }
    }

    #[test]
    fn the_largest_value_is_that_of_a_fine_grid() {
        let wave = |i: usize| libm::sin(78.233 * i as f64) * 43758.5453 % 1.0;
        let shapes = [
            ClosedShape::Ring { radii: [0.0, 1.0] },
            ClosedShape::Ring { radii: [0.7, 1.0] },
            ClosedShape::Rectangle { half: [0.5, 1.0] },
        ];
        for (number, shape) in shapes.into_iter().enumerate() {
            let form = ClosedForm::new(shape, 0.3);
            let section = Recovery::closed("s", form, Placement::default(), None);
            let [[u0, u1], [v0, v1]] = form.domain();
            let fine: Vec<Matrix6> = (0..=60)
                .flat_map(|i| (0..=120).map(move |j| [i, j]))
                .map(|[i, j]| {
                    let u = u0 + (u1 - u0) * f64::from(i) / 60.0;
                    form.unit(form.point([u, v0 + (v1 - v0) * f64::from(j) / 120.0]))
                })
                .collect();
            for case in 0..20 {
                let load = Vector6::from_fn(|i, _| wave(200 * number + 6 * case + i) * if i < 3 { 5.0 } else { 1.0 });
                let on_grid = fine.iter().map(|unit| von_mises(&(unit * load))).fold(0.0, f64::max);
                let found = section.largest(Measure::VonMises, &load, 0.0).expect("a value");
                assert!(found.value > on_grid * (1.0 - 1e-5), "{shape:?} {case}: {} {on_grid}", found.value);
                assert!(found.value < on_grid * 1.003, "{shape:?} {case}: {} {on_grid}", found.value);
                let again = section.largest(Measure::VonMises, &load, found.value * (1.0 - 1e-9));
                assert_eq!(again, Some(found));
                assert_eq!(section.largest(Measure::VonMises, &load, found.value), None);
            }
        }
    }

    #[test]
    fn a_section_beside_the_line_sees_moments_about_its_origin() {
        let form = ClosedForm::new(ClosedShape::Rectangle { half: [1.0, 2.0] }, 0.3);
        let section = Arc::new(Recovery::closed("s", form, Placement::default(), None));
        // Tension along the line bends a section that lies above it, and pulls most at its lower side.
        let pulled = Vector6::ith(0, 1.0);
        let above = PlacedRecovery::new(section.clone(), [0.0, 3.0], 0.0);
        let found = above.largest(Measure::Axial, &pulled, 0.0).expect("a value");
        assert!((found.value - (1.0 / 8.0 + 3.0 * 2.0 / (32.0 / 3.0))).abs() < 1e-12, "{found:?}");
        assert!((found.at[1] + 2.0).abs() < 1e-12, "{found:?}");
        // Turned by a right angle, its axis 2 points to 3 of the beam: the side at -1 is the lower one.
        let turned = PlacedRecovery::new(section, [0.0, 3.0], 0.5 * PI);
        let found = turned.largest(Measure::Axial, &pulled, 0.0).expect("a value");
        assert!((found.value - (1.0 / 8.0 + 3.0 / (8.0 / 3.0))).abs() < 1e-12, "{found:?}");
        let lower = turned.at([-1.0, 0.0], None).expect("a point");
        assert!((lower.unit[(0, 0)] - found.value).abs() < 1e-12, "{lower:?}");
    }

    #[test]
    fn offset_and_turn_of_a_beam_are_those_of_a_section() {
        let form = ClosedForm::new(ClosedShape::Rectangle { half: [1.0, 2.0] }, 0.3);
        let turn = 0.4;
        let own = Arc::new(Recovery::closed("s", form, Placement::default(), None));
        let placement = Placement::beside([0.7, -0.2], turn);
        let other = Recovery::closed("s", form, placement, None);
        let placed = PlacedRecovery::new(own, [0.7, -0.2], turn);
        for k in 0..6 {
            let load = Vector6::from_fn(|i, _| if i == k { 1.0 } else { 0.1 });
            let [a, b] = [placed.largest(Measure::VonMises, &load, 0.0), other.largest(Measure::VonMises, &load, 0.0)];
            let [a, b] = [a, b].map(|peak| peak.expect("a value").value);
            assert!((a - b).abs() < 1e-6 * b, "{k}: {a} {b}");
        }
    }

    #[test]
    fn a_turned_section_sees_turned_resultants() {
        let form = ClosedForm::new(ClosedShape::Rectangle { half: [1.0, 2.0] }, 0.3);
        let turn = Placement { turn: 0.5 * PI, ..Placement::default() };
        let section = Recovery::closed("s", form, turn, None);
        // Depth 4 of the shape now lies along -2 of the beam: a moment about 3 bends it the strong way.
        let load = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let found = section.largest(Measure::Axial, &load, 0.0).expect("a value");
        assert!((found.value - 2.0 / (4.0 / 3.0 * 8.0)).abs() < 1e-12, "{found:?}");
    }
}
