//! LU in blocks, of unsymmetric tangents, with pivots looked for inside the blocks of the diagonal.

use super::elimination::Elimination;
use super::tile::{self, Part, RowOrder, Rows, Tile, Width};
use super::{Factor, load, tiles};
use crate::real::Instructions;
use crate::system::System;

/// With P A_kk = L U: Y = L^-1 P A_kj right of the diagonal, W = U^-T A_jk^T below it; L_jk = W^T.
pub struct Lu<const W: usize> {
    diagonal: Vec<Tile<W>>,
    orders: Vec<RowOrder<W>>,
    upper: Vec<Tile<W>>,
    /// Transposed, each beside its mirror image in `upper`
    lower: Vec<Tile<W>>,
}

impl<const W: usize> Lu<W>
where
    Width<W>: Rows<W>,
{
    /// Of so many rows, and blocks right of the diagonal.
    pub fn new(rows: usize, blocks: usize) -> Option<Self> {
        let orders = vec![[0; W]; rows];
        Some(Self { diagonal: tiles(rows)?, orders, upper: tiles(blocks)?, lower: tiles(blocks)? })
    }

    #[inline(always)]
    fn eliminate(&mut self, elimination: &Elimination, system: &System) -> bool {
        load(elimination, system, &mut self.diagonal, &mut self.upper, Some(&mut self.lower));
        let mut target = 0;
        for row in 0..self.diagonal.len() {
            let Some(order) = tile::factorise(&mut self.diagonal[row]) else { return false };
            self.orders[row] = order;
            let factor = self.diagonal[row];
            let neighbours = elimination.neighbours(row);
            for k in neighbours.clone() {
                let mut y = tile::permuted(&order, &self.upper[k]);
                tile::forward(&factor, &mut y);
                self.upper[k] = y;
                tile::forward_upper(&factor, &mut self.lower[k]);
            }
            for k in neighbours.clone() {
                let (w, y) = (self.lower[k], self.upper[k]);
                tile::subtract_product(&mut self.diagonal[elimination.later[k] as usize], &w, &y);
                for b in k + 1..neighbours.end {
                    let (other_w, other_y) = (self.lower[b], self.upper[b]);
                    let shared = elimination.targets[target] as usize;
                    tile::subtract_product(&mut self.upper[shared], &w, &other_y);
                    tile::subtract_product(&mut self.lower[shared], &y, &other_w);
                    target += 1;
                }
            }
        }
        true
    }

    #[inline(always)]
    fn substitute(&self, elimination: &Elimination, x: &mut [Part<W>]) {
        for (row, factor) in self.diagonal.iter().enumerate() {
            let mut part = x[row];
            tile::solve_forward(factor, &self.orders[row], &mut part);
            for k in elimination.neighbours(row) {
                tile::subtract_transposed(&mut x[elimination.later[k] as usize], &self.lower[k], &part);
            }
            x[row] = part;
        }
        for (row, factor) in self.diagonal.iter().enumerate().rev() {
            let mut part = x[row];
            for k in elimination.neighbours(row) {
                tile::subtract_times(&mut part, &self.upper[k], &x[elimination.later[k] as usize]);
            }
            tile::solve_backward(factor, &mut part);
            x[row] = part;
        }
    }
}

impl<const W: usize> Factor for Lu<W>
where
    Width<W>: Rows<W>,
{
    fn name(&self) -> &'static str {
        "block LU"
    }

    fn factorise(&mut self, elimination: &Elimination, system: &System) -> bool {
        Instructions::here().run(
            #[inline(always)]
            || self.eliminate(elimination, system),
        )
    }

    fn negative(&self) -> Option<usize> {
        None
    }

    fn solve(&self, elimination: &Elimination, x: &mut [f64]) {
        Instructions::here().run(
            #[inline(always)]
            || self.substitute(elimination, x.as_chunks_mut().0),
        )
    }
}
