//! What is said of each key: the JSON Schema of the deck, which is the one source of words about keys.

use super::hints::nearest;
use serde_json::Value;

/// The JSON Schema (draft 7).
pub const SCHEMA: &str = include_str!("schema.json");

/// A key, or a table, of the deck.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// `beam.elements`
    pub path: String,
    /// Where it stands: `[[beam]]`, `the deck`
    pub table: String,
    /// What it means
    pub description: String,
    /// What it takes
    pub kinds: String,
    /// Its unit, where it has one
    pub unit: Option<String>,
    /// What it is where it is left out, as TOML
    pub default: Option<String>,
    /// As TOML
    pub examples: Vec<String>,
    /// Keys of a table
    pub keys: Vec<String>,
    /// Whether its table needs it
    pub required: bool,
}

/// What is known of a word: a key (`elements`, in all tables that have it), `beam.elements`, or a table (`[[beam]]`, `beam`).
/// `Err` with what was probably meant.
pub fn explain(word: &str) -> Result<Vec<Entry>, Option<String>> {
    let path = word.trim().trim_matches(['[', ']']).replace(".NAME", "");
    let all = entries();
    if path == "deck" {
        return Ok(vec![whole()]);
    }
    let exact: Vec<Entry> = all.iter().filter(|entry| entry.path == path).cloned().collect();
    if !exact.is_empty() {
        return Ok(exact);
    }
    let below = format!(".{path}");
    let found: Vec<Entry> = all.iter().filter(|entry| entry.path.ends_with(&below)).cloned().collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let keys = all.iter().filter_map(|entry| entry.path.rsplit('.').next());
    let known: Vec<&str> = all.iter().map(|entry| entry.path.as_str()).chain(keys).collect();
    Err(nearest(&path, known).map(str::to_string))
}

/// The deck itself, whose keys are its tables.
fn whole() -> Entry {
    let schema: Value = serde_json::from_str(SCHEMA).unwrap_or_default();
    let keys = schema["properties"].as_object().map_or(Vec::new(), |keys| keys.keys().cloned().collect());
    Entry { examples: Vec::new(), keys, ..entry(&schema, &schema, "deck", "a file", false) }
}

/// Every table and key, in the order of the schema.
pub fn entries() -> Vec<Entry> {
    let schema: Value = serde_json::from_str(SCHEMA).unwrap_or_default();
    let mut all = Vec::new();
    walk(&schema, "", "the deck", &mut all);
    all
}

/// The keys of a table, and of the tables in it.
fn walk(table: &Value, path: &str, name: &str, all: &mut Vec<Entry>) {
    let Some(properties) = table["properties"].as_object() else { return };
    for (key, node) in properties {
        let below = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let (inner, inner_name) = inside(node, &below, key);
        let required = table["required"].as_array().is_some_and(|keys| keys.iter().any(|k| k == key));
        all.push(entry(node, inner, &below, name, required));
        walk(inner, &below, &inner_name, all);
    }
}

/// The table that a key holds, or the one of which it holds several; and what that is called.
fn inside<'a>(node: &'a Value, path: &str, key: &str) -> (&'a Value, String) {
    let top = !path.contains('.');
    match () {
        () if node["items"]["properties"].is_object() => (&node["items"], format!("[[{key}]]")),
        () if node["additionalProperties"]["properties"].is_object() => {
            (&node["additionalProperties"], format!("[{key}.NAME]"))
        }
        () if top => (node, format!("[{key}]")),
        () => (node, format!("`{path}`")),
    }
}

fn entry(node: &Value, inner: &Value, path: &str, table: &str, required: bool) -> Entry {
    let text = |of: &Value, key: &str| of[key].as_str().map(str::to_string);
    let mut description = text(node, "description").unwrap_or_default();
    if !std::ptr::eq(node, inner) {
        description = format!("{description} {}", text(inner, "description").unwrap_or_default());
    }
    let examples = node["examples"].as_array().map_or(&[][..], Vec::as_slice);
    let name = path.rsplit('.').next().unwrap_or(path);
    Entry {
        path: path.into(),
        table: table.into(),
        description: description.trim().into(),
        kinds: kinds(node),
        unit: text(node, "x-unit").filter(|unit| unit != "none"),
        default: node.get("default").map(to_toml),
        examples: examples.iter().map(|example| format!("{name} = {}", to_toml(example))).collect(),
        keys: inner["properties"].as_object().map_or(Vec::new(), |keys| keys.keys().cloned().collect()),
        required,
    }
}

