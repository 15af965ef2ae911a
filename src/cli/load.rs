//! From the path of a deck to a scene, with the messages about it.

use super::console;
use super::error::{CommandError, DeckError, DeckFault};
use crate::deck::{
    self, Deck, Diagnostic, ExpectBody, Imported, ImportedTable, Severity, SweepFile, Unreadable, Words,
};
use crate::output::{DeckSource, OutputError, TableSource};
use crate::scene::{self, Scene};
use beamsim_core::sorting::sort_by_key;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The largest deck that is read, in bytes.
const LARGEST_DECK: u64 = 64 << 20;

/// Most lines and entries of lists in a deck. Reading takes some 100 bytes for each of them.
const MOST_PARTS: usize = 2_000_000;

/// Rows of a table beside a deck that are stored in run.json, at most; of longer tables run.json
/// keeps path and fingerprint.
const MOST_STORED_ROWS: usize = 1000;

/// Most messages about a deck that are shown.
const MOST_MESSAGES: usize = 50;

/// A deck that was read.
pub struct Loaded {
    /// Its text, with the settings of the command line and the rows of imported tables
    pub(super) text: String,
    /// What run.json keeps of the text
    pub(super) source: DeckSource,
    /// The deck as it stands in the text
    pub(super) deck: Deck,
    /// The scene
    pub(super) scene: Scene,
}

/// Reads a deck and builds its scene; warnings are shown, errors returned, all at once.
pub fn deck(path: &Path, settings: &[String]) -> Result<Loaded, CommandError> {
    again(path, &deck_text(path)?, settings)
}

/// Reads the text of a deck that comes from a file, and builds its scene.
pub fn again(path: &Path, own: &str, settings: &[String]) -> Result<Loaded, CommandError> {
    let ReadDeck { own, imported, label, deck, found } = read(path, own, settings)?;
    let built = scene::from_deck(&deck, found);
    let refuse =
        |found: Vec<Diagnostic>| refusal(path, &label, &own, &imported.at_home(&own, &found), expected_failures(&deck));
    let (scene, warnings) = built.map_err(refuse)?;
    show_warnings(path, &label, &own, imported.at_home(&own, &warnings))?;
    let Imported { text, tables } = imported;
    let source = source(path, &own, &text, tables);
    Ok(Loaded { text, source, deck, scene })
}

/// Shows the warnings that are new; they are an error with `--deny-warnings`.
fn show_warnings(path: &Path, label: &str, text: &str, warnings: Vec<Diagnostic>) -> Result<(), CommandError> {
    if !warnings.is_empty() && console::denies_warnings() {
        let count = warnings.len();
        let path = path.display();
        return Err(CommandError::Deck(DeckError {
            message: format!("{count} warning(s) in {path}, which --deny-warnings treats as errors"),
            details: render(label, text, &warnings),
            ..DeckError::default()
        }));
    }
    let new: Vec<Diagnostic> = warnings.into_iter().filter(|warning| console::is_new(path, &warning.message)).collect();
    if !new.is_empty() {
        console::diagnostics(&render(label, text, &new));
    }
    Ok(())
}

/// A deck without its scene.
pub struct ReadDeck {
    /// Its text with the settings of the command line
    own: String,
    /// The text with the rows of imported tables
    imported: Imported,
    /// Its name in messages
    label: String,
    /// The deck as it stands in the text
    pub(super) deck: Deck,
    /// Messages about it
    pub(super) found: Vec<Diagnostic>,
}

impl ReadDeck {
    /// Shows warnings about the deck; they are its error with `--deny-warnings`.
    pub fn warn(&self, path: &Path, warnings: Vec<Diagnostic>) -> Result<(), CommandError> {
        show_warnings(path, &self.label, &self.own, self.imported.at_home(&self.own, &warnings))
    }

