//! Dense arithmetic on tiles, the 6 x 6 blocks of the tangent. Every loop runs along rows, which lie next to each other.

pub use crate::system::{Tile, WIDTH};

/// A part of a vector that belongs to one tile row.
pub type Part = [f64; WIDTH];

/// Nothing.
pub const ZERO: Tile = [[0.0; WIDTH]; WIDTH];

/// The order in which a tile takes its rows as pivots.
pub type RowOrder = [u8; WIDTH];

/// row -= factor other
#[inline(always)]
fn subtract(row: &mut Part, factor: f64, other: &Part) {
    for (x, y) in row.iter_mut().zip(other) {
        *x -= factor * y;
    }
}

/// The transpose.
#[inline(always)]
pub fn transposed(tile: &Tile) -> Tile {
    let mut out = ZERO;
    for (i, row) in tile.iter().enumerate() {
        for (j, &x) in row.iter().enumerate() {
            out[j][i] = x;
        }
    }
    out
}

/// target -= w^T y
#[inline(always)]
pub fn subtract_product(target: &mut Tile, w: &Tile, y: &Tile) {
    for (r, row) in target.iter_mut().enumerate() {
        for d in 0..WIDTH {
            subtract(row, w[d][r], &y[d]);
        }
    }
}

/// part -= w^T x
#[inline(always)]
pub fn subtract_transposed(part: &mut Part, w: &Tile, x: &Part) {
    for (row, &x) in w.iter().zip(x) {
        subtract(part, x, row);
    }
}

/// part -= y x
#[inline(always)]
pub fn subtract_times(part: &mut Part, y: &Tile, x: &Part) {
    for (out, row) in part.iter_mut().zip(y) {
        *out -= dot(row, x);
    }
}

/// Two sums of three: shorter chains than one of six.
#[inline(always)]
fn dot(a: &Part, b: &Part) -> f64 {
    (a[0] * b[0] + a[2] * b[2] + a[4] * b[4]) + (a[1] * b[1] + a[3] * b[3] + a[5] * b[5])
}

/// L D L^T of a symmetric tile, whose upper triangle is read: L^T takes the place above the diagonal, 1/D that of the
/// diagonal. The number of negative pivots; `None` where one is zero or no number.
#[inline(always)]
pub fn factorise_symmetric(tile: &mut Tile) -> Option<usize> {
    let mut negative = 0;
    for r in 0..WIDTH {
        let inverse = 1.0 / tile[r][r];
        if !inverse.is_finite() || inverse == 0.0 {
            return None;
        }
        negative += usize::from(inverse < 0.0);
        let pivot_row = tile[r];
        for (k, row) in tile.iter_mut().enumerate().skip(r + 1) {
            subtract(row, pivot_row[k] * inverse, &pivot_row);
        }
        tile[r].iter_mut().for_each(|x| *x *= inverse);
        tile[r][r] = inverse;
    }
    Some(negative)
}

/// y = L^-1 y, for all columns at once.
#[inline(always)]
pub fn forward_symmetric(factor: &Tile, y: &mut Tile) {
    for r in 0..WIDTH {
        let row = y[r];
        for k in r + 1..WIDTH {
            subtract(&mut y[k], factor[r][k], &row);
        }
    }
}

/// D^-1 y
#[inline(always)]
pub fn over_pivots(factor: &Tile, y: &Tile) -> Tile {
    let mut out = *y;
    for (r, row) in out.iter_mut().enumerate() {
        row.iter_mut().for_each(|x| *x *= factor[r][r]);
    }
    out
}

/// x = L^-1 x
#[inline(always)]
pub fn solve_forward_symmetric(factor: &Tile, x: &mut Part) {
    for r in 0..WIDTH {
        for k in r + 1..WIDTH {
            x[k] -= factor[r][k] * x[r];
        }
    }
}

/// x = L^-T x
#[inline(always)]
pub fn solve_backward_symmetric(factor: &Tile, x: &mut Part) {
    for r in (0..WIDTH).rev() {
        for k in r + 1..WIDTH {
            x[r] -= factor[r][k] * x[k];
        }
    }
}

/// P A = L U of a tile with rows in the order of the largest pivots: L (its diagonal is one) below, U from the diagonal on,
/// whose diagonal holds inverses. `None` where a pivot is zero or no number.
#[inline(always)]
pub fn factorise(tile: &mut Tile) -> Option<RowOrder> {
    let mut order = [0, 1, 2, 3, 4, 5];
    for r in 0..WIDTH {
        let larger = |best: usize, k: usize| if tile[k][r].abs() > tile[best][r].abs() { k } else { best };
        let pivot = (r + 1..WIDTH).fold(r, larger);
        tile.swap(r, pivot);
        order.swap(r, pivot);
        let inverse = 1.0 / tile[r][r];
        if !inverse.is_finite() || inverse == 0.0 {
            return None;
        }
        let pivot_row = tile[r];
        for row in tile.iter_mut().skip(r + 1) {
            let factor = row[r] * inverse;
            for c in r + 1..WIDTH {
                row[c] -= factor * pivot_row[c];
            }
            row[r] = factor;
        }
        tile[r][r] = inverse;
    }
    Some(order)
}

/// Rows in another order.
#[inline(always)]
pub fn permuted(order: &RowOrder, tile: &Tile) -> Tile {
    order.map(|r| tile[r as usize])
}

/// y = L^-1 y, for all columns at once.
#[inline(always)]
pub fn forward(factor: &Tile, y: &mut Tile) {
    for r in 0..WIDTH {
        let row = y[r];
        for k in r + 1..WIDTH {
            subtract(&mut y[k], factor[k][r], &row);
        }
    }
}

/// w = U^-T w, for all columns at once.
#[inline(always)]
pub fn forward_upper(factor: &Tile, w: &mut Tile) {
    for r in 0..WIDTH {
        let inverse = factor[r][r];
        w[r].iter_mut().for_each(|x| *x *= inverse);
        let row = w[r];
        for k in r + 1..WIDTH {
            subtract(&mut w[k], factor[r][k], &row);
        }
    }
}

/// x = L^-1 P x
#[inline(always)]
pub fn solve_forward(factor: &Tile, order: &RowOrder, x: &mut Part) {
    *x = order.map(|r| x[r as usize]);
    for r in 0..WIDTH {
        for k in r + 1..WIDTH {
            x[k] -= factor[k][r] * x[r];
        }
    }
}

/// x = U^-1 x
#[inline(always)]
pub fn solve_backward(factor: &Tile, x: &mut Part) {
    for r in (0..WIDTH).rev() {
        for k in r + 1..WIDTH {
            x[r] -= factor[r][k] * x[k];
        }
        x[r] *= factor[r][r];
    }
}
