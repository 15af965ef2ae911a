//! `axes = [[…], […]]`: turned directions of supports, motions and springs.

use super::reader::{Table, kind_of};
use toml::de::DeValue;

/// Two orthonormal directions; the third follows.
pub type Axes = [[f64; 3]; 2];

/// Departure from unit length and right angles that is taken for rounding.
const ORTHONORMAL: f64 = 1e-6;

/// The key `axes` of a table; `Some(None)` where it is left out.
pub(super) fn read_axes(table: &Table) -> Option<Option<Axes>> {
    table.optional("axes", |context, item| {
        let DeValue::Array(rows) = item.get_ref() else {
            return context.wrong(item.span(), format!("`axes` is two vectors, found {}", kind_of(item.get_ref())));
        };
        if rows.len() != 2 {
            return context
                .wrong(item.span(), format!("`axes` is the first two of three directions, found {}", rows.len()));
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
