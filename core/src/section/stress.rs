//! Stresses of a section under resultants, at its nodes and at any point.
//!
//! The stress is the sum of the stresses of six unit resultants. They are evaluated at the nodes of
//! elements, and averaged over the elements of one region around a node, never across regions.

use super::element::SectionPoint;
use super::error::SectionError;
use super::material::{Material, material_axes, stress_in_material_axes};
use super::mesh::{Element, Mesh};
use super::saint_venant::{Solution, StiffnessField};
use super::{Matrix6, Point, Vector6};
use std::collections::HashMap;

/// Steps of Newton's method for the place of a point in an element
const MAX_STEPS: usize = 20;

/// Largest distance of a point outside an element, in its reference coordinates
const INSIDE_TOLERANCE: f64 = 1e-6;

/// Unit stresses of each node and region.
#[derive(Clone, Debug)]
pub struct NodalStresses {
    /// Node and region of each place
    pub places: Vec<Place>,
    /// Stresses of the six unit resultants, by columns, of each place
    pub unit: Vec<Matrix6>,
    /// Place of each node of each element
    of_element: Vec<Vec<u32>>,
}

/// A node as a point of one region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// The node
    pub node: u32,
    /// The region
    pub region: u32,
}

/// The largest value of a stress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// The value
    pub value: f64,
    /// Its place
    pub at: Point,
    /// Index of the region
    pub region: usize,
}

/// The search for the largest stress near re-entrant corners, where it is infinite and a
/// mesh only shows how fine it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Corners {
    /// Points nearer than one wall thickness to a re-entrant corner are left out
    Exclude,
    /// All points
    Include,
}

/// Unit stresses at a point, as part of one region.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    /// Index of the region
    pub region: usize,
    /// Stresses of the six unit resultants in section axes, by columns
    pub(super) unit: Matrix6,
    /// Angle of the wall tangent, rad
    pub(super) beta: f64,
    /// Angle of the fibre, rad
    pub(super) theta: f64,
}

impl NodalStresses {
    /// Recovers stresses at all nodes.
    pub fn new(mesh: &Mesh, materials: &[Material], solution: &Solution) -> Result<Self, SectionError> {
        let field = StiffnessField::new(mesh, materials)?;
        let mut index: HashMap<Place, u32> = HashMap::new();
        let mut stresses = Self { places: Vec::new(), unit: Vec::new(), of_element: Vec::new() };
        let mut counts: Vec<f64> = Vec::new();
        for element in &mesh.elements {
            let mut of_element = Vec::new();
            for (node, unit) in element.nodes().iter().zip(element_stresses(mesh, &field, solution, element)) {
                let place = Place { node: *node, region: element.region };
                let position = *index.entry(place).or_insert_with(|| {
                    stresses.places.push(place);
                    stresses.unit.push(Matrix6::zeros());
                    counts.push(0.0);
                    counts.len() as u32 - 1
                });
                stresses.unit[position as usize] += unit;
                counts[position as usize] += 1.0;
                of_element.push(position);
            }
            stresses.of_element.push(of_element);
        }
        for (unit, count) in stresses.unit.iter_mut().zip(counts) {
            *unit /= count;
        }
        Ok(stresses)
    }

    /// Indices of the places that a search looks at. If corners leave none, all are.
    pub fn kept(&self, mesh: &Mesh, corners: Corners) -> Vec<usize> {
        let all = 0..self.places.len();
        let is_kept = |&index: &usize| !is_near_corner(mesh, mesh.nodes[self.places[index].node as usize]);
        let kept: Vec<usize> = match corners {
            Corners::Include => all.collect(),
            Corners::Exclude => all.filter(is_kept).collect(),
        };
        if kept.is_empty() { (0..self.places.len()).collect() } else { kept }
    }

    /// Mean of a measure of the stress over the nodes of each element under a load (N1 to M3).
    pub fn of_elements(&self, load: &Vector6, measure: impl Fn(&Vector6) -> f64) -> Vec<f64> {
        let of_place = |&place: &u32| measure(&(self.unit[place as usize] * load));
        let mean = |places: &Vec<u32>| places.iter().map(of_place).sum::<f64>() / places.len() as f64;
        self.of_element.iter().map(mean).collect()
    }

    /// Unit stresses at a point, for each region that contains it: two on an interface.
    pub fn probe(&self, mesh: &Mesh, at: Point) -> Vec<Probe> {
        let mut probes: Vec<Probe> = Vec::new();
        for (element, places) in mesh.elements.iter().zip(&self.of_element) {
            if probes.iter().any(|probe| probe.region == element.region as usize) {
                continue;
            }
            let Some(shape) = shape_at(mesh, element, at) else { continue };
            let unit = places
                .iter()
                .zip(shape)
                .fold(Matrix6::zeros(), |sum, (&place, shape)| sum + self.unit[place as usize] * shape);
            let region = mesh.region(element);
            let beta = region.tangent.beta(at);
            probes.push(Probe { region: element.region as usize, unit, beta, theta: region.theta });
        }
        probes
    }
}

impl Probe {
    /// The stress under a load in section axes.
    pub fn stress(&self, load: &Vector6) -> Vector6 {
        self.unit * load
    }

    /// The stress under a load in material axes: fibre, transverse, normal.
    pub fn stress_in_material_axes(&self, load: &Vector6) -> Vector6 {
        stress_in_material_axes(&self.stress(load), &material_axes(self.beta, self.theta))
    }
}

/// True if a point is nearer to a re-entrant corner than the thickness of the wall.
fn is_near_corner(mesh: &Mesh, at: Point) -> bool {
    mesh.corners.iter().any(|corner| libm::hypot(at[0] - corner.at[0], at[1] - corner.at[1]) < corner.wall)
}

