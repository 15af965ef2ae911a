//! Reads typed values out of TOML tables, each with its place, and collects everything that is
//! wrong.

use super::diagnostic::{Diagnostic, Span, Spanned, one_of};
use super::expression::Expression;
use super::hints::{self, nearest};
use super::parameters::Parameters;
use super::words::Words;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use toml::de::{DeTable, DeValue};

/// A value of the deck with its place.
pub type Item<'a> = toml::Spanned<DeValue<'a>>;

/// Parameters and stages that readers refer to, and the diagnostics that they collect.
pub struct Context {
    /// The values of `[param]`
    pub(super) parameters: Parameters,
    /// Number of stages of the deck
    pub(super) stage_count: usize,
    /// Errors and warnings so far
    pub(super) diagnostics: RefCell<Vec<Diagnostic>>,
    /// The numbers that strings stood for, by the start of the string
    pub(super) resolved: RefCell<BTreeMap<usize, f64>>,
}

impl Context {
    /// Adds a diagnostic.
    pub fn report(&self, diagnostic: Diagnostic) {
        self.diagnostics.borrow_mut().push(diagnostic);
    }

    /// Reports an error at a place; returns nothing, for use in a tail position.
    pub fn wrong<T>(&self, span: Span, message: impl Into<String>) -> Option<T> {
        self.report(Diagnostic::error(message, span));
        None
    }

    /// A finite number, or an expression of one.
    pub fn number(&self, item: &Item) -> Option<Spanned<f64>> {
        let span = item.span();
        let value = match item.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => literal(item.get_ref()),
            DeValue::String(text) => {
                let value = self.expression_value(text, &span)?;
                self.resolved.borrow_mut().insert(span.start, value);
                Some(value)
            }
            other => return self.wrong(span, format!("expected a number, found {}", kind_of(other))),
        };
        match value {
            Some(value) if value.is_finite() => Some(Spanned { value, span }),
            _ => self.wrong(span, "a number must be finite"),
        }
    }

    fn expression_value(&self, text: &str, span: &Span) -> Option<f64> {
        let evaluated = Expression::parse(text).and_then(|e| e.evaluate(&mut |name| self.parameters.get(name)));
        match evaluated {
            Ok([value, ..]) if value.is_finite() => Some(value),
            Ok([value, ..]) => {
                self.wrong(span.clone(), format!("the expression `{text}` gives {value}; a number must be finite"))
            }
            Err(_) if self.parameters.is_broken(text) => None,
            Err(error) => {
                let mut diagnostic = error.diagnostic(text, span);
                if let Some(name) = error.message.strip_prefix("unknown name `").and_then(|n| n.strip_suffix('`')) {
                    diagnostic.help = Some(if name == "t" {
                        "`t` exists only in the `expr` of a history".into()
                    } else {
                        match nearest(name, self.parameters.names()) {
                            Some(meant) => format!("did you mean `{meant}`?"),
                            None => format!("define it: [param] {name} = …"),
                        }
                    });
                }
                self.report(diagnostic);
                None
            }
        }
    }

    /// A list of numbers; of a certain length where one is given.
    pub fn numbers(&self, item: &Item, length: Option<usize>) -> Option<Spanned<Vec<f64>>> {
        let span = item.span();
        let DeValue::Array(array) = item.get_ref() else {
            let wanted = length.map_or("a list of numbers".into(), |n| format!("a list of {n} numbers"));
            return self.wrong(span, format!("expected {wanted}, found {}", kind_of(item.get_ref())));
        };
        let values: Vec<Option<f64>> = array.iter().map(|entry| self.number(entry).map(|n| n.value)).collect();
        if let Some(length) = length.filter(|&length| length != values.len()) {
            return self.wrong(span, format!("expected {length} numbers, found {}", values.len()));
        }
        Some(Spanned { value: values.into_iter().collect::<Option<_>>()?, span })
    }

    /// Exactly N numbers.
    pub fn vector<const N: usize>(&self, item: &Item) -> Option<Spanned<[f64; N]>> {
        let list = self.numbers(item, Some(N))?;
        let value = list.value.try_into().ok()?;
        Some(Spanned { value, span: list.span })
    }

    /// A whole number in a range.
    pub fn whole(&self, item: &Item, least: usize, most: usize) -> Option<Spanned<usize>> {
        let Spanned { value, span } = self.number(item)?;
        // Whole numbers may be the outcome of an expression: 0.3/0.1.
        let value = if (value - value.round()).abs() <= 1e-9 * value.abs() { value.round() } else { value };
        if value.fract() != 0.0 {
            return self.wrong(span, format!("expected a whole number, found {value}"));
        }
        if value < least as f64 {
            return self.wrong(span, format!("expected at least {least}, found {value}"));
        }
        if value > most as f64 {
            let message = format!("{value} is more than the limit of {most}");
            self.report(Diagnostic::limit(message, span));
            return None;
        }
        Some(Spanned { value: value as usize, span })
    }

    /// A text.
    pub fn text(&self, item: &Item) -> Option<Spanned<String>> {
        match item.get_ref() {
            DeValue::String(text) => Some(Spanned { value: text.to_string(), span: item.span() }),
            other => self.wrong(item.span(), format!("expected a string, found {}", kind_of(other))),
        }
    }

    /// One of a few words; `key` is named in messages.
    pub fn word<W: Words>(&self, item: &Item, key: &str) -> Option<Spanned<W>> {
        let text = self.text(item)?;
        if let Some(value) = W::of(&text.value) {
            return Some(Spanned { value, span: text.span });
        }
        let message = format!("`{key}` must be {}, not `{}`", one_of(W::words()), text.value);
        let mut diagnostic = Diagnostic::error(message, text.span);
        let known: Vec<&str> = W::words().collect();
        diagnostic.help = hints::for_word(key, &text.value, &known).help();
        self.report(diagnostic);
        None
    }

    /// A list of texts.
    pub fn texts(&self, item: &Item) -> Option<Vec<Spanned<String>>> {
        match item.get_ref() {
            DeValue::Array(array) => array.iter().map(|entry| self.text(entry)).collect(),
            other => self.wrong(item.span(), format!("expected a list of strings, found {}", kind_of(other))),
        }
    }
}

