//! What differences of outputs are measured against.

use crate::deck::without_stage;
use crate::scene::{ModeQuantity, mode_quantity};
use beamsim_core::probe::{self, MeshError, Quantity};
use std::collections::HashMap;

/// Forces below this part of the moments over the length of the scene are round-off, and moments, displacements and
/// rotations likewise: what a run leaves out of balance is up to 1e-8 of the largest force, and adds up over elements.
const ROUND_OFF: f64 = 1e-6;

/// For each column the largest value of its quantity in the whole scene: of all displacements, rotations, forces, …. Rows
/// come with the number of the column that they begin with; `length` is that of the scene.
pub(super) fn scales<'a>(columns: &[String], length: f64, rows: impl Iterator<Item = (usize, &'a [f64])>) -> Vec<f64> {
    let quantities: Vec<Option<Quantity>> = columns.iter().map(|column| quantity(column)).collect();
    let mut scales = HashMap::new();
    for (first, row) in rows {
        for (quantity, value) in quantities[first..].iter().zip(row) {
            let scale = scales.entry(*quantity).or_insert(0.0_f64);
            *scale = scale.max(value.abs());
        }
    }
    // Round-off of forces is no moment, that of displacements no rotation, and the other way about.
    let before = scales.clone();
    for along in Quantity::ALL {
        let Some(about) = along.about_axis() else { continue };
        let arm = length.powi(about.dimension().length - along.dimension().length);
        for (one, other, arm) in [(about, along, arm), (along, about, 1.0 / arm)] {
            let floor = before.get(&Some(other)).map_or(0.0, |scale| ROUND_OFF * arm * scale);
            scales.entry(Some(one)).and_modify(|scale| *scale = scale.max(floor));
        }
    }
    quantities.iter().map(|quantity| scales.get(quantity).copied().unwrap_or(0.0)).collect()
}

/// Quantity of an output: of a column of the history, a mode or a critical load, with or without its stage before it and
/// the row at which it is looked at behind a space.
pub(super) fn quantity(output: &str) -> Option<Quantity> {
    let column = output.split(' ').next().unwrap_or(output);
    match mode_quantity(without_stage(column)) {
        Some((ModeQuantity::Omega | ModeQuantity::Growth, _)) => Some(Quantity::Eigenvalue),
        Some((ModeQuantity::Load, _)) => Some(Quantity::LoadFactor),
        None => probe::quantity(column),
    }
}

/// Order at which the error of an output falls with the width of elements.
pub(super) fn mesh_error(output: &str) -> MeshError {
    quantity(output).map_or(MeshError::Unspecified, Quantity::mesh_error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_off_of_one_kind_is_measured_by_its_partner() {
        let columns = ["a.ux", "b.uy", "a.rz", "a.mz", "energy.strain"].map(String::from);
        let rows = [(0, &[2.0, -5.0, 1e-16, f64::NAN, 3.0][..])];
        let scales = scales(&columns, 10.0, rows.into_iter());
        assert_eq!(scales, [5.0, 5.0, ROUND_OFF * 0.5, 0.0, 3.0]);
    }

    #[test]
    fn outputs_have_quantities() {
        assert_eq!(quantity("tip.ux at the end"), Some(Quantity::Displacement));
        assert_eq!(quantity("stage2.mode1.growth"), Some(Quantity::Eigenvalue));
        assert_eq!(quantity("buckling1.load"), Some(Quantity::LoadFactor));
        assert_eq!(mesh_error("arm@0.5.M2"), MeshError::Slopes);
    }
}