    /// The error that shows messages about the deck.
    pub fn refuse(&self, path: &Path, found: &[Diagnostic]) -> CommandError {
        refusal(path, &self.label, &self.own, &self.imported.at_home(&self.own, found), Vec::new())
    }
}

/// Reads a deck without building its scene.
pub fn read(path: &Path, own: &str, settings: &[String]) -> Result<ReadDeck, CommandError> {
    let own = deck::apply(own, settings).map_err(CommandError::deck)?;
    // Settings may have moved lines.
    let changed = if settings.is_empty() { "" } else { " (as changed by --set)" };
    let label = format!("{}{changed}", path.display());
    let imported = deck::import(&own, &|name| beside(path, name));
    let imported = imported.map_err(|found| refusal(path, &label, &own, &found, Vec::new()))?;
    let read = deck::read(&imported.text);
    let refuse = |found: Vec<Diagnostic>| refusal(path, &label, &own, &imported.at_home(&own, &found), Vec::new());
    let (deck, found) = read.map_err(refuse)?;
    Ok(ReadDeck { own, imported, label, deck, found })
}

/// The error of a deck with the messages about it.
fn refusal(path: &Path, label: &str, text: &str, found: &[Diagnostic], expected: Vec<String>) -> CommandError {
    if SweepFile::is_one(text) {
        return sweep_as_deck(path);
    }
    let errors: Vec<_> = found.iter().filter(|d| !d.is_warning()).collect();
    CommandError::Deck(DeckError {
        message: count_of_errors(errors.len(), path),
        details: render(label, text, found),
        fault: fault(&errors),
        expected,
    })
}

/// What run.json keeps of a deck: its text with the rows of short tables, and where long ones are.
fn source(path: &Path, own: &str, text: &str, mut tables: Vec<ImportedTable>) -> DeckSource {
    tables.retain(|table| table.rows > MOST_STORED_ROWS);
    let text = if tables.is_empty() {
        text.into()
    } else {
        let imported = deck::import_up_to(MOST_STORED_ROWS, own, &|name| beside(path, name));
        imported.map_or(own.into(), |imported| imported.text)
    };
    let tables = tables.into_iter().map(|table| TableSource { path: absolute_path(path, &table.name), table });
    DeckSource { text, tables: tables.collect() }
}

/// The kind of the errors of a deck, if all are of one kind.
fn fault(errors: &[&Diagnostic]) -> DeckFault {
    let all = |severity: Severity| errors.iter().all(|error| error.severity == severity);
    if all(Severity::Limit) {
        DeckFault::Limit
    } else if all(Severity::File) {
        DeckFault::File
    } else {
        DeckFault::Text
    }
}

/// `2 errors in arm.toml`
pub fn count_of_errors(count: usize, path: &Path) -> String {
    let path = path.display();
    if count == 1 { format!("1 error in {path}") } else { format!("{count} errors in {path}") }
}

/// The error of a sweep.toml where a deck is needed.
fn sweep_as_deck(path: &Path) -> CommandError {
    let name = path.display();
    CommandError::deck(format!("{name} is a sweep file, not a deck: try `beamsim sweep {name}`"))
}

/// The path of a table that a deck names, relative to the folder of the deck.
fn path_beside(deck: &Path, name: &str) -> PathBuf {
    deck.parent().unwrap_or(Path::new("")).join(name)
}

/// The absolute path of a table that a deck names.
fn absolute_path(deck: &Path, name: &str) -> PathBuf {
    let path = path_beside(deck, name);
    std::fs::canonicalize(&path).or_else(|_| std::path::absolute(&path)).unwrap_or(path)
}

/// The content of a file that a deck names.
fn beside(deck: &Path, name: &str) -> Result<Vec<u8>, Unreadable> {
    table(&path_beside(deck, name))
}

