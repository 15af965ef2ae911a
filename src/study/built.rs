//! A changed deck and its scene.

use super::change::{self, Change};
use super::error::StudyError;
use crate::deck::{self, Deck, Diagnostic, Severity};
use crate::scene::{self, Scene};
use beamsim_core::failure::FailureKind;

/// A deck with its scene.
pub struct BuiltDeck {
    /// The deck
    pub(super) deck: Deck,
    /// The scene
    pub(super) scene: Scene,
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
    let Some(error) = found.into_iter().find(|diagnostic| !diagnostic.is_warning()) else {
        return StudyError::no_scene("there is no such scene".into());
    };
    let kind = match error.severity {
        Severity::Limit => FailureKind::Limit,
        Severity::File => FailureKind::Io,
        Severity::Error | Severity::Warning(_) => FailureKind::Deck,
    };
    let message = match error.help {
        Some(help) => format!("{}: {help}", error.message),
        None => error.message,
    };
    StudyError::NoScene { message, kind }
}
