//! Which slots share a tile of the tangent, the displacement and the rotation of a node, and which rows of it are theirs.

use super::state::Slot;

/// Slots in a tile.
pub const SLOTS: usize = 2;

/// The slots of a scene in groups of one or two.
#[derive(Clone, Debug)]
pub struct Groups {
    /// For each slot its group, and its place in it
    places: Vec<(u32, u8)>,
    /// The slots of each group
    members: Vec<[Option<Slot>; SLOTS]>,
    layout: Layout,
}

/// Which rows of a tile belong to the directions of its slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Three for each slot
    Spatial,
    /// Three in all: displacements keep to the first two directions of their slot, rotation vectors to the third.
    Planar,
}

impl Groups {
    /// Of so many slots; `joins` tells which of them share the group of the one before.
    pub fn new(slots: usize, layout: Layout, joins: impl Fn(Slot) -> bool) -> Self {
        let mut out = Self { places: Vec::with_capacity(slots), members: Vec::new(), layout };
        for slot in 0..slots as Slot {
            match out.members.last_mut() {
                Some([Some(_), second @ None]) if joins(slot) => {
                    *second = Some(slot);
                    out.places.push((out.members.len() as u32 - 1, 1));
                }
                _ => {
                    out.places.push((out.members.len() as u32, 0));
                    out.members.push([Some(slot), None]);
                }
            }
        }
        out
    }

    /// The number of groups.
    pub fn count(&self) -> usize {
        self.members.len()
    }

    /// The number of slots.
    pub fn slots(&self) -> usize {
        self.places.len()
    }

    /// The first slot of a group; those of its others and of later groups follow.
    pub fn first_slot(&self, group: usize) -> usize {
        self.members[group].into_iter().flatten().next().map_or(0, |slot| slot as usize)
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
        let (group, place) = self.places[slot as usize];
        (group as usize, place as usize)
    }

    /// The slots of a group.
    pub fn members(&self, group: usize) -> [Option<Slot>; SLOTS] {
        self.members[group]
    }
}
