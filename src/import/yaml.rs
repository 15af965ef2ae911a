//! Trees of YAML files: lists, maps and scalars, each with its place. An alias is the node that it
//! names, not a copy, so that few lines cannot become a large tree.

use super::lines::ImportError;
use saphyr_parser::{Event, Parser, ScanError, Span};
use std::cell::Cell;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

/// Lists and maps within one another, at most
const DEEPEST: usize = 64;

/// A node with its place in the file.
#[derive(Debug)]
pub struct Node {
    /// Line and column from 1
    at: [usize; 2],
    value: Value,
    /// Lists and maps within one another, aliases included
    depth: usize,
}

#[derive(Debug)]
enum Value {
    Scalar(String),
    List(Vec<Rc<Node>>),
    Map(Vec<Entry>),
}

/// A key of a map with its value.
#[derive(Debug)]
struct Entry {
    key: String,
    /// Line and column of the key
    at: [usize; 2],
    node: Rc<Node>,
    /// True once the value was asked for
    is_read: Cell<bool>,
}

/// A list or map whose end has not come yet.
struct Open {
    anchor: usize,
    at: [usize; 2],
    value: Value,
    /// The key whose value comes next, with its place
    key: Option<(String, [usize; 2])>,
    /// All keys so far
    keys: HashSet<String>,
    /// The depth of the deepest node in it
    depth: usize,
}

/// A file of YAML.
pub struct Yaml<'t> {
    file: &'t str,
    root: Rc<Node>,
}

impl<'t> Yaml<'t> {
    /// Reads the document that is the text of a file with this name.
    pub fn new(file: &'t str, text: &str) -> Result<Self, ImportError> {
        let mut tree = Tree { file, open: Vec::new(), anchors: HashMap::new(), root: None };
        let mut parser = Parser::new_from_str(text);
        while let Some(found) = parser.next_event() {
            let (event, span) = found.map_err(|error| scan_error(file, &error))?;
            tree.take(event, span)?;
        }
        let empty = || ImportError { file: file.into(), at: None, message: "this file of YAML is empty".into() };
        Ok(Self { file, root: tree.root.ok_or_else(empty)? })
    }

    /// The outermost node.
    pub fn root(&self) -> &Node {
        &self.root
    }

    /// An error at a node.
    pub fn error(&self, at: &Node, message: impl Into<String>) -> ImportError {
        ImportError { file: self.file.into(), at: Some(at.at), message: message.into() }
    }

    /// Keys that nobody asked for, in maps that were read, each with its path and line.
    pub fn unread(&self) -> Vec<String> {
        let mut found = Vec::new();
        self.root.unread("", &mut found);
        found
    }

    /// The node at the end of a path of keys, if all of them are there.
    pub fn find<'n>(&self, from: &'n Node, path: &[&str]) -> Option<&'n Node> {
        path.iter().try_fold(from, |node, key| node.get(key))
    }

    /// The value of a key of a map.
    pub fn need<'n>(&self, from: &'n Node, key: &str) -> Result<&'n Node, ImportError> {
        from.get(key).ok_or_else(|| self.error(from, format!("there is no `{key}` here")))
    }

    /// The items of a list.
    pub fn items<'n>(&self, node: &'n Node, of: &str) -> Result<&'n [Rc<Node>], ImportError> {
        match &node.value {
            Value::List(items) => Ok(items),
            Value::Scalar(_) | Value::Map(_) => Err(self.error(node, format!("{of} must be a list"))),
        }
    }

    /// A list of numbers.
    pub fn numbers(&self, node: &Node, of: &str) -> Result<Vec<f64>, ImportError> {
        self.items(node, of)?.iter().map(|item| self.number(item, of)).collect()
    }

    fn number(&self, node: &Node, of: &str) -> Result<f64, ImportError> {
        let number = match &node.value {
            Value::Scalar(text) => text.parse::<f64>().ok().filter(|number| number.is_finite()),
            Value::List(_) | Value::Map(_) => None,
        };
        number.ok_or_else(|| self.error(node, format!("{of} must be numbers")))
    }
}

impl Node {
    /// Line in the file, from 1.
    pub fn line(&self) -> usize {
        self.at[0]
    }

    /// The value of a key, if this is a map that has it.
    pub fn get(&self, key: &str) -> Option<&Node> {
        match &self.value {
            Value::Map(entries) => {
                let entry = entries.iter().find(|entry| entry.key == key)?;
                entry.is_read.set(true);
                Some(&entry.node)
            }
            Value::Scalar(_) | Value::List(_) => None,
        }
    }

    fn unread(&self, path: &str, found: &mut Vec<String>) {
        let Value::Map(entries) = &self.value else { return };
        for Entry { key, at, node, is_read } in entries {
            if is_read.get() {
                node.unread(&format!("{path}{key}."), found);
            } else {
                found.push(format!("`{path}{key}` (line {})", at[0]));
            }
        }
    }

    /// The text of a scalar.
    pub fn text(&self) -> Option<&str> {
        match &self.value {
            Value::Scalar(text) => Some(text),
            Value::List(_) | Value::Map(_) => None,
        }
    }
}

/// A tree that is being read.
struct Tree<'t> {
    file: &'t str,
    open: Vec<Open>,
    anchors: HashMap<usize, Rc<Node>>,
    root: Option<Rc<Node>>,
}

