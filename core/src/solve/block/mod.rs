//! Block factorisations of the tangent, with one block per node, 6 x 6 or in a plane 3 x 3: L D L^T
//! if it is symmetric, else LU.
//!
//! The order is minimum degree, in large scenes rearranged towards a middle, so that chains and
//! trees have no fill. There is no pivoting across blocks: callers check the residual of their
//! solution, or whether the factorisation is [sure](BlockSolver::is_sure). Off-diagonal blocks
//! without fill are read from the tangent; factors may overwrite its diagonal tiles.

mod diagonal;
mod elimination;
mod factor;
mod ldl;
mod list_range;
mod lu;
mod order;
mod pieces;
mod tile;

use crate::system::{Matrix, Pattern, Symmetry, System, WIDTH};
use crate::tensor::Vec3;
use crate::threads;
use elimination::{Elimination, FillLimit};
use factor::Factor;
use ldl::Ldl;
use lu::Lu;
use pieces::Pieces;
use std::sync::Arc;

/// A block factorisation with its symbolic analysis.
pub struct BlockSolver {
    elimination: Arc<Elimination>,
    factor: Box<dyn Factor>,
    /// Right-hand side and solution in the order of elimination
    parts: Vec<f64>,
}

impl BlockSolver {
    /// Solver for tangents of this pattern. Node blocks of `multipliers` are eliminated after those
    /// they are coupled with. `None` if there is too much fill, or memory is not available.
    pub fn new(pattern: &Pattern, multipliers: &[u32]) -> Option<Self> {
        let elimination = Elimination::new(pattern, multipliers, FillLimit::Little)?;
        Self::by(Arc::new(elimination), pattern, pattern.symmetry == Symmetry::Whole)
    }

    /// Solver with any amount of fill for symmetric tangents, even if the symmetry of the pattern
    /// is not declared. `None` if memory is not available.
    pub fn symmetric(pattern: &Pattern, multipliers: &[u32]) -> Option<Self> {
        Self::by(Arc::new(Elimination::new(pattern, multipliers, FillLimit::Any)?), pattern, true)
    }

    /// Solver in the same order for tangents of a pattern that is [like](Pattern::is_like) this
    /// one.
    pub fn of_like(&self, pattern: &Pattern) -> Option<Self> {
        Self::by(Arc::new(self.elimination.of_like(pattern)), pattern, pattern.symmetry == Symmetry::Whole)
    }

    /// Solver in the same order for symmetric tangents of this pattern.
    pub fn symmetric_beside(&self, pattern: &Pattern) -> Option<Self> {
        Self::by(self.elimination.clone(), pattern, true)
    }

    fn by(elimination: Arc<Elimination>, pattern: &Pattern, symmetric: bool) -> Option<Self> {
        let factor: Box<dyn Factor> = match (pattern.width(), symmetric) {
            (3, true) => Box::new(Pieces::<Ldl<3>, 3>::new(&elimination)?),
            (3, false) => Box::new(Pieces::<Lu<3>, 3>::new(&elimination)?),
            (_, true) => Box::new(Pieces::<Ldl<6>, 6>::new(&elimination)?),
            (_, false) => Box::new(Pieces::<Lu<6>, 6>::new(&elimination)?),
        };
        let parts = vec![0.0; pattern.width() * elimination.order.len()];
        Some(Self { elimination, factor, parts })
    }

