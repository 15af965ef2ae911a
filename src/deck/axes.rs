//! `axes = [[…], […]]`: turned directions of supports, motions and springs.

use super::reader::{Context, Item, Table, kind_of};
use toml::de::DeValue;

/// Two orthonormal directions; the third follows.
pub type Axes = [[f64; 3]; 2];

/// Departure from unit length and right angles that is taken for rounding.
const ORTHONORMAL: f64 = 1e-6;

/// The key `axes` of a table; `Some(None)` where it is left out.
pub(super) fn read_axes(table: &Table) -> Option<Option<Axes>> {
    table.optional("axes", |context, item| {
        let DeValue::Array(rows) = item.get_ref() else {
            return context
                .wrong(item.span(), format!("`axes` must be two vectors, found {}", kind_of(item.get_ref())));
        };
        if rows.len() != 2 {
            return context
                .wrong(item.span(), format!("`axes` must be the first two of three directions, found {}", rows.len()));
        }
        let rows: Vec<Option<[f64; 3]>> = rows.iter().map(|row| context.vector(row).map(|v| v.value)).collect();
        let [a, b]: [Option<[f64; 3]>; 2] = rows.try_into().ok()?;
        let a = a?;
        let b = b?;
        let off = (dot(a, a) - 1.0).abs().max((dot(b, b) - 1.0).abs()).max(dot(a, b).abs());
        if off > ORTHONORMAL {
            return context.wrong(item.span(), "`axes` must be two unit vectors normal to each other");
        }
        Some([a, b])
    })
}

/// The scalar product.
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector of length one in a direction; `None` for zero. Components of any size are allowed:
/// they are scaled where their squares would overflow or vanish.
pub(super) fn unit(vector: [f64; 3]) -> Option<[f64; 3]> {
    const SHORTEST: f64 = 1e-150;
    const LONGEST: f64 = 1e150;
    let length = dot(vector, vector).sqrt();
    if (SHORTEST..=LONGEST).contains(&length) {
        return Some(vector.map(|c| c / length));
    }
    let largest = vector.iter().fold(0.0, |largest: f64, c| largest.max(c.abs()));
    let scaled = vector.map(|c| c / largest);
    let length = dot(scaled, scaled).sqrt();
    (largest > 0.0).then(|| scaled.map(|c| c / length))
}

/// A direction as a unit vector.
pub(super) fn read_direction(table: &Table, key: &str) -> Option<[f64; 3]> {
    read_unit(table.context, table.required(key)?, key)
}

/// A vector that is not zero, as a unit vector.
pub(super) fn read_unit(context: &Context, item: &Item, key: &str) -> Option<[f64; 3]> {
    let vector = context.vector::<3>(item)?;
    match unit(vector.value) {
        Some(unit) => Some(unit),
        None => context.wrong(vector.span, format!("`{key}` must not be zero")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_of_any_size_have_a_direction() {
        for size in [5e-324, 1e-200, 1.0, 1e200, 1.7e308] {
            assert_eq!(unit([size, 0.0, 0.0]), Some([1.0, 0.0, 0.0]), "{size}");
        }
        let [x, _, z] = unit([3e200, 0.0, -4e200]).unwrap();
        assert!((x - 0.6).abs() < 1e-15 && (z + 0.8).abs() < 1e-15);
        assert_eq!(unit([0.0; 3]), None);
    }
}
