//! Saint-Venant solutions of a prismatic beam on a mesh of its section: stiffness and stresses.
//!
//! Giavotto et al. 1983 (doi:10.1016/0045-7949(83)90179-7), central solutions. The displacement is
//! a rigid motion of the section plus a warping w(x2, x3) that is linear in x1. The strain is
//!
//! ```text
//! e = B w + S psi + N w'
//! B w:   e22 = u2,2   e33 = u3,3   g23 = u2,3 + u3,2   g13 = u1,3   g12 = u1,2
//! S psi: e11 = G1 + K2 x3 - K3 x2   g13 = G3 + K1 x2   g12 = G2 - K1 x3
//! N w':  e11 = u1'   g13 = u3'   g12 = u2'
//! ```
//!
//! The shear strains G2 and G3 of the axis are a rigid tilt of the warping: the gauge G2 = G3 = 0
//! leaves four strains psi4 = (G1, K1, K2, K3), and the shear stiffness follows from the energy of
//! the warping under N2 and N3.

use super::element::{MAX_NODES, SectionPoint};
use super::error::SectionError;
use super::material::{Material, material_axes, rotated_stiffness};
use super::mesh::{Element, Mesh, Tangent};
use super::{Matrix6, Point, Vector6};
use crate::solve::{Cholesky, NodeGraph};
use nalgebra::{Matrix3, Matrix4, SMatrix, Vector3, Vector4};

/// Components of the shear strains g13 and g12
const OUT_OF_PLANE: [usize; 2] = [4, 5];

/// Components of e11, e22, e33 and g23
const IN_PLANE: [usize; 4] = [0, 1, 2, 3];

/// Couplings of material stiffness below this part of its largest entry count as none
const NO_COUPLING: f64 = 1e-14;

/// Corrections of a solution stop below this part of it
const SMALL_CORRECTION: f64 = 1e-9;

/// Largest number of corrections; the first is the solution itself
const MAX_CORRECTIONS: usize = 5;

/// Resultants with a warping that changes along the beam: N2 and N3
pub const SHEAR_RESULTANTS: [usize; 2] = [1, 2];

/// Material stiffness in section axes, for each region of a mesh.
pub struct StiffnessField {
    regions: Vec<RegionStiffness>,
}

/// The stiffness of one region.
enum RegionStiffness {
    Constant(Matrix6),
    /// Follows the wall tangent: stiffness in material axes, theta, tangent
    Curved(Matrix6, f64, Tangent),
}

impl StiffnessField {
    /// Rotates the materials of the regions of a mesh.
    pub fn new(mesh: &Mesh, materials: &[Material]) -> Result<Self, SectionError> {
        let mut regions = Vec::new();
        for region in &mesh.regions {
            let material = materials.get(region.material).ok_or_else(|| SectionError::Dimensions {
                message: format!("region `{}` has no material", region.name),
            })?;
            let stiffness = material.stiffness()?;
            regions.push(match region.tangent {
                _ if material.is_isotropic() => RegionStiffness::Constant(stiffness),
                Tangent::Fixed(beta) => {
                    RegionStiffness::Constant(rotated_stiffness(&stiffness, &material_axes(beta, region.theta)))
                }
                tangent @ Tangent::Around { .. } => RegionStiffness::Curved(stiffness, region.theta, tangent),
            });
        }
        Ok(Self { regions })
    }

    /// The stiffness at a point of an element.
    #[inline]
    pub fn at(&self, element: &Element, at: Point) -> Matrix6 {
        match &self.regions[element.region as usize] {
            RegionStiffness::Constant(stiffness) => *stiffness,
            RegionStiffness::Curved(stiffness, theta, tangent) => {
                rotated_stiffness(stiffness, &material_axes(tangent.beta(at), *theta))
            }
        }
    }

    /// True if displacements along 1 are independent of those in the section: no coupling between
    /// e11 e22 e33 g23 and g13 g12.
    fn is_decoupled(&self) -> bool {
        self.regions.iter().all(|region| match region {
            RegionStiffness::Constant(q) => {
                let limit = NO_COUPLING * q.abs().max();
                OUT_OF_PLANE.iter().all(|&i| IN_PLANE.iter().all(|&j| q[(i, j)].abs() <= limit))
            }
            RegionStiffness::Curved(..) => false,
        })
    }
}

