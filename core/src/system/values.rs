//! Mutable values of a tangent or of a slice of it, to which blocks are added in any storage.

use super::storage::{NOT_KEPT, Storage, upper_entry};

/// Mutable values of a slice of the tangent.
pub struct TileValues<'a> {
    storage: &'a Storage,
    own: &'a mut [f64],
    beside: &'a mut [f64],
    /// Positions in the complete list of the first value of `own` and of `beside`
    first: [usize; 2],
}

/// Mutable tile, or block of two slots in a tile.
pub enum BlockMut<'a> {
    /// Values of a complete tile, from the first entry of the block on
    Whole(&'a mut [f64]),
    /// Upper triangle of a tile, row by row, and the tile row and column of the first entry of the
    /// block
    Upper(&'a mut [f64], [usize; 2]),
    /// The tile is not stored, since its transpose is.
    Nowhere,
}

impl<'a> TileValues<'a> {
    /// Values of all tiles.
    pub(super) fn all(storage: &'a Storage, values: &'a mut [f64]) -> Self {
        let (own, beside) = values.split_at_mut(storage.boundary());
        Self { storage, own, beside, first: [0, storage.boundary()] }
    }

    /// Values of some diagonal and off-diagonal tiles, which begin at the positions `first` of the
    /// complete list.
    pub(super) fn part(storage: &'a Storage, [own, beside]: [&'a mut [f64]; 2], first: [usize; 2]) -> Self {
        Self { storage, own, beside, first }
    }

    /// Borrows the values again for a shorter time.
    #[inline]
    pub(super) fn reborrow(&mut self) -> TileValues<'_> {
        TileValues { storage: self.storage, own: self.own, beside: self.beside, first: self.first }
    }

    /// Sets all values to zero.
    pub(super) fn clear(&mut self) {
        self.own.fill(0.0);
        self.beside.fill(0.0);
    }

    /// Block at a position: that of its first entry, or in an upper triangle that of the tile, for
    /// which `corner` gives tile row and column of the first entry.
    #[inline(always)]
    pub(super) fn block(&mut self, place: u32, corner: impl FnOnce() -> [usize; 2]) -> BlockMut<'_> {
        let at = place as usize;
        if place == NOT_KEPT {
            BlockMut::Nowhere
        } else if at >= self.storage.boundary() {
            BlockMut::Whole(&mut self.beside[at - self.first[1]..])
        } else if self.storage.keeps_upper() {
            BlockMut::Upper(&mut self.own[at - self.first[0]..], corner())
        } else {
            BlockMut::Whole(&mut self.own[at - self.first[0]..])
        }
    }

    /// Tile at a position.
    #[inline(always)]
    pub(super) fn tile(&mut self, place: u32) -> BlockMut<'_> {
        self.block(place, || [0, 0])
    }
}

impl<'a> BlockMut<'a> {
    /// Block of a tile of the given width that begins at this row and column.
    #[inline(always)]
    pub fn within(self, width: usize, [row, column]: [usize; 2]) -> Self {
        match self {
            Self::Whole(values) => Self::Whole(&mut values[width * column + row..]),
            Self::Upper(values, _) => Self::Upper(values, [row, column]),
            Self::Nowhere => Self::Nowhere,
        }
    }

    /// Adds to an entry of the block, in a tile of the given width. In an upper triangle entries
    /// below the diagonal are skipped.
    #[inline(always)]
    pub fn add(&mut self, width: usize, row: usize, column: usize, value: f64) {
        match self {
            Self::Whole(values) => {
                debug_assert!(row < width && column < width, "another tile");
                values[width * column + row] += value;
            }
            Self::Upper(values, [first_row, first_column]) => {
                let row = *first_row + row;
                let column = *first_column + column;
                if row <= column {
                    values[upper_entry(width, row, column)] += value;
                }
            }
            Self::Nowhere => {}
        }
    }

    /// Adds a value to the first D diagonal entries of the block, in a tile of width W.
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

    /// Adds 3 x 3 entries by row and column, in a tile of width W.
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

    /// Adds all entries of a tile of width W, numbered by columns.
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
    use super::super::storage::DiagonalTiles;
    use super::*;

    #[test]
    fn what_is_added_to_halves_is_found_in_both() {
        let storage = Storage::new(3, 2, true);
        let mut values = vec![0.0; storage.off_diagonal_tile(1)];
        let mut add = |place: usize| {
            let mut all = TileValues::all(&storage, &mut values);
            all.tile(place as u32).add_tile::<3>(|k| [1.0, 2.0, 3.0, 2.0, 4.0, 5.0, 3.0, 5.0, 6.0][k]);
            let mut tile = all.tile(place as u32);
            (0..3).for_each(|c| (0..3).for_each(|r| tile.add(3, r, c, f64::from(u8::from(r != c)))));
            tile.within(3, [1, 1]).add_along_diagonal::<3, 2>(10.0);
            all.tile(place as u32).add_block::<3>(|r, c| f64::from(u8::from(r + c == 0)));
        };
        add(storage.diagonal_tile(1));
        add(storage.off_diagonal_tile(0));
        let expected = [[2.0, 3.0, 4.0], [3.0, 14.0, 6.0], [4.0, 6.0, 16.0]];
        for place in [storage.diagonal_tile(1), storage.off_diagonal_tile(0)] {
            let entry = |r: usize, c: usize| values[storage.entry(place, r, c)];
            assert!((0..9).all(|k| entry(k / 3, k % 3) == expected[k / 3][k % 3]));
        }
        let tiles = storage.tiles::<3>(&values);
        assert_eq!(tiles.own.with(1, |tile| *tile), expected);
        assert_eq!((tiles.own.with(0, |tile| *tile), tiles.beside), ([[0.0; 3]; 3], &[expected][..]));
        let mut half = [0.0; 6];
        let mut whole = [0.0; 6];
        tiles.own.copy_upper(1, &mut half);
        DiagonalTiles::Whole(tiles.beside).copy_upper(0, &mut whole);
        assert_eq!((half, half), (whole, [2.0, 3.0, 4.0, 14.0, 6.0, 16.0]));
    }
}
