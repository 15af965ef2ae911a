//! Factorisations of the tangent in blocks, the unknowns of one node each, 6 x 6 or in a plane 3 x 3: L D L^T where it is symmetric, LU
//! where not.
//!
//! The order of elimination is that of least degree, so that chains and trees get no fill at all. Pivots are not looked for
//! across blocks: who uses this looks at the residual of what it solved.

mod elimination;
mod ldl;
mod lu;
mod tile;

use crate::system::{Pattern, System};
use elimination::{Elimination, Place};
use ldl::Ldl;
use lu::Lu;
use std::sync::Arc;
use tile::{Tile, zero};

/// A factorisation in blocks.
pub struct BlockSolver {
    elimination: Arc<Elimination>,
    factor: Box<dyn Factor>,
    /// What is solved for, by row
    parts: Vec<f64>,
}

/// The numbers of a factorisation.
trait Factor: Send {
    /// What it does, in a word.
    fn name(&self) -> &'static str;

    /// Factorises; `false` where a pivot is zero or no number.
    fn factorise(&mut self, elimination: &Elimination, system: &System) -> bool;

    /// See [`BlockSolver::negative`].
    fn negative(&self) -> Option<usize>;

    /// Solves with the last factorisation, row by row.
    fn solve(&self, elimination: &Elimination, x: &mut [f64]);
}

impl BlockSolver {
    /// For tangents of this pattern. `None` where blocks would fill up, or memory cannot be had.
    pub fn new(pattern: &Pattern, symmetric: bool) -> Option<Self> {
        Self::by(Arc::new(Elimination::new(pattern)?), pattern, symmetric)
    }

    /// Another one for tangents of the same pattern, which are symmetric.
    pub fn symmetric_beside(&self, pattern: &Pattern) -> Option<Self> {
        Self::by(self.elimination.clone(), pattern, true)
    }

    fn by(elimination: Arc<Elimination>, pattern: &Pattern, symmetric: bool) -> Option<Self> {
        let (rows, blocks) = (elimination.order.len(), elimination.later.len());
        let factor: Box<dyn Factor> = match (pattern.width(), symmetric) {
            (3, true) => Box::new(Ldl::<3>::new(rows, blocks)?),
            (3, false) => Box::new(Lu::<3>::new(rows, blocks)?),
            (_, true) => Box::new(Ldl::<6>::new(rows, blocks)?),
            (_, false) => Box::new(Lu::<6>::new(rows, blocks)?),
        };
        Some(Self { elimination, factor, parts: vec![0.0; pattern.width() * rows] })
    }

    /// What it does, in a word.
    pub fn name(&self) -> &'static str {
        self.factor.name()
    }

    /// Whether it takes the tangent for symmetric.
    pub fn is_symmetric(&self) -> bool {
        self.factor.negative().is_some()
    }

    /// Factorises; `false` where a pivot is zero or no number.
    pub fn factorise(&mut self, system: &System) -> bool {
        self.factor.factorise(&self.elimination, system)
    }

    /// How many pivots of the last factorisation are negative: as many as the matrix has negative eigenvalues (Sylvester).
    /// `None` where it is not symmetric.
    pub fn negative(&self) -> Option<usize> {
        self.factor.negative()
    }

    /// Solves with the last factorisation; one entry an equation.
    pub fn solve(&mut self, pattern: &Pattern, x: &mut [f64]) {
        let Self { elimination, factor, parts } = self;
        for (part, &group) in parts.chunks_exact_mut(pattern.width()).zip(&elimination.order) {
            for (entry, &number) in part.iter_mut().zip(pattern.numbers(group as usize)) {
                *entry = x.get(number as usize).copied().unwrap_or(0.0);
            }
        }
        factor.solve(elimination, parts);
        for (part, &group) in parts.chunks_exact(pattern.width()).zip(&elimination.order) {
            for (entry, &number) in part.iter().zip(pattern.numbers(group as usize)) {
                if let Some(x) = x.get_mut(number as usize) {
                    *x = *entry;
                }
            }
        }
    }
}

/// Rows of zeros; `None` where memory for them cannot be had.
fn tiles<const W: usize>(count: usize) -> Option<Vec<Tile<W>>> {
    let mut out = Vec::new();
    out.try_reserve_exact(count).ok()?;
    out.resize(count, zero());
    Some(out)
}

/// The tiles of the tangent in the order of the elimination, by rows; what stands left of the diagonal is transposed. Directions
/// that are no equations get a one on the diagonal.
#[inline(always)]
fn load<const W: usize>(
    elimination: &Elimination,
    system: &System,
    diagonal: &mut [Tile<W>],
    upper: &mut [Tile<W>],
    mut lower: Option<&mut [Tile<W>]>,
) {
    // Fill begins at zero.
    upper.fill(zero());
    if let Some(lower) = lower.as_deref_mut() {
        lower.fill(zero());
    }
    for (columns, place) in system.tiles::<W>().iter().zip(&elimination.places) {
        match (*place, lower.as_deref_mut()) {
            // Of a symmetric tangent the one half is the other one's transpose.
            (Place::Diagonal(row), None) => diagonal[row as usize] = *columns,
            (Place::Lower(k), None) => upper[k as usize] = *columns,
            (Place::Upper(_), None) => {}
            (Place::Diagonal(row), Some(_)) => diagonal[row as usize] = tile::transposed(columns),
            (Place::Upper(k), Some(_)) => upper[k as usize] = tile::transposed(columns),
            (Place::Lower(k), Some(lower)) => lower[k as usize] = *columns,
        }
    }
    for &(group, direction) in &system.pattern.idle {
        diagonal[elimination.row_of[group as usize] as usize][direction as usize][direction as usize] = 1.0;
    }
}
