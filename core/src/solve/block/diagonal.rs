//! Diagonal tiles of some rows, stored by row or by node block.

use std::ops::{Index, IndexMut};

/// Diagonal tiles of a piece, indexed by row: stored in a list of their own, by row, or in the
/// tangent, by node block. `S` is a slice of tiles.
pub struct Diagonal<'a, S> {
    tiles: S,
    /// Row or node block of the first tile
    first: usize,
    /// Node block of each row, for tiles stored by node block
    node_blocks: Option<&'a [u32]>,
}

impl<'a, S> Diagonal<'a, S> {
    /// Tiles stored by row from row `first` on.
    pub fn by_rows(tiles: S, first: usize) -> Self {
        Self { tiles, first, node_blocks: None }
    }

    /// Tiles stored by node block from node block `first` on; `order` is the node block of each
    /// row.
    pub fn by_node_blocks(tiles: S, first: usize, order: &'a [u32]) -> Self {
        Self { tiles, first, node_blocks: Some(order) }
    }

    /// Index in `tiles` of the tile of a row; out of bounds for rows of other pieces.
    #[inline(always)]
    fn place(&self, row: usize) -> usize {
        self.node_blocks.map_or(row, |order| order[row] as usize).wrapping_sub(self.first)
    }
}

impl<T> Diagonal<'_, &mut [T]> {
    /// Tile of a row, of this piece or else of `beyond`.
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
