//! From the path of a deck to a scene, with every message on the way.

use super::{Status, say};
use crate::deck::{self, Deck, Diagnostic, ExpectBody, Severity, SweepFile};
use crate::scene::{self, Scene};
use beamsim_core::failure::FailureKind;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Largest deck that is read, in bytes.
const LARGEST_DECK: u64 = 64 << 20;

/// Why there is no scene.
pub struct Refusal {
    /// The exit status that belongs to it
    pub status: Status,
    /// The name of the failure
    pub name: &'static str,
    /// The last line
    pub message: String,
    /// What is wrong, with the lines of the deck
    pub details: String,
    /// Failures that the deck itself expects
    pub expected: Vec<String>,
}

impl Refusal {
    /// A file that could not be read or written.
    pub fn io(error: std::io::Error) -> Self {
        Self::of(FailureKind::Io, error.to_string())
    }

    /// A wrong command line.
    pub fn usage(message: String) -> Self {
        Self::with_status(Status::Wrong, "usage", message)
    }

    /// A failure of a kind that runs have, too, with its last line.
    pub fn of(kind: FailureKind, message: String) -> Self {
        Self::with_status(Status::of(kind), kind.name(), message)
    }

    /// A failure with its exit status and its last line.
    pub fn with_status(status: Status, name: &'static str, message: String) -> Self {
        Self { status, name, message, details: String::new(), expected: Vec::new() }
    }
}

/// A deck that was read.
pub struct Loaded {
    /// Its text, with settings
    pub text: String,
    /// Its words
    pub deck: Deck,
    /// The scene
    pub scene: Scene,
}

/// Reads a deck and builds its scene; warnings are shown, errors returned, all at once.
pub fn deck(path: &Path, settings: &[String]) -> Result<Loaded, Refusal> {
    again(path, &text(path)?, settings)
}

/// The same for a text that was read from there before.
pub fn again(path: &Path, own: &str, settings: &[String]) -> Result<Loaded, Refusal> {
    let text = deck::apply(own, settings).map_err(|why| Refusal::of(FailureKind::Deck, why))?;
    // Settings may have moved lines.
    let changed = if settings.is_empty() { "" } else { " (as changed by --set)" };
    let label = format!("{}{changed}", path.display());
    let refuse = |text: &str, found: &[Diagnostic], expected: Vec<String>| {
        if SweepFile::is_one(text) {
            return a_sweep(path);
        }
        let errors: Vec<_> = found.iter().filter(|d| !d.is_warning()).collect();
        let is_limit = errors.iter().all(|d| d.severity == Severity::Limit);
        let kind = if is_limit { FailureKind::Limit } else { FailureKind::Deck };
        let count = if errors.len() == 1 { "1 error".to_string() } else { format!("{} errors", errors.len()) };
        Refusal {
            details: render(&label, text, found),
            expected,
            ..Refusal::of(kind, format!("{count} in {}", path.display()))
        }
    };
    let text = deck::import(&text, &|name| beside(path, name)).map_err(|found| refuse(&text, &found, Vec::new()))?;
    let (deck, found) = deck::read(&text).map_err(|found| refuse(&text, &found, Vec::new()))?;
    let built = scene::from_deck(&deck, found);
    let (scene, warnings) = built.map_err(|found| refuse(&text, &found, expected_failures(&deck)))?;
    if !warnings.is_empty() && say::denies_warnings() {
        let count = warnings.len();
        return Err(Refusal {
            details: render(&label, &text, &warnings),
            ..Refusal::of(
                FailureKind::Deck,
                format!("{count} warning(s) in {}, which --deny-warnings takes for errors", path.display()),
            )
        });
    }
    let new: Vec<Diagnostic> = warnings.into_iter().filter(|warning| say::is_new(path, &warning.message)).collect();
    if !new.is_empty() {
        say::note(&render(&label, &text, &new));
    }
    Ok(Loaded { text, deck, scene })
}

/// What a sweep is told where a deck belongs.
fn a_sweep(path: &Path) -> Refusal {
    let name = path.display();
    Refusal::of(FailureKind::Deck, format!("{name} is a sweep and no deck: try `beamsim sweep {name}`"))
}

/// The text of a table that a deck names, seen from the deck's folder.
fn beside(deck: &Path, name: &str) -> Result<String, String> {
    let folder = deck.parent().unwrap_or(Path::new(""));
    text(&folder.join(name)).map_err(|refusal| refusal.message)
}

/// The text of a file.
pub fn text(path: &Path) -> Result<String, Refusal> {
    let refuse = |why: String| Refusal::of(FailureKind::Io, format!("{}: {why}", path.display()));
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|e| refuse(e.to_string()))?;
    file.take(LARGEST_DECK + 1).read_to_end(&mut bytes).map_err(|e| refuse(e.to_string()))?;
    if bytes.len() as u64 > LARGEST_DECK {
        let message = format!("{}: more than the largest supported {LARGEST_DECK} bytes", path.display());
        return Err(Refusal::of(FailureKind::Limit, message));
    }
    String::from_utf8(bytes).map_err(|e| {
        let message = format!("{}: not UTF-8 text at byte {}", path.display(), e.utf8_error().valid_up_to());
        Refusal::of(FailureKind::Deck, message)
    })
}

/// A deck may expect to be wrong.
fn expected_failures(deck: &Deck) -> Vec<String> {
    let name = |expect: &deck::Expect| match &expect.body {
        ExpectBody::Fails(name) => Some(name.value.clone()),
        ExpectBody::Column { .. } | ExpectBody::Warns(_) | ExpectBody::Quiet => None,
    };
    deck.expects.iter().filter_map(name).collect()
}

/// Messages as the user sees them; of warnings that differ in names and numbers only the first is shown, with the lines of the others.
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
            [line] => format!("the same warning holds of line {line}\n"),
            lines => format!("the same warning holds of lines {}\n", lines.join(", ")),
        };
        format!("{}\n{others}", diagnostic.render(path, text, say::styled()))
    };
    shown.iter().map(one).collect::<Vec<_>>().join("\n")
}

/// A message without names and numbers.
fn bare(message: &str) -> String {
    let words = message.split('`').step_by(2).collect::<String>();
    words.chars().filter(|c| !c.is_ascii_digit() && !['.', '-'].contains(c)).collect()
}

/// The name of a deck: its file without the extension.
pub fn name(path: &Path) -> String {
    let stem = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    // Names become folders, never paths that lead elsewhere.
    if stem.chars().all(|c| c == '.') { "deck".into() } else { stem }
}
