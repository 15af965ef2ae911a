//! The number of negative pivots of a symmetric tangent: how many directions have lost their stiffness.

use crate::system::{Pattern, Slot, System};
use faer::Par;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

/// LDL^T without pivoting, whose D tells the inertia (Sylvester).
pub struct Pivots {
    symbolic: SymbolicCholesky<u32>,
    memory: MemBuffer,
    factor: Vec<f64>,
    values: Vec<f64>,
    /// Where the diagonal entries of multipliers are stored
    multipliers: Vec<usize>,
}

/// A tangent whose entries differ from their mirror images by more than this is not symmetric: relative to the roots of the
/// diagonal entries that they stand between, so that stiff directions do not hide soft ones.
const SYMMETRY: f64 = 1e-9;

/// What multipliers get on their diagonal, relative to the largest stiffness, so that pivots exist.
const COMPLIANCE: f64 = 1e-9;

impl Pivots {
    /// For tangents of this pattern. `None` where memory cannot be had.
    pub fn new(system: &System, multipliers: &[Slot]) -> Option<Self> {
        let pattern = &system.pattern;
        let (n, entries) = (pattern.equations.count(), pattern.nonzeros());
        let structure = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.rows);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SIMPLICIAL,
            ..Default::default()
        };
        let symbolic =
            factorize_symbolic_cholesky(structure, faer::Side::Lower, SymmetricOrdering::Amd, params).ok()?;
        let scratch = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let memory = MemBuffer::try_new(scratch).ok()?;
        let numbers = multipliers.iter().flat_map(|&slot| pattern.equations.of(slot));
        let multipliers = numbers.filter_map(|number| pattern.find(number, number)).collect();
        Some(Self { factor: vec![0.0; symbolic.len_val()], values: vec![0.0; entries], symbolic, memory, multipliers })
    }

    /// How many pivots of the tangent are negative, those of multipliers left out; `None` where it is not symmetric, or a
    /// pivot is lost.
    pub fn negative(&mut self, system: &System) -> Option<usize> {
        let pattern = &system.pattern;
        if !is_symmetric(pattern, &system.values) {
            return None;
        }
        let entries = self.values.len();
        self.values.copy_from_slice(&system.values[..entries]);
        let largest = self.values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for &place in &self.multipliers {
            self.values[place] -= COMPLIANCE / largest;
        }
        let n = pattern.equations.count();
        let structure = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.rows);
        let matrix = SparseColMatRef::new(structure, &self.values[..]);
        let stack = MemStack::new(&mut self.memory);
        let regularization = Default::default();
        let done = self.symbolic.factorize_numeric_ldlt(
            &mut self.factor,
            matrix,
            faer::Side::Lower,
            regularization,
            Par::Seq,
            stack,
            Default::default(),
        );
        if done.is_err() {
            return None;
        }
        let SymbolicCholeskyRaw::Simplicial(simplicial) = self.symbolic.raw() else { return None };
        let starts = simplicial.col_ptr();
        let diagonal = (0..n).map(|column| self.factor[starts[column] as usize]);
        let negative = diagonal.filter(|&d| d < 0.0).count();
        negative.checked_sub(self.multipliers.len())
    }
}

/// Whether each entry is what its mirror image is.
pub fn is_symmetric(pattern: &Pattern, values: &[f64]) -> bool {
    let values = &values[..pattern.nonzeros()];
    let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let root = |k: u32| match pattern.find(k, k).map_or(0.0, |place| values[place].abs().sqrt()) {
        0.0 => largest.sqrt(),
        root => root,
    };
    let roots: Vec<f64> = (0..pattern.equations.count() as u32).map(root).collect();
    (0..pattern.equations.count() as u32).all(|column| {
        let entries =
            pattern.column_starts[column as usize] as usize..pattern.column_starts[column as usize + 1] as usize;
        entries.into_iter().all(|k| {
            let mirror = pattern.find(column, pattern.rows[k]).map_or(0.0, |place| values[place]);
            (values[k] - mirror).abs() <= SYMMETRY * roots[column as usize] * roots[pattern.rows[k] as usize]
        })
    })
}
