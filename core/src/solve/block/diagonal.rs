//! The tiles on the diagonal of some rows, wherever they stand.

use std::ops::{Index, IndexMut};

/// The tiles on the diagonal of a piece, called by its rows: they stand in a list of their own, row
/// by row, or in the tangent, group by group. `S` is a slice of them.
pub struct Diagonal<'a, S> {
    tiles: S,
    /// The row or the group of the first
    first: usize,
    /// The group of each row, where they stand by groups
    node_blocks: Option<&'a [u32]>,
}

impl<'a, S> Diagonal<'a, S> {
    /// Row by row from the first on.
    pub fn by_rows(tiles: S, first: usize) -> Self {
        Self { tiles, first, node_blocks: None }
    }

    /// Group by group from the first on; `order` tells the group of each row.
    pub fn by_groups(tiles: S, first: usize, order: &'a [u32]) -> Self {
        Self { tiles, first, node_blocks: Some(order) }
    }

    /// Where the tile of a row is; rows of other pieces lie beyond.
    #[inline(always)]
    fn place(&self, row: usize) -> usize {
        self.node_blocks.map_or(row, |order| order[row] as usize).wrapping_sub(self.first)
    }
}

impl<T> Diagonal<'_, &mut [T]> {
    /// The tile of a row, of this piece or of one beyond.
    #[inline(always)]
    pub fn or<'s>(&'s mut self, beyond: &'s mut Diagonal<'_, &mut [T]>, row: usize) -> &'s mut T {
        let place = self.place(row);
        match self.tiles.get_mut(place) {
            Some(own) => own,
            None => &mut beyond[row],
        }
    }
}

impl<T> Index<usize> for Diagonal<'_, &[T]> {
    type Output = T;

    #[inline(always)]
    fn index(&self, row: usize) -> &T {
        &self.tiles[self.place(row)]
    }
}

impl<T> Index<usize> for Diagonal<'_, &mut [T]> {
    type Output = T;

    #[inline(always)]
    fn index(&self, row: usize) -> &T {
        &self.tiles[self.place(row)]
    }
}

impl<T> IndexMut<usize> for Diagonal<'_, &mut [T]> {
    #[inline(always)]
    fn index_mut(&mut self, row: usize) -> &mut T {
        let place = self.place(row);
        &mut self.tiles[place]
    }
}
