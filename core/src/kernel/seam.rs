//! Elements whose nodes have rotation vectors in different charts (Makinen 2007, section 3.4.1).
//!
//! Such an element is evaluated with all nodes in the chart of its first node; force f^C and
//! matrices are then pulled back to the charts of the others. With G = blockdiag(I or B) and B of
//! each converted node:
//!
//! ```text
//! f = G^T f^C
//! J = G^T [ J^C G + s C^C Gd + M^C (s Gdd + 2 d Gd) ] + s diag( Bd(g_P^C) )
//! ```
//!
//! This corrects the paper's (84), whose last relation is printed with B where it must be 2 Bd, and
//! adds the off-diagonal blocks that (86)–(89) leave out.

use super::element::{ElementSystem, MAX_NODES, NodeMotion, Weights};
use crate::rotation::Complement;
use crate::scalar::Real;
use crate::tensor::Vec3;

/// The converted nodes of an element, as a mask: bit j for node j.
pub type Conversion = u8;

/// A squared distance of rotation vectors, rad^2, a little below pi^2: nearer nodes need no
/// conversion.
const LEAST_SQUARED_DISTANCE: f64 = 9.8;

/// Chooses the charts of an element: node j is converted if the complement of its rotation vector
/// lies nearer to the vector of the first node. Needs no history, and holds through any number of
/// turns as long as neighbours turn by less than pi against each other.
#[inline]
pub fn conversion(p: &[Vec3]) -> Conversion {
    let mut mask = 0;
    for (j, &p_j) in p.iter().enumerate().skip(1) {
        let distance = (p_j - p[0]).squared();
        // A vector and its complement lie 2 pi apart, so the complement can be nearer only beyond
        // pi.
        if distance > LEAST_SQUARED_DISTANCE && (crate::rotation::complement(p_j) - p[0]).squared() < distance {
            mask |= 1 << j;
        }
    }
    mask
}

/// The nodes of one element in the chart of its first node.
pub struct Converted<T = f64> {
    /// The nodes, all in the chart of the first one
    pub nodes: [NodeMotion<T>; MAX_NODES],
    original: [Vec3<T>; MAX_NODES],
    change: [Option<Complement<T>>; MAX_NODES],
}

impl<T: Real> Converted<T> {
    /// Converts the nodes whose bits are set in `mask`.
    pub fn new(nodes: &[NodeMotion<T>], mask: Conversion) -> Self {
        let mut out = Self {
            nodes: [NodeMotion::rest(); MAX_NODES],
            original: [Vec3::zero(); MAX_NODES],
            change: [None; MAX_NODES],
        };
        for (j, node) in nodes.iter().enumerate() {
            out.nodes[j] = *node;
            out.original[j] = node.p;
            if mask & (1 << j) != 0 {
                let change = Complement::new(node.p, node.p_rate, node.p_rate2);
                out.nodes[j].p = change.p;
                out.nodes[j].p_rate = change.velocity;
                out.nodes[j].p_rate2 = change.acceleration;
                out.change[j] = Some(change);
            }
        }
        out
    }

    /// A variation of the rotation vector of node j, carried into the chart of the element.
    pub fn variation(&self, j: usize, dp: Vec3<T>) -> Vec3<T> {
        self.change[j].as_ref().map_or(dp, |change| change.b * dp)
    }

    /// Evaluates the element in one chart and pulls force and tangent back to the charts of the
    /// nodes.
    ///
    /// `rotation_block` gives the block of the rotation of node j; `evaluate` clears the system
    /// that it is given and fills it; `rates` is true if forces depend on rates of P.
    pub fn pull_back(
        &self,
        weights: Weights,
        rates: bool,
        rotation_block: &dyn Fn(usize) -> usize,
        out: &mut ElementSystem<T>,
        evaluate: &dyn Fn(Weights, &mut ElementSystem<T>),
    ) {
        evaluate(weights, out);
        let needs_rates = rates && (weights.stiffness != 0.0 || weights.damping != 0.0);
        let rate_parts = needs_rates.then(|| {
            let mut damping = out.clone();
            let mut mass = out.clone();
            evaluate(Weights::DAMPING, &mut damping);
            evaluate(Weights::MASS, &mut mass);
            (damping, mass)
        });
        let blocks = out.blocks();
        for (j, change) in self.change.iter().enumerate() {
            let Some(change) = change else { continue };
            let column = rotation_block(j);
            for row in 0..blocks {
                let mut block = out.tangent_block(row, column) * change.b;
                if let Some((damping, mass)) = &rate_parts {
                    block += damping.tangent_block(row, column) * change.b_rate.scale(weights.stiffness);
                    block += mass.tangent_block(row, column)
                        * (change.b_rate2.scale(weights.stiffness) + change.b_rate.scale(2.0 * weights.damping));
                }
                out.set_tangent(row, column, &block);
            }
        }
        for (j, change) in self.change.iter().enumerate() {
            let Some(change) = change else { continue };
            let row = rotation_block(j);
            let force = out.force_block(row);
            for column in 0..blocks {
                let block = change.b.transpose_matmul(out.tangent_block(row, column));
                out.set_tangent(row, column, &block);
            }
            out.add_tangent(row, row, Complement::geometric(self.original[j], force).scale(weights.stiffness));
            out.set_force(row, change.b.transpose_mul(force));
        }
    }
}
