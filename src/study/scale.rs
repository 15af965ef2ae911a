//! What differences of outputs are measured against.

use std::collections::HashMap;

/// Forces below this part of the moments over the length of the scene are round-off, and moments, displacements and rotations likewise: what a run
/// leaves out of balance is up to 1e-8 of the largest force, and adds up over elements.
const ROUND_OFF: f64 = 1e-6;

/// For each column the largest value of its kind in the whole scene: of all displacements, rotations, forces, …. Rows come with the number
/// of the column that they begin with; `length` is that of the scene.
pub(super) fn scales<'a>(columns: &[String], length: f64, rows: impl Iterator<Item = (usize, &'a [f64])>) -> Vec<f64> {
    let kinds: Vec<&str> = columns.iter().map(|column| kind(column)).collect();
    let mut scales = HashMap::new();
    for (first, row) in rows {
        for (kind, value) in kinds[first..].iter().zip(row) {
            let scale = scales.entry(*kind).or_insert(0.0_f64);
            *scale = scale.max(value.abs());
        }
    }
    // Round-off of forces is no moment, that of displacements no rotation, and the other way about.
    let before = scales.clone();
    for (along, about, arm) in [
        ("f", "m", length),
        ("N", "M", length),
        ("u", "r", 1.0 / length),
        ("v", "w", 1.0 / length),
        ("a", "alpha", 1.0 / length),
        ("G", "K", 1.0 / length),
    ] {
        for (one, other, arm) in [(about, along, arm), (along, about, 1.0 / arm)] {
            let floor = before.get(other).map_or(0.0, |scale| ROUND_OFF * arm * scale);
            scales.entry(one).and_modify(|scale| *scale = scale.max(floor));
        }
    }
    kinds.iter().map(|kind| scales.get(kind).copied().unwrap_or(0.0)).collect()
}

/// What a column shows: its name without the node, and without the direction. Energies compare with each other: their sum is the error
/// of the scheme alone.
pub(super) fn kind(column: &str) -> &str {
    // Behind a space stands at which row it is looked at.
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
        let rows = [(0, &[2.0, -5.0, 1e-16, f64::NAN, 3.0][..])];
        let scales = scales(&columns, 10.0, rows.into_iter());
        assert_eq!(scales, [5.0, 5.0, ROUND_OFF * 0.5, 0.0, 3.0]);
    }
}
