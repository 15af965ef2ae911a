//! The tests of the whole, in one binary.

mod assembled;
mod bad_decks;
mod coefficients;
mod command;
mod convergence;
mod corners;
mod counters;
mod decks;
mod dual;
mod effects;
mod failures;
mod invariance;
mod joints;
mod layers;
mod mechanics;
mod mechanisms;
mod planar;
mod random;
mod relative;
mod rotations;
mod scenes;
mod schemes;
mod solvers;
mod statics;
mod tangents;
mod turned;
