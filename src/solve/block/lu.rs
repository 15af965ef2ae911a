//! LU in blocks, of unsymmetric tangents, with pivots looked for inside the blocks of the diagonal where those in place are small.

use super::elimination::Elimination;
use super::pieces::Piece;
use super::stretch::Stretch;
use super::tile::{self, Block, Part, RowOrder, Rows, Tile, Tiles, Width};
use std::ops::Range;

/// With P A_kk = L U as row k is eliminated. Blocks beside the diagonal stay what they are then: with Y = L^-1 P A_kj and
/// W = U^-T A_jk^T a row takes W^T Y from what comes later.
pub struct Lu<const W: usize> {
    diagonal: Stretch<Tile<W>>,
    orders: Stretch<RowOrder<W>>,
    /// The blocks above the diagonal that are not those of the tangent
    above: Stretch<Tile<W>>,
    /// Transposed, each beside its mirror image in `above`
    below: Stretch<Tile<W>>,
    /// Y and W of the row that is being eliminated
    row: Vec<[Tile<W>; 2]>,
}

impl<const W: usize> Piece<W> for Lu<W>
where
    Width<W>: Rows<W>,
{
    const NAME: &'static str = "block LU";
    const SYMMETRIC: bool = false;

    fn new(rows: Range<usize>, changed: Range<usize>) -> Option<Self> {
        Some(Self {
            diagonal: Stretch::new(rows.clone(), tile::zero())?,
            orders: Stretch::new(rows, [0; W])?,
            above: Stretch::new(changed.clone(), tile::zero())?,
            below: Stretch::new(changed, tile::zero())?,
            row: Vec::new(),
        })
    }

    fn rows(&self) -> Range<usize> {
        self.diagonal.range()
    }

    #[inline(always)]
    fn load(&mut self, rows: Range<usize>, elimination: &Elimination, tiles: &Tiles<W>) {
        for row in rows.clone() {
            let group = elimination.order[row] as usize;
            tiles.own.with(
                group,
                #[inline(always)]
                |own| self.diagonal[row] = tile::transposed(own),
            );
        }
        for number in elimination.changed(&rows) {
            let (none, above, below) = (Stretch::nothing(), &mut self.above[number], &mut self.below[number]);
            for (own, source) in [above, below].into_iter().zip(elimination.begin(number)) {
                Block::find(source, tiles, &none).with(|begin| tile::copy(own, begin));
            }
        }
        for &(row, direction) in elimination.idle(&rows) {
            self.diagonal[row as usize][direction as usize][direction as usize] = 1.0;
        }
    }

    fn add(&mut self, other: &Self) {
        self.diagonal.add_tiles(&other.diagonal);
        self.above.add_tiles(&other.above);
        self.below.add_tiles(&other.below);
    }

    fn clear(&mut self) {
        for stretch in [&mut self.diagonal, &mut self.above, &mut self.below] {
            stretch.fill(|_| tile::zero());
        }
    }

    #[inline(always)]
    fn eliminate(
        &mut self,
        rows: Range<usize>,
        elimination: &Elimination,
        tiles: &Tiles<W>,
        beyond: &mut Self,
    ) -> Option<usize> {
        let Self { diagonal, orders, above, below, row: before } = self;
        let (mut factor, mut y, mut w) = (tile::zero(), tile::zero(), tile::zero());
        for row in rows {
            tile::copy(&mut factor, &diagonal[row]);
            let order = tile::factorise(&mut factor)?;
            orders[row] = order;
            let (neighbours, mut target) = (elimination.neighbours(row), elimination.target_starts[row] as usize);
            before.clear();
            for k in neighbours.clone() {
                let is_one = elimination.is_one(k);
                let both = |block: &Tile<W>| {
                    tile::forward_upper(&factor, block, &mut w);
                    if is_one {
                        tile::forward(&factor, &order, block, &mut y);
                    }
                };
                Block::find(elimination.below(k), tiles, below).with(both);
                if !is_one {
                    let forward = |block: &Tile<W>| tile::forward(&factor, &order, block, &mut y);
                    Block::find(elimination.above(k), tiles, above).with(forward);
                }
                for [other_y, other_w] in &*before {
                    let shared = elimination.targets[target] as usize;
                    tile::subtract_product(above.or(&mut beyond.above, shared), other_w, &y);
                    tile::subtract_product(below.or(&mut beyond.below, shared), other_y, &w);
                    target += 1;
                }
                let later = diagonal.or(&mut beyond.diagonal, elimination.later[k] as usize);
                tile::subtract_product(later, &w, &y);
                if k + 1 < neighbours.end {
                    before.push([y, w]);
                }
            }
            tile::invert(&factor, &mut diagonal[row]);
        }
        // Signs of pivots tell nothing.
        Some(0)
    }

    #[inline(always)]
    fn forward(&self, elimination: &Elimination, tiles: &Tiles<W>, x: &mut [Part<W>], beyond: &mut [Part<W>]) {
        let rows = self.rows();
        for row in rows.clone() {
            let part = self.solved(row, &x[row - rows.start]);
            for k in elimination.neighbours(row) {
                let later = elimination.place(&rows, k).of_mut(x, beyond);
                Block::find(elimination.below(k), tiles, &self.below).transposed().subtract_times(later, &part);
            }
            x[row - rows.start] = part;
        }
    }

    #[inline(always)]
    fn backward(&self, elimination: &Elimination, tiles: &Tiles<W>, x: &mut [Part<W>], beyond: &[Part<W>]) {
        let rows = self.rows();
        for row in rows.clone().rev() {
            let mut part = [0.0; W];
            for k in elimination.neighbours(row) {
                let later = elimination.place(&rows, k).of(x, beyond);
                Block::find(elimination.above(k), tiles, &self.above).subtract_times(&mut part, later);
            }
            let part = self.solved(row, &part);
            x[row - rows.start].iter_mut().zip(part).for_each(|(x, change)| *x += change);
        }
    }
}

impl<const W: usize> Lu<W> {
    /// A_kk^-1 x, with A_kk as row k was eliminated
    #[inline(always)]
    fn solved(&self, row: usize, x: &Part<W>) -> Part<W> {
        tile::solve(&self.diagonal[row], &tile::reordered(&self.orders[row], x))
    }
}
