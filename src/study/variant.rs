//! A deck with settings, read and built.

use crate::deck::{self, Deck, Diagnostic};
use crate::scene::{self, Scene};

/// The text of a deck with settings, what it says, and its scene.
pub struct Variant {
    /// With the settings
    pub text: String,
    /// Its words
    pub deck: Deck,
    /// The scene
    pub scene: Scene,
}

impl Variant {
    /// `Err` with the first thing that is wrong.
    pub fn read(text: &str, settings: &[String]) -> Result<Self, String> {
        let text = deck::apply(text, settings)?;
        let (deck, found) = deck::read(&text).map_err(first)?;
        let (scene, _) = scene::from_deck(&deck, found).map_err(first)?;
        Ok(Self { text, deck, scene })
    }
}

fn first(found: Vec<Diagnostic>) -> String {
    let error = found.into_iter().find(|diagnostic| !diagnostic.is_warning());
    error.map_or("there is no such scene".into(), |error| match error.help {
        Some(help) => format!("{}: {help}", error.message),
        None => error.message,
    })
}
