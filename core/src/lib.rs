//! The mechanics of beamsim: slender parts that bend, twist and spin far.
//!
//! The modules stand in the order of their layers: each imports only those above it.

pub mod failure;
pub mod warning;

pub mod threads;

pub mod scalar;
pub mod tensor;

pub mod rotation;

pub mod kernel;

pub mod system;

pub mod effect;

pub mod model;

pub mod integrate;

pub mod solve;

pub mod run;

pub mod probe;
