//! Factorisations of the tangent in 6 x 6 blocks, the unknowns of one node each: L D L^T where it is symmetric, LU where not.
//!
//! The order of elimination is that of least degree, so that chains and trees get no fill at all. Pivots are not looked for
//! across blocks: who uses this looks at the residual of what it solved.

mod elimination;
mod ldl;
mod lu;
mod tile;

use crate::real::Instructions;
use crate::system::{Pattern, System};
use elimination::{Elimination, Place};
use ldl::Ldl;
use lu::Lu;
use tile::{Part, Tile, WIDTH, ZERO};

/// A factorisation in blocks.
pub struct BlockSolver {
    elimination: Elimination,
    factor: Factor,
    /// By row
    parts: Vec<Part>,
}

enum Factor {
    Symmetric(Ldl),
    General(Lu),
}

impl BlockSolver {
    /// For tangents of this pattern. `None` where blocks would fill up, or memory cannot be had.
    pub fn new(pattern: &Pattern, symmetric: bool) -> Option<Self> {
        let elimination = Elimination::new(pattern)?;
        let (rows, blocks) = (elimination.order.len(), elimination.later.len());
        let factor = if symmetric {
            Factor::Symmetric(Ldl::new(rows, blocks)?)
        } else {
            Factor::General(Lu::new(rows, blocks)?)
        };
        Some(Self { elimination, factor, parts: vec![[0.0; WIDTH]; rows] })
    }

    /// What it does, in a word.
    pub fn name(&self) -> &'static str {
        match self.factor {
            Factor::Symmetric(_) => "block LDL^T",
            Factor::General(_) => "block LU",
        }
    }

    /// Factorises; `false` where a pivot is zero or no number.
    pub fn factorise(&mut self, system: &System) -> bool {
        let Self { elimination, factor, .. } = self;
        Instructions::here().run(
            #[inline(always)]
            || match factor {
                Factor::Symmetric(ldl) => ldl.factorise(elimination, system),
                Factor::General(lu) => lu.factorise(elimination, system),
            },
        )
    }

    /// How many pivots of the last factorisation are negative: as many as the matrix has negative eigenvalues (Sylvester).
    /// `None` where it is not symmetric.
    pub fn negative(&self) -> Option<usize> {
        match &self.factor {
            Factor::Symmetric(ldl) => Some(ldl.negative),
            Factor::General(_) => None,
        }
    }

    /// Solves with the last factorisation; one entry an equation.
    pub fn solve(&mut self, pattern: &Pattern, x: &mut [f64]) {
        let Self { elimination, factor, parts } = self;
        for (part, &group) in parts.iter_mut().zip(&elimination.order) {
            for (entry, &number) in part.iter_mut().zip(pattern.numbers(group as usize)) {
                *entry = x.get(number as usize).copied().unwrap_or(0.0);
            }
        }
        Instructions::here().run(
            #[inline(always)]
            || match factor {
                Factor::Symmetric(ldl) => ldl.solve(elimination, parts),
                Factor::General(lu) => lu.solve(elimination, parts),
            },
        );
        for (part, &group) in parts.iter().zip(&elimination.order) {
            for (entry, &number) in part.iter().zip(pattern.numbers(group as usize)) {
                if let Some(x) = x.get_mut(number as usize) {
                    *x = *entry;
                }
            }
        }
    }
}

/// Rows of zeros; `None` where memory for them cannot be had.
fn tiles(count: usize) -> Option<Vec<Tile>> {
    let mut out = Vec::new();
    out.try_reserve_exact(count).ok()?;
    out.resize(count, ZERO);
    Some(out)
}

/// The tiles of the tangent in the order of the elimination, by rows; what stands left of the diagonal is transposed. Directions
/// that are no equations get a one on the diagonal.
#[inline(always)]
fn load(
    elimination: &Elimination,
    system: &System,
    diagonal: &mut [Tile],
    upper: &mut [Tile],
    mut lower: Option<&mut [Tile]>,
) {
    // Fill begins at zero.
    upper.fill(ZERO);
    if let Some(lower) = lower.as_deref_mut() {
        lower.fill(ZERO);
    }
    for (columns, place) in system.tiles().iter().zip(&elimination.places) {
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
