//! Dense arithmetic on tiles, the blocks of the tangent: 6 x 6, or 3 x 3 in planar scenes. All
//! loops run along rows, which are contiguous.

use super::elimination::{BlockPosition, BlockSource};
use super::list_range::ListRange;
use crate::scalar::{LANES, Lanes, each_lane};
pub use crate::system::{DiagonalTiles, Tile, transposed};
use crate::system::{upper_entry, upper_start};

/// Entries of a vector at the rows of one node block.
pub type BlockVector<const W: usize> = [f64; W];

/// Limit for rows of a tile to keep their order: no pivot may subtract from the diagonal entry of a
/// later row more than this many times its value. The measure is dimensionless, while entries of L
/// may have units. Its value matters little: tiles with reordered rows are checked for lost digits.
const MAX_GROWTH_IN_ORDER: f64 = 16.0;

/// Limit for lost digits: terms subtracted from a diagonal entry may be this many times the entry,
/// which multiplies its relative round-off (Higham, Accuracy and Stability of Numerical Algorithms,
/// 2nd ed., theorem 13.6).
const MAX_CANCELLATION: f64 = 1e3;

/// Order in which the rows of a tile are pivots.
pub type RowOrder<const W: usize> = [u8; W];

/// Marker for tiles of width W.
pub struct Width<const W: usize>;

/// Representation of a row of a tile in vector registers, padded with zeros.
pub trait Rows<const W: usize> {
    /// Registers of a row
    type Row: Copy;

    /// Upper triangle of a symmetric tile, row by row
    type UpperTriangle: Copy + Send + Sync + AsRef<[f64]> + AsMut<[f64]>;

    /// Upper triangle of zeros
    const NOTHING: Self::UpperTriangle;

    /// Views a list of values as upper triangles.
    fn uppers(numbers: &[f64]) -> &[Self::UpperTriangle];

    /// Mutable view of a list of values as upper triangles.
    fn uppers_mut(numbers: &mut [f64]) -> &mut [Self::UpperTriangle];

    /// Loads a row into registers.
    fn row(part: &BlockVector<W>) -> Self::Row;

    /// Stores a row from registers.
    fn part(row: Self::Row) -> BlockVector<W>;

    /// row -= factor * other
    fn subtract(row: &mut Self::Row, factor: f64, other: &Self::Row);

    /// row * factor
    fn scaled(row: Self::Row, factor: f64) -> Self::Row;

    /// sums += |a * b|, entry by entry
    fn add_sizes(sums: &mut Self::Row, a: &Self::Row, b: &Self::Row);

    /// Inner product a . b
    fn dot(a: &BlockVector<W>, b: &BlockVector<W>) -> f64;

    /// Row r of an upper triangle, with undefined entries left of the diagonal
    fn upper_row(upper: &Self::UpperTriangle, r: usize) -> Self::Row;

    /// Stores row r of an upper triangle. This overwrites the ends of earlier rows: later rows must
    /// be stored first.
    fn set_upper_row(upper: &mut Self::UpperTriangle, r: usize, row: Self::Row);
}

/// Upper triangle of a symmetric tile of width W.
pub type UpperTriangle<const W: usize> = <Width<W> as Rows<W>>::UpperTriangle;

impl Rows<6> for Width<6> {
    type Row = [Lanes; 2];
    type UpperTriangle = [f64; 21];

    const NOTHING: Self::UpperTriangle = [0.0; 21];

    fn uppers(numbers: &[f64]) -> &[Self::UpperTriangle] {
        numbers.as_chunks().0
    }

    fn uppers_mut(numbers: &mut [f64]) -> &mut [Self::UpperTriangle] {
        numbers.as_chunks_mut().0
    }

    #[inline(always)]
    fn row(part: &BlockVector<6>) -> Self::Row {
        let [a, b, c, d, e, f] = *part;
        [Lanes([a, b, c, d]), Lanes([e, f, 0.0, 0.0])]
    }

