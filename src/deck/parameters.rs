//! `[param]`: names for numbers, which may be expressions of each other.

use super::diagnostic::{Diagnostic, Span};
use super::expression::{CONSTANTS, Expression, Jet};
use super::reader::{kind_of, literal};
use std::collections::{BTreeMap, BTreeSet};
use toml::de::{DeTable, DeValue};

/// The values of the parameters.
#[derive(Clone, Debug, Default)]
pub struct Parameters {
    values: BTreeMap<String, f64>,
    broken: BTreeSet<String>,
}

/// Longest chain of parameters that refer to each other.
const MOST_LINKS: usize = 256;

struct Entry {
    span: Span,
    expression: Option<Expression>,
}

impl Parameters {
    /// Reads and resolves the table; what is wrong goes to `diagnostics`.
    pub fn read(table: &DeTable, diagnostics: &mut Vec<Diagnostic>) -> Self {
        let mut entries = BTreeMap::new();
        for (key, item) in table {
            let name = key.get_ref().to_string();
            if let Some(problem) = unusable(&name) {
                diagnostics.push(Diagnostic::error(problem, key.span()));
                continue;
            }
            let expression = read_entry(item, diagnostics);
            entries.insert(name, Entry { span: item.span(), expression });
        }
        let mut parameters = Self::default();
        for name in entries.keys() {
            parameters.resolve(name, &entries, &mut Vec::new(), diagnostics);
        }
        parameters
    }

    /// The value of a parameter.
    pub fn get(&self, name: &str) -> Option<Jet> {
        self.values.get(name).map(|&value| [value, 0.0, 0.0])
    }

    /// The names of all parameters.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.values.keys().map(String::as_str)
    }

    /// True if an expression uses a parameter that has been reported as wrong.
    pub fn is_broken(&self, text: &str) -> bool {
        let mut broken = false;
        if let Ok(expression) = Expression::parse(text) {
            expression.names(&mut |name, _| broken |= self.broken.contains(name));
        }
        broken
    }

    fn resolve(
        &mut self,
        name: &str,
        entries: &BTreeMap<String, Entry>,
        path: &mut Vec<String>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<f64> {
        if let Some(&value) = self.values.get(name) {
            return Some(value);
        }
        let entry = entries.get(name)?;
        if self.broken.contains(name) {
            return None;
        }
        if let Some(start) = path.iter().position(|p| p == name) {
            let circle = [&path[start..], &[name.to_string()]].concat().join(" -> ");
            diagnostics.push(Diagnostic::error(format!("parameters go in a circle: {circle}"), entry.span.clone()));
            self.broken.extend(path[start..].iter().cloned());
            return None;
        }
        if path.len() >= MOST_LINKS {
            let message = format!("more than {MOST_LINKS} parameters refer to each other in a chain");
            diagnostics.push(Diagnostic::limit(message, entry.span.clone()));
            self.broken.extend(path.drain(..));
            return None;
        }
        path.push(name.into());
        let value = self.value_of(name, entry, entries, path, diagnostics);
        path.pop();
        match value {
            Some(value) => {
                self.values.insert(name.into(), value);
            }
            None => {
                self.broken.insert(name.into());
            }
        }
        value
    }

    fn value_of(
        &mut self,
        name: &str,
        entry: &Entry,
        entries: &BTreeMap<String, Entry>,
        path: &mut Vec<String>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<f64> {
        let expression = entry.expression.as_ref()?;
        let mut missing = false;
        let evaluated = expression.evaluate(&mut |other| {
            let value = self.resolve(other, entries, path, diagnostics);
            missing |= value.is_none() && entries.contains_key(other);
            value.map(|value| [value, 0.0, 0.0])
        });
        match evaluated {
            Ok([value, ..]) if value.is_finite() => Some(value),
            Ok([value, ..]) => {
                let message = format!("parameter `{name}` is {value}; a number must be finite");
                diagnostics.push(Diagnostic::error(message, entry.span.clone()));
                None
            }
            Err(_) if missing => None,
            Err(error) => {
                let message = format!("parameter `{name}`: {}", error.message);
                diagnostics.push(Diagnostic::error(message, entry.span.clone()));
                None
            }
        }
    }
}

/// The reason why a name cannot be a parameter.
fn unusable(name: &str) -> Option<String> {
    let fixed = CONSTANTS.iter().map(|(known, _)| *known).chain(["t"]);
    if fixed.into_iter().any(|known| known == name) {
        return Some(format!("`{name}` has a fixed meaning and cannot be a parameter"));
    }
    let mut characters = name.chars();
    let starts = characters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
    if starts && characters.all(|c| c.is_ascii_alphanumeric() || c == '_') {
        return None;
    }
    Some(format!(
        "`{name}` cannot stand in an expression: a parameter is letters, digits and _, beginning with a letter"
    ))
}

fn read_entry(item: &toml::Spanned<DeValue>, diagnostics: &mut Vec<Diagnostic>) -> Option<Expression> {
    let text = match item.get_ref() {
        DeValue::Integer(_) | DeValue::Float(_) => {
            let number = literal(item.get_ref());
            if number.is_none() {
                diagnostics.push(Diagnostic::error("this number is too large", item.span()));
            }
            return number.map(Expression::Number);
        }
        DeValue::String(text) => text.to_string(),
        other => {
            let message = format!("a parameter is a number or an expression, found {}", kind_of(other));
            diagnostics.push(Diagnostic::error(message, item.span()));
            return None;
        }
    };
    match Expression::parse(&text) {
        Ok(expression) => Some(expression),
        Err(error) => {
            let at = item.span().start + 1 + error.offset;
            diagnostics.push(Diagnostic::error(format!("in the expression `{text}`: {}", error.message), at..at + 1));
            None
        }
    }
}
