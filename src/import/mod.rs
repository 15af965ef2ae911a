//! Decks from files of other programs.

mod abaqus;
mod abaqus_deck;
mod abaqus_model;
mod beamdyn;
mod beamdyn_deck;
mod deck_text;
mod keywords;
mod lines;
mod parameters;

pub use abaqus::read_abaqus;
pub use abaqus_deck::abaqus_deck;
pub use abaqus_model::Model;
pub use beamdyn::{Blade, Driver, read_blade, read_driver};
pub use beamdyn_deck::beamdyn_deck;
pub use deck_text::Imported;
pub use lines::ImportError;