    #[inline(always)]
    fn part(row: Self::Row) -> BlockVector<6> {
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

    #[inline(always)]
    fn add_sizes(sums: &mut Self::Row, a: &Self::Row, b: &Self::Row) {
        for k in 0..2 {
            let Lanes(product) = a[k] * b[k];
            sums[k] += Lanes(each_lane!(|k| product[k].abs()));
        }
    }

    /// Two sums of three terms have shorter dependency chains than one of six.
    #[inline(always)]
    fn dot(a: &BlockVector<6>, b: &BlockVector<6>) -> f64 {
        (a[0] * b[0] + a[2] * b[2] + a[4] * b[4]) + (a[1] * b[1] + a[3] * b[3] + a[5] * b[5])
    }

    #[inline(always)]
    fn upper_row(upper: &Self::UpperTriangle, r: usize) -> Self::Row {
        let row = &upper[upper_start(6, r)..][..6];
        [Lanes([row[0], row[1], row[2], row[3]]), Lanes([row[4], row[5], 0.0, 0.0])]
    }

    #[inline(always)]
    fn set_upper_row(upper: &mut Self::UpperTriangle, r: usize, [left, right]: Self::Row) {
        let row = &mut upper[upper_start(6, r)..][..6];
        if r < LANES {
            row[..LANES].copy_from_slice(&left.0);
        }
        row[LANES..].copy_from_slice(&right.0[..2]);
    }
}

impl Rows<3> for Width<3> {
    type Row = [f64; 3];
    type UpperTriangle = [f64; 6];

    const NOTHING: Self::UpperTriangle = [0.0; 6];

    fn uppers(numbers: &[f64]) -> &[Self::UpperTriangle] {
        numbers.as_chunks().0
    }

    fn uppers_mut(numbers: &mut [f64]) -> &mut [Self::UpperTriangle] {
        numbers.as_chunks_mut().0
    }

    #[inline(always)]
    fn row(part: &BlockVector<3>) -> Self::Row {
        *part
    }

