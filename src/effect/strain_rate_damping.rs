//! The stiffness part of Rayleigh damping: stresses beta C d(Gamma, K)/dt of the material frame, so that rigid motion is not
//! damped.
//!
//! With b_k = w dE_k/dq for each strain component E_k of a point of weight w, and G_k = db_k/dq:
//!
//! ```text
//! dE_k/dt = b_k . qd / w,   s = beta C dE/dt,   f = sum b_k s_k
//! df/dqd = sum b_k (beta C / w)_kl b_l,   df/dq = sum s_k G_k + sum b_k (beta C / w)_kl (G_l qd)
//! ```
//!
//! b_k and G_k are force and geometric tangent of the elastic element under a unit stress, whatever its interpolation.

use super::beam_elasticity::{BeamElasticity, ElasticElement};
use super::interpolation::{Interpolation, PointSum, Scratch};
use super::{Connection, Effect, for_each_batch};
use crate::kernel::beam::StiffnessPoint;
use crate::kernel::elastic::{Stiffness, Stress};
use crate::kernel::{ElementSystem, NodeMotion, Weights};
use crate::system::{Aspect, Category, Cliques, Memory, RotationRate, Sink, State};
use crate::tensor::{Mat3, Vec3};
use std::sync::Arc;

/// Damping of all beams that interpolate in one way.
pub struct StrainRateDamping<I> {
    /// The beams
    pub elasticity: Arc<BeamElasticity<I>>,
    /// beta, a time
    pub factor: f64,
}

impl<I: Interpolation> Effect for StrainRateDamping<I> {
    fn name(&self) -> &'static str {
        I::DAMPING_NAME
    }

    fn category(&self) -> Category {
        Category::Damping
    }

    fn cliques(&self) -> Cliques {
        self.elasticity.cliques()
    }

    fn aspects(&self, _show: &mut dyn FnMut(Aspect)) {
        // Of the elasticity, which shows itself.
    }

    fn add(&self, at: &State, _memory: &Memory, weights: Weights, out: &mut Sink) {
        for_each_batch!(self.elasticity.elements, |first, batch| {
            add_batch::<I, _, _>(batch, first, self.factor, at, weights, out);
        });
    }
}

fn add_batch<I: Interpolation, const N: usize, const G: usize>(
    batch: &[ElasticElement<N, G>],
    first: usize,
    factor: f64,
    at: &State,
    weights: Weights,
    out: &mut Sink,
) {
    let mut work = (ElementSystem::new(2 * N), Scratch::new(N));
    let mut system = ElementSystem::new(2 * N);
    for (k, element) in batch.iter().enumerate() {
        let rates = Rates::new(&element.connection, at);
        system.clear();
        for point in &element.points {
            let units = UnitStresses::new::<I>(point, &element.connection, at, &rates, weights, &mut work);
            units.add(&matrix(&point.stiffness, factor / point.weight), weights, &mut system);
        }
        out.add(first + k, &system);
    }
}

/// A section's stiffness as a 6x6 matrix, times a factor.
fn matrix(stiffness: &Stiffness, factor: f64) -> [[f64; 6]; 6] {
    let coupling = stiffness.cc.unwrap_or(Mat3::ZERO);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            factor
                * match (i < 3, j < 3) {
                    (true, true) => stiffness.cn.0[i][j],
                    (true, false) => coupling.0[i][j - 3],
                    (false, true) => coupling.0[j][i - 3],
                    (false, false) => stiffness.cm.0[i - 3][j - 3],
                }
        })
    })
}

/// The rates of an element's unknowns.
struct Rates<const N: usize> {
    displacements: [Vec3; N],
    rotations: [RotationRate; N],
}

impl<const N: usize> Rates<N> {
    fn new(connection: &Connection<N>, at: &State) -> Self {
        Self {
            displacements: connection.nodes.map(|node| at.v[node.u as usize]),
            rotations: connection.nodes.map(|node| at.rotation_rate(node.p)),
        }
    }

    fn of_block(&self, block: usize) -> Vec3 {
        if block.is_multiple_of(2) { self.displacements[block / 2] } else { self.rotations[block / 2].rate }
    }

