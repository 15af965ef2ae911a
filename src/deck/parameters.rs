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
            parameters.resolve(name, &entries, diagnostics);
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

    /// Resolves a parameter after those that it refers to. Parameters that wait for others are on a
    /// list, not on the call stack.
    fn resolve(&mut self, name: &str, entries: &BTreeMap<String, Entry>, diagnostics: &mut Vec<Diagnostic>) {
        let mut path = vec![name.to_string()];
        while let Some(name) = path.last().cloned() {
            let Some(entry) = entries.get(&name).filter(|_| !self.is_resolved(&name)) else {
                path.pop();
                continue;
            };
            let needed = self.unresolved(entry, entries);
            let Some(next) = needed else {
                match self.value_of(&name, entry, entries, diagnostics) {
                    Some(value) => drop(self.values.insert(name, value)),
                    None => drop(self.broken.insert(name)),
                }
                path.pop();
                continue;
            };
            if let Some(start) = path.iter().position(|known| *known == next) {
                let circle = [&path[start..], std::slice::from_ref(&next)].concat().join(" -> ");
                let message = format!("parameters refer to each other in a circle: {circle}");
                diagnostics.push(Diagnostic::error(message, entries[&next].span.clone()));
                self.broken.extend(path.drain(start..));
            } else if path.len() >= MOST_LINKS {
                let message = format!("more than {MOST_LINKS} parameters refer to each other in a chain");
                diagnostics.push(Diagnostic::limit(message, entries[&next].span.clone()));
                self.broken.extend(path.drain(..));
            } else {
                path.push(next);
            }
        }
    }

    /// True if a parameter has a value, or has been reported as wrong.
    fn is_resolved(&self, name: &str) -> bool {
        self.values.contains_key(name) || self.broken.contains(name)
    }

    /// The first parameter that must be resolved before an entry.
    fn unresolved(&self, entry: &Entry, entries: &BTreeMap<String, Entry>) -> Option<String> {
        let mut found = None;
        entry.expression.as_ref()?.names(&mut |name, _| {
            if found.is_none() && entries.contains_key(name) && !self.is_resolved(name) {
                found = Some(name.to_string());
            }
        });
        found
    }

    /// The value of a parameter whose needed parameters are resolved.
    fn value_of(
        &self,
        name: &str,
        entry: &Entry,
        entries: &BTreeMap<String, Entry>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<f64> {
        let expression = entry.expression.as_ref()?;
        let mut missing = false;
        let evaluated = expression.evaluate(&mut |other| {
            let value = self.get(other);
            missing |= value.is_none() && entries.contains_key(other);
            value
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
        "`{name}` cannot be used in an expression: the name of a parameter has letters, digits and _, and starts with \
         a letter"
    ))
}

fn read_entry(item: &toml::Spanned<DeValue>, diagnostics: &mut Vec<Diagnostic>) -> Option<Expression> {
    let text = match item.get_ref() {
        DeValue::Integer(_) | DeValue::Float(_) => {
            let number = literal(item.get_ref());
            if number.is_none() {
                diagnostics.push(Diagnostic::error("this number is too large", item.span()));
            }
            return number.map(Expression::of_number);
        }
        DeValue::String(text) => text.to_string(),
        other => {
            let message = format!("a parameter must be a number or an expression, found {}", kind_of(other));
            diagnostics.push(Diagnostic::error(message, item.span()));
            return None;
        }
    };
    match Expression::parse(&text) {
        Ok(expression) => Some(expression),
        Err(error) => {
            diagnostics.push(error.diagnostic(&text, &item.span()));
            None
        }
    }
}
