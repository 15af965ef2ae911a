//! Values of decks as TOML.

/// A deck, and what was not imported into it.
pub struct Imported {
    /// The text of the deck
    pub deck: String,
    /// One line for each
    pub notes: Vec<String>,
}

/// A text as it may stand in a comment: on one line, without control characters.
pub fn comment(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).collect()
}

/// A text as a string of TOML.
pub fn quoted(text: &str) -> String {
    format!("\"{}\"", comment(text).replace('\\', "\\\\").replace('"', "\\\""))
}

/// A number that reads back to the last bit.
pub fn number(x: f64) -> String {
    format!("{:?}", x + 0.0)
}

/// A list of numbers, over several lines if it is long.
pub fn list(numbers: &[f64]) -> String {
    let entries: Vec<String> = numbers.iter().map(|&x| number(x)).collect();
    match entries.len() {
        0..=6 => format!("[{}]", entries.join(", ")),
        _ => wrapped(&entries),
    }
}

/// A list over several lines.
pub fn wrapped(entries: &[String]) -> String {
    let lines: Vec<String> = entries.chunks(6).map(|chunk| format!("  {},\n", chunk.join(", "))).collect();
    format!("[\n{}]", lines.concat())
}
