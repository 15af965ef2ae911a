//! Text files of lines `value  keyword - description`, with tables of numbers between them, as
//! OpenFAST has them.

use std::fmt;

/// Characters of a word in a message, at most.
const LONGEST: usize = 40;

/// An error in a file, with its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportError {
    /// Name of the file
    pub(super) file: String,
    /// Line and column from 1; `None` for the whole file
    pub(super) at: Option<[usize; 2]>,
    /// The fault, in a sentence
    pub(super) message: String,
}

impl fmt::Display for ImportError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.at {
            Some([line, column]) => write!(f, "{}:{line}:{column}: {}", self.file, self.message),
            None => write!(f, "{}: {}", self.file, self.message),
        }
    }
}

/// A word of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word<'t> {
    /// Without quotes
    pub(super) text: &'t str,
    /// Column of its first character, from 1
    pub(super) column: usize,
}

/// The lines of a file.
pub struct Lines<'t> {
    file: &'t str,
    lines: Vec<&'t str>,
}

impl<'t> Lines<'t> {
    /// The lines of the text of a file with this name.
    pub fn new(file: &'t str, text: &'t str) -> Self {
        Self { file, lines: text.lines().collect() }
    }

    /// The number of lines.
    pub fn count(&self) -> usize {
        self.lines.len()
    }

    /// A line, from 0; empty after the end.
    pub fn line(&self, line: usize) -> &'t str {
        self.lines.get(line).copied().unwrap_or("")
    }

    /// An error at a column of a line, which counts from 0.
    pub fn error(&self, line: usize, column: usize, message: impl Into<String>) -> ImportError {
        ImportError { file: self.file.into(), at: Some([line + 1, column]), message: message.into() }
    }

    /// An error of the whole file.
    pub fn wrong(&self, message: impl Into<String>) -> ImportError {
        ImportError { file: self.file.into(), at: None, message: message.into() }
    }

    /// The words of a line; a quoted text is one word.
    pub fn words(&self, line: usize) -> Vec<Word<'t>> {
        words(self.line(line))
    }

    /// The fields of a line between commas, which may be empty; an empty one at the end is none.
    pub fn fields(&self, line: usize) -> Vec<Word<'t>> {
        let mut fields = Vec::new();
        let mut column = 1;
        for field in self.line(line).split(',') {
            let skipped = field.chars().take_while(|c| c.is_whitespace()).count();
            fields.push(Word { text: field.trim(), column: column + skipped });
            column += field.chars().count() + 1;
        }
        if fields.last().is_some_and(|word| word.text.is_empty()) {
            fields.pop();
        }
        fields
    }

    /// The line that gives a keyword, `value keyword …`; keywords have no case.
    pub fn find(&self, keyword: &str) -> Option<usize> {
        let is_keyword = |word: &Word| word.text.eq_ignore_ascii_case(keyword);
        (0..self.count()).find(|&line| self.words(line).get(1).is_some_and(is_keyword))
    }

    /// The line and the value of a keyword that must be there.
    pub fn value(&self, keyword: &str) -> Result<(usize, Word<'t>), ImportError> {
        let line = self.find(keyword).ok_or_else(|| self.wrong(format!("there is no line with `{keyword}`")))?;
        Ok((line, self.words(line)[0]))
    }

    /// A number that must be there.
    pub fn number(&self, keyword: &str) -> Result<f64, ImportError> {
        let (line, word) = self.value(keyword)?;
        self.number_of(line, word)
    }

    /// A number, or `default` where there is no such line or the word DEFAULT.
    pub fn number_or(&self, keyword: &str, default: f64) -> Result<f64, ImportError> {
        match self.find(keyword).map(|line| (line, self.words(line)[0])) {
            Some((line, word)) if !word.text.eq_ignore_ascii_case("default") => self.number_of(line, word),
            _ => Ok(default),
        }
    }

    /// A whole number in a range that must be there.
    pub fn whole(&self, keyword: &str, least: usize, most: usize) -> Result<(usize, usize), ImportError> {
        let (line, word) = self.value(keyword)?;
        match word.text.parse::<usize>() {
            Ok(number) if (least..=most).contains(&number) => Ok((line, number)),
            Ok(_) | Err(_) => {
                let message =
                    format!("`{keyword}` must be a whole number from {least} to {most}, found `{}`", shown(word.text));
                Err(self.error(line, word.column, message))
            }
        }
    }

    /// True or false.
    pub fn flag(&self, keyword: &str) -> Result<bool, ImportError> {
        let (line, word) = self.value(keyword)?;
        match word.text.to_ascii_lowercase().as_str() {
            "true" | "t" => Ok(true),
            "false" | "f" => Ok(false),
            _ => {
                let message = format!("`{keyword}` must be True or False, found `{}`", shown(word.text));
                Err(self.error(line, word.column, message))
            }
        }
    }

    /// The first N words of a line, which must be numbers.
    pub fn row<const N: usize>(&self, line: usize, of: &str) -> Result<[f64; N], ImportError> {
        if line >= self.count() {
            return Err(self.error(self.count(), 1, format!("the file ends where {of} should follow")));
        }
        let words = self.words(line);
        if words.len() < N {
            let column = words.last().map_or(1, |word| word.column + word.text.len());
            let message = format!("expected {N} numbers of {of}, found {}", words.len());
            return Err(self.error(line, column, message));
        }
        let mut numbers = [0.0; N];
        for (number, word) in numbers.iter_mut().zip(words) {
            *number = self.number_of(line, word)?;
        }
        Ok(numbers)
    }

    /// The next line from `line` on that is not empty.
    pub fn next_row(&self, line: usize) -> usize {
        (line..self.count()).find(|&line| !self.line(line).trim().is_empty()).unwrap_or(self.count())
    }

    /// A word as a finite number; Fortran's `1.0D+03` is one.
    pub fn number_of(&self, line: usize, word: Word) -> Result<f64, ImportError> {
        match word.text.replace(['d', 'D'], "e").parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            Ok(_) => Err(self.error(line, word.column, format!("`{}` is not a finite number", shown(word.text)))),
            Err(_) => Err(self.error(line, word.column, format!("`{}` is not a number", shown(word.text)))),
        }
    }
}

