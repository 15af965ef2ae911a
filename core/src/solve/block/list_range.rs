//! A range of a longer list, indexed by positions in the whole list.

use super::tile::Tile;
use std::ops::{Index, IndexMut, Range};

/// Consecutive items of a longer list, indexed by positions in the whole list.
pub struct ListRange<T> {
    start: usize,
    entries: Vec<T>,
}

impl<T: Clone> ListRange<T> {
    /// An empty range.
    pub fn nothing() -> Self {
        Self { start: 0, entries: Vec::new() }
    }

    /// Copies of `entry` at the given positions. `None` if memory is not available.
    pub fn new(places: Range<usize>, entry: T) -> Option<Self> {
        let mut entries = Vec::new();
        entries.try_reserve_exact(places.len()).ok()?;
        entries.resize(places.len(), entry);
        Some(Self { start: places.start, entries })
    }

    /// Positions of the items.
    #[inline(always)]
    pub fn range(&self) -> Range<usize> {
        self.start..self.start + self.entries.len()
    }

    /// Sets each item to a function of its position.
    #[inline(always)]
    pub fn fill(&mut self, entry: impl Fn(usize) -> T) {
        (self.start..).zip(&mut self.entries).for_each(|(place, own)| *own = entry(place));
    }

    /// Item at a position of this range, or else of `beyond`.
    #[inline(always)]
    pub fn or<'a>(&'a mut self, beyond: &'a mut Self, place: usize) -> &'a mut T {
        match self.entries.get_mut(place - self.start) {
            Some(own) => own,
            None => &mut beyond[place],
        }
    }
}

impl<const W: usize> ListRange<Tile<W>> {
    /// Adds the tiles of another range with equal positions.
    pub fn add_tiles(&mut self, other: &Self) {
        add(self.entries.as_flattened_mut().as_flattened_mut(), other.entries.as_flattened().as_flattened());
    }
}

fn add(sums: &mut [f64], others: &[f64]) {
    sums.iter_mut().zip(others).for_each(|(sum, other)| *sum += other);
}

impl<T> Index<usize> for ListRange<T> {
    type Output = T;

    #[inline(always)]
    fn index(&self, place: usize) -> &T {
        &self.entries[place - self.start]
    }
}

impl<T> IndexMut<usize> for ListRange<T> {
    #[inline(always)]
    fn index_mut(&mut self, place: usize) -> &mut T {
        &mut self.entries[place - self.start]
    }
}
