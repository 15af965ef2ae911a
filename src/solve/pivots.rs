//! The number of negative pivots of a symmetric tangent: how many directions have lost their stiffness.

use super::block::BlockSolver;
use super::columns::Columns;
use super::linear::LinearSolver;
use crate::system::{Equations, Pattern, Slot, System};
use faer::Par;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};

/// LDL^T without pivoting, whose D tells the inertia (Sylvester).
pub enum Pivots {
    /// By blocks
    Blocks(Box<BlockSolver>),
    /// In general
    Entries(Box<Entries>),
}

/// Of numbers, by faer.
pub struct Entries {
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

impl Pivots {
    /// For tangents of this pattern; a `solver` for it lends its order of elimination. `None` where memory cannot be had.
    pub fn new(system: &System, multipliers: &[Slot], solver: Option<&LinearSolver>) -> Option<Self> {
        let pattern = &system.pattern;
        let blocks = match solver.and_then(LinearSolver::blocks) {
            Some(blocks) => blocks.symmetric_beside(pattern),
            None => multipliers.is_empty().then(|| BlockSolver::new(pattern, true)).flatten(),
        };
        match blocks {
            Some(blocks) => Some(Self::Blocks(Box::new(blocks))),
            None => Some(Self::Entries(Box::new(Entries::new(system, multipliers)?))),
        }
    }

    /// How many pivots of the tangent are negative, those of multipliers left out; `None` where it is not symmetric, or a
    /// pivot is lost.
    pub fn negative(&mut self, system: &System) -> Option<usize> {
        if !system.symmetric && !is_symmetric(&system.pattern, &system.values) {
            return None;
        }
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

/// Whether each entry is what its mirror image is.
pub fn is_symmetric(pattern: &Pattern, values: &[f64]) -> bool {
    let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let root = |k: u32| match pattern.find(k, k).map_or(0.0, |place| values[place].abs().sqrt()) {
        0.0 => largest.sqrt(),
        root => root,
    };
    let count = pattern.equations.count() as u32;
    let roots: Vec<f64> = (0..count).map(root).collect();
    (0..count).all(|column| {
        pattern.entries(column).all(|entry| {
            let mirror = pattern.find(column, entry.row).map_or(0.0, |place| values[place]);
            (values[entry.place] - mirror).abs() <= SYMMETRY * roots[column as usize] * roots[entry.row as usize]
        })
    })
}
