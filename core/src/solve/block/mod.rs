//! Factorisations of the tangent in blocks, the unknowns of one node each, 6 x 6 or in a plane 3 x
//! 3: L D L^T where it is symmetric, LU where not.
//!
//! The order of elimination is that of least degree, in large scenes turned towards a middle, so
//! that chains and trees get no fill at all. Pivots are not looked for across blocks: who uses this
//! looks at the residual of what it solved, or whether the factorisation is
//! [sure](BlockSolver::is_sure). Where blocks are not filled up the tangent's own serve beside the
//! diagonal; those on it may give their place to the factors, too.

mod diagonal;
mod elimination;
mod factor;
mod ldl;
mod lu;
mod order;
mod pieces;
mod stretch;
mod tile;

use crate::system::{Matrix, Pattern, Symmetry, System, WIDTH};
use crate::tensor::Vec3;
use crate::threads;
use elimination::{Elimination, Fill};
use factor::Factor;
use ldl::Ldl;
use lu::Lu;
use pieces::Pieces;
use std::sync::Arc;

/// A factorisation in blocks.
pub struct BlockSolver {
    elimination: Arc<Elimination>,
    factor: Box<dyn Factor>,
    /// The unknowns that are solved for, by row
    parts: Vec<f64>,
}

impl BlockSolver {
    /// For tangents of this pattern; groups of `multipliers` are eliminated behind those that they
    /// meet. `None` where blocks would fill up, or memory cannot be had.
    pub fn new(pattern: &Pattern, multipliers: &[u32]) -> Option<Self> {
        let elimination = Elimination::new(pattern, multipliers, Fill::Little)?;
        Self::by(Arc::new(elimination), pattern, pattern.symmetry == Symmetry::Whole)
    }

    /// For tangents of this pattern that are symmetric, even where the pattern does not say so, and
    /// with as much fill as it takes. `None` where memory cannot be had.
    pub fn symmetric(pattern: &Pattern, multipliers: &[u32]) -> Option<Self> {
        Self::by(Arc::new(Elimination::new(pattern, multipliers, Fill::Any)?), pattern, true)
    }

    /// Another one for tangents of a pattern that is [like](Pattern::is_like) its own: in the same
    /// order.
    pub fn of_like(&self, pattern: &Pattern) -> Option<Self> {
        Self::by(Arc::new(self.elimination.of_like(pattern)), pattern, pattern.symmetry == Symmetry::Whole)
    }

    /// Another one for tangents of the same pattern, which are symmetric.
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

    /// The name of its factorisation, in a word.
    pub fn name(&self) -> &'static str {
        self.factor.name()
    }

    /// The rows in each part that is eliminated at once with others; what is left comes last.
    pub fn branches(&self) -> Vec<usize> {
        self.elimination.branches.iter().map(|rows| rows.len()).collect()
    }

    /// The blocks right of the diagonal.
    pub fn blocks(&self) -> usize {
        self.elimination.later.len()
    }

    /// True if it takes the tangent for symmetric.
    pub fn is_symmetric(&self) -> bool {
        self.factor.is_symmetric()
    }

    /// Factorises; `false` where a pivot is zero or no number, or memory cannot be had.
    pub fn factorise(&mut self, matrix: Matrix) -> bool {
        self.factor.factorise(&self.elimination, matrix)
    }

    /// True if the factors may take the place of this tangent: each branch has nodes that follow
    /// each other, and the tangent keeps as much of the tiles on its diagonal as the factors.
    pub fn can_stay_within(&self, system: &System) -> bool {
        self.factor.can_stay_within(&self.elimination, system)
    }

    /// Factorises a tangent whose place the factors [can](Self::can_stay_within) take: it needs no
    /// memory. `false` where a pivot is zero or no number; the tangent is gone in any case.
    pub fn factorise_within(&mut self, system: &mut System) -> bool {
        self.factor.factorise_within(&self.elimination, system)
    }

    /// How many pivots of the last factorisation are negative: as many as the matrix has negative
    /// eigenvalues (Sylvester). `None` where it is not symmetric, or did not come to its end.
    pub fn negative(&self) -> Option<usize> {
        self.factor.negative()
    }

    /// True if the determinant of what was factorised last is negative: an odd number of its real
    /// eigenvalues is. `None` where the factorisation did not come to its end.
    pub fn has_negative_determinant(&self) -> Option<bool> {
        self.factor.has_negative_determinant()
    }

    /// True if the last factorisation shows no sign of lost digits. Where the tangent is symmetric,
    /// all pivots are positive: it is that of a matrix which differs from A_ij by a few eps
    /// sqrt(A_ii A_jj) (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., theorems
    /// 10.4, 10.5). Where not, no row took from an entry on the diagonal much more than what it had
    /// then: no proof, since several rows may take some each.
    pub fn is_sure(&self) -> bool {
        self.factor.is_sure()
    }

    /// Solves with the last factorisation, which is that of `matrix`; one entry an equation.
    pub fn solve(&mut self, matrix: Matrix, x: &mut [f64]) {
        match matrix.pattern.width() {
            WIDTH => self.solve_by::<WIDTH>(matrix, x),
            _ => self.solve_by::<3>(matrix, x),
        }
    }

    /// Solves for the correction that a system asks for, whose tangent was factorised last, and
    /// writes it into a field of slots; held directions take their part of `held`. Whether it is
    /// finite.
    pub fn correct(&mut self, system: &System, held: Option<&[Vec3]>, out: &mut [Vec3]) -> bool {
        match system.pattern.width() {
            WIDTH => self.correct_by::<WIDTH>(system, held, out),
            _ => self.correct_by::<3>(system, held, out),
        }
    }

    fn correct_by<const W: usize>(&mut self, system: &System, held: Option<&[Vec3]>, out: &mut [Vec3]) -> bool {
        let Self { elimination, factor, parts } = self;
        threads::each_part(parts.as_chunks_mut::<W>().0, |start, parts| {
            for (part, &group) in parts.iter_mut().zip(&elimination.order[start..]) {
                *part = system.right_hand_side_at(group as usize);
            }
        });
        factor.solve(elimination, system.matrix(), parts);
        let (is_finite, parts) = (parts.iter().all(|x| x.is_finite()), parts.as_chunks::<W>().0);
        if is_finite {
            system.pattern.scatter(|group| &parts[elimination.row_of[group] as usize], held, out);
        }
        is_finite
    }

    fn solve_by<const W: usize>(&mut self, matrix: Matrix, x: &mut [f64]) {
        let Self { elimination, factor, parts } = self;
        threads::each_part(parts.as_chunks_mut::<W>().0, |start, parts| {
            for (part, &group) in parts.iter_mut().zip(&elimination.order[start..]) {
                *part = matrix.pattern.part(group as usize, x);
            }
        });
        factor.solve(elimination, matrix, parts);
        let parts = parts.as_chunks::<W>().0;
        matrix.pattern.join(|group| &parts[elimination.row_of[group] as usize], x);
    }
}