/// The strain S4 psi4 at a point.
#[inline]
fn beam_strain(psi4: &Vector4<f64>, [x2, x3]: Point) -> Vector6 {
    Vector6::new(psi4[0] + psi4[2] * x3 - psi4[3] * x2, 0.0, 0.0, 0.0, psi4[1] * x2, -psi4[1] * x3)
}

/// S4' s: the four resultants N1, M1, M2, M3 of a stress at a point, per area.
#[inline]
fn four_resultants(s: &Vector6, [x2, x3]: Point) -> Vector4<f64> {
    Vector4::new(s[0], s[4] * x2 - s[5] * x3, s[0] * x3, -s[0] * x2)
}

/// The six resultants of a stress at a point, per area.
fn six_resultants(s: &Vector6, at: Point) -> Vector6 {
    let four = four_resultants(s, at);
    Vector6::new(four[0], s[5], s[4], four[1], four[2], four[3])
}

/// The strain B w at a point; `w` holds the displacements of the element's nodes.
#[inline]
fn warping_strain(point: &SectionPoint, w: &[[f64; 3]]) -> Vector6 {
    let mut e = Vector6::zeros();
    for (u, &[by2, by3]) in w.iter().zip(&point.gradient) {
        e[1] += by2 * u[1];
        e[2] += by3 * u[2];
        e[3] += by3 * u[1] + by2 * u[2];
        e[4] += by3 * u[0];
        e[5] += by2 * u[0];
    }
    e
}

/// The strain N w' at a point; `rate` holds w' at the element's nodes.
#[inline]
fn rate_strain(point: &SectionPoint, rate: &[[f64; 3]]) -> Vector6 {
    let mut e = Vector6::zeros();
    for (u, &shape) in rate.iter().zip(&point.shape) {
        e[0] += shape * u[0];
        e[4] += shape * u[2];
        e[5] += shape * u[1];
    }
    e
}

/// B' s for node `a`.
#[inline]
fn warping_force(point: &SectionPoint, a: usize, s: &Vector6) -> [f64; 3] {
    let [by2, by3] = point.gradient[a];
    [s[4] * by3 + s[5] * by2, s[1] * by2 + s[3] * by3, s[2] * by3 + s[3] * by2]
}

/// N' s for node `a`.
#[inline]
fn rate_force(point: &SectionPoint, a: usize, s: &Vector6) -> [f64; 3] {
    let shape = point.shape[a];
    [s[0] * shape, s[5] * shape, s[4] * shape]
}

/// Warping and strains of the beam under unit resultants, with stiffness and mass.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Strains of the beam under unit resultants
    pub compliance: Matrix6,
    /// Resultants of unit strains of the beam
    pub stiffness: Matrix6,
    /// Mass per length, about the reference point
    pub mass: Matrix6,
    /// Area
    pub area: f64,
    /// Centre of the area
    pub centroid: Point,
    /// Largest error of the resultants of the six unit stress states; lengths in half diagonals
    pub resultant_check: f64,
    /// Warping of each node under unit N1, N2, N3, M1, M2, M3
    warping: Vec<Vec<f64>>,
    /// Change of warping along the beam under unit N2 and N3
    rates: Vec<Vec<f64>>,
    /// G1, K1, K2, K3 under the six unit resultants
    psi4: SMatrix<f64, 4, 6>,
}

/// Integrals that need no solution.
struct Assembled {
    graph: NodeGraph,
    /// E = int B'QB by pairs of the graph
    blocks: Vec<[f64; 9]>,
    mass: Matrix6,
    area: f64,
    /// Integral of the coordinates
    first_moment: Point,
}

