//! Reads an input and builds its scene, within this process.

use super::generate::Corpus;
use super::input::{Input, Language, TABLE};
use super::process;
use beamsim::deck::{self, Beam, Deck, Diagnostic, Expression, Imported, Severity, SweepFile, Unreadable};
use beamsim::output::HistoryReader;
use beamsim::{scene, study};
use std::panic::{self, AssertUnwindSafe};
use std::sync::{Mutex, PoisonError};

/// Scenes with more elements than this are not built.
const MOST_ELEMENTS: usize = 5_000;

/// The outcome of an input.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Refused, with a message that has a place
    Refused,
    /// Accepted: a scene with this number of elements, or 0 for an expression or a table
    Accepted(usize),
    /// Not built: too large for a short test
    Large,
    /// A fault of the program
    Fault(String),
}

/// The message and the place of the last panic.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Keeps messages of panics for the verdict in place of printing them.
pub fn keep_panics() {
    panic::set_hook(Box::new(|info| {
        let panic = process::panic_of(&info.to_string()).unwrap_or("panic".into());
        *PANIC.lock().unwrap_or_else(PoisonError::into_inner) = panic;
    }));
}

/// Reads and checks an input.
pub fn inspect(input: &Input, corpus: &Corpus) -> Verdict {
    let looked = panic::catch_unwind(AssertUnwindSafe(|| match input.language {
        Language::Deck => inspect_deck(input, corpus),
        Language::Expression => inspect_expression(&input.text),
        Language::History => inspect_history(&input.text),
    }));
    looked.unwrap_or_else(|_| Verdict::Fault(PANIC.lock().unwrap_or_else(PoisonError::into_inner).clone()))
}

/// The deck with its settings and tables; `Err` holds the verdict where it is refused.
pub fn whole_text(input: &Input, corpus: &Corpus) -> Result<String, Verdict> {
    with_tables(input, corpus).map(|(_, imported)| imported.text)
}

/// The deck with its settings, without and with its tables.
fn with_tables(input: &Input, corpus: &Corpus) -> Result<(String, Imported), Verdict> {
    let text = deck::apply(&input.text, &input.settings).map_err(|message| {
        let named = message.starts_with("--set ") && !message.ends_with(": ");
        if named { Verdict::Refused } else { Verdict::Fault(format!("no name in an error of --set: {message}")) }
    })?;
    let open = |name: &str| match (&input.table, corpus.table(name)) {
        (Some(table), _) if name == TABLE => Ok(table.clone().into()),
        (_, Some(table)) => Ok(table.into()),
        (_, None) => {
            let message = "there is no such file".into();
            Err(Unreadable { message, severity: Severity::File })
        }
    };
    match deck::import(&text, &open) {
        Ok(imported) => Ok((text, imported)),
        Err(found) => Err(refusal(&text, &found)),
    }
}

fn inspect_deck(input: &Input, corpus: &Corpus) -> Verdict {
    let (own, imported) = match with_tables(input, corpus) {
        Ok(whole) => whole,
        Err(verdict) => return verdict,
    };
    let text = &imported.text;
    // Messages are about the text of the user.
    let refused = |found: &[Diagnostic]| refusal(&own, &imported.at_home(&own, found));
    // Every deck is a wrong sweep file, too.
    if let Err(found) = SweepFile::read(text)
        && let Verdict::Fault(fault) = refusal(text, &found)
    {
        return Verdict::Fault(format!("as a sweep file, {fault}"));
    }
    let (deck, found) = match deck::read(text) {
        Ok(read) => read,
        Err(found) => return refused(&found),
    };
    if elements(&deck) > MOST_ELEMENTS {
        return Verdict::Large;
    }
    match scene::from_deck(&deck, found) {
        Ok((scene, warnings)) => match imported.at_home(&own, &warnings).iter().find_map(|found| fault_of(&own, found))
        {
            Some(fault) => Verdict::Fault(fault),
            None => Verdict::Accepted(scene.mesh.element_count),
        },
        Err(found) => refused(&found),
    }
}

/// The number of elements that a deck asks for.
fn elements(deck: &Deck) -> usize {
    let of_beam = |beam: &Beam| match &beam.elements.value[..] {
        [each] => each.count().saturating_mul(beam.pieces()),
        several => several.iter().fold(0, |sum: usize, division| sum.saturating_add(division.count())),
    };
    deck.beams.iter().map(of_beam).fold(0, usize::saturating_add)
}

fn refusal(text: &str, found: &[Diagnostic]) -> Verdict {
    if found.iter().all(Diagnostic::is_warning) {
        return Verdict::Fault("refused without an error".into());
    }
    match found.iter().find_map(|diagnostic| fault_of(text, diagnostic)) {
        Some(fault) => Verdict::Fault(fault),
        None => Verdict::Refused,
    }
}

/// A fault of a diagnostic: it has no text, its place is outside of the deck, or it has neither a
/// place nor a name.
fn fault_of(text: &str, diagnostic: &Diagnostic) -> Option<String> {
    let message = &diagnostic.message;
    let rendered = diagnostic.render("deck.toml", text, false);
    if message.trim().is_empty() || rendered.trim().is_empty() {
        return Some("no message".into());
    }
    match &diagnostic.span {
        Some(span) if span.start > text.len() || span.end < span.start => {
            Some(format!("no such place in the deck: {span:?} of {} bytes: {message}", text.len()))
        }
        // The count of messages that are not shown is about no place.
        None if message.contains("more messages are not shown") => None,
        None if !message.contains(['`', '[', '"']) => Some(format!("neither place nor name: {message}")),
        Some(_) | None => None,
    }
}

fn inspect_expression(text: &str) -> Verdict {
    let refused_at = |offset: usize, message: &str| {
        if offset <= text.len() && !message.trim().is_empty() {
            return Verdict::Refused;
        }
        Verdict::Fault(format!("no such place in the expression: byte {offset} of {}: {message}", text.len()))
    };
    let expression = match Expression::parse(text) {
        Ok(expression) => expression,
        Err(error) => return refused_at(error.offset, &error.message),
    };
    for time in [0.0, 1.0, -3.5, 1e308] {
        let lookup = &mut |name: &str| (name == "t" || name == "L").then_some([time, 1.0, 0.0]);
        if let Err(error) = expression.evaluate(lookup) {
            return refused_at(error.offset, &error.message);
        }
    }
    Verdict::Accepted(0)
}

/// Reads a history, and compares it with itself.
fn inspect_history(text: &str) -> Verdict {
    let path = std::env::temp_dir().join(format!("beamsim-fuzz-{}.csv", std::process::id()));
    let read = std::fs::write(&path, text).map(|()| HistoryReader::read(&path));
    let _ = std::fs::remove_file(&path);
    match read {
        Err(error) => Verdict::Fault(format!("no temporary file: {error}")),
        Ok(Err(error)) if error.to_string().contains(".csv: ") => Verdict::Refused,
        Ok(Err(error)) => Verdict::Fault(format!("no name of the file: {error}")),
        Ok(Ok(history)) => match study::compare(&history, &history, 1e-9, 1e-12) {
            Ok(compared) if compared.columns.iter().any(|column| column.ratio > 0.0) => {
                Verdict::Fault("a history differs from itself".into())
            }
            Ok(_) => Verdict::Accepted(0),
            Err(_) => Verdict::Refused,
        },
    }
}
