//! beamsim simulates slender parts that bend, twist and spin far.

pub mod real;
pub mod tensor;
pub mod rotation;
pub mod kernel;
pub mod system;
pub mod effect;
pub mod model;
pub mod integrate;
pub mod solve;
pub mod drive;
pub mod deck;
pub mod probe;
pub mod scene;
pub mod output;
pub mod study;
pub mod cli;
