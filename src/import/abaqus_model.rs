//! Beams of input files of Abaqus and CalculiX.

use std::collections::{BTreeMap, BTreeSet};

/// A beam element.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamElement {
    /// Its nodes from start to end: two or three
    pub nodes: Vec<u64>,
    /// True if it stays in the plane of x and y
    pub is_planar: bool,
    /// Line in the file, from 1
    pub line: usize,
}

/// Directions (0 to 5) in which a node is held.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Held {
    /// From 0 to 5
    pub directions: BTreeSet<usize>,
    /// Last line in the file, from 1
    pub line: usize,
}

/// Force and moment at a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeLoad {
    /// Three components of force, three of moment
    pub vector: [f64; 6],
    /// Last line in the file, from 1
    pub line: usize,
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
    pub set: String,
    /// Name of its material, in capitals
    pub material: String,
    /// Shape
    pub profile: Profile,
    /// Direction of n1
    pub n1: [f64; 3],
    /// Line in the file, from 1
    pub line: usize,
}

/// An isotropic material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Elastic {
    /// Young's modulus and Poisson's ratio
    pub elastic: Option<[f64; 2]>,
    /// Density
    pub density: Option<f64>,
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
    pub file: String,
    /// First line of `*HEADING`
    pub title: String,
    /// Places of nodes
    pub nodes: BTreeMap<u64, [f64; 3]>,
    /// Elements of beams
    pub elements: BTreeMap<u64, BeamElement>,
    /// Sets of elements
    pub element_sets: BTreeMap<String, BTreeSet<u64>>,
    /// Sets of nodes
    pub node_sets: BTreeMap<String, BTreeSet<u64>>,
    /// Materials
    pub materials: BTreeMap<String, Elastic>,
    /// Sections
    pub sections: Vec<BeamSection>,
    /// Supports of nodes
    pub held: BTreeMap<u64, Held>,
    /// Forces and moments at nodes
    pub loads: BTreeMap<u64, NodeLoad>,
    /// Forces per length on elements
    pub line_loads: BTreeMap<u64, [f64; 3]>,
    /// Acceleration of gravity
    pub gravity: Option<[f64; 3]>,
    /// The first analysis
    pub analysis: Option<Analysis>,
    /// Messages about parts of the file that are left out
    pub notes: Vec<String>,
}
