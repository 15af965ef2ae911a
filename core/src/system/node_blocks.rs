//! Node blocks: the displacement and the rotation of a node share a block row of the tangent, and a
//! tile per coupled node.

use super::state::Slot;
use std::ops::Range;

/// Largest number of slots in a node block.
pub const SLOTS: usize = 2;

/// The slots of a scene in node blocks of one or two.
#[derive(Clone, Debug)]
pub struct NodeBlocks {
    slots: usize,
    /// Lists by slot; `None` if every node block has two slots
    uneven: Option<Uneven>,
    layout: Layout,
}

#[derive(Clone, Debug)]
struct Uneven {
    /// For each slot `SLOTS` times its node block plus its position in it
    places: Vec<u32>,
    /// First slot of each node block; the last item is the number of all slots
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
        let second = |slot: Slot| !slot.is_multiple_of(SLOTS as Slot);
        let are_pairs =
            slots.is_multiple_of(SLOTS) && (0..slots as Slot).all(|slot| (slot > 0 && joins(slot)) == second(slot));
        Self { slots, uneven: (!are_pairs).then(|| Uneven::new(slots, joins)), layout }
    }

    /// Number of node blocks.
    pub fn count(&self) -> usize {
        self.uneven.as_ref().map_or(self.slots / SLOTS, |uneven| uneven.starts.len() - 1)
    }

    /// Number of slots.
    pub fn slots(&self) -> usize {
        self.slots
    }

    /// First slot of a node block; for `count()` the number of all slots. The slots of a node block
    /// are consecutive.
    #[inline]
    pub fn first_slot(&self, group: usize) -> usize {
        self.uneven.as_ref().map_or(SLOTS * group, |uneven| uneven.starts[group] as usize)
    }

    /// Rows of a tile.
    pub fn width(&self) -> usize {
        match self.layout {
            Layout::Spatial => 3 * SLOTS,
            Layout::Planar => 3,
        }
    }

    /// Node block of a slot, and the tile row of its first direction.
    #[inline]
    pub fn row(&self, slot: Slot) -> (usize, usize) {
        let (group, place) = self.of(slot);
        match self.layout {
            Layout::Spatial => (group, 3 * place),
            Layout::Planar => (group, 0),
        }
    }

    /// Node block of a slot, and its position in it (0 or 1).
    #[inline]
    pub fn of(&self, slot: Slot) -> (usize, usize) {
        let place = self.uneven.as_ref().map_or(slot, |uneven| uneven.places[slot as usize]) as usize;
        (place / SLOTS, place % SLOTS)
    }

    /// Slots of a node block.
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
