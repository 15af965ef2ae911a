//! Input files of keywords, as Abaqus and CalculiX have them: `*KEYWORD, PARAMETER=VALUE` with lines
//! of data below, and comments that begin with `**`.

use super::lines::{ImportError, Lines, Word, shown};

/// A keyword with its data.
pub struct Block<'t> {
    /// In capitals, without spaces: `BEAMSECTION`
    pub name: String,
    /// Line of the keyword, from 0
    pub line: usize,
    /// Names in capitals, and values
    pub parameters: Vec<(String, Word<'t>)>,
    /// Lines of data, from 0, that are not empty
    pub data: Vec<usize>,
}

impl<'t> Block<'t> {
    /// The value of a parameter.
    pub fn get(&self, name: &str) -> Option<Word<'t>> {
        self.parameters.iter().find(|(known, _)| known == name).map(|(_, word)| *word)
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
            let parameters = fields.filter_map(parameter).collect();
            blocks.push(Block { name: name.to_uppercase(), line: number, parameters, data: Vec::new() });
        } else if let Some(block) = blocks.last_mut() {
            if continues {
                block.parameters.extend(lines.fields(number).into_iter().filter_map(parameter));
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

fn parameter(word: Word) -> Option<(String, Word)> {
    if word.text.is_empty() {
        return None;
    }
    let (name, value) = word.text.split_once('=').unwrap_or((word.text, ""));
    let name: String = name.split_whitespace().collect();
    let skipped = word.text.len() - value.trim_start().len();
    Some((name.to_uppercase(), Word { text: value.trim(), column: word.column + skipped }))
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
