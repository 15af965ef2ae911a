//! Sections from shapes: the 6x6 stiffness and mass of a beam section and its stresses, by finite
//! elements over the section.
//!
//! The theory is that of Giavotto et al. 1983 (doi:10.1016/0045-7949(83)90179-7), central
//! solutions only: no initial twist or curvature, no taper, no restrained warping, no loads
//! distributed over the section, linear elastic materials.
//!
//! Axes: 1 is the tangent of the beam, 2 and 3 lie in the section. Strains of the beam are
//! G1 G2 G3 K1 K2 K3, resultants N1 N2 N3 M1 M2 M3, in this order. Stresses and strains of the
//! material have the order 11 22 33 23 13 12, with engineering shear strains.
//!
//! The way through the files: [`geometry`] (what the shape is) makes a [`mesh`] with
//! [`element`]s of oriented [`material`]s; [`saint_venant`] solves on it; [`properties`] derives
//! centres and principal axes, [`stress`] recovers stresses, [`strength`] compares them with those
//! that a material bears; [`closed`] has stresses in closed form, and [`recovery`] those of a section
//! on a beam, whose largest one [`search`] and [`climb`] find and [`unit_peaks`] bound; [`analysis`] chooses the mesh so that
//! its estimated error meets an aim.

pub mod airfoil;
pub mod analysis;
pub mod blocks;
pub mod climb;
pub mod closed;
pub mod divide;
pub mod element;
pub mod error;
pub mod geometry;
pub mod grid;
pub mod material;
pub mod mesh;
pub mod outline;
pub mod properties;
pub mod recovery;
pub mod rings;
pub mod saint_venant;
pub mod search;
pub mod strength;
pub mod stress;
pub mod triangulate;
pub mod unit_peaks;
pub mod walls;

pub use analysis::{Analysis, analyse};
pub use error::SectionError;

/// A matrix of resultants and strains of the beam, or of stresses and strains of the material
pub type Matrix6 = nalgebra::Matrix6<f64>;

/// Six strains or six stresses
pub type Vector6 = nalgebra::Vector6<f64>;

/// Coordinates 2 and 3 of a point of the section
pub type Point = [f64; 2];
