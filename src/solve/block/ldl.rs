//! L D L^T in blocks, of symmetric tangents.

use super::elimination::Elimination;
use super::pieces::Piece;
use super::stretch::Stretch;
use super::tile::{self, Part, Rows, Tile, Width};
use crate::system::System;
use std::ops::Range;

/// With Y = L_kk^-1 A_kj, L_jk = Y^T D_k^-1, whose transpose stands right of the diagonal.
pub struct Ldl<const W: usize> {
    diagonal: Stretch<Tile<W>>,
    upper: Stretch<Tile<W>>,
}

impl<const W: usize> Piece<W> for Ldl<W>
where
    Width<W>: Rows<W>,
{
    const NAME: &'static str = "block LDL^T";
    const SYMMETRIC: bool = true;

    fn new(rows: Range<usize>, blocks: Range<usize>) -> Option<Self> {
        Some(Self { diagonal: Stretch::new(rows, tile::zero())?, upper: Stretch::new(blocks, tile::zero())? })
    }

    fn rows(&self) -> Range<usize> {
        self.diagonal.range()
    }

    #[inline(always)]
    fn load(&mut self, rows: Range<usize>, elimination: &Elimination, system: &System) {
        let tiles = system.tiles::<W>();
        for row in rows.clone() {
            self.diagonal[row] = tiles[elimination.diagonal[row] as usize];
            for k in elimination.neighbours(row) {
                // By columns it is what its mirror image is by rows.
                tile::take(&mut self.upper[k], tiles, elimination.sources[k][1]);
            }
        }
        for &(row, direction) in elimination.idle(&rows) {
            self.diagonal[row as usize][direction as usize][direction as usize] = 1.0;
        }
    }

    fn add(&mut self, other: &Self) {
        self.diagonal.add(&other.diagonal);
        self.upper.add(&other.upper);
    }

    fn clear(&mut self) {
        self.diagonal.fill(|_| tile::zero());
        self.upper.fill(|_| tile::zero());
    }

    #[inline(always)]
    fn eliminate(&mut self, rows: Range<usize>, elimination: &Elimination, beyond: &mut Self) -> Option<usize> {
        let Self { diagonal, upper } = self;
        let mut negative = 0;
        for row in rows {
            negative += tile::factorise_symmetric(&mut diagonal[row])?;
            let factor = diagonal[row];
            let (neighbours, mut target) = (elimination.neighbours(row), elimination.target_starts[row] as usize);
            for k in neighbours.clone() {
                let mut y = upper[k];
                tile::forward_symmetric(&factor, &mut y);
                for a in neighbours.start..k {
                    let w = upper[a];
                    tile::subtract_product(upper.or(&mut beyond.upper, elimination.targets[target] as usize), &w, &y);
                    target += 1;
                }
                let w = tile::over_pivots(&factor, &y);
                let changed = diagonal.or(&mut beyond.diagonal, elimination.later[k] as usize);
                tile::subtract_product(changed, &w, &y);
                upper[k] = w;
            }
        }
        Some(negative)
    }

    #[inline(always)]
    fn forward(&self, elimination: &Elimination, x: &mut [Part<W>], beyond: &mut [Part<W>]) {
        let rows = self.rows();
        for row in rows.clone() {
            let (factor, mut part) = (&self.diagonal[row], x[row - rows.start]);
            tile::solve_forward_symmetric(factor, &mut part);
            for k in elimination.neighbours(row) {
                let later = elimination.place(&rows, k);
                tile::subtract_transposed(later.of_mut(x, beyond), &self.upper[k], &part);
            }
            part.iter_mut().enumerate().for_each(|(r, x)| *x *= factor[r][r]);
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
            tile::solve_backward_symmetric(&self.diagonal[row], &mut part);
            x[row - rows.start] = part;
        }
    }
}