/// Solves on a mesh, with axes and reference point those of its coordinates.
pub fn solve(mesh: &Mesh, materials: &[Material]) -> Result<Solution, SectionError> {
    let field = StiffnessField::new(mesh, materials)?;
    let mut assembled = assemble(mesh, materials, &field);
    let solver = Factors::new(mesh, &mut assembled, field.is_decoupled())?;

    // Strains without shear: warping of unit G1, K1, K2, K3.
    let mut classical = Matrix4::zeros();
    let unit = solver.solve_refined(4, 3 * mesh.nodes.len(), |warping| {
        let (residual, stiffness) = residual_without_shear(mesh, &field, warping);
        classical = stiffness;
        residual
    })?;
    let flexibility = classical.cholesky().ok_or(SectionError::Singular)?.inverse();

    // Shear forces: M3' = -N2 and M2' = N3 change the curvatures and with them the warping.
    let strain_rates = [-flexibility.column(3).into_owned(), flexibility.column(2).into_owned()];
    let rates: Vec<Vec<f64>> = strain_rates.iter().map(|psi4| combine(&unit, psi4)).collect();
    let mut resultants = [Vector4::zeros(); 2];
    let shear = solver.solve_refined(2, 3 * mesh.nodes.len(), |warping| {
        let (residual, of_warping) = residual_of_shear(mesh, &field, &rates, &strain_rates, warping);
        resultants = of_warping;
        residual
    })?;

    let mut psi4 = SMatrix::<f64, 4, 6>::zeros();
    for (row, column) in [(0, 0), (1, 3), (2, 4), (3, 5)] {
        psi4[(row, column)] = 1.0;
    }
    for (k, &column) in SHEAR_RESULTANTS.iter().enumerate() {
        psi4.set_column(column, &-resultants[k]);
    }
    let psi4 = flexibility * psi4;
    let mut warping: Vec<Vec<f64>> = (0..6).map(|j| combine(&unit, &psi4.column(j).into_owned())).collect();
    for (k, &column) in SHEAR_RESULTANTS.iter().enumerate() {
        for (entry, added) in warping[column].iter_mut().zip(&shear[k]) {
            *entry += added;
        }
    }
    let solution = Solution {
        compliance: Matrix6::zeros(),
        stiffness: Matrix6::zeros(),
        mass: assembled.mass,
        area: assembled.area,
        centroid: assembled.first_moment.map(|moment| moment / assembled.area),
        resultant_check: 0.0,
        warping,
        rates,
        psi4,
    };
    solution.with_energy(mesh, &field)
}

impl Solution {
    /// Compliance, stiffness and the check of resultants, from the stresses.
    fn with_energy(mut self, mesh: &Mesh, field: &StiffnessField) -> Result<Self, SectionError> {
        let mut compliance = Matrix6::zeros();
        let mut resultants = Matrix6::zeros();
        for_each_point(mesh, |element, _, point| {
            let strains = self.unit_strains(element, point);
            let stresses = field.at(element, point.at) * strains;
            compliance += strains.transpose() * stresses * point.area;
            for j in 0..6 {
                let resultant = six_resultants(&stresses.column(j).into_owned(), point.at);
                resultants.set_column(j, &(resultants.column(j) + resultant * point.area));
            }
        });
        self.compliance = 0.5 * (compliance + compliance.transpose());
        let stiffness = spd_inverse(&self.compliance).ok_or(SectionError::Singular)?;
        self.stiffness = 0.5 * (stiffness + stiffness.transpose());
        self.resultant_check = largest_error(&resultants, half_diagonal(mesh));
        Ok(self)
    }

    /// Removes couplings that vanish in a section that is its own mirror image with the other sign
    /// of axis 2, and of axis 3.
    pub fn impose_mirrors(&mut self, mirrors: [bool; 2]) {
        // Components that change their sign with axis 2, and with axis 3.
        const ODD: [[bool; 6]; 2] = [[false, true, false, true, false, true], [false, false, true, true, true, false]];
        for axis in (0..2).filter(|&axis| mirrors[axis]) {
            self.centroid[axis] = 0.0;
            for matrix in [&mut self.compliance, &mut self.stiffness, &mut self.mass] {
                for i in 0..6 {
                    for j in (0..6).filter(|&j| ODD[axis][i] != ODD[axis][j]) {
                        matrix[(i, j)] = 0.0;
                    }
                }
            }
        }
    }