/// The number that stands in the text as one.
pub fn literal(value: &DeValue) -> Option<f64> {
    match value {
        DeValue::Integer(integer) => {
            let digits = integer.as_str().trim_start_matches('+').replace('_', "");
            let whole = i128::from_str_radix(&digits, integer.radix()).ok().map(|v| v as f64);
            whole.or_else(|| (integer.radix() == 10).then(|| digits.parse().ok()).flatten())
        }
        DeValue::Float(float) => float.as_str().replace('_', "").parse().ok(),
        _ => None,
    }
}

/// The kind of a TOML value, for messages.
pub fn kind_of(value: &DeValue) -> &'static str {
    match value {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

/// One table of the deck.
pub struct Table<'a> {
    /// Parameters and diagnostics
    pub(super) context: &'a Context,
    /// Its name in messages: `[[beam]]`
    pub(super) what: String,
    /// Place of the table
    pub(super) span: Span,
    entries: &'a DeTable<'a>,
    /// Known keys that misspelt ones stand for: they are not reported as missing again.
    misspelt: Vec<String>,
}

impl<'a> Table<'a> {
    /// The table `item`; keys that are not in `keys` are errors.
    pub fn new(
        context: &'a Context,
        item: &'a Item<'a>,
        what: impl Into<String>,
        keys: &[&'static str],
    ) -> Option<Self> {
        let mut table = Self::of_names(context, item, what)?;
        table.refuse_unknown(keys);
        Some(table)
    }

    /// A table whose keys are names that the user chooses.
    pub fn of_names(context: &'a Context, item: &'a Item<'a>, what: impl Into<String>) -> Option<Self> {
        let what = what.into();
        let DeValue::Table(entries) = item.get_ref() else {
            let message = format!("{what} must be a table, found {}", kind_of(item.get_ref()));
            let mut diagnostic = Diagnostic::error(message, item.span());
            if matches!(item.get_ref(), DeValue::Array(_)) && what.starts_with('[') && !what.starts_with("[[") {
                diagnostic = diagnostic.help(format!("write {what} in single brackets: there is one of it"));
            }
            context.report(diagnostic);
            return None;
        };
        Some(Self { context, what, span: item.span(), entries, misspelt: Vec::new() })
    }

    /// The top level of a file.
    pub fn top(context: &'a Context, entries: &'a DeTable<'a>, what: &str, keys: &[&'static str]) -> Self {
        let mut table = Self { context, what: what.into(), span: 0..0, entries, misspelt: Vec::new() };
        table.refuse_unknown(keys);
        table
    }

