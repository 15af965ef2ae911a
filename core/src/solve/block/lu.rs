//! Block LU factorisation of unsymmetric tangents, with row pivoting inside diagonal tiles that
//! have small pivots.

use super::diagonal::Diagonal;
use super::elimination::Elimination;
use super::pieces::{Look, Piece, Signs};
use super::stretch::Stretch;
use super::tile::{self, Block, Own, Part, RowOrder, Rows, Tile, Width};
use std::ops::Range;

/// Rows of a block LU factorisation, with P A_kk = L U the diagonal tile at the elimination of row
/// k. Off-diagonal blocks keep the values they have then: with Y = L^-1 P A_kj and W = U^-T A_jk^T,
/// row k subtracts W^T Y from later blocks.
pub struct Lu<const W: usize> {
    orders: Stretch<RowOrder<W>>,
    /// Blocks above the diagonal that elimination changes
    above: Stretch<Tile<W>>,
    /// Transposes of the mirror images of the blocks in `above`, in the same order
    below: Stretch<Tile<W>>,
    /// Y and W of the row being eliminated
    row: Vec<[Tile<W>; 2]>,
}

impl<const W: usize> Piece<W> for Lu<W>
where
    Width<W>: Rows<W>,
{
    const NAME: &'static str = "block LU";
    const SYMMETRIC: bool = false;

    type Own = Tile<W>;
    const NOTHING: Self::Own = tile::zero();

    fn new(rows: Range<usize>, changed: Range<usize>) -> Option<Self> {
        Some(Self {
            orders: Stretch::new(rows, [0; W])?,
            above: Stretch::new(changed.clone(), tile::zero())?,
            below: Stretch::new(changed, tile::zero())?,
            row: Vec::new(),
        })
    }

    fn rows(&self) -> Range<usize> {
        self.orders.range()
    }

    fn within(numbers: &[f64]) -> &[Self::Own] {
        numbers.as_chunks().0.as_chunks().0
    }

    fn within_mut(numbers: &mut [f64]) -> &mut [Self::Own] {
        numbers.as_chunks_mut().0.as_chunks_mut().0
    }

    #[inline(always)]
    fn load(
        &mut self,
        rows: Range<usize>,
        elimination: &Elimination,
        own: Option<&Own<W>>,
        beside: &[Tile<W>],
        diagonal: &mut Diagonal<&mut [Self::Own]>,
    ) {
        for row in rows.clone() {
            // Tiles of the tangent are stored by columns; factors are by rows.
            match own {
                Some(own) => own.with(
                    elimination.order[row] as usize,
                    #[inline(always)]
                    |own| diagonal[row] = tile::transposed(own),
                ),
                None => diagonal[row] = tile::transposed(&diagonal[row]),
            }
        }
        for number in elimination.changed(&rows) {
            let (none, above, below) = (Stretch::nothing(), &mut self.above[number], &mut self.below[number]);
            for (own, source) in [above, below].into_iter().zip(elimination.begin(number)) {
                Block::find(source, beside, &none).with(|begin| tile::copy(own, begin));
            }
        }
        for &(row, direction) in elimination.idle(&rows) {
            diagonal[row as usize][direction as usize][direction as usize] = 1.0;
        }
    }

    fn add_own(sum: &mut Self::Own, other: &Self::Own) -> bool {
        tile::add_moderate(sum, other)
    }

    fn add(&mut self, other: &Self) {
        self.above.add_tiles(&other.above);
        self.below.add_tiles(&other.below);
    }

    fn clear(&mut self) {
        for stretch in [&mut self.above, &mut self.below] {
            stretch.fill(|_| tile::zero());
        }
    }

    #[inline(always)]
    fn eliminate(
        &mut self,
        rows: Range<usize>,
        elimination: &Elimination,
        beside: &[Tile<W>],
        diagonal: &mut Diagonal<&mut [Self::Own]>,
        (beyond, of_beyond): (&mut Self, &mut Diagonal<&mut [Self::Own]>),
    ) -> Option<Signs> {
        let end = self.rows().end;
        let Self { orders, above, below, row: before } = self;
        let (mut factor, mut y, mut w) = (tile::zero(), tile::zero(), tile::zero());
        let (mut negative, mut doubtful) = (0, 0);
        for row in rows {
            tile::copy(&mut factor, &diagonal[row]);
            let (order, mut is_sure) = tile::factorise(&mut factor)?;
            orders[row] = order;
            negative += usize::from(tile::has_negative_determinant(&factor, &order));
            let (neighbours, mut target) = (elimination.neighbours(row), elimination.first_target(row));
            before.clear();
            for k in neighbours.clone() {
                let is_one = elimination.is_one(k);
                let both = |block: &Tile<W>| {
                    tile::forward_upper(&factor, block, &mut w);
                    if is_one {
                        tile::forward(&factor, &order, block, &mut y);
                    }
                };
                Block::find(elimination.below(k), beside, below).with(both);
                if !is_one {
                    let forward = |block: &Tile<W>| tile::forward(&factor, &order, block, &mut y);
                    Block::find(elimination.above(k), beside, above).with(forward);
                }
                for [other_y, other_w] in &*before {
                    let shared = elimination.targets[target] as usize;
                    tile::subtract_product(above.or(&mut beyond.above, shared), other_w, &y);
                    tile::subtract_product(below.or(&mut beyond.below, shared), other_y, &w);
                    target += 1;
                }
                match elimination.later[k] as usize {
                    later if later < end => {
                        let later = &mut diagonal[later];
                        is_sure &= tile::is_moderate(&w, &y, later);
                        tile::subtract_product(later, &w, &y);
                    }
                    later => tile::subtract_product(&mut of_beyond[later], &w, &y),
                }
                if k + 1 < neighbours.end {
                    before.push([y, w]);
                }
            }
            tile::invert(&factor, &mut diagonal[row]);
            doubtful += usize::from(!is_sure);
        }
        Some(Signs { negative, doubtful })
    }

    #[inline(always)]
    fn forward(&self, look: &Look<Self, W>, x: &mut [Part<W>], beyond: &mut [Part<W>]) {
        let rows = self.rows();
        for row in rows.clone() {
            let part = self.solved(look, row, &x[row - rows.start]);
            self.subtract_from_later(look, row, &part, x, beyond);
            x[row - rows.start] = part;
        }
    }

    #[inline(always)]
    fn backward(&self, look: &Look<Self, W>, x: &mut [Part<W>], beyond: &[Part<W>]) {
        let rows = self.rows();
        for row in rows.clone().rev() {
            let part = self.solved(look, row, &self.subtracted_by_later(look, row, x, beyond));
            x[row - rows.start].iter_mut().zip(part).for_each(|(x, change)| *x += change);
        }
    }
}

