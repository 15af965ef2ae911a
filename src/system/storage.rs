//! How the values of a tangent stand in one list: first the tiles on the diagonal, one a group, then those beside it.

use super::pattern::Tile;
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
    halves: bool,
    /// The numbers of a tile on the diagonal, and of one beside it
    lengths: [usize; 2],
    /// Where the tiles beside the diagonal begin
    boundary: usize,
}

impl Storage {
    /// Of tiles so wide; `halves` where those on the diagonal are symmetric.
    pub(super) fn new(width: usize, groups: usize, halves: bool) -> Self {
        let whole = width * width;
        let own = if halves { upper_length(width) } else { whole };
        Self { width, halves, lengths: [own, whole], boundary: own * groups }
    }

    /// The numbers of these tiles on the diagonal.
    pub(super) fn on_diagonal(&self, groups: &Range<usize>) -> Range<usize> {
        self.own(groups.start)..self.own(groups.end)
    }

    /// The numbers of these tiles beside it.
    pub(super) fn beside(&self, tiles: &Range<usize>) -> Range<usize> {
        self.other(tiles.start)..self.other(tiles.end)
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

    /// Where the block is added to that begins at an entry of a tile: see [`Values::block`].
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
        self.halves && place < self.boundary
    }

    /// The tiles of a list of values.
    pub(super) fn tiles<'a, const W: usize>(&self, values: &'a [f64]) -> Tiles<'a, W> {
        let (own, beside) = values.split_at(self.boundary);
        let own = if self.halves { Own::Halves(own) } else { Own::Whole(as_tiles(own)) };
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
fn as_tiles<const W: usize>(values: &[f64]) -> &[Tile<W>] {
    values.as_chunks::<W>().0.as_chunks::<W>().0
}

/// The values of a stretch of the tangent, to add to.
pub struct Values<'a> {
    storage: &'a Storage,
    own: &'a mut [f64],
    beside: &'a mut [f64],
    /// What both begin with
    first: [usize; 2],
}

/// A tile, or a block of two slots in it, to add to.
pub enum BlockMut<'a> {
    /// As it is, from its first entry on
    Whole(&'a mut [f64]),
    /// The upper half of the tile, row by row, and row and column of the tile that the block begins with
    Upper(&'a mut [f64], [usize; 2]),
    /// It is not kept.
    Nowhere,
}

impl<'a> Values<'a> {
    /// Those of all tiles.
    pub(super) fn all(storage: &'a Storage, values: &'a mut [f64]) -> Self {
        let (own, beside) = values.split_at_mut(storage.boundary);
        Self { storage, own, beside, first: [0, storage.boundary] }
    }

    /// Those of some tiles on the diagonal, and beside it, that stand at these places.
    pub(super) fn part(storage: &'a Storage, [own, beside]: [&'a mut [f64]; 2], first: [usize; 2]) -> Self {
        Self { storage, own, beside, first }
    }

    /// Lends them.
    #[inline]
    pub(super) fn reborrow(&mut self) -> Values<'_> {
        Values { storage: self.storage, own: self.own, beside: self.beside, first: self.first }
    }

    /// Sets them to zero.
    pub(super) fn clear(&mut self) {
        self.own.fill(0.0);
        self.beside.fill(0.0);
    }

    /// The block at a place, which is that of its first entry; in a tile of which one half is kept that of the tile, and `corner` tells
    /// row and column of the first entry.
    #[inline(always)]
    pub(super) fn block(&mut self, place: u32, corner: impl FnOnce() -> [usize; 2]) -> BlockMut<'_> {
        let at = place as usize;
        match () {
            () if place == NOT_KEPT => BlockMut::Nowhere,
            () if at >= self.storage.boundary => BlockMut::Whole(&mut self.beside[at - self.first[1]..]),
            () if self.storage.halves => BlockMut::Upper(&mut self.own[at - self.first[0]..], corner()),
            () => BlockMut::Whole(&mut self.own[at - self.first[0]..]),
        }
    }

    /// The tile at a place.
    #[inline(always)]
    pub(super) fn tile(&mut self, place: u32) -> BlockMut<'_> {
        self.block(place, || [0, 0])
    }
}

impl<'a> BlockMut<'a> {
    /// The block of a tile so wide that begins at this row and column.
    #[inline(always)]
    pub fn within(self, width: usize, [row, column]: [usize; 2]) -> Self {
        match self {
            Self::Whole(values) => Self::Whole(&mut values[width * column + row..]),
            Self::Upper(values, _) => Self::Upper(values, [row, column]),
            Self::Nowhere => Self::Nowhere,
        }
    }

