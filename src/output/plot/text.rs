//! Texts of a plot, wrapped and cut to fit. Widths are estimated, since the font depends on the
//! reader's machine.

/// Widths of characters relative to the font size, as in the wider of the common sans-serif fonts.
fn width_of(character: char) -> f64 {
    match character {
        'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' | ' ' => 0.32,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '/' | '-' | '·' => 0.42,
        'm' | 'w' | 'M' | 'W' | '@' | '%' | '…' => 1.0,
        'A'..='Z' => 0.72,
        '\u{2e80}'.. => 1.05,
        _ => 0.62,
    }
}

/// The width of a text in pixels.
pub fn width(text: &str, size: f64) -> f64 {
    size * text.chars().map(width_of).sum::<f64>()
}

/// The text, or its beginning and an ellipsis if it is wider than the room in pixels.
pub fn cut(text: &str, size: f64, room: f64) -> String {
    if width(text, size) <= room {
        return text.into();
    }
    let mut kept = String::new();
    for character in text.chars() {
        kept.push(character);
        if width(&kept, size) + size > room {
            kept.pop();
            break;
        }
    }
    format!("{}…", kept.trim_end())
}

/// Lines that fit the room in pixels: broken at spaces, and within words that are wider than the
/// room.
pub fn wrapped(text: &str, size: f64, room: f64) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let longer = if line.is_empty() { word.to_string() } else { format!("{line} {word}") };
        if width(&longer, size) <= room {
            line = longer;
            continue;
        }
        if !line.is_empty() {
            lines.push(std::mem::take(&mut line));
        }
        for character in word.chars() {
            if width(&line, size) + size > room {
                lines.push(std::mem::take(&mut line));
            }
            line.push(character);
        }
    }
    if !line.is_empty() {
        lines.push(line);
    }
    lines
}

/// A text on one or more lines, in a smaller font if it is long.
pub struct Block {
    /// The lines of the text
    pub(super) lines: Vec<String>,
    /// The font size in pixels
    pub(super) size: f64,
}

impl Block {
    /// The text in the first of the font sizes with which it needs at most `max_lines` lines; if no
    /// size suffices, it is cut in the last size.
    pub fn fit(text: &str, sizes: &[f64], max_lines: usize, room: f64) -> Self {
        let mut block = Self { lines: Vec::new(), size: 0.0 };
        for &size in sizes {
            block = Self { lines: wrapped(text, size, room), size };
            if block.lines.len() <= max_lines {
                return block;
            }
        }
        let rest = block.lines.split_off(max_lines - 1).join(" ");
        block.lines.push(cut(&rest, block.size, room));
        block
    }

    /// The distance between base lines in pixels.
    pub fn line_height(&self) -> f64 {
        1.25 * self.size
    }

    /// The height of the text in pixels.
    pub fn height(&self) -> f64 {
        self.line_height() * self.lines.len() as f64
    }
}
