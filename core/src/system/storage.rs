//! How the values of a tangent stand in one list: first the tiles on the diagonal, one a group, then those beside it.

use super::tile::Tile;
use std::ops::Range;

/// The place of a tile that is not kept: that of its transpose is.
pub(super) const NOT_KEPT: u32 = u32::MAX;

/// Where tiles and their entries stand in the list.
///
/// Tiles stand by their columns. Where a tangent is symmetric, tiles on the diagonal keep one half of themselves: what is above the
/// diagonal and on it, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Storage {
    width: usize,
    /// Whether tiles on the diagonal keep one half
    keeps_upper: bool,
    /// The numbers of a tile on the diagonal, and of one beside it
    lengths: [usize; 2],
    /// Where the tiles beside the diagonal begin
    boundary: usize,
}

impl Storage {
    /// Of tiles so wide; `keeps_upper` where those on the diagonal are symmetric, and only that half is kept.
    pub(super) fn new(width: usize, node_blocks: usize, keeps_upper: bool) -> Self {
        let whole = width * width;
        let own = if keeps_upper { upper_length(width) } else { whole };
        Self { width, keeps_upper, lengths: [own, whole], boundary: own * node_blocks }
    }

    /// The numbers of these tiles on the diagonal.
    pub(super) fn on_diagonal(&self, node_blocks: &Range<usize>) -> Range<usize> {
        self.own(node_blocks.start)..self.own(node_blocks.end)
    }

    /// The numbers of these tiles beside it.
    pub(super) fn beside(&self, tiles: &Range<usize>) -> Range<usize> {
        self.other(tiles.start)..self.other(tiles.end)
    }

    /// Whether tiles on the diagonal keep one half.
    #[inline(always)]
    pub(super) fn keeps_upper(&self) -> bool {
        self.keeps_upper
    }

    /// Where the tiles beside the diagonal begin.
    #[inline(always)]
    pub(super) fn boundary(&self) -> usize {
        self.boundary
    }

    /// Where the tile of a group and itself begins.
    #[inline(always)]
    pub(super) fn own(&self, group: usize) -> usize {
        self.lengths[0] * group
    }

    /// Where a tile beside the diagonal begins.
    #[inline(always)]
    pub(super) fn other(&self, tile: usize) -> usize {
        self.boundary + self.lengths[1] * tile
    }

    /// Where the block is added to that begins at an entry of a tile: see [`Values::block`](super::values::Values::block).
    pub(super) fn target(&self, place: usize, row: usize, column: usize) -> usize {
        if self.is_half(place) { place } else { self.entry(place, row, column) }
    }

    /// Where an entry of the tile stands that begins at a place; in one half, perhaps with its mirror image.
    #[inline]
    pub fn entry(&self, place: usize, row: usize, column: usize) -> usize {
        match self.is_half(place) {
            true => place + upper_entry(self.width, row.min(column), row.max(column)),
            false => place + self.width * column + row,
        }
    }

    /// Whether one half is kept of the tile at a place.
    #[inline(always)]
    fn is_half(&self, place: usize) -> bool {
        self.keeps_upper && place < self.boundary
    }

    /// The tiles of a list of values.
    pub(super) fn tiles<'a, const W: usize>(&self, values: &'a [f64]) -> Tiles<'a, W> {
        let (own, beside) = values.split_at(self.boundary);
        let own = if self.keeps_upper { Own::Halves(own) } else { Own::Whole(as_tiles(own)) };
        Tiles { own, beside: as_tiles(beside) }
    }
}

/// The numbers of the upper half of a symmetric tile.
pub const fn upper_length(width: usize) -> usize {
    width * (width + 1) / 2
}

/// Where an entry on or above the diagonal stands in it.
#[inline(always)]
pub const fn upper_entry(width: usize, row: usize, column: usize) -> usize {
    upper_start(width, row) + column
}

/// Where its rows would begin if they were complete: they overlap.
#[inline(always)]
pub const fn upper_start(width: usize, row: usize) -> usize {
    row * (width - 1) - row * row.saturating_sub(1) / 2
}

/// The values of a tangent as tiles.
#[derive(Clone, Copy)]
pub struct Tiles<'a, const W: usize> {
    /// Those on the diagonal, one a group
    pub own: Own<'a, W>,
    /// Those beside it, in the order of the pattern
    pub beside: &'a [Tile<W>],
}

/// The tiles on the diagonal of a tangent.
#[derive(Clone, Copy)]
pub enum Own<'a, const W: usize> {
    /// As they are
    Whole(&'a [Tile<W>]),
    /// The upper half of each, row by row
    Halves(&'a [f64]),
}

impl<'a, const W: usize> Own<'a, W> {
    /// Does something with the tile of a group.
    #[inline(always)]
    pub fn with<T>(&self, group: usize, work: impl FnOnce(&Tile<W>) -> T) -> T {
        match self {
            Self::Whole(tiles) => work(&tiles[group]),
            Self::Halves(numbers) => {
                let (numbers, mut tile) = (half::<W>(numbers, group), [[0.0; W]; W]);
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

    /// Copies the upper half of the tile of a group, which is symmetric.
    #[inline(always)]
    pub fn copy_upper(&self, group: usize, upper: &mut [f64]) {
        match self {
            Self::Halves(numbers) => upper.copy_from_slice(half::<W>(numbers, group)),
            Self::Whole(tiles) => {
                for r in 0..W {
                    let row = &tiles[group][r][r..];
                    upper[upper_entry(W, r, r)..][..W - r].copy_from_slice(row);
                }
            }
        }
    }
}

/// The numbers of one half among many.
#[inline(always)]
fn half<const W: usize>(numbers: &[f64], group: usize) -> &[f64] {
    &numbers[upper_length(W) * group..][..upper_length(W)]
}

/// Values as tiles.
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