    /// Strains at a point of an element under the six unit resultants, by columns.
    pub fn unit_strains(&self, element: &Element, point: &SectionPoint) -> Matrix6 {
        let mut strains = Matrix6::zeros();
        let nodes = element.nodes();
        for j in 0..6 {
            let local = gather(&self.warping[j], nodes);
            let strain =
                warping_strain(point, &local[..nodes.len()]) + beam_strain(&self.psi4.column(j).into_owned(), point.at);
            strains.set_column(j, &strain);
        }
        for (k, &j) in SHEAR_RESULTANTS.iter().enumerate() {
            let local = gather(&self.rates[k], nodes);
            let strain = strains.column(j) + rate_strain(point, &local[..nodes.len()]);
            strains.set_column(j, &strain);
        }
        strains
    }

    /// Warping displacement of a node along 1, 2, 3 under a unit resultant (0 to 5); up to a rigid
    /// motion, which depends on the nodes that were held.
    pub fn warping(&self, resultant: usize, node: usize) -> [f64; 3] {
        let w = &self.warping[resultant];
        [w[3 * node], w[3 * node + 1], w[3 * node + 2]]
    }
}

impl Solution {
    /// Warping displacement of all nodes along 1 under a unit resultant (0 to 5), without its mean
    /// and its slopes over the section: what is left of it does not depend on the nodes that were
    /// held.
    pub fn axial_warping(&self, mesh: &Mesh, resultant: usize) -> Vec<f64> {
        let warping = &self.warping[resultant];
        let mut moments = Matrix3::zeros();
        let mut right_side = Vector3::zeros();
        for_each_point(mesh, |element, _, point| {
            let local = gather(warping, element.nodes());
            let value: f64 = local.iter().zip(&point.shape).map(|(u, shape)| u[0] * shape).sum();
            let basis = Vector3::new(1.0, point.at[0] - self.centroid[0], point.at[1] - self.centroid[1]);
            moments += basis * basis.transpose() * point.area;
            right_side += basis * value * point.area;
        });
        let plane = moments.cholesky().map_or(Vector3::zeros(), |factors| factors.solve(&right_side));
        let rest = |(node, at): (usize, &Point)| {
            let basis = Vector3::new(1.0, at[0] - self.centroid[0], at[1] - self.centroid[1]);
            warping[3 * node] - plane.dot(&basis)
        };
        mesh.nodes.iter().enumerate().map(rest).collect()
    }
}

/// Calls a function at each integration point of each element, with the positions of its nodes.
fn for_each_point(mesh: &Mesh, mut call: impl FnMut(&Element, usize, &SectionPoint)) {
    for (index, element) in mesh.elements.iter().enumerate() {
        let positions = mesh.positions(element);
        for reference in element.kind.integration_points() {
            call(element, index, &SectionPoint::new(reference, &positions[..element.kind.nodes()]));
        }
    }
}

/// Unit strains S4 at a point: columns G1, K1, K2, K3.
fn unit_beam_strains(at: Point) -> [Vector6; 4] {
    std::array::from_fn(|c| beam_strain(&Vector4::ith(c, 1.0), at))
}

/// Matrix, right-hand sides and mass.
fn assemble(mesh: &Mesh, materials: &[Material], field: &StiffnessField) -> Assembled {
    let graph = NodeGraph::new(mesh.nodes.len(), mesh.elements.iter().map(Element::nodes));
    let mut assembled = Assembled {
        blocks: vec![[0.0; 9]; graph.pairs()],
        graph,
        mass: Matrix6::zeros(),
        area: 0.0,
        first_moment: [0.0; 2],
    };
    for element in &mesh.elements {
        let positions = mesh.positions(element);
        let nodes = element.nodes();
        let density = materials[mesh.region(element).material].density;
        let mut local = [[[0.0; 9]; MAX_NODES]; MAX_NODES];
        for reference in element.kind.integration_points() {
            let point = SectionPoint::new(reference, &positions[..nodes.len()]);
            let q = field.at(element, point.at) * point.area;
            add_stiffness(&point, &q, nodes, &mut local);
            assembled.area += point.area;
            for axis in 0..2 {
                assembled.first_moment[axis] += point.area * point.at[axis];
            }
            add_mass(&mut assembled.mass, density * point.area, point.at);
        }
        for (a, &node) in nodes.iter().enumerate() {
            for (b, &other) in nodes.iter().enumerate().filter(|&(_, &other)| other <= node) {
                let block = &mut assembled.blocks[assembled.graph.pair(node, other)];
                for (entry, added) in block.iter_mut().zip(local[a][b]) {
                    *entry += added;
                }
            }
        }
    }
    assembled
}

