//! Node blocks: the displacement and the rotation of a node share a block row of the tangent, and a
//! tile per coupled node.

use super::state::Slot;
use std::ops::Range;

/// Largest number of slots in a node block.
pub const SLOTS_PER_BLOCK: usize = 2;

/// The slots of a scene in node blocks of one or two.
#[derive(Clone, Debug)]
pub struct NodeBlocks {
    slots: usize,
    /// Lists by slot; `None` if every node block has two slots
    lists: Option<SlotLists>,
    layout: Layout,
}

#[derive(Clone, Debug)]
struct SlotLists {
    /// For each slot `SLOTS_PER_BLOCK` times its node block plus its position in it
    places: Vec<u32>,
    /// First slot of each node block; the last item is the number of all slots
    starts: Vec<Slot>,
}

impl SlotLists {
    fn new(slots: usize, joins: impl Fn(Slot) -> bool) -> Self {
        let mut places = Vec::with_capacity(slots);
        let mut starts = Vec::with_capacity(slots / SLOTS_PER_BLOCK + 1);
        for slot in 0..slots as Slot {
            let joined = starts.last().filter(|&&first| slot - first < SLOTS_PER_BLOCK as Slot && joins(slot)).copied();
            if joined.is_none() {
                starts.push(slot);
            }
            let place = joined.map_or(0, |first| slot - first);
            places.push(SLOTS_PER_BLOCK as u32 * (starts.len() as u32 - 1) + place);
        }
        starts.push(slots as Slot);
        starts.shrink_to_fit();
        Self { places, starts }
    }
}

/// A row of the tiles of a node block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TileRow {
    pub(super) node_block: usize,
    /// Row in the tile
    pub(super) row: usize,
}

/// Rows of a tile by slot and direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Three rows for each slot
    Spatial,
    /// Three rows for a node: displacements use the first two local directions of their slot,
    /// rotation vectors the third.
    Planar,
}

impl NodeBlocks {
    /// Node blocks of `slots` slots; `joins` is true for slots that share the node block of the
    /// slot before.
    pub fn new(slots: usize, layout: Layout, joins: impl Fn(Slot) -> bool) -> Self {
        let second = |slot: Slot| !slot.is_multiple_of(SLOTS_PER_BLOCK as Slot);
        let are_pairs = slots.is_multiple_of(SLOTS_PER_BLOCK)
            && (0..slots as Slot).all(|slot| (slot > 0 && joins(slot)) == second(slot));
        Self { slots, lists: (!are_pairs).then(|| SlotLists::new(slots, joins)), layout }
    }

    /// Number of node blocks.
    pub fn count(&self) -> usize {
        self.lists.as_ref().map_or(self.slots / SLOTS_PER_BLOCK, |lists| lists.starts.len() - 1)
    }

    /// Number of slots.
    pub fn slots(&self) -> usize {
        self.slots
    }

    /// First slot of a node block; for `count()` the number of all slots. The slots of a node block
    /// are consecutive.
    #[inline]
    pub fn first_slot(&self, node_block: usize) -> usize {
        self.lists.as_ref().map_or(SLOTS_PER_BLOCK * node_block, |lists| lists.starts[node_block] as usize)
    }

    /// Rows of a tile.
    pub fn width(&self) -> usize {
        match self.layout {
            Layout::Spatial => 3 * SLOTS_PER_BLOCK,
            Layout::Planar => 3,
        }
    }

    /// Node block of a slot, and the tile row of its first direction.
    #[inline]
    pub(super) fn row(&self, slot: Slot) -> TileRow {
        let place = self.place(slot);
        let node_block = place / SLOTS_PER_BLOCK;
        let row = match self.layout {
            Layout::Spatial => 3 * (place % SLOTS_PER_BLOCK),
            Layout::Planar => 0,
        };
        TileRow { node_block, row }
    }

    /// Node block of a slot.
    #[inline]
    pub fn of(&self, slot: Slot) -> usize {
        self.place(slot) / SLOTS_PER_BLOCK
    }

    /// `SLOTS_PER_BLOCK` times the node block of a slot plus its position in it.
    #[inline]
    fn place(&self, slot: Slot) -> usize {
        self.lists.as_ref().map_or(slot, |lists| lists.places[slot as usize]) as usize
    }

    /// Slots of a node block.
    #[inline]
    pub fn members(&self, node_block: usize) -> Range<Slot> {
        self.first_slot(node_block) as Slot..self.first_slot(node_block + 1) as Slot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_that_join_share_a_node_block() {
        let node_blocks = NodeBlocks::new(6, Layout::Spatial, |slot| [1, 2, 5].contains(&slot));
        let members: Vec<_> = (0..node_blocks.count()).map(|node_block| node_blocks.members(node_block)).collect();
        assert_eq!(members, [0..2, 2..3, 3..4, 4..6]);
        assert_eq!([0, 1, 2, 3, 4, 5].map(|slot| node_blocks.of(slot)), [0, 0, 1, 2, 3, 3]);
        assert_eq!([0, 1, 2, 3, 4, 5].map(|slot| node_blocks.row(slot).row), [0, 3, 0, 0, 0, 3]);
        assert_eq!((node_blocks.first_slot(4), node_blocks.slots()), (6, 6));
        assert_eq!(NodeBlocks::new(0, Layout::Planar, |_| true).count(), 0);
    }

    #[test]
    fn pairs_need_no_list() {
        let node_blocks = NodeBlocks::new(8, Layout::Spatial, |slot| slot % 2 == 1);
        let members: Vec<_> = (0..node_blocks.count()).map(|node_block| node_blocks.members(node_block)).collect();
        assert_eq!(members, [0..2, 2..4, 4..6, 6..8]);
        assert_eq!((node_blocks.row(5), node_blocks.first_slot(4)), (TileRow { node_block: 2, row: 3 }, 8));
        assert!(
            node_blocks.lists.is_none() && NodeBlocks::new(7, Layout::Spatial, |slot| slot % 2 == 1).lists.is_some()
        );
    }
}
