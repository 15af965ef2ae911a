//! beamsim simulates slender parts that bend, twist and spin far: a deck in TOML, nodal histories in CSV.
//!
//! The mechanics stand in the package `beamsim-core`; this one reads decks, writes results and has the command line.

// Whoever adds a variant to an enum is shown by the compiler where it matters.
#![warn(clippy::wildcard_enum_match_arm)]

pub mod deck;

pub mod scene;

pub mod import;

pub mod output;

pub mod study;

pub mod cli;
