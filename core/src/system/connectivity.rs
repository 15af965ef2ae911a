//! Connectivity: the slots that each instance of an effect couples.

use super::range_list::RangeList;
use super::state::Slot;

/// The slots that each instance of an effect couples, one list per element, spring or joint.
#[derive(Clone, Debug, Default)]
pub struct Connectivity {
    slots: Vec<Slot>,
    instances: RangeList,
    pub(super) divisible: bool,
}

impl Connectivity {
    /// Connectivity of an effect that adds only the [instances its assembler asks
    /// for](super::Assembler::instances), so that the regions of a large scene can be evaluated in
    /// parallel.
    pub fn divisible() -> Self {
        Self { divisible: true, ..Self::default() }
    }

    /// Adds an instance that couples `slots`, in the order of its element blocks.
    pub fn push(&mut self, slots: impl IntoIterator<Item = Slot>) {
        let before = self.slots.len();
        self.slots.extend(slots);
        self.instances.push(self.slots.len() - before);
    }

    pub(super) fn shrink(&mut self) {
        self.slots.shrink_to_fit();
        self.instances.shrink_to_fit();
    }

    /// Number of instances.
    pub fn len(&self) -> usize {
        self.instances.len()
    }

    /// True without instances.
    pub fn is_empty(&self) -> bool {
        self.instances.is_empty()
    }

    /// Slots of instance `k`.
    #[inline]
    pub fn get(&self, k: usize) -> &[Slot] {
        &self.slots[self.instances.get(k)]
    }

    /// The slots of each instance, in order.
    pub fn iter(&self) -> impl Iterator<Item = &[Slot]> {
        (0..self.len()).map(|k| self.get(k))
    }
}
