//! The tests of the whole, in one binary.

mod coefficients;
mod dual;
mod layers;
mod random;
mod rotations;
mod tangents;
