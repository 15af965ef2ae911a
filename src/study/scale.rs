//! Scales of outputs, to make differences relative.

use std::collections::HashMap;

/// Forces below this part of the moments over the length of the scene are round-off, and moments,
/// displacements and rotations likewise: residuals are up to 1e-8 of the largest force, and add up
/// over elements.
const ROUND_OFF: f64 = 1e-6;

/// Numbers of consecutive columns.
#[derive(Clone, Copy)]
pub(super) struct ScaleRow<'a> {
    /// The number of the first column
    pub first: usize,
    /// The numbers
    pub values: &'a [f64],
}

/// For each column the largest value of its kind in the whole scene: of all displacements,
/// rotations, forces, …. `length` is that of the scene.
pub(super) fn scales<'a>(columns: &[String], length: f64, rows: impl Iterator<Item = ScaleRow<'a>>) -> Vec<f64> {
    let kinds: Vec<&str> = columns.iter().map(|column| kind(column)).collect();
    let mut scales = HashMap::new();
    for row in rows {
        for (kind, value) in kinds[row.first..].iter().zip(row.values) {
            let scale = scales.entry(*kind).or_insert(0.0_f64);
            *scale = scale.max(value.abs());
        }
    }
    // Round-off of forces must not count as a moment, nor that of displacements as a rotation, and
    // vice versa.
    let before = scales.clone();
    let mut set_floor = |kind: &'static str, partner: &str, arm: f64| {
        let floor = before.get(partner).map_or(0.0, |scale| ROUND_OFF * arm * scale);
        scales.entry(kind).and_modify(|scale| *scale = scale.max(floor));
    };
    for (force, moment) in [("f", "m"), ("N", "M")] {
        set_floor(moment, force, length);
        set_floor(force, moment, 1.0 / length);
    }
    for (translation, rotation) in [("u", "r"), ("v", "w"), ("a", "alpha"), ("G", "K")] {
        set_floor(rotation, translation, 1.0 / length);
        set_floor(translation, rotation, 1.0 / (1.0 / length));
    }
    kinds.iter().map(|kind| scales.get(kind).copied().unwrap_or(0.0)).collect()
}

/// The kind of a column: its name without node and direction. All energies are one kind, since they
/// are compared with each other.
pub(super) fn kind(column: &str) -> &str {
    // After a space the name tells the row of an expectation.
    let column = column.split(' ').next().unwrap_or(column);
    if column.starts_with("energy.") {
        return "energy";
    }
    if column.ends_with(".omega") || column.ends_with(".growth") {
        return "mode";
    }
    let quantity = column.rsplit('.').next().unwrap_or(column);
    quantity.trim_end_matches(|c: char| c.is_ascii_digit() || ['x', 'y', 'z'].contains(&c))
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
}