/// The content of a file beside a deck. Only plain files are read: a deck from elsewhere must not
/// make the program wait for a device.
pub fn table(path: &Path) -> Result<Vec<u8>, Unreadable> {
    let unreadable = |message: String| Unreadable { message, severity: Severity::File };
    let found = std::fs::metadata(path).map_err(|error| unreadable(OutputError::file(path, error).to_string()))?;
    if !found.is_file() {
        return Err(unreadable(format!("{}: not a plain file", path.display())));
    }
    bytes(path).map_err(|error| {
        let severity = match &error {
            CommandError::Deck(DeckError { fault: DeckFault::Limit, .. }) => Severity::Limit,
            CommandError::Io(_) => Severity::File,
            CommandError::Deck(_)
            | CommandError::Usage(_)
            | CommandError::Locked(_)
            | CommandError::Checkpoint(_)
            | CommandError::Run(_)
            | CommandError::Stopped { .. }
            | CommandError::SearchStopped { .. }
            | CommandError::Missed(_)
            | CommandError::Unexpected(_)
            | CommandError::Sweep(_)
            | CommandError::Warnings(_) => Severity::Error,
        };
        Unreadable { message: error.to_string(), severity }
    })
}

/// The text of a deck or a sweep.toml.
pub fn deck_text(path: &Path) -> Result<String, CommandError> {
    let text = text(path)?;
    check_parts(path, &text)?;
    Ok(text)
}

/// Refuses a deck of very many short lines or entries: reading takes far more memory than its text.
fn check_parts(path: &Path, text: &str) -> Result<(), CommandError> {
    let parts = text.bytes().filter(|byte| matches!(byte, b'\n' | b',' | b'[' | b'{' | b'=')).count();
    if parts <= MOST_PARTS {
        return Ok(());
    }
    let path = path.display();
    let message = format!(
        "{path}: {parts} lines and entries of lists are more than the limit of {MOST_PARTS}: put long tables into CSV files"
    );
    Err(CommandError::limit(message))
}

/// The content of a file.
fn bytes(path: &Path) -> Result<Vec<u8>, CommandError> {
    let io = |error: std::io::Error| OutputError::file(path, error);
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(io)?;
    file.take(LARGEST_DECK + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > LARGEST_DECK {
        let message = format!("{}: more bytes than the limit of {LARGEST_DECK}", path.display());
        return Err(CommandError::limit(message));
    }
    Ok(bytes)
}

/// The text of a file.
pub fn text(path: &Path) -> Result<String, CommandError> {
    String::from_utf8(bytes(path)?).map_err(|e| {
        let message = format!("{}: not UTF-8 text at byte {}", path.display(), e.utf8_error().valid_up_to());
        CommandError::deck(message)
    })
}

/// The failures that a deck expects: it may expect to be wrong.
fn expected_failures(deck: &Deck) -> Vec<String> {
    let name = |expect: &deck::Expect| match &expect.body {
        ExpectBody::Fails(failure) => Some(failure.word().into()),
        ExpectBody::Column { .. } | ExpectBody::Warns(_) | ExpectBody::Quiet => None,
    };
    deck.expects.iter().filter_map(name).collect()
}

/// Messages as the user sees them. Of warnings that differ only in names and numbers the first is
/// shown, with the lines of the others. Of very many messages the first are shown, and the others
/// counted.
pub fn render(path: &str, text: &str, diagnostics: &[Diagnostic]) -> String {
    let mut sorted: Vec<&Diagnostic> = diagnostics.iter().collect();
    sort_by_key(&mut sorted, |d| d.span.as_ref().map_or(0, |span| span.start));
    let mut shown: Vec<Message> = Vec::new();
    let mut hidden = 0;
    let mut lines = LineCounter { text: text.as_bytes(), at: 0, line: 1 };
    for diagnostic in sorted {
        let line = diagnostic.span.as_ref().map(|span| lines.line_at(span.start));
        let same = |message: &Message| {
            let first = message.diagnostic;
            diagnostic.is_warning() && first.is_warning() && bare(&first.message) == bare(&diagnostic.message)
        };
        match (shown.iter().position(same), line) {
            (Some(first), Some(line)) => shown[first].others.push(line),
            _ if shown.len() < MOST_MESSAGES => shown.push(Message { diagnostic, others: Vec::new() }),
            _ => hidden += 1,
        }
    }
    let mut rendered: Vec<String> = shown.iter().map(|message| message.render(path, text)).collect();
    match hidden {
        0 => {}
        1 => rendered.push("and 1 more message".into()),
        _ => rendered.push(format!("and {hidden} more messages")),
    }
    rendered.join("\n")
}

/// A message that is shown.
struct Message<'a> {
    diagnostic: &'a Diagnostic,
    /// Lines to which the same warning applies
    others: Vec<usize>,
}

