//! Block LU factorisation of unsymmetric tangents, with row pivoting inside diagonal tiles
//! that have small pivots.

use super::diagonal::Diagonal;
use super::elimination::Elimination;
use super::list_range::ListRange;
use super::pieces::{LaterTargets, Piece, PieceFactors, PivotSigns};
use super::tile::{self, BlockVector, DiagonalTiles, RowOrder, Rows, StoredBlock, Tile, Width};
use crate::interrupt;
use std::ops::Range;

/// Rows of a block LU factorisation, with P A_kk = L U the diagonal tile at the elimination of row
/// k. Off-diagonal blocks keep the values they have then: with Y = L^-1 P A_kj and W = U^-T A_jk^T,
/// row k subtracts W^T Y from later blocks.
pub struct Lu<const W: usize> {
    orders: ListRange<RowOrder<W>>,
    /// Blocks above the diagonal that elimination changes
    above: ListRange<Tile<W>>,
    /// Transposes of the mirror images of the blocks in `above`, in the same order
    below: ListRange<Tile<W>>,
    /// Y and W of the row being eliminated
    row: Vec<[Tile<W>; 2]>,
}

impl<const W: usize> Piece<W> for Lu<W>
where
    Width<W>: Rows<W>,
{
    const NAME: &'static str = "block LU";
    const SYMMETRIC: bool = false;

    type DiagonalTile = Tile<W>;
    const NOTHING: Self::DiagonalTile = tile::zero();

    fn new(rows: Range<usize>, changed: Range<usize>) -> Option<Self> {
        Some(Self {
            orders: ListRange::new(rows, [0; W])?,
            above: ListRange::new(changed.clone(), tile::zero())?,
            below: ListRange::new(changed, tile::zero())?,
            row: Vec::new(),
        })
    }

    fn rows(&self) -> Range<usize> {
        self.orders.range()
    }

    fn within(numbers: &[f64]) -> &[Self::DiagonalTile] {
        numbers.as_chunks().0.as_chunks().0
    }

    fn within_mut(numbers: &mut [f64]) -> &mut [Self::DiagonalTile] {
        numbers.as_chunks_mut().0.as_chunks_mut().0
    }

    #[inline(always)]
    fn load(
        &mut self,
        rows: Range<usize>,
        elimination: &Elimination,
        own: Option<&DiagonalTiles<W>>,
        beside: &[Tile<W>],
        diagonal: &mut Diagonal<&mut [Self::DiagonalTile]>,
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
            let none = ListRange::nothing();
            let above = &mut self.above[number];
            let below = &mut self.below[number];
            for (own, source) in [above, below].into_iter().zip(elimination.begin(number)) {
                StoredBlock::find(source, beside, &none).with(|begin| tile::copy(own, begin));
            }
        }
        for idle in elimination.idle(&rows) {
            let r = idle.tile_row as usize;
            diagonal[idle.block_row as usize][r][r] = 1.0;
        }
    }

    fn add_own(sum: &mut Self::DiagonalTile, other: &Self::DiagonalTile) -> bool {
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
        diagonal: &mut Diagonal<&mut [Self::DiagonalTile]>,
        beyond: LaterTargets<Self, W>,
    ) -> Option<PivotSigns> {
        let end = self.rows().end;
        let Self { orders, above, below, row: before } = self;
        let mut factor = tile::zero();
        let mut y = tile::zero();
        let mut w = tile::zero();
        let mut negative = 0;
        let mut doubtful = 0;
        for row in rows {
            tile::copy(&mut factor, &diagonal[row]);
            let (order, mut is_sure) = tile::factorise(&mut factor)?;
            orders[row] = order;
            negative += usize::from(tile::has_negative_determinant(&factor, &order));
            let neighbours = elimination.neighbours(row);
            let mut target = elimination.first_target(row);
            before.clear();
            for k in neighbours.clone() {
                if interrupt::is_requested() {
                    return None;
                }
                let is_one = elimination.is_one(k);
                let both = |block: &Tile<W>| {
                    tile::forward_upper(&factor, block, &mut w);
                    if is_one {
                        tile::forward(&factor, &order, block, &mut y);
                    }
                };
                StoredBlock::find(elimination.below(k), beside, below).with(both);
                if !is_one {
                    let forward = |block: &Tile<W>| tile::forward(&factor, &order, block, &mut y);
                    StoredBlock::find(elimination.above(k), beside, above).with(forward);
                }
                for [other_y, other_w] in &*before {
                    let shared = elimination.targets[target] as usize;
                    tile::subtract_product(above.or(&mut beyond.blocks.above, shared), other_w, &y);
                    tile::subtract_product(below.or(&mut beyond.blocks.below, shared), other_y, &w);
                    target += 1;
                }
                match elimination.later[k] as usize {
                    later if later < end => {
                        let later = &mut diagonal[later];
                        is_sure &= tile::is_moderate(&w, &y, later);
                        tile::subtract_product(later, &w, &y);
                    }
                    later => tile::subtract_product(&mut beyond.diagonal[later], &w, &y),
                }
                if k + 1 < neighbours.end {
                    before.push([y, w]);
                }
            }
            tile::invert(&factor, &mut diagonal[row]);
            doubtful += usize::from(!is_sure);
        }
        Some(PivotSigns { negative, doubtful })
    }

    #[inline(always)]
    fn forward(&self, factors: &PieceFactors<Self, W>, x: &mut [BlockVector<W>], beyond: &mut [BlockVector<W>]) {
        let rows = self.rows();
        for row in rows.clone() {
            let part = self.solved(factors, row, &x[row - rows.start]);
            self.subtract_from_later(factors, row, &part, x, beyond);
            x[row - rows.start] = part;
        }
    }

    #[inline(always)]
    fn backward(&self, factors: &PieceFactors<Self, W>, x: &mut [BlockVector<W>], beyond: &[BlockVector<W>]) {
        let rows = self.rows();
        for row in rows.clone().rev() {
            let part = self.solved(factors, row, &self.subtracted_by_later(factors, row, x, beyond));
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
    fn solved(&self, factors: &PieceFactors<Self, W>, row: usize, x: &BlockVector<W>) -> BlockVector<W> {
        tile::solve(&factors.diagonal[row], &tile::reordered(&self.orders[row], x))
    }

    /// x_j -= A_jk x_k for all later rows j, with x_k in `part`
    #[inline(always)]
    fn subtract_from_later(
        &self,
        factors: &PieceFactors<Self, W>,
        row: usize,
        part: &BlockVector<W>,
        x: &mut [BlockVector<W>],
        beyond: &mut [BlockVector<W>],
    ) {
        let rows = self.rows();
        for k in factors.elimination.neighbours(row) {
            let later = factors.elimination.place(&rows, k).of_mut(x, beyond);
            StoredBlock::find(factors.elimination.below(k), factors.beside, &self.below)
                .transposed()
                .subtract_times(later, part);
        }
    }

    /// -sum A_kj x_j over all later rows j
    #[inline(always)]
    fn subtracted_by_later(
        &self,
        factors: &PieceFactors<Self, W>,
        row: usize,
        x: &[BlockVector<W>],
        beyond: &[BlockVector<W>],
    ) -> BlockVector<W> {
        let rows = self.rows();
        let mut part = [0.0; W];
        for k in factors.elimination.neighbours(row) {
            let later = factors.elimination.place(&rows, k).of(x, beyond);
            StoredBlock::find(factors.elimination.above(k), factors.beside, &self.above)
                .subtract_times(&mut part, later);
        }
        part
    }
}