    fn refuse_unknown(&mut self, keys: &[&'static str]) {
        for key in self.entries.keys() {
            let name: &str = key.get_ref();
            if !keys.contains(&name) {
                let hint = hints::for_key(&self.what, name, keys);
                self.misspelt.extend(hint.meant().map(str::to_string));
                let list = || format!("keys of {}: {}", self.what, one_of(keys.iter().copied()));
                let message = format!("unknown key `{name}` in {}", self.what);
                let help = hint.help().unwrap_or_else(list);
                let error = Diagnostic::error(message, key.span()).help(help);
                self.context.report(Diagnostic { is_of_key: true, ..error });
            }
        }
    }

    /// True if the table has a key.
    pub fn has(&self, key: &str) -> bool {
        self.entries.contains_key(key)
    }

    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&'a Item<'a>> {
        self.entries.get(key)
    }

    /// The place of a key; that of the table where it has none.
    pub fn key_span(&self, key: &str) -> Span {
        self.entries.keys().find(|k| k.get_ref().as_ref() == key).map_or(self.span.clone(), |k| k.span())
    }

    /// The value of a key that must be there.
    pub fn required(&self, key: &str) -> Option<&'a Item<'a>> {
        let found = self.get(key);
        if found.is_none() && !self.misspelt.iter().any(|meant| meant == key) {
            self.context.report(Diagnostic::error(format!("{} needs `{key}`", self.what), self.span.clone()));
        }
        found
    }

    /// Names and values in the order of the deck.
    pub fn entries(&self) -> impl Iterator<Item = (Spanned<String>, &'a Item<'a>)> {
        let mut all: Vec<_> = self.entries.iter().collect();
        all.sort_by_key(|(key, _)| key.span().start);
        all.into_iter().map(|(key, value)| (Spanned { value: key.get_ref().to_string(), span: key.span() }, value))
    }

    /// The entries of an array of tables.
    pub fn list(&self, key: &str) -> Vec<&'a Item<'a>> {
        match self.get(key).map(|item| item.get_ref()) {
            None => Vec::new(),
            Some(DeValue::Array(array)) => array.iter().collect(),
            Some(_) => {
                let message = format!("`{key}` is a list of tables: write [[{key}]] above each");
                self.context.report(Diagnostic::error(message, self.key_span(key)));
                Vec::new()
            }
        }
    }

    /// Reports an error at the table; returns nothing, for use in a tail position.
    pub fn wrong<T>(&self, message: impl Into<String>) -> Option<T> {
        self.context.wrong(self.span.clone(), message)
    }

    /// Reports an error at a key; returns nothing, for use in a tail position.
    pub fn wrong_key<T>(&self, key: &str, message: impl Into<String>) -> Option<T> {
        self.context.wrong(self.key_span(key), message)
    }

    /// Reports an error at the value of a key; returns nothing, for use in a tail position.
    pub fn wrong_value<T>(&self, key: &str, message: impl Into<String>) -> Option<T> {
        self.context.wrong(self.get(key).map_or(self.span.clone(), |item| item.span()), message)
    }

    /// Reports an error at a key if the table has it.
    pub fn refuse(&self, key: &str, message: impl Into<String>) {
        if self.has(key) {
            self.wrong_key::<()>(key, message);
        }
    }

    /// The value of a key that may be left out: `Some(None)` where it is, `None` where the value is
    /// wrong.
    pub fn optional<T>(
        &self,
        key: &str,
        read: impl FnOnce(&'a Context, &'a Item<'a>) -> Option<T>,
    ) -> Option<Option<T>> {
        self.get(key).map_or(Some(None), |item| read(self.context, item).map(Some))
    }

    /// One of a few words.
    pub fn word<W: Words>(&self, key: &str) -> Option<Spanned<W>> {
        self.context.word(self.get(key)?, key)
    }

    /// One of a few words, or `default` where the key is left out.
    pub fn word_or<W: Words>(&self, key: &str, default: W) -> Option<W> {
        Some(self.optional(key, |context, item| context.word(item, key))?.map_or(default, |word| word.value))
    }

    /// A number.
    pub fn number(&self, key: &str) -> Option<Spanned<f64>> {
        self.context.number(self.get(key)?)
    }

    /// A number that must be there.
    pub fn required_number(&self, key: &str) -> Option<Spanned<f64>> {
        self.context.number(self.required(key)?)
    }

    /// A positive number.
    pub fn positive(&self, key: &str) -> Option<Spanned<f64>> {
        let number = self.number(key)?;
        if number.value > 0.0 {
            return Some(number);
        }
        self.context.wrong(number.span, format!("`{key}` must be positive, found {}", number.value))
    }

    /// A positive number that must be there.
    pub fn required_positive(&self, key: &str) -> Option<Spanned<f64>> {
        self.required(key)?;
        self.positive(key)
    }

    /// A positive number, or `default` where the key is left out.
    pub fn positive_or(&self, key: &str, default: f64) -> Option<f64> {
        Some(self.optional(key, |_, _| self.positive(key))?.map_or(default, |number| number.value))
    }

    /// Two positive numbers that must be there, or one for both.
    pub fn positive_pair(&self, key: &str) -> Option<[f64; 2]> {
        let item = self.required(key)?;
        let values = match item.get_ref() {
            DeValue::Array(_) => self.context.vector::<2>(item)?,
            _ => self.context.number(item)?.map(|value| [value, value]),
        };
        if values.value.iter().all(|&value| value > 0.0) {
            return Some(values.value);
        }
        self.context.wrong(values.span, format!("`{key}` must be positive"))
    }

    /// A number that is not negative.
    pub fn non_negative(&self, key: &str) -> Option<Spanned<f64>> {
        let number = self.number(key)?;
        if number.value >= 0.0 {
            return Some(number);
        }
        self.context.wrong(number.span, format!("`{key}` must not be negative, found {}", number.value))
    }

    /// A number that is not negative, or `default` where the key is left out.
    pub fn non_negative_or(&self, key: &str, default: f64) -> Option<f64> {
        Some(self.optional(key, |_, _| self.non_negative(key))?.map_or(default, |number| number.value))
    }

    /// A whole number in a range, or `default` where the key is left out.
    pub fn whole_or(&self, key: &str, range: RangeInclusive<usize>, default: usize) -> Option<usize> {
        let whole = self.optional(key, |context, item| context.whole(item, *range.start(), *range.end()));
        Some(whole?.map_or(default, |number| number.value))
    }

    /// A vector of N numbers.
    pub fn vector<const N: usize>(&self, key: &str) -> Option<Spanned<[f64; N]>> {
        self.context.vector(self.get(key)?)
    }

    /// A vector of N numbers, or `default` where the key is left out.
    pub fn vector_or<const N: usize>(&self, key: &str, default: [f64; N]) -> Option<[f64; N]> {
        Some(self.optional(key, |_, _| self.vector(key))?.map_or(default, |vector| vector.value))
    }

    /// A vector of N numbers, none of which is negative.
    pub fn non_negative_vector<const N: usize>(&self, key: &str) -> Option<Spanned<[f64; N]>> {
        let vector = self.vector(key)?;
        match vector.value.iter().find(|&&value| value < 0.0) {
            Some(value) => self.context.wrong(vector.span, format!("`{key}` must not be negative, found {value}")),
            None => Some(vector),
        }
    }

    /// A vector of N numbers, none of which is negative, or `default` where the key is left out.
    pub fn non_negative_vector_or<const N: usize>(&self, key: &str, default: [f64; N]) -> Option<[f64; N]> {
        Some(self.optional(key, |_, _| self.non_negative_vector(key))?.map_or(default, |vector| vector.value))
    }

    /// A text.
    pub fn text(&self, key: &str) -> Option<Spanned<String>> {
        self.context.text(self.get(key)?)
    }

    /// A text that must be there.
    pub fn required_text(&self, key: &str) -> Option<Spanned<String>> {
        self.context.text(self.required(key)?)
    }

    /// True or false.
    pub fn flag(&self, key: &str) -> Option<bool> {
        let item = self.get(key)?;
        match item.get_ref() {
            DeValue::Boolean(value) => Some(*value),
            other => {
                self.context.wrong(item.span(), format!("`{key}` must be true or false, found {}", kind_of(other)))
            }
        }
    }

    /// True or false, or `default` where the key is left out.
    pub fn flag_or(&self, key: &str, default: bool) -> Option<bool> {
        Some(self.optional(key, |_, _| self.flag(key))?.unwrap_or(default))
    }
}

/// One list of keys from several.
pub const fn joined<const N: usize>(lists: &[&[&'static str]]) -> [&'static str; N] {
    let mut all = [""; N];
    let mut count = 0;
    let mut list = 0;
    while list < lists.len() {
        let mut key = 0;
        while key < lists[list].len() {
            all[count] = lists[list][key];
            count += 1;
            key += 1;
        }
        list += 1;
    }
    assert!(count == N, "the length of the joined list");
    all
}
