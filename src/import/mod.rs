//! Decks from files of other programs.

mod abaqus;
mod abaqus_deck;
mod abaqus_model;
mod beamdyn;
mod blade_deck;
mod deck_text;
mod keywords;
mod lines;
mod parameters;
mod windio;
mod yaml;

pub use abaqus::read_abaqus;
pub use abaqus_deck::abaqus_deck;
pub use abaqus_model::Model;
pub use beamdyn::{Blade, Driver, Origin, read_blade, read_driver};
pub use blade_deck::blade_deck;
pub use deck_text::Imported;
pub use lines::ImportError;
pub use windio::read_windio;