    #[inline(always)]
    fn part(row: Self::Row) -> BlockVector<3> {
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
    fn add_sizes(sums: &mut Self::Row, a: &Self::Row, b: &Self::Row) {
        (0..3).for_each(|k| sums[k] += (a[k] * b[k]).abs());
    }

    #[inline(always)]
    fn dot(a: &BlockVector<3>, b: &BlockVector<3>) -> f64 {
        (a[0] * b[0] + a[2] * b[2]) + a[1] * b[1]
    }

    #[inline(always)]
    fn upper_row(upper: &Self::UpperTriangle, r: usize) -> Self::Row {
        let row = &upper[upper_start(3, r)..][..3];
        [row[0], row[1], row[2]]
    }

    #[inline(always)]
    fn set_upper_row(upper: &mut Self::UpperTriangle, r: usize, row: Self::Row) {
        upper[upper_start(3, r)..][..3].copy_from_slice(&row);
    }
}

/// A tile of zeros.
pub const fn zero<const W: usize>() -> Tile<W> {
    [[0.0; W]; W]
}

#[inline(always)]
fn row<const W: usize>(part: &BlockVector<W>) -> <Width<W> as Rows<W>>::Row
where
    Width<W>: Rows<W>,
{
    Width::<W>::row(part)
}

#[inline(always)]
fn part<const W: usize>(row: <Width<W> as Rows<W>>::Row) -> BlockVector<W>
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
fn store<const W: usize>(rows: &[<Width<W> as Rows<W>>::Row; W], out: &mut Tile<W>)
where
    Width<W>: Rows<W>,
{
    for r in 0..W {
        out[r] = part::<W>(rows[r]);
    }
}

/// Repeats `$work` for each row of a tile, unrolled: in loops over a triangle that are not
/// unrolled, the compiler keeps values in memory instead of registers.
macro_rules! each_row {
    ($width:ident, |$row:ident| $work:expr) => {{
        const { assert!($width <= 6) };
        each_row!(@ $width, $row, $work, 0, 1, 2, 3, 4, 5);
    }};
    (@ $width:ident, $row:ident, $work:expr, $($number:literal),*) => {
        $({
            let $row = $number;
            if $row < $width {
                $work;
            }
        })*
    };
}

/// Repeats `$work` for each row of a tile from the last to the first, unrolled.
macro_rules! each_row_backwards {
    ($width:ident, |$row:ident| $work:expr) => {{
        each_row!(@ $width, $row, $work, 5, 4, 3, 2, 1, 0);
    }};
}

/// A block of a factorisation, as stored in the tangent or by the factorisation.
#[derive(Clone, Copy)]
pub enum StoredBlock<'a, const W: usize> {
    /// The tile itself
    Tile(&'a Tile<W>),
    /// Transpose of the tile
    Transpose(&'a Tile<W>),
    /// Zero
    Nothing,
}

impl<'a, const W: usize> StoredBlock<'a, W> {
    /// Block at a position, in the off-diagonal tiles of the tangent or in the changed blocks `own`
    /// of the factorisation.
    #[inline(always)]
    pub fn find(source: BlockSource, beside: &'a [Tile<W>], own: &'a ListRange<Tile<W>>) -> Self {
        match source.position() {
            BlockPosition::Tile(number) => Self::Tile(&beside[number]),
            BlockPosition::Transpose(number) => Self::Transpose(&beside[number]),
            BlockPosition::Changed(number) => Self::Tile(&own[number]),
            BlockPosition::Nowhere => Self::Nothing,
        }
    }

    /// Transpose of the block.
    #[inline(always)]
    pub fn transposed(self) -> Self {
        match self {
            Self::Tile(tile) => Self::Transpose(tile),
            Self::Transpose(tile) => Self::Tile(tile),
            Self::Nothing => Self::Nothing,
        }
    }

    /// Calls `work` with the block by reference: copying it would take as long as solving with it.
    #[inline(always)]
    pub fn with(self, mut work: impl FnMut(&Tile<W>)) {
        match self {
            Self::Tile(tile) => work(tile),
            Self::Transpose(tile) => work(&transposed(tile)),
            Self::Nothing => work(&zero()),
        }
    }

    /// part -= b x, with b the block
    #[inline(always)]
    pub fn subtract_times(self, part: &mut BlockVector<W>, x: &BlockVector<W>)
    where
        Width<W>: Rows<W>,
    {
        match self {
            Self::Tile(tile) => subtract_times(part, tile, x),
            Self::Transpose(tile) => subtract_transposed(part, tile, x),
            Self::Nothing => {}
        }
    }
}

/// Copies a tile row by row, which is faster than a call for so few values.
#[inline(always)]
pub fn copy<const W: usize>(to: &mut Tile<W>, from: &Tile<W>)
where
    Width<W>: Rows<W>,
{
    each_row!(W, |r| to[r] = part::<W>(row::<W>(&from[r])));
}

/// target -= w^T y
#[inline(always)]
pub fn subtract_product<const W: usize>(target: &mut Tile<W>, w: &Tile<W>, y: &Tile<W>)
where
    Width<W>: Rows<W>,
{
    let y = rows::<W>(y);
    each_row!(W, |r| {
        let mut sum = row::<W>(&target[r]);
        each_row!(W, |d| Width::<W>::subtract(&mut sum, w[d][r], &y[d]));
        target[r] = part::<W>(sum);
    });
}

/// True if |w|^T |y| is at most [`MAX_CANCELLATION`] times the diagonal entries of `target`, from
/// which w^T y is subtracted.
#[inline(always)]
pub fn is_moderate<const W: usize>(w: &Tile<W>, y: &Tile<W>, target: &Tile<W>) -> bool
where
    Width<W>: Rows<W>,
{
    let mut sums = row::<W>(&[0.0; W]);
    each_row!(W, |d| Width::<W>::add_sizes(&mut sums, &row::<W>(&w[d]), &row::<W>(&y[d])));
    let sums = part::<W>(sums);
    let mut is_moderate = true;
    each_row!(W, |r| is_moderate &= sums[r] <= MAX_CANCELLATION * target[r][r].abs());
    is_moderate
}

/// sum += other for diagonal tiles; `false` if a diagonal entry of `other` exceeds
/// [`MAX_CANCELLATION`] times that of `sum`.
pub fn add_moderate<const W: usize>(sum: &mut Tile<W>, other: &Tile<W>) -> bool {
    let is_moderate = (0..W).all(|r| other[r][r].abs() <= MAX_CANCELLATION * sum[r][r].abs());
    sum.as_flattened_mut().iter_mut().zip(other.as_flattened()).for_each(|(sum, other)| *sum += other);
    is_moderate
}

/// target -= w^T y for a symmetric product, of which the upper triangle is stored.
#[inline(always)]
pub fn subtract_symmetric_product<const W: usize>(target: &mut UpperTriangle<W>, w: &Tile<W>, y: &Tile<W>)
where
    Width<W>: Rows<W>,
{
    let y = rows::<W>(y);
    let mut sums = upper_rows::<W>(target);
    each_row!(W, |r| each_row!(W, |d| Width::<W>::subtract(&mut sums[r], w[d][r], &y[d])));
    each_row_backwards!(W, |r| Width::<W>::set_upper_row(target, r, sums[r]));
}

/// Rows of an upper triangle, with undefined entries left of the diagonal.
#[inline(always)]
fn upper_rows<const W: usize>(upper: &UpperTriangle<W>) -> [<Width<W> as Rows<W>>::Row; W]
where
    Width<W>: Rows<W>,
{
    let mut out = [Width::<W>::upper_row(upper, 0); W];
    each_row!(W, |r| out[r] = Width::<W>::upper_row(upper, r));
    out
}

/// Copies an upper triangle into a tile; entries below its diagonal are undefined.
#[inline(always)]
pub fn spread<const W: usize>(upper: &UpperTriangle<W>, out: &mut Tile<W>)
where
    Width<W>: Rows<W>,
{
    store::<W>(&upper_rows::<W>(upper), out);
}

/// part -= w^T x
#[inline(always)]
fn subtract_transposed<const W: usize>(part: &mut BlockVector<W>, w: &Tile<W>, x: &BlockVector<W>)
where
    Width<W>: Rows<W>,
{
    let mut sum = row::<W>(part);
    each_row!(W, |r| Width::<W>::subtract(&mut sum, x[r], &row::<W>(&w[r])));
    *part = self::part::<W>(sum);
}

/// part -= y x
#[inline(always)]
fn subtract_times<const W: usize>(part: &mut BlockVector<W>, y: &Tile<W>, x: &BlockVector<W>)
where
    Width<W>: Rows<W>,
{
    each_row!(W, |r| part[r] -= Width::<W>::dot(&y[r], x));
}

/// Factorises a symmetric tile, whose upper triangle is read, as L D L^T: L^T replaces the entries
/// above the diagonal, 1/D those on it. Returns the number of negative pivots; `None` if one is
/// zero or not finite.
#[inline(always)]
pub fn factorise_symmetric<const W: usize>(tile: &mut Tile<W>) -> Option<usize>
where
    Width<W>: Rows<W>,
{
    let mut negative = 0;
    let mut poison = 0.0;
    each_row!(W, |r| {
        let inverse = 1.0 / tile[r][r];
        poison += poison_of(tile[r][r], inverse);
        let pivot = tile[r];
        let lanes = row::<W>(&tile[r]);
        each_row!(W, |k| if k > r {
            let mut below = row::<W>(&tile[k]);
            Width::<W>::subtract(&mut below, pivot[k] * inverse, &lanes);
            tile[k] = part::<W>(below);
        });
        tile[r] = part::<W>(Width::<W>::scaled(lanes, inverse));
        tile[r][r] = inverse;
        negative += usize::from(inverse < 0.0);
    });
    (poison == 0.0).then_some(negative)
}

/// Zero; NaN if a pivot or its inverse is not finite. Testing a sum of these once costs less than
/// testing each pivot.
#[inline(always)]
fn poison_of(pivot: f64, inverse: f64) -> f64 {
    (pivot + inverse) * 0.0
}

/// y = L^-1 b for all columns, with the factors of [`factorise_symmetric`].
#[inline(always)]
pub fn forward_symmetric<const W: usize>(factor: &Tile<W>, b: &Tile<W>, y: &mut Tile<W>)
where
    Width<W>: Rows<W>,
{
    let mut lanes = rows::<W>(b);
    each_row!(W, |r| {
        let pivot = lanes[r];
        each_row!(W, |k| if k > r {
            Width::<W>::subtract(&mut lanes[k], factor[r][k], &pivot);
        });
    });
    store::<W>(&lanes, y);
}

/// w = D^-1 y, with the factors of [`factorise_symmetric`].
#[inline(always)]
pub fn over_pivots<const W: usize>(factor: &Tile<W>, y: &Tile<W>, w: &mut Tile<W>)
where
    Width<W>: Rows<W>,
{
    each_row!(W, |r| w[r] = part::<W>(Width::<W>::scaled(row::<W>(&y[r]), factor[r][r])));
}

/// Factorises a tile as P A = L U: L (unit diagonal) below the diagonal, U on and above it, with
/// inverted diagonal. Rows keep their order if each pivot is large enough for the rows below; else
/// the rows with the largest pivots come first. `None` if a pivot is zero or not finite.
#[inline(always)]
pub fn factorise<const W: usize>(tile: &mut Tile<W>) -> Option<(RowOrder<W>, bool)>
where
    Width<W>: Rows<W>,
{
    let mut in_order = *tile;
    if factorise_in_order(&mut in_order) {
        *tile = in_order;
        return Some((std::array::from_fn(|r| r as u8), true));
    }
    let before = *tile;
    let order = factorise_by_largest(tile)?;
    Some((order, has_grown_moderately(tile, &order, &before)))
}

/// Factorises a tile as A = L U with rows in their order; `false` if a pivot exceeds
/// [`MAX_GROWTH_IN_ORDER`], is zero or not finite.
#[inline(always)]
fn factorise_in_order<const W: usize>(tile: &mut Tile<W>) -> bool
where
    Width<W>: Rows<W>,
{
    let mut poison = 0.0;
    let mut fits = true;
    each_row!(W, |r| {
        let inverse = 1.0 / tile[r][r];
        poison += poison_of(tile[r][r], inverse);
        each_row!(W, |k| if k > r {
            fits &= (tile[k][r] * tile[k][r] * inverse).abs() <= MAX_GROWTH_IN_ORDER * tile[k][k].abs();
        });
        take_pivot(tile, r, inverse);
    });
    fits && poison == 0.0
}

/// Factorises a tile as P A = L U with partial pivoting: the row with the largest entry of the
/// column is next.
#[inline(never)]
fn factorise_by_largest<const W: usize>(tile: &mut Tile<W>) -> Option<RowOrder<W>>
where
    Width<W>: Rows<W>,
{
    let mut order = std::array::from_fn(|r| r as u8);
    for r in 0..W {
        let mut pivot = r;
        for k in r + 1..W {
            if tile[k][r].abs() > tile[pivot][r].abs() {
                pivot = k;
            }
        }
        tile.swap(r, pivot);
        order.swap(r, pivot);
        let inverse = 1.0 / tile[r][r];
        if poison_of(tile[r][r], inverse) != 0.0 {
            return None;
        }
        take_pivot(tile, r, inverse);
    }
    Some(order)
}

/// True if (|L| |U|)_ij^2 is at most [`MAX_CANCELLATION`]^2 |A_ii A_jj| for the tile `before`,
/// which was factorised with its rows in this order.
#[inline(never)]
fn has_grown_moderately<const W: usize>(factor: &Tile<W>, order: &RowOrder<W>, before: &Tile<W>) -> bool {
    let lower = |i: usize, k: usize| if k < i { factor[i][k].abs() } else { 1.0 };
    let upper = |k: usize, j: usize| if k < j { factor[k][j].abs() } else { 1.0 / factor[k][k].abs() };
    (0..W).all(|i| {
        (0..W).all(|j| {
            let row = order[i] as usize;
            let sum = (0..=i.min(j)).map(|k| lower(i, k) * upper(k, j)).sum::<f64>();
            sum * sum <= MAX_CANCELLATION * MAX_CANCELLATION * (before[row][row] * before[j][j]).abs()
        })
    })
}

/// True if the determinant of a tile that was factorised with its rows in this order is negative:
/// negative pivots and row exchanges add up to an odd number.
#[inline(always)]
pub fn has_negative_determinant<const W: usize>(factor: &Tile<W>, order: &RowOrder<W>) -> bool {
    let mut is_negative = false;
    for r in 0..W {
        is_negative ^= factor[r][r] < 0.0;
        for k in 0..r {
            is_negative ^= order[k] > order[r];
        }
    }
    is_negative
}

/// Subtracts multiples of row r, whose pivot has this inverse, from the rows below.
#[inline(always)]
fn take_pivot<const W: usize>(tile: &mut Tile<W>, r: usize, inverse: f64)
where
    Width<W>: Rows<W>,
{
    // Entries left of the diagonal belong to L.
    let mut right = tile[r];
    each_row!(W, |k| if k <= r {
        right[k] = 0.0;
    });
    let right = row::<W>(&right);
    each_row!(W, |k| if k > r {
        let factor = tile[k][r] * inverse;
        let mut below = row::<W>(&tile[k]);
        Width::<W>::subtract(&mut below, factor, &right);
        tile[k] = part::<W>(below);
        tile[k][r] = factor;
    });
    tile[r][r] = inverse;
}

/// y = L^-1 P b for all columns, with the factors of [`factorise`].
#[inline(always)]
pub fn forward<const W: usize>(factor: &Tile<W>, order: &RowOrder<W>, b: &Tile<W>, y: &mut Tile<W>)
where
    Width<W>: Rows<W>,
{
    let mut lanes = [row::<W>(&b[order[0] as usize]); W];
    each_row!(W, |r| lanes[r] = row::<W>(&b[order[r] as usize]));
    each_row!(W, |r| {
        let pivot = lanes[r];
        each_row!(W, |k| if k > r {
            Width::<W>::subtract(&mut lanes[k], factor[k][r], &pivot);
        });
    });
    store::<W>(&lanes, y);
}

/// w = U^-T b for all columns, with the factors of [`factorise`].
#[inline(always)]
pub fn forward_upper<const W: usize>(factor: &Tile<W>, b: &Tile<W>, w: &mut Tile<W>)
where
    Width<W>: Rows<W>,
{
    let mut lanes = rows::<W>(b);
    each_row!(W, |r| {
        lanes[r] = Width::<W>::scaled(lanes[r], factor[r][r]);
        let pivot = lanes[r];
        each_row!(W, |k| if k > r {
            Width::<W>::subtract(&mut lanes[k], factor[r][k], &pivot);
        });
    });
    store::<W>(&lanes, w);
}

/// Inverts the factors of [`factorise_symmetric`] for [`solve_symmetric`]: L^-T (unit diagonal)
/// above the diagonal, D^-1 on it.
#[inline(always)]
pub fn invert_symmetric<const W: usize>(factor: &Tile<W>, out: &mut UpperTriangle<W>)
where
    Width<W>: Rows<W>,
{
    let mut below = [row::<W>(&[0.0; W]); W];
    let out = out.as_mut();
    each_row!(W, |r| {
        below[r] = unit::<W>(r);
        each_row!(W, |k| if k < r {
            let line = below[k];
            Width::<W>::subtract(&mut below[r], factor[k][r], &line);
        });
        let column = part::<W>(below[r]);
        each_row!(W, |k| if k < r {
            out[upper_entry(W, k, r)] = column[k];
        });
        out[upper_entry(W, r, r)] = factor[r][r];
    });
}

/// Inverts the factors of [`factorise`] for [`solve`]: L^-1 (unit diagonal) below the diagonal,
/// U^-1 on and above it.
#[inline(always)]
pub fn invert<const W: usize>(factor: &Tile<W>, out: &mut Tile<W>)
where
    Width<W>: Rows<W>,
{
    let mut lines = [row::<W>(&[0.0; W]); W];
    each_row_backwards!(W, |r| {
        lines[r] = unit::<W>(r);
        each_row!(W, |k| if k > r {
            let line = lines[k];
            Width::<W>::subtract(&mut lines[r], factor[r][k], &line);
        });
        lines[r] = Width::<W>::scaled(lines[r], factor[r][r]);
    });
    store::<W>(&lines, out);
    each_row!(W, |r| {
        lines[r] = unit::<W>(r);
        each_row!(W, |k| if k < r {
            let line = lines[k];
            Width::<W>::subtract(&mut lines[r], factor[r][k], &line);
        });
        let below = part::<W>(lines[r]);
        each_row!(W, |k| if k < r {
            out[r][k] = below[k];
        });
    });
}

/// Row r of the identity.
#[inline(always)]
fn unit<const W: usize>(r: usize) -> <Width<W> as Rows<W>>::Row
where
    Width<W>: Rows<W>,
{
    let mut out = [0.0; W];
    out[r] = 1.0;
    row::<W>(&out)
}

/// U^-1 L^-1 x with the inverted triangles of [`invert`]. Two products take half the time of two
/// substitutions, in which each entry waits for the one before.
#[inline(always)]
pub fn solve<const W: usize>(inverses: &Tile<W>, x: &BlockVector<W>) -> BlockVector<W> {
    let mut y = [0.0; W];
    let mut z = [0.0; W];
    each_row!(W, |r| {
        let mut sums = [x[r], 0.0];
        each_row!(W, |k| if k < r {
            sums[k % 2] += inverses[r][k] * x[k];
        });
        y[r] = sums[0] + sums[1];
    });
    each_row!(W, |r| {
        let mut sums = [0.0; 2];
        each_row!(W, |k| if k >= r {
            sums[k % 2] += inverses[r][k] * y[k];
        });
        z[r] = sums[0] + sums[1];
    });
    z
}

/// L^-T D^-1 L^-1 x with the inverted triangles of [`invert_symmetric`].
#[inline(always)]
pub fn solve_symmetric<const W: usize>(inverses: &UpperTriangle<W>, x: &BlockVector<W>) -> BlockVector<W>
where
    Width<W>: Rows<W>,
{
    let inverses = inverses.as_ref();
    let mut y = [0.0; W];
    let mut z = [0.0; W];
    each_row!(W, |r| {
        let mut sums = [x[r], 0.0];
        each_row!(W, |k| if k < r {
            sums[k % 2] += inverses[upper_entry(W, k, r)] * x[k];
        });
        y[r] = (sums[0] + sums[1]) * inverses[upper_entry(W, r, r)];
    });
    each_row!(W, |r| {
        let mut sums = [0.0; 2];
        sums[r % 2] = y[r];
        each_row!(W, |k| if k > r {
            sums[k % 2] += inverses[upper_entry(W, r, k)] * y[k];
        });
        z[r] = sums[0] + sums[1];
    });
    z
}

/// Entries of x in the order of the pivots, P x.
#[inline(always)]
pub fn reordered<const W: usize>(order: &RowOrder<W>, x: &BlockVector<W>) -> BlockVector<W> {
    let mut out = [0.0; W];
    each_row!(W, |r| out[r] = x[order[r] as usize]);
    out
}
