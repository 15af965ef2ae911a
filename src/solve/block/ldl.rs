//! L D L^T in blocks, of symmetric tangents.

use super::elimination::Elimination;
use super::tile::{self, Part, Rows, Tile, Width};
use super::{Factor, load, tiles};
use crate::real::Instructions;
use crate::system::System;

/// With Y = L_kk^-1 A_kj right of the diagonal, L_jk = Y^T D_k^-1.
pub struct Ldl<const W: usize> {
    diagonal: Vec<Tile<W>>,
    upper: Vec<Tile<W>>,
    /// Pivots below zero in the last factorisation
    negative: usize,
}

impl<const W: usize> Ldl<W>
where
    Width<W>: Rows<W>,
{
    /// Of so many rows, and blocks right of the diagonal.
    pub fn new(rows: usize, blocks: usize) -> Option<Self> {
        Some(Self { diagonal: tiles(rows)?, upper: tiles(blocks)?, negative: 0 })
    }

    #[inline(always)]
    fn eliminate(&mut self, elimination: &Elimination, system: &System) -> bool {
        load(elimination, system, &mut self.diagonal, &mut self.upper, None);
        self.negative = 0;
        let mut target = 0;
        for row in 0..self.diagonal.len() {
            let Some(negative) = tile::factorise_symmetric(&mut self.diagonal[row]) else { return false };
            self.negative += negative;
            let factor = self.diagonal[row];
            let neighbours = elimination.neighbours(row);
            for k in neighbours.clone() {
                tile::forward_symmetric(&factor, &mut self.upper[k]);
            }
            for k in neighbours.clone() {
                let w = tile::over_pivots(&factor, &self.upper[k]);
                let a = elimination.later[k] as usize;
                tile::subtract_product(&mut self.diagonal[a], &w, &self.upper[k]);
                for b in k + 1..neighbours.end {
                    let y = self.upper[b];
                    tile::subtract_product(&mut self.upper[elimination.targets[target] as usize], &w, &y);
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
            tile::solve_forward_symmetric(factor, &mut part);
            part.iter_mut().enumerate().for_each(|(r, x)| *x *= factor[r][r]);
            for k in elimination.neighbours(row) {
                tile::subtract_transposed(&mut x[elimination.later[k] as usize], &self.upper[k], &part);
            }
            x[row] = part;
        }
        for (row, factor) in self.diagonal.iter().enumerate().rev() {
            let mut sum = [0.0; W];
            for k in elimination.neighbours(row) {
                tile::subtract_times(&mut sum, &self.upper[k], &x[elimination.later[k] as usize]);
            }
            let mut part = x[row];
            part.iter_mut().enumerate().for_each(|(r, x)| *x += factor[r][r] * sum[r]);
            tile::solve_backward_symmetric(factor, &mut part);
            x[row] = part;
        }
    }
}

impl<const W: usize> Factor for Ldl<W>
where
    Width<W>: Rows<W>,
{
    fn name(&self) -> &'static str {
        "block LDL^T"
    }

    fn factorise(&mut self, elimination: &Elimination, system: &System) -> bool {
        Instructions::here().run(
            #[inline(always)]
            || self.eliminate(elimination, system),
        )
    }

    fn negative(&self) -> Option<usize> {
        Some(self.negative)
    }

    fn solve(&self, elimination: &Elimination, x: &mut [f64]) {
        Instructions::here().run(
            #[inline(always)]
            || self.substitute(elimination, x.as_chunks_mut().0),
        )
    }
}
