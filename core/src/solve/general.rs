//! LU with partial pivoting and a fill-reducing column order, by faer, for tangents that the block
//! solver cannot factorise.

use super::columns::CompressedColumns;
use crate::system::System;
use crate::threads;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::mat::MatMut;
use faer::sparse::linalg::lu::{LuRef, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::{Conj, Par};

/// Number of unknowns above which a factorisation may take long, and has a thread of its own so
/// that a request to stop need not wait for it.
const LONG_FACTORISATION: usize = 2000;

/// A sparse LU factorisation with its symbolic analysis.
pub struct GeneralSolver {
    /// `None` after an interrupted factorisation, which keeps it
    sparse_lu: Option<Box<SparseLu>>,
}

/// Matrix, analysis and factors.
struct SparseLu {
    columns: CompressedColumns,
    symbolic: SymbolicLu<u32>,
    numeric: NumericLu<u32, f64>,
    memory: MemBuffer,
}

impl GeneralSolver {
    /// Analyses the pattern of a system. `None` if memory is not available, or after a request to
    /// stop.
    pub fn new(system: &System) -> Option<Self> {
        let columns = CompressedColumns::new(&system.pattern)?;
        let sparse_lu = match columns.count() > LONG_FACTORISATION {
            true => threads::unless_interrupted(|| SparseLu::new(columns)).flatten(),
            false => SparseLu::new(columns),
        };
        Some(Self { sparse_lu: Some(Box::new(sparse_lu?)) })
    }

    /// Factorises the tangent of a system; `false` if no pivot is found, or after a request to
    /// stop.
    pub fn factorise(&mut self, system: &System) -> bool {
        let Some(mut sparse_lu) = self.sparse_lu.take() else { return false };
        sparse_lu.columns.take(system);
        let factorise = move || {
            let done = sparse_lu.factorise();
            (sparse_lu, done)
        };
        let factorised = match system.pattern.dof_map.count() > LONG_FACTORISATION {
            true => threads::unless_interrupted(factorise),
            false => Some(factorise()),
        };
        let Some((sparse_lu, done)) = factorised else { return false };
        self.sparse_lu = Some(sparse_lu);
        done
    }

    /// Solves with the last factorisation, which must not have failed; `x` is by equation.
    pub fn solve(&mut self, x: &mut [f64]) {
        self.sparse_lu.iter_mut().for_each(|sparse_lu| sparse_lu.solve(x));
    }
}

impl SparseLu {
    fn new(columns: CompressedColumns) -> Option<Self> {
        let symbolic = factorize_symbolic_lu(columns.structure(), Default::default()).ok()?;
        let factor = symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
        let solve = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        let memory = MemBuffer::try_new(factor.or(solve)).ok()?;
        Some(Self { columns, symbolic, numeric: NumericLu::new(), memory })
    }

    fn factorise(&mut self) -> bool {
        let matrix = self.columns.matrix();
        let stack = MemStack::new(&mut self.memory);
        self.symbolic.factorize_numeric_lu(&mut self.numeric, matrix, Par::Seq, stack, Default::default()).is_ok()
    }

    fn solve(&mut self, x: &mut [f64]) {
        let n = x.len();
        let lu = LuRef::new_unchecked(&self.symbolic, &self.numeric);
        let x = MatMut::from_column_major_slice_mut(x, n, 1);
        lu.solve_in_place_with_conj(Conj::No, x, Par::Seq, MemStack::new(&mut self.memory));
    }
}
