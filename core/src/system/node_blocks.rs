//! Which slots share a tile of the tangent, the displacement and the rotation of a node, and which rows of it are theirs.

use super::state::Slot;
use std::ops::Range;

/// Slots in a tile.
pub const SLOTS: usize = 2;

/// The slots of a scene in groups of one or two.
#[derive(Clone, Debug)]
pub struct NodeBlocks {
    slots: usize,
    /// Where not all groups are pairs
    uneven: Option<Uneven>,
    layout: Layout,
}

#[derive(Clone, Debug)]
struct Uneven {
    /// For each slot its group, twice, and its place in it
    places: Vec<u32>,
    /// The first slot of each group, and behind the last group the number of all
    starts: Vec<Slot>,
}

impl Uneven {
    fn new(slots: usize, joins: impl Fn(Slot) -> bool) -> Self {
        let (mut places, mut starts) = (Vec::with_capacity(slots), Vec::with_capacity(slots / SLOTS + 1));
        for slot in 0..slots as Slot {
            let joined = starts.last().filter(|&&first| slot - first < SLOTS as Slot && joins(slot)).copied();
            if joined.is_none() {
                starts.push(slot);
            }
            let place = joined.map_or(0, |first| slot - first);
            places.push(SLOTS as u32 * (starts.len() as u32 - 1) + place);
        }
        starts.push(slots as Slot);
        starts.shrink_to_fit();
        Self { places, starts }
    }
}

/// Which rows of a tile belong to the directions of its slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Three for each slot
    Spatial,
    /// Three in all: displacements keep to the first two directions of their slot, rotation vectors to the third.
    Planar,
}

impl NodeBlocks {
    /// Of so many slots; `joins` tells which of them share the group of the one before.
    pub fn new(slots: usize, layout: Layout, joins: impl Fn(Slot) -> bool) -> Self {
        let second = |slot: Slot| !slot.is_multiple_of(SLOTS as Slot);
        let are_pairs =
            slots.is_multiple_of(SLOTS) && (0..slots as Slot).all(|slot| (slot > 0 && joins(slot)) == second(slot));
        Self { slots, uneven: (!are_pairs).then(|| Uneven::new(slots, joins)), layout }
    }

    /// The number of groups.
    pub fn count(&self) -> usize {
        self.uneven.as_ref().map_or(self.slots / SLOTS, |uneven| uneven.starts.len() - 1)
    }

    /// The number of slots.
    pub fn slots(&self) -> usize {
        self.slots
    }

    /// The first slot of a group; those of its others and of later groups follow. Behind the last group the number of all.
    #[inline]
    pub fn first_slot(&self, group: usize) -> usize {
        self.uneven.as_ref().map_or(SLOTS * group, |uneven| uneven.starts[group] as usize)
    }

    /// The rows of a tile.
    pub fn width(&self) -> usize {
        match self.layout {
            Layout::Spatial => 3 * SLOTS,
            Layout::Planar => 3,
        }
    }

    /// The group of a slot, and the row of its first direction in the group's tiles.
    #[inline]
    pub fn row(&self, slot: Slot) -> (usize, usize) {
        let (group, place) = self.of(slot);
        match self.layout {
            Layout::Spatial => (group, 3 * place),
            Layout::Planar => (group, 0),
        }
    }

    /// The group of a slot, and its place in it.
    #[inline]
    pub fn of(&self, slot: Slot) -> (usize, usize) {
        let place = self.uneven.as_ref().map_or(slot, |uneven| uneven.places[slot as usize]) as usize;
        (place / SLOTS, place % SLOTS)
    }

    /// The slots of a group.
    #[inline]
    pub fn members(&self, group: usize) -> Range<Slot> {
        self.first_slot(group) as Slot..self.first_slot(group + 1) as Slot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_that_join_share_a_group() {
        let node_blocks = NodeBlocks::new(6, Layout::Spatial, |slot| [1, 2, 5].contains(&slot));
        let members: Vec<_> = (0..node_blocks.count()).map(|group| node_blocks.members(group)).collect();
        assert_eq!(members, [0..2, 2..3, 3..4, 4..6]);
        assert_eq!(
            [0, 1, 2, 3, 4, 5].map(|slot| node_blocks.of(slot)),
            [(0, 0), (0, 1), (1, 0), (2, 0), (3, 0), (3, 1)]
        );
        assert_eq!((node_blocks.row(1), node_blocks.first_slot(4), node_blocks.slots()), ((0, 3), 6, 6));
        assert_eq!(NodeBlocks::new(0, Layout::Planar, |_| true).count(), 0);
    }

    #[test]
    fn pairs_need_no_list() {
        let node_blocks = NodeBlocks::new(8, Layout::Spatial, |slot| slot % 2 == 1);
        let members: Vec<_> = (0..node_blocks.count()).map(|group| node_blocks.members(group)).collect();
        assert_eq!(members, [0..2, 2..4, 4..6, 6..8]);
        assert_eq!((node_blocks.of(5), node_blocks.row(5), node_blocks.first_slot(4)), ((2, 1), (2, 3), 8));
        assert!(
            node_blocks.uneven.is_none() && NodeBlocks::new(7, Layout::Spatial, |slot| slot % 2 == 1).uneven.is_some()
        );
    }
}
