//! Storage of tangent values in one list: first the diagonal tiles, one per node block, then the
//! off-diagonal tiles.

use super::tile::Tile;
use std::ops::Range;

/// Position of tiles that are not stored, since their transposes are.
pub(super) const NOT_KEPT: u32 = u32::MAX;

/// Positions of tiles and of their entries in the list of values.
///
/// Tiles are stored by columns. Diagonal tiles of symmetric tangents store only their upper
/// triangle, diagonal included, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Storage {
    width: usize,
    /// True if diagonal tiles store only their upper triangle.
    keeps_upper: bool,
    /// Numbers of values of a diagonal and of an off-diagonal tile
    lengths: [usize; 2],
    /// Position of the first off-diagonal tile
    boundary: usize,
}

impl Storage {
    /// Storage of tiles with `width` rows for `node_blocks` node blocks; with `keeps_upper`
    /// diagonal tiles store only their upper triangle.
    pub(super) fn new(width: usize, node_blocks: usize, keeps_upper: bool) -> Self {
        let whole = width * width;
        let own = if keeps_upper { upper_length(width) } else { whole };
        Self { width, keeps_upper, lengths: [own, whole], boundary: own * node_blocks }
    }

    /// Positions of the values of some diagonal tiles.
    pub(super) fn on_diagonal(&self, node_blocks: &Range<usize>) -> Range<usize> {
        self.diagonal_tile(node_blocks.start)..self.diagonal_tile(node_blocks.end)
    }

    /// Positions of the values of some off-diagonal tiles.
    pub(super) fn off_diagonal(&self, tiles: &Range<usize>) -> Range<usize> {
        self.off_diagonal_tile(tiles.start)..self.off_diagonal_tile(tiles.end)
    }

    /// True if diagonal tiles store only their upper triangle.
    #[inline(always)]
    pub(super) fn keeps_upper(&self) -> bool {
        self.keeps_upper
    }

    /// Position of the first off-diagonal tile.
    #[inline(always)]
    pub(super) fn boundary(&self) -> usize {
        self.boundary
    }

    /// Position of the diagonal tile of a node block.
    #[inline(always)]
    pub(super) fn diagonal_tile(&self, node_block: usize) -> usize {
        self.lengths[0] * node_block
    }

    /// Position of an off-diagonal tile.
    #[inline(always)]
    pub(super) fn off_diagonal_tile(&self, tile: usize) -> usize {
        self.boundary + self.lengths[1] * tile
    }

    /// Position to which a block is added that begins at an entry of the tile at `place`: see
    /// [`TileValues::block`](super::values::TileValues::block).
    pub(super) fn target(&self, place: usize, row: usize, column: usize) -> usize {
        if self.is_half(place) { place } else { self.entry(place, row, column) }
    }

    /// Position of an entry of the tile at `place`; in an upper triangle it may be that of the
    /// mirrored entry.
    #[inline]
    pub fn entry(&self, place: usize, row: usize, column: usize) -> usize {
        match self.is_half(place) {
            true => place + upper_entry(self.width, row.min(column), row.max(column)),
            false => place + self.width * column + row,
        }
    }

    /// True if the tile at `place` stores only its upper triangle.
    #[inline(always)]
    fn is_half(&self, place: usize) -> bool {
        self.keeps_upper && place < self.boundary
    }

    /// A list of values as tiles.
    pub(super) fn tiles<'a, const W: usize>(&self, values: &'a [f64]) -> Tiles<'a, W> {
        let (own, beside) = values.split_at(self.boundary);
        let own =
            if self.keeps_upper { DiagonalTiles::UpperTriangles(own) } else { DiagonalTiles::Whole(as_tiles(own)) };
        Tiles { own, beside: as_tiles(beside) }
    }
}

/// Number of values in the upper triangle of a symmetric tile.
pub const fn upper_length(width: usize) -> usize {
    width * (width + 1) / 2
}

/// Position in an upper triangle of an entry on or above the diagonal.
#[inline(always)]
pub const fn upper_entry(width: usize, row: usize, column: usize) -> usize {
    upper_start(width, row) + column
}

/// Position in an upper triangle of column 0 of a row, if the row were complete; such rows overlap.
#[inline(always)]
pub const fn upper_start(width: usize, row: usize) -> usize {
    row * (width - 1) - row * row.saturating_sub(1) / 2
}

/// Values of a tangent as tiles.
#[derive(Clone, Copy)]
pub struct Tiles<'a, const W: usize> {
    /// Diagonal tiles, one per node block
    pub(crate) own: DiagonalTiles<'a, W>,
    /// Off-diagonal tiles, in the order of the pattern
    pub(crate) beside: &'a [Tile<W>],
}

/// Diagonal tiles of a tangent.
#[derive(Clone, Copy)]
pub enum DiagonalTiles<'a, const W: usize> {
    /// Complete tiles
    Whole(&'a [Tile<W>]),
    /// Upper triangles, each row by row
    UpperTriangles(&'a [f64]),
}

impl<'a, const W: usize> DiagonalTiles<'a, W> {
    /// Calls `work` with the tile of a node block.
    #[inline(always)]
    pub fn with<T>(&self, node_block: usize, work: impl FnOnce(&Tile<W>) -> T) -> T {
        match self {
            Self::Whole(tiles) => work(&tiles[node_block]),
            Self::UpperTriangles(numbers) => {
                let numbers = half::<W>(numbers, node_block);
                let mut tile = [[0.0; W]; W];
                for r in 0..W {
                    for c in r..W {
                        tile[r][c] = numbers[upper_entry(W, r, c)];
                        tile[c][r] = tile[r][c];
                    }
                }
                work(&tile)
            }
        }
    }

    /// Copies the upper triangle of the symmetric tile of a node block.
    #[inline(always)]
    pub fn copy_upper(&self, node_block: usize, upper: &mut [f64]) {
        match self {
            Self::UpperTriangles(numbers) => upper.copy_from_slice(half::<W>(numbers, node_block)),
            Self::Whole(tiles) => {
                for r in 0..W {
                    let row = &tiles[node_block][r][r..];
                    upper[upper_entry(W, r, r)..][..W - r].copy_from_slice(row);
                }
            }
        }
    }
}

/// Upper triangle of one node block in the list of all.
#[inline(always)]
fn half<const W: usize>(numbers: &[f64], node_block: usize) -> &[f64] {
    &numbers[upper_length(W) * node_block..][..upper_length(W)]
}

/// A list of values as complete tiles.
pub(super) fn as_tiles<const W: usize>(values: &[f64]) -> &[Tile<W>] {
    values.as_chunks::<W>().0.as_chunks::<W>().0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_half_follow_each_other() {
        for width in [3, 6] {
            let entries = (0..width).flat_map(|r| (r..width).map(move |c| upper_entry(width, r, c)));
            assert!(entries.eq(0..upper_length(width)));
        }
    }
}