    /// Name of the method.
    pub fn name(&self) -> &'static str {
        self.factor.name()
    }

    /// Numbers of rows of the branches that are eliminated in parallel, before the trunk.
    pub fn branches(&self) -> Vec<usize> {
        self.elimination.branches.iter().map(|rows| rows.len()).collect()
    }

    /// Number of blocks right of the diagonal.
    pub fn blocks(&self) -> usize {
        self.elimination.later.len()
    }

    /// True if the tangent is taken for symmetric.
    pub fn is_symmetric(&self) -> bool {
        self.factor.is_symmetric()
    }

    /// Factorises a matrix; `false` if a pivot is zero or not finite, or memory is not available.
    pub fn factorise(&mut self, matrix: Matrix) -> bool {
        self.factor.factorise(&self.elimination, matrix)
    }

    /// True if factors may overwrite the diagonal tiles of this tangent: each branch has
    /// consecutive nodes, and the tangent stores as many values per diagonal tile as the factor.
    pub fn can_stay_within(&self, system: &System) -> bool {
        self.factor.can_stay_within(&self.elimination, system)
    }

    /// Factorises a tangent in place, if that is [possible](Self::can_stay_within), without further
    /// memory. `false` if a pivot is zero or not finite; the tangent is destroyed in any case.
    pub fn factorise_within(&mut self, system: &mut System) -> bool {
        self.factor.factorise_within(&self.elimination, system)
    }

    /// Number of negative pivots of the last factorisation, equal to the number of negative
    /// eigenvalues (Sylvester's law of inertia). `None` if it is unsymmetric or has failed.
    pub fn negative(&self) -> Option<usize> {
        self.factor.negative()
    }

    /// True if the determinant of the last factorised matrix is negative: it has an odd number of
    /// negative real eigenvalues. `None` if the factorisation has failed.
    pub fn has_negative_determinant(&self) -> Option<bool> {
        self.factor.has_negative_determinant()
    }

    /// True if the last factorisation shows no sign of lost digits. For a symmetric tangent, all
    /// pivots are positive: the factors are those of a matrix that differs from A_ij by a few eps
    /// sqrt(A_ii A_jj) (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., theorems
    /// 10.4, 10.5). For an unsymmetric one, no row has subtracted from a diagonal entry much more
    /// than its value. The latter is no proof, since several rows may each subtract some.
    pub fn is_sure(&self) -> bool {
        self.factor.is_sure()
    }

    /// Solves with the last factorisation, which is that of `matrix`; `x` is by equation.
    pub fn solve(&mut self, matrix: Matrix, x: &mut [f64]) {
        match matrix.pattern.width() {
            WIDTH => self.solve_by::<WIDTH>(matrix, x),
            _ => self.solve_by::<3>(matrix, x),
        }
    }

    /// Solves J du = -g for the correction of a system whose tangent was factorised last, and
    /// writes du to a field of slots (global components). Held directions take the components of
    /// `held`, or zero. `false`, with `out` unchanged, if du is not finite.
    pub fn correct(&mut self, system: &System, held: Option<&[Vec3]>, out: &mut [Vec3]) -> bool {
        match system.pattern.width() {
            WIDTH => self.correct_by::<WIDTH>(system, held, out),
            _ => self.correct_by::<3>(system, held, out),
        }
    }

    fn correct_by<const W: usize>(&mut self, system: &System, held: Option<&[Vec3]>, out: &mut [Vec3]) -> bool {
        let Self { elimination, factor, parts } = self;
        threads::each_part(parts.as_chunks_mut::<W>().0, |start, parts| {
            for (part, &node_block) in parts.iter_mut().zip(&elimination.order[start..]) {
                *part = system.right_hand_side_at(node_block as usize);
            }
        });
        factor.solve(elimination, system.matrix(), parts);
        let is_finite = parts.iter().all(|x| x.is_finite());
        let parts = parts.as_chunks::<W>().0;
        if is_finite {
            system.pattern.scatter(|node_block| &parts[elimination.row_of[node_block] as usize], held, out);
        }
        is_finite
    }

    fn solve_by<const W: usize>(&mut self, matrix: Matrix, x: &mut [f64]) {
        let Self { elimination, factor, parts } = self;
        threads::each_part(parts.as_chunks_mut::<W>().0, |start, parts| {
            for (part, &node_block) in parts.iter_mut().zip(&elimination.order[start..]) {
                *part = matrix.pattern.part(node_block as usize, x);
            }
        });
        factor.solve(elimination, matrix, parts);
        let parts = parts.as_chunks::<W>().0;
        matrix.pattern.join(|node_block| &parts[elimination.row_of[node_block] as usize], x);
    }
}
