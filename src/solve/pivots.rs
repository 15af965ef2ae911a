//! The number of negative pivots of a symmetric tangent: how many directions have lost their stiffness.

use super::block::BlockSolver;
use super::columns::Columns;
use super::linear::LinearSolver;
use super::tangent::Tangent;
use crate::system::{Equations, Pattern, Slot, Symmetry, System};
use faer::Par;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};

/// LDL^T without pivoting, whose D tells the inertia (Sylvester).
pub(super) enum Pivots {
    /// By blocks
    Blocks(Box<BlockSolver>),
    /// In general
    Entries(Box<Entries>),
}

/// Of numbers, by faer.
pub(super) struct Entries {
    symbolic: SymbolicCholesky<u32>,
    columns: Columns,
    memory: MemBuffer,
    factor: Vec<f64>,
    /// Where the diagonal entries of multipliers are stored
    multipliers: Vec<usize>,
}

/// A tangent whose entries differ from their mirror images by more than this is not symmetric: relative to the roots of the
/// diagonal entries that they stand between, so that stiff directions do not hide soft ones.
const SYMMETRY: f64 = 1e-9;

/// What multipliers get on their diagonal, relative to the largest stiffness, so that pivots exist.
const COMPLIANCE: f64 = 1e-9;

impl LinearSolver {
    /// How many pivots of the tangent are negative, those of multipliers left out; `None` where it is not symmetric, or a
    /// pivot is lost. Where this solver's own factorisation tells, the tangent is what it has factorised last,
    /// and may be used up by that.
    pub fn negative_pivots(&mut self, tangent: &mut Tangent) -> Option<usize> {
        if self.is_symmetric() {
            return self.negative_of_own(tangent);
        }
        let system = tangent.look();
        if !is_symmetric(&system.pattern, &system.values) {
            return None;
        }
        if self.pivots.is_none() {
            self.pivots = Pivots::beside(self, system);
        }
        self.pivots.as_mut()?.negative(system)
    }
}

impl Pivots {
    /// Of a solver whose own factorisation does not tell; its order of elimination serves for both. `None` where memory cannot be
    /// had.
    fn beside(solver: &LinearSolver, system: &System) -> Option<Self> {
        let blocks = match solver.blocks() {
            Some(blocks) => blocks.symmetric_beside(&system.pattern),
            None => solver.multipliers.is_empty().then(|| BlockSolver::symmetric(&system.pattern)).flatten(),
        };
        match blocks {
            Some(blocks) => Some(Self::Blocks(Box::new(blocks))),
            None => Some(Self::Entries(Box::new(Entries::new(system, &solver.multipliers)?))),
        }
    }

    fn negative(&mut self, system: &System) -> Option<usize> {
        match self {
            Self::Blocks(blocks) => blocks.factorise(system).then(|| blocks.negative()).flatten(),
            Self::Entries(entries) => entries.negative(system),
        }
    }
}

impl Entries {
    fn new(system: &System, multipliers: &[Slot]) -> Option<Self> {
        let columns = Columns::new(&system.pattern);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SIMPLICIAL,
            ..Default::default()
        };
        let (side, order) = (faer::Side::Lower, SymmetricOrdering::Amd);
        let symbolic = factorize_symbolic_cholesky(columns.structure(), side, order, params).ok()?;
        let scratch = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let memory = MemBuffer::try_new(scratch).ok()?;
        let numbers = multipliers.iter().flat_map(|&slot| system.pattern.equations.of(slot));
        let multipliers =
            numbers.filter(|&n| n != Equations::HELD).filter_map(|number| columns.diagonal(number)).collect();
        Some(Self { factor: vec![0.0; symbolic.len_val()], symbolic, columns, memory, multipliers })
    }

    fn negative(&mut self, system: &System) -> Option<usize> {
        let Self { symbolic, columns, memory, factor, multipliers } = self;
        let matrix = columns.matrix(system, |values| {
            let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            multipliers.iter().for_each(|&place| values[place] -= COMPLIANCE / largest);
        });
        let (stack, side) = (MemStack::new(memory), faer::Side::Lower);
        let done = symbolic.factorize_numeric_ldlt(
            factor,
            matrix,
            side,
            Default::default(),
            Par::Seq,
            stack,
            Default::default(),
        );
        if done.is_err() {
            return None;
        }
        let SymbolicCholeskyRaw::Simplicial(simplicial) = symbolic.raw() else { return None };
        let starts = simplicial.col_ptr();
        let diagonal = (0..system.pattern.equations.count()).map(|column| factor[starts[column] as usize]);
        let negative = diagonal.filter(|&d| d < 0.0).count();
        negative.checked_sub(multipliers.len())
    }
}

/// Whether each entry is what its mirror image is. Of tiles of which one is kept nothing is to be told.
pub fn is_symmetric(pattern: &Pattern, values: &[f64]) -> bool {
    if pattern.symmetry == Symmetry::Whole {
        return true;
    }
    let width = pattern.width();
    let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let entry = |tile: usize, r: usize, c: usize| values[pattern.storage.entry(tile, r, c)];
    let root = |k: usize| match pattern.tile(k / width, k / width).map_or(0.0, |tile| entry(tile, k % width, k % width))
    {
        0.0 => largest.sqrt(),
        diagonal => diagonal.abs().sqrt(),
    };
    let roots: Vec<f64> = (0..width * pattern.groups.count()).map(root).collect();
    let roots: Vec<&[f64]> = roots.chunks_exact(width).collect();
    (0..pattern.groups.count()).all(|column| {
        let beside = pattern.rows_of(column).iter().map(|&row| row as usize);
        let beside = beside.filter(|&row| row > column && !pattern.symmetry.halves());
        let rows = std::iter::once(column).chain(beside);
        let mut pairs = rows.map(|row| (row, pattern.tile(row, column), pattern.tile(column, row)));
        pairs.all(|(row, tile, mirror)| match (tile, mirror) {
            (Some(tile), Some(mirror)) => (0..width * width).all(|k| {
                let (c, r) = (k / width, k % width);
                let difference = entry(tile, r, c) - entry(mirror, c, r);
                difference.abs() <= SYMMETRY * roots[column][c] * roots[row][r]
            }),
            // Whom a node meets meets it.
            _ => false,
        })
    })
}
