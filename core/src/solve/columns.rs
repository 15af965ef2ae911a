//! The tangent in compressed columns of numbers, the format of general sparse solvers.

use crate::interrupt;
use crate::system::{Pattern, System};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

/// Compressed columns of a tangent, with the position of each entry among its values.
pub struct CompressedColumns {
    starts: Vec<u32>,
    rows: Vec<u32>,
    places: Vec<u32>,
    values: Vec<f64>,
}

impl CompressedColumns {
    /// Compressed columns of a pattern. `None` after a request to stop.
    pub fn new(pattern: &Pattern) -> Option<Self> {
        let mut rows = Vec::new();
        let mut places = Vec::new();
        let mut starts = vec![0];
        for column in 0..pattern.dof_map.count() as u32 {
            if interrupt::is_requested() {
                return None;
            }
            let mut entries: Vec<_> = pattern.entries(column).collect();
            // The diagonal tile comes between the others, and nodes that share displacements are
            // not in the order of equations.
            entries.sort_unstable_by_key(|entry| entry.row);
            rows.extend(entries.iter().map(|entry| entry.row));
            places.extend(entries.iter().map(|entry| entry.place as u32));
            starts.push(rows.len() as u32);
        }
        Some(Self { values: vec![0.0; rows.len()], starts, rows, places })
    }

    /// The pattern without values.
    pub fn structure(&self) -> SymbolicSparseColMatRef<'_, u32> {
        let n = self.count();
        SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.rows)
    }

    /// Takes the values of the tangent of a system.
    pub fn take(&mut self, system: &System) {
        for (value, &place) in self.values.iter_mut().zip(&self.places) {
            *value = system.values[place as usize];
        }
    }

    /// The pattern with the values taken last.
    pub fn matrix(&self) -> SparseColMatRef<'_, u32, f64> {
        SparseColMatRef::new(self.structure(), &self.values)
    }

    /// The number of columns.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }
}
