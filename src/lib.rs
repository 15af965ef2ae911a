//! beamsim simulates slender parts that bend, twist and spin far: a deck in TOML, nodal histories in CSV.
//!
//! The mechanics stand in the package `beamsim-core`; this one reads decks, writes results and has the command line.

pub mod deck;

pub mod scene;

pub mod import;

pub mod output;

pub mod study;

pub mod cli;
