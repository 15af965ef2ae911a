//! Dense arithmetic on tiles, the blocks of the tangent: 6 x 6, or 3 x 3 where a scene is planar. Every loop runs along rows, which lie
//! next to each other.

use crate::real::Lanes;
pub use crate::system::Tile;

/// A part of a vector that belongs to one tile row.
pub type Part<const W: usize> = [f64; W];

/// The order in which a tile takes its rows as pivots.
pub type RowOrder<const W: usize> = [u8; W];

/// Tiles so wide.
pub struct Width<const W: usize>;

/// How a row of a tile stands in registers; behind its numbers stand zeros.
pub trait Rows<const W: usize> {
    /// The registers
    type Row: Copy;

    /// Into registers
    fn row(part: &Part<W>) -> Self::Row;

    /// And out of them
    fn part(row: Self::Row) -> Part<W>;

    /// row -= factor other
    fn subtract(row: &mut Self::Row, factor: f64, other: &Self::Row);

    /// row factor
    fn scaled(row: Self::Row, factor: f64) -> Self::Row;

    /// a.b
    fn dot(a: &Part<W>, b: &Part<W>) -> f64;
}

impl Rows<6> for Width<6> {
    type Row = [Lanes; 2];

    #[inline(always)]
    fn row(part: &Part<6>) -> Self::Row {
        let [a, b, c, d, e, f] = *part;
        [Lanes([a, b, c, d]), Lanes([e, f, 0.0, 0.0])]
    }

    #[inline(always)]
    fn part(row: Self::Row) -> Part<6> {
        let [Lanes([a, b, c, d]), Lanes([e, f, ..])] = row;
        [a, b, c, d, e, f]
    }

    #[inline(always)]
    fn subtract(row: &mut Self::Row, factor: f64, other: &Self::Row) {
        let factor = Lanes([factor; 4]);
        row[0] -= other[0] * factor;
        row[1] -= other[1] * factor;
    }

    #[inline(always)]
    fn scaled(row: Self::Row, factor: f64) -> Self::Row {
        let factor = Lanes([factor; 4]);
        [row[0] * factor, row[1] * factor]
    }

    /// Two sums of three: shorter chains than one of six.
    #[inline(always)]
    fn dot(a: &Part<6>, b: &Part<6>) -> f64 {
        (a[0] * b[0] + a[2] * b[2] + a[4] * b[4]) + (a[1] * b[1] + a[3] * b[3] + a[5] * b[5])
    }
}

impl Rows<3> for Width<3> {
    type Row = [f64; 3];

    #[inline(always)]
    fn row(part: &Part<3>) -> Self::Row {
        *part
    }

    #[inline(always)]
    fn part(row: Self::Row) -> Part<3> {
        row
    }

    #[inline(always)]
    fn subtract(row: &mut Self::Row, factor: f64, other: &Self::Row) {
        row[0] -= other[0] * factor;
        row[1] -= other[1] * factor;
        row[2] -= other[2] * factor;
    }

    #[inline(always)]
    fn scaled(row: Self::Row, factor: f64) -> Self::Row {
        [row[0] * factor, row[1] * factor, row[2] * factor]
    }

    #[inline(always)]
    fn dot(a: &Part<3>, b: &Part<3>) -> f64 {
        (a[0] * b[0] + a[2] * b[2]) + a[1] * b[1]
    }
}

/// Nothing.
pub const fn zero<const W: usize>() -> Tile<W> {
    [[0.0; W]; W]
}

/// A tile of the tangent; nothing where elimination fills it.
#[inline(always)]
pub fn of<const W: usize>(tiles: &[Tile<W>], number: u32) -> &Tile<W> {
    tiles.get(number as usize).unwrap_or(const { &zero() })
}

#[inline(always)]
fn row<const W: usize>(part: &Part<W>) -> <Width<W> as Rows<W>>::Row
where
    Width<W>: Rows<W>,
{
    Width::<W>::row(part)
}

#[inline(always)]
fn part<const W: usize>(row: <Width<W> as Rows<W>>::Row) -> Part<W>
where
    Width<W>: Rows<W>,
{
    Width::<W>::part(row)
}