/// Unit stresses at the nodes of an element.
fn element_stresses(mesh: &Mesh, field: &StiffnessField, solution: &Solution, element: &Element) -> Vec<Matrix6> {
    let positions = mesh.positions(element);
    let nodes = &positions[..element.kind.nodes()];
    let at_node = |reference| {
        let point = SectionPoint::new(reference, nodes);
        field.at(element, point.at) * solution.unit_strains(element, &point)
    };
    element.kind.node_points().iter().map(at_node).collect()
}

/// Shape functions of an element at a point, if the point is inside.
fn shape_at(mesh: &Mesh, element: &Element, at: Point) -> Option<[f64; 9]> {
    let positions = mesh.positions(element);
    let nodes = &positions[..element.kind.nodes()];
    let within = |axis: usize| {
        let low = nodes.iter().map(|node| node[axis]).fold(f64::MAX, f64::min);
        let high = nodes.iter().map(|node| node[axis]).fold(f64::MIN, f64::max);
        // Curved sides may reach beyond their nodes.
        let margin = 0.1 * (high - low);
        low - margin <= at[axis] && at[axis] <= high + margin
    };
    if !within(0) || !within(1) {
        return None;
    }
    let mut xi = element.kind.middle();
    for _ in 0..MAX_STEPS {
        let reference = element.kind.at(xi, 1.0);
        let point = SectionPoint::new(&reference, nodes);
        let missing = [at[0] - point.at[0], at[1] - point.at[1]];
        let mut map = [[0.0; 2]; 2];
        for (node, slopes) in nodes.iter().zip(&reference.derivatives) {
            for axis in 0..2 {
                map[axis][0] += slopes[0] * node[axis];
                map[axis][1] += slopes[1] * node[axis];
            }
        }
        let step = [
            (missing[0] * map[1][1] - missing[1] * map[0][1]) / point.determinant,
            (missing[1] * map[0][0] - missing[0] * map[1][0]) / point.determinant,
        ];
        xi = [xi[0] + step[0], xi[1] + step[1]];
        if step[0].abs() + step[1].abs() < 1e-10 {
            break;
        }
    }
    element.kind.contains(xi, INSIDE_TOLERANCE).then(|| element.kind.at(xi, 1.0).shape)
}

/// Von Mises stress.
pub fn von_mises(s: &Vector6) -> f64 {
    let normal = (s[0] - s[1]).powi(2) + (s[1] - s[2]).powi(2) + (s[2] - s[0]).powi(2);
    let shear = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
    (0.5 * normal + 3.0 * shear).sqrt()
}

/// The first and the third principal stress, by the trigonometric solution of the cubic equation.
pub fn extreme_principal_stresses(s: &Vector6) -> [f64; 2] {
    let mean = (s[0] + s[1] + s[2]) / 3.0;
    let [a, b, c] = [s[0] - mean, s[1] - mean, s[2] - mean];
    let shear = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
    let size = ((a * a + b * b + c * c + 2.0 * shear) / 6.0).sqrt();
    if size == 0.0 {
        return [mean; 2];
    }
    // Relative to the size, whose cube may be below the range of numbers.
    let [a, b, c, s23, s13, s12] = [a, b, c, s[3], s[4], s[5]].map(|value| value / size);
    let determinant = a * (b * c - s23 * s23) - s12 * (s12 * c - s23 * s13) + s13 * (s12 * s23 - b * s13);
    let cosine = (0.5 * determinant).clamp(-1.0, 1.0);
    let angle = libm::acos(cosine) / 3.0;
    [mean + 2.0 * size * libm::cos(angle), mean + 2.0 * size * libm::cos(angle + 2.0 / 3.0 * std::f64::consts::PI)]
}

#[cfg(test)]
mod tests {
    use super::super::material::tensor;
    use super::*;
    use nalgebra::SymmetricEigen;

    /// Principal stresses, the largest first.
    fn principal_stresses(s: &Vector6) -> [f64; 3] {
        let mut values: [f64; 3] = SymmetricEigen::new(tensor(s)).eigenvalues.into();
        values.sort_by(|a, b| b.total_cmp(a));
        values
    }

    #[test]
    fn measures_of_pure_shear() {
        let s = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 2.0);
        assert!((von_mises(&s) - 2.0 * 3_f64.sqrt()).abs() < 1e-12);
        let [first, third] = extreme_principal_stresses(&s);
        assert!((first - 2.0).abs() < 1e-12 && (third + 2.0).abs() < 1e-12);
    }

    #[test]
    fn principal_stresses_of_the_cubic_equation_are_eigenvalues() {
        for case in 0..50 {
            let s =
                Vector6::from_fn(|i, _| libm::sin((7 * case + 3 * i) as f64) * if case % 3 == 0 { 1e6 } else { 1.0 });
            let [first, _, third] = principal_stresses(&s);
            let found = extreme_principal_stresses(&s);
            assert!((found[0] - first).abs().max((found[1] - third).abs()) < 1e-9 * s.amax(), "{s}");
        }
        let tiny = extreme_principal_stresses(&Vector6::ith(5, 1e-120));
        assert!((tiny[0] / 1e-120 - 1.0).abs() < 1e-9 && (tiny[1] / 1e-120 + 1.0).abs() < 1e-9, "{tiny:?}");
        assert_eq!(extreme_principal_stresses(&Vector6::new(2.0, 2.0, 2.0, 0.0, 0.0, 0.0)), [2.0; 2]);
    }
}