    /// Adds to an entry, in a tile so wide; what is below the diagonal of one half goes without saying.
    #[inline(always)]
    pub fn add(&mut self, width: usize, row: usize, column: usize, value: f64) {
        match self {
            Self::Whole(values) => {
                debug_assert!(row < width && column < width, "another tile");
                values[width * column + row] += value;
            }
            Self::Upper(values, [first_row, first_column]) => {
                let (row, column) = (*first_row + row, *first_column + column);
                if row <= column {
                    values[upper_entry(width, row, column)] += value;
                }
            }
            Self::Nowhere => {}
        }
    }

    /// Adds the same to the first D entries of its diagonal, in a tile W wide.
    #[inline(always)]
    pub fn add_along_diagonal<const W: usize, const D: usize>(&mut self, value: f64) {
        match self {
            Self::Whole(values) => {
                values[..(W + 1) * (D - 1) + 1].iter_mut().step_by(W + 1).for_each(|sum| *sum += value);
            }
            Self::Upper(..) => (0..D).for_each(|d| self.add(W, d, d, value)),
            Self::Nowhere => {}
        }
    }

    /// Adds 3 x 3 entries, by row and column, in a tile W wide.
    #[inline(always)]
    pub fn add_block<const W: usize>(&mut self, value: impl Fn(usize, usize) -> f64) {
        match self {
            Self::Whole(values) => {
                let values = &mut values[..2 * W + 3];
                for c in 0..3 {
                    for r in 0..3 {
                        values[W * c + r] += value(r, c);
                    }
                }
            }
            Self::Upper(..) => (0..3).for_each(|c| (0..3).for_each(|r| self.add(W, r, c, value(r, c)))),
            Self::Nowhere => {}
        }
    }

    /// Adds all of a tile W wide, which stands by its columns.
    #[inline(always)]
    pub fn add_tile<const W: usize>(&mut self, value: impl Fn(usize) -> f64) {
        match self {
            Self::Whole(values) => {
                values[..W * W].iter_mut().enumerate().for_each(|(k, sum)| *sum += value(k));
            }
            Self::Upper(values, _) => {
                for r in 0..W {
                    let row = &mut values[upper_entry(W, r, r)..][..W - r];
                    (W * r + r..).zip(row).for_each(|(k, sum)| *sum += value(k));
                }
            }
            Self::Nowhere => {}
        }
    }
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

    #[test]
    fn what_is_added_to_halves_is_found_in_both() {
        let storage = Storage::new(3, 2, true);
        let mut values = vec![0.0; storage.other(1)];
        let mut add = |place: usize| {
            let mut all = Values::all(&storage, &mut values);
            all.tile(place as u32).add_tile::<3>(|k| [1.0, 2.0, 3.0, 2.0, 4.0, 5.0, 3.0, 5.0, 6.0][k]);
            let mut tile = all.tile(place as u32);
            (0..3).for_each(|c| (0..3).for_each(|r| tile.add(3, r, c, f64::from(u8::from(r != c)))));
            tile.within(3, [1, 1]).add_along_diagonal::<3, 2>(10.0);
            all.tile(place as u32).add_block::<3>(|r, c| f64::from(u8::from(r + c == 0)));
        };
        add(storage.own(1));
        add(storage.other(0));
        let expected = [[2.0, 3.0, 4.0], [3.0, 14.0, 6.0], [4.0, 6.0, 16.0]];
        for place in [storage.own(1), storage.other(0)] {
            let entry = |r: usize, c: usize| values[storage.entry(place, r, c)];
            assert!((0..9).all(|k| entry(k / 3, k % 3) == expected[k / 3][k % 3]));
        }
        let tiles = storage.tiles::<3>(&values);
        assert_eq!(tiles.own.with(1, |tile| *tile), expected);
        assert_eq!((tiles.own.with(0, |tile| *tile), tiles.beside), ([[0.0; 3]; 3], &[expected][..]));
        let (mut half, mut whole) = ([0.0; 6], [0.0; 6]);
        tiles.own.copy_upper(1, &mut half);
        Own::Whole(tiles.beside).copy_upper(0, &mut whole);
        assert_eq!((half, half), (whole, [2.0, 3.0, 4.0, 14.0, 6.0, 16.0]));
    }
}
