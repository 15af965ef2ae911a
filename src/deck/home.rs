//! From places in the text with the rows of all tables back to the text of the user, for messages.

use super::files::ImportedTable;
use super::shown::shown_in_line;
use super::{Diagnostic, Span};
use std::ops::Range;

/// The comment at the end of a line that a table has made, before the name of the table.
const FROM: &str = " # from ";

/// Lines of the user one after the other that are missing, at most: `csv` and `column` of a history, and
/// some lines between them.
const MOST_MISSING: usize = 8;

/// The end of a line that a table has made, or one row of it; rows by their lines in the file.
pub(super) fn from_table(path: &str, line: Option<u64>) -> String {
    let row = line.map_or(String::new(), |line| format!(", line {line}"));
    format!("{FROM}{}{row}", shown_in_line(path))
}

/// The lines of a text with the rows of tables, and those of the text of the user.
pub(super) struct Home<'t> {
    own: &'t str,
    whole: &'t str,
    own_lines: Vec<Range<usize>>,
    whole_lines: Vec<Range<usize>>,
    /// The line of the user that each line is, or that it stands for
    origins: Vec<Option<usize>>,
    tables: &'t [ImportedTable],
}

impl<'t> Home<'t> {
    /// For the text of a user and the one with the rows of its tables. Lines keep their order; some
    /// have another value for the same key, some are missing, some new.
    pub(super) fn new(own: &'t str, whole: &'t str, tables: &'t [ImportedTable]) -> Self {
        let (own_lines, whole_lines) = (lines(own), lines(whole));
        let of = |text: &'t str, ranges: &[Range<usize>]| ranges.iter().map(|range| &text[range.clone()]).collect();
        let origins = origins(of(own, &own_lines), of(whole, &whole_lines));
        Self { own, whole, own_lines, whole_lines, origins, tables }
    }

    /// A message about the text of the user.
    pub(super) fn of(&self, mut diagnostic: Diagnostic) -> Diagnostic {
        if let Some(span) = &diagnostic.span {
            let (place, label) = self.place(span);
            diagnostic.span = place;
            if diagnostic.label.is_empty() {
                diagnostic.label = label;
            }
        }
        diagnostic.context = diagnostic.context.and_then(|(span, label)| Some((self.place(&span).0?, label)));
        diagnostic
    }

    /// A place of the user, and what to say of it.
    fn place(&self, span: &Span) -> (Option<Span>, String) {
        let number = self.whole_lines.partition_point(|line| line.end < span.start).min(self.whole_lines.len() - 1);
        let line = &self.whole_lines[number];
        let Some(origin) = self.origins[number] else { return self.maker(number) };
        let own_line = self.own_lines[origin].clone();
        if self.own[own_line.clone()] == self.whole[line.clone()] {
            let start = own_line.start + (span.start - line.start);
            return (Some(start..start + span.len()), String::new());
        }
        match self.tables.iter().find_map(|table| self.name_in(own_line.clone(), &table.name)) {
            Some(place) => (Some(place), "in this table".into()),
            None => (Some(own_line), String::new()),
        }
    }

    /// The name of the table that has made a line, and of its row where it is one.
    fn maker(&self, number: usize) -> (Option<Span>, String) {
        let comment = |number: &usize| {
            let line = &self.whole[self.whole_lines[*number].clone()];
            line.rsplit_once(FROM).map(|(_, comment)| comment)
        };
        let made = (0..=number).rev().take_while(|&number| self.origins[number].is_none());
        let Some(comment) = made.into_iter().find_map(|number| comment(&number)) else {
            return (None, String::new());
        };
        let tables = self.tables.iter();
        let found = tables
            .filter_map(|table| Some((table, comment.strip_prefix(&*shown_in_line(&table.name))?)))
            .find(|(_, row)| row.is_empty() || row.starts_with(", line "));
        let Some((table, row)) = found else { return (None, String::new()) };
        let label = match row.strip_prefix(", ") {
            Some(row) => format!("{row} of this table"),
            None => "in this table".into(),
        };
        // One file may be named in several places.
        let before = self.origins[..number].iter().rev().find_map(|origin| *origin);
        let from = before.map_or(0, |origin| self.own_lines[origin].start);
        let nearest = self.name_in(from..self.own.len(), &table.name);
        (nearest.or_else(|| self.name_in(0..self.own.len(), &table.name)), label)
    }

    /// The place of the name of a file within a part of the text of the user.
    fn name_in(&self, part: Range<usize>, name: &str) -> Option<Span> {
        let start = part.start + self.own[part].find(&format!("\"{name}\""))? + 1;
        Some(start..start + name.len())
    }
}

/// The line of the user that each line of the whole is, or whose key it has.
fn origins(own: Vec<&str>, whole: Vec<&str>) -> Vec<Option<usize>> {
    let key = |line: &str| line.split_once('=').map(|(key, _)| key.trim().to_string());
    let mut next = 0;
    let mut origins = Vec::with_capacity(whole.len());
    for line in whole {
        let is_same = |number: usize| own.get(number).is_some_and(|own| *own == line);
        let has_key = |number: usize| own.get(number).is_some_and(|own| key(own).is_some() && key(own) == key(line));
        let is_made = line.contains(FROM);
        let found = if is_same(next) || !is_made && has_key(next) {
            Some(next)
        } else if is_made || line.trim().is_empty() {
            // Empty lines stand before tables that are new, too.
            None
        } else {
            let most = if line.trim_start().starts_with('[') { own.len() } else { MOST_MISSING };
            (next + 1..=next + most).find(|&number| is_same(number))
        };
        next = found.map_or(next, |number| number + 1);
        origins.push(found);
    }
    origins
}

/// The lines of a text without their ends.
fn lines(text: &str) -> Vec<Range<usize>> {
    let mut start = 0;
    let mut lines = Vec::new();
    for line in text.split('\n') {
        lines.push(start..start + line.trim_end_matches('\r').len());
        start += line.len() + 1;
    }
    lines
}
