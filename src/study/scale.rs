//! Scales of outputs, to make differences relative.

use beamsim_core::probe::{self, MeshError, Quantity};
use std::collections::HashMap;

/// Forces below this part of the moments over the length of the scene are round-off, and moments,
/// displacements and rotations likewise: residuals are up to 1e-8 of the largest force, and add up
/// over elements.
const ROUND_OFF: f64 = 1e-6;

/// Numbers of consecutive columns.
#[derive(Clone, Copy)]
pub(super) struct ScaleRow<'a> {
    /// The number of the first column
    pub(super) first: usize,
    /// The numbers
    pub(super) values: &'a [f64],
}

/// For each column the largest value of its quantity in the whole scene: of all displacements,
/// rotations, forces, …. `length` is that of the scene.
pub(super) fn scales<'a>(columns: &[String], length: f64, rows: impl Iterator<Item = ScaleRow<'a>>) -> Vec<f64> {
    let quantities: Vec<Option<Quantity>> = columns.iter().map(|column| scale_quantity(column)).collect();
    let mut scales = HashMap::new();
    for row in rows {
        for (quantity, value) in quantities[row.first..].iter().zip(row.values) {
            let scale = scales.entry(*quantity).or_insert(0.0_f64);
            *scale = scale.max(value.abs());
        }
    }
    // Round-off of forces must not count as a moment, nor that of displacements as a rotation, and
    // vice versa.
    let before = scales.clone();
    let mut set_floor = |quantity: Quantity, partner: Quantity, arm: f64| {
        let floor = before.get(&Some(partner)).map_or(0.0, |scale| ROUND_OFF * arm * scale);
        scales.entry(Some(quantity)).and_modify(|scale| *scale = scale.max(floor));
    };
    for along in Quantity::ALL {
        let Some(about) = along.about_axis() else { continue };
        let arm = length.powi(about.dimension().length - along.dimension().length);
        set_floor(about, along, arm);
        set_floor(along, about, 1.0 / arm);
    }
    quantities.iter().map(|quantity| scales.get(quantity).copied().unwrap_or(0.0)).collect()
}

/// The quantity of an output, with or without the row of an expectation after a space.
pub(super) fn quantity(output: &str) -> Option<Quantity> {
    probe::quantity(output.split(' ').next().unwrap_or(output))
}

/// The quantity whose largest value is the scale of an output. An angular frequency and a growth
/// rate are the two parts of one eigenvalue, and have one scale.
fn scale_quantity(output: &str) -> Option<Quantity> {
    let quantity = quantity(output)?;
    Some(if quantity == Quantity::GrowthRate { Quantity::AngularFrequency } else { quantity })
}

/// True if an output changes in jumps, so that its error says nothing about a mesh.
pub(super) fn jumps(output: &str) -> bool {
    mesh_error(output) == MeshError::Jumps
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
        let row = ScaleRow { first: 0, values: &[2.0, -5.0, 1e-16, f64::NAN, 3.0] };
        let scales = scales(&columns, 10.0, std::iter::once(row));
        assert_eq!(scales, [5.0, 5.0, ROUND_OFF * 0.5, 0.0, 3.0]);
    }

    #[test]
    fn outputs_have_quantities() {
        assert_eq!(quantity("tip.ux at the end"), Some(Quantity::Displacement));
        assert_eq!(quantity("stage2.mode1.growth"), Some(Quantity::GrowthRate));
        assert_eq!(scale_quantity("stage2.mode1.growth"), scale_quantity("stage2.mode1.omega"));
        assert_eq!(quantity("buckling1.load"), Some(Quantity::LoadFactor));
        assert_eq!(mesh_error("arm@0.5.M2"), MeshError::Slopes);
    }
}
