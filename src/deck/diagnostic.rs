//! Errors and warnings of a deck with their places, and help.

use super::shown::{shown_in_line, shown_in_place};
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use beamsim_core::warning::WarningKind;
use std::ops::Range;

/// A range of bytes in the deck.
pub type Span = Range<usize>;

/// A value with the place it was read from.
#[derive(Clone, Debug, PartialEq)]
pub struct Spanned<T> {
    /// The value
    pub value: T,
    /// Its place in the text
    pub span: Span,
}

impl<T> Spanned<T> {
    /// Replaces the value and keeps the place.
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Spanned<U> {
        Spanned { value: f(self.value), span: self.span }
    }
}

/// One error or warning.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// The message
    pub message: String,
    /// Its place; none: the deck as a whole
    pub span: Option<Span>,
    /// Text at the caret
    pub(super) label: String,
    /// Another place that it refers to, with a label
    pub(super) context: Option<(Span, String)>,
    /// Advice
    pub help: Option<String>,
    /// Severity
    pub(crate) severity: Severity,
    /// The unknown name, for errors about one
    pub(crate) unknown: Option<String>,
    /// True for an error about a key that the table does not have
    pub(crate) is_of_key: bool,
}

/// Severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The run goes on.
    Warning(WarningKind),
    /// Something in the text
    Error,
    /// Larger than the stated bounds
    Limit,
    /// A file that the deck names could not be read
    File,
}

impl Diagnostic {
    /// An error at a place.
    pub fn error(message: impl Into<String>, span: Span) -> Self {
        Self {
            message: message.into(),
            span: Some(span),
            label: String::new(),
            context: None,
            help: None,
            severity: Severity::Error,
            unknown: None,
            is_of_key: false,
        }
    }

    /// An error of the deck as a whole.
    pub fn whole(message: impl Into<String>) -> Self {
        Self { span: None, ..Self::error(message, 0..0) }
    }

    /// A warning at a place.
    pub fn warning(kind: WarningKind, message: impl Into<String>, span: Span) -> Self {
        Self { severity: Severity::Warning(kind), ..Self::error(message, span) }
    }

    /// A number beyond the stated bounds.
    pub fn limit(message: impl Into<String>, span: Span) -> Self {
        Self { severity: Severity::Limit, ..Self::error(message, span) }
    }

    /// True for warnings: the run goes on.
    pub fn is_warning(&self) -> bool {
        matches!(self.severity, Severity::Warning(_))
    }

    /// Sets the text at the caret.
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    /// Sets the advice.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Sets another place.
    pub fn context(mut self, span: Span, label: impl Into<String>) -> Self {
        self.context = Some((span, label.into()));
        self
    }

    /// The diagnostic as text, with the lines it speaks of. Characters of the deck that would control
    /// a terminal are escaped.
    pub fn render(&self, path: &str, text: &str, styled: bool) -> String {
        let text = &*shown_in_place(text);
        let path = &*shown_in_line(path);
        let message = &*shown_in_line(&self.message);
        let title = match self.severity {
            Severity::Warning(kind) => Level::WARNING.primary_title(message).id(kind.name()),
            Severity::Error | Severity::Limit | Severity::File => Level::ERROR.primary_title(message),
        };
        let mut group = match &self.span {
            Some(span) => {
                let mut snippet = Snippet::source(text).path(path);
                let mut primary = AnnotationKind::Primary.span(within(span, text));
                if !self.label.is_empty() {
                    primary = primary.label(&self.label);
                }
                snippet = snippet.annotation(primary);
                if let Some((span, label)) = &self.context {
                    snippet = snippet.annotation(AnnotationKind::Context.span(within(span, text)).label(label));
                }
                title.element(snippet)
            }
            None => Group::with_title(title),
        };
        if let Some(help) = &self.help {
            group = group.element(Level::HELP.message(shown_in_line(help)));
        }
        let renderer = if styled { Renderer::styled() } else { Renderer::plain() };
        renderer.render(&[group])
    }
}

/// Cuts a span to one that lies in the text, on character boundaries.
fn within(span: &Span, text: &str) -> Span {
    let clamp = |mut at: usize| {
        at = at.min(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    let start = clamp(span.start);
    start..clamp(span.end).max(start)
}

/// `a`, `b` or `c`
pub fn one_of<'a>(words: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = words.into_iter().map(|w| format!("`{w}`")).collect();
    match quoted.split_last() {
        None => "nothing".into(),
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
    }
}
