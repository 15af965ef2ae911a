//! Inputs of the fuzzer and their files.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The largest input, in bytes.
pub const LARGEST: usize = 64 << 10;

/// The name under which a deck finds the table of its input.
pub const TABLE: &str = "table.csv";

/// The language of an input. Its word is the extension of its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// A deck, with an optional table and settings
    Deck,
    /// An expression
    Expression,
    /// A stored history, as `compare` and `plot` read it
    History,
}

impl Language {
    const ALL: [Self; 3] = [Self::Deck, Self::Expression, Self::History];

    fn extension(self) -> &'static str {
        match self {
            Self::Deck => "toml",
            Self::Expression => "expr",
            Self::History => "history",
        }
    }
}

/// One input.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// The language of `text`
    pub language: Language,
    /// The deck, expression or history
    pub text: String,
    /// The table that the deck reads as `table.csv`
    pub table: Option<String>,
    /// `--set` settings of the command line
    pub settings: Vec<String>,
}

impl Input {
    /// An input without table and settings.
    pub fn new(language: Language, text: String) -> Self {
        Self { language, text, table: None, settings: Vec::new() }
    }

    /// Cuts its texts to the largest size.
    pub fn cut(mut self) -> Self {
        for text in self.settings.iter_mut().chain(&mut self.table).chain([&mut self.text]) {
            let mut end = text.len().min(LARGEST);
            while !text.is_char_boundary(end) {
                end -= 1;
            }
            text.truncate(end);
        }
        self
    }

    /// Writes `NAME.toml` (`.expr`, `.history`) in a folder, with `NAME.csv` for its table and
    /// `NAME.set` for its settings, a JSON string on each line. Returns the first path.
    pub fn write(&self, folder: &Path, name: &str) -> io::Result<PathBuf> {
        fs::create_dir_all(folder)?;
        let path = folder.join(format!("{name}.{}", self.language.extension()));
        fs::write(&path, &self.text)?;
        if let Some(table) = &self.table {
            fs::write(path.with_extension("csv"), table)?;
        }
        if !self.settings.is_empty() {
            let lines: Vec<String> =
                self.settings.iter().map(|s| serde_json::Value::from(s.as_str()).to_string()).collect();
            fs::write(path.with_extension("set"), lines.join("\n"))?;
        }
        Ok(path)
    }

    /// Reads what `write` has written.
    pub fn read(path: &Path) -> io::Result<Self> {
        let extension = path.extension().unwrap_or_default();
        let language = Language::ALL.into_iter().find(|language| extension == language.extension());
        let language =
            language.ok_or_else(|| io::Error::other("the name of an input ends in .toml, .expr or .history"))?;
        let settings = fs::read_to_string(path.with_extension("set")).unwrap_or_default();
        let setting = |line: &str| serde_json::from_str(line).unwrap_or_else(|_| line.to_string());
        Ok(Self {
            language,
            text: fs::read_to_string(path)?,
            table: fs::read_to_string(path.with_extension("csv")).ok(),
            settings: settings.lines().map(setting).collect(),
        })
    }

    /// The inputs in a folder and its subfolders, by name.
    pub fn paths(folder: &Path) -> Vec<PathBuf> {
        let mut found = Vec::new();
        let Ok(entries) = fs::read_dir(folder) else { return found };
        for path in entries.flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                found.extend(Self::paths(&path));
            } else if Language::ALL.iter().any(|own| path.extension().is_some_and(|e| e == own.extension())) {
                found.push(path);
            }
        }
        found.sort();
        found
    }
}
