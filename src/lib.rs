//! beamsim simulates slender parts that bend, twist and spin far.

pub mod cli;
pub mod deck;
pub mod drive;
pub mod effect;
pub mod integrate;
pub mod kernel;
pub mod model;
pub mod output;
pub mod probe;
pub mod real;
pub mod rotation;
pub mod scene;
pub mod solve;
pub mod study;
pub mod system;
pub mod tensor;
pub mod threads;
pub mod warning;
