//! LU in blocks, of unsymmetric tangents, with pivots looked for inside the blocks of the diagonal where those in place are small.

use super::elimination::Elimination;
use super::pieces::Piece;
use super::stretch::Stretch;
use super::tile::{self, Part, RowOrder, Rows, Tile, Width};
use crate::system::System;
use std::ops::Range;

/// With P A_kk = L U: Y = L^-1 P A_kj right of the diagonal, W = U^-T A_jk^T below it; L_jk = W^T.
pub struct Lu<const W: usize> {
    diagonal: Stretch<Tile<W>>,
    orders: Stretch<RowOrder<W>>,
    upper: Stretch<Tile<W>>,
    /// Transposed, each beside its mirror image in `upper`
    lower: Stretch<Tile<W>>,
}

impl<const W: usize> Piece<W> for Lu<W>
where
    Width<W>: Rows<W>,
{
    const NAME: &'static str = "block LU";
    const SYMMETRIC: bool = false;

    fn new(rows: Range<usize>, blocks: Range<usize>) -> Option<Self> {
        Some(Self {
            diagonal: Stretch::new(rows.clone(), tile::zero())?,
            orders: Stretch::new(rows, [0; W])?,
            upper: Stretch::new(blocks.clone(), tile::zero())?,
            lower: Stretch::new(blocks, tile::zero())?,
        })
    }

    fn rows(&self) -> Range<usize> {
        self.diagonal.range()
    }

    #[inline(always)]
    fn load(&mut self, rows: Range<usize>, elimination: &Elimination, system: &System) {
        let tiles = system.tiles::<W>();
        for row in rows.clone() {
            self.diagonal[row] = tile::transposed(&tiles[elimination.diagonal[row] as usize]);
            for k in elimination.neighbours(row) {
                let [upper, lower] = elimination.sources[k];
                tile::take(&mut self.upper[k], tiles, upper.transposed());
                // Where one tile is the transpose of the other, both are one here.
                match lower == upper.transposed() {
                    true => self.lower[k] = self.upper[k],
                    false => tile::take(&mut self.lower[k], tiles, lower),
                }
            }
        }
        for &(row, direction) in elimination.idle(&rows) {
            self.diagonal[row as usize][direction as usize][direction as usize] = 1.0;
        }
    }

    fn add(&mut self, other: &Self) {
        self.diagonal.add(&other.diagonal);
        self.upper.add(&other.upper);
        self.lower.add(&other.lower);
    }

    fn clear(&mut self) {
        for stretch in [&mut self.diagonal, &mut self.upper, &mut self.lower] {
            stretch.fill(|_| tile::zero());
        }
    }

    #[inline(always)]
    fn eliminate(&mut self, rows: Range<usize>, elimination: &Elimination, beyond: &mut Self) -> Option<usize> {
        let Self { diagonal, orders, upper, lower } = self;
        for row in rows {
            let order = tile::factorise(&mut diagonal[row])?;
            orders[row] = order;
            let factor = diagonal[row];
            let (neighbours, mut target) = (elimination.neighbours(row), elimination.target_starts[row] as usize);
            for k in neighbours.clone() {
                let (mut y, mut w) = (tile::permuted(&order, &upper[k]), lower[k]);
                tile::forward(&factor, &mut y);
                tile::forward_upper(&factor, &mut w);
                for a in neighbours.start..k {
                    let (other_y, other_w) = (upper[a], lower[a]);
                    let shared = elimination.targets[target] as usize;
                    tile::subtract_product(upper.or(&mut beyond.upper, shared), &other_w, &y);
                    tile::subtract_product(lower.or(&mut beyond.lower, shared), &other_y, &w);
                    target += 1;
                }
                let changed = diagonal.or(&mut beyond.diagonal, elimination.later[k] as usize);
                tile::subtract_product(changed, &w, &y);
                (upper[k], lower[k]) = (y, w);
            }
        }
        // Signs of pivots tell nothing.
        Some(0)
    }

    #[inline(always)]
    fn forward(&self, elimination: &Elimination, x: &mut [Part<W>], beyond: &mut [Part<W>]) {
        let rows = self.rows();
        for row in rows.clone() {
            let mut part = x[row - rows.start];
            tile::solve_forward(&self.diagonal[row], &self.orders[row], &mut part);
            for k in elimination.neighbours(row) {
                let later = elimination.place(&rows, k);
                tile::subtract_transposed(later.of_mut(x, beyond), &self.lower[k], &part);
            }
            x[row - rows.start] = part;
        }
    }

    #[inline(always)]
    fn backward(&self, elimination: &Elimination, x: &mut [Part<W>], beyond: &[Part<W>]) {
        let rows = self.rows();
        for row in rows.clone().rev() {
            let mut part = x[row - rows.start];
            for k in elimination.neighbours(row) {
                tile::subtract_times(&mut part, &self.upper[k], elimination.place(&rows, k).of(x, beyond));
            }
            tile::solve_backward(&self.diagonal[row], &mut part);
            x[row - rows.start] = part;
        }
    }
}
