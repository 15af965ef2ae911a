//! From the path of a deck to a scene, with every message on the way.

use super::{Status, say};
use crate::deck::{self, Diagnostic, Severity};
use crate::scene::{self, Scene};
use std::fs;
use std::path::Path;

/// Largest deck that is read, in bytes.
const LARGEST_DECK: u64 = 64 << 20;

/// Reads a deck and builds its scene; all that is wrong is said at once.
pub fn scene(path: &Path, settings: &[String]) -> Result<Scene, Status> {
    let text = text(path)?;
    let text = deck::apply(&text, settings).map_err(|message| {
        say::error("deck", &message);
        Status::Wrong
    })?;
    match scene::from_text(&text) {
        Ok((scene, warnings)) => {
            show(path, &text, &warnings);
            Ok(scene)
        }
        Err(diagnostics) => {
            show(path, &text, &diagnostics);
            let errors: Vec<_> = diagnostics.iter().filter(|d| !d.is_warning()).collect();
            let name = if errors.iter().all(|d| d.severity == Severity::Limit) { "limit" } else { "deck" };
            let count = if errors.len() == 1 { "1 error".to_string() } else { format!("{} errors", errors.len()) };
            say::error(name, &format!("{count} in {}", path.display()));
            Err(Status::Wrong)
        }
    }
}

fn text(path: &Path) -> Result<String, Status> {
    let refuse = |why: String| {
        say::error("io", &format!("{}: {why}", path.display()));
        Status::Io
    };
    let size = fs::metadata(path).map_err(|e| refuse(e.to_string()))?.len();
    if size > LARGEST_DECK {
        say::error(
            "limit",
            &format!("{}: {size} bytes are more than the largest supported {LARGEST_DECK}", path.display()),
        );
        return Err(Status::Wrong);
    }
    let bytes = fs::read(path).map_err(|e| refuse(e.to_string()))?;
    String::from_utf8(bytes).map_err(|e| {
        say::error("deck", &format!("{}: not UTF-8 text at byte {}", path.display(), e.utf8_error().valid_up_to()));
        Status::Wrong
    })
}

fn show(path: &Path, text: &str, diagnostics: &[Diagnostic]) {
    let mut sorted: Vec<&Diagnostic> = diagnostics.iter().collect();
    sorted.sort_by_key(|d| d.span.as_ref().map_or(0, |span| span.start));
    for diagnostic in sorted {
        say::note(&format!("{}\n", diagnostic.render(&path.display().to_string(), text, say::styled())));
    }
}

/// The name of a deck: its file without the extension.
pub fn name(path: &Path) -> String {
    path.file_stem().map_or("deck".into(), |stem| stem.to_string_lossy().into_owned())
}