/// Adds B_b' Q B_a of a point to the blocks of nodes a and b with a number not above that of a.
#[inline]
fn add_stiffness(point: &SectionPoint, q: &Matrix6, nodes: &[u32], local: &mut [[[f64; 9]; MAX_NODES]; MAX_NODES]) {
    for a in 0..nodes.len() {
        let [by2, by3] = point.gradient[a];
        let stresses: [Vector6; 3] = [
            q.column(4) * by3 + q.column(5) * by2,
            q.column(1) * by2 + q.column(3) * by3,
            q.column(2) * by3 + q.column(3) * by2,
        ];
        for b in (0..nodes.len()).filter(|&b| nodes[b] <= nodes[a]) {
            let block = &mut local[a][b];
            for (j, stress) in stresses.iter().enumerate() {
                let force = warping_force(point, b, stress);
                for i in 0..3 {
                    block[3 * i + j] += force[i];
                }
            }
        }
    }
}

/// Adds a point mass (mass per length of the beam) to the 6x6 mass about the origin.
fn add_mass(mass: &mut Matrix6, m: f64, [x2, x3]: Point) {
    for i in 0..3 {
        mass[(i, i)] += m;
    }
    // The block m d~ with d = (0, x2, x3), and its transpose.
    for (row, column, entry) in [(3, 1, -m * x3), (3, 2, m * x2), (4, 0, m * x3), (5, 0, -m * x2)] {
        mass[(row, column)] += entry;
        mass[(column, row)] += entry;
    }
    mass[(3, 3)] += m * (x2 * x2 + x3 * x3);
    mass[(4, 4)] += m * x3 * x3;
    mass[(5, 5)] += m * x2 * x2;
    mass[(4, 5)] -= m * x2 * x3;
    mass[(5, 4)] -= m * x2 * x3;
}

/// For warpings w of unit G1, K1, K2, K3, the residual -int B'Q (B w + S4), and the stiffness
/// int e'Q e of the four strains.
fn residual_without_shear(mesh: &Mesh, field: &StiffnessField, warping: &[Vec<f64>]) -> (Vec<Vec<f64>>, Matrix4<f64>) {
    let mut residual = vec![vec![0.0; 3 * mesh.nodes.len()]; 4];
    let mut stiffness = Matrix4::zeros();
    for_each_point(mesh, |element, _, point| {
        let nodes = element.nodes();
        let q = field.at(element, point.at) * point.area;
        let mut strains = SMatrix::<f64, 6, 4>::zeros();
        for (c, unit) in unit_beam_strains(point.at).iter().enumerate() {
            let local = gather(&warping[c], nodes);
            strains.set_column(c, &(unit + warping_strain(point, &local[..nodes.len()])));
        }
        let stresses = q * strains;
        stiffness += strains.transpose() * stresses;
        for c in 0..4 {
            let stress = stresses.column(c).into_owned();
            for (a, &node) in nodes.iter().enumerate() {
                add_node(&mut residual[c], node, &warping_force(point, a, &stress), -1.0);
            }
        }
    });
    (residual, 0.5 * (stiffness + stiffness.transpose()))
}

