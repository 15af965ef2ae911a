//! L D L^T in blocks, of symmetric tangents.

use super::elimination::Elimination;
use super::pieces::Piece;
use super::stretch::Stretch;
use super::tile::{self, Block, Part, Rows, Tile, Tiles, Upper, Width};
use crate::system::upper_entry;
use std::ops::Range;

/// With A_kk = L D L^T as row k is eliminated. Blocks beside the diagonal stay what they are then: with Y = L^-1 A_kj a row
/// takes Y^T D^-1 Y from what comes later.
pub struct Ldl<const W: usize>
where
    Width<W>: Rows<W>,
{
    diagonal: Stretch<Upper<W>>,
    /// The blocks above the diagonal that are not those of the tangent
    changed: Stretch<Tile<W>>,
    /// D^-1 Y of the row that is being eliminated
    row: Vec<Tile<W>>,
}

impl<const W: usize> Piece<W> for Ldl<W>
where
    Width<W>: Rows<W>,
{
    const NAME: &'static str = "block LDL^T";
    const SYMMETRIC: bool = true;

    fn new(rows: Range<usize>, changed: Range<usize>) -> Option<Self> {
        let (diagonal, changed) = (Stretch::new(rows, Width::NOTHING)?, Stretch::new(changed, tile::zero())?);
        Some(Self { diagonal, changed, row: Vec::new() })
    }

    fn rows(&self) -> Range<usize> {
        self.diagonal.range()
    }

    #[inline(always)]
    fn load(&mut self, rows: Range<usize>, elimination: &Elimination, tiles: &Tiles<W>) {
        for row in rows.clone() {
            tiles.own.copy_upper(elimination.order[row] as usize, self.diagonal[row].as_mut());
        }
        for number in elimination.changed(&rows) {
            // By columns it is what its mirror image is by rows.
            let ([_, below], none, block) = (elimination.begin(number), Stretch::nothing(), &mut self.changed[number]);
            Block::find(below, tiles, &none).with(|begin| tile::copy(block, begin));
        }
        for &(row, direction) in elimination.idle(&rows) {
            self.diagonal[row as usize].as_mut()[upper_entry(W, direction as usize, direction as usize)] = 1.0;
        }
    }

    fn add(&mut self, other: &Self) {
        self.diagonal.add(&other.diagonal);
        self.changed.add_tiles(&other.changed);
    }

    fn clear(&mut self) {
        self.diagonal.fill(|_| Width::NOTHING);
        self.changed.fill(|_| tile::zero());
    }

    #[inline(always)]
    fn eliminate(
        &mut self,
        rows: Range<usize>,
        elimination: &Elimination,
        tiles: &Tiles<W>,
        beyond: &mut Self,
    ) -> Option<usize> {
        let Self { diagonal, changed, row: before } = self;
        let (mut factor, mut y, mut w, mut negative) = (tile::zero(), tile::zero(), tile::zero(), 0);
        for row in rows {
            tile::spread(&diagonal[row], &mut factor);
            negative += tile::factorise_symmetric(&mut factor)?;
            let (neighbours, mut target) = (elimination.neighbours(row), elimination.target_starts[row] as usize);
            before.clear();
            for k in neighbours.clone() {
                let forward = |block: &Tile<W>| tile::forward_symmetric(&factor, block, &mut y);
                Block::find(elimination.below(k), tiles, changed).with(forward);
                for w in &*before {
                    let shared = elimination.targets[target] as usize;
                    tile::subtract_product(changed.or(&mut beyond.changed, shared), w, &y);
                    target += 1;
                }
                tile::over_pivots(&factor, &y, &mut w);
                let later = diagonal.or(&mut beyond.diagonal, elimination.later[k] as usize);
                tile::subtract_symmetric_product(later, &w, &y);
                if k + 1 < neighbours.end {
                    before.push(w);
                }
            }
            tile::invert_symmetric(&factor, &mut diagonal[row]);
        }
        Some(negative)
    }

    #[inline(always)]
    fn forward(&self, elimination: &Elimination, tiles: &Tiles<W>, x: &mut [Part<W>], beyond: &mut [Part<W>]) {
        let rows = self.rows();
        for row in rows.clone() {
            let part = tile::solve_symmetric(&self.diagonal[row], &x[row - rows.start]);
            for k in elimination.neighbours(row) {
                let later = elimination.place(&rows, k).of_mut(x, beyond);
                Block::find(elimination.below(k), tiles, &self.changed).transposed().subtract_times(later, &part);
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
                Block::find(elimination.below(k), tiles, &self.changed).subtract_times(&mut part, later);
            }
            let part = tile::solve_symmetric(&self.diagonal[row], &part);
            x[row - rows.start].iter_mut().zip(part).for_each(|(x, change)| *x += change);
        }
    }
}
