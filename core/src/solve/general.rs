//! LU with partial pivoting and a fill-reducing column order, by faer, for tangents that the block
//! solver cannot factorise.

use super::columns::CompressedColumns;
use crate::system::System;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::mat::MatMut;
use faer::sparse::linalg::lu::{LuRef, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::{Conj, Par};

/// A sparse LU factorisation with its symbolic analysis.
pub struct GeneralSolver {
    columns: CompressedColumns,
    symbolic: SymbolicLu<u32>,
    numeric: NumericLu<u32, f64>,
    memory: MemBuffer,
}

impl GeneralSolver {
    /// Analyses the pattern of a system. `None` if memory is not available.
    pub fn new(system: &System) -> Option<Self> {
        let columns = CompressedColumns::new(&system.pattern);
        let symbolic = factorize_symbolic_lu(columns.structure(), Default::default()).ok()?;
        let factor = symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
        let solve = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        let memory = MemBuffer::try_new(factor.or(solve)).ok()?;
        Some(Self { columns, symbolic, numeric: NumericLu::new(), memory })
    }

    /// Factorises the tangent of a system; `false` if no pivot is found.
    pub fn factorise(&mut self, system: &System) -> bool {
        let matrix = self.columns.matrix(system);
        let stack = MemStack::new(&mut self.memory);
        self.symbolic.factorize_numeric_lu(&mut self.numeric, matrix, Par::Seq, stack, Default::default()).is_ok()
    }

    /// Solves with the last factorisation, which must not have failed; `x` is by equation.
    pub fn solve(&mut self, x: &mut [f64]) {
        let n = x.len();
        let lu = LuRef::new_unchecked(&self.symbolic, &self.numeric);
        let x = MatMut::from_column_major_slice_mut(x, n, 1);
        lu.solve_in_place_with_conj(Conj::No, x, Par::Seq, MemStack::new(&mut self.memory));
    }
}