#[inline(always)]
fn rows<const W: usize>(tile: &Tile<W>) -> [<Width<W> as Rows<W>>::Row; W]
where
    Width<W>: Rows<W>,
{
    let mut out = [row::<W>(&tile[0]); W];
    for r in 1..W {
        out[r] = row::<W>(&tile[r]);
    }
    out
}

#[inline(always)]
fn parts<const W: usize>(rows: &[<Width<W> as Rows<W>>::Row; W]) -> Tile<W>
where
    Width<W>: Rows<W>,
{
    let mut out = zero();
    for r in 0..W {
        out[r] = part::<W>(rows[r]);
    }
    out
}

/// What `f` gives for each row of a tile, written out: the first `None` ends it.
macro_rules! each_row {
    ($f:ident, $($argument:expr),*) => {{
        let mut sum = $f::<W, 0>($($argument),*)? + $f::<W, 1>($($argument),*)? + $f::<W, 2>($($argument),*)?;
        if W > 3 {
            sum += $f::<W, 3>($($argument),*)? + $f::<W, 4>($($argument),*)? + $f::<W, 5>($($argument),*)?;
        }
        sum
    }};
}

/// The transpose.
#[inline(always)]
pub fn transposed<const W: usize>(tile: &Tile<W>) -> Tile<W> {
    let mut out = zero();
    for (i, row) in tile.iter().enumerate() {
        for (j, &x) in row.iter().enumerate() {
            out[j][i] = x;
        }
    }
    out
}

/// target -= w^T y
#[inline(always)]
pub fn subtract_product<const W: usize>(target: &mut Tile<W>, w: &Tile<W>, y: &Tile<W>)
where
    Width<W>: Rows<W>,
{
    let y = rows::<W>(y);
    for (r, sum) in target.iter_mut().enumerate() {
        let mut lanes = row::<W>(sum);
        for d in 0..W {
            Width::<W>::subtract(&mut lanes, w[d][r], &y[d]);
        }
        *sum = part::<W>(lanes);
    }
}

/// part -= w^T x
#[inline(always)]
pub fn subtract_transposed<const W: usize>(part: &mut Part<W>, w: &Tile<W>, x: &Part<W>)
where
    Width<W>: Rows<W>,
{
    let mut sum = row::<W>(part);
    for (line, &x) in w.iter().zip(x) {
        Width::<W>::subtract(&mut sum, x, &row::<W>(line));
    }
    *part = self::part::<W>(sum);
}

/// part -= y x
#[inline(always)]
pub fn subtract_times<const W: usize>(part: &mut Part<W>, y: &Tile<W>, x: &Part<W>)
where
    Width<W>: Rows<W>,
{
    for (out, row) in part.iter_mut().zip(y) {
        *out -= Width::<W>::dot(row, x);
    }
}

/// L D L^T of a symmetric tile, whose upper triangle is read: L^T takes the place above the diagonal, 1/D that of the
/// diagonal. The number of negative pivots; `None` where one is zero or no number.
#[inline(always)]
pub fn factorise_symmetric<const W: usize>(tile: &mut Tile<W>) -> Option<usize>
where
    Width<W>: Rows<W>,
{
    Some(each_row!(eliminate_symmetric, tile))
}

/// Takes row R as the pivot of those below.
#[inline(always)]
fn eliminate_symmetric<const W: usize, const R: usize>(tile: &mut Tile<W>) -> Option<usize>
where
    Width<W>: Rows<W>,
{
    let inverse = 1.0 / tile[R][R];
    if !inverse.is_finite() || inverse == 0.0 {
        return None;
    }
    let (pivot, lanes) = (tile[R], row::<W>(&tile[R]));
    for k in R + 1..W {
        let mut below = row::<W>(&tile[k]);
        Width::<W>::subtract(&mut below, pivot[k] * inverse, &lanes);
        tile[k] = part::<W>(below);
    }
    tile[R] = part::<W>(Width::<W>::scaled(lanes, inverse));
    tile[R][R] = inverse;
    Some(usize::from(inverse < 0.0))
}

/// y = L^-1 y, for all columns at once.
#[inline(always)]
pub fn forward_symmetric<const W: usize>(factor: &Tile<W>, y: &mut Tile<W>)
where
    Width<W>: Rows<W>,
{
    let mut lanes = rows::<W>(y);
    for r in 0..W {
        let pivot = lanes[r];
        for k in r + 1..W {
            Width::<W>::subtract(&mut lanes[k], factor[r][k], &pivot);
        }
    }
    *y = parts::<W>(&lanes);
}

