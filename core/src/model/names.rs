//! Names of nodes for messages, composed on demand from compact tables.

use crate::system::Slot;
use std::sync::Arc;

/// The names of the nodes of slots. Nodes along beams are stored as numbered runs.
#[derive(Clone, Debug, Default)]
pub struct Names {
    runs: Vec<NameRun>,
}

/// Consecutive slots, up to the first slot of the next run, whose nodes share a name or are
/// numbered along a beam.
#[derive(Clone, Debug)]
struct NameRun {
    /// The first slot
    first: Slot,
    /// The name of one node, or of the beam of numbered nodes, which have two slots each
    name: Arc<str>,
    /// The number of the first node along the beam; `None` for a node with a name of its own
    number: Option<usize>,
}

impl Names {
    /// Gives a name to the node whose slots begin at `first`. Names must be given in the order of
    /// slots.
    pub fn give(&mut self, first: Slot, name: &str) {
        self.runs.push(NameRun { first, name: name.into(), number: None });
    }

    /// Gives number `number` along `beam` to the node whose two slots begin at `first`.
    pub fn count(&mut self, first: Slot, beam: &str, number: usize) {
        let goes_on = |run: &NameRun| {
            let next = run.number.map(|begin| begin + (first - run.first) as usize / 2);
            *run.name == *beam && next == Some(number)
        };
        if !self.runs.last().is_some_and(goes_on) {
            self.runs.push(NameRun { first, name: beam.into(), number: Some(number) });
        }
    }

    /// The name of the node of a slot: a point, `beam:3`, or a joint; `?` before the first name.
    pub fn of(&self, slot: Slot) -> String {
        let after = self.runs.partition_point(|run| run.first <= slot);
        let Some(NameRun { first, name, number }) = self.runs[..after].last() else { return "?".into() };
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
