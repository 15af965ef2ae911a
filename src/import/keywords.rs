//! Input files of keywords, as Abaqus and CalculiX have them: `*KEYWORD, PARAMETER=VALUE` with lines
//! of data below, and comments that begin with `**`.

use super::lines::{ImportError, Lines, Word, shown};

/// A parameter of a keyword.
pub struct Parameter<'t> {
    /// In capitals, without spaces
    pub(super) name: String,
    /// Line in the file, from 0
    pub(super) line: usize,
    /// Column of its name, from 1
    pub(super) column: usize,
    /// Without quotes; empty if it has none
    pub(super) value: Word<'t>,
}

/// A keyword with its data.
pub struct Block<'t> {
    /// In capitals, without spaces: `BEAMSECTION`
    pub(super) name: String,
    /// Line of the keyword, from 0
    pub(super) line: usize,
    /// Its parameters, in order
    pub(super) parameters: Vec<Parameter<'t>>,
    /// Lines of data, from 0, that are not empty
    pub(super) data: Vec<usize>,
}

impl<'t> Block<'t> {
    /// The value of a parameter.
    pub fn get(&self, name: &str) -> Option<Word<'t>> {
        self.parameters.iter().find(|known| known.name == name).map(|known| known.value)
    }

    /// True if it has a parameter, with a value or without.
    pub fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// The value of a parameter that must be there, as the name of a set or material.
    pub fn name_of(&self, lines: &Lines, parameter: &str) -> Result<String, ImportError> {
        match self.get(parameter) {
            Some(word) if !word.text.is_empty() => Ok(word.text.to_uppercase()),
            _ => Err(lines.error(self.line, 1, format!("*{} needs {parameter}=…", self.name))),
        }
    }
}

/// The blocks of a file.
pub fn blocks<'t>(lines: &Lines<'t>) -> Result<Vec<Block<'t>>, ImportError> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut continues = false;
    for number in 0..lines.count() {
        let line = lines.line(number);
        if line.starts_with("**") || line.trim().is_empty() {
            continue;
        }
        if let Some(keyword) = line.trim_start().strip_prefix('*') {
            let mut fields = lines.fields(number).into_iter();
            let _ = fields.next();
            let name: String = keyword.split(',').next().unwrap_or("").split_whitespace().collect();
            let parameters = fields.filter_map(|word| parameter(number, word)).collect();
            blocks.push(Block { name: name.to_uppercase(), line: number, parameters, data: Vec::new() });
        } else if let Some(block) = blocks.last_mut() {
            if continues {
                block.parameters.extend(lines.fields(number).into_iter().filter_map(|word| parameter(number, word)));
            } else {
                block.data.push(number);
            }
        } else {
            return Err(lines.error(number, 1, "data without a keyword: is this an input file of Abaqus or CalculiX?"));
        }
        let is_keyword = line.trim_start().starts_with('*');
        continues = (is_keyword || continues) && line.trim_end().ends_with(',');
    }
    Ok(blocks)
}

fn parameter(line: usize, word: Word) -> Option<Parameter> {
    if word.text.is_empty() {
        return None;
    }
    let (name, value) = word.text.split_once('=').unwrap_or((word.text, ""));
    let name: String = name.split_whitespace().collect();
    let skipped = word.text[..word.text.len() - value.trim_start().len()].chars().count();
    let value = Word { text: unquoted(value.trim()), column: word.column + skipped };
    Some(Parameter { name: name.to_uppercase(), line, column: word.column, value })
}

fn unquoted(text: &str) -> &str {
    text.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(text)
}

/// The name of a set in a line of data, in capitals; without that of a part or an instance before a
/// point: `beam-1.tip`.
pub fn set_name(word: Word) -> String {
    let own = if word.text.ends_with('"') { word.text } else { word.text.rsplit('.').next().unwrap_or(word.text) };
    let quoted = own.rfind(".\"").map_or(own, |point| &own[point + 1..]);
    unquoted(quoted).to_uppercase()
}

/// A positive whole number.
pub fn label(lines: &Lines, line: usize, word: Word) -> Result<u64, ImportError> {
    match word.text.parse::<u64>() {
        Ok(number) if number > 0 => Ok(number),
        Ok(_) | Err(_) => Err(lines.error(
            line,
            word.column,
            format!("`{}` is not the number of a node or element", shown(word.text)),
        )),
    }
}

/// The numbers of a line; empty fields are zero.
pub fn numbers(lines: &Lines, line: usize) -> Result<Vec<f64>, ImportError> {
    let number = |word: Word| if word.text.is_empty() { Ok(0.0) } else { lines.number_of(line, word) };
    lines.fields(line).into_iter().map(number).collect()
}
