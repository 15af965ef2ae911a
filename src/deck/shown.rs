//! Texts of users as a terminal shows them: characters that control it, hide text or reorder it are
//! escaped.

use std::borrow::Cow;
use std::fmt::Write;

/// True for characters that reorder text or end a line, but are no control characters: marks and
/// overrides of writing direction, and separators of lines and paragraphs.
pub fn hides_text(c: char) -> bool {
    matches!(c, '\u{200e}' | '\u{200f}' | '\u{061c}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// A text with characters that are not printed as they are (`\u{1b}`), except ends of lines and
/// tabulators.
pub fn shown(text: &str) -> Cow<'_, str> {
    escaped(text, |c| matches!(c, '\n' | '\t'))
}

/// A text in one line.
pub fn shown_in_line(text: &str) -> Cow<'_, str> {
    escaped(text, |_| false)
}

fn escaped(text: &str, is_allowed: impl Fn(char) -> bool) -> Cow<'_, str> {
    let is_bad = |c: char| (c.is_control() || hides_text(c)) && !is_allowed(c);
    if !text.chars().any(is_bad) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if is_bad(c) {
            let _ = write!(out, "{}", c.escape_default());
        } else {
            out.push(c);
        }
    }
    Cow::Owned(out)
}

/// The text of a deck for messages about it: each character that is not printed is replaced by as
/// many bytes, so that places stay where they are.
pub fn shown_in_place(text: &str) -> Cow<'_, str> {
    let is_bad = |c: char| (c.is_control() && !matches!(c, '\n' | '\t' | '\r')) || hides_text(c);
    if !text.chars().any(is_bad) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c.len_utf8() {
            _ if !is_bad(c) => out.push(c),
            // A replacement character has three bytes.
            3 => out.push('\u{fffd}'),
            bytes => out.extend(std::iter::repeat_n('?', bytes)),
        }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminals_are_not_controlled_by_texts() {
        assert_eq!(shown("plain é\n\ttext"), "plain é\n\ttext");
        assert_eq!(shown("A\u{1b}]0;x\u{7}"), "A\\u{1b}]0;x\\u{7}");
        assert_eq!(shown("\u{9b}2J\r\u{7f}"), "\\u{9b}2J\\r\\u{7f}");
        assert_eq!(shown("a\u{202e}b\u{2066}c\u{2028}"), "a\\u{202e}b\\u{2066}c\\u{2028}");
        assert_eq!(shown_in_line("a\nerror[deck]: forged"), "a\\nerror[deck]: forged");
    }

    #[test]
    fn places_in_a_text_stay_where_they_are() {
        for text in ["a\u{1b}b", "a\u{9b}b", "a\u{202e}b", "a\u{61c}b\n"] {
            let replaced = shown_in_place(text);
            assert_eq!(replaced.len(), text.len());
            assert_eq!(shown(&replaced), replaced);
        }
    }
}