fn words(line: &str) -> Vec<Word<'_>> {
    let mut words = Vec::new();
    let mut rest = line;
    let mut column = 1;
    loop {
        let skipped = rest.len() - rest.trim_start_matches(|c: char| c.is_whitespace() || c == ',').len();
        column += rest[..skipped].chars().count();
        rest = &rest[skipped..];
        let Some(first) = rest.chars().next() else { return words };
        let quoted = if matches!(first, '"' | '\'') { rest[1..].find(first) } else { None };
        let (text, length) = match quoted {
            Some(end) => (&rest[1..=end], end + 2),
            None => {
                let end = rest.find(|c: char| c.is_whitespace() || c == ',').unwrap_or(rest.len());
                (&rest[..end], end)
            }
        };
        words.push(Word { text, column });
        column += rest[..length].chars().count();
        rest = &rest[length..];
    }
}

/// The beginning of a word: a file of another kind may have very long ones.
pub fn shown(word: &str) -> String {
    match word.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &word[..end]),
        None => word.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_have_columns_and_quotes_join_them() {
        let found = words("  1.0D+03,  \"a file.dat\"\tBldFile - name");
        let texts: Vec<&str> = found.iter().map(|word| word.text).collect();
        assert_eq!(texts, ["1.0D+03", "a file.dat", "BldFile", "-", "name"]);
        assert_eq!((found[0].column, found[1].column, found[2].column), (3, 13, 26));
        assert_eq!(words("\"open").len(), 1);
        assert_eq!(words("ä \"ö\" x")[2].column, 7);
    }

    #[test]
    fn values_are_found_by_their_keyword() {
        let text = "header\n 12 kp_total - number\n1 2.5d0 nan\n";
        let lines = Lines::new("f.dat", text);
        assert_eq!(lines.whole("KP_TOTAL", 3, 50), Ok((1, 12)));
        assert_eq!(lines.row::<2>(2, "a row"), Ok([1.0, 2.5]));
        let told = |error: ImportError| error.to_string();
        assert_eq!(told(lines.row::<3>(2, "a row").unwrap_err()), "f.dat:3:9: `nan` is not a finite number");
        assert_eq!(told(lines.row::<4>(2, "a row").unwrap_err()), "f.dat:3:12: expected 4 numbers of a row, found 3");
        assert_eq!(told(lines.row::<4>(3, "a row").unwrap_err()), "f.dat:4:1: the file ends where a row should follow");
        assert_eq!(told(lines.number("order").unwrap_err()), "f.dat: there is no line with `order`");
        assert_eq!(
            told(lines.whole("kp_total", 3, 5).unwrap_err()),
            "f.dat:2:2: `kp_total` must be a whole number from 3 to 5, found `12`"
        );
    }
}
