//! From the path of a deck to a scene, with the messages about it.

use super::console;
use super::error::{CommandError, DeckError};
use crate::deck::{self, Deck, Diagnostic, ExpectBody, Severity, SweepFile, Words};
use crate::output::OutputError;
use crate::scene::{self, Scene};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The largest deck that is read, in bytes.
const LARGEST_DECK: u64 = 64 << 20;

/// A deck that was read.
pub struct Loaded {
    /// Its text, with the settings of the command line
    pub text: String,
    /// The deck as it stands in the text
    pub deck: Deck,
    /// The scene
    pub scene: Scene,
}

/// Reads a deck and builds its scene; warnings are shown, errors returned, all at once.
pub fn deck(path: &Path, settings: &[String]) -> Result<Loaded, CommandError> {
    again(path, &text(path)?, settings)
}

/// Reads the text of a deck that comes from a file, and builds its scene.
pub fn again(path: &Path, own: &str, settings: &[String]) -> Result<Loaded, CommandError> {
    let text = deck::apply(own, settings).map_err(CommandError::deck)?;
    // Settings may have moved lines.
    let changed = if settings.is_empty() { "" } else { " (as changed by --set)" };
    let label = format!("{}{changed}", path.display());
    let refuse = |text: &str, found: &[Diagnostic], expected: Vec<String>| {
        if SweepFile::is_one(text) {
            return sweep_as_deck(path);
        }
        let errors: Vec<_> = found.iter().filter(|d| !d.is_warning()).collect();
        CommandError::Deck(DeckError {
            message: count_of_errors(errors.len(), path),
            details: render(&label, text, found),
            is_limit: errors.iter().all(|d| d.severity == Severity::Limit),
            expected,
        })
    };
    let text = deck::import(&text, &|name| beside(path, name)).map_err(|found| refuse(&text, &found, Vec::new()))?;
    let (deck, found) = deck::read(&text).map_err(|found| refuse(&text, &found, Vec::new()))?;
    let built = scene::from_deck(&deck, found);
    let (scene, warnings) = built.map_err(|found| refuse(&text, &found, expected_failures(&deck)))?;
    if !warnings.is_empty() && console::denies_warnings() {
        let (count, path) = (warnings.len(), path.display());
        return Err(CommandError::Deck(DeckError {
            message: format!("{count} warning(s) in {path}, which --deny-warnings treats as errors"),
            details: render(&label, &text, &warnings),
            ..DeckError::default()
        }));
    }
    let new: Vec<Diagnostic> = warnings.into_iter().filter(|warning| console::is_new(path, &warning.message)).collect();
    if !new.is_empty() {
        console::note(&render(&label, &text, &new));
    }
    Ok(Loaded { text, deck, scene })
}

/// `2 errors in arm.toml`
pub fn count_of_errors(count: usize, path: &Path) -> String {
    let path = path.display();
    if count == 1 { format!("1 error in {path}") } else { format!("{count} errors in {path}") }
}

/// The error of a sweep.toml where a deck is needed.
fn sweep_as_deck(path: &Path) -> CommandError {
    let name = path.display();
    CommandError::deck(format!("{name} is a sweep and no deck: try `beamsim sweep {name}`"))
}

/// The text of a table that a deck names by a path relative to the folder of the deck.
fn beside(deck: &Path, name: &str) -> Result<String, String> {
    let folder = deck.parent().unwrap_or(Path::new(""));
    text(&folder.join(name)).map_err(|error| error.to_string())
}

/// The text of a file.
pub fn text(path: &Path) -> Result<String, CommandError> {
    let io = |error: std::io::Error| OutputError::file(path, error);
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(io)?;
    file.take(LARGEST_DECK + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > LARGEST_DECK {
        let message = format!("{}: more than the largest supported {LARGEST_DECK} bytes", path.display());
        return Err(CommandError::limit(message));
    }
    String::from_utf8(bytes).map_err(|e| {
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
/// shown, with the lines of the others.
pub fn render(path: &str, text: &str, diagnostics: &[Diagnostic]) -> String {
    let mut sorted: Vec<&Diagnostic> = diagnostics.iter().collect();
    sorted.sort_by_key(|d| d.span.as_ref().map_or(0, |span| span.start));
    let mut shown: Vec<(&Diagnostic, Vec<usize>)> = Vec::new();
    for diagnostic in sorted {
        let same = |(first, _): &&mut (&Diagnostic, Vec<usize>)| {
            diagnostic.is_warning() && first.is_warning() && bare(&first.message) == bare(&diagnostic.message)
        };
        let line = diagnostic.span.as_ref().map(|span| {
            text.as_bytes()[..span.start.min(text.len())].iter().filter(|byte| **byte == b'\n').count() + 1
        });
        match (shown.iter_mut().find(same), line) {
            (Some((_, others)), Some(line)) => others.push(line),
            _ => shown.push((diagnostic, Vec::new())),
        }
    }
    let one = |(diagnostic, others): &(&Diagnostic, Vec<usize>)| {
        let lines: Vec<String> = others.iter().map(usize::to_string).collect();
        let others = match &lines[..] {
            [] => String::new(),
            [line] => format!("the same warning applies to line {line}\n"),
            lines => format!("the same warning applies to lines {}\n", lines.join(", ")),
        };
        format!("{}\n{others}", diagnostic.render(path, text, console::styled()))
    };
    shown.iter().map(one).collect::<Vec<_>>().join("\n")
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
    if name.chars().all(|c| c == '.') { "deck".into() } else { name.into() }
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
            (".toml", "deck"),
            ("..", "deck"),
            ("", "deck"),
        ] {
            assert_eq!(name(Path::new(path)), expected, "{path}");
        }
        assert_eq!(folder_name(Path::new("results/arm2_0.004/")), "arm2_0.004");
        assert_eq!(without_extension(Path::new("a.b/stored.2.csv"), ".csv"), "stored.2");
    }
}