/// For warpings w of unit N2 and N3 (their parts without psi4), the residual
/// int N's' - int B'Q (B w + N w') with s' = Q (B w' + S4 psi4'), and the resultants
/// int S4'Q (B w + N w').
fn residual_of_shear(
    mesh: &Mesh,
    field: &StiffnessField,
    rates: &[Vec<f64>],
    strain_rates: &[Vector4<f64>; 2],
    warping: &[Vec<f64>],
) -> (Vec<Vec<f64>>, [Vector4<f64>; 2]) {
    let mut residual = vec![vec![0.0; 3 * mesh.nodes.len()]; 2];
    let mut resultants = [Vector4::zeros(); 2];
    for_each_point(mesh, |element, _, point| {
        let q = field.at(element, point.at) * point.area;
        let nodes = element.nodes();
        for k in 0..2 {
            let rate = gather(&rates[k], nodes);
            let rate = &rate[..nodes.len()];
            let local = gather(&warping[k], nodes);
            let stress_rate = q * (warping_strain(point, rate) + beam_strain(&strain_rates[k], point.at));
            let stress = q * (warping_strain(point, &local[..nodes.len()]) + rate_strain(point, rate));
            resultants[k] += four_resultants(&stress, point.at);
            for (a, &node) in nodes.iter().enumerate() {
                add_node(&mut residual[k], node, &rate_force(point, a, &stress_rate), 1.0);
                add_node(&mut residual[k], node, &warping_force(point, a, &stress), -1.0);
            }
        }
    });
    (residual, resultants)
}

/// The factors of E with its four rigid motions held.
struct Factors {
    parts: Vec<Cholesky>,
    held: [usize; 4],
    /// Largest diagonal entry of E, by which it is divided
    scale: f64,
}

impl Factors {
    /// Holds and factorises; the blocks of `assembled` are changed.
    fn new(mesh: &Mesh, assembled: &mut Assembled, decoupled: bool) -> Result<Self, SectionError> {
        let held = held_unknowns(mesh);
        let graph = &assembled.graph;
        let blocks = &mut assembled.blocks;
        let scale = (0..graph.count() as u32).map(|node| blocks[graph.pair(node, node)]);
        let scale = scale.map(|block| block[0].max(block[4]).max(block[8])).fold(0.0, f64::max);
        blocks.iter_mut().flatten().for_each(|entry| *entry /= scale);
        for unknown in held {
            hold(graph, blocks, unknown);
        }
        let order = graph.elimination_order().ok_or(SectionError::Singular)?;
        let groups: &[&[usize]] = if decoupled { &[&[0], &[1, 2]] } else { &[&[0, 1, 2]] };
        let parts = groups.iter().map(|group| Cholesky::new(graph, &order, blocks, group));
        let parts = parts.collect::<Option<Vec<_>>>().ok_or(SectionError::Singular)?;
        Ok(Self { parts, held, scale })
    }

    /// Solves from zero by corrections until they are small. Residuals come from strains, so that
    /// corrections also remove most round-off of the factors, which is large for thin walls.
    fn solve_refined(
        &self,
        columns: usize,
        size: usize,
        mut residual: impl FnMut(&[Vec<f64>]) -> Vec<Vec<f64>>,
    ) -> Result<Vec<Vec<f64>>, SectionError> {
        let mut x = vec![vec![0.0; size]; columns];
        for _ in 0..MAX_CORRECTIONS {
            let mut correction = residual(&x);
            self.solve(&mut correction)?;
            let mut is_small = true;
            for (x, correction) in x.iter_mut().zip(&correction) {
                is_small &= largest(correction) <= SMALL_CORRECTION * largest(x);
                x.iter_mut().zip(correction).for_each(|(x, correction)| *x += correction);
            }
            if is_small {
                break;
            }
        }
        Ok(x)
    }

    /// Solves in place.
    fn solve(&self, x: &mut [Vec<f64>]) -> Result<(), SectionError> {
        for x in x.iter_mut() {
            x.iter_mut().for_each(|entry| *entry /= self.scale);
            for unknown in self.held {
                x[unknown] = 0.0;
            }
        }
        self.parts.iter().try_for_each(|part| part.solve(x).ok_or(SectionError::Singular))
    }
}

