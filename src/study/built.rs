//! A changed deck and its scene.

use super::change::{self, Change};
use super::error::StudyError;
use crate::deck::{self, Deck, Diagnostic};
use crate::scene::{self, Scene};

/// A deck with its scene.
pub struct BuiltDeck {
    /// The deck
    pub deck: Deck,
    /// The scene
    pub scene: Scene,
}

impl BuiltDeck {
    /// Reads the text of a deck.
    pub fn read(text: &str) -> Result<Self, StudyError> {
        let (deck, found) = deck::read(text).map_err(first)?;
        let (scene, _) = scene::from_deck(&deck, found).map_err(first)?;
        Ok(Self { deck, scene })
    }

    /// Applies changes of a study to a deck that was read before.
    pub fn changed(deck: &Deck, changes: &[Change]) -> Result<Self, StudyError> {
        let deck = change::apply(deck, changes)?;
        let (scene, _) = scene::from_deck(&deck, Vec::new()).map_err(first)?;
        Ok(Self { deck, scene })
    }
}

/// The first error, with its advice.
fn first(found: Vec<Diagnostic>) -> StudyError {
    let error = found.into_iter().find(|diagnostic| !diagnostic.is_warning());
    StudyError::NoScene(error.map_or("there is no such scene".into(), |error| match error.help {
        Some(help) => format!("{}: {help}", error.message),
        None => error.message,
    }))
}