/// D^-1 y
#[inline(always)]
pub fn over_pivots<const W: usize>(factor: &Tile<W>, y: &Tile<W>) -> Tile<W>
where
    Width<W>: Rows<W>,
{
    let mut out = zero();
    for r in 0..W {
        out[r] = part::<W>(Width::<W>::scaled(row::<W>(&y[r]), factor[r][r]));
    }
    out
}

/// x = L^-1 x
#[inline(always)]
pub fn solve_forward_symmetric<const W: usize>(factor: &Tile<W>, x: &mut Part<W>) {
    for r in 0..W {
        for k in r + 1..W {
            x[k] -= factor[r][k] * x[r];
        }
    }
}

/// x = L^-T x
#[inline(always)]
pub fn solve_backward_symmetric<const W: usize>(factor: &Tile<W>, x: &mut Part<W>) {
    for r in (0..W).rev() {
        for k in r + 1..W {
            x[r] -= factor[r][k] * x[k];
        }
    }
}

/// P A = L U of a tile with rows in the order of the largest pivots: L (its diagonal is one) below, U from the diagonal on,
/// whose diagonal holds inverses. `None` where a pivot is zero or no number.
#[inline(always)]
pub fn factorise<const W: usize>(tile: &mut Tile<W>) -> Option<RowOrder<W>>
where
    Width<W>: Rows<W>,
{
    let mut order = std::array::from_fn(|r| r as u8);
    each_row!(eliminate, tile, &mut order);
    Some(order)
}

/// Takes the row with the largest entry in column R as the pivot of those below.
#[inline(always)]
fn eliminate<const W: usize, const R: usize>(tile: &mut Tile<W>, order: &mut RowOrder<W>) -> Option<usize>
where
    Width<W>: Rows<W>,
{
    let mut pivot = R;
    for k in R + 1..W {
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
    let right = row::<W>(&right);
    for below in tile.iter_mut().skip(R + 1) {
        let factor = below[R] * inverse;
        let mut lanes = row::<W>(below);
        Width::<W>::subtract(&mut lanes, factor, &right);
        *below = part::<W>(lanes);
        below[R] = factor;
    }
    tile[R][R] = inverse;
    Some(0)
}

/// Rows in another order.
#[inline(always)]
pub fn permuted<const W: usize>(order: &RowOrder<W>, tile: &Tile<W>) -> Tile<W> {
    order.map(|r| tile[r as usize])
}

/// y = L^-1 y, for all columns at once.
#[inline(always)]
pub fn forward<const W: usize>(factor: &Tile<W>, y: &mut Tile<W>)
where
    Width<W>: Rows<W>,
{
    let mut lanes = rows::<W>(y);
    for r in 0..W {
        let pivot = lanes[r];
        for k in r + 1..W {
            Width::<W>::subtract(&mut lanes[k], factor[k][r], &pivot);
        }
    }
    *y = parts::<W>(&lanes);
}

/// w = U^-T w, for all columns at once.
#[inline(always)]
pub fn forward_upper<const W: usize>(factor: &Tile<W>, w: &mut Tile<W>)
where
    Width<W>: Rows<W>,
{
    let mut lanes = rows::<W>(w);
    for r in 0..W {
        lanes[r] = Width::<W>::scaled(lanes[r], factor[r][r]);
        let pivot = lanes[r];
        for k in r + 1..W {
            Width::<W>::subtract(&mut lanes[k], factor[r][k], &pivot);
        }
    }
    *w = parts::<W>(&lanes);
}

/// x = L^-1 P x
#[inline(always)]
pub fn solve_forward<const W: usize>(factor: &Tile<W>, order: &RowOrder<W>, x: &mut Part<W>) {
    *x = order.map(|r| x[r as usize]);
    for r in 0..W {
        for k in r + 1..W {
            x[k] -= factor[k][r] * x[r];
        }
    }
}

/// x = U^-1 x
#[inline(always)]
pub fn solve_backward<const W: usize>(factor: &Tile<W>, x: &mut Part<W>) {
    for r in (0..W).rev() {
        for k in r + 1..W {
            x[r] -= factor[r][k] * x[k];
        }
        x[r] *= factor[r][r];
    }
}
