//! Beams of input files of Abaqus and CalculiX.

use std::collections::{BTreeMap, BTreeSet};

/// A beam element.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamElement {
    /// Its nodes from start to end: two or three
    pub(crate) nodes: Vec<u64>,
    /// True if it stays in the plane of x and y
    pub(super) is_planar: bool,
    /// Line in the file, from 1
    pub(super) line: usize,
}

/// Directions (0 to 5) in which a node is held.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Held {
    /// From 0 to 5
    pub(super) directions: BTreeSet<usize>,
    /// Last line in the file, from 1
    pub(super) line: usize,
}

/// Force and moment at a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeLoad {
    /// Three components of force, three of moment
    pub(super) vector: [f64; 6],
    /// Last line in the file, from 1
    pub(super) line: usize,
}

/// The shape of a section, in its axes n1 and n2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// Radius
    Circle(f64),
    /// Widths along n1 and n2
    Ellipse([f64; 2]),
    /// Outer radius and thickness
    Pipe([f64; 2]),
    /// Widths along n1 and n2
    Rectangle([f64; 2]),
    /// Widths along n1 and n2, thickness of walls along n2 and along n1
    Box([f64; 4]),
    /// Height of the origin, height, widths of the flanges at the bottom and the top, their
    /// thicknesses, thickness of the web
    I([f64; 7]),
}

/// `*BEAM SECTION`
#[derive(Clone, Debug, PartialEq)]
pub struct BeamSection {
    /// Name of its set of elements, in capitals
    pub(super) set: String,
    /// Name of its material, in capitals
    pub(super) material: String,
    /// Shape
    pub(super) profile: Profile,
    /// Direction of n1
    pub(super) n1: [f64; 3],
    /// Line in the file, from 1
    pub(super) line: usize,
}

/// An isotropic material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Elastic {
    /// Young's modulus and Poisson's ratio
    pub(super) elastic: Option<[f64; 2]>,
    /// Density
    pub(super) density: Option<f64>,
}

/// The first analysis of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Analysis {
    /// Of equilibrium, with large rotations or without
    Static {
        /// NLGEOM
        large: bool,
    },
    /// Of so many modes
    Modes(usize),
    /// Over time: end and step
    Dynamic([f64; 2]),
}

/// The beams of a file, with supports and loads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Name of the file
    pub(super) file: String,
    /// First line of `*HEADING`
    pub(super) title: String,
    /// Places of nodes
    pub(super) nodes: BTreeMap<u64, [f64; 3]>,
    /// Elements of beams
    pub(super) elements: BTreeMap<u64, BeamElement>,
    /// Sets of elements
    pub(super) element_sets: BTreeMap<String, BTreeSet<u64>>,
    /// Sets of nodes
    pub(super) node_sets: BTreeMap<String, BTreeSet<u64>>,
    /// Materials
    pub(super) materials: BTreeMap<String, Elastic>,
    /// Sections
    pub(super) sections: Vec<BeamSection>,
    /// Supports of nodes
    pub(super) held: BTreeMap<u64, Held>,
    /// Forces and moments at nodes
    pub(super) loads: BTreeMap<u64, NodeLoad>,
    /// Forces per length on elements
    pub(super) line_loads: BTreeMap<u64, [f64; 3]>,
    /// Acceleration of gravity
    pub(super) gravity: Option<[f64; 3]>,
    /// The first analysis
    pub(super) analysis: Option<Analysis>,
    /// Messages about parts of the file that are left out
    pub(super) notes: Vec<String>,
}