impl Message<'_> {
    fn render(&self, path: &str, text: &str) -> String {
        let mut lines: Vec<String> = self.others.iter().take(MOST_MESSAGES).map(usize::to_string).collect();
        if self.others.len() > lines.len() {
            lines.push(format!("and {} more", self.others.len() - lines.len()));
        }
        let others = match &lines[..] {
            [] => String::new(),
            [line] => format!("the same warning applies to line {line}\n"),
            lines => format!("the same warning applies to lines {}\n", lines.join(", ")),
        };
        format!("{}\n{others}", self.diagnostic.render(path, text, console::styled()))
    }
}

/// Counts lines from place to place.
struct LineCounter<'a> {
    text: &'a [u8],
    at: usize,
    line: usize,
}

impl LineCounter<'_> {
    /// The line at a byte, from 1. Bytes must not decrease from call to call.
    fn line_at(&mut self, byte: usize) -> usize {
        let end = byte.clamp(self.at, self.text.len().max(self.at));
        self.line += self.text[self.at..end].iter().filter(|byte| **byte == b'\n').count();
        self.at = end;
        self.line
    }
}

/// A message without names and numbers, to compare warnings.
fn bare(message: &str) -> String {
    let words = message.split('`').step_by(2).collect::<String>();
    words.chars().filter(|c| !c.is_ascii_digit() && !['.', '-'].contains(c)).collect()
}

/// The name of a deck: that of its file without `.toml`. Dots within the name belong to it:
/// `arm_0.004.toml` gives `arm_0.004`.
pub fn name(path: &Path) -> String {
    without_extension(path, ".toml")
}

/// The name of a folder, including dots.
pub fn folder_name(folder: &Path) -> String {
    without_extension(folder, "")
}

/// The last part of a path without an extension, which is given with its dot in ASCII letters.
pub fn without_extension(path: &Path, extension: &str) -> String {
    let file = path.file_name().map_or(String::new(), |file| file.to_string_lossy().into_owned());
    let end = file.len().saturating_sub(extension.len());
    let has_extension = file.get(end..).is_some_and(|found| found.eq_ignore_ascii_case(extension));
    let name = if has_extension { &file[..end] } else { &file[..] };
    // Names become folders, never paths that lead elsewhere.
    if !name.chars().all(|c| c == '.') {
        name.into()
    } else if file.chars().all(|c| c == '.') {
        "deck".into()
    } else {
        // A file that is called `.toml`: no other deck has its name.
        file
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_belong_to_names() {
        for (path, expected) in [
            ("decks/arm.toml", "arm"),
            ("ARM.TOML", "ARM"),
            ("arm2_0.004.toml", "arm2_0.004"),
            ("arm2_0.001", "arm2_0.001"),
            (".toml", ".toml"),
            ("odd/.toml", ".toml"),
            ("..", "deck"),
            ("", "deck"),
        ] {
            assert_eq!(name(Path::new(path)), expected, "{path}");
        }
        assert_eq!(folder_name(Path::new("results/arm2_0.004/")), "arm2_0.004");
        assert_eq!(without_extension(Path::new("a.b/stored.2.csv"), ".csv"), "stored.2");
    }
}
