//! Block L D L^T factorisation of symmetric tangents.

use super::diagonal::Diagonal;
use super::elimination::Elimination;
use super::list_range::ListRange;
use super::pieces::{LaterTargets, Piece, PieceFactors, PivotSigns};
use super::tile::{self, BlockVector, DiagonalTiles, Rows, StoredBlock, Tile, UpperTriangle, Width};
use crate::interrupt;
use crate::system::upper_entry;
use std::ops::Range;

/// Rows of a block L D L^T factorisation, with A_kk = L D L^T the diagonal tile at the elimination
/// of row k. Off-diagonal blocks keep the values they have then: with Y = L^-1 A_kj, row k
/// subtracts Y^T D^-1 Y from later blocks.
pub struct Ldl<const W: usize>
where
    Width<W>: Rows<W>,
{
    rows: Range<usize>,
    /// Blocks above the diagonal that elimination changes
    changed: ListRange<Tile<W>>,
    /// D^-1 Y of the row being eliminated
    row: Vec<Tile<W>>,
}

impl<const W: usize> Piece<W> for Ldl<W>
where
    Width<W>: Rows<W>,
{
    const NAME: &'static str = "block LDL^T";
    const SYMMETRIC: bool = true;

    type DiagonalTile = UpperTriangle<W>;
    const NOTHING: Self::DiagonalTile = <Width<W> as Rows<W>>::NOTHING;

    fn new(rows: Range<usize>, changed: Range<usize>) -> Option<Self> {
        Some(Self { rows, changed: ListRange::new(changed, tile::zero())?, row: Vec::new() })
    }

    fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    fn within(numbers: &[f64]) -> &[Self::DiagonalTile] {
        Width::<W>::uppers(numbers)
    }

    fn within_mut(numbers: &mut [f64]) -> &mut [Self::DiagonalTile] {
        Width::<W>::uppers_mut(numbers)
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
        if let Some(own) = own {
            for row in rows.clone() {
                own.copy_upper(elimination.order[row] as usize, diagonal[row].as_mut());
            }
        }
        for number in elimination.changed(&rows) {
            // A block stored by columns is its mirror image stored by rows.
            let [_, below] = elimination.begin(number);
            let none = ListRange::nothing();
            let block = &mut self.changed[number];
            StoredBlock::find(below, beside, &none).with(|begin| tile::copy(block, begin));
        }
        for idle in elimination.idle(&rows) {
            let r = idle.tile_row as usize;
            diagonal[idle.block_row as usize].as_mut()[upper_entry(W, r, r)] = 1.0;
        }
    }

    fn add_own(sum: &mut Self::DiagonalTile, other: &Self::DiagonalTile) -> bool {
        sum.as_mut().iter_mut().zip(other.as_ref()).for_each(|(sum, other)| *sum += other);
        // The signs of pivots tell whether digits may be lost.
        true
    }

    fn add(&mut self, other: &Self) {
        self.changed.add_tiles(&other.changed);
    }

    fn clear(&mut self) {
        self.changed.fill(|_| tile::zero());
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
        let Self { changed, row: before, .. } = self;
        let mut factor = tile::zero();
        let mut y = tile::zero();
        let mut w = tile::zero();
        let mut negative = 0;
        for row in rows {
            tile::spread(&diagonal[row], &mut factor);
            negative += tile::factorise_symmetric(&mut factor)?;
            let neighbours = elimination.neighbours(row);
            let mut target = elimination.first_target(row);
            before.clear();
            for k in neighbours.clone() {
                if interrupt::is_requested() {
                    return None;
                }
                let forward = |block: &Tile<W>| tile::forward_symmetric(&factor, block, &mut y);
                StoredBlock::find(elimination.below(k), beside, changed).with(forward);
                for w in &*before {
                    let shared = elimination.targets[target] as usize;
                    tile::subtract_product(changed.or(&mut beyond.blocks.changed, shared), w, &y);
                    target += 1;
                }
                tile::over_pivots(&factor, &y, &mut w);
                let later = diagonal.or(beyond.diagonal, elimination.later[k] as usize);
                tile::subtract_symmetric_product(later, &w, &y);
                if k + 1 < neighbours.end {
                    before.push(w);
                }
            }
            tile::invert_symmetric(&factor, &mut diagonal[row]);
        }
        // With positive pivots only no digits are lost, as in Cholesky's factorisation.
        Some(PivotSigns { negative, doubtful: negative })
    }

    #[inline(always)]
    fn forward(&self, factors: &PieceFactors<Self, W>, x: &mut [BlockVector<W>], beyond: &mut [BlockVector<W>]) {
        for row in self.rows() {
            let part = tile::solve_symmetric(&factors.diagonal[row], &x[row - self.rows.start]);
            self.subtract_from_later(factors, row, &part, x, beyond);
            x[row - self.rows.start] = part;
        }
    }

    #[inline(always)]
    fn backward(&self, factors: &PieceFactors<Self, W>, x: &mut [BlockVector<W>], beyond: &[BlockVector<W>]) {
        for row in self.rows().rev() {
            let part =
                tile::solve_symmetric(&factors.diagonal[row], &self.subtracted_by_later(factors, row, x, beyond));
            x[row - self.rows.start].iter_mut().zip(part).for_each(|(x, change)| *x += change);
        }
    }
}

impl<const W: usize> Ldl<W>
where
    Width<W>: Rows<W>,
{
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
        for k in factors.elimination.neighbours(row) {
            let later = factors.elimination.place(&self.rows, k).of_mut(x, beyond);
            StoredBlock::find(factors.elimination.below(k), factors.beside, &self.changed)
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
        let mut part = [0.0; W];
        for k in factors.elimination.neighbours(row) {
            let later = factors.elimination.place(&self.rows, k).of(x, beyond);
            StoredBlock::find(factors.elimination.below(k), factors.beside, &self.changed)
                .subtract_times(&mut part, later);
        }
        part
    }
}
