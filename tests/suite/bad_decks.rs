//! Wrong decks and the messages they get, word for word.
//!
//! `BLESS=1 cargo test --release bad_decks` writes the messages anew; read the difference before it is committed.

use crate::decks::decks;
use beamsim::scene;
use std::fs;

#[test]
fn wrong_decks_get_their_messages() {
    let decks = decks("tests/bad_decks");
    assert!(decks.len() >= 200, "{} wrong decks", decks.len());
    let mut wrong = Vec::new();
    for path in decks {
        let text = fs::read_to_string(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let Err(mut diagnostics) = scene::from_text(&text) else {
            wrong.push(format!("{name} is accepted"));
            continue;
        };
        diagnostics.sort_by_key(|d| d.span.as_ref().map_or(0, |span| span.start));
        let messages: Vec<String> = diagnostics.iter().map(|d| d.render(&name, &text, false)).collect();
        let came = messages.join("\n\n") + "\n";
        let stored = path.with_extension("txt");
        if std::env::var_os("BLESS").is_some() {
            fs::write(&stored, &came).unwrap();
        }
        if fs::read_to_string(&stored).unwrap_or_default() != came {
            wrong.push(format!("{name}:\n{came}"));
        }
    }
    assert!(wrong.is_empty(), "{} differ:\n{}", wrong.len(), wrong.join("\n"));
}

/// Bytes cut out of, or put into, good decks: errors, never panics.
#[test]
fn mangled_decks_never_panic() {
    let pieces = ["\"", "[", "]", "=", "1e999", "nan", "-1", "\n", "{", "x.y", "\u{e9}", "0", "\"tip\"", "[[beam]]\n"];
    let mut random = crate::random::Random::new(3);
    let mut tried = 0;
    for path in decks("decks/minimal") {
        let text = fs::read_to_string(&path).unwrap();
        for _ in 0..60 {
            let mut at = (random.range(0.0, 1.0) * text.len() as f64) as usize;
            let mut end = (at + (random.range(0.0, 1.0) * 12.0) as usize).min(text.len());
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            while !text.is_char_boundary(end) {
                end += 1;
            }
            let piece = pieces[(random.range(0.0, 1.0) * pieces.len() as f64) as usize % pieces.len()];
            let mangled = format!("{}{piece}{}", &text[..at], &text[end.max(at)..]);
            if let Err(diagnostics) = scene::from_text(&mangled) {
                assert!(!diagnostics.is_empty(), "an error without a word:\n{mangled}");
                diagnostics.iter().for_each(|d| assert!(!d.render("deck", &mangled, false).is_empty()));
            }
            tried += 1;
        }
    }
    assert!(tried > 3000);
}
