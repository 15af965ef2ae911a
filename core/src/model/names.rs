//! What nodes are called in messages: put together where somebody asks.

use crate::system::Slot;
use std::sync::Arc;

/// The names of the nodes that slots belong to, those along beams only by how they count.
#[derive(Clone, Debug, Default)]
pub struct Names {
    runs: Vec<Run>,
}

/// Slots up to the next run.
#[derive(Clone, Debug)]
struct Run {
    first: Slot,
    /// Of one node, or of the beam that nodes of two slots each lie on
    name: Arc<str>,
    /// That of the first node on the beam
    number: Option<usize>,
}

impl Names {
    /// The name of what begins at a slot; names are given in the order of slots.
    pub fn give(&mut self, first: Slot, name: &str) {
        self.runs.push(Run { first, name: name.into(), number: None });
    }

    /// The next node on a beam, whose two slots begin here.
    pub fn count(&mut self, first: Slot, beam: &str, number: usize) {
        let goes_on = |run: &Run| {
            let next = run.number.map(|begin| begin + (first - run.first) as usize / 2);
            *run.name == *beam && next == Some(number)
        };
        if !self.runs.last().is_some_and(goes_on) {
            self.runs.push(Run { first, name: beam.into(), number: Some(number) });
        }
    }

    /// The node of a slot: a point, `beam:3`, or a joint.
    pub fn of(&self, slot: Slot) -> String {
        let after = self.runs.partition_point(|run| run.first <= slot);
        let Some(Run { first, name, number }) = self.runs[..after].last() else { return "?".into() };
        match number {
            None => name.to_string(),
            Some(begin) => format!("{name}:{}", begin + (slot - first) as usize / 2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_counted_along_beams() {
        let mut names = Names::default();
        names.give(0, "root");
        (1..4).for_each(|k| names.count(2 * k, "arm", k as usize));
        names.give(8, "tip (joint)");
        names.count(9, "arm", 4);
        names.count(11, "arm", 6);
        names.count(13, "leg", 7);
        let known: Vec<String> = (0..15).map(|slot| names.of(slot)).collect();
        let expected = [
            "root",
            "root",
            "arm:1",
            "arm:1",
            "arm:2",
            "arm:2",
            "arm:3",
            "arm:3",
            "tip (joint)",
            "arm:4",
            "arm:4",
            "arm:6",
            "arm:6",
            "leg:7",
            "leg:7",
        ];
        assert_eq!(known, expected);
        assert_eq!(Names::default().of(3), "?");
    }
}