impl<const W: usize> Lu<W>
where
    Width<W>: Rows<W>,
{
    /// A_kk^-1 x, with A_kk the diagonal tile at the elimination of row k
    #[inline(always)]
    fn solved(&self, look: &Look<Self, W>, row: usize, x: &Part<W>) -> Part<W> {
        tile::solve(&look.diagonal[row], &tile::reordered(&self.orders[row], x))
    }

    /// x_j -= A_jk x_k for all later rows j, with x_k in `part`
    #[inline(always)]
    fn subtract_from_later(
        &self,
        look: &Look<Self, W>,
        row: usize,
        part: &Part<W>,
        x: &mut [Part<W>],
        beyond: &mut [Part<W>],
    ) {
        let rows = self.rows();
        for k in look.elimination.neighbours(row) {
            let later = look.elimination.place(&rows, k).of_mut(x, beyond);
            Block::find(look.elimination.below(k), look.beside, &self.below).transposed().subtract_times(later, part);
        }
    }

    /// -sum A_kj x_j over all later rows j
    #[inline(always)]
    fn subtracted_by_later(&self, look: &Look<Self, W>, row: usize, x: &[Part<W>], beyond: &[Part<W>]) -> Part<W> {
        let (rows, mut part) = (self.rows(), [0.0; W]);
        for k in look.elimination.neighbours(row) {
            let later = look.elimination.place(&rows, k).of(x, beyond);
            Block::find(look.elimination.above(k), look.beside, &self.above).subtract_times(&mut part, later);
        }
        part
    }
}
