//! Dense arithmetic on tiles, the 6 x 6 blocks of the tangent. Every loop runs along rows, which lie next to each other.

use crate::real::Lanes;
pub use crate::system::{Tile, WIDTH};

/// A part of a vector that belongs to one tile row.
pub type Part = [f64; WIDTH];

/// Nothing.
pub const ZERO: Tile = [[0.0; WIDTH]; WIDTH];

/// The order in which a tile takes its rows as pivots.
pub type RowOrder = [u8; WIDTH];

/// A row of a tile in registers; behind its numbers stand two zeros.
type Row = [Lanes; 2];

#[inline(always)]
fn row(part: &Part) -> Row {
    let [a, b, c, d, e, f] = *part;
    [Lanes([a, b, c, d]), Lanes([e, f, 0.0, 0.0])]
}

#[inline(always)]
fn part(row: Row) -> Part {
    let [Lanes([a, b, c, d]), Lanes([e, f, ..])] = row;
    [a, b, c, d, e, f]
}

#[inline(always)]
fn rows(tile: &Tile) -> [Row; WIDTH] {
    let [a, b, c, d, e, f] = tile;
    [row(a), row(b), row(c), row(d), row(e), row(f)]
}

/// row -= factor other
#[inline(always)]
fn subtract(row: &mut Row, factor: f64, other: &Row) {
    let factor = Lanes([factor; 4]);
    row[0] -= other[0] * factor;
    row[1] -= other[1] * factor;
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
    let y = rows(y);
    for (r, sum) in target.iter_mut().enumerate() {
        let mut lanes = row(sum);
        for d in 0..WIDTH {
            subtract(&mut lanes, w[d][r], &y[d]);
        }
        *sum = part(lanes);
    }
}

/// part -= w^T x
#[inline(always)]
pub fn subtract_transposed(part: &mut Part, w: &Tile, x: &Part) {
    let mut sum = row(part);
    for (line, &x) in w.iter().zip(x) {
        subtract(&mut sum, x, &row(line));
    }
    *part = self::part(sum);
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
    negative += eliminate_symmetric::<0>(tile)?;
    negative += eliminate_symmetric::<1>(tile)?;
    negative += eliminate_symmetric::<2>(tile)?;
    negative += eliminate_symmetric::<3>(tile)?;
    negative += eliminate_symmetric::<4>(tile)?;
    negative += eliminate_symmetric::<5>(tile)?;
    Some(negative)
}

/// Takes row R as the pivot of those below.
#[inline(always)]
fn eliminate_symmetric<const R: usize>(tile: &mut Tile) -> Option<usize> {
    let inverse = 1.0 / tile[R][R];
    if !inverse.is_finite() || inverse == 0.0 {
        return None;
    }
    let (pivot, lanes) = (tile[R], row(&tile[R]));
    for k in R + 1..WIDTH {
        let mut below = row(&tile[k]);
        subtract(&mut below, pivot[k] * inverse, &lanes);
        tile[k] = part(below);
    }
    let factor = Lanes([inverse; 4]);
    tile[R] = part([lanes[0] * factor, lanes[1] * factor]);
    tile[R][R] = inverse;
    Some(usize::from(inverse < 0.0))
}

/// y = L^-1 y, for all columns at once.
#[inline(always)]
pub fn forward_symmetric(factor: &Tile, y: &mut Tile) {
    let mut lanes = rows(y);
    for r in 0..WIDTH {
        let pivot = lanes[r];
        for k in r + 1..WIDTH {
            subtract(&mut lanes[k], factor[r][k], &pivot);
        }
    }
    *y = lanes.map(part);
}

/// D^-1 y
#[inline(always)]
pub fn over_pivots(factor: &Tile, y: &Tile) -> Tile {
    let mut out = ZERO;
    for r in 0..WIDTH {
        let (lanes, inverse) = (row(&y[r]), Lanes([factor[r][r]; 4]));
        out[r] = part([lanes[0] * inverse, lanes[1] * inverse]);
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
    eliminate::<0>(tile, &mut order)?;
    eliminate::<1>(tile, &mut order)?;
    eliminate::<2>(tile, &mut order)?;
    eliminate::<3>(tile, &mut order)?;
    eliminate::<4>(tile, &mut order)?;
    eliminate::<5>(tile, &mut order)?;
    Some(order)
}

/// Takes the row with the largest entry in column R as the pivot of those below.
#[inline(always)]
fn eliminate<const R: usize>(tile: &mut Tile, order: &mut RowOrder) -> Option<()> {
    let mut pivot = R;
    for k in R + 1..WIDTH {
        if tile[k][R].abs() > tile[pivot][R].abs() {
            pivot = k;
        }
    }
    tile.swap(R, pivot);
    order.swap(R, pivot);
    let inverse = 1.0 / tile[R][R];
    if !inverse.is_finite() || inverse == 0.0 {
        return None;
    }
    // What stands left of the diagonal belongs to L.
    let mut right = tile[R];
    right[..=R].fill(0.0);
    let right = row(&right);
    for below in tile.iter_mut().skip(R + 1) {
        let factor = below[R] * inverse;
        let mut lanes = row(below);
        subtract(&mut lanes, factor, &right);
        *below = part(lanes);
        below[R] = factor;
    }
    tile[R][R] = inverse;
    Some(())
}

/// Rows in another order.
#[inline(always)]
pub fn permuted(order: &RowOrder, tile: &Tile) -> Tile {
    order.map(|r| tile[r as usize])
}

/// y = L^-1 y, for all columns at once.
#[inline(always)]
pub fn forward(factor: &Tile, y: &mut Tile) {
    let mut lanes = rows(y);
    for r in 0..WIDTH {
        let pivot = lanes[r];
        for k in r + 1..WIDTH {
            subtract(&mut lanes[k], factor[k][r], &pivot);
        }
    }
    *y = lanes.map(part);
}

/// w = U^-T w, for all columns at once.
#[inline(always)]
pub fn forward_upper(factor: &Tile, w: &mut Tile) {
    let mut lanes = rows(w);
    for r in 0..WIDTH {
        let inverse = Lanes([factor[r][r]; 4]);
        lanes[r] = [lanes[r][0] * inverse, lanes[r][1] * inverse];
        let pivot = lanes[r];
        for k in r + 1..WIDTH {
            subtract(&mut lanes[k], factor[r][k], &pivot);
        }
    }
    *w = lanes.map(part);
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
