//! LU in blocks, of unsymmetric tangents, with pivots looked for inside the blocks of the diagonal.

use super::elimination::Elimination;
use super::tile::{self, Part, RowOrder, Tile};
use super::{load, tiles};
use crate::system::System;

/// With P A_kk = L U: Y = L^-1 P A_kj right of the diagonal, W = U^-T A_jk^T below it; L_jk = W^T.
pub struct Lu {
    diagonal: Vec<Tile>,
    orders: Vec<RowOrder>,
    upper: Vec<Tile>,
    /// Transposed, each beside its mirror image in `upper`
    lower: Vec<Tile>,
}

impl Lu {
    /// Of so many rows, and blocks right of the diagonal.
    pub fn new(rows: usize, blocks: usize) -> Option<Self> {
        let orders = vec![[0; tile::WIDTH]; rows];
        Some(Self { diagonal: tiles(rows)?, orders, upper: tiles(blocks)?, lower: tiles(blocks)? })
    }

    /// Factorises; `false` where a pivot is zero or no number.
    #[inline(always)]
    pub fn factorise(&mut self, elimination: &Elimination, system: &System) -> bool {
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

    /// Solves with the last factorisation.
    #[inline(always)]
    pub fn solve(&self, elimination: &Elimination, x: &mut [Part]) {
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