    /// See [`RotationRate::pull_back`].
    fn pull_back(&self, block: usize, over_rate: Vec3) -> (Vec3, Vec3) {
        if block.is_multiple_of(2) { (over_rate, Vec3::ZERO) } else { self.rotations[block / 2].pull_back(over_rate) }
    }
}

/// A point under a stress that does not depend on its strain.
struct UnitStress<'a, const N: usize> {
    point: &'a StiffnessPoint<N>,
    stress: Stress,
}

impl<const N: usize> PointSum<N, f64> for UnitStress<'_, N> {
    fn add(&self, nodes: &[NodeMotion; N], stiffness: f64, out: &mut ElementSystem) {
        let (point, none) = (self.point, Stiffness { cn: Mat3::ZERO, cm: Mat3::ZERO, cc: None });
        let place = point.configuration(nodes);
        point.add_force(&place, &self.stress, out);
        if stiffness != 0.0 {
            point.add_tangent(&place, &none, &self.stress, stiffness, out);
        }
    }

    fn add_geometric(&self, _nodes: &[NodeMotion; N], _out: &mut ElementSystem) -> bool {
        false
    }
}

/// What the six unit stresses of a point give, by block of the element.
struct UnitStresses<const N: usize> {
    blocks: [Vec<UnitBlock>; 6],
    /// G_k
    tangent: Vec<ElementSystem>,
}

/// One block of one unit stress.
struct UnitBlock {
    /// b_k
    force: Vec3,
    /// w dE_k/dt over the rate of this block
    over_rate: Vec3,
    /// w dE_k/dt over this block
    over_unknown: Vec3,
    /// The part of w dE_k/dt that this block brings
    part: f64,
}

impl<const N: usize> UnitStresses<N> {
    fn new<I: Interpolation>(
        point: &StiffnessPoint<N>,
        connection: &Connection<N>,
        at: &State,
        rates: &Rates<N>,
        weights: Weights,
        (system, scratch): &mut (ElementSystem, Scratch),
    ) -> Self {
        let mut tangent = Vec::new();
        let blocks = std::array::from_fn(|k| {
            let unit = |part: usize| if k / 3 == part { Vec3::UNIT[k % 3] } else { Vec3::ZERO };
            let stress = Stress { n: unit(0), m: unit(1) };
            let wanted = if weights.stiffness != 0.0 { 1.0 } else { 0.0 };
            I::evaluate(connection, at, wanted, scratch, system, &UnitStress { point, stress });
            let block = |b: usize| {
                let (force, rate) = (system.force_block(b), rates.of_block(b));
                let bent = (0..2 * N)
                    .fold(Vec3::ZERO, |sum, row| sum + system.tangent_block(row, b).transpose_mul(rates.of_block(row)));
                let (over_rate, lost) = rates.pull_back(b, force);
                let over_unknown = lost + if wanted == 0.0 { Vec3::ZERO } else { bent };
                UnitBlock { force, over_rate, over_unknown, part: force.dot(rate) }
            };
            let blocks: Vec<UnitBlock> = (0..2 * N).map(block).collect();
            if wanted != 0.0 {
                tangent.push(system.clone());
            }
            blocks
        });
        Self { blocks, tangent }
    }

    /// `c` is beta C / w.
    fn add(&self, c: &[[f64; 6]; 6], weights: Weights, out: &mut ElementSystem) {
        let rate: [f64; 6] = std::array::from_fn(|k| self.blocks[k].iter().map(|b| b.part).sum());
        for k in 0..6 {
            let stress: f64 = (0..6).map(|l| c[k][l] * rate[l]).sum();
            for row in 0..2 * N {
                let force = self.blocks[k][row].force;
                out.add_force(row, force * stress);
                for column in 0..2 * N {
                    let over = (0..6).filter(|&l| c[k][l] != 0.0).fold(Vec3::ZERO, |sum, l| {
                        let block = &self.blocks[l][column];
                        sum + (block.over_rate * weights.damping + block.over_unknown * weights.stiffness) * c[k][l]
                    });
                    let mut tangent = force.outer(over);
                    if let Some(bent) = self.tangent.get(k) {
                        tangent += bent.tangent_block(row, column).scale(stress * weights.stiffness);
                    }
                    out.add_tangent(row, column, tangent);
                }
            }
        }
    }
}