/// Replaces row and column of an unknown by those of the identity.
fn hold(graph: &NodeGraph, blocks: &mut [[f64; 9]], unknown: usize) {
    let held_node = unknown / 3;
    let component = unknown % 3;
    for node in 0..graph.count() {
        let (start, neighbours) = graph.of(node);
        for (k, &other) in neighbours.iter().enumerate() {
            for i in 0..3 {
                if node == held_node {
                    blocks[start + k][3 * i + component] = 0.0;
                }
                if other as usize == held_node {
                    blocks[start + k][3 * component + i] = 0.0;
                }
            }
        }
    }
    let diagonal = graph.pair(held_node as u32, held_node as u32);
    blocks[diagonal][4 * component] = 1.0;
}

/// Four unknowns whose holding prevents rigid motion: three of the node nearest the middle, and
/// one of the node farthest from it, across the line between both.
fn held_unknowns(mesh: &Mesh) -> [usize; 4] {
    let count = mesh.nodes.len().max(1) as f64;
    let middle: Point = std::array::from_fn(|axis| mesh.nodes.iter().map(|node| node[axis]).sum::<f64>() / count);
    let distance = |node: usize, from: Point| {
        let at = mesh.nodes[node];
        (at[0] - from[0]).powi(2) + (at[1] - from[1]).powi(2)
    };
    let nodes = 0..mesh.nodes.len();
    let near = nodes.clone().min_by(|&a, &b| distance(a, middle).total_cmp(&distance(b, middle))).unwrap_or(0);
    let origin = mesh.nodes[near];
    let far = nodes.max_by(|&a, &b| distance(a, origin).total_cmp(&distance(b, origin))).unwrap_or(0);
    let along_2 = (mesh.nodes[far][0] - origin[0]).abs() > (mesh.nodes[far][1] - origin[1]).abs();
    [3 * near, 3 * near + 1, 3 * near + 2, 3 * far + if along_2 { 2 } else { 1 }]
}

/// Values of three unknowns at some nodes.
#[inline]
fn gather(values: &[f64], nodes: &[u32]) -> [[f64; 3]; MAX_NODES] {
    let mut local = [[0.0; 3]; MAX_NODES];
    for (u, &node) in local.iter_mut().zip(nodes) {
        let first = 3 * node as usize;
        u.copy_from_slice(&values[first..first + 3]);
    }
    local
}

/// Adds a multiple of a force to the unknowns of a node.
#[inline]
fn add_node(values: &mut [f64], node: u32, force: &[f64; 3], factor: f64) {
    for (i, component) in force.iter().enumerate() {
        values[3 * node as usize + i] += factor * component;
    }
}

/// The largest absolute value.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// The combination of four warpings.
fn combine(unit: &[Vec<f64>], factors: &Vector4<f64>) -> Vec<f64> {
    (0..unit[0].len()).map(|k| (0..4).map(|c| unit[c][k] * factors[c]).sum()).collect()
}

/// Half the diagonal of the box around a section.
pub fn half_diagonal(mesh: &Mesh) -> f64 {
    let extent = |axis: usize| {
        let values = mesh.nodes.iter().map(|node| node[axis]);
        values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
    };
    0.5 * libm::hypot(extent(0), extent(1))
}

/// Largest difference of resultants from the identity, with moments divided by a length.
fn largest_error(resultants: &Matrix6, length: f64) -> f64 {
    let unit = |index: usize| if index < 3 { 1.0 } else { length };
    let error = |i: usize, j: usize| {
        let exact = if i == j { 1.0 } else { 0.0 };
        ((resultants[(i, j)] - exact) * unit(j) / unit(i)).abs()
    };
    (0..36).map(|k| error(k / 6, k % 6)).fold(0.0, f64::max)
}

/// The inverse of a symmetric positive definite matrix of entries with different units.
pub fn spd_inverse(matrix: &Matrix6) -> Option<Matrix6> {
    let scale = Vector6::from_fn(|i, _| 1.0 / matrix[(i, i)].sqrt());
    let scaled = Matrix6::from_fn(|i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    Some(Matrix6::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