impl Tree<'_> {
    fn take(&mut self, event: Event, span: Span) -> Result<(), ImportError> {
        let at = place(span);
        match event {
            Event::DocumentStart(_) if self.root.is_some() => Err(self.error(at, "a second document begins here")),
            Event::Nothing | Event::StreamStart | Event::StreamEnd | Event::DocumentStart(_) | Event::DocumentEnd => {
                Ok(())
            }
            Event::SequenceStart(anchor, _) => self.begin(anchor, at, Value::List(Vec::new())),
            Event::MappingStart(anchor, _) => self.begin(anchor, at, Value::Map(Vec::new())),
            Event::SequenceEnd | Event::MappingEnd => match self.open.pop() {
                None => Ok(()),
                Some(Open { anchor, at, value, depth, .. }) => {
                    self.add(anchor, Rc::new(Node { at, value, depth: depth + 1 }))
                }
            },
            Event::Scalar(text, _, anchor, _) => {
                self.add(anchor, Rc::new(Node { at, value: Value::Scalar(text.into_owned()), depth: 0 }))
            }
            Event::Alias(anchor) => match self.anchors.get(&anchor).cloned() {
                Some(node) => self.add(0, node),
                None => Err(self.error(at, "this alias names a part that has not ended yet")),
            },
        }
    }

    fn begin(&mut self, anchor: usize, at: [usize; 2], value: Value) -> Result<(), ImportError> {
        if self.open.len() == DEEPEST {
            return Err(self.too_deep(at));
        }
        self.open.push(Open { anchor, at, value, key: None, keys: HashSet::new(), depth: 0 });
        Ok(())
    }

    /// Adds a complete node to the list or map around it.
    fn add(&mut self, anchor: usize, node: Rc<Node>) -> Result<(), ImportError> {
        if anchor > 0 {
            self.anchors.insert(anchor, node.clone());
        }
        if node.depth > DEEPEST {
            return Err(self.too_deep(node.at));
        }
        let Some(Open { value, key, keys, depth, .. }) = self.open.last_mut() else {
            self.root = Some(node);
            return Ok(());
        };
        *depth = node.depth.max(*depth);
        match value {
            Value::List(items) => items.push(node),
            Value::Map(entries) => match key.take() {
                Some((key, at)) => entries.push(Entry { key, at, node, is_read: Cell::new(false) }),
                None => {
                    let name = node.text().map(str::to_string);
                    let Some(name) = name else { return Err(self.error(node.at, "a key must be a word")) };
                    if name == "<<" {
                        return Err(self.error(node.at, "merge keys (`<<`) are not supported: write the keys here"));
                    }
                    if !keys.insert(name.clone()) {
                        return Err(self.error(node.at, &format!("the key `{name}` is given twice")));
                    }
                    *key = Some((name, node.at));
                }
            },
            Value::Scalar(_) => {}
        }
        Ok(())
    }

    fn too_deep(&self, at: [usize; 2]) -> ImportError {
        self.error(at, &format!("more than {DEEPEST} lists and maps within one another"))
    }

    fn error(&self, at: [usize; 2], message: &str) -> ImportError {
        ImportError { file: self.file.into(), at: Some(at), message: message.into() }
    }
}

/// Line and column from 1 at which a part of the text begins.
fn place(span: Span) -> [usize; 2] {
    [span.start.line(), span.start.col() + 1]
}

fn scan_error(file: &str, error: &ScanError) -> ImportError {
    let at = [error.marker().line(), error.marker().col() + 1];
    ImportError { file: file.into(), at: Some(at), message: format!("this is no YAML: {}", error.info()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(text: &str, path: &[&str]) -> Result<Vec<f64>, String> {
        let yaml = Yaml::new("a.yaml", text).map_err(|error| error.to_string())?;
        let node = yaml.find(yaml.root(), path).ok_or("no such path")?;
        yaml.numbers(node, "`x`").map_err(|error| error.to_string())
    }

    #[test]
    fn lists_in_both_styles_and_aliases_are_read() {
        let text = "a: &x [1, 2.e+1, -.5]\nb:\n  c: *x\n  d:\n    - 1e3\n    - 2\n";
        assert_eq!(numbers(text, &["b", "c"]).unwrap(), [1.0, 20.0, -0.5]);
        assert_eq!(numbers(text, &["b", "d"]).unwrap(), [1000.0, 2.0]);
    }

    #[test]
    fn faults_have_their_place() {
        for (text, message) in [
            ("a: [1, x]", "a.yaml:1:8: `x` must be numbers"),
            ("a: [1, .inf]", "a.yaml:1:8: `x` must be numbers"),
            ("a: 1\nb: 2\na: 3\n", "a.yaml:3:1: the key `a` is given twice"),
            ("a: *b\n", "a.yaml:1:4: this is no YAML: while parsing node, found unknown anchor"),
            ("a: &b [*b]\n", "a.yaml:1:8: this alias names a part that has not ended yet"),
            ("", "a.yaml: this file of YAML is empty"),
            ("? [1]\n: 2\n", "a.yaml:1:3: a key must be a word"),
            ("a: [1]\n---\na: [2]\n", "a.yaml:2:1: a second document begins here"),
            ("b: &b {a: [1]}\n<<: *b\n", "a.yaml:2:1: merge keys (`<<`) are not supported: write the keys here"),
        ] {
            assert_eq!(numbers(text, &["a"]).unwrap_err(), message, "{text}");
        }
        assert!(numbers(&"[".repeat(100), &["a"]).unwrap_err().contains("within one another"));
        assert!(numbers(&"[".repeat(100_000), &["a"]).is_err());
        let by_aliases = (0..100_000).map(|k| format!("- &a{} [*a{k}]\n", k + 1)).collect::<String>();
        assert!(numbers(&format!("- &a0 [1]\n{by_aliases}"), &["a"]).unwrap_err().contains("within one another"));
    }
}