fn kinds(node: &Value) -> String {
    if let Some(words) = node["enum"].as_array() {
        return words.iter().map(to_toml).collect::<Vec<_>>().join(", ");
    }
    let listed = match &node["type"] {
        Value::String(one) => vec![one.as_str()],
        several => several.as_array().map_or(Vec::new(), |all| all.iter().filter_map(Value::as_str).collect()),
    };
    let numeric = listed.iter().any(|kind| ["number", "integer"].contains(kind));
    let word = |kind: &&str| {
        match *kind {
            "integer" => "whole number",
            "string" if numeric => "expression",
            "string" => "text",
            "array" => "list",
            "object" => "table",
            "boolean" => "true or false",
            other => return other.to_string(),
        }
        .to_string()
    };
    listed.iter().map(word).collect::<Vec<_>>().join(", ")
}

/// As it stands in a deck.
fn to_toml(value: &Value) -> String {
    match value {
        Value::Array(all) => format!("[{}]", all.iter().map(to_toml).collect::<Vec<_>>().join(", ")),
        Value::Object(all) => {
            let pairs = all.iter().map(|(key, value)| format!("{key} = {}", to_toml(value)));
            format!("{{ {} }}", pairs.collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck;

    /// The keys that the reader says a table knows.
    fn known(text: &str, table: &str) -> Vec<String> {
        let found = match deck::read(text) {
            Ok((_, found)) | Err(found) => found,
        };
        let help = found.iter().find_map(|d| d.message.contains("zzzzzzzzzzzz").then(|| d.help.clone()).flatten());
        let help = help.unwrap_or_else(|| panic!("{table}: {found:?}"));
        let (_, listed) = help.split_once(" knows ").unwrap();
        let mut keys: Vec<String> = listed.split('`').skip(1).step_by(2).map(str::to_string).collect();
        keys.sort();
        keys
    }

    #[test]
    fn the_schema_has_the_keys_that_the_reader_has() {
        let schema: Value = serde_json::from_str(SCHEMA).unwrap();
        let sorted = |table: &Value| {
            let mut keys: Vec<String> = table["properties"].as_object().unwrap().keys().cloned().collect();
            keys.sort();
            keys
        };
        assert_eq!(known("zzzzzzzzzzzz = 1", ""), sorted(&schema));
        let mut tables = 0;
        for (key, node) in schema["properties"].as_object().unwrap() {
            let (inner, name) = inside(node, key, key);
            if inner["properties"].is_object() {
                let head = name.replace("NAME", "n");
                let kind = if key == "stage" { "kind = \"static\"\n" } else { "" };
                assert_eq!(known(&format!("{head}\n{kind}zzzzzzzzzzzz = 1\n"), &name), sorted(inner), "{name}");
                tables += 1;
            }
        }
        assert!(tables >= 15, "{tables}");
    }

    #[test]
    fn keys_are_explained_wherever_they_stand() {
        let one = |word: &str| explain(word).unwrap().remove(0);
        let elements = one("beam.elements");
        assert_eq!((elements.table.as_str(), elements.unit.as_deref()), ("[[beam]]", None));
        assert!(elements.kinds.contains("whole number") && elements.examples[0] == "elements = 10");
        assert_eq!(one("section.rhoA").unit.as_deref(), Some("mass/length"));
        assert!(one("[[stage]]").keys.contains(&"until".into()) && one("until.below").path == "stage.until.below");
        assert!(["moment", "history"].into_iter().all(|word| explain(word).is_ok_and(|all| !all.is_empty())));
        assert_eq!(explain("elemnts"), Err(Some("elements".into())));
        assert_eq!(explain("qqqqqqqqqqqqqq"), Err(None));
    }

    #[test]
    fn everything_is_described_with_an_example() {
        for entry in entries() {
            assert!(!entry.description.is_empty() && !entry.examples.is_empty(), "{}", entry.path);
        }
    }
}
