//! Which slots meet in the instances of an effect.

use super::runs::Runs;
use super::state::Slot;

/// The slots that meet in each instance of an effect: one clique an element.
#[derive(Clone, Debug, Default)]
pub struct Connectivity {
    slots: Vec<Slot>,
    instances: Runs,
    pub(super) divisible: bool,
}

impl Connectivity {
    /// Of an effect that adds no others than the [instances that a sink takes](super::Assembler::instances), so that regions of a large scene
    /// can be evaluated at once.
    pub fn divisible() -> Self {
        Self { divisible: true, ..Self::default() }
    }

    /// Adds an instance that couples these slots, in the order of its blocks.
    pub fn push(&mut self, slots: impl IntoIterator<Item = Slot>) {
        let before = self.slots.len();
        self.slots.extend(slots);
        self.instances.push(self.slots.len() - before);
    }

    pub(super) fn shrink(&mut self) {
        self.slots.shrink_to_fit();
        self.instances.shrink_to_fit();
    }

    /// The number of instances.
    pub fn len(&self) -> usize {
        self.instances.len()
    }

    /// Whether there is no instance.
    pub fn is_empty(&self) -> bool {
        self.instances.is_empty()
    }

    /// The slots of an instance.
    #[inline]
    pub fn get(&self, k: usize) -> &[Slot] {
        &self.slots[self.instances.get(k)]
    }

    /// All instances.
    pub fn iter(&self) -> impl Iterator<Item = &[Slot]> {
        (0..self.len()).map(|k| self.get(k))
    }
}
