//! `beamsim schema`

use super::console;
use super::status::Status;
use crate::deck::SCHEMA;

/// Prints the JSON Schema of the deck.
pub fn schema() -> Status {
    console::answer(SCHEMA.trim_end());
    Status::Fine
}
