//! Columns bound to the node, beam point or scene that they are read from.

use super::beam_point::{BeamPoint, StressPlace, StressPoint};
use super::columns::ColumnGroup;
use super::place::Place;
use crate::run::{Snapshot, WatchedColumns};
use crate::system::Node;
use std::sync::Arc;

/// A group of columns of one object, with their names.
#[derive(Clone)]
pub struct Probe {
    /// One name a column
    pub names: Vec<String>,
    /// Row of the table of columns
    pub group: &'static ColumnGroup,
    /// Object and function that the values come from
    pub reading: Reading,
}

/// The object that is read, with the function that reads it.
#[derive(Clone)]
pub enum Reading {
    /// A node, or a place within a beam element
    Place(Place, fn(&Place, &Snapshot, &mut Vec<f64>)),
    /// A node
    Node(Node, fn(Node, &Snapshot, &mut Vec<f64>)),
    /// A point of one beam
    BeamPoint(BeamPoint, fn(&BeamPoint, &Snapshot, &mut Vec<f64>)),
    /// A section of one beam with its stresses
    Stress(StressPlace, fn(&StressPlace, &Snapshot, &mut Vec<f64>)),
    /// A fixed point of such a section
    StressPoint(StressPoint, fn(&StressPoint, &Snapshot, &mut Vec<f64>)),
    /// A contact, by its number
    Contact(usize, fn(usize, &Snapshot, &mut Vec<f64>)),
    /// The whole scene, or the clocks of the run
    Whole(fn(&Snapshot, &mut Vec<f64>)),
}

impl Probe {
    /// Appends the values of the columns.
    pub fn read(&self, at: &Snapshot, out: &mut Vec<f64>) {
        match &self.reading {
            Reading::Place(place, read) => read(place, at, out),
            Reading::Node(node, read) => read(*node, at, out),
            Reading::BeamPoint(point, read) => read(point, at, out),
            Reading::Stress(place, read) => read(place, at, out),
            Reading::StressPoint(point, read) => read(point, at, out),
            Reading::Contact(number, read) => read(*number, at, out),
            Reading::Whole(read) => read(at, out),
        }
    }

    /// The columns that dynamic stages watch, if it has some.
    pub fn watched(&self) -> Option<WatchedColumns> {
        let parts = self.group.parts.iter().scan(0, |end, part| {
            let start = *end;
            *end += part.suffixes.len().max(1);
            Some((part.quantity, [start, *end]))
        });
        let vectors: Vec<_> = parts.filter_map(|(quantity, ends)| Some((quantity.ringing_kind()?, ends))).collect();
        let probe = self.clone();
        let read = Arc::new(move |at: &Snapshot, out: &mut Vec<f64>| probe.read(at, out));
        (!vectors.is_empty()).then(|| WatchedColumns { names: self.names.clone(), vectors, read })
    }

    /// The place whose motion the columns show.
    pub fn place(&self) -> Option<&Place> {
        match &self.reading {
            Reading::Place(place, _) => Some(place),
            Reading::Node(..)
            | Reading::BeamPoint(..)
            | Reading::Stress(..)
            | Reading::StressPoint(..)
            | Reading::Contact(..)
            | Reading::Whole(_) => None,
        }
    }
}
